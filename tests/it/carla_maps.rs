//! Maps as CARLA's clients read them.

use std::{fs, path::PathBuf, process::Command};

use serde_json::Value;

use crate::{
    carla::{python_or_skip, with_carla_server},
    kit::{Scratch, note_skipped},
};

/// Returns what `topology.py` prints about each source.
fn topologies(python: &PathBuf, sources: &[String]) -> Vec<Value> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/carla/topology.py");
    let output = Command::new(python).arg(script).args(sources).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}{words}", output.status);
    let found: Vec<Value> = said.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    assert_eq!(found.len(), sources.len(), "{said}{words}");
    found
}

/// CARLA's route planner divides by the distance of the two waypoints of each pair.
#[test]
fn no_section_of_a_served_map_is_too_short_for_carla_s_route_planner() {
    let Some(python) =
        python_or_skip("no_section_of_a_served_map_is_too_short_for_carla_s_route_planner")
    else {
        return;
    };
    let lane = r#"<lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="solid"/></lane>"#;
    let section = |s: &str| {
        format!(
            r#"<laneSection s="{s}"><center><lane id="0"/></center><right>{lane}</right></laneSection>"#
        )
    };
    let text = format!(
        r#"<OpenDRIVE><header revMajor="1" revMinor="4"/><road name="" id="1" length="200" junction="-1"><planView><geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry></planView><lanes>{}{}{}</lanes></road></OpenDRIVE>"#,
        section("0"),
        section("100"),
        section("100.00000006")
    );
    let scratch = Scratch::new();
    let path = scratch.path().join("short.xodr");
    fs::write(&path, text).unwrap();
    let path = path.to_str().unwrap().to_owned();
    let (sim, port) = with_carla_server(&["--map", &path]);
    let found = topologies(&python, &[path, port.to_string()]);
    let equal = |found: &Value| found["equal"].as_array().map(Vec::len);
    assert_eq!(equal(&found[0]), Some(1), "the file has a pair of equal waypoints: {}", found[0]);
    assert_eq!(equal(&found[1]), Some(0), "{}", found[1]);
    let log = sim.end();
    let told = "clients receive 1 lane sections of less than 1 mm as 1 mm long";
    assert_eq!(log.matches(told).count(), 1, "{log}");
}

#[test]
fn carla_s_route_planner_reads_every_map_there_is() {
    let test = "carla_s_route_planner_reads_every_map_there_is";
    let Some(python) = python_or_skip(test) else { return };
    let Some(folder) = std::env::var_os("OMNIBUS_MAPS") else {
        note_skipped(test, "OMNIBUS_MAPS names no folder");
        return;
    };
    let scratch = Scratch::new();
    let mut sources = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|extension| extension == "xodr") {
            let text = fs::read_to_string(&path).unwrap();
            let text = road::repair(&text).unwrap().map_or(text, |repaired| repaired.text);
            let copy = scratch.path().join(path.file_name().unwrap());
            fs::write(&copy, text).unwrap();
            sources.push(copy.to_str().unwrap().to_owned());
        }
    }
    sources.sort();
    for found in topologies(&python, &sources) {
        let equal = found["equal"].as_array().into_iter().flatten();
        // A road that is its own successor begins where it ends; CARLA's library says the same.
        let wrong: Vec<_> = equal.filter(|pair| pair[0] != pair[1]).collect();
        assert!(wrong.is_empty(), "{}: {wrong:?}", found["source"]);
        println!("{}: {} pairs {}", found["source"], found["pairs"], found["error"]);
    }
}
