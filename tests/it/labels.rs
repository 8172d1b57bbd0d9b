//! The boxes of `omnibus collect`, checked against the images of its data sets.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use mesh::Tag;
use serde_json::Value;

use crate::kit::{Scratch, omnibus};

/// Collects a data set and returns the frames of its list.
fn collect(folder: &Path, more: &[&str]) -> Vec<u64> {
    let output = omnibus()
        .args(["collect", "--device", "cpu", "--warmup", "10"])
        .args(["--out", folder.to_str().unwrap()])
        .args(more)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let list = fs::read_to_string(folder.join("frames.jsonl")).unwrap();
    let frame = |line| serde_json::from_str::<Value>(line).unwrap()["frame"].as_u64().unwrap();
    list.lines().map(frame).collect()
}

/// Returns the width of an image and its samples.
fn image(folder: &Path, output: &str, frame: u64) -> (usize, Vec<u8>) {
    let file = fs::File::open(folder.join(format!("front/{output}/{frame:06}.png"))).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut bytes).unwrap().width as usize;
    (width, bytes)
}

/// Returns the boxes of a frame by id: actors and objects.
fn boxes(folder: &Path, frame: u64) -> BTreeMap<u64, Value> {
    let text = fs::read(folder.join(format!("boxes/{frame:06}.json"))).unwrap();
    let boxes: Value = serde_json::from_slice(&text).unwrap();
    let of = |list: &str, key: &str| -> Vec<(u64, Value)> {
        let list = boxes[list].as_array().unwrap();
        list.iter().map(|one| (one[key].as_u64().unwrap(), one.clone())).collect()
    };
    let (actors, objects) = (of("actors", "actor_id"), of("objects", "object_id"));
    actors.into_iter().chain(objects).collect()
}

/// Classes of things that stand apart from each other. The default map has no others of them.
const BOXED: [Tag; 6] =
    [Tag::Car, Tag::Pole, Tag::TrafficLight, Tag::TrafficSign, Tag::Vegetation, Tag::Static];

#[test]
fn every_pixel_of_a_thing_belongs_to_a_box_that_encloses_it() {
    let scratch = Scratch::new();
    let set = scratch.path().join("set");
    let (mut parked, mut classes) = (0, BTreeSet::new());
    for frame in collect(&set, &["--frames", "4", "--every", "25"]) {
        let boxes = boxes(&set, frame);
        let (_, tags) = image(&set, "tag", frame);
        let (width, ids) = image(&set, "instance", frame);
        // Left, top, right, bottom edge, and the number of pixels, by id.
        let mut seen: BTreeMap<u64, [usize; 5]> = BTreeMap::new();
        for (at, (tag, id)) in tags.iter().zip(ids.chunks_exact(3)).enumerate() {
            let id = u64::from(u32::from_le_bytes([id[0], id[1], id[2], 0]));
            let (x, y) = (at % width, at / width);
            let [left, top, right, bottom, count] =
                seen.get(&id).copied().unwrap_or([x, y, x, y, 0]);
            let edges = [left.min(x), top, right.max(x + 1), bottom.max(y + 1), count + 1];
            seen.insert(id, edges);
            let tag = Tag::from_code(*tag).unwrap();
            let is_thing = BOXED.contains(&tag);
            assert!(!is_thing || boxes.contains_key(&id), "frame {frame}: {tag:?} {id} at {x} {y}");
            if is_thing {
                classes.insert(tag as u8);
            }
        }
        for (id, one) in &boxes {
            let Some(view) = one["cameras"].get("front") else { continue };
            let [left, top, right, bottom, count] = seen[id];
            assert_eq!(view["visible_px"], count, "{id} in frame {frame}");
            assert_eq!(view["visible_box_px"], serde_json::json!([left, top, right, bottom]));
            assert!(view["unoccluded_px"].as_u64().unwrap() >= count as u64);
            if one.get("layer").is_none() {
                // The box of a walker is CARLA's; arms and legs swing out of it.
                continue;
            }
            let edges: Vec<f64> = serde_json::from_value(view["projected_box_px"].clone()).unwrap();
            let inside = [left as f64 - edges[0], top as f64 - edges[1]];
            let beyond = [right as f64 - edges[2], bottom as f64 - edges[3]];
            assert!(
                inside.iter().all(|px| *px > -2.0) && beyond.iter().all(|px| *px < 2.0),
                "{id} in frame {frame}: pixels {:?}, box {edges:?}",
                seen[id]
            );
            parked += u32::from(one["layer"] == "parked-vehicles");
        }
        for one in boxes.values().filter(|one| one["layer"] == "parked-vehicles") {
            let size: Vec<f64> = serde_json::from_value(one["size_m"].clone()).unwrap();
            assert!(size[0] > size[1], "longer than wide: {one}");
            assert!(one["blueprint"].as_str().unwrap().starts_with("vehicle."), "{one}");
        }
    }
    assert!(parked > 20, "{parked} boxes of parked cars");
    assert_eq!(classes.len(), BOXED.len(), "{classes:?}");
}
