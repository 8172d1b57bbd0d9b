//! Numbers that are no quantities: not finite, or beyond every scale of a road.

use std::collections::BTreeSet;

use glam::Vec3;
use protocol::{
    AckermannControl, AckermannSettings, ActorId, ActorState, ApplyForce, Autopilot, BlendPose,
    Command, CommandGroup, EraseShapes, HideLayers, HideObjects, Name, Pose, RawCommand,
    RouteCommand, RouteStep, SetBones, SetDead, SetDoors, SetPhysics, SetStreetLights,
    SetTrafficLight, SetVehicleLights, SetVelocity, SetWeatherAffectsGrip, Settings, Shape, Spawn,
    Switch, Teleport, TrafficParam, VehicleControl, VehiclePhysics, WalkerLimbs, Weather, flag,
    param, shape,
};

use super::{CarryOut, plain, plain_of, run, spawned};
use crate::{SavedState, Sim};

const HOSTILE: &[f32] = &[
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    3e38,
    -3e38,
    1e30,
    -1e30,
    1e10,
    -1e10,
    1e-40,
    9.9e7,
    4.9e4,
    -390.0,
];

const CAR: ActorId = ActorId(1);
const WALKER: ActorId = ActorId(2);
const PROP: ActorId = ActorId(3);

/// A car, a walker and a prop, and a walker that has fallen.
fn crowd() -> Sim {
    let mut sim = plain_of(100.0);
    let names = [
        "vehicle.tesla.model3",
        "walker.pedestrian.0001",
        "static.prop.box01",
        "walker.pedestrian.0002",
    ];
    for (index, name) in names.into_iter().enumerate() {
        spawned(&mut sim, name, 8.0 * index as f32);
    }
    sim.carry_out(&Command::SetDead(SetDead { actor_id: ActorId(4), removes_body: 0 })).unwrap();
    sim
}

/// A valid command of every kind that the simulation itself applies.
fn samples() -> Vec<Command> {
    let VehiclePhysics { body, engine, gearbox, steering, wheels } =
        crowd().world().physics().vehicle_physics(CAR).unwrap();
    let far = Pose::level(Vec3::new(-20.0, 5.0, 0.5), 0.3);
    let light = SetTrafficLight { actor_id: CAR, hold: 1, phase: 1 };
    let push =
        ApplyForce { linear: [10.0; 3], angular: [1.0; 3], has_point: 1, ..ApplyForce::default() };
    let velocity = SetVelocity { velocity_mps: [1.0; 3], ..SetVelocity::default() };
    let steps = [RouteStep::place(Vec3::X); protocol::ROUTE_STEPS];
    let mut commands = vec![
        Command::Destroy(CAR),
        Command::Control(VehicleControl { actor_id: CAR, throttle: 0.5, ..Default::default() }),
        Command::Autopilot(Autopilot { actor_id: CAR, on: 1 }),
        Command::SetTrafficLight(light),
        Command::SetVehicleLights(SetVehicleLights { actor_id: CAR, lamps: 1 }),
        Command::SetDoors(SetDoors { actor_id: CAR, open: 1 }),
        Command::SetBody(body),
        Command::SetEngine(engine),
        Command::SetGearbox(gearbox),
        Command::SetSteering(steering),
        Command::SetWheel(wheels[0]),
        Command::SetCollisions(Switch { actor_id: CAR, on: 0 }),
        Command::Ackermann(AckermannControl {
            actor_id: CAR,
            speed_mps: 5.0,
            ..Default::default()
        }),
        Command::SetAckermann(AckermannSettings { actor_id: CAR, ..Default::default() }),
        Command::Jump(WALKER),
        Command::RouteCommand(RouteCommand {
            actor_id: CAR,
            count: 11,
            steps,
            ..Default::default()
        }),
        Command::SetDead(SetDead { actor_id: WALKER, removes_body: 1 }),
        Command::SetGravity(Switch { actor_id: CAR, on: 0 }),
        Command::SetPhysics(SetPhysics { actor_id: CAR, on: 0 }),
        Command::SetWeather(Weather::default()),
        Command::SetSettings(Settings::default()),
        Command::TrafficParam(TrafficParam { actor_id: CAR, param: param::GAP_M, value: 1.0 }),
        Command::HideLayers(HideLayers { layers: 1, hidden: 1 }),
        Command::HideObjects(HideObjects::default()),
        Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on: 1, reserved: 0 }),
        Command::EraseShapes(EraseShapes::ALL),
        Command::SetBones(SetBones { actor_id: WALKER, count: 6, ..SetBones::default() }),
        Command::BlendPose(BlendPose { actor_id: WALKER, weight: 0.5 }),
        Command::SetStreetLights(SetStreetLights {
            intensity: 1.0,
            ..bytemuck::Zeroable::zeroed()
        }),
    ];
    for kind in [shape::POINT, shape::LINE, shape::ARROW, shape::BOX, shape::TEXT] {
        commands.push(Command::Draw(Shape::new(kind)));
    }
    for actor_id in [CAR, WALKER, PROP, ActorId(4)] {
        commands.push(Command::Teleport(Teleport { actor_id, pose: far }));
        commands.push(Command::SetVelocity(SetVelocity { actor_id, ..velocity }));
        for is_force in [0, 1] {
            commands.push(Command::ApplyForce(ApplyForce { actor_id, is_force, ..push }));
        }
    }
    for name in ["vehicle.audi.tt", "walker.pedestrian.0003", "static.prop.box02"] {
        for flags in [0, flag::KINEMATIC] {
            let blueprint = Name::new(name);
            commands.push(Command::Spawn(Spawn {
                blueprint,
                flags,
                pose: far,
                ..Spawn::default()
            }));
        }
    }
    commands
}

/// The kinds of command that the simulation itself applies.
fn kinds() -> BTreeSet<u32> {
    let is_own = |kind: &u32| {
        let command = with_word(&RawCommand::default(), 0, *kind).decode().map(Command::group);
        matches!(command, Some(CommandGroup::World(_) | CommandGroup::Standing(_)))
    };
    (0..1000).filter(is_own).collect()
}

/// Replaces a word of a command; word 0 is its kind, and its body begins at word 2.
fn with_word(raw: &RawCommand, word: usize, value: u32) -> RawCommand {
    let mut raw = *raw;
    bytemuck::bytes_of_mut(&mut raw)[word * 4..][..4].copy_from_slice(&value.to_ne_bytes());
    raw
}

/// Returns the first number of the world that is not finite.
fn fault(sim: &Sim) -> Option<String> {
    let actor = |state: &ActorState| {
        let ActorState { pose, velocity_mps, angular_velocity_radps, acceleration_mps2, .. } =
            state;
        let vectors = [&pose.position_m, velocity_mps, angular_velocity_radps, acceleration_mps2];
        let scalars = [
            state.throttle,
            state.brake,
            state.steer,
            state.engine_rpm,
            state.wheel_steer_rad,
            state.wheel_spin_rad,
        ];
        let mut all = vectors.into_iter().flatten().chain(&pose.rotation).chain(&scalars);
        let is_fine = pose.is_valid() && all.all(|number| number.is_finite());
        (!is_fine).then(|| format!("{state:?}"))
    };
    let limbs = |walker: &WalkerLimbs| {
        let is_fine = walker.rotations.iter().flatten().all(|number| number.is_finite());
        (!is_fine).then(|| format!("{walker:?}"))
    };
    let weather = bytemuck::cast_slice::<_, f32>(std::slice::from_ref(&sim.standing().weather));
    let weather = weather.iter().any(|number| !number.is_finite());
    let fault = sim.states().iter().find_map(actor).or(sim.world().limbs().iter().find_map(limbs));
    fault.or(weather.then(|| format!("{:?}", sim.standing().weather)))
}

#[test]
fn every_number_of_every_command_is_refused_or_leaves_the_world_finite() {
    let samples = samples();
    let covered: BTreeSet<u32> = samples
        .iter()
        .map(|command| {
            bytemuck::pod_read_unaligned(&bytemuck::bytes_of(&RawCommand::from(*command))[..4])
        })
        .collect();
    assert_eq!(covered, kinds(), "a sample of every kind of command");
    let (mut faults, mut refusals, mut accepted) = (BTreeSet::new(), 0, 0);
    for sample in &samples {
        let raw = RawCommand::from(*sample);
        for word in 2..92 {
            let mut sim = crowd();
            for value in HOSTILE {
                let command = with_word(&raw, word, value.to_bits());
                let is_read = |decoded: Command| RawCommand::from(decoded) == command;
                if !command.decode().is_some_and(is_read) {
                    break;
                }
                if sim.carry_out(&command.decode().unwrap()).is_err() {
                    refusals += 1;
                    continue;
                }
                accepted += 1;
                run(&mut sim, 3);
                if let Some(fault) = fault(&sim) {
                    faults.insert(format!("{sample:?}\n  word {word} {value:e}:\n  {fault}"));
                    sim = crowd();
                }
            }
        }
    }
    println!("{refusals} refused, {accepted} accepted");
    for fault in &faults {
        println!("{fault}");
    }
    assert!(faults.is_empty(), "{} commands", faults.len());
}

#[test]
fn the_greatest_forces_leave_the_world_finite() {
    for is_force in [0, 1] {
        for [linear, angular] in [[1.0, 0.0], [0.0, 1.0], [0.57, 0.57]] {
            let mut sim = crowd();
            for frame in 0..300 {
                for actor_id in [CAR, PROP] {
                    let push = ApplyForce {
                        actor_id,
                        is_force,
                        linear: [1e8 * linear, 0.0, 0.0],
                        angular: [0.0, 0.7e8 * angular, 0.7e8 * angular],
                        ..ApplyForce::default()
                    };
                    sim.carry_out(&Command::ApplyForce(push)).unwrap();
                }
                run(&mut sim, 1);
                if let Some(fault) = fault(&sim) {
                    panic!("frame {frame}: {fault}");
                }
            }
        }
    }
}

#[test]
fn what_falls_or_drives_for_days_stays_finite() {
    let mut sim = crowd();
    let settings = Settings {
        delta_nanos: 10_000_000_000,
        substep_max_nanos: 100_000_000,
        ..Settings::default()
    };
    sim.carry_out(&Command::SetSettings(settings)).unwrap();
    let edge = |y: f32| Pose::level(Vec3::new(4.9e4, y, 4.9e4), 0.1);
    for (actor_id, y) in [(CAR, 0.0), (WALKER, 10.0), (PROP, 20.0), (ActorId(4), 30.0)] {
        let pose = edge(y);
        sim.carry_out(&Command::Teleport(Teleport { actor_id, pose })).unwrap();
    }
    let fast = sim.carry_out(&Command::Spawn(Spawn {
        blueprint: Name::new("vehicle.audi.tt"),
        pose: edge(40.0),
        flags: flag::KINEMATIC,
        ..Spawn::default()
    }));
    let velocity_mps = [230.0; 3];
    sim.carry_out(&Command::SetVelocity(SetVelocity {
        actor_id: ActorId(fast.unwrap()),
        velocity_mps,
        angular_velocity_radps: [50.0; 3],
    }))
    .unwrap();
    for frame in 0..1000 {
        run(&mut sim, 1);
        if let Some(fault) = fault(&sim) {
            panic!("frame {frame}: {fault}");
        }
    }
}

#[test]
fn a_saved_state_brings_no_number_that_is_not_finite() {
    let mut sim = crowd();
    sim.carry_out(&Command::SetWeather(Weather { wetness: 50.0, ..Weather::default() })).unwrap();
    run(&mut sim, 3);
    let mut saved = SavedState::default();
    sim.save_into(&mut saved);
    for value in [f32::NAN, f32::INFINITY, 3e38] {
        let mut of_actor = saved.clone();
        of_actor.actors[1].acceleration_mps2[2] = value;
        let mut of_limbs = saved.clone();
        of_limbs.limbs[0].rotations[3][1] = value;
        for state in [of_actor, of_limbs] {
            let mut other = plain();
            let why = other.restore(&state).unwrap_err().to_string();
            assert!(why.contains("not finite"), "{why}");
            assert!(other.states().is_empty());
        }
        let mut of_weather = saved.clone();
        let weather = Weather { wetness: value, ..Weather::default() };
        of_weather.standing[0].command = Command::SetWeather(weather).into();
        let mut other = plain();
        other.restore(&of_weather).unwrap();
        assert_eq!(other.standing().weather, Weather::default());
    }
    plain().restore(&saved).unwrap();
}
