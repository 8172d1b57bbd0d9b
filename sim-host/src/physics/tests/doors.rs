use std::sync::Arc;

use glam::{Quat, Vec3};
use protocol::{ActorId, Pose, VehicleControl, flag};

use super::{FRAME_NANOS, Lone, SUBSTEP_NANOS};
use crate::physics::{DoorModel, Ground, Physics, StaticBox, VehicleModel};

/// The front left door, open.
fn door() -> DoorModel {
    DoorModel {
        number: 0,
        middle_m: Vec3::new(0.9, 1.35, 0.8),
        half_extents_m: Vec3::new(0.5, 0.05, 0.5),
        turn: Quat::from_rotation_z(-1.15),
    }
}

fn with(boxes: &[StaticBox]) -> Physics {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), boxes);
    let model = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(ActorId(1), &model, &Pose::IDENTITY, false).unwrap();
    let handbrake =
        VehicleControl { actor_id: ActorId(1), flags: flag::HANDBRAKE, ..Default::default() };
    physics.control(&handbrake).unwrap();
    physics
}

fn run(physics: &mut Physics, frames: u32) -> bool {
    (0..frames).fold(false, |hit, _| {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        hit | !physics.collisions().is_empty()
    })
}

/// Drives a car past on the left from behind, so close that an open door is in its way. Returns
/// whether it collides.
fn pass(physics: &mut Physics) -> bool {
    let model = Arc::new(VehicleModel::sedan());
    let beside = Pose::level(Vec3::new(-12.0, 2.4, 0.0), 0.0);
    physics.spawn_vehicle(ActorId(2), &model, &beside, false).unwrap();
    physics.set_velocity(ActorId(2), Vec3::X * 8.0, Vec3::ZERO).unwrap();
    let hit = run(physics, 50);
    physics.destroy(ActorId(2)).unwrap();
    hit
}

#[test]
fn a_passing_car_hits_an_open_door_and_not_a_closed_one() {
    let mut physics = with(&[]);
    assert!(!pass(&mut physics), "the door was never open");
    assert_eq!(physics.set_doors(ActorId(1), &[door()], false), Ok(1));
    assert!(pass(&mut physics), "the door is open");
    physics.teleport(ActorId(1), &Pose::IDENTITY).unwrap();
    run(&mut physics, 10);
    assert!(pass(&mut physics), "the open door moves with its car");
    physics.teleport(ActorId(1), &Pose::IDENTITY).unwrap();
    physics.set_collisions(ActorId(1), false).unwrap();
    assert!(!pass(&mut physics), "a car without collisions does not hit the door");
    physics.set_collisions(ActorId(1), true).unwrap();
    assert_eq!(physics.set_doors(ActorId(1), &[], false), Ok(0));
    assert!(!pass(&mut physics), "the door is closed again");
}

#[test]
fn a_door_with_an_obstacle_in_its_way_stays_closed() {
    let wall = StaticBox {
        center: Vec3::new(0.0, 2.3, 1.0),
        half_extents_m: Vec3::new(10.0, 0.5, 1.0),
        yaw_rad: 0.0,
    };
    let mut physics = with(&[wall]);
    let hash = physics.hash();
    let why = physics.set_doors(ActorId(1), &[door()], false).unwrap_err().to_string();
    assert!(why.contains("a building is in the way of the doors of actor 1"), "{why}");
    assert_eq!(physics.hash(), hash, "nothing changed");
    let DoorModel { middle_m, turn, .. } = door();
    let flip = Vec3::new(1.0, -1.0, 1.0);
    let right =
        DoorModel { number: 1, middle_m: middle_m * flip, turn: turn.conjugate(), ..door() };
    assert_eq!(physics.set_doors(ActorId(1), &[door(), right], false), Ok(2));
    assert!(!run(&mut physics, 20));
}

#[test]
fn open_doors_add_drag_and_turn_the_car_to_their_side() {
    let coast = |doors: &[DoorModel]| {
        let mut lone = Lone::sedan();
        lone.physics.set_doors(ActorId(1), doors, false).unwrap();
        lone.physics.set_velocity(ActorId(1), Vec3::X * 30.0, Vec3::ZERO).unwrap();
        let neutral = VehicleControl { actor_id: ActorId(1), manual_gear: 1, ..Default::default() };
        lone.physics.control(&neutral).unwrap();
        run(&mut lone.physics, 40);
        (lone.state().velocity().length(), lone.state().pose.position_m[1])
    };
    let ((shut, straight), (open, aside)) = (coast(&[]), coast(&[door()]));
    println!("{shut} m/s at {straight} m shut, {open} m/s at {aside} m open");
    // An area of 1 m² that faces the wind: 1.17 * 0.5 * 1.2 * 30^2 * sin^2 of 66 degrees, over 1.5
    // t.
    assert!((0.4..1.2).contains(&(shut - open)), "{shut} {open}");
    assert!(aside > straight + 0.05, "{straight} {aside}");
}

#[test]
fn open_doors_are_part_of_a_saved_state() {
    let mut physics = with(&[]);
    physics.set_doors(ActorId(1), &[door()], false).unwrap();
    run(&mut physics, 5);
    let (bytes, hash) = (physics.save(), physics.hash());
    let mut other = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    other.restore(&bytes).unwrap();
    assert_eq!(other.hash(), hash);
    assert!(pass(&mut other) && pass(&mut physics));
    assert_eq!(other.hash(), physics.hash());
    assert_eq!(other.set_doors(ActorId(1), &[], false), Ok(0));
    assert_ne!(other.hash(), physics.hash());
}
