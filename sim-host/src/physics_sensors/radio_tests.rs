//! Tests of two radio stations.

use glam::Vec3;
use protocol::{
    ActorId, CamReading, CamSpec, MessageReading, MessageSpec, Pose, RadioSpec, SensorSpec,
    SnapshotHeader, Stamp, TEXT_BYTES, radio,
};

use super::{
    Noise, PhysicsSensor, Scene, State,
    radio::Transmission,
    tests::{Bench, spawn},
};

/// Radio without shadow fading, in town.
fn quiet() -> RadioSpec {
    RadioSpec { flags: 0, scenario: radio::URBAN, ..RadioSpec::default() }
}

struct Pair {
    bench: Bench,
    stations: [(ActorId, PhysicsSensor); 2],
    nanos: u64,
}

impl Pair {
    /// Places the second station `away` metres from the first, along x.
    fn new(make: impl Fn() -> SensorSpec, away: Vec3) -> Pair {
        let mut bench = Bench::new();
        let other = spawn(&mut bench.world, Pose::level(away, 0.0));
        (0..5).for_each(|_| drop(bench.tick()));
        let sensor = || PhysicsSensor::new(&make(), protocol::BundleReceipt::default()).unwrap();
        Pair { stations: [(bench.carrier, sensor()), (other, sensor())], bench, nanos: 0 }
    }

    /// Simulates one frame and returns the readings of each station as bytes.
    fn tick(&mut self) -> [Vec<u8>; 2] {
        self.bench.tick();
        self.nanos += 50_000_000;
        let header = SnapshotHeader {
            stamp: Stamp { sim_time_nanos: self.nanos, ..Stamp::default() },
            delta_nanos: 50_000_000,
            ..SnapshotHeader::default()
        };
        let Bench { world, network, .. } = &self.bench;
        let scene = |parent| Scene { world, network: Some(network), parent, header: &header };
        let mut air: Vec<Transmission> = Vec::new();
        for (id, sensor) in &mut self.stations {
            let State::Radio(station) = &mut sensor.state else { panic!("a radio") };
            let pose = world.state(*id).unwrap().pose;
            station.send(&scene(*id), &pose, &mut Noise::at(0, self.nanos), &mut air);
        }
        let mut receive = |index: usize| {
            let (id, sensor) = &mut self.stations[index];
            let pose = world.state(*id).unwrap().pose;
            sensor.measure(&scene(*id), &pose, &air, 64)
        };
        [receive(0), receive(1)]
    }
}

fn cams(bytes: &[u8]) -> Vec<CamReading> {
    bytemuck::pod_collect_to_vec(bytes)
}

#[test]
fn each_station_receives_the_other_with_the_path_loss_of_the_distance() {
    let make = || {
        SensorSpec::physics(
            "v2x",
            Pose::IDENTITY,
            &CamSpec { radio: quiet(), ..CamSpec::default() },
        )
    };
    let mut pair = Pair::new(make, Vec3::new(-100.0, 0.0, 0.0));
    let [first, second] = pair.tick().map(|bytes| cams(&bytes));
    let ids = [pair.stations[0].0.0, pair.stations[1].0.0];
    assert_eq!((first.len(), second.len()), (1, 1));
    assert_eq!([second[0].station_id, first[0].station_id], ids);
    // 21.5 + 10 − (38.77 + 16.7 · 2 + 18.2 · lg 5.9) dBm at 100 m.
    assert!((first[0].power_dbm + 54.70).abs() < 0.1, "{}", first[0].power_dbm);
    let message = first[0];
    assert_eq!(
        (message.station_type, message.drive_direction, message.has_low_frequency),
        (5, 0, 1)
    );
    // Heading east, 100 m west of the map's origin at 49 north, 8 east.
    assert!((message.heading_rad - std::f32::consts::FRAC_PI_2).abs() < 0.01);
    assert!((message.latitude_deg - 49.0).abs() < 1e-5);
    assert!(
        (message.longitude_deg - 8.0 + 100.0 / 73_172.0).abs() < 1e-5,
        "{}",
        message.longitude_deg
    );
    assert!((4.0..5.5).contains(&message.length_m) && (1.7..2.4).contains(&message.width_m));
    // A standing vehicle sends once per second.
    let received = (0..39).map(|_| cams(&pair.tick()[0]).len()).sum::<usize>();
    assert_eq!(received, 1);
}

#[test]
fn buildings_cars_and_distance_reduce_the_received_power() {
    let power = |away: Vec3, between: Option<Vec3>, radio: RadioSpec| {
        let spec = CamSpec { radio, ..CamSpec::default() };
        let mut pair = Pair::new(|| SensorSpec::physics("v2x", Pose::IDENTITY, &spec), away);
        if let Some(place) = between {
            spawn(&mut pair.bench.world, Pose::level(place, 0.0));
        }
        cams(&pair.tick()[0]).first().map(|heard| heard.power_dbm)
    };
    let clear = power(Vec3::new(-100.0, 0.0, 0.0), None, quiet()).unwrap();
    // The building of the bench stands at 60 m.
    let behind = power(Vec3::new(100.0, 0.0, 0.0), None, quiet()).unwrap();
    let expected = 36.85 + 60.0 + 18.9 * 5.9f32.log10() - (38.77 + 33.4 + 18.2 * 5.9f32.log10());
    assert!((clear - behind - expected).abs() < 0.2, "{clear} {behind} {expected}");
    let before = power(Vec3::new(-100.0, 0.0, 0.0), Some(Vec3::new(-50.0, 0.0, 0.0)), quiet());
    // The top of a car of the same height is two centimetres below the line of sight.
    let least = clear - before.unwrap();
    assert!((0.0..6.5).contains(&least), "{least} dB");
    let near = RadioSpec { range_m: 90.0, ..quiet() };
    assert_eq!(power(Vec3::new(-100.0, 0.0, 0.0), None, near), None);
    let deaf = RadioSpec { sensitivity_dbm: -50.0, ..quiet() };
    assert_eq!(power(Vec3::new(-100.0, 0.0, 0.0), None, deaf), None);
}

#[test]
fn a_text_is_received_once_and_by_the_other_station_only() {
    let spec = MessageSpec { radio: quiet() };
    let make = || SensorSpec::physics("chat", Pose::IDENTITY, &spec);
    let mut pair = Pair::new(make, Vec3::new(-40.0, 0.0, 0.0));
    assert!(pair.tick().iter().all(Vec::is_empty));
    let mut text = [0; TEXT_BYTES];
    text[..6].copy_from_slice("grüß".as_bytes());
    let State::Radio(station) = &mut pair.stations[1].1.state else { panic!("a radio") };
    station.queue(text).unwrap();
    let [first, second] = pair.tick();
    let heard: Vec<MessageReading> = bytemuck::pod_collect_to_vec(&first);
    assert_eq!((heard.len(), heard[0].text()), (1, "grüß"));
    assert_eq!(heard[0].station_id, pair.stations[1].0.0);
    assert!(second.is_empty() && pair.tick().iter().all(Vec::is_empty));
}
