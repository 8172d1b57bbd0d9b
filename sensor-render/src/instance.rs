use bytemuck::{Pod, Zeroable};
use glam::Affine3A;
use protocol::StreetLightState;

use crate::bvh::{Box3, Link, transformed_box};
use crate::scene::Scene;

/// Bits of [`Instance::lights`]. Vehicles have those of [`protocol::lamp`] that shine at this
/// moment; traffic lights have the bits below.
pub(crate) mod lights {
    /// The instance is a traffic light; its phase begins at bit [`PHASE_SHIFT`].
    pub(crate) const SIGNAL: u32 = 1 << 31;
    /// The instance is a parked vehicle, whose lamps are off at night too.
    pub(crate) const PARKED: u32 = 1 << 30;
    /// Lowest bit of the phase.
    pub(crate) const PHASE_SHIFT: u32 = 16;
    /// Bits of the phase, after the shift.
    pub(crate) const PHASE_MASK: u32 = 3;
}

/// One piece of an actor in the top-level hierarchy. The shaders read the same 80 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Instance {
    /// Rows of `piece_from_world`; the space of a piece is that of its actor at rest.
    pub(crate) actor_from_world: [[f32; 4]; 3],
    /// Root of the piece's bottom-level hierarchy.
    pub(crate) root: Link,
    /// Id of the actor.
    pub(crate) id: u32,
    /// Colour in sRGB: red in bits 0 to 7, green in bits 8 to 15, blue in bits 16 to 23.
    pub(crate) color: u32,
    /// Bits of [`lights`] and of [`protocol::lamp`].
    pub(crate) lights: u32,
    /// Index into the bottom-level hierarchies of the scene.
    pub(crate) blas: u32,
    /// Square of the size relative to the piece: 1 for actors, another number for plants.
    pub(crate) size_squared: f32,
    pub(crate) reserved: [u32; 2],
}

const _: () = assert!(size_of::<Instance>() == 80);

impl Instance {
    /// Returns the box of a piece in world space, and the piece at its place.
    pub(crate) fn placed(
        self,
        scene: &Scene,
        blas: u32,
        world_from_piece: &Affine3A,
    ) -> (Box3, Instance) {
        let bottom = &scene.blases[blas as usize];
        let bounds = transformed_box(world_from_piece, bottom.low, bottom.high);
        let actor_from_world = rows(&world_from_piece.inverse());
        (bounds, Instance { actor_from_world, root: bottom.root, blas, size_squared: 1.0, ..self })
    }
}

/// Returns the three rows of an affine transform.
pub(crate) fn rows(affine: &Affine3A) -> [[f32; 4]; 3] {
    let (m, t) = (&affine.matrix3, affine.translation);
    [0, 1, 2].map(|row| [m.x_axis[row], m.y_axis[row], m.z_axis[row], t[row]])
}

/// State of a street light that a command has set. The shaders read the same 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct StreetLight {
    pub(crate) number: u32,
    pub(crate) mode: u32,
    /// Colour in sRGB, as [`Instance::color`]; 0 means the colour of the lamp.
    pub(crate) color: u32,
    pub(crate) share: f32,
}

impl StreetLight {
    pub(crate) fn of((number, shine): (u32, &StreetLightState)) -> StreetLight {
        let StreetLightState { mode, color, intensity: share } = *shine;
        StreetLight { number, mode, color, share }
    }
}
