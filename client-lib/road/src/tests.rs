//! Whole maps. Those of `OMNIBUS_MAPS`, a folder, are judged where that variable is set.

mod reference;
mod surface;

use crate::Network;
use std::path::PathBuf;

/// Name and text of every map in the folder that `OMNIBUS_MAPS` names, by name; none without it.
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
    std::env::var_os("OMNIBUS_MAPS").map(PathBuf::from)
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
