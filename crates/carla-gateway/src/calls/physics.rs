//! The physics of vehicles: parameters, controllers, forces and telemetry.
//!
//! Numbers are CARLA's where their meaning is the same: degrees, centimetres, newton metres.
//! CARLA's default friction, 3.5, is the friction of the blueprint's tyre. Clutch strength is the
//! torque of the clutch at a slip of 50 rad/s.

use client_lib::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Curve, Gear, VehiclePhysics,
    VehicleWheel,
    wire::{Command, Switch},
};
use glam::Vec3;

use crate::{
    args::{Args, RpcError},
    calls::call::Call,
    msgpack::Pack,
    proxy_actors::ProxyActors,
    shared_bridge::LockedBridge,
    wire::{flip, flip_turn, location},
};

/// CARLA's default friction.
const FRICTION: f32 = 3.5;
/// The slip at which clutch strength is measured. Radians per second.
const CLUTCH_SLIP_RADPS: f32 = 50.0;
const KMH_PER_MPS: f32 = 3.6;

pub(super) fn control(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.vehicle("get_physics_control", id)?;
    let physics = call.bridge.physics_of(id)?;
    let pose = call.bridge.actor_state(id).map(|state| state.pose).unwrap_or_default();
    let out = &mut *call.out;
    out.list(17);
    write_pairs(out, physics.engine.torque.pairs(), 1.0);
    let engine = &physics.engine;
    out.f32(engine.max_rpm).f32(engine.inertia_kgm2).f32(engine.damping_full_nmsprad);
    out.f32(engine.damping_geared_nmsprad).f32(engine.damping_neutral_nmsprad);
    let gearbox = &physics.gearbox;
    out.bool(gearbox.automatic != 0).f32(gearbox.shift_s);
    out.f32(gearbox.clutch_nm / CLUTCH_SLIP_RADPS).f32(gearbox.final_drive);
    out.list(gearbox.gears().len());
    for gear in gearbox.gears() {
        out.list(3).f32(gear.ratio).f32(gear.down).f32(gear.up);
    }
    let body = &physics.body;
    out.f32(body.mass_kg).f32(body.drag_coefficient).vector(flip(body.center_of_mass_m));
    write_pairs(out, physics.steering.share.pairs(), KMH_PER_MPS);
    out.list(physics.wheels.len());
    let carried_kg = mass_per_wheel_kg(&physics);
    for wheel in &physics.wheels {
        let at = pose.affine().transform_point3(Vec3::from_array(wheel.hub_m)) * 100.0;
        out.list(10).f32(wheel.grip * FRICTION).f32(wheel.damping_nmsprad);
        out.f32(wheel.steer_max_rad.to_degrees()).f32(wheel.radius_m * 100.0);
        out.f32(wheel.brake_torque_nm).f32(wheel.handbrake_torque_nm);
        out.f32(wheel.stiff_load).f32(wheel.stiffness_y).f32(wheel.stiffness_x * carried_kg);
        // Centimetres, unlike all other positions of this struct.
        out.vector(flip(at.to_array()));
    }
    out.bool(body.sweep != 0);
    Ok(())
}

/// Returns the mass that each wheel carries: CARLA's longitudinal stiffness is per unit of gravity.
fn mass_per_wheel_kg(physics: &VehiclePhysics) -> f32 {
    physics.body.mass_kg / physics.wheels.len().max(1) as f32
}

fn write_pairs(out: &mut Pack, pairs: &[[f32; 2]], scale: f32) {
    out.list(pairs.len());
    for [x, y] in pairs {
        out.list(2).f32(x * scale).f32(*y);
    }
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
    out.list(8).f32(vehicle.speed_mps).f32(-vehicle.steer).f32(vehicle.throttle);
    out.f32(vehicle.brake).f32(vehicle.engine_rpm).int(vehicle.gear.into());
    out.f32(vehicle.drag_n).list(wheels.len());
    for wheel in &wheels {
        let per_load = |force: f32| if wheel.load_n > 0.0 { force / wheel.load_n } else { 0.0 };
        let across_n = -wheel.across_n;
        out.list(11).f32(wheel.grip * FRICTION).f32(-wheel.slip_y_rad).f32(wheel.slip_x);
        out.f32(wheel.spin_radps).f32(wheel.load_n).f32(wheel.load_n / wheel.rest_load_n.max(1.0));
        out.f32(wheel.torque_nm).f32(wheel.along_n).f32(across_n);
        out.f32(per_load(wheel.along_n)).f32(per_load(across_n));
    }
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

fn pairs(args: &mut Args, what: &str, scale: f32) -> Result<Curve, RpcError> {
    let mut list = args.list()?;
    let mut pairs = Vec::new();
    while list.len() > 0 {
        let mut pair = list.list()?;
        pairs.push([pair.f32()? * scale, pair.f32()?]);
    }
    let many = || format!("{what} has {} points; the limit is 16", pairs.len());
    Ok(Curve::new(&pairs).ok_or_else(many)?)
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
        let mut physics = self.physics_of(id)?;
        let mut f = args.list()?;
        let engine = &mut physics.engine;
        engine.torque = pairs(&mut f, "torque_curve", 1.0)?;
        (engine.max_rpm, engine.inertia_kgm2) = (f.f32()?, f.f32()?);
        engine.damping_full_nmsprad = f.f32()?;
        engine.damping_geared_nmsprad = f.f32()?;
        engine.damping_neutral_nmsprad = f.f32()?;
        let gearbox = &mut physics.gearbox;
        (gearbox.automatic, gearbox.shift_s) = (f.bool()?.into(), f.f32()?);
        (gearbox.clutch_nm, gearbox.final_drive) = (f.f32()? * CLUTCH_SLIP_RADPS, f.f32()?);
        let mut list = f.list()?;
        let mut gears = Vec::new();
        while list.len() > 0 {
            let mut gear = list.list()?;
            gears.push(Gear { ratio: gear.f32()?, down: gear.f32()?, up: gear.f32()? });
        }
        let many = || format!("there are {} forward_gears; the limit is 12", gears.len());
        *gearbox = gearbox.with_gears(&gears).ok_or_else(many)?;
        (physics.body.mass_kg, physics.body.drag_coefficient) = (f.f32()?, f.f32()?);
        physics.body.center_of_mass_m = flip(f.vector()?);
        physics.steering.share = pairs(&mut f, "steering_curve", 1.0 / KMH_PER_MPS)?;
        let mut wheels = f.list()?;
        let count = physics.wheels.len();
        if wheels.len() != count {
            return Err(format!(
                "there are {} wheels in the physics control, but the vehicle has {count}",
                wheels.len()
            )
            .into());
        }
        let carried_kg = mass_per_wheel_kg(&physics).max(1e-3);
        for wheel in &mut physics.wheels {
            let mut w = wheels.list()?;
            *wheel = VehicleWheel {
                grip: w.f32()? / FRICTION,
                damping_nmsprad: w.f32()?,
                steer_max_rad: w.f32()?.to_radians(),
                radius_m: w.f32()? / 100.0,
                brake_torque_nm: w.f32()?,
                handbrake_torque_nm: w.f32()?,
                stiff_load: w.f32()?,
                stiffness_y: w.f32()?,
                stiffness_x: w.f32()? / carried_kg,
                // The position of the wheel is that of the blueprint.
                ..*wheel
            };
        }
        physics.body.sweep = f.bool()?.into();
        physics.check()?;
        let outcomes = self.request("physics control", &physics.commands(ActorId(id)))?;
        outcomes
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
