//! The actors by id, and which of them sleep.
//!
//! A sleeping actor does not change until a command does, and every mutable access wakes it. So its
//! digest stays valid, and so does its published state. Sleeping changes no result and is not
//! saved.

use std::ops::Deref;

use super::{actor::Actor, digest::Digest, parallel::for_each};

/// Actors per thread that are worth a thread.
const LEAST_DIGESTS: usize = 1000;

/// The actors, sorted by id.
#[derive(Default)]
pub(super) struct ActorList {
    actors: Vec<Actor>,
    /// Their ids: a search reads few cache lines.
    ids: Vec<u32>,
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
        let ids = actors.iter().map(|actor| actor.id).collect();
        ActorList { actors, ids, sleeping }
    }

    /// Returns the index of the actor with this id.
    pub(super) fn index_of(&self, id: u32) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// Wakes an actor and returns it for a change.
    pub(super) fn wake(&mut self, index: usize) -> &mut Actor {
        self.sleeping[index] = None;
        &mut self.actors[index]
    }

    pub(super) fn insert(&mut self, actor: Actor) {
        let at = self.ids.partition_point(|id| *id < actor.id);
        self.ids.insert(at, actor.id);
        self.actors.insert(at, actor);
        self.sleeping.insert(at, None);
    }

    pub(super) fn remove(&mut self, index: usize) -> Actor {
        self.sleeping.remove(index);
        self.ids.remove(index);
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

    /// Appends the digest of each actor to `sum`, computed on at most `threads` threads.
    pub(super) fn hash(
        &self,
        sum: &mut Digest,
        threads: usize,
        digest: impl Fn(&Actor) -> u64 + Sync,
    ) {
        let mut digests: Vec<(&Actor, Option<u64>)> =
            self.actors.iter().zip(self.sleeping.iter().copied()).collect();
        for_each(&mut digests, threads, LEAST_DIGESTS, |(actor, known)| {
            known.get_or_insert_with(|| digest(actor));
        });
        digests.iter().for_each(|(_, known)| sum.word(known.unwrap_or_default()));
    }
}
