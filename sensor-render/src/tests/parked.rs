//! Parked vehicles and actors in one hierarchy.

use glam::{Quat, Vec3};
use mesh::Tag;
use protocol::{ActorState, Pose, output};

use super::{MeasuredBundle, actor, camera, cpu, town, world_with};
use crate::Scene;
use crate::reference::{Ray, closest};

/// Returns a scene in which model 3 cars are parked at these places, objects 0, 1 and so on.
fn scene(places: &[Vec3]) -> Scene {
    let (number, car) = town::blueprint("vehicle.tesla.model3").expect("an id of the catalogue");
    let object = |position: &Vec3| town::Object {
        tag: Tag::Car,
        layer: town::Layer::ParkedVehicles,
        center: *position + car.center_m,
        half_extents_m: car.half_extents_m,
        yaw_rad: 0.,
        color: [200, 10, 10],
    };
    let parked = |(object, position): (u32, &Vec3)| town::Parked {
        blueprint: number,
        object,
        position: *position,
        rotation: Quat::IDENTITY.to_array(),
    };
    let town = town::Town {
        mesh: town(),
        objects: places.iter().map(object).collect(),
        parked: (0..).zip(places).map(parked).collect(),
        ..Default::default()
    };
    Scene::of_town(&town).unwrap()
}

fn driving(id: u32, at: Vec3) -> ActorState {
    let (blueprint, _) = town::blueprint("vehicle.tesla.model3").expect("an id of the catalogue");
    ActorState { blueprint, ..actor(id, Pose::level(at, 0.)) }
}

#[test]
fn parked_vehicles_and_actors_are_hit_whatever_their_numbers() {
    let rows = [
        vec![],
        vec![Vec3::new(10., 3., 0.)],
        vec![Vec3::new(10., 3., 0.), Vec3::new(15., 3., 0.)],
    ];
    let scenes = rows.each_ref().map(|row| scene(row));
    let mut gpu = crate::gpu::tests::gpu();
    // One world is placed in every scene in turn, with none, one and two actors.
    let mut world = world_with(&scenes[2], &[]);
    for (parked, scene) in scenes.iter().enumerate() {
        for count in [2, 0, 1] {
            let actors: Vec<ActorState> = (0..count)
                .map(|n| driving(40 + n, Vec3::new(10. + 5. * n as f32, -3., 0.)))
                .collect();
            let (stamp, weather) = (world.stamp(), Default::default());
            world.place(scene, stamp, 50_000_000, &weather, &actors, |_| [9; 3]);
            let measured = MeasuredBundle::measure(&mut cpu(1), scene, &world, &[camera(161, 61)]);
            let ids = measured.plane::<u32>(0, output::INSTANCE);
            if let Some(gpu) = &mut gpu {
                let by_gpu = MeasuredBundle::measure(gpu, scene, &world, &[camera(161, 61)]);
                assert_eq!(by_gpu.plane::<u32>(0, output::INSTANCE), ids);
            }
            let has = |id: u32| ids.contains(&id);
            assert_eq!((has(0x8000_0001), has(0x8000_0002)), (parked > 0, parked > 1));
            assert_eq!((has(40), has(41)), (count > 0, count > 1));
            // Single rays traverse the binary hierarchy.
            for (y, expected) in [(3., parked > 0), (-3., count > 0)] {
                let ray = Ray { origin: Vec3::new(0., y, 0.8), direction: Vec3::X };
                let hit = closest(scene, &world, ray, 30.);
                assert_eq!(hit.instance != crate::hit::NONE, expected, "{parked} {count} {y}");
            }
        }
    }
}

#[test]
fn the_lamps_of_parked_vehicles_are_off_at_night() {
    let at = Vec3::new(8., 0., 0.);
    let brightest = |scene: &Scene, actors: &[ActorState]| {
        let mut world = world_with(scene, actors);
        world.weather.sun_altitude_rad = -0.6;
        let measured = MeasuredBundle::measure(&mut cpu(1), scene, &world, &[camera(161, 61)]);
        let colors = measured.plane::<[u8; 4]>(0, output::COLOR);
        let ids = measured.plane::<u32>(0, output::INSTANCE);
        let of_car = colors.iter().zip(ids).filter(|(_, id)| [4, 0x8000_0001].contains(*id));
        of_car.map(|([r, ..], _)| *r).max().unwrap()
    };
    let driven = brightest(&scene(&[]), &[driving(4, at)]);
    let parked = brightest(&scene(&[at]), &[]);
    // The satin housing of a lamp that is off mirrors the night sky.
    assert!(driven > 200 && parked < 150, "{driven} {parked}");
}
