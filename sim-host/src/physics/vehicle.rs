//! A vehicle in motion: from controls and ground to the force and torque on its body.

use std::sync::Arc;

use glam::Vec3;
use protocol::VehiclePhysics;
use serde::{Deserialize, Serialize};

use super::{
    ackermann::Ackermann,
    aerodynamics::add_aerodynamic_forces,
    contact::CornerContacts,
    door_model::{DoorModel, OpenDoor},
    drivetrain::{Demand, Drivetrain},
    ground::CachedTriangle,
    kinematic::KinematicModel,
    model::{GRAVITY_MPS2, LeanModel, VehicleModel, WheelModel},
    motion::{Motion, Wrench},
    pedals::Pedals,
    stability::{Intervention, Stability, StabilityModel},
    tuning::tuned_model,
    wheels::{Braking, Surface, WheelBank, WheelBankState, WheelContacts, banks, lane_order},
};

/// Longest sub-iteration. Seconds.
const ITERATION_MAX_S: f32 = 0.0026;
/// Cosine of the tilt beyond which the wheels carry no load.
const CARRY_UP_MIN: f32 = 0.3;
/// Fraction of the tyres' friction that a rider uses in a curve.
const LEAN_SHARE: f32 = 0.95;
/// Banks of four for [`super::WHEELS_MAX`] wheels.
const BANKS_MAX: usize = 2;

/// A [`VehicleModel`] with precomputed values.
#[derive(Debug)]
pub(super) struct Prepared {
    pub model: Arc<VehicleModel>,
    banks: Vec<WheelBank>,
    pub kinematic: KinematicModel,
    /// Index of the wheel in each lane of the banks.
    pub order: Vec<usize>,
    /// Distance from the turning line to the foremost axle.
    wheelbase_m: f32,
    /// The turning line in vehicle space: the line through the centre of rotation, parallel to y.
    pub rear_x_m: f32,
    pub stability: StabilityModel,
}

impl Prepared {
    pub(super) fn new(model: Arc<VehicleModel>) -> Prepared {
        let xs = || model.wheels.iter().map(|w| w.hub_m.x);
        let front = xs().fold(f32::NEG_INFINITY, f32::max);
        // Wheels that are not steered roll straight; several such axles share one turning line.
        let fixed: Vec<f32> =
            model.wheels.iter().filter(|w| !w.steered).map(|w| w.hub_m.x).collect();
        let rear_x_m = match fixed.len() {
            0 => xs().fold(f32::INFINITY, f32::min),
            n => fixed.iter().sum::<f32>() / n as f32,
        };
        let (banks, order) = (banks(&model, rear_x_m), lane_order(&model));
        let wheelbase_m = (front - rear_x_m).max(0.3);
        let stability = StabilityModel::new(&model, wheelbase_m);
        let kinematic = KinematicModel::new(&model);
        Prepared { banks, kinematic, order, wheelbase_m, rear_x_m, stability, model }
    }
}

impl Prepared {
    /// Returns the largest lean angle: the resultant of weight and side force lies within the
    /// friction of the tyres.
    fn lean_max_rad(&self, lean: &LeanModel, friction: f32) -> f32 {
        lean.max_rad.min((LEAN_SHARE * self.stability.grip * friction).atan())
    }

    /// Returns the direction of a wheel in body axes, by Ackermann geometry.
    pub(super) fn heading(&self, wheel: &WheelModel, steer_rad: f32) -> Vec3 {
        if !wheel.steered {
            return Vec3::X;
        }
        let curvature = wheel.steer_share * steer_rad.tan() / self.wheelbase_m;
        let ahead = curvature * (wheel.hub_m.x - self.rear_x_m);
        Vec3::new(1.0 - curvature * wheel.hub_m.y, ahead, 0.0).normalize_or(Vec3::X)
    }
}

/// The state of a vehicle beyond the pose and velocity of its body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct VehicleState {
    pub banks: Vec<WheelBankState>,
    pub drivetrain: Drivetrain,
    /// Steering angle in the middle of the front axle that the controls command, positive to the
    /// left.
    pub steer_rad: f32,
    /// What the rider of a two-wheeler adds to it against a slide.
    pub counter_steer_rad: f32,
    pub control: Pedals,
    pub stability: Stability,
    /// The Ackermann controller, once a command has used it.
    pub ackermann: Option<Box<Ackermann>>,
    /// Open doors, by index.
    pub doors: Vec<OpenDoor>,
}

/// A vehicle without its body.
#[derive(Clone, Debug)]
pub(super) struct Vehicle {
    /// The model with the parameters that clients changed.
    pub prepared: Arc<Prepared>,
    /// The model of the blueprint.
    pub own: Arc<VehicleModel>,
    /// The parameters that clients changed.
    pub tuning: Option<Box<VehiclePhysics>>,
    pub state: VehicleState,
    /// The ground under the wheels of each bank: a cache that changes no result and is no state.
    cached_ground: Vec<[Option<CachedTriangle>; 4]>,
}

impl Vehicle {
    pub(super) fn new(prepared: Arc<Prepared>) -> Vehicle {
        let state = VehicleState::at_rest(&prepared);
        let own = Arc::clone(&prepared.model);
        let cached_ground = vec![[None; 4]; prepared.banks.len()];
        Vehicle { own, tuning: None, prepared, state, cached_ground }
    }

    /// Changes the parameters of the vehicle in motion.
    pub(super) fn tune(&mut self, physics: &VehiclePhysics) {
        self.prepared = Arc::new(Prepared::new(Arc::new(tuned_model(&self.own, physics))));
        self.tuning = Some(Box::new(physics.clone()));
    }

    /// Whether a state is one of this model.
    pub(super) fn takes(&self, state: &VehicleState) -> bool {
        state.banks.len() == self.prepared.banks.len()
    }

    /// Resets the state to standstill; controls, controller and doors stay.
    pub(super) fn reset_motion(&mut self) {
        let VehicleState { control, ackermann, doors, .. } = &mut self.state;
        let (control, ackermann, doors) = (*control, ackermann.take(), std::mem::take(doors));
        let at_rest = VehicleState::at_rest(&self.prepared);
        self.state = VehicleState { control, ackermann, doors, ..at_rest };
    }

    /// Sets the wheel speeds to that of the body, so that a set velocity causes no slip.
    pub(super) fn roll_without_slip(&mut self, forward_mps: f32) {
        for (bank, state) in self.prepared.banks.iter().zip(&mut self.state.banks) {
            bank.roll_without_slip(state, forward_mps);
        }
    }

    /// Returns the sum of the wheel loads.
    pub(super) fn load_n(&self) -> f32 {
        self.state.banks.iter().map(|bank| bank.load_n.reduce_add()).sum()
    }

    /// Advances the rotation angles of the wheels.
    pub(super) fn advance_angles(&mut self, dt: f32) {
        for (bank, state) in self.prepared.banks.iter().zip(&mut self.state.banks) {
            bank.advance_angles(state, dt);
        }
    }

    /// Returns the open doors, by index.
    pub(super) fn open_doors(&self) -> impl Iterator<Item = &DoorModel> {
        self.state.doors.iter().map(|door| &door.model)
    }

    /// Returns the rotation angle of the first wheel, modulo one revolution.
    pub(super) fn wheel_angle_rad(&self) -> f32 {
        self.state.banks.first().map_or(0.0, |b| b.angle_rad.to_array()[0])
    }

    /// Advances a copy of the body through the sub-iterations of one substep of `dt` seconds.
    /// Returns the mean force, without gravity, and the mean torque. `external` acts in addition.
    pub(super) fn substep(
        &mut self,
        surface: &Surface,
        start: &Motion,
        external: &Wrench,
        dt: f32,
    ) -> Wrench {
        self.advance(surface, start, external, dt).0
    }

    /// As [`Vehicle::substep`]; returns the motion of the copy at the end, too.
    pub(super) fn advance(
        &mut self,
        surface: &Surface,
        start: &Motion,
        external: &Wrench,
        dt: f32,
    ) -> (Wrench, Motion) {
        let Vehicle { prepared, state, cached_ground, .. } = self;
        let model = &*prepared.model;
        let forward_mps = start.velocity_mps.dot(start.axes.x_axis);
        if let Some(controller) = &mut state.ackermann {
            let most = model.steer_max_rad * share_at(&model.steer_curve, forward_mps.abs());
            controller.drive(&mut state.control, forward_mps, most, dt);
        }
        state.steer(prepared, forward_mps, surface.grip, dt);
        if model.lean.is_some() && !model.stability_control {
            let (model, steer_rad, grip) = (&prepared.stability, state.steer_rad, surface.grip);
            state.counter_steer_rad =
                state.stability.counter_steer(model, steer_rad, start, grip, dt);
        }

        let curvature = state.steer_rad.tan() / prepared.wheelbase_m;
        let wheel_curvature = state.wheel_steer_rad().tan() / prepared.wheelbase_m;
        let mut contacts = [WheelContacts::default(); BANKS_MAX];
        let mut carried = start.axes.z_axis.z > CARRY_UP_MIN;
        let mut pressed = false;
        let mut friction = surface.grip;
        for (index, bank) in prepared.banks.iter().enumerate() {
            let state = &mut state.banks[index];
            if start.axes.z_axis.z > CARRY_UP_MIN {
                let holds = &mut cached_ground[index];
                contacts[index] = bank.contacts(state, holds, surface, start, wheel_curvature, dt);
                friction = friction.min(bank.friction(&contacts[index]));
            }
            carried &= bank.all_touch(&contacts[index]);
            pressed |= bank.is_pressed(state);
        }
        let pedals = state.control;
        let driven_radps = state.driven_radps(prepared);
        let aid = if model.stability_control {
            state.stability.regulate(&prepared.stability, state.steer_rad, start, friction, dt)
        } else {
            Intervention::NONE
        };
        let throttle = pedals.throttle * aid.throttle;
        let demand = Demand { throttle, reverse: pedals.reverse, manual: pedals.manual };
        state.drivetrain.shift(model, demand, driven_radps, forward_mps, dt);

        // The collision box can touch the ground only if the wheels do not carry the body.
        let upright = start.axes.z_axis.z > 0.8;
        let corners = if carried && upright && !pressed {
            CornerContacts::default()
        } else {
            let center_m = model.box_center_m - model.com_m;
            CornerContacts::find(surface.ground, start, center_m, model.box_half_m, dt)
        };

        let iterations = (dt / ITERATION_MAX_S).ceil().max(1.0);
        let step = dt / iterations;
        let handbrake = f32::from(u8::from(pedals.handbrake));
        let mut motion = *start;
        let mut sum = Wrench::default();
        for _ in 0..iterations as usize {
            let mut wrench = *external;
            let driven_radps = state.driven_radps(prepared);
            let drive = state.drivetrain.drive(model, driven_radps, step);
            for (index, bank) in prepared.banks.iter().enumerate() {
                let wheels = &mut state.banks[index];
                let single_nm = bank.single_brakes(aid.front_nm, aid.rear_nm);
                let braking = Braking { pedal: pedals.brake, handbrake, single_nm };
                bank.advance(wheels, &contacts[index], &motion, &drive, braking, step, &mut wrench);
            }
            let driven_radps = state.driven_radps(prepared);
            state.drivetrain.update_clutch(model, &drive, driven_radps);
            corners.add_forces(&motion, model.mass_kg, step, &mut wrench);
            add_aerodynamic_forces(model, &motion, &mut wrench);
            for door in &state.doors {
                door.add_drag(model.com_m, &motion, &mut wrench);
            }
            if model.lean.is_some() {
                lean(prepared, curvature, friction, &motion, &mut wrench);
            }
            motion.advance(&wrench, model.mass_kg, model.inertia_kgm2, step);
            sum.force_n += wrench.force_n;
            sum.torque_nm += wrench.torque_nm;
        }
        for (bank, state) in prepared.banks.iter().zip(&mut state.banks) {
            bank.advance_angles(state, dt);
        }
        let mean =
            Wrench { force_n: sum.force_n / iterations, torque_nm: sum.torque_nm / iterations };
        (mean, motion)
    }
}

impl VehicleState {
    fn at_rest(prepared: &Prepared) -> VehicleState {
        VehicleState {
            banks: vec![WheelBank::at_rest(); prepared.banks.len()],
            drivetrain: Drivetrain::new(&prepared.model),
            steer_rad: 0.0,
            counter_steer_rad: 0.0,
            control: Pedals::default(),
            stability: Stability::default(),
            ackermann: None,
            doors: Vec::new(),
        }
    }

    /// Returns the steering angle of the front wheels in the middle of their axle.
    #[inline]
    pub(super) fn wheel_steer_rad(&self) -> f32 {
        self.steer_rad + self.counter_steer_rad
    }

    /// Returns the mean speed of the driven wheels.
    #[inline]
    fn driven_radps(&self, prepared: &Prepared) -> f32 {
        prepared.banks.iter().zip(&self.banks).map(|(bank, state)| bank.driven_radps(state)).sum()
    }

    pub(super) fn steer(&mut self, prepared: &Prepared, forward_mps: f32, friction: f32, dt: f32) {
        let model = &prepared.model;
        let most = model.steer_max_rad * share_at(&model.steer_curve, forward_mps.abs());
        let mut target = self.control.steer * most;
        if let Some(lean) = &model.lean {
            // The steering angle is limited by the largest lean angle.
            let leans = prepared.lean_max_rad(lean, friction);
            let tightest = 0.9 * leans.tan() * GRAVITY_MPS2 * prepared.wheelbase_m;
            let tightest = (tightest / (forward_mps * forward_mps).max(0.1)).atan();
            target = target.clamp(-tightest, tightest);
        }
        let rate = model.steer_rate_radps * dt;
        self.steer_rad += (target - self.steer_rad).clamp(-rate, rate);
    }
}

/// Adds the rider's balance: a torque about the longitudinal axis towards the lean angle of the
/// curve. It also raises a two-wheeler that has fallen over.
fn lean(
    prepared: &Prepared,
    curvature_per_m: f32,
    friction: f32,
    motion: &Motion,
    wrench: &mut Wrench,
) {
    let model = &prepared.model;
    let Some(lean) = &model.lean else { return };
    let ahead = motion.axes.x_axis;
    let speed = motion.velocity_mps.dot(ahead);
    // A positive angle about x leans to the right; a left curve needs a lean to the left.
    let target = -(speed * speed * curvature_per_m / GRAVITY_MPS2).atan();
    let most = prepared.lean_max_rad(lean, friction);
    let target = target.clamp(-most, most);
    let roll = motion.axes.y_axis.z.clamp(-1.0, 1.0).asin();
    let rate = motion.spin_radps.dot(ahead);
    let omega = lean.frequency_radps;
    let inertia = model.inertia_kgm2.x + model.mass_kg * model.com_m.z * model.com_m.z;
    let torque = inertia * (omega * omega * (target - roll) - 2.0 * omega * rate);
    wrench.torque_nm += ahead * torque;
}

/// Interpolates linearly between pairs; constant beyond them.
fn share_at(curve: &[[f32; 2]], at: f32) -> f32 {
    let Some(first) = curve.first() else { return 1.0 };
    if at <= first[0] {
        return first[1];
    }
    for pair in curve.windows(2) {
        let [[from, low], [to, high]] = [pair[0], pair[1]];
        if at <= to {
            return low + (high - low) * (at - from) / (to - from).max(1e-3);
        }
    }
    curve[curve.len() - 1][1]
}
