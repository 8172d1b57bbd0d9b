//! `omnibus stage`: one stage alone, and the tick without sensors.

use crate::kit::{omnibus, small_map};

const SMALL: [&str; 8] = ["--frames", "12", "--warmup", "5", "--width", "64", "--height", "48"];

fn measured(stage: &str, more: &[&str]) -> serde_json::Value {
    let args = ["stage", stage, "--json", "--map", small_map(), "--device", "cpu"];
    let output = omnibus().args(args).args(SMALL).args(more).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn each_stage_and_the_tick_report_percentiles() {
    for (stage, more) in [
        ("physics", &["--vehicles", "3"][..]),
        ("traffic", &["--vehicles", "3"]),
        ("render", &["--vehicles", "3"]),
        ("tick", &["--vehicles", "3"]),
        ("tick", &["--vehicles", "3", "--single-process"]),
    ] {
        let told = measured(stage, more);
        assert_eq!((&told["stage"], &told["n"]), (&stage.into(), &12.into()), "{told}");
        assert_eq!(told["vehicles"], 3, "{told}");
        let times = ["p50_ms", "p90_ms", "p99_ms", "max_ms"].map(|k| told[k].as_f64().unwrap());
        assert!(times[0] > 0.0 && times.is_sorted(), "{told}");
    }
}

#[test]
fn a_world_is_built_in_three_timed_parts() {
    let told = measured("world", &[]);
    assert_eq!((&told["stage"], &told["n"]), (&"world".into(), &12.into()), "{told}");
    let [network, town, scene, all] =
        ["network_ms", "town_ms", "scene_ms", "p50_ms"].map(|key| told[key].as_f64().unwrap());
    assert!(network > 0.0 && town > network && scene > 0.0 && all > town, "{told}");
    assert!(told["triangles"].as_u64().unwrap() > 10_000, "{told}");
    assert!(told["peak_mb"].as_f64().unwrap() > 10.0, "{told}");
}
