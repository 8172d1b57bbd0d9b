use std::{fmt, str::FromStr};

use glam::Vec4;
use protocol::quality;

/// Rays per pixel of colour images.
///
/// A ray passes through the surface next to the pixel's centre, so that edges are smooth, and tests
/// the shadow of another point of the sun's disc, so that shadows have a penumbra. Rays of one pixel
/// that hit the same triangle share its shading; only shadows are computed for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// One ray through the centre of each pixel, hard shadows.
    #[default]
    Low,
    /// Four rays.
    Standard,
    /// Sixteen rays.
    Epic,
}

impl Quality {
    /// Every level, the cheapest first.
    pub const ALL: [Quality; 3] = [Quality::Low, Quality::Standard, Quality::Epic];

    /// Returns the level's name.
    pub fn name(self) -> &'static str {
        match self {
            Quality::Low => "low",
            Quality::Standard => "standard",
            Quality::Epic => "epic",
        }
    }

    /// Returns its code, one of [`protocol::quality`].
    pub fn code(self) -> u32 {
        match self {
            Quality::Low => quality::LOW,
            Quality::Standard => quality::STANDARD,
            Quality::Epic => quality::EPIC,
        }
    }

    /// Returns the level that a sensor asks for by one of [`protocol::quality`]; `self` for
    /// [`quality::DEFAULT`].
    pub(crate) fn or_own(self, code: u32) -> Quality {
        match code {
            quality::LOW => Quality::Low,
            quality::STANDARD => Quality::Standard,
            quality::EPIC => Quality::Epic,
            _ => self,
        }
    }

    /// Returns the rays of each pixel.
    pub(crate) fn samples(self) -> &'static [Sample] {
        match self {
            Quality::Low => &SAMPLES[..1],
            Quality::Standard => &SAMPLES[1..5],
            Quality::Epic => &SAMPLES[5..],
        }
    }

    /// Returns the direction of the sky for which each ray computes ambient occlusion.
    pub(crate) fn sky_directions(self) -> &'static [Vec4] {
        let first = self.first_sample() as usize;
        &SKY_DIRECTIONS[first..first + self.samples().len()]
    }

    /// Returns the index of the first of these rays in [`SAMPLES`].
    pub(crate) fn first_sample(self) -> u32 {
        match self {
            Quality::Low => 0,
            Quality::Standard => 1,
            Quality::Epic => 5,
        }
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Text that is not the name of a level.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("quality is {0:?}; use low, standard or epic")]
pub struct UnknownQuality(String);

impl FromStr for Quality {
    type Err = UnknownQuality;

    /// Reads a name, in upper or lower case.
    fn from_str(text: &str) -> Result<Quality, UnknownQuality> {
        let named = |level: &Quality| level.name().eq_ignore_ascii_case(text);
        Quality::ALL.into_iter().find(named).ok_or_else(|| UnknownQuality(text.into()))
    }
}

/// Ray of a pixel: its offset from the centre in pixels, to the right and down, and its point on a
/// disc of radius 1 that represents the sun.
pub(crate) type Sample = [f32; 4];

/// Rays of each level. Four: a rotated grid; sixteen: a Hammersley set, of which four in a row spread
/// over the pixel. The points on the disc are on a sunflower spiral. The shaders read the same
/// vectors.
#[rustfmt::skip]
pub(crate) const SAMPLES: [Sample; 21] = [
    [0.0, 0.0, 0.0, 0.0],

    [-0.125, -0.375, 0.353_55, 0.0],
    [0.375, -0.125, -0.451_54, 0.413_65],
    [-0.375, 0.125, 0.069_12, -0.787_54],
    [0.125, 0.375, 0.569_14, 0.742_35],

    [-0.468_75, -0.468_75, 0.176_78, 0.0],
    [-0.218_75, -0.343_75, -0.315_56, -0.607_59],
    [0.031_25, -0.406_25, -0.547_51, 0.778_77],
    [0.281_25, -0.281_25, 0.494_70, -0.314_68],
    [-0.406_25, 0.031_25, -0.764_75, -0.443_19],
    [-0.156_25, 0.156_25, 0.284_57, 0.371_17],
    [0.093_75, 0.093_75, 0.343_35, -0.733_73],
    [0.343_75, 0.218_75, -0.225_77, 0.206_83],
    [-0.343_75, -0.218_75, 0.684_64, 0.250_03],
    [-0.093_75, -0.093_75, -0.126_49, -0.976_09],
    [0.156_25, -0.156_25, -0.165_47, 0.615_53],
    [0.406_25, -0.031_25, 0.897_13, -0.197_23],
    [-0.281_25, 0.281_25, -0.522_22, -0.092_37],
    [-0.031_25, 0.406_25, 0.253_73, 0.808_93],
    [0.218_75, 0.343_75, 0.034_56, -0.393_77],
    [0.468_75, 0.468_75, -0.712_26, 0.294_01],
];

/// Directions in world space towards the sky, of unit length, for each of [`SAMPLES`]: as dense as the
/// cosine from the vertical, so that each stands for an equal part of the light on level ground. The first
/// is not used. The shaders read the same vectors.
#[rustfmt::skip]
pub(crate) const SKY_DIRECTIONS: [Vec4; 21] = [
    Vec4::new(0.000_00, 0.000_00, 1.000_00, 0.0),

    Vec4::new(0.546_57, 0.226_40, 0.806_23, 0.0),
    Vec4::new(-0.331_41, 0.800_10, 0.500_00, 0.0),
    Vec4::new(-0.619_76, -0.256_71, 0.741_62, 0.0),
    Vec4::new(0.308_53, -0.744_86, 0.591_61, 0.0),

    Vec4::new(0.171_02, 0.032_62, 0.984_73, 0.0),
    Vec4::new(0.293_58, 0.432_00, 0.852_75, 0.0),
    Vec4::new(0.599_99, 0.394_12, 0.696_20, 0.0),
    Vec4::new(0.176_53, 0.852_44, 0.492_13, 0.0),
    Vec4::new(-0.296_22, -0.056_51, 0.953_45, 0.0),
    Vec4::new(-0.324_57, -0.477_59, 0.816_43, 0.0),
    Vec4::new(-0.634_30, -0.416_66, 0.651_20, 0.0),
    Vec4::new(-0.183_46, -0.885_88, 0.426_10, 0.0),
    Vec4::new(-0.072_95, 0.382_41, 0.921_11, 0.0),
    Vec4::new(-0.519_19, 0.352_84, 0.778_42, 0.0),
    Vec4::new(-0.438_04, 0.666_85, 0.602_86, 0.0),
    Vec4::new(-0.918_10, 0.190_13, 0.347_76, 0.0),
    Vec4::new(0.086_31, -0.452_48, 0.887_59, 0.0),
    Vec4::new(0.557_70, -0.379_02, 0.738_45, 0.0),
    Vec4::new(0.458_42, -0.697_88, 0.550_28, 0.0),
    Vec4::new(0.949_23, -0.196_58, 0.245_59, 0.0),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_of_the_sky_are_unit_vectors_upwards_that_spread_around_the_zenith() {
        for level in [Quality::Standard, Quality::Epic] {
            let directions = level.sky_directions();
            let sum: Vec4 = directions.iter().sum();
            assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-4 && d.z > 0.1));
            assert!(sum.truncate().truncate().length() < 0.15 * directions.len() as f32, "{sum}");
        }
    }
}
