use glam::Vec3;
use protocol::{ActorId, Curve, VehicleControl, VehiclePhysics};

use super::Lone;
use crate::physics::{PhysicsError, VehicleModel, tuning};

const ID: ActorId = ActorId(1);

/// A sedan with changed parameters.
fn with(change: impl FnOnce(&mut VehiclePhysics)) -> Lone {
    let mut lone = Lone::sedan();
    let mut physics = lone.physics.vehicle_physics(ID).unwrap();
    change(&mut physics);
    lone.physics.set_vehicle_physics(ID, &physics).unwrap();
    lone.run(0.5);
    lone
}

/// Returns the speed after some seconds of full throttle. Metres per second.
fn sprint(lone: &mut Lone, seconds: f32) -> f32 {
    lone.control.throttle = 1.0;
    lone.run(seconds);
    lone.control.throttle = 0.0;
    lone.speed()
}

/// Returns the stopping distance from 20 m/s. Metres.
fn stop(lone: &mut Lone) -> f32 {
    lone.physics.set_velocity(ID, Vec3::X * 20.0, Vec3::ZERO).unwrap();
    let from = lone.position();
    lone.control.brake = 1.0;
    lone.run(15.0);
    lone.control.brake = 0.0;
    (lone.position() - from).length()
}

/// Returns the yaw rate at 10 m/s with half steering. Radians per second.
fn turn(lone: &mut Lone) -> f32 {
    lone.physics.set_velocity(ID, Vec3::X * 10.0, Vec3::ZERO).unwrap();
    lone.control.steer = 0.5;
    lone.run(0.6);
    lone.control.steer = 0.0;
    lone.state().angular_velocity_radps[2]
}

#[test]
fn setting_unchanged_parameters_changes_nothing() {
    let own = VehicleModel::sedan();
    assert_eq!(tuning::tuned_model(&own, &tuning::physics_of(&own)), own);
    let mut lone = Lone::sedan();
    let physics = lone.physics.vehicle_physics(ID).unwrap();
    lone.physics.set_vehicle_physics(ID, &physics).unwrap();
    assert_eq!(lone.physics.vehicle_physics(ID).unwrap(), physics);
    let mut other = Lone::sedan();
    for lone in [&mut lone, &mut other] {
        lone.control.steer = 0.2;
        sprint(lone, 3.0);
    }
    assert_eq!(lone.state(), other.state());
}

#[test]
fn changed_parameters_are_returned_and_saved() {
    let mut physics = with(|_| {}).physics.vehicle_physics(ID).unwrap();
    physics.body.mass_kg = 2345.0;
    physics.body.center_of_mass_m = [0.1, -0.02, 0.05];
    physics.engine.torque = Curve::new(&[[0.0, 100.0], [5000.0, 300.0]]).unwrap();
    physics.wheels[2].grip = 0.4;
    let mut lone = with(|p| *p = physics.clone());
    assert_eq!(lone.physics.vehicle_physics(ID).unwrap(), physics);
    let (bytes, hash) = (lone.physics.save(), lone.physics.hash());
    sprint(&mut lone, 2.0);
    let state = lone.state();
    lone.physics.restore(&bytes).unwrap();
    assert_eq!(lone.physics.hash(), hash);
    assert_eq!(lone.physics.vehicle_physics(ID).unwrap(), physics);
    sprint(&mut lone, 2.0);
    assert_eq!(lone.state(), state);
}

#[test]
fn the_hash_depends_on_vehicle_parameters() {
    let mut lone = Lone::sedan();
    let before = lone.physics.hash();
    let mut physics = lone.physics.vehicle_physics(ID).unwrap();
    physics.gearbox.shift_s *= 2.0;
    lone.physics.set_vehicle_physics(ID, &physics).unwrap();
    assert_ne!(lone.physics.hash(), before);
}

#[test]
fn each_parameter_of_the_drivetrain_has_an_effect() {
    let plain = sprint(&mut with(|_| {}), 4.0);
    let is_slower = |what: &str, change: fn(&mut VehiclePhysics)| {
        let mps = sprint(&mut with(change), 4.0);
        println!("{what}: {mps:.2} m/s instead of {plain:.2}");
        assert!(mps < 0.97 * plain, "{what}: {mps} m/s, unchanged {plain} m/s");
    };
    is_slower("twice the mass", |p| p.body.mass_kg *= 2.0);
    is_slower("half the torque", |p| {
        let half: Vec<_> = p.engine.torque.pairs().iter().map(|[x, y]| [*x, 0.5 * y]).collect();
        p.engine.torque = Curve::new(&half).unwrap();
    });
    is_slower("an early limiter", |p| p.engine.max_rpm = 2000.0);
    is_slower("a heavy flywheel", |p| p.engine.inertia_kgm2 *= 15.0);
    is_slower("a dragging engine", |p| p.engine.damping_full_nmsprad = 0.5);
    is_slower("slow shifts", |p| p.gearbox.shift_s = 2.0);
    is_slower("a weak clutch", |p| p.gearbox.clutch_nm = 60.0);
    is_slower("a long final drive", |p| p.gearbox.final_drive *= 0.4);
    is_slower("one long gear", |p| {
        let mut gear = p.gearbox.gears()[5];
        gear.ratio = 0.6;
        p.gearbox = p.gearbox.with_gears(&[gear]).unwrap();
    });
    is_slower("dragging bearings", |p| p.wheels.iter_mut().for_each(|w| w.damping_nmsprad = 5.0));
    is_slower("ice", |p| p.wheels.iter_mut().for_each(|w| w.grip = 0.1));
    is_slower("a parachute", |p| p.body.drag_coefficient = 10.0);
}

#[test]
fn engine_braking_grows_with_engine_damping() {
    let coast = |change: fn(&mut VehiclePhysics)| {
        let mut lone = with(change);
        sprint(&mut lone, 4.0);
        let before = lone.speed();
        lone.run(2.0);
        before - lone.speed()
    };
    let (plain, strong) = (coast(|_| {}), coast(|p| p.engine.damping_geared_nmsprad = 0.5));
    assert!(strong > 1.3 * plain, "lost {strong} m/s, unchanged {plain} m/s");
}

#[test]
fn engine_speed_in_neutral_is_limited_by_damping() {
    let rpm = |change: fn(&mut VehiclePhysics)| {
        let mut lone = with(change);
        (lone.control.manual_gear, lone.control.gear) = (1, 0);
        lone.control.throttle = 1.0;
        lone.run(3.0);
        lone.control.throttle = 0.0;
        lone.run(0.3);
        lone.state().engine_rpm
    };
    let (plain, strong) = (rpm(|_| {}), rpm(|p| p.engine.damping_neutral_nmsprad = 1.0));
    assert!(strong < 0.8 * plain, "{strong} rpm, unchanged {plain}");
}

#[test]
fn gears_shift_at_their_shift_points() {
    let gear = |change: fn(&mut VehiclePhysics)| {
        let mut lone = with(change);
        lone.control.throttle = 0.5;
        lone.run(8.0);
        println!("{} m/s, {} rpm", lone.speed(), lone.state().engine_rpm);
        lone.state().gear
    };
    let late = |p: &mut VehiclePhysics| {
        p.gearbox.forward.iter_mut().for_each(|gear| (gear.down, gear.up) = (0.1, 0.98));
    };
    let manual = |p: &mut VehiclePhysics| p.gearbox.automatic = 0;
    let (plain, late, manual) = (gear(|_| {}), gear(late), gear(manual));
    assert!(late < plain && manual == 1, "late {late}, by hand {manual}, unchanged {plain}");
}

#[test]
fn each_parameter_of_brakes_and_tyres_has_an_effect() {
    let plain = stop(&mut with(|_| {}));
    let is_longer = |what: &str, change: fn(&mut VehiclePhysics)| {
        let meters = stop(&mut with(change));
        println!("{what}: {meters:.2} m instead of {plain:.2}");
        assert!(meters > 1.1 * plain, "{what}: {meters} m, unchanged {plain} m");
    };
    is_longer("weak brakes", |p| p.wheels.iter_mut().for_each(|w| w.brake_torque_nm *= 0.5));
    is_longer("half the grip", |p| p.wheels.iter_mut().for_each(|w| w.grip = 0.5));
    is_longer("soft tyres", |p| p.wheels.iter_mut().for_each(|w| w.stiffness_x = 0.6));
    let mut parked = with(|p| p.wheels.iter_mut().for_each(|w| w.handbrake_torque_nm = 0.0));
    parked.control.flags = protocol::flag::HANDBRAKE;
    assert!(sprint(&mut parked, 2.0) > 3.0, "it has no handbrake");
}

#[test]
fn each_parameter_of_the_steering_has_an_effect() {
    let plain = turn(&mut with(|_| {}));
    let is_wider = |what: &str, change: fn(&mut VehiclePhysics)| {
        let rate = turn(&mut with(change));
        println!("{what}: {rate:.3} rad/s instead of {plain:.3}");
        assert!(rate < 0.93 * plain, "{what}: {rate} rad/s, unchanged {plain} rad/s");
    };
    is_wider("little lock", |p| {
        p.wheels.iter_mut().for_each(|w| w.steer_max_rad = w.steer_max_rad.min(0.3));
    });
    is_wider("a flat curve", |p| p.steering.share = Curve::new(&[[0.0, 0.5]]).unwrap());
    is_wider("soft front tyres", |p| p.wheels[..2].iter_mut().for_each(|w| w.stiffness_y = 4.0));
    is_wider("early saturation", |p| p.wheels[..2].iter_mut().for_each(|w| w.stiff_load = 0.3));
    is_wider("a nose-heavy car", |p| p.body.center_of_mass_m = [1.2, 0.0, 0.0]);
}

#[test]
fn larger_wheels_lift_the_body() {
    let mut lone = with(|p| p.wheels.iter_mut().for_each(|w| w.radius_m += 0.1));
    lone.run(2.0);
    assert!((lone.position().z - 0.1).abs() < 0.02, "{}", lone.position());
}

#[test]
fn a_car_with_changed_parameters_stays_stable() {
    let mut lone = with(|p| {
        p.body.mass_kg = 9000.0;
        p.body.center_of_mass_m = [0.3, 0.1, -0.1];
    });
    lone.run(3.0);
    let up = lone.rotation() * Vec3::Z;
    assert!(lone.speed() < 1e-2 && up.z > 0.99, "{} m/s, up {up}", lone.speed());
    assert!(lone.position().z.abs() < 0.05, "{}", lone.position());
}

#[test]
fn invalid_parameters_are_refused_and_change_nothing() {
    let mut lone = Lone::sedan();
    let good = lone.physics.vehicle_physics(ID).unwrap();
    let hash = lone.physics.hash();
    let mut refused = |what: &str, change: &dyn Fn(&mut VehiclePhysics)| {
        let mut bad = good.clone();
        change(&mut bad);
        let why = lone.physics.set_vehicle_physics(ID, &bad).unwrap_err();
        assert!(why.to_string().contains(what), "{why}, not about {what}");
        assert_eq!(lone.physics.hash(), hash, "{what}");
    };
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e30] {
        refused("mass_kg", &|p| p.body.mass_kg = number);
        refused("drag_coefficient", &|p| p.body.drag_coefficient = number);
        refused("max_rpm", &|p| p.engine.max_rpm = number);
        refused("inertia_kgm2", &|p| p.engine.inertia_kgm2 = number);
        refused("damping_nmsprad", &|p| p.engine.damping_neutral_nmsprad = number);
        refused("torque curve", &|p| p.engine.torque.points[1] = [number, 1.0]);
        refused("torque curve", &|p| p.engine.torque.points[1][1] = number);
        refused("clutch_nm", &|p| p.gearbox.clutch_nm = number);
        refused("gear", &|p| p.gearbox.forward[0].ratio = number);
        refused("steering curve", &|p| p.steering.share.points[1][1] = number);
        refused("grip", &|p| p.wheels[3].grip = number);
        refused("radius_m", &|p| p.wheels[3].radius_m = number);
        refused("brake_torque_nm", &|p| p.wheels[0].brake_torque_nm = number);
        refused("stiffness_x", &|p| p.wheels[0].stiffness_x = number);
    }
    refused("center_of_mass_m", &|p| p.body.center_of_mass_m[1] = f32::NAN);
    refused("torque curve", &|p| p.engine.torque = Curve::default());
    refused("gears", &|p| p.gearbox.count = 0);
    refused("gears", &|p| p.gearbox.count = 99);
    refused("wheels", &|p| p.wheels.truncate(3));
    refused("wheels", &|p| p.wheels.clear());
    assert_eq!(
        lone.physics.set_vehicle_physics(ActorId(9), &good),
        Err(PhysicsError::Unknown(ActorId(9)))
    );
}

#[test]
fn a_larger_steering_limit_gives_a_larger_angle() {
    let mut lone = with(|p| p.wheels[..2].iter_mut().for_each(|w| w.steer_max_rad = 1.0));
    lone.control = VehicleControl { steer: 1.0, ..lone.control };
    lone.run(1.0);
    assert!((lone.state().wheel_steer_rad - 1.0).abs() < 1e-3, "{}", lone.state().wheel_steer_rad);
}
