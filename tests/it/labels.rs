//! The boxes of `omnibus collect`, checked against the images of its data sets.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use mesh::Tag;
use serde_json::Value;

use crate::kit::{Scratch, omnibus, small_map};

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

/// Runs `omnibus collect --verify` and returns its status and what it printed.
fn verify(folder: &Path) -> (Option<i32>, String) {
    let output = omnibus().args(["collect", "--verify"]).arg(folder).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(text).unwrap())
}

/// Flips a bit in the middle of a file.
fn damage(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(path, bytes).unwrap();
}

/// Moves the rows of a depth image up by a quarter of its height.
fn shift_depth(folder: &Path, frame: u64) {
    let (width, bytes) = image(folder, "depth", frame);
    let rows = bytes.len() / (2 * width);
    let mut moved = bytes.clone();
    moved.rotate_left(2 * width * (rows / 4));
    let path = folder.join(format!("front/depth/{frame:06}.png"));
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), width as u32, rows as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&moved).unwrap();
}

#[test]
fn every_kind_of_fault_is_found_and_named() {
    let scratch = Scratch::new();
    let set = scratch.path().join("set");
    let small = ["--map", small_map(), "--vehicles", "5", "--width", "160", "--height", "120"];
    let frames =
        collect(&set, &[&small[..], &["--frames", "3", "--every", "5", "--amodal-masks"]].concat());
    let (status, text) = verify(&set);
    assert_eq!(status, Some(0), "{text}");
    assert!(text.starts_with("3 frames, ") && text.contains(", no fault"), "{text}");
    assert!(text.contains("lidar against the depth of front"), "{text}");
    let frame = frames[1];
    let file = |folder: &str, extension: &str| {
        let name = format!("{folder}/{frame:06}.{extension}");
        (set.join(&name), name)
    };
    let find = |name: &str, faults: &[&str]| {
        let (status, text) = verify(&set);
        assert_eq!(status, Some(1), "{name}: {text}");
        for fault in faults {
            let found = text.lines().find(|line| line.contains(fault));
            assert!(found.is_some_and(|line| line.contains(name)), "{name}, {fault}: {text}");
        }
    };
    let files = [
        file("front/color", "png"),
        file("front/depth", "png"),
        file("front/instance", "png"),
        file("front/tag", "png"),
        file("lidar/points", "bin"),
        file("lidar/labels", "bin"),
        file("boxes", "json"),
        file("lanes", "json"),
    ]
    .into_iter()
    .chain(
        ["frames.jsonl", "map.xodr", "lanes.json", "tracks.json"]
            .map(|name| (set.join(name), name.to_owned())),
    );
    for (path, name) in files {
        let sound = fs::read(&path).unwrap();
        damage(&path);
        find(&name, &["with another checksum"]);
        fs::remove_file(&path).unwrap();
        if name != "frames.jsonl" {
            find(&name, &["missing files"]);
        }
        fs::write(&path, sound).unwrap();
    }
    let (extra, name) = file("front/color", "jpg");
    fs::write(&extra, "x").unwrap();
    find(&name, &["additional files"]);
    fs::remove_file(&extra).unwrap();

    // Contents that are well-formed and wrong.
    let (path, _) = file("boxes", "json");
    let sound = fs::read_to_string(&path).unwrap();
    let stated = sound.split_once("\"visible_px\":").unwrap().1.split(',').next().unwrap();
    let wrong = sound.replacen(&format!("\"visible_px\":{stated},"), "\"visible_px\":7,", 1);
    fs::write(&path, wrong).unwrap();
    let of_frame = format!("frame {frame}, front, id ");
    find(&of_frame, &["boxes that disagree with the instance image"]);
    let (before, rest) = sound.split_once("\"unoccluded_px\":").unwrap();
    fs::write(&path, format!("{before}\"unoccluded_px\":1{rest}")).unwrap();
    find(&of_frame, &["masks that disagree with the instance image"]);
    let (before, rest) = sound.split_once("\"px\":[[").expect("a pedestrian is in view");
    fs::write(&path, format!("{before}\"px\":[[9{rest}")).unwrap();
    find(&of_frame, &["keypoints that disagree with the instance image"]);
    let (before, rest) = sound.split_once("\"lidar_points\":{\"lidar\":").unwrap();
    let (_, rest) = rest.split_once('}').unwrap();
    fs::write(&path, format!("{before}\"lidar_points\":{{\"lidar\":9999}}{rest}")).unwrap();
    find(&format!("frame {frame}, lidar, id "), &["boxes that disagree with the lidar labels"]);
    fs::write(&path, &sound).unwrap();
    let (path, _) = file("front/depth", "png");
    let depth = fs::read(&path).unwrap();
    shift_depth(&set, frame);
    find(&format!("frame {frame}, lidar and front"), &["disagree with the depth image"]);
    fs::write(&path, depth).unwrap();
    let list = fs::read_to_string(set.join("frames.jsonl")).unwrap();
    let without: Vec<_> = list.lines().enumerate().filter(|(at, _)| *at != 1).collect();
    let without: String = without.into_iter().map(|(_, line)| format!("{line}\n")).collect();
    fs::write(set.join("frames.jsonl"), without).unwrap();
    find("frames.jsonl", &["stamps out of order", "counts that disagree", "another checksum"]);
    fs::write(set.join("frames.jsonl"), list).unwrap();
    assert_eq!(verify(&set).0, Some(0));
}

#[test]
fn tracks_weather_and_lane_lines_are_those_of_the_frames() {
    let scratch = Scratch::new();
    let set = scratch.path().join("set");
    let suns = ["--sun-altitudes-deg", "60,-10"];
    let frames = collect(&set, &[&["--frames", "4", "--every", "5"], &suns[..]].concat());
    let read = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(set.join(name)).unwrap()).unwrap()
    };
    let tracks = read("tracks.json");
    let mut counts: BTreeMap<u64, u64> = BTreeMap::new();
    for frame in &frames {
        for id in boxes(&set, *frame).keys() {
            *counts.entry(*id).or_default() += 1;
        }
    }
    let track = |id: &u64| {
        let list = if *id < 1 << 23 { "actors" } else { "objects" };
        tracks[list][id.to_string()].clone()
    };
    assert!(counts.iter().all(|(id, count)| track(id)["box_count"] == *count), "{tracks}");

    let list = fs::read_to_string(set.join("frames.jsonl")).unwrap();
    let altitude = |line: &str| -> f64 {
        let line: Value = serde_json::from_str(line).unwrap();
        line["weather"]["sun_altitude_rad"].as_f64().unwrap().to_degrees()
    };
    let altitudes: Vec<_> = list.lines().map(|line| altitude(line).round()).collect();
    assert_eq!(altitudes, [60.0, 60.0, -10.0, -10.0]);

    // Broken lines lie on their dashes where these are near enough to fill a pixel.
    let map = read("lanes.json");
    let (mut painted, mut points) = (0, 0);
    for frame in frames {
        let (width, tags) = image(&set, "tag", frame);
        let lines = read(&format!("lanes/{frame:06}.json"));
        for line in lines["cameras"]["front"].as_array().unwrap() {
            let boundary = &map["boundaries"][line["boundary"].as_u64().unwrap() as usize];
            for key in ["type", "color", "road", "left_lane_id", "right_lane_id"] {
                assert_eq!(line[key], boundary[key]);
            }
            if line["type"] != "broken" {
                continue;
            }
            let line: Vec<[f64; 2]> = serde_json::from_value(line["points_px"].clone()).unwrap();
            for ends in line.windows(2) {
                for step in 0..10 {
                    let share = f64::from(step) / 10.0;
                    let at =
                        [0, 1].map(|axis| ends[0][axis] + (ends[1][axis] - ends[0][axis]) * share);
                    let [x, y] = at.map(|px| px as usize);
                    // The lower third of the image is within 15 m.
                    if !(400..599).contains(&y) || !(1..width - 1).contains(&x) {
                        continue;
                    }
                    let near = (x - 1..=x + 1).map(|x| tags[y * width + x]);
                    painted += usize::from(near.clone().any(|tag| tag == Tag::RoadLine as u8));
                    points += 1;
                }
            }
        }
    }
    // A quarter of a broken line is dashes; a hundredth of a road is paint.
    assert!(points > 40 && painted * 6 > points, "{painted} of {points} points");
}
