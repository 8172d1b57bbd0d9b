use bytemuck::{Pod, Zeroable};

use crate::FilePath;

/// What world an instance runs: every stage builds the same from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Episode {
    /// The map's name.
    pub map: String,
    /// Decides scenery and traffic.
    pub seed: u64,
    /// The map itself.
    pub open_drive: String,
}

/// See [`crate::Command::LoadMap`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LoadMap {
    /// The name of a map, or an absolute path; empty: the one that runs.
    pub map: FilePath,
    /// Decides scenery and traffic, where [`load::SEED`] says so.
    pub seed: u64,
    /// Layers of the town that are switched off at first: bits of [`crate::layer`].
    pub hidden_layers: u32,
    /// Bits of [`load`].
    pub flags: u32,
}

/// Bits of [`LoadMap::flags`].
pub mod load {
    /// The seed is the one given, not the one that runs.
    pub const SEED: u32 = 1;
}

/// What a client knows of a blueprint; its place in the list is [`crate::ActorState::blueprint`].
#[derive(Clone, Debug, PartialEq)]
pub struct BlueprintInfo {
    /// As `vehicle.tesla.model3`.
    pub id: String,
    /// The semantic tag's code (`mesh::Tag`).
    pub tag: u8,
    /// Half the size of its bounding box.
    pub half_extents_m: [f32; 3],
    /// The middle of its bounding box, in actor space.
    pub center_m: [f32; 3],
}
