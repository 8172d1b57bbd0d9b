//! Physics sensors over the bus: every frame is exact, and they do not change the world.

use client_lib::{
    ActorId, Client, GnssSpec, ImuSpec, ObstacleSpec, OdometrySpec, SensorSpec, Spawn, camera,
    collision, gnss, imu, lane_invasion, obstacle, odometry,
    wire::{SetVelocity, output, tracer},
};
use glam::{Quat, Vec3};
use protocol::{Command, Name, ObstacleReading, Pose};

use crate::kit::{DELTA_NANOS, Scratch, Sim, omnibus, small_map};

const TESLA: &str = "vehicle.tesla.model3";

/// One sensor of each kind; the receiver measures every second frame.
fn sensors() -> Vec<SensorSpec> {
    let mast = Pose::new(Vec3::new(0.5, 0.2, 1.5), Quat::IDENTITY);
    let errors = ImuSpec { accelerometer_stddev_mps2: [0.02; 3], ..ImuSpec::default() };
    let look = ObstacleSpec { distance_m: 30.0, only_dynamics: 1, ..ObstacleSpec::default() };
    vec![
        SensorSpec { seed: 7, ..imu("imu", mast, errors) },
        SensorSpec {
            period_nanos: 2 * DELTA_NANOS,
            ..gnss("gnss", mast, GnssSpec { wander_m: 1.0, ..GnssSpec::default() })
        },
        odometry("odometry", Pose::IDENTITY, OdometrySpec::default()),
        collision("collision"),
        lane_invasion("lanes"),
        obstacle("obstacle", mast, look),
    ]
}

/// A car that drives into a car parked 12 m ahead.
fn scene(client: &mut Client) -> (ActorId, ActorId) {
    let place = client.spawn_points().unwrap()[0];
    let ahead = place.then(&Pose::new(Vec3::new(14.0, 0.0, 0.0), Quat::IDENTITY));
    let hero = client.spawn(Spawn::new(TESLA, place)).unwrap();
    let other = client.spawn(Spawn::new(TESLA, ahead)).unwrap();
    (hero, other)
}

fn go(client: &mut Client, hero: ActorId) {
    let ahead = client.world().state(hero).unwrap().pose.rotation() * Vec3::X;
    let velocity_mps = (ahead * 8.0).to_array();
    let to = SetVelocity { actor_id: hero, velocity_mps, ..SetVelocity::default() };
    client.request("velocity", &[Command::SetVelocity(to)]).unwrap();
}

/// Returns the state hash of each frame, and the measurements as bytes.
fn run(with_sensors: bool) -> (Vec<u64>, Vec<Vec<u8>>) {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (hero, other) = scene(&mut client);
    let mut bundle =
        with_sensors.then(|| client.create_bundle("felt", hero, &sensors(), 2).unwrap());
    let (mut hashes, mut said) = (Vec::new(), Vec::new());
    let (mut touches, mut nearest) = (0, f32::MAX);
    for tick in 0..60 {
        if tick == 20 {
            go(&mut client, hero);
        }
        let mut bundles: Vec<_> = bundle.iter_mut().collect();
        let (frame, measured) = client.tick_and_collect(&mut bundles).unwrap();
        let header = *client.world().header();
        hashes.push(header.state_hash);
        let Some(felt) = measured.into_iter().next() else { continue };
        let felt = felt.expect("the inertial unit speaks every frame");
        assert_eq!(felt.frame(), frame);
        assert_eq!(
            (felt.header().state_hash, felt.header().tracer),
            (header.state_hash, tracer::HOST)
        );
        let car = *client.world().state(hero).unwrap();
        assert_eq!(felt.header().world_from_parent, car.pose);
        let speed = felt.odometry(2).unwrap().speed_mps;
        let truth = car.velocity().dot(car.pose.rotation() * Vec3::X);
        assert!((speed - truth).abs() < 1e-4, "{speed} {truth}");
        // At the first frame of the bundle, and at every second one since.
        assert_eq!(felt.gnss(1).is_some(), tick % 2 == 0);
        let up = felt.imu(0).unwrap().accelerometer_mps2[2];
        // It stands from the drop at the spawn until it drives off.
        assert!(!(15..20).contains(&tick) || (up - 9.81).abs() < 0.3, "{up}");
        touches += felt.collisions(3).iter().filter(|hit| hit.other == other).count();
        if let Some(ObstacleReading { distance_m, other: seen, .. }) = felt.obstacle(5) {
            assert_eq!(*seen, other);
            nearest = nearest.min(*distance_m);
        }
        let planes = felt.planes().iter();
        said.push(
            planes.flat_map(|p| felt.data(p.sensor as usize, p.output).unwrap().to_vec()).collect(),
        );
    }
    if with_sensors {
        assert!(touches > 0 && nearest < 3.0, "{touches} touches, {nearest} m");
    }
    drop(client);
    sim.end();
    (hashes, said)
}

#[test]
fn physics_sensors_change_no_bit_of_the_state_and_are_reproducible() {
    let (alone, _) = run(false);
    let (measured, said) = run(true);
    assert_eq!(alone, measured);
    assert_eq!((measured, said), run(true));
}

#[test]
fn a_bundle_has_rendered_or_physics_sensors_and_each_number_is_checked() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (hero, _) = scene(&mut client);
    let eye = camera("eye", Pose::IDENTITY, 64, 48, 1.0, output::COLOR);
    let refused = |client: &mut Client, specs: &[SensorSpec], words: &[&str]| {
        let said = client.create_bundle("r", hero, specs, 2).expect_err("refused").to_string();
        words.iter().for_each(|word| assert!(said.contains(word), "{said} lacks {word}"));
    };
    let bad =
        imu("imu", Pose::IDENTITY, ImuSpec { gyroscope_walk: f32::NAN, ..ImuSpec::default() });
    refused(&mut client, &[bad], &["\"imu\"", "gyroscope_walk is NaN"]);
    refused(&mut client, &[collision("hit"), eye], &["\"r\"", "make a bundle of each"]);
    let odd = SensorSpec { outputs: output::IMU, ..collision("hit") };
    refused(&mut client, &[odd], &["\"hit\"", "outputs are"]);
    refused(&mut client, &[SensorSpec { kind: 99, ..eye }], &["unknown sensor type 99"]);

    // Both at one tick; sensors are removed with their carrier.
    let mut seen = client.create_bundle("seen", hero, &[eye], 2).unwrap();
    let mut felt = client.create_bundle("felt", hero, &sensors(), 2).unwrap();
    for _ in 0..5 {
        let (frame, both) = client.tick_and_collect(&mut [&mut seen, &mut felt]).unwrap();
        assert!(both.iter().all(|m| m.as_ref().is_some_and(|m| m.frame() == frame)));
    }
    assert_eq!((seen.missed(), felt.missed()), (0, 0));
    client.destroy(hero).unwrap();
    for _ in 0..3 {
        client.tick().unwrap();
        assert!(felt.receive().unwrap().is_none());
    }
    // A map that is loaded again has its own roads.
    client.reload_map().unwrap();
    let (hero, _) = scene(&mut client);
    let mut felt = client.create_bundle("felt", hero, &sensors(), 2).unwrap();
    let (_, told) = client.tick_and_collect(&mut [&mut felt]).unwrap();
    assert_eq!(told[0].as_ref().unwrap().header().stamp.episode, 2);
    assert!(felt.sensors()[1].name == Name::new("gnss"));
    drop(client);
    sim.end();
}

/// Returns the lines of a data set's frame list.
fn collected(folder: &std::path::Path, frames: &str, more: &[&str]) -> String {
    let small = ["--vehicles", "3", "--width", "64", "--height", "48", "--every", "3"];
    let output = omnibus()
        .args(["collect", "--map", small_map(), "--device", "cpu", "--warmup", "10"])
        .args(["--frames", frames, "--out", folder.to_str().unwrap()])
        .args(small)
        .args(more)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(folder.join("frames.jsonl")).unwrap()
}

#[test]
fn a_data_set_has_the_ego_sensors_of_every_frame() {
    let scratch = Scratch::new();
    let whole = collected(&scratch.path().join("whole"), "4", &[]);
    let mut last = None;
    for line in whole.lines() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        let frame = line["frame"].as_u64().unwrap();
        let felt = line["ego_sensors"].as_array().unwrap();
        let frames: Vec<u64> = felt.iter().map(|f| f["frame"].as_u64().unwrap()).collect();
        let from = last.unwrap_or(frames[0] - 1);
        assert_eq!(frames, (from + 1..=frame).collect::<Vec<_>>());
        last = Some(frame);
        let numbers = |value: &serde_json::Value| -> Vec<f64> {
            value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
        };
        let newest = felt.last().unwrap();
        let speed = numbers(&line["ego"]["velocity_mps"]).iter().map(|v| v * v).sum::<f64>().sqrt();
        let shown = newest["odometry"]["speed_mps"].as_f64().unwrap();
        assert!((shown - speed).abs() < 0.1, "{shown} {speed}");
        let up = numbers(&newest["imu"]["accelerometer_mps2"])[2];
        assert!((up - 9.81).abs() < 1.5, "{up}");
        let turn = numbers(&newest["imu"]["gyroscope_radps"])[2];
        let yaw = newest["odometry"]["yaw_rate_radps"].as_f64().unwrap();
        assert!((turn - yaw).abs() < 0.1, "{turn} {yaw}");
    }
    // A resumed data set is the same.
    let parts = scratch.path().join("parts");
    collected(&parts, "2", &[]);
    assert_eq!(collected(&parts, "4", &["--resume", "--pipeline", "3"]), whole);
}
