//! Encodes the planes of a measurement as files.

use mesh::ObjectId;
use png::{BitDepth, ColorType, Compression, Filter};
use protocol::DEPTH_FAR_M;

use crate::collect::CollectError;

/// Steps per metre of the depth in files.
pub(crate) const DEPTH_STEPS_PER_M: f32 = 100.0;

/// The depth of the sky, and of everything beyond the range of the file.
pub(crate) const DEPTH_FAR: u16 = u16::MAX;

/// The bit that marks the id of a static object in files; in memory it is the top bit.
pub(crate) const STATIC_BIT: u32 = 1 << 23;

/// Encodes images as PNG and reuses its memory.
#[derive(Default)]
pub(crate) struct Encoder {
    pixels: Vec<u8>,
    /// The bytes of the last file.
    pub(crate) file: Vec<u8>,
}

impl Encoder {
    /// Encodes red, green, blue, 255 as RGB.
    pub(crate) fn color(&mut self, size: [u32; 2], rgba: &[u8]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend(rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]));
        self.png(size, ColorType::Rgb, BitDepth::Eight, Filter::Sub)
    }

    /// Encodes RGB.
    pub(crate) fn picture(&mut self, size: [u32; 2], rgb: &[u8]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend_from_slice(rgb);
        self.png(size, ColorType::Rgb, BitDepth::Eight, Filter::Sub)
    }

    /// Encodes depth, metres in native order as in [`protocol::output::DEPTH`], as 16-bit steps.
    pub(crate) fn depth(&mut self, size: [u32; 2], metres: &[f32]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend(metres.iter().flat_map(|m| depth_steps(*m).to_be_bytes()));
        self.png(size, ColorType::Grayscale, BitDepth::Sixteen, Filter::Paeth)
    }

    /// Encodes tags.
    pub(crate) fn tag(&mut self, size: [u32; 2], tags: &[u8]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend_from_slice(tags);
        self.png(size, ColorType::Grayscale, BitDepth::Eight, Filter::Up)
    }

    /// Encodes ids as three bytes, the lowest first.
    pub(crate) fn instance(&mut self, size: [u32; 2], ids: &[u32]) -> Result<(), CollectError> {
        self.pixels.clear();
        let bytes = |id: &u32| {
            let [low, middle, high, _] = file_id(*id).to_le_bytes();
            [low, middle, high]
        };
        self.pixels.extend(ids.iter().flat_map(bytes));
        self.png(size, ColorType::Rgb, BitDepth::Eight, Filter::Up)
    }

    fn png(
        &mut self,
        [width, height]: [u32; 2],
        color: ColorType,
        depth: BitDepth,
        filter: Filter,
    ) -> Result<(), CollectError> {
        self.file.clear();
        let mut encoder = png::Encoder::new(&mut self.file, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_compression(Compression::Fast);
        // One filter for the whole image: a choice per row costs a fifth of the time and saves a
        // twentieth.
        encoder.set_filter(filter);
        let write = || {
            let mut writer = encoder.write_header()?;
            writer.write_image_data(&self.pixels)?;
            writer.finish()
        };
        write().map_err(|e| CollectError::Bug { what: "encoding a PNG", why: e.to_string() })
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
            points.extend(ray.iter().flat_map(|v| v.to_le_bytes()));
            labels.extend([file_id(*id), *tag].iter().flat_map(|v| v.to_le_bytes()));
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::decode;

    #[test]
    fn colour_is_decoded_without_its_fourth_byte() {
        let mut encoder = Encoder::default();
        encoder.color([2, 1], &[1, 2, 3, 255, 40, 50, 60, 255]).unwrap();
        let image = decode::png(&encoder.file).unwrap();
        assert_eq!((image.width, image.height, image.bytes), (2, 1, vec![1, 2, 3, 40, 50, 60]));
    }

    #[test]
    fn depth_is_decoded_within_half_a_centimetre() {
        let metres = [0.0, 0.004, 0.126, 12.345, 655.3, 655.36, 999.0, DEPTH_FAR_M];
        let mut encoder = Encoder::default();
        encoder.depth([4, 2], &metres).unwrap();
        let steps = decode::png(&encoder.file).unwrap().sixteen();
        for (metre, step) in metres.iter().zip(&steps).take(5) {
            assert!(
                (f32::from(*step) / DEPTH_STEPS_PER_M - metre).abs() <= 0.00501,
                "{metre} {step}"
            );
        }
        assert_eq!(steps[5..], [DEPTH_FAR; 3]);
    }

    #[test]
    fn ids_and_tags_are_decoded_unchanged() {
        let ids = [0, 1, 70_000, 8_388_607, 0x8000_0000, 0x8000_0000 | 513];
        let mut encoder = Encoder::default();
        encoder.instance([3, 2], &ids).unwrap();
        let back = decode::png(&encoder.file).unwrap().ids();
        assert_eq!(back, [0, 1, 70_000, 8_388_607, STATIC_BIT, STATIC_BIT | 513]);
        encoder.tag([3, 2], &[0, 1, 14, 28, 24, 255]).unwrap();
        assert_eq!(decode::png(&encoder.file).unwrap().bytes, [0, 1, 14, 28, 24, 255]);
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
