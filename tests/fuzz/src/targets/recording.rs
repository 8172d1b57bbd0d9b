//! Recordings.

use std::{
    fs::File,
    os::{fd::AsRawFd, unix::fs::FileExt},
    path::PathBuf,
};

use carla_gateway::carla_log::Source;
use record::Recording;
use rustix::fs::{MemfdFlags, memfd_create};

/// Scans a recording, reads every segment, and converts its frames to those of CARLA.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let file = File::from(memfd_create("fuzz", MemfdFlags::CLOEXEC).expect("a file in memory"));
    file.write_all_at(bytes, 0).expect("memory for the file");
    let path = PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()));
    let mut recording = match Recording::open(&path) {
        Ok(recording) => recording,
        Err(why) => {
            assert!(!why.to_string().is_empty());
            return false;
        }
    };
    let segments = recording.segments();
    let mut is_whole = recording.duration_nanos().is_ok();
    for segment in 0..segments {
        assert!(recording.segment_at(recording.start_nanos(segment)) < segments);
        is_whole &= recording.frames(segment).is_ok();
        is_whole &= recording.recorded_frames(segment).is_ok();
    }
    // Backwards, every segment is read from its key.
    for segment in (0..segments).rev() {
        let _ = (recording.world_before(segment), recording.recorded_frames(segment).is_ok());
    }
    let converted = Source::open(&path).and_then(|mut source| source.each(|_| ()));
    is_whole && converted.is_ok()
}
