//! `bench latency`, in short: the agents in all languages run, and each finds its controls in the
//! snapshots.

use std::process::Command;

use crate::{c_interface, carla, kit::note_skipped, python_package};

#[test]
fn the_agents_of_bench_latency_see_their_controls_in_the_next_snapshot() {
    let test = "the_agents_of_bench_latency_see_their_controls_in_the_next_snapshot";
    let mut bench = Command::new(c_interface::library().join("omnibus-bench"));
    bench
        .args(["latency", "--quick"])
        .env_remove("OMNIBUS_PYTHON")
        .env_remove("OMNIBUS_CARLA_PYTHON");
    let mut expected = vec!["rust_agent", "c_agent"];
    match python_package::python() {
        Ok(python) => {
            bench.env("OMNIBUS_PYTHON", python);
            expected.extend(["python_agent", "python_image", "python_poses"]);
        }
        Err(why) => note_skipped(test, &format!("no Python environment: {why}")),
    }
    if let Some(python) = carla::python_or_skip(test) {
        bench.env("OMNIBUS_CARLA_PYTHON", python);
        expected.push("carla_agent");
    }
    let ended = bench.output().unwrap();
    let said = String::from_utf8_lossy(&ended.stdout);
    assert!(ended.status.success(), "{said}{}", String::from_utf8_lossy(&ended.stderr));
    for name in expected {
        // "latency.c_agent: 20.7 us (p50 …"
        let line = said.lines().find_map(|line| line.strip_prefix(&format!("latency.{name}: ")));
        let micros = line.and_then(|line| line.split(' ').next()?.parse::<f64>().ok());
        assert!(micros.is_some_and(|micros| micros > 0.0), "latency.{name}: {said}");
    }
}
