//! The tyre: from slip to force.
//!
//! The shape is Pacejka's magic formula (Pacejka, Tire and Vehicle Dynamics, 3rd ed., section
//! 4.3.1), once along and once across. Both slips, each scaled so that its curve begins with
//! slope 1, form one vector; its length reads the curves, its direction shares the force out, so
//! that the limit is an ellipse. Slip itself is the deflection of a contact patch that is dragged
//! over the ground (ibid., section 7.2.3): at speed that is the textbook's slip after a short
//! relaxation length, at rest it is a spring, and a parked car stays where it is.

use glam::Vec2;
use serde::{Deserialize, Serialize};

const STEPS: usize = 80;
const STEPS_PER_UNIT: f32 = 4.0;

/// What one tyre can do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TyreModel {
    /// Peak force along, as a share of the load, at the nominal load on dry asphalt.
    pub grip_x: f32,
    /// Peak force across, as a share of the load.
    pub grip_y: f32,
    /// Force along for small slip: per unit of slip and newton of load.
    pub stiffness_x: f32,
    /// Force across for small slip: per radian of slip angle and newton of load.
    pub stiffness_y: f32,
    /// Magic formula's C along.
    pub shape_x: f32,
    /// Magic formula's C across.
    pub shape_y: f32,
    /// Magic formula's E along.
    pub curvature_x: f32,
    /// Magic formula's E across.
    pub curvature_y: f32,
    /// Share of grip and stiffness lost per multiple of the nominal load.
    pub load_sensitivity: f32,
    /// Load at which grip and stiffness hold.
    pub nominal_load_n: f32,
    /// Distance rolled until the force along has followed the slip to 63 %.
    pub relaxation_x_m: f32,
    /// The same across.
    pub relaxation_y_m: f32,
    /// Drag of rolling, as a share of the load.
    pub rolling_resistance: f32,
}

/// Force over scaled slip, divided by scaled slip, in a table: 1 at 0 and falling.
#[derive(Clone, Debug, PartialEq)]
struct Curve([f32; STEPS + 1]);

impl Curve {
    fn new(shape: f32, curvature: f32) -> Curve {
        let force = |slip: f32| {
            let b = slip / shape;
            (shape * (b - curvature * (b - b.atan())).atan()).sin()
        };
        Curve(std::array::from_fn(|i| match i {
            0 => 1.0,
            _ => force(i as f32 / STEPS_PER_UNIT) * STEPS_PER_UNIT / i as f32,
        }))
    }

    #[inline]
    fn at(&self, slip: f32) -> f32 {
        let place = (slip * STEPS_PER_UNIT).min(STEPS as f32 - 1e-3);
        let index = place as usize;
        let low = self.0[index];
        low + (self.0[index + 1] - low) * (place - index as f32)
    }
}

/// A [`TyreModel`] with what can be computed beforehand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tyre {
    pub model: TyreModel,
    along: Curve,
    across: Curve,
}

/// The contact patch's deflection: what a tyre remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Patch {
    pub along_m: f32,
    pub across_m: f32,
}

/// What a tyre answers to one sub-iteration's motion.
///
/// Along, the force is `held_n + slope_nspm * (rim speed − ground speed)`, so that the wheel's spin
/// can be found together with it.
pub(super) struct Answer {
    pub held_n: f32,
    pub slope_nspm: f32,
    pub across_n: f32,
    pub limit_n: f32,
    fade: f32,
}

/// Below this speed the patch's spring is damped as rubber is.
const DAMPED_BELOW_MPS: f32 = 3.0;
/// How much, per newton of load: about a third of critical for the vehicle on its patches.
const DAMPING_SPM: f32 = 2.0;

impl Tyre {
    pub(super) fn new(model: TyreModel) -> Tyre {
        let along = Curve::new(model.shape_x, model.curvature_x);
        let across = Curve::new(model.shape_y, model.curvature_y);
        Tyre { model, along, across }
    }

    /// One sub-iteration of `dt` seconds. `ground_mps` is the contact point's velocity over ground,
    /// along and across; `rim_mps` is spin times radius. Moves the patch across; [`Tyre::spun`]
    /// moves it along when the new spin is known.
    #[inline]
    pub(super) fn answer(
        &self,
        patch: &mut Patch,
        load_n: f32,
        friction: f32,
        ground_mps: Vec2,
        rim_mps: f32,
        dt: f32,
    ) -> Answer {
        let m = &self.model;
        let sensitivity =
            (1.0 - m.load_sensitivity * (load_n / m.nominal_load_n - 1.0)).clamp(0.5, 1.3);
        let transport = ground_mps.abs().max_element().max(rim_mps.abs());
        let (relax_x, relax_y) = (1.0 / m.relaxation_x_m, 1.0 / m.relaxation_y_m);
        let fade_x = 1.0 / (1.0 + dt * transport * relax_x);
        let fade_y = 1.0 / (1.0 + dt * transport * relax_y);

        let along_m = (patch.along_m + dt * (rim_mps - ground_mps.x)) * fade_x;
        patch.across_m = (patch.across_m - dt * ground_mps.y) * fade_y;

        // Slips scaled to slope 1. Grip and stiffness fall alike with load, so their ratio stays.
        let scale_x = m.stiffness_x / (m.grip_x * friction) * relax_x;
        let scale_y = m.stiffness_y / (m.grip_y * friction) * relax_y;
        let slip = Vec2::new(along_m * scale_x, patch.across_m * scale_y).length();
        let load_n = load_n * sensitivity;
        let spring_x = m.stiffness_x * relax_x * load_n * self.along.at(slip);
        let spring_y = m.stiffness_y * relax_y * load_n * self.across.at(slip);

        let slowness = (1.0 - transport * (1.0 / DAMPED_BELOW_MPS)).max(0.0);
        let damper = slowness * load_n * DAMPING_SPM;
        // Along, the patch will be (old + dt · slide) · fade, with the slide yet to be found.
        Answer {
            held_n: spring_x * patch.along_m * fade_x,
            slope_nspm: spring_x * dt * fade_x + damper,
            across_n: spring_y * patch.across_m - damper * ground_mps.y,
            limit_n: m.grip_x.max(m.grip_y) * friction * load_n,
            fade: fade_x,
        }
    }
}

impl Patch {
    /// Moves the patch along, now that the rim's speed over ground is known.
    #[inline]
    pub(super) fn spun(&mut self, answer: &Answer, slide_mps: f32, dt: f32) {
        self.along_m = (self.along_m + dt * slide_mps) * answer.fade;
    }
}
