//! Files that a user or a client has named. Only regular ones are opened: a named pipe would block
//! its reader, and a device may never end.

use std::{
    fs::{File, OpenOptions},
    io::{self, Read},
    os::unix::fs::{FileTypeExt, OpenOptionsExt},
    path::Path,
};

use rustix::fs::OFlags;

/// Opens an existing file for reading. Never blocks.
///
/// # Errors
///
/// Returns an error if the file cannot be opened or is not a regular one.
pub fn open_regular(path: &Path) -> io::Result<File> {
    open(OpenOptions::new().read(true), path)
}

/// Opens a file for reading and writing, and creates it if it is missing. Does not truncate it.
///
/// # Errors
///
/// Returns an error if the file cannot be opened or is not a regular one.
pub fn create_regular(path: &Path) -> io::Result<File> {
    open(OpenOptions::new().read(true).write(true).create(true).truncate(false), path)
}

/// Reads a file of at most `most` bytes.
///
/// # Errors
///
/// Returns an error if the file cannot be read, is not a regular one or is longer.
pub fn read_regular(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open_regular(path)?;
    let mut bytes = Vec::new();
    // Some regular files, those of /proc for instance, say that they are empty.
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::other(format!("more than {most} bytes, the most that are read")));
    }
    Ok(bytes)
}

fn open(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    let flags = (OFlags::NONBLOCK | OFlags::NOCTTY).bits();
    let file = options.custom_flags(flags as i32).open(path)?;
    let kind = file.metadata()?.file_type();
    if kind.is_file() {
        return Ok(file);
    }
    let what = match kind {
        _ if kind.is_dir() => "a folder",
        _ if kind.is_fifo() => "a named pipe",
        _ if kind.is_socket() => "a socket",
        _ => "a device",
    };
    Err(io::Error::other(format!("{what}, not a regular file")))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use rustix::fs::{Mode, mkfifoat};

    use super::*;

    #[test]
    fn only_regular_files_are_opened_and_never_more_is_read_than_asked_for() {
        let folder = std::env::temp_dir().join(format!("omnibus-regular-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (pipe, plain) = (folder.join("pipe"), folder.join("plain"));
        mkfifoat(rustix::fs::CWD, &pipe, Mode::RUSR | Mode::WUSR).unwrap();
        fs::write(&plain, [7; 100]).unwrap();
        for (path, what) in
            [(&*pipe, "a named pipe"), (&folder, "folder"), (Path::new("/dev/zero"), "a device")]
        {
            let why = open_regular(path).unwrap_err().to_string();
            assert!(why.contains(what), "{}: {why}", path.display());
            assert!(read_regular(path, 10).is_err());
        }
        for path in [&*pipe, Path::new("/dev/zero")] {
            assert!(create_regular(path).unwrap_err().to_string().contains("not a regular file"));
        }
        assert_eq!(read_regular(&plain, 100).unwrap(), [7; 100]);
        assert!(read_regular(&plain, 99).unwrap_err().to_string().contains("more than 99 bytes"));
        drop(create_regular(&plain).unwrap());
        assert_eq!(fs::read(&plain).unwrap(), [7; 100]);
        fs::remove_dir_all(&folder).unwrap();
    }
}
