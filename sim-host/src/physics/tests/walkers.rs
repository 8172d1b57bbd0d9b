use std::sync::Arc;

use glam::{Vec2, Vec3};
use protocol::{ActorId, ActorState, Pose, VehicleControl, flag};

use super::{FRAME_NANOS, Ground, SUBSTEP_NANOS, incline};
use crate::physics::{Physics, PhysicsError, StaticBox, VehicleModel, WalkerModel};

const WALKER: ActorId = ActorId(1);
const CAR: ActorId = ActorId(2);

fn person(is_ragdoll_on_hit: bool) -> WalkerModel {
    WalkerModel {
        radius_m: 0.3,
        height_m: 1.8,
        mass_kg: 75.0,
        is_ragdoll_on_hit,
        gets_up_after_fall: false,
    }
}

fn street(ground: Arc<Ground>, is_ragdoll_on_hit: bool) -> Physics {
    let mut physics = Physics::new(ground, &[]);
    physics.spawn_walker(WALKER, person(is_ragdoll_on_hit), &Pose::IDENTITY).unwrap();
    physics
}

/// A walker with a car that approaches from behind.
fn with_car(is_ragdoll_on_hit: bool, mps: f32) -> Physics {
    let mut physics = street(Arc::new(Ground::flat(0.0)), is_ragdoll_on_hit);
    let model = Arc::new(VehicleModel::sedan());
    let place = Pose::level(Vec3::X * -12.0, 0.0);
    physics.spawn_vehicle(CAR, &model, &place, false).unwrap();
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

fn place(physics: &Physics, id: ActorId) -> Vec3 {
    state(physics, id).pose.position()
}

#[test]
fn a_jumping_walker_keeps_its_velocity_and_lands() {
    let mut physics = street(Arc::new(Ground::flat(0.0)), true);
    physics.walk(WALKER, Vec2::X * 2.0).unwrap();
    physics.jump(WALKER).unwrap();
    let mut highest = 0.0f32;
    for _ in 0..40 {
        run(&mut physics, 0.05);
        highest = highest.max(place(&physics, WALKER).z);
    }
    let end = place(&physics, WALKER);
    println!("{highest} m high, then at {end}");
    assert!((0.6..1.2).contains(&highest), "{highest} m");
    assert!(end.z == 0.0 && (end.x - 4.0).abs() < 0.05, "{end}");
    assert_eq!(physics.jump(CAR), Err(PhysicsError::Unknown(CAR)));
}

#[test]
fn walkers_follow_slopes_and_kerbs_and_fall_off_edges() {
    let mut physics = street(incline(0.2), false);
    physics.walk(WALKER, Vec2::X * 1.5).unwrap();
    for _ in 0..60 {
        run(&mut physics, 0.05);
        let feet = place(&physics, WALKER);
        assert!((feet.z - 0.2 * feet.x).abs() < 0.01, "{feet}");
    }
    // A kerb of 15 cm up, and a platform of 1 m down.
    let mut mesh = mesh::Mesh::default();
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    let mut floor = |from: f32, to: f32, z: f32| {
        let corners = [[from, -9.0, z], [to, -9.0, z], [to, 9.0, z], [from, 9.0, z]];
        mesh.quad(corners, face);
    };
    floor(-5.0, 2.0, 0.0);
    floor(2.0, 4.0, 0.15);
    floor(4.0, 30.0, -1.0);
    let mut physics = street(Arc::new(Ground::new(&mesh)), false);
    physics.walk(WALKER, Vec2::X * 1.0).unwrap();
    run(&mut physics, 3.0);
    assert!((place(&physics, WALKER).z - 0.15).abs() < 0.01, "{}", place(&physics, WALKER));
    run(&mut physics, 1.3);
    let falling = place(&physics, WALKER);
    assert!(falling.z < 0.1 && falling.z > -0.99, "{falling}");
    run(&mut physics, 2.0);
    assert!((place(&physics, WALKER).z + 1.0).abs() < 0.01, "{}", place(&physics, WALKER));
}

#[test]
fn a_hit_walker_falls_and_the_car_drives_on() {
    let mut physics = with_car(true, 12.0);
    run(&mut physics, 1.2);
    let mps = state(&physics, CAR).velocity_mps[0];
    assert!(mps > 9.0, "a person does not stop a car: {mps} m/s");
    let brake = VehicleControl { actor_id: CAR, brake: 1.0, ..VehicleControl::default() };
    physics.control(&brake).unwrap();
    run(&mut physics, 5.0);
    let (lying, car) = (state(&physics, WALKER), state(&physics, CAR));
    let up = lying.pose.rotation() * Vec3::Z;
    println!("lies at {}, up {up}; car {:?}", lying.pose.position(), car.velocity_mps);
    assert!(lying.has(flag::FALLEN));
    assert!(up.z.abs() < 0.5, "it stands: {up}");
    assert!(lying.pose.position().x > 1.0 && lying.velocity().length() < 0.1, "{lying:?}");
    assert!(lying.pose.position().z.abs() < 0.6, "{}", lying.pose.position());
    assert_eq!(physics.walk(WALKER, Vec2::X), Err(PhysicsError::Fallen(WALKER)));
    assert_eq!(physics.jump(WALKER), Err(PhysicsError::Fallen(WALKER)));
}

/// A walker that stands up after a fall, hit by a car that brakes after the impact.
fn with_braking_car(boxes: &[StaticBox]) -> Physics {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), boxes);
    (0..boxes.len()).for_each(|index| physics.set_static(index, false));
    let model = WalkerModel { gets_up_after_fall: true, ..person(true) };
    physics.spawn_walker(WALKER, model, &Pose::IDENTITY).unwrap();
    let sedan = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(CAR, &sedan, &Pose::level(Vec3::X * -12.0, 0.0), false).unwrap();
    run(&mut physics, 0.5);
    physics.set_velocity(CAR, Vec3::X * 10.4, Vec3::ZERO).unwrap();
    while !state(&physics, WALKER).has(flag::FALLEN) {
        run(&mut physics, 0.05);
    }
    let brake = VehicleControl { actor_id: CAR, brake: 1.0, ..VehicleControl::default() };
    physics.control(&brake).unwrap();
    physics
}

#[test]
fn a_walker_that_gets_up_stands_after_five_seconds_and_walks_on() {
    let mut physics = with_braking_car(&[]);
    run(&mut physics, 4.8);
    let lying = state(&physics, WALKER);
    assert!(lying.has(flag::FALLEN));
    let saved = physics.save();
    run(&mut physics, 0.4);
    let (stands, hash) = (state(&physics, WALKER), physics.hash());
    let up = stands.pose.rotation() * Vec3::Z;
    println!("lay at {}, stands at {}", lying.pose.position(), stands.pose.position());
    assert!(!stands.has(flag::FALLEN) && physics.limbs(WALKER).is_none());
    assert!(up.z > 0.999 && stands.pose.position().z.abs() < 0.01, "{stands:?}");
    let away = stands.pose.position() - lying.pose.position();
    assert!(away.truncate().length() < 1.2, "it stands up {away} from where it lay");
    physics.walk(WALKER, Vec2::Y * 1.5).unwrap();
    run(&mut physics, 1.0);
    let walked = place(&physics, WALKER) - stands.pose.position();
    assert!((walked.y - 1.5).abs() < 0.1, "{walked}");
    // It is hit like before, and a saved state continues bit for bit.
    let last = physics.actors.last().map(|actor| actor.id);
    assert_eq!(last, Some(CAR.0), "the order of actors");
    physics.restore(&saved).unwrap();
    run(&mut physics, 0.4);
    assert_eq!(physics.hash(), hash);
}

#[test]
fn a_walker_without_room_to_stand_lies_on() {
    let roof = StaticBox {
        center: Vec3::new(10.0, 0.0, 2.0),
        half_extents_m: Vec3::new(60.0, 20.0, 1.0),
        yaw_rad: 0.0,
    };
    let mut physics = with_braking_car(&[roof]);
    run(&mut physics, 4.0);
    physics.set_static(0, true);
    run(&mut physics, 3.0);
    assert!(state(&physics, WALKER).has(flag::FALLEN), "it stands inside the roof");
    physics.set_static(0, false);
    run(&mut physics, 0.1);
    assert!(!state(&physics, WALKER).has(flag::FALLEN));
}

#[test]
fn a_walker_killed_on_the_ground_does_not_get_up() {
    let mut physics = with_braking_car(&[]);
    run(&mut physics, 1.0);
    physics.fall_for_good(WALKER).unwrap();
    run(&mut physics, 6.0);
    assert!(state(&physics, WALKER).has(flag::FALLEN));
}

#[test]
fn a_slow_car_pushes_a_walker_aside() {
    let mut physics = with_car(true, 1.2);
    let control =
        VehicleControl { actor_id: CAR, throttle: 0.15, manual_gear: 0, ..Default::default() };
    physics.control(&control).unwrap();
    let mut touched = false;
    while place(&physics, CAR).x < 1.0 {
        run(&mut physics, 0.05);
        let car = state(&physics, CAR);
        assert!(car.velocity_mps[0] > 0.9, "the walker stops the car: {:?}", car.velocity_mps);
        if car.velocity_mps[0] > 1.8 {
            physics.set_velocity(CAR, Vec3::X * 1.5, Vec3::ZERO).unwrap();
        }
        touched |= physics.collisions().iter().any(|c| {
            // The walker, which has the lower id, is pushed ahead.
            (c.actor, c.other) == (WALKER, CAR) && c.impulse_ns.x > 0.0
        });
    }
    assert!(touched, "no collision is reported");
    assert!(!state(&physics, WALKER).has(flag::FALLEN));
    // The front of the car is 2.35 m ahead of its origin.
    let ahead_m = place(&physics, WALKER).x - place(&physics, CAR).x;
    assert!((2.6..2.75).contains(&ahead_m), "{ahead_m} m");
}

#[test]
fn a_walker_that_does_not_fall_is_pushed_along() {
    let mut physics = with_car(false, 12.0);
    run(&mut physics, 2.0);
    assert!(!state(&physics, WALKER).has(flag::FALLEN));
    assert!(place(&physics, WALKER).x > 5.0, "{}", place(&physics, WALKER));
    assert!(state(&physics, CAR).velocity_mps[0] > 9.0);
}

#[test]
fn walkers_stop_at_a_car_without_moving_it() {
    let mut physics = with_car(true, 0.0);
    let control =
        VehicleControl { actor_id: CAR, flags: flag::HANDBRAKE, ..VehicleControl::default() };
    physics.control(&control).unwrap();
    run(&mut physics, 1.0);
    let stood = place(&physics, CAR);
    physics.walk(WALKER, -Vec2::X * 1.5).unwrap();
    run(&mut physics, 12.0);
    let feet = place(&physics, WALKER);
    // The front of the car is at −12 m + 2.35 m.
    assert!((feet.x - (-9.65 + 0.3)).abs() < 0.1, "{feet}");
    assert!((place(&physics, CAR) - stood).length() < 1e-3, "{}", place(&physics, CAR));
    physics.walk(WALKER, Vec2::X * 1.5).unwrap();
    run(&mut physics, 2.0);
    assert!(place(&physics, WALKER).x > -7.0, "a fallen walker does not walk");
}

#[test]
fn a_restored_fall_continues_bit_for_bit() {
    let mut physics = with_car(true, 12.0);
    run(&mut physics, 0.8);
    let bytes = physics.save();
    let mut hashes = Vec::new();
    for _ in 0..2 {
        physics.restore(&bytes).unwrap();
        run(&mut physics, 3.0);
        assert!(state(&physics, WALKER).has(flag::FALLEN));
        hashes.push(physics.hash());
    }
    let mut again = with_car(true, 12.0);
    run(&mut again, 3.8);
    hashes.push(again.hash());
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:x?}");
}
