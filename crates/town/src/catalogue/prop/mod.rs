//! Things that just stand there: CARLA's 95 ids, each of a size that such a thing has.

mod garden;
mod litter;
mod street;

use glam::{Vec3, vec3};
use mesh::{Material, Mesh, Tag};

use super::{Blueprint, Kind, Recipe};
use crate::clay::{self, Clay};

/// Shapes a prop in units of its own: it is brought to its size afterwards.
pub(super) type Shape = fn(&mut Clay);

/// Id, tag, length, width and height in metres, mass in kilograms, and what shapes it.
pub(super) type Row = (&'static str, Tag, [f32; 3], f32, Shape);

fn rows() -> impl Iterator<Item = &'static Row> {
    litter::ROWS.iter().chain(garden::ROWS).chain(street::ROWS)
}

/// All props, by id.
pub(super) fn props() -> Vec<Blueprint> {
    let mut all: Vec<Blueprint> = rows().map(prop).collect();
    all.sort_by_key(|blueprint| blueprint.id);
    all
}

fn prop(&(id, tag, size_m, mass_kg, shape): &Row) -> Blueprint {
    let size = Vec3::from_array(size_m);
    Blueprint {
        half_extents_m: size * 0.5,
        center_m: Vec3::Z * size.z * 0.5,
        mass_kg,
        default_color: [200, 90, 30],
        ..Blueprint::new(id, Kind::Prop, tag, Recipe::Prop(tag, size_m, shape))
    }
}

/// The mesh of a prop: centred over the origin, standing on the ground, of exactly that size.
pub(super) fn sculpt(tag: Tag, size_m: [f32; 3], shape: Shape) -> Mesh {
    let mut clay = Clay::new(tag, Material::Plastic, 0);
    shape(&mut clay);
    let (low, high) = clay::bounds(&clay.mesh);
    let scale = Vec3::from_array(size_m) / (high - low);
    let foot = vec3((low.x + high.x) * 0.5, (low.y + high.y) * 0.5, low.z);
    for position in &mut clay.mesh.positions {
        *position = ((Vec3::from_array(*position) - foot) * scale).to_array();
    }
    clay.mesh
}

/// sRGB.
mod hue {
    pub(super) const WHITE: [u8; 3] = [236, 236, 232];
    pub(super) const BLACK: [u8; 3] = [26, 26, 28];
    pub(super) const GREY: [u8; 3] = [128, 130, 134];
    pub(super) const DARK: [u8; 3] = [60, 63, 68];
    pub(super) const RED: [u8; 3] = [186, 32, 30];
    pub(super) const ORANGE: [u8; 3] = [238, 92, 20];
    pub(super) const YELLOW: [u8; 3] = [240, 190, 30];
    pub(super) const GREEN: [u8; 3] = [44, 110, 60];
    pub(super) const LIME: [u8; 3] = [112, 160, 62];
    pub(super) const BLUE: [u8; 3] = [32, 84, 160];
    pub(super) const SKY: [u8; 3] = [120, 170, 206];
    pub(super) const BROWN: [u8; 3] = [110, 74, 46];
    pub(super) const TAN: [u8; 3] = [190, 152, 106];
    pub(super) const CARTON: [u8; 3] = [184, 140, 92];
    pub(super) const TERRACOTTA: [u8; 3] = [176, 92, 60];
    pub(super) const STRAW: [u8; 3] = [206, 176, 92];
    pub(super) const PINK: [u8; 3] = [214, 110, 130];
    pub(super) const STONE: [u8; 3] = [150, 146, 138];
}

/// A box about a middle, by its whole size.
fn slab(clay: &mut Clay, center: [f32; 3], size: [f32; 3]) {
    let (center, half) = (Vec3::from_array(center), Vec3::from_array(size) * 0.5);
    clay.block(center - half, center + half);
}

/// Four upright legs, or as many as there are signs.
fn legs(clay: &mut Clay, x: f32, y: f32, top: f32, radius: f32) {
    for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        clay.rod(vec3(sx * x, sy * y, 0.0), vec3(sx * x, sy * y, top), radius, 6);
    }
}

/// A heap: a ball cut off at the ground, bent out of shape by fixed numbers.
fn heap(clay: &mut Clay, center: [f32; 2], radii: [f32; 3], seed: u32) {
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
    clay.loft(&stack, |_, _| None);
}
