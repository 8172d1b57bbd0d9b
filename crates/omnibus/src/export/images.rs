//! Colour images: the files of the data set where they have the wanted format, or PNG, or JPEG.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

use anyhow::{Context, ensure};
use foxglove::Message;
use image_file::Pixels;

use crate::{
    collect::{
        CollectError, Encoder,
        format::{Camera, Sensor},
        jpeg,
    },
    export::set::{Frame, Scene, Set},
};

/// How colour images are stored.
pub(crate) struct Images {
    jpeg_quality: Option<u8>,
    extension: &'static str,
}

impl Images {
    /// Stores JPEG of a quality from 1 to 100. Without one the files of the data sets are taken as they are,
    /// and PNG where these hold arrays.
    pub(crate) fn new(jpeg_quality: Option<u8>, set: &Set) -> anyhow::Result<Images> {
        let is_jpeg = |scene: &Scene| {
            let outputs = &scene.metadata.outputs;
            outputs.iter().any(|output| output.extension == "jpg")
        };
        let count = set.scenes().iter().filter(|scene| is_jpeg(scene)).count();
        ensure!(
            jpeg_quality.is_some() || count == 0 || count == set.scenes().len(),
            "{count} of {} scenes have images in JPEG; use --jpeg QUALITY for all",
            set.scenes().len()
        );
        let extension = if jpeg_quality.is_some() || count > 0 { "jpg" } else { "png" };
        Ok(Images { jpeg_quality, extension })
    }

    /// Returns the extension of the files.
    pub(crate) fn extension(&self) -> &'static str {
        self.extension
    }

    /// Returns the extension of a camera's file in the data set, if it can be taken as it is.
    fn stored<'a>(&self, frame: &'a Frame, folder: &str) -> Option<&'a str> {
        let stored = frame.scene.metadata.extension(folder);
        (self.jpeg_quality.is_none() && stored == self.extension).then_some(stored)
    }

    /// Returns the file of a camera's image.
    pub(crate) fn file(
        &self,
        frame: &Frame,
        sensor: &Sensor,
        camera: &Camera,
    ) -> anyhow::Result<Vec<u8>> {
        let folder = format!("{}/color", sensor.name);
        if let Some(extension) = self.stored(frame, &folder) {
            return Ok(frame.bytes(&folder, extension)?);
        }
        let image = frame.image(sensor, camera, "color")?;
        ensure!(
            image.bytes.len() == image.width * image.height * 3,
            "an image of {} x {} pixels has {} bytes, is not 8-bit RGB",
            image.width,
            image.height,
            image.bytes.len()
        );
        let size = [image.width, image.height].map(|side| side as u32);
        let Some(quality) = self.jpeg_quality else {
            let mut encoder = Encoder::default();
            encoder.picture(size, &image.bytes)?;
            return Ok(encoder.file);
        };
        let mut file = Vec::new();
        jpeg(size, Pixels::Rgb(&image.bytes), quality, &mut file)?;
        Ok(file)
    }

    /// Appends a camera's image to a message as the bytes of a field.
    pub(crate) fn append(
        &self,
        frame: &Frame,
        sensor: &Sensor,
        camera: &Camera,
        message: &mut Message,
        field: u32,
    ) -> anyhow::Result<()> {
        let folder = format!("{}/color", sensor.name);
        let Some(extension) = self.stored(frame, &folder) else {
            let file = self.file(frame, sensor, camera)?;
            message.begin_bytes(field, file.len()).extend_from_slice(&file);
            return Ok(());
        };
        let path = frame.path(&folder, extension);
        let mut read = || {
            let file = File::open(&path)?;
            let len = file.metadata()?.len();
            let read = file.take(len).read_to_end(message.begin_bytes(field, len as usize))?;
            if read as u64 == len { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
        };
        read().map_err(|e| CollectError::io(&path, e).into())
    }

    /// Puts a camera's image at `to`: a file of the data set as another name of the same file where the file
    /// system allows it, else as a copy.
    pub(crate) fn place(
        &self,
        frame: &Frame,
        sensor: &Sensor,
        camera: &Camera,
        to: &Path,
    ) -> anyhow::Result<()> {
        let folder = format!("{}/color", sensor.name);
        if let Some(extension) = self.stored(frame, &folder) {
            return link(&frame.path(&folder, extension), to);
        }
        let file = self.file(frame, sensor, camera)?;
        fs::write(to, file).with_context(|| to.display().to_string())
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
