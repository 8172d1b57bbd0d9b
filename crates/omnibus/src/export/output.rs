//! The folder that is written: `OUT.partial` until it is complete, then `OUT`.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail, ensure};
use rustix::fs::{CWD, RenameFlags, renameat_with};

/// Marks a folder as one of a run, which holds a lock on it.
const LOCK: &str = ".lock";

/// A folder that gets its name when it is complete, and is removed if it never is.
pub(crate) struct Output {
    out: PathBuf,
    partial: PathBuf,
    is_finished: bool,
    _lock: File,
}

impl Output {
    /// Creates the folder; what a killed run left under the same name is removed first.
    pub(crate) fn create(out: &Path) -> anyhow::Result<Output> {
        ensure!(
            fs::symlink_metadata(out).is_err(),
            "{} exists; choose another --out, or remove it",
            out.display()
        );
        let Some(name) = out.file_name() else {
            bail!("--out {} names no folder to create", out.display());
        };
        let mut name = name.to_owned();
        name.push(".partial");
        let partial = out.with_file_name(name);
        let lock = partial.join(LOCK);
        if fs::symlink_metadata(&partial).is_ok() {
            let shown = partial.display();
            // Without the mark the folder belongs to somebody else.
            let file = File::open(&lock)
                .map_err(|_| anyhow!("{shown} exists and is no rest of an export; remove it"))?;
            match file.try_lock() {
                Ok(()) => fs::remove_dir_all(&partial).with_context(|| shown.to_string())?,
                Err(TryLockError::WouldBlock) => {
                    bail!(
                        "{shown} is being written by another omnibus export; choose another --out"
                    )
                }
                Err(TryLockError::Error(e)) => return Err(e).context(lock.display().to_string()),
            }
        }
        if let Some(parent) = partial.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            fs::create_dir_all(parent).with_context(|| parent.display().to_string())?;
        }
        fs::create_dir(&partial).with_context(|| partial.display().to_string())?;
        let file = File::create(&lock).with_context(|| lock.display().to_string())?;
        file.try_lock().with_context(|| lock.display().to_string())?;
        Ok(Output { out: out.to_owned(), partial, is_finished: false, _lock: file })
    }

    /// Returns the folder to write to.
    pub(crate) fn root(&self) -> &Path {
        &self.partial
    }

    /// Gives the complete folder its name.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        let shown = self.out.display().to_string();
        fs::remove_file(self.partial.join(LOCK)).with_context(|| shown.clone())?;
        renameat_with(CWD, &self.partial, CWD, &self.out, RenameFlags::NOREPLACE)
            .with_context(|| format!("{shown} appeared during the export"))?;
        self.is_finished = true;
        Ok(())
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if !self.is_finished {
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}
