//! JPEG files, by the encoder of libjpeg-turbo.
//!
//! The package `mozjpeg` contains that encoder: with the settings below its files have the bytes of
//! those of libjpeg-turbo, with or without SIMD.

use mozjpeg::{ColorSpace, Compress};

/// The quality from which on colour has the resolution of the image. Below it, an image has one value of
/// colour for 2 x 2 pixels, as the images of cameras and the files of other encoders have: this takes
/// three fifths of the time and four fifths of the bytes, and blurs the colour of distant lamps.
pub const FULL_COLOR_QUALITY: u8 = 95;

/// The longest side of a JPEG image that libjpeg-turbo writes, in pixels.
pub const MAX_JPEG_SIDE_PX: u32 = 65_500;

/// The pixels of an image, row by row from the top, 8 bits for each value.
#[derive(Clone, Copy, Debug)]
pub enum Pixels<'a> {
    /// One value for each pixel.
    Grey(&'a [u8]),
    /// Red, green, blue.
    Rgb(&'a [u8]),
    /// Red, green, blue, and a value that is not stored.
    Rgbx(&'a [u8]),
}

/// Why an image is no JPEG file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JpegError {
    /// The size is outside of what the format allows.
    #[error(
        "an image of {width} x {height} pixels; JPEG allows 1 to {MAX_JPEG_SIDE_PX} on each side"
    )]
    Size {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The pixels are not those of an image of this size.
    #[error("an image of {width} x {height} pixels of {values} bytes has {bytes} bytes")]
    Length {
        /// Pixels of a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes of a pixel.
        values: usize,
        /// Bytes that were passed.
        bytes: usize,
    },
    /// The encoder ended early.
    #[error("libjpeg-turbo: {0}")]
    Encoder(String),
}

impl<'a> Pixels<'a> {
    fn parts(self) -> (&'a [u8], usize, ColorSpace) {
        match self {
            Pixels::Grey(bytes) => (bytes, 1, ColorSpace::JCS_GRAYSCALE),
            Pixels::Rgb(bytes) => (bytes, 3, ColorSpace::JCS_EXT_RGB),
            Pixels::Rgbx(bytes) => (bytes, 4, ColorSpace::JCS_EXT_RGBX),
        }
    }
}

/// Appends a JPEG file of an image of [width, height] pixels; `quality` is 1 to 100 as in libjpeg.
///
/// # Errors
///
/// [`JpegError`] if the size is not one of a JPEG image or not that of the pixels.
pub fn jpeg(
    [width, height]: [u32; 2],
    pixels: Pixels<'_>,
    quality: u8,
    file: &mut Vec<u8>,
) -> Result<(), JpegError> {
    let (bytes, values, space) = pixels.parts();
    let allowed = 1..=MAX_JPEG_SIDE_PX;
    if !allowed.contains(&width) || !allowed.contains(&height) {
        return Err(JpegError::Size { width, height });
    }
    if bytes.len() as u64 != u64::from(width) * u64::from(height) * values as u64 {
        return Err(JpegError::Length { width, height, values, bytes: bytes.len() });
    }
    let mut encoder = Compress::new(space);
    encoder.set_size(width as usize, height as usize);
    encoder.set_fastest_defaults();
    encoder.set_quality(f32::from(quality.clamp(1, 100)));
    if values > 1 {
        let side = if quality < FULL_COLOR_QUALITY { 2 } else { 1 };
        encoder.set_chroma_sampling_pixel_sizes((side, side), (side, side));
    }
    let encode = || {
        let mut started = encoder.start_compress(file)?;
        started.write_scanlines(bytes)?;
        started.finish()
    };
    encode().map(drop).map_err(|e: std::io::Error| JpegError::Encoder(e.to_string()))
}

#[cfg(test)]
mod tests {
    use zune_jpeg::{JpegDecoder, zune_core::bytestream::ZCursor};

    use super::*;

    const SIZE: [u32; 2] = [83, 41];

    /// Returns an image whose left half is red and whose right half is blue, from `edge` on.
    fn red_and_blue(edge: u32) -> Vec<u8> {
        let pixel = |x| if x < edge { [200, 20, 30] } else { [30, 20, 200] };
        (0..SIZE[1]).flat_map(|_| (0..SIZE[0]).flat_map(pixel)).collect()
    }

    fn encoded(pixels: Pixels<'_>, quality: u8) -> Vec<u8> {
        let mut file = b"head".to_vec();
        jpeg(SIZE, pixels, quality, &mut file).unwrap();
        assert_eq!(&file[..4], b"head");
        file.split_off(4)
    }

    /// Returns the largest difference of a value.
    fn difference(file: &[u8], expected: &[u8]) -> u8 {
        let mut decoder = JpegDecoder::new(ZCursor::new(file));
        let decoded = decoder.decode().unwrap();
        assert_eq!(decoder.dimensions().unwrap(), SIZE.map(|side| side as usize).into());
        assert_eq!(decoded.len(), expected.len());
        decoded.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
    }

    #[test]
    fn images_of_any_size_are_decoded_with_little_difference() {
        let rgb = red_and_blue(40);
        let grey: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(|i| (i % SIZE[0] * 3) as u8).collect();
        assert!(difference(&encoded(Pixels::Rgb(&rgb), 95), &rgb) <= 12);
        // The decoder returns red, green and blue of grey images too.
        let three: Vec<u8> = grey.iter().flat_map(|value| [*value; 3]).collect();
        assert!(difference(&encoded(Pixels::Grey(&grey), 90), &three) <= 8);
    }

    #[test]
    fn the_fourth_value_of_a_pixel_is_left_out() {
        let rgb = red_and_blue(40);
        let rgbx: Vec<u8> = rgb.chunks(3).flat_map(|c| [c[0], c[1], c[2], c[0]]).collect();
        assert_eq!(encoded(Pixels::Rgbx(&rgbx), 80), encoded(Pixels::Rgb(&rgb), 80));
    }

    #[test]
    fn colour_has_the_resolution_of_the_image_from_the_documented_quality_on() {
        // The edge lies within a block of 2 x 2 pixels.
        let rgb = red_and_blue(41);
        assert!(difference(&encoded(Pixels::Rgb(&rgb), FULL_COLOR_QUALITY), &rgb) <= 12);
        assert!(difference(&encoded(Pixels::Rgb(&rgb), FULL_COLOR_QUALITY - 1), &rgb) >= 40);
    }

    #[test]
    fn an_image_that_the_format_does_not_allow_is_an_error() {
        let refused = |size: [u32; 2], bytes: usize| {
            let mut file = Vec::new();
            let error = jpeg(size, Pixels::Rgb(&vec![0; bytes]), 90, &mut file).unwrap_err();
            assert!(file.is_empty());
            error
        };
        assert_eq!(refused([0, 5], 0), JpegError::Size { width: 0, height: 5 });
        assert_eq!(refused([65_501, 1], 196_503), JpegError::Size { width: 65_501, height: 1 });
        let error = JpegError::Length { width: 4, height: 3, values: 3, bytes: 35 };
        assert_eq!(refused([4, 3], 35), error);
    }
}
