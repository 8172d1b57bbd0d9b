//! Decodes the files of a data set, for the contact sheet, `inspect` and tests.

use png::Decoder;

/// A decoded image.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// As in PNG: the high byte of a 16-bit sample comes first.
    pub(crate) bytes: Vec<u8>,
}

impl Image {
    /// Returns the samples of a 16-bit image.
    pub(crate) fn sixteen(&self) -> Vec<u16> {
        self.bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()
    }

    /// Returns the ids of an instance image.
    pub(crate) fn ids(&self) -> Vec<u32> {
        self.bytes.chunks_exact(3).map(|b| u32::from_le_bytes([b[0], b[1], b[2], 0])).collect()
    }
}

/// Decodes a PNG file.
pub(crate) fn png(file: &[u8]) -> Result<Image, String> {
    let decode = || {
        let mut reader = Decoder::new(std::io::Cursor::new(file)).read_info()?;
        let mut bytes = vec![0; reader.output_buffer_size().unwrap_or(0)];
        let frame = reader.next_frame(&mut bytes)?;
        bytes.truncate(frame.buffer_size());
        Ok(Image { width: frame.width as usize, height: frame.height as usize, bytes })
    };
    decode().map_err(|e: png::DecodingError| e.to_string())
}

/// Decodes little-endian f32 values.
pub(crate) fn floats(bytes: &[u8]) -> Vec<f32> {
    let four = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    bytes.chunks_exact(4).map(four).collect()
}

/// Decodes little-endian u32 values.
pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    let four = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    bytes.chunks_exact(4).map(four).collect()
}
