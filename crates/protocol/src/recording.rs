//! Commands of recordings, replays and saved states.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

/// An absolute path on the host, UTF-8, at most 160 bytes, padded with zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct FilePath(pub [u8; 160]);

const _: () = assert!(size_of::<FilePath>() == 160);

impl FilePath {
    /// Encodes a path.
    ///
    /// # Errors
    ///
    /// The path is not absolute, not UTF-8, or longer than 160 bytes.
    pub fn new(path: &Path) -> Result<FilePath, String> {
        let text = path.to_str().ok_or_else(|| format!("{}: it is not UTF-8", path.display()))?;
        let mut bytes = [0; 160];
        if text.is_empty() || text.contains('\0') {
            return Err("an empty name names no file".to_owned());
        }
        let len = text.len();
        let room = bytes.get_mut(..len).ok_or_else(|| {
            format!(
                "{text}: the path has {len} bytes, at most 160 are possible; use a shorter path"
            )
        })?;
        room.copy_from_slice(text.as_bytes());
        Ok(FilePath(bytes))
    }

    /// The path; empty if the bytes are not UTF-8.
    pub fn path(&self) -> &Path {
        let end = self.0.iter().position(|&b| b == 0).unwrap_or(self.0.len());
        Path::new(std::str::from_utf8(&self.0[..end]).unwrap_or(""))
    }
}

impl Default for FilePath {
    fn default() -> FilePath {
        FilePath([0; 160])
    }
}

/// Parameters of [`crate::Command::StartRecorder`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct StartRecorder {
    /// The file to write; an existing file is replaced.
    pub path: FilePath,
    /// Profile: 0 state, 1 inputs, 2 compact.
    pub profile: u32,
    /// Reserved; 0.
    pub reserved: u32,
}

/// Parameters of [`crate::Command::StartReplay`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StartReplay {
    /// The recording.
    pub path: FilePath,
    /// Recorded time at which the replay begins; negative: relative to the end.
    pub from_nanos: i64,
    /// Recorded duration to replay; 0: to the end.
    pub duration_nanos: u64,
    /// Recorded seconds per simulated second.
    pub time_factor: f32,
    /// 1: actors with the role `hero` are left out.
    pub ignore_hero: u32,
}

/// Parameters of [`crate::Command::StopReplay`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct StopReplay {
    /// 1: replayed actors stay in the world, vehicles on autopilot; 0: they are destroyed.
    pub keep_actors: u32,
    /// Reserved; 0.
    pub reserved: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_told_whole_or_not_at_all() {
        let path = Path::new("/tmp/a b/ü.mcap");
        assert_eq!(FilePath::new(path).unwrap().path(), path);
        let long = format!("/{}", "x".repeat(160));
        assert!(FilePath::new(Path::new(&long)).unwrap_err().contains("161 bytes"));
        assert!(FilePath::new(Path::new("")).is_err());
    }
}
