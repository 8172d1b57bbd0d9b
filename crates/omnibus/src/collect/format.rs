//! The data-set format: `metadata.json`, `frames.jsonl` and `boxes/`.
//!
//! Names carry units. Quaternions are x, y, z, w; matrices are lists of rows.

use std::collections::BTreeMap;

use client_lib::KEYPOINT_COUNT;
use glam::{Affine3A, Mat4};
use protocol::{ActorState, LensSpec, Pose, flag, lens_model, tracer};
use serde::{Deserialize, Serialize};

use crate::collect::{
    ego_sensors::EgoSensors, events::Event, image_storage::ImageStorage,
    label_settings::LabelSettings, rle::Rle,
};

/// The version of the format.
pub(crate) const FORMAT: &str = "omnibus-dataset-3";

/// `metadata.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Metadata {
    /// [`FORMAT`].
    pub(crate) format: String,
    /// The version of the program that wrote the data set.
    pub(crate) omnibus_version: String,
    /// Whether all requested frames are complete.
    pub(crate) complete: bool,
    /// The number of requested frames.
    pub(crate) frames_requested: u64,
    /// The number of complete frames when this was written.
    pub(crate) frames_complete: u64,
    /// What traced the rays; more than one if the tracer changed during the run.
    pub(crate) tracers: Vec<String>,
    /// Everything that decides what the frames show.
    pub(crate) settings: DataSetSettings,
    /// The actors at the start.
    pub(crate) spawned_actors: SpawnedActors,
    /// The contents of each folder.
    pub(crate) outputs: Vec<Output>,
    /// How to read the numbers.
    pub(crate) conventions: BTreeMap<String, String>,
    /// Codes of the semantic tags.
    pub(crate) tags: BTreeMap<u8, String>,
    /// CRC-32 of every file that belongs to no frame, except this one; empty until all requested
    /// frames are complete.
    pub(crate) files_crc32: BTreeMap<String, u32>,
}

impl Metadata {
    /// Returns the extension of the files in a folder; a folder that is not listed has none.
    pub(crate) fn extension(&self, folder: &str) -> &str {
        let output = self.outputs.iter().find(|output| output.folder == folder);
        output.map_or("", |output| &output.extension)
    }
}

/// Everything that decides what the frames show: the same settings and build give the same data
/// set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DataSetSettings {
    /// The name of the map.
    pub(crate) map: String,
    /// FNV-1a of the OpenDRIVE text in `map.xodr`.
    pub(crate) map_fnv1a64: String,
    /// The seed of the scenery.
    pub(crate) seed: u64,
    /// Simulated time per frame.
    pub(crate) fixed_delta_nanos: u64,
    /// Frames simulated before the first that is kept.
    pub(crate) warmup_frames: u64,
    /// Sensors without a rate of their own measure in one of this many frames.
    pub(crate) every_frames: u64,
    /// The index of the scene in its plan.
    pub(crate) scene: u64,
    /// The seed of traffic, spawn points and paint in this scene.
    pub(crate) scene_seed: u64,
    /// Vehicles requested in addition to the ego.
    pub(crate) vehicles_requested: u32,
    /// Of these, vehicles near the ego at the start.
    pub(crate) vehicles_near: u32,
    /// By how much drivers differ; absent: 1, as in the field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) driver_spread: Option<f32>,
    /// The radius of hybrid physics; absent: physics is full everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) hybrid_radius_m: Option<f32>,
    /// FNV-1a of the route file whose vehicles depart; absent: none do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) routes_fnv1a64: Option<String>,
    /// The time of the route file at which the scene begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) routes_begin_secs: Option<f64>,
    /// Instead: vehicles per kilometre of driving lane near the ego.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) vehicles_per_km: Option<f32>,
    /// Instead: pedestrians per kilometre of sidewalk near the ego.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) walkers_per_km: Option<f32>,
    /// Pedestrians requested on the sidewalks around the ego.
    pub(crate) walkers_requested: u32,
    /// What is near the ego; half of it for pedestrians.
    pub(crate) traffic_radius_m: f32,
    /// Road users of at least 25 pixels of height below which more vehicles come near.
    pub(crate) in_view: f32,
    /// The weather at the start; absent: the default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) weather: Option<WeatherSettings>,
    /// Altitudes of the sun, each for an equal part of the frames; empty: the default weather holds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) sun_altitudes_deg: Vec<f32>,
    /// What happens during the scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) events: Vec<Event>,
    /// The blueprint of the ego.
    pub(crate) ego_blueprint: String,
    /// Places that the ego drives over; empty: turns at random.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) ego_route: Vec<[f32; 2]>,
    /// How the images are stored.
    #[serde(default)]
    pub(crate) images: ImageStorage,
    /// Labels besides boxes.
    #[serde(default = "LabelSettings::boxes_alone")]
    pub(crate) labels: LabelSettings,
    /// The sensors on the ego.
    pub(crate) sensors: Vec<Sensor>,
}

/// A weather. Percentages have the meaning that CARLA gives them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WeatherSettings {
    pub(crate) cloudiness: f32,
    pub(crate) precipitation: f32,
    pub(crate) precipitation_deposits: f32,
    pub(crate) wind_intensity: f32,
    pub(crate) sun_azimuth_rad: f32,
    pub(crate) sun_altitude_rad: f32,
    pub(crate) fog_density: f32,
    pub(crate) fog_distance_m: f32,
    pub(crate) wetness: f32,
}

impl From<protocol::Weather> for WeatherSettings {
    fn from(weather: protocol::Weather) -> WeatherSettings {
        WeatherSettings {
            cloudiness: weather.cloudiness,
            precipitation: weather.precipitation,
            precipitation_deposits: weather.precipitation_deposits,
            wind_intensity: weather.wind_intensity,
            sun_azimuth_rad: weather.sun_azimuth_rad,
            sun_altitude_rad: weather.sun_altitude_rad,
            fog_density: weather.fog_density,
            fog_distance_m: weather.fog_distance_m,
            wetness: weather.wetness,
        }
    }
}

/// One sensor on the ego.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sensor {
    pub(crate) name: String,
    /// `camera`, `lidar`, `radar`, `imu`, `gnss`, `odometry`, `collision` or `lane_invasion`. The readings of
    /// the last five are in `frames.jsonl` under `ego_sensors`.
    pub(crate) kind: String,
    /// From sensor space (x forward, y left, z up) to vehicle space.
    pub(crate) vehicle_from_sensor: Matrix4,
    /// Simulated time from one measurement to the next: a sensor measures in the frames within which this
    /// time has elapsed once more. Absent: every frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) period_nanos: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) camera: Option<Camera>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lidar: Option<Lidar>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) radar: Option<Radar>,
}

/// A 4 × 4 matrix by rows.
pub(crate) type Matrix4 = [[f64; 4]; 4];

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Camera {
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    pub(crate) horizontal_fov_rad: f64,
    /// `pixel = intrinsics * point_in_optical / depth`; with a lens, of the distorted point.
    pub(crate) intrinsics_px: [[f64; 3]; 3],
    /// Absent: a pinhole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) lens: Option<Lens>,
    /// From optical space (x right, y down, z forward) to vehicle space.
    pub(crate) vehicle_from_optical: Matrix4,
}

/// The distortion of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Lens {
    pub(crate) model: LensName,
    /// In OpenCV's order: k1, k2, p1, p2, k3, or k1 to k4.
    pub(crate) coefficients: Vec<f64>,
    /// Largest angle between a ray and the optical axis; the image is black beyond. Absent: as far as the
    /// formula holds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) max_angle_rad: Option<f64>,
}

/// The models of distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LensName {
    BrownConrady,
    Fisheye,
}

impl Lens {
    /// Returns the distortion of a camera; `None` for a pinhole.
    pub(crate) fn of(lens: &LensSpec) -> Option<Lens> {
        let (model, count) = match lens.model {
            lens_model::BROWN_CONRADY => (LensName::BrownConrady, 5),
            lens_model::FISHEYE => (LensName::Fisheye, 4),
            _ => return None,
        };
        let coefficients = lens.coefficients[..count].iter().copied().map(shortest_decimal);
        let max_angle_rad =
            (lens.max_angle_rad > 0.0).then(|| shortest_decimal(lens.max_angle_rad));
        Some(Lens { model, coefficients: coefficients.collect(), max_angle_rad })
    }
}

/// A lidar; without the optional fields it measures its whole turn at one instant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Lidar {
    pub(crate) channels: u32,
    pub(crate) columns: u32,
    pub(crate) upper_elevation_rad: f64,
    pub(crate) lower_elevation_rad: f64,
    pub(crate) range_m: f64,
    pub(crate) attenuation_per_m: f64,
    /// Of each channel, the highest first; empty: spaced equally.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) elevations_rad: Vec<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) prism_hz: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) rotation_rate_hz: Option<f64>,
    /// Whether points are in the space of the sensor at the time of their column.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) sweep: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) divergence_rad: Option<f64>,
    /// Whether fog, rain and spray have returns, which have the id 0 and the tag 22.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) weather: bool,
}

/// A radar that looks in random directions of an elliptic cone, more of them in its middle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Radar {
    pub(crate) horizontal_fov_rad: f64,
    pub(crate) vertical_fov_rad: f64,
    pub(crate) range_m: f64,
    /// Directions of one measurement; those that meet something give a detection.
    pub(crate) points: u64,
    /// With a receiver, the cells that it detects are the detections, and `points` has no effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) receiver: Option<Receiver>,
}

/// The receiver of a radar.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Receiver {
    pub(crate) frequency_hz: f64,
    pub(crate) transmit_power_dbm: f64,
    pub(crate) antenna_gain_db: f64,
    pub(crate) noise_dbm: f64,
    pub(crate) snr_min_db: f64,
    /// Size of a cell: metres, radians, metres per second.
    pub(crate) cell: [f64; 3],
    pub(crate) has_ghosts: bool,
}

/// The actors at the start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SpawnedActors {
    pub(crate) ego_actor_id: u32,
    /// Vehicles on the map, without the ego.
    pub(crate) vehicles_spawned: u32,
    /// Spawn points where the host refused a vehicle.
    pub(crate) spawns_refused: u32,
}

/// The contents of the files of one folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Output {
    /// As in `front/color`.
    pub(crate) folder: String,
    pub(crate) extension: String,
    pub(crate) description: String,
}

/// A line of `frames.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FrameLine {
    pub(crate) frame: u64,
    /// Simulated time since the world began.
    pub(crate) sim_time_nanos: u64,
    /// Hash of everything that decides the future, in hexadecimal.
    pub(crate) state_hash: String,
    pub(crate) tracer: String,
    pub(crate) ego: Ego,
    pub(crate) weather: WeatherSettings,
    /// The sensors that measured in this frame.
    pub(crate) sensors: Vec<SensorPose>,
    /// The number of entries in `boxes/`: actors and objects.
    pub(crate) box_count: u64,
    /// The number of returns or detections in the files of each lidar and radar.
    pub(crate) point_counts: BTreeMap<String, u64>,
    /// Readings of the physics sensors, at each frame since the frame before that was kept.
    #[serde(default)]
    pub(crate) ego_sensors: Vec<EgoSensors>,
    /// CRC-32 of the files of the frame, by folder.
    pub(crate) files_crc32: BTreeMap<String, u32>,
}

impl FrameLine {
    /// Returns whether a sensor measured in this frame.
    pub(crate) fn measures(&self, sensor: &str) -> bool {
        self.sensors.iter().any(|pose| pose.name == sensor)
    }

    /// Returns whether the frame has a file in a folder of the data set, such as `front/color`.
    pub(crate) fn has_file(&self, folder: &str) -> bool {
        folder.split_once('/').is_none_or(|(sensor, _)| self.measures(sensor))
    }
}

/// A rigid transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Transform {
    pub(crate) position_m: [f32; 3],
    pub(crate) rotation_xyzw: [f32; 4],
}

impl From<&Pose> for Transform {
    fn from(pose: &Pose) -> Transform {
        Transform { position_m: pose.position_m, rotation_xyzw: pose.rotation }
    }
}

/// The state of the ego.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ego {
    pub(crate) actor_id: u32,
    pub(crate) world_from_vehicle: Transform,
    pub(crate) velocity_mps: [f32; 3],
    pub(crate) angular_velocity_radps: [f32; 3],
    pub(crate) acceleration_mps2: [f32; 3],
    pub(crate) control: Control,
}

/// Pedals, steering and gear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Control {
    /// 0 to 1.
    pub(crate) throttle: f32,
    /// 0 to 1.
    pub(crate) brake: f32,
    /// −1 (full right) to 1 (full left).
    pub(crate) steer: f32,
    pub(crate) gear: i32,
    pub(crate) handbrake: bool,
    pub(crate) reverse: bool,
}

impl From<&ActorState> for Ego {
    fn from(actor: &ActorState) -> Ego {
        Ego {
            actor_id: actor.actor_id.0,
            world_from_vehicle: (&actor.pose).into(),
            velocity_mps: actor.velocity_mps,
            angular_velocity_radps: actor.angular_velocity_radps,
            acceleration_mps2: actor.acceleration_mps2,
            control: Control {
                throttle: actor.throttle,
                brake: actor.brake,
                steer: actor.steer,
                gear: actor.gear,
                handbrake: actor.has(flag::HANDBRAKE),
                reverse: actor.has(flag::REVERSE),
            },
        }
    }
}

/// The pose of a sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SensorPose {
    pub(crate) name: String,
    pub(crate) world_from_sensor: Transform,
}

/// A file of `boxes/`: everything with a class and an extent of its own that a sensor saw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Boxes {
    pub(crate) frame: u64,
    /// Every actor except the ego.
    pub(crate) actors: Vec<ActorBox>,
    /// Every static object of the town: parked vehicles, poles, signs, plants, props.
    pub(crate) objects: Vec<ObjectBox>,
}

impl Boxes {
    /// Returns the number of boxes.
    pub(crate) fn count(&self) -> u64 {
        (self.actors.len() + self.objects.len()) as u64
    }
}

/// One actor and its boxes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ActorBox {
    pub(crate) actor_id: u32,
    pub(crate) blueprint: String,
    pub(crate) tag: u8,
    pub(crate) tag_name: String,
    /// Length, width, height.
    pub(crate) size_m: [f32; 3],
    /// The centre of the box; its x axis is the actor's forward.
    pub(crate) world_from_box: Transform,
    pub(crate) velocity_mps: [f32; 3],
    /// What a traffic light shows: `red`, `yellow`, `green` or `off`. Absent for other actors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) traffic_light_state: Option<String>,
    /// The number of returns on the actor, for each lidar that hit it.
    pub(crate) lidar_points: BTreeMap<String, u32>,
    /// The number of detections of the actor, for each radar that has any.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) radar_points: BTreeMap<String, u32>,
    /// The keypoints of a walker in COCO's order. Absent for other actors, and if not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) keypoints_in_world_m: Option<[[f32; 3]; KEYPOINT_COUNT]>,
    /// The actor in the image of each camera that saw it.
    pub(crate) cameras: BTreeMap<String, View>,
}

/// One static object and its boxes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ObjectBox {
    /// As in instance images and labels.
    pub(crate) object_id: u32,
    /// The layer of the town that hides it.
    pub(crate) layer: String,
    /// Of a parked vehicle. Absent for other objects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) blueprint: Option<String>,
    pub(crate) tag: u8,
    pub(crate) tag_name: String,
    /// Length, width, height.
    pub(crate) size_m: [f32; 3],
    /// The centre of the box; its x axis is the object's own.
    pub(crate) world_from_box: Transform,
    /// The number of returns on the object, for each lidar that hit it.
    pub(crate) lidar_points: BTreeMap<String, u32>,
    /// The number of detections of the object, for each radar that has any.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) radar_points: BTreeMap<String, u32>,
    /// The object in the image of each camera that saw it.
    pub(crate) cameras: BTreeMap<String, View>,
}

/// An actor or object in one camera's image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct View {
    /// The box in optical space.
    pub(crate) optical_from_box: Transform,
    /// Left, top, right, bottom edge of its visible pixels; right and bottom are exclusive.
    pub(crate) visible_box_px: [u32; 4],
    /// Left, top, right, bottom edge of the projected box, clipped to the image.
    pub(crate) projected_box_px: [f32; 4],
    /// Pixels that show it.
    pub(crate) visible_px: u32,
    /// Pixels that would show it if nothing occluded it.
    pub(crate) unoccluded_px: u32,
    /// `1 − visible_px / unoccluded_px`, not below 0.
    pub(crate) occluded_fraction: f32,
    /// Fraction of the projected box that lies outside the image.
    pub(crate) truncated_fraction: f32,
    /// The keypoints of a walker. Absent for other things, and if not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) keypoints: Option<ViewKeypoints>,
    /// The pixels that `unoccluded_px` counts. Absent if not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) amodal_mask: Option<Rle>,
}

/// The keypoints of a walker in one camera's image, in COCO's order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ViewKeypoints {
    /// In optical space.
    pub(crate) in_optical_m: [[f32; 3]; KEYPOINT_COUNT],
    /// Column and row; zeros outside of the image.
    pub(crate) px: [[f32; 2]; KEYPOINT_COUNT],
    /// COCO's numbers: 0 outside of the image, 1 occluded, 2 visible.
    pub(crate) visibility: [u8; KEYPOINT_COUNT],
}

/// Returns the rows of a transform.
pub(crate) fn matrix4(transform: &Affine3A) -> Matrix4 {
    let rows = Mat4::from(*transform).transpose().to_cols_array_2d();
    rows.map(|row| row.map(shortest_decimal))
}

/// Returns the number with the shortest decimal text of the same f32.
pub(crate) fn shortest_decimal(value: f32) -> f64 {
    let text = (value + 0.0).to_string();
    text.parse().expect("a number's own text")
}

/// Returns a state hash as written in files.
pub(crate) fn hash_text(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Returns the name of a tracer.
pub(crate) fn tracer_name(code: u32) -> &'static str {
    match code {
        tracer::NULL => "null",
        tracer::CPU => "cpu",
        tracer::GPU => "gpu",
        _ => "unknown",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    #[test]
    fn a_matrix_is_written_by_rows() {
        let quarter = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let matrix =
            matrix4(&Affine3A::from_rotation_translation(quarter, Vec3::new(1.5, 0.0, 2.4)));
        let [x, y, ..] = matrix;
        assert!((x[1] + 1.0).abs() < 1e-6 && (y[0] - 1.0).abs() < 1e-6, "{matrix:?}");
        assert_eq!([x[3], y[3], matrix[2][3]], [1.5, 0.0, 2.4]);
        assert_eq!(matrix[3], [0.0, 0.0, 0.0, 1.0]);
    }
}
