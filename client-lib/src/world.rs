use bus::Snapshot;
use protocol::{ActorId, ActorState, SnapshotHeader, WalkerLimbs};

/// The world at one frame: the host's own memory, read in place.
pub struct World {
    snapshot: Snapshot,
}

impl World {
    pub(crate) fn new(snapshot: Snapshot) -> World {
        World { snapshot }
    }

    /// Which frame, its hash, its stage clock.
    pub fn header(&self) -> &SnapshotHeader {
        self.snapshot.header()
    }

    /// Every actor, sorted by id.
    pub fn actors(&self) -> &[ActorState] {
        self.snapshot.actors()
    }

    /// The limbs of every fallen walker, sorted by id.
    pub fn limbs(&self) -> &[WalkerLimbs] {
        self.snapshot.limbs()
    }

    /// One actor.
    pub fn actor(&self, id: ActorId) -> Option<&ActorState> {
        let actors = self.actors();
        actors.binary_search_by_key(&id, |a| a.actor_id).ok().map(|index| &actors[index])
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
