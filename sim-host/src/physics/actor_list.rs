//! Everybody, and who rests: what does nothing costs nothing.
//!
//! Who rests stays as it is until somebody wants to change it, and to want that is to wake it:
//! nobody gets hold of an actor otherwise. So its digest is known, and what was published of it
//! holds. That somebody rests changes nothing of what happens; it is not saved.

use std::ops::Deref;

use super::{actor::Actor, digest::Digest};

/// Everybody, sorted by id.
#[derive(Default)]
pub(super) struct ActorList {
    actors: Vec<Actor>,
    /// In the same order, of who rests: the digest.
    sleeping: Vec<Option<u64>>,
}

impl Deref for ActorList {
    type Target = [Actor];

    fn deref(&self) -> &[Actor] {
        &self.actors
    }
}

impl ActorList {
    /// From a list that is sorted by id. Everybody is awake.
    pub(super) fn new(actors: Vec<Actor>) -> ActorList {
        let sleeping = vec![None; actors.len()];
        ActorList { actors, sleeping }
    }

    /// For who changes it: it rests no longer.
    pub(super) fn wake(&mut self, index: usize) -> &mut Actor {
        self.sleeping[index] = None;
        &mut self.actors[index]
    }

    pub(super) fn insert(&mut self, actor: Actor) {
        let at = self.actors.partition_point(|a| a.id < actor.id);
        self.actors.insert(at, actor);
        self.sleeping.insert(at, None);
    }

    pub(super) fn remove(&mut self, index: usize) -> Actor {
        self.sleeping.remove(index);
        self.actors.remove(index)
    }

    /// Who is awake, by id.
    pub(super) fn awake(&self) -> impl Iterator<Item = &Actor> {
        self.actors
            .iter()
            .zip(&self.sleeping)
            .filter(|(_, sleeping)| sleeping.is_none())
            .map(|(actor, _)| actor)
    }

    /// The same, for who moves them.
    pub(super) fn awake_mut(&mut self) -> impl Iterator<Item = &mut Actor> {
        let all = self.actors.iter_mut().zip(&self.sleeping);
        all.filter(|(_, sleeping)| sleeping.is_none()).map(|(actor, _)| actor)
    }

    /// Lets those rest who are awake and of whom `digest` gives one.
    pub(super) fn sleep_where(&mut self, digest: impl Fn(&Actor) -> Option<u64>) {
        for (actor, sleeping) in self.actors.iter().zip(&mut self.sleeping) {
            if sleeping.is_none() {
                *sleeping = digest(actor);
            }
        }
    }

    /// Takes in everybody's digest.
    pub(super) fn hash(&self, sum: &mut Digest, digest: impl Fn(&Actor) -> u64) {
        for (actor, sleeping) in self.actors.iter().zip(&self.sleeping) {
            sum.word(sleeping.unwrap_or_else(|| digest(actor)));
        }
    }
}
