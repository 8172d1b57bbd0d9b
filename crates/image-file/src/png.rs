//! PNG files (ISO/IEC 15948), for the images of data sets: quicker to write than those of general encoders.

use crate::deflate::{Counts, Stream};

/// Of as many rows one counts for the Huffman code.
const SAMPLED_ROWS: usize = 16;

/// The most bytes of pixels, so that a chunk holds them with the longest codes.
const MAX_PNG_BYTES: u64 = 1 << 30;

/// The samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Eight bits.
    Grey8,
    /// 16 bits, the high byte first.
    Grey16,
    /// Red, green and blue of eight bits each.
    Rgb8,
}

/// The value that is subtracted from each byte of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The byte above: for images of few values.
    Up,
    /// The byte to the left, above, or above to the left, whichever is nearest to left + above − above
    /// left (ISO/IEC 15948, 9.4): for colour and depth.
    Paeth,
}

/// An image of this size is no PNG file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an image of {width} x {height} pixels; PNG files hold 1 pixel to 1 GiB")]
pub struct PngError {
    /// Pixels of a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Samples {
    /// Returns the bytes of a pixel.
    #[must_use]
    pub fn bytes(self) -> usize {
        self.parts().2
    }

    /// Returns bits of a sample, colour type, and bytes of a pixel.
    fn parts(self) -> (u8, u8, usize) {
        match self {
            Samples::Grey8 => (8, 0, 1),
            Samples::Grey16 => (16, 0, 2),
            Samples::Rgb8 => (8, 2, 3),
        }
    }
}

/// Appends a PNG file of an image of [width, height] pixels. `row` writes the bytes of a row, counted from
/// the top; it is called more than once for some rows.
///
/// # Errors
///
/// [`PngError`] if the size is not one of a PNG image.
pub fn png(
    [width, height]: [u32; 2],
    samples: Samples,
    filter: Filter,
    row: impl Fn(usize, &mut [u8]),
    file: &mut Vec<u8>,
) -> Result<(), PngError> {
    let (bits, color, pixel) = samples.parts();
    let size = u64::from(width) * u64::from(height) * pixel as u64;
    if size == 0 || size > MAX_PNG_BYTES {
        return Err(PngError { width, height });
    }
    let (len, rows) = (width as usize * pixel, height as usize);
    file.reserve(size as usize / 2);
    file.extend_from_slice(b"\x89PNG\r\n\x1a\n");
    let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[bits, color, 0, 0, 0]].concat();
    chunk(b"IHDR", file, |file| file.extend_from_slice(&head));
    // Rows begin with a pixel of zeros, the one to the left of the image.
    let mut two = vec![0; 2 * (pixel + len)];
    let (mut above, mut now) = two.split_at_mut(pixel + len);
    let mut filtered = vec![0; 1 + len];
    let mut counts = Counts::new();
    for y in (SAMPLED_ROWS / 2..rows).step_by(SAMPLED_ROWS) {
        row(y - 1, &mut above[pixel..]);
        row(y, &mut now[pixel..]);
        filter.apply(pixel, above, now, &mut filtered);
        counts.add(&filtered);
    }
    above.fill(0);
    chunk(b"IDAT", file, |file| {
        let mut stream = Stream::new(&counts, filtered.len(), file);
        for y in 0..rows {
            row(y, &mut now[pixel..]);
            filter.apply(pixel, above, now, &mut filtered);
            stream.put(&filtered, file);
            std::mem::swap(&mut above, &mut now);
        }
        stream.finish(file);
    });
    chunk(b"IEND", file, |_| ());
    Ok(())
}

/// Appends a chunk: the length of its content, its name, the content, and the checksum of both.
fn chunk(name: &[u8; 4], file: &mut Vec<u8>, content: impl FnOnce(&mut Vec<u8>)) {
    let begin = file.len();
    file.extend_from_slice(&[0; 4]);
    file.extend_from_slice(name);
    content(file);
    let len = (file.len() - begin - 8) as u32;
    file[begin..begin + 4].copy_from_slice(&len.to_be_bytes());
    let sum = crc32fast::hash(&file[begin + 4..]);
    file.extend_from_slice(&sum.to_be_bytes());
}

impl Filter {
    /// Writes the number of the filter and the filtered bytes of row `now`. Both rows begin with a pixel of
    /// zeros.
    fn apply(self, pixel: usize, above: &[u8], now: &[u8], filtered: &mut [u8]) {
        let (number, filtered) = filtered.split_first_mut().expect("a row has a number");
        let bytes = filtered.iter_mut().zip(&now[pixel..]).zip(&above[pixel..]);
        match self {
            Filter::Up => {
                *number = 2;
                bytes.for_each(|((to, byte), above)| *to = byte.wrapping_sub(*above));
            }
            Filter::Paeth => {
                *number = 4;
                for (((to, byte), up), (left, up_left)) in bytes.zip(now.iter().zip(above)) {
                    let (a, b, c) = (i16::from(*left), i16::from(*up), i16::from(*up_left));
                    let (to_a, to_b) = ((b - c).abs(), (a - c).abs());
                    let to_c = (a + b - 2 * c).abs();
                    let other = if to_b <= to_c { b } else { c };
                    let nearest = if to_a <= to_b && to_a <= to_c { a } else { other };
                    *to = byte.wrapping_sub(nearest as u8);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Encodes an image whose bytes follow from their ordinal, and decodes it with the package `png`.
    fn again(size: [u32; 2], samples: Samples, filter: Filter, byte: impl Fn(usize) -> u8) {
        let len = size[0] as usize * samples.parts().2;
        let pixels: Vec<u8> = (0..len * size[1] as usize).map(byte).collect();
        let mut file = b"head".to_vec();
        let row = |y: usize, to: &mut [u8]| to.copy_from_slice(&pixels[y * len..][..len]);
        png(size, samples, filter, row, &mut file).unwrap();
        assert_eq!(&file[..4], b"head");
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(&file[4..])).read_info().unwrap();
        let mut decoded = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut decoded).unwrap();
        assert_eq!([info.width, info.height], size);
        assert!(decoded == pixels, "{size:?} {samples:?} {filter:?}");
    }

    #[test]
    fn images_of_any_kind_are_decoded_unchanged() {
        // A linear congruential generator: bytes without any order.
        let noise = |i: usize| ((i as u32).wrapping_mul(747_796_405).rotate_left(9) >> 7) as u8;
        for samples in [Samples::Grey8, Samples::Grey16, Samples::Rgb8] {
            for filter in [Filter::Up, Filter::Paeth] {
                for size in [[1, 1], [7, 3], [83, 41], [512, 20]] {
                    again(size, samples, filter, |_| 0);
                    again(size, samples, filter, noise);
                    again(size, samples, filter, |i| (i / 97) as u8);
                }
            }
        }
    }

    #[test]
    fn runs_of_any_length_are_decoded_unchanged() {
        // Row n has n equal bytes: zeros after the filter, and other bytes around them.
        let width = 600;
        for filter in [Filter::Up, Filter::Paeth] {
            again([width, 600], Samples::Grey8, filter, |i| {
                let (x, y) = (i % width as usize, i / width as usize);
                if (3..3 + y).contains(&x) { 9 } else { (x * 31 + y * 17) as u8 }
            });
        }
    }

    #[test]
    fn equal_pixels_take_little_room() {
        let mut file = Vec::new();
        png([800, 600], Samples::Rgb8, Filter::Up, |_, to| to.fill(77), &mut file).unwrap();
        assert!(file.len() < 10_000, "{}", file.len());
    }

    #[test]
    fn an_image_that_the_format_does_not_allow_is_an_error() {
        for [width, height] in [[0, 5], [5, 0], [1 << 16, 1 << 15]] {
            let mut file = Vec::new();
            let made = png([width, height], Samples::Rgb8, Filter::Up, |_, _| (), &mut file);
            assert_eq!(made, Err(PngError { width, height }));
            assert!(file.is_empty());
        }
    }
}
