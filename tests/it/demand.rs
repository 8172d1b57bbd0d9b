//! Vehicles of a route file in a collection.

use std::{fs, path::Path};

use road::{LaneTypes, Network};
use serde_json::Value;

use crate::{
    kit::{Scratch, eventually, small_map},
    plan::{assert_same, collect, finish},
};

const LIDAR: &str = "
[[sensor]]
name = \"top\"
kind = \"lidar\"
position_m = [0.0, 0.0, 2.2]
channels = 16
columns = 360
";

/// Returns a place 60 m along a lane, and the name that netconvert gives the lane's edge.
fn start(network: &Network) -> ([f64; 2], String) {
    let lane = network.lanes().iter().find(|lane| {
        lane.junction.is_none() && LaneTypes::DRIVABLE.contains(lane.kind) && lane.length_m > 90.0
    });
    let lane = lane.expect("the map has a road of 90 m");
    let at = network.place(road::LanePoint { lane: lane.index, along_m: 60.0 });
    let sign = if lane.id < 0 { "-" } else { "" };
    let edge = format!("{sign}{}", network.roads()[lane.road as usize].id);
    ([at.position.x, at.position.y], edge)
}

fn small_network() -> Network {
    Network::parse(&fs::read_to_string(small_map()).unwrap()).unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn vehicles_of_a_route_file_depart_in_a_collection_and_after_every_kill() {
    let scratch = Scratch::new();
    let (routes, plan) = (scratch.path().join("day.rou.xml"), scratch.path().join("plan.toml"));
    let network = small_network();
    let ([x, y], edge) = start(&network);
    // The bus departs before the scene begins, and would hide the car.
    let vehicle = |id: &str, depart: f64, more: &str| {
        format!(
            "<vehicle id=\"{id}\" type=\"{id}\" depart=\"{depart}\" {more}>\
             <route edges=\"{edge}\"/></vehicle>"
        )
    };
    let text = format!(
        "<routes><vType id=\"bus\" vClass=\"bus\"/><vType id=\"car\" vClass=\"passenger\"/>{}{}</routes>",
        vehicle("bus", 50.0, "departPos=\"30\""),
        vehicle("car", 100.5, ""),
    );
    fs::write(&routes, text).unwrap();
    let write_plan = |demand: &str| {
        let traffic = "[traffic]\nvehicles = 0\nvehicles_near = 0\nwalkers = 0\nin_view = 0.0\n";
        let ego = format!("[ego]\nroutes = [[[{x:.2}, {y:.2}]]]\n");
        let head = format!("maps = [\"{}\"]\nframes = 12\nwarmup = 30\n", small_map());
        fs::write(&plan, format!("{head}{ego}{traffic}{demand}{LIDAR}")).unwrap();
    };
    let out = |name: &str| scratch.path().join(name);
    let seen = |name: &str| -> Vec<String> {
        let set = out(name).join("scene-0000");
        let lines = fs::read_to_string(set.join("frames.jsonl")).unwrap();
        let last: Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
        let boxes = json(&set.join(format!("boxes/{:06}.json", last["frame"].as_u64().unwrap())));
        let actors = boxes["actors"].as_array().unwrap().iter();
        let blueprints = actors.map(|actor| actor["blueprint"].as_str().unwrap().to_owned());
        blueprints.filter(|blueprint| blueprint.starts_with("vehicle.")).collect()
    };

    write_plan("");
    finish(collect(&plan, &out("none"), &[]));
    assert_eq!(seen("none"), [""; 0]);

    let demand = format!("[demand]\nroutes = {:?}\nbegin_secs = 100.0\n", routes.to_str().unwrap());
    write_plan(&demand);
    finish(collect(&plan, &out("whole"), &[]));
    let cars = seen("whole");
    assert_eq!(cars.len(), 1, "{cars:?}");
    let (_, blueprint) = town::blueprint(&cars[0]).unwrap();
    assert!(blueprint.base_type == "car", "{cars:?}");
    let settings = &json(&out("whole").join("scene-0000/metadata.json"))["settings"];
    assert_eq!(settings["routes_begin_secs"], 100.0);

    let mut killed = collect(&plan, &out("killed"), &[]);
    let lines = out("killed").join("scene-0000/frames.jsonl");
    let has_frames = || fs::read_to_string(&lines).is_ok_and(|text| text.lines().count() > 2);
    eventually("three frames are complete", has_frames);
    killed.kill().unwrap();
    killed.wait().unwrap();
    eventually("the folder of the scene is free", || {
        let lock = fs::File::open(out("killed").join("scene-0000/.lock"));
        lock.map_or(true, |file| file.try_lock().is_ok())
    });
    finish(collect(&plan, &out("killed"), &["--resume"]));
    assert_same(&out("whole"), &out("killed"));
}

#[test]
fn faults_of_a_route_file_end_a_collection_before_it_begins() {
    let scratch = Scratch::new();
    let (routes, plan) = (scratch.path().join("day.rou.xml"), scratch.path().join("plan.toml"));
    let out = scratch.path().join("out");
    let refused = |more: &[&str]| {
        let ended = collect(&plan, &out, more).wait_with_output().unwrap();
        assert!(!ended.status.success() && !out.exists());
        String::from_utf8(ended.stderr).unwrap()
    };
    let file = routes.to_str().unwrap();
    fs::write(&plan, format!("maps = [\"{}\"]\n", small_map())).unwrap();
    let vehicle = |edge: &str| {
        let route = format!("<route edges=\"{edge}\"/>");
        let text =
            format!("<routes>\n<vehicle id=\"a\" depart=\"5\">{route}</vehicle>\n</routes>\n");
        fs::write(&routes, text).unwrap();
    };
    vehicle("nowhere");
    let said = refused(&["--routes", file]);
    assert!(said.contains("day.rou.xml:2") && said.contains("\"nowhere\""), "{said}");
    vehicle(&start(&small_network()).1);
    let said = refused(&["--routes", file, "--routes-begin", "6"]);
    assert!(said.contains("none of its 1 vehicles departs at 6 s or later"), "{said}");
    let said = refused(&["--routes-begin", "6"]);
    assert!(said.contains("--routes-begin has no effect without --routes"), "{said}");
    fs::write(&plan, "maps = [\"Flatford\", \"Altmarkt\"]\n").unwrap();
    let said = refused(&["--routes", file]);
    assert!(said.contains("for one map, but the plan has 2"), "{said}");
}
