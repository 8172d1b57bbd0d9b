use std::sync::Arc;

use glam::Vec3;
use protocol::{ActorId, VehicleControl};

use super::{FRAME_NANOS, Lone, SUBSTEP_NANOS, incline};
use crate::physics::{Ground, StaticBox, VehicleModel};

const CAR: ActorId = ActorId(1);

/// Returns a copy in the same state.
fn fork(of: &Lone, ground: &Arc<Ground>) -> Lone {
    let mut copy = Lone::new(Arc::clone(ground), VehicleModel::sedan());
    copy.physics.restore(&of.physics.save()).unwrap();
    copy.control = of.control;
    copy
}

/// Returns the distance between two cars and the difference of their velocities.
fn apart(one: &Lone, other: &Lone) -> (f32, f32) {
    let velocity = |lone: &Lone| Vec3::from_array(lone.state().velocity_mps);
    (one.position().distance(other.position()), velocity(one).distance(velocity(other)))
}

fn pedals(throttle: f32, brake: f32, steer: f32) -> VehicleControl {
    VehicleControl { actor_id: CAR, throttle, brake, steer, ..VehicleControl::default() }
}

#[test]
fn a_hand_over_in_a_curve_is_no_jump() {
    let ground = Arc::new(Ground::flat(0.0));
    let mut full = Lone::new(Arc::clone(&ground), VehicleModel::sedan());
    full.control = pedals(0.5, 0.0, 0.0);
    full.run(5.0);
    full.control = pedals(0.25, 0.0, 0.12);
    full.run(2.0);
    assert!(full.speed() > 8.0, "{} m/s", full.speed());

    let mut dormant = fork(&full, &ground);
    dormant.physics.set_dormant(CAR, true).unwrap();
    assert!(dormant.physics.is_dormant(CAR));
    assert_eq!(apart(&full, &dormant), (0.0, 0.0));
    full.frame();
    dormant.frame();
    let (place, velocity) = apart(&full, &dormant);
    assert!(place < 5e-3 && velocity < 0.15, "into: {place} m and {velocity} m/s");

    dormant.run(3.0);
    let mut woken = fork(&dormant, &ground);
    assert!(woken.physics.is_dormant(CAR), "it is not saved that the car is dormant");
    woken.physics.set_dormant(CAR, false).unwrap();
    assert_eq!(apart(&dormant, &woken), (0.0, 0.0));
    dormant.frame();
    woken.frame();
    let (place, velocity) = apart(&dormant, &woken);
    assert!(place < 5e-3 && velocity < 0.15, "out of: {place} m and {velocity} m/s");
    let (before, after) = (dormant.state().engine_rpm, woken.state().engine_rpm);
    assert!((before - after).abs() < 100.0, "{before} and {after} rpm");
}

#[test]
fn a_dormant_car_drives_as_its_full_model() {
    let ground = Arc::new(Ground::flat(0.0));
    let mut full = Lone::new(Arc::clone(&ground), VehicleModel::sedan());
    full.run(0.5);
    let mut dormant = fork(&full, &ground);
    dormant.physics.set_dormant(CAR, true).unwrap();
    for (control, seconds, within_mps) in [
        (pedals(0.6, 0.0, 0.0), 6.0, 1.0),
        (pedals(0.2, 0.0, 0.05), 6.0, 1.5),
        (pedals(0.0, 0.3, 0.0), 2.0, 1.5),
        (pedals(0.0, 1.0, 0.0), 4.0, 0.01),
    ] {
        (full.control, dormant.control) = (control, control);
        full.run(seconds);
        dormant.run(seconds);
        let (one, other) = (full.speed(), dormant.speed());
        assert!((one - other).abs() < within_mps, "{control:?}: {one} and {other} m/s");
    }
    let (place, way_m) = (apart(&full, &dormant).0, full.position().length());
    assert!(way_m > 100.0 && place < 0.1 * way_m, "{place} m apart after {way_m} m");
}

#[test]
fn a_dormant_car_follows_a_slope_and_its_brakes_hold_it() {
    let ground = incline(0.1);
    let mut car = Lone::new(Arc::clone(&ground), VehicleModel::sedan());
    car.control = pedals(0.0, 1.0, 0.0);
    car.run(1.0);
    car.physics.set_dormant(CAR, true).unwrap();
    let stood = car.position();
    car.run(2.0);
    assert!(car.position().distance(stood) < 0.03, "{} m", car.position().distance(stood));
    let mut full = fork(&car, &ground);
    full.physics.set_dormant(CAR, false).unwrap();
    for one in [&mut car, &mut full] {
        one.control = pedals(0.5, 0.0, 0.0);
        one.run(4.0);
    }
    let (position, way_m) = (car.position(), full.position().x);
    assert!((position.x - way_m).abs() < 0.15 * way_m && way_m > 4.0, "{position}, {way_m} m");
    assert!((position.z - 0.1 * position.x).abs() < 0.02, "{position}");
    let ahead = car.rotation() * Vec3::X;
    assert!((ahead.z - 0.0995).abs() < 2e-3, "{ahead}");
}

#[test]
fn a_dormant_car_passes_through_a_box_and_a_full_one_does_not() {
    let ahead = StaticBox {
        center: Vec3::new(20.0, 0.0, 1.0),
        half_extents_m: Vec3::splat(1.0),
        yaw_rad: 0.0,
    };
    let way_m = |is_dormant: bool| {
        let mut car = Lone::sedan();
        car.physics = crate::physics::Physics::new(Arc::new(Ground::flat(0.0)), &[ahead]);
        let model = Arc::new(VehicleModel::sedan());
        car.physics.spawn_vehicle(CAR, &model, &protocol::Pose::IDENTITY, false).unwrap();
        car.physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        car.physics.set_dormant(CAR, is_dormant).unwrap();
        car.control = pedals(0.5, 0.0, 0.0);
        car.run(6.0);
        car.position().x
    };
    assert!(way_m(false) < 18.0);
    assert!(way_m(true) > 25.0);
}

#[test]
fn a_falling_car_does_not_become_dormant() {
    let mut car = Lone::sedan();
    car.physics.teleport(CAR, &protocol::Pose::level(Vec3::Z * 10.0, 0.0)).unwrap();
    car.frame();
    car.physics.set_dormant(CAR, true).unwrap();
    assert!(!car.physics.is_dormant(CAR));
}
