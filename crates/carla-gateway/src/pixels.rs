//! Pixels of CARLA's images: words of blue, green, red and alpha.

use crate::wire::Bytes;

/// Appends pixels as words with blue in the lowest byte and alpha in the highest. The loop over
/// whole words is vectorised by the compiler.
pub(crate) fn pixels<T>(
    mut bytes: Bytes,
    from: impl ExactSizeIterator<Item = T>,
    pixel: impl Fn(T) -> u32,
) -> Bytes {
    let begin = bytes.0.len();
    bytes.0.resize(begin + 4 * from.len(), 0);
    let (into, _) = bytes.0[begin..].as_chunks_mut::<4>();
    for (into, from) in into.iter_mut().zip(from) {
        *into = pixel(from).to_le_bytes();
    }
    bytes
}

/// The alpha of an opaque pixel.
pub(crate) const OPAQUE: u32 = 0xff00_0000;

/// Returns the word of an opaque pixel.
pub(crate) fn bgra(rgba: [u8; 4]) -> u32 {
    let word = u32::from_le_bytes(rgba);
    OPAQUE | (word & 0xff) << 16 | word & 0xff00 | word >> 16 & 0xff
}
