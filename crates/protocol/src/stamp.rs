use std::fmt;

use bytemuck::{Pod, Zeroable};

/// The ordinal number of a simulation step.
///
/// Frame 0 is the world as loaded; the n-th tick produces frame n. Frames keep counting across
/// episodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct Frame(pub u64);

impl Frame {
    /// The frame that the next tick will produce.
    pub fn next(self) -> Frame {
        Frame(self.0 + 1)
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frame {}", self.0)
    }
}

/// Frame, time and episode of a message. Every message begins with a stamp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Stamp {
    /// The frame.
    pub frame: Frame,
    /// Simulated time since the episode began, accumulated exactly.
    pub sim_time_nanos: u64,
    /// Number of the episode; the first is 1.
    pub episode: u32,
    /// Reserved; 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<Stamp>() == 24);
