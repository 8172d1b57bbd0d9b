//! Generated maps, read by other programs: ASAM's checker, CARLA's client, SUMO's netconvert.
//!
//! The programs are installed once into a folder of their own; without Python or a package registry
//! the test is skipped and says so.

use std::{collections::BTreeMap, fs, path::PathBuf, process::Command};

use mapgen::{Character, Plan};
use road::{LaneType, LaneTypes, Network};
use serde_json::Value;

use crate::{
    carla::environment,
    kit::{Scratch, is_soak, note_skipped},
};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/oracle/judge_maps.py");
const PACKAGES: [&str; 3] = ["carla==0.9.16", "asam-qc-opendrive==1.0.0", "eclipse-sumo==1.28.0"];
const CHECK: &str = "import carla, qc_opendrive, sumo";

/// Returns each character in several seeds and sizes, and every named town.
fn texts() -> BTreeMap<String, String> {
    let seeds = if is_soak() { 10 } else { 2 };
    let plans = Character::ALL.into_iter().flat_map(|character| {
        (0..seeds).map(move |seed| {
            let (size_m, relief_m) = character.default_size_and_relief_m();
            let name = format!("{}-{seed}", character.name());
            let size_m = size_m * (1.0 + 0.1 * (seed % 3) as f64);
            Plan { name, seed, size_m, character, relief_m }
        })
    });
    let named = mapgen::names().chain(mapgen::carla_names());
    let named = named.map(|name| (name.to_owned(), mapgen::named(name).unwrap()));
    plans.map(|plan| (plan.name.clone(), mapgen::generate(&plan))).chain(named).collect()
}

#[test]
fn generated_maps_are_read_without_error_by_asam_s_checker_carla_and_sumo() {
    let test = "generated_maps_are_read_without_error_by_asam_s_checker_carla_and_sumo";
    let python = match environment("omnibus-it-oracles-1", &PACKAGES, CHECK) {
        Ok(python) => python,
        Err(why) => {
            note_skipped(test, &format!("the oracles are not there: {why}"));
            return;
        }
    };
    let scratch = Scratch::new();
    let texts = texts();
    let files: Vec<PathBuf> = texts
        .iter()
        .map(|(name, text)| {
            let file = scratch.path().join(format!("{name}.xodr"));
            fs::write(&file, text).unwrap();
            file
        })
        .collect();
    let ended = Command::new(python).arg(SCRIPT).args(&files).output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let said = String::from_utf8(ended.stdout).unwrap();
    let verdicts: Vec<Value> = said.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(verdicts.len(), texts.len());
    let mut faults = Vec::new();
    for verdict in verdicts {
        let name = verdict["map"].as_str().unwrap();
        for judge in ["asam", "netconvert"] {
            for error in verdict[judge].as_array().unwrap() {
                faults.push(format!("{name}: {judge}: {error}"));
            }
        }
        let network = Network::parse(&texts[name]).unwrap();
        let driving = LaneTypes::only(LaneType::Driving);
        // CARLA pairs the start of a lane that leads nowhere with its end.
        let ends = network
            .lanes()
            .iter()
            .filter(|lane| driving.contains(lane.kind) && lane.successors.is_empty());
        let topology = network.topology().len() + ends.count();
        let own = [network.waypoints(5.0, driving).len(), topology];
        let carla = ["waypoints", "topology"].map(|count| verdict[count].as_u64().unwrap());
        if own.map(|count| count as u64) != carla {
            faults.push(format!("{name}: carla.Map counts {carla:?}, we {own:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
