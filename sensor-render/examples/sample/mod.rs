//! Town with cars and camera poses, for tests and measurements.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "a part of several programs, each of which needs other parts of it"
)]

use std::error::Error;
use std::f32::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use glam::{DVec3, Quat, Vec3, vec3};
use protocol::{
    ActorId, ActorState, EffectsSpec, LensSpec, Name, Pose, SensorSpec, exposure, kind, lens_model,
    light, output, sensor,
};
use road::{LanePoint, Network};
use town::{Detail, Kind};

/// Map that benchmark figures refer to, in the folder that OMNIBUS_MAPS names.
const HEAVY: &str = "carla2021-scenic__Town10HD.xodr";

/// Returns the paths of five CARLA towns if the folder OMNIBUS_MAPS has them, else the names of the
/// generated towns.
pub fn towns() -> Vec<String> {
    let in_folder = |folder: std::ffi::OsString| -> Option<Vec<String>> {
        let names = ["2021-scenic__Town01", "2021-scenic__Town02", "2019__Town03"];
        let names = names.into_iter().chain(["2021-scenic__Town06", "2021-scenic__Town10HD"]);
        let paths = names.map(|name| Path::new(&folder).join(format!("carla{name}.xodr")));
        paths.map(|path| path.exists().then(|| path.to_string_lossy().into_owned())).collect()
    };
    std::env::var_os("OMNIBUS_MAPS")
        .and_then(in_folder)
        .unwrap_or_else(|| mapgen::names().map(String::from).collect())
}

/// Furnished town.
pub struct Sample {
    pub name: String,
    pub network: Network,
    pub town: town::Town,
    /// Spawn points, outside of junctions.
    stands: Vec<LanePoint>,
    center: DVec3,
}

impl Sample {
    /// Returns Town10HD if the folder OMNIBUS_MAPS has it, else the largest generated town.
    pub fn heavy() -> Result<Sample, Box<dyn Error>> {
        if let Some(folder) = std::env::var_os("OMNIBUS_MAPS") {
            let path = Path::new(&folder).join(HEAVY);
            if path.exists() {
                let text = std::fs::read_to_string(path)?;
                return Sample::of("Town10HD", &text, Detail::High);
            }
        }
        let text = mapgen::named("Greatmoor").ok_or("there is no Greatmoor")?;
        Sample::of("Greatmoor", &text, Detail::Standard)
    }

    /// Returns the generated town of this name, or the map at this path.
    pub fn named(name: &str) -> Result<Sample, Box<dyn Error>> {
        match mapgen::named(name) {
            Some(text) => Sample::of(name, &text, Detail::Standard),
            None => {
                let text = std::fs::read_to_string(name)?;
                let short = Path::new(name).file_stem().map(|stem| stem.to_string_lossy());
                let short = short.as_deref().and_then(|stem| stem.rsplit("__").next());
                Sample::of(short.unwrap_or(name), &text, Detail::Standard)
            }
        }
    }

    fn of(name: &str, open_drive: &str, detail: Detail) -> Result<Sample, Box<dyn Error>> {
        let network = Network::parse(open_drive)?;
        let town = town::furnish_with(&network, 1, detail);
        let stands = network.spawn_points();
        if stands.is_empty() {
            return Err(format!("{name}: there is no room for a car").into());
        }
        let (low, high) = network.bounds();
        Ok(Sample { name: name.into(), network, town, stands, center: (low + high) * 0.5 })
    }

    /// Returns `count` vehicles of all blueprints on the roads nearest to the centre of the town,
    /// and its traffic lights. Positions depend on `frame`.
    pub fn traffic(&self, count: usize, frame: u64) -> Vec<ActorState> {
        let vehicles: Vec<u32> = (0..)
            .zip(town::catalogue())
            .filter(|(_, blueprint)| blueprint.kind == Kind::Vehicle)
            .map(|(index, _)| index)
            .collect();
        let mut stands: Vec<usize> =
            (0..self.stands.len()).filter(|index| !index.is_multiple_of(3)).collect();
        stands.sort_by(|a, b| {
            let far = |index: &usize| self.place(*index).distance_squared(self.center);
            far(a).total_cmp(&far(b))
        });
        stands.truncate(count * 2);
        let mut taken = vec![false; stands.len()];
        let mut actors = Vec::new();
        for id in 0..count.min(stands.len()) {
            let mut at = (id * 7 + frame as usize * 3) % stands.len();
            while std::mem::replace(&mut taken[at], true) {
                at = (at + 1) % stands.len();
            }
            let stand = stands[at];
            let dice = mixed(id as u64);
            let blueprint = vehicles[dice as usize % vehicles.len()];
            let placement = self.network.place(self.stands[stand]);
            let rotation = placement.rotation().as_quat();
            let speed_mps = 9.0 * (id % 3) as f32;
            actors.push(ActorState {
                actor_id: ActorId(id as u32 + 1),
                blueprint,
                kind: kind::VEHICLE,
                pose: Pose::new(placement.position.as_vec3(), rotation),
                velocity_mps: (rotation * glam::Vec3::X * speed_mps).to_array(),
                brake: if id % 3 == 0 { 0.5 } else { 0.0 },
                lamps: mixed(id as u64 ^ 77) as u32 & protocol::lamp::ALL,
                doors: u32::from(id % 11 == 0),
                wheel_steer_rad: 0.05 * (id % 7) as f32 - 0.15,
                wheel_spin_rad: id as f32,
                color: PAINTS[(dice >> 32) as usize % PAINTS.len()],
                ..Default::default()
            });
        }
        if let Some((blueprint, _)) = town::blueprint("traffic.traffic_light") {
            actors.extend(self.town.heads.iter().zip(10_000..).map(|(head, id)| ActorState {
                actor_id: ActorId(id),
                blueprint,
                kind: kind::TRAFFIC_LIGHT,
                pose: Pose::level(head.position, head.yaw_rad),
                phase: [light::RED, light::GREEN, light::YELLOW][id as usize % 3],
                ..Default::default()
            }));
        }
        actors
    }

    /// Returns the pose of a camera on the roof of a car, looking ahead. Poses are spread over the
    /// centre of the town.
    pub fn street_pose(&self, index: usize) -> Pose {
        let (low, high) = self.network.bounds();
        let reach = (high - low).truncate().max_element() * 0.35;
        let inner: Vec<usize> = (0..self.stands.len())
            .filter(|stand| stand.is_multiple_of(3))
            .filter(|stand| self.place(*stand).distance(self.center) < reach)
            .collect();
        let inner = if inner.is_empty() { vec![0] } else { inner };
        let placement = self.network.place(self.stands[inner[index * 17 % inner.len()]]);
        let turn = placement.rotation().as_quat();
        let ahead = turn * Quat::from_rotation_y(0.03);
        Pose::new(placement.position.as_vec3() + turn * vec3(0.0, 0.0, 1.7), ahead)
    }

    fn place(&self, stand: usize) -> DVec3 {
        self.network.place(self.stands[stand]).position
    }
}

/// Returns the colour of a vehicle, for `World::place`.
pub fn paint(actor: &ActorState) -> [u8; 3] {
    let [red, green, blue, _] = actor.color.to_le_bytes();
    [red, green, blue]
}

/// Colours: red in the lowest byte, then green and blue.
const PAINTS: [u32; 8] =
    [0x1816b0, 0xe4e6e6, 0x1c1816, 0x827c78, 0x823c18, 0x28a0c4, 0x465a3c, 0x142896];

/// Returns a hash of a word.
fn mixed(word: u64) -> u64 {
    mesh::mix64((word + 1).wrapping_mul(mesh::GOLDEN_GAMMA))
}

/// Returns a camera with colour, depth, tag and instance outputs.
pub fn camera(name: &str, width: u32, height: u32) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::CAMERA,
        outputs: output::COLOR | output::DEPTH | output::TAG | output::INSTANCE,
        width,
        height,
        fov_rad: FRAC_PI_2,
        ..Default::default()
    }
}

/// Returns effects by name; of an unknown name none.
pub fn effects(name: &str) -> EffectsSpec {
    let none = EffectsSpec::default();
    let automatic = EffectsSpec { exposure: exposure::AUTOMATIC, ..none };
    match name {
        "automatic" => automatic,
        "manual" => EffectsSpec {
            exposure: exposure::MANUAL,
            iso: 100.0,
            shutter_secs: 0.008,
            f_number: 16.0,
            ..none
        },
        "bloom" => EffectsSpec { bloom: 0.1, ..none },
        "vignette" => EffectsSpec { vignette: 1.0, ..none },
        "noise" => EffectsSpec { white_electrons: 1000.0, read_electrons: 10.0, ..none },
        "fringe" => EffectsSpec { chromatic_aberration: 0.006, ..none },
        "filmic" => {
            EffectsSpec { slope: 0.88, toe: 0.55, shoulder: 0.26, white_clip: 0.04, ..none }
        }
        "cold" => EffectsSpec { temperature_k: 4000.0, ..none },
        "rolling" => EffectsSpec { readout_secs: 0.03, ..none },
        "blur" => EffectsSpec { blur_secs: 0.015, ..none },
        "focus" => EffectsSpec { aperture_m: 0.05, focus_m: 8.0, ..none },
        "camera" => EffectsSpec {
            bloom: 0.06,
            vignette: 0.6,
            white_electrons: 8000.0,
            read_electrons: 6.0,
            chromatic_aberration: 0.001,
            ..automatic
        },
        _ => none,
    }
}

/// Returns a lens by its name: `brown-conrady`, a barrel distortion, or `fisheye`, 190 degrees wide; a
/// pinhole for others.
pub fn lens(name: &str) -> LensSpec {
    let (model, coefficients) = match name {
        "brown-conrady" => (lens_model::BROWN_CONRADY, [-0.29, 0.11, 0.0008, -0.0006, -0.02]),
        "fisheye" => (lens_model::FISHEYE, [0.03, -0.008, 0.002, -0.0003, 0.0]),
        _ => (lens_model::PINHOLE, [0.0; 5]),
    };
    LensSpec { model, coefficients, ..LensSpec::default() }
}

/// Returns six cameras that together cover a full turn.
pub fn ring(width: u32, height: u32) -> Vec<SensorSpec> {
    (0..6)
        .map(|side| SensorSpec {
            fov_rad: 1.22,
            parent_from_sensor: Pose::level(Vec3::ZERO, side as f32 * TAU / 6.0),
            ..camera(&format!("ring{side}"), width, height)
        })
        .collect()
}

/// Returns a lidar that measures a full turn at one instant.
pub fn lidar(name: &str, columns: u32, channels: u32) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::LIDAR,
        outputs: output::POINTS | output::LABELS,
        width: columns,
        height: channels,
        fov_rad: TAU,
        upper_rad: 10f32.to_radians(),
        lower_rad: (-30f32).to_radians(),
        range_m: 100.0,
        attenuation_per_m: 0.004,
        ..Default::default()
    }
}
