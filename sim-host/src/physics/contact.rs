//! Contact of a box with the ground: an overturned car or a crate.
//!
//! A spring pushes out each corner below the surface, and Coulomb friction acts on it. The ground
//! is no collider of the rigid-body world, so this is the only contact of these bodies with it.

use glam::Vec3;

use super::{
    ground::Ground,
    motion::{Motion, Wrench},
};

/// Natural frequency of a body on its corners, with its whole mass. Radians per second.
const STIFFNESS_RADPS: f32 = 60.0;
const DAMPING_RATIO: f32 = 0.5;
const FRICTION: f32 = 0.6;

/// A corner, and the ground plane below it.
#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    in_body_m: Vec3,
    on_ground_m: Vec3,
    normal: Vec3,
    friction: f32,
}

/// The corners that may touch the ground during one substep.
#[derive(Debug, Default)]
pub(super) struct CornerContacts {
    corners: [Corner; 8],
    count: usize,
}

impl CornerContacts {
    /// Finds the corners of a box that are or may come below ground. `center_m` is the box's centre
    /// relative to the centre of mass, in body axes.
    pub(super) fn find(
        ground: &Ground,
        motion: &Motion,
        center_m: Vec3,
        half_m: Vec3,
        dt: f32,
    ) -> CornerContacts {
        let mut found = CornerContacts::default();
        let middle = motion.com_m + motion.axes * center_m;
        for index in 0..8 {
            let sign = |bit: usize| if index & bit == 0 { -1.0 } else { 1.0 };
            let in_body_m = center_m + half_m * Vec3::new(sign(1), sign(2), sign(4));
            let arm = motion.axes * in_body_m;
            let corner = motion.com_m + arm;
            // The query starts at the height of the centre, so that it finds the surface even if a
            // fall has pressed the corner below it.
            let hit = ground.below(corner.x, corner.y, corner.z.max(middle.z) + 0.3);
            let height = (corner.z - hit.height_m) * hit.normal.z;
            let approach = -motion.velocity_at(arm).dot(hit.normal) * dt;
            if height < approach.max(0.0) + 0.05 {
                found.corners[found.count] = Corner {
                    in_body_m,
                    on_ground_m: Vec3::new(corner.x, corner.y, hit.height_m),
                    normal: hit.normal,
                    friction: FRICTION * hit.friction,
                };
                found.count += 1;
            }
        }
        found
    }

    /// Adds the contact forces at this moment. Returns the sum of the normal forces.
    pub(super) fn add_forces(
        &self,
        motion: &Motion,
        mass_kg: f32,
        dt: f32,
        wrench: &mut Wrench,
    ) -> f32 {
        let share_kg = mass_kg / 4.0;
        let mut pressed_n = 0.0;
        for corner in &self.corners[..self.count] {
            let arm = motion.axes * corner.in_body_m;
            let depth = (corner.on_ground_m - motion.com_m - arm).dot(corner.normal);
            if depth <= 0.0 {
                continue;
            }
            let velocity = motion.velocity_at(arm);
            let leaving = velocity.dot(corner.normal);
            let spring = STIFFNESS_RADPS * STIFFNESS_RADPS * depth;
            let damper = 2.0 * DAMPING_RATIO * STIFFNESS_RADPS * -leaving;
            let normal_n = share_kg * (spring + damper).max(0.0);
            let along = velocity - corner.normal * leaving;
            let speed = along.length();
            // Coulomb friction, limited to the force that stops the corner's share of the mass.
            let drag = (corner.friction * normal_n).min(0.3 * share_kg * speed / dt);
            let friction = if speed > 1e-6 { along * (-drag / speed) } else { Vec3::ZERO };
            wrench.add(corner.normal * normal_n + friction, arm);
            pressed_n += normal_n;
        }
        pressed_n
    }
}
