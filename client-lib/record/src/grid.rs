//! Frames of actors turned into columns: for each word of a state and each actor, its values frame
//! by frame, two earlier ones before them.

use std::collections::BTreeMap;

use bus::ActorState;

use crate::error::Damage;

/// Words of an [`ActorState`].
pub(crate) const WORDS: usize = 32;
/// Earlier frames that a prediction may look at.
pub(crate) const PAST: usize = 2;

/// One actor's state as words.
pub(crate) type Words = [u32; WORDS];

/// One actor's stay within a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) actor: u32,
    /// Its first frame in the segment.
    pub(crate) from: usize,
    /// Frames that it is there.
    pub(crate) len: usize,
    /// How many of its earlier frames are known, up to [`PAST`].
    pub(crate) known: usize,
    /// Where its first value lies in a column; its past lies before it.
    pub(crate) at: usize,
}

/// The columns of a segment.
pub(crate) struct Grid {
    pub(crate) rows: Vec<Row>,
    pub(crate) columns: Vec<Vec<u32>>,
    pub(crate) frames: usize,
}

/// What is known of each actor's last frames, newest last.
#[derive(Clone, Default)]
pub(crate) struct Past {
    last: BTreeMap<u32, (usize, [Words; PAST])>,
}

impl Past {
    /// Nobody is known.
    pub(crate) fn forget(&mut self) {
        self.last.clear();
    }
}

pub(crate) fn words_of(state: &ActorState) -> &Words {
    bytemuck::cast_ref(state)
}

impl Grid {
    /// Rows for actors that come and go as told: id, first frame, frames. Their pasts are filled in.
    pub(crate) fn new(
        stays: impl IntoIterator<Item = (u32, usize, usize)>,
        frames: usize,
        past: &Past,
    ) -> Grid {
        let mut rows = Vec::new();
        let mut end = 0;
        for (actor, from, len) in stays {
            // Who was away has no past.
            let known = if from == 0 { past.last.get(&actor).map_or(0, |(n, _)| *n) } else { 0 };
            rows.push(Row { actor, from, len, known, at: end + PAST });
            end += PAST + len;
        }
        let mut columns = vec![vec![0; end]; WORDS];
        for row in rows.iter().filter(|row| row.known > 0) {
            let (_, states) = &past.last[&row.actor];
            for (back, state) in states.iter().rev().take(row.known).enumerate() {
                for (column, word) in columns.iter_mut().zip(state) {
                    column[row.at - 1 - back] = *word;
                }
            }
        }
        Grid { rows, columns, frames }
    }

    /// The columns of frames, each sorted by id.
    pub(crate) fn of_frames(frames: &[&[ActorState]], past: &Past) -> Grid {
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
        let mut grid = Grid::new(stays, frames.len(), past);
        let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (index, row) in grid.rows.iter().enumerate() {
            at.entry(row.actor).or_default().push(index);
        }
        for (index, states) in frames.iter().enumerate() {
            for state in *states {
                let of = &at[&state.actor_id.0];
                let mut rows = of.iter().map(|i| &grid.rows[*i]);
                let row = rows.rfind(|r| (r.from..r.from + r.len).contains(&index));
                let slot = row.map(|r| r.at + index - r.from).expect("it has a row");
                for (column, word) in grid.columns.iter_mut().zip(words_of(state)) {
                    column[slot] = *word;
                }
            }
        }
        grid
    }

    /// Back to frames, each sorted by id; into vectors that are reused.
    pub(crate) fn write_frames(&self, out: &mut Vec<Vec<ActorState>>) -> Result<(), Damage> {
        out.resize_with(self.frames, Vec::new);
        out.iter_mut().for_each(Vec::clear);
        for row in &self.rows {
            for index in 0..row.len {
                let mut words: Words =
                    std::array::from_fn(|word| self.columns[word][row.at + index]);
                words[0] = row.actor;
                let frame = out.get_mut(row.from + index).ok_or(Damage("a stay outlasts it"))?;
                frame.push(bytemuck::cast(words));
            }
        }
        for frame in out {
            if !frame.is_sorted_by_key(|state: &ActorState| state.actor_id) {
                frame.sort_unstable_by_key(|state| state.actor_id);
            }
            if frame.windows(2).any(|pair| pair[0].actor_id == pair[1].actor_id) {
                return Err(Damage("an actor is there twice"));
            }
        }
        Ok(())
    }

    /// What the next segment may know.
    pub(crate) fn remember(&self, past: &mut Past) {
        past.last.clear();
        for row in self.rows.iter().filter(|row| row.from + row.len == self.frames) {
            let known = (row.known + row.len).min(PAST);
            let end = row.at + row.len;
            let states = std::array::from_fn(|i| {
                std::array::from_fn(|word| self.columns[word][end - PAST + i])
            });
            past.last.insert(row.actor, (known, states));
        }
    }
}
