//! `omnibus map` on a generated town.

use std::{path::Path, process::Output};

use serde_json::Value;

use crate::kit::{Scratch, omnibus};

fn map(args: &[&str]) -> Output {
    omnibus().arg("map").args(args).output().unwrap()
}

/// Returns the output lines of a successful command.
fn said(args: &[&str]) -> Vec<String> {
    let ended = map(args);
    assert!(ended.status.success(), "{args:?}: {}", String::from_utf8_lossy(&ended.stderr));
    String::from_utf8(ended.stdout).unwrap().lines().map(str::to_owned).collect()
}

fn values(args: &[&str]) -> Vec<Value> {
    said(args).iter().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn generated(folder: &Path) -> String {
    let path = folder.join("town.xodr");
    let path = path.to_str().unwrap().to_owned();
    said(&["generate", "--seed", "3", "--size", "300", "--out", &path]);
    path
}

#[test]
fn every_subcommand_works_on_a_generated_map() {
    let scratch = Scratch::new();
    let town = generated(scratch.path());
    assert!(said(&["info", &town]).iter().any(|line| line.contains("spawn points")));
    assert_eq!(said(&["validate", &town]).len(), 1);

    let waypoints = values(&["waypoints", &town, "--every", "5", "--step", "5"]);
    assert!(waypoints.len() > 500);
    let place = |w: &Value| [w["x_m"].as_f64().unwrap(), w["y_m"].as_f64().unwrap()];
    let linked = waypoints.iter().filter(|w| !w["next"].as_array().unwrap().is_empty());
    assert!(linked.count() > 400);
    assert!(!values(&["topology", &town]).is_empty());
    assert!(!values(&["landmarks", &town]).is_empty());
    assert!(!values(&["crosswalks", &town]).is_empty());

    // Each waypoint is the nearest one to itself, on asphalt or paint.
    let points = scratch.path().join("points.csv");
    let rows = waypoints.iter().step_by(25).map(|w| {
        let [x, y] = place(w);
        format!("{x},{y}\n")
    });
    let rows: Vec<String> = rows.collect();
    std::fs::write(&points, rows.concat()).unwrap();
    let found = values(&["query", &town, "--points", points.to_str().unwrap()]);
    assert_eq!(found.len(), rows.len());
    for line in &found {
        assert!(line["left_m"].as_f64().unwrap().abs() < 0.01, "{line}");
        assert!(matches!(line["tag"].as_str(), Some("Roads" | "RoadLine")), "{line}");
        let away = line["ground_m"].as_f64().unwrap() - line["waypoint"]["z_m"].as_f64().unwrap();
        assert!(away.abs() < 0.05, "{line}");
    }

    // Every driving lane of a generated town reaches every other.
    let [a, b] = [&waypoints[0], &waypoints[waypoints.len() / 2]].map(|w| {
        format!("{}:{}:{}", w["road"].as_str().unwrap(), w["lane"], w["s_m"].as_f64().unwrap())
    });
    let legs = values(&["route", &town, &a, &b, "--json"]);
    assert!(!legs.is_empty());
}

#[test]
fn pictures_and_models_have_the_format_of_their_extension() {
    let scratch = Scratch::new();
    let town = generated(scratch.path());
    for (verb, name, magic) in [
        ("render", "town.png", &b"\x89PNG"[..]),
        ("render", "town.svg", b"<svg"),
        ("export", "town.glb", b"glTF"),
        ("export", "town.obj", b"# town"),
    ] {
        let out = scratch.path().join(name);
        said(&[verb, &town, "--out", out.to_str().unwrap()]);
        let bytes = std::fs::read(&out).unwrap();
        assert!(bytes.starts_with(magic), "{name}");
        assert!(bytes.len() > 10_000, "{name}");
    }
    let model = std::fs::read_to_string(scratch.path().join("town.obj")).unwrap();
    for part in ["g Car.Glass", "g TrafficLight.SignalRed", "g Building."] {
        assert!(model.contains(part), "{part}: not in the exported town");
    }
}

#[test]
fn an_error_in_a_map_is_reported_with_its_line() {
    let scratch = Scratch::new();
    let town = generated(scratch.path());
    let text = std::fs::read_to_string(&town).unwrap();
    let broken = scratch.path().join("broken.xodr");
    std::fs::write(&broken, text.replacen("<successor id=\"-1\"/>", "<successor id=\"-77\"/>", 1))
        .unwrap();
    let ended = map(&["validate", broken.to_str().unwrap()]);
    assert!(!ended.status.success());
    let said = String::from_utf8(ended.stdout).unwrap();
    assert!(said.contains("broken.xodr:") && said.contains("lane -77"), "{said}");

    std::fs::write(&broken, &text[..text.len() / 2]).unwrap();
    let ended = map(&["info", broken.to_str().unwrap()]);
    let said = String::from_utf8(ended.stderr).unwrap();
    assert!(!ended.status.success() && said.contains("broken.xodr:"), "{said}");
    for args in [
        &["waypoints", &town, "--every", "0"][..],
        &["waypoints", &town, "--types", "flying"],
        &["route", &town, "nowhere", "0,0"],
        &["render", &town, "--out", "town.bmp"],
        &["generate", "--size", "7"],
    ] {
        let ended = map(args);
        let said = String::from_utf8(ended.stderr).unwrap();
        assert!(!ended.status.success() && said.lines().count() == 1, "{args:?}: {said}");
    }
}
