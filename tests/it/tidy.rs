//! The drawing of the rooms, held against the manifests.

use std::{collections::BTreeSet, process::Command};

use serde_json::Value;

/// Who may name whom: the arrows of ARCHITECTURE.md, and nothing else.
const ARROWS: [(&str, &[&str]); 15] = [
    ("mesh", &[]),
    ("bus", &[]),
    ("record", &["bus"]),
    ("road", &["mesh"]),
    ("mapgen", &["mesh", "road"]),
    ("town", &["mapgen", "mesh", "road"]),
    ("bake", &["mapgen", "mesh", "road", "town"]),
    ("sim-host", &["bake", "bus", "mapgen", "mesh", "record", "road", "town"]),
    ("traffic", &["bake", "bus", "mapgen", "mesh", "road", "town"]),
    ("sensor-render", &["bake", "bus", "mapgen", "mesh", "road", "town"]),
    ("client-lib", &["bake", "bus", "mesh", "road"]),
    ("carla-gateway", &["bake", "client-lib", "mapgen", "mesh", "record", "road", "town"]),
    ("bench", &["bake", "client-lib", "mapgen", "mesh", "road", "town"]),
    (
        "omnibus",
        &[
            "bus",
            "mesh",
            "record",
            "road",
            "mapgen",
            "town",
            "bake",
            "sim-host",
            "traffic",
            "sensor-render",
            "client-lib",
            "carla-gateway",
        ],
    ),
    (
        "tests",
        &[
            "bus",
            "mesh",
            "record",
            "road",
            "mapgen",
            "town",
            "bake",
            "sim-host",
            "traffic",
            "sensor-render",
            "client-lib",
            "carla-gateway",
            "omnibus",
        ],
    ),
];

/// Packages that belong to one room alone.
const OWNED: [(&str, &str); 8] = [
    ("rapier3d", "sim-host"),
    ("wgpu", "sensor-render"),
    ("ash", "sensor-render"),
    ("iceoryx2", "bus"),
    ("mcap", "record"),
    ("memmap2", "bake"),
    ("quick-xml", "road"),
    ("zstd", "record"),
];

fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What is wrong with the manifests, as sentences.
fn faults(packages: &[Value]) -> Vec<String> {
    let mut faults = Vec::new();
    let drawn: BTreeSet<&str> = ARROWS.iter().map(|(room, _)| *room).collect();
    for package in packages {
        let name = package["name"].as_str().unwrap();
        let room = name.strip_prefix("omnibus-").unwrap_or(name);
        let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| *name == room) else {
            faults.push(format!("{room} is no room of the drawing"));
            continue;
        };
        // Every kind: normal, dev, build, and those of one target only.
        for dependency in package["dependencies"].as_array().unwrap() {
            let name = dependency["name"].as_str().unwrap();
            let name = name.strip_prefix("omnibus-").unwrap_or(name);
            if drawn.contains(name) && !allowed.contains(&name) {
                faults.push(format!("{room} names {name}, which the drawing does not show"));
            }
            if let Some((_, owner)) = OWNED.iter().find(|(package, _)| *package == name)
                && *owner != room
            {
                faults.push(format!("{room} names {name}, which is {owner}'s alone"));
            }
        }
    }
    faults
}

#[test]
fn rooms_name_only_whom_the_drawing_shows() {
    let metadata = metadata();
    let packages = metadata["packages"].as_array().unwrap();
    assert_eq!(faults(packages), Vec::<String>::new());
    assert_eq!(packages.len(), ARROWS.len(), "a room of the drawing is missing");
}

#[test]
fn a_forbidden_arrow_of_any_kind_is_found() {
    for kind in [Value::Null, "dev".into(), "build".into()] {
        let package = serde_json::json!({
            "name": "traffic",
            "dependencies": [{ "name": "rapier3d", "kind": kind }, { "name": "sim-host", "kind": kind }],
        });
        assert_eq!(faults(&[package]).len(), 2);
    }
}

#[test]
fn the_drawing_in_the_architecture_names_every_room() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../ARCHITECTURE.md"))
        .unwrap();
    for (room, _) in ARROWS {
        assert!(text.contains(&format!("`{room}`")), "ARCHITECTURE.md does not name `{room}`");
    }
    for channel in bus::CHANNELS {
        assert!(
            text.contains(&format!("`{}`", channel.name)),
            "ARCHITECTURE.md lacks `{}`",
            channel.name
        );
    }
}

#[test]
fn the_top_level_holds_the_doors_and_nothing_else() {
    let doors = [
        "bench",
        "client-lib",
        "crates",
        "docs",
        "sensor-render",
        "sim-host",
        "target",
        "tests",
        "traffic",
    ];
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let entries = std::fs::read_dir(root).unwrap().flatten().filter(|e| e.path().is_dir());
    let names = entries.map(|e| e.file_name().into_string().unwrap());
    let strange: Vec<_> =
        names.filter(|n| !n.starts_with('.') && !doors.contains(&n.as_str())).collect();
    assert_eq!(strange, Vec::<String>::new());
}
