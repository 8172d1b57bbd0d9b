//! Tests with whole maps. Those in the folder `OMNIBUS_MAPS` are tested where that variable is set.

mod bake;
mod coverage;
mod extras;
mod heights;
mod made;
mod objects;
mod queries;
mod reference;
mod repair;
mod small;
mod structures;
mod surface;
mod threads;
mod validate;
mod xml;

use std::path::PathBuf;

use crate::Network;

/// Returns name and text of every map in the folder that `OMNIBUS_MAPS` names, sorted by name; none
/// without it.
pub(crate) fn shared_maps() -> Vec<(String, String)> {
    let Some(folder) = maps_folder() else { return Vec::new() };
    let mut maps = Vec::new();
    for entry in std::fs::read_dir(folder).expect("OMNIBUS_MAPS names a folder") {
        let path = entry.expect("a readable folder").path();
        if path.extension().is_some_and(|extension| extension == "xodr") {
            let name = path.file_stem().expect("a name").to_string_lossy().to_string();
            maps.push((name, std::fs::read_to_string(&path).expect("a readable map")));
        }
    }
    maps.sort();
    maps
}

pub(crate) fn maps_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("OMNIBUS_MAPS").map(PathBuf::from);
    if folder.is_none() {
        note_skipped("OMNIBUS_MAPS names no folder");
    }
    folder
}

/// Notes that the running test skips what it cannot do; `./run test` counts and lists these notes.
fn note_skipped(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or_default().rsplit("::").next().unwrap_or_default().to_owned();
    eprintln!("skipped {test}: {why}");
    if let Some(path) = std::env::var_os("OMNIBUS_TEST_NOTES") {
        use std::io::Write as _;
        let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
        let line = format!("skipped {test}: {why}\n");
        file.and_then(|mut file| file.write_all(line.as_bytes())).expect("the notes are writable");
    }
}

#[test]
fn every_shared_map_loads() {
    for (name, text) in shared_maps() {
        let network = Network::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(!network.lanes().is_empty(), "{name} has no lanes");
        for finding in network.findings().iter().take(5) {
            println!("{name}: {finding}");
        }
        println!(
            "{name}: {} roads, {} lanes, {} junctions, {} signals, {} findings",
            network.roads().len(),
            network.lanes().len(),
            network.junctions().len(),
            network.signals().len(),
            network.findings().len()
        );
    }
}

#[test]
fn lanes_continue_where_sections_end() {
    for (name, text) in shared_maps() {
        let network = Network::parse(&text).expect("a map that loads");
        let mut jumps = Vec::new();
        for lane in network.lanes() {
            if lane.length_m < 0.1 || !crate::LaneTypes::DRIVABLE.contains(lane.kind) {
                continue;
            }
            let end = network.place_at(lane.index, lane.length_m, 0.0).position;
            let before = network.place_at(lane.index, lane.length_m - 0.05, 0.0).position;
            // Some files have bends almost as sharp.
            if end.distance(before) > 1.0 {
                jumps.push(format!("{} {end} {before}", network.roads()[lane.road as usize].id));
            }
        }
        assert!(jumps.is_empty(), "{name}: {} jumps, {:?}", jumps.len(), jumps.first());
    }
}
