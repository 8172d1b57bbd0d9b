//! Hybrid physics: which vehicles are dormant.

use glam::Vec3;
use protocol::{
    ActorId, Autopilot, Command, Name, Pose, SetPhysics, Spawn, Teleport, TrafficParam,
    VehicleControl, flag, param,
};

use super::{CarryOut, Sim, plain, run};
use crate::saved::SavedState;

fn spawn(world: &mut Sim, x: f32, role: &str, flags: u32) -> ActorId {
    let spawn = Spawn {
        blueprint: Name::new("vehicle.tesla.model3"),
        role: Name::new(role),
        pose: Pose::level(Vec3::new(x, 0.0, 0.0), 0.0),
        flags,
        ..Spawn::default()
    };
    let id = ActorId(world.carry_out(&Command::Spawn(spawn)).unwrap());
    run(world, 1);
    id
}

fn set(world: &mut Sim, param: u32, value: f32) {
    let actor_id = ActorId::NONE;
    world.carry_out(&Command::TrafficParam(TrafficParam { actor_id, param, value })).unwrap();
}

fn place(world: &mut Sim, id: ActorId, x: f32) {
    let pose = Pose::level(Vec3::new(x, 0.0, 0.0), 0.0);
    world.carry_out(&Command::Teleport(Teleport { actor_id: id, pose })).unwrap();
    run(world, 2);
}

fn is_dormant(world: &Sim, id: ActorId) -> bool {
    world.world().physics().is_dormant(id)
}

#[test]
fn vehicles_far_from_every_hero_are_dormant() {
    let mut world = plain();
    let hero = spawn(&mut world, 0.0, "hero", flag::AUTOPILOT);
    let car = spawn(&mut world, 100.0, "autopilot", flag::AUTOPILOT);
    let parked = spawn(&mut world, 120.0, "", 0);
    run(&mut world, 3);
    assert!(!is_dormant(&world, car), "hybrid physics is off by default");
    set(&mut world, param::HYBRID_PHYSICS, 1.0);
    run(&mut world, 1);
    // The radius is 50 m by default; a parked car is nobody's.
    assert!(is_dormant(&world, car) && !is_dormant(&world, hero) && !is_dormant(&world, parked));
    place(&mut world, hero, 49.0);
    assert!(is_dormant(&world, car));
    place(&mut world, hero, 51.0);
    assert!(!is_dormant(&world, car));
    // It becomes dormant again beyond 55 m.
    place(&mut world, hero, 47.0);
    assert!(!is_dormant(&world, car));
    place(&mut world, hero, 44.0);
    assert!(is_dormant(&world, car));
    set(&mut world, param::HYBRID_RADIUS_M, 70.0);
    run(&mut world, 1);
    assert!(!is_dormant(&world, car));
    set(&mut world, param::HYBRID_RADIUS_M, 20.0);
    run(&mut world, 1);
    assert!(is_dormant(&world, car));
    set(&mut world, param::HYBRID_PHYSICS, 0.0);
    run(&mut world, 1);
    assert!(!is_dormant(&world, car));
}

#[test]
fn vehicles_that_clients_drive_and_actors_with_sensors_are_observers() {
    let mut world = plain();
    let car = spawn(&mut world, 0.0, "", flag::AUTOPILOT);
    let driven = spawn(&mut world, 20.0, "", 0);
    set(&mut world, param::HYBRID_PHYSICS, 1.0);
    run(&mut world, 2);
    assert!(is_dormant(&world, car));
    let control = VehicleControl { actor_id: driven, brake: 1.0, ..VehicleControl::default() };
    world.carry_out(&Command::Control(control)).unwrap();
    run(&mut world, 1);
    assert!(!is_dormant(&world, car));
    world.carry_out(&Command::Autopilot(Autopilot { actor_id: driven, on: 1 })).unwrap();
    run(&mut world, 1);
    assert!(is_dormant(&world, car) && is_dormant(&world, driven));
    world.world_mut().mark_carrier(driven);
    run(&mut world, 1);
    assert!(!is_dormant(&world, car) && !is_dormant(&world, driven));
    place(&mut world, driven, 200.0);
    assert!(is_dormant(&world, car));
    world.carry_out(&Command::SetPhysics(SetPhysics { actor_id: car, on: 0 })).unwrap();
    run(&mut world, 1);
    assert!(!is_dormant(&world, car));
}

#[test]
fn a_saved_state_holds_who_is_dormant() {
    let mut world = plain();
    let car = spawn(&mut world, 0.0, "", flag::AUTOPILOT);
    set(&mut world, param::HYBRID_PHYSICS, 1.0);
    run(&mut world, 3);
    let mut state = SavedState::default();
    world.save_into(&mut state);
    let mut other = plain();
    other.restore(&state).unwrap();
    assert!(is_dormant(&world, car) && is_dormant(&other, car));
    assert_eq!(world.state_hash(), other.state_hash());
    // Switching it off in the restored world wakes the vehicle.
    set(&mut other, param::HYBRID_PHYSICS, 0.0);
    run(&mut other, 1);
    assert!(!is_dormant(&other, car));
}
