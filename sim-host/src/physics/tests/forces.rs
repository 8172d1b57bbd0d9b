use std::sync::Arc;

use glam::Vec3;
use protocol::{ActorId, Pose};

use super::{FRAME_NANOS, Ground, Lone, SUBSTEP_NANOS};
use crate::physics::{Physics, PhysicsError, PropModel, VehicleModel, WalkerModel};

const ID: ActorId = ActorId(1);

/// A car without gravity high in the air.
fn floating() -> Lone {
    let mut lone = Lone::sedan();
    lone.physics.teleport(ID, &Pose::level(Vec3::Z * 50.0, 0.5)).unwrap();
    lone.physics.set_gravity(ID, false).unwrap();
    lone.run(0.1);
    lone
}

fn spin(lone: &Lone) -> Vec3 {
    Vec3::from_array(lone.state().angular_velocity_radps)
}

#[test]
fn an_actor_without_gravity_floats_and_falls_with_it() {
    let mut lone = floating();
    lone.run(2.0);
    assert!((lone.position().z - 50.0).abs() < 1e-3, "{}", lone.position());
    lone.physics.set_gravity(ID, true).unwrap();
    lone.run(1.0);
    assert!((lone.position().z - 45.0).abs() < 0.5, "{}", lone.position());
}

#[test]
fn an_impulse_equals_a_force_over_one_frame() {
    let push = Vec3::new(3000.0, -1000.0, 500.0);
    let twist = Vec3::new(100.0, 200.0, -900.0);
    let (mut at_once, mut over_a_frame) = (floating(), floating());
    at_once.physics.impulse(ID, push, twist, None).unwrap();
    let per_s = 1.0 / (FRAME_NANOS as f32 * 1e-9);
    over_a_frame.physics.force(ID, push * per_s, twist * per_s, None).unwrap();
    at_once.frame();
    over_a_frame.frame();
    let mass = VehicleModel::sedan().mass_kg;
    for lone in [&mut at_once, &mut over_a_frame] {
        // The impulse acts at the centre of mass; the origin turns about it.
        let model = VehicleModel::sedan();
        let arm = lone.rotation() * -model.com_m;
        let com_mps = lone.state().velocity() - spin(lone).cross(arm);
        assert!((com_mps - push / mass).length() < 0.02, "{com_mps}");
        // The force acts for one frame only.
        let before = spin(lone);
        lone.frame();
        assert!((spin(lone) - before).length() < 0.01, "{} {before}", spin(lone));
    }
    assert!((spin(&at_once) - spin(&over_a_frame)).length() < 0.01);
}

#[test]
fn a_torque_acts_on_the_bodys_inertia() {
    let inertia = VehicleModel::sedan().inertia_kgm2;
    for (axis, inertia) in [(Vec3::X, inertia.x), (Vec3::Y, inertia.y), (Vec3::Z, inertia.z)] {
        let mut lone = floating();
        let along = lone.rotation() * axis;
        lone.physics.impulse(ID, Vec3::ZERO, along * 300.0, None).unwrap();
        lone.frame();
        let rate = spin(&lone).dot(along);
        assert!((rate - 300.0 / inertia).abs() < 0.01 * rate, "{axis}: {rate}");
    }
}

#[test]
fn a_force_beside_the_centre_of_mass_turns_the_body() {
    let mut lone = floating();
    let nose = lone.position() + lone.rotation() * Vec3::new(2.0, 0.0, 0.5);
    let left = lone.rotation() * Vec3::Y;
    lone.physics.impulse(ID, left * 1000.0, Vec3::ZERO, Some(nose)).unwrap();
    lone.frame();
    assert!(spin(&lone).z > 0.3, "{}", spin(&lone));
}

#[test]
fn an_actor_without_collisions_passes_through_others_on_the_ground() {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    let model = Arc::new(VehicleModel::sedan());
    for (id, x) in [(1, 0.0), (2, 12.0)] {
        let pose = Pose::level(Vec3::X * x, 0.0);
        physics.spawn_vehicle(ActorId(id), &model, &pose, false).unwrap();
    }
    physics.set_collisions(ID, false).unwrap();
    physics.set_velocity(ID, Vec3::X * 20.0, Vec3::ZERO).unwrap();
    let mut states: Vec<_> = Vec::new();
    for _ in 0..40 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        states = physics.states().collect();
        assert!(physics.collisions().is_empty());
    }
    let [one, other] = [0, 1].map(|i| states[i].pose.position());
    assert!(one.x > 20.0 && one.z.abs() < 0.05, "{one}");
    assert!((other.x - 12.0).abs() < 0.01, "{other}");
    // With collisions enabled again, the car is hit.
    physics.set_collisions(ID, true).unwrap();
    physics.teleport(ID, &Pose::IDENTITY).unwrap();
    physics.set_velocity(ID, Vec3::X * 20.0, Vec3::ZERO).unwrap();
    let mut has_hit = false;
    for _ in 0..40 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        has_hit |= !physics.collisions().is_empty();
    }
    assert!(has_hit);
}

#[test]
fn invalid_forces_are_refused() {
    let mut lone = Lone::sedan();
    let hash = lone.physics.hash();
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let bad = Vec3::new(0.0, bad, 0.0);
        assert!(lone.physics.impulse(ID, bad, Vec3::ZERO, None).is_err());
        assert!(lone.physics.impulse(ID, Vec3::ZERO, bad, None).is_err());
        assert!(lone.physics.force(ID, bad, Vec3::ZERO, None).is_err());
        assert!(lone.physics.force(ID, Vec3::ZERO, Vec3::ZERO, Some(bad)).is_err());
    }
    assert_eq!(lone.physics.set_gravity(ActorId(7), true), Err(PhysicsError::Unknown(ActorId(7))));
    let model = WalkerModel {
        radius_m: 0.2,
        height_m: 1.8,
        mass_kg: 80.0,
        is_ragdoll_on_hit: false,
        gets_up_after_fall: false,
    };
    lone.physics.spawn_walker(ActorId(3), model, &Pose::level(Vec3::X * 9.0, 0.0)).unwrap();
    lone.physics.destroy(ActorId(3)).unwrap();
    assert_eq!(lone.physics.hash(), hash);
}

#[test]
fn forces_act_on_props() {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    let model = PropModel {
        half_extents_m: Vec3::splat(0.4),
        mass_kg: 20.0,
        is_passable: false,
        is_released_on_hit: false,
    };
    physics.spawn_prop(ID, model, &Pose::IDENTITY, false).unwrap();
    for _ in 0..10 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    physics.impulse(ID, Vec3::X * 60.0, Vec3::ZERO, None).unwrap();
    physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    let state = physics.states().next().unwrap();
    assert!(state.velocity_mps[0] > 2.0, "{:?}", state.velocity_mps);
}

#[test]
fn wheel_telemetry_agrees_with_the_motion() {
    let mut lone = Lone::sedan();
    lone.run(3.0);
    let weight = VehicleModel::sedan().mass_kg * 9.81;
    let wheels = |lone: &Lone| -> Vec<_> {
        (0..4).map(|i| lone.physics.wheel_telemetry(ID, i).unwrap()).collect()
    };
    let at_rest = wheels(&lone);
    let carried: f32 = at_rest.iter().map(|w| w.load_n).sum();
    assert!((carried / weight - 1.0).abs() < 0.01, "{carried} N of {weight} N");
    assert!(at_rest.iter().all(|w| w.slip_y_rad.abs() < 0.01 && w.slip_x.abs() < 0.01));

    // The sum of the wheel forces is what accelerates the car.
    lone.control.throttle = 0.6;
    lone.run(2.5);
    let wheels_now = wheels(&lone);
    let along: f32 = wheels_now.iter().map(|w| w.along_n).sum();
    let drag = lone.physics.telemetry(ID).unwrap().drag_n;
    let body_force = lone.state().acceleration_mps2[0] * VehicleModel::sedan().mass_kg;
    println!("along {along:.0} N, drag {drag:.0} N, body_force {body_force:.0} N");
    assert!(
        (along - drag - body_force).abs() < 0.1 * body_force,
        "{along} N − {drag} N, body {body_force} N"
    );
    assert!(wheels_now[2].slip_x > 0.0 && wheels_now[2].torque_nm > 50.0, "{:?}", wheels_now[2]);
    assert!(wheels_now[2].load_n > at_rest[2].load_n && wheels_now[0].load_n < at_rest[0].load_n);

    // Steered to the left, the tyres pull to the left and slide to the right, and the outer ones
    // carry more load.
    lone.control.throttle = 0.2;
    lone.control.steer = 0.2;
    lone.run(1.5);
    for wheel in wheels(&lone) {
        assert!(wheel.across_n > 100.0 && wheel.slip_y_rad < 0.0, "{wheel:?}");
    }
    let wheels_now = wheels(&lone);
    assert!(
        wheels_now[1].load_n > wheels_now[0].load_n + 300.0,
        "{} {}",
        wheels_now[0].load_n,
        wheels_now[1].load_n
    );
    assert!(lone.physics.wheel_telemetry(ID, 4).is_err());
}
