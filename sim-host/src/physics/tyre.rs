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

use super::lanes::Lanes;

/// The curves' table: entries, and how many for each unit of scaled slip.
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
    /// Above this multiple of that load, stiffness across grows no more.
    pub stiff_load: f32,
    /// Force across of a leaning wheel, to the side that it leans to: per radian of camber and
    /// newton of load.
    pub camber_stiffness: f32,
    /// Distance rolled until the force along has followed the slip to 63 %.
    pub relaxation_x_m: f32,
    /// The same across.
    pub relaxation_y_m: f32,
    /// Drag of rolling, as a share of the load.
    pub rolling_resistance: f32,
}

/// Both curves in one table: force over scaled slip, divided by scaled slip; 1 at 0 and falling.
///
/// Each entry holds its own values, along and across, and its successor's.
#[derive(Debug, PartialEq)]
struct Curves([[f32; 4]; STEPS]);

impl Curves {
    fn new(model: &TyreModel) -> Curves {
        let ratio = |step: usize, shape: f32, curvature: f32| {
            let slip = step as f32 / STEPS_PER_UNIT;
            let b = slip / shape;
            let force = (shape * (b - curvature * (b - b.atan())).atan()).sin();
            if step == 0 { 1.0 } else { force / slip }
        };
        let along = |step| ratio(step, model.shape_x, model.curvature_x);
        let across = |step| ratio(step, model.shape_y, model.curvature_y);
        Curves(std::array::from_fn(|i| [along(i), across(i), along(i + 1), across(i + 1)]))
    }

    #[inline]
    fn at(&self, place: f32) -> Vec2 {
        let index = place as usize;
        let [along, across, next_along, next_across] = self.0[index.min(STEPS - 1)];
        let part = place - index as f32;
        Vec2::new(along + (next_along - along) * part, across + (next_across - across) * part)
    }
}

/// Up to four tyres, with what can be computed beforehand.
#[derive(Debug)]
pub(super) struct Tyres {
    curves: [Curves; 4],
    /// Inverse relaxation lengths.
    relax_x: Lanes,
    relax_y: Lanes,
    /// From a patch's deflection to its slip, scaled so that the curve's slope is 1.
    scale_x: Lanes,
    scale_y: Lanes,
    /// Force per deflection and load, for small slips.
    spring_x: Lanes,
    spring_y: Lanes,
    grip_max: Lanes,
    /// Effective load per load: `base − fall * load`.
    load_base: Lanes,
    load_fall: Lanes,
    stiff_n: Lanes,
    camber_stiffness: Lanes,
}

/// What the tyres answer to one sub-iteration's motion.
///
/// Along, the force is `held_n + slope_nspm * (rim speed − ground speed)`, so that the wheel's spin
/// can be found together with it.
pub(super) struct TyreForces {
    pub held_n: Lanes,
    pub slope_nspm: Lanes,
    pub across_n: Lanes,
    pub limit_n: Lanes,
    /// The patch's deflection along fades by this factor.
    pub fade: Lanes,
}

/// The contact patches' deflection: what tyres remember.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PatchDeflection {
    pub along_m: Lanes,
    pub across_m: Lanes,
}

/// How the wheels move over ground: forwards, to the left, and their rims backwards at the ground.
#[derive(Clone, Copy)]
pub(super) struct ContactVelocity {
    pub along_mps: Lanes,
    pub across_mps: Lanes,
    pub wheel_speed_mps: Lanes,
    /// Radians by which the wheels lean to the right.
    pub camber: Lanes,
}

/// Below this speed the patch's spring is damped as rubber is.
const DAMPED_BELOW_MPS: f32 = 3.0;
/// How much, per newton of load: about a third of critical for the vehicle on its patches.
const DAMPING_SPM: f32 = 2.0;

impl Tyres {
    pub(super) fn new(models: [&TyreModel; 4]) -> Tyres {
        let lanes = |value: fn(&TyreModel) -> f32| Lanes::new(models.map(value));
        Tyres {
            curves: models.map(Curves::new),
            relax_x: lanes(|m| 1.0 / m.relaxation_x_m),
            relax_y: lanes(|m| 1.0 / m.relaxation_y_m),
            scale_x: lanes(|m| m.stiffness_x / m.grip_x / m.relaxation_x_m),
            scale_y: lanes(|m| m.stiffness_y / m.grip_y / m.relaxation_y_m),
            spring_x: lanes(|m| m.stiffness_x / m.relaxation_x_m),
            spring_y: lanes(|m| m.stiffness_y / m.relaxation_y_m),
            grip_max: lanes(|m| m.grip_x.max(m.grip_y)),
            load_base: lanes(|m| 1.0 + m.load_sensitivity),
            load_fall: lanes(|m| m.load_sensitivity / m.nominal_load_n),
            stiff_n: lanes(|m| m.stiff_load * m.nominal_load_n),
            camber_stiffness: lanes(|m| m.camber_stiffness),
        }
    }

    /// One sub-iteration of `dt` seconds. Moves the patches across; along they move when the new
    /// spin is known.
    #[inline]
    pub(super) fn forces(
        &self,
        deflection: &mut PatchDeflection,
        load_n: Lanes,
        friction: Lanes,
        velocity: &ContactVelocity,
        dt: f32,
    ) -> TyreForces {
        let ContactVelocity { along_mps, across_mps, wheel_speed_mps, camber } = *velocity;
        let transport = along_mps.abs().fast_max(across_mps.abs()).fast_max(wheel_speed_mps.abs());
        let fade_x = Lanes::ONE / (transport * self.relax_x * dt + Lanes::ONE);
        let fade_y = Lanes::ONE / (transport * self.relax_y * dt + Lanes::ONE);
        let along_m = (deflection.along_m + (wheel_speed_mps - along_mps) * dt) * fade_x;
        let across_m = (deflection.across_m - across_mps * dt) * fade_y;
        deflection.across_m = across_m;

        // Grip and stiffness fall alike with load, so their ratio stays.
        let (slip_x, slip_y) = (along_m * self.scale_x, across_m * self.scale_y);
        let slip = (slip_x * slip_x + slip_y * slip_y).sqrt() / friction;
        let place = (slip * STEPS_PER_UNIT).fast_min(Lanes::splat(STEPS as f32 - 1e-3)).to_array();
        let ratios: [Vec2; 4] = std::array::from_fn(|lane| self.curves[lane].at(place[lane]));
        let ratio_x = Lanes::new(ratios.map(|r| r.x));
        let ratio_y = Lanes::new(ratios.map(|r| r.y));
        let share =
            (self.load_base - self.load_fall * load_n).clamp(Lanes::splat(0.5), Lanes::splat(1.3));
        let load_n = load_n * share;
        let spring_x = self.spring_x * load_n * ratio_x;
        let spring_y = self.spring_y * load_n.fast_min(self.stiff_n * share) * ratio_y;

        let slowness = (Lanes::ONE - transport * (1.0 / DAMPED_BELOW_MPS)).fast_max(Lanes::ZERO);
        let damper = slowness * load_n * DAMPING_SPM;
        // Along, the patch will be (old + dt · slide) · fade, with the slide yet to be found.
        TyreForces {
            held_n: spring_x * deflection.along_m * fade_x,
            slope_nspm: spring_x * fade_x * dt + damper,
            across_n: spring_y * across_m
                - damper * across_mps
                - self.camber_stiffness * camber * load_n,
            limit_n: self.grip_max * friction * load_n,
            fade: fade_x,
        }
    }
}
