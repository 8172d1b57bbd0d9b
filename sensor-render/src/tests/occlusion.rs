//! What stands near keeps the light of the sky away, at every quality but the lowest.

use glam::{Quat, Vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{Pose, SensorSpec, output, quality};

use super::{MeasuredBundle, block, camera, cpu, world_with};
use crate::Scene;

/// Returns how bright grey ground is in overcast light: 0.2 m before a wall 3 m high, and 8 m before it.
fn brightness(level: u32) -> [i32; 2] {
    let mut mesh = Mesh::default();
    let face =
        Face { tint: Face::tint([150, 150, 150]), ..Face::new(Tag::Ground, Material::Concrete, 0) };
    mesh.quad([[-50., -50., 0.], [50., -50., 0.], [50., 50., 0.], [-50., 50., 0.]], face);
    block(&mut mesh, [8.2, -20., 0.], [9., 20., 3.], face);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    world.weather.cloudiness = 100.0;
    // Two cameras look straight down.
    let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let specs = [8.0, 0.2].map(|x| SensorSpec {
        quality: level,
        outputs: output::COLOR,
        parent_from_sensor: Pose::new(Vec3::new(x, 0.0, 1.0), down),
        fov_rad: 0.05,
        ..camera(16, 16)
    });
    let bundle = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &specs);
    [0, 1].map(|sensor| {
        let colors = bundle.plane::<[u8; 4]>(sensor, output::COLOR);
        colors.iter().map(|[_, g, ..]| i32::from(*g)).sum::<i32>() / colors.len() as i32
    })
}

#[test]
fn ground_before_a_wall_is_darker_than_open_ground_under_an_overcast_sky() {
    for level in [quality::STANDARD, quality::EPIC] {
        let [wall, open] = brightness(level);
        assert!(wall < open - 15, "{wall} {open}");
    }
    let [wall, open] = brightness(quality::LOW);
    assert!((wall - open).abs() <= 2, "{wall} {open}");
}
