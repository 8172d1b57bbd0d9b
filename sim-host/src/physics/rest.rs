//! Everybody, and who rests: what does nothing costs nothing.
//!
//! Who rests stays as it is until somebody wants to change it, and to want that is to wake it:
//! nobody gets hold of an actor otherwise. So its digest is known, and what was published of it
//! holds. That somebody rests changes nothing of what happens; it is not saved.

use std::ops::Deref;

use super::{actor::Actor, digest::Digest};

/// Everybody, sorted by id.
#[derive(Default)]
pub(super) struct Actors {
    list: Vec<Actor>,
    /// In the same order, of who rests: the digest.
    rest: Vec<Option<u64>>,
}

impl Deref for Actors {
    type Target = [Actor];

    fn deref(&self) -> &[Actor] {
        &self.list
    }
}

impl Actors {
    /// From a list that is sorted by id. Everybody is awake.
    pub(super) fn new(list: Vec<Actor>) -> Actors {
        let rest = vec![None; list.len()];
        Actors { list, rest }
    }

    /// For who changes it: it rests no longer.
    pub(super) fn wake(&mut self, index: usize) -> &mut Actor {
        self.rest[index] = None;
        &mut self.list[index]
    }

    pub(super) fn insert(&mut self, actor: Actor) {
        let at = self.list.partition_point(|a| a.id < actor.id);
        self.list.insert(at, actor);
        self.rest.insert(at, None);
    }

    pub(super) fn remove(&mut self, index: usize) -> Actor {
        self.rest.remove(index);
        self.list.remove(index)
    }

    /// Who is awake, by id.
    pub(super) fn awake(&self) -> impl Iterator<Item = &Actor> {
        self.list.iter().zip(&self.rest).filter(|(_, rest)| rest.is_none()).map(|(actor, _)| actor)
    }

    /// The same, for who moves them.
    pub(super) fn awake_mut(&mut self) -> impl Iterator<Item = &mut Actor> {
        let all = self.list.iter_mut().zip(&self.rest);
        all.filter(|(_, rest)| rest.is_none()).map(|(actor, _)| actor)
    }

    /// Lets those rest who are awake and of whom `digest` gives one.
    pub(super) fn settle(&mut self, digest: impl Fn(&Actor) -> Option<u64>) {
        for (actor, rest) in self.list.iter().zip(&mut self.rest) {
            if rest.is_none() {
                *rest = digest(actor);
            }
        }
    }

    /// Takes in everybody's digest.
    pub(super) fn hash(&self, sum: &mut Digest, digest: impl Fn(&Actor) -> u64) {
        for (actor, rest) in self.list.iter().zip(&self.rest) {
            sum.word(rest.unwrap_or_else(|| digest(actor)));
        }
    }
}
