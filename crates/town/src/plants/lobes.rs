//! The lobes of a crown, each the leaves of one large branch.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use mesh::RandomStream;

/// The number of lobes of a crown.
const LOBES: usize = 13;
/// How far the surface of a crown lies between its lobes, as a fraction of its radii.
const VALLEY: f32 = 0.70;
/// The cosine of the angle from the middle of a lobe to its edge.
const LOBE_EDGE: f32 = 0.86;

/// The directions of the middles of lobes.
pub(super) struct Lobes([Vec3; LOBES]);

impl Lobes {
    /// Draws directions that are spread over the sphere and differ between plants: a Fibonacci lattice, each point
    /// displaced.
    pub(super) fn new(random: &mut RandomStream) -> Lobes {
        let turn = random.between(0.0, TAU);
        Lobes(std::array::from_fn(|lobe| {
            let z = 1.0 - 2.0 * (lobe as f32 + 0.5) / LOBES as f32;
            // The golden angle.
            let around = Vec2::from_angle(turn + lobe as f32 * 2.399_963_2);
            let even = (around * (1.0 - z * z).sqrt()).extend(z);
            (even + unit(random) * 0.25).normalize_or(even)
        }))
    }

    /// The distance of the surface from the middle in a direction, as a fraction of the radii.
    pub(super) fn surface(&self, direction: Vec3) -> f32 {
        let near = self.0.iter().map(|lobe| lobe.dot(direction)).fold(-1.0, f32::max);
        let inside = ((near - LOBE_EDGE) / (1.0 - LOBE_EDGE)).clamp(0.0, 1.0);
        // A lobe is round: steep at its edge, flat in its middle.
        VALLEY + (1.0 - VALLEY) * (inside * (2.0 - inside)).sqrt()
    }
}

/// A random direction.
pub(super) fn unit(random: &mut RandomStream) -> Vec3 {
    let z = random.between(-1.0, 1.0);
    let around = Vec2::from_angle(random.between(0.0, std::f32::consts::TAU));
    (around * (1.0 - z * z).max(0.0).sqrt()).extend(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crowns_have_lobes_and_valleys_that_differ_between_plants() {
        let of = |seed: u64| {
            let lobes = Lobes::new(&mut RandomStream::from_state(seed));
            let mut random = RandomStream::from_state(9);
            (0..2000).map(|_| lobes.surface(unit(&mut random))).collect::<Vec<f32>>()
        };
        let one = of(1);
        assert!(one.iter().all(|far| (VALLEY..=1.0).contains(far)));
        let share = |deep: f32| one.iter().filter(|far| **far < deep).count() as f32 / 2000.0;
        // Lobes cover most of a crown, and valleys are lines between them.
        assert!((0.03..0.4).contains(&share(0.8)), "{}", share(0.8));
        assert!(share(0.95) < 0.7, "{}", share(0.95));
        assert!(one != of(2));
    }
}
