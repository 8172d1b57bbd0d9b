//! How the images of a data set are stored.

use protocol::output;
use serde::{Deserialize, Serialize};

/// How the images of cameras are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, clap::ValueEnum)]
pub(crate) enum ImageFormat {
    /// PNG: colour, depth in centimetres, tags and instances.
    #[default]
    #[serde(rename = "png")]
    Png,
    /// Colour as JPEG, which loses detail; the others as PNG.
    #[serde(rename = "jpeg")]
    Jpeg,
    /// Arrays of NumPy, not compressed: depth in metres as f32, instances as u32.
    #[serde(rename = "npy")]
    Npy,
    /// The same, compressed by Zstandard.
    #[serde(rename = "npy.zst")]
    #[value(name = "npy.zst")]
    NpyZst,
}

impl ImageFormat {
    /// Returns the extension of the files of an output.
    pub(crate) fn extension(self, output: u32) -> &'static str {
        match self {
            ImageFormat::Jpeg if output == output::COLOR => "jpg",
            ImageFormat::Png | ImageFormat::Jpeg => "png",
            ImageFormat::Npy => "npy",
            ImageFormat::NpyZst => "npy.zst",
        }
    }
}

/// How the images of cameras are stored, as in plans and metadata.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ImageStorage {
    pub(crate) format: ImageFormat,
    /// 1 to 100; with less than 95, colour has half the resolution.
    pub(crate) jpeg_quality: u8,
}

impl Default for ImageStorage {
    fn default() -> ImageStorage {
        ImageStorage { format: ImageFormat::Png, jpeg_quality: 95 }
    }
}
