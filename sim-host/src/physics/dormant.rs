//! Dormant vehicles: those that hybrid physics moves by a kinematic model.
//!
//! A dormant vehicle is far from everything that observes it ([`Physics::set_dormant`]). It has the
//! pedals, the gears and the brakes of its full model, but its tyres do not slip and its suspension
//! does not move: a single-track model with the yaw rate of the linear bicycle model
//! ([`StabilityModel::steady_yaw_radps`]) turns it, and its attitude follows the plane through the
//! ground under its wheels. It passes through other bodies, except walkers, which it pushes aside or
//! knocks down. Its body is disabled in the rigid-body world and always holds its pose and
//! velocity, so a vehicle continues from both when it becomes dormant, and when it ceases to be.
//!
//! [`StabilityModel::steady_yaw_radps`]: super::stability::StabilityModel

use glam::{Mat3, Quat, Vec3};
use protocol::ActorId;
use rapier3d::prelude::Pose;

use super::{
    actor::Kind,
    body_state::BodyState,
    drivetrain::Demand,
    error::PhysicsError,
    mark,
    model::GRAVITY_MPS2,
    motion::Twist,
    stability::LAG_S,
    vehicle::{Prepared, Vehicle, VehicleState},
    wheels::Surface,
    world::Physics,
};

/// Time in which the height and the attitude approach those over the ground.
const SETTLE_S: f32 = 0.1;
/// Time in which the tyres stop to slip aside.
const GRIP_S: f32 = 0.05;
/// Speed from which on the yaw rate lags behind the steering as that of a car.
const LAG_FROM_MPS: f32 = 4.0;
/// Limits of the motion of a vehicle that may become dormant: it drives on its wheels.
const UPRIGHT_MIN: f32 = 0.85;
const VERTICAL_MAX_MPS: f32 = 1.0;
const ASIDE_MAX_MPS: f32 = 0.5;
/// Fraction of the weight that its wheels carry at least.
const CARRIED_MIN: f32 = 0.7;

impl Physics {
    /// Selects whether a vehicle is dormant: whether a kinematic model moves it, without contacts.
    /// Nothing happens to an actor that is no vehicle, that is kinematic, drives by a target speed
    /// or has open doors, or whose wheels do not carry it: it is not dormant.
    ///
    /// # Errors
    ///
    /// The actor does not exist.
    pub fn set_dormant(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        if self.actors[index].dormant == on || on && !self.may_be_dormant(index) {
            return Ok(());
        }
        let actor = self.actors.wake(index);
        actor.dormant = on;
        self.set_mark(index, mark::DORMANT, on);
        Ok(())
    }

    /// Whether an actor is a dormant vehicle.
    pub fn is_dormant(&self, id: ActorId) -> bool {
        self.find(id).is_ok_and(|index| self.actors[index].dormant)
    }

    fn may_be_dormant(&self, index: usize) -> bool {
        let actor = &self.actors[index];
        let Kind::Vehicle(vehicle) = &actor.kind else { return false };
        let BodyState { pose, velocity } = BodyState::of(self.body(actor));
        let axes = Mat3::from_quat(pose.rotation);
        let weight_n = vehicle.prepared.model.mass_kg * GRAVITY_MPS2;
        !actor.kinematic
            && !actor.gravity_disabled
            && vehicle.state.doors.is_empty()
            && vehicle.state.ackermann.is_none()
            && axes.z_axis.z > UPRIGHT_MIN
            && velocity.linear_mps.dot(axes.z_axis).abs() < VERTICAL_MAX_MPS
            && velocity.linear_mps.dot(axes.y_axis).abs() < ASIDE_MAX_MPS
            && vehicle.load_n() > CARRIED_MIN * weight_n
    }

    pub(super) fn set_mark(&mut self, index: usize, mark: u128, on: bool) {
        let body = &self.world.bodies[self.actors[index].body];
        let marks = if on { body.user_data | mark } else { body.user_data & !mark };
        if marks != body.user_data {
            let handle = self.actors.wake(index).body;
            self.world.bodies[handle].user_data = marks;
        }
    }

    /// Notes that a sensor bundle was mounted on an actor. Traffic lights have no body, and nothing
    /// is noted.
    pub fn mark_carrier(&mut self, id: ActorId) {
        if let Ok(index) = self.find(id) {
            self.set_mark(index, mark::CARRIER, true);
        }
    }

    /// Notes whether a client drives a vehicle.
    pub fn mark_driven(&mut self, id: ActorId, on: bool) {
        if let Ok(index) = self.find(id) {
            self.set_mark(index, mark::DRIVEN, on);
        }
    }

    /// Returns for every actor, by id: the id, the position, whether it is dormant, whether it
    /// carries sensors, and whether a client has driven it.
    pub fn observers(&self) -> impl Iterator<Item = (ActorId, Vec3, [bool; 3])> + '_ {
        self.actors.iter().map(|actor| {
            let body = self.body(actor);
            let is = |mark: u128| body.user_data & mark != 0;
            let marks = [actor.dormant, is(mark::CARRIER), is(mark::DRIVEN)];
            (ActorId(actor.id), body.translation(), marks)
        })
    }
}

impl Vehicle {
    /// Advances a dormant vehicle by `dt` seconds: a frame. `com_m` is the centre of mass in body
    /// axes.
    pub(super) fn advance_dormant(
        &mut self,
        surface: &Surface,
        start: &BodyState,
        com_m: Vec3,
        dt: f32,
    ) -> BodyState {
        let axes = Mat3::from_quat(start.pose.rotation);
        let local = axes.transpose() * start.velocity.linear_mps;
        let yaw_radps = start.velocity.angular_radps.dot(axes.z_axis);
        let rear_x_m = self.prepared.rear_x_m;
        let (forward, aside) = (local.x, local.y - yaw_radps * (com_m.x - rear_x_m));

        let Vehicle { prepared, state, .. } = self;
        let model = &*prepared.model;
        state.steer(prepared, forward, surface.grip, dt);
        state.counter_steer_rad = 0.0;
        let next = next_speed(prepared, state, forward, axes.x_axis.z, surface.grip, dt);
        let steady = prepared.stability.steady_yaw_radps(state.steer_rad, next, surface.grip);
        let lag_s = LAG_S * (next.abs() / LAG_FROM_MPS).min(1.0);
        let next_yaw_radps = yaw_radps + (steady - yaw_radps) * dt / (lag_s + dt);
        let next_aside = aside * GRIP_S / (GRIP_S + dt);
        state.stability.set_reference(next_yaw_radps);

        // The middle of the turning line moves along the mean heading.
        let turn_rad = 0.5 * (yaw_radps + next_yaw_radps) * dt;
        let half = Quat::from_axis_angle(axes.z_axis, 0.5 * turn_rad);
        let [ahead, left] = [half * axes.x_axis, half * axes.y_axis];
        let way = (ahead * (0.5 * (forward + next)) + left * (0.5 * (aside + next_aside))) * dt;
        let from = start.pose.translation;
        let heading = half * ahead;
        let to = from + axes.x_axis * rear_x_m + way - heading * rear_x_m;

        // The way follows the slope, and what is left of the distance to the ground shrinks.
        let leans = if model.lean.is_some() { 1.0 / GRAVITY_MPS2 } else { 0.0 };
        let lean = next_yaw_radps * next * leans;
        let keep = SETTLE_S / (SETTLE_S + dt);
        let (height_m, upright) = prepared.kinematic.plane_below(surface.ground, to, heading);
        let z = height_m + (to.z - height_m) * keep;
        let leaning = (upright + upright.cross(heading) * lean).normalize_or(Vec3::Z);
        let up = (leaning + (axes.z_axis - leaning) * keep).normalize_or(Vec3::Z);
        let left = up.cross(heading).normalize_or(axes.y_axis);
        let turned = Mat3::from_cols(left.cross(up), left, up);
        let rotation = Quat::from_mat3(&turned).normalize();

        let across = next_aside + next_yaw_radps * (com_m.x - rear_x_m);
        let linear_mps = turned * Vec3::new(next, across, 0.0);
        let velocity = Twist { linear_mps, angular_radps: up * next_yaw_radps };
        self.roll_without_slip(next);
        self.advance_angles(dt);
        BodyState { pose: Pose::from_parts(to.with_z(z), rotation), velocity }
    }
}

/// Returns the forward speed after `dt` seconds. `rise` is the z of the forward axis.
fn next_speed(
    prepared: &Prepared,
    state: &mut VehicleState,
    forward: f32,
    rise: f32,
    grip: f32,
    dt: f32,
) -> f32 {
    let (model, kinematic) = (&*prepared.model, &prepared.kinematic);
    let pedals = state.control;
    let wheel_radps = forward / kinematic.radius_m;
    let demand =
        Demand { throttle: pedals.throttle, reverse: pedals.reverse, manual: pedals.manual };
    state.drivetrain.shift(model, demand, wheel_radps, forward, dt);
    let drive = state.drivetrain.steady(model, wheel_radps);
    let grip_n = kinematic.grip_n * grip;
    let inertia_kg = drive.inertia_kgm2 / (kinematic.radius_m * kinematic.radius_m);
    let mass_kg = model.mass_kg + kinematic.rotating_kg + inertia_kg;
    let pull_n = (drive.torque_nm / kinematic.radius_m).clamp(-grip_n, grip_n)
        - kinematic.drag_nspm2 * forward * forward.abs()
        - model.mass_kg * GRAVITY_MPS2 * rise;
    let handbrake_n = if pedals.handbrake { kinematic.handbrake_n } else { 0.0 };
    let hold_n = (kinematic.brake_n * pedals.brake + handbrake_n).min(grip_n) + kinematic.rolling_n;
    let free = forward + pull_n / mass_kg * dt;
    let held = hold_n / mass_kg * dt;
    free - free.clamp(-held, held)
}
