//! Drops and spray are seen where they are, on both tracers.

use glam::Vec3;
use mesh::{Face, Material, Mesh, Tag};
use protocol::{ActorState, Pose, SensorSpec, Weather, output, quality};

use super::lens::tracers;
use super::{MeasuredBundle, block, camera};
use crate::{Scene, Tracer, World};

/// Returns a floor and a dark wall in front of the camera, and a roof high above it.
fn scene(wall_m: f32, has_roof: bool) -> Scene {
    let mut mesh = Mesh::default();
    let floor = Face::new(Tag::Roads, Material::Asphalt, 0);
    mesh.quad([[-90., -90., 0.], [90., -90., 0.], [90., 90., 0.], [-90., 90., 0.]], floor);
    let wall = Face { tint: Face::tint([30, 30, 30]), ..Face::new(Tag::Wall, Material::Metal, 3) };
    block(&mut mesh, [wall_m, -80., 0.], [wall_m + 1., 80., 60.], wall);
    if has_roof {
        block(&mut mesh, [-5., -5., 40.], [0.5, 5., 41.], wall);
    }
    Scene::new(&mesh, &[]).unwrap()
}

/// Returns a world without shadows, which the roof would cast.
fn world(scene: &Scene, weather: &Weather, actors: &[ActorState]) -> World {
    let mut world = super::world_with(scene, &[]);
    world.set_shadows(false);
    let stamp = world.stamp();
    world.place(scene, stamp, 50_000_000, weather, actors, |_| [200, 30, 30]);
    world
}

fn image(tracer: &mut Tracer, scene: &Scene, world: &World, level: u32) -> Vec<[u8; 4]> {
    let spec = SensorSpec { quality: level, outputs: output::COLOR, ..camera(160, 120) };
    MeasuredBundle::measure(tracer, scene, world, &[spec]).plane(0, output::COLOR).to_vec()
}

/// Returns how many pixels of two images differ by more than rounding.
fn differences(a: &[[u8; 4]], b: &[[u8; 4]]) -> usize {
    let differs = |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2);
    a.iter().zip(b).filter(|pair| differs(*pair)).count()
}

fn downpour() -> Weather {
    Weather { precipitation: 80.0, wetness: 80.0, ..Weather::default() }
}

#[test]
fn drops_fall_between_the_camera_and_the_wall_but_not_below_a_roof() {
    for mut tracer in tracers() {
        for level in [quality::LOW, quality::STANDARD] {
            let mut shown = |wall_m: f32, has_roof: bool| {
                let scene = scene(wall_m, has_roof);
                image(&mut tracer, &scene, &world(&scene, &downpour(), &[]), level)
            };
            let streaks = differences(&shown(30.0, false), &shown(30.0, true));
            assert!((400..15_000).contains(&streaks), "{streaks} of 19200");
            assert_eq!(differences(&shown(0.7, false), &shown(0.7, true)), 0);
        }
    }
}

#[test]
fn fast_vehicles_throw_spray_on_wet_roads_alone() {
    let scene = scene(60.0, true);
    let (number, _) = town::blueprint("vehicle.tesla.model3").expect("an id of the catalogue");
    let car = |speed_mps: f32| ActorState {
        blueprint: number,
        velocity_mps: [speed_mps, 0.0, 0.0],
        ..super::actor(7, Pose::level(Vec3::new(14., 0., 0.), 0.))
    };
    let wet = Weather { wetness: 90.0, ..Weather::default() };
    for mut tracer in tracers() {
        let mut shown = |weather: &Weather, speed_mps: f32| {
            // The scene has no mesh of the blueprint: only the spray is seen.
            let world = world(&scene, weather, &[car(speed_mps)]);
            image(&mut tracer, &scene, &world, quality::STANDARD)
        };
        let still = shown(&wet, 0.0);
        assert_eq!(differences(&still, &shown(&wet, 5.0)), 0);
        let fast = shown(&wet, 25.0);
        let hidden = differences(&still, &fast);
        assert!((300..9000).contains(&hidden), "{hidden} of 19200");
        // Spray is brighter than the dark wall, most of all behind the car.
        let at = |image: &[[u8; 4]]| i32::from(image[62 * 160 + 80][1]);
        assert!(at(&fast) > at(&still) + 15, "{} {}", at(&fast), at(&still));
        let dry = Weather { wetness: 0.0, ..wet };
        assert_eq!(differences(&shown(&dry, 0.0), &shown(&dry, 25.0)), 0);
    }
}

#[test]
fn both_tracers_show_the_same_rain() {
    let scene = scene(30.0, false);
    let (number, _) = town::blueprint("vehicle.tesla.model3").expect("an id of the catalogue");
    let cars = [1, 2, 3].map(|id| ActorState {
        blueprint: number,
        velocity_mps: [20.0, 3.0 * id as f32, 0.0],
        ..super::actor(id, Pose::level(Vec3::new(4. + 6. * id as f32, 3. * id as f32 - 6., 0.), 0.))
    });
    let world = world(&scene, &downpour(), &cars);
    let images = tracers().map(|mut tracer| image(&mut tracer, &scene, &world, quality::STANDARD));
    let images: Vec<_> = images.collect();
    for other in &images[1..] {
        assert!(differences(&images[0], other) <= 19, "{}", differences(&images[0], other));
    }
}
