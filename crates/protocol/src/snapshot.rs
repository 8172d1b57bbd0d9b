use bytemuck::{Pod, Zeroable};

use crate::Stamp;

/// The most frames that rendering may trail behind the world.
pub const PIPELINE_MAX: u32 = 3;

/// Header of a snapshot; the payload is the [`crate::ActorState`]s, sorted by id.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SnapshotHeader {
    /// Which frame this is.
    pub stamp: Stamp,
    /// How much simulated time this frame took.
    pub delta_nanos: u64,
    /// Over everything that decides the future.
    pub state_hash: u64,
    /// How many entries this frame's journal has, in all its parts.
    pub journal_entries: u32,
    /// How many collisions began in this frame.
    pub collisions: u32,
    /// Stage clock, monotonic: the host began this frame.
    pub begin_nanos: u64,
    /// Stage clock: commands were applied.
    pub applied_nanos: u64,
    /// Stage clock: physics was done.
    pub stepped_nanos: u64,
    /// Stage clock: the snapshot was sent.
    pub published_nanos: u64,
}

const _: () = assert!(size_of::<SnapshotHeader>() == 80);
