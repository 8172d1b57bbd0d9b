use bytemuck::{Pod, Zeroable};

use crate::FilePath;

/// The inputs from which every stage builds the same world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Episode {
    /// The map's name.
    pub map: String,
    /// Seed of scenery and traffic.
    pub seed: u64,
    /// The map as OpenDRIVE text.
    pub open_drive: String,
}

/// Parameters of [`crate::Command::LoadMap`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LoadMap {
    /// Name of a map, or an absolute path; empty: the current map.
    pub map: FilePath,
    /// Seed of scenery and traffic; used with [`load::SEED`].
    pub seed: u64,
    /// Layers that are hidden at first: bits of [`crate::layer`].
    pub hidden_layers: u32,
    /// Bits of [`load`].
    pub flags: u32,
}

/// Bits of [`LoadMap::flags`].
pub mod load {
    /// `seed` is used instead of the current seed.
    pub const SEED: u32 = 1;
}

/// A blueprint as clients see it; its index in the list is [`crate::ActorState::blueprint`].
#[derive(Clone, Debug, PartialEq)]
pub struct BlueprintInfo {
    /// The id, for example `vehicle.tesla.model3`.
    pub id: String,
    /// The semantic tag's code (`mesh::Tag`).
    pub tag: u8,
    /// Half extents of the bounding box.
    pub half_extents_m: [f32; 3],
    /// Centre of the bounding box in actor space.
    pub center_m: [f32; 3],
}
