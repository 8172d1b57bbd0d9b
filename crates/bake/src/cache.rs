//! A folder of baked items.

use std::{
    env,
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
    process,
    sync::atomic::{AtomicU64, Ordering},
    time::SystemTime,
};

use town::Detail;

use crate::{
    checksum::Checksum,
    file::{self, Parts},
    town_bytes::TOWN_VERSION,
};

/// The most files that are kept; the newest stay.
pub(crate) const FILES_MAX: usize = 32;
/// The most bytes that are kept in all files together.
const BYTES_MAX: u64 = 2_000_000_000;

/// How the names of cache files begin; nothing else in the folder is touched.
const PREFIX: &str = "baked-";

/// A folder of baked items, or a disabled cache.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: Option<PathBuf>,
}

/// Identifies a baked item: its kind, the map, the seed, the detail, and the code that baked it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    kind: &'static str,
    sums: [u64; 2],
}

impl Key {
    /// The key of the item called `kind` that is baked from this map. `code` identifies the code
    /// that bakes it outside the crates whose sources the key always covers.
    pub fn new(kind: &'static str, code: &str, open_drive: &str, seed: u64, detail: Detail) -> Key {
        let mut sum = Checksum::new();
        sum.add(concat!(env!("CARGO_PKG_VERSION"), " ", env!("OMNIBUS_SOURCES")).as_bytes());
        sum.add(kind.as_bytes());
        sum.add(code.as_bytes());
        sum.add(bytemuck::cast_slice(&[TOWN_VERSION, seed, detail as u64]));
        sum.add(open_drive.as_bytes());
        Key { kind, sums: sum.digest() }
    }

    pub(crate) fn file_name(&self) -> String {
        format!("{PREFIX}{}-{:016x}{:016x}", self.kind, self.sums[0], self.sums[1])
    }
}

impl Cache {
    /// The cache that the environment names: `$OMNIBUS_CACHE`, else `omnibus` in
    /// `$XDG_CACHE_HOME`, else `.cache/omnibus` in the home folder. An empty `$OMNIBUS_CACHE`
    /// disables it.
    pub fn from_environment() -> Cache {
        let folder = folder_from(|name| env::var_os(name));
        Cache { folder }
    }

    /// The cache in `folder`, which is created when something is kept.
    pub fn in_folder(folder: &Path) -> Cache {
        Cache { folder: Some(folder.to_owned()) }
    }

    /// A cache that keeps nothing and finds nothing.
    pub fn disabled() -> Cache {
        Cache { folder: None }
    }

    /// Whether this cache can keep anything.
    pub(crate) fn is_enabled(&self) -> bool {
        self.folder.is_some()
    }

    /// The item that was kept under `key`, to be read in the order in which it was kept.
    pub fn find(&self, key: Key) -> Option<Parts> {
        Parts::open(&self.folder.as_ref()?.join(key.file_name()), key.sums)
    }

    /// Keeps `parts` under `key`, unless an intact file exists already or the folder cannot be
    /// written. The file appears whole or not at all, even if other processes keep the same item
    /// at the same time.
    pub fn keep(&self, key: Key, parts: &[&[u8]]) {
        let Some(folder) = &self.folder else { return };
        if self.find(key).is_none_or(|mut parts| !parts.is_intact()) {
            // Without a writable folder the next start builds the item again.
            let _ = keep_in(folder, key, parts);
        }
    }
}

/// The folder that these environment variables name.
pub(crate) fn folder_from(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(folder) = variable("OMNIBUS_CACHE") {
        return (!folder.is_empty()).then(|| folder.into());
    }
    // The XDG Base Directory Specification: "If an implementation encounters a relative path in
    // any of these variables it should consider the path invalid and ignore it."
    let base = variable("XDG_CACHE_HOME").map(PathBuf::from).filter(|base| base.is_absolute());
    let home = || variable("HOME").map(|home| PathBuf::from(home).join(".cache"));
    let base = base.or_else(home).filter(|base| base.is_absolute())?;
    Some(base.join("omnibus"))
}

fn keep_in(folder: &Path, key: Key, parts: &[&[u8]]) -> io::Result<()> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    fs::create_dir_all(folder)?;
    let name = key.file_name();
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let unfinished = folder.join(format!("{name}.{}.{count}", process::id()));
    let written = file::write(&unfinished, key.sums, parts)
        .and_then(|()| fs::rename(&unfinished, folder.join(name)));
    if written.is_err() {
        let _ = fs::remove_file(&unfinished);
    }
    written?;
    prune(folder)
}

/// Removes the oldest files beyond the limits, and unfinished files of processes that have ended.
fn prune(folder: &Path) -> io::Result<()> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !name.starts_with(PREFIX) {
            continue;
        }
        if let Some(writer) = name.split('.').nth(1)
            && !Path::new("/proc").join(writer).exists()
        {
            let _ = fs::remove_file(entry.path());
            continue;
        }
        // Another process may prune at the same time and remove the file first.
        if let Ok(metadata) = entry.metadata() {
            let written = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            files.push((written, metadata.len(), entry.path()));
        }
    }
    files.sort();
    let mut bytes = 0;
    for (index, (_, length, path)) in files.iter().rev().enumerate() {
        bytes += length;
        // The newest file stays, however large it is.
        if index >= FILES_MAX || index > 0 && bytes > BYTES_MAX {
            let _ = fs::remove_file(path);
        }
    }
    Ok(())
}
