//! What stands in the world is what the bytes show.

use std::f32::consts::{FRAC_PI_2, TAU};

use bus::{
    ActorId, ActorState, Frame, Name, Plane, Pose, SensorSpec, Stamp, Weather, kind, layout,
    output, sensor,
};
use glam::{Quat, Vec3};
use road::{Face, Material, Mesh, Tag};

use crate::{BlueprintMesh, CpuTracer, RigJob, Scene, TraceError, Tracer, World, pose_planes};

/// A box with corners at `low` and `high`.
fn block(mesh: &mut Mesh, low: [f32; 3], high: [f32; 3], face: Face) {
    let p =
        |x: usize, y: usize, z: usize| [[low, high][x][0], [low, high][y][1], [low, high][z][2]];
    for side in [
        [p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0)],
        [p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)],
        [p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)],
        [p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0)],
        [p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)],
        [p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)],
    ] {
        mesh.quad(side, face);
    }
}

/// A floor at z = 0 and a wall whose near side lies at x = 20.
fn town() -> Mesh {
    let mut mesh = Mesh::default();
    let floor = Face::new(Tag::Roads, Material::Asphalt, 0);
    mesh.quad([[-50., -50., 0.], [50., -50., 0.], [50., 50., 0.], [-50., 50., 0.]], floor);
    block(
        &mut mesh,
        [20., -8., 0.],
        [25., 8., 6.],
        Face::new(Tag::Building, Material::FacadeBrick, 7),
    );
    mesh
}

/// A car of 4 m by 2 m by 1.5 m, with its origin on the ground below its middle.
fn car() -> Mesh {
    let mut mesh = Mesh::default();
    block(&mut mesh, [-2., -1., 0.], [2., 1., 1.5], Face::new(Tag::Car, Material::CarPaint, 0));
    mesh
}

fn scene() -> Scene {
    Scene::new(&town(), &[BlueprintMesh { mesh: &car() }])
}

fn actor(id: u32, pose: Pose) -> ActorState {
    ActorState {
        actor_id: ActorId(id),
        blueprint: 0,
        kind: kind::VEHICLE,
        pose,
        ..Default::default()
    }
}

fn world_with(scene: &Scene, actors: &[ActorState]) -> World {
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(9), sim_time_nanos: 450_000_000, episode: 1, reserved: 0 };
    world.place(scene, stamp, 50_000_000, &Weather::default(), actors, |_| [200, 30, 30]);
    world
}

fn camera(width: u32, height: u32) -> SensorSpec {
    SensorSpec {
        name: Name::new("front"),
        kind: sensor::CAMERA,
        outputs: output::COLOR | output::DEPTH | output::TAG | output::INSTANCE,
        width,
        height,
        fov_rad: FRAC_PI_2,
        parent_from_sensor: Pose::level(Vec3::new(0., 0., 1.), 0.),
        ..Default::default()
    }
}

fn lidar(columns: u32, channels: u32) -> SensorSpec {
    SensorSpec {
        name: Name::new("roof"),
        kind: sensor::LIDAR,
        outputs: output::POINTS | output::LABELS,
        width: columns,
        height: channels,
        fov_rad: TAU,
        upper_rad: 0.1,
        lower_rad: -0.1,
        range_m: 100.,
        attenuation_per_m: 0.004,
        parent_from_sensor: Pose::level(Vec3::new(0., 0., 1.), 0.),
        ..Default::default()
    }
}

/// A bundle's payload, aligned as the bus aligns it.
struct Bundle {
    planes: Vec<Plane>,
    words: Vec<[u64; 8]>,
}

impl Bundle {
    fn measure(
        tracer: &mut Tracer,
        scene: &Scene,
        world: &World,
        sensors: &[SensorSpec],
    ) -> Bundle {
        let (mut planes, byte_len) = layout(sensors);
        pose_planes(&mut planes, sensors, &Pose::IDENTITY);
        let mut words = vec![[0xa5a5_a5a5_a5a5_a5a5; 8]; byte_len as usize / 64 + 1];
        let out = bytemuck::cast_slice_mut(&mut words);
        let mut jobs = [RigJob { sensors, planes: &planes, out }];
        tracer.measure(scene, world, &mut jobs).unwrap();
        let table: &[Plane] = &bytemuck::cast_slice(&words)[..planes.len()];
        Bundle { planes: table.to_vec(), words }
    }

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn plane<T: bytemuck::Pod>(&self, sensor: u32, output: u32) -> &[T] {
        let plane = self.planes.iter().find(|p| (p.sensor, p.output) == (sensor, output)).unwrap();
        bytemuck::cast_slice(&self.bytes()[plane.offset as usize..][..plane.byte_len as usize])
    }
}

fn cpu(threads: usize) -> Tracer {
    Tracer::Cpu(CpuTracer::new(threads).unwrap())
}

#[test]
fn a_wall_ahead_is_where_it_is() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[camera(81, 61)]);
    let at = 30 * 81 + 40;
    assert!((seen.plane::<f32>(0, output::DEPTH)[at] - 20.).abs() < 1e-4);
    assert_eq!(seen.plane::<u8>(0, output::TAG)[at], Tag::Building as u8);
    assert_eq!(seen.plane::<u32>(0, output::INSTANCE)[at], 0x8000_0007);
    assert_eq!(seen.plane::<u8>(0, output::COLOR)[at * 4 + 3], 255);
    // The wall is 6 m high and the camera 1 m above ground: at 20 m, 40.5 pixels a unit of depth,
    // its top edge lies 5 / 20 * 40.5 = 10.1 pixels above the middle.
    let tags = seen.plane::<u8>(0, output::TAG);
    assert_eq!(tags[(30 - 10) * 81 + 40], Tag::Building as u8);
    assert_eq!(tags[(30 - 11) * 81 + 40], Tag::Sky as u8);
    assert_eq!(seen.plane::<f32>(0, output::DEPTH)[40], bus::DEPTH_FAR_M);
    assert_eq!(seen.plane::<u32>(0, output::INSTANCE)[40], 0);
    // And its foot 2 pixels below, with the floor before it.
    assert_eq!(tags[(30 + 2) * 81 + 40], Tag::Building as u8);
    assert_eq!(tags[(30 + 3) * 81 + 40], Tag::Roads as u8);
    assert_eq!(seen.plane::<u32>(0, output::INSTANCE)[33 * 81 + 40], 0x8000_0000);
}

#[test]
fn left_in_the_world_is_left_in_the_image() {
    let scene = scene();
    let world = world_with(&scene, &[actor(41, Pose::level(Vec3::new(10., 5., 0.), 0.))]);
    let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[camera(81, 61)]);
    let instances = seen.plane::<u32>(0, output::INSTANCE);
    let columns: Vec<usize> =
        (0..instances.len()).filter(|i| instances[*i] == 41).map(|i| i % 81).collect();
    // Its right edge passes at y = 4, x = 12: a third of 40.5 pixels left of the middle.
    assert_eq!(columns.iter().max(), Some(&26));
    assert!(columns.iter().min() >= Some(&8));
}

#[test]
fn a_turned_actor_is_met_on_its_near_side() {
    let scene = scene();
    let pose = Pose::level(Vec3::new(10., 0., 0.), FRAC_PI_2);
    let world = world_with(&scene, &[actor(3, pose)]);
    let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[camera(9, 9)]);
    assert!((seen.plane::<f32>(0, output::DEPTH)[40] - 9.).abs() < 1e-4);
    assert_eq!(seen.plane::<u32>(0, output::INSTANCE)[40], 3);
    assert_eq!(seen.plane::<u8>(0, output::TAG)[40], Tag::Car as u8);
}

#[test]
fn a_lidar_return_is_a_point_on_the_thing_it_met() {
    let scene = scene();
    let world = world_with(&scene, &[actor(5, Pose::level(Vec3::new(0., 12., 0.), 0.))]);
    let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[lidar(361, 5)]);
    let points = seen.plane::<[f32; 4]>(0, output::POINTS);
    let labels = seen.plane::<[u32; 2]>(0, output::LABELS);
    // 361 columns over a turn: column 180 looks straight ahead, channel 2 lies level.
    let ahead = 180 * 5 + 2;
    assert!((Vec3::from_slice(&points[ahead][..3]) - Vec3::new(20., 0., 0.)).length() < 1e-4);
    assert_eq!(labels[ahead], [0x8000_0007, Tag::Building as u32]);
    assert!(points[ahead][3] > 0. && points[ahead][3] < (-0.004f32 * 20.).exp() + 1e-6);
    // A quarter turn to the left, and down: the car's near side at y = 11, 0.55 m below.
    let left = (180 + 90) * 5 + 3;
    assert_eq!(labels[left], [5, Tag::Car as u32]);
    assert!((points[left][1] - 11.).abs() < 0.01, "{:?}", points[left]);
    for (point, label) in points.iter().zip(labels) {
        assert_eq!(*label == [0; 2], *point == [0.; 4]);
    }
    // The highest channel sees the sky behind: nothing.
    assert_eq!(points[0], [0.; 4]);
}

#[test]
fn a_spinning_lidar_goes_on_where_it_stopped() {
    let spec = SensorSpec { rotation_rate_hz: 7.3, ..lidar(100, 4) };
    let scene = scene();
    let mut first_of_frame = Vec::new();
    for frame in 1..40u64 {
        let mut world = World::new();
        let stamp =
            Stamp { frame: Frame(frame), sim_time_nanos: frame * 50_000_000, ..Default::default() };
        world.place(&scene, stamp, 50_000_000, &Weather::default(), &[], |_| [0; 3]);
        let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        first_of_frame.push(f64::from(seen.planes[0].first_azimuth_rad));
    }
    let sweep = std::f64::consts::TAU * 7.3 * 0.05;
    for pair in first_of_frame.windows(2) {
        let gone = (pair[1] - pair[0]).rem_euclid(std::f64::consts::TAU);
        assert!((gone - sweep).abs() < 1e-3, "{gone} against {sweep}");
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let scene = scene();
    let actors: Vec<ActorState> = (0..30)
        .map(|i| {
            let angle = i as f32 * 0.7;
            actor(i + 1, Pose::level(Vec3::new(9. * angle.cos(), 9. * angle.sin(), 0.), angle))
        })
        .collect();
    let world = world_with(&scene, &actors);
    let spec = SensorSpec { noise_m: 0.02, dropoff: 0.1, seed: 4, ..lidar(512, 32) };
    let sensors = [camera(203, 97), spec, camera(84, 84)];
    let one = Bundle::measure(&mut cpu(1), &scene, &world, &sensors);
    let two = Bundle::measure(&mut cpu(2), &scene, &world, &sensors);
    let again = Bundle::measure(&mut cpu(2), &scene, &world, &sensors);
    assert!(one.bytes() == two.bytes() && two.bytes() == again.bytes());
}

#[test]
fn the_null_tracer_writes_the_table_and_nothing_else() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let seen = Bundle::measure(&mut Tracer::Null, &scene, &world, &[camera(8, 8)]);
    assert_eq!(seen.planes[1].output, output::DEPTH);
    assert!(seen.bytes()[seen.planes[0].offset as usize..].iter().all(|byte| *byte == 0xa5));
}

#[test]
fn what_a_sensor_cannot_be_is_refused_by_name() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let refusal = |spec: SensorSpec, cut: usize| {
        let sensors = [spec];
        let (mut planes, byte_len) = layout(&sensors);
        pose_planes(&mut planes, &sensors, &Pose::IDENTITY);
        let mut words = vec![[0u64; 8]; byte_len as usize / 64 + 1];
        let out: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
        let end = byte_len as usize - cut;
        let mut jobs = [RigJob { sensors: &sensors, planes: &planes, out: &mut out[..end] }];
        cpu(1).measure(&scene, &world, &mut jobs).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(SensorSpec { fov_rad: 4.0, ..camera(8, 8) }, 0),
        "sensor front: a camera's field of view lies between 0 and pi rad, this one's is 4"
    );
    assert_eq!(
        refusal(SensorSpec { kind: 9, ..camera(8, 8) }, 0),
        "sensor front: there is no kind 9; cameras are 1, lidars 2"
    );
    assert_eq!(
        refusal(SensorSpec { outputs: output::POINTS, ..camera(8, 8) }, 0),
        "sensor front: a sensor of kind 1 has no output 0x10"
    );
    assert!(refusal(camera(8, 8), 64).contains("the payload holds"));
    let short = TraceError::Unaligned.to_string();
    assert_eq!(short, "the payload begins at an address that is no multiple of 16");
}

#[test]
fn nothing_is_not_seen_and_breaks_nothing() {
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &Mesh::default() }]);
    let lost = Pose { position_m: [f32::NAN; 3], ..Pose::IDENTITY };
    let nowhere = ActorState { blueprint: 77, ..actor(2, Pose::IDENTITY) };
    let world = world_with(&scene, &[actor(1, Pose::IDENTITY), nowhere, actor(3, lost)]);
    let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[camera(8, 8), lidar(8, 4)]);
    assert!(seen.plane::<u32>(0, output::INSTANCE).iter().all(|id| *id == 0));
    assert!(seen.plane::<[f32; 4]>(1, output::POINTS).iter().all(|point| *point == [0.; 4]));
}

#[test]
fn the_same_actor_looks_the_same_wherever_the_world_is_turned() {
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &car() }]);
    let look = |turn: Quat, shift: Vec3| {
        let pose = Pose::new(turn * Vec3::new(9., 1., 0.) + shift, turn);
        let world = world_with(&scene, &[actor(1, pose)]);
        let spec = SensorSpec { parent_from_sensor: Pose::new(shift, turn), ..camera(64, 64) };
        let seen = Bundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        seen.plane::<f32>(0, output::DEPTH).to_vec()
    };
    let plain = look(Quat::IDENTITY, Vec3::ZERO);
    let turned =
        look(Quat::from_euler(glam::EulerRot::ZYX, 2.1, 0.3, -0.4), Vec3::new(30., -7., 4.));
    let differ = plain.iter().zip(&turned).filter(|(a, b)| (*a - *b).abs() > 1e-3 * *a).count();
    assert!(differ <= 4, "{differ} of {} pixels differ", plain.len());
}
