//! Maps by name: files of the user's, towns of our own, and towns of our own under CARLA's names.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Once,
};

use anyhow::{Context, anyhow};

/// Where else the user keeps maps.
const VARIABLE: &str = "OMNIBUS_MAPS";

/// What `omnibus maps` takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MapsArgs {
    /// A folder of OpenDRIVE files; else the one that OMNIBUS_MAPS names
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
}

/// Prints every name that `--map` takes, and where the map comes from.
pub(crate) fn list(args: &MapsArgs) -> anyhow::Result<()> {
    let files = files(args.maps.as_deref())?;
    let mut lines: Vec<(String, String)> = Vec::new();
    for name in mapgen::names() {
        let about = mapgen::description(name).unwrap_or_default();
        lines.push((name.to_owned(), format!("ours: {about}")));
    }
    for name in mapgen::carla_names() {
        if file_of(&files, name).is_none() {
            let about = mapgen::description(name).unwrap_or_default();
            lines.push((name.to_owned(), format!("ours, in place of CARLA's: {about}")));
        }
    }
    for file in &files {
        lines.push((called(file).to_owned(), file.display().to_string()));
    }
    for (name, origin) in lines {
        say!("{name:<20}  {origin}");
    }
    Ok(())
}

/// Where a simulator that runs finds other maps.
pub(crate) struct Shelf {
    /// What `--maps` says.
    pub(crate) folder: Option<PathBuf>,
}

impl sim_host::Maps for Shelf {
    fn find(&self, name: &str) -> Result<(String, String), String> {
        let text = text(name, self.folder.as_deref()).map_err(|e| format!("{e:#}"))?;
        Ok((plain(name).to_owned(), text))
    }

    fn names(&self) -> Vec<String> {
        let files = files(self.folder.as_deref()).unwrap_or_default();
        let named = mapgen::names().chain(mapgen::carla_names()).map(str::to_owned);
        let mut names: Vec<String> =
            named.chain(files.iter().map(|file| called(file).to_owned())).collect();
        names.sort();
        names.dedup();
        names
    }
}

/// A name without the folder that CARLA keeps its maps in.
fn plain(name: &str) -> &str {
    name.rsplit_once("Carla/Maps/").map_or(name, |(_, plain)| plain)
}

/// The text of a map: of a town of our own, of a file in the folder of maps, of a file; and where
/// nothing else has one of CARLA's names, of a town of our own of the same kind.
pub(crate) fn text(name: &str, folder: Option<&Path>) -> anyhow::Result<String> {
    let name = plain(name);
    let is_plain = !name.contains(['/', '.']);
    if mapgen::names().any(|own| own.eq_ignore_ascii_case(name)) {
        return mapgen::named(name).with_context(|| format!("map {name}"));
    }
    if is_plain {
        if let Some(file) = file_of(&files(folder)?, name) {
            return read(file);
        }
        if !Path::new(name).is_file()
            && let Some(text) = mapgen::named(name)
        {
            static SAID: Once = Once::new();
            SAID.call_once(|| {
                let about = mapgen::description(name).unwrap_or_default();
                eprintln!(
                    "omnibus: {name} is a town of our own in place of CARLA's ({about}); CARLA's \
                     is loaded from a folder with {name}.xodr, named by --maps or {VARIABLE}"
                );
            });
            return Ok(text);
        }
    }
    match read(Path::new(name)) {
        Err(e) if is_plain && is_missing(&e) => {
            let known = mapgen::names().chain(mapgen::carla_names()).collect::<Vec<_>>().join(", ");
            Err(anyhow!("no map is named {name:?} and no file is; there are {known}"))
        }
        read => read,
    }
}

fn is_missing(e: &anyhow::Error) -> bool {
    e.downcast_ref::<io::Error>().is_some_and(|e| e.kind() == io::ErrorKind::NotFound)
}

fn read(file: &Path) -> anyhow::Result<String> {
    let name = file.display();
    let bytes = fs::read(file).with_context(|| format!("map {name}"))?;
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        anyhow!("map {name}: byte {at} is not UTF-8; is this an OpenDRIVE file?")
    })
}

/// Every OpenDRIVE file in the folder of maps, by name; none where no folder is named.
fn files(folder: Option<&Path>) -> anyhow::Result<Vec<PathBuf>> {
    let told = folder.map(Path::to_path_buf);
    let Some(folder) = told.or_else(|| std::env::var_os(VARIABLE).map(PathBuf::from)) else {
        return Ok(Vec::new());
    };
    let entries =
        fs::read_dir(&folder).with_context(|| format!("folder of maps {}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xodr")))
        .collect();
    files.sort();
    Ok(files)
}

/// What a file's map is called: what its name says after a source and two underscores.
fn called(file: &Path) -> &str {
    let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    stem.rsplit("__").next().unwrap_or(stem)
}

/// The file of a map, by its whole name or what it is called, with or without CARLA's `_Opt`.
fn file_of<'a>(files: &'a [PathBuf], name: &str) -> Option<&'a Path> {
    let stem = |file: &&PathBuf| file.file_stem().is_some_and(|s| s.eq_ignore_ascii_case(name));
    let end = name.len().saturating_sub(4);
    let is_opt = name.get(end..).is_some_and(|mark| mark.eq_ignore_ascii_case("_opt"));
    let plain = if is_opt { &name[..end] } else { name };
    let named = |file: &&PathBuf| called(file).eq_ignore_ascii_case(plain);
    files.iter().find(stem).or_else(|| files.iter().find(named)).map(PathBuf::as_path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str, files: &[&str]) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("omnibus-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        files.iter().for_each(|file| fs::write(folder.join(file), *file).unwrap());
        folder
    }

    #[test]
    fn a_file_of_the_user_s_goes_before_a_look_alike_but_not_before_our_own_towns() {
        let folder =
            folder("maps", &["carla__Town04.xodr", "Town03.xodr", "Millbrook.xodr", "b.txt"]);
        let text = |name: &str| super::text(name, Some(&folder)).unwrap();
        assert_eq!(text("Town04"), "carla__Town04.xodr");
        assert_eq!(text("town04_opt"), "carla__Town04.xodr");
        assert_eq!(text("Town04_Opt"), "carla__Town04.xodr");
        assert_eq!(text("carla__Town04"), "carla__Town04.xodr");
        assert_eq!(text("Town03"), "Town03.xodr");
        assert_eq!(text("Town05"), mapgen::named("Town05").unwrap());
        assert_eq!(text("Millbrook"), mapgen::named("Millbrook").unwrap());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn carla_s_folder_in_front_of_a_name_says_nothing() {
        let folder = folder("prefix", &[]);
        for spelling in ["Carla/Maps/Town02", "/Game/Carla/Maps/Town02", "Town02_Opt"] {
            assert_eq!(text(spelling, Some(&folder)).unwrap(), mapgen::named("Town02").unwrap());
        }
        assert!(text("Town10HD_Opt", Some(&folder)).is_ok());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_is_not_there_is_said() {
        let folder = folder("none", &[]);
        let said = |name: &str| format!("{:#}", text(name, Some(&folder)).unwrap_err());
        assert!(said("Town99").contains("no map is named \"Town99\""), "{}", said("Town99"));
        assert!(said("a/b.xodr").starts_with("map a/b.xodr"), "{}", said("a/b.xodr"));
        fs::remove_dir_all(&folder).unwrap();
        assert!(said("Town04").contains("folder of maps"), "{}", said("Town04"));
    }
}
