//! Commands about recordings and saved states.

use std::path::Path;

use bytemuck::{Pod, Zeroable};

/// Where a file lies, for the host: an absolute path of at most 160 bytes, padded with zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct FilePath(pub [u8; 160]);

const _: () = assert!(size_of::<FilePath>() == 160);

impl FilePath {
    /// The path, or why it cannot be told.
    pub fn new(path: &Path) -> Result<FilePath, String> {
        let text = path.to_str().ok_or_else(|| format!("{}: it is not UTF-8", path.display()))?;
        let mut bytes = [0; 160];
        if text.is_empty() || text.contains('\0') {
            return Err("an empty name names no file".to_owned());
        }
        let len = text.len();
        let room = bytes.get_mut(..len).ok_or_else(|| {
            format!("{text}: it has {len} bytes, 160 are possible; use a folder nearer the root")
        })?;
        room.copy_from_slice(text.as_bytes());
        Ok(FilePath(bytes))
    }

    /// The path; empty if a stranger wrote something that is not UTF-8.
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

/// See [`crate::Command::StartRecorder`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct StartRecorder {
    /// Where to; a file of that name is replaced.
    pub path: FilePath,
    /// How much is kept: 0 state, 1 inputs, 2 compact.
    pub profile: u32,
    /// Zero.
    pub reserved: u32,
}

/// See [`crate::Command::StartReplay`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StartReplay {
    /// From where.
    pub path: FilePath,
    /// Recorded time to begin at; below 0: counted from the end.
    pub from_nanos: i64,
    /// Recorded time to play; 0: to the end.
    pub duration_nanos: u64,
    /// Recorded seconds per simulated second.
    pub time_factor: f32,
    /// 1: actors of the role `hero` are left out.
    pub ignore_hero: u32,
}

/// See [`crate::Command::StopReplay`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct StopReplay {
    /// 1: who was shown stays, vehicles on autopilot; 0: they go.
    pub keep_actors: u32,
    /// Zero.
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
