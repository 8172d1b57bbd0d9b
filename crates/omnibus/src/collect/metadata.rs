//! The initial `metadata.json`, and how two settings differ.

use std::collections::BTreeMap;

use mesh::Tag;
use serde_json::Value;

use crate::collect::{
    format::{DataSetSettings, FORMAT, Metadata, SpawnedActors},
    sensors::{self, PlannedSensor},
};

/// Returns the metadata of a data set before its first frame.
pub(crate) fn of(
    settings: DataSetSettings,
    spawned_actors: SpawnedActors,
    sensors: &[PlannedSensor],
    frames: u64,
) -> Metadata {
    Metadata {
        format: FORMAT.to_owned(),
        omnibus_version: env!("CARGO_PKG_VERSION").to_owned(),
        complete: false,
        frames_requested: frames,
        frames_complete: 0,
        tracers: Vec::new(),
        outputs: sensors::outputs(sensors, settings.images.format),
        settings,
        spawned_actors,
        conventions: conventions(),
        tags: Tag::ALL.iter().map(|tag| (*tag as u8, format!("{tag:?}"))).collect(),
        files_crc32: BTreeMap::new(),
    }
}

fn conventions() -> BTreeMap<String, String> {
    let all = [
        ("units", "metres, seconds, radians; names carry the unit"),
        ("world", "right-handed, x east, y north, z up: the axes of map.xodr"),
        (
            "vehicle",
            "right-handed, x forward, y left, z up; the origin lies on the ground below the middle \
             of the wheelbase",
        ),
        ("sensor", "right-handed, x forward, y left, z up"),
        ("optical", "right-handed, x right, y down, z forward: the axes of intrinsics_px"),
        ("transforms", "a_from_b turns a point in b into the same point in a; matrices by rows"),
        ("rotation_xyzw", "unit quaternion, the real part last"),
        (
            "pixels",
            "(0, 0) is the top left corner of the image; the centre of the first pixel is (0.5, 0.5)",
        ),
        ("boxes_px", "left, top, right, bottom edge; right and bottom are exclusive"),
        ("files", "named by the frame, the ordinal of the simulation step"),
        (
            "ids",
            "the same in images, labels and boxes: 0 the sky, below 8388608 an actor, from 8388608 \
             on a static object",
        ),
        (
            "keypoints",
            "those of COCO in its order; visibility 0 is outside of the image, 1 occluded, 2 visible",
        ),
        (
            "amodal_mask",
            "the pixels of unoccluded_px, as COCO's compressed run-length encoding: height and width, \
             and the runs down the columns",
        ),
        (
            "frames.jsonl",
            "one line for each complete frame; a file whose frame is not listed is not complete",
        ),
    ];
    all.into_iter().map(|(key, text)| (key.to_owned(), text.to_owned())).collect()
}

/// Returns the path of the first difference between two settings, and both values.
pub(crate) fn difference(
    recorded: &DataSetSettings,
    requested: &DataSetSettings,
) -> Option<(String, String, String)> {
    // Compares the written text, because the recorded settings were read from text.
    let value = |settings: &DataSetSettings| -> Value {
        let text = serde_json::to_string(settings).expect("plain data has a JSON form");
        serde_json::from_str(&text).expect("what was written can be read")
    };
    differ("", &value(recorded), &value(requested))
}

/// Returns the path of the first difference between two values below `path`, and both values.
pub(crate) fn differ(path: &str, a: &Value, b: &Value) -> Option<(String, String, String)> {
    let inner = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            let keys = a.keys().chain(b.keys().filter(|k| !a.contains_key(*k)));
            let get = |map: &serde_json::Map<String, Value>, key: &str| {
                map.get(key).cloned().unwrap_or(Value::Null)
            };
            keys.into_iter().find_map(|k| differ(&inner(k), &get(a, k), &get(b, k)))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => (a.iter().zip(b))
            .enumerate()
            .find_map(|(index, (a, b))| differ(&inner(&index.to_string()), a, b)),
        _ => (a != b).then(|| (path.to_owned(), a.to_string(), b.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::testing::settings;

    #[test]
    fn the_first_difference_is_named_with_both_values() {
        let first = settings();
        assert_eq!(difference(&first, &first), None);
        let other = DataSetSettings { seed: 8, ..first.clone() };
        let expected = ("seed".to_owned(), "7".to_owned(), "8".to_owned());
        assert_eq!(difference(&first, &other), Some(expected));
        let mut wider = first.clone();
        wider.sensors[0].camera.as_mut().unwrap().width_px = 1920;
        let (key, recorded, requested) = difference(&first, &wider).unwrap();
        assert_eq!(
            (&key[..], &recorded[..], &requested[..]),
            ("sensors.0.camera.width_px", "800", "1920")
        );
    }

    #[test]
    fn settings_that_were_written_and_read_are_unchanged() {
        let first = settings();
        let text = serde_json::to_string_pretty(&first).unwrap();
        let read: DataSetSettings = serde_json::from_str(&text).unwrap();
        assert_eq!(difference(&read, &first), None);
    }
}
