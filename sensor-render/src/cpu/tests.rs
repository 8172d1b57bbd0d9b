//! Packets, groups of rays and every instruction set agree with the reference implementation.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec3, vec3};
use protocol::{
    Frame, LensSpec, Name, Plane, Pose, SensorSpec, Stamp, Weather, layout, output, sensor,
};

use super::CpuTracer;
use super::occlusion;
use super::shadow::{self, Shadow};
use super::shortlist::Surroundings;
use super::traversal::Stack;
use crate::lidar::Lidar;
use crate::quality::Quality;
use crate::rays::{Sensor, rays};
use crate::reference::{Ray, closest};
use crate::simd::{Float, Isa, Kernel, LANES, Mask, V3};
use crate::tests::lens::lenses;
use crate::{BundleJob, Scene, World, pose_planes, sample};

fn town() -> (sample::Sample, Scene) {
    let town = sample::Sample::named("Flatford").unwrap();
    let scene = Scene::of_town(&town.town).unwrap();
    (town, scene)
}

fn world(town: &sample::Sample, scene: &Scene) -> World {
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(3), sim_time_nanos: 150_000_000, ..Default::default() };
    let weather = Weather::default();
    world.place(scene, stamp, 50_000_000, &weather, &town.traffic(60, 3), sample::paint);
    world
}

fn measure(
    isa: Isa,
    scene: &Scene,
    world: &World,
    spec: &SensorSpec,
    pose: &Pose,
) -> (Vec<Plane>, Vec<[u64; 8]>) {
    let sensors = [*spec];
    let (mut planes, byte_len) = layout(&sensors);
    pose_planes(&mut planes, &sensors, pose);
    let mut words = vec![[0u64; 8]; byte_len as usize / 64];
    let out = bytemuck::cast_slice_mut(&mut words);
    let mut jobs =
        [BundleJob { parent: protocol::ActorId::NONE, sensors: &sensors, planes: &planes, out }];
    CpuTracer::with_isa(1, isa).measure(scene, world, &mut jobs).unwrap();
    (planes, words)
}

fn plane<T: bytemuck::Pod>((planes, words): &(Vec<Plane>, Vec<[u64; 8]>), output: u32) -> &[T] {
    let plane = planes.iter().find(|plane| plane.output == output).unwrap();
    let bytes: &[u8] = bytemuck::cast_slice(words);
    bytemuck::cast_slice(&bytes[plane.offset as usize..][..plane.byte_len as usize])
}

fn camera(width: u32, height: u32, fov_rad: f32) -> SensorSpec {
    SensorSpec {
        name: Name::new("front"),
        kind: sensor::CAMERA,
        outputs: output::DEPTH | output::TAG | output::INSTANCE,
        width,
        height,
        fov_rad,
        ..Default::default()
    }
}

/// Returns depth, tag and id of a reference ray.
fn looked(scene: &Scene, world: &World, ray: Ray, far: f32) -> (f32, u8, u32) {
    let hit = closest(scene, world, ray, f32::INFINITY);
    if !hit.is_some() {
        return (far, mesh::Tag::Sky as u8, 0);
    }
    let triangle = &scene.triangles[hit.triangle as usize];
    let id = match world.instances.get(hit.instance as usize) {
        Some(actor) => actor.id,
        None => mesh::ObjectId::new(triangle.object).instance(),
    };
    (hit.t.min(far), triangle.tag(), id)
}

#[test]
fn camera_packets_agree_with_the_reference() {
    let (town, scene) = town();
    let world = world(&town, &scene);
    // A fine and a wide image, traced as packets, and a coarse one, traced as groups of rays; no size is
    // a multiple of 8.
    let [barrel, _, fisheye, _] = lenses([341, 253]);
    let through = |lens: LensSpec| SensorSpec { lens, ..camera(341, 253, FRAC_PI_2) };
    let specs = [
        camera(341, 253, FRAC_PI_2),
        camera(250, 61, 2.4),
        camera(84, 84, FRAC_PI_2),
        through(barrel),
        through(fisheye),
        through(LensSpec { focal_px: [110.0; 2], ..fisheye }),
    ];
    for (index, spec) in specs.iter().enumerate() {
        let pose = town.street_pose(index);
        let Sensor::Camera(camera) = rays(spec, &pose, world.stamp, 0, Quality::Low).unwrap()
        else {
            unreachable!()
        };
        for isa in Isa::all() {
            let measured = measure(isa, &scene, &world, spec, &pose);
            let (depths, tags, ids) = (
                plane::<f32>(&measured, output::DEPTH),
                plane::<u8>(&measured, output::TAG),
                plane::<u32>(&measured, output::INSTANCE),
            );
            let (mut wrong_depths, mut wrong_things) = (0, 0);
            for y in 0..spec.height {
                for x in 0..spec.width {
                    let at = (y * spec.width + x) as usize;
                    let (depth, tag, id) = match camera.direction(x, y) {
                        Some(direction) => {
                            let ray = Ray { origin: camera.origin, direction };
                            looked(&scene, &world, ray, protocol::DEPTH_FAR_M)
                        }
                        None => (protocol::DEPTH_FAR_M, 0, 0),
                    };
                    wrong_depths += usize::from((depth - depths[at]).abs() > 1e-4 * depth);
                    wrong_things += usize::from((tag, id) != (tags[at], ids[at]));
                }
            }
            let allowed = (spec.width * spec.height / 10_000).max(1) as usize;
            assert!(
                wrong_depths <= allowed && wrong_things <= allowed,
                "{} on {}: {wrong_depths} depths, {wrong_things} tags or ids",
                spec.width,
                isa.name()
            );
        }
    }
}

#[test]
fn coarse_lidars_agree_with_the_reference() {
    agrees_with_the_reference(TAU);
}

#[test]
fn fine_lidars_agree_with_the_reference() {
    agrees_with_the_reference(0.3);
}

fn agrees_with_the_reference(fov_rad: f32) {
    let (town, scene) = town();
    let world = world(&town, &scene);
    let spec = SensorSpec {
        kind: sensor::LIDAR,
        outputs: output::POINTS | output::LABELS,
        width: 333,
        height: 21,
        fov_rad,
        upper_rad: 0.2,
        lower_rad: -0.5,
        range_m: 80.0,
        ..Default::default()
    };
    let pose = town.street_pose(5).then(&Pose::level(vec3(0.0, 0.0, 0.7), 1.0));
    let Sensor::Lidar(lidar) = rays(&spec, &pose, world.stamp, 0, Quality::Low).unwrap() else {
        unreachable!()
    };
    for isa in Isa::all() {
        let measured = measure(isa, &scene, &world, &spec, &pose);
        let points = plane::<[f32; 4]>(&measured, output::POINTS);
        let labels = plane::<[u32; 2]>(&measured, output::LABELS);
        let mut wrong = 0;
        for beam in 0..(spec.width * spec.height) as usize {
            let ray = beam_of(&lidar, beam);
            let (t, tag, id) = looked(&scene, &world, ray, f32::INFINITY);
            let wanted = if t <= 80.0 { [id, u32::from(tag)] } else { [0; 2] };
            let distance = Vec3::from_slice(&points[beam]).length();
            let far = if t <= 80.0 { t } else { 0.0 };
            wrong += usize::from(labels[beam] != wanted || (distance - far).abs() > 1e-4 * far);
        }
        assert!(wrong <= 1, "{}: {wrong} beams", isa.name());
    }
}

fn beam_of(lidar: &Lidar, beam: usize) -> Ray {
    let azimuth = lidar.azimuths[beam / lidar.channels as usize];
    let [cos, sin] = lidar.elevations[beam % lidar.channels as usize];
    let in_sensor = vec3(cos * azimuth[0], cos * azimuth[1], sin);
    Ray { origin: lidar.origin, direction: lidar.axes * in_sensor }
}

/// Shadow rays from sixteen points at once; the result has one bit for each blocked ray.
struct ShadowRays<'a> {
    scene: &'a Scene,
    world: &'a World,
    points: &'a [Vec3; LANES],
    sun: Vec3,
}

impl Kernel for ShadowRays<'_> {
    type Output = u16;

    #[inline(always)]
    fn run<F: Float>(self) -> u16 {
        let origins = V3 {
            x: F::from_array(self.points.map(|point| point.x)),
            y: F::from_array(self.points.map(|point| point.y)),
            z: F::from_array(self.points.map(|point| point.z)),
        };
        let shadow =
            Shadow::<F> { direction: self.sun, origins, active: F::Mask::from_bits(u16::MAX) };
        shadow.blocked(self.scene, self.world, None, &mut Stack::new()).bits()
    }
}

/// Four groups of rays to the sun and to the sky, with lists of what is around them or without; the result has
/// which are blocked by anything, the distances of obstacles in the direction of the sky, and how many lists there
/// were.
struct SurroundedRays<'a> {
    scene: &'a Scene,
    world: &'a World,
    points: &'a [[Vec3; LANES]; 4],
    to_sun: [Vec3; 4],
    to_sky: [Vec3; 4],
    in_lists: bool,
}

impl Kernel for SurroundedRays<'_> {
    type Output = ([u16; 4], [[f32; LANES]; 4], usize);

    #[inline(always)]
    fn run<F: Float>(self) -> Self::Output {
        let SurroundedRays { scene, world, points, to_sun, to_sky, in_lists } = self;
        let all = F::Mask::from_bits(u16::MAX);
        let mut origins = [V3::<F>::splat(Vec3::ZERO); 4];
        for group in 0..4 {
            origins[group] = V3 {
                x: F::from_array(points[group].map(|point| point.x)),
                y: F::from_array(points[group].map(|point| point.y)),
                z: F::from_array(points[group].map(|point| point.z)),
            };
        }
        let mut stack = Stack::new();
        let mut around = Surroundings::<F>::new();
        let t = [F::splat(1.0); 4];
        around.begin(origins, &t, [all; 4], [to_sun, to_sky], in_lists);
        let (mut blocked, mut nearest, mut lists) = ([0; 4], [[0.0; LANES]; 4], 0);
        for group in 0..4 {
            let (origins, active) = (origins[group], all);
            let near = around.towards_sun(scene, world, 0.0, shadow::SPREAD_MAX);
            lists += usize::from(near.is_some());
            let rays = Shadow::<F> { direction: to_sun[group], origins, active };
            blocked[group] = rays.blocked(scene, world, near, &mut stack).bits();
            let near = around.towards_sky(scene, world, 0.0, occlusion::SPREAD_MAX);
            lists += usize::from(near.is_some());
            let rays = Shadow::<F> { direction: to_sky[group], origins, active };
            nearest[group] = rays.nearest(scene, world, near, &mut stack).to_array();
        }
        (blocked, nearest, lists)
    }
}

#[test]
fn rays_meet_the_same_in_lists_of_their_surroundings_as_in_the_whole_world() {
    let (town, scene) = town();
    let world = world(&town, &scene);
    let light = world.light();
    let samples = Quality::Standard.samples();
    let to_sun = std::array::from_fn(|group| light.on_sun(samples[group]));
    let sky = Quality::Standard.sky_directions();
    let to_sky = std::array::from_fn(|group| sky[group].truncate());
    let (mut rays, mut dark, mut near_obstacles, mut lists) = (0, 0, 0, 0);
    for (index, step_m) in (0..200).zip([0.02, 0.1, 0.5, 3.0].into_iter().cycle()) {
        // Beside the street too, where there are trees, walls and parked cars.
        let middle = town.street_pose(index);
        let foot = middle.then(&Pose::level(vec3(0.0, 0.7 * (index % 11) as f32, -1.5), 0.0));
        let points = std::array::from_fn(|group| {
            std::array::from_fn(|lane| {
                let [x, y] = [lane % 4, lane / 4].map(|at| at as f32 + 0.2 * group as f32);
                foot.position() + vec3(x, y, 0.02 * lane as f32) * step_m
            })
        });
        for isa in Isa::all() {
            let run = |in_lists| {
                let (scene, world, points) = (&scene, &world, &points);
                isa.run(SurroundedRays { scene, world, points, to_sun, to_sky, in_lists })
            };
            let (blocked, nearest, found) = run(true);
            let (expected_blocked, expected_nearest, none) = run(false);
            assert_eq!(
                (blocked, nearest, none),
                (expected_blocked, expected_nearest, 0),
                "{index}"
            );
            rays += 4 * LANES;
            dark += blocked.iter().map(|blocked| blocked.count_ones() as usize).sum::<usize>();
            near_obstacles += nearest.as_flattened().iter().filter(|t| **t < 2.0).count();
            lists += found;
        }
    }
    assert!(dark * 20 > rays && dark * 20 < rays * 19, "{dark} of {rays} are dark");
    assert!(near_obstacles * 50 > rays, "{near_obstacles} of {rays} have an obstacle");
    // All but those 3 m apart: 8 of a block.
    assert!(lists * 64 * 10 > rays * 8 * 6, "{lists} lists for {rays} rays");
}

#[test]
fn shadow_packets_agree_with_the_reference() {
    let (town, scene) = town();
    let world = world(&town, &scene);
    let sun = vec3(0.5, 0.3, 0.6).normalize_or(Vec3::Z);
    let (mut asked, mut dark, mut wrong) = (0, 0, 0);
    for (index, step_m) in (0..200).zip([0.02, 0.1, 0.6, 3.0].into_iter().cycle()) {
        let foot = town.street_pose(index).position() - vec3(0.0, 0.0, 1.6);
        let points: [Vec3; LANES] = std::array::from_fn(|lane| {
            foot + vec3((lane % 4) as f32, (lane / 4) as f32, 0.0) * step_m
        });
        for isa in Isa::all() {
            let (scene, world, points) = (&scene, &world, &points);
            let blocked = isa.run(ShadowRays { scene, world, points, sun });
            for (lane, origin) in points.iter().copied().enumerate() {
                let ray = Ray { origin, direction: sun };
                let is_dark = closest(scene, world, ray, f32::INFINITY).is_some();
                asked += 1;
                dark += usize::from(is_dark);
                wrong += usize::from(is_dark != (blocked >> lane & 1 != 0));
            }
        }
    }
    assert!(dark * 20 > asked && dark * 20 < asked * 19, "{dark} of {asked} are dark");
    assert!(wrong * 2000 <= asked, "{wrong} of {asked} differ");
}
