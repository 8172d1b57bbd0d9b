//! Baked things on disk, so that the next start need not make them again.
//!
//! A cache only saves time: what is damaged, foreign or not to be read is made anew, and where
//! nothing can be written nothing is kept.

mod file;
mod mapped;
mod network;
mod sum;

#[cfg(test)]
mod tests;

use std::env;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

pub use file::Parts;
use sum::Sum;

use crate::{BAKE_VERSION, Detail, Town};

/// At most so many files are kept, the newest.
const FILES_MAX: usize = 32;
/// At most so many bytes are kept.
const BYTES_MAX: u64 = 2_000_000_000;

/// How the files of a cache begin; nothing else in its folder is ever touched.
const PREFIX: &str = "baked-";

/// A folder of baked things, or none.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: Option<PathBuf>,
}

/// Which thing: the map, the seed and the detail, what was made of them, and by which code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    kind: &'static str,
    sums: [u64; 2],
}

impl Key {
    /// Of the thing that `kind` names, made of these by code that `code` identifies together with
    /// that of this crate.
    pub fn new(kind: &'static str, code: &str, open_drive: &str, seed: u64, detail: Detail) -> Key {
        let mut sum = Sum::new();
        sum.add(concat!(env!("CARGO_PKG_VERSION"), " ", env!("OMNIBUS_SOURCES")).as_bytes());
        sum.add(kind.as_bytes());
        sum.add(code.as_bytes());
        sum.add(bytemuck::cast_slice(&[BAKE_VERSION, seed, detail as u64]));
        sum.add(open_drive.as_bytes());
        Key { kind, sums: sum.both() }
    }

    fn file_name(&self) -> String {
        format!("{PREFIX}{}-{:016x}{:016x}", self.kind, self.sums[0], self.sums[1])
    }
}

impl Cache {
    /// Where the environment says: `$OMNIBUS_CACHE`, else `omnibus` in `$XDG_CACHE_HOME`, else
    /// `.cache/omnibus` in the home folder. An empty `$OMNIBUS_CACHE` switches it off.
    pub fn of_environment() -> Cache {
        let folder = folder_by(|name| env::var_os(name));
        Cache { folder }
    }

    /// In this folder, which is made when something is kept.
    pub fn at(folder: &Path) -> Cache {
        Cache { folder: Some(folder.to_owned()) }
    }

    /// Keeps nothing, finds nothing.
    pub fn off() -> Cache {
        Cache { folder: None }
    }

    /// What was kept under this key, to be taken apart in the order in which it was kept.
    pub fn find(&self, key: Key) -> Option<Parts> {
        Parts::open(&self.folder.as_ref()?.join(key.file_name()), key.sums)
    }

    /// Keeps these parts under this key, unless it is there already or cannot be written. The
    /// file appears whole or not at all, whoever else keeps it at the same time.
    pub fn keep(&self, key: Key, parts: &[&[u8]]) {
        let Some(folder) = &self.folder else { return };
        if self.find(key).is_none_or(|mut parts| !parts.is_intact()) {
            // Whoever cannot write does without.
            let _ = keep_in(folder, key, parts);
        }
    }

    /// Whether there is a town for this map and seed; it may yet be damaged.
    pub fn has_town(&self, open_drive: &str, seed: u64) -> bool {
        self.find(town_key(open_drive, seed)).is_some()
    }

    /// The town that was kept for this map and seed.
    pub fn find_town(&self, open_drive: &str, seed: u64) -> Option<Town> {
        let bytes: Vec<u8> = self.find(town_key(open_drive, seed))?.take()?;
        Town::from_bytes(&bytes).ok()
    }

    /// Keeps the town of this map and seed.
    pub fn keep_town(&self, open_drive: &str, seed: u64, town: &Town) {
        if self.folder.is_some() {
            self.keep(town_key(open_drive, seed), &[&town.to_bytes()]);
        }
    }
}

fn town_key(open_drive: &str, seed: u64) -> Key {
    Key::new("town", "", open_drive, seed, Detail::Standard)
}

fn folder_by(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(folder) = variable("OMNIBUS_CACHE") {
        return (!folder.is_empty()).then(|| folder.into());
    }
    // A relative XDG_CACHE_HOME is to be ignored, says its specification.
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

/// Removes the oldest files, and those that a process left unfinished when it was killed.
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
        // Another process may be pruning too.
        if let Ok(about) = entry.metadata() {
            let written = about.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            files.push((written, about.len(), entry.path()));
        }
    }
    files.sort();
    let mut bytes = 0;
    for (index, (_, length, path)) in files.iter().rev().enumerate() {
        bytes += length;
        // The newest stays, however large.
        if index >= FILES_MAX || index > 0 && bytes > BYTES_MAX {
            let _ = fs::remove_file(path);
        }
    }
    Ok(())
}
