//! Colour images with several rays per pixel.

use glam::Vec3;
use mesh::{Face, Material, Mesh, Tag};
use protocol::{Pose, SensorSpec, output, quality};

use super::{MeasuredBundle, block, camera, cpu, world_with};
use crate::{Quality, Scene, World};

const LEVELS: [u32; 3] = [quality::LOW, quality::STANDARD, quality::EPIC];

/// Returns a black wall at x = 10 whose left edge crosses the image at a slope.
fn scene() -> Scene {
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Wall, Material::Rubber, 3);
    mesh.quad([[10., 1., -6.], [10., -15., -6.], [10., -15., 6.], [10., -1., 6.]], face);
    Scene::new(&mesh, &[]).unwrap()
}

fn measured(scene: &Scene, world: &World, spec: SensorSpec) -> MeasuredBundle {
    MeasuredBundle::measure(&mut cpu(1), scene, world, &[spec])
}

/// Returns the green of a colour image, which is darker on the wall.
fn green(bundle: &MeasuredBundle) -> Vec<f32> {
    bundle.plane::<[u8; 4]>(0, output::COLOR).iter().map(|[_, g, ..]| f32::from(*g)).collect()
}

#[test]
fn rays_of_a_pixel_smooth_edges_by_their_share_of_the_pixel() {
    let scene = scene();
    let world = world_with(&scene, &[]);
    let images = LEVELS.map(|quality| {
        let spec = SensorSpec { quality, outputs: output::COLOR, ..camera(81, 61) };
        green(&measured(&scene, &world, spec))
    });
    // Colours between those of wall and sky, in the rows that the edge crosses.
    let between = images.each_ref().map(|image| {
        let row = &image[30 * 81..31 * 81];
        let (sky, wall) = (row[0], row[80]);
        let apart = (sky - wall).abs() * 0.15;
        row.iter().filter(|g| (*g - sky).abs() > apart && (*g - wall).abs() > apart).count()
    });
    assert_eq!(between[0], 0, "low has one ray per pixel");
    // The edge has a slope of 2 / 12, so a row of pixels meets it in one or two of them.
    assert!((1..=2).contains(&between[1]), "{between:?}");
    // The position of the edge, from the brightness of the pixels around it, is more exact with more
    // rays.
    let error = images.each_ref().map(|image| {
        let mut error = 0.0f32;
        for row in 12..48 {
            // The edge lies at y = -z / 6, the camera at z = 1; 40.5 pixels are a slope of 1.
            let z = 1.0 - (row as f32 - 30.0) / 40.5 * 10.0;
            let edge = 40.5 + z / 6.0 / 10.0 * 40.5;
            let first = edge as usize - 4;
            let line: Vec<f32> =
                image[row * 81 + first..][..9].iter().map(|g| (g / 255.0).powf(2.2)).collect();
            let of_sky = line.iter().map(|g| (g - line[8]) / (line[0] - line[8])).sum::<f32>();
            error = error.max((first as f32 + of_sky - edge).abs());
        }
        error
    });
    assert!(error[0] < 0.51 && error[1] < 0.27 && error[2] < 0.11, "{error:?}");
}

#[test]
fn other_outputs_are_those_of_the_pixel_centre_at_every_quality() {
    let mut mesh = super::town();
    block(&mut mesh, [6., -1., 0.], [7., 1., 2.], Face::new(Tag::Car, Material::CarPaint, 9));
    let scene = Scene::new(&mesh, &[]).unwrap();
    let world = world_with(&scene, &[]);
    let every = output::COLOR | output::DEPTH | output::TAG | output::INSTANCE;
    let every = every | output::NORMAL | output::FLOW;
    let [low, standard, epic] = LEVELS.map(|quality| {
        let spec = SensorSpec { quality, outputs: every, ..camera(83, 59) };
        measured(&scene, &world, spec)
    });
    for bundle in [&standard, &epic] {
        for plane in low.planes.iter().filter(|plane| plane.output != output::COLOR) {
            assert!(
                low.plane::<u8>(0, plane.output) == bundle.plane::<u8>(0, plane.output),
                "output {:#x}",
                plane.output
            );
        }
        assert!(green(&low) != green(bundle));
        // The colours do not depend on which other outputs are measured.
        let spec = SensorSpec {
            quality: if std::ptr::eq(bundle, &epic) { quality::EPIC } else { quality::STANDARD },
            outputs: output::COLOR,
            ..camera(83, 59)
        };
        assert!(green(&measured(&scene, &world, spec)) == green(bundle));
    }
}

#[test]
fn a_camera_without_a_quality_has_that_of_the_renderer() {
    let scene = scene();
    let mut world = world_with(&scene, &[]);
    let own = green(&measured(&scene, &world, camera(81, 61)));
    let standard = SensorSpec { quality: quality::STANDARD, ..camera(81, 61) };
    let standard = green(&measured(&scene, &world, standard));
    assert!(own != standard);
    world.set_quality(Quality::Standard);
    assert!(green(&measured(&scene, &world, camera(81, 61))) == standard);
    let low = SensorSpec { quality: quality::LOW, ..camera(81, 61) };
    assert!(green(&measured(&scene, &world, low)) == own);
}

#[test]
fn the_shadow_of_a_high_roof_has_a_penumbra_as_wide_as_the_sun() {
    let mut mesh = Mesh::default();
    let floor = Face::new(Tag::Roads, Material::Asphalt, 0);
    mesh.quad([[-200., -200., 0.], [200., -200., 0.], [200., 200., 0.], [-200., 200., 0.]], floor);
    // A roof 60 m above the ground; the sun stands at the zenith.
    block(
        &mut mesh,
        [-50., 0., 60.],
        [50., 50., 61.],
        Face::new(Tag::Building, Material::Metal, 4),
    );
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    world.weather.sun_altitude_rad = std::f32::consts::FRAC_PI_2;
    // The camera looks at the edge of the shadow from 2 m above it.
    let down =
        Pose::new(Vec3::new(0., 0., 2.), glam::Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    let widths = LEVELS.map(|quality| {
        let spec = SensorSpec {
            quality,
            outputs: output::COLOR,
            parent_from_sensor: down,
            fov_rad: 0.5,
            ..camera(101, 11)
        };
        let image = green(&measured(&scene, &world, spec));
        let row = &image[5 * 101..][..101];
        let (dark, bright) = (row[0].min(row[100]), row[0].max(row[100]));
        assert!(bright > dark + 40.0, "{dark} {bright}");
        let pixel_m = 2.0 * 2.0 * 0.25f32.tan() / 101.0;
        let half = |g: &&f32| **g > dark + 12.0 && **g < bright - 12.0;
        row.iter().filter(half).count() as f32 * pixel_m
    });
    // The sun is 0.532 degrees wide: 0.56 m at 60 m.
    assert_eq!(widths[0], 0.0);
    assert!((0.15..0.56).contains(&widths[1]) && (0.25..0.56).contains(&widths[2]), "{widths:?}");
}

#[test]
fn a_quality_is_read_from_its_name() {
    for level in Quality::ALL {
        assert_eq!(level.to_string().parse(), Ok(level));
    }
    assert_eq!("Epic".parse(), Ok(Quality::Epic));
    let refusal = "high".parse::<Quality>().unwrap_err().to_string();
    assert_eq!(refusal, "quality is \"high\"; use low, standard or epic");
}
