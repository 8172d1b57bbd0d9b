//! What the tables of props share: the type of a row, colours, and common shapes.

use glam::{Vec3, vec3};
use mesh::Tag;

use crate::{catalogue::mesh_source::Shape, mesh_builder::MeshBuilder};

/// Id, tag, length, width and height in metres, mass in kilograms, and the function that builds it.
pub(super) type Row = (&'static str, Tag, [f32; 3], f32, Shape);

/// Colours, sRGB.
pub(super) mod hue {
    pub(crate) const WHITE: [u8; 3] = [236, 236, 232];
    pub(crate) const BLACK: [u8; 3] = [26, 26, 28];
    pub(crate) const GREY: [u8; 3] = [128, 130, 134];
    pub(crate) const DARK: [u8; 3] = [60, 63, 68];
    pub(crate) const RED: [u8; 3] = [186, 32, 30];
    pub(crate) const ORANGE: [u8; 3] = [238, 92, 20];
    pub(crate) const YELLOW: [u8; 3] = [240, 190, 30];
    pub(crate) const GREEN: [u8; 3] = [44, 110, 60];
    pub(crate) const LIME: [u8; 3] = [112, 160, 62];
    pub(crate) const BLUE: [u8; 3] = [32, 84, 160];
    pub(crate) const SKY: [u8; 3] = [120, 170, 206];
    pub(crate) const BROWN: [u8; 3] = [110, 74, 46];
    pub(crate) const TAN: [u8; 3] = [190, 152, 106];
    pub(crate) const CARTON: [u8; 3] = [184, 140, 92];
    pub(crate) const TERRACOTTA: [u8; 3] = [176, 92, 60];
    pub(crate) const STRAW: [u8; 3] = [206, 176, 92];
    pub(crate) const PINK: [u8; 3] = [214, 110, 130];
    pub(crate) const STONE: [u8; 3] = [150, 146, 138];
}

/// A box of this size about a centre.
pub(super) fn slab(builder: &mut MeshBuilder, center: [f32; 3], size: [f32; 3]) {
    let (center, half) = (Vec3::from_array(center), Vec3::from_array(size) * 0.5);
    builder.block(center - half, center + half);
}

/// Four upright legs, one in each quadrant.
pub(super) fn legs(builder: &mut MeshBuilder, x: f32, y: f32, top: f32, radius: f32) {
    for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        builder.rod(vec3(sx * x, sy * y, 0.0), vec3(sx * x, sy * y, top), radius, 6);
    }
}

/// A heap: the upper half of an ellipsoid, with fixed irregularities.
pub(super) fn heap(builder: &mut MeshBuilder, center: [f32; 2], radii: [f32; 3], seed: u32) {
    let bump = |ring: u32, side: u32| {
        let mut x = seed.wrapping_mul(747_796_405) ^ ring.wrapping_mul(2_891_336_453) ^ (side * 97);
        x = (x ^ x >> 15).wrapping_mul(2_246_822_519);
        0.86 + 0.28 * ((x >> 8 & 0xff) as f32 / 255.0)
    };
    let (rings, sides) = (5u32, 11u32);
    let stack: Vec<Vec<Vec3>> = (0..=rings)
        .map(|ring| {
            let polar = std::f32::consts::FRAC_PI_2 * ring as f32 / rings as f32;
            (0..sides)
                .map(|side| {
                    let angle = std::f32::consts::TAU * side as f32 / sides as f32;
                    let reach = if ring == rings { 0.0 } else { polar.cos() * bump(ring, side) };
                    vec3(
                        center[0] + radii[0] * reach * angle.cos(),
                        center[1] + radii[1] * reach * angle.sin(),
                        radii[2] * polar.sin(),
                    )
                })
                .collect()
        })
        .collect();
    builder.loft(&stack, |_, _| None);
}
