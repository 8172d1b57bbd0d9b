//! Maps by name: files of the user, generated towns, and generated towns under CARLA's names.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Once,
};

#[cfg(test)]
mod tests;

/// The environment variable that names the folder of maps.
pub const MAPS_VARIABLE: &str = "OMNIBUS_MAPS";

/// Most bytes of a map's file. The largest maps of cities have about 100 MB.
const MAP_MAX: u64 = 1 << 30;

/// Why the text of a map cannot be found.
#[derive(Debug, thiserror::Error)]
pub enum FindError {
    /// No map has this name.
    #[error(
        "no map is named {name:?}, and there is no such file; the named maps are {known}, and towns \
         by character and seed, such as old-town-7"
    )]
    Unknown {
        /// The name.
        name: String,
        /// The names that are known.
        known: String,
    },
    /// The file cannot be read.
    #[error("map {}: {why}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        why: io::Error,
    },
    /// The file is no text.
    #[error("map {}: byte {byte} is not UTF-8; is this an OpenDRIVE file?", .path.display())]
    NoText {
        /// The file.
        path: PathBuf,
        /// Where the text ends.
        byte: usize,
    },
    /// The folder of maps cannot be read.
    #[error("folder of maps {}: {why}", .path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The reason.
        why: io::Error,
    },
}

/// Returns a name without the folder in which CARLA keeps its maps.
pub fn without_carla_folder(name: &str) -> &str {
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
/// maps, the file at this path, a town generated from a character and a seed (`old-town-7`), a generated
/// town in place of one of CARLA's. The folder is `folder`,
/// else that of [`MAPS_VARIABLE`].
///
/// # Errors
/// [`FindError`] with the name or the file.
pub fn text(name: &str, folder: Option<&Path>) -> Result<String, FindError> {
    find(name, folder, true)
}

/// Returns the OpenDRIVE text of a map, as [`text`] does; `is_path` says whether a name may be a path.
///
/// # Errors
/// [`FindError`] with the name or the file.
pub fn find(name: &str, folder: Option<&Path>, is_path: bool) -> Result<String, FindError> {
    let name = without_carla_folder(name);
    let is_file = is_path && Path::new(name).is_file();
    let name = if is_file { name } else { without_extension(name) };
    let is_plain = !name.contains(['/', '.']);
    if mapgen::names().any(|own| own.eq_ignore_ascii_case(name))
        && let Some(text) = mapgen::named(name)
    {
        return Ok(text);
    }
    if is_plain {
        if let Some(file) = file_of(&files(folder)?, name) {
            return read(file).map_err(|why| why.of(file));
        }
        if !is_file && let Some(text) = of_seed(name) {
            return Ok(text);
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
        FindError::Unknown { name: name.to_owned(), known }
    };
    if !is_path {
        return Err(unknown());
    }
    let file = Path::new(name);
    read(file).map_err(|why| match &why {
        ReadError::Io(e) if is_plain && e.kind() == io::ErrorKind::NotFound => unknown(),
        _ => why.of(file),
    })
}

/// Returns the generated town of a name such as `old-town-7`: a character and a seed, in the default
/// size; the text that `omnibus map generate --character old-town --seed 7` writes.
fn of_seed(name: &str) -> Option<String> {
    let (character, seed) = name.rsplit_once('-')?;
    let character = mapgen::Character::by_name(character)?;
    // One town has one name: no sign and no leading zero.
    let seed: u64 = seed.parse().ok().filter(|number: &u64| number.to_string() == seed)?;
    let (size_m, relief_m) = character.default_size_and_relief_m();
    let plan = mapgen::Plan { name: name.to_owned(), seed, size_m, character, relief_m };
    Some(mapgen::generate(&plan))
}

enum ReadError {
    Io(io::Error),
    NoText(usize),
}

impl ReadError {
    fn of(self, file: &Path) -> FindError {
        let path = file.to_owned();
        match self {
            ReadError::Io(why) => FindError::File { path, why },
            ReadError::NoText(byte) => FindError::NoText { path, byte },
        }
    }
}

fn read(file: &Path) -> Result<String, ReadError> {
    let bytes = bus::read_regular(file, MAP_MAX).map_err(ReadError::Io)?;
    String::from_utf8(bytes).map_err(|e| ReadError::NoText(e.utf8_error().valid_up_to()))
}

/// Returns the OpenDRIVE files in the folder of maps, sorted; none if no folder is given.
///
/// # Errors
/// [`FindError::Folder`].
pub fn files(folder: Option<&Path>) -> Result<Vec<PathBuf>, FindError> {
    let chosen = folder.map(Path::to_path_buf);
    let Some(folder) = chosen.or_else(|| std::env::var_os(MAPS_VARIABLE).map(PathBuf::from)) else {
        return Ok(Vec::new());
    };
    let entries = match fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(why) => return Err(FindError::Folder { path: folder, why }),
    };
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xodr")))
        .collect();
    files.sort();
    Ok(files)
}

/// Returns the name of the map in a file: the file's stem after a source and two underscores.
pub fn display_name(file: &Path) -> &str {
    let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    stem.rsplit("__").next().unwrap_or(stem)
}

/// Returns the file of a map, by its stem or by its map's name, with or without CARLA's `_Opt`.
pub fn file_of<'a>(files: &'a [PathBuf], name: &str) -> Option<&'a Path> {
    let stem = |file: &&PathBuf| file.file_stem().is_some_and(|s| s.eq_ignore_ascii_case(name));
    let end = name.len().saturating_sub(4);
    let is_opt = name.get(end..).is_some_and(|mark| mark.eq_ignore_ascii_case("_opt"));
    let plain = if is_opt { &name[..end] } else { name };
    let named = |file: &&PathBuf| display_name(file).eq_ignore_ascii_case(plain);
    files.iter().find(stem).or_else(|| files.iter().find(named)).map(PathBuf::as_path)
}
