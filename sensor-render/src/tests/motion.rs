//! Normals and optical flow agree with the motion of actors and cameras.

use glam::{Quat, Vec2, Vec3};
use protocol::{
    ActorId, ActorState, LensSpec, Plane, Pose, Projection, SensorSpec, flag, layout, output,
};

use super::lens::{lenses, tracers};
use super::{actor, camera, scene, world_with};
use crate::{BundleJob, Scene, Tracer, World, pose_planes};

/// Image size, and a pixel's side at depth 1: 81 pixels over 90 degrees.
const SIZE: [usize; 2] = [81, 61];
const SIDE: f32 = 2.0 / 81.0;

/// Measurement of one camera.
struct Picture(Vec<(u32, Vec<f32>)>);

impl Picture {
    fn of(
        tracer: &mut Tracer,
        scene: &Scene,
        world: &World,
        carrier: &ActorState,
        lens: LensSpec,
    ) -> Picture {
        let outputs = output::NORMAL | output::FLOW | output::DEPTH | output::INSTANCE;
        let spec = SensorSpec { outputs, lens, ..camera(SIZE[0] as u32, SIZE[1] as u32) };
        let (mut planes, byte_len) = layout(&[spec]);
        pose_planes(&mut planes, &[spec], &carrier.pose);
        let mut words = vec![[0xa5a5_a5a5_a5a5_a5a5u64; 8]; byte_len as usize / 64 + 1];
        let out = bytemuck::cast_slice_mut(&mut words);
        let parent = carrier.actor_id;
        let mut jobs = [BundleJob { parent, sensors: &[spec], planes: &planes, out }];
        tracer.measure(scene, world, &mut jobs).unwrap();
        let bytes: &[u8] = bytemuck::cast_slice(&words);
        let of = |p: &Plane| {
            let bytes = &bytes[p.offset as usize..][..p.byte_len as usize];
            (p.output, bytemuck::cast_slice(bytes).to_vec())
        };
        Picture(planes.iter().map(of).collect())
    }

    fn at<const N: usize>(&self, wanted: u32, [x, y]: [usize; 2]) -> [f32; N] {
        let plane = self.0.iter().find(|(output, _)| *output == wanted).unwrap();
        std::array::from_fn(|i| plane.1[(y * SIZE[0] + x) * N + i])
    }

    fn flow(&self, pixel: [usize; 2]) -> Vec2 {
        self.at::<2>(output::FLOW, pixel).into()
    }

    fn normal(&self, pixel: [usize; 2]) -> Vec3 {
        self.at::<3>(output::NORMAL, pixel).into()
    }

    fn depth(&self, pixel: [usize; 2]) -> f32 {
        self.at::<1>(output::DEPTH, pixel)[0]
    }
}

fn nobody(pose: Pose) -> ActorState {
    ActorState { pose, ..actor(0, pose) }
}

/// Offset from the centre of the image, in pixels to the right and down.
fn from_middle([x, y]: [usize; 2]) -> Vec2 {
    Vec2::new(x as f32 - 40.0, y as f32 - 30.0)
}

fn close(a: Vec2, b: Vec2) {
    assert!((a - b).length() < 0.01, "{a} is not {b}");
}

/// Measures the world `now` whose previous frame was `before`.
fn measured(
    tracer: &mut Tracer,
    carrier: u32,
    before: &[ActorState],
    now: &[ActorState],
) -> Picture {
    measured_through(LensSpec::default(), tracer, carrier, before, now)
}

fn measured_through(
    lens: LensSpec,
    tracer: &mut Tracer,
    carrier: u32,
    before: &[ActorState],
    now: &[ActorState],
) -> Picture {
    let scene = scene();
    let mut world = world_with(&scene, now);
    world.track_motion(&scene, before, now);
    let of_carrier = now.iter().find(|a| a.actor_id == ActorId(carrier));
    let carrier = of_carrier.copied().unwrap_or(nobody(Pose::IDENTITY));
    Picture::of(tracer, &scene, &world, &carrier, lens)
}

fn car_at(x: f32, y: f32) -> ActorState {
    actor(5, Pose::level(Vec3::new(x, y, 0.0), 0.0))
}

/// Parent of the camera, which is invisible because its blueprint has no mesh.
fn carrier_at(x: f32, y: f32, yaw_rad: f32) -> ActorState {
    ActorState { blueprint: 999, ..actor(9, Pose::level(Vec3::new(x, y, 0.0), yaw_rad)) }
}

#[test]
fn a_normal_points_from_the_surface_towards_the_camera() {
    for mut tracer in tracers() {
        let picture = measured(&mut tracer, 0, &[], &[]);
        assert!((picture.normal([40, 28]) - Vec3::NEG_X).length() < 1e-5, "the wall ahead");
        assert!((picture.normal([40, 50]) - Vec3::Z).length() < 1e-5, "the floor");
        assert_eq!(picture.normal([40, 0]), Vec3::ZERO, "the sky");
        // The camera is turned a quarter to the left, so the side of the wall is to its right.
        let turned = [carrier_at(22.0, -12.0, std::f32::consts::FRAC_PI_4)];
        let picture = measured(&mut tracer, 9, &turned, &turned);
        let side = Vec3::NEG_Y;
        let of_wall = Quat::from_rotation_z(-std::f32::consts::FRAC_PI_4) * side;
        let close = (0..SIZE[0]).any(|x| (picture.normal([x, 28]) - of_wall).length() < 1e-4);
        assert!(close, "{of_wall}");
    }
}

#[test]
fn a_resting_object_has_no_flow_for_a_resting_camera() {
    for mut tracer in tracers() {
        let now = [car_at(8.0, 0.0)];
        let picture = measured(&mut tracer, 0, &now, &now);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                assert!(
                    picture.flow([x, y]).length() < 1e-3,
                    "({x}, {y}) {}",
                    picture.flow([x, y])
                );
            }
        }
    }
}

#[test]
fn a_car_that_moves_left_flows_left_and_the_wall_behind_it_does_not() {
    for mut tracer in tracers() {
        let (before, now) = ([car_at(8.0, 0.0)], [car_at(8.0, 0.5)]);
        let picture = measured(&mut tracer, 0, &before, &now);
        let on_car = [38, 30];
        assert!((picture.depth(on_car) - 6.0).abs() < 1e-3);
        close(picture.flow(on_car), Vec2::new(-0.5 / (6.0 * SIDE), 0.0));
        assert_eq!(picture.flow([70, 28]), Vec2::ZERO, "the wall");
    }
}

#[test]
fn a_camera_that_moves_ahead_measures_flow_away_from_the_centre() {
    for mut tracer in tracers() {
        let (before, now) = ([carrier_at(-1.0, 0.0, 0.0)], [carrier_at(0.0, 0.0, 0.0)]);
        let picture = measured(&mut tracer, 9, &before, &now);
        for pixel in [[10, 50], [40, 50], [54, 28], [70, 45]] {
            let from = from_middle(pixel);
            close(
                picture.flow(pixel),
                from - from * picture.depth(pixel) / (picture.depth(pixel) + 1.0),
            );
        }
        close(picture.flow([5, 2]), Vec2::ZERO);
    }
}

#[test]
fn flow_through_a_lens_leads_to_the_pixel_that_showed_the_point_before() {
    for mut tracer in tracers() {
        for lens in lenses(SIZE.map(|size| size as u32)) {
            let spec = SensorSpec { lens, ..camera(SIZE[0] as u32, SIZE[1] as u32) };
            let projection = Projection::of(&spec).unwrap();
            let (before, now) = ([carrier_at(-1.0, 0.3, -0.04)], [carrier_at(0.0, 0.0, 0.0)]);
            let before_from_now = before[0].pose.affine().inverse() * now[0].pose.affine();
            let picture = measured_through(lens, &mut tracer, 9, &before, &now);
            let mut seen = 0;
            for (x, y) in
                (0..SIZE[1]).step_by(4).flat_map(|y| (0..SIZE[0]).step_by(4).map(move |x| (x, y)))
            {
                let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let depth = picture.depth([x, y]);
                if picture.normal([x, y]) == Vec3::ZERO {
                    continue;
                }
                // The camera stands 1 m above its carrier.
                let point = projection.unproject(pixel, depth).unwrap() + Vec3::Z;
                let then = before_from_now.transform_point3(point) - Vec3::Z;
                let Some(then) = projection.project(then) else { continue };
                close(picture.flow([x, y]), pixel - then);
                seen += 1;
            }
            assert!(seen > 60, "{lens:?}: {seen}");
        }
    }
}

#[test]
fn a_camera_that_turns_left_measures_flow_to_the_right_even_in_the_sky() {
    for mut tracer in tracers() {
        let (before, now) = ([carrier_at(0.0, 0.0, 0.0)], [carrier_at(0.0, 0.0, 0.05)]);
        let picture = measured(&mut tracer, 9, &before, &now);
        // The direction of the centre was 0.05 rad to the left of straight ahead.
        close(picture.flow([40, 28]), Vec2::new(0.05f32.tan() / SIDE, picture.flow([40, 28]).y));
        let sky = [40, 1];
        assert_eq!(picture.normal(sky), Vec3::ZERO);
        close(
            picture.flow(sky),
            Vec2::new(0.05f32.tan() / SIDE, from_middle(sky).y * (1.0 - 1.0 / 0.05f32.cos())),
        );
    }
}

#[test]
fn a_teleported_or_new_actor_has_no_flow() {
    for mut tracer in tracers() {
        let jumped = ActorState { flags: flag::TELEPORTED, ..car_at(8.0, 0.5) };
        for before in [vec![car_at(8.0, -3.0)], vec![]] {
            assert_eq!(measured(&mut tracer, 0, &before, &[jumped]).flow([38, 30]), Vec2::ZERO);
        }
    }
}

#[test]
fn both_tracers_measure_the_same_normals_and_flow() {
    let mut tracers: Vec<Tracer> = tracers().collect();
    let [first, others @ ..] = &mut tracers[..] else { unreachable!("there is a CPU") };
    let before = [car_at(8.0, 0.0), carrier_at(-1.0, 0.3, -0.04)];
    let now = [car_at(8.0, 0.5), carrier_at(0.0, 0.0, 0.0)];
    for lens in lenses(SIZE.map(|size| size as u32)).into_iter().chain([LensSpec::default()]) {
        let wanted = measured_through(lens, first, 9, &before, &now);
        for other in &mut *others {
            let found = measured_through(lens, other, 9, &before, &now);
            for ((output, wanted), (_, found)) in wanted.0.iter().zip(&found.0) {
                if !matches!(*output, output::NORMAL | output::FLOW) {
                    continue;
                }
                let differ = wanted.iter().zip(found).filter(|(a, b)| (**a - **b).abs() > 0.01);
                // Rays that graze an edge hit one side or the other.
                let (count, of) = (differ.count(), wanted.len());
                assert!(count <= of / 500, "{lens:?}: output {output:#x}: {count} of {of}");
            }
        }
    }
}
