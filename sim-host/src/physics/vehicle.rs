//! A vehicle in motion: from pedals and ground to the force and torque on its body.

use std::sync::Arc;

use bus::{VehicleControl, flag};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::contact::Corners;
use super::drivetrain::{Demand, Drivetrain};
use super::ground::Ground;
use super::model::{GRAVITY_MPS2, VehicleModel, WHEELS_MAX};
use super::motion::{Motion, Push};
use super::suspension;
use super::tyre::{Patch, Tyre};

/// The longest sub-iteration.
const ITERATION_MAX_S: f32 = 0.0026;
/// The wheel's ray starts this far above its hub at rest.
const RAY_ABOVE_M: f32 = 0.6;
/// Leaning further than this (cosine of the tilt), wheels do not carry.
const CARRY_UP_MIN: f32 = 0.3;
/// A step in the ground lifts a wheel no faster than it could roll up: speed plus this.
const CLIMB_MIN_MPS: f32 = 0.5;
const AIR_DENSITY_KGPM3: f32 = 1.2;

/// A [`VehicleModel`] with what can be computed beforehand.
#[derive(Debug)]
pub(super) struct Prepared {
    pub model: Arc<VehicleModel>,
    tyres: Vec<Tyre>,
    /// Distance from the rearmost to the foremost axle.
    wheelbase_m: f32,
    rear_x_m: f32,
}

impl Prepared {
    pub(super) fn new(model: Arc<VehicleModel>) -> Prepared {
        let xs = || model.wheels.iter().map(|w| w.hub_m.x);
        let front = xs().fold(f32::NEG_INFINITY, f32::max);
        // Behind the turning point all wheels roll straight; several rear axles share one.
        let fixed: Vec<f32> =
            model.wheels.iter().filter(|w| !w.steered).map(|w| w.hub_m.x).collect();
        let rear_x_m = match fixed.len() {
            0 => xs().fold(f32::INFINITY, f32::min),
            n => fixed.iter().sum::<f32>() / n as f32,
        };
        Prepared {
            tyres: model.wheels.iter().map(|w| Tyre::new(w.tyre.clone())).collect(),
            wheelbase_m: (front - rear_x_m).max(0.3),
            rear_x_m,
            model,
        }
    }
}

/// What one wheel remembers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct WheelState {
    pub spin_radps: f32,
    pub angle_rad: f32,
    patch: Patch,
    /// Height of the ground that it rolls on; none in the air.
    ground_m: Option<f32>,
    pub load_n: f32,
    across_n: f32,
}

/// All of a vehicle's state beyond its body's pose and velocity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct VehicleState {
    pub wheels: Vec<WheelState>,
    pub drivetrain: Drivetrain,
    /// In the middle of the front axle, positive to the left.
    pub steer_rad: f32,
    pub control: Pedals,
}

/// The driver's wishes, checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Pedals {
    pub throttle: f32,
    pub brake: f32,
    pub steer: f32,
    pub handbrake: bool,
    pub reverse: bool,
    pub manual: Option<i32>,
}

impl Pedals {
    /// Cut to their ranges; what is not a number is 0.
    pub(super) fn new(control: &VehicleControl) -> Pedals {
        let cut = |value: f32, low: f32| if value.is_nan() { 0.0 } else { value.clamp(low, 1.0) };
        Pedals {
            throttle: cut(control.throttle, 0.0),
            brake: cut(control.brake, 0.0),
            steer: cut(control.steer, -1.0),
            handbrake: control.flags & flag::HANDBRAKE != 0,
            reverse: control.flags & flag::REVERSE != 0,
            manual: (control.manual_gear != 0).then_some(control.gear),
        }
    }
}

/// A vehicle, without its body.
#[derive(Clone, Debug)]
pub(super) struct Vehicle {
    pub prepared: Arc<Prepared>,
    pub state: VehicleState,
}

/// One wheel on its ground during one substep.
#[derive(Clone, Copy, Default)]
struct Footing {
    touching: bool,
    on_ground_m: Vec3,
    normal: Vec3,
    friction: f32,
    /// Hub at rest, from the centre of mass, in the body's axes.
    hub_in_body_m: Vec3,
    /// From hub to the contact point, in world space.
    foot_m: Vec3,
    /// Steered direction in the body's axes, level.
    heading: Vec2,
}

impl Vehicle {
    pub(super) fn new(prepared: Arc<Prepared>) -> Vehicle {
        let state = VehicleState::at_rest(&prepared.model);
        Vehicle { prepared, state }
    }

    /// Forgets all motion, keeps the pedals.
    pub(super) fn rest(&mut self) {
        let control = self.state.control;
        self.state = VehicleState { control, ..VehicleState::at_rest(&self.prepared.model) };
    }

    /// Sets the wheels rolling as the body moves, so that a set velocity does not make them slide.
    pub(super) fn roll_at(&mut self, forward_mps: f32) {
        for (wheel, model) in self.state.wheels.iter_mut().zip(&self.prepared.model.wheels) {
            wheel.spin_radps = forward_mps / model.radius_m;
            wheel.patch = Patch::default();
        }
    }

    /// The driven wheels' mean speed.
    fn driven_radps(&self) -> f32 {
        let wheels = self.state.wheels.iter().zip(&self.prepared.model.wheels);
        wheels.map(|(state, model)| state.spin_radps * model.drive_share).sum()
    }

    /// One substep of `dt` seconds: moves a copy of the body through its sub-iterations, and
    /// returns the mean force (without gravity) and torque.
    pub(super) fn substep(&mut self, ground: &Ground, start: &Motion, dt: f32) -> Push {
        let prepared = Arc::clone(&self.prepared);
        let model = &prepared.model;
        let forward_mps = start.velocity_mps.dot(start.axes.x_axis);
        self.steer(&prepared, forward_mps, dt);
        self.shift(model, forward_mps, dt);

        let count = model.wheels.len();
        let mut footings = [Footing::default(); WHEELS_MAX];
        let mut carried = true;
        let mut pressed = false;
        for (index, footing) in footings[..count].iter_mut().enumerate() {
            *footing = self.footing(&prepared, ground, start, index, dt);
            carried &= footing.touching;
            pressed |= self.state.wheels[index].load_n > 3.0 * model.wheels[index].static_load_n;
        }
        // The body itself can only meet the ground when the wheels do not hold it up.
        let upright = start.axes.z_axis.z > 0.8;
        let center_m = model.box_center_m - model.com_m;
        let corners = if carried && upright && !pressed {
            Corners::default()
        } else {
            Corners::look(ground, start, center_m, model.box_half_m, dt)
        };

        let iterations = (dt / ITERATION_MAX_S).ceil().max(1.0);
        let step = dt / iterations;
        let mut motion = *start;
        let mut sum = Push::default();
        for _ in 0..iterations as usize {
            let mut push = Push::default();
            self.wheels(&prepared, &footings[..count], &motion, step, &mut push);
            corners.push(&motion, model.mass_kg, step, &mut push);
            self.air(model, &motion, &mut push);
            self.lean(&prepared, &motion, &mut push);
            motion.advance(&push, model.mass_kg, model.inertia_kgm2, step);
            sum.force_n += push.force_n;
            sum.torque_nm += push.torque_nm;
        }
        for wheel in &mut self.state.wheels {
            wheel.angle_rad = (wheel.angle_rad + wheel.spin_radps * dt) % std::f32::consts::TAU;
        }
        Push { force_n: sum.force_n / iterations, torque_nm: sum.torque_nm / iterations }
    }

    fn steer(&mut self, prepared: &Prepared, forward_mps: f32, dt: f32) {
        let model = &prepared.model;
        let most = model.steer_max_rad * share_at(&model.steer_curve, forward_mps.abs());
        let mut target = self.state.control.steer * most;
        if let Some(lean) = &model.lean {
            // Nobody steers a two-wheeler tighter than they can lean.
            let tightest = 0.9 * lean.max_rad.tan() * GRAVITY_MPS2 * prepared.wheelbase_m;
            let tightest = (tightest / (forward_mps * forward_mps).max(0.1)).atan();
            target = target.clamp(-tightest, tightest);
        }
        let rate = model.steer_rate_radps * dt;
        self.state.steer_rad += (target - self.state.steer_rad).clamp(-rate, rate);
    }

    fn shift(&mut self, model: &VehicleModel, forward_mps: f32, dt: f32) {
        let pedals = self.state.control;
        let demand =
            Demand { throttle: pedals.throttle, reverse: pedals.reverse, manual: pedals.manual };
        let wheel_radps = self.driven_radps();
        self.state.drivetrain.shift(model, demand, wheel_radps, forward_mps, dt);
    }

    /// Where wheel `index` meets the ground in the middle of the coming substep.
    fn footing(
        &mut self,
        prepared: &Prepared,
        ground: &Ground,
        start: &Motion,
        index: usize,
        dt: f32,
    ) -> Footing {
        let wheel = &prepared.model.wheels[index];
        let state = &mut self.state.wheels[index];
        let hub_in_body_m = wheel.hub_m - prepared.model.com_m;
        let up = start.axes.z_axis;
        let mut footing = Footing { hub_in_body_m, heading: Vec2::X, ..Footing::default() };
        if wheel.steered {
            // Ackermann: all wheels turn about one point on the line of the rear axle.
            let curvature = self.state.steer_rad.tan() / prepared.wheelbase_m;
            let ahead = (wheel.hub_m.x - prepared.rear_x_m) * curvature;
            footing.heading =
                Vec2::new(1.0 - wheel.hub_m.y * curvature, ahead).normalize_or(Vec2::X);
        }
        if up.z < CARRY_UP_MIN {
            state.ground_m = None;
            return footing;
        }
        let axle = start.axes.x_axis * -footing.heading.y + start.axes.y_axis * footing.heading.x;
        let hub = start.com_m + start.axes * hub_in_body_m + start.velocity_mps * (0.5 * dt);
        let from = hub + up * RAY_ABOVE_M;
        // Down the body's axis by a radius leads to about where the wheel stands.
        let guess = hub - up * wheel.radius_m;
        let hit = ground.below(guess.x, guess.y, from.z);
        footing.on_ground_m = Vec3::new(guess.x, guess.y, hit.height_m);
        // A disc touches the plane with its lowest point, towards the plane's normal within itself.
        let in_disc = hit.normal - axle * hit.normal.dot(axle);
        footing.foot_m = -in_disc.normalize_or(up) * wheel.radius_m;
        footing.normal = hit.normal;
        footing.friction = hit.friction;
        if let Some(before) = state.ground_m {
            let climb = (start.velocity_mps.truncate().length() + CLIMB_MIN_MPS) * dt;
            footing.on_ground_m.z = footing.on_ground_m.z.min(before + climb);
        }
        let droop = wheel.static_load_n / wheel.spring_npm;
        let gap = (hub + footing.foot_m - footing.on_ground_m).dot(hit.normal);
        footing.touching = gap < droop + 0.3 * start.velocity_mps.length().min(1.0);
        state.ground_m = footing.touching.then_some(footing.on_ground_m.z);
        footing
    }

    /// One sub-iteration of all wheels: loads, tyre forces, spins.
    fn wheels(
        &mut self,
        prepared: &Prepared,
        footings: &[Footing],
        motion: &Motion,
        dt: f32,
        push: &mut Push,
    ) {
        let model = &prepared.model;
        let pedals = self.state.control;
        let up = motion.axes.z_axis;

        // How far each wheel is up in the body: needed from both ends of an axle.
        let mut raised = [0.0f32; WHEELS_MAX];
        let mut hubs = [Vec3::ZERO; WHEELS_MAX];
        for (index, footing) in footings.iter().enumerate() {
            hubs[index] = motion.axes * footing.hub_in_body_m;
            let droop = -model.wheels[index].static_load_n / model.wheels[index].spring_npm;
            raised[index] = if footing.touching {
                let foot = motion.com_m + hubs[index] + footing.foot_m;
                let depth = (footing.on_ground_m - foot).dot(footing.normal);
                (depth / footing.normal.dot(up).max(0.2)).clamp(droop, 0.4)
            } else {
                droop
            };
        }

        let wheel_radps = self.driven_radps();
        let drive = self.state.drivetrain.drive(model, wheel_radps, dt);
        let acrosses: [f32; WHEELS_MAX] =
            std::array::from_fn(|i| self.state.wheels.get(i).map_or(0.0, |w| w.across_n));
        for (index, footing) in footings.iter().enumerate() {
            let wheel = &model.wheels[index];
            let state = &mut self.state.wheels[index];
            let mut shifted = 0.0;
            if let Some(partner) = wheel.partner.map(usize::from) {
                shifted += wheel.anti_roll_npm * (raised[index] - raised[partner]);
                let track = wheel.hub_m.y - model.wheels[partner].hub_m.y;
                shifted -= (acrosses[index] + acrosses[partner]) * wheel.roll_center_m / track;
            }
            let hub_mps = motion.velocity_at(hubs[index]);
            let load = if footing.touching {
                let rate = -hub_mps.dot(footing.normal) / footing.normal.dot(up).max(0.2);
                suspension::load_n(wheel, raised[index], rate, shifted)
            } else {
                0.0
            };
            state.load_n = load;

            let push_nm = drive.push_nm * wheel.drive_share;
            let hold = drive.hold_nmsprad * wheel.drive_share;
            let inertia = wheel.inertia_kgm2 + drive.inertia_kgm2 * wheel.drive_share;
            let mut brake_nm = pedals.brake * wheel.brake_torque_nm
                + wheel.tyre.rolling_resistance * load * wheel.radius_m;
            if pedals.handbrake {
                brake_nm += wheel.handbrake_torque_nm;
            }

            if load <= 0.0 {
                state.patch = Patch::default();
                state.across_n = 0.0;
                let free = (inertia * state.spin_radps + dt * push_nm) / (inertia + dt * hold);
                state.spin_radps = braked(free, dt * brake_nm / (inertia + dt * hold));
                continue;
            }

            // The plane's axes: along the wheel's heading, and to its left.
            let heading =
                motion.axes.x_axis * footing.heading.x + motion.axes.y_axis * footing.heading.y;
            let left = footing.normal.cross(heading).normalize_or(motion.axes.y_axis);
            let along = left.cross(footing.normal);
            // The contact point, from the centre of mass.
            let foot = hubs[index] + up * raised[index] + footing.foot_m;
            let foot_mps = motion.velocity_at(foot);
            let ground_mps = Vec2::new(foot_mps.dot(along), foot_mps.dot(left));
            let radius = wheel.radius_m;
            let answer = prepared.tyres[index].answer(
                &mut state.patch,
                load,
                footing.friction,
                ground_mps,
                state.spin_radps * radius,
                dt,
            );
            // The new spin and the force along depend on each other: solved together.
            let slope = answer.slope_nspm;
            let stiff = inertia + dt * (hold + radius * radius * slope);
            let pull = push_nm - radius * (answer.held_n - slope * ground_mps.x);
            let free = (inertia * state.spin_radps + dt * pull) / stiff;
            state.spin_radps = braked(free, dt * brake_nm / stiff);
            let slide = state.spin_radps * radius - ground_mps.x;
            state.patch.spun(&answer, slide, dt);

            let force = Vec2::new(answer.held_n + slope * slide, answer.across_n);
            let force = force.clamp_length_max(answer.limit_n);
            state.across_n = force.y;
            push.add(footing.normal * load + along * force.x + left * force.y, foot);
        }
        let wheel_radps = self.driven_radps();
        self.state.drivetrain.follow(model, wheel_radps);
    }

    fn air(&self, model: &VehicleModel, motion: &Motion, push: &mut Push) {
        let speed = motion.velocity_mps.length();
        let pressure = 0.5 * AIR_DENSITY_KGPM3 * speed;
        push.force_n -= motion.velocity_mps * (pressure * model.drag_area_m2)
            + motion.axes.z_axis * (pressure * speed * model.downforce_area_m2);
    }

    /// The rider's balance: a torque about the length axis towards the lean that the curve asks for.
    fn lean(&self, prepared: &Prepared, motion: &Motion, push: &mut Push) {
        let model = &prepared.model;
        let Some(lean) = &model.lean else { return };
        if motion.axes.z_axis.z < CARRY_UP_MIN {
            return;
        }
        let ahead = motion.axes.x_axis;
        let speed = motion.velocity_mps.dot(ahead);
        let curvature = self.state.steer_rad.tan() / prepared.wheelbase_m;
        // Positive about x is to the right; a left curve asks for left.
        let wanted = -(speed * speed * curvature / GRAVITY_MPS2).atan();
        let wanted = wanted.clamp(-lean.max_rad, lean.max_rad);
        let roll = motion.axes.y_axis.z.clamp(-1.0, 1.0).asin();
        let rate = motion.spin_radps.dot(ahead);
        let omega = lean.frequency_radps;
        let inertia = model.inertia_kgm2.x + model.mass_kg * model.com_m.z * model.com_m.z;
        let torque = inertia * (omega * omega * (wanted - roll) - 2.0 * omega * rate);
        push.torque_nm += ahead * torque;
    }
}

impl VehicleState {
    fn at_rest(model: &VehicleModel) -> VehicleState {
        let wheel = WheelState {
            spin_radps: 0.0,
            angle_rad: 0.0,
            patch: Patch::default(),
            ground_m: None,
            load_n: 0.0,
            across_n: 0.0,
        };
        VehicleState {
            wheels: vec![wheel; model.wheels.len()],
            drivetrain: Drivetrain::new(model),
            steer_rad: 0.0,
            control: Pedals::default(),
        }
    }
}

/// A spin after a brake has taken up to `most` from it, towards 0.
#[inline]
fn braked(spin_radps: f32, most: f32) -> f32 {
    spin_radps - spin_radps.clamp(-most, most)
}

/// Linear between the pairs, constant beyond them.
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
