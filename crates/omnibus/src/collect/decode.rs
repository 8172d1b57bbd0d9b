//! Decodes the files of a data set, for the contact sheet, `inspect` and tests.

use png::Decoder;
use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

use crate::collect::{encode::depth_steps, npy};

/// A decoded image.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Image {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// As in the PNG files of a data set: 8-bit RGB, tags, ids of three bytes, or 16-bit depth with the high
    /// byte first.
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

/// Decodes an image of a data set by the extension of its file.
pub(crate) fn image(extension: &str, file: &[u8]) -> Result<Image, String> {
    match extension {
        "jpg" => jpeg(file),
        "npy" => array(file),
        "npy.zst" => array(&zstd::decode_all(file).map_err(|e| e.to_string())?),
        _ => png(file),
    }
}

fn jpeg(file: &[u8]) -> Result<Image, String> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    let bytes = decoder.decode().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions().ok_or("no size")?;
    Ok(Image { width, height, bytes })
}

fn array(file: &[u8]) -> Result<Image, String> {
    let array = npy::parse(file)?;
    let (&[height, width] | &[height, width, 3]) = &array.shape[..] else {
        return Err(format!("an array of shape {:?}, which is no image", array.shape));
    };
    let bytes = match array.kind {
        "<f4" => {
            let steps = floats(array.bytes).into_iter().map(depth_steps);
            steps.flat_map(u16::to_be_bytes).collect()
        }
        "<u4" => {
            array.bytes.as_chunks::<4>().0.iter().flat_map(|id| [id[0], id[1], id[2]]).collect()
        }
        _ => array.bytes.to_vec(),
    };
    Ok(Image { width, height, bytes })
}

/// Decodes a PNG file.
fn png(file: &[u8]) -> Result<Image, String> {
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
