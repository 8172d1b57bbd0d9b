//! Colour images: the PNG files of the data set, or JPEG.

use std::{fs, path::Path};

use anyhow::{Context, ensure};
use jpeg_encoder::ColorType;

use crate::{
    collect::format::{Camera, Sensor},
    export::set::Frame,
};

/// How colour images are stored.
pub(crate) struct Images {
    jpeg_quality: Option<u8>,
}

impl Images {
    /// Stores JPEG of a quality from 1 to 100; without one the PNG files as they are.
    pub(crate) fn new(jpeg_quality: Option<u8>) -> Images {
        Images { jpeg_quality }
    }

    /// Returns the extension of the files.
    pub(crate) fn extension(&self) -> &'static str {
        if self.jpeg_quality.is_some() { "jpg" } else { "png" }
    }

    /// Returns the file of a camera's image.
    pub(crate) fn file(
        &self,
        frame: &Frame,
        sensor: &Sensor,
        camera: &Camera,
    ) -> anyhow::Result<Vec<u8>> {
        match self.jpeg_quality {
            None => Ok(frame.bytes(&format!("{}/color", sensor.name), "png")?),
            Some(quality) => {
                let image = frame.image(sensor, camera, "color")?;
                jpeg(image.width, image.height, &image.bytes, quality)
            }
        }
    }

    /// Puts a camera's image at `to`: a PNG as another name of the same file where the file system
    /// allows it, else as a copy.
    pub(crate) fn place(
        &self,
        frame: &Frame,
        sensor: &Sensor,
        camera: &Camera,
        to: &Path,
    ) -> anyhow::Result<()> {
        if self.jpeg_quality.is_some() {
            let file = self.file(frame, sensor, camera)?;
            return fs::write(to, file).with_context(|| to.display().to_string());
        }
        link(&frame.path(&format!("{}/color", sensor.name), "png"), to)
    }
}

/// Gives a file a second name, or copies it where the file system does not allow that.
pub(crate) fn link(from: &Path, to: &Path) -> anyhow::Result<()> {
    if fs::hard_link(from, to).is_ok() {
        return Ok(());
    }
    let shown = || format!("copying {} to {}", from.display(), to.display());
    fs::copy(from, to).map(drop).with_context(shown)
}

/// Encodes 8-bit RGB.
fn jpeg(width: usize, height: usize, rgb: &[u8], quality: u8) -> anyhow::Result<Vec<u8>> {
    ensure!(
        rgb.len() == width * height * 3,
        "an image of {width} x {height} pixels has {} bytes, is not 8-bit RGB",
        rgb.len()
    );
    let size = |pixels: usize| u16::try_from(pixels).context("JPEG allows 65535 pixels at most");
    let mut file = Vec::new();
    jpeg_encoder::Encoder::new(&mut file, quality).encode(
        rgb,
        size(width)?,
        size(height)?,
        ColorType::Rgb,
    )?;
    Ok(file)
}
