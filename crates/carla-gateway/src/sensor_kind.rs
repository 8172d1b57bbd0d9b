//! The kinds of sensors: CARLA's blueprints, message types and measured outputs.

use client_lib::wire::output;

/// A kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Rgb,
    Depth,
    Semantic,
    Instance,
    Normals,
    Flow,
    Events,
    Cosmos,
    Lidar,
    SemanticLidar,
    Radar,
    Imu,
    Gnss,
    Collision,
    Obstacle,
    LaneInvasion,
    V2x,
    V2xCustom,
}

impl Kind {
    /// Returns the kind of a blueprint.
    pub(crate) fn of(id: &str) -> Option<Kind> {
        Some(match id {
            "sensor.camera.rgb" => Kind::Rgb,
            "sensor.camera.depth" => Kind::Depth,
            "sensor.camera.semantic_segmentation" => Kind::Semantic,
            "sensor.camera.instance_segmentation" => Kind::Instance,
            "sensor.camera.normals" => Kind::Normals,
            "sensor.camera.optical_flow" => Kind::Flow,
            "sensor.camera.dvs" => Kind::Events,
            "sensor.camera.cosmos_visualization" => Kind::Cosmos,
            "sensor.lidar.ray_cast" => Kind::Lidar,
            "sensor.lidar.ray_cast_semantic" => Kind::SemanticLidar,
            "sensor.other.radar" => Kind::Radar,
            "sensor.other.imu" => Kind::Imu,
            "sensor.other.gnss" => Kind::Gnss,
            "sensor.other.collision" => Kind::Collision,
            "sensor.other.obstacle" => Kind::Obstacle,
            "sensor.other.lane_invasion" => Kind::LaneInvasion,
            "sensor.other.v2x" => Kind::V2x,
            "sensor.other.v2x_custom" => Kind::V2xCustom,
            _ => return None,
        })
    }

    /// Returns the number of the message type. A client that receives a wrong one crashes.
    pub(crate) fn type_id(self) -> u64 {
        match self {
            Kind::Collision => 0,
            Kind::Depth => 1,
            Kind::Normals => 2,
            Kind::Events => 3,
            Kind::Gnss => 4,
            Kind::Imu => 5,
            Kind::LaneInvasion => 6,
            Kind::Obstacle => 7,
            Kind::Flow => 8,
            Kind::Radar => 9,
            Kind::SemanticLidar => 10,
            Kind::Lidar => 11,
            Kind::Rgb => 13,
            Kind::Semantic => 14,
            Kind::Instance => 15,
            Kind::Cosmos => 16,
            Kind::V2x => 20,
            Kind::V2xCustom => 21,
        }
    }

    /// Returns what the renderer outputs for the sensor; 0: the renderer does not measure it.
    pub(crate) fn outputs(self) -> u32 {
        match self {
            Kind::Rgb | Kind::Events => output::COLOR,
            Kind::Normals => output::NORMAL,
            Kind::Flow => output::FLOW,
            Kind::Depth => output::DEPTH,
            // Of the image, only its frame and pose are used.
            Kind::Semantic | Kind::Cosmos => output::TAG,
            Kind::Instance => output::TAG | output::INSTANCE,
            Kind::Lidar => output::POINTS,
            Kind::SemanticLidar | Kind::Radar => output::POINTS | output::LABELS,
            _ => 0,
        }
    }

    /// Returns whether this is a radio, which sends whether or not a client listens to it.
    pub(crate) fn is_radio(self) -> bool {
        matches!(self, Kind::V2x | Kind::V2xCustom)
    }
}
