//! Strips of windows of buildings in low detail.

use std::f32::consts::FRAC_PI_2;

use crate::mesh_builder::MeshBuilder;
use glam::{Quat, vec3};

/// One wall of a building: the first faces the street, the others follow to the left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    turn: Quat,
    /// Half the width of the wall, and its distance from the middle of the building. Metres.
    half: f32,
    out: f32,
}

impl Wall {
    /// The wall number `side` of a building with these half sizes.
    pub(super) fn new([x, y]: [f32; 2], side: usize) -> Wall {
        let (half, out) = if side.is_multiple_of(2) { (x, y) } else { (y, x) };
        Wall { turn: Quat::from_rotation_z(FRAC_PI_2 * side as f32), half, out }
    }

    /// Adds a rectangle `before` the wall, over a range of x and a range of z.
    pub(super) fn patch(&self, builder: &mut MeshBuilder, x: [f32; 2], z: [f32; 2], before: f32) {
        let y = self.out + before;
        builder.quad(
            [(x[1], z[0]), (x[0], z[0]), (x[0], z[1]), (x[1], z[1])]
                .map(|(x, z)| self.turn * vec3(x, y, z)),
        );
    }

    /// Adds a strip along the whole wall: glass between slabs, or slabs between glass.
    pub(super) fn band(&self, builder: &mut MeshBuilder, z: [f32; 2], inset: f32) {
        let reach = self.half - inset;
        self.patch(builder, [-reach, reach], z, 0.02);
    }
}
