//! Planes of memory into the bytes of files.

use mesh::ObjectId;
use png::{BitDepth, ColorType, Compression, Filter};
use protocol::DEPTH_FAR_M;

use crate::collect::CollectError;

/// Depth in files: this many steps a metre.
pub(crate) const DEPTH_STEPS_PER_M: f32 = 100.0;

/// The depth of what is too far for the file, and of the sky.
pub(crate) const DEPTH_FAR: u16 = u16::MAX;

/// Set in the ids of static objects, in files. In memory it is the top bit.
pub(crate) const STATIC_BIT: u32 = 1 << 23;

/// Turns images into PNG files; keeps its memory from one to the next.
#[derive(Default)]
pub(crate) struct Encoder {
    pixels: Vec<u8>,
    /// The last file's bytes.
    pub(crate) file: Vec<u8>,
}

impl Encoder {
    /// RGB of red, green, blue, 255.
    pub(crate) fn color(&mut self, size: [u32; 2], rgba: &[u8]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend(rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]));
        self.png(size, ColorType::Rgb, BitDepth::Eight, Filter::Sub)
    }

    /// RGB as it is.
    pub(crate) fn picture(&mut self, size: [u32; 2], rgb: &[u8]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend_from_slice(rgb);
        self.png(size, ColorType::Rgb, BitDepth::Eight, Filter::Sub)
    }

    /// 16-bit steps of metres, native order, as [`protocol::output::DEPTH`].
    pub(crate) fn depth(&mut self, size: [u32; 2], metres: &[f32]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend(metres.iter().flat_map(|m| depth_steps(*m).to_be_bytes()));
        self.png(size, ColorType::Grayscale, BitDepth::Sixteen, Filter::Paeth)
    }

    /// Tags as they are.
    pub(crate) fn tag(&mut self, size: [u32; 2], tags: &[u8]) -> Result<(), CollectError> {
        self.pixels.clear();
        self.pixels.extend_from_slice(tags);
        self.png(size, ColorType::Grayscale, BitDepth::Eight, Filter::Up)
    }

    /// Ids as three bytes, the lowest first.
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
        // One filter for the whole image: choosing for each row costs a fifth and gains a twentieth.
        encoder.set_filter(filter);
        let write = || {
            let mut writer = encoder.write_header()?;
            writer.write_image_data(&self.pixels)?;
            writer.finish()
        };
        write().map_err(|e| CollectError::Bug { what: "encoding a PNG", why: e.to_string() })
    }
}

/// Metres in steps of the file.
pub(crate) fn depth_steps(metres: f32) -> u16 {
    if metres >= DEPTH_FAR_M { DEPTH_FAR } else { (metres * DEPTH_STEPS_PER_M + 0.5) as u16 }
}

/// The id of an actor or object as it stands in files: 24 bits.
pub(crate) fn file_id(id: u32) -> u32 {
    match ObjectId::from_instance(id) {
        Some(object) => object.number() & (STATIC_BIT - 1) | STATIC_BIT,
        None => id & (STATIC_BIT - 1),
    }
}

/// The returns of a lidar without the rays that met nothing: points, labels. Says how many.
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
    fn colour_comes_back_without_its_fourth_byte() {
        let mut encoder = Encoder::default();
        encoder.color([2, 1], &[1, 2, 3, 255, 40, 50, 60, 255]).unwrap();
        let image = decode::png(&encoder.file).unwrap();
        assert_eq!((image.width, image.height, image.bytes), (2, 1, vec![1, 2, 3, 40, 50, 60]));
    }

    #[test]
    fn depth_comes_back_within_half_a_centimetre() {
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
    fn ids_and_tags_come_back_as_they_were() {
        let ids = [0, 1, 70_000, 8_388_607, 0x8000_0000, 0x8000_0000 | 513];
        let mut encoder = Encoder::default();
        encoder.instance([3, 2], &ids).unwrap();
        let back = decode::png(&encoder.file).unwrap().ids();
        assert_eq!(back, [0, 1, 70_000, 8_388_607, STATIC_BIT, STATIC_BIT | 513]);
        encoder.tag([3, 2], &[0, 1, 14, 28, 24, 255]).unwrap();
        assert_eq!(decode::png(&encoder.file).unwrap().bytes, [0, 1, 14, 28, 24, 255]);
    }

    #[test]
    fn rays_that_met_nothing_are_left_out() {
        let rays = [[0.0; 4], [1.0, -2.0, 0.5, 0.25], [0.0; 4], [3.0, 0.0, 0.0, 0.0]];
        let met = [[0, 0], [17, 14], [0, 0], [0x8000_0000, 1]];
        let (mut points, mut labels) = (vec![9], vec![9]);
        assert_eq!(returns(&rays, &met, &mut points, &mut labels), 2);
        assert_eq!(decode::floats(&points), [1.0, -2.0, 0.5, 0.25, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!(decode::words(&labels), [17, 14, STATIC_BIT, 1]);
    }
}
