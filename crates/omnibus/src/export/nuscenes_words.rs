//! The vocabulary of nuScenes: categories, attributes, visibility, channels, tokens.

use serde_json::{Value, json};

use crate::{
    collect::format::{ActorBox, Camera, Sensor},
    export::class::{Class, class, is_static},
};

const CATEGORIES: [&str; 12] = [
    "human.pedestrian.adult",
    "human.pedestrian.child",
    "vehicle.car",
    "vehicle.truck",
    "vehicle.bus.rigid",
    "vehicle.motorcycle",
    "vehicle.bicycle",
    "vehicle.emergency.ambulance",
    "vehicle.emergency.police",
    "movable_object.trafficcone",
    "movable_object.barrier",
    "static_object.bicycle_rack",
];

const ATTRIBUTES: [&str; 7] = [
    "vehicle.moving",
    "vehicle.stopped",
    "vehicle.parked",
    "cycle.with_rider",
    "cycle.without_rider",
    "pedestrian.moving",
    "pedestrian.standing",
];

/// The lower bounds of visibility 2, 3 and 4.
const VISIBLE_FRACTIONS: [f64; 3] = [0.4, 0.6, 0.8];

/// Children are smaller than this.
const ADULT_FROM_M: f32 = 1.45;
/// What is slower stands.
const MOVING_FROM_MPS: f32 = 0.2;

/// Returns a token: 128 bits of a hash of the words that identify a row, so that the same data have
/// the same tokens.
pub(crate) fn token(words: &[&str]) -> String {
    // FNV-1a with 64 bits, twice with different beginnings.
    let hash = |begin: u64| {
        let bytes = words.iter().flat_map(|word| word.bytes().chain([0]));
        bytes.fold(begin, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    };
    // The low bits alone would mix little: FNV ends with a product.
    let mixed = |hash: u64| (hash ^ hash >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let [first, second] =
        [0xcbf2_9ce4_8422_2325, 0x6c62_272e_07bb_0142].map(|begin| mixed(hash(begin)));
    format!("{first:016x}{second:016x}")
}

/// Returns the rows of `category`.
pub(crate) fn categories() -> Vec<Value> {
    named("category", &CATEGORIES)
}

/// Returns the rows of `attribute`.
pub(crate) fn attributes() -> Vec<Value> {
    named("attribute", &ATTRIBUTES)
}

fn named(table: &str, names: &[&str]) -> Vec<Value> {
    let row =
        |name: &&str| json!({ "token": token(&[table, name]), "name": name, "description": "" });
    names.iter().map(row).collect()
}

/// Returns the rows of `visibility`, whose tokens are numbers.
pub(crate) fn visibilities() -> Vec<Value> {
    let levels = [("1", "v0-40"), ("2", "v40-60"), ("3", "v60-80"), ("4", "v80-100")];
    let row = |(token, level): (&str, &str)| {
        let description = format!("visibility of whole object is {}%", &level[1..]);
        json!({ "token": token, "level": level, "description": description })
    };
    levels.map(row).to_vec()
}

/// Returns the token of the visible fraction of an object in all images that show it.
pub(crate) fn visibility(actor: &ActorBox) -> &'static str {
    let sum = |pixels: fn(&crate::collect::format::View) -> u32| {
        actor.cameras.values().map(|view| f64::from(pixels(view))).sum::<f64>()
    };
    let (visible, whole) = (sum(|v| v.visible_px), sum(|v| v.unoccluded_px));
    let fraction = if whole > 0.0 { visible / whole } else { 0.0 };
    let level = VISIBLE_FRACTIONS.iter().filter(|from| fraction >= **from).count();
    ["1", "2", "3", "4"][level]
}

/// Returns the category of an object; none for what nuScenes does not name.
pub(crate) fn category(actor: &ActorBox) -> Option<&'static str> {
    Some(match class(actor)? {
        Class::Pedestrian if actor.size_m[2] < ADULT_FROM_M => "human.pedestrian.child",
        Class::Pedestrian => "human.pedestrian.adult",
        _ if actor.blueprint.contains("ambulance") => "vehicle.emergency.ambulance",
        _ if actor.blueprint.contains("police") => "vehicle.emergency.police",
        Class::Car | Class::Van => "vehicle.car",
        Class::Truck => "vehicle.truck",
        Class::Bus => "vehicle.bus.rigid",
        Class::Motorcycle => "vehicle.motorcycle",
        Class::Bicycle => "vehicle.bicycle",
        Class::Cone => "movable_object.trafficcone",
        Class::Barrier => "movable_object.barrier",
        Class::Train | Class::TrafficLight | Class::StopSign => return None,
    })
}

/// Returns the attribute of an object; none for things that do not move.
pub(crate) fn attribute(actor: &ActorBox) -> Option<&'static str> {
    let [x, y, z] = actor.velocity_mps;
    let is_moving = (x * x + y * y + z * z).sqrt() >= MOVING_FROM_MPS;
    match class(actor)? {
        Class::Pedestrian if is_moving => Some("pedestrian.moving"),
        Class::Pedestrian => Some("pedestrian.standing"),
        Class::Motorcycle | Class::Bicycle if is_static(actor) => Some("cycle.without_rider"),
        Class::Motorcycle | Class::Bicycle => Some("cycle.with_rider"),
        Class::Car | Class::Van | Class::Truck | Class::Bus if is_static(actor) => {
            Some("vehicle.parked")
        }
        Class::Car | Class::Van | Class::Truck | Class::Bus if is_moving => Some("vehicle.moving"),
        Class::Car | Class::Van | Class::Truck | Class::Bus => Some("vehicle.stopped"),
        _ => None,
    }
}

/// The directions of nuScenes' cameras, counter-clockwise from ahead, in degrees.
const CAMERAS: [(&str, f64); 6] = [
    ("CAM_FRONT", 0.0),
    ("CAM_FRONT_LEFT", 55.0),
    ("CAM_FRONT_RIGHT", -55.0),
    ("CAM_BACK_LEFT", 110.0),
    ("CAM_BACK_RIGHT", -110.0),
    ("CAM_BACK", 180.0),
];
/// How far a direction may be from that of its name.
const TOLERANCE_DEG: f64 = 36.0;

/// Returns the channel of a camera: that of nuScenes with about its direction, or its own name.
pub(crate) fn camera_channel(sensor: &Sensor, camera: &Camera) -> String {
    let [x, y, z] = [0, 1, 2].map(|row| camera.vehicle_from_optical[row][2]);
    let away = |degrees: f64| {
        let turned = (y.atan2(x).to_degrees() - degrees).rem_euclid(360.0);
        turned.min(360.0 - turned)
    };
    let nearest = CAMERAS.iter().min_by(|a, b| away(a.1).total_cmp(&away(b.1)));
    match nearest {
        Some((name, degrees)) if away(*degrees) <= TOLERANCE_DEG && z.abs() < 0.7 => {
            (*name).to_owned()
        }
        _ => own_channel("CAM", sensor),
    }
}

/// Returns `CAM_ROOF` for the sensor `roof`.
pub(crate) fn own_channel(prefix: &str, sensor: &Sensor) -> String {
    let name = sensor.name.to_ascii_uppercase().replace([' ', '-'], "_");
    if name.starts_with(&format!("{prefix}_")) { name } else { format!("{prefix}_{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_are_named_by_their_direction() {
        let mut sensor = crate::collect::testing::settings().sensors[0].clone();
        let mut named = |degrees: f64, down: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let camera = sensor.camera.as_mut().unwrap();
            for (row, value) in [cos, sin, -down].into_iter().enumerate() {
                camera.vehicle_from_optical[row][2] = value;
            }
            camera_channel(&sensor, sensor.camera.as_ref().unwrap())
        };
        assert_eq!(named(0.0, 0.0), "CAM_FRONT");
        assert_eq!(named(50.0, 0.1), "CAM_FRONT_LEFT");
        assert_eq!(named(-60.0, 0.1), "CAM_FRONT_RIGHT");
        assert_eq!(named(-120.0, 0.0), "CAM_BACK_RIGHT");
        assert_eq!(named(-179.0, 0.0), "CAM_BACK");
        assert_eq!(named(0.0, 0.9), own_channel("CAM", &sensor), "it looks down");
    }

    #[test]
    fn tokens_differ_and_have_32_digits() {
        assert_eq!(token(&["a"]).len(), 32);
        assert_ne!(token(&["a", "b"]), token(&["ab"]));
        assert_ne!(token(&["sample", "s", "1"]), token(&["sample", "s", "2"]));
    }
}
