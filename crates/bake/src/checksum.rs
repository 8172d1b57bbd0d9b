const FACTORS: [u64; 4] =
    [0x9e37_79b9_7f4a_7c15, 0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb, 0xd6e8_feb8_6659_fd93];

/// A checksum of 128 bits over words of 8 bytes. It detects damage and tells inputs apart; it is
/// no defence against forgery.
///
/// Four independent streams, so that their multiplications overlap in the processor.
#[derive(Clone, Debug)]
pub(crate) struct Checksum {
    streams: [u64; 4],
}

impl Checksum {
    /// The checksum of no bytes.
    pub(crate) fn new() -> Checksum {
        Checksum { streams: FACTORS }
    }

    /// The digest of `bytes` alone.
    pub(crate) fn of(bytes: &[u8]) -> [u64; 2] {
        let mut sum = Checksum::new();
        sum.add(bytes);
        sum.digest()
    }

    /// Adds `bytes` and their number.
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        let whole = bytes.len() / 32 * 32;
        self.add_beginning(&bytes[..whole]);
        self.add_end(&bytes[whole..], bytes.len());
    }

    /// Adds a beginning of bytes, a multiple of 32.
    pub(crate) fn add_beginning(&mut self, bytes: &[u8]) {
        let (blocks, rest) = bytes.as_chunks::<32>();
        debug_assert!(rest.is_empty());
        let mut streams = self.streams;
        for block in blocks {
            let (words, _) = block.as_chunks::<8>();
            for lane in 0..4 {
                streams[lane] = step(streams[lane], u64::from_le_bytes(words[lane]), lane);
            }
        }
        self.streams = streams;
    }

    /// Adds the less than 32 bytes behind the beginning of `length` bytes, and that number.
    pub(crate) fn add_end(&mut self, rest: &[u8], length: usize) {
        let mut last = [0; 32];
        last[..rest.len()].copy_from_slice(rest);
        for lane in 0..4 {
            let word = last[8 * lane..8 * lane + 8].try_into().expect("eight bytes");
            self.streams[lane] = step(self.streams[lane], u64::from_le_bytes(word), lane);
            self.streams[lane] = step(self.streams[lane], length as u64, lane);
        }
    }

    /// The 128 bits.
    pub(crate) fn digest(&self) -> [u64; 2] {
        let [a, b, c, d] = self.streams;
        let mixed = |x: u64, y: u64| {
            let z = (x ^ y.rotate_left(29)).wrapping_mul(FACTORS[0]);
            let z = (z ^ z >> 32).wrapping_mul(FACTORS[1]).wrapping_add(x);
            z ^ z >> 29
        };
        [mixed(mixed(a, b), mixed(c, d)), mixed(mixed(d, a), mixed(b, c))]
    }
}

/// One-to-one in `word`, so that a single changed word always changes the state.
#[inline(always)]
fn step(state: u64, word: u64, lane: usize) -> u64 {
    ((state ^ word).wrapping_mul(FACTORS[lane])).rotate_left(31)
}
