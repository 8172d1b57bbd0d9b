//! One wall of a building as a drawing board: u from left to right and z upwards, both seen from
//! outside, and o out of the wall. Metres; u is 0 in the middle of the wall, o is 0 on it.

use glam::{Quat, Vec3, vec3};

use crate::{furnish::facade::book::Paint, mesh_builder::MeshBuilder};

/// A piece of flat wall that has not been added yet.
#[derive(Clone, Copy, Debug)]
struct Flat {
    u: [f32; 2],
    z: [f32; 2],
    out: f32,
    paint: Paint,
}

/// How many of the newest pieces of wall are compared with a new one.
const NEIGHBOURS: usize = 24;
/// The projection up to which a box has no visible sides, and so has none. Metres.
const THIN_M: f32 = 0.051;
/// The projection up to which the ends of a box are open: its inner sides have the same paint. Metres.
const OPEN_M: f32 = 0.25;
/// Edges that are this near coincide. Metres.
const NEAR_M: f32 = 1e-3;

/// Where a wall stands in the space of its building.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// The rotation about z; without one, o points along y.
    pub(crate) turn: Quat,
    /// The foot of the middle of the wall.
    pub(crate) foot: Vec3,
    /// Half the width of the wall.
    pub(crate) half: f32,
}

impl Frame {
    /// The wall number `side` of a box with these half sizes about the z axis: the first looks
    /// along y, the others follow counter-clockwise seen from above.
    pub(crate) fn of_box([x, y]: [f32; 2], side: usize) -> Frame {
        let (half, out) = if side.is_multiple_of(2) { (x, y) } else { (y, x) };
        let turn = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2 * side as f32);
        Frame { turn, foot: turn * vec3(0.0, out, 0.0), half }
    }

    /// The same wall, higher by `z`.
    pub(crate) fn raised(self, z: f32) -> Frame {
        Frame { foot: self.foot + Vec3::Z * z, ..self }
    }
}

/// A wall that is being drawn.
pub(super) struct Canvas<'a> {
    builder: &'a mut MeshBuilder,
    frame: Frame,
    flats: Vec<Flat>,
}

impl<'a> Canvas<'a> {
    pub(super) fn new(builder: &'a mut MeshBuilder, frame: Frame) -> Canvas<'a> {
        Canvas { builder, frame, flats: Vec::new() }
    }

    /// Half the width of the wall.
    pub(super) fn half(&self) -> f32 {
        self.frame.half
    }

    /// The point at (u, z, o) in the space of the building.
    pub(super) fn at(&self, [u, z, o]: [f32; 3]) -> Vec3 {
        self.frame.foot + self.frame.turn * vec3(-u, o, z)
    }

    /// The builder, for solids at points of [`Canvas::at`].
    pub(super) fn builder(&mut self) -> &mut MeshBuilder {
        self.builder
    }

    /// Sets the paint of further pieces.
    pub(super) fn paint(&mut self, paint: Paint) -> &mut Self {
        paint.apply(self.builder);
        self
    }

    /// Adds a quadrilateral at (u, z, o), counter-clockwise seen from its front.
    pub(super) fn quad(&mut self, corners: [[f32; 3]; 4]) {
        let corners = corners.map(|corner| self.at(corner));
        self.builder.quad(corners);
    }

    /// Adds a rectangle that faces outwards.
    pub(super) fn rect(&mut self, u: [f32; 2], z: [f32; 2], o: f32) {
        self.quad([[u[0], z[0], o], [u[1], z[0], o], [u[1], z[1], o], [u[0], z[1], o]]);
    }

    /// Adds flat wall; neighbouring pieces of one paint become one rectangle.
    pub(super) fn wall(&mut self, u: [f32; 2], z: [f32; 2], out: f32, paint: Paint) {
        if u[1] - u[0] < NEAR_M || z[1] - z[0] < NEAR_M {
            return;
        }
        let new = Flat { u, z, out, paint };
        let same = |one: [f32; 2], other: [f32; 2]| {
            (one[0] - other[0]).abs() < NEAR_M && (one[1] - other[1]).abs() < NEAR_M
        };
        for old in self.flats.iter_mut().rev().take(NEIGHBOURS) {
            if old.paint != paint || old.out != out {
                continue;
            }
            if same(old.z, z) && (old.u[1] - u[0]).abs() < NEAR_M {
                old.u[1] = u[1];
                return;
            }
            if same(old.u, u) && (old.z[1] - z[0]).abs() < NEAR_M {
                old.z[1] = z[1];
                return;
            }
        }
        self.flats.push(new);
    }

    /// Adds the four inner sides of an opening of this depth.
    pub(super) fn reveal(&mut self, [l, r]: [f32; 2], [b, t]: [f32; 2], out: f32, depth: f32) {
        let d = out - depth;
        self.quad([[l, b, d], [l, t, d], [l, t, out], [l, b, out]]);
        self.quad([[r, b, out], [r, t, out], [r, t, d], [r, b, d]]);
        self.quad([[l, b, d], [l, b, out], [r, b, out], [r, b, d]]);
        self.quad([[l, t, out], [l, t, d], [r, t, d], [r, t, out]]);
    }

    /// Adds a box on the wall without its back, from `o[0]` to `o[1]`. At the edges of the wall it
    /// is longer by what it projects, so that it meets that of the next wall. Thin boxes are their
    /// front only, and deep ones alone have ends.
    pub(super) fn ledge(&mut self, u: [f32; 2], z: [f32; 2], o: [f32; 2]) {
        let half = self.half();
        let ends = [u[0] > NEAR_M - half, u[1] < half - NEAR_M];
        let (l, r) = (
            if ends[0] { u[0] } else { u[0] - o[1].max(0.0) },
            if ends[1] { u[1] } else { u[1] + o[1].max(0.0) },
        );
        let ([b, t], [i, o]) = (z, o);
        self.rect([l, r], z, o);
        if o - i <= THIN_M {
            return;
        }
        self.quad([[l, t, i], [l, t, o], [r, t, o], [r, t, i]]);
        self.quad([[l, b, o], [l, b, i], [r, b, i], [r, b, o]]);
        if o - i > OPEN_M {
            self.quad([[l, b, o], [l, t, o], [l, t, i], [l, b, i]]);
            self.quad([[r, b, i], [r, t, i], [r, t, o], [r, b, o]]);
        }
    }

    /// Adds the pending flat wall.
    pub(super) fn finish(mut self) {
        // Rows of one width, one above the other, become one rectangle.
        let flats = std::mem::take(&mut self.flats);
        let mut merged: Vec<Flat> = Vec::with_capacity(flats.len());
        for flat in flats {
            let fits = |old: &&mut Flat| {
                old.paint == flat.paint
                    && old.out == flat.out
                    && (old.u[0] - flat.u[0]).abs() < NEAR_M
                    && (old.u[1] - flat.u[1]).abs() < NEAR_M
                    && (old.z[1] - flat.z[0]).abs() < NEAR_M
            };
            match merged.iter_mut().rev().take(NEIGHBOURS).find(fits) {
                Some(old) => old.z[1] = flat.z[1],
                None => merged.push(flat),
            }
        }
        for flat in merged {
            self.paint(flat.paint).rect(flat.u, flat.z, flat.out);
        }
    }
}
