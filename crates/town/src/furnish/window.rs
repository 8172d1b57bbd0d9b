//! Windows: panes slightly in front of the wall, with a frame behind them and a sill below.

use std::f32::consts::FRAC_PI_2;

use glam::{Quat, vec3};
use mesh::Material;

use crate::{mesh_builder::MeshBuilder, static_world::Detail};

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

    /// Adds a row of windows with their sills at `sill`, with a gap round `door`.
    pub(super) fn row(
        &self,
        builder: &mut MeshBuilder,
        sill: f32,
        spec: &Windows,
        door: Option<f32>,
    ) {
        let count = ((self.half * 2.0 - 0.6) / spec.pitch_m) as u32;
        let [half, top] = [spec.size_m[0] * 0.5, sill + spec.size_m[1]];
        for window in 0..count {
            let x = -self.half + self.half * 2.0 * (window as f32 + 0.5) / count as f32;
            if door.is_some_and(|door| (door - x).abs() < half + 1.3) {
                continue;
            }
            builder.material(spec.frame);
            let rim = 0.09;
            self.patch(builder, [x - half - rim, x + half + rim], [sill - rim, top + rim], 0.015);
            builder.material(Material::Glass);
            if spec.detail == Detail::High {
                // Two casements of two panes each.
                for (from, to) in [(x - half, x - 0.03), (x + 0.03, x + half)] {
                    let middle = sill + spec.size_m[1] * 0.68;
                    self.patch(builder, [from, to], [sill, middle - 0.03], 0.03);
                    self.patch(builder, [from, to], [middle + 0.03, top], 0.03);
                }
                builder.material(Material::Concrete);
                let at = |z: f32, out: f32| self.turn * vec3(x, self.out + out, z);
                builder.block_at(at(sill - 0.12, 0.07), vec3(half + 0.14, 0.10, 0.04), self.turn);
                builder.block_at(at(top + 0.16, 0.03), vec3(half + 0.18, 0.05, 0.07), self.turn);
            } else {
                self.patch(builder, [x - half, x + half], [sill, top], 0.03);
            }
        }
    }
}

/// The windows of a building.
#[derive(Clone, Copy, Debug)]
pub(super) struct Windows {
    /// The distance from one window to the next. Metres.
    pub(super) pitch_m: f32,
    /// The width and height of the pane. Metres.
    pub(super) size_m: [f32; 2],
    pub(super) frame: Material,
    pub(super) detail: Detail,
}
