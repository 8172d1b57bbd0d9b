//! Pieces of actors are placed by the actor's state and carry the actor's id.

use glam::{Quat, Vec3};
use mesh::Mesh;
use protocol::{ActorId, ActorState, Frame, Pose, STRIDE, Stamp, Weather, kind, lamp, output};

use super::{MeasuredBundle, camera, cpu};
use crate::{Scene, World};

fn actor(id: &str, pose: Pose) -> ActorState {
    let (blueprint, found) = town::blueprint(id).unwrap();
    let kind = match found.kind {
        town::Kind::Walker => kind::WALKER,
        _ => kind::VEHICLE,
    };
    ActorState { actor_id: ActorId(7), blueprint, kind, pose, ..ActorState::default() }
}

/// Measures from 1 m above the ground at the origin, along x.
fn look(scene: &Scene, actor: ActorState, sim_time_nanos: u64) -> MeasuredBundle {
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(1), sim_time_nanos, episode: 1, reserved: 0 };
    world.place(scene, stamp, 50_000_000, &Weather::default(), &[actor], |_| [40, 40, 160]);
    MeasuredBundle::measure(&mut cpu(1), scene, &world, &[camera(320, 240)])
}

fn columns_of(picture: &MeasuredBundle, wanted: impl Fn([u8; 4]) -> bool) -> Vec<usize> {
    let pixels = picture.plane::<[u8; 4]>(0, output::COLOR);
    (0..pixels.len()).filter(|at| wanted(pixels[*at])).map(|at| at % 320).collect()
}

/// Returns a car with its rear towards the camera.
fn tail() -> ActorState {
    actor("vehicle.tesla.model3", Pose::level(Vec3::new(6.0, 0.0, 0.0), 0.0))
}

const MODEL3_RED: fn([u8; 4]) -> bool = |[r, g, b, _]| r > 200 && g < 120 && b < 120;
const AMBER: fn([u8; 4]) -> bool = |[r, g, b, _]| r > 220 && (110..235).contains(&g) && b < 140;

#[test]
fn lamps_shine_if_their_bits_are_set() {
    let scene = Scene::with_catalogue(&Mesh::default(), &[], Vec::new(), &[]).unwrap();
    let with = |lamps: u32| look(&scene, ActorState { lamps, ..tail() }, 0);
    let dark = with(0);
    assert!(columns_of(&dark, MODEL3_RED).is_empty() && columns_of(&dark, AMBER).is_empty());
    let shining = columns_of(&with(lamp::BRAKE), MODEL3_RED).len();
    assert!(shining > 40, "{shining} pixels");
    let pedal = look(&scene, ActorState { brake: 0.4, ..tail() }, 0);
    assert_eq!(pedal.bytes(), with(lamp::BRAKE).bytes(), "the pedal is as good as the bit");
    // From behind, the left indicator is on the left of the image.
    let left = columns_of(&with(lamp::LEFT_BLINKER), AMBER);
    let right = columns_of(&with(lamp::RIGHT_BLINKER), AMBER);
    assert!(left.len() > 5 && left.iter().all(|x| *x < 160), "{left:?}");
    assert!(right.len() > 5 && right.iter().all(|x| *x > 160), "{right:?}");
    let white =
        |picture: &MeasuredBundle| columns_of(picture, |[r, g, b, _]| r.min(g).min(b) > 235).len();
    assert!(white(&with(lamp::REVERSE)) > white(&dark) + 5);
}

#[test]
fn indicators_blink_with_simulated_time() {
    let scene = Scene::with_catalogue(&Mesh::default(), &[], Vec::new(), &[]).unwrap();
    let lit = |millis: u64| {
        let actor = ActorState { lamps: lamp::LEFT_BLINKER, ..tail() };
        !columns_of(&look(&scene, actor, millis * 1_000_000), AMBER).is_empty()
    };
    assert_eq!([0, 200, 400, 600, 700].map(lit), [true, true, false, false, true]);
}

#[test]
fn only_the_wheels_of_a_rolling_car_change_in_the_image() {
    let scene = Scene::with_catalogue(&Mesh::default(), &[], Vec::new(), &[]).unwrap();
    let side = Pose::level(Vec3::new(5.0, 0.0, 0.0), std::f32::consts::FRAC_PI_2);
    let still = actor("vehicle.tesla.model3", side);
    let rest = look(&scene, still, 0);
    let rolled = look(&scene, ActorState { wheel_spin_rad: 0.6, ..still }, 0);
    let ids = rest.plane::<u32>(0, output::INSTANCE);
    assert!(ids.iter().all(|id| *id == 0 || *id == 7), "every part has the actor's id");
    let color = |picture: &MeasuredBundle| picture.plane::<[u8; 4]>(0, output::COLOR).to_vec();
    let changed: Vec<usize> = color(&rest)
        .iter()
        .zip(color(&rolled))
        .enumerate()
        .filter(|(_, (a, b))| **a != *b)
        .map(|(at, _)| at)
        .collect();
    assert!(changed.len() > 100, "{} pixels changed", changed.len());
    // The camera is level, 1 m above ground: wheels, 0.7 m high, are below the centre.
    assert!(changed.iter().all(|at| at / 320 > 120));
}

#[test]
fn an_open_door_widens_the_silhouette_of_the_car() {
    let scene = Scene::with_catalogue(&Mesh::default(), &[], Vec::new(), &[]).unwrap();
    let widest = |doors: u32| {
        let picture = look(&scene, ActorState { doors, ..tail() }, 0);
        let ids = picture.plane::<u32>(0, output::INSTANCE);
        let columns = (0..ids.len()).filter(|at| ids[*at] == 7).map(|at| at % 320);
        columns.fold((320, 0), |(low, high), x| (low.min(x), high.max(x)))
    };
    let (shut, left, right) = (widest(0), widest(1), widest(2));
    // The tip of the door, 1.9 m from the middle and 6.75 m ahead, is 45 pixels from the middle; the tail 36.
    assert!(left.0 + 6 < shut.0 && left.1 == shut.1, "{shut:?} {left:?}");
    assert!(right.1 > shut.1 + 6 && right.0 == shut.0, "{shut:?} {right:?}");
}

#[test]
fn a_walking_pedestrian_strides_and_a_standing_one_does_not() {
    let scene = Scene::with_catalogue(&Mesh::default(), &[], Vec::new(), &[]).unwrap();
    let pose = Pose::new(Vec3::new(4.0, 0.0, 0.0), Quat::from_rotation_z(1.5));
    let still = actor("walker.pedestrian.0002", pose);
    let at = |phase: u32, speed: f32| {
        look(&scene, ActorState { phase, velocity_mps: [0.0, speed, 0.0], ..still }, 0)
    };
    assert_eq!(at(0, 0.0).bytes(), at(STRIDE / 4, 0.0).bytes());
    let width = |picture: &MeasuredBundle| {
        let ids = picture.plane::<u32>(0, output::INSTANCE);
        let columns: Vec<usize> =
            (0..ids.len()).filter(|i| ids[*i] == 7).map(|i| i % 320).collect();
        columns.iter().max().unwrap() - columns.iter().min().unwrap()
    };
    assert!(width(&at(STRIDE / 4, 1.4)) > width(&at(0, 0.0)) + 10);
}
