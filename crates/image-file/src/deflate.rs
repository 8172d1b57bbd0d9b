//! A stream of zlib (RFC 1950) of one block of DEFLATE (RFC 1951) for the filtered rows of an image.
//!
//! Filtered rows are mostly small values, and zeros where neighbours are equal. So there are only
//! literals and runs of zeros, without the search for other repetitions in which other compressors
//! spend their time. The Huffman code is that of some of the image's rows.

use simd_adler32::Adler32;

/// Literals, the end of the block, and the lengths of repetitions.
const SYMBOLS: usize = 286;
const END: usize = 256;
/// The longest code: four of them after an incomplete byte are fewer than 64 bits.
const MAX_BITS: u8 = 12;
/// The longest repetition.
const MAX_RUN: usize = 258;

/// What a row consists of.
enum Token<'a> {
    Literals(&'a [u8; 8]),
    /// At least 8 zeros.
    Zeros(usize),
    /// Fewer than 8 bytes, the last of the row.
    Last(&'a [u8]),
}

/// The tokens of the rest of a row.
struct Tokens<'a>(&'a [u8]);

impl<'a> Iterator for Tokens<'a> {
    type Item = Token<'a>;

    #[inline]
    fn next(&mut self) -> Option<Token<'a>> {
        let Some((eight, rest)) = self.0.split_first_chunk::<8>() else {
            let last = std::mem::take(&mut self.0);
            return (!last.is_empty()).then_some(Token::Last(last));
        };
        if *eight != [0; 8] {
            self.0 = rest;
            return Some(Token::Literals(eight));
        }
        let (eights, last) = self.0.as_chunks::<8>();
        let zeros_of = |bytes: &[u8]| bytes.iter().take_while(|byte| **byte == 0).count();
        let zeros = match eights.iter().position(|eight| *eight != [0; 8]) {
            Some(index) => 8 * index + zeros_of(&eights[index]),
            None => 8 * eights.len() + zeros_of(last),
        };
        self.0 = &self.0[zeros..];
        Some(Token::Zeros(zeros))
    }
}

/// Passes the symbols of a run of zeros to `put`, each with its further bits and their number: a zero, and
/// repetitions of the byte before.
fn run(zeros: usize, mut put: impl FnMut(usize, u64, u32)) {
    put(0, 0, 0);
    let mut left = zeros - 1;
    while left > 0 {
        match left {
            1 | 2 => (0..left).for_each(|_| put(0, 0, 0)),
            3..=10 => put(254 + left, 0, 0),
            MAX_RUN.. => put(285, 0, 0),
            _ => {
                let length = left - 3;
                let bits = length.ilog2() - 2;
                let symbol = 261 + 4 * bits as usize + (length >> bits & 3);
                put(symbol, (length & ((1 << bits) - 1)) as u64, bits);
            }
        }
        left -= left.min(MAX_RUN);
    }
}

/// How often each symbol occurs in some rows.
pub(crate) struct Counts([u32; SYMBOLS]);

impl Counts {
    pub(crate) fn new() -> Counts {
        Counts([0; SYMBOLS])
    }

    pub(crate) fn add(&mut self, row: &[u8]) {
        for token in Tokens(row) {
            match token {
                Token::Literals(eight) => eight.iter().for_each(|b| self.0[usize::from(*b)] += 1),
                Token::Last(last) => last.iter().for_each(|b| self.0[usize::from(*b)] += 1),
                Token::Zeros(zeros) => run(zeros, |symbol, _, _| self.0[symbol] += 1),
            }
        }
    }

    /// Returns the lengths of the codes of all symbols, at most [`MAX_BITS`].
    fn lengths(&self) -> [u8; SYMBOLS] {
        let mut weights = self.0;
        loop {
            // Symbols that these rows lack have codes too, because other rows may hold them.
            let least = weights.iter().sum::<u32>() >> MAX_BITS | 1;
            weights = weights.map(|weight| weight.max(least));
            let lengths = huffman(&weights);
            if lengths.iter().all(|bits| *bits <= MAX_BITS) {
                return lengths;
            }
            weights = weights.map(|weight| weight >> 1);
        }
    }
}

/// Returns the lengths of an optimal code (Huffman 1952): again and again, the two rarest nodes get a
/// common one above them.
fn huffman(weights: &[u32; SYMBOLS]) -> [u8; SYMBOLS] {
    const NODES: usize = 2 * SYMBOLS - 1;
    let mut leaves: [usize; SYMBOLS] = std::array::from_fn(|symbol| symbol);
    leaves.sort_by_key(|symbol| weights[*symbol]);
    let mut nodes = [0; NODES];
    nodes[..SYMBOLS].copy_from_slice(weights);
    let mut above = [0; NODES];
    // Nodes above others are created in the order of their weights.
    let (mut leaf, mut inner) = (0, SYMBOLS);
    for node in SYMBOLS..NODES {
        for _ in 0..2 {
            let is_leaf = leaf < SYMBOLS && (inner == node || nodes[leaves[leaf]] <= nodes[inner]);
            let rarest = if is_leaf { leaves[leaf] } else { inner };
            *(if is_leaf { &mut leaf } else { &mut inner }) += 1;
            nodes[node] += nodes[rarest];
            above[rarest] = node;
        }
    }
    let mut depth = [0; NODES];
    for node in (0..NODES - 1).rev() {
        depth[node] = depth[above[node]] + 1;
    }
    std::array::from_fn(|symbol| depth[symbol])
}

/// The code of each symbol, first bit lowest, and from bit 16 on its length.
type Codes = [u32; SYMBOLS];

/// Returns the codes that follow from their lengths (RFC 1951, 3.2.2).
fn codes(lengths: &[u8; SYMBOLS]) -> Codes {
    let mut next = 0u32;
    let mut codes = [0; SYMBOLS];
    for bits in 1..=MAX_BITS {
        next <<= 1;
        for symbol in (0..SYMBOLS).filter(|symbol| lengths[*symbol] == bits) {
            codes[symbol] = next.reverse_bits() >> (32 - bits) | u32::from(bits) << 16;
            next += 1;
        }
    }
    codes
}

/// The end of a stream.
#[derive(Default)]
struct Bits {
    /// The bits after the last complete byte, and their number.
    waiting: u64,
    count: u32,
    /// A buffer, and the number of bytes in it.
    bytes: Vec<u8>,
    len: usize,
}

impl Bits {
    #[inline]
    fn put(&mut self, bits: u64, count: u32) {
        self.waiting |= bits << self.count;
        self.count += count;
    }

    #[inline]
    fn code(&mut self, code: u32) {
        self.put(u64::from(code & 0xffff), code >> 16);
    }

    /// Moves complete bytes to the buffer; at most seven bits remain.
    #[inline]
    fn flush(&mut self) {
        // A store of a word, where a copy of a slice would be a call.
        if let Some(word) = self.bytes[self.len..].first_chunk_mut() {
            *word = self.waiting.to_le_bytes();
        }
        self.len += (self.count >> 3) as usize;
        self.waiting >>= self.count & !7;
        self.count &= 7;
    }

    /// Moves the bytes of the buffer to a file.
    fn empty(&mut self, file: &mut Vec<u8>) {
        file.extend_from_slice(&self.bytes[..self.len]);
        self.len = 0;
    }
}

/// A stream that is appended to a file.
pub(crate) struct Stream {
    codes: Codes,
    sum: Adler32,
    bits: Bits,
}

impl Stream {
    /// Begins a stream with the code of the counted rows. No row is longer than `row_bytes`.
    pub(crate) fn new(counts: &Counts, row_bytes: usize, file: &mut Vec<u8>) -> Stream {
        let lengths = counts.lengths();
        // The longest code for each byte, at least the lengths of all codes, and a word.
        let bytes = vec![0; row_bytes.max(SYMBOLS) * usize::from(MAX_BITS) / 8 + 16];
        let mut bits = Bits { bytes, ..Bits::default() };
        // A window of 32 KiB; the quickest level.
        file.extend_from_slice(&[0x78, 0x01]);
        // The last block, with codes of its own; the numbers of symbols, distances and lengths of codes.
        bits.put(1 | 2 << 1, 3);
        bits.put((SYMBOLS - 257) as u64 | (19 - 4) << 10, 14);
        // Each length is a number of four bits; the three ways to repeat lengths have no code.
        for way in 0..19 {
            bits.put(if way < 3 { 0 } else { 4 }, 3);
            bits.flush();
        }
        // One distance: 1, whose code is a bit.
        for length in lengths.iter().chain(&[1]) {
            bits.put(u64::from(length.reverse_bits() >> 4), 4);
            bits.flush();
        }
        bits.empty(file);
        Stream { codes: codes(&lengths), sum: Adler32::new(), bits }
    }

    /// Appends a row.
    pub(crate) fn put(&mut self, row: &[u8], file: &mut Vec<u8>) {
        self.sum.write(row);
        let (bits, codes) = (&mut self.bits, &self.codes);
        for token in Tokens(row) {
            match token {
                Token::Literals(eight) => {
                    for four in eight.as_chunks::<4>().0 {
                        four.iter().for_each(|byte| bits.code(codes[usize::from(*byte)]));
                        bits.flush();
                    }
                }
                Token::Last(last) => last.iter().for_each(|byte| {
                    bits.code(codes[usize::from(*byte)]);
                    bits.flush();
                }),
                Token::Zeros(zeros) => run(zeros, |symbol, more, count| {
                    bits.code(codes[symbol]);
                    // The code of the distance is a zero after the further bits.
                    bits.put(more, count + u32::from(symbol > END));
                    bits.flush();
                }),
            }
        }
        bits.empty(file);
    }

    /// Ends the stream.
    pub(crate) fn finish(mut self, file: &mut Vec<u8>) {
        self.bits.code(self.codes[END]);
        // Zeros up to a complete byte.
        self.bits.put(0, 7);
        self.bits.flush();
        self.bits.empty(file);
        file.extend_from_slice(&self.sum.finish().to_be_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sum of Kraft (1949) of 1 is a code without gaps that can be decoded.
    #[test]
    fn codes_are_complete_and_no_longer_than_allowed() {
        let fibonacci = |symbol: usize| (0..symbol % 40).fold((0, 1), |(a, b), _| (b, a + b)).1;
        for counts in [[0; SYMBOLS], [7; SYMBOLS], std::array::from_fn(fibonacci)] {
            let lengths = Counts(counts).lengths();
            let kraft: u32 = lengths.iter().map(|bits| 1 << (MAX_BITS - bits)).sum();
            assert_eq!(kraft, 1 << MAX_BITS);
        }
    }

    #[test]
    fn frequent_symbols_have_short_codes() {
        let mut counts = Counts::new();
        counts.add(&[[1u8; 1000].as_slice(), &[2; 10]].concat());
        let lengths = counts.lengths();
        assert_eq!(lengths[1], 1);
        assert!(lengths[2] < lengths[3], "{} {}", lengths[2], lengths[3]);
    }
}
