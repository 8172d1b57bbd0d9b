//! Trees and bushes: a few models per town, planted with different rotations and scales.

use glam::{Vec3, vec3};
use mesh::{Material, Mesh, RandomStream, Tag};

use crate::{mesh_builder::MeshBuilder, static_world::Detail};

/// The species of a plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Species {
    /// A street tree, pruned so that the crown starts above trucks.
    Plane,
    /// A round crown on a short trunk.
    Lime,
    /// A slender, tall tree.
    Poplar,
    /// A conifer with needles down to the ground.
    Spruce,
    /// A broad tree with several crowns.
    Oak,
    /// A bush of waist height.
    Bush,
}

/// A model of a tree with its foot at the origin.
#[derive(Debug)]
pub(super) struct TreeModel {
    pub(super) species: Species,
    pub(super) mesh: Mesh,
    /// The radius of the crown. Metres.
    pub(super) height: f32,
    pub(super) crown_radius: f32,
    pub(super) trunk_radius: f32,
}

/// The level of detail of trees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finish {
    /// The factor for the number of balls in a crown; the result is limited to `balls_max`.
    balls: u32,
    balls_max: u32,
    rings: u32,
    sides: u32,
    /// The number of whorls of a conifer, and of their sides.
    tiers: [u32; 2],
    trunk_sides: u32,
}

impl Finish {
    /// For trees along streets.
    pub(super) fn near(detail: Detail) -> Finish {
        match detail {
            Detail::Low => Finish::far(detail),
            Detail::Standard => {
                Finish { balls: 1, balls_max: 5, rings: 5, sides: 8, tiers: [6, 9], trunk_sides: 6 }
            }
            Detail::High => {
                let (balls_max, tiers) = (20, [16, 20]);
                Finish { balls: 4, balls_max, rings: 9, sides: 13, tiers, trunk_sides: 12 }
            }
        }
    }

    /// For trees far from roads.
    pub(super) fn far(detail: Detail) -> Finish {
        match detail {
            Detail::Low => {
                Finish { balls: 1, balls_max: 1, rings: 3, sides: 5, tiers: [3, 5], trunk_sides: 3 }
            }
            Detail::Standard => {
                Finish { balls: 1, balls_max: 2, rings: 4, sides: 6, tiers: [4, 7], trunk_sides: 4 }
            }
            Detail::High => Finish::near(detail),
        }
    }
}

/// Returns a few models of each species.
pub(super) fn tree_models(seed: u64, finish: Finish) -> Vec<TreeModel> {
    use Species::{Bush, Lime, Oak, Plane, Poplar, Spruce};
    let mut random = RandomStream::named(seed, 0x72ee);
    let mut all = Vec::new();
    for species in [Plane, Lime, Poplar, Spruce, Oak, Bush] {
        for _ in 0..4 {
            all.push(tree_model(species, finish, &mut random));
        }
    }
    all
}

fn tree_model(species: Species, finish: Finish, random: &mut RandomStream) -> TreeModel {
    let mut builder = MeshBuilder::new(Tag::Vegetation, Material::Bark, 0);
    let grow = random.between(0.85, 1.2);
    let mut crown = Crown { finish, random };
    let (height, crown_radius, trunk_radius) = match species {
        Species::Plane => {
            let height = 9.5 * grow.max(0.95);
            trunk(&mut builder, height * 0.62, 0.16, finish);
            builder.material(Material::Leaves);
            crown.cloud(&mut builder, Vec3::Z * height * 0.75, vec3(2.1, 2.1, height * 0.23), 3);
            (height, 2.4, 0.16)
        }
        Species::Lime => {
            let height = 8.0 * grow;
            trunk(&mut builder, height * 0.6, 0.17, finish);
            builder.material(Material::Leaves);
            crown.cloud(&mut builder, Vec3::Z * height * 0.63, vec3(2.3, 2.3, height * 0.36), 3);
            (height, 2.7, 0.17)
        }
        Species::Poplar => {
            let height = 13.0 * grow;
            trunk(&mut builder, height * 0.5, 0.20, finish);
            builder.material(Material::Leaves);
            crown.cloud(&mut builder, Vec3::Z * height * 0.56, vec3(1.3, 1.3, height * 0.43), 2);
            (height, 1.7, 0.20)
        }
        Species::Spruce => {
            let height = 11.0 * grow;
            trunk(&mut builder, height * 0.8, 0.19, finish);
            builder.material(Material::Needles);
            crown.tiers(&mut builder, height, 2.4);
            (height, 2.5, 0.19)
        }
        Species::Oak => {
            let height = 10.0 * grow;
            trunk(&mut builder, height * 0.55, 0.32, finish);
            branches(&mut builder, height, crown.random);
            builder.material(Material::Leaves);
            crown.cloud(&mut builder, Vec3::Z * height * 0.66, vec3(3.6, 3.6, height * 0.32), 5);
            (height, 4.2, 0.32)
        }
        Species::Bush => {
            let height = 1.3 * grow;
            builder.material(Material::Leaves);
            crown.cloud(&mut builder, Vec3::Z * height * 0.42, vec3(0.8, 0.8, height * 0.5), 1);
            (height, 1.0, 0.0)
        }
    };
    TreeModel { species, mesh: builder.mesh, height, crown_radius, trunk_radius }
}

fn trunk(builder: &mut MeshBuilder, height: f32, radius: f32, finish: Finish) {
    let sides = finish.trunk_sides;
    builder.material(Material::Bark);
    builder.cone(Vec3::Z * -0.4, Vec3::Z * 0.5, [radius * 1.5, radius], sides);
    builder.cone(Vec3::Z * 0.5, Vec3::Z * height, [radius, radius * 0.45], sides);
}

fn branches(builder: &mut MeshBuilder, height: f32, random: &mut RandomStream) {
    for branch in 0..4 {
        let around = glam::Vec2::from_angle(1.6 * branch as f32 + random.unit());
        let from = Vec3::Z * height * random.between(0.28, 0.42);
        let to = from + around.extend(0.9) * height * 0.2;
        builder.cone(from, to, [0.13, 0.06], 5);
    }
}

struct Crown<'a> {
    finish: Finish,
    random: &'a mut RandomStream,
}

impl Crown<'_> {
    /// Adds foliage as irregular balls that fill an ellipsoid.
    fn cloud(&mut self, builder: &mut MeshBuilder, center: Vec3, radii: Vec3, balls: u32) {
        let Finish { rings, sides, .. } = self.finish;
        let balls = (balls * self.finish.balls).min(self.finish.balls_max);
        for ball in 0..balls {
            let (offset, size) = if balls == 1 {
                (Vec3::ZERO, 1.0)
            } else {
                let turn = ball as f32 * 2.4 + self.random.between(0.0, 0.8);
                let level = (ball as f32 + 0.5) / balls as f32 * 2.0 - 1.0;
                let out = (1.0 - level * level).max(0.0).sqrt() * 0.45;
                (
                    vec3(turn.cos() * out, turn.sin() * out, level * 0.45),
                    self.random.between(0.52, 0.66),
                )
            };
            let first = builder.mesh.positions.len();
            builder.ball(center + offset * radii, radii * size, rings, sides);
            self.dent(&mut builder.mesh.positions[first..], center + offset * radii, 0.16);
        }
    }

    /// Adds whorls of branches, one above the other.
    fn tiers(&mut self, builder: &mut MeshBuilder, height: f32, radius: f32) {
        let [tiers, sides] = self.finish.tiers;
        for tier in 0..tiers {
            let fraction = tier as f32 / tiers as f32;
            let low = 0.9 + (height - 1.2) * fraction;
            let high = (low + (height - 1.2) / tiers as f32 * 1.9).min(height);
            let first = builder.mesh.positions.len();
            builder.cone(
                Vec3::Z * low,
                Vec3::Z * high,
                [radius * (1.0 - fraction * 0.86), 0.0],
                sides,
            );
            self.dent(&mut builder.mesh.positions[first..], Vec3::Z * high, 0.10);
        }
    }

    /// Moves points towards and away from `center`, so that all crowns differ.
    fn dent(&mut self, points: &mut [[f32; 3]], center: Vec3, by: f32) {
        for point in points {
            let p = Vec3::from_array(*point);
            *point = (center + (p - center) * self.random.between(1.0 - by, 1.0 + by)).to_array();
        }
    }
}
