//! What shading draws without geometry: rooms behind panes, light through leaves, tracks and oil on lanes, grain. On
//! both tracers.

use glam::{Quat, Vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{EffectsSpec, Frame, Pose, SensorSpec, Stamp, Weather, lamp, output, quality};

use super::lens::tracers;
use super::{MeasuredBundle, actor, block, camera, world_with};
use crate::{BlueprintMesh, Scene, Tracer, World};

type Image = Vec<[u8; 4]>;

const WIDTH: u32 = 64;

fn image(tracer: &mut Tracer, scene: &Scene, world: &World, spec: SensorSpec) -> Image {
    let spec = SensorSpec { outputs: output::COLOR, ..spec };
    let bundle = MeasuredBundle::measure(tracer, scene, world, &[spec]);
    bundle.plane::<[u8; 4]>(0, output::COLOR).to_vec()
}

fn at_quality(level: u32) -> SensorSpec {
    SensorSpec { quality: level, ..camera(WIDTH, WIDTH) }
}

/// Returns the image of every tracer, after comparing those of the others with the first.
fn agreed(scene: &Scene, world: &World, spec: SensorSpec) -> Image {
    let images: Vec<Image> =
        tracers().map(|mut tracer| image(&mut tracer, scene, world, spec)).collect();
    for other in &images[1..] {
        let apart =
            |(a, b): &(&[u8; 4], &[u8; 4])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 3);
        let count = images[0].iter().zip(other).filter(apart).count();
        assert!(count * 200 <= other.len(), "{count} of {} pixels differ", other.len());
    }
    images[0].clone()
}

/// Returns a wall at x = 6 with a pane of 3 m by 2 m in it.
fn window(rgb: [u8; 3]) -> Scene {
    let mut mesh = Mesh::default();
    let of = |material: Material, tint: [u8; 3]| Face {
        tint: Face::tint(tint),
        ..Face::new(Tag::Building, material, 3)
    };
    block(&mut mesh, [6., -9., 0.], [9., 9., 9.], of(Material::FacadePlaster, [180, 170, 160]));
    let corners = [[5.98, 1.5, 0.2], [5.98, -1.5, 0.2], [5.98, -1.5, 2.2], [5.98, 1.5, 2.2]];
    mesh.quad(corners, of(Material::Glass, rgb));
    Scene::new(&mesh, &[]).unwrap()
}

/// Returns the difference between the brightest and the darkest pixel of the middle of the pane.
fn spread(image: &Image) -> u8 {
    let pane = (28..36).flat_map(|y| (24..40).map(move |x| y * WIDTH as usize + x));
    let values: Vec<u8> = pane.map(|at| image[at][1]).collect();
    values.iter().max().unwrap() - values.iter().min().unwrap()
}

#[test]
fn a_pane_of_a_building_shows_a_room() {
    let scene = window([34, 38, 44]);
    let world = world_with(&scene, &[]);
    let fine = spread(&agreed(&scene, &world, at_quality(quality::STANDARD)));
    let low = spread(&agreed(&scene, &world, at_quality(quality::LOW)));
    // By day a room is dark.
    assert!(fine > low + 1, "{fine} {low}");
}

#[test]
fn the_sun_shines_through_leaves_unless_something_is_behind_them() {
    let shown = |has_wall: bool| {
        let mut mesh = Mesh::default();
        let green = Face {
            tint: Face::tint([110, 140, 60]),
            ..Face::new(Tag::Vegetation, Material::Leaves, 2)
        };
        mesh.quad([[5., 3., 0.], [5., -3., 0.], [5., -3., 3.], [5., 3., 3.]], green);
        if has_wall {
            let wall = Face::new(Tag::Wall, Material::Concrete, 3);
            block(&mut mesh, [5.5, -40., 0.], [6., 40., 60.], wall);
        }
        let scene = Scene::new(&mesh, &[]).unwrap();
        let mut world = world_with(&scene, &[]);
        // The sun is ahead of the camera.
        world.weather =
            Weather { sun_azimuth_rad: 0.0, sun_altitude_rad: 0.6, ..Weather::default() };
        agreed(&scene, &world, at_quality(quality::STANDARD))[32 * WIDTH as usize + 32]
    };
    let (open, shaded) = (shown(false), shown(true));
    assert!(open[1] > shaded[1] + 25, "{open:?} {shaded:?}");
    assert!(open[1] > open[2] + 40, "yellower than the leaf: {open:?}");
}

/// Returns the image, from 2 m above it, of a lane with this blue in its tint; its first columns lie at its left
/// edge.
fn lane(blue: u8) -> Image {
    let mut mesh = Mesh::default();
    let asphalt =
        Face { tint: Face::tint([82, 81, blue]), ..Face::new(Tag::Roads, Material::Asphalt, 0) };
    // The first edge of each triangle lies along the lane, which leads along x.
    for x in (-40..40).step_by(8).map(|x| x as f32) {
        let [a, b, c, d] = [[x, 2., 0.], [x, -2., 0.], [x + 8., -2., 0.], [x + 8., 2., 0.]]
            .map(|corner| mesh.vertex(corner));
        mesh.triangle([d, a, c], asphalt);
        mesh.triangle([b, c, a], asphalt);
    }
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
    // From above: a column of pixels lies at one distance from the middle.
    let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let parent_from_sensor = Pose::new(Vec3::new(0., 0., 2.0), down);
    let spec = SensorSpec { parent_from_sensor, ..at_quality(quality::STANDARD) };
    agreed(&scene, &world, spec)
}

/// Returns the mean brightness of columns of an image.
fn mean(image: &Image, columns: std::ops::Range<usize>) -> f32 {
    let of = columns.clone().flat_map(|x| (0..64).map(move |y| y * 64 + x));
    of.map(|at| f32::from(image[at][1])).sum::<f32>() / (columns.len() * 64) as f32
}

#[test]
fn the_tracks_of_wheels_lie_along_a_lane() {
    let image = lane(82);
    // 32 pixels are 2 m.
    let (middle, edges) = (mean(&image, 29..35), (mean(&image, 0..4) + mean(&image, 60..64)) * 0.5);
    assert!(middle < edges - 4.0, "{middle} {edges}");
    // Between the oil and the tracks of wheels, 0.82 m from the middle, the road is brighter than in both.
    let between = (mean(&image, 24..26) + mean(&image, 38..40)) * 0.5;
    let tracks = (mean(&image, 17..21) + mean(&image, 43..47)) * 0.5;
    assert!(between > tracks + 3.0 && between > middle + 3.0, "{between} {tracks} {middle}");
}

#[test]
fn oil_lies_where_vehicles_wait() {
    let [dry, oily] = [82, 82 + 3 * 8].map(lane);
    let (middle, before) = (mean(&oily, 28..36), mean(&dry, 28..36));
    assert!(middle < before - 5.0, "{middle} {before}");
    let (edge, before) = (mean(&oily, 0..6), mean(&dry, 0..6));
    assert!((edge - before).abs() < 0.6, "its edges are no bluer: {edge} {before}");
}

#[test]
fn asphalt_and_grass_have_grain_that_fades_with_the_distance() {
    for material in [Material::Asphalt, Material::Grass] {
        let mut mesh = Mesh::default();
        let face = Face::new(Tag::Roads, material, 0);
        mesh.quad([[-90., 90., 0.], [-90., -90., 0.], [90., -90., 0.], [90., 90., 0.]], face);
        let scene = Scene::new(&mesh, &[]).unwrap();
        let mut world = world_with(&scene, &[]);
        world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
        // The mean difference between neighbouring pixels.
        let grain = |high: f32| {
            let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
            let parent_from_sensor = Pose::new(Vec3::new(3.3, 1.7, high), down);
            let spec = SensorSpec { parent_from_sensor, ..at_quality(quality::STANDARD) };
            let image = agreed(&scene, &world, SensorSpec { fov_rad: 0.25, ..spec });
            let differences = image.chunks(WIDTH as usize).flat_map(|row| row.windows(2));
            let differences = differences.map(|pair| f32::from(pair[0][1].abs_diff(pair[1][1])));
            differences.sum::<f32>() / image.len() as f32
        };
        let (near, far) = (grain(2.0), grain(60.0));
        assert!(near > 3.0 && far > 0.2 && near > far * 1.5, "{material:?}: {near} {far}");
    }
}

#[test]
fn a_clear_cover_shows_the_head_lamp_behind_it() {
    let shown = |level: u32, lamps: u32, red: u8| {
        let mut mesh = super::car();
        let ground =
            Face { tint: Face::tint([red, 10, 10]), ..Face::new(Tag::Car, Material::Plastic, 0) };
        block(&mut mesh, [-2.1, -1.5, 0.3], [-2.0, 1.5, 2.4], ground);
        let cover = Face { tint: 1, ..Face::new(Tag::Car, Material::Glass, 0) };
        block(&mut mesh, [-2.14, -1.5, 0.3], [-2.13, 1.5, 2.4], cover);
        let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &mesh }]).unwrap();
        let car = actor(4, Pose::level(Vec3::new(6., 0., 0.), 0.));
        let mut world = world_with(&scene, &[protocol::ActorState { lamps, ..car }]);
        world.weather.sun_azimuth_rad = std::f32::consts::PI;
        agreed(&scene, &world, at_quality(level))[32 * WIDTH as usize + 32]
    };
    let [red, black] = [230, 10].map(|red| shown(quality::STANDARD, 0, red));
    assert!(red[0] > black[0] + 60, "{red:?} {black:?}");
    let [off, on] = [0, lamp::LOW_BEAM].map(|lamps| shown(quality::LOW, lamps, 230));
    assert!(on[1] > off[1] + 60, "{on:?} {off:?}");
}

/// Returns the image of level ground of a material in rain, from 1.6 m above it.
fn wet_ground(material: Material) -> Image {
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Terrain, material, 0);
    mesh.quad([[-90., 90., 0.], [-90., -90., 0.], [90., -90., 0.], [90., 90., 0.]], face);
    let wall = Face { tint: Face::tint([250, 30, 30]), ..Face::new(Tag::Wall, Material::Sign, 3) };
    block(&mut mesh, [30., -90., 0.], [31., 90., 40.], wall);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    world.weather = Weather {
        cloudiness: 100.0,
        wetness: 100.0,
        precipitation_deposits: 100.0,
        ..Weather::default()
    };
    let parent_from_sensor = Pose::new(Vec3::new(0., 0., 1.6), Quat::IDENTITY);
    let spec = SensorSpec { parent_from_sensor, ..at_quality(quality::STANDARD) };
    agreed(&scene, &world, spec)
}

#[test]
fn in_rain_roads_mirror_and_grass_does_not() {
    // Of the ground between 9 and 25 m ahead, how much redder than green it is.
    let redness = |image: &Image| {
        let rows = (34..38).flat_map(|y| (8..56).map(move |x| y * WIDTH as usize + x));
        rows.map(|at| i32::from(image[at][0]) - i32::from(image[at][1])).sum::<i32>() / (4 * 48)
    };
    let [road, grass] = [Material::Asphalt, Material::Grass].map(|of| redness(&wet_ground(of)));
    assert!(road > 20 && grass < 5, "{road} {grass}");
}

#[test]
fn plates_of_actors_of_one_blueprint_differ() {
    let mut mesh = super::car();
    let tint = crate::plate::TINT as u16;
    let face = Face { tint, ..Face::new(Tag::Car, Material::Sign, 0) };
    block(&mut mesh, [-2.1, -0.26, 1.145], [-2.0, 0.26, 1.255], face);
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &mesh }]).unwrap();
    let shown = |id: u32| {
        let car = actor(id, Pose::level(Vec3::new(5., 0., 0.), 0.));
        let parent_from_sensor = Pose::new(Vec3::new(0., 0., 1.2), Quat::IDENTITY);
        let level = at_quality(quality::STANDARD);
        let spec = SensorSpec { parent_from_sensor, fov_rad: 0.2, ..level };
        agreed(&scene, &world_with(&scene, &[car]), spec)
    };
    let (one, other) = (shown(4), shown(5));
    let differs = one.iter().zip(&other).filter(|(a, b)| a[1].abs_diff(b[1]) > 60).count();
    assert!(differs > 40, "{differs}");
}

/// Returns the image of a panel of a vehicle 3.9 m ahead, 6 m wide and 3 m high, of a paint.
fn panel(town: &Mesh, weather: &Weather, rgb: [u8; 3]) -> Image {
    panel_with(town, weather, rgb, EffectsSpec::default())
}

/// Returns that image from a camera with effects.
fn panel_with(town: &Mesh, weather: &Weather, rgb: [u8; 3], effects: EffectsSpec) -> Image {
    let mut mesh = super::car();
    block(&mut mesh, [-2.1, -3., 0.2], [-2.0, 3., 3.], Face::new(Tag::Car, Material::CarPaint, 0));
    let scene = Scene::new(town, &[BlueprintMesh { mesh: &mesh }]).unwrap();
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(9), ..Stamp::default() };
    let car = actor(4, Pose::level(Vec3::new(6., 0., 0.), 0.));
    world.place(&scene, stamp, 50_000_000, weather, &[car], |_| rgb);
    agreed(&scene, &world, SensorSpec { effects, ..at_quality(quality::STANDARD) })
}

#[test]
fn metallic_paint_is_brighter_towards_the_mirrored_sky_and_solid_paint_is_not() {
    let overcast = Weather { cloudiness: 100.0, ..Weather::default() };
    // How much brighter the panel is 2.8 m than 1.1 m above the road, where a mirror shows the sky and the horizon.
    let rise = |rgb: [u8; 3]| {
        let image = panel(&Mesh::default(), &overcast, rgb);
        let [high, level] = [17, 31].map(|row| i32::from(image[row * WIDTH as usize + 32][1]));
        high - level
    };
    let [silver, white] = [[176, 180, 183], [236, 236, 234]].map(rise);
    // Of the latter only the clear coat mirrors the sky.
    assert!(silver > 15 && white < 11, "{silver} {white}");
}

#[test]
fn the_clear_coat_of_black_paint_mirrors_a_wall_behind_the_camera() {
    let mut town = Mesh::default();
    let white = Face::new(Tag::Building, Material::PaintWhite, 0);
    block(&mut town, [-4., 0., 0.], [-3., 9., 9.], white);
    // The wall is in the sun, and the panel is not.
    let weather = Weather { sun_azimuth_rad: 0.0, sun_altitude_rad: 0.3, ..Weather::default() };
    let image = panel(&town, &weather, [22, 23, 25]);
    let [left, right] = [26, 38].map(|x| i32::from(image[30 * WIDTH as usize + x][1]));
    assert!(left > right + 12, "{left} {right}");
}

#[test]
fn black_paint_mirrors_the_sun_as_a_small_spot_that_is_brighter_than_white() {
    // Behind the camera, 11 degrees above the horizon, at an exposure at which white is dark.
    let weather = Weather {
        sun_azimuth_rad: std::f32::consts::PI,
        sun_altitude_rad: 0.2,
        cloudiness: 0.0,
        ..Weather::default()
    };
    let effects = EffectsSpec { compensation_ev: -4.0, ..Default::default() };
    let shown = |weather: &Weather, rgb: [u8; 3]| {
        let image = panel_with(&Mesh::default(), weather, rgb, effects);
        image.iter().map(|pixel| pixel[0]).collect::<Vec<u8>>()
    };
    let (black, white) = (shown(&weather, [22, 23, 25]), shown(&weather, [236, 236, 234]));
    let (top, matte) = (*black.iter().max().unwrap(), white[50 * WIDTH as usize + 50]);
    let spot = black.iter().filter(|red| **red > top / 2).count();
    assert!(top > 150 && matte < 100 && spot < 30, "{top} {matte} {spot}");
    // Behind clouds, and at night, there is no disc to mirror: nothing is brighter than the sky.
    let cloudy = Weather { cloudiness: 100.0, ..weather };
    let night = Weather { sun_azimuth_rad: 0.0, sun_altitude_rad: -0.2, ..weather };
    for (hidden, limit) in [(cloudy, 70), (night, 30)] {
        let most = *shown(&hidden, [22, 23, 25]).iter().max().unwrap();
        assert!(most < limit, "{most} {hidden:?}");
    }
}

#[test]
fn the_clear_sky_is_brighter_around_the_sun() {
    let scene = Scene::new(&lone_block(), &[]).unwrap();
    let shown = |sun_azimuth_rad: f32| {
        let mut world = world_with(&scene, &[]);
        let weather = Weather { sun_azimuth_rad, sun_altitude_rad: 0.9, ..Weather::default() };
        world.weather = Weather { cloudiness: 0.0, ..weather };
        // 34 degrees above the horizon.
        agreed(&scene, &world, at_quality(quality::STANDARD))[10 * WIDTH as usize + 32]
    };
    let (before, behind) = (shown(0.0), shown(std::f32::consts::PI));
    assert!(before[0] > behind[0] + 40, "{before:?} {behind:?}");
    assert!(behind[2] > behind[0] + 40, "{behind:?}");
}

/// Returns a small block behind the camera.
fn lone_block() -> Mesh {
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Wall, Material::Concrete, 3);
    block(&mut mesh, [-9., 0., 0.], [-8., 1., 1.], face);
    mesh
}

#[test]
fn metal_flakes_in_paint_shine_about_the_mirrored_sun() {
    let mut mesh = super::car();
    block(&mut mesh, [-2.1, -3., 0.2], [-2.0, 3., 3.], Face::new(Tag::Car, Material::CarPaint, 0));
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &mesh }]).unwrap();
    let shown = |azimuth: f32| {
        let mut world = world_with(&scene, &[actor(4, Pose::level(Vec3::new(6., 0., 0.), 0.))]);
        // Behind the camera, both at one angle from the panel's normal.
        world.weather =
            Weather { sun_azimuth_rad: azimuth, sun_altitude_rad: 0.2, ..Weather::default() };
        let image = agreed(&scene, &world, at_quality(quality::STANDARD));
        let bright = |x: usize| i32::from(image[30 * WIDTH as usize + x][1]);
        (bright(10), bright(54))
    };
    let turn = std::f32::consts::PI - 0.6;
    let (left, right) = shown(turn);
    assert!((left - right).abs() > 12, "{left} {right}");
}

#[test]
fn fog_lamps_are_red_at_the_rear_and_white_at_the_front() {
    let shown = |rear: bool| {
        let mut mesh = super::car();
        let own = Face::new(Tag::Car, Material::LampFog, 0);
        let face = if rear { Face { tint: Face::tint([120, 20, 18]), ..own } } else { own };
        block(&mut mesh, [-2.1, -0.5, 0.5], [-2.0, 0.5, 1.5], face);
        let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &mesh }]).unwrap();
        let car = actor(4, Pose::level(Vec3::new(6., 0., 0.), 0.));
        let world = world_with(&scene, &[protocol::ActorState { lamps: lamp::FOG, ..car }]);
        agreed(&scene, &world, at_quality(quality::LOW))[32 * WIDTH as usize + 32]
    };
    let (front, rear) = (shown(false), shown(true));
    assert!(front[1] > 200 && rear[0] > rear[1] + 60, "{front:?} {rear:?}");
}

#[test]
fn dust_covers_the_paint_of_vehicles_towards_the_road_and_more_of_it_on_some() {
    let mut mesh = super::car();
    block(&mut mesh, [-2.1, -3., 0.05], [-2.0, 3., 3.], Face::new(Tag::Car, Material::CarPaint, 0));
    let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &mesh }]).unwrap();
    // The brightness of the panel 0.15 m, 0.6 m, 1.1 m and 1.9 m above the road that the vehicle stands on.
    let shown = |id: u32, ground_m: f32, rgb: [u8; 3]| {
        let mut world = World::new();
        let stamp = Stamp { frame: Frame(9), ..Stamp::default() };
        let weather = Weather { cloudiness: 100.0, ..Weather::default() };
        let car = actor(id, Pose::level(Vec3::new(6., 0., ground_m), 0.));
        world.place(&scene, stamp, 50_000_000, &weather, &[car], |_| rgb);
        let parent_from_sensor = Pose::level(Vec3::new(0., 0., ground_m + 1.0), 0.);
        let spec = SensorSpec { parent_from_sensor, ..at_quality(quality::STANDARD) };
        let image = agreed(&scene, &world, spec);
        [0.15f32, 0.6, 1.1, 1.9].map(|height| {
            // 3.9 m ahead, 32 pixels are 3.9 m.
            let row = (31.5 + (1.0 - height) * 32.0 / 3.9).round() as usize;
            i32::from(image[row * WIDTH as usize + 32][1])
        })
    };
    let white = shown(4, 0.0, [225, 226, 224]);
    assert!(white[0] + 5 < white[1] && white[1] < white[2], "{white:?}");
    assert!((white[2] - white[3]).abs() < 12, "clean from 0.95 m on: {white:?}");
    let raised = shown(4, 7.0, [225, 226, 224]);
    assert!(white.iter().zip(raised).all(|(a, b)| a.abs_diff(b) < 4), "{white:?} {raised:?}");
    let black = shown(4, 0.0, [8, 8, 9]);
    assert!(black[0] > black[2] + 5, "dust is lighter than black paint: {black:?}");
    let shares = (5..25).map(|id| white[0] - shown(id, 0.0, [225, 226, 224])[0]);
    let (low, high) =
        shares.fold((0i32, 0i32), |(low, high), share| (low.min(share), high.max(share)));
    assert!(high - low > 4, "{low} {high}");
}

#[test]
fn a_lit_sign_is_darker_than_a_head_lamp_and_a_cover_than_both() {
    // With an exposure at which none of them is white.
    let shown = |material: Material, tint: u16| {
        let mut mesh = super::car();
        let face = Face { tint, ..Face::new(Tag::Car, material, 0) };
        block(&mut mesh, [-2.1, -1.5, 0.3], [-2.0, 1.5, 2.4], face);
        let scene = Scene::new(&Mesh::default(), &[BlueprintMesh { mesh: &mesh }]).unwrap();
        let car = actor(4, Pose::level(Vec3::new(6., 0., 0.), 0.));
        let lit = protocol::ActorState { lamps: lamp::LOW_BEAM, ..car };
        let mut world = world_with(&scene, &[lit]);
        world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
        let effects = EffectsSpec { compensation_ev: -5.0, ..Default::default() };
        let spec = SensorSpec { effects, ..at_quality(quality::LOW) };
        i32::from(agreed(&scene, &world, spec)[32 * WIDTH as usize + 32][1])
    };
    let head = shown(Material::LampWhite, 0);
    let sign = shown(Material::LampWhite, Face::tint([214, 208, 188]));
    let cover = shown(Material::Glass, 1);
    assert!(head > sign + 60 && head > cover + 60, "{head} {sign} {cover}");
}

/// Returns the image of a wall in the shade at x = 6, 12 m high from this foot, of a material in a colour.
fn shaded_wall(material: Material, rgb: [u8; 3], foot: f32) -> Image {
    shaded_wall_to(material, rgb, [foot, foot + 12.])
}

/// As [`shaded_wall`], from a foot to a top.
fn shaded_wall_to(material: Material, rgb: [u8; 3], [foot, top]: [f32; 2]) -> Image {
    let mut mesh = Mesh::default();
    let face = Face { tint: Face::tint(rgb), ..Face::new(Tag::Building, material, 3) };
    block(&mut mesh, [6., -30., foot], [9., 30., top], face);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
    agreed(&scene, &world, at_quality(quality::STANDARD))
}

#[test]
fn coloured_walls_are_dirty_above_their_foot_and_below_their_top_wherever_those_are() {
    // The camera is 1 m above z = 0, and a row of pixels 0.19 m high.
    let row = |image: &Image, z: f32| {
        let row = (31.5 - (z - 1.0) * (32.0 / 6.0)).round() as usize;
        let pixels = &image[row * 64..][..64];
        pixels.iter().map(|pixel| f32::from(pixel[1])).sum::<f32>() / 64.0
    };
    for foot in [-4.5, -2.0] {
        let image = shaded_wall(Material::FacadePlaster, [190, 186, 180], foot);
        let (low, middle) = (row(&image, foot + 0.2), row(&image, foot + 3.5));
        assert!(low < middle - 6.0, "foot at {foot}: {low} {middle}");
    }
    // Beside a higher wall, since storeys differ.
    let [high, middle] = [4.5f32, 20.0].map(|top| {
        row(&shaded_wall_to(Material::FacadePlaster, [190, 186, 180], [-7.5, top]), 4.1)
    });
    assert!(high < middle - 1.0, "{high} {middle}");
}

#[test]
fn storeys_of_plaster_differ_and_some_walls_have_a_darker_base() {
    let wall = |object: u32| {
        let mut mesh = Mesh::default();
        let of = Face::new(Tag::Building, Material::FacadePlaster, object);
        let face = Face { tint: Face::tint([190, 186, 180]), ..of };
        block(&mut mesh, [6., -30., 0.], [9., 30., 9.], face);
        let scene = Scene::new(&mesh, &[]).unwrap();
        let mut world = world_with(&scene, &[]);
        world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
        let image = agreed(&scene, &world, at_quality(quality::STANDARD));
        // The camera is 1 m above the foot, and a row of pixels 0.19 m high.
        [0.5f32, 0.7].map(|z| {
            let row = (31.5 - (z - 1.0) * (32.0 / 6.0)).round() as usize;
            image[row * 64..][..64].iter().map(|pixel| f32::from(pixel[1])).sum::<f32>() / 64.0
        })
    };
    let steps: Vec<f32> = (3..15).map(wall).map(|[base, above]| above - base).collect();
    let has_base = steps.iter().filter(|step| **step > 8.0).count();
    assert!((2..=10).contains(&has_base), "{steps:?}");
}

#[test]
fn brick_walls_have_joints_of_another_hue() {
    let mut mesh = Mesh::default();
    let face = Face {
        tint: Face::tint([142, 78, 60]),
        ..Face::new(Tag::Building, Material::FacadeBrick, 3)
    };
    block(&mut mesh, [1.2, -9., -3.], [2., 9., 9.], face);
    let scene = Scene::new(&mesh, &[]).unwrap();
    let mut world = world_with(&scene, &[]);
    world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
    // A pixel is 5 mm wide.
    let spec = SensorSpec { fov_rad: 0.25, ..at_quality(quality::STANDARD) };
    let image = agreed(&scene, &world, spec);
    let mut redness: Vec<f32> =
        image.iter().map(|pixel| f32::from(pixel[0]) / f32::from(pixel[2].max(1))).collect();
    redness.sort_by(f32::total_cmp);
    let [low, high] = [0.05, 0.95].map(|share| redness[(redness.len() as f32 * share) as usize]);
    assert!(high > 1.5 * low, "red over blue from {low} to {high}");
}

/// Returns an image of something in diffuse light, with pixels 4 mm wide at a distance of 1 m.
fn close_up(scene: &Scene) -> Image {
    let mut world = world_with(scene, &[]);
    world.weather = Weather { cloudiness: 100.0, ..Weather::default() };
    agreed(scene, &world, SensorSpec { fov_rad: 0.25, ..at_quality(quality::STANDARD) })
}

#[test]
fn furrows_of_bark_run_up_the_trunk() {
    // An oak 1.13 m before the camera.
    let oak = town::Plant {
        model: 48,
        object: 0,
        position: Vec3::new(1.45, 0., 0.),
        yaw_rad: 0.,
        scale: 1.,
    };
    let object = town::Object {
        tag: Tag::Vegetation,
        layer: town::Layer::Foliage,
        center: oak.position,
        half_extents_m: Vec3::ONE,
        yaw_rad: 0.,
        color: [70, 110, 50],
    };
    let (objects, plants) = (vec![object], vec![oak]);
    let town = town::Town { mesh: super::town(), objects, plants, ..Default::default() };
    let image = close_up(&Scene::of_town(&town).unwrap());
    let green = |x: usize, y: usize| f32::from(image[y * WIDTH as usize + x][1]);
    let pixels = || (8..56).flat_map(|y| (8..56).map(move |x| (x, y)));
    let across: f32 = pixels().map(|(x, y)| (green(x + 1, y) - green(x, y)).abs()).sum();
    let upwards: f32 = pixels().map(|(x, y)| (green(x, y + 1) - green(x, y)).abs()).sum();
    assert!(across > 1.4 * upwards && across > 48.0 * 48.0, "{across} {upwards}");
}

#[test]
fn bark_is_as_bright_from_afar_as_from_nearby() {
    let shown = |away: f32| {
        let mut mesh = Mesh::default();
        let face = Face {
            tint: Face::tint([108, 100, 84]),
            ..Face::new(Tag::Vegetation, Material::Bark, 3)
        };
        block(&mut mesh, [away, -40., -40.], [away + 9., 40., 40.], face);
        mean(&close_up(&Scene::new(&mesh, &[]).unwrap()), 0..64)
    };
    let (near, far) = (shown(1.2), shown(24.0));
    // The near image shows 0.3 m, with ridges and algae of its own.
    assert!((near / far - 1.0).abs() < 0.15, "{near} {far}");
}
