//! Where the files of a data set lie, and how they get there whole.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
};

use crate::collect::{
    CollectError,
    format::{FORMAT, Metadata},
};

/// What marks a file that is being written. Such files mean nothing.
const PARTIAL: &str = ".partial";

/// Locked for as long as somebody writes in the folder.
const LOCK: &str = ".lock";

/// The part of `metadata.json` that every version of the format shares.
#[derive(serde::Deserialize)]
struct Head {
    format: String,
}

/// The folder of a data set.
#[derive(Clone, Debug)]
pub(crate) struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The data set at `root`, which need not exist.
    pub(crate) fn new(root: &Path) -> Folder {
        Folder { root: root.to_owned() }
    }

    /// Its path.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// One line for each complete frame.
    pub(crate) fn frames(&self) -> PathBuf {
        self.root.join("frames.jsonl")
    }

    /// What the data set is.
    pub(crate) fn metadata(&self) -> PathBuf {
        self.root.join("metadata.json")
    }

    /// A file of one frame: `front/color` and `png` make `front/color/000123.png`.
    pub(crate) fn frame_file(&self, output: &str, frame: u64, extension: &str) -> PathBuf {
        self.root.join(output).join(format!("{frame:06}.{extension}"))
    }

    /// Takes the folder: makes it if it is not there, proves that it can be written, and locks it
    /// for as long as the answer lives.
    pub(crate) fn lock(&self) -> Result<FolderLock, CollectError> {
        let is_new = !self.root.exists();
        if !is_new && !self.root.is_dir() {
            return Err(CollectError::io(&self.root, io::ErrorKind::NotADirectory.into()));
        }
        fs::create_dir_all(&self.root).map_err(|e| CollectError::io(&self.root, e))?;
        let path = self.root.join(LOCK);
        let open = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
        let file = open.map_err(|e| CollectError::io(&path, e))?;
        match file.try_lock() {
            Ok(()) => Ok(FolderLock { folder: self.clone(), is_new, _file: file }),
            Err(TryLockError::WouldBlock) => Err(CollectError::Busy { dir: self.root.clone() }),
            Err(TryLockError::Error(e)) => Err(CollectError::io(&path, e)),
        }
    }

    /// How many things lie in the folder. What a run has made that was killed before it knew what
    /// to collect does not count: the lock, an empty frame_list, half a file.
    pub(crate) fn count(&self) -> Result<usize, CollectError> {
        let counts = |entry: &fs::DirEntry| {
            let name = entry.file_name();
            let is_partial = name.to_string_lossy().ends_with(PARTIAL);
            let is_empty_list = entry.path() == self.frames() && is_empty(&self.frames());
            !(name == LOCK || is_partial || is_empty_list)
        };
        match fs::read_dir(&self.root) {
            Ok(entries) => Ok(entries.flatten().filter(counts).count()),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(0),
            Err(e) => Err(CollectError::io(&self.root, e)),
        }
    }

    /// What the data set says of itself; nothing if there is none.
    pub(crate) fn read_metadata(&self) -> Result<Option<Metadata>, CollectError> {
        let path = self.metadata();
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(CollectError::io(&path, e)),
        };
        let damaged = |e| CollectError::damaged(&path, e);
        // The version comes first: the keys of another one have other names.
        let Head { format } = serde_json::from_str(&text).map_err(damaged)?;
        if format != FORMAT {
            return Err(CollectError::OtherFormat { path, format });
        }
        serde_json::from_str(&text).map(Some).map_err(damaged)
    }

    /// Writes what the data set says of itself.
    pub(crate) fn write_metadata(&self, metadata: &Metadata) -> Result<(), CollectError> {
        let mut text = serde_json::to_vec_pretty(metadata).expect("plain data has a JSON form");
        text.push(b'\n');
        write_atomically(&self.metadata(), &text)
    }

    /// Removes what a killed run left half written in these output folders and at the top.
    pub(crate) fn remove_partial_files<'a>(
        &self,
        outputs: impl IntoIterator<Item = &'a str>,
    ) -> Result<(), CollectError> {
        for output in outputs.into_iter().chain([""]) {
            let dir = self.root.join(output);
            let Ok(entries) = fs::read_dir(&dir) else { continue };
            for entry in entries.flatten() {
                if entry.file_name().to_string_lossy().ends_with(PARTIAL) {
                    let path = entry.path();
                    fs::remove_file(&path).map_err(|e| CollectError::io(&path, e))?;
                }
            }
        }
        Ok(())
    }
}

fn is_empty(file: &Path) -> bool {
    fs::metadata(file).is_ok_and(|m| m.is_file() && m.len() == 0)
}

/// The lock on a data set's folder. When nothing was collected, nothing is left.
pub(crate) struct FolderLock {
    folder: Folder,
    is_new: bool,
    _file: File,
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        let Folder { root } = &self.folder;
        if is_empty(&self.folder.frames()) && !self.folder.metadata().exists() {
            let _ = fs::remove_file(self.folder.frames());
        }
        let _ = fs::remove_file(root.join(LOCK));
        if self.is_new {
            // Only an empty folder goes.
            let _ = fs::remove_dir(root);
        }
    }
}

/// Writes a file so that it is there whole or not at all, whenever the process is killed.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), CollectError> {
    let mut name = path.file_name().expect("a file has a name").to_owned();
    name.push(PARTIAL);
    let partial = path.with_file_name(name);
    let write = || {
        let mut file = File::create(&partial)?;
        file.write_all(bytes)?;
        fs::rename(&partial, path)
    };
    write().map_err(|e| {
        let _ = fs::remove_file(&partial);
        CollectError::io(path, e)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::testing::Scratch;

    #[test]
    fn a_file_that_cannot_be_finished_leaves_nothing() {
        let scratch = Scratch::new("whole");
        let path = scratch.path().join("a.bin");
        fs::create_dir(&path).unwrap();
        assert!(write_atomically(&path, b"x").is_err(), "a folder stands in the way");
        let names: Vec<_> = fs::read_dir(scratch.path()).unwrap().flatten().collect();
        assert_eq!(names.len(), 1, "{names:?}");
    }

    #[test]
    fn a_full_disk_is_named_as_such() {
        let error = write_whole_to_full();
        assert!(matches!(error, CollectError::DiskFull { .. }), "{error}");
    }

    /// `/dev/full` answers every write with "no space left on device".
    fn write_whole_to_full() -> CollectError {
        let path = Path::new("/dev/full");
        let written = OpenOptions::new().write(true).open(path).and_then(|mut f| f.write_all(b"x"));
        CollectError::io(path, written.unwrap_err())
    }

    #[test]
    fn a_data_set_of_another_version_is_rejected_by_name() {
        let scratch = Scratch::new("version");
        let folder = Folder::new(scratch.path());
        // Only the version is known of other versions.
        fs::write(folder.metadata(), r#"{"format": "omnibus-dataset-1", "recipe": {}}"#).unwrap();
        let error = folder.read_metadata().unwrap_err();
        assert!(
            matches!(&error, CollectError::OtherFormat { format, .. } if format == "omnibus-dataset-1")
        );
        let text = error.to_string();
        assert!(text.contains("omnibus-dataset-1") && text.contains(FORMAT), "{text}");
    }

    #[test]
    fn a_folder_is_locked_once() {
        let scratch = Scratch::new("taken");
        let folder = Folder::new(scratch.path());
        let lock = folder.lock().unwrap();
        assert!(matches!(folder.lock(), Err(CollectError::Busy { .. })));
        assert_eq!(folder.count().unwrap(), 0, "the lock is no content");
        drop(lock);
        assert!(folder.lock().is_ok());
    }

    #[test]
    fn a_run_that_ends_before_it_collects_leaves_nothing() {
        let scratch = Scratch::new("nothing");
        let folder = Folder::new(&scratch.path().join("set"));
        let lock = folder.lock().unwrap();
        fs::write(folder.frames(), "").unwrap();
        drop(lock);
        assert!(!folder.root().exists());
        // A folder that was there before stays.
        drop(Folder::new(scratch.path()).lock().unwrap());
        assert!(scratch.path().exists());
    }

    #[test]
    fn a_run_that_was_killed_before_it_collected_does_not_fill_its_folder() {
        let scratch = Scratch::new("killed");
        let folder = Folder::new(scratch.path());
        for trace in [".lock", "frames.jsonl", "metadata.json.partial"] {
            fs::write(scratch.path().join(trace), "").unwrap();
        }
        assert_eq!(folder.count().unwrap(), 0);
        fs::write(folder.frames(), "a line").unwrap();
        assert_eq!(folder.count().unwrap(), 1);
    }

    #[test]
    fn what_was_half_written_is_swept() {
        let scratch = Scratch::new("swept");
        let folder = Folder::new(scratch.path());
        fs::create_dir_all(scratch.path().join("front/color")).unwrap();
        fs::write(folder.frame_file("front/color", 7, "png.partial"), b"torn").unwrap();
        fs::write(folder.frame_file("front/color", 6, "png"), b"whole").unwrap();
        folder.remove_partial_files(["front/color"]).unwrap();
        assert!(!folder.frame_file("front/color", 7, "png.partial").exists());
        assert!(folder.frame_file("front/color", 6, "png").exists());
    }
}
