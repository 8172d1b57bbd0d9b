//! Real maps, if there are any: on each a car drives and is measured.

use crate::kit::{Scratch, note_skipped, omnibus};

#[test]
fn every_map_there_is_becomes_a_data_set() {
    let Some(folder) = std::env::var_os("OMNIBUS_MAPS") else {
        note_skipped("every_map_there_is_becomes_a_data_set", "OMNIBUS_MAPS names no folder");
        return;
    };
    let mut maps: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "xodr"))
        .collect();
    maps.sort();
    assert!(!maps.is_empty());
    for map in maps {
        let scratch = Scratch::new();
        let out = scratch.path().join("set");
        let ended = omnibus()
            .args(["collect", "--frames", "2", "--warmup", "3", "--vehicles", "5"])
            .args(["--width", "64", "--height", "48", "--device", "cpu", "--map"])
            .arg(&map)
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&ended.stderr);
        // A map may have no driving lane; then the error says so.
        let is_undrivable = said.contains("no driving lane has room for a vehicle");
        assert!(ended.status.success() || is_undrivable, "{}: {said}", map.display());
        let what = if is_undrivable { "nowhere to drive" } else { "collected" };
        println!("{}: {what}", map.file_name().unwrap().display());
    }
}
