//! The radars of collections, checked against the motion that the data set states.

use std::{collections::BTreeMap, fs, path::Path};

use glam::{Quat, Vec3};
use serde_json::Value;

use crate::kit::{Scratch, omnibus, small_map};

const PLAN: &str = "
frames = 20
every = 2
warmup = 40

[traffic]
vehicles = 8
vehicles_near = 8
walkers = 6
radius_m = 60.0

[[event]]
at_secs = 0.2
crossing = { ahead_m = 12.0, speed_mps = 1.5 }

[[sensor]]
name = \"RADAR_FRONT\"
kind = \"radar\"
position_m = [2.6, 0.0, 0.6]
horizontal_fov_deg = 80.0
vertical_fov_deg = 12.0
range_m = 60.0
points_per_second = 4000.0

[[sensor]]
name = \"RADAR_LEFT\"
kind = \"radar\"
position_m = [0.0, 1.3, 0.8]
yaw_deg = 90.0
rate_hz = 5.0

[[sensor]]
name = \"cells\"
kind = \"radar\"
position_m = [2.6, 0.0, 0.6]
horizontal_fov_deg = 80.0
vertical_fov_deg = 12.0
receiver = { ghosts = true, snr_min_db = 15.0 }

[[sensor]]
name = \"top\"
kind = \"lidar\"
position_m = [0.0, 0.0, 2.2]
channels = 8
columns = 180

[[sensor]]
name = \"front\"
kind = \"camera\"
position_m = [1.5, 0.0, 1.6]
width_px = 96
height_px = 48
outputs = [\"color\", \"instance\"]
";

fn vector(value: &Value) -> Vec3 {
    Vec3::from_array(serde_json::from_value(value.clone()).unwrap())
}

/// The detections of a frame with the id of each.
fn detections(set: &Path, radar: &str, frame: u64) -> Vec<([f32; 4], u32)> {
    let read = |what: &str| fs::read(set.join(format!("{radar}/{what}/{frame:06}.bin"))).unwrap();
    let word = |bytes: &[u8]| <[u8; 4]>::try_from(bytes).unwrap();
    let (rows, labels) = (read("detections"), read("labels"));
    assert_eq!((rows.len() % 16, rows.len() / 16), (0, labels.len() / 8));
    let row = |row: &[u8]| [0, 4, 8, 12].map(|at| f32::from_le_bytes(word(&row[at..at + 4])));
    let rows = rows.chunks_exact(16).map(row);
    rows.zip(labels.chunks_exact(8).map(|label| u32::from_le_bytes(word(&label[..4])))).collect()
}

/// Checks the powers of the radar with a receiver, and the range rates of what rests, against its own
/// velocity in its space. Returns the number of detections.
fn check_cells(set: &Path, frame: u64, own: Vec3) -> usize {
    let found = detections(set, "cells", frame);
    let powers = fs::read(set.join(format!("cells/powers/{frame:06}.bin"))).unwrap();
    assert_eq!(powers.len(), found.len() * 12);
    let floats: Vec<f32> =
        powers.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    for (([rate, azimuth, altitude, depth], id), power) in found.iter().zip(floats.chunks_exact(3))
    {
        let [power_dbm, snr_db, cross_section_dbsm] = [power[0], power[1], power[2]];
        assert!(snr_db >= 15.0 && (snr_db - power_dbm - 120.0).abs() < 1e-3, "{power:?}");
        // The radar equation with the numbers of the plan.
        let lambda_db = 20.0 * (299_792_458.0f32 / 77e9).log10();
        let four_pi_db = 30.0 * (4.0 * std::f32::consts::PI).log10();
        let due = 62.0 + lambda_db + cross_section_dbsm - four_pi_db - 40.0 * depth.log10();
        assert!((power_dbm - due).abs() < 0.01, "{power:?} {due}");
        let level = altitude.cos();
        let to = Vec3::new(azimuth.cos() * level, azimuth.sin() * level, altitude.sin());
        if *id >= 1 << 23 {
            // The cell may be as wide as its resolution, and the mean lie beside its parts.
            assert!((rate + own.dot(to)).abs() < 0.15, "{rate} {}", own.dot(to));
        }
    }
    found.len()
}

fn run(args: &[&str], path: &Path) -> (bool, String) {
    let output = omnibus().args(args).arg(path).output().unwrap();
    (output.status.success(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

#[test]
fn range_rates_are_those_of_the_motions_in_the_data_set_and_verify_counts_detections() {
    let scratch = Scratch::new();
    let (plan, set) = (scratch.path().join("plan.toml"), scratch.path().join("set"));
    fs::write(&plan, format!("maps = [\"{}\"]\n{PLAN}", small_map())).unwrap();
    let more = ["--scene", "0", "--device", "cpu", "--out"];
    let output = omnibus().arg("collect").arg(&plan).args(more).arg(&set).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let list = fs::read_to_string(set.join("frames.jsonl")).unwrap();
    let (mut still, mut moving, mut crossing, mut last, mut cells) = (0, 0, 0, 0, 0);
    for line in list.lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        let frame = line["frame"].as_u64().unwrap();
        let text = fs::read(set.join(format!("boxes/{frame:06}.json"))).unwrap();
        let boxes: Value = serde_json::from_slice(&text).unwrap();
        let actors: BTreeMap<u64, &Value> = (boxes["actors"].as_array().unwrap().iter())
            .map(|one| (one["actor_id"].as_u64().unwrap(), one))
            .collect();
        let own = vector(&line["ego"]["velocity_mps"]);
        for pose in line["sensors"].as_array().unwrap() {
            let radar = pose["name"].as_str().unwrap();
            let rotation = &pose["world_from_sensor"]["rotation_xyzw"];
            let rotation = Quat::from_array(serde_json::from_value(rotation.clone()).unwrap());
            if radar == "cells" {
                cells += check_cells(&set, frame, rotation.inverse() * own);
            }
            if !radar.starts_with("RADAR") {
                continue;
            }
            let found = detections(&set, radar, frame);
            assert_eq!(line["point_counts"][radar], found.len());
            let mut counts: BTreeMap<u64, u64> = BTreeMap::new();
            for ([rate, azimuth, altitude, depth], id) in found {
                let level = altitude.cos();
                let to = Vec3::new(azimuth.cos() * level, azimuth.sin() * level, altitude.sin());
                let is_actor = id < 1 << 23;
                let velocity = match actors.get(&id.into()) {
                    Some(actor) => vector(&actor["velocity_mps"]),
                    None => {
                        assert!(!is_actor, "frame {frame}, {radar}: actor {id} has no box");
                        Vec3::ZERO
                    }
                };
                let expected = (velocity - own).dot(rotation * to);
                assert!((rate - expected).abs() < 1e-3, "{radar}: {rate} {expected}");
                assert!((0.0..=100.0).contains(&depth));
                *counts.entry(id.into()).or_default() += 1;
                still += u32::from(!is_actor && own.length() > 2.0);
                moving += u32::from(is_actor && velocity.length() > 0.5);
                let is_pedestrian = is_actor && actors[&id.into()]["tag_name"] == "Pedestrian";
                crossing += u32::from(is_pedestrian && depth < 12.0);
            }
            for (id, actor) in &actors {
                let stated = actor["radar_points"][radar].as_u64();
                assert_eq!(stated, counts.get(id).copied(), "frame {frame}, {radar}, id {id}");
            }
            last = frame;
        }
    }
    assert!(cells > 100, "{cells}");
    assert!(still > 500 && moving > 20 && crossing > 5, "{still} {moving} {crossing}");
    let (is_sound, text) = run(&["collect", "--verify"], &set);
    assert!(is_sound, "{text}");

    // The rays of a radar are no lidar to other readers.
    let export = |format: &str| {
        let out = scratch.path().join(format);
        let mut command = omnibus();
        command.arg("export").arg(&set).args(["--format", format, "--out"]).arg(&out);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        out
    };
    let nuscenes = export("nuscenes");
    let tables = nuscenes.join("v1.0-trainval");
    let table = |name: &str| -> Vec<Value> {
        let text = fs::read(tables.join(format!("{name}.json"))).unwrap();
        serde_json::from_slice(&text).unwrap()
    };
    let modality = |channel: &str| {
        let row = table("sensor").into_iter().find(|row| row["channel"] == channel).unwrap();
        row["modality"].as_str().unwrap().to_owned()
    };
    assert_eq!(["RADAR_FRONT", "LIDAR_TOP"].map(modality), ["radar", "lidar"]);
    let annotated: u64 =
        table("sample_annotation").iter().map(|row| row["num_radar_pts"].as_u64().unwrap()).sum();
    assert!(annotated > 0);
    for folder in ["samples", "sweeps"] {
        let files = fs::read_dir(nuscenes.join(folder).join("RADAR_FRONT")).unwrap();
        assert!(files.count() > 2, "{folder}");
    }
    for format in ["coco", "kitti", "mcap", "webdataset", "yolo"] {
        export(format);
    }

    // A detection that is missing is a fault.
    for what in ["detections", "labels"] {
        let path = set.join(format!("RADAR_FRONT/{what}/{last:06}.bin"));
        let whole = fs::read(&path).unwrap();
        let cut = if what == "labels" { 8 } else { 16 };
        fs::write(&path, &whole[cut..]).unwrap();
        let (is_sound, text) = run(&["collect", "--verify"], &set);
        let named = format!("RADAR_FRONT/{what}/{last:06}.bin: bytes ");
        assert!(!is_sound && text.contains(&named), "{text}");
        fs::write(&path, whole).unwrap();
    }
}
