//! Everybody as the bus sees them, side by side in memory as a snapshot has them.

use protocol::{ActorId, ActorState, Name};

use crate::hash::StateHash;

/// Every actor's published state and role, by id; of who does not change, the digest of both is
/// kept.
#[derive(Default)]
pub(super) struct Cast {
    ids: Vec<ActorId>,
    states: Vec<ActorState>,
    roles: Vec<Name>,
    digests: Vec<Option<u64>>,
}

impl Cast {
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    pub(super) fn states(&self) -> &[ActorState] {
        &self.states
    }

    pub(super) fn roles(&self) -> &[Name] {
        &self.roles
    }

    pub(super) fn get(&self, id: ActorId) -> Option<&ActorState> {
        self.ids.binary_search(&id).ok().map(|index| &self.states[index])
    }

    /// For who changes it.
    pub(super) fn get_mut(&mut self, id: ActorId) -> Option<&mut ActorState> {
        let index = self.ids.binary_search(&id).ok()?;
        self.digests[index] = None;
        Some(&mut self.states[index])
    }

    /// Adds one, or puts it in the place of who has its id.
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
        }
    }

    /// Lets `tell` write the state of everybody in `stirred`, which is sorted; keeps the digests
    /// of the others.
    pub(super) fn renew(&mut self, stirred: &[u32], mut tell: impl FnMut(&mut ActorState)) {
        let mut stirred = stirred.iter().copied().peekable();
        for index in 0..self.ids.len() {
            let id = self.ids[index].0;
            while stirred.next_if(|other| *other < id).is_some() {}
            if stirred.next_if_eq(&id).is_some() {
                tell(&mut self.states[index]);
                self.digests[index] = None;
            } else if self.digests[index].is_none() {
                self.digests[index] = Some(self.digest(index));
            }
        }
    }

    pub(super) fn hash(&self, hash: &mut StateHash) {
        for (index, digest) in self.digests.iter().enumerate() {
            hash.word(digest.unwrap_or_else(|| self.digest(index)));
        }
    }

    fn digest(&self, index: usize) -> u64 {
        let mut hash = StateHash::new();
        hash.bytes(bytemuck::bytes_of(&self.states[index]));
        hash.bytes(&self.roles[index].0);
        hash.value()
    }
}
