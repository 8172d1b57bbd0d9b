//! Maps by name: files of the user, generated towns, and generated towns under CARLA's names.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Once,
};

use anyhow::{Context, anyhow};

/// The environment variable that names the folder of maps.
const MAPS_VARIABLE: &str = "OMNIBUS_MAPS";

/// Most bytes of a map's file. The largest maps of cities have about 100 MB.
const MAP_MAX: u64 = 1 << 30;

/// Arguments of `omnibus maps`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MapsArgs {
    /// A folder of OpenDRIVE files; default: OMNIBUS_MAPS
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
}

/// Prints every name that `--map` takes, with the source of the map.
pub(crate) fn list(args: &MapsArgs) -> anyhow::Result<()> {
    let files = files(args.maps.as_deref())?;
    let mut lines: Vec<(String, String)> = Vec::new();
    for name in mapgen::names() {
        let about = mapgen::description(name).unwrap_or_default();
        lines.push((name.to_owned(), format!("generated: {about}")));
    }
    for name in mapgen::carla_names() {
        if file_of(&files, name).is_none() {
            let about = mapgen::description(name).unwrap_or_default();
            lines.push((name.to_owned(), format!("generated, in place of CARLA's: {about}")));
        }
    }
    for file in &files {
        lines.push((display_name(file).to_owned(), file.display().to_string()));
    }
    for (name, origin) in lines {
        print_line!("{name:<20}  {origin}");
    }
    Ok(())
}

/// Finds the maps that a running simulator loads by name.
pub(crate) struct MapLibrary {
    /// The folder of `--maps`.
    pub(crate) folder: Option<PathBuf>,
}

impl sim_host::Maps for MapLibrary {
    fn find(&self, name: &str) -> Result<(String, String), String> {
        // A relative path would be one in the host's folder, of which a client does not know.
        let is_path = Path::new(name).is_absolute();
        let text = find(name, self.folder.as_deref(), is_path).map_err(|e| format!("{e:#}"))?;
        Ok((without_carla_folder(name).to_owned(), text))
    }

    fn names(&self) -> Vec<String> {
        let files = files(self.folder.as_deref()).unwrap_or_default();
        let named = mapgen::names().chain(mapgen::carla_names()).map(str::to_owned);
        let mut names: Vec<String> =
            named.chain(files.iter().map(|file| display_name(file).to_owned())).collect();
        names.sort();
        names.dedup();
        names
    }
}

/// Returns a name without the folder in which CARLA keeps its maps.
fn without_carla_folder(name: &str) -> &str {
    name.rsplit_once("Carla/Maps/").map_or(name, |(_, plain)| plain)
}

/// Returns a name without `.xodr`, unless it is a path: `Town10HD.xodr` means the map `Town10HD`.
fn without_extension(name: &str) -> &str {
    let stem = name.len().checked_sub(5).and_then(|at| name.split_at_checked(at));
    match stem {
        Some((stem, extension))
            if extension.eq_ignore_ascii_case(".xodr") && !stem.contains(['/', '.']) =>
        {
            stem
        }
        _ => name,
    }
}

/// Returns the OpenDRIVE text of a map. In this order: a generated town, a file in the folder of
/// maps, the file at this path, a generated town in place of one of CARLA's.
pub(crate) fn text(name: &str, folder: Option<&Path>) -> anyhow::Result<String> {
    find(name, folder, true)
}

/// Returns the OpenDRIVE text of a map, as [`text`] does; `is_path` says whether a name may be a path.
fn find(name: &str, folder: Option<&Path>, is_path: bool) -> anyhow::Result<String> {
    let name = without_carla_folder(name);
    let is_file = is_path && Path::new(name).is_file();
    let name = if is_file { name } else { without_extension(name) };
    let is_plain = !name.contains(['/', '.']);
    if mapgen::names().any(|own| own.eq_ignore_ascii_case(name)) {
        return mapgen::named(name).with_context(|| format!("map {name}"));
    }
    if is_plain {
        if let Some(file) = file_of(&files(folder)?, name) {
            return read(file);
        }
        if !is_file && let Some(text) = mapgen::named(name) {
            static LOGGED: Once = Once::new();
            LOGGED.call_once(|| {
                let about = mapgen::description(name).unwrap_or_default();
                log::warn!(
                    "{name} is a generated town in place of CARLA's ({about}); to load CARLA's, put \
                     {name}.xodr into a folder and name it by --maps or {MAPS_VARIABLE}"
                );
            });
            return Ok(text);
        }
    }
    let unknown = || {
        let known = mapgen::names().chain(mapgen::carla_names()).collect::<Vec<_>>().join(", ");
        anyhow!("no map is named {name:?}, and there is no such file; the named maps are {known}")
    };
    if !is_path {
        return Err(unknown());
    }
    match read(Path::new(name)) {
        Err(e) if is_plain && is_missing(&e) => Err(unknown()),
        read => read,
    }
}

fn is_missing(e: &anyhow::Error) -> bool {
    e.downcast_ref::<io::Error>().is_some_and(|e| e.kind() == io::ErrorKind::NotFound)
}

fn read(file: &Path) -> anyhow::Result<String> {
    let name = file.display();
    let bytes = bus::read_regular(file, MAP_MAX).with_context(|| format!("map {name}"))?;
    String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        anyhow!("map {name}: byte {at} is not UTF-8; is this an OpenDRIVE file?")
    })
}

/// Returns the OpenDRIVE files in the folder of maps, sorted; none if no folder is given.
fn files(folder: Option<&Path>) -> anyhow::Result<Vec<PathBuf>> {
    let chosen = folder.map(Path::to_path_buf);
    let Some(folder) = chosen.or_else(|| std::env::var_os(MAPS_VARIABLE).map(PathBuf::from)) else {
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

/// Returns the name of the map in a file: the file's stem after a source and two underscores.
fn display_name(file: &Path) -> &str {
    let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    stem.rsplit("__").next().unwrap_or(stem)
}

/// Returns the file of a map, by its stem or by its map's name, with or without CARLA's `_Opt`.
fn file_of<'a>(files: &'a [PathBuf], name: &str) -> Option<&'a Path> {
    let stem = |file: &&PathBuf| file.file_stem().is_some_and(|s| s.eq_ignore_ascii_case(name));
    let end = name.len().saturating_sub(4);
    let is_opt = name.get(end..).is_some_and(|mark| mark.eq_ignore_ascii_case("_opt"));
    let plain = if is_opt { &name[..end] } else { name };
    let named = |file: &&PathBuf| display_name(file).eq_ignore_ascii_case(plain);
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
    fn a_file_of_the_user_replaces_a_town_in_place_of_carla_s_but_not_a_generated_town() {
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
    fn the_folder_of_carla_s_maps_is_ignored_in_a_name() {
        let folder = folder("prefix", &[]);
        for spelling in ["Carla/Maps/Town02", "/Game/Carla/Maps/Town02", "Town02_Opt"] {
            assert_eq!(text(spelling, Some(&folder)).unwrap(), mapgen::named("Town02").unwrap());
        }
        assert!(text("Town10HD_Opt", Some(&folder)).is_ok());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_name_with_and_without_its_extension_is_the_same_map() {
        let folder = folder("extension", &["Town04.xodr"]);
        let text = |name: &str| super::text(name, Some(&folder)).unwrap();
        for name in ["Town10HD", "Town04", "Millbrook"] {
            assert_eq!(text(&format!("{name}.xodr")), text(name));
        }
        assert_eq!(text("town04.XODR"), "Town04.xodr");
        let error = super::text("Town99.xodr", Some(&folder)).unwrap_err().to_string();
        assert!(error.contains("no map is named \"Town99\""), "{error}");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_missing_map_file_or_folder_is_named() {
        let folder = folder("none", &[]);
        let error_of = |name: &str| format!("{:#}", text(name, Some(&folder)).unwrap_err());
        assert!(
            error_of("Town99").contains("no map is named \"Town99\""),
            "{}",
            error_of("Town99")
        );
        assert!(error_of("a/b.xodr").starts_with("map a/b.xodr"), "{}", error_of("a/b.xodr"));
        fs::remove_dir_all(&folder).unwrap();
        assert!(error_of("Town04").contains("folder of maps"), "{}", error_of("Town04"));
    }
}
