//! The physics of vehicles: parameters, controllers, forces and telemetry.
//!
//! What the numbers of a `VehiclePhysicsControl` mean is in [`crate::physics_control`].

use client_lib::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, VehiclePhysics, VehicleWheel,
    carla_axes::degrees,
    wire::{Command, Switch},
};
use glam::Vec3;

use crate::{
    args::{Args, RpcError},
    bridge::Bridge,
    calls::call::Call,
    physics_control::{FRICTION, PhysicsControl, reported, wheel_of},
    proxy_actors::ProxyActors,
    shared_bridge::LockedBridge,
    wire::{flip_turn, location},
};

pub(super) fn control(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.vehicle("get_physics_control", id)?;
    let physics = call.bridge.physics_of(id)?;
    let pose = call.bridge.actor_state(id).map(|state| state.pose).unwrap_or_default();
    // Conversions to our units round: a client reads the numbers that were set as long as they hold.
    let given = call.bridge.episode.vehicles.physics(id);
    let holds = |given: &&PhysicsControl| given.applied_to(&physics).is_ok_and(|p| p == physics);
    match given.filter(holds) {
        Some(given) => given.write(&physics, &pose, call.out),
        None => PhysicsControl::of(&physics).write(&physics, &pose, call.out),
    }
    Ok(())
}

pub(super) fn apply_control(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.set_physics(id, &mut call.args)
}

pub(super) fn telemetry(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.vehicle("get_telemetry_data", id)?;
    call.bridge.flush_and_wait()?;
    let (vehicle, wheels) = call.bridge.query(|queries| queries.telemetry(ActorId(id)))?;
    let out = &mut *call.out;
    let count = reported(wheels.len());
    // Two of CARLA's wheels share the load and the forces of one wheel of a two-wheeler.
    let part = wheels.len() as f32 / count.max(1) as f32;
    out.list(8).f32(vehicle.speed_mps).f32(-vehicle.steer).f32(vehicle.throttle);
    out.f32(vehicle.brake).f32(vehicle.engine_rpm).int(vehicle.gear.into());
    out.f32(vehicle.drag_n).list(count);
    for wheel in (0..count).map(|index| &wheels[wheel_of(index, wheels.len())]) {
        let per_load = |force: f32| if wheel.load_n > 0.0 { force / wheel.load_n } else { 0.0 };
        let across_n = -wheel.across_n;
        out.list(11).f32(wheel.grip * FRICTION).f32(-wheel.slip_y_rad).f32(wheel.slip_x);
        out.f32(wheel.spin_radps).f32(part * wheel.load_n);
        out.f32(wheel.load_n / wheel.rest_load_n.max(1.0));
        out.f32(part * wheel.torque_nm).f32(part * wheel.along_n).f32(part * across_n);
        out.f32(per_load(wheel.along_n)).f32(per_load(across_n));
    }
    Ok(())
}

/// Returns the steering angle of a wheel. Degrees, positive to the right.
pub(super) fn wheel_angle(call: &mut Call) -> Result<(), RpcError> {
    let (id, wheel) = (call.args.u32()?, call.args.u32()?);
    let wheels = call.bridge.vehicle("get_wheel_steer_angle", id)?.wheels.len();
    call.bridge.flush_and_wait()?;
    let (_, all) = call.bridge.query(|queries| queries.telemetry(ActorId(id)))?;
    // CARLA's `Front_Wheel` and `Back_Wheel` of a two-wheeler are 0 and 1.
    let index = if wheels == 2 { wheel.min(1) } else { wheel };
    let angle_rad = all.get(index as usize).map_or(0.0, |wheel| -wheel.steer_rad);
    call.out.f32(degrees(angle_rad.into()));
    Ok(())
}

pub(super) fn ackermann(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.apply_ackermann(id, &mut call.args)
}

pub(super) fn ackermann_settings(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.vehicle("get_ackermann_controller_settings", id)?;
    call.bridge.flush_and_wait()?;
    let settings = call.bridge.query(|queries| queries.ackermann_settings(ActorId(id)))?;
    call.out.list(6);
    for gain in settings.speed.iter().chain(&settings.acceleration) {
        call.out.f32(*gain);
    }
    Ok(())
}

pub(super) fn set_ackermann_settings(call: &mut Call) -> Result<(), RpcError> {
    let actor_id = ActorId(call.args.u32()?);
    let mut gains = call.args.list()?;
    let mut three = || Ok::<_, RpcError>([gains.f32()?, gains.f32()?, gains.f32()?]);
    let settings = AckermannSettings { actor_id, speed: three()?, acceleration: three()? };
    call.bridge.request_one("Ackermann settings", Command::SetAckermann(settings)).map(drop)
}

pub(super) fn impulse(call: &mut Call) -> Result<(), RpcError> {
    apply_force(call, 0)
}

pub(super) fn force(call: &mut Call) -> Result<(), RpcError> {
    apply_force(call, 1)
}

fn apply_force(call: &mut Call, is_force: u32) -> Result<(), RpcError> {
    let (id, linear) = (call.args.u32()?, location(&mut call.args)?);
    let at = if call.args.len() > 0 { Some(location(&mut call.args)?) } else { None };
    call.bridge.apply_force(id, is_force, linear, at)
}

pub(super) fn angular_impulse(call: &mut Call) -> Result<(), RpcError> {
    let (id, impulse) = (call.args.u32()?, call.args.vector()?);
    call.bridge.apply_torque(id, 0, impulse)
}

pub(super) fn torque(call: &mut Call) -> Result<(), RpcError> {
    let (id, torque) = (call.args.u32()?, call.args.vector()?);
    call.bridge.apply_torque(id, 1, torque)
}

/// Sets the acceleration that inertial sensors at rest measure. Metres per second squared.
pub(super) fn imu_gravity(call: &mut Call) -> Result<(), RpcError> {
    let mps2 = call.args.f32()?;
    if !(-1000.0..=1000.0).contains(&mps2) {
        return Err(format!("gravity is {mps2}, must be -1000 to 1000").into());
    }
    call.bridge.set_imu_gravity(mps2);
    Ok(())
}

pub(super) fn gravity(call: &mut Call) -> Result<(), RpcError> {
    let (id, on) = (call.args.u32()?, call.args.bool()?);
    call.bridge.set_gravity(id, on)
}

pub(super) fn collisions(call: &mut Call) -> Result<(), RpcError> {
    let (id, on) = (call.args.u32()?, call.args.bool()?);
    if ProxyActors::is_proxy(id) {
        return Ok(());
    }
    let switch = Switch { actor_id: ActorId(id), on: on.into() };
    call.bridge.request_one("collisions", Command::SetCollisions(switch)).map(drop)
}

impl LockedBridge<'_> {
    fn physics_of(&mut self, id: u32) -> Result<VehiclePhysics, RpcError> {
        self.flush_and_wait()?;
        self.query(|queries| queries.vehicle_physics(ActorId(id)))
    }

    /// Applies a `VehiclePhysicsControl`.
    ///
    /// # Errors
    ///
    /// Returns an error if a value is invalid or the number of wheels differs from the blueprint's.
    pub(crate) fn set_physics(&mut self, id: u32, args: &mut Args) -> Result<(), RpcError> {
        self.vehicle("apply_physics_control", id)?;
        let given = PhysicsControl::read(args)?;
        let physics = given.applied_to(&self.physics_of(id)?)?;
        physics.check()?;
        let outcomes = self.request("physics control", &physics.commands(ActorId(id)))?;
        outcomes
            .iter()
            .try_for_each(|entry| entry.outcome.result().map(drop).map_err(RpcError::from))?;
        self.episode.vehicles.set_physics(id, given);
        Ok(())
    }

    /// Gives vehicles that have entered or left a friction trigger the friction that holds there.
    pub(crate) fn update_friction(&mut self) {
        let Bridge { client, episode, .. } = &mut **self;
        for (vehicle, trigger) in episode.friction.changes(client.world(), client.blueprints()) {
            if let Err(why) = self.set_friction(vehicle, trigger) {
                log::warn!("the friction of vehicle {vehicle} is not set: {why:?}");
            }
        }
    }

    fn set_friction(&mut self, vehicle: u32, trigger: Option<u32>) -> Result<(), RpcError> {
        let actor_id = ActorId(vehicle);
        let mut wheels = self.query(|queries| queries.vehicle_physics(actor_id))?.wheels;
        self.episode.friction.apply(vehicle, trigger, &mut wheels);
        let of = |(index, wheel)| Command::SetWheel(VehicleWheel { actor_id, index, ..wheel });
        let commands: Vec<Command> = (0..).zip(wheels).map(of).collect();
        self.request("friction", &commands)?
            .iter()
            .try_for_each(|entry| entry.outcome.result().map(drop).map_err(RpcError::from))
    }

    /// Applies a `VehicleAckermannControl`, whose steering is positive to the right.
    pub(crate) fn apply_ackermann(&mut self, id: u32, args: &mut Args) -> Result<(), RpcError> {
        self.vehicle("apply_ackermann_control_to_vehicle", id)?;
        let mut f = args.list()?;
        let control = AckermannControl {
            actor_id: ActorId(id),
            steer_rad: -f.f32()?,
            steer_radps: f.f32()?,
            speed_mps: f.f32()?,
            acceleration_mps2: f.f32()?,
            jerk_mps3: f.f32()?,
        };
        self.request_one("Ackermann control", Command::Ackermann(control)).map(drop)
    }

    /// Applies an impulse in newton seconds, or a force in newtons for the next frame.
    pub(crate) fn apply_force(
        &mut self,
        id: u32,
        is_force: u32,
        linear: Vec3,
        at: Option<Vec3>,
    ) -> Result<(), RpcError> {
        let push = ApplyForce {
            actor_id: ActorId(id),
            is_force,
            linear: linear.to_array(),
            has_point: at.is_some().into(),
            at_m: at.unwrap_or_default().to_array(),
            ..ApplyForce::default()
        };
        self.request_one("push", Command::ApplyForce(push)).map(drop)
    }

    /// Applies an angular impulse in newton metre seconds, or a torque in newton metres for the
    /// next frame, in CARLA's axes.
    pub(crate) fn apply_torque(
        &mut self,
        id: u32,
        is_force: u32,
        angular: [f32; 3],
    ) -> Result<(), RpcError> {
        let angular = flip_turn(angular);
        let push = ApplyForce { actor_id: ActorId(id), is_force, angular, ..ApplyForce::default() };
        self.request_one("twist", Command::ApplyForce(push)).map(drop)
    }

    /// Sets whether gravity acts on an actor.
    pub(crate) fn set_gravity(&mut self, id: u32, on: bool) -> Result<(), RpcError> {
        if ProxyActors::is_proxy(id) {
            return Ok(());
        }
        let switch = Switch { actor_id: ActorId(id), on: on.into() };
        self.request_one("gravity", Command::SetGravity(switch)).map(drop)
    }
}
