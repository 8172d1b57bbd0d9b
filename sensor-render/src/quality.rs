use std::{fmt, str::FromStr};

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
