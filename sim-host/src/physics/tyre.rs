//! The tyre model: from slip to force.
//!
//! The shape is Pacejka's magic formula (Pacejka, Tire and Vehicle Dynamics, 3rd ed., section
//! 4.3.1), with a longitudinal and a lateral curve. Both slips, each scaled so that its curve
//! begins with slope 1, form one vector; its length selects the point on the curves and its
//! direction distributes the force, so that the limit is an ellipse. The slip itself is the
//! deflection of a contact patch dragged over the ground (ibid., section 7.2.3): at speed it is the
//! steady-state slip after a relaxation length, at standstill it is a spring, so that a parked car
//! does not creep.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::lanes::Lanes;

/// Size of the tables of the curves, and entries per unit of scaled slip.
const STEPS: usize = 80;
const STEPS_PER_UNIT: f32 = 4.0;

/// The parameters of a tyre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TyreModel {
    /// Peak longitudinal friction coefficient, at the nominal load on dry asphalt.
    pub grip_x: f32,
    /// Peak lateral friction coefficient, at the nominal load on dry asphalt.
    pub grip_y: f32,
    /// Longitudinal slip stiffness: force per unit of slip and newton of load.
    pub stiffness_x: f32,
    /// Cornering stiffness: force per radian of slip angle and newton of load.
    pub stiffness_y: f32,
    /// Longitudinal shape factor C of the magic formula.
    pub shape_x: f32,
    /// Lateral shape factor C of the magic formula.
    pub shape_y: f32,
    /// Longitudinal curvature factor E of the magic formula.
    pub curvature_x: f32,
    /// Lateral curvature factor E of the magic formula.
    pub curvature_y: f32,
    /// Fraction of friction and stiffness lost per multiple of the nominal load.
    pub load_sensitivity: f32,
    /// Load for which friction and stiffness are given.
    pub nominal_load_n: f32,
    /// Multiple of the nominal load above which the cornering stiffness no longer grows.
    pub stiff_load: f32,
    /// Camber stiffness: lateral force towards the side of the inclination, per radian of camber
    /// and newton of load.
    pub camber_stiffness: f32,
    /// Longitudinal relaxation length: distance rolled until the force reaches 63 % of its final
    /// value.
    pub relaxation_x_m: f32,
    /// Lateral relaxation length.
    pub relaxation_y_m: f32,
    /// Rolling resistance coefficient.
    pub rolling_resistance: f32,
}

/// Both curves in one table: force divided by scaled slip, over scaled slip; 1 at 0 and falling.
///
/// Each entry holds its own longitudinal and lateral values, and those of its successor.
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

/// Up to four tyres with precomputed values.
#[derive(Debug)]
pub(super) struct Tyres {
    curves: [Curves; 4],
    /// Inverse relaxation lengths.
    relax_x: Lanes,
    relax_y: Lanes,
    /// Factor from the deflection of a patch to its slip, scaled so that the curve's slope is 1.
    scale_x: Lanes,
    scale_y: Lanes,
    /// Force per deflection and load, for small slips.
    spring_x: Lanes,
    spring_y: Lanes,
    grip_max: Lanes,
    /// Effective load divided by load: `base − fall * load`.
    load_base: Lanes,
    load_fall: Lanes,
    stiff_n: Lanes,
    camber_stiffness: Lanes,
}

/// The tyre forces of one sub-iteration.
///
/// The longitudinal force is `held_n + slope_nspm * (circumferential speed − ground speed)`, so
/// that it can be solved together with the wheel's angular velocity.
pub(super) struct TyreForces {
    pub held_n: Lanes,
    pub slope_nspm: Lanes,
    pub across_n: Lanes,
    pub limit_n: Lanes,
    /// Factor by which the longitudinal deflection of the patch decays.
    pub fade: Lanes,
}

/// The deflection of the contact patches: the state of the tyres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PatchDeflection {
    pub along_m: Lanes,
    pub across_m: Lanes,
}

/// The velocity of the contact points over ground, forwards and to the left, and the
/// circumferential speed of the wheels.
#[derive(Clone, Copy)]
pub(super) struct ContactVelocity {
    pub along_mps: Lanes,
    pub across_mps: Lanes,
    pub wheel_speed_mps: Lanes,
    /// Camber: inclination of the wheels to the right. Radians.
    pub camber: Lanes,
}

/// Below this speed the deflection of the patch is damped like rubber.
const DAMPED_BELOW_MPS: f32 = 3.0;
/// Damping per newton of load: about a third of the critical damping of the vehicle on its patches.
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

    /// Computes one sub-iteration of `dt` seconds. Advances the lateral deflection; the
    /// longitudinal one is advanced when the new angular velocity is known.
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

        // Friction and stiffness fall with load by the same factor, so their ratio is constant.
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
        // The longitudinal deflection will be (old + dt · slide) · fade, with the slide still
        // unknown.
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
