//! The corpus: one folder of small files for each target.

use std::{env, fs, io, path::PathBuf};

/// Returns the folder of a target's corpus.
pub fn folder(target: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target)
}

/// Returns the files of a target's corpus, by name.
///
/// # Errors
/// The folder or a file cannot be read.
pub fn seeds(target: &str) -> io::Result<Vec<(PathBuf, Vec<u8>)>> {
    let folder = match fs::read_dir(folder(target)) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        folder => folder?,
    };
    let mut paths: Vec<PathBuf> =
        folder.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    paths.sort();
    paths.into_iter().map(|path| Ok((path.clone(), fs::read(path)?))).collect()
}

/// Returns whether full counts are requested.
pub fn is_soak() -> bool {
    env::var_os("OMNIBUS_SOAK").is_some()
}

/// Returns the maps of up to `len` bytes in the folder `OMNIBUS_MAPS`, by name; none without it.
pub(crate) fn real_maps(len: usize) -> Vec<Vec<u8>> {
    let folder = env::var_os("OMNIBUS_MAPS").and_then(|folder| fs::read_dir(folder).ok());
    let mut paths: Vec<PathBuf> =
        folder.into_iter().flatten().flatten().map(|e| e.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "xodr"));
    paths.sort();
    let maps = paths.iter().filter_map(|path| fs::read(path).ok());
    maps.filter(|bytes| bytes.len() <= len).collect()
}
