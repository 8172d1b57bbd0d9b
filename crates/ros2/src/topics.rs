//! The topics of a vehicle and its sensors: names, message types, qualities.

use client_lib::wire::{SensorSpec, output, sensor};

use crate::{discovery::Quality, error::Ros2Error, participant::Topic};

/// Publications that every node has, by their place in the list of topics.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fixed {
    Clock,
    Status,
    Transforms,
    Odometry,
    Speedometer,
    VehicleStatus,
    Imu,
    Gnss,
}

/// Sensors of motion, by their place in their bundle.
pub(crate) const IMU: usize = 0;
pub(crate) const GNSS: usize = 1;

/// One output of one camera or lidar.
#[derive(Clone, Debug)]
pub(crate) struct SensorTopic {
    /// Its place in the list of topics.
    pub(crate) publication: usize,
    /// That of the camera's `camera_info`; `None`: a lidar.
    pub(crate) info: Option<usize>,
    /// The place of the sensor in its bundle.
    pub(crate) sensor: usize,
    /// One of [`output`].
    pub(crate) output: u32,
    /// The encoding of an image; empty: a lidar.
    pub(crate) encoding: &'static str,
    /// The coordinate frame.
    pub(crate) frame_id: String,
}

/// All publications.
#[derive(Clone, Debug)]
pub(crate) struct Publications {
    pub(crate) topics: Vec<Topic>,
    pub(crate) sensors: Vec<SensorTopic>,
}

/// Lost samples are sent again, as by CARLA's bridge: subscribers of either quality match.
const RELIABLE: Quality = Quality { is_reliable: true, is_kept: false };
/// Messages that are kept for subscribers that lack them.
const DEPTH: usize = 10;
/// Of images and point clouds: one that is old is not wanted.
const LARGE_DEPTH: usize = 2;

/// Outputs of cameras, the names of their topics beside colour, and their encodings.
const IMAGES: [(u32, &str, &str); 6] = [
    (output::COLOR, "", "bgra8"),
    (output::DEPTH, "_depth", "32FC1"),
    (output::TAG, "_tag", "8UC1"),
    (output::INSTANCE, "_instance", "32SC1"),
    (output::NORMAL, "_normal", "32FC3"),
    (output::FLOW, "_flow", "32FC2"),
];

/// Returns a topic of the node.
pub(crate) fn topic(name: String, message: &'static str) -> Topic {
    Topic { name, message, quality: RELIABLE, depth: DEPTH }
}

impl Publications {
    /// Returns the publications of a vehicle and its cameras and lidars.
    ///
    /// # Errors
    ///
    /// [`Ros2Error::Name`]; [`Ros2Error::SameTopic`].
    pub(crate) fn new(role: &str, sensors: &[SensorSpec]) -> Result<Publications, Ros2Error> {
        check_name("role", role)?;
        let of_vehicle = |name: &str| format!("/carla/{role}/{name}");
        // In the order of `Fixed`.
        let mut topics = vec![
            topic("/clock".to_owned(), "rosgraph_msgs/msg/Clock"),
            topic("/carla/status".to_owned(), "carla_msgs/msg/CarlaStatus"),
            topic("/tf".to_owned(), "tf2_msgs/msg/TFMessage"),
            topic(of_vehicle("odometry"), "nav_msgs/msg/Odometry"),
            topic(of_vehicle("speedometer"), "std_msgs/msg/Float32"),
            topic(of_vehicle("vehicle_status"), "carla_msgs/msg/CarlaEgoVehicleStatus"),
            topic(of_vehicle("imu"), "sensor_msgs/msg/Imu"),
            topic(of_vehicle("gnss"), "sensor_msgs/msg/NavSatFix"),
        ];
        let mut add = |topic: Topic| -> Result<usize, Ros2Error> {
            if topics.iter().any(|other| other.name == topic.name) {
                return Err(Ros2Error::SameTopic { topic: topic.name });
            }
            topics.push(topic);
            Ok(topics.len() - 1)
        };
        let mut outputs = Vec::new();
        for (index, spec) in sensors.iter().enumerate() {
            let name = spec.name.as_str();
            check_name("sensor", name)?;
            let frame_id = format!("{role}/{name}");
            let large =
                |name: String, message| Topic { depth: LARGE_DEPTH, ..topic(name, message) };
            if spec.kind == sensor::LIDAR {
                let cloud = large(of_vehicle(name), "sensor_msgs/msg/PointCloud2");
                outputs.push(SensorTopic {
                    publication: add(cloud)?,
                    info: None,
                    sensor: index,
                    output: output::POINTS,
                    encoding: "",
                    frame_id,
                });
                continue;
            }
            let is_only = spec.outputs.count_ones() == 1;
            for (output, suffix, encoding) in IMAGES {
                if spec.outputs & output == 0 {
                    continue;
                }
                let suffix = if is_only { "" } else { suffix };
                let of_camera = |what| of_vehicle(&format!("{name}{suffix}/{what}"));
                outputs.push(SensorTopic {
                    publication: add(large(of_camera("image"), "sensor_msgs/msg/Image"))?,
                    info: Some(add(topic(of_camera("camera_info"), "sensor_msgs/msg/CameraInfo"))?),
                    sensor: index,
                    output,
                    encoding,
                    frame_id: frame_id.clone(),
                });
            }
        }
        Ok(Publications { topics, sensors: outputs })
    }
}

/// Names of ROS: letters, digits and underscores, with a letter first.
fn check_name(what: &'static str, name: &str) -> Result<(), Ros2Error> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_part) {
        return Ok(());
    }
    Err(Ros2Error::Name { what, name: name.to_owned() })
}

#[cfg(test)]
mod tests {
    use client_lib::{Pose, wire};

    use super::*;

    fn names(sensors: &[SensorSpec]) -> Result<Vec<String>, String> {
        let all = Publications::new("ego_vehicle", sensors).map_err(|e| e.to_string())?;
        Ok(all.topics.into_iter().map(|topic| topic.name).collect())
    }

    #[test]
    fn topics_have_the_names_of_carla_s_bridge() {
        let camera = |name, outputs| wire::camera(name, Pose::IDENTITY, 8, 6, 1.0, outputs);
        let lidar = wire::lidar("lidar", Pose::IDENTITY, 4, 90, [-0.5, 0.2], 50.0);
        let both = output::COLOR | output::DEPTH;
        let names = names(&[camera("front", both), camera("depth", output::DEPTH), lidar]).unwrap();
        assert_eq!(names[Fixed::Gnss as usize], "/carla/ego_vehicle/gnss");
        assert_eq!(
            names[Fixed::Gnss as usize + 1..].iter().map(|n| &n[19..]).collect::<Vec<_>>(),
            [
                "front/image",
                "front/camera_info",
                "front_depth/image",
                "front_depth/camera_info",
                "depth/image",
                "depth/camera_info",
                "lidar",
            ]
        );
    }

    #[test]
    fn names_that_ros_has_not_and_topics_twice_are_refused() {
        let lidar = |name| wire::lidar(name, Pose::IDENTITY, 4, 90, [-0.5, 0.2], 50.0);
        let why = names(&[lidar("a-b")]).unwrap_err();
        assert!(why.contains("sensor \"a-b\""), "{why}");
        let why = names(&[lidar("imu")]).unwrap_err();
        assert!(why.contains("/carla/ego_vehicle/imu"), "{why}");
    }
}
