//! The published states of actors, contiguous in memory as in a snapshot.

use mesh::WordHash;
use protocol::{ActorId, ActorState, Name, WalkerLimbs};

/// The published state and role of every actor, by id, and cached digests of those that do not
/// change.
#[derive(Default)]
pub(super) struct ActorTable {
    ids: Vec<ActorId>,
    states: Vec<ActorState>,
    roles: Vec<Name>,
    digests: Vec<Option<u64>>,
    /// The limbs of fallen walkers, by id.
    limbs: Vec<WalkerLimbs>,
}

impl ActorTable {
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    pub(super) fn states(&self) -> &[ActorState] {
        &self.states
    }

    pub(super) fn limbs(&self) -> &[WalkerLimbs] {
        &self.limbs
    }

    /// Replaces or removes the limbs of one walker.
    pub(super) fn set_limbs(&mut self, id: ActorId, limbs: Option<WalkerLimbs>) {
        let found = self.limbs.binary_search_by_key(&id, |walker| walker.actor_id);
        match (found, limbs) {
            (Ok(index), Some(limbs)) => self.limbs[index] = limbs,
            (Ok(index), None) => drop(self.limbs.remove(index)),
            (Err(index), Some(limbs)) => self.limbs.insert(index, limbs),
            (Err(_), None) => return,
        }
        if let Ok(index) = self.ids.binary_search(&id) {
            self.digests[index] = None;
        }
    }

    pub(super) fn roles(&self) -> &[Name] {
        &self.roles
    }

    pub(super) fn get(&self, id: ActorId) -> Option<&ActorState> {
        self.ids.binary_search(&id).ok().map(|index| &self.states[index])
    }

    /// Returns the state of an actor for a change.
    pub(super) fn get_mut(&mut self, id: ActorId) -> Option<&mut ActorState> {
        let index = self.ids.binary_search(&id).ok()?;
        self.digests[index] = None;
        Some(&mut self.states[index])
    }

    /// Adds an actor, or replaces the one with its id.
    pub(super) fn insert(&mut self, state: ActorState, role: Name) {
        match self.ids.binary_search(&state.actor_id) {
            Ok(index) => {
                (self.states[index], self.roles[index]) = (state, role);
                self.digests[index] = None;
            }
            Err(index) => {
                self.ids.insert(index, state.actor_id);
                self.states.insert(index, state);
                self.roles.insert(index, role);
                self.digests.insert(index, None);
            }
        }
    }

    pub(super) fn remove(&mut self, id: ActorId) {
        if let Ok(index) = self.ids.binary_search(&id) {
            self.ids.remove(index);
            self.states.remove(index);
            self.roles.remove(index);
            self.digests.remove(index);
            self.set_limbs(id, None);
        }
    }

    /// Calls `update` for the state of every actor in `active`, which is sorted; it returns the
    /// limbs of a fallen walker. Caches the digests of the others.
    pub(super) fn update_active(
        &mut self,
        active: &[u32],
        mut update: impl FnMut(&mut ActorState) -> Option<WalkerLimbs>,
    ) {
        let mut active = active.iter().copied().peekable();
        for index in 0..self.ids.len() {
            let id = self.ids[index].0;
            while active.next_if(|other| *other < id).is_some() {}
            if active.next_if_eq(&id).is_some() {
                let limbs = update(&mut self.states[index]);
                if limbs.is_some() || !self.limbs.is_empty() {
                    self.set_limbs(ActorId(id), limbs);
                }
                self.digests[index] = None;
            } else if self.digests[index].is_none() {
                self.digests[index] = Some(self.digest(index));
            }
        }
    }

    pub(super) fn hash(&self, hash: &mut WordHash) {
        for (index, digest) in self.digests.iter().enumerate() {
            hash.word(digest.unwrap_or_else(|| self.digest(index)));
        }
    }

    fn digest(&self, index: usize) -> u64 {
        let mut hash = WordHash::new();
        hash.bytes(bytemuck::bytes_of(&self.states[index]));
        hash.bytes(&self.roles[index].0);
        if let Some(limbs) = WalkerLimbs::find(&self.limbs, self.ids[index]) {
            hash.bytes(bytemuck::bytes_of(limbs));
        }
        hash.value()
    }
}
