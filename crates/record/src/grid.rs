//! Frames of actors turned into blocks: for each word of a state its values frame by frame, two
//! earlier ones before them. A block holds one actor's stay and fits into the nearest cache.

use std::collections::BTreeMap;

use protocol::ActorState;

use crate::error::Damage;

/// Words of an [`ActorState`].
pub(crate) const WORDS: usize = 32;
/// Earlier frames that a prediction may look at.
pub(crate) const PAST: usize = 2;
/// Frames of a segment at most.
pub(crate) const FRAMES_MAX: usize = 64;

/// Slots of a block.
pub(crate) const SLOTS: usize = PAST + FRAMES_MAX;

/// One actor's state as words.
pub(crate) type Words = [u32; WORDS];

pub(crate) fn words_of(state: &ActorState) -> &Words {
    bytemuck::cast_ref(state)
}

/// One actor's stay within a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) actor: u32,
    /// Its first frame in the segment.
    pub(crate) from: usize,
    /// Frames that it is there; never 0.
    pub(crate) len: usize,
    /// How many of its earlier frames are known, up to [`PAST`].
    pub(crate) known: usize,
}

/// One stay's values: the first [`PAST`] slots of a word are those before it.
pub(crate) struct Block {
    pub(crate) cells: [[u32; SLOTS]; WORDS],
}

impl Block {
    pub(crate) fn new() -> Box<Block> {
        Box::new(Block { cells: [[0; SLOTS]; WORDS] })
    }

    pub(crate) fn put(&mut self, slot: usize, words: &Words) {
        for (cells, word) in self.cells.iter_mut().zip(words) {
            cells[slot] = *word;
        }
    }

    #[inline]
    pub(crate) fn take(&self, slot: usize) -> Words {
        let mut words = [0; WORDS];
        for (word, cells) in words.iter_mut().zip(&self.cells) {
            *word = cells[slot];
        }
        words
    }

    #[inline]
    pub(crate) fn float(&self, word: usize, slot: usize) -> f32 {
        f32::from_bits(self.cells[word][slot])
    }
}

/// What is known of each actor's last frames, newest last.
#[derive(Clone, Default)]
pub(crate) struct Past {
    /// By id.
    last: Vec<(u32, usize, [Words; PAST])>,
    next: Vec<(u32, usize, [Words; PAST])>,
}

impl Past {
    /// Nobody is known.
    pub(crate) fn forget(&mut self) {
        self.last.clear();
    }

    fn find(&self, actor: u32) -> Option<&(u32, usize, [Words; PAST])> {
        let at = self.last.binary_search_by_key(&actor, |(id, ..)| *id).ok()?;
        Some(&self.last[at])
    }

    /// A stay with what is known before it.
    pub(crate) fn row(&self, actor: u32, from: usize, len: usize) -> Row {
        // Who was away has no past.
        let known = if from == 0 { self.find(actor).map_or(0, |(_, n, _)| *n) } else { 0 };
        Row { actor, from, len, known }
    }

    /// Puts what is known into the slots before the stay.
    pub(crate) fn fill(&self, row: &Row, block: &mut Block) {
        if let (1.., Some((_, _, states))) = (row.known, self.find(row.actor)) {
            states.iter().enumerate().for_each(|(slot, words)| block.put(slot, words));
        }
    }

    /// What the next segment of `frames` may know of this stay.
    pub(crate) fn note(&mut self, row: &Row, block: &Block, frames: usize) {
        if row.from + row.len == frames {
            let states = std::array::from_fn(|slot| block.take(row.len + slot));
            self.next.push((row.actor, (row.known + row.len).min(PAST), states));
        }
    }

    /// All stays of the segment are noted.
    pub(crate) fn turn(&mut self) {
        if !self.next.is_sorted_by_key(|(id, ..)| *id) {
            self.next.sort_unstable_by_key(|(id, ..)| *id);
        }
        std::mem::swap(&mut self.last, &mut self.next);
        self.next.clear();
    }
}

/// The stays of actors in frames, each sorted by id.
pub(crate) fn stays(frames: &[&[ActorState]], past: &Past) -> Vec<Row> {
    let mut stays: Vec<(u32, usize, usize)> = Vec::new();
    let mut open: BTreeMap<u32, usize> = BTreeMap::new();
    for (index, states) in frames.iter().enumerate() {
        for state in *states {
            let id = state.actor_id.0;
            match open.get(&id).copied() {
                Some(at) if stays[at].1 + stays[at].2 == index => stays[at].2 += 1,
                _ => {
                    open.insert(id, stays.len());
                    stays.push((id, index, 1));
                }
            }
        }
    }
    stays.into_iter().map(|(id, from, len)| past.row(id, from, len)).collect()
}

/// Nobody is in a frame twice; each is sorted by id.
pub(crate) fn settle(frames: &[Vec<ActorState>]) -> Result<(), Damage> {
    let twice = |frame: &Vec<ActorState>| frame.windows(2).any(|p| p[0].actor_id == p[1].actor_id);
    if frames.iter().any(twice) { Err(Damage("an actor is there twice")) } else { Ok(()) }
}
