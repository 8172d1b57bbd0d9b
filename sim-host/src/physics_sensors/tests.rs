//! Tests of sensor readings against the known motion of the world.

use glam::{Quat, Vec3};
use protocol::{
    ActorId, CollisionReading, CollisionSpec, GnssReading, GnssSpec, ImuReading, ImuSpec, Name,
    ObstacleReading, ObstacleSpec, OdometryReading, OdometrySpec, Pose, Reading, SensorSpec,
    SetVelocity, Settings, SnapshotHeader, Spawn, Stamp, Teleport, VehicleControl, WorldCommand,
    flag,
};
use road::Network;

use super::{PhysicsSensor, Scene, State};
use crate::world::World;

/// A floor with one building, and sensors on one carrier.
pub(super) struct Bench {
    pub(super) world: World,
    pub(super) network: Network,
    settings: Settings,
    nanos: u64,
    pub(super) carrier: ActorId,
    physics_sensors: Vec<PhysicsSensor>,
}

const ROADS: &str = r#"<OpenDRIVE><header revMajor="1" revMinor="6"><geoReference>+proj=tmerc +lat_0=49 +lon_0=8 +k=1 +ellps=WGS84</geoReference></header>
<road name="" length="400" id="1" junction="-1">
 <planView><geometry s="0" x="-200" y="0" hdg="0" length="400"><line/></geometry></planView>
 <lanes><laneSection s="0">
  <left><lane id="2" type="shoulder"><width sOffset="0" a="1" b="0" c="0" d="0"/><roadMark sOffset="0" type="none"/></lane>
   <lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="solid" color="white" width="0.12"/></lane></left>
  <center><lane id="0" type="none"><roadMark sOffset="0" type="broken" color="yellow" width="0.15"/></lane></center>
  <right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="broken" color="white" width="0.12"/></lane>
   <lane id="-2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="curb" color="white" width="0.2"/></lane></right>
 </laneSection></lanes>
</road></OpenDRIVE>"#;

impl Bench {
    pub(super) fn new() -> Bench {
        let mut town = town::Town::default();
        let corner = |x: f32, y: f32| [x * 900.0, y * 900.0, 0.0];
        let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        town.mesh.quad(corners, face);
        let center = Vec3::new(60.0, 0.0, 5.0);
        let half_extents_m = Vec3::new(2.0, 10.0, 5.0);
        town.objects.push(town::Object {
            tag: mesh::Tag::Building,
            layer: town::Layer::ALL[0],
            center,
            half_extents_m,
            yaw_rad: 0.0,
            color: [0; 3],
        });
        town.colliders.push(town::Collider { center, half_extents_m, yaw_rad: 0.0, object: 0 });
        let mut world = World::new(&town, 1);
        let carrier = spawn(&mut world, Pose::IDENTITY);
        Bench {
            world,
            network: Network::parse(ROADS).unwrap(),
            settings: Settings::default(),
            nanos: 0,
            carrier,
            physics_sensors: Vec::new(),
        }
    }

    fn mount<T: protocol::PhysicsSensorSpec>(
        &mut self,
        pose: Pose,
        numbers: &T,
    ) -> &mut SensorSpec {
        let delta_nanos = self.settings.delta_nanos;
        let receipt = protocol::BundleReceipt::new(self.nanos + delta_nanos, delta_nanos);
        let spec = SensorSpec::physics("s", pose, numbers);
        self.physics_sensors.push(PhysicsSensor::new(&spec, receipt).unwrap());
        &mut self.physics_sensors.last_mut().unwrap().spec
    }

    /// Simulates one frame and returns the readings of each sensor as bytes.
    pub(super) fn tick(&mut self) -> Vec<Vec<u8>> {
        let (physics_sensors, carrier) = (&mut self.physics_sensors, self.carrier);
        self.world.step(&self.settings, |physics, dt| {
            for sense in physics_sensors.iter_mut() {
                if let (State::Imu(imu), Some(moving)) = (&mut sense.state, physics.motion(carrier))
                {
                    imu.observe(&moving, dt);
                }
            }
        });
        self.nanos += self.settings.delta_nanos;
        let header = SnapshotHeader {
            stamp: Stamp { sim_time_nanos: self.nanos, ..Stamp::default() },
            delta_nanos: self.settings.delta_nanos,
            ..SnapshotHeader::default()
        };
        let scene = Scene {
            world: &self.world,
            network: Some(&self.network),
            parent: carrier,
            header: &header,
        };
        let from = self.world.state(carrier).unwrap().pose;
        let mut measure = |sense: &mut PhysicsSensor| {
            let pose = from.then(&sense.spec.parent_from_sensor);
            sense.measure(&scene, &pose, &[], 64)
        };
        self.physics_sensors.iter_mut().map(&mut measure).collect()
    }

    fn control(&mut self, throttle: f32, steer: f32) {
        let control =
            VehicleControl { actor_id: self.carrier, throttle, steer, ..Default::default() };
        self.world.apply(&WorldCommand::Control(control)).unwrap();
    }

    fn velocity(&mut self, velocity_mps: [f32; 3]) {
        let to = SetVelocity { actor_id: self.carrier, velocity_mps, ..Default::default() };
        self.world.apply(&WorldCommand::SetVelocity(to)).unwrap();
    }
}

pub(super) fn spawn(world: &mut World, pose: Pose) -> ActorId {
    let blueprint = Name::new("vehicle.tesla.model3");
    ActorId(
        world.apply(&WorldCommand::Spawn(Spawn { blueprint, pose, ..Spawn::default() })).unwrap(),
    )
}

fn only<T: Reading>(bytes: &[u8]) -> T {
    all(bytes)[0]
}

fn all<T: Reading>(bytes: &[u8]) -> Vec<T> {
    bytemuck::pod_collect_to_vec(bytes)
}

/// Dead reckoning: the integral of the readings is the motion of the sensor. Lever arm, mounting
/// rotation and substeps all contribute.
#[test]
fn imu_readings_integrate_to_the_motion_of_the_sensor() {
    let mut bench = Bench::new();
    let away = Pose::level(Vec3::new(-300.0, -100.0, 0.0), 0.0);
    bench
        .world
        .apply(&WorldCommand::Teleport(Teleport { actor_id: bench.carrier, pose: away }))
        .unwrap();
    (0..20).for_each(|_| drop(bench.tick()));
    let arm = Vec3::new(1.5, -0.8, 1.2);
    let turn = Quat::from_euler(glam::EulerRot::ZYX, 0.5, 0.2, -0.1);
    bench.mount(Pose::new(arm, turn), &ImuSpec::default());
    let (mut velocity, mut attitude) = (Vec3::ZERO, Quat::IDENTITY);
    let delta = 0.05;
    let mut furthest = 0.0f32;
    for frame in 0..160 {
        bench.control(0.6, if frame % 80 < 40 { 0.12 } else { -0.08 });
        let before = bench.world.state(bench.carrier).unwrap().pose.rotation() * turn;
        if frame == 0 {
            attitude = before;
        }
        let measured: ImuReading = only(&bench.tick()[0]);
        assert!((measured.over_secs - delta).abs() < 1e-6);
        let half = Quat::from_scaled_axis(Vec3::from(measured.gyroscope_radps) * delta * 0.5);
        let middle = attitude * half;
        attitude = (middle * half).normalize();
        let change = middle * Vec3::from(measured.accelerometer_mps2) - Vec3::Z * 9.81;
        velocity += change * delta;
        let state = bench.world.state(bench.carrier).unwrap();
        let spin = Vec3::from(state.angular_velocity_radps);
        let truth = state.velocity() + spin.cross(state.pose.rotation() * arm);
        furthest = furthest.max(velocity.distance(truth));
    }
    let speed = bench.world.state(bench.carrier).unwrap().velocity().length();
    let off =
        attitude.angle_between(bench.world.state(bench.carrier).unwrap().pose.rotation() * turn);
    println!("{speed} m/s after 8 s; at most {furthest} m/s off, {off} rad at the end");
    assert!(speed > 8.0, "{speed}");
    assert!(furthest < 0.1, "{furthest} m/s off");
    assert!(off < 0.02, "{off} rad off");
}

#[test]
fn a_teleport_is_not_measured() {
    let mut bench = Bench::new();
    bench.mount(Pose::new(Vec3::new(1.0, 0.0, 1.0), Quat::IDENTITY), &ImuSpec::default());
    (0..20).for_each(|_| drop(bench.tick()));
    bench.velocity([20.0, 0.0, 0.0]);
    (0..10).for_each(|_| drop(bench.tick()));
    let away = Pose::level(Vec3::new(-100.0, 80.0, 0.0), 2.0);
    let to = Teleport { actor_id: bench.carrier, pose: away };
    bench.world.apply(&WorldCommand::Teleport(to)).unwrap();
    for _ in 0..5 {
        let measured: ImuReading = only(&bench.tick()[0]);
        let extra = Vec3::from(measured.accelerometer_mps2) - Vec3::Z * 9.81;
        // A change of 20 m/s within a frame would be 400.
        assert!(extra.length() < 12.0, "{extra}");
        let moved = bench.world.state(bench.carrier).unwrap().pose.position();
        assert!(moved.distance(away.position()) < 2.0);
    }
}

#[test]
fn a_set_velocity_is_not_measured_as_acceleration() {
    let mut bench = Bench::new();
    bench.mount(Pose::new(Vec3::new(1.0, 0.0, 1.0), Quat::IDENTITY), &ImuSpec::default());
    (0..20).for_each(|_| drop(bench.tick()));
    let mut measured = |frames: u32, moves: bool| {
        let extra = (0..frames).map(|_| {
            if moves {
                bench.velocity([8.0, 0.0, 0.0]);
            }
            let measured: ImuReading = only(&bench.tick()[0]);
            Vec3::from(measured.accelerometer_mps2) - Vec3::Z * 9.81
        });
        extra.fold(Vec3::ZERO, |most, extra| most.max(extra.abs()))
    };
    // A single change of 8 m/s within a frame would be 160.
    let once = measured(1, true) + measured(10, false);
    assert!(once.length() < 3.0, "{once}");
    // Set in every frame, the losses to wheels and air are measured, not their compensation.
    let held = measured(60, true);
    println!("{once} once, {held} held");
    assert!(held.x < 1.0 && held.y < 0.1, "{held}");
}

#[test]
fn the_compass_is_clockwise_from_north() {
    for (yaw, compass) in [(std::f32::consts::FRAC_PI_2, 0.0), (0.0, std::f32::consts::FRAC_PI_2)] {
        let measured = super::imu::compass(&Pose::level(Vec3::ZERO, yaw + 1e-4));
        let off = (measured - compass + 3.0).rem_euclid(std::f32::consts::TAU) - 3.0;
        assert!(off.abs() < 1e-3, "{measured}, not {compass}");
    }
}

#[test]
fn colliding_actors_read_opposite_impulses() {
    let mut bench = Bench::new();
    bench.mount(Pose::IDENTITY, &CollisionSpec::default());
    let other = spawn(&mut bench.world, Pose::level(Vec3::new(15.0, 0.0, 0.0), 0.0));
    (0..20).for_each(|_| assert!(bench.tick()[0].is_empty()));
    let mass_kg = town::blueprint("vehicle.tesla.model3").unwrap().1.mass_kg;
    bench.velocity([10.0, 0.0, 0.0]);
    let mut given = Vec3::ZERO;
    let mut begins = 0;
    for _ in 0..60 {
        for hit in all::<CollisionReading>(&bench.tick()[0]) {
            assert_eq!((hit.other, hit.object, hit.tag), (other, 0, mesh::Tag::Car as u32));
            let impulse = Vec3::from(hit.impulse_ns);
            let mirrored = super::collisions(&bench.world, other);
            assert_eq!(Vec3::from(mirrored[0].impulse_ns), -impulse);
            assert_eq!(mirrored[0].other, bench.carrier);
            given += impulse;
            begins += hit.began;
        }
    }
    let pushed = bench.world.state(other).unwrap().pose.position().x - 15.0;
    println!("{given} N s, pushed {pushed} m");
    // The car loses between half (both move on together) and all of its momentum.
    let share = -given.x / (mass_kg * 10.0);
    assert!((0.35..1.0).contains(&share) && pushed > 0.1, "{share}, {pushed}");
    assert!(begins >= 1);
}

#[test]
fn an_obstacle_sensor_measures_the_distance_to_the_obstacle() {
    let mut bench = Bench::new();
    let mast = Pose::new(Vec3::new(0.0, 0.0, 1.5), Quat::IDENTITY);
    let seen = ObstacleSpec { distance_m: 80.0, hit_radius_m: 0.5, only_dynamics: 0 };
    bench.mount(mast, &seen);
    bench.mount(mast, &ObstacleSpec { only_dynamics: 1, ..seen });
    bench.mount(mast, &ObstacleSpec { distance_m: 20.0, ..seen });
    bench.mount(Pose::new(Vec3::Z, Quat::from_rotation_y(0.1)), &seen);
    let readings = (0..20).map(|_| bench.tick()).last().unwrap();
    let house: ObstacleReading = only(&readings[0]);
    let expected = (house.other, house.object, house.tag);
    assert_eq!(expected, (ActorId::NONE, 0x8000_0001, mesh::Tag::Building as u32));
    // The wall stands at 58 m.
    assert!((house.distance_m - 57.5).abs() < 0.2, "{house:?}");
    assert!(readings[1].is_empty() && readings[2].is_empty());
    // From 1 m up and 0.1 rad down, a sphere of 0.5 m touches the ground after 5 m.
    let ground: ObstacleReading = only(&readings[3]);
    assert_eq!((ground.other, ground.object), (ActorId::NONE, 0));
    assert!((ground.distance_m - 0.5 / 0.1f32.sin()).abs() < 0.3, "{ground:?}");

    let other = spawn(&mut bench.world, Pose::level(Vec3::new(30.0, 0.0, 0.0), 0.0));
    let readings = (0..20).map(|_| bench.tick()).last().unwrap();
    for bytes in &readings[..2] {
        let car: ObstacleReading = only(bytes);
        assert_eq!((car.other, car.object), (other, 0));
        assert!((26.0..28.5).contains(&car.distance_m), "{car:?}");
    }
}

#[test]
fn a_gnss_receiver_has_the_map_s_position_and_the_set_errors() {
    let mut bench = Bench::new();
    bench.mount(Pose::IDENTITY, &GnssSpec::default());
    let biased = GnssSpec { latitude_bias_deg: 0.01, altitude_stddev_m: 2.0, ..Default::default() };
    bench.mount(Pose::IDENTITY, &biased);
    let wander = GnssSpec { wander_m: 3.0, wander_secs: 60.0, ..GnssSpec::default() };
    bench.mount(Pose::IDENTITY, &wander);
    let (mut heights, mut norths) = (Vec::new(), Vec::new());
    for _ in 0..4000 {
        let readings = bench.tick();
        let [fix, off, lost]: [GnssReading; 3] = std::array::from_fn(|i| only(&readings[i]));
        assert!((fix.latitude_deg - 49.0).abs() < 1e-6 && (fix.longitude_deg - 8.0).abs() < 1e-6);
        assert!((off.latitude_deg - fix.latitude_deg - 0.01).abs() < 1e-8);
        heights.push(off.altitude_m - fix.altitude_m);
        norths.push((lost.latitude_deg - fix.latitude_deg) * 111_200.0);
    }
    let spread = |of: &[f64]| (of.iter().map(|x| x * x).sum::<f64>() / of.len() as f64).sqrt();
    assert!((spread(&heights) - 2.0).abs() < 0.15, "{}", spread(&heights));
    // White noise would differ by 3 · √2 between frames.
    let steps: Vec<f64> = norths.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let expected = 3.0 * (1.0 - (-2.0f64 * 0.05 / 60.0).exp()).sqrt();
    assert!((spread(&steps) / expected - 1.0).abs() < 0.1, "{} {expected}", spread(&steps));
    assert!((0.5..8.0).contains(&spread(&norths)), "{}", spread(&norths));
}

#[test]
fn an_odometer_measures_wheel_speed_and_distance() {
    let mut bench = Bench::new();
    bench.mount(Pose::IDENTITY, &OdometrySpec::default());
    let worn = OdometrySpec { scale_error: 0.05, step_mps: 0.5, ..OdometrySpec::default() };
    bench.mount(Pose::IDENTITY, &worn);
    (0..10).for_each(|_| drop(bench.tick()));
    let from = bench.world.state(bench.carrier).unwrap().pose.position();
    let mut last = OdometryReading::default();
    let begun: OdometryReading = only(&bench.tick()[0]);
    for _ in 0..120 {
        bench.control(0.5, 0.0);
        let readings = bench.tick();
        last = only(&readings[0]);
        let measured: OdometryReading = only(&readings[1]);
        let expected = (last.speed_mps * 1.05 / 0.5).round() * 0.5;
        assert!((measured.speed_mps - expected).abs() < 1e-4);
    }
    let state = bench.world.state(bench.carrier).unwrap();
    assert!((last.speed_mps - state.velocity().length()).abs() < 0.05 && last.speed_mps > 5.0);
    let way = state.pose.position().distance(from);
    let counted = (last.distance_m - begun.distance_m) as f32;
    assert!((counted / way - 1.0).abs() < 0.05, "{counted} of {way} m");
}

#[test]
fn a_reading_is_the_mean_over_the_sensor_period() {
    let mut bench = Bench::new();
    bench.mount(Pose::IDENTITY, &ImuSpec::default()).period_nanos = 100_000_000;
    let mut readings_so_far = Vec::new();
    for frame in 0..9 {
        let readings = bench.tick();
        readings_so_far.push(!readings[0].is_empty());
        if let Some(measured) = all::<ImuReading>(&readings[0]).first() {
            // The first reading covers the time since the sensor exists: one frame.
            let expected_s = if frame == 0 { 0.05 } else { 0.1 };
            assert!((measured.over_secs - expected_s).abs() < 1e-6);
        }
    }
    assert_eq!(readings_so_far, [true, false, true, false, true, false, true, false, true]);
}

#[test]
fn sensors_do_not_change_the_state_hash_and_are_deterministic() {
    let noisy =
        ImuSpec { accelerometer_stddev_mps2: [0.1; 3], gyroscope_walk: 0.01, ..ImuSpec::default() };
    let run = |seed: Option<u64>| {
        let mut bench = Bench::new();
        if let Some(seed) = seed {
            bench.mount(Pose::IDENTITY, &noisy).seed = seed;
            bench.mount(Pose::IDENTITY, &ObstacleSpec { distance_m: 90.0, ..Default::default() });
            bench.mount(Pose::IDENTITY, &CollisionSpec::default());
        }
        let mut readings_so_far = Vec::new();
        for _ in 0..100 {
            bench.control(0.8, 0.1);
            readings_so_far.extend(bench.tick());
        }
        let mut hash = mesh::WordHash::new();
        bench.world.hash(&mut hash, &protocol::StandingState::default());
        let hash = hash.value();
        (hash, readings_so_far)
    };
    let (alone, _) = run(None);
    let (first, readings) = run(Some(3));
    assert_eq!(alone, first);
    assert!(readings == run(Some(3)).1);
    assert!(readings != run(Some(4)).1);
}

mod lanes {
    use super::*;
    use crate::physics_sensors::lanes::Corners;
    use protocol::{ActorState, LaneInvasionReading};
    use road::{MarkColor, MarkKind};

    fn car(y: f32, yaw_rad: f32) -> ActorState {
        let (blueprint, _) = town::blueprint("vehicle.tesla.model3").unwrap();
        let pose = Pose::level(Vec3::new(0.0, y, 0.0), yaw_rad);
        ActorState { blueprint, pose, ..ActorState::default() }
    }

    /// Moves a car from y to y and returns the crossings of its corners, in order of time.
    fn slide(from: f32, to: f32, yaw_rad: f32) -> Vec<(u32, MarkKind)> {
        let network = Network::parse(ROADS).unwrap();
        let kinds = [MarkKind::Solid, MarkKind::Broken, MarkKind::Curb];
        let mut corners = Corners::default();
        let mut crossed = Vec::new();
        for step in 0..=100 {
            let found = corners
                .crossings(&car(from + (to - from) * step as f32 / 100.0, yaw_rad), &network);
            crossed.extend(found.iter().map(|f: &LaneInvasionReading| {
                (f.corner, kinds.into_iter().find(|k| *k as u32 == f.kind).unwrap())
            }));
        }
        crossed
    }

    #[test]
    fn each_corner_crosses_each_marking_once() {
        // From the middle of lane -1 over the centre line into lane 1.
        let left = slide(-1.75, 1.75, 0.0);
        let broken = |corners: [u32; 4]| corners.map(|c| (c, MarkKind::Broken)).to_vec();
        assert_eq!(left, broken([0, 2, 1, 3]));
        // And back.
        assert_eq!(slide(1.75, -1.75, 0.0), broken([1, 3, 0, 2]));
        // Two lanes to the right and over the kerb, beyond the outermost lane.
        let kinds: Vec<_> = slide(-1.75, -12.0, 0.0).into_iter().map(|c| c.1).collect();
        assert_eq!(kinds.iter().filter(|k| **k == MarkKind::Broken).count(), 4);
        assert_eq!(kinds.iter().filter(|k| **k == MarkKind::Curb).count(), 4);
        assert_eq!(kinds.len(), 8);
        // Back from there.
        assert_eq!(slide(-12.0, -1.75, 0.0).len(), 8);
        // Over the narrow shoulder, whose own border has no mark.
        let kinds: Vec<_> = slide(1.75, 12.0, 0.0).into_iter().map(|c| c.1).collect();
        assert_eq!(kinds, [MarkKind::Solid; 4]);
    }

    #[test]
    fn keeping_to_a_lane_and_teleports_cross_nothing() {
        assert_eq!(slide(-2.2, -1.3, 0.0), []);
        let network = Network::parse(ROADS).unwrap();
        let mut corners = Corners::default();
        assert_eq!(corners.crossings(&car(-1.75, 0.0), &network), []);
        let put = ActorState { flags: flag::TELEPORTED, ..car(1.75, 0.0) };
        assert_eq!(corners.crossings(&put, &network), []);
        assert_eq!(corners.crossings(&car(1.75, 0.0), &network), []);
    }

    #[test]
    fn a_crossing_has_the_mark_and_the_lane_of_origin() {
        let network = Network::parse(ROADS).unwrap();
        let mut corners = Corners::default();
        corners.crossings(&car(-1.5, 0.0), &network);
        let found = corners.crossings(&car(-0.5, 0.0), &network);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].color, MarkColor::Yellow as u32);
        assert!((found[0].width_m - 0.15).abs() < 1e-6);
        assert_eq!((found[0].to_left, found[0].from_lane_id), (1, -1));
    }
}
