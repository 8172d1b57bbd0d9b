use std::fmt;

use bytemuck::{Pod, Zeroable};

/// The ordinal number of a simulation step.
///
/// Frame 0 is the world as loaded; the n-th tick produces frame n. Frames grow for ever, across
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

/// When something on the bus is true. Every message begins with one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Stamp {
    /// The step it belongs to.
    pub frame: Frame,
    /// Simulated time since the episode began, accumulated exactly.
    pub sim_time_nanos: u64,
    /// Counts the worlds that this host has loaded; the first is 1.
    pub episode: u32,
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<Stamp>() == 24);
