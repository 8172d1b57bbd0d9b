use bytemuck::{Pod, Zeroable};

use crate::{ActorState, Block, Stamp, WalkerLimbs};

/// The most frames that rendering may trail behind the world.
pub const PIPELINE_MAX: u32 = 3;

/// Header of a snapshot. The payload holds `actor_count` [`ActorState`]s and then `limbs_count`
/// [`WalkerLimbs`], each sorted by id, in whole [`Block`]s.
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
    /// How many actors the payload holds.
    pub actor_count: u32,
    /// How many fallen walkers the payload holds the limbs of.
    pub limbs_count: u32,
    /// Stage clock, monotonic: the host began this frame.
    pub begin_nanos: u64,
    /// Stage clock: commands were applied.
    pub applied_nanos: u64,
    /// Stage clock: physics was done.
    pub stepped_nanos: u64,
    /// Stage clock: the snapshot was sent.
    pub published_nanos: u64,
}

const _: () = assert!(size_of::<SnapshotHeader>() == 88);

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
