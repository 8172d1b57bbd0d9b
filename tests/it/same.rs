//! The same seed gives the same run: across process layouts, observers and process speeds.

use client_lib::{
    Client, Pose, Spawn,
    wire::{camera, lidar},
};
use glam::{Quat, Vec3};
use mesh::WordHash;
use omnibus::{BackgroundHost, WorldArgs};
use protocol::{
    AckermannControl, ActorId, ApplyForce, Command, SetVelocity, Settings, Switch, Teleport, output,
};

use crate::kit::{DELTA_NANOS, Sim, is_soak, small_map};

const VEHICLES: usize = 100;

fn frames() -> u64 {
    if is_soak() { 2000 } else { 1000 }
}

/// The result of a run.
#[derive(Debug, PartialEq)]
struct Run {
    hashes: Vec<u64>,
    collisions: u32,
    vehicles: usize,
    /// Hashes of depth, tags and ids of every measured frame.
    measured: Vec<u64>,
    /// The first measured frame.
    first: u64,
}

/// How a run is observed; none of it may change the result.
#[derive(Clone, Copy, Default)]
struct Look {
    measuring: bool,
    pipeline: u32,
}

/// A fixed scenario: a hundred cars in traffic; every 40 frames one is thrown against another;
/// every 60 frames one is destroyed and a new one is spawned.
fn play(client: &mut Client, look: Look) -> Run {
    client.synchronise(std::time::Duration::from_nanos(DELTA_NANOS)).unwrap();
    let settings = Settings { pipeline: look.pipeline, ..client.wire_settings() };
    client.apply_wire_settings(settings).unwrap();
    let places = client.spawn_points().unwrap();
    let mut places = places.iter().cycle();
    let mut cars = Vec::new();
    let blueprints = ["vehicle.tesla.model3", "vehicle.audi.tt", "vehicle.carlamotors.firetruck"];
    let mut next = |client: &mut Client, cars: &mut Vec<ActorId>| loop {
        let blueprint = blueprints[cars.len() % blueprints.len()];
        let place = places.next().unwrap();
        if let Ok(car) = client.spawn(Spawn::new(blueprint, *place).autopilot()) {
            cars.push(car);
            break;
        }
    };
    while cars.len() < VEHICLES {
        next(client, &mut cars);
    }
    crate::crash::spawn_walkers(client, 30).unwrap();
    let mut bundle = look.measuring.then(|| {
        let roof = Pose::new(Vec3::Z * 2.5, Quat::IDENTITY);
        let sensors = [
            camera("front", roof, 96, 72, 1.5, output::DEPTH | output::TAG | output::INSTANCE),
            lidar("lidar", roof, 8, 90, [-0.4, 0.1], 60.0),
        ];
        client.create_bundle("look", cars[0], sensors, 4).unwrap()
    });
    let mut run = Run { hashes: vec![], collisions: 0, vehicles: 0, measured: vec![], first: 0 };
    for frame in 1..=frames() {
        if frame % 40 == 0 {
            let [target, bullet] =
                [frame / 40, frame / 40 + 37].map(|n| cars[n as usize % VEHICLES]);
            if let Some(pose) = client.world().state(target).map(|a| a.pose) {
                let ahead = pose.rotation() * Vec3::X;
                let facing = pose.rotation() * Quat::from_rotation_z(std::f32::consts::PI);
                let at = pose.position() + ahead * 8.0 + Vec3::Z * 0.2;
                let teleport = Teleport { actor_id: bullet, pose: Pose::new(at, facing) };
                let velocity_mps = (ahead * -15.0).to_array();
                let push = SetVelocity { actor_id: bullet, velocity_mps, ..Default::default() };
                client.send(&[Command::Teleport(teleport), Command::SetVelocity(push)]).unwrap();
            }
        }
        if frame % 50 == 0 {
            meddle(client, &cars, frame as usize);
        }
        if frame % 60 == 0 {
            let gone = cars.remove((frame / 60) as usize % 50 + 1);
            client.send(&[Command::Destroy(gone)]).unwrap();
            next(client, &mut cars);
        }
        client.tick().unwrap();
        let header = client.world().header();
        run.hashes.push(header.state_hash);
        run.collisions += header.collisions;
        if let Some(bundle) = &mut bundle {
            while let Some(measured) = bundle.receive().unwrap() {
                if run.measured.is_empty() {
                    run.first = measured.frame().0;
                }
                run.measured.push(digest(&measured));
            }
        }
    }
    if let Some(bundle) = &mut bundle {
        while run.measured.len() < frames() as usize {
            let measured = client.await_measurement(bundle);
            let measured = measured.unwrap_or_else(|e| {
                panic!(
                    "{e}: {} of {} came, from frame {} to {}, {} were missed",
                    run.measured.len(),
                    frames(),
                    run.first,
                    bundle.last(),
                    bundle.missed()
                )
            });
            run.measured.push(digest(&measured));
        }
    }
    run.vehicles =
        client.world().states().iter().filter(|a| a.kind == protocol::kind::VEHICLE).count();
    run
}

/// One car gets other physics, one is pushed, one has no gravity, one is driven by a controller,
/// and a walker stands in the way.
fn meddle(client: &mut Client, cars: &[ActorId], frame: usize) {
    let one = |nth: usize| cars[(frame / 50 * 7 + nth) % cars.len()];
    let mut physics = client.vehicle_physics(one(0)).unwrap();
    physics.body.mass_kg *= 1.2;
    physics.wheels[0].grip = 0.7;
    let mut commands = physics.commands(one(0));
    let push = ApplyForce {
        actor_id: one(1),
        is_force: 1,
        linear: [0.0, 4e4, 0.0],
        ..ApplyForce::default()
    };
    commands.push(Command::ApplyForce(push));
    let on = u32::from(frame.is_multiple_of(100));
    commands.push(Command::SetGravity(Switch { actor_id: one(2), on }));
    commands.push(Command::SetCollisions(Switch { actor_id: one(3), on }));
    let drive = AckermannControl { actor_id: one(4), speed_mps: 6.0, ..Default::default() };
    commands.push(Command::Ackermann(drive));
    client.send(&commands).unwrap();
    if let Some(car) = client.world().state(one(5)) {
        let ahead = car.pose.position() + car.pose.rotation() * Vec3::X * 6.0;
        let walker = Spawn::new("walker.pedestrian.0001", Pose::level(ahead, 0.0)).ragdoll_on_hit();
        // There may be no free spawn point.
        if let Ok(walker) = client.spawn(walker) {
            client.send(&[Command::Jump(walker)]).unwrap();
        }
    }
}

fn digest(measured: &client_lib::Measurement) -> u64 {
    let mut digest = WordHash::new();
    for plane in measured.planes() {
        digest.bytes(measured.data(plane.sensor as usize, plane.output).unwrap());
    }
    digest.value()
}

fn as_processes(args: &[&str], variables: &[(&str, &str)], look: Look) -> Run {
    let sim = Sim::start_with(args, variables);
    let run = play(&mut sim.client("player"), look);
    sim.end();
    run
}

fn as_one_process(look: Look) -> Run {
    let mut args = WorldArgs::of_map(small_map());
    args.single_process = true;
    args.seed = Some(3);
    args.device = "cpu".to_owned();
    args.name = Some(format!("one-{}", std::process::id() % 100_000));
    let host =
        BackgroundHost::start(&args, Settings { synchronous: 1, ..Settings::default() }).unwrap();
    let run = play(&mut host.connect("player").unwrap(), look);
    host.end().unwrap();
    run
}

fn first_difference(a: &Run, b: &Run) -> Option<usize> {
    a.hashes.iter().zip(&b.hashes).position(|(a, b)| a != b)
}

#[test]
fn two_runs_with_one_seed_are_identical_frame_by_frame() {
    let first = as_processes(&["--seed", "3"], &[], Look::default());
    assert_eq!(first.hashes.len(), frames() as usize);
    assert!(u64::from(first.collisions) >= frames() / 100, "{} collisions", first.collisions);
    assert!(first.vehicles >= VEHICLES - 1, "{} vehicles", first.vehicles);
    let seeing = Look { measuring: true, pipeline: 0 };
    let trailing = Look { measuring: true, pipeline: 3 };
    let slow = [("OMNIBUS_DELAY", "traffic:1500")];
    let seen = as_processes(&["--seed", "3", "--threads", "2"], &[], seeing);
    let variants = [
        ("again", as_processes(&["--seed", "3"], &[], Look::default())),
        ("traffic slowed", as_processes(&["--seed", "3"], &slow, Look::default())),
        ("one process", as_one_process(Look::default())),
        ("one tracer thread", as_processes(&["--seed", "3", "--threads", "1"], &[], seeing)),
        ("pipelined", as_processes(&["--seed", "3"], &[], trailing)),
    ];
    println!(
        "hash of frame {}: {:016x}, {} collisions",
        frames(),
        first.hashes.last().unwrap(),
        first.collisions
    );
    for (name, run) in variants.iter().chain([&("with sensors", seen.clone_hashes())]) {
        println!("{name}: {:016x}", run.hashes.last().unwrap());
        if let Some(at) = first_difference(&first, run) {
            panic!("{name}: another state from frame {} of the play on", at + 1);
        }
        assert_eq!(run.collisions, first.collisions, "{name}");
        if !run.measured.is_empty() {
            let at = run.measured.iter().zip(&seen.measured).position(|(a, b)| a != b);
            assert_eq!(at, None, "{name}: other bytes were measured");
            assert_eq!(run.measured.len(), seen.measured.len(), "{name}");
        }
    }
    let other = as_processes(&["--seed", "4"], &[], Look::default());
    assert!(
        first_difference(&first, &other).is_some_and(|at| at < 100),
        "another seed, another run"
    );
}

impl Run {
    fn clone_hashes(&self) -> Run {
        Run { hashes: self.hashes.clone(), measured: vec![], ..*self }
    }
}
