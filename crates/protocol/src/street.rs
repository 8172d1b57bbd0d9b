//! Street lamps, switched by hand.

use bytemuck::{Pod, Zeroable};

use crate::vehicle::within;

/// Values of [`SetStreetLights::mode`].
pub mod shine {
    /// Dark.
    pub const OFF: u32 = 0;
    /// Day and night.
    pub const ON: u32 = 1;
    /// While it is dark: as all lamps do at first.
    pub const AT_NIGHT: u32 = 2;
}

/// See [`crate::Command::SetStreetLights`]. A lamp's number is that of its pole in instance images,
/// without the highest bit.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SetStreetLights {
    /// The number of the first bit's lamp, over 1024.
    pub block: u32,
    /// One of [`shine`].
    pub mode: u32,
    /// Red, green, blue, 255, sRGB; 0: each lamp's own.
    pub color: u32,
    /// How bright, as a share of a lamp's own brightness.
    pub share: f32,
    /// Which of the block's 1024.
    pub bits: [u64; 16],
}

const _: () = assert!(size_of::<SetStreetLights>() == 144);

impl SetStreetLights {
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        if self.mode > shine::AT_NIGHT {
            return Err(format!("a lamp has no mode {}", self.mode));
        }
        within("a lamp's share of its brightness", self.share, 0.0, 100.0)
    }

    /// The numbers of its lamps.
    pub fn numbers(&self) -> impl Iterator<Item = u32> {
        let bits = self.bits;
        let count = u64::BITS * bits.len() as u32;
        let first = self.block.saturating_mul(count);
        let is_set = move |within: &u32| bits[*within as usize / 64] >> (within % 64) & 1 != 0;
        (0..count).filter(is_set).map(move |within| first.saturating_add(within))
    }
}
