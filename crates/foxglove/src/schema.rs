//! The description of Foxglove's schemas.
//!
//! Source: <https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto>. The description holds
//! the messages that are written and all that they can contain, so that a reader finds every field.

use Type::{Boolean, Bytes, Double, Enum, Fixed32, Message as Of, Text};

use crate::message::Message;

/// The type of a field.
#[derive(Clone, Copy, PartialEq)]
enum Type {
    Double,
    Fixed32,
    Boolean,
    Text,
    Bytes,
    Enum(&'static str),
    Message(&'static str),
}

/// Name, number, type, whether it is a list.
type Field = (&'static str, u32, Type, bool);

const TIME: Field = ("timestamp", 1, Of("google.protobuf.Timestamp"), false);
const POSE: Type = Of("foxglove.Pose");
const COLOR: Type = Of("foxglove.Color");
const VECTOR: Type = Of("foxglove.Vector3");
const POINT: Type = Of("foxglove.Point3");

/// The name of each message, and its fields.
const MESSAGES: &[(&str, &[Field])] = &[
    (
        "CompressedImage",
        &[
            TIME,
            ("frame_id", 4, Text, false),
            ("data", 2, Bytes, false),
            ("format", 3, Text, false),
        ],
    ),
    (
        "CameraCalibration",
        &[
            TIME,
            ("frame_id", 9, Text, false),
            ("width", 2, Fixed32, false),
            ("height", 3, Fixed32, false),
            ("distortion_model", 4, Text, false),
            ("D", 5, Double, true),
            ("K", 6, Double, true),
            ("R", 7, Double, true),
            ("P", 8, Double, true),
        ],
    ),
    (
        "PointCloud",
        &[
            TIME,
            ("frame_id", 2, Text, false),
            ("pose", 3, POSE, false),
            ("point_stride", 4, Fixed32, false),
            ("fields", 5, Of("foxglove.PackedElementField"), true),
            ("data", 6, Bytes, false),
        ],
    ),
    (
        "PackedElementField",
        &[
            ("name", 1, Text, false),
            ("offset", 2, Fixed32, false),
            ("type", 3, Enum("NumericType"), false),
        ],
    ),
    ("FrameTransforms", &[("transforms", 1, Of("foxglove.FrameTransform"), true)]),
    (
        "FrameTransform",
        &[
            TIME,
            ("parent_frame_id", 2, Text, false),
            ("child_frame_id", 3, Text, false),
            ("translation", 4, VECTOR, false),
            ("rotation", 5, Of("foxglove.Quaternion"), false),
        ],
    ),
    (
        "SceneUpdate",
        &[
            ("deletions", 1, Of("foxglove.SceneEntityDeletion"), true),
            ("entities", 2, Of("foxglove.SceneEntity"), true),
        ],
    ),
    ("SceneEntityDeletion", &[TIME, ("type", 2, Enum("Type"), false), ("id", 3, Text, false)]),
    (
        "SceneEntity",
        &[
            TIME,
            ("frame_id", 2, Text, false),
            ("id", 3, Text, false),
            ("lifetime", 4, Of("google.protobuf.Duration"), false),
            ("frame_locked", 5, Boolean, false),
            ("metadata", 6, Of("foxglove.KeyValuePair"), true),
            ("arrows", 7, Of("foxglove.ArrowPrimitive"), true),
            ("cubes", 8, Of("foxglove.CubePrimitive"), true),
            ("spheres", 9, Of("foxglove.SpherePrimitive"), true),
            ("cylinders", 10, Of("foxglove.CylinderPrimitive"), true),
            ("lines", 11, Of("foxglove.LinePrimitive"), true),
            ("triangles", 12, Of("foxglove.TriangleListPrimitive"), true),
            ("texts", 13, Of("foxglove.TextPrimitive"), true),
            ("models", 14, Of("foxglove.ModelPrimitive"), true),
        ],
    ),
    ("KeyValuePair", &[("key", 1, Text, false), ("value", 2, Text, false)]),
    (
        "ArrowPrimitive",
        &[
            ("pose", 1, POSE, false),
            ("shaft_length", 2, Double, false),
            ("shaft_diameter", 3, Double, false),
            ("head_length", 4, Double, false),
            ("head_diameter", 5, Double, false),
            ("color", 6, COLOR, false),
        ],
    ),
    (
        "CubePrimitive",
        &[("pose", 1, POSE, false), ("size", 2, VECTOR, false), ("color", 3, COLOR, false)],
    ),
    (
        "SpherePrimitive",
        &[("pose", 1, POSE, false), ("size", 2, VECTOR, false), ("color", 3, COLOR, false)],
    ),
    (
        "CylinderPrimitive",
        &[
            ("pose", 1, POSE, false),
            ("size", 2, VECTOR, false),
            ("bottom_scale", 3, Double, false),
            ("top_scale", 4, Double, false),
            ("color", 5, COLOR, false),
        ],
    ),
    (
        "LinePrimitive",
        &[
            ("type", 1, Enum("Type"), false),
            ("pose", 2, POSE, false),
            ("thickness", 3, Double, false),
            ("scale_invariant", 4, Boolean, false),
            ("points", 5, POINT, true),
            ("color", 6, COLOR, false),
            ("colors", 7, COLOR, true),
            ("indices", 8, Fixed32, true),
        ],
    ),
    (
        "TriangleListPrimitive",
        &[
            ("pose", 1, POSE, false),
            ("points", 2, POINT, true),
            ("color", 3, COLOR, false),
            ("colors", 4, COLOR, true),
            ("indices", 5, Fixed32, true),
        ],
    ),
    (
        "TextPrimitive",
        &[
            ("pose", 1, POSE, false),
            ("billboard", 2, Boolean, false),
            ("font_size", 3, Double, false),
            ("scale_invariant", 4, Boolean, false),
            ("color", 5, COLOR, false),
            ("text", 6, Text, false),
        ],
    ),
    (
        "ModelPrimitive",
        &[
            ("pose", 1, POSE, false),
            ("scale", 2, VECTOR, false),
            ("color", 3, COLOR, false),
            ("override_color", 4, Boolean, false),
            ("url", 5, Text, false),
            ("media_type", 6, Text, false),
            ("data", 7, Bytes, false),
        ],
    ),
    (
        "Color",
        &[
            ("r", 1, Double, false),
            ("g", 2, Double, false),
            ("b", 3, Double, false),
            ("a", 4, Double, false),
        ],
    ),
    (
        "Pose",
        &[("position", 1, VECTOR, false), ("orientation", 2, Of("foxglove.Quaternion"), false)],
    ),
    ("Vector3", &[("x", 1, Double, false), ("y", 2, Double, false), ("z", 3, Double, false)]),
    ("Point3", &[("x", 1, Double, false), ("y", 2, Double, false), ("z", 3, Double, false)]),
    (
        "Quaternion",
        &[
            ("x", 1, Double, false),
            ("y", 2, Double, false),
            ("z", 3, Double, false),
            ("w", 4, Double, false),
        ],
    ),
    ("PoseInFrame", &[TIME, ("frame_id", 2, Text, false), ("pose", 3, POSE, false)]),
    (
        "Log",
        &[
            TIME,
            ("level", 2, Enum("Level"), false),
            ("message", 3, Text, false),
            ("name", 4, Text, false),
            ("file", 5, Text, false),
            ("line", 6, Fixed32, false),
        ],
    ),
    (
        "LocationFix",
        &[
            ("timestamp", 6, Of("google.protobuf.Timestamp"), false),
            ("frame_id", 7, Text, false),
            ("latitude", 1, Double, false),
            ("longitude", 2, Double, false),
            ("altitude", 3, Double, false),
            ("position_covariance", 4, Double, true),
            ("position_covariance_type", 5, Enum("PositionCovarianceType"), false),
            ("color", 8, COLOR, false),
            ("metadata", 9, Of("foxglove.KeyValuePair"), true),
            ("heading", 10, Double, false),
            ("velocity", 11, VECTOR, false),
        ],
    ),
];

/// The enumerations: the message around, their name, their values from 0 on.
const ENUMS: &[(&str, &str, &[&str])] = &[
    (
        "PackedElementField",
        "NumericType",
        &["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"],
    ),
    ("SceneEntityDeletion", "Type", &["MATCHING_ID", "ALL"]),
    ("Log", "Level", &["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"]),
    ("LinePrimitive", "Type", &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"]),
    (
        "LocationFix",
        "PositionCovarianceType",
        &["UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN"],
    ),
];

/// Returns the `google.protobuf.FileDescriptorSet` of all messages.
///
/// Source of the numbers:
/// <https://github.com/protocolbuffers/protobuf/blob/main/src/google/protobuf/descriptor.proto>.
#[must_use]
pub fn descriptor() -> Vec<u8> {
    let time = |name: &str, message: &str| {
        let field = |name: &str, number, kind| {
            let field = Message::new().text(1, name).integer(3, number);
            field.integer(4, 1).integer(5, kind)
        };
        // int64 and int32.
        let fields = Message::new().text(1, message);
        let fields = fields.message(2, &field("seconds", 1, 3)).message(2, &field("nanos", 2, 5));
        let file = Message::new().text(1, name).text(2, "google.protobuf");
        file.message(4, &fields).text(12, "proto3")
    };
    let files = ["google/protobuf/timestamp.proto", "google/protobuf/duration.proto"];
    let mut file = Message::new().text(1, "foxglove.proto").text(2, "foxglove");
    for name in files {
        file = file.text(3, name);
    }
    for (name, fields) in MESSAGES {
        file = file.message(4, &message_descriptor(name, fields));
    }
    file = file.text(12, "proto3");
    let set = Message::new();
    let set = set.message(1, &time(files[0], "Timestamp")).message(1, &time(files[1], "Duration"));
    set.message(1, &file).0
}

fn message_descriptor(name: &str, fields: &[Field]) -> Message {
    let mut described = Message::new().text(1, name);
    for (field, number, kind, is_list) in fields {
        let (code, of) = match kind {
            Double => (1, None),
            Fixed32 => (7, None),
            Boolean => (8, None),
            Text => (9, None),
            Of(of) => (11, Some(format!(".{of}"))),
            Bytes => (12, None),
            Enum(of) => (14, Some(format!(".foxglove.{name}.{of}"))),
        };
        let label = if *is_list { 3 } else { 1 };
        let mut entry = Message::new().text(1, field).integer(3, u64::from(*number));
        entry = entry.integer(4, label).integer(5, code);
        if let Some(of) = of {
            entry = entry.text(6, &of);
        }
        described = described.message(2, &entry);
    }
    for (_, of, values) in ENUMS.iter().filter(|(around, ..)| *around == name) {
        let mut entry = Message::new().text(1, of);
        for (number, value) in (0..).zip(*values) {
            entry = entry.message(2, &Message::new().text(1, value).integer(2, number));
        }
        described = described.message(4, &entry);
    }
    described
}
