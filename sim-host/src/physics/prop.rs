//! Props: boxes that lie or stand on the ground.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{
    contact::CornerContacts,
    ground::Ground,
    motion::{Motion, Wrench},
};

/// The size and mass of a prop: a box with its origin in the middle of its base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PropModel {
    /// Half the edges.
    pub half_extents_m: Vec3,
    /// Mass, evenly distributed.
    pub mass_kg: f32,
    /// Whether vehicles drive over the prop and walkers step over it
    /// ([`town::Blueprint::is_passable`]): only the ground and static boxes hold it.
    pub is_passable: bool,
    /// Whether a moving actor that touches the prop makes it dynamic.
    pub is_released_on_hit: bool,
}

impl PropModel {
    pub(super) fn inertia_kgm2(&self) -> Vec3 {
        let square = self.half_extents_m * self.half_extents_m;
        Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y)
            * (self.mass_kg / 3.0)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Prop {
    pub model: PropModel,
}

/// Corner contacts for a box without wheels.
impl Prop {
    pub(super) fn substep(
        &self,
        ground: &Ground,
        start: &Motion,
        external: &Wrench,
        dt: f32,
    ) -> Wrench {
        const ITERATIONS: usize = 4;
        let corners =
            CornerContacts::find(ground, start, Vec3::ZERO, self.model.half_extents_m, dt);
        let mut motion = *start;
        let mut sum = Wrench::default();
        let step = dt / ITERATIONS as f32;
        for _ in 0..ITERATIONS {
            let mut wrench = *external;
            corners.add_forces(&motion, self.model.mass_kg, step, &mut wrench);
            motion.advance(&wrench, self.model.mass_kg, self.model.inertia_kgm2(), step);
            sum.force_n += wrench.force_n;
            sum.torque_nm += wrench.torque_nm;
        }
        let count = ITERATIONS as f32;
        Wrench { force_n: sum.force_n / count, torque_nm: sum.torque_nm / count }
    }
}
