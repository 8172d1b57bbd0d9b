//! The folder of recordings: the only one in which network clients name files.
//!
//! CARLA's protocol has no authentication, so that every client that reaches the port, a web page's
//! request included if it were executed, acts with the rights of the user. Names are therefore
//! confined: relative ones lie in the folder, absolute ones must, and no link is followed on the way.

use std::{
    env,
    ffi::OsStr,
    fs, io,
    os::fd::OwnedFd,
    path::{Component, Path, PathBuf},
};

use rustix::{
    fs::{CWD, FileType, Mode, OFlags, fstat, openat},
    io::Errno,
};

use crate::args::RpcError;

/// Returns the default folder: `omnibus/recordings` in the user's state folder; `None` without a
/// home.
pub fn default_folder() -> Option<PathBuf> {
    let state = env::var_os("XDG_STATE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    let home = || env::var_os("HOME").map(|home| Path::new(&home).join(".local/state"));
    Some(state.or_else(home)?.join("omnibus/recordings"))
}

/// The folder of recordings.
#[derive(Clone, Debug)]
pub(crate) struct Recordings {
    folder: Option<PathBuf>,
}

impl Recordings {
    /// Creates the rule for a folder, which need not exist yet.
    pub(crate) fn in_folder(folder: Option<PathBuf>) -> Recordings {
        Recordings { folder }
    }

    /// Returns the folder as a text for people.
    pub(crate) fn describe(&self) -> String {
        let folder = self.folder.as_ref();
        folder.map_or("no folder".to_owned(), |folder| folder.display().to_string())
    }

    /// Returns the path of a file that a client has named. The file may be missing; the folder is
    /// created.
    ///
    /// # Errors
    ///
    /// Returns an error if the file would lie outside of the folder, behind a link, or is not a
    /// regular one.
    pub(crate) fn path(&self, name: &str) -> Result<PathBuf, RpcError> {
        let Some(folder) = &self.folder else {
            return Err(
                "there is no folder of recordings, because HOME is not set; start omnibus \
                        run with --recordings DIR"
                    .into(),
            );
        };
        let at = |e: io::Error| RpcError(format!("{}: {e}", folder.display()));
        fs::create_dir_all(folder).map_err(at)?;
        let real = folder.canonicalize().map_err(at)?;
        let outside = || {
            RpcError(format!(
                "{name:?} is not in the folder of recordings {}; clients write and read files only \
                 there (omnibus run --recordings DIR chooses another)",
                folder.display()
            ))
        };
        let named = Path::new(name);
        let inner = match named.is_absolute() {
            true => named.strip_prefix(folder).or_else(|_| named.strip_prefix(&real)),
            false => Ok(named),
        };
        let mut parts = Vec::new();
        for part in inner.map_err(|_| outside())?.components() {
            match part {
                Component::Normal(part) => parts.push(part),
                Component::CurDir => {}
                _ => return Err(outside()),
            }
        }
        if parts.is_empty() || name.contains('\0') {
            return Err(RpcError(format!("{name:?} is not the name of a file")));
        }
        check(&real, &parts).map_err(|why| {
            RpcError(format!("{name:?} in the folder of recordings {}: {why}", folder.display()))
        })?;
        Ok(parts.iter().fold(real, |path, part| path.join(part)))
    }
}

/// Checks that what exists of a path are folders and, at its end, a regular file, without links.
fn check(folder: &Path, parts: &[&OsStr]) -> Result<(), String> {
    let words = |e: Errno| io::Error::from(e).to_string();
    let flags = OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    let mut here: OwnedFd = openat(CWD, folder, flags, Mode::empty()).map_err(words)?;
    for (index, part) in parts.iter().enumerate() {
        here = match openat(&here, *part, flags, Mode::empty()) {
            Ok(next) => next,
            Err(Errno::NOENT) => return Ok(()),
            Err(e) => return Err(words(e)),
        };
        let kind = FileType::from_raw_mode(fstat(&here).map_err(words)?.st_mode);
        let is_last = index + 1 == parts.len();
        match kind {
            FileType::Directory if !is_last => {}
            FileType::RegularFile if is_last => {}
            FileType::Symlink => {
                return Err(format!("{} is a link, and links are not followed", part.display()));
            }
            _ if is_last => return Err("it is not a regular file".to_owned()),
            _ => return Err(format!("{} is not a folder", part.display())),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn names_are_confined_to_the_folder() {
        let scratch = env::temp_dir().join(format!("omnibus-recordings-{}", std::process::id()));
        let folder = scratch.join("inside");
        fs::create_dir_all(folder.join("sub")).unwrap();
        fs::write(scratch.join("outside.mcap"), "").unwrap();
        fs::write(folder.join("there.mcap"), "").unwrap();
        symlink(&scratch, folder.join("out")).unwrap();
        symlink(scratch.join("outside.mcap"), folder.join("link.mcap")).unwrap();
        symlink(scratch.join("missing"), folder.join("dangling.mcap")).unwrap();
        rustix::fs::mkfifoat(CWD, folder.join("pipe"), Mode::RUSR | Mode::WUSR).unwrap();
        let recordings = Recordings::in_folder(Some(folder.clone()));
        let real = folder.canonicalize().unwrap();
        let absolute = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        for (name, path) in [
            ("new.mcap", "new.mcap"),
            ("there.mcap", "there.mcap"),
            ("./sub/new/run.log", "sub/new/run.log"),
            ("C:\\run.log", "C:\\run.log"),
            (&absolute("sub/a.mcap"), "sub/a.mcap"),
        ] {
            assert_eq!(recordings.path(name).unwrap(), real.join(path), "{name}");
        }
        let above = absolute("../outside.mcap");
        for (name, word) in [
            ("", "not the name of a file"),
            (".", "not the name of a file"),
            ("a\0b", "not the name of a file"),
            ("/etc/passwd", "--recordings"),
            ("../outside.mcap", "--recordings"),
            ("sub/../../outside.mcap", "--recordings"),
            (&above, "--recordings"),
            ("out/outside.mcap", "out is a link"),
            ("out/new.mcap", "out is a link"),
            ("link.mcap", "link.mcap is a link"),
            ("dangling.mcap", "dangling.mcap is a link"),
            ("pipe", "not a regular file"),
            ("sub", "not a regular file"),
            ("there.mcap/new", "there.mcap is not a folder"),
        ] {
            let RpcError(why) = recordings.path(name).unwrap_err();
            assert!(why.contains(word), "{name}: {why}");
        }
        fs::remove_dir_all(&scratch).unwrap();
        let RpcError(why) = Recordings::in_folder(None).path("a").unwrap_err();
        assert!(why.contains("--recordings"), "{why}");
    }
}
