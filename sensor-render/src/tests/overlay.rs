//! Debug shapes appear where a pinhole camera projects them, and only in colour images.

use std::sync::Arc;

use glam::{Quat, Vec3};
use protocol::{Pose, SensorSpec, Shape, output, shape};

use super::{MeasuredBundle, camera, cpu, lidar, scene, world_with};
use crate::{Overlay, Tracer};

const SIZE: [usize; 2] = [161, 121];
/// Pixels per metre at a distance of 1 m: 161 pixels over 90 degrees.
const FOCAL: f32 = 80.5;
const RED: u32 = u32::from_le_bytes([255, 0, 0, 255]);

fn sensors() -> [SensorSpec; 2] {
    let mut camera = camera(SIZE[0] as u32, SIZE[1] as u32);
    camera.outputs = output::OF_CAMERA;
    [camera, lidar(90, 8)]
}

fn measured(tracer: &mut Tracer, shapes: &[Shape]) -> MeasuredBundle {
    let scene = scene();
    let mut world = world_with(&scene, &[]);
    world.set_overlay(Arc::new(Overlay::new(shapes)));
    MeasuredBundle::measure(tracer, &scene, &world, &sensors())
}

fn red(begin: Vec3, end: Vec3) -> Shape {
    Shape {
        begin_m: begin.to_array(),
        end_m: end.to_array(),
        color: RED,
        ..Shape::new(shape::LINE)
    }
}

/// Returns the pixels that are pure red.
fn marked(bundle: &MeasuredBundle) -> Vec<[usize; 2]> {
    let colors = bundle.plane::<[u8; 4]>(0, output::COLOR).iter().enumerate();
    let red = colors.filter(|(_, color)| u32::from_le_bytes(**color) == RED);
    red.map(|(at, _)| [at % SIZE[0], at / SIZE[0]]).collect()
}

/// Projects a point of the world into the image of the camera, which is 1 m above the ground.
fn pixel(at: Vec3) -> [f32; 2] {
    [80.0 - FOCAL * at.y / at.x, 60.0 - FOCAL * (at.z - 1.0) / at.x]
}

#[test]
fn a_line_appears_at_its_projection_only() {
    let (begin, end) = (Vec3::new(6.0, 3.0, 0.5), Vec3::new(15.0, -6.0, 4.0));
    let bundle = measured(&mut cpu(1), &[red(begin, end)]);
    let marked = marked(&bundle);
    let share = |at: [usize; 2]| {
        let [[u0, v0], [u1, v1]] = [pixel(begin), pixel(end)];
        let (along, from) = ([u1 - u0, v1 - v0], [at[0] as f32 - u0, at[1] as f32 - v0]);
        let square = along[0] * along[0] + along[1] * along[1];
        let share = (from[0] * along[0] + from[1] * along[1]) / square;
        let off = (from[0] * along[1] - from[1] * along[0]).abs() / square.sqrt();
        (share, off, square.sqrt())
    };
    for at in &marked {
        let (share, off, length) = share(*at);
        assert!(off <= 0.85 && (-1.0 / length..=1.0 + 1.0 / length).contains(&share), "{at:?}");
    }
    let (_, _, length) = share([0, 0]);
    assert!(marked.len() as f32 >= length, "{} pixels of {length}", marked.len());
}

#[test]
fn only_colour_images_show_debug_shapes() {
    let line = red(Vec3::new(6.0, 3.0, 0.5), Vec3::new(6.0, -3.0, 2.0));
    let (bare, drawn) = (measured(&mut cpu(1), &[]), measured(&mut cpu(1), &[line]));
    for plane in &bare.planes {
        let range = plane.offset as usize..(plane.offset + plane.byte_len) as usize;
        let is_same = bare.bytes()[range.clone()] == drawn.bytes()[range];
        assert_eq!(is_same, plane.output != output::COLOR, "{:#x}", plane.output);
    }
}

#[test]
fn nearer_surfaces_hide_debug_shapes() {
    let wall_x = 20.0;
    let behind = red(Vec3::new(wall_x + 8.0, -3.0, 1.0), Vec3::new(wall_x + 8.0, 3.0, 1.0));
    assert_eq!(marked(&measured(&mut cpu(1), &[behind])).len(), 0);
    let before = red(Vec3::new(wall_x - 1.0, -3.0, 1.0), Vec3::new(wall_x - 1.0, 3.0, 1.0));
    assert!(marked(&measured(&mut cpu(1), &[before])).len() > 20);
    // Nothing hides a shape in front of the sky.
    let high = red(Vec3::new(2000.0, -300.0, 900.0), Vec3::new(2000.0, 300.0, 900.0));
    assert!(marked(&measured(&mut cpu(1), &[high])).len() > 20);
    // A shape behind the camera is not visible.
    let back = red(Vec3::new(-5.0, -3.0, 1.0), Vec3::new(-5.0, 3.0, 1.0));
    assert_eq!(marked(&measured(&mut cpu(1), &[back])).len(), 0);
}

#[test]
fn a_line_has_its_thickness_and_at_least_its_minimum_pixels() {
    let rows = |size_m: f32, pixels: f32| {
        let line = red(Vec3::new(10.0, -3.0, 3.0), Vec3::new(10.0, 3.0, 3.0));
        let marked = marked(&measured(&mut cpu(1), &[Shape { size_m, pixels, ..line }]));
        marked.iter().filter(|[x, _]| *x == 80).count() as f32
    };
    assert!((rows(1.0, 1.0) - FOCAL / 10.0).abs() <= 1.0, "{}", rows(1.0, 1.0));
    assert!((rows(0.0, 5.0) - 5.0).abs() <= 1.0, "{}", rows(0.0, 5.0));
}

#[test]
fn a_box_has_its_corners_and_an_arrow_its_barbs() {
    let turn = Quat::from_rotation_z(0.5) * Quat::from_rotation_x(0.2);
    let (middle, half) = (Vec3::new(9.0, 0.5, 1.5), Vec3::new(1.5, 2.0, 1.0));
    let cuboid = Shape {
        begin_m: middle.to_array(),
        end_m: half.to_array(),
        rotation: turn.to_array(),
        color: RED,
        pixels: 2.0,
        ..Shape::new(shape::BOX)
    };
    let corners = (0..8).map(|at| {
        let side = |bit: usize| if at & bit == 0 { -1.0 } else { 1.0 };
        middle + turn * (half * Vec3::new(side(1), side(2), side(4)))
    });
    let (begin, end, head) = (Vec3::new(8.0, 3.0, 0.6), Vec3::new(8.0, -1.0, 0.6), 0.5);
    let arrow = Shape { head_m: head, pixels: 2.0, ..red(begin, end) };
    let arrow = Shape { kind: shape::ARROW, ..arrow };
    let barbs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let barbs = barbs.map(|(x, z)| end + Vec3::new(x * head, head, z * head));
    for (shape, ends) in
        [(cuboid, corners.collect::<Vec<_>>()), (arrow, [&barbs[..], &[begin, end]].concat())]
    {
        let marked = marked(&measured(&mut cpu(1), &[shape]));
        for place in ends {
            let [u, v] = pixel(place);
            let near =
                |[x, y]: &[usize; 2]| (*x as f32 - u).abs() < 1.1 && (*y as f32 - v).abs() < 1.1;
            assert!(marked.iter().any(near), "{place} at {u}, {v}");
        }
    }
}

#[test]
fn a_text_faces_the_camera_and_is_centred_on_its_position() {
    let at = Vec3::new(12.0, 1.0, 3.0);
    let text = Shape { begin_m: at.to_array(), color: RED, ..Shape::new(shape::TEXT) };
    let bundle = measured(&mut cpu(1), &[text.with_text("T-").unwrap()]);
    let marked = marked(&bundle);
    let [u, v] = pixel(at);
    let row = |y: usize| marked.iter().filter(|at| at[1] == y).map(|at| at[0]).collect::<Vec<_>>();
    let top = marked.iter().map(|at| at[1]).min().unwrap();
    // The letter T is a bar over a stem; the dash is beside its centre.
    assert!((top as f32 + 3.0 - v).abs() <= 1.0, "{top} {v}");
    let bar = row(top);
    assert_eq!(bar.len(), 5);
    assert!((bar[0] as f32 + 5.0 - u).abs() <= 1.0, "{bar:?} {u}");
    assert_eq!(row(top + 6), [bar[2]]);
    let dash: Vec<usize> = [bar[2]].into_iter().chain(bar[0] + 6..bar[0] + 11).collect();
    assert_eq!(row(top + 3), dash);
    assert_eq!(marked.len(), 5 + 6 + 5);
    let shaded = Shape { shadow: 1, ..text }.with_text("T-").unwrap();
    let shaded = measured(&mut cpu(1), &[shaded]);
    let colors = shaded.plane::<[u8; 4]>(0, output::COLOR);
    assert_eq!(colors[(top + 1) * SIZE[0] + bar[0] + 1], [0, 0, 0, 255]);
}

#[test]
fn many_shapes_cover_the_same_pixels_as_each_of_them_alone() {
    // Every leaf of the hierarchy is found: single shapes cover the same pixels as all shapes
    // together.
    let place = |at: u32| {
        let (x, y) = (at % 12, at / 12);
        Vec3::new(4.0 + 1.2 * x as f32, y as f32 - 5.0, 0.3 + (at * 7 % 5) as f32)
    };
    let shapes: Vec<Shape> = (0..120)
        .map(|at| Shape { size_m: 0.1, ..red(place(at), place(at) + Vec3::new(0.2, 0.3, -0.2)) })
        .collect();
    let together = marked(&measured(&mut cpu(2), &shapes));
    let mut apart: Vec<_> =
        shapes.iter().flat_map(|shape| marked(&measured(&mut cpu(1), &[*shape]))).collect();
    apart.sort_unstable_by_key(|[x, y]| [*y, *x]);
    apart.dedup();
    assert_eq!(together, apart);
    assert!(together.len() > 300, "{}", together.len());
}

#[test]
fn the_gpu_draws_the_same_shapes() {
    let Some(mut gpu) = crate::gpu::tests::gpu() else { return };
    let mut shapes = Vec::new();
    for at in 0..40u32 {
        let place = Vec3::new(3.0 + at as f32 * 0.6, (at * 5 % 11) as f32 - 5.0, 0.2);
        let to = place + Vec3::new(1.0, (at % 3) as f32 - 1.0, 0.1 * at as f32);
        let color = 0xff00_0000 | at.wrapping_mul(0x0047_1f3b);
        let like = Shape { color, size_m: 0.01 * (at % 7) as f32, head_m: 0.2, ..red(place, to) };
        shapes.push(Shape { kind: 1 + at % 3, ..like });
        let half = [0.3, 0.2 + 0.01 * at as f32, 0.4];
        let rotation = Quat::from_rotation_z(at as f32).to_array();
        shapes.push(Shape { kind: shape::BOX, end_m: half, rotation, ..like });
        let text = Shape { kind: shape::TEXT, shadow: at % 2, ..like };
        shapes.push(text.with_text(&format!("no. {at} {{~}}")).unwrap());
    }
    let scene = scene();
    let mut world = world_with(&scene, &[]);
    world.set_overlay(Arc::new(Overlay::new(&shapes)));
    let front = SensorSpec {
        outputs: output::COLOR | output::TAG,
        parent_from_sensor: Pose::level(Vec3::new(0.1, 0.05, 1.3), 0.03),
        ..camera(321, 243)
    };
    let by_cpu = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &[front]);
    let by_gpu = MeasuredBundle::measure(&mut gpu, &scene, &world, &[front]);
    world.set_overlay(Arc::default());
    let bare = MeasuredBundle::measure(&mut gpu, &scene, &world, &[front]);
    let [a, b, bare] =
        [&by_cpu, &by_gpu, &bare].map(|bundle| bundle.plane::<[u8; 4]>(0, output::COLOR));
    let differ = |a: &[[u8; 4]], b: &[[u8; 4]]| {
        let apart = |(a, b): &(&[u8; 4], &[u8; 4])| (0..4).any(|i| a[i].abs_diff(b[i]) > 2);
        a.iter().zip(b).filter(apart).count()
    };
    assert!(differ(b, bare) > 3000, "{} pixels are drawn", differ(b, bare));
    assert!(differ(a, b) <= a.len() / 1000, "{} of {} differ", differ(a, b), a.len());
}
