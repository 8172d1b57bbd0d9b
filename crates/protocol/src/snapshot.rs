use bytemuck::{Pod, Zeroable};

use crate::{ActorState, Block, Stamp, WalkerLimbs};

/// The most frames that rendering may trail behind the world.
pub const PIPELINE_MAX: u32 = 3;

/// Header of a snapshot. The payload holds `actor_count` [`ActorState`]s and then `limbs_count`
/// [`WalkerLimbs`], each sorted by id, in whole [`Block`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SnapshotHeader {
    /// The frame.
    pub stamp: Stamp,
    /// Simulated time of this frame.
    pub delta_nanos: u64,
    /// State hash: over everything that determines future frames.
    pub state_hash: u64,
    /// Number of entries of this frame's journal, in all its parts.
    pub journal_entries: u32,
    /// Number of collisions in this frame.
    pub collisions: u32,
    /// Number of actors in the payload.
    pub actor_count: u32,
    /// Number of fallen walkers in the payload.
    pub limbs_count: u32,
    /// Monotonic clock when the host began this frame.
    pub begin_nanos: u64,
    /// Monotonic clock when commands had been applied.
    pub applied_nanos: u64,
    /// Monotonic clock when physics was done.
    pub stepped_nanos: u64,
    /// Monotonic clock when the snapshot was sent.
    pub published_nanos: u64,
    /// Serial after the last part of this frame's journal: a stage that has received so many parts has
    /// everything that decided this frame.
    pub journal_serial: u64,
}

const _: () = assert!(size_of::<SnapshotHeader>() == 96);

impl SnapshotHeader {
    /// Bytes of the actors, from the start of the payload.
    pub fn actor_bytes(&self) -> usize {
        self.actor_count as usize * size_of::<ActorState>()
    }

    /// Bytes of the limbs, right after the actors.
    pub fn limbs_bytes(&self) -> usize {
        self.limbs_count as usize * size_of::<WalkerLimbs>()
    }

    /// Length of the payload in blocks.
    pub fn payload_blocks(&self) -> usize {
        (self.actor_bytes() + self.limbs_bytes()).div_ceil(size_of::<Block>())
    }
}
