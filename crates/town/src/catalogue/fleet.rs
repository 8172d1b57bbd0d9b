//! The table of vehicles.
//!
//! Sizes are length, width with mirrors and height in metres; two-wheelers with their riders.

use glam::{Vec3, vec3};
use mesh::{Mesh, Tag};

use crate::{
    catalogue::{
        blueprint::{Blueprint, Kind, Wheel},
        car::{self, Livery},
        heavy::{self, Heavy},
        mesh_source::MeshSource,
        profile::{Measure, SHELL, Silhouette},
        rig::{Joint, Motion, Rig},
        silhouettes, tall,
        trim::{self, Extra, Grille, Lamps, Tail, Trim},
        two_wheels::{self, Bike},
        wheel,
    },
    mesh_builder::{self, MeshBuilder},
};

/// How the mesh of a vehicle is built.
enum Build {
    Car(&'static Silhouette, Trim),
    Heavy(Heavy),
    Bike(Bike),
}
use Build::Car;

/// The driven axles.
#[derive(Clone, Copy, PartialEq)]
enum Drive {
    Front,
    Rear,
    All,
    Legs,
}
use Drive::{All, Front, Legs, Rear};

/// A row of the table of vehicles.
struct Row(
    &'static str,
    Build,
    [f32; 3], // size_m: length, width with mirrors, height
    f32,      // width without mirrors as a fraction of the width with them
    f32,      // wheelbase_m
    f32,      // fraction of the overhangs that lies in front
    f32,      // wheel radius_m
    f32,      // mass_kg
    Drive,
    [u8; 3],      // default colour
    &'static str, // special type
);

const RED: [u8; 3] = [163, 24, 22];
const WHITE: [u8; 3] = [225, 226, 224];
const BLACK: [u8; 3] = [22, 23, 26];
const SILVER: [u8; 3] = [150, 153, 156];
/// Brushed stainless steel.
const STEEL: [u8; 3] = [134, 136, 138];
const BLUE: [u8; 3] = [25, 60, 130];
const GREEN: [u8; 3] = [35, 92, 62];
const YELLOW: [u8; 3] = [230, 176, 22];
const GREY: [u8; 3] = [84, 88, 92];
const ORANGE: [u8; 3] = [205, 92, 20];
const TEAL: [u8; 3] = [60, 130, 135];

#[rustfmt::skip]
static TABLE: [Row; 41] = [
    Row("vehicle.audi.a2", Car(&silhouettes::MONOVOLUME, Trim(Lamps::Slim, Grille::Wide, Tail::Corner, Extra::Nothing)), [3.705, 1.789, 1.550], 0.93, 2.405, 0.52, 0.310, 1020.0, Front, SILVER, ""),
    Row("vehicle.audi.etron", Car(&silhouettes::SUV, Trim(Lamps::Slim, Grille::Frame, Tail::Bar, Extra::Rails)), [4.856, 2.033, 1.649], 0.92, 2.928, 0.47, 0.385, 2490.0, All, BLUE, "electric"),
    Row("vehicle.audi.tt", Car(&silhouettes::DOME, Trim(Lamps::Wide, Grille::Wide, Tail::Corner, Extra::Nothing)), [4.181, 1.994, 1.385], 0.92, 2.505, 0.53, 0.335, 1335.0, Front, RED, ""),
    Row("vehicle.bmw.grandtourer", Car(&silhouettes::MONOVOLUME, Trim(Lamps::Wide, Grille::Kidneys, Tail::Corner, Extra::Rails)), [4.611, 2.242, 1.667], 0.84, 2.780, 0.47, 0.340, 1640.0, Front, GREY, ""),
    Row("vehicle.chevrolet.impala", Car(&silhouettes::CLASSIC, Trim(Lamps::Twin, Grille::Chrome, Tail::Round, Extra::Nothing)), [5.357, 2.033, 1.411], 0.95, 3.020, 0.44, 0.340, 1750.0, Rear, TEAL, ""),
    Row("vehicle.citroen.c3", Car(&silhouettes::HATCHBACK, Trim(Lamps::Slim, Grille::Wide, Tail::Corner, Extra::Roof([40, 42, 46]))), [3.988, 1.851, 1.624], 0.94, 2.540, 0.54, 0.325, 1090.0, Front, ORANGE, ""),
    Row("vehicle.dodge.charger_2020", Car(&silhouettes::SEDAN, Trim(Lamps::Slim, Grille::Wide, Tail::Bar, Extra::Nothing)), [5.006, 2.097, 1.534], 0.91, 3.052, 0.50, 0.365, 1920.0, Rear, BLACK, ""),
    Row("vehicle.dodge.charger_police", Car(&silhouettes::SEDAN, Trim(Lamps::Slim, Grille::Wide, Tail::Bar, Extra::Police([24, 25, 28]))), [4.974, 2.038, 1.542], 0.93, 3.052, 0.50, 0.365, 1990.0, Rear, WHITE, "emergency"),
    Row("vehicle.dodge.charger_police_2020", Car(&silhouettes::SEDAN, Trim(Lamps::Slim, Grille::Wide, Tail::Bar, Extra::Police([232, 232, 230]))), [5.237, 2.097, 1.638], 0.91, 3.052, 0.49, 0.365, 2010.0, Rear, WHITE, "emergency"),
    Row("vehicle.ford.crown", Car(&silhouettes::CLASSIC, Trim(Lamps::Wide, Grille::Frame, Tail::Corner, Extra::Taxi)), [5.366, 1.801, 1.575], 0.98, 2.913, 0.44, 0.345, 1870.0, Rear, YELLOW, "taxi"),
    Row("vehicle.ford.mustang", Car(&silhouettes::FASTBACK, Trim(Lamps::Round, Grille::Frame, Tail::Upright, Extra::Stripes([236, 236, 232]))), [4.718, 1.895, 1.301], 0.95, 2.743, 0.45, 0.330, 1400.0, Rear, BLUE, ""),
    Row("vehicle.jeep.wrangler_rubicon", Car(&tall::JEEP, Trim(Lamps::Round, Grille::Slots, Tail::Upright, Extra::Spare)), [3.866, 1.905, 1.878], 0.92, 2.424, 0.46, 0.405, 1900.0, All, GREEN, ""),
    Row("vehicle.lincoln.mkz_2017", Car(&silhouettes::LIFTBACK, Trim(Lamps::Slim, Grille::Frame, Tail::Bar, Extra::Nothing)), [4.902, 2.128, 1.511], 0.875, 2.850, 0.49, 0.345, 1720.0, Front, BLACK, ""),
    Row("vehicle.lincoln.mkz_2020", Car(&silhouettes::SEDAN, Trim(Lamps::Slim, Grille::Frame, Tail::Bar, Extra::Nothing)), [4.892, 1.837, 1.490], 0.97, 2.850, 0.49, 0.350, 1750.0, Front, WHITE, ""),
    Row("vehicle.mercedes.coupe", Car(&silhouettes::FASTBACK, Trim(Lamps::Wide, Grille::Frame, Tail::Corner, Extra::Nothing)), [5.027, 2.152, 1.651], 0.89, 2.945, 0.45, 0.355, 2020.0, All, SILVER, ""),
    Row("vehicle.mercedes.coupe_2020", Car(&silhouettes::COUPE, Trim(Lamps::Slim, Grille::Frame, Tail::Corner, Extra::Nothing)), [4.674, 1.815, 1.447], 0.97, 2.840, 0.46, 0.345, 1650.0, Rear, GREY, ""),
    Row("vehicle.micro.microlino", Car(&silhouettes::BUBBLE, Trim(Lamps::Round, Grille::Bare, Tail::Round, Extra::Roof([232, 232, 228]))), [2.207, 1.481, 1.376], 0.96, 1.400, 0.46, 0.260, 513.0, Rear, TEAL, "electric"),
    Row("vehicle.mini.cooper_s", Car(&silhouettes::BRICK, Trim(Lamps::Round, Grille::Wide, Tail::Upright, Extra::Roof([232, 232, 228]))), [3.806, 1.970, 1.475], 0.87, 2.467, 0.49, 0.315, 1165.0, Front, RED, ""),
    Row("vehicle.mini.cooper_s_2021", Car(&silhouettes::BRICK, Trim(Lamps::Round, Grille::Frame, Tail::Upright, Extra::Rails)), [4.553, 2.098, 1.767], 0.88, 2.930, 0.49, 0.370, 1330.0, Front, GREEN, ""),
    Row("vehicle.nissan.micra", Car(&silhouettes::HATCHBACK, Trim(Lamps::Round, Grille::Wide, Tail::Corner, Extra::Nothing)), [3.633, 1.845, 1.501], 0.90, 2.430, 0.52, 0.300, 980.0, Front, BLUE, ""),
    Row("vehicle.nissan.patrol", Car(&tall::OFF_ROADER, Trim(Lamps::Wide, Grille::Frame, Tail::Upright, Extra::Rack)), [4.604, 1.931, 1.855], 0.95, 2.750, 0.42, 0.395, 2180.0, All, SILVER, ""),
    Row("vehicle.nissan.patrol_2021", Car(&silhouettes::SUV, Trim(Lamps::Wide, Grille::Frame, Tail::Upright, Extra::Rails)), [5.566, 2.150, 2.045], 0.92, 3.250, 0.42, 0.440, 2720.0, All, WHITE, ""),
    Row("vehicle.seat.leon", Car(&silhouettes::HATCHBACK, Trim(Lamps::Wide, Grille::Wide, Tail::Corner, Extra::Spoiler)), [4.193, 1.816, 1.474], 0.98, 2.578, 0.53, 0.320, 1330.0, Front, RED, ""),
    Row("vehicle.tesla.cybertruck", Car(&silhouettes::WEDGE, Trim(Lamps::Bar, Grille::Bare, Tail::Bar, Extra::Nothing)), [6.274, 2.390, 2.098], 0.88, 3.950, 0.43, 0.455, 3100.0, All, STEEL, "electric"),
    Row("vehicle.tesla.model3", Car(&silhouettes::LIFTBACK, Trim(Lamps::Wide, Grille::Bare, Tail::Corner, Extra::Nothing)), [4.792, 2.163, 1.488], 0.88, 2.875, 0.44, 0.345, 1845.0, Rear, RED, "electric"),
    Row("vehicle.toyota.prius", Car(&silhouettes::LIFTBACK, Trim(Lamps::Tall, Grille::Wide, Tail::Upright, Extra::Nothing)), [4.513, 2.007, 1.525], 0.88, 2.700, 0.51, 0.320, 1400.0, Front, WHITE, "electric"),
    Row("vehicle.volkswagen.t2", Car(&tall::MICROBUS, Trim(Lamps::Round, Grille::Badge, Tail::Upright, Extra::Roof([236, 232, 220]))), [4.480, 2.069, 2.038], 0.86, 2.430, 0.52, 0.330, 1280.0, Rear, ORANGE, ""),
    Row("vehicle.volkswagen.t2_2021", Car(&tall::MICROBUS, Trim(Lamps::Round, Grille::Badge, Tail::Upright, Extra::Rack)), [4.442, 1.774, 1.987], 0.97, 2.430, 0.52, 0.325, 1300.0, Rear, TEAL, ""),
    Row("vehicle.mercedes.sprinter", Car(&tall::VAN, Trim(Lamps::Tall, Grille::Frame, Tail::Upright, Extra::Nothing)), [5.915, 1.989, 2.561], 0.97, 3.665, 0.45, 0.345, 2200.0, Rear, WHITE, ""),
    Row("vehicle.ford.ambulance", Build::Heavy(heavy::AMBULANCE), [6.366, 2.351, 2.431], 0.92, 3.990, 0.42, 0.380, 4300.0, Rear, WHITE, "emergency"),
    Row("vehicle.carlamotors.carlacola", Build::Heavy(heavy::BOX_TRUCK), [5.204, 2.614, 2.467], 0.90, 2.950, 0.45, 0.420, 5200.0, Rear, RED, ""),
    Row("vehicle.carlamotors.firetruck", Build::Heavy(heavy::FIRE_TRUCK), [8.468, 2.891, 3.828], 0.88, 4.550, 0.40, 0.520, 14500.0, Rear, RED, "emergency"),
    Row("vehicle.carlamotors.european_hgv", Build::Heavy(heavy::LORRY), [7.935, 2.891, 3.464], 0.88, 4.600, 0.34, 0.520, 11000.0, Rear, BLUE, ""),
    Row("vehicle.mitsubishi.fusorosa", Build::Heavy(heavy::BUS), [10.272, 2.900, 3.250], 0.88, 5.300, 0.46, 0.500, 10500.0, Rear, WHITE, ""),
    Row("vehicle.bh.crossbike", Build::Bike(two_wheels::CROSS), [1.690, 0.640, 1.760], 1.0, 1.030, 0.5, 0.330, 95.0, Legs, BLACK, ""),
    Row("vehicle.diamondback.century", Build::Bike(two_wheels::RACER), [1.660, 0.500, 1.640], 1.0, 0.990, 0.5, 0.335, 90.0, Legs, RED, ""),
    Row("vehicle.gazelle.omafiets", Build::Bike(two_wheels::ROADSTER), [1.800, 0.600, 1.830], 1.0, 1.110, 0.5, 0.345, 100.0, Legs, BLACK, ""),
    Row("vehicle.harley-davidson.low_rider", Build::Bike(two_wheels::CRUISER), [2.300, 0.900, 1.560], 1.0, 1.630, 0.5, 0.325, 382.0, Rear, BLACK, ""),
    Row("vehicle.kawasaki.ninja", Build::Bike(two_wheels::SPORT), [2.033, 0.797, 1.480], 1.0, 1.395, 0.5, 0.310, 248.0, Rear, GREEN, ""),
    Row("vehicle.vespa.zx125", Build::Bike(two_wheels::SCOOTER), [1.804, 0.740, 1.690], 1.0, 1.250, 0.5, 0.250, 184.0, Rear, TEAL, ""),
    Row("vehicle.yamaha.yzf", Build::Bike(two_wheels::SPORT), [2.209, 0.867, 1.530], 1.0, 1.510, 0.5, 0.340, 249.0, Rear, BLUE, ""),
];

/// The ids of CARLA's second generation of vehicles.
pub(super) const SECOND: [&str; 14] = [
    "vehicle.carlamotors.european_hgv",
    "vehicle.carlamotors.firetruck",
    "vehicle.dodge.charger_2020",
    "vehicle.dodge.charger_police_2020",
    "vehicle.ford.ambulance",
    "vehicle.ford.crown",
    "vehicle.lincoln.mkz_2020",
    "vehicle.mercedes.coupe_2020",
    "vehicle.mercedes.sprinter",
    "vehicle.mini.cooper_s_2021",
    "vehicle.mitsubishi.fusorosa",
    "vehicle.nissan.patrol_2021",
    "vehicle.tesla.cybertruck",
    "vehicle.volkswagen.t2_2021",
];

/// Returns every vehicle, sorted by id.
pub(super) fn vehicles() -> Vec<Blueprint> {
    let mut all: Vec<Blueprint> = (0..TABLE.len()).map(build).collect();
    all.sort_by_key(|blueprint| blueprint.id);
    all
}

fn build(number: usize) -> Blueprint {
    let Row(id, ref build, size, body, wheelbase, front, radius, mass, drive, color, special) =
        TABLE[number];
    let size = Vec3::from_array(size);
    let nose = wheelbase * 0.5 + (size.x - wheelbase) * front;
    let wheels = match build {
        Build::Bike(bike) => two_wheels::wheels(bike, wheelbase, radius),
        _ => four_wheels(size, body, wheelbase, radius, drive),
    };
    let (tag, base_type) = match build {
        Build::Heavy(heavy) => (heavy.tag, heavy.base_type),
        Build::Bike(_) if drive == Legs => (Tag::Bicycle, "bicycle"),
        Build::Bike(_) => (Tag::Motorcycle, "motorcycle"),
        _ if id.contains("sprinter") || id.contains("volkswagen") => (Tag::Car, "van"),
        _ => (Tag::Car, "car"),
    };
    Blueprint {
        base_type,
        special_type: special,
        generation: if SECOND.contains(&id) { 2 } else { 1 },
        half_extents_m: size * 0.5,
        center_m: vec3(nose - size.x * 0.5, 0.0, size.z * 0.5),
        wheels,
        mass_kg: mass,
        wheelbase_m: wheelbase,
        default_color: color,
        ..Blueprint::new(id, Kind::Vehicle, tag, MeshSource::Vehicle(number))
    }
}

fn measure<'a>(row: &Row, blueprint: &'a Blueprint) -> Measure<'a> {
    let size = Vec3::from_array(row.2);
    let nose_m = blueprint.center_m.x + size.x * 0.5;
    // Loads on the roof count towards the height, parts behind the tail towards the length.
    let size_m = match &row.1 {
        Car(_, trim) => size - vec3(trim.3.trailing_m(), 0.0, trim.3.roof_load_m()),
        _ => size,
    };
    Measure { size_m, body_m: size.y * row.3, nose_m, wheels: &blueprint.wheels }
}

/// Returns the rig of a vehicle: the body, its wheels, then its other joints.
pub(super) fn rig(number: usize, blueprint: &Blueprint) -> Rig {
    let row = &TABLE[number];
    let measure = measure(row, blueprint);
    let (shape, measure) = match &row.1 {
        Build::Bike(bike) => return two_wheels::rig(bike, &measure),
        Build::Heavy(heavy) => heavy::cab(heavy, &measure),
        Car(shape, _) => (*shape, measure),
    };
    let cuts = shape.door_cuts();
    let body = if cuts.is_empty() { Motion::Still } else { Motion::Shut };
    let mut joints = vec![Joint { name: "body", motion: body }];
    let names = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];
    joints.extend(blueprint.wheels.iter().zip(names).map(|(wheel, name)| {
        let steers_about = if wheel.steered { Vec3::Z } else { Vec3::ZERO };
        Joint { name, motion: Motion::Wheel { hub_m: wheel.position_m, steers_about } }
    }));
    if !cuts.is_empty() {
        joints.push(Joint { name: "shell", motion: Motion::Ajar });
        let cage = car::cage(shape.cage, &measure);
        let names = ["door_fl", "door_fr", "door_rl", "door_rr"];
        for (number, name) in (0..cuts.len() * 2).zip(names) {
            let side = if number % 2 == 0 { 1.0 } else { -1.0 };
            let front = car::door_front(&cage, number as u32);
            let hinge_m = vec3(front.x, front.y * 0.97, 0.0);
            let motion = Motion::Door {
                number: number as u32,
                hinge_m,
                axis: Vec3::Z,
                opens_rad: -side * 1.15,
            };
            joints.push(Joint { name, motion });
        }
    }
    debug_assert!(cuts.is_empty() || joints[SHELL as usize].name == "shell");
    Rig { joints, skeleton: None }
}

/// Builds the mesh; each face names its joint as its object.
pub(super) fn build_mesh(number: usize, blueprint: &Blueprint) -> Mesh {
    let row = &TABLE[number];
    let measure = measure(row, blueprint);
    let mut builder = MeshBuilder::new(blueprint.tag, mesh::Material::CarPaint, 0);
    match &row.1 {
        Car(shape, trim) => {
            let livery = match trim.3 {
                Extra::Roof(rgb) => Livery { upper: Some(rgb), doors: None },
                Extra::Police(rgb) => Livery { upper: None, doors: Some(rgb) },
                _ => Livery::default(),
            };
            let surface = car::body(&mut builder, shape, &measure, livery, number);
            trim::fit(&mut builder, shape, &measure, trim, &surface);
        }
        Build::Heavy(heavy) => heavy::body(&mut builder, heavy, &measure, number),
        Build::Bike(bike) => {
            two_wheels::body(&mut builder, bike, &measure);
            return builder.mesh;
        }
    }
    let mut mesh = fitted(builder.mesh, blueprint);
    for (one, joint) in blueprint.wheels.iter().zip(1..) {
        let mut builder = MeshBuilder::new(blueprint.tag, mesh::Material::Rubber, joint);
        wheel::car_wheel(&mut builder, one, 24, number);
        mesh.append(&builder.mesh);
    }
    mesh
}

/// Scales the mesh slightly, to exactly the length, width and height of the table.
fn fitted(mut mesh: Mesh, blueprint: &Blueprint) -> Mesh {
    let (low, high) = mesh_builder::bounds(&mesh);
    let (half, center) = (blueprint.half_extents_m, blueprint.center_m);
    let scale = vec3(
        half.x * 2.0 / (high.x - low.x),
        half.y * 2.0 / (high.y - low.y),
        half.z * 2.0 / high.z,
    );
    let middle = vec3((low.x + high.x) * 0.5, (low.y + high.y) * 0.5, 0.0);
    for position in &mut mesh.positions {
        let moved = (Vec3::from_array(*position) - middle) * scale;
        *position = (moved + vec3(center.x, center.y, 0.0)).to_array();
    }
    mesh
}

fn four_wheels(size: Vec3, body: f32, wheelbase: f32, radius: f32, drive: Drive) -> Vec<Wheel> {
    let width = (radius * 0.66).clamp(0.17, 0.34);
    let lateral = size.y * body * 0.5 - width * 0.5 - 0.015;
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
        .map(|(ahead, side): (f32, f32)| Wheel {
            position_m: vec3(ahead * wheelbase * 0.5, side * lateral, radius),
            radius_m: radius,
            width_m: width,
            steered: ahead > 0.0,
            driven: drive == All || (drive == Front) == (ahead > 0.0),
        })
        .to_vec()
}

/// The sizes of the table, for the tests.
#[cfg(test)]
pub(super) fn promised() -> Vec<(&'static str, Vec3)> {
    TABLE.iter().map(|row| (row.0, Vec3::from_array(row.2))).collect()
}
