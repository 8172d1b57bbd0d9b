//! Cameras with a lens show points where the formulas of OpenCV project them.

use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{
    DEPTH_FAR_M, LensSpec, Pose, Projection, SensorSpec, Shape, lens_model, output, quality, shape,
};

use super::{MeasuredBundle, actor, block, camera, cpu, world_with};
use crate::{BlueprintMesh, Overlay, Scene, Tracer};

const SIZE: [u32; 2] = [640, 400];

/// Returns lenses for an image of this size: barrel and pincushion distortion, a fisheye of more than
/// 180 degrees with an image circle, and a pinhole with its own principal point.
pub(crate) fn lenses([width, height]: [u32; 2]) -> [LensSpec; 4] {
    let [width, height] = [width, height].map(|size| size as f32);
    let lens = |model: u32, focal: f32, coefficients: [f32; 5]| LensSpec {
        model,
        focal_px: [focal * width, focal * 1.02 * width],
        center_px: [0.52 * width, 0.47 * height],
        coefficients,
        ..LensSpec::default()
    };
    let fisheye = lens(lens_model::FISHEYE, 0.19, [0.03, -0.008, 0.002, -0.0003, 0.0]);
    [
        lens(lens_model::BROWN_CONRADY, 0.48, [-0.22, 0.05, 0.002, -0.001, -0.004]),
        lens(lens_model::BROWN_CONRADY, 0.7, [0.12, 0.06, -0.001, 0.003, 0.0]),
        LensSpec { max_angle_rad: 1.75, ..fisheye },
        lens(lens_model::PINHOLE, 0.6, [0.0; 5]),
    ]
}

/// The formulas of OpenCV's `projectPoints`, of a point that is `forward`, `left` and `up` of the camera.
fn formula(lens: &LensSpec, [forward, left, up]: [f64; 3]) -> [f64; 2] {
    let [k1, k2, p1, p2, k3] = lens.coefficients.map(f64::from);
    let [x, y, z] = [-left, -up, forward];
    let [a, b] = if lens.model == lens_model::FISHEYE {
        let [k1, k2, k3, k4, _] = lens.coefficients.map(f64::from);
        let from_axis = x.hypot(y);
        let t = from_axis.atan2(z);
        let bent = t * (1.0 + k1 * t.powi(2) + k2 * t.powi(4) + k3 * t.powi(6) + k4 * t.powi(8));
        [x, y].map(|side| bent * side / from_axis)
    } else {
        let (x, y) = (x / z, y / z);
        let r2 = x * x + y * y;
        let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    };
    let [[fx, fy], [cx, cy]] = [lens.focal_px, lens.center_px].map(|pair| pair.map(f64::from));
    [cx + fx * a, cy + fy * b]
}

fn spec(lens: LensSpec) -> SensorSpec {
    SensorSpec { lens, ..camera(SIZE[0], SIZE[1]) }
}

pub(crate) fn tracers() -> impl Iterator<Item = Tracer> {
    [Some(cpu(2)), crate::gpu::tests::gpu()].into_iter().flatten()
}

#[test]
fn cubes_all_around_are_shown_where_the_formula_projects_them() {
    const HALF_M: f32 = 0.1;
    let mut cube = Mesh::default();
    let face = Face::new(Tag::Dynamic, Material::Sign, 0);
    block(&mut cube, [-HALF_M; 3], [HALF_M; 3], face);
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &cube }]).unwrap();
    // The camera is turned and moved; cubes lie on spirals around its axis, up to 108 degrees from it.
    let stand = Pose::new(
        Vec3::new(30.0, -12.0, 3.0),
        Quat::from_euler(glam::EulerRot::ZYX, 0.7, -0.2, 0.1),
    );
    let place = |index: u32| {
        let (angle, turn) = (0.03 + 0.0155 * index as f32, 2.4 * index as f32);
        let (across, ahead) = angle.sin_cos();
        let distance = 4.0 + 0.7 * (index % 7) as f32;
        Vec3::new(ahead, across * turn.cos(), across * turn.sin()) * distance
    };
    let actors: Vec<_> = (0..120)
        .map(|index| {
            let at = stand.affine().transform_point3(place(index));
            actor(index + 1, Pose::new(at, stand.rotation()))
        })
        .collect();
    let world = world_with(&scene, &actors);
    for mut tracer in tracers() {
        for lens in lenses(SIZE) {
            let spec = SensorSpec { parent_from_sensor: stand, ..spec(lens) };
            let measured = MeasuredBundle::measure(&mut tracer, &scene, &world, &[spec]);
            let ids = measured.plane::<u32>(0, output::INSTANCE);
            let depths = measured.plane::<f32>(0, output::DEPTH);
            let mut seen = 0;
            for index in 0..120 {
                let at = place(index);
                if lens.max_angle_rad > 0.0
                    && 0.03 + 0.0155 * index as f32 > lens.max_angle_rad - 0.05
                {
                    // The image circle cuts it.
                    continue;
                }
                let pixels: Vec<usize> = (0..ids.len()).filter(|i| ids[*i] == index + 1).collect();
                let mean = |part: fn(usize) -> usize| {
                    pixels.iter().map(|i| part(*i) as f64 + 0.5).sum::<f64>() / pixels.len() as f64
                };
                let center = [mean(|i| i % SIZE[0] as usize), mean(|i| i / SIZE[0] as usize)];
                let [column, row] = center.map(|px| px as usize);
                if pixels.len() < 12
                    || !(12..SIZE[0] as usize - 12).contains(&column)
                    || !(12..SIZE[1] as usize - 12).contains(&row)
                {
                    continue;
                }
                let wanted = formula(&lens, at.as_dvec3().to_array());
                let off = (wanted[0] - center[0]).hypot(wanted[1] - center[1]);
                // The nearer side of a cube is larger, which moves the mean of its pixels.
                assert!(off < 0.5 + 0.03 * (pixels.len() as f64).sqrt(), "{lens:?} {index}: {off}");
                let depth = depths[row * SIZE[0] as usize + column];
                let far = if lens.model == lens_model::FISHEYE { at.length() } else { at.x };
                assert!((depth - far).abs() < 1.8 * HALF_M, "{lens:?} {index}: {depth} {far}");
                seen += 1;
            }
            let least = if lens.model == lens_model::FISHEYE { 90 } else { 30 };
            assert!(seen >= least, "{lens:?}: {seen} cubes");
        }
    }
}

#[test]
fn a_point_of_the_depth_image_is_projected_to_its_pixel() {
    // The floor is 1 m below the camera, the wall 20 m ahead.
    let scene = super::scene();
    let world = world_with(&scene, &[]);
    for mut tracer in tracers() {
        for lens in lenses(SIZE) {
            let spec = spec(lens);
            let projection = Projection::of(&spec).unwrap();
            let measured = MeasuredBundle::measure(&mut tracer, &scene, &world, &[spec]);
            let depths = measured.plane::<f32>(0, output::DEPTH);
            let tags = measured.plane::<u8>(0, output::TAG);
            let (mut floor, mut far_m) = (0, 0.0_f32);
            for at in (0..depths.len()).step_by(7).filter(|at| tags[*at] == Tag::Roads as u8) {
                let [x, y] =
                    [at % SIZE[0] as usize, at / SIZE[0] as usize].map(|px| px as f32 + 0.5);
                let point = projection.unproject(Vec2::new(x, y), depths[at]).unwrap();
                // A hundredth of a pixel, seen on the floor.
                let slack = 0.01 / projection.focal_px()[0] as f32 * point.length_squared();
                assert!((point.z + 1.0).abs() < slack.max(1e-4), "{lens:?}: {point}");
                let [u, v] = formula(&lens, point.as_dvec3().to_array()).map(|px| px as f32);
                assert!((u - x).hypot(v - y) < 0.02, "{lens:?}: {x} {y} {u} {v}");
                (floor, far_m) = (floor + 1, far_m.max(point.length()));
            }
            assert!(floor > 2000 && far_m > 15.0, "{lens:?}: {floor} pixels up to {far_m} m");
        }
    }
}

#[test]
fn what_the_lens_does_not_show_is_black_and_has_no_tag() {
    let scene = super::scene();
    let world = world_with(&scene, &[]);
    let [_, _, circle, _] = lenses(SIZE);
    // r - 0.3 r³ rises up to 0.70, and the corners lie beyond.
    let barrel = LensSpec {
        focal_px: [420.0; 2],
        coefficients: [-0.3, 0.0, 0.0, 0.0, 0.0],
        ..lenses(SIZE)[0]
    };
    for mut tracer in tracers() {
        for (lens, radius_px) in [(circle, f64::NAN), (barrel, 0.7027 * 420.0)] {
            for quality in [quality::LOW, quality::STANDARD, quality::EPIC] {
                let spec = SensorSpec { quality, ..spec(lens) };
                let projection = Projection::of(&spec).unwrap();
                let limit = projection.radius_limits()[1];
                if radius_px.is_finite() {
                    assert!((limit * 420.0 - radius_px).abs() < 0.1, "{limit}");
                }
                let measured = MeasuredBundle::measure(&mut tracer, &scene, &world, &[spec]);
                let colors = measured.plane::<[u8; 4]>(0, output::COLOR);
                let depths = measured.plane::<f32>(0, output::DEPTH);
                let tags = measured.plane::<u8>(0, output::TAG);
                let ids = measured.plane::<u32>(0, output::INSTANCE);
                let [[fx, fy], [cx, cy]] = [projection.focal_px(), projection.center_px()];
                let mut dark = 0;
                for at in 0..depths.len() {
                    let [x, y] = [at % SIZE[0] as usize, at / SIZE[0] as usize]
                        .map(|pixel| pixel as f64 + 0.5);
                    let radius = ((x - cx) / fx).hypot((y - cy) / fy);
                    let found = (colors[at], depths[at], tags[at], ids[at]);
                    if radius > limit + 1.5 / fx {
                        assert_eq!(found, ([0, 0, 0, 255], DEPTH_FAR_M, 0, 0), "({x}, {y})");
                        dark += 1;
                    } else if radius < limit - 1.5 / fx {
                        assert!(found.0[..3] != [0; 3] && found.2 != 0, "({x}, {y}) {found:?}");
                    }
                }
                assert!(dark > 2000, "{dark}");
            }
        }
    }
}

#[test]
fn debug_shapes_are_drawn_through_the_lens() {
    let red = u32::from_le_bytes([255, 0, 0, 255]);
    let scene = super::scene();
    let mut world = world_with(&scene, &[]);
    let points = [[4.0, 1.5, 1.6], [6.0, -3.0, 2.5], [3.0, 0.2, 1.1], [5.0, 2.0, 0.4]];
    let shapes = points.map(|begin_m| Shape {
        begin_m,
        color: red,
        pixels: 5.0,
        ..Shape::new(shape::POINT)
    });
    let text = Shape { begin_m: [6.0, 0.6, 2.4], color: red, ..Shape::new(shape::TEXT) };
    for mut tracer in tracers() {
        for lens in lenses(SIZE) {
            let spec = spec(lens);
            let mut marked = |shape: &Shape| {
                world.set_overlay(Arc::new(Overlay::new([shape])));
                let measured = MeasuredBundle::measure(&mut tracer, &scene, &world, &[spec]);
                let colors = measured.plane::<[u8; 4]>(0, output::COLOR).iter().enumerate();
                let red = colors.filter(|(_, color)| u32::from_le_bytes(**color) == red);
                red.map(|(at, _)| [at % SIZE[0] as usize, at / SIZE[0] as usize])
                    .collect::<Vec<_>>()
            };
            for shape in shapes.iter().chain([&text.with_text("HI").unwrap()]) {
                let [x, y, z] = shape.begin_m.map(f64::from);
                let wanted = formula(&lens, [x, y, z - 1.0]);
                let pixels = marked(shape);
                assert!(pixels.len() >= 12, "{lens:?} {shape:?}: {}", pixels.len());
                for axis in 0..2 {
                    let all = pixels.iter().map(|pixel| pixel[axis] as f64 + 0.5);
                    let (low, high) =
                        all.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
                    let middle = (low + high) * 0.5;
                    assert!((middle - wanted[axis]).abs() <= 1.0, "{lens:?} {middle} {wanted:?}");
                }
            }
        }
    }
}

#[test]
fn both_tracers_show_the_same_through_a_lens_at_every_quality() {
    let Some(mut gpu) = crate::gpu::tests::gpu() else { return };
    let scene = super::scene();
    let actors: Vec<_> = (0..30)
        .map(|i| {
            let angle = i as f32 * 0.7;
            let at = Vec3::new(9. * angle.cos(), 9. * angle.sin(), 0.);
            actor(i + 1, Pose::level(at, angle))
        })
        .collect();
    let world = world_with(&scene, &actors);
    let size @ [width, height] = [240, 150];
    for lens in lenses(size) {
        for quality in [quality::LOW, quality::STANDARD, quality::EPIC] {
            if quality == quality::EPIC && lens.model != lens_model::FISHEYE {
                continue;
            }
            let front = SensorSpec { quality, lens, ..camera(width, height) };
            let sensors = [front, camera(43, 29)];
            let by_cpu = MeasuredBundle::measure(&mut cpu(2), &scene, &world, &sensors);
            let by_gpu = MeasuredBundle::measure(&mut gpu, &scene, &world, &sensors);
            let differ = |output: u32, size: usize| {
                let planes = [&by_cpu, &by_gpu].map(|bundle| bundle.plane::<u8>(0, output));
                let pairs = planes[0].chunks_exact(size).zip(planes[1].chunks_exact(size));
                let apart = |(a, b): &(&[u8], &[u8])| match output {
                    output::COLOR => a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2),
                    output::DEPTH => {
                        let [a, b] = [a, b].map(|depth| bytemuck::pod_read_unaligned::<f32>(depth));
                        (a - b).abs() > 1e-4 * a
                    }
                    _ => a != b,
                };
                pairs.filter(apart).count()
            };
            let all = (width * height) as usize;
            for (output, size, one_in) in [
                (output::COLOR, 4, 1000),
                (output::DEPTH, 4, 10_000),
                (output::TAG, 1, 10_000),
                (output::INSTANCE, 4, 10_000),
            ] {
                let count = differ(output, size);
                assert!(
                    count <= all.div_ceil(one_in),
                    "{lens:?} {quality} {output:#x}: {count} of {all}"
                );
            }
        }
    }
}
