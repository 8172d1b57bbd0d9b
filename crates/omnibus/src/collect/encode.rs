//! Encodes the planes of a measurement as files.

use client_lib::RadarDetection;
use image_file::{Filter, Pixels, Samples};
use mesh::ObjectId;
use protocol::{DEPTH_FAR_M, output};

use crate::collect::{
    CollectError,
    image_storage::{ImageFormat, ImageStorage},
    npy,
};

/// Steps per metre of the depth in files.
pub(crate) const DEPTH_STEPS_PER_M: f32 = 100.0;

/// The depth of the sky, and of everything beyond the range of the file.
pub(crate) const DEPTH_FAR: u16 = u16::MAX;

/// The bit that marks the id of a static object in files; in memory it is the top bit.
pub(crate) const STATIC_BIT: u32 = 1 << 23;

/// The level of Zstandard: a higher one takes longer than the disk for what it saves.
const ZSTD_LEVEL: i32 = 1;

/// Encodes images and reuses its memory.
#[derive(Default)]
pub(crate) struct Encoder {
    pixels: Vec<u8>,
    /// The bytes of the last file.
    pub(crate) file: Vec<u8>,
}

impl Encoder {
    /// Encodes an output of a camera, as its plane has it (see [`protocol::output`]).
    pub(crate) fn image(
        &mut self,
        storage: ImageStorage,
        output: u32,
        size: [u32; 2],
        plane: &[u8],
    ) -> Result<(), CollectError> {
        match (storage.format, output) {
            (ImageFormat::Npy, _) => {
                self.array(output, size, plane);
                Ok(())
            }
            (ImageFormat::NpyZst, _) => {
                self.array(output, size, plane);
                std::mem::swap(&mut self.pixels, &mut self.file);
                self.zstd()
            }
            (ImageFormat::Jpeg, output::COLOR) => {
                jpeg(size, Pixels::Rgbx(plane), storage.jpeg_quality, &mut self.file)
            }
            (_, output::COLOR) => self.color(size, plane),
            (_, output::DEPTH) => self.depth(size, bytemuck::cast_slice(plane)),
            (_, output::TAG) => self.tag(size, plane),
            _ => self.instance(size, bytemuck::cast_slice(plane)),
        }
    }

    /// Encodes RGB.
    pub(crate) fn picture(&mut self, size: [u32; 2], rgb: &[u8]) -> Result<(), CollectError> {
        let row = |y: usize, to: &mut [u8]| to.copy_from_slice(&rgb[y * to.len()..][..to.len()]);
        self.png(size, rgb.len(), Samples::Rgb8, Filter::Paeth, row)
    }

    /// Encodes red, green, blue, 255 as RGB.
    fn color(&mut self, size: [u32; 2], rgba: &[u8]) -> Result<(), CollectError> {
        let pixels = rgba.as_chunks().0;
        let row = |y, to: &mut [u8]| first_three(row_of(size, y, pixels), to);
        self.png(size, pixels.len() * 3, Samples::Rgb8, Filter::Paeth, row)
    }

    /// Encodes depth, metres in native order as in [`protocol::output::DEPTH`], as 16-bit steps.
    fn depth(&mut self, size: [u32; 2], metres: &[f32]) -> Result<(), CollectError> {
        let row = |y, to: &mut [u8]| {
            for (bytes, metres) in to.as_chunks_mut().0.iter_mut().zip(row_of(size, y, metres)) {
                *bytes = depth_steps(*metres).to_be_bytes();
            }
        };
        self.png(size, metres.len() * 2, Samples::Grey16, Filter::Paeth, row)
    }

    /// Encodes tags.
    fn tag(&mut self, size: [u32; 2], tags: &[u8]) -> Result<(), CollectError> {
        let row = |y, to: &mut [u8]| to.copy_from_slice(row_of(size, y, tags));
        self.png(size, tags.len(), Samples::Grey8, Filter::Up, row)
    }

    /// Encodes ids as three bytes, the lowest first.
    fn instance(&mut self, size: [u32; 2], ids: &[u32]) -> Result<(), CollectError> {
        let row = |y, to: &mut [u8]| {
            for (bytes, id) in to.as_chunks_mut().0.iter_mut().zip(row_of(size, y, ids)) {
                let [low, middle, high, _] = file_id(*id).to_le_bytes();
                *bytes = [low, middle, high];
            }
        };
        self.png(size, ids.len() * 3, Samples::Rgb8, Filter::Up, row)
    }

    /// Encodes an image of this many bytes, which `row` writes row by row.
    fn png(
        &mut self,
        size: [u32; 2],
        bytes: usize,
        samples: Samples,
        filter: Filter,
        row: impl Fn(usize, &mut [u8]),
    ) -> Result<(), CollectError> {
        let bug = |why| CollectError::Bug { what: "encoding a PNG", why };
        let [width, height] = size;
        let expected = width as usize * height as usize * samples.bytes();
        if bytes != expected {
            return Err(bug(format!(
                "{width} x {height} pixels have {expected} bytes, not {bytes}"
            )));
        }
        self.file.clear();
        image_file::png(size, samples, filter, row, &mut self.file).map_err(|e| bug(e.to_string()))
    }

    /// Encodes an array of NumPy.
    fn array(&mut self, output: u32, [width, height]: [u32; 2], plane: &[u8]) {
        let (kind, shape) = match output {
            output::COLOR => ("|u1", format!("({height}, {width}, 3)")),
            output::DEPTH => ("<f4", format!("({height}, {width})")),
            output::TAG => ("|u1", format!("({height}, {width})")),
            _ => ("<u4", format!("({height}, {width})")),
        };
        npy::head(kind, &shape, &mut self.file);
        match output {
            output::COLOR => {
                let (begin, pixels) = (self.file.len(), plane.as_chunks().0);
                self.file.resize(begin + 3 * pixels.len(), 0);
                first_three(pixels, &mut self.file[begin..]);
            }
            output::INSTANCE => {
                let ids: &[u32] = bytemuck::cast_slice(plane);
                let begin = self.file.len();
                self.file.resize(begin + plane.len(), 0);
                for (bytes, id) in self.file[begin..].as_chunks_mut().0.iter_mut().zip(ids) {
                    *bytes = file_id(*id).to_le_bytes();
                }
            }
            _ => self.file.extend_from_slice(plane),
        }
    }

    /// Compresses `pixels`.
    fn zstd(&mut self) -> Result<(), CollectError> {
        self.file.resize(zstd::zstd_safe::compress_bound(self.pixels.len()), 0);
        let length =
            zstd::bulk::compress_to_buffer(&self.pixels, &mut self.file[..], ZSTD_LEVEL).map_err(
                |e| CollectError::Bug { what: "compressing an array", why: e.to_string() },
            )?;
        self.file.truncate(length);
        Ok(())
    }
}

/// Encodes 8-bit pixels as JPEG.
pub(crate) fn jpeg(
    size: [u32; 2],
    pixels: Pixels<'_>,
    quality: u8,
    file: &mut Vec<u8>,
) -> Result<(), CollectError> {
    file.clear();
    image_file::jpeg(size, pixels, quality, file)
        .map_err(|e| CollectError::Bug { what: "encoding a JPEG", why: e.to_string() })
}

/// Returns a row of an image, counted from the top.
fn row_of<T>([width, _]: [u32; 2], y: usize, pixels: &[T]) -> &[T] {
    &pixels[y * width as usize..][..width as usize]
}

/// Copies the first three of every four bytes.
fn first_three(of: &[[u8; 4]], to: &mut [u8]) {
    // Four pixels at a time, because the compiler turns copies of single ones into calls.
    let (twelves, rest) = to.as_chunks_mut::<12>();
    let (fours, last) = of.as_chunks::<4>();
    for (to, [a, b, c, d]) in twelves.iter_mut().zip(fours) {
        *to = [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], d[0], d[1], d[2]];
    }
    for (to, [red, green, blue, _]) in rest.as_chunks_mut().0.iter_mut().zip(last) {
        *to = [*red, *green, *blue];
    }
}

/// Converts metres to steps of the file.
pub(crate) fn depth_steps(metres: f32) -> u16 {
    if metres >= DEPTH_FAR_M { DEPTH_FAR } else { (metres * DEPTH_STEPS_PER_M + 0.5) as u16 }
}

/// Returns the 24-bit id of an actor or object in files.
pub(crate) fn file_id(id: u32) -> u32 {
    match ObjectId::from_instance(id) {
        Some(object) => object.number() & (STATIC_BIT - 1) | STATIC_BIT,
        None => id & (STATIC_BIT - 1),
    }
}

/// Writes the points and labels of all rays that hit something, and returns their number.
pub(crate) fn returns(
    rays: &[[f32; 4]],
    met: &[[u32; 2]],
    points: &mut Vec<u8>,
    labels: &mut Vec<u8>,
) -> u64 {
    points.clear();
    labels.clear();
    let mut count = 0;
    for (ray, [id, tag]) in rays.iter().zip(met) {
        if *id != 0 || *tag != 0 {
            for value in ray {
                points.extend_from_slice(&value.to_le_bytes());
            }
            labels.extend_from_slice(&file_id(*id).to_le_bytes());
            labels.extend_from_slice(&tag.to_le_bytes());
            count += 1;
        }
    }
    count
}

/// Writes the detections of a radar and their labels, and returns their number.
pub(crate) fn detections(
    found: impl Iterator<Item = (RadarDetection, [u32; 2])>,
    points: &mut Vec<u8>,
    labels: &mut Vec<u8>,
) -> u64 {
    points.clear();
    labels.clear();
    for (one, [id, tag]) in found {
        let RadarDetection { velocity_mps, azimuth_rad, altitude_rad, depth_m } = one;
        let row = [velocity_mps, azimuth_rad, altitude_rad, depth_m];
        points.extend(row.iter().flat_map(|v| v.to_le_bytes()));
        labels.extend([file_id(id), tag].iter().flat_map(|v| v.to_le_bytes()));
    }
    points.len() as u64 / 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::decode;

    const FORMATS: [ImageFormat; 4] =
        [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Npy, ImageFormat::NpyZst];

    /// Encodes and decodes a plane.
    fn again(format: ImageFormat, output: u32, size: [u32; 2], plane: &[u8]) -> decode::Image {
        let mut encoder = Encoder::default();
        // What an encoder reuses is of another image first.
        let storage = ImageStorage { format, ..ImageStorage::default() };
        encoder.image(storage, output::TAG, [3, 5], &[7; 15]).unwrap();
        encoder.image(storage, output, size, plane).unwrap();
        let image = decode::image(format.extension(output), &encoder.file).unwrap();
        assert_eq!([image.width, image.height], size.map(|side| side as usize), "{format:?}");
        image
    }

    #[test]
    fn colour_is_decoded_without_its_fourth_byte() {
        for format in FORMATS.into_iter().filter(|format| *format != ImageFormat::Jpeg) {
            let image = again(format, output::COLOR, [2, 1], &[1, 2, 3, 255, 40, 50, 60, 255]);
            assert_eq!(image.bytes, [1, 2, 3, 40, 50, 60], "{format:?}");
        }
    }

    #[test]
    fn colour_in_jpeg_differs_by_little_and_has_no_other_order() {
        let plane: Vec<u8> = (0..64 * 48u32)
            .flat_map(|i| [(i % 64 * 3) as u8, (i / 64 * 4) as u8, 90, 255])
            .collect();
        let image = again(ImageFormat::Jpeg, output::COLOR, [64, 48], &plane);
        for (found, wanted) in image.bytes.chunks_exact(3).zip(plane.chunks_exact(4)) {
            for channel in 0..3 {
                assert!(found[channel].abs_diff(wanted[channel]) <= 6, "{found:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn depth_is_decoded_within_half_a_centimetre() {
        let metres = [0.0f32, 0.004, 0.126, 12.345, 655.3, 655.36, 999.0, DEPTH_FAR_M];
        for format in FORMATS {
            let image = again(format, output::DEPTH, [4, 2], bytemuck::cast_slice(&metres));
            let steps = image.sixteen();
            for (metre, step) in metres.iter().zip(&steps).take(5) {
                assert!(
                    (f32::from(*step) / DEPTH_STEPS_PER_M - metre).abs() <= 0.00501,
                    "{metre} {step}"
                );
            }
            assert_eq!(steps[5..], [DEPTH_FAR; 3], "{format:?}");
        }
    }

    #[test]
    fn ids_and_tags_are_decoded_unchanged() {
        let ids = [0u32, 1, 70_000, 8_388_607, 0x8000_0000, 0x8000_0000 | 513];
        for format in FORMATS {
            let image = again(format, output::INSTANCE, [3, 2], bytemuck::cast_slice(&ids));
            assert_eq!(image.ids(), [0, 1, 70_000, 8_388_607, STATIC_BIT, STATIC_BIT | 513]);
            let tags = [0, 1, 14, 28, 24, 255];
            assert_eq!(again(format, output::TAG, [3, 2], &tags).bytes, tags, "{format:?}");
        }
    }

    #[test]
    fn rays_that_hit_nothing_are_left_out() {
        let rays = [[0.0; 4], [1.0, -2.0, 0.5, 0.25], [0.0; 4], [3.0, 0.0, 0.0, 0.0]];
        let met = [[0, 0], [17, 14], [0, 0], [0x8000_0000, 1]];
        let (mut points, mut labels) = (vec![9], vec![9]);
        assert_eq!(returns(&rays, &met, &mut points, &mut labels), 2);
        assert_eq!(decode::floats(&points), [1.0, -2.0, 0.5, 0.25, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!(decode::words(&labels), [17, 14, STATIC_BIT, 1]);
    }
}
