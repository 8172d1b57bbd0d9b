//! Encodes the presence of an actor in a segment: each value as its difference to a prediction.
//!
//! A difference is a Rice code: its lower bits, and the overflow as a number of zeros. The number
//! of lower bits is chosen for each actor, word and segment. Writer and reader walk over a block by
//! the same code, with one [`Pass`] or the other, so that they cannot predict differently.

use std::{marker::PhantomData, mem::take, panic::resume_unwind, thread};

use protocol::ActorState;

use crate::{
    bits::{BitReader, BitWriter, STREAMS, best_width, class, fold, unfold},
    error::Damage,
    grid::{Block, FRAMES_MAX, PAST, Past, Row, check_sorted, presences, words_of},
    space::Space,
};

/// The most words that are predicted together, each in a bit stream of its own.
const GROUP_MAX: usize = STREAMS;
/// In place of a width: all differences of the word are 0.
const NONE: u32 = 32;

/// How a group of words is predicted.
pub(crate) mod mode {
    /// The whole group is unchanged.
    pub(crate) const UNCHANGED: u8 = 0;
    /// Each value is the last one.
    pub(crate) const LAST: u8 = 1;
    /// Each value continues linearly.
    pub(crate) const LINEAR: u8 = 2;
    /// By the laws of motion, up to three of them.
    pub(crate) const MOTION: u8 = 3;
    pub(crate) const MOTION_LAST: u8 = 5;
    /// In whole steps of the word's grid, on which all its values lie.
    pub(crate) const ON_GRID: u8 = 8;
}

/// The duration of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) delta_s: f32,
    /// Frames per second, as the host computes it.
    pub(crate) per_second: f32,
}

impl Step {
    fn of(delta_nanos: u64) -> Step {
        Step {
            delta_s: (delta_nanos as f64 * 1e-9) as f32,
            per_second: (1e9 / delta_nanos.max(1) as f64) as f32,
        }
    }
}

/// The slots of a block that are coded.
#[derive(Clone, Copy)]
pub(crate) struct Span<'a> {
    /// The first; the slot before it is known.
    pub(crate) start: usize,
    /// From here on two slots before are known.
    pub(crate) both: usize,
    pub(crate) end: usize,
    /// The durations of the frames, by slot minus [`PAST`].
    pub(crate) steps: &'a [Step],
}

impl<'a> Span<'a> {
    fn of(row: &Row, steps: &'a [Step]) -> Span<'a> {
        // The first state of a new actor is stored whole.
        let start = if row.known == 0 { PAST + 1 } else { PAST };
        let both = if row.known == PAST { start } else { start + 1 };
        let steps = &steps[row.from..][..row.len];
        Span { start, both, end: PAST + row.len, steps }
    }

    #[inline]
    pub(crate) fn step(&self, slot: usize) -> Step {
        self.steps[slot - PAST]
    }
}

/// What is done with each value and its prediction. Loops move it out and back, so that its fields
/// stay in registers.
pub(crate) trait Pass: Default {
    /// Handles one value; `place` is the index of the word in its group. Returns the value as a
    /// number.
    fn value<S: Space>(&mut self, cell: &mut u32, guess: u32, place: usize) -> u32;
}

/// Which words are kept, and how they are predicted.
pub(crate) trait Scheme {
    /// The kept words, in groups of neighbours. A group is predicted from groups before it, and
    /// from its own earlier frames.
    const GROUPS: &[&[usize]];
    /// The compression level of everything except the numbers.
    const LEVEL: i32;
    /// The number of parts that actors are distributed to, which are read side by side.
    const PARTS: usize;
    /// Returns the modes worth trying for a group that begins with this word.
    fn modes(word: usize) -> &'static [u8];
    /// Returns whether all values lie on the grid of the group, if it has one.
    fn is_on_grid(group: &[usize], block: &Block, slots: std::ops::Range<usize>) -> bool;
    /// Walks over the values of a group, frame by frame; returns false for an unknown mode.
    fn walk<P: Pass>(
        pass: &mut P,
        block: &mut Block,
        span: &Span,
        group: &[usize],
        mode: u8,
    ) -> bool;
}

/// Predicts unchanged or linear values: `N` words from `word` on, the first at `place`.
#[inline]
pub(crate) fn straight<S: Space, P: Pass, const N: usize>(
    pass: &mut P,
    block: &mut Block,
    span: &Span,
    (word, place): (usize, usize),
    mode: u8,
) -> bool {
    let Some(cells) = block.cells[word..].first_chunk_mut::<N>() else { return false };
    let mut own = take(pass);
    let (mut before, mut last) = ([0; N], [0; N]);
    for (index, cells) in cells.iter().enumerate() {
        before[index] = S::number(cells[span.start - 2]);
        last[index] = S::number(cells[span.start - 1]);
    }
    let is_straight = mode & !mode::ON_GRID == mode::LINEAR;
    let from = if is_straight { span.both.min(span.end) } else { span.end };
    for slot in span.start..from {
        before = last;
        for (index, (last, cells)) in last.iter_mut().zip(&mut *cells).enumerate() {
            *last = own.value::<S>(&mut cells[slot], *last, place + index);
        }
    }
    for slot in from..span.end {
        for (index, cells) in cells.iter_mut().enumerate() {
            let guess = S::beyond(before[index], last[index]);
            let value = own.value::<S>(&mut cells[slot], guess, place + index);
            (before[index], last[index]) = (last[index], value);
        }
    }
    *pass = own;
    is_straight || mode & !mode::ON_GRID == mode::LAST
}

/// Predicts by a rule that sees the block up to the predicted slot: `N` words from `word` on.
#[inline]
pub(crate) fn by_rule<S: Space, P: Pass, const N: usize>(
    pass: &mut P,
    block: &mut Block,
    span: &Span,
    word: usize,
    rule: impl Fn(&Block, usize, Step) -> [f32; N],
) -> bool {
    let mut own = take(pass);
    for slot in span.start..span.end {
        let guess = rule(block, slot, span.step(slot));
        for (place, guess) in guess.into_iter().enumerate() {
            let guess = S::number(guess.to_bits());
            own.value::<S>(&mut block.cells[word + place][slot], guess, place);
        }
    }
    *pass = own;
    true
}

/// A difference, and the index of its word in the group.
type Difference = (u32, usize);

/// Collects the differences.
#[derive(Default)]
struct Telling(Vec<Difference>);

impl Pass for Telling {
    #[inline]
    fn value<S: Space>(&mut self, cell: &mut u32, guess: u32, place: usize) -> u32 {
        let value = S::number(*cell);
        self.0.push((fold(value.wrapping_sub(guess) as i32), place));
        value
    }
}

/// Applies the differences.
#[derive(Default)]
struct Taking<'a> {
    bits: BitReader<'a>,
    widths: [u32; GROUP_MAX],
}

impl Pass for Taking<'_> {
    #[inline(always)]
    fn value<S: Space>(&mut self, cell: &mut u32, guess: u32, place: usize) -> u32 {
        let width = self.widths[place];
        let told = if width == NONE { 0 } else { self.bits.pull_rice(place, width) };
        let value = guess.wrapping_add(unfold(told) as u32);
        *cell = S::bits(value);
        value
    }
}

/// Returns the words that a scheme keeps.
fn kept<S: Scheme>() -> impl Iterator<Item = usize> {
    S::GROUPS.iter().flat_map(|group| group.iter().copied())
}

/// The largest size of an actor's numbers in a segment, in bytes.
const BYTES_MAX: usize = 1 << 26;

/// Encodes segments; each except a key segment builds on the one before.
pub(crate) struct Encoder<S>(Vec<PartEncoder<S>>);

impl<S: Scheme> Encoder<S> {
    pub(crate) fn new() -> Encoder<S> {
        Encoder((0..S::PARTS).map(|_| PartEncoder::new()).collect())
    }

    /// Encodes one segment; with `is_key` it can be read without the ones before.
    pub(crate) fn encode(
        &mut self,
        frames: &[&[ActorState]],
        deltas: &[u64],
        is_key: bool,
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (part, encoder) in self.0.iter_mut().enumerate() {
            let is_its = |state: &&ActorState| state.actor_id.0 as usize % S::PARTS == part;
            let its: Vec<Vec<ActorState>> =
                frames.iter().map(|f| f.iter().filter(is_its).copied().collect()).collect();
            let its: Vec<&[ActorState]> = its.iter().map(Vec::as_slice).collect();
            let told = encoder.encode(&its, deltas, is_key);
            bytes.extend_from_slice(&(told.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&told);
        }
        bytes
    }
}

/// Encodes one part of the actors.
struct PartEncoder<S> {
    past: Past,
    block: Box<Block>,
    scheme: PhantomData<S>,
}

impl<S: Scheme> PartEncoder<S> {
    fn new() -> PartEncoder<S> {
        PartEncoder { past: Past::default(), block: Block::new(), scheme: PhantomData }
    }

    fn encode(&mut self, frames: &[&[ActorState]], deltas: &[u64], is_key: bool) -> Vec<u8> {
        if is_key {
            self.past.forget();
        }
        let rows = presences(frames, &self.past);
        let steps: Vec<_> = deltas.iter().map(|nanos| Step::of(*nanos)).collect();
        // Group by group and word by word, a byte for each row.
        let mut modes = vec![mode::UNCHANGED; S::GROUPS.len() * rows.len()];
        let mut widths = vec![0; kept::<S>().count() * rows.len()];
        let mut firsts = Vec::new();
        let mut bits: [BitWriter; STREAMS] = Default::default();
        let (mut best, mut tried) = (Telling::default(), Telling::default());
        for (index, row) in rows.iter().enumerate() {
            let block = &mut *self.block;
            self.past.fill(row, block);
            for (slot, frame) in frames[row.from..][..row.len].iter().enumerate() {
                let at = frame.binary_search_by_key(&row.actor, |s| s.actor_id.0);
                block.put(PAST + slot, words_of(&frame[at.expect("it presences")]));
            }
            if row.known == 0 {
                firsts.extend(kept::<S>().map(|word| block.cells[word][PAST]));
            }
            let span = Span::of(row, &steps);
            let mut words = 0..;
            for (at, &group) in S::GROUPS.iter().enumerate() {
                let places = words.by_ref().take(group.len()).collect::<Vec<usize>>();
                let Some(taken) =
                    choose::<S>(block, &span, group, row.known, (&mut best, &mut tried))
                else {
                    continue;
                };
                modes[at * rows.len() + index] = taken;
                let mut width = [0; GROUP_MAX];
                for (place, word) in places.into_iter().enumerate() {
                    let numbers = || best.0.iter().filter(|(_, of)| *of == place).map(|(n, _)| *n);
                    width[place] =
                        if numbers().all(|n| n == 0) { NONE } else { best_width(numbers) };
                    widths[word * rows.len() + index] = width[place] as u8;
                }
                for (number, place) in best.0.iter().filter(|(_, place)| width[*place] != NONE) {
                    bits[*place].push_rice(*number, width[*place]);
                }
            }
            self.past.keep_last(row, block, frames.len());
        }
        self.past.end_segment();
        let mut head = Vec::new();
        let mut put = |value: usize| head.extend_from_slice(&(value as u32).to_le_bytes());
        put(frames.len());
        put(rows.len());
        rows.iter().for_each(|row| put(row.actor as usize));
        rows.iter().for_each(|row| put(row.from));
        rows.iter().for_each(|row| put(row.len));
        head.append(&mut modes);
        head.append(&mut widths);
        // Byte planes: equal bytes of a word lie side by side.
        let count = kept::<S>().count();
        for word in 0..count {
            for byte in 0..4 {
                let of = firsts.iter().skip(word).step_by(count);
                head.extend(of.map(|value| value.to_le_bytes()[byte]));
            }
        }
        let packed = zstd::bulk::compress(&head, S::LEVEL).expect("it fits in memory");
        let mut bytes = Vec::new();
        let bits = bits.map(BitWriter::finish);
        for len in [head.len(), packed.len()].into_iter().chain(bits.each_ref().map(Vec::len)) {
            bytes.extend_from_slice(&(len as u32).to_le_bytes());
        }
        bytes.extend_from_slice(&packed);
        bits.iter().for_each(|bits| bytes.extend_from_slice(bits));
        bytes
    }
}

/// Returns the mode that takes the fewest bits, and its differences; `None` if nothing changed.
fn choose<S: Scheme>(
    block: &mut Block,
    span: &Span,
    group: &[usize],
    known: usize,
    (best, tried): (&mut Telling, &mut Telling),
) -> Option<u8> {
    let is_still = |word: &usize| {
        block.cells[*word][span.start - 1..span.end].windows(2).all(|w| w[0] == w[1])
    };
    if group.iter().all(is_still) {
        return None;
    }
    let seen = span.start - known.max(1)..span.end;
    let grid = if S::is_on_grid(group, block, seen) { mode::ON_GRID } else { 0 };
    let mut cheapest = (u32::MAX, mode::LAST);
    for mode in S::modes(group[0]).iter().map(|mode| mode | grid) {
        tried.0.clear();
        S::walk(tried, block, span, group, mode);
        let cost = tried.0.iter().map(|(n, _)| class(*n)).sum();
        if cost < cheapest.0 {
            cheapest = (cost, mode);
            std::mem::swap(tried, best);
        }
        if cost == 0 {
            break;
        }
    }
    Some(cheapest.1)
}

/// A decompressor, reused because creating one takes as long as unpacking a second of a world.
pub(crate) type Unpacker = zstd::bulk::Decompressor<'static>;

/// Takes numbers off the front of bytes.
pub(crate) struct ByteReader<'a>(pub(crate) &'a [u8]);

impl<'a> ByteReader<'a> {
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

    /// Unpacks the next `len` bytes, which [`zstd`] compressed.
    pub(crate) fn unpacked(
        &mut self,
        len: usize,
        whole: usize,
        unpacker: &mut Unpacker,
    ) -> Result<Vec<u8>, Damage> {
        if whole > BYTES_MAX {
            return Err(Damage("a length is absurd"));
        }
        let packed = self.bytes(len)?;
        let bytes = unpacker.decompress(packed, whole).map_err(|_| Damage("zstd refuses it"))?;
        if bytes.len() == whole { Ok(bytes) } else { Err(Damage("zstd finds another length")) }
    }
}

/// An encoded segment.
pub(crate) struct Written<'a> {
    pub(crate) bytes: &'a [u8],
    /// The durations of its frames.
    pub(crate) deltas: Vec<u64>,
    pub(crate) is_key: bool,
}

/// The damaged segment, and the damage.
pub(crate) type DamageIn = (usize, Damage);

/// Decodes segments in the same order.
pub(crate) struct Decoder<S>(Vec<PartDecoder<S>>);

impl<S: Scheme + Send> Decoder<S> {
    pub(crate) fn new() -> Decoder<S> {
        Decoder((0..S::PARTS).map(|_| PartDecoder::new()).collect())
    }

    /// Decodes consecutive segments and puts the frames of the last one into `out`, whose memory is
    /// reused.
    pub(crate) fn decode(
        &mut self,
        segments: &[Written],
        out: &mut Vec<Vec<ActorState>>,
    ) -> Result<(), DamageIn> {
        let mut parts: Vec<Vec<&[u8]>> = vec![Vec::new(); S::PARTS];
        for (index, segment) in segments.iter().enumerate() {
            let mut front = ByteReader(segment.bytes);
            for part in &mut parts {
                let of = front.number().and_then(|len| front.bytes(len));
                part.push(of.map_err(|e| (index, e))?);
            }
        }
        let (first, others) = self.0.split_first_mut().expect("a part at least");
        thread::scope(|scope| {
            let mut threads = Vec::new();
            for (decoder, bytes) in others.iter_mut().zip(&parts[1..]) {
                let builder = thread::Builder::new().name("recording".to_owned());
                let thread = builder.spawn_scoped(scope, || decoder.decode_all(segments, bytes));
                threads.push(thread.map_err(|_| (0, Damage("there is no thread to read it")))?);
            }
            first.decode_all(segments, &parts[0])?;
            let mut ended = threads.into_iter().map(|thread| thread.join());
            ended.try_for_each(|end| end.unwrap_or_else(|why| resume_unwind(why)))
        })?;
        let last = segments.len() - 1;
        merge(&mut self.0, out);
        check_sorted(out).map_err(|e| (last, e))
    }
}

/// Merges the actors of the parts into one list per frame, sorted by id.
fn merge<S>(parts: &mut [PartDecoder<S>], out: &mut Vec<Vec<ActorState>>) {
    let frames = parts[0].out.len();
    if let [only] = parts {
        std::mem::swap(&mut only.out, out);
        return;
    }
    out.resize_with(frames, Vec::new);
    for (index, frame) in out.iter_mut().enumerate() {
        frame.clear();
        let mut fronts: Vec<&[ActorState]> =
            parts.iter().map(|p| p.out[index].as_slice()).collect();
        let id = |front: &&mut &[ActorState]| front.first().map_or(u32::MAX, |s| s.actor_id.0);
        while let Some(front) = fronts.iter_mut().filter(|f| !f.is_empty()).min_by_key(id) {
            frame.push(front[0]);
            *front = &front[1..];
        }
    }
}

/// Decodes one part of the actors.
struct PartDecoder<S> {
    past: Past,
    block: Box<Block>,
    unpacker: Unpacker,
    /// The frames that were read last.
    out: Vec<Vec<ActorState>>,
    scheme: PhantomData<S>,
}

impl<S: Scheme> PartDecoder<S> {
    fn new() -> PartDecoder<S> {
        PartDecoder {
            past: Past::default(),
            block: Block::new(),
            unpacker: Unpacker::default(),
            out: Vec::new(),
            scheme: PhantomData,
        }
    }

    /// Decodes the part's bytes of all segments and keeps the frames of the last one.
    fn decode_all(&mut self, segments: &[Written], bytes: &[&[u8]]) -> Result<(), DamageIn> {
        for (index, (segment, bytes)) in segments.iter().zip(bytes).enumerate() {
            let mut frames = take(&mut self.out);
            let out = (index + 1 == segments.len()).then_some(&mut frames);
            let read = self.decode(bytes, &segment.deltas, segment.is_key, out);
            self.out = frames;
            read.map_err(|e| (index, e))?;
        }
        Ok(())
    }

    /// Decodes one segment. Without `out` only what the next segment builds on is kept.
    fn decode(
        &mut self,
        bytes: &[u8],
        deltas: &[u64],
        is_key: bool,
        mut out: Option<&mut Vec<Vec<ActorState>>>,
    ) -> Result<(), Damage> {
        if is_key {
            self.past.forget();
        }
        let mut front = ByteReader(bytes);
        let (whole, packed) = (front.number()?, front.number()?);
        let mut lens = [0; STREAMS];
        for len in &mut lens {
            *len = front.number()?;
        }
        let head = front.unpacked(packed, whole, &mut self.unpacker)?;
        let mut pass = Taking { bits: BitReader::new(front.0, lens), ..Taking::default() };
        let mut head = ByteReader(&head);
        let (frames, count) = (head.number()?, head.number()?);
        if frames != deltas.len() || frames > FRAMES_MAX {
            return Err(Damage("it has another number of frames than its inputs"));
        }
        let (ids, from, len) = (head.numbers(count)?, head.numbers(count)?, head.numbers(count)?);
        let fits = |from: usize, len: usize| len > 0 && from < frames && len <= frames - from;
        if from.iter().zip(&len).any(|(from, len)| !fits(*from, *len)) {
            return Err(Damage("a stay outlasts it"));
        }
        let modes = head.bytes(S::GROUPS.len() * count)?;
        let words = kept::<S>().count();
        let widths = head.bytes(words * count)?;
        let presences = ids.iter().zip(from.iter().zip(&len));
        let rows: Vec<_> =
            presences.map(|(id, (f, l))| self.past.row(*id as u32, *f, *l)).collect();
        let fresh = rows.iter().filter(|row| row.known == 0).count();
        let firsts = head.bytes(words * fresh * 4)?;
        let steps: Vec<_> = deltas.iter().map(|nanos| Step::of(*nanos)).collect();
        if let Some(out) = &mut out {
            out.resize_with(frames, Vec::new);
            for frame in out.iter_mut() {
                frame.clear();
                frame.reserve(count);
            }
        }
        let mut begun = 0;
        for (index, row) in rows.iter().enumerate() {
            let block = &mut *self.block;
            self.past.fill(row, block);
            if row.known == 0 {
                for (place, word) in kept::<S>().enumerate() {
                    let byte = |b: usize| firsts[(4 * place + b) * fresh + begun];
                    block.cells[word][PAST] = u32::from_le_bytes([0, 1, 2, 3].map(byte));
                }
                begun += 1;
            }
            let span = Span::of(row, &steps);
            if modes[index..].iter().step_by(count).all(|mode| *mode == mode::UNCHANGED) {
                // An unchanged row, such as a light or a resting vehicle: all words at once.
                let mut words = block.take(span.start - 1);
                block.put(row.len, &words);
                block.put(row.len + 1, &words);
                words[0] = row.actor;
                if let Some(out) = &mut out {
                    let state = bytemuck::cast(words);
                    out[row.from..][..row.len].iter_mut().for_each(|frame| frame.push(state));
                }
                self.past.keep_last(row, block, frames);
                continue;
            }
            let mut word = 0;
            for (at, &group) in S::GROUPS.iter().enumerate() {
                let taken = modes[at * count + index];
                if taken == mode::UNCHANGED {
                    for &word in group {
                        let cells = &mut block.cells[word];
                        let was = cells[span.start - 1];
                        cells[span.start..span.end].fill(was);
                    }
                } else {
                    for (place, width) in pass.widths.iter_mut().enumerate().take(group.len()) {
                        *width = u32::from(widths[(word + place) * count + index]).min(NONE);
                    }
                    if !S::walk(&mut pass, block, &span, group, taken) {
                        return Err(Damage("it predicts by no rule we know"));
                    }
                }
                word += group.len();
            }
            if let Some(out) = &mut out {
                for (slot, frame) in out[row.from..][..row.len].iter_mut().enumerate() {
                    let mut words = block.take(PAST + slot);
                    words[0] = row.actor;
                    frame.push(bytemuck::cast(words));
                }
            }
            self.past.keep_last(row, block, frames);
        }
        self.past.end_segment();
        pass.bits.check()?;
        // An actor that leaves and returns has several rows.
        for frame in out.into_iter().flatten().filter(|f| !f.is_sorted_by_key(|s| s.actor_id)) {
            frame.sort_unstable_by_key(|state| state.actor_id);
        }
        Ok(())
    }
}
