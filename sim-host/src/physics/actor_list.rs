//! The actors by id, and which of them sleep.
//!
//! A sleeping actor does not change until a command does, and every mutable access wakes it. So its
//! digest stays valid, and so does its published state. Sleeping changes no result and is not
//! saved.

use std::ops::Deref;

use super::{actor::Actor, digest::Digest};

/// The actors, sorted by id.
#[derive(Default)]
pub(super) struct ActorList {
    actors: Vec<Actor>,
    /// For each actor, its digest if it sleeps.
    sleeping: Vec<Option<u64>>,
}

impl Deref for ActorList {
    type Target = [Actor];

    fn deref(&self) -> &[Actor] {
        &self.actors
    }
}

impl ActorList {
    /// Creates a list from actors sorted by id, all awake.
    pub(super) fn new(actors: Vec<Actor>) -> ActorList {
        let sleeping = vec![None; actors.len()];
        ActorList { actors, sleeping }
    }

    /// Wakes an actor and returns it for a change.
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

    /// Returns the awake actors, by id.
    pub(super) fn awake(&self) -> impl Iterator<Item = &Actor> {
        self.actors
            .iter()
            .zip(&self.sleeping)
            .filter(|(_, sleeping)| sleeping.is_none())
            .map(|(actor, _)| actor)
    }

    /// Returns the awake actors for a change, by id.
    pub(super) fn awake_mut(&mut self) -> impl Iterator<Item = &mut Actor> {
        let all = self.actors.iter_mut().zip(&self.sleeping);
        all.filter(|(_, sleeping)| sleeping.is_none()).map(|(actor, _)| actor)
    }

    /// Puts to sleep every awake actor for which `digest` returns a digest.
    pub(super) fn sleep_where(&mut self, digest: impl Fn(&Actor) -> Option<u64>) {
        for (actor, sleeping) in self.actors.iter().zip(&mut self.sleeping) {
            if sleeping.is_none() {
                *sleeping = digest(actor);
            }
        }
    }

    /// Appends the digest of each actor to `sum`.
    pub(super) fn hash(&self, sum: &mut Digest, digest: impl Fn(&Actor) -> u64) {
        for (actor, sleeping) in self.actors.iter().zip(&self.sleeping) {
            sum.word(sleeping.unwrap_or_else(|| digest(actor)));
        }
    }
}
