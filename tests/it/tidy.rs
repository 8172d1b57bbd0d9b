//! The repository's own rules: crate dependencies, module cycles, claims of READMEs, code in pages.

mod claims;
mod cycles;
mod docs;
mod source;

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

use crate::kit::note_skipped;

/// Which crate may depend on which: the diagram of ARCHITECTURE.md, and nothing else.
const DIAGRAM: &[(&str, &[&str])] = &[
    ("mesh", &[]),
    ("protocol", &[]),
    ("bus", &["protocol"]),
    ("simulated-bus", &["protocol"]),
    ("record", &["bus", "protocol"]),
    ("road", &["mesh"]),
    ("mapgen", &["mesh", "road"]),
    ("town", &["mapgen", "mesh", "road"]),
    ("walkable", &["mapgen", "mesh", "road", "town"]),
    ("demand", &["mapgen", "mesh", "road"]),
    ("bake", &["mapgen", "mesh", "road", "town"]),
    (
        "sim-host",
        &["bake", "bus", "mapgen", "mesh", "protocol", "record", "road", "simulated-bus", "town"],
    ),
    ("traffic", &["bake", "bus", "mapgen", "mesh", "protocol", "road", "town", "walkable"]),
    ("sensor-render", &["bake", "bus", "mapgen", "mesh", "protocol", "road", "town"]),
    ("client-lib", &["bake", "bus", "mesh", "protocol", "road", "town"]),
    ("c", &["client-lib"]),
    ("maps", &["bus", "mapgen"]),
    ("python", &["client-lib", "environment", "mapgen", "maps", "protocol"]),
    (
        "carla-gateway",
        &["bake", "client-lib", "mapgen", "mesh", "record", "road", "town", "walkable"],
    ),
    ("ros2", &["client-lib"]),
    ("foxglove", &[]),
    ("image-file", &[]),
    ("view", &["client-lib", "foxglove", "image-file"]),
    (
        "environment",
        &[
            "bake",
            "mapgen",
            "mesh",
            "protocol",
            "road",
            "sensor-render",
            "sim-host",
            "town",
            "traffic",
        ],
    ),
    (
        "bench",
        &["bake", "client-lib", "environment", "image-file", "mapgen", "mesh", "road", "town"],
    ),
    ("fuzz", &["carla-gateway", "mesh", "protocol", "record", "road", "sim-host", "town"]),
    (
        "omnibus",
        &[
            "bus",
            "protocol",
            "mesh",
            "record",
            "road",
            "mapgen",
            "maps",
            "town",
            "bake",
            "sim-host",
            "traffic",
            "sensor-render",
            "client-lib",
            "demand",
            "carla-gateway",
            "foxglove",
            "image-file",
            "ros2",
            "view",
        ],
    ),
    (
        "tests",
        &[
            "environment",
            "bus",
            "protocol",
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

/// Packages that one crate alone may depend on.
const OWNED: &[(&str, &str)] = &[
    ("rapier3d", "sim-host"),
    ("wgpu", "sensor-render"),
    ("ash", "sensor-render"),
    ("iceoryx2", "bus"),
    ("memmap2", "bake"),
    ("socket2", "ros2"),
    ("axum", "view"),
    ("mozjpeg", "image-file"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The workspace's packages, as `cargo metadata` describes them.
fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// A package's name without the product's. The program's package is `omnibus-sim`, since `omnibus`
/// belongs to others in the package indexes.
fn crate_name(package: &Value) -> &str {
    match package["name"].as_str().unwrap() {
        "omnibus-sim" => "omnibus",
        name => name.strip_prefix("omnibus-").unwrap_or(name),
    }
}

/// The folder of each crate.
fn folders() -> Vec<PathBuf> {
    let folder = |package: &Value| {
        Path::new(package["manifest_path"].as_str().unwrap()).parent().unwrap().to_owned()
    };
    packages().iter().map(folder).collect()
}

/// What is wrong with the manifests, as sentences.
fn faults(packages: &[Value]) -> Vec<String> {
    let mut faults = Vec::new();
    let known: BTreeSet<&str> = DIAGRAM.iter().map(|(name, _)| *name).collect();
    for package in packages {
        let user = crate_name(package);
        let Some((_, allowed)) = DIAGRAM.iter().find(|(name, _)| *name == user) else {
            faults.push(format!("{user} is not in the crate diagram"));
            continue;
        };
        // Every kind: normal, dev, build, and those of one target only.
        for dependency in package["dependencies"].as_array().unwrap() {
            let name = crate_name(dependency);
            if known.contains(name) && !allowed.contains(&name) {
                faults.push(format!(
                    "{user} depends on {name}, which the crate diagram does not show; draw it in \
                     ARCHITECTURE.md first"
                ));
            }
            if let Some((_, owner)) = OWNED.iter().find(|(package, _)| *package == name)
                && *owner != user
            {
                faults.push(format!("{user} depends on {name}, which only {owner} may"));
            }
        }
    }
    faults
}

#[test]
fn crates_depend_only_on_what_the_diagram_shows() {
    let packages = packages();
    assert_eq!(faults(&packages), Vec::<String>::new());
    assert_eq!(
        packages.len(),
        DIAGRAM.len(),
        "the crate diagram names a crate that does not exist"
    );
}

#[test]
fn a_forbidden_dependency_of_any_kind_is_found() {
    for kind in [Value::Null, "dev".into(), "build".into()] {
        let package = serde_json::json!({
            "name": "traffic",
            "dependencies": [{ "name": "rapier3d", "kind": kind }, { "name": "sim-host", "kind": kind }],
        });
        assert_eq!(faults(&[package]).len(), 2);
    }
}

#[test]
fn a_crate_lies_in_the_folder_of_its_name() {
    for package in packages() {
        let manifest = Path::new(package["manifest_path"].as_str().unwrap());
        let folder = manifest.parent().unwrap().file_name().unwrap();
        assert_eq!(folder, crate_name(&package));
        assert!(
            crate_name(&package) != package["name"],
            "{} is not named omnibus-…",
            package["name"]
        );
    }
}

#[test]
fn modules_of_a_crate_do_not_read_each_other_in_cycles() {
    let mut faults = Vec::new();
    for folder in folders() {
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        let cycles = cycles::cycles(&folder.join("src"));
        faults.extend(cycles.into_iter().map(|cycle| format!("{name}: {cycle}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_architecture_names_every_crate_and_every_channel() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for (name, _) in DIAGRAM {
        assert!(text.contains(&format!("`{name}`")), "ARCHITECTURE.md does not name `{name}`");
    }
    for channel in bus::CHANNELS {
        assert!(
            text.contains(&format!("`{}`", channel.name)),
            "ARCHITECTURE.md lacks `{}`",
            channel.name
        );
    }
}

/// The files that git tracks, by their path from the root; nothing where there is no git checkout.
fn tracked() -> Option<Vec<String>> {
    let output = Command::new("git").args(["ls-files"]).current_dir(root()).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect())
}

#[test]
fn the_top_level_holds_the_entry_points_and_nothing_else() {
    let Some(files) = tracked() else {
        note_skipped("the_top_level_holds_the_entry_points_and_nothing_else", "no git checkout");
        return;
    };
    let expected =
        ["bench", "client-lib", "crates", "docs", "sensor-render", "sim-host", "tests", "traffic"];
    let folders: BTreeSet<_> = files.iter().filter_map(|file| file.split_once('/')).collect();
    let folders: BTreeSet<&str> = folders.into_iter().map(|(folder, _)| folder).collect();
    let visible: Vec<_> = folders.into_iter().filter(|name| !name.starts_with('.')).collect();
    assert_eq!(visible, expected);
}

/// The features of each package in a build, as `cargo tree` resolves them.
fn features(args: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--prefix", "none", "--format", "{p}|{f}"])
        .args(args)
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut features: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let (package, set) = line.trim_end_matches(" (*)").split_once('|').unwrap_or((line, ""));
        features.entry(package.to_owned()).or_default().insert(set.to_owned());
    }
    features
}

#[test]
fn program_and_tests_share_one_build_of_each_dependency() {
    let program = features(&["-p", "omnibus-sim", "--edges", "normal,build"]);
    let tests = features(&["--workspace", "--edges", "normal,build,dev"]);
    let mut faults = Vec::new();
    for (package, sets) in program {
        for set in sets.difference(&tests[&package]) {
            faults
                .push(format!("{package}: {set:?} in the program, {:?} in tests", tests[&package]));
        }
    }
    assert!(
        faults.is_empty(),
        "the tests would build these again, and what depends on them; fix the features in \
         crates/omnibus/Cargo.toml:\n{}",
        faults.join("\n")
    );
}

#[test]
fn the_skips_that_ci_allows_are_tests() {
    let script = fs::read_to_string(root().join(".ci/run")).unwrap();
    let start = script.find("OMNIBUS_SKIPS_ALLOWED=\"").unwrap();
    let list = script[start..].split('"').nth(1).unwrap();
    let mut sources = String::new();
    for folder in folders() {
        for file in ["src", "it"].iter().flat_map(|part| source::files(&folder.join(part))) {
            sources += &fs::read_to_string(file).unwrap();
        }
    }
    for name in list.split_whitespace() {
        assert!(
            sources.contains(&format!("fn {name}()")),
            ".ci/run allows a skip of {name}, which is no test"
        );
    }
}
