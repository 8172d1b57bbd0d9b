//! Rows of a rolling shutter see the world from where the camera was when they were read, and a thin lens
//! blurs what is out of focus.

use glam::Vec3;
use mesh::{Face, Material, Mesh, Tag};
use protocol::{ActorState, EffectsSpec, LensSpec, Pose, SensorSpec, layout, output, quality};

use super::lens::{lenses, tracers};
use super::{actor, block, camera, world_with};
use crate::{BlueprintMesh, BundleJob, Scene, Tracer, World, pose_planes};

const SIZE: [usize; 2] = [200, 160];
/// Pixels per unit of slope: 200 pixels over 90 degrees.
const FOCAL_PX: f32 = 100.0;
const DELTA_SECS: f32 = 0.05;

/// Returns a pole of 0.2 m and of any height around x = 10 and a wall behind it.
fn pole() -> Scene {
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Pole, Material::Rubber, 3);
    block(&mut mesh, [9.9, -0.1, -30.0], [10.1, 0.1, 30.0], face);
    let wall = Face::new(Tag::Building, Material::Sign, 4);
    block(&mut mesh, [40.0, -90.0, -90.0], [41.0, 90.0, 90.0], wall);
    Scene::new(&mesh, &[BlueprintMesh { mesh: &Mesh::default() }]).unwrap()
}

/// Parent of the camera, which is invisible because its blueprint has no mesh.
fn carrier(y: f32, yaw_rad: f32) -> ActorState {
    ActorState { blueprint: 999, ..actor(9, Pose::level(Vec3::new(0.0, y, 0.0), yaw_rad)) }
}

/// Measures one camera on a carrier that has moved; returns the bytes of each output.
fn measured(
    tracer: &mut Tracer,
    scene: &Scene,
    [before, now]: [ActorState; 2],
    spec: SensorSpec,
) -> Vec<(u32, Vec<u8>)> {
    let mut world = world_with(scene, &[now]);
    world.track_motion(scene, &[before], &[now]);
    world.place_slices(scene, &[before], &[now], &[spec], |_| [0; 3]);
    outputs_of(tracer, scene, &world, &now, spec)
}

/// Measures one camera on a carrier; returns the bytes of each output.
fn outputs_of(
    tracer: &mut Tracer,
    scene: &Scene,
    world: &World,
    carrier: &ActorState,
    spec: SensorSpec,
) -> Vec<(u32, Vec<u8>)> {
    let (mut planes, byte_len) = layout(&[spec]);
    pose_planes(&mut planes, &[spec], &carrier.pose);
    let mut words = vec![[0u64; 8]; byte_len as usize / 64 + 1];
    let out = bytemuck::cast_slice_mut(&mut words);
    let parent = carrier.actor_id;
    let mut jobs = [BundleJob { parent, sensors: &[spec], planes: &planes, out }];
    tracer.measure(scene, world, &mut jobs).unwrap();
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    let of = |plane: &protocol::Plane| {
        (plane.output, bytes[plane.offset as usize..][..plane.byte_len as usize].to_vec())
    };
    planes.iter().map(of).collect()
}

/// Returns the colours that a camera on `carrier` measures.
fn colors_of(
    tracer: &mut Tracer,
    scene: &Scene,
    world: &World,
    carrier: &ActorState,
    spec: SensorSpec,
) -> Vec<[u8; 4]> {
    let seen = outputs_of(tracer, scene, world, carrier, spec);
    bytemuck::cast_slice(plane(&seen, output::COLOR)).to_vec()
}

fn spec(effects: EffectsSpec) -> SensorSpec {
    SensorSpec { effects, ..camera(SIZE[0] as u32, SIZE[1] as u32) }
}

fn plane(measured: &[(u32, Vec<u8>)], wanted: u32) -> &[u8] {
    &measured.iter().find(|(output, _)| *output == wanted).unwrap().1
}

/// Returns the mean column of the pixels with this tag in a row, from the middle of the image.
fn column_of(tags: &[u8], row: usize, tag: Tag) -> f32 {
    let row = &tags[row * SIZE[0]..][..SIZE[0]];
    let columns: Vec<f32> = (0u8..)
        .zip(row)
        .filter(|(_, found)| **found == tag as u8)
        .map(|(column, _)| f32::from(column) + 0.5)
        .collect();
    assert!(!columns.is_empty());
    columns.iter().sum::<f32>() / columns.len() as f32 - SIZE[0] as f32 / 2.0
}

#[test]
fn a_pole_that_a_moving_camera_passes_is_slanted_by_speed_and_readout() {
    let scene = pole();
    let (speed, readout_secs) = (40.0, 0.03);
    for mut tracer in tracers() {
        for quality in [quality::LOW, quality::STANDARD] {
            let effects = EffectsSpec { readout_secs, ..EffectsSpec::default() };
            let spec = SensorSpec { quality, ..spec(effects) };
            // The camera moves to the left, so that the pole moves to the right.
            let pair = [carrier(-speed * DELTA_SECS, 0.0), carrier(0.0, 0.0)];
            let seen = measured(&mut tracer, &scene, pair, spec);
            let tags = plane(&seen, output::TAG);
            for row in (0..SIZE[1]).step_by(13) {
                let since_secs = readout_secs * (1.0 - (row as f32 + 0.5) / SIZE[1] as f32);
                let wanted = -FOCAL_PX / 9.9 * speed * since_secs;
                let found = column_of(tags, row, Tag::Pole);
                // Off the axis, the far corners of the pole are seen too.
                assert!((found - wanted).abs() < 0.8, "row {row}: {found} {wanted}");
            }
            let depths: &[f32] = bytemuck::cast_slice(plane(&seen, output::DEPTH));
            let at = SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2 - 6;
            assert!((depths[at] - 9.9).abs() < 1e-3, "{}", depths[at]);
            // The colours bend with the other outputs.
            let colors: &[[u8; 4]] = bytemuck::cast_slice(plane(&seen, output::COLOR));
            let [first, last] = [0, SIZE[1] - 1].map(|row| &colors[row * SIZE[0]..][..SIZE[0]]);
            assert_ne!(first, last);
            let still = measured(&mut tracer, &scene, [carrier(0.0, 0.0); 2], spec);
            let tags = plane(&still, output::TAG);
            assert_eq!(column_of(tags, 0, Tag::Pole), column_of(tags, SIZE[1] - 1, Tag::Pole));
        }
    }
}

#[test]
fn a_pole_is_slanted_by_the_turn_of_the_camera() {
    let scene = pole();
    let effects = EffectsSpec { readout_secs: DELTA_SECS, ..EffectsSpec::default() };
    for mut tracer in tracers() {
        let pair = [carrier(0.0, -0.08), carrier(0.0, 0.0)];
        let seen = measured(&mut tracer, &scene, pair, spec(effects));
        let tags = plane(&seen, output::TAG);
        for row in [0, 60, 159] {
            let share = 1.0 - (row as f32 + 0.5) / SIZE[1] as f32;
            let wanted = -FOCAL_PX * (0.08 * share).tan();
            let found = column_of(tags, row, Tag::Pole);
            assert!((found - wanted).abs() < 0.8, "row {row}: {found} {wanted}");
        }
    }
}

#[test]
fn an_edge_out_of_focus_is_as_wide_as_its_circle_of_confusion() {
    // A dark screen to the right of the optical axis, before a wall; thin, since a lens sees its side, which is out
    // of focus where its front is not.
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Pole, Material::Rubber, 3);
    block(&mut mesh, [9.9, -20.0, -30.0], [9.91, 0.0, 30.0], face);
    let wall = Face::new(Tag::Building, Material::Sign, 4);
    block(&mut mesh, [40.0, -90.0, -90.0], [41.0, 90.0, 90.0], wall);
    let scene = Scene::new(&mesh, &[BlueprintMesh { mesh: &Mesh::default() }]).unwrap();
    let focal_px = SIZE[0] as f32 / 2.0 / 0.25f32.tan();
    for mut tracer in tracers() {
        let mut row_of = |effects: EffectsSpec| -> Vec<[u8; 4]> {
            let spec = SensorSpec {
                quality: quality::EPIC,
                outputs: output::COLOR,
                fov_rad: 0.5,
                ..spec(effects)
            };
            let seen = measured(&mut tracer, &scene, [carrier(0.0, 0.0); 2], spec);
            let colors: &[[u8; 4]] = bytemuck::cast_slice(plane(&seen, output::COLOR));
            colors[SIZE[1] / 2 * SIZE[0]..][..SIZE[0]].to_vec()
        };
        let sharp = row_of(EffectsSpec { temperature_k: 6500.0, ..EffectsSpec::default() });
        for (aperture_m, focus_m) in [(0.5, 40.0), (0.4, 9.9), (0.3, 5.0), (0.1, 40.0)] {
            let circle_px = aperture_m * focal_px * (1.0 / 9.9f32 - 1.0 / focus_m).abs();
            let row = row_of(EffectsSpec { aperture_m, focus_m, ..EffectsSpec::default() });
            let changed = (0..SIZE[0]).filter(|x| row[*x][1].abs_diff(sharp[*x][1]) > 3);
            let reach = changed.map(|x| (x as f32 + 0.5 - SIZE[0] as f32 / 2.0).abs());
            let reach = reach.fold(0.0, f32::max);
            if circle_px < 0.5 {
                assert_eq!(reach, 0.0);
                continue;
            }
            // The outermost of 16 points lies at 0.93 of the radius.
            let radius_px = circle_px / 2.0;
            assert!(reach < radius_px + 0.6, "{reach} {radius_px}");
            assert!(reach > 0.85 * radius_px - 1.0, "{reach} {radius_px}");
        }
    }
}

#[test]
fn an_edge_that_moves_is_blurred_by_its_way_during_the_exposure() {
    // A box that moves 1 m to the left in a frame, and the same with a camera that moves with it.
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Dynamic, Material::Rubber, 0);
    block(&mut mesh, [-0.1, -1.0, -30.0], [0.1, 1.0, 30.0], face);
    let mut wall = Mesh::default();
    let face = Face::new(Tag::Building, Material::Sign, 4);
    block(&mut wall, [40.0, -90.0, -90.0], [41.0, 90.0, 90.0], face);
    let scene = Scene::new(&wall, &[BlueprintMesh { mesh: &mesh }]).unwrap();
    let car = |y: f32| actor(5, Pose::level(Vec3::new(10.0, y, 0.0), 0.0));
    let effects = EffectsSpec { blur_secs: 0.02, ..EffectsSpec::default() };
    let row_of = |tracer: &mut Tracer, camera_before: f32, effects: EffectsSpec| -> Vec<u8> {
        let spec = SensorSpec { quality: quality::EPIC, outputs: output::COLOR, ..spec(effects) };
        let before = [car(-1.0), carrier(camera_before, 0.0)];
        let now = [car(0.0), carrier(0.0, 0.0)];
        let mut world = world_with(&scene, &now);
        world.track_motion(&scene, &before, &now);
        world.place_slices(&scene, &before, &now, &[spec], |_| [0; 3]);
        let colors = colors_of(tracer, &scene, &world, &now[1], spec);
        let row = SIZE[1] / 2 * SIZE[0];
        colors[row..row + SIZE[0]].iter().map(|color| color[1]).collect()
    };
    for mut tracer in tracers() {
        let neutral = EffectsSpec { temperature_k: 6500.0, ..EffectsSpec::default() };
        let sharp = row_of(&mut tracer, 0.0, neutral);
        let blurred = row_of(&mut tracer, 0.0, effects);
        let changed: Vec<usize> =
            (0..SIZE[0]).filter(|x| sharp[*x].abs_diff(blurred[*x]) > 12).collect();
        // In 0.02 of 0.05 s, 0.4 m at a distance of 9.9 m: 4.04 pixels to the right of each edge.
        let edge = |y: f32| SIZE[0] as f32 / 2.0 - FOCAL_PX * y / 9.9;
        for edge in [edge(1.0), edge(-1.0)] {
            let near: Vec<f32> = changed
                .iter()
                .map(|x| *x as f32 + 0.5 - edge)
                .filter(|off| off.abs() < 12.0)
                .collect();
            let (low, high) = (near[0], near[near.len() - 1]);
            assert!((-1.0..=1.6).contains(&low) && (2.2..=4.6).contains(&high), "{near:?}");
        }
        assert!(changed.len() <= 12, "{changed:?}");
        let together = row_of(&mut tracer, -1.0, effects);
        let apart = (0..SIZE[0]).filter(|x| sharp[*x].abs_diff(together[*x]) > 12).count();
        assert_eq!(apart, 0, "what moves with the camera is sharp");
    }
}

#[test]
fn both_tracers_bend_the_same_rays() {
    let Some(mut gpu) = crate::gpu::tests::gpu() else { return };
    let scene = super::scene();
    let pair = [carrier(-0.6, -0.02), carrier(0.0, 0.0)];
    let size = SIZE.map(|size| size as u32);
    for lens in [LensSpec::default(), lenses(size)[0], lenses(size)[2]] {
        for quality in [quality::LOW, quality::STANDARD] {
            let effects = EffectsSpec {
                readout_secs: 0.03,
                blur_secs: 0.01,
                aperture_m: 0.02,
                focus_m: 8.0,
                bloom: 0.1,
                ..EffectsSpec::default()
            };
            let spec = SensorSpec { quality, lens, ..spec(effects) };
            let by_cpu = measured(&mut super::cpu(2), &scene, pair, spec);
            let by_gpu = measured(&mut gpu, &scene, pair, spec);
            let all = SIZE[0] * SIZE[1];
            for (output, size, one_in) in
                [(output::COLOR, 4, 1000), (output::TAG, 1, 5000), (output::INSTANCE, 4, 5000)]
            {
                let planes = [&by_cpu, &by_gpu].map(|measured| plane(measured, output));
                let most = if output == output::COLOR { 2 } else { 0 };
                let pairs = planes[0].chunks_exact(size).zip(planes[1].chunks_exact(size));
                let differ =
                    pairs.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > most));
                let count = differ.count();
                assert!(count <= all.div_ceil(one_in), "{quality} {output:#x}: {count} of {all}");
            }
        }
    }
}
