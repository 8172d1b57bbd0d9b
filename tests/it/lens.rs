//! Collections by cameras with lenses: what is drawn into their images fits what they show.

use std::{fs, path::Path};

use serde_json::Value;

use crate::kit::{Scratch, omnibus, small_map};

const PLAN: &str = "
frames = 8
every = 5
warmup = 40

[traffic]
vehicles = 10
vehicles_near = 8
walkers = 6
radius_m = 40.0

[[sensor]]
name = \"barrel\"
kind = \"camera\"
position_m = [1.5, 0.0, 1.6]
width_px = 400
height_px = 240
intrinsics_px = [205.0, 208.0, 206.5, 117.0]
lens = { model = \"brown-conrady\", coefficients = [-0.22, 0.05, 0.002, -0.001, -0.004] }
outputs = [\"depth\", \"instance\"]

[[sensor]]
name = \"around\"
kind = \"camera\"
position_m = [0.0, 0.0, 2.2]
width_px = 320
height_px = 320
fov_deg = 190.0
lens = { model = \"fisheye\", coefficients = [0.02, -0.004], max_angle_deg = 95.0 }
outputs = [\"color\", \"depth\", \"instance\"]

[[sensor]]
name = \"top\"
kind = \"lidar\"
position_m = [0.0, 0.0, 2.3]
channels = 16
columns = 720
elevations_deg = [-30.0, 5.0]
";

fn run(args: &[&str], paths: &[&Path]) -> (bool, String) {
    let output = omnibus().args(args).args(paths).output().unwrap();
    (output.status.success(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

fn edges(view: &Value, key: &str) -> [f32; 4] {
    serde_json::from_value(view[key].clone()).unwrap()
}

#[test]
fn boxes_silhouettes_and_depths_of_a_collection_follow_the_lens() {
    let scratch = Scratch::new();
    let (plan, set) = (scratch.path().join("plan.toml"), scratch.path().join("set"));
    fs::write(&plan, format!("maps = [\"{}\"]\n{PLAN}", small_map())).unwrap();
    let more = ["--scene", "0", "--device", "cpu", "--out"];
    let output = omnibus().arg("collect").arg(&plan).args(more).arg(&set).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let metadata: Value =
        serde_json::from_slice(&fs::read(set.join("metadata.json")).unwrap()).unwrap();
    let sensors = metadata["settings"]["sensors"].as_array().unwrap();
    let camera = |name: &str| &sensors.iter().find(|one| one["name"] == name).unwrap()["camera"];
    assert_eq!(camera("barrel")["lens"]["model"], "brown-conrady");
    assert_eq!(camera("barrel")["intrinsics_px"][0], serde_json::json!([205.0, 0.0, 206.5]));
    assert_eq!(camera("around")["lens"]["coefficients"][0], 0.02);

    let (mut seen, mut whole, mut lines) = (0, 0, 0);
    for line in fs::read_to_string(set.join("frames.jsonl")).unwrap().lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        let read = |folder: &str| -> Value {
            let frame = line["frame"].as_u64().unwrap();
            let text = fs::read(set.join(format!("{folder}/{frame:06}.json"))).unwrap();
            serde_json::from_slice(&text).unwrap()
        };
        for actor in read("boxes")["actors"].as_array().unwrap() {
            for (name, view) in actor["cameras"].as_object().unwrap() {
                let [left, top, right, bottom] = edges(view, "visible_box_px");
                let [l, t, r, b] = edges(view, "projected_box_px");
                // Steered wheels and the grid of a surface reach a little beyond.
                let slack = 2.0 + 0.03 * (right - left).max(bottom - top);
                let encloses = l < left + slack && t < top + slack;
                // The limbs of walkers swing out of their boxes.
                assert!(
                    actor["tag_name"] == "Pedestrian"
                        || encloses && r > right - slack && b > bottom - slack,
                    "{name}: {view} of {}",
                    actor["blueprint"]
                );
                let pixels = |key: &str| view[key].as_f64().unwrap();
                seen += 1;
                if pixels("visible_px") > 100.0 && pixels("occluded_fraction") < 0.05 {
                    whole += 1;
                }
            }
        }
        let lanes = read("lanes");
        for name in ["barrel", "around"] {
            lines += lanes["cameras"][name].as_array().unwrap().len();
        }
    }
    assert!(
        seen > 20 && whole > 3 && lines > 20,
        "{seen} boxes, {whole} unoccluded, {lines} lines"
    );

    // Boxes against instances, and the lidar against the depths.
    let (is_sound, text) = run(&["collect", "--verify"], &[&set]);
    assert!(is_sound, "{text}");
    assert!(text.contains("barrel") && text.contains("around"), "{text}");

    for (format, exports) in [("mcap", true), ("yolo", true), ("kitti", false), ("nuscenes", false)]
    {
        let out = scratch.path().join(format);
        let (done, text) =
            run(&["export", "--format", format, "--out"], &[out.as_path(), set.as_path()]);
        assert_eq!(done, exports, "{format}: {text}");
        assert!(exports || text.contains("has a lens, but calibrations of"), "{format}: {text}");
    }
}
