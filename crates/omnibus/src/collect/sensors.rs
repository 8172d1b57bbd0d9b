//! The default sensors: a camera with all outputs, and a lidar on the roof.

use std::f32::consts::FRAC_PI_2;

use client_lib::{Radar, RadarReceiver};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use protocol::{Pose, SensorSpec, lidar_flag, output, sensor};

use crate::collect::{
    camera_model::CameraModel,
    format::{self, Camera, Lens, Lidar, Output, Sensor, matrix4, shortest_decimal},
    image_storage::ImageFormat,
};

/// The outputs of cameras that have files.
pub(crate) const CAMERA_OUTPUTS: u32 =
    output::COLOR | output::DEPTH | output::TAG | output::INSTANCE;

/// Returns the default sensors on a car.
pub(crate) fn default_sensors(width_px: u32, height_px: u32) -> Vec<SensorSpec> {
    // Above the windscreen: with a vertical field of view of 74 degrees the bonnet is just out of
    // view.
    let windscreen = Pose::new(Vec3::new(1.5, 0.0, 2.0), glam::Quat::IDENTITY);
    // High enough that the lowest channel clears the roof's edge.
    let roof = Pose::new(Vec3::new(0.0, 0.0, 2.4), glam::Quat::IDENTITY);
    let degrees = |deg: f32| deg.to_radians();
    vec![
        client_lib::wire::camera(
            "front",
            windscreen,
            width_px,
            height_px,
            FRAC_PI_2,
            CAMERA_OUTPUTS,
        ),
        client_lib::wire::lidar("lidar", roof, 32, 1800, [degrees(-30.0), degrees(10.0)], 100.0),
    ]
}

/// A sensor on the ego: what the renderer measures, and what is made of that.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlannedSensor {
    pub(crate) spec: SensorSpec,
    /// What a radar detects with its rays; `None` for other sensors.
    pub(crate) radar: Option<Radar>,
    /// The receiver of a radar with powers.
    pub(crate) receiver: Option<RadarReceiver>,
}

impl From<SensorSpec> for PlannedSensor {
    fn from(spec: SensorSpec) -> PlannedSensor {
        PlannedSensor { spec, radar: None, receiver: None }
    }
}

/// Returns the transform from optical axes to sensor axes.
pub(crate) fn sensor_from_optical() -> Affine3A {
    Affine3A::from_mat3(Mat3A::from_cols(Vec3A::NEG_Y, Vec3A::NEG_Z, Vec3A::X).into())
}

/// Returns a sensor's entry in `metadata.json`.
pub(crate) fn describe(sensor: &PlannedSensor) -> Sensor {
    let PlannedSensor { spec, radar, receiver } = sensor;
    let vehicle_from_sensor = spec.parent_from_sensor.affine();
    let is_camera = spec.kind == sensor::CAMERA;
    let camera = is_camera.then(|| {
        let model = CameraModel::of(spec);
        let lens = &spec.lens;
        // A field of view of 90 degrees gives a round number, not 400.0000349.
        let px = |exact: f64, given: f32| {
            if lens.has_intrinsics() {
                shortest_decimal(given)
            } else {
                (exact * 1e4).round() / 1e4
            }
        };
        let [[fx, fy], [cx, cy]] = [model.projection.focal_px(), model.projection.center_px()];
        let [fx, fy] = [px(fx, lens.focal_px[0]), px(fy, lens.focal_px[1])];
        let [cx, cy] = [px(cx, lens.center_px[0]), px(cy, lens.center_px[1])];
        let horizontal_fov_rad = if lens.has_intrinsics() {
            shortest_decimal(model.horizontal_fov_rad() as f32)
        } else {
            shortest_decimal(spec.fov_rad)
        };
        Camera {
            width_px: spec.width,
            height_px: spec.height,
            horizontal_fov_rad,
            intrinsics_px: [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]],
            lens: Lens::of(lens),
            vehicle_from_optical: matrix4(&(vehicle_from_sensor * sensor_from_optical())),
        }
    });
    let is_lidar = spec.kind == sensor::LIDAR && radar.is_none();
    let radar = radar.map(|radar| {
        let [horizontal_fov_rad, vertical_fov_rad] = radar.fov_rad.map(shortest_decimal);
        format::Radar {
            horizontal_fov_rad,
            vertical_fov_rad,
            range_m: shortest_decimal(radar.range_m),
            points: radar.points as u64,
            receiver: receiver.map(|receiver| {
                let RadarReceiver { frequency_hz, transmit_power_dbm, antenna_gain_db, .. } =
                    receiver;
                format::Receiver {
                    frequency_hz: shortest_decimal(frequency_hz),
                    transmit_power_dbm: shortest_decimal(transmit_power_dbm),
                    antenna_gain_db: shortest_decimal(antenna_gain_db),
                    noise_dbm: shortest_decimal(receiver.noise_dbm),
                    snr_min_db: shortest_decimal(receiver.snr_min_db),
                    cell: receiver.cell.map(shortest_decimal),
                    has_ghosts: receiver.has_ghosts,
                }
            }),
        }
    });
    let lidar = is_lidar.then(|| Lidar {
        channels: spec.height,
        columns: spec.width,
        upper_elevation_rad: shortest_decimal(spec.upper_rad),
        lower_elevation_rad: shortest_decimal(spec.lower_rad),
        range_m: shortest_decimal(spec.range_m),
        attenuation_per_m: shortest_decimal(spec.attenuation_per_m),
        elevations_rad: elevations_rad(spec),
        prism_hz: spec.lidar.has_prisms().then(|| spec.lidar.prism_hz.map(shortest_decimal)),
        rotation_rate_hz: Some(spec.rotation_rate_hz).filter(|hz| *hz > 0.0).map(shortest_decimal),
        sweep: spec.lidar.has(lidar_flag::SWEEP),
        divergence_rad: Some(spec.lidar.divergence_rad)
            .filter(|rad| *rad > 0.0)
            .map(shortest_decimal),
        weather: spec.lidar.has(lidar_flag::WEATHER),
    });
    Sensor {
        name: spec.name.to_string(),
        kind: if radar.is_some() { "radar" } else { kind_name(spec.kind) }.to_owned(),
        vehicle_from_sensor: matrix4(&vehicle_from_sensor),
        period_nanos: Some(spec.period_nanos).filter(|nanos| *nanos > 0),
        camera,
        lidar,
        radar,
    }
}

/// Returns the elevations of the channels of a lidar that has a table of them.
fn elevations_rad(spec: &SensorSpec) -> Vec<f64> {
    let channels = if spec.lidar.has(lidar_flag::ELEVATIONS) { spec.height } else { 0 };
    (0..channels)
        .map(|channel| shortest_decimal(spec.lidar.elevation_rad(channel) as f32))
        .collect()
}

/// Returns the word for a kind of sensor in `metadata.json`.
fn kind_name(kind: u32) -> &'static str {
    match kind {
        sensor::CAMERA => "camera",
        sensor::LIDAR => "lidar",
        sensor::IMU => "imu",
        sensor::GNSS => "gnss",
        sensor::ODOMETRY => "odometry",
        sensor::COLLISION => "collision",
        sensor::LANE_INVASION => "lane_invasion",
        _ => "other",
    }
}

/// One thing to write for every frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Task {
    /// An image of one output of one camera.
    Image { sensor: usize, output: u32, folder: String },
    /// The returns of one lidar or the detections of one radar, with the id and tag of each.
    Points {
        sensor: usize,
        points: String,
        labels: String,
        /// Of the powers of a radar with a receiver.
        powers: Option<String>,
    },
    /// The boxes of what the sensors saw.
    Boxes,
    /// The lane lines in the images.
    Lanes,
}

/// The folder of the boxes.
pub(crate) const BOXES: &str = "boxes";

/// The folder of the lane lines.
pub(crate) const LANES: &str = "lanes";

/// Returns everything to write for every frame, the slowest first.
pub(crate) fn tasks(sensors: &[PlannedSensor]) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (index, PlannedSensor { spec, radar, receiver }) in sensors.iter().enumerate() {
        if spec.kind == sensor::LIDAR {
            let what = if radar.is_some() { "detections" } else { "points" };
            let points = format!("{}/{what}", spec.name);
            tasks.push(Task::Points {
                sensor: index,
                points,
                labels: format!("{}/labels", spec.name),
                powers: receiver.map(|_| format!("{}/powers", spec.name)),
            });
            continue;
        }
        for (output, name) in IMAGES {
            if spec.outputs & output != 0 {
                let folder = format!("{}/{name}", spec.name);
                tasks.push(Task::Image { sensor: index, output, folder });
            }
        }
    }
    tasks.push(Task::Boxes);
    tasks.push(Task::Lanes);
    tasks
}

const IMAGES: [(u32, &str); 4] = [
    (output::COLOR, "color"),
    (output::DEPTH, "depth"),
    (output::INSTANCE, "instance"),
    (output::TAG, "tag"),
];

/// Returns the contents of each folder of the data set.
pub(crate) fn outputs(sensors: &[PlannedSensor], format: ImageFormat) -> Vec<Output> {
    let mut all = Vec::new();
    let mut add = |folder: &str, extension: &str, description: &str| {
        let (folder, extension) = (folder.to_owned(), extension.to_owned());
        all.push(Output { folder, extension, description: description.to_owned() });
    };
    for task in tasks(sensors) {
        match task {
            Task::Image { output, folder, .. } => {
                let extension = format.extension(output);
                add(&folder, extension, image_holds(extension, output));
            }
            Task::Points { sensor, points, labels, powers } => {
                let of_radar = "little-endian f32 range rate in metres per second, azimuth (positive to \
                     the left) and altitude (positive upwards) in radians in sensor space, and \
                     distance in metres, for each random direction in which the radar met something, or \
                     each cell that its receiver detected";
                let of_lidar = "little-endian f32 x, y, z in metres in sensor space and intensity 0 to 1, for \
                     each ray that met something, column by column from straight behind over \
                     the right, ahead and the left, the highest channel first";
                let is_radar = sensors[sensor].radar.is_some();
                add(&points, "bin", if is_radar { of_radar } else { of_lidar });
                add(
                    &labels,
                    "bin",
                    "little-endian u32 id and u32 tag, for each point of the other file, in its order",
                );
                if let Some(powers) = powers {
                    add(
                        &powers,
                        "bin",
                        "little-endian f32 received power in dBm, ratio of signal to noise in dB and \
                         cross-section in dBm², for each detection of the other file, in its order",
                    );
                }
            }
            Task::Boxes => add(
                BOXES,
                "json",
                "every actor but the ego and every static object that a sensor saw: its box in the \
                 world and in each camera's optical space, its visible and its projected box in \
                 the image, and how much of it is occluded",
            ),
            Task::Lanes => add(
                LANES,
                "json",
                "every lane boundary with a mark in each camera's image, up to 80 m along the \
                 optical axis, whether or not something hides it; lanes.json has all of the map",
            ),
        }
    }
    all
}

fn image_holds(extension: &str, output: u32) -> &'static str {
    let is_array = extension.starts_with("npy");
    match output {
        output::DEPTH if is_array => "f32 metres along the optical axis; 1000 is the sky",
        output::INSTANCE if is_array => {
            "u32: 0 is the sky, below 8388608 an actor's id, from 8388608 on a static object of the town"
        }
        output::COLOR => "8-bit RGB, sRGB",
        output::DEPTH => {
            "16-bit grey: centimetres along the optical axis, of a fisheye from the camera, rounded; \
             65535 is 655.35 m or farther, and the sky"
        }
        output::TAG => "8 bits: the semantic tag's code",
        _ => {
            "8-bit RGB: id = R + 256 G + 65536 B; 0 is the sky, below 8388608 an actor's id, from \
             8388608 on a static object of the town"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{LensSpec, lens_model};

    #[test]
    fn a_point_ahead_of_the_car_is_in_the_centre_of_the_image() {
        let spec = &default_sensors(800, 600)[0];
        let optical_from_vehicle =
            (spec.parent_from_sensor.affine() * sensor_from_optical()).inverse();
        let model = CameraModel::of(spec);
        let at = |x: f32, y: f32, z: f32| {
            let optical = optical_from_vehicle.transform_point3a(Vec3A::new(x, y, z));
            model.project(optical).unwrap()
        };
        let close = |a: [f32; 2], b: [f32; 2]| {
            assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{a:?} {b:?}");
        };
        close(at(11.5, 0.0, 2.0), [400.0, 300.0]);
        close(at(11.5, 10.0, 2.0), [0.0, 300.0]); // 10 m to the left at 10 m: the left edge.
        close(at(11.5, 0.0, 9.5), [400.0, 0.0]); // 7.5 m up: the top edge.
    }

    #[test]
    fn the_written_matrices_agree_with_the_projection() {
        let spec = &default_sensors(640, 480)[0];
        let camera = describe(&(*spec).into()).camera.unwrap();
        let model = CameraModel::of(spec);
        assert!((camera.intrinsics_px[0][0] - f64::from(model.focal_px)).abs() < 1e-3);
        assert_eq!(
            camera.intrinsics_px,
            [[320.0, 0.0, 320.0], [0.0, 320.0, 240.0], [0.0, 0.0, 1.0]]
        );
        let forward: Vec<f64> = camera.vehicle_from_optical.iter().map(|row| row[2]).collect();
        assert_eq!(forward, [1.0, 0.0, 0.0, 0.0], "optical z is vehicle x");
    }

    #[test]
    fn metadata_holds_the_whole_projection() {
        let lens = LensSpec {
            model: lens_model::BROWN_CONRADY,
            focal_px: [612.3, 611.9],
            center_px: [401.25, 298.5],
            coefficients: [-0.21, 0.07, 0.001, -0.002, -0.01],
            ..LensSpec::default()
        };
        let pose = Pose::IDENTITY;
        let spec = client_lib::wire::camera("front", pose, 800, 600, 1.0, 1u32);
        for lens in [lens, LensSpec { model: lens_model::FISHEYE, coefficients: [0.01; 5], ..lens }]
        {
            let mut lens = lens;
            if lens.model == lens_model::FISHEYE {
                (lens.coefficients[4], lens.max_angle_rad) = (0.0, 1.7);
            }
            let spec = SensorSpec { lens, ..spec };
            let written = describe(&spec.into()).camera.unwrap();
            let text = serde_json::to_string(&written).unwrap();
            let read = serde_json::from_str(&text).unwrap();
            let model = CameraModel::of_metadata(&read).unwrap();
            assert_eq!(model.projection, CameraModel::of(&spec).projection);
        }
    }

    #[test]
    fn every_output_of_the_sensors_has_its_folder() {
        let sensors: Vec<_> = default_sensors(800, 600).into_iter().map(Into::into).collect();
        let outputs = outputs(&sensors, ImageFormat::Png);
        let folders: Vec<_> = outputs.iter().map(|o| o.folder.as_str()).collect();
        assert_eq!(
            folders,
            [
                "front/color",
                "front/depth",
                "front/instance",
                "front/tag",
                "lidar/points",
                "lidar/labels",
                "boxes",
                "lanes"
            ]
        );
    }
}
