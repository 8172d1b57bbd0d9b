//! Lamps illuminate what is around them.

use glam::{Quat, Vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{
    ActorState, Pose, SensorSpec, StreetLightState, StreetLights, Weather, lamp, output,
};

use super::{MeasuredBundle, actor, block, camera, cpu, effects::exposed, world_with};
use crate::{BlueprintMesh, Scene, World};

/// Returns a level road, 200 m by 200 m.
fn road() -> Mesh {
    let mut mesh = Mesh::default();
    let floor = Face::new(Tag::Roads, Material::Paving, 0);
    mesh.quad([[-100., -100., 0.], [100., -100., 0.], [100., 100., 0.], [-100., 100., 0.]], floor);
    mesh
}

/// Adds a street light of object 9 at (x, y), 8 m high.
fn street_light(mesh: &mut Mesh, [x, y]: [f32; 2]) {
    let lens = Face::new(Tag::Pole, Material::LampWhite, 9);
    block(mesh, [x - 0.2, y - 0.2, 8.0], [x + 0.2, y + 0.2, 8.1], lens);
}

fn at_night(world: &mut World) {
    world.weather = Weather { sun_altitude_rad: -0.6, ..Weather::default() };
}

/// Returns the linear brightness of points on the ground, measured from 3 m above each.
fn brightness(scene: &Scene, world: &World, points: &[[f32; 2]]) -> Vec<f32> {
    mean_green(scene, world, points, |g| (f32::from(g) / 255.0).powf(2.2))
}

/// Returns the mean of a function of the green values of points on the ground, measured from 3 m above each.
fn mean_green(
    scene: &Scene,
    world: &World,
    points: &[[f32; 2]],
    of: impl Fn(u8) -> f32,
) -> Vec<f32> {
    let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let spec = |point: &[f32; 2]| SensorSpec {
        outputs: output::COLOR,
        parent_from_sensor: Pose::new(Vec3::new(point[0], point[1], 3.0), down),
        fov_rad: 0.1,
        ..camera(8, 8)
    };
    let specs: Vec<SensorSpec> = points.iter().map(spec).collect();
    let bundle = MeasuredBundle::measure(&mut cpu(1), scene, world, &specs);
    let mean = |sensor: u32| {
        let pixels = bundle.plane::<[u8; 4]>(sensor, output::COLOR);
        pixels.iter().map(|[_, g, ..]| of(*g)).sum::<f32>() / pixels.len() as f32
    };
    (0..points.len() as u32).map(mean).collect()
}

#[test]
fn a_street_light_illuminates_the_road_below_it_at_night_only() {
    let mut mesh = road();
    street_light(&mut mesh, [0.0, 0.0]);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    let points = [[1.0, 0.0], [8.0, 0.0], [20.0, 0.0], [60.0, 0.0]];
    let by_day = brightness(&scene, &world, &points);
    assert!((by_day[0] - by_day[3]).abs() < 0.05 * by_day[3], "{by_day:?}");
    at_night(&mut world);
    let by_night = brightness(&scene, &world, &points);
    assert!(by_night[0] > 5.0 * by_night[3], "{by_night:?}");
    assert!(by_night.is_sorted_by(|a, b| a > b), "{by_night:?}");
    let mut lights = StreetLights::default();
    let mut bits = [0; 16];
    bits[0] = 1 << 9;
    lights.set(0, &bits, StreetLightState { mode: 0, ..StreetLightState::OWN });
    world.set_street_lights(&lights);
    let off = brightness(&scene, &world, &points);
    assert!((off[0] - off[3]).abs() <= 0.1 * off[3], "{off:?}");
}

#[test]
fn a_street_light_is_dark_from_a_little_below_its_height() {
    let mut mesh = road();
    street_light(&mut mesh, [0.0, 0.0]);
    block(&mut mesh, [20., -4., 0.], [21., 4., 9.], Face::new(Tag::Wall, Material::Concrete, 5));
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    at_night(&mut world);
    let shown = |height: f32| {
        let parent_from_sensor = Pose::level(Vec3::new(10., 0., height), 0.0);
        let spec = SensorSpec {
            outputs: output::COLOR,
            parent_from_sensor,
            fov_rad: 0.05,
            ..camera(8, 8)
        };
        let bundle = MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec]);
        i32::from(bundle.plane::<[u8; 4]>(0, output::COLOR)[36][1])
    };
    // 83, 79 and 72 degrees from straight down.
    let [above, edge, lit] = [5.5, 4.2, 1.5].map(shown);
    let [dark] = [8.9].map(shown);
    assert!(
        (above - dark).abs() < 4 && edge < lit && lit > dark + 20,
        "{above} {edge} {lit} {dark}"
    );
}

#[test]
fn a_wall_casts_a_shadow_in_the_light_of_a_street_light() {
    let mut mesh = road();
    street_light(&mut mesh, [0.0, 0.0]);
    // A wall 2.5 m high hides the lamp from 10 to 14.5 m, but not from 16 m on.
    block(&mut mesh, [9.7, -4., 0.], [10.0, 4., 2.5], Face::new(Tag::Wall, Material::Concrete, 5));
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    at_night(&mut world);
    let points = [[8., 0.], [12., 0.], [12., 8.], [16., 0.], [70., 0.]];
    let [front, shaded, beside, behind, dark] = brightness(&scene, &world, &points)[..] else {
        unreachable!()
    };
    let all = [front, beside, behind];
    assert!((shaded - dark).abs() < 0.1 * dark, "{shaded} {dark}");
    assert!(all.iter().all(|lit| *lit > 2.0 * shaded), "{all:?} {shaded}");
}

/// Returns a car with a headlamp on either side and tail lamps.
fn car() -> Mesh {
    let mut mesh = super::car();
    for y in [-0.7, 0.7] {
        let head = Face::new(Tag::Car, Material::LampWhite, 0);
        block(&mut mesh, [2.0, y - 0.1, 0.6], [2.02, y + 0.1, 0.7], head);
        let tail = Face::new(Tag::Car, Material::LampRed, 0);
        block(&mut mesh, [-2.02, y - 0.1, 0.6], [-2.0, y + 0.1, 0.7], tail);
    }
    mesh
}

#[test]
fn each_of_fourteen_lamps_at_one_place_counts() {
    let by = |count: u32| {
        let mut mesh = road();
        for object in 1..=count {
            let lens = Face::new(Tag::Pole, Material::LampWhite, object);
            let x = object as f32 * 0.3;
            block(&mut mesh, [x, -0.1, 8.0], [x + 0.2, 0.1, 8.1], lens);
        }
        let scene = Scene::new(&mesh, &[]).unwrap();
        let mut world = world_with(&scene, &[]);
        at_night(&mut world);
        let [lit, dark] = brightness(&scene, &world, &[[2.0, 26.0], [2.0, 80.0]])[..] else {
            unreachable!()
        };
        lit - dark
    };
    let (seven, fourteen) = (by(7), by(14));
    assert!(fourteen > 1.5 * seven, "{seven} {fourteen}");
}

#[test]
fn headlamps_illuminate_the_road_ahead_of_a_car_that_drives() {
    let scene = Scene::new(&road(), &[BlueprintMesh { mesh: &car() }]).unwrap();
    let pose = Pose::level(Vec3::ZERO, std::f32::consts::FRAC_PI_2);
    let lit = |lamps: u32| ActorState { lamps, ..actor(4, pose) };
    let mut world = world_with(&scene, &[lit(lamp::LOW_BEAM)]);
    at_night(&mut world);
    // The car heads along y.
    let points = [[0., 12.], [12., 0.], [0., -12.], [90., 0.]];
    let [ahead, aside, behind, dark] = brightness(&scene, &world, &points)[..] else {
        unreachable!()
    };
    let beyond = [ahead, aside, behind].map(|lit| lit - dark);
    assert!(beyond[0] > 10.0 * beyond[1].max(beyond[2]) && ahead > 1.5 * dark, "{beyond:?} {dark}");
    // A brake lamp lights the road behind the car in red.
    let red = |lamps: u32| {
        let mut world = world_with(&scene, &[lit(lamps)]);
        at_night(&mut world);
        let spec = SensorSpec {
            outputs: output::COLOR,
            parent_from_sensor: Pose::new(
                Vec3::new(0., -3., 2.),
                Quat::from_rotation_y(std::f32::consts::FRAC_PI_2),
            ),
            fov_rad: 0.1,
            ..camera(8, 8)
        };
        MeasuredBundle::measure(&mut cpu(1), &scene, &world, &[spec])
            .plane::<[u8; 4]>(0, output::COLOR)[0]
    };
    let ([r, g, ..], [weak, ..]) = (red(lamp::BRAKE), red(lamp::POSITION));
    assert!(r > g + 30 && r > weak + 20, "{r} {g} {weak}");
}

#[test]
fn headlamps_add_little_to_the_light_of_dusk() {
    let scene = Scene::new(&road(), &[BlueprintMesh { mesh: &car() }]).unwrap();
    let car = ActorState { lamps: lamp::LOW_BEAM, ..actor(4, Pose::level(Vec3::ZERO, 0.0)) };
    let lit = |sun_altitude_rad: f32| {
        let mut world = world_with(&scene, &[car]);
        world.weather = Weather { cloudiness: 100.0, sun_altitude_rad, ..Weather::default() };
        let points = [[12., 0.], [0., -40.]];
        let [ahead, dark] = mean_green(&scene, &world, &points, exposed)[..] else {
            unreachable!()
        };
        ahead / dark - 1.0
    };
    // Over the light that is there without them.
    let (dusk, night) = (lit(0.057), lit(-0.6));
    assert!(dusk < 0.03 && night > 0.6, "{dusk} {night}");
}
