//! Compares maps with CARLA's own client, if a Python has it.

use std::process::Command;

use crate::{carla::python_or_skip, kit::note_skipped};

#[test]
fn maps_answer_as_carla_s_client_does() {
    let Some(python) = python_or_skip("maps_answer_as_carla_s_client_does") else { return };
    let Some(folder) = std::env::var_os("OMNIBUS_MAPS") else {
        note_skipped("maps_answer_as_carla_s_client_does", "OMNIBUS_MAPS names no folder");
        return;
    };
    let towns = ["Town01", "Town02", "Town03", "Town04", "Town06", "Town10HD"];
    let mut maps: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            towns.iter().any(|town| name.ends_with(town))
        })
        .collect();
    maps.sort();
    assert!(!maps.is_empty());
    let ended = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/carla/compare_map.py"))
        .args(["--omnibus", env!("CARGO_BIN_EXE_role")])
        .args(&maps)
        .output()
        .unwrap();
    println!("{}", String::from_utf8_lossy(&ended.stdout));
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
}
