//! Physics sensors over the bus: every frame is exact, and they do not change the world.

use std::time::Duration;

use client_lib::{
    ActorId, Client, DetectedObject, GnssOptions, ImuOptions, LaneSide, Measurement,
    ObstacleOptions, OdometryOptions, Sensor, Spawn, V2xAwarenessOptions, V2xRadioFlags,
    V2xRadioOptions, V2xStationType,
    wire::{
        CamReading, CollisionReading, GnssReading, GnssSpec, ImuReading, ImuSpec,
        LaneInvasionReading, MessageReading, ObstacleReading, ObstacleSpec, OdometryReading,
        OdometrySpec, SensorSpec, SetVelocity, camera, collision, gnss, imu, lane_invasion,
        obstacle, odometry, output, tracer,
    },
};
use glam::{Quat, Vec3};
use protocol::{Command, Name, Pose};

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
        with_sensors.then(|| client.create_bundle("felt", hero, sensors(), 2).unwrap());
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
        let up = felt.imu(0).unwrap().accelerometer.z;
        // It stands from the drop at the spawn until it drives off.
        assert!(!(15..20).contains(&tick) || (up - 9.81).abs() < 0.3, "{up}");
        touches +=
            felt.collisions(3).iter().filter(|hit| hit.other().actor() == Some(other)).count();
        if let Some(seen) = felt.obstacle(5) {
            assert_eq!(seen.object, DetectedObject::Actor(other));
            nearest = nearest.min(seen.distance_m);
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

/// The sensors of [`sensors`], and a station of each kind, described by types.
fn typed_sensors() -> Vec<Sensor> {
    let mast = Pose::new(Vec3::new(0.5, 0.2, 1.5), Quat::IDENTITY);
    let errors = ImuOptions::default().accelerometer_stddev(Vec3::splat(0.02));
    let sweep = ObstacleOptions::default().distance_m(30.0).only_actors(true);
    let radio = V2xRadioOptions::default().flags(V2xRadioFlags::FIXED_RATE);
    vec![
        Sensor::imu("imu", mast, errors).seed(7),
        Sensor::gnss("gnss", mast, GnssOptions::default().wander_m(1.0))
            .period(Duration::from_nanos(2 * DELTA_NANOS)),
        Sensor::odometry("odometry", Pose::IDENTITY, OdometryOptions::default()),
        Sensor::collision("collision"),
        Sensor::lane_invasion("lanes"),
        Sensor::obstacle("obstacle", mast, sweep),
        Sensor::v2x_awareness("cam", mast, V2xAwarenessOptions::default().radio(radio)),
        Sensor::v2x_messages("text", mast, radio),
    ]
}

/// Compares every typed reading of `felt` with its wire record; returns the number of readings of
/// each sensor.
fn compare_with_wire(felt: &Measurement) -> [usize; 8] {
    let imu = felt.readings::<ImuReading>(0).first();
    let fix = felt.readings::<GnssReading>(1).first();
    let odometry = felt.readings::<OdometryReading>(2).first();
    let hits = felt.readings::<CollisionReading>(3);
    let crossed = felt.readings::<LaneInvasionReading>(4);
    let seen = felt.readings::<ObstacleReading>(5).first();
    let cams = felt.readings::<CamReading>(6);
    let texts = felt.readings::<MessageReading>(7);
    assert_eq!(
        felt.imu(0).map(|r| (r.accelerometer, r.gyroscope, r.compass_rad)),
        imu.map(|r| (r.accelerometer_mps2.into(), r.gyroscope_radps.into(), r.compass_rad))
    );
    for (typed, wire) in felt.imu(0).iter().zip(imu) {
        assert_eq!(typed.averaged_over, Duration::from_secs_f32(wire.over_secs));
    }
    assert_eq!(
        felt.gnss(1).map(|r| [r.latitude_deg, r.longitude_deg, r.altitude_m]),
        fix.map(|r| [r.latitude_deg, r.longitude_deg, r.altitude_m])
    );
    assert_eq!(
        felt.odometry(2).map(|r| (
            [r.speed_mps, r.wheel_speed_mps, r.yaw_rate_radps, r.steer_rad],
            r.distance_m
        )),
        odometry.map(|r| (
            [r.speed_mps, r.wheel_speed_mps, r.yaw_rate_radps, r.steer_rad],
            r.distance_m
        ))
    );
    assert_eq!(felt.collisions(3).len(), hits.len());
    for (typed, wire) in felt.collisions(3).iter().zip(hits) {
        assert_eq!(typed.other().actor().unwrap_or(ActorId::NONE), wire.other);
        assert_eq!(typed.tag() as u32, wire.tag);
        assert_eq!(typed.is_first_contact(), wire.began == 1);
        assert_eq!(typed.impulse().to_array(), wire.impulse_ns);
    }
    assert_eq!(felt.lane_invasions(4).len(), crossed.len());
    for (typed, wire) in felt.lane_invasions(4).iter().zip(crossed) {
        assert_eq!(typed.marking() as u32, wire.kind);
        assert_eq!(typed.color() as u32, wire.color);
        assert_eq!(typed.permitted_change() as u32, wire.change);
        assert_eq!(typed.corner() as u32, wire.corner);
        assert_eq!(typed.side() == LaneSide::Left, wire.to_left == 1);
        assert_eq!(
            (typed.from_lane().0, typed.from_lane_id()),
            (wire.from_lane, wire.from_lane_id)
        );
        assert_eq!(typed.width_m(), wire.width_m);
    }
    assert_eq!(
        felt.obstacle(5).map(|r| (r.object.actor(), r.tag as u32, r.distance_m)),
        seen.map(|r| (Some(r.other), r.tag, r.distance_m))
    );
    assert_eq!(felt.awareness_messages(6).len(), cams.len());
    for (typed, wire) in felt.awareness_messages(6).iter().zip(cams) {
        assert_eq!((typed.sender().0, typed.power_dbm()), (wire.station_id, wire.power_dbm));
        assert_eq!((typed.station_type(), wire.station_type), (V2xStationType::PassengerCar, 5));
        assert_eq!(typed.generation_time().as_millis(), u128::from(wire.generation_delta_ms));
        assert_eq!(
            [typed.latitude_deg(), typed.longitude_deg(), typed.altitude_m()],
            [wire.latitude_deg, wire.longitude_deg, wire.altitude_m]
        );
        assert_eq!(
            [typed.heading_rad(), typed.speed_mps(), typed.length_m(), typed.width_m()],
            [wire.heading_rad, wire.speed_mps, wire.length_m, wire.width_m]
        );
        assert_eq!(typed.acceleration().to_array(), wire.acceleration_mps2);
        assert_eq!(typed.yaw_rate_radps(), wire.yaw_rate_radps);
        assert_eq!(typed.is_reversing(), wire.drive_direction == 1);
        assert_eq!(typed.low_frequency().is_some(), wire.has_low_frequency == 1);
    }
    assert_eq!(felt.text_messages(7).len(), texts.len());
    for (typed, wire) in felt.text_messages(7).iter().zip(texts) {
        assert_eq!((typed.sender().0, typed.power_dbm()), (wire.station_id, wire.power_dbm));
        assert_eq!(typed.text(), wire.text());
    }
    let header = felt.header();
    assert_eq!((felt.state_hash(), felt.episode()), (header.state_hash, header.stamp.episode));
    assert_eq!(
        (felt.parent(), felt.world_from_parent()),
        (Some(header.parent), header.world_from_parent)
    );
    let planes = felt.planes();
    let pose = planes.iter().find(|plane| plane.sensor == 2).map(|plane| plane.world_from_sensor);
    assert_eq!(felt.world_from_sensor(2), pose);
    [
        imu.iter().len(),
        fix.iter().len(),
        odometry.iter().len(),
        hits.len(),
        crossed.len(),
        seen.iter().len(),
        cams.len(),
        texts.len(),
    ]
}

#[test]
fn typed_sensors_and_readings_are_those_of_the_wire() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (hero, other) = scene(&mut client);
    let typed = typed_sensors();
    let mut felt = client.create_bundle("felt", hero, &typed, 2).unwrap();
    assert_eq!(felt.sensors()[..6], sensors()[..]);
    let stations = client.create_bundle("stations", other, typed[6..].iter(), 2).unwrap();
    let mut readings = [0; 8];
    for tick in 0..60 {
        if tick == 20 {
            go(&mut client, hero);
            client.transmit(&stations, 1, "brake").unwrap();
        }
        let (_, measured) = client.tick_and_collect(&mut [&mut felt]).unwrap();
        let measured = measured[0].as_ref().expect("the IMU measures in every frame");
        assert_eq!(measured.episode(), client.world().episode());
        assert_eq!(measured.state_hash(), client.world().state_hash());
        assert!(
            measured.text_messages(7).iter().all(|m| m.text() == "brake" && m.sender() == other)
        );
        let counts = compare_with_wire(measured);
        (0..8).for_each(|sensor| readings[sensor] += counts[sensor]);
    }
    let [imu, gnss, odometry, collisions, _, obstacles, cams, texts] = readings;
    assert_eq!((imu, gnss, odometry, texts), (60, 30, 60, 1), "{readings:?}");
    assert!(collisions > 0 && obstacles > 0 && cams > 0, "{readings:?}");
    drop((felt, stations, client));
    sim.end();
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
    let mut seen = client.create_bundle("seen", hero, [eye], 2).unwrap();
    let mut felt = client.create_bundle("felt", hero, sensors(), 2).unwrap();
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
    let mut felt = client.create_bundle("felt", hero, sensors(), 2).unwrap();
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
