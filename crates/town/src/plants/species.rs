//! The shapes of species.

use glam::{Vec3, vec3};
use mesh::RandomStream;

/// The species of a plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Species {
    /// A street tree, pruned so that the crown starts above trucks.
    Plane,
    /// A round crown on a short trunk.
    Lime,
    /// A slender, tall tree.
    Poplar,
    /// A conifer with needles down to the ground.
    Spruce,
    /// A broad tree with a spreading crown.
    Oak,
    /// A bush of waist height.
    Bush,
}

/// The shape of a species at its full size. Metres.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) species: Species,
    pub(crate) height_m: f32,
    pub(crate) crown_radius_m: f32,
    /// The radius of the trunk at breast height; 0 without a trunk.
    pub(crate) trunk_radius_m: f32,
    /// The height of the lowest foliage.
    pub(super) crown_from_m: f32,
    /// How much narrower the crown is at its top than at its middle, and how much wider at its foot.
    pub(super) taper: f32,
    /// The upward tendency of branches.
    pub(super) rise: f32,
    /// The number of limbs into which the trunk forks.
    pub(super) limbs: u32,
    /// The number of leaves of a broad-leaved plant.
    pub(super) leaves: u32,
    /// The length of a leaf, or of a spray of needles.
    pub(super) leaf_m: f32,
    /// The colour of leaves in the sun, sRGB.
    pub(super) green: [u8; 3],
    /// The colour of the bark, sRGB.
    pub(super) bark: [u8; 3],
}

impl Shape {
    /// A plant of the species that differs from others in its proportions.
    pub(super) fn varied(&self, random: &mut RandomStream) -> Shape {
        let mut by = |least: f32, most: f32| random.between(least, most);
        Shape {
            height_m: self.height_m * by(0.97, 1.03),
            crown_radius_m: self.crown_radius_m * by(0.92, 1.1),
            crown_from_m: self.crown_from_m * by(0.9, 1.1),
            taper: self.taper + by(-0.12, 0.12),
            rise: self.rise * by(0.8, 1.25),
            ..self.clone()
        }
    }

    /// The middle of the crown, and its radii.
    pub(super) fn crown(&self) -> (Vec3, Vec3) {
        let half = (self.height_m - self.crown_from_m) * 0.5;
        let wide = self.crown_radius_m;
        (Vec3::Z * (self.crown_from_m + half), vec3(wide, wide, half))
    }
}

/// By species.
#[rustfmt::skip]
pub(super) const SHAPES: [Shape; 6] = [
    Shape {
        species: Species::Plane, height_m: 9.9, crown_radius_m: 2.5, trunk_radius_m: 0.17,
        crown_from_m: 4.0, taper: 0.1, rise: 0.3, limbs: 5, leaves: 4500, leaf_m: 0.235,
        green: [112, 132, 72], bark: [118, 110, 94],
    },
    Shape {
        species: Species::Lime, height_m: 8.3, crown_radius_m: 2.7, trunk_radius_m: 0.18,
        crown_from_m: 2.0, taper: 0.3, rise: 0.3, limbs: 4, leaves: 4700, leaf_m: 0.235,
        green: [99, 125, 64], bark: [76, 67, 56],
    },
    Shape {
        species: Species::Poplar, height_m: 13.0, crown_radius_m: 1.7, trunk_radius_m: 0.17,
        crown_from_m: 0.9, taper: 0.25, rise: 1.0, limbs: 1, leaves: 4300, leaf_m: 0.21,
        green: [106, 127, 79], bark: [94, 89, 78],
    },
    Shape {
        species: Species::Spruce, height_m: 11.0, crown_radius_m: 2.7, trunk_radius_m: 0.19,
        crown_from_m: 0.7, taper: 1.0, rise: 0.0, limbs: 0, leaves: 0, leaf_m: 0.34,
        green: [60, 83, 60], bark: [76, 62, 50],
    },
    Shape {
        species: Species::Oak, height_m: 10.0, crown_radius_m: 4.1, trunk_radius_m: 0.31,
        crown_from_m: 2.5, taper: 0.1, rise: 0.15, limbs: 6, leaves: 5000, leaf_m: 0.31,
        green: [90, 111, 56], bark: [68, 60, 50],
    },
    Shape {
        species: Species::Bush, height_m: 1.3, crown_radius_m: 0.95, trunk_radius_m: 0.0,
        crown_from_m: 0.02, taper: 0.1, rise: 0.5, limbs: 0, leaves: 1400, leaf_m: 0.115,
        green: [86, 112, 60], bark: [84, 72, 56],
    },
];
