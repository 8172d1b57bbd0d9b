//! The world at one frame.

use std::time::Duration;

use bus::Snapshot;
use bytemuck::TransparentWrapper;
use protocol::{ActorId, ActorState, Frame, SnapshotHeader, WalkerLimbs};

use crate::Actor;

/// A snapshot: the world at one frame, read in the host's own memory. It is `Send` and `Sync`.
pub struct World {
    snapshot: Snapshot,
}

impl World {
    pub(crate) fn new(snapshot: Snapshot) -> World {
        World { snapshot }
    }

    /// The frame.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.header().stamp.frame
    }

    /// Simulated time since the world was loaded.
    #[must_use]
    pub fn sim_time(&self) -> Duration {
        Duration::from_nanos(self.header().stamp.sim_time_nanos)
    }

    /// The number of the world, from 1: loading a world raises it.
    #[must_use]
    pub fn episode(&self) -> u32 {
        self.header().stamp.episode
    }

    /// A hash of everything that decides the future: two worlds with the same hash go on alike.
    #[must_use]
    pub fn state_hash(&self) -> u64 {
        self.header().state_hash
    }

    /// When the snapshot was published: nanoseconds of [`clock`](crate::clock).
    #[must_use]
    pub fn published_nanos(&self) -> u64 {
        self.header().published_nanos
    }

    /// Every actor, sorted by id.
    #[must_use]
    pub fn actors(&self) -> &[Actor] {
        Actor::wrap_slice(self.states())
    }

    /// One actor; `None` if it does not exist at this frame.
    #[must_use]
    pub fn actor(&self, id: ActorId) -> Option<&Actor> {
        self.state(id).map(Actor::wrap_ref)
    }

    /// The header in the protocol's layout: stage clocks and counts. The typed way is
    /// [`World::frame`], [`World::sim_time`], [`World::episode`], [`World::state_hash`] and
    /// [`World::published_nanos`].
    #[must_use]
    pub fn header(&self) -> &SnapshotHeader {
        self.snapshot.header()
    }

    /// Every actor in the protocol's layout, sorted by id. The typed way is [`World::actors`].
    #[must_use]
    pub fn states(&self) -> &[ActorState] {
        self.snapshot.actors()
    }

    /// One actor in the protocol's layout. The typed way is [`World::actor`].
    #[must_use]
    pub fn state(&self, id: ActorId) -> Option<&ActorState> {
        let states = self.states();
        states.binary_search_by_key(&id, |a| a.actor_id).ok().map(|index| &states[index])
    }

    /// The limbs of every fallen walker in the protocol's layout, sorted by id.
    #[must_use]
    pub fn limbs(&self) -> &[WalkerLimbs] {
        self.snapshot.limbs()
    }
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("World")
            .field("header", self.header())
            .field("actors", &self.actors().len())
            .finish()
    }
}
