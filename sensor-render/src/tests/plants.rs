//! Plants are where their meshes would be.

use glam::Vec3;
use mesh::Tag;
use protocol::{Pose, SensorSpec, output};

use super::{MeasuredBundle, camera, cpu, town, world_with};
use crate::Scene;

/// Returns a town with plants of several models and sizes before the camera.
fn planted() -> town::Town {
    let plant = |(number, (scale, x, y)): (u32, (f32, f32, f32))| town::Plant {
        model: number * 13 % town::plant_count(),
        object: number,
        position: Vec3::new(x, y, 0.),
        yaw_rad: number as f32,
        scale,
    };
    let places = [(0.5, 9., 2.), (1.3, 14., -4.), (1., 17., 5.), (0.7, 30., 12.), (1.2, 12., -9.)];
    let plants: Vec<town::Plant> = (0..).zip(places).map(plant).collect();
    let object = |plant: &town::Plant| town::Object {
        tag: Tag::Vegetation,
        layer: town::Layer::Foliage,
        center: plant.position,
        half_extents_m: Vec3::ONE,
        yaw_rad: plant.yaw_rad,
        color: [70, 110, 50],
    };
    let objects = plants.iter().map(object).collect();
    town::Town { mesh: town(), objects, plants, ..Default::default() }
}

fn measured(town: &town::Town, width: u32) -> MeasuredBundle {
    let scene = Scene::of_town(town).unwrap();
    let sensor = SensorSpec {
        parent_from_sensor: Pose::level(Vec3::new(0., 0., 2.5), 0.),
        ..camera(width, width * 3 / 4)
    };
    MeasuredBundle::measure(&mut cpu(2), &scene, &world_with(&scene, &[]), &[sensor])
}

#[test]
fn plants_of_any_size_are_measured_where_their_meshes_are() {
    let town = planted();
    let baked = town::Town { mesh: town.assembled_mesh(), plants: Vec::new(), ..town.clone() };
    // Packets of rays, and groups of rays that are far apart.
    for width in [320, 24] {
        let [planted, baked] = [measured(&town, width), measured(&baked, width)];
        let tags = planted.plane::<u8>(0, output::TAG);
        let count = tags.iter().filter(|tag| **tag == Tag::Vegetation as u8).count();
        assert!(count * 20 > tags.len(), "{count} of {} pixels show plants", tags.len());
        let others = tags.iter().zip(baked.plane::<u8>(0, output::TAG)).filter(|(a, b)| a != b);
        assert!(others.count() * 1000 <= tags.len(), "{width} pixels: other tags");
        let instances = planted.plane::<u32>(0, output::INSTANCE).iter();
        let differ = instances.zip(baked.plane::<u32>(0, output::INSTANCE)).filter(|(a, b)| a != b);
        assert!(differ.count() * 1000 <= tags.len(), "{width} pixels: other objects");
        let depths = planted.plane::<f32>(0, output::DEPTH).iter();
        let apart = depths
            .zip(baked.plane::<f32>(0, output::DEPTH))
            .filter(|(a, b)| (*a - *b).abs() > 1e-3 * b.abs().max(1.0));
        assert!(apart.count() * 1000 <= tags.len(), "{width} pixels: other depths");
    }
}
