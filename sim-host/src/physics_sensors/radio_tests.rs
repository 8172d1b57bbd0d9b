//! Two stations, and what lies between them.

use glam::Vec3;
use protocol::{
    ActorId, CamReading, CamSpec, MessageReading, MessageSpec, Pose, RadioSpec, SensorSpec,
    SnapshotHeader, Stamp, TEXT_BYTES, radio,
};

use super::{
    Noise, PhysicsSensor, Scene, State,
    air::Transmission,
    tests::{Bench, spawn},
};

/// Without shadow fading, in town.
fn quiet() -> RadioSpec {
    RadioSpec { flags: 0, scenario: radio::URBAN, ..RadioSpec::default() }
}

struct Pair {
    bench: Bench,
    stations: [(ActorId, PhysicsSensor); 2],
    nanos: u64,
}

impl Pair {
    /// The second one `away` metres off along x.
    fn new(make: impl Fn() -> SensorSpec, away: Vec3) -> Pair {
        let mut bench = Bench::new();
        let other = spawn(&mut bench.world, Pose::level(away, 0.0));
        (0..5).for_each(|_| drop(bench.tick()));
        let sense = || PhysicsSensor::new(&make()).unwrap();
        Pair { stations: [(bench.carrier, sense()), (other, sense())], bench, nanos: 0 }
    }

    /// One frame; what each hears, as bytes.
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
        for (id, sense) in &mut self.stations {
            let State::Radio(station) = &mut sense.state else { panic!("a radio") };
            let pose = world.state(*id).unwrap().pose;
            station.send(&scene(*id), &pose, &mut Noise::at(0, self.nanos), &mut air);
        }
        let mut hear = |index: usize| {
            let (id, sense) = &mut self.stations[index];
            let pose = world.state(*id).unwrap().pose;
            sense.measure(&scene(*id), &pose, &air, 64)
        };
        [hear(0), hear(1)]
    }
}

fn cams(bytes: &[u8]) -> Vec<CamReading> {
    bytemuck::pod_collect_to_vec(bytes)
}

#[test]
fn each_hears_the_other_and_not_itself_as_strong_as_the_way_is_long() {
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
    let said = first[0];
    assert_eq!((said.station_type, said.drive_direction, said.has_low_frequency), (5, 0, 1));
    // Looking east, 100 m west of the map's origin at 49 north, 8 east.
    assert!((said.heading_rad - std::f32::consts::FRAC_PI_2).abs() < 0.01);
    assert!((said.latitude_deg - 49.0).abs() < 1e-5);
    assert!((said.longitude_deg - 8.0 + 100.0 / 73_172.0).abs() < 1e-5, "{}", said.longitude_deg);
    assert!((4.0..5.5).contains(&said.length_m) && (1.7..2.4).contains(&said.width_m));
    // Who stands says so once a second.
    let heard = (0..39).map(|_| cams(&pair.tick()[0]).len()).sum::<usize>();
    assert_eq!(heard, 1);
}

#[test]
fn a_house_a_car_and_the_distance_take_what_they_take() {
    let power = |away: Vec3, between: Option<Vec3>, radio: RadioSpec| {
        let spec = CamSpec { radio, ..CamSpec::default() };
        let mut pair = Pair::new(|| SensorSpec::physics("v2x", Pose::IDENTITY, &spec), away);
        if let Some(place) = between {
            spawn(&mut pair.bench.world, Pose::level(place, 0.0));
        }
        cams(&pair.tick()[0]).first().map(|heard| heard.power_dbm)
    };
    let clear = power(Vec3::new(-100.0, 0.0, 0.0), None, quiet()).unwrap();
    // The house of the bench stands at 60 m.
    let behind = power(Vec3::new(100.0, 0.0, 0.0), None, quiet()).unwrap();
    let told = 36.85 + 60.0 + 18.9 * 5.9f32.log10() - (38.77 + 33.4 + 18.2 * 5.9f32.log10());
    assert!((clear - behind - told).abs() < 0.2, "{clear} {behind} {told}");
    let before = power(Vec3::new(-100.0, 0.0, 0.0), Some(Vec3::new(-50.0, 0.0, 0.0)), quiet());
    // A car of the same height does not reach up to the line of sight, by two centimetres.
    let least = clear - before.unwrap();
    assert!((0.0..6.5).contains(&least), "{least} dB");
    let near = RadioSpec { range_m: 90.0, ..quiet() };
    assert_eq!(power(Vec3::new(-100.0, 0.0, 0.0), None, near), None);
    let deaf = RadioSpec { sensitivity_dbm: -50.0, ..quiet() };
    assert_eq!(power(Vec3::new(-100.0, 0.0, 0.0), None, deaf), None);
}

#[test]
fn a_text_arrives_once_and_only_at_the_other() {
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
