//! What stands near keeps the light of the sky away, at every quality but the lowest.

use glam::{Quat, Vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{Pose, SensorSpec, output, quality};

use super::lens::tracers;
use super::{MeasuredBundle, block, camera, cpu, world_with};
use crate::Scene;

/// Returns how bright grey ground is in overcast light, without and with a wall 0.2 m away and 3 m high.
fn brightness(level: u32) -> [i32; 2] {
    [false, true].map(|walled| {
        let mut mesh = Mesh::default();
        let tint = Face::tint([150, 150, 150]);
        let face = Face { tint, ..Face::new(Tag::Ground, Material::Concrete, 0) };
        let ground = [[-50., -50., 0.], [50., -50., 0.], [50., 50., 0.], [-50., 50., 0.]];
        mesh.quad(ground, face);
        if walled {
            block(&mut mesh, [8.2, -20., 0.], [9., 20., 3.], face);
        }
        let scene = Scene::new(&mesh, &[]).unwrap();
        let mut world = world_with(&scene, &[]);
        world.weather.cloudiness = 100.0;
        // The wall casts no shadow of the sun, which is at the zenith.
        world.weather.sun_altitude_rad = std::f32::consts::FRAC_PI_2;
        // The camera looks straight down.
        let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
        let spec = SensorSpec {
            quality: level,
            outputs: output::COLOR,
            parent_from_sensor: Pose::new(Vec3::new(8.0, 0.0, 1.0), down),
            fov_rad: 0.05,
            ..camera(16, 16)
        };
        let bundle = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        let colors = bundle.plane::<[u8; 4]>(0, output::COLOR);
        colors.iter().map(|[_, g, ..]| i32::from(*g)).sum::<i32>() / colors.len() as i32
    })
}

#[test]
fn ground_before_a_wall_is_darker_than_open_ground_under_an_overcast_sky() {
    // Half of the sky is behind the wall, whose upper part is beyond the reach of the occlusion. The sun's
    // share of the light, which comes through the clouds, is the same.
    for level in [quality::STANDARD, quality::EPIC] {
        let [open, wall] = brightness(level);
        assert!(wall <= open - 8, "{wall} {open}");
    }
    let [open, wall] = brightness(quality::LOW);
    assert_eq!(wall, open);
}

/// Returns how bright asphalt is 12 m ahead under an overcast sky, in the open and below the body of a vehicle, on
/// each tracer.
fn below_a_body() -> Vec<[i32; 2]> {
    let measured = |mut tracer: crate::Tracer| {
        [false, true].map(|covered| {
            let mut mesh = Mesh::default();
            let road = Face::new(Tag::Roads, Material::Asphalt, 0);
            mesh.quad([[-50., -50., 0.], [50., -50., 0.], [50., 50., 0.], [-50., 50., 0.]], road);
            if covered {
                let body = Face::new(Tag::Car, Material::Plastic, 1);
                block(&mut mesh, [11.4, -2., 0.3], [16., 2., 1.5], body);
            }
            let scene = Scene::new(&mesh, &[]).unwrap();
            let mut world = world_with(&scene, &[]);
            world.weather.cloudiness = 100.0;
            let spec = SensorSpec {
                quality: quality::EPIC,
                outputs: output::COLOR,
                parent_from_sensor: Pose::new(
                    Vec3::new(0.0, 0.0, 1.2),
                    Quat::from_rotation_y((1.2f32 / 12.0).atan()),
                ),
                fov_rad: 0.01,
                ..camera(16, 16)
            };
            let bundle = MeasuredBundle::measure(&mut tracer, &scene, &world, &[spec]);
            let colors = bundle.plane::<[u8; 4]>(0, output::COLOR);
            colors.iter().map(|[_, g, ..]| i32::from(*g)).sum::<i32>() / colors.len() as i32
        })
    };
    tracers().map(measured).collect()
}

#[test]
fn the_road_below_a_vehicle_is_dark_although_its_asphalt_shines_at_this_angle() {
    for [open, below] in below_a_body() {
        assert!(below * 2 < open, "{below} {open}");
    }
}
