//! Props that vehicles hit.

use std::sync::Arc;

use glam::{Quat, Vec3};
use protocol::{ActorId, ActorState, Pose, VehicleControl, flag};

use super::{FRAME_NANOS, Ground, SUBSTEP_NANOS};
use crate::physics::{Physics, PropModel, VehicleModel};

const CONE: ActorId = ActorId(1);
const CAR: ActorId = ActorId(2);

/// A kinematic traffic cone at a height above the road, and a car that approaches it.
fn with_car(is_released_on_hit: bool, height_m: f32, mps: f32) -> Physics {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    let model = PropModel {
        half_extents_m: Vec3::new(0.2, 0.2, 0.4),
        mass_kg: 5.0,
        is_passable: false,
        is_released_on_hit,
    };
    physics.spawn_prop(CONE, model, &Pose::level(Vec3::Z * height_m, 0.0), true).unwrap();
    let place = Pose::new(Vec3::new(-10.0, 0.3, 0.0), Quat::IDENTITY);
    physics.spawn_vehicle(CAR, &Arc::new(VehicleModel::sedan()), &place, false).unwrap();
    run(&mut physics, 0.5);
    physics.set_velocity(CAR, Vec3::X * mps, Vec3::ZERO).unwrap();
    physics
}

fn run(physics: &mut Physics, seconds: f32) {
    for _ in 0..(seconds / 0.05).round() as usize {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
}

fn state(physics: &Physics, actor_id: ActorId) -> ActorState {
    let mut state = ActorState { actor_id, ..ActorState::default() };
    assert!(physics.write_state(&mut state));
    state
}

#[test]
fn a_released_prop_meets_the_car_with_its_own_mass() {
    let mut physics = with_car(true, 0.0, 8.0);
    let before = state(&physics, CONE);
    assert!(before.has(flag::KINEMATIC) && before.velocity().length() == 0.0);
    run(&mut physics, 1.5);
    let (cone, car) = (state(&physics, CONE), state(&physics, CAR));
    println!("cone at {}, car {:?}", cone.pose.position(), car.velocity_mps);
    assert!(!cone.has(flag::KINEMATIC) && cone.pose.position().x > 2.0);
    assert!(car.velocity_mps[0] > 7.0, "a cone stops the car: {:?}", car.velocity_mps);
    let brake = VehicleControl { actor_id: CAR, brake: 1.0, ..VehicleControl::default() };
    physics.control(&brake).unwrap();
    run(&mut physics, 6.0);
    let cone = state(&physics, CONE);
    assert!(cone.velocity().length() < 0.2, "{:?}", cone.velocity_mps);
    assert!(cone.pose.position().z.abs() < 0.5, "it lies on the ground: {}", cone.pose.position());
}

#[test]
fn a_prop_stays_where_it_is_spawned_until_it_is_touched() {
    let mut physics = with_car(true, 0.5, 8.0);
    run(&mut physics, 0.5);
    assert_eq!(state(&physics, CONE).pose.position(), Vec3::Z * 0.5);
    run(&mut physics, 4.0);
    assert!(!state(&physics, CONE).has(flag::KINEMATIC));
    assert!(state(&physics, CONE).pose.position().z < 0.4);
    // A slow car moves it as well.
    let mut physics = with_car(true, 0.0, 1.0);
    for _ in 0..400 {
        physics.set_velocity(CAR, Vec3::X, Vec3::ZERO).unwrap();
        run(&mut physics, 0.05);
    }
    assert!(state(&physics, CONE).pose.position().x > 2.0);
}

#[test]
fn a_kinematic_prop_that_is_not_released_stops_the_car() {
    let mut physics = with_car(false, 0.0, 8.0);
    run(&mut physics, 2.0);
    assert_eq!(state(&physics, CONE).pose.position(), Vec3::ZERO);
    assert!(state(&physics, CAR).velocity_mps[0] < 3.0);
}

#[test]
fn a_prop_may_overlap_obstacles_where_it_is_spawned() {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    let car = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(CAR, &car, &Pose::IDENTITY, false).unwrap();
    let model = PropModel {
        half_extents_m: Vec3::new(0.5, 0.5, 0.5),
        mass_kg: 40.0,
        is_passable: false,
        is_released_on_hit: false,
    };
    physics.spawn_prop(CONE, model, &Pose::IDENTITY, true).unwrap();
    let place = Pose::level(Vec3::X * 1.0, 0.0);
    let vehicle = physics.spawn_vehicle(ActorId(3), &car, &place, false);
    assert!(vehicle.is_err(), "a vehicle may not");
}
