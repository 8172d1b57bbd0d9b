//! Measurements agree with the geometry of the world.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{
    ActorId, ActorState, Frame, Name, Plane, Pose, SensorSpec, Stamp, Weather, kind, layout,
    output, sensor,
};

mod baked;
mod effects;
mod lamps;
pub(crate) mod lens;
mod lidar;
mod looks;
mod motion;
mod occlusion;
mod overlay;
mod panes;
mod parked;
mod pieces;
mod plants;
mod quality;
mod rain;
mod reflections;
mod shutter;
mod street_lights;

use crate::{BlueprintMesh, BundleJob, CpuTracer, Scene, TraceError, Tracer, World, pose_planes};

/// Adds a box with corners at `low` and `high`.
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

/// Returns a floor at z = 0 and a wall whose near side is at x = 20.
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

/// Returns a car of 4 m by 2 m by 1.5 m, with its origin on the ground below its centre.
fn car() -> Mesh {
    let mut mesh = Mesh::default();
    block(&mut mesh, [-2., -1., 0.], [2., 1., 1.5], Face::new(Tag::Car, Material::CarPaint, 0));
    mesh
}

fn scene() -> Scene {
    Scene::new(&town(), &[BlueprintMesh { mesh: &car() }]).unwrap()
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

/// Payload of a bundle, aligned as on the bus.
struct MeasuredBundle {
    planes: Vec<Plane>,
    words: Vec<[u64; 8]>,
}

impl MeasuredBundle {
    fn measure(
        tracer: &mut Tracer,
        scene: &Scene,
        world: &World,
        sensors: &[SensorSpec],
    ) -> MeasuredBundle {
        let (mut planes, byte_len) = layout(sensors);
        pose_planes(&mut planes, sensors, &Pose::IDENTITY);
        let mut words = vec![[0xa5a5_a5a5_a5a5_a5a5; 8]; byte_len as usize / 64 + 1];
        let out = bytemuck::cast_slice_mut(&mut words);
        let mut jobs =
            [BundleJob { parent: protocol::ActorId::NONE, sensors, planes: &planes, out }];
        tracer.measure(scene, world, &mut jobs).unwrap();
        let table: &[Plane] = &bytemuck::cast_slice(&words)[..planes.len()];
        MeasuredBundle { planes: table.to_vec(), words }
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
fn a_wall_appears_at_its_distance_height_and_id() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(81, 61)]);
    let at = 30 * 81 + 40;
    assert!((measured.plane::<f32>(0, output::DEPTH)[at] - 20.).abs() < 1e-4);
    assert_eq!(measured.plane::<u8>(0, output::TAG)[at], Tag::Building as u8);
    assert_eq!(measured.plane::<u32>(0, output::INSTANCE)[at], 0x8000_0007);
    assert_eq!(measured.plane::<u8>(0, output::COLOR)[at * 4 + 3], 255);
    // The wall is 6 m high and the camera 1 m above ground. At 20 m, with 40.5 pixels per unit of
    // slope, its top edge lies 5 / 20 * 40.5 = 10.1 pixels above the centre.
    let tags = measured.plane::<u8>(0, output::TAG);
    assert_eq!(tags[(30 - 10) * 81 + 40], Tag::Building as u8);
    assert_eq!(tags[(30 - 11) * 81 + 40], Tag::Sky as u8);
    assert_eq!(measured.plane::<f32>(0, output::DEPTH)[40], protocol::DEPTH_FAR_M);
    assert_eq!(measured.plane::<u32>(0, output::INSTANCE)[40], 0);
    // Its foot lies 2 pixels below the centre, with the floor in front of it.
    assert_eq!(tags[(30 + 2) * 81 + 40], Tag::Building as u8);
    assert_eq!(tags[(30 + 3) * 81 + 40], Tag::Roads as u8);
    assert_eq!(
        measured.plane::<u32>(0, output::INSTANCE)[33 * 81 + 40],
        mesh::ObjectId::GROUND.instance()
    );
}

#[test]
fn a_parked_car_has_the_mesh_of_its_blueprint_and_the_id_of_its_object() {
    let number = town::blueprint("vehicle.tesla.model3").expect("an id of the catalogue").0;
    let car = &town::catalogue()[number as usize];
    let position = Vec3::new(12., 0., 0.);
    let town = town::Town {
        mesh: town(),
        objects: vec![town::Object {
            tag: Tag::Car,
            layer: town::Layer::ParkedVehicles,
            center: position + car.center_m,
            half_extents_m: car.half_extents_m,
            yaw_rad: 0.,
            color: [200, 10, 10],
        }],
        parked: vec![town::Parked {
            blueprint: number,
            object: 0,
            position,
            rotation: Quat::IDENTITY.to_array(),
        }],
        ..Default::default()
    };
    let scene = Scene::of_town(&town).unwrap();
    let world = world_with(&scene, &[]);
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(81, 61)]);
    let at = 31 * 81 + 40;
    assert_eq!(measured.plane::<u8>(0, output::TAG)[at], Tag::Car as u8);
    assert_eq!(measured.plane::<u32>(0, output::INSTANCE)[at], 0x8000_0001);
    let near = measured.plane::<f32>(0, output::DEPTH)[at];
    assert!((near - (12. + car.center_m.x - car.half_extents_m.x)).abs() < 0.6, "{near}");
}

#[test]
fn left_in_the_world_is_left_in_the_image() {
    let scene = scene();
    let world = world_with(&scene, &[actor(41, Pose::level(Vec3::new(10., 5., 0.), 0.))]);
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(81, 61)]);
    let instances = measured.plane::<u32>(0, output::INSTANCE);
    let columns: Vec<usize> =
        (0..instances.len()).filter(|i| instances[*i] == 41).map(|i| i % 81).collect();
    // Its right edge passes through y = 4, x = 12: a third of 40.5 pixels left of the centre.
    assert_eq!(columns.iter().max(), Some(&26));
    assert!(columns.iter().min() >= Some(&8));
}

#[test]
fn a_turned_actor_is_hit_on_its_near_side() {
    let scene = scene();
    let pose = Pose::level(Vec3::new(10., 0., 0.), FRAC_PI_2);
    let world = world_with(&scene, &[actor(3, pose)]);
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(9, 9)]);
    assert!((measured.plane::<f32>(0, output::DEPTH)[40] - 9.).abs() < 1e-4);
    assert_eq!(measured.plane::<u32>(0, output::INSTANCE)[40], 3);
    assert_eq!(measured.plane::<u8>(0, output::TAG)[40], Tag::Car as u8);
}

#[test]
fn a_lidar_point_lies_on_the_surface_that_was_hit() {
    let scene = scene();
    let world = world_with(&scene, &[actor(5, Pose::level(Vec3::new(0., 12., 0.), 0.))]);
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[lidar(361, 5)]);
    let points = measured.plane::<[f32; 4]>(0, output::POINTS);
    let labels = measured.plane::<[u32; 2]>(0, output::LABELS);
    // 361 columns over a full turn: column 180 points straight ahead, channel 2 is level.
    let ahead = 180 * 5 + 2;
    assert!((Vec3::from_slice(&points[ahead][..3]) - Vec3::new(20., 0., 0.)).length() < 1e-4);
    assert_eq!(labels[ahead], [0x8000_0007, Tag::Building as u32]);
    assert!(points[ahead][3] > 0. && points[ahead][3] < (-0.004f32 * 20.).exp() + 1e-6);
    // A quarter turn to the left and downward: the car's near side at y = 11, 0.55 m below.
    let left = (180 + 90) * 5 + 3;
    assert_eq!(labels[left], [5, Tag::Car as u32]);
    assert!((points[left][1] - 11.).abs() < 0.01, "{:?}", points[left]);
    for (point, label) in points.iter().zip(labels) {
        assert_eq!(*label == [0; 2], *point == [0.; 4]);
    }
    // The highest channel misses everything behind the sensor.
    assert_eq!(points[0], [0.; 4]);
}

#[test]
fn a_spinning_lidar_continues_its_sweep_in_the_next_frame() {
    let spec = SensorSpec { rotation_rate_hz: 7.3, ..lidar(100, 4) };
    let scene = scene();
    let mut first_of_frame = Vec::new();
    for frame in 1..40u64 {
        let mut world = World::new();
        let stamp =
            Stamp { frame: Frame(frame), sim_time_nanos: frame * 50_000_000, ..Default::default() };
        world.place(&scene, stamp, 50_000_000, &Weather::default(), &[], |_| [0; 3]);
        let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        first_of_frame.push(f64::from(measured.planes[0].first_azimuth_rad));
    }
    let sweep = std::f64::consts::TAU * 7.3 * 0.05;
    for pair in first_of_frame.windows(2) {
        let gone = (pair[1] - pair[0]).rem_euclid(std::f64::consts::TAU);
        assert!((gone - sweep).abs() < 1e-3, "{gone} against {sweep}");
    }
}

#[test]
fn the_number_of_threads_does_not_change_the_bytes() {
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
    let one = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &sensors);
    let two = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &sensors);
    let again = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &sensors);
    assert!(one.bytes() == two.bytes() && two.bytes() == again.bytes());
}

#[test]
fn the_null_tracer_writes_the_table_and_nothing_else() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let measured = MeasuredBundle::measure(&mut Tracer::Null, &scene, &world, &[camera(8, 8)]);
    assert_eq!(measured.planes[1].output, output::DEPTH);
    assert!(
        measured.bytes()[measured.planes[0].offset as usize..].iter().all(|byte| *byte == 0xa5)
    );
}

#[test]
fn an_invalid_sensor_is_rejected_by_name() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let refusal = |spec: SensorSpec, cut: usize| {
        let sensors = [spec];
        let (mut planes, byte_len) = layout(&sensors);
        pose_planes(&mut planes, &sensors, &Pose::IDENTITY);
        let mut words = vec![[0u64; 8]; byte_len as usize / 64 + 1];
        let out: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
        let end = byte_len as usize - cut;
        let mut jobs = [BundleJob {
            parent: protocol::ActorId::NONE,
            sensors: &sensors,
            planes: &planes,
            out: &mut out[..end],
        }];
        cpu(1).measure(&scene, &world, &mut jobs).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(SensorSpec { fov_rad: 4.0, ..camera(8, 8) }, 0),
        "sensor front: fov_rad is 4, not 0.01 to 3.1"
    );
    assert_eq!(
        refusal(SensorSpec { kind: 9, ..camera(8, 8) }, 0),
        "sensor front: unsupported sensor type 9; the renderer measures cameras (1) and lidars (2)"
    );
    assert_eq!(
        refusal(SensorSpec { outputs: output::POINTS, ..camera(8, 8) }, 0),
        "sensor front: unsupported output 0x10 for sensor type 1"
    );
    assert_eq!(
        refusal(camera(8193, 1), 0),
        "sensor front: 8193 x 1 is too large; width and height are at most 8192"
    );
    assert!(refusal(camera(8, 8), 64).contains("the payload holds"));
    let short = TraceError::Unaligned.to_string();
    assert_eq!(short, "the payload is not aligned to 16 bytes");
}

#[test]
fn empty_meshes_and_invalid_poses_are_invisible() {
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &Mesh::default() }]).unwrap();
    let lost = Pose { position_m: [f32::NAN; 3], ..Pose::IDENTITY };
    let nowhere = ActorState { blueprint: 77, ..actor(2, Pose::IDENTITY) };
    let world = world_with(&scene, &[actor(1, Pose::IDENTITY), nowhere, actor(3, lost)]);
    let measured =
        MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(8, 8), lidar(8, 4)]);
    assert!(measured.plane::<u32>(0, output::INSTANCE).iter().all(|id| *id == 0));
    assert!(measured.plane::<[f32; 4]>(1, output::POINTS).iter().all(|point| *point == [0.; 4]));
}

#[test]
fn the_same_actor_looks_the_same_wherever_the_world_is_turned() {
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &car() }]).unwrap();
    let look = |turn: Quat, shift: Vec3| {
        let pose = Pose::new(turn * Vec3::new(9., 1., 0.) + shift, turn);
        let world = world_with(&scene, &[actor(1, pose)]);
        let spec = SensorSpec { parent_from_sensor: Pose::new(shift, turn), ..camera(64, 64) };
        let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        measured.plane::<f32>(0, output::DEPTH).to_vec()
    };
    let plain = look(Quat::IDENTITY, Vec3::ZERO);
    let turned =
        look(Quat::from_euler(glam::EulerRot::ZYX, 2.1, 0.3, -0.4), Vec3::new(30., -7., 4.));
    let differ = plain.iter().zip(&turned).filter(|(a, b)| (*a - *b).abs() > 1e-3 * *a).count();
    assert!(differ <= 4, "{differ} of {} pixels differ", plain.len());
}

#[test]
fn ten_cameras_in_one_job_measure_the_same_as_ten_jobs() {
    let scene = scene();
    let actors = [actor(4, Pose::level(Vec3::new(9., 2., 0.), 0.4))];
    let world = world_with(&scene, &actors);
    let cameras: Vec<SensorSpec> = (0..10)
        .map(|i| SensorSpec {
            parent_from_sensor: Pose::level(Vec3::new(-(i as f32), 0.3, 1.5), 0.2 * i as f32),
            ..camera(61 + 7 * i, 45 + i)
        })
        .collect();
    let together = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &cameras);
    for (index, camera) in (0..).zip(&cameras) {
        let alone = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &[*camera]);
        for which in [output::COLOR, output::DEPTH, output::TAG, output::INSTANCE] {
            assert!(together.plane::<u8>(index, which) == alone.plane::<u8>(0, which));
        }
    }
}

/// Returns columns and rows of the pixels of this instance.
fn extent(measured: &MeasuredBundle, id: u32, width: usize) -> [usize; 4] {
    let ids = measured.plane::<u32>(0, output::INSTANCE);
    let at = |i: &usize| (i % width, i / width);
    let shown: Vec<(usize, usize)> =
        (0..ids.len()).filter(|i| ids[*i] == id).map(|i| at(&i)).collect();
    let columns = || shown.iter().map(|(x, _)| *x);
    let rows = || shown.iter().map(|(_, y)| *y);
    [columns().min(), columns().max(), rows().min(), rows().max()].map(|edge| edge.unwrap())
}

#[test]
fn the_field_of_view_ends_at_the_outer_edges_of_the_outer_pixels() {
    let (width, height) = (64usize, 48usize);
    let mut mesh = Mesh::default();
    // At depth 10 and 90 degrees, column 0 covers y from 10 down to 10 (1 - 2 / 64).
    let edge = 10. * (1. - 2. / width as f32);
    let face = Face::new(Tag::Pole, Material::Metal, 3);
    block(&mut mesh, [10., edge + 0.01, -20.], [10.0001, 10. - 0.01, 20.], face);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let world = world_with(&scene, &[]);
    for (width, height, outer) in [(width as u32, height as u32, true), (32, 24, false)] {
        let measured =
            MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(width, height)]);
        let ids = measured.plane::<u32>(0, output::INSTANCE);
        let columns: Vec<usize> =
            (0..ids.len()).filter(|i| ids[*i] != 0).map(|i| i % width as usize).collect();
        // Half as many columns are twice as wide: the centre of the outer one is 0.01 beside the
        // begin of the post.
        assert_eq!(columns.len(), if outer { height as usize } else { 0 });
        assert!(columns.iter().all(|column| *column == 0));
    }
}

#[test]
fn a_marker_lies_within_half_a_pixel_of_its_projection() {
    let mut plate = Mesh::default();
    block(
        &mut plate,
        [-0.001, -0.5, -0.5],
        [0.001, 0.5, 0.5],
        Face::new(Tag::Dynamic, Material::Sign, 0),
    );
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &plate }]).unwrap();
    let (width, height) = (640u32, 480u32);
    for step in 0..40 {
        let step = step as f32;
        let at = Vec3::new(5. + step * 0.37, (step * 0.9).sin() * 3.1, (step * 1.7).cos() * 2.2);
        // The camera has an arbitrary pose; the plate is perpendicular to its axis.
        let turn = Quat::from_euler(glam::EulerRot::ZYX, 0.4 * step, 0.3 * step.sin(), 0.);
        let stand = Vec3::new(100. * step.cos(), 50. * step.sin(), 3.);
        let world = world_with(&scene, &[actor(77, Pose::new(stand + turn * at, turn))]);
        let spec = SensorSpec {
            fov_rad: 1.4,
            parent_from_sensor: Pose::new(stand, turn),
            ..camera(width, height)
        };
        let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        let focal = width as f32 / 2. / (1.4f32 / 2.).tan();
        // Pixel centres lie at whole numbers plus one half.
        let column = |y: f32| width as f32 / 2. - y / (at.x - 0.001) * focal;
        let row = |z: f32| height as f32 / 2. - z / (at.x - 0.001) * focal;
        let wanted =
            [column(at.y + 0.5), column(at.y - 0.5) - 1., row(at.z + 0.5), row(at.z - 0.5) - 1.];
        let got = extent(&measured, 77, width as usize);
        for (got, wanted) in got.into_iter().zip(wanted) {
            assert!((got as f32 - wanted).abs() <= 0.51, "{got} against {wanted} at {at}");
        }
        let middle = (row(at.z) as usize) * width as usize + column(at.y) as usize;
        assert!((measured.plane::<f32>(0, output::DEPTH)[middle] - at.x).abs() < 2e-3);
        assert_eq!(measured.plane::<u8>(0, output::TAG)[middle], Tag::Dynamic as u8);
    }
}

#[test]
fn lidar_channels_and_columns_have_the_specified_angles() {
    // A box around the sensor.
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Building, Material::Concrete, 2);
    block(&mut mesh, [-30., -30., -30.], [30., 30., 30.], face);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let world = world_with(&scene, &[]);
    let spec = SensorSpec {
        upper_rad: 0.3,
        lower_rad: -0.5,
        parent_from_sensor: Pose::level(Vec3::new(1., 2., 3.), 0.7),
        ..lidar(90, 9)
    };
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
    for (beam, point) in measured.plane::<[f32; 4]>(0, output::POINTS).iter().enumerate() {
        let (column, channel) = (beam / 9, beam % 9);
        let at = Vec3::from_slice(point);
        let elevation = 0.3 - 0.8 * channel as f32 / 8.;
        let azimuth = -TAU / 2. + TAU * (column as f32 + 0.5) / 90.;
        assert!((at.z.atan2(at.truncate().length()) - elevation).abs() < 1e-5);
        assert!((at.y.atan2(at.x) - azimuth).abs() < 1e-5, "{column}");
        // The point lies on the box.
        let in_world = spec.parent_from_sensor.affine().transform_point3(at);
        assert!((in_world.abs().max_element() - 30.).abs() < 1e-3, "{in_world}");
    }
}

#[test]
fn lidar_intensity_follows_the_documented_formula() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let spec = SensorSpec { attenuation_per_m: 0.03, ..lidar(361, 5) };
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
    let points = measured.plane::<[f32; 4]>(0, output::POINTS);
    let [rho, diffuse] = crate::lidar_return::REFLECTIVITIES[Material::FacadeBrick as usize];
    for column in 170..190 {
        let point = points[column * 5 + 2];
        let d = Vec3::from_slice(&point).length();
        let cosine = 20. / d;
        let wanted = rho * (1. - diffuse + diffuse * cosine) * (-0.03 * d).exp();
        assert!((point[3] - wanted).abs() < 1e-5, "{point:?} against {wanted}");
    }
}

#[test]
fn a_lidar_reports_the_cosine_of_incidence_on_request() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let spec =
        SensorSpec { point_attribute: protocol::point_attribute::COS_INCIDENCE, ..lidar(361, 5) };
    let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
    let points = measured.plane::<[f32; 4]>(0, output::POINTS);
    for column in 170..190 {
        let point = points[column * 5 + 2];
        // The wall ahead is at 20 m, perpendicular to the sensor's axis.
        let wanted = 20. / Vec3::from_slice(&point).length();
        assert!((point[3] - wanted).abs() < 1e-5, "{point:?} against {wanted}");
    }
}

#[test]
fn a_surface_beyond_the_range_gives_no_return() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    for (range_m, heard) in [(19.9, false), (20.1, true)] {
        let spec = SensorSpec { range_m, ..lidar(361, 5) };
        let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        let ahead = measured.plane::<[f32; 4]>(0, output::POINTS)[180 * 5 + 2];
        assert_eq!(ahead != [0.; 4], heard);
    }
}

/// Returns the brightness of the pixel that shows this point of the world, from a camera high above
/// it.
fn brightness_from_above(scene: &Scene, world: &World, at: Vec3) -> u32 {
    let down = Quat::from_rotation_y(FRAC_PI_2);
    let spec = SensorSpec {
        parent_from_sensor: Pose::new(Vec3::new(0., 0., 40.), down),
        ..camera(400, 400)
    };
    let measured = MeasuredBundle::measure(&mut cpu(1), scene, world, &[spec]);
    let in_sensor = down.inverse() * (at - Vec3::new(0., 0., 40.));
    let pixel = |across: f32| (200. - across / in_sensor.x * 200.) as usize;
    let index = pixel(in_sensor.z) * 400 + pixel(in_sensor.y);
    measured.plane::<[u8; 4]>(0, output::COLOR)[index][..3].iter().map(|c| u32::from(*c)).sum()
}

#[test]
fn shadows_fall_away_from_the_sun() {
    let scene = scene();
    for (azimuth_rad, sunward) in
        [(0., Vec3::X), (FRAC_PI_2, Vec3::Y), (3.6, Quat::from_rotation_z(3.6) * Vec3::X)]
    {
        let mut world = World::new();
        let weather = Weather {
            sun_azimuth_rad: azimuth_rad,
            sun_altitude_rad: 0.5,
            cloudiness: 0.,
            ..Default::default()
        };
        let car = [actor(1, Pose::level(Vec3::new(-5., 0., 0.), azimuth_rad))];
        world.place(&scene, Stamp::default(), 0, &weather, &car, |_| [9; 3]);
        let beside = |along: f32| Vec3::new(-5., 0., 0.) + sunward * along;
        // The car is 4 m long and 1.5 m high: its shadow ends 1.5 / tan(0.5) = 2.7 m behind it.
        let lit = brightness_from_above(&scene, &world, beside(3.5));
        let dark = brightness_from_above(&scene, &world, beside(-3.5));
        let behind = brightness_from_above(&scene, &world, beside(-5.5));
        assert!(dark * 5 < lit * 4, "{dark} against {lit}");
        assert!(behind * 10 > lit * 9, "{behind} against {lit}");
    }
}

#[test]
fn lamps_show_the_state_of_the_actor() {
    let mut lamp = Mesh::default();
    block(&mut lamp, [0., -1., 0.], [1., 1., 2.], Face::new(Tag::Car, Material::LampRed, 0));
    let mut signal = Mesh::default();
    for (row, material) in
        [Material::SignalRed, Material::SignalYellow, Material::SignalGreen].into_iter().enumerate()
    {
        let z = row as f32;
        let face = Face::new(Tag::TrafficLight, material, 0);
        block(&mut signal, [0., -1., z], [1., 1., z + 1.], face);
    }
    let meshes = [BlueprintMesh { mesh: &lamp }, BlueprintMesh { mesh: &signal }];
    let scene = Scene::new(&Mesh::default(), &meshes).unwrap();
    let reds = |brake: f32| {
        let car = ActorState { brake, ..actor(1, Pose::level(Vec3::new(6., 0., 0.), 0.)) };
        let measured = MeasuredBundle::measure(
            &mut cpu(1),
            &scene,
            &world_with(&scene, &[car]),
            &[camera(9, 9)],
        );
        measured.plane::<[u8; 4]>(0, output::COLOR)[40][0]
    };
    assert!(reds(1.0) > reds(0.0) + 30, "{} against {}", reds(1.0), reds(0.0));
    for phase in [
        protocol::light::RED,
        protocol::light::YELLOW,
        protocol::light::GREEN,
        protocol::light::OFF,
    ] {
        let light = ActorState {
            blueprint: 1,
            kind: kind::TRAFFIC_LIGHT,
            phase,
            ..actor(1, Pose::level(Vec3::new(4., 0., -0.5), 0.))
        };
        let world = world_with(&scene, &[light]);
        let measured = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[camera(90, 90)]);
        let colors = measured.plane::<[u8; 4]>(0, output::COLOR);
        // The centres of the three lamps are 0, 1 and 2 m above the ground below the camera, 4 m
        // ahead.
        let bright = [0., 1., 2.].map(|z: f32| {
            let row = (45. - (z - 1.0) / 4. * 45.) as usize;
            colors[row * 90 + 45][..3].iter().copied().max() > Some(180)
        });
        let wanted = [protocol::light::RED, protocol::light::YELLOW, protocol::light::GREEN]
            .map(|p| p == phase);
        assert_eq!(bright, wanted, "phase {phase}");
        if phase == protocol::light::GREEN {
            let [r, g, b, _] = colors[33 * 90 + 45].map(u32::from);
            assert!(10 * r.max(b) < 6 * g, "the green lamp is [{r}, {g}, {b}]");
        }
        if phase == protocol::light::YELLOW {
            let [r, g, b, _] = colors[45 * 90 + 45].map(u32::from);
            let is_yellow = 100 * g < 92 * r && 10 * g > 7 * r && 10 * b < 5 * r;
            assert!(is_yellow, "the yellow lamp is [{r}, {g}, {b}]");
        }
    }
}
