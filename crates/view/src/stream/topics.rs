//! What can be subscribed to.

use serde_json::{Value, json};

use crate::stream::base64;

/// A topic; its code is the id of its channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    Transforms = 1,
    Actors,
    Map,
    EgoPose,
    Image,
    Calibration,
    Points,
    Stages,
}

/// The schema of the stages, in JSON: the number of the frame and, for each stage, the milliseconds that
/// each of its parts took, as `host.physics_ms`.
pub(crate) const STAGES: &str = "omnibus.Stages";

/// All topics with their names and schemas.
pub(crate) const TOPICS: &[(Topic, &str, &str)] = &[
    (Topic::Transforms, "/tf", "foxglove.FrameTransforms"),
    (Topic::Actors, "/actors", "foxglove.SceneUpdate"),
    (Topic::Map, "/map", "foxglove.SceneUpdate"),
    (Topic::EgoPose, "/ego/pose", "foxglove.PoseInFrame"),
    (Topic::Image, "/front/image", "foxglove.CompressedImage"),
    (Topic::Calibration, "/front/calibration", "foxglove.CameraCalibration"),
    (Topic::Points, "/lidar/points", "foxglove.PointCloud"),
    (Topic::Stages, "/stages", STAGES),
];

impl Topic {
    /// Returns the topic of a channel.
    pub(crate) fn of(channel: u32) -> Option<Topic> {
        TOPICS.iter().map(|(topic, ..)| *topic).find(|topic| *topic as u32 == channel)
    }
}

/// Returns the message that advertises the channels.
pub(crate) fn advertisement() -> Value {
    let schema = base64::encode(&foxglove::descriptor());
    let channels = TOPICS.iter().map(|(topic, name, schema_name)| {
        let is_json = *schema_name == STAGES;
        json!({
            "id": *topic as u32,
            "topic": name,
            "encoding": if is_json { "json" } else { "protobuf" },
            "schemaName": schema_name,
            "schemaEncoding": if is_json { "jsonschema" } else { "protobuf" },
            "schema": if is_json { r#"{"type": "object"}"# } else { &schema },
        })
    });
    json!({ "op": "advertise", "channels": channels.collect::<Vec<_>>() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_is_found_by_its_channel_and_each_channel_is_one_topic() {
        for (topic, ..) in TOPICS {
            assert_eq!(Topic::of(*topic as u32), Some(*topic));
        }
        assert_eq!((Topic::of(0), Topic::of(TOPICS.len() as u32 + 1)), (None, None));
    }
}
