use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// One triangle, with everything that shading a hit needs. The shaders read the same 48 bytes.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Triangle {
    pub(crate) corner: [f32; 3],
    /// Tag in bits 0 to 7, material in bits 8 to 15, tint in bits 16 to 31 ([`mesh::Face::tint`]).
    pub(crate) face: u32,
    pub(crate) edge1: [f32; 3],
    pub(crate) object: u32,
    pub(crate) edge2: [f32; 3],
    /// Index into the walls of the scene; 0 means none.
    pub(crate) wall: u32,
}

const _: () = assert!(size_of::<Triangle>() == 48);

impl Triangle {
    #[inline(always)]
    pub(crate) fn tag(&self) -> u8 {
        self.face as u8
    }

    /// Returns the three corners.
    pub(crate) fn corners(&self) -> [Vec3; 3] {
        let [corner, edge1, edge2] = [self.corner, self.edge1, self.edge2].map(Vec3::from);
        [corner, corner + edge1, corner + edge2]
    }

    #[inline(always)]
    pub(crate) fn material(&self) -> u8 {
        (self.face >> 8) as u8
    }

    /// Returns the colour that replaces the one of the material; 0 means none.
    #[inline(always)]
    pub(crate) fn tint(&self) -> u16 {
        (self.face >> 16) as u16
    }
}
