//! Models of lidars: channels, prisms, sweeps, wide beams, fog and rain, in both tracers, against closed
//! forms.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use mesh::{Face, Material, Mesh, RandomStream, Tag};
use protocol::{
    ActorState, Frame, LidarSpec, Pose, SensorSpec, Stamp, Weather, layout, lidar_flag, output,
};

use super::{actor, block, cpu, lidar};
use crate::{BundleJob, Scene, Tracer, World, pose_planes};

const DELTA_NANOS: u64 = 50_000_000;

fn tracers() -> impl Iterator<Item = Tracer> {
    [Some(cpu(2)), crate::gpu::tests::gpu()].into_iter().flatten()
}

/// Returns a carrier without a mesh.
fn carrier(x: f32, y: f32, yaw_rad: f32) -> ActorState {
    ActorState { blueprint: 999, ..actor(9, Pose::level(Vec3::new(x, y, 0.0), yaw_rad)) }
}

fn world_at(scene: &Scene, nanos: u64, weather: &Weather) -> World {
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(9), sim_time_nanos: nanos, episode: 1, reserved: 0 };
    world.place(scene, stamp, DELTA_NANOS, weather, &[], |_| [0; 3]);
    world
}

/// Clear air.
fn clear() -> Weather {
    Weather { fog_density: 0.0, ..Weather::default() }
}

/// Points and labels of the strongest and, if asked for, of the last returns.
#[derive(PartialEq)]
struct Cloud {
    points: Vec<[f32; 4]>,
    labels: Vec<[u32; 2]>,
    last_points: Vec<[f32; 4]>,
    last_labels: Vec<[u32; 2]>,
}

fn measure(
    tracer: &mut Tracer,
    scene: &Scene,
    world: &World,
    carrier: &ActorState,
    spec: SensorSpec,
) -> Cloud {
    let (mut planes, byte_len) = layout(&[spec]);
    pose_planes(&mut planes, &[spec], &carrier.pose);
    let mut words = vec![[0u64; 8]; byte_len as usize / 64 + 1];
    let out = bytemuck::cast_slice_mut(&mut words);
    let parent = carrier.actor_id;
    let mut jobs = [BundleJob { parent, sensors: &[spec], planes: &planes, out }];
    tracer.measure(scene, world, &mut jobs).unwrap();
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    let of = |output: u32| {
        let plane = planes.iter().find(|plane| plane.output == output);
        plane.map_or(&[][..], |plane| &bytes[plane.offset as usize..][..plane.byte_len as usize])
    };
    Cloud {
        points: bytemuck::pod_collect_to_vec(of(output::POINTS)),
        labels: bytemuck::pod_collect_to_vec(of(output::LABELS)),
        last_points: bytemuck::pod_collect_to_vec(of(output::LAST_POINTS)),
        last_labels: bytemuck::pod_collect_to_vec(of(output::LAST_LABELS)),
    }
}

fn still(tracer: &mut Tracer, scene: &Scene, weather: &Weather, spec: SensorSpec) -> Cloud {
    measure(tracer, scene, &world_at(scene, 450_000_000, weather), &carrier(0.0, 0.0, 0.0), spec)
}

/// Returns a wall at x, across the view from y = `right` to y = `left`.
fn wall(mesh: &mut Mesh, x: f32, [right, left]: [f32; 2], object: u32) {
    let face = Face::new(Tag::Building, Material::FacadeBrick, object);
    block(mesh, [x, right, -60.0], [x + 1.0, left, 60.0], face);
}

fn walls(all: &[(f32, [f32; 2])]) -> Scene {
    let mut mesh = Mesh::default();
    for (object, (x, sides)) in all.iter().enumerate() {
        wall(&mut mesh, *x, *sides, object as u32 + 1);
    }
    Scene::new(&mesh, &[]).unwrap()
}

fn distance(point: &[f32; 4]) -> f32 {
    Vec3::from_slice(point).length()
}

/// Level beams, one channel.
fn ring(columns: u32) -> SensorSpec {
    SensorSpec { upper_rad: 0.0, lower_rad: 0.0, attenuation_per_m: 0.0, ..lidar(columns, 1) }
}

#[test]
fn each_channel_meets_the_floor_at_the_elevation_in_its_table() {
    let mut mesh = Mesh::default();
    let floor = Face::new(Tag::Roads, Material::Asphalt, 0);
    mesh.quad([[-90., -90., 0.], [90., -90., 0.], [90., 90., 0.], [-90., 90., 0.]], floor);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let table = [0.035, 0.0, -0.02, -0.0201, -0.15, -0.31, -0.433, -1.2];
    let mut spec = lidar(72, table.len() as u32);
    spec.lidar.set_elevations(&table);
    for mut tracer in tracers() {
        let cloud = still(&mut tracer, &scene, &clear(), spec);
        for (at, point) in cloud.points.iter().enumerate() {
            let elevation: f32 = table[at % table.len()];
            if elevation > -0.01 {
                assert_eq!(*point, [0.0; 4]);
                continue;
            }
            let [x, y, z, _] = *point;
            // The sensor is 1 m above the floor.
            assert!((z + 1.0).abs() < 1e-3, "{point:?}");
            assert!((z.atan2(x.hypot(y)) - elevation).abs() < 3e-5, "{point:?} {elevation}");
        }
    }
}

#[test]
fn two_prisms_draw_a_rosette_that_does_not_repeat() {
    let scene = walls(&[(30.0, [-60.0, 60.0])]);
    let (fov_rad, hz) = (0.67f32, [121.567f32, -77.733]);
    let spec = SensorSpec {
        fov_rad,
        lidar: LidarSpec { prism_hz: hz, ..LidarSpec::default() },
        ..lidar(1000, 2)
    };
    for mut tracer in tracers() {
        let mut frames = Vec::new();
        for frame in [3u64, 4] {
            let world = world_at(&scene, frame * DELTA_NANOS, &clear());
            let cloud = measure(&mut tracer, &scene, &world, &carrier(0.0, 0.0, 0.0), spec);
            let mut seen = Vec::new();
            for (beam, point) in cloud.points.iter().enumerate() {
                let direction = Vec3::from_slice(point).normalize_or_zero();
                let secs = (frame as f64 - 1.0 + (beam as f64 + 0.5) / 2000.0) * 0.05;
                let [a, b] = hz.map(|hz| (secs * f64::from(hz)).fract() as f32 * TAU);
                // The sum of two unit vectors has the mean of their angles as its direction.
                let radius = fov_rad / 2.0 * ((a - b) / 2.0).cos();
                let across = Vec2::from_angle((a + b) / 2.0) * radius;
                let found = Vec2::new(direction.y, direction.z).normalize_or_zero()
                    * direction.x.clamp(-1.0, 1.0).acos();
                assert!(found.distance(across) < 1e-3, "beam {beam}: {found} {across}");
                seen.push(found);
            }
            frames.push(seen);
        }
        assert!(frames[0].iter().any(|at| at.length() > 0.99 * fov_rad / 2.0));
        let [first, second] = [&frames[0], &frames[1]];
        let again = |at: &&Vec2| second.iter().any(|other| at.distance(*other) < 2e-4);
        let repeated = first.iter().filter(again).count();
        assert!(repeated < first.len() / 10, "{repeated} of {}", first.len());
    }
}

#[test]
fn each_column_of_a_sweep_starts_where_the_sensor_was_at_its_time() {
    let scene = walls(&[(20.0, [-8.0, 8.0])]);
    let columns = 720;
    // 20 turns per second: a frame is a turn, which begins straight ahead.
    let spec = SensorSpec { rotation_rate_hz: 20.0, ..ring(columns) };
    let mut swept = spec;
    swept.lidar.flags = lidar_flag::SWEEP;
    let (mut ahead, mut turning) = (0, 0);
    for mut tracer in tracers() {
        // 1 m towards the wall, and a turn of 0.1 rad to the left, within the frame.
        for (before, is_turning) in
            [(carrier(-1.0, 0.0, 0.0), false), (carrier(0.0, 0.0, -0.1), true)]
        {
            let now = carrier(0.0, 0.0, 0.0);
            let mut world = world_at(&scene, 450_000_000, &clear());
            world.track_motion(&scene, &[before], &[now]);
            let raw = measure(&mut tracer, &scene, &world, &now, swept);
            for (column, point) in raw.points.iter().enumerate() {
                let passed = (column as f32 + 0.5) / columns as f32;
                let left = 1.0 - passed;
                let azimuth = passed * TAU;
                let (x, turned) = if is_turning { (0.0, 0.1 * left) } else { (-left, 0.0) };
                let in_world = azimuth - turned;
                let distance_m = (20.0 - x) / in_world.cos();
                let is_met = in_world.cos() > 0.5 && (distance_m * in_world.sin()).abs() < 7.9;
                if is_met {
                    // In the space of the sensor at that time.
                    let expected = Vec3::new(azimuth.cos(), azimuth.sin(), 0.0) * distance_m;
                    let found = Vec3::from_slice(point);
                    assert!(found.distance(expected) < 2e-3, "column {column}: {found} {expected}");
                    *(if is_turning { &mut turning } else { &mut ahead }) += 1;
                }
            }
            // Without the option, and in the first frame of a carrier, all columns start at one pose.
            let frozen = measure(&mut tracer, &scene, &world, &now, spec);
            assert!((frozen.points[0][0] - 20.0).abs() < 1e-3, "{:?}", frozen.points[0]);
            let alone = world_at(&scene, 450_000_000, &clear());
            assert!(measure(&mut tracer, &scene, &alone, &now, swept) == frozen);
        }
    }
    assert!(ahead > 50 && turning > 50, "{ahead} {turning}");
}

#[test]
fn a_wide_beam_on_an_edge_returns_both_surfaces() {
    let scene = walls(&[(20.0, [0.0, 8.0]), (30.0, [-60.0, 60.0])]);
    let mut spec = SensorSpec {
        outputs: output::OF_LIDAR,
        parent_from_sensor: Pose::level(Vec3::new(0.0, 0.02, 0.0), 0.0),
        ..ring(721)
    };
    spec.lidar.divergence_rad = 0.02;
    for mut tracer in tracers() {
        let cloud = still(&mut tracer, &scene, &clear(), spec);
        // Column 360 points straight ahead, 2 cm left of the edge: the axis and three of the outer rays
        // meet the near wall, three pass.
        let [near, far] = [cloud.points[360], cloud.last_points[360]];
        assert!((distance(&near) - 20.0).abs() < 1e-2 && (distance(&far) - 30.0).abs() < 1e-2);
        assert_eq!([near, far].map(|[_, y, z, _]| [y.abs() < 1e-3, z == 0.0]), [[true; 2]; 2]);
        assert!((near[3] - 4.0 / 7.0 * 0.35).abs() < 1e-3, "{near:?}");
        assert!((far[3] - 3.0 / 7.0 * 0.35).abs() < 1e-3, "{far:?}");
        assert_eq!([cloud.labels[360][0], cloud.last_labels[360][0]], [0x8000_0001, 0x8000_0002]);
        // Beside the edge there is one surface.
        for column in [380, 340] {
            assert_eq!(cloud.last_points[column], [0.0; 4]);
            assert_eq!(cloud.last_labels[column], [0; 2]);
            assert!((cloud.points[column][3] - 0.35).abs() < 0.01, "{:?}", cloud.points[column]);
        }
        // A beam without a width has one return, that of a lidar without this option.
        let thin = SensorSpec { lidar: LidarSpec::default(), ..spec };
        let cloud = still(&mut tracer, &scene, &clear(), thin);
        assert!(cloud.last_points.iter().all(|point| *point == [0.0; 4]));
        let outputs = output::POINTS | output::LABELS;
        let plain = still(&mut tracer, &scene, &clear(), SensorSpec { outputs, ..thin });
        for (a, b) in cloud.points.iter().zip(&plain.points) {
            assert!((0..4).all(|axis| (a[axis] - b[axis]).abs() < 1e-4), "{a:?} {b:?}");
        }
        assert!(cloud.labels == plain.labels);
    }
}

/// A lidar of a weather.
fn weathered(spec: SensorSpec) -> SensorSpec {
    SensorSpec { lidar: LidarSpec { flags: lidar_flag::WEATHER, ..spec.lidar }, ..spec }
}

#[test]
fn fog_attenuates_twice_along_the_way_and_hides_what_is_far() {
    let fog = |fog_density: f32| Weather { fog_density, ..Weather::default() };
    for mut tracer in tracers() {
        let scene = walls(&[(25.0, [-60.0, 60.0])]);
        let spec = SensorSpec { fov_rad: 0.5, ..ring(51) };
        for density in [10.0, 30.0] {
            let share = density / 100.0;
            let extinction = 0.03 * share * share + 0.0006 * share;
            let clear = still(&mut tracer, &scene, &fog(density), spec);
            let hazy = still(&mut tracer, &scene, &fog(density), weathered(spec));
            for (a, b) in clear.points.iter().zip(&hazy.points) {
                let expected = (-2.0 * extinction * distance(a)).exp();
                assert!((b[3] / a[3] - expected).abs() < 1e-4, "{a:?} {b:?}");
                assert!((distance(a) - distance(b)).abs() < 1e-4);
            }
        }
        let scene = walls(&[(80.0, [-60.0, 60.0])]);
        let lost = still(&mut tracer, &scene, &fog(100.0), weathered(spec));
        let (echo_m, label) = (distance(&lost.points[0]), [0, Tag::Other as u32]);
        assert!((3.0..6.0).contains(&echo_m), "{echo_m}");
        for (point, found) in lost.points.iter().zip(&lost.labels) {
            assert!((distance(point) - echo_m).abs() < 1e-4 && *found == label);
        }
        assert!(distance(&still(&mut tracer, &scene, &fog(100.0), spec).points[25]) > 79.0);
    }
}

/// Draws the drops of Marshall and Palmer in the cone of each of many beams. Returns the share of the
/// beams that detect one, and the mean distance of the strongest drop of each.
fn drawn_drops(rate_mm_per_h: f64, divergence_rad: f64, least_power: f64) -> (f64, f64) {
    let mut random = RandomStream::from_state(5);
    let mut exponential = move || -f64::from(random.unit()).max(1e-9).ln();
    let decay_per_mm = 4.1 * rate_mm_per_h.powf(-0.21);
    let drops_per_m3 = 8000.0 / decay_per_mm;
    let (beams, range_m) = (20_000, 40f64);
    let (mut detected, mut sum) = (0, 0.0);
    for _ in 0..beams {
        let (mut volume, mut strongest) = (0.0, (0.0, 0.0));
        loop {
            volume += exponential() / drops_per_m3;
            let r = (volume * 12.0 / (std::f64::consts::PI * divergence_rad.powi(2))).cbrt();
            if r > range_m {
                break;
            }
            let diameter_m = 1e-3 * exponential() / decay_per_mm;
            let power = 0.02 * (diameter_m / (divergence_rad * r)).powi(2) / (r * r);
            if power > strongest.0 {
                strongest = (power, r);
            }
        }
        if strongest.0 > least_power && strongest.1 >= 1.0 {
            detected += 1;
            sum += strongest.1;
        }
    }
    (f64::from(detected) / f64::from(beams), sum / f64::from(detected))
}

#[test]
fn raindrops_return_as_often_and_as_far_away_as_a_poisson_process_of_drops() {
    let scene = Scene::new(&Mesh::default(), &[]).unwrap();
    // 10 mm/h.
    let rain = Weather { precipitation: 20.0, fog_density: 0.0, ..Weather::default() };
    let mut spec = weathered(lidar(1800, 32));
    spec.lidar.divergence_rad = 0.002;
    let least_power = 0.1 / 100f64.powi(2);
    let (share, mean_m) = drawn_drops(10.0, 0.002, least_power);
    // The closed form, without the blind zone.
    let decay_per_m = 4100.0 * 10f64.powf(-0.21);
    let k = decay_per_m * 0.002 * (least_power / 0.02).sqrt();
    let mean_drops =
        8e6 / decay_per_m * std::f64::consts::PI.powf(1.5) / 16.0 * 0.002f64.powi(2) * k.powf(-1.5);
    let formula = 1.0 - (-mean_drops).exp();
    assert!((share / formula - 1.0).abs() < 0.08, "{share} drawn, {formula} by the formula");
    let mut seeds = Vec::new();
    for mut tracer in tracers() {
        let cloud = still(&mut tracer, &scene, &rain, spec);
        let hits: Vec<f32> = cloud.points.iter().map(distance).filter(|m| *m > 0.0).collect();
        let found = hits.len() as f64 / cloud.points.len() as f64;
        assert!((found / share - 1.0).abs() < 0.08, "{found} of the beams, {share} expected");
        let mean = hits.iter().map(|m| f64::from(*m)).sum::<f64>() / hits.len() as f64;
        assert!((mean / mean_m - 1.0).abs() < 0.05, "{mean} m, {mean_m} m expected");
        // Other drops with another seed, the same ones again with the same seed.
        let again = still(&mut tracer, &scene, &rain, spec);
        let other = still(&mut tracer, &scene, &rain, SensorSpec { seed: 8, ..spec });
        assert!(again == cloud && other != cloud);
        seeds.push(hits.len());
    }
    assert!(seeds.iter().all(|hits| hits.abs_diff(seeds[0]) <= 3), "{seeds:?}");
}

/// Returns the world at an instant, with a car that drives along x at 25 m/s.
fn in_spray(scene: &Scene, weather: &Weather, car: Vec3) -> World {
    let (number, _) = town::blueprint("vehicle.tesla.model3").expect("an id of the catalogue");
    let car = ActorState {
        blueprint: number,
        velocity_mps: [25.0, 0.0, 0.0],
        ..actor(7, Pose::level(car, 0.))
    };
    let mut world = world_at(scene, 450_000_000, weather);
    // The scene has no mesh of the blueprint: only the spray is met.
    world.place(scene, world.stamp(), DELTA_NANOS, weather, &[car], |_| [0; 3]);
    world
}

/// Returns the optical depth of the spray in a world from 1 m above the origin at an azimuth, at steps of 5 cm up to 30 m.
fn depths(world: &World, azimuth: f32) -> Vec<f64> {
    const STEP_M: f32 = 0.05;
    let [puff] = world.puffs[..] else { panic!("{} puffs", world.puffs.len()) };
    let mut sum = 0.0;
    let step = |number: u32| {
        let at = (Vec2::from_angle(azimuth) * (STEP_M * (number as f32 + 0.5))).extend(1.0);
        let to = at - Vec3::from(puff.center);
        // The car drives along x.
        let own = to * Vec3::new(puff.per_length, puff.per_width, puff.per_width / 0.8);
        sum += f64::from(puff.density_per_m * STEP_M * (1.0 + own.length_squared()).powf(-3.5));
        sum
    };
    (0..600).map(step).collect()
}

#[test]
fn spray_returns_as_often_and_as_far_away_as_clumps_of_its_optical_depth() {
    let open = Scene::new(&Mesh::default(), &[]).unwrap();
    let spec = weathered(SensorSpec {
        fov_rad: 0.3,
        outputs: output::POINTS | output::LABELS | output::LAST_POINTS,
        ..ring(4000)
    });
    let wet = Weather { wetness: 60.0, ..clear() };
    let dry = Weather { wetness: 0.0, ..wet };
    let car = Vec3::new(14.0, 0.0, 0.0);
    let world = in_spray(&open, &wet, car);
    let azimuth = |column: usize| 0.3 * ((column as f32 + 0.5) / 4000.0 - 0.5);
    let (mut expected, mut moment) = (0.0, 0.0);
    for column in (0..4000).step_by(8) {
        let all = depths(&world, azimuth(column));
        for (number, pair) in all.windows(2).enumerate() {
            let returned = (-pair[0]).exp() - (-pair[1]).exp();
            let distance_m = 0.05 * (number as f64 + 1.5);
            if distance_m >= 1.0 {
                expected += 8.0 * returned;
                moment += 8.0 * returned * distance_m;
            }
        }
    }
    assert!((800.0..3200.0).contains(&expected), "{expected}");
    // A dark wall, 5 m behind the car.
    let walled = walls(&[(20.0, [-60.0, 60.0])]);
    let through = in_spray(&walled, &wet, car);
    let mut counts = Vec::new();
    for mut tracer in tracers() {
        let mut seen = |scene: &Scene, world: &World| {
            measure(&mut tracer, scene, world, &carrier(0.0, 0.0, 0.0), spec)
        };
        let cloud = seen(&open, &world);
        let hits: Vec<f32> = cloud.points.iter().map(distance).filter(|m| *m > 0.0).collect();
        let share = hits.len() as f64 / expected;
        assert!((share - 1.0).abs() < 0.05, "{} returns, {expected} expected", hits.len());
        let mean = hits.iter().map(|m| f64::from(*m)).sum::<f64>() / hits.len() as f64;
        assert!((mean - moment / expected).abs() < 0.1, "{mean} m, {} m", moment / expected);
        counts.push(hits.len());
        // The wall's echo is attenuated on both ways, and is the last one behind a clump.
        let plain = seen(&walled, &in_spray(&walled, &dry, car));
        let cloud = seen(&walled, &through);
        for column in (0..4000).step_by(40) {
            let [before, behind] = [&plain.points[column], &cloud.last_points[column]];
            let depth = *depths(&world, azimuth(column)).last().unwrap() as f32;
            let is_last = distance(behind) > 19.0;
            let behind = if is_last { behind } else { &cloud.points[column] };
            if distance(behind) > 19.0 {
                let ratio = behind[3] / before[3];
                assert!((ratio / (-2.0 * depth).exp() - 1.0).abs() < 0.01, "{ratio}, {depth}");
            } else {
                assert!(depth > 1.0, "the wall is lost behind an optical depth of {depth}");
            }
        }
        let air = [0, Tag::Other as u32];
        let clumps = cloud.labels.iter().filter(|label| **label == air).count();
        assert!((200..hits.len()).contains(&clumps), "{clumps} before the wall");
    }
    assert!(counts.iter().all(|hits| hits.abs_diff(counts[0]) <= 3), "{counts:?}");
}

/// A lidar with everything at once.
fn full(columns: u32) -> SensorSpec {
    let mut spec = weathered(SensorSpec {
        outputs: output::OF_LIDAR,
        rotation_rate_hz: 10.0,
        noise_m: 0.02,
        dropoff: 0.05,
        seed: 3,
        ..lidar(columns, 32)
    });
    spec.lidar.flags |= lidar_flag::SWEEP;
    spec.lidar.divergence_rad = 0.003;
    let table: Vec<f32> =
        (0..32).map(|channel| 0.1 - 0.0006 * (channel * channel) as f32).collect();
    spec.lidar.set_elevations(&table);
    spec
}

#[test]
fn threads_and_tracers_agree_on_a_lidar_with_every_option() {
    let town = crate::sample::Sample::named("Flatford").unwrap();
    let scene = Scene::of_town(&town.town).unwrap();
    let weather = Weather { precipitation: 40.0, fog_density: 40.0, ..Weather::default() };
    let now = ActorState { pose: town.street_pose(2), ..carrier(0.0, 0.0, 0.0) };
    let mut world = in_spray(&scene, &weather, now.pose.position() + Vec3::new(7.0, 2.0, 0.0));
    let back = Pose::level(Vec3::new(-0.7, 0.05, 0.0), -0.02);
    let before = ActorState { pose: now.pose.then(&back), ..now };
    world.track_motion(&scene, &[before], &[now]);
    let by = |tracer: &mut Tracer| measure(tracer, &scene, &world, &now, full(512));
    let one = by(&mut cpu(1));
    assert!(by(&mut cpu(2)) == one && by(&mut cpu(2)) == one);
    let returned = |points: &[[f32; 4]]| points.iter().filter(|point| **point != [0.0; 4]).count();
    let counts = [returned(&one.points), returned(&one.last_points)];
    assert!(counts[0] > 8000 && counts[1] > 500, "{counts:?}");
    let Some(mut gpu) = crate::gpu::tests::gpu() else { return };
    let other = by(&mut gpu);
    let differ = |a: &[f32; 4], b: &[f32; 4]| {
        let [a_at, b_at] = [a, b].map(|p| Vec3::from_slice(p));
        a_at.distance(b_at) > 1e-3 * a_at.length().max(1.0) || (a[3] - b[3]).abs() > 1e-3
    };
    let wrong =
        |a: &[[f32; 4]], b: &[[f32; 4]]| a.iter().zip(b).filter(|(a, b)| differ(a, b)).count();
    let found = [wrong(&one.points, &other.points), wrong(&one.last_points, &other.last_points)];
    // Rays that graze an edge, and echoes that are nearly as strong as each other.
    assert!(found.iter().all(|wrong| *wrong <= one.points.len() / 1000), "{found:?}");
    let labels = one.labels.iter().zip(&other.labels).filter(|(a, b)| a != b).count();
    assert!(labels <= one.labels.len() / 1000, "{labels}");
}
