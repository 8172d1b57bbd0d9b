//! The paths of a data set, and how files are written atomically.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
};

use crate::collect::{
    CollectError,
    format::{FORMAT, Metadata},
};

/// The suffix of a file that is being written. Such files are ignored.
const PARTIAL: &str = ".partial";

/// The file that is locked while a process writes to the folder.
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
    /// Returns the data set at `root`, which need not exist.
    pub(crate) fn new(root: &Path) -> Folder {
        Folder { root: root.to_owned() }
    }

    /// Returns the path of the data set.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Returns the path of the list of complete frames.
    pub(crate) fn frames(&self) -> PathBuf {
        self.root.join("frames.jsonl")
    }

    /// Returns the path of the metadata.
    pub(crate) fn metadata(&self) -> PathBuf {
        self.root.join("metadata.json")
    }

    /// Returns a file of one frame: `front/color` and `png` give `front/color/000123.png`.
    pub(crate) fn frame_file(&self, output: &str, frame: u64, extension: &str) -> PathBuf {
        self.root.join(output).join(format!("{frame:06}.{extension}"))
    }

    /// Creates the folder if needed, checks that it is writable, and locks it for the life of the
    /// returned value.
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

    /// Counts the entries of the folder. Traces of a run that was killed before its first frame do
    /// not count: the lock, an empty list, a partial file.
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

    /// Reads the metadata; `None` if there is none.
    pub(crate) fn read_metadata(&self) -> Result<Option<Metadata>, CollectError> {
        let path = self.metadata();
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(CollectError::io(&path, e)),
        };
        let damaged = |e| CollectError::damaged(&path, e);
        // The version comes first: other versions have other keys.
        let Head { format } = serde_json::from_str(&text).map_err(damaged)?;
        if format != FORMAT {
            return Err(CollectError::OtherFormat { path, format });
        }
        serde_json::from_str(&text).map(Some).map_err(damaged)
    }

    /// Writes the metadata.
    pub(crate) fn write_metadata(&self, metadata: &Metadata) -> Result<(), CollectError> {
        let mut text = serde_json::to_vec_pretty(metadata).expect("plain data has a JSON form");
        text.push(b'\n');
        write_atomically(&self.metadata(), &text)
    }

    /// Removes partial files from these output folders and from the root.
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

/// The lock on the folder of a data set. If nothing was collected, dropping it leaves nothing
/// behind.
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
            // Removes the folder only if it is empty.
            let _ = fs::remove_dir(root);
        }
    }
}

/// Writes a file that is either complete or absent, even if the process is killed.
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
    fn a_file_that_cannot_be_written_leaves_nothing() {
        let scratch = Scratch::new("whole");
        let path = scratch.path().join("a.bin");
        fs::create_dir(&path).unwrap();
        assert!(write_atomically(&path, b"x").is_err(), "a folder stands in the way");
        let names: Vec<_> = fs::read_dir(scratch.path()).unwrap().flatten().collect();
        assert_eq!(names.len(), 1, "{names:?}");
    }

    #[test]
    fn a_full_disk_is_named_as_such() {
        let error = error_of_a_full_disk();
        assert!(matches!(error, CollectError::DiskFull { .. }), "{error}");
    }

    /// `/dev/full` answers every write with "no space left on device".
    fn error_of_a_full_disk() -> CollectError {
        let path = Path::new("/dev/full");
        let written = OpenOptions::new().write(true).open(path).and_then(|mut f| f.write_all(b"x"));
        CollectError::io(path, written.unwrap_err())
    }

    #[test]
    fn a_data_set_of_another_version_is_rejected_by_name() {
        let scratch = Scratch::new("version");
        let folder = Folder::new(scratch.path());
        // Other versions share only the key of the version.
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
        // A folder that existed before stays.
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
    fn partial_files_are_removed() {
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
