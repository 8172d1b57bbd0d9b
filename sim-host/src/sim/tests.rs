use glam::Vec3;
use protocol::{
    Autopilot, BlendPose, Command, CommandGroup, GivenPoses, Name, Pose, Query, QueryKind, Refusal,
    RefusalCode, SetBones, SetDoors, SetPhysics, SetVehicleLights, SetVelocity,
    SetWeatherAffectsGrip, Spawn, Switch, Teleport, VehicleBody, VehicleControl, Weather, flag,
    lamp,
};

use super::{Inputs, NoServices, Sim};
use crate::saved::SavedState;

mod hybrid;
mod numbers;

/// Any command that the simulation itself applies.
trait CarryOut {
    fn carry_out(&mut self, command: &Command) -> Result<u32, Refusal>;
}

impl CarryOut for Sim {
    fn carry_out(&mut self, command: &Command) -> Result<u32, Refusal> {
        match command.group() {
            CommandGroup::World(command) => self.apply_world(&command),
            CommandGroup::Standing(command) => {
                self.apply_standing(&command, self.coming()).map(|outcome| outcome.id)
            }
            other => panic!("{other:?}"),
        }
    }
}

/// A town of one floor without objects.
fn plain() -> Sim {
    plain_of(1000.0)
}

/// A world whose ground is a flat square with this edge.
fn plain_of(edge_m: f32) -> Sim {
    let mut town = town::Town::default();
    let corner = |x: f32, y: f32| [x * 0.5 * edge_m, y * 0.5 * edge_m, 0.0];
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    town.mesh
        .quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], face);
    Sim::new(&town, 1)
}

fn run(world: &mut Sim, frames: u32) {
    for _ in 0..frames {
        let Ok(_) = world.step(&Inputs::default(), &mut NoServices::default());
    }
}

/// Returns the stopping distance from 20 m/s. Metres.
fn stopping(world: &mut Sim) -> f32 {
    let name = Name::new("vehicle.tesla.model3");
    let spawn = Spawn { blueprint: name, pose: Pose::IDENTITY, ..Spawn::default() };
    let id = protocol::ActorId(world.carry_out(&Command::Spawn(spawn)).unwrap());
    run(world, 10);
    let velocity_mps = [20.0, 0.0, 0.0];
    world
        .carry_out(&Command::SetVelocity(SetVelocity {
            actor_id: id,
            velocity_mps,
            ..Default::default()
        }))
        .unwrap();
    let brake = VehicleControl { actor_id: id, brake: 1.0, ..VehicleControl::default() };
    world.carry_out(&Command::Control(brake)).unwrap();
    let from = world.world().state(id).unwrap().pose.position();
    run(world, 200);
    let state = world.world().state(id).unwrap();
    assert!(state.velocity().length() < 0.01 && !state.has(flag::COLLIDING));
    let meters = (state.pose.position() - from).dot(Vec3::X);
    world.carry_out(&Command::Destroy(id)).unwrap();
    meters
}

#[test]
fn wet_roads_are_slippery_only_where_the_weather_affects_grip() {
    let mut world = plain();
    let dry = stopping(&mut world);
    let rain = Weather { wetness: 100.0, precipitation_deposits: 50.0, ..Weather::default() };
    world.carry_out(&Command::SetWeather(rain)).unwrap();
    assert_eq!(stopping(&mut world), dry);
    world
        .carry_out(&Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on: 1, reserved: 0 }))
        .unwrap();
    let wet = stopping(&mut world);
    println!("{dry} m dry, {wet} m wet");
    assert!((1.4..2.0).contains(&(wet / dry)), "{dry} m dry, {wet} m wet");

    let mut state = SavedState::default();
    world.save_into(&mut state);
    let mut other = plain();
    other.restore(&state).unwrap();
    assert_eq!(stopping(&mut other), stopping(&mut world));

    world.carry_out(&Command::SetWeather(Weather::default())).unwrap();
    assert!((stopping(&mut world) / dry - 1.0).abs() < 0.01);
}

/// Three kinematic actors at rest: a box, a car and a walker.
fn standing() -> Sim {
    let mut world = plain();
    for (k, name) in ["static.prop.box01", "vehicle.tesla.model3", "walker.pedestrian.0001"]
        .into_iter()
        .enumerate()
    {
        let pose = Pose::level(Vec3::new(10.0 * k as f32, 0.0, 0.0), 0.3);
        let name = Name::new(name);
        let spawn = Spawn { blueprint: name, pose, flags: flag::KINEMATIC, ..Spawn::default() };
        let id = protocol::ActorId(world.carry_out(&Command::Spawn(spawn)).unwrap());
        world.carry_out(&Command::SetPhysics(SetPhysics { actor_id: id, on: 0 })).unwrap();
    }
    run(&mut world, 4);
    world
}

/// The same simulation with all actors awake.
fn all_awake(of: &Sim) -> Sim {
    let mut state = SavedState::default();
    of.save_into(&mut state);
    let mut other = plain();
    other.restore(&state).unwrap();
    other
}

fn hash(world: &Sim) -> u64 {
    world.state_hash()
}

#[test]
fn a_sleeping_actor_wakes_for_every_command() {
    let id = |k: u32| protocol::ActorId(k + 1);
    let on = |k: u32, on: u32| Switch { actor_id: id(k), on };
    let moved = Teleport { actor_id: id(0), pose: Pose::level(Vec3::new(-5.0, 1.0, 0.0), 0.0) };
    let glides = |k: u32| SetVelocity {
        actor_id: id(k),
        velocity_mps: [1.0, 0.5, 0.0],
        angular_velocity_radps: [0.0, 0.0, 0.2],
    };
    let pedals = VehicleControl { actor_id: id(1), throttle: 0.5, ..VehicleControl::default() };
    let commands = [
        Command::Teleport(moved),
        Command::SetVelocity(glides(0)),
        Command::SetVelocity(glides(1)),
        Command::SetVelocity(glides(2)),
        Command::SetPhysics(SetPhysics { actor_id: id(0), on: 1 }),
        Command::SetPhysics(SetPhysics { actor_id: id(1), on: 1 }),
        Command::Control(pedals),
        Command::SetGravity(on(0, 0)),
        Command::SetCollisions(on(1, 0)),
        Command::SetVehicleLights(SetVehicleLights { actor_id: id(1), lamps: lamp::FOG }),
        Command::SetDoors(SetDoors { actor_id: id(1), open: 1 }),
        Command::Autopilot(Autopilot { actor_id: id(1), on: 1 }),
    ];
    for command in commands {
        let mut rested = standing();
        let before = hash(&rested);
        let mut fresh = all_awake(&rested);
        assert_eq!(hash(&fresh), before, "to rest changes nothing");
        for world in [&mut rested, &mut fresh] {
            world.carry_out(&command).unwrap();
        }
        assert_ne!(hash(&rested), before, "{command:?}");
        for frame in 0..4 {
            assert_eq!(hash(&rested), hash(&fresh), "frame {frame} after {command:?}");
            assert_eq!(rested.states(), fresh.states(), "frame {frame} after {command:?}");
            run(&mut rested, 1);
            run(&mut fresh, 1);
        }
    }
}

#[test]
fn a_sleeping_actor_in_a_collision_is_marked() {
    let mut world = standing();
    let name = Name::new("vehicle.tesla.model3");
    let pose = Pose::level(Vec3::new(0.0, 6.0, 0.0), -std::f32::consts::FRAC_PI_2);
    let spawn = Spawn { blueprint: name, pose, ..Spawn::default() };
    let actor_id = protocol::ActorId(world.carry_out(&Command::Spawn(spawn)).unwrap());
    let velocity_mps = [0.0, -8.0, 0.0];
    world
        .carry_out(&Command::SetVelocity(SetVelocity {
            actor_id,
            velocity_mps,
            ..Default::default()
        }))
        .unwrap();
    let is_hit =
        |world: &Sim| world.world().state(protocol::ActorId(1)).unwrap().has(flag::COLLIDING);
    let hits = (0..40).filter(|_| {
        run(&mut world, 1);
        is_hit(&world)
    });
    assert!(hits.count() > 0);
    world.carry_out(&Command::Destroy(actor_id)).unwrap();
    run(&mut world, 1);
    assert!(!is_hit(&world));
}

fn spawned(world: &mut Sim, blueprint: &str, x: f32) -> protocol::ActorId {
    let pose = Pose::new(Vec3::X * x, glam::Quat::IDENTITY);
    let spawn = Spawn { blueprint: Name::new(blueprint), pose, ..Spawn::default() };
    protocol::ActorId(world.carry_out(&Command::Spawn(spawn)).unwrap())
}

#[test]
fn poses_are_set_on_walkers_only_and_are_part_of_a_saved_state() {
    let mut world = plain();
    let walker = spawned(&mut world, "walker.pedestrian.0001", 0.0);
    let car = spawned(&mut world, "vehicle.tesla.model3", 10.0);
    let hash = |world: &Sim| world.world().physics().hash();
    let before = hash(&world);
    let up = Pose::new(Vec3::Y * 0.1, glam::Quat::from_rotation_x(3.0));
    let good = SetBones { parent_from_bones: [up; 6], count: 6, ..SetBones::default() };
    let mut refused = |set: SetBones, why: &str| {
        let error = world.carry_out(&Command::SetBones(set)).unwrap_err();
        assert!(error.reason.contains(why), "{error}");
    };
    refused(SetBones { actor_id: car, ..good }, "not a walker");
    refused(SetBones { actor_id: protocol::ActorId(99), ..good }, "never spawned");
    let good = SetBones { actor_id: walker, ..good };
    refused(SetBones { first: 61, ..good }, "it has 66");
    refused(SetBones { first: u32::MAX, ..good }, "it has 66");
    refused(SetBones { count: 0, ..good }, "1 to 6");
    refused(SetBones { count: 7, ..good }, "1 to 6");
    for bad in [
        Pose { position_m: [f32::NAN, 0.0, 0.0], ..up },
        Pose { position_m: [30.0, 0.0, 0.0], ..up },
        Pose { rotation: [0.0; 4], ..up },
    ] {
        let mut set = good;
        set.parent_from_bones[5] = bad;
        refused(set, "crl_arm__L");
    }
    let blend = |share| Command::BlendPose(BlendPose { actor_id: walker, weight: share });
    for bad in [-0.1, 1.1, f32::NAN, f32::INFINITY] {
        world.carry_out(&blend(bad)).unwrap_err();
    }
    assert_eq!(world.standing().poses, GivenPoses::default(), "a refused command changes nothing");

    world.carry_out(&Command::SetBones(SetBones { first: 5, count: 1, ..good })).unwrap();
    world.carry_out(&blend(0.25)).unwrap();
    assert!(world.world().state(walker).unwrap().has(flag::POSED));
    assert_eq!(hash(&world), before, "poses do not affect bodies");
    let bones = |sim: &Sim, id, first| {
        sim.answer(&Query::new(QueryKind::Bones, id, first)).body::<SetBones>()
    };
    let first = bones(&world, walker, 0).unwrap();
    assert_eq!((first.count, first.parent_from_bones[5]), (6, up));
    let rest = bones(&world, walker, 60).unwrap();
    assert_eq!((rest.count, rest.parent_from_bones[0].rotation()), (6, glam::Quat::IDENTITY));
    assert!(bones(&world, walker, 66).is_err() && bones(&world, car, 0).is_err());

    let mut state = SavedState::default();
    world.save_into(&mut state);
    let state = SavedState::from_bytes(&state.to_bytes(), 0).unwrap();
    let mut other = plain();
    other.restore(&state).unwrap();
    assert_eq!(other.standing().poses, world.standing().poses);
    assert!(other.world().state(walker).unwrap().has(flag::POSED));

    world.carry_out(&blend(0.0)).unwrap();
    assert!(!world.world().state(walker).unwrap().has(flag::POSED));
    world.carry_out(&Command::Destroy(walker)).unwrap();
    assert_eq!(world.standing().poses, GivenPoses::default());
}

#[test]
fn a_query_returns_the_weather_that_was_set_last() {
    let mut world = plain();
    let query = Query::new(QueryKind::Weather, protocol::ActorId::NONE, 0);
    let weather = |world: &Sim| world.answer(&query).body::<Weather>().unwrap();
    assert_eq!(weather(&world), Weather::default());
    let rain = Weather { precipitation: 80.0, ..Weather::default() };
    world.carry_out(&Command::SetWeather(rain)).unwrap();
    assert_eq!(weather(&world), rain);
}

#[test]
fn a_query_of_an_unknown_kind_or_about_a_missing_actor_is_refused() {
    let mut world = plain();
    let car = spawned(&mut world, "vehicle.tesla.model3", 0.0);
    let body = Query::new(QueryKind::VehicleBody, car, 0);
    assert!(world.answer(&body).body::<VehicleBody>().is_ok());
    let unknown = Query { kind: 99, ..body };
    let why = world.answer(&unknown).body::<VehicleBody>().unwrap_err();
    assert_eq!(why, Refusal::unsupported("unknown query kind 99"));
    let missing = Query { actor_id: protocol::ActorId(7), ..body };
    let why = world.answer(&missing).body::<VehicleBody>().unwrap_err();
    assert!(why.reason.contains("was never spawned"), "{why}");
    assert_eq!(why.code, RefusalCode::UnknownActor);
}

/// Returns the speed of a car that drove over or against a prop at 8 m/s. Metres per second.
fn speed_after(blueprint: &str, flags: u32) -> f32 {
    let mut world = plain();
    let car = spawned(&mut world, "vehicle.tesla.model3", 0.0);
    let (name, pose) = (Name::new(blueprint), Pose::level(Vec3::X * 8.0, 0.0));
    let spawn = Spawn { blueprint: name, pose, flags, ..Spawn::default() };
    world.carry_out(&Command::Spawn(spawn)).unwrap();
    run(&mut world, 10);
    let velocity_mps = [8.0, 0.0, 0.0];
    let go = SetVelocity { actor_id: car, velocity_mps, ..SetVelocity::default() };
    world.carry_out(&Command::SetVelocity(go)).unwrap();
    run(&mut world, 30);
    world.world().state(car).unwrap().velocity().length()
}

#[test]
fn flat_and_soft_props_do_not_stop_a_car_and_light_ones_are_pushed_aside() {
    let free = speed_after("static.prop.mobile", flag::KINEMATIC);
    assert!(free > 6.0, "{free} m/s");
    for passable in
        ["dirtdebris01", "dirtdebris02", "dirtdebris03", "plasticbag", "garbage06", "ironplank"]
    {
        for flags in [0, flag::KINEMATIC] {
            let mps = speed_after(&format!("static.prop.{passable}"), flags);
            assert!((mps - free).abs() < 0.05, "{passable}: {mps} m/s, {free} m/s without it");
        }
    }
    for light in ["trafficcone01", "box01", "plasticchair"] {
        let mps = speed_after(&format!("static.prop.{light}"), 0);
        assert!(mps > 0.85 * free, "{light}: {mps} m/s, {free} m/s without it");
    }
    let mps = speed_after("static.prop.streetbarrier", flag::KINEMATIC);
    assert!(mps < 1.0, "a fixed barrier stops it: {mps} m/s");
}
