//! State of street lights.

use bytemuck::{Pod, Zeroable};

use crate::range::within;

/// Values of [`SetStreetLights::mode`].
pub mod street_light {
    /// Off.
    pub const OFF: u32 = 0;
    /// On, day and night.
    pub const ON: u32 = 1;
    /// On while it is dark (the default).
    pub const AT_NIGHT: u32 = 2;
}

/// Parameters of [`crate::Command::SetStreetLights`]: up to 1024 street lights with consecutive numbers.
/// The number of a light is the id of its pole in instance images without the highest bit.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SetStreetLights {
    /// Number of the light of bit 0, divided by 1024.
    pub block: u32,
    /// One of [`street_light`].
    pub mode: u32,
    /// Red, green, blue, 255; sRGB; 0: the default colour of each light.
    pub color: u32,
    /// Intensity relative to the default of each light.
    pub intensity: f32,
    /// A bit for each light of the block.
    pub bits: [u64; 16],
}

const _: () = assert!(size_of::<SetStreetLights>() == 144);

impl SetStreetLights {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        if self.mode > street_light::AT_NIGHT {
            return Err(format!("unknown street light mode {}, not 0 to 2", self.mode));
        }
        within("a lamp's intensity of its brightness", self.intensity, 0.0, 100.0)
    }

    /// The numbers of the lights.
    pub fn numbers(&self) -> impl Iterator<Item = u32> {
        let bits = self.bits;
        let count = u64::BITS * bits.len() as u32;
        let first = self.block.saturating_mul(count);
        let is_set = move |within: &u32| bits[*within as usize / 64] >> (within % 64) & 1 != 0;
        (0..count).filter(is_set).map(move |within| first.saturating_add(within))
    }
}
