//! Smooth surfaces mirror what is around them, at every quality but the lowest.

use mesh::{Face, Material, Mesh, Tag};
use protocol::{SensorSpec, output, quality};

use super::{MeasuredBundle, block, camera, cpu, world_with};
use crate::Scene;

/// Returns water with a tall red wall behind it.
fn scene() -> Scene {
    let mut mesh = Mesh::default();
    let water = Face::new(Tag::Water, Material::Water, 0);
    mesh.quad([[-50., -50., 0.], [50., -50., 0.], [50., 50., 0.], [-50., 50., 0.]], water);
    let wall =
        Face { tint: Face::tint([220, 20, 20]), ..Face::new(Tag::Wall, Material::Concrete, 3) };
    block(&mut mesh, [20., 0., 0.], [21., 30., 12.], wall);
    Scene::new(&mesh, &[]).unwrap()
}

/// Returns how much redder than green the water is, left, before the wall, and right of it.
fn redness(level: u32) -> [i32; 2] {
    let scene = scene();
    let mut world = world_with(&scene, &[]);
    world.weather.sun_azimuth_rad = std::f32::consts::PI;
    let spec = SensorSpec { quality: level, outputs: output::COLOR, ..camera(80, 60) };
    let bundle = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
    let colors = bundle.plane::<[u8; 4]>(0, output::COLOR);
    // Ten rows below the horizon, the camera 1 m above the water: 4 m ahead of it.
    [20, 60].map(|column| {
        let [r, g, ..] = colors[40 * 80 + column];
        i32::from(r) - i32::from(g)
    })
}

#[test]
fn water_mirrors_clouds() {
    let scene = scene();
    let mut shown = [0.0, 39.0].map(|cloudiness| {
        let mut world = world_with(&scene, &[]);
        // Up to 40 % clouds leave the light of sky and ground as it is.
        world.weather.cloudiness = cloudiness;
        let spec =
            SensorSpec { quality: quality::STANDARD, outputs: output::COLOR, ..camera(80, 60) };
        MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec])
            .plane::<[u8; 4]>(0, output::COLOR)
            .to_vec()
    });
    let [clear, cloudy] = shown.each_mut().map(|image| image.split_off(35 * 80));
    let differ = clear.iter().zip(&cloudy).filter(|(a, b)| a[0].abs_diff(b[0]) > 3).count();
    assert!(differ > 40, "{differ} of {} pixels of the water", clear.len());
}

#[test]
fn water_mirrors_the_wall_behind_it() {
    for level in [quality::STANDARD, quality::EPIC] {
        let [wall, sky] = redness(level);
        assert!(wall > sky + 25, "{wall} {sky}");
    }
    let [wall, sky] = redness(quality::LOW);
    assert!((wall - sky).abs() <= 2, "{wall} {sky}");
}
