//! Columns as bytes: each value as its difference to a prediction.
//!
//! A difference is a Rice code: its lower bits as they are, how often they overflow in ones. How
//! many lower bits there are is chosen for each actor, field and segment.

use std::marker::PhantomData;

use bus::ActorState;

use crate::{
    bits::{BitReader, BitWriter, best_width, class, fold, ordered, unfold},
    error::Damage,
    grid::{Grid, PAST, Past},
    predict::{Step, View, mode},
};

/// Bits of a byte that say how a row is predicted; the others say how wide its numbers are.
const MODE_BITS: u32 = 3;
/// Words that are predicted together: at most this many.
pub(crate) const GROUP_MAX: usize = 4;
/// A guess at each word of a group.
pub(crate) type Guess = [u32; GROUP_MAX];

/// Which columns are kept, and how they are predicted.
pub(crate) trait Scheme {
    /// Words that are kept, in groups of neighbours. What a group is predicted from comes before
    /// it; of itself, only earlier frames.
    const GROUPS: &[&[usize]];
    /// How hard all but the numbers is compressed.
    const LEVEL: i32;
    /// Which modes are worth a try for a group that begins with this word.
    fn modes(word: usize) -> &'static [u8];
    /// Whether a word is a float: then its order is by value.
    fn is_float(word: usize) -> bool;
    /// The bits that the group which begins with `word` will have.
    fn predict(view: &View, word: usize, mode: u8) -> Guess;
}

/// Nobody has more actors and frames in a segment.
const VALUES_MAX: usize = 1 << 26;

/// Writes segments; each but a key segment builds on the one before.
pub(crate) struct Encoder<S> {
    past: Past,
    scheme: PhantomData<S>,
}

/// Reads them in the same order.
pub(crate) struct Decoder<S> {
    past: Past,
    scheme: PhantomData<S>,
}

impl<S: Scheme> Encoder<S> {
    pub(crate) fn new() -> Encoder<S> {
        Encoder { past: Past::default(), scheme: PhantomData }
    }

    /// One segment; `is_key`: it can be read without those before it.
    pub(crate) fn encode(
        &mut self,
        frames: &[&[ActorState]],
        deltas: &[u64],
        is_key: bool,
    ) -> Vec<u8> {
        if is_key {
            self.past.forget();
        }
        let grid = Grid::of_frames(frames, &self.past);
        let steps: Vec<_> = deltas.iter().map(|nanos| Step::of(*nanos)).collect();
        let mut head = Vec::new();
        let mut put = |value: usize| head.extend_from_slice(&(value as u32).to_le_bytes());
        put(grid.frames);
        put(grid.rows.len());
        grid.rows.iter().for_each(|row| put(row.actor as usize));
        grid.rows.iter().for_each(|row| put(row.from));
        grid.rows.iter().for_each(|row| put(row.len));
        let mut how = Vec::new();
        let mut bits = BitWriter::default();
        let (mut best, mut numbers) = (Vec::new(), Vec::new());
        for &group in S::GROUPS {
            for row in &grid.rows {
                let (mut cost, mut taken) = (u32::MAX, mode::LAST);
                for &tried in S::modes(group[0]) {
                    numbers.clear();
                    for index in 0..row.len {
                        let view = View::new(&grid.columns, row, index, &steps);
                        let guess = S::predict(&view, group[0], tried);
                        for (&word, &guess) in group.iter().zip(&guess) {
                            let value = grid.columns[word][view.slot];
                            numbers.push(fold(if S::is_float(word) {
                                ordered(value).wrapping_sub(ordered(guess)) as i32
                            } else {
                                value.wrapping_sub(guess) as i32
                            }));
                        }
                    }
                    let bits = numbers.iter().map(|n| class(*n)).sum();
                    if bits < cost {
                        (cost, taken) = (bits, tried);
                        std::mem::swap(&mut numbers, &mut best);
                    }
                    if cost == 0 {
                        break;
                    }
                }
                if cost == 0 && taken == mode::LAST {
                    how.push(mode::STILL);
                    continue;
                }
                for word in 0..group.len() {
                    let numbers = || best.iter().skip(word).step_by(group.len()).copied();
                    how.push(taken | (best_width(numbers) as u8) << MODE_BITS);
                }
                let widths = &how[how.len() - group.len()..];
                for numbers in best.chunks_exact(group.len()) {
                    for (number, width) in numbers.iter().zip(widths) {
                        bits.push_rice(*number, u32::from(width >> MODE_BITS));
                    }
                }
            }
        }
        grid.remember(&mut self.past);
        head.append(&mut how);
        let packed = zstd::bulk::compress(&head, S::LEVEL).expect("it fits in memory");
        let mut bytes = Vec::with_capacity(packed.len() + 16);
        for len in [head.len() as u32, packed.len() as u32] {
            bytes.extend_from_slice(&len.to_le_bytes());
        }
        bytes.extend_from_slice(&packed);
        bytes.extend_from_slice(&bits.finish());
        bytes
    }
}

/// Takes numbers off the front of bytes.
pub(crate) struct Front<'a>(pub(crate) &'a [u8]);

impl<'a> Front<'a> {
    pub(crate) fn bytes(&mut self, len: usize) -> Result<&'a [u8], Damage> {
        let (front, rest) = self.0.split_at_checked(len).ok_or(Damage("it ends early"))?;
        self.0 = rest;
        Ok(front)
    }

    pub(crate) fn number(&mut self) -> Result<usize, Damage> {
        let bytes = self.bytes(4)?;
        Ok(u32::from_le_bytes(bytes.try_into().expect("four bytes")) as usize)
    }

    pub(crate) fn numbers(&mut self, count: usize) -> Result<Vec<usize>, Damage> {
        let bytes = self.bytes(count.checked_mul(4).ok_or(Damage("a count is absurd"))?)?;
        let number = |b: &[u8; 4]| u32::from_le_bytes(*b) as usize;
        Ok(bytes.as_chunks::<4>().0.iter().map(number).collect())
    }

    /// What [`zstd`] packed into the next `len` bytes.
    pub(crate) fn unpacked(&mut self, len: usize, whole: usize) -> Result<Vec<u8>, Damage> {
        if whole > VALUES_MAX {
            return Err(Damage("a length is absurd"));
        }
        let packed = self.bytes(len)?;
        let bytes = zstd::bulk::decompress(packed, whole).map_err(|_| Damage("zstd refuses it"))?;
        if bytes.len() == whole { Ok(bytes) } else { Err(Damage("zstd finds another length")) }
    }
}

impl<S: Scheme> Decoder<S> {
    pub(crate) fn new() -> Decoder<S> {
        Decoder { past: Past::default(), scheme: PhantomData }
    }

    /// One segment's frames; `deltas` are their lengths.
    pub(crate) fn decode(
        &mut self,
        bytes: &[u8],
        deltas: &[u64],
        is_key: bool,
        out: &mut Vec<Vec<ActorState>>,
    ) -> Result<(), Damage> {
        if is_key {
            self.past.forget();
        }
        let mut front = Front(bytes);
        let (whole, packed) = (front.number()?, front.number()?);
        let head = front.unpacked(packed, whole)?;
        let mut bits = BitReader::new(front.0);
        let mut head = Front(&head);
        let (frames, rows) = (head.number()?, head.number()?);
        if frames != deltas.len() {
            return Err(Damage("it has another number of frames than its inputs"));
        }
        let (ids, from, len) = (head.numbers(rows)?, head.numbers(rows)?, head.numbers(rows)?);
        let fits = |from: usize, len: usize| from.checked_add(len).is_some_and(|e| e <= frames);
        if from.iter().zip(&len).any(|(f, l)| !fits(*f, *l)) || rows * (frames + 2) > VALUES_MAX {
            return Err(Damage("a stay outlasts it"));
        }
        let stays = ids.iter().zip(from.iter().zip(&len)).map(|(id, (f, l))| (*id as u32, *f, *l));
        let mut grid = Grid::new(stays, frames, &self.past);
        let steps: Vec<_> = deltas.iter().map(|nanos| Step::of(*nanos)).collect();
        for &group in S::GROUPS {
            for index in 0..rows {
                let row = grid.rows[index];
                let first = head.bytes(1)?[0];
                if first == mode::STILL {
                    for &word in group {
                        let column = &mut grid.columns[word];
                        let was = if row.known > 0 { column[row.at - 1] } else { 0 };
                        column[row.at..][..row.len].fill(was);
                    }
                    continue;
                }
                let mut how = [first; GROUP_MAX];
                how[1..group.len()].copy_from_slice(head.bytes(group.len() - 1)?);
                let mode = first & ((1 << MODE_BITS) - 1);
                if mode > mode::MOTION[2] {
                    return Err(Damage("it predicts by no rule we know"));
                }
                if let (&[word], mode::LAST | mode::LINEAR) = (group, mode) {
                    let width = u32::from(first >> MODE_BITS);
                    let column = &mut grid.columns[word][row.at - PAST..row.at + row.len];
                    if S::is_float(word) {
                        go_on::<true>(column, row.known, mode, width, &mut bits)?;
                    } else {
                        go_on::<false>(column, row.known, mode, width, &mut bits)?;
                    }
                    continue;
                }
                for step in 0..row.len {
                    let view = View::new(&grid.columns, &row, step, &steps);
                    let guess = S::predict(&view, group[0], mode);
                    for (place, &word) in group.iter().enumerate() {
                        let number = bits.pull_rice(u32::from(how[place] >> MODE_BITS))?;
                        let (guess, difference) = (guess[place], unfold(number) as u32);
                        grid.columns[word][row.at + step] = if S::is_float(word) {
                            ordered(ordered(guess).wrapping_add(difference))
                        } else {
                            guess.wrapping_add(difference)
                        };
                    }
                }
            }
        }
        grid.remember(&mut self.past);
        grid.write_frames(out)
    }
}

/// Most columns go on as they were, or as straight lines: the same as their prediction, faster.
#[inline]
fn go_on<const IS_FLOAT: bool>(
    column: &mut [u32],
    known: usize,
    mode: u8,
    width: u32,
    bits: &mut BitReader,
) -> Result<(), Damage> {
    let (mut before, mut last) = (column[0], column[1]);
    for (step, room) in column[PAST..].iter_mut().enumerate() {
        let guess = match (mode, known + step) {
            (_, 0) => 0,
            (mode::LINEAR, 2..) if IS_FLOAT => {
                let (a, b) = (f32::from_bits(last), f32::from_bits(before));
                (a + (a - b)).to_bits()
            }
            (mode::LINEAR, 2..) => last.wrapping_add(last.wrapping_sub(before)),
            _ => last,
        };
        let difference = unfold(bits.pull_rice(width)?) as u32;
        *room = if IS_FLOAT {
            ordered(ordered(guess).wrapping_add(difference))
        } else {
            guess.wrapping_add(difference)
        };
        (before, last) = (last, *room);
    }
    Ok(())
}
