//! Layers of the map, and the commands that hide layers and static objects.

use bytemuck::{Pod, Zeroable};

/// Parameters of [`crate::Command::HideLayers`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HideLayers {
    /// Bits of [`layer`].
    pub layers: u32,
    /// 1: invisible and without collisions; 0: restored.
    pub hidden: u32,
}

/// Bits of [`HideLayers::layers`].
pub mod layer {
    /// Buildings.
    pub const BUILDINGS: u32 = 1 << 0;
    /// Trees, bushes, hedges.
    pub const FOLIAGE: u32 = 1 << 1;
    /// Parked cars.
    pub const PARKED_VEHICLES: u32 = 1 << 2;
    /// Benches, bins, signs and poles.
    pub const PROPS: u32 = 1 << 3;
    /// Street lights.
    pub const STREET_LIGHTS: u32 = 1 << 4;
    /// Walls and fences.
    pub const WALLS: u32 = 1 << 5;
    /// Every layer.
    pub const ALL: u32 = (1 << 6) - 1;
}

/// Parameters of [`crate::Command::HideObjects`]: up to 1024 static objects with consecutive numbers. An
/// object's number is its id in instance images without the highest bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HideObjects {
    /// Number of the object of bit 0, divided by 1024.
    pub block: u32,
    /// 1: invisible and without collisions; 0: restored, unless their layer is hidden.
    pub hidden: u32,
    /// A bit for each object of the block.
    pub bits: [u64; 16],
}
