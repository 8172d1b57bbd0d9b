//! Turns frames of actors into blocks: the values of each word frame by frame, after two earlier
//! ones. A block holds one actor's presence in a segment and fits into the first-level cache.

use std::collections::BTreeMap;

use protocol::ActorState;

use crate::error::Damage;

/// Words of an [`ActorState`].
pub(crate) const WORDS: usize = 32;
/// Earlier frames that a prediction may use.
pub(crate) const PAST: usize = 2;
/// The most frames in a segment.
pub(crate) const FRAMES_MAX: usize = 64;

/// Slots of a block.
pub(crate) const SLOTS: usize = PAST + FRAMES_MAX;

/// The state of an actor as words.
pub(crate) type Words = [u32; WORDS];

pub(crate) fn words_of(state: &ActorState) -> &Words {
    bytemuck::cast_ref(state)
}

/// The presence of one actor within a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) actor: u32,
    /// Its first frame in the segment.
    pub(crate) from: usize,
    /// The number of frames; never 0.
    pub(crate) len: usize,
    /// How many of its earlier frames are known, up to [`PAST`].
    pub(crate) known: usize,
}

/// The values of one row: the first [`PAST`] slots of a word are earlier ones.
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

/// The last frames of each actor, newest last.
#[derive(Clone, Default)]
pub(crate) struct Past {
    /// Sorted by id.
    last: Vec<(u32, usize, [Words; PAST])>,
    next: Vec<(u32, usize, [Words; PAST])>,
}

impl Past {
    /// Forgets all actors.
    pub(crate) fn forget(&mut self) {
        self.last.clear();
    }

    fn find(&self, actor: u32) -> Option<&(u32, usize, [Words; PAST])> {
        let at = self.last.binary_search_by_key(&actor, |(id, ..)| *id).ok()?;
        Some(&self.last[at])
    }

    /// Returns a row with the number of known earlier frames.
    pub(crate) fn row(&self, actor: u32, from: usize, len: usize) -> Row {
        // An actor that was away has no past.
        let known = if from == 0 { self.find(actor).map_or(0, |(_, n, _)| *n) } else { 0 };
        Row { actor, from, len, known }
    }

    /// Copies the known frames into the slots before the row.
    pub(crate) fn fill(&self, row: &Row, block: &mut Block) {
        if let (1.., Some((_, _, states))) = (row.known, self.find(row.actor)) {
            states.iter().enumerate().for_each(|(slot, words)| block.put(slot, words));
        }
    }

    /// Notes the last frames of a row for the next segment.
    pub(crate) fn keep_last(&mut self, row: &Row, block: &Block, frames: usize) {
        if row.from + row.len == frames {
            let states = std::array::from_fn(|slot| block.take(row.len + slot));
            self.next.push((row.actor, (row.known + row.len).min(PAST), states));
        }
    }

    /// Ends a segment: all its rows are noted.
    pub(crate) fn end_segment(&mut self) {
        if !self.next.is_sorted_by_key(|(id, ..)| *id) {
            self.next.sort_unstable_by_key(|(id, ..)| *id);
        }
        std::mem::swap(&mut self.last, &mut self.next);
        self.next.clear();
    }
}

/// Returns the rows of actors in frames, each sorted by id.
pub(crate) fn presences(frames: &[&[ActorState]], past: &Past) -> Vec<Row> {
    let mut presences: Vec<(u32, usize, usize)> = Vec::new();
    let mut open: BTreeMap<u32, usize> = BTreeMap::new();
    for (index, states) in frames.iter().enumerate() {
        for state in *states {
            let id = state.actor_id.0;
            match open.get(&id).copied() {
                Some(at) if presences[at].1 + presences[at].2 == index => presences[at].2 += 1,
                _ => {
                    open.insert(id, presences.len());
                    presences.push((id, index, 1));
                }
            }
        }
    }
    presences.into_iter().map(|(id, from, len)| past.row(id, from, len)).collect()
}

/// Checks that each frame is sorted by id without duplicates.
pub(crate) fn check_sorted(frames: &[Vec<ActorState>]) -> Result<(), Damage> {
    let twice = |frame: &Vec<ActorState>| frame.windows(2).any(|p| p[0].actor_id == p[1].actor_id);
    if frames.iter().any(twice) { Err(Damage("an actor is there twice")) } else { Ok(()) }
}
