//! The stage clock, `omnibus profile` and `omnibus top`.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use client_lib::{CameraOutputs, Client, Pose, Spawn, VehicleControl, wire::camera};
use glam::{Quat, Vec3};
use protocol::ActorId;

use serde_json::Value;

use crate::kit::{Scratch, Sim, omnibus, small_map, thread};

/// Spawns an ego and two vehicles in traffic; returns the ego.
fn populate(client: &mut Client) -> ActorId {
    let places = client.spawn_points().unwrap();
    for place in &places[1..3] {
        client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot()).unwrap();
    }
    client.spawn(Spawn::new("vehicle.tesla.model3", places[0])).unwrap()
}

#[test]
fn the_stage_clock_has_every_instant_of_each_frame_in_causal_order() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let ego = populate(&mut client);
    let above = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", above, 64, 48, 1.5, CameraOutputs::COLOR);
    let mut bundle = client.create_bundle("above", ActorId::NONE, [spec], 2).unwrap();
    client.tick().unwrap();
    let mut before = None;
    for _ in 0..100 {
        let (frame, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        assert!(measured[0].is_some());
        let pedals = VehicleControl { actor_id: ego, throttle: 0.3, ..Default::default() };
        client.control(&[pedals]).unwrap();
        // The controls sent on a frame act in the next one.
        let Some(done) = before.replace(frame) else { continue };
        let clock = client.stage_clock(done);
        assert_eq!(clock.frame, done);
        let chain = [
            ("requested", clock.requested_nanos),
            ("begun", clock.begun_nanos),
            ("physics begun", clock.physics_begun_nanos),
            ("physics ended", clock.physics_ended_nanos),
            ("published", clock.published_nanos),
            ("trace begun", clock.trace_begun_nanos),
            ("traced", clock.traced_nanos),
            ("delivered", clock.delivered_nanos),
            ("read", clock.read_nanos),
            ("control sent", clock.control_sent_nanos),
            ("control applied", clock.control_applied_nanos),
        ];
        let plan = [
            ("published", clock.published_nanos),
            ("plan begun", clock.plan_begun_nanos),
            ("planned", clock.planned_nanos),
            ("plan delivered", clock.plan_delivered_nanos),
            ("read", clock.read_nanos),
        ];
        let close = [("delivered", clock.delivered_nanos), ("closed", clock.closed_nanos)];
        for chain in [&chain[..], &plan, &close] {
            for (name, nanos) in chain {
                assert!(nanos.is_some(), "{done} has no instant {name:?}: {clock:?}");
            }
            for pair in chain.windows(2) {
                assert!(pair[0].1 <= pair[1].1, "{done}: {:?} after {:?}", pair[0], pair[1]);
            }
        }
        let next = client.stage_clock(frame);
        assert_eq!(clock.control_applied_nanos, next.physics_begun_nanos, "{clock:?} {next:?}");
        assert_eq!(next.control_applied_nanos, None, "no frame has applied them: {next:?}");
    }
    let old = client.stage_clock(protocol::Frame(2));
    assert_eq!((old.published_nanos, old.read_nanos), (None, None), "overwritten: {old:?}");
    drop((client, bundle));
    sim.end();
}

#[test]
fn a_gpu_works_between_the_begin_and_the_end_of_the_renderer() {
    let test = "a_gpu_works_between_the_begin_and_the_end_of_the_renderer";
    let Some(sim) = Sim::start_on_gpu(test) else { return };
    let mut client = sim.ticker();
    let above = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", above, 64, 48, 1.5, CameraOutputs::COLOR);
    let mut bundle = client.create_bundle("above", ActorId::NONE, [spec], 2).unwrap();
    client.tick().unwrap();
    for _ in 0..5 {
        let (frame, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        assert!(measured[0].is_some());
        let clock = client.stage_clock(frame);
        let chain = [
            clock.trace_begun_nanos,
            clock.device_begun_nanos,
            clock.device_traced_nanos,
            clock.device_copied_nanos,
            clock.traced_nanos,
        ];
        assert!(chain.iter().all(Option::is_some) && chain.is_sorted(), "{clock:?}");
    }
    client.destroy_bundle(bundle).unwrap();
    let unmeasured = client.tick().unwrap();
    let clock = client.stage_clock(unmeasured);
    assert_eq!((clock.device_begun_nanos, clock.device_copied_nanos), (None, None), "{clock:?}");
    drop(client);
    sim.end();
}

/// Runs `omnibus profile` and returns its result.
fn profile(args: &[&str]) -> Value {
    let output = omnibus().args(["profile", "--json"]).args(args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Profiles a simulator that a client ticks, and whose sensors are measured.
fn profile_of(sim: &Sim, args: &[&str]) -> Value {
    let all = [&["--name", sim.instance().id()], args].concat();
    while_ticking(sim, || profile(&all))
}

/// Calls `look` while a client ticks, drives and has its sensors measured.
fn while_ticking<T>(sim: &Sim, look: impl FnOnce() -> T) -> T {
    let mut client = sim.ticker();
    let ego = populate(&mut client);
    let above = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", above, 64, 48, 1.5, CameraOutputs::COLOR);
    let mut bundle = client.create_bundle("above", ActorId::NONE, [spec], 2).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let is_stopped = Arc::clone(&stop);
    let ticking = thread(move || {
        while !is_stopped.load(Ordering::Acquire) {
            client.tick_and_collect(&mut [&mut bundle]).unwrap();
            let pedals = VehicleControl { actor_id: ego, throttle: 0.3, ..Default::default() };
            client.control(&[pedals]).unwrap();
        }
    });
    let result = look();
    stop.store(true, Ordering::Release);
    ticking.join().unwrap();
    result
}

#[test]
fn the_profile_of_a_running_simulator_names_the_slow_stage() {
    for (slow, stage) in [("sensor-render:40000", "rendering"), ("traffic:40000", "traffic")] {
        let sim = Sim::start_with(&[], &[("OMNIBUS_DELAY", slow)]);
        let found = profile_of(&sim, &["--frames", "30"]);
        assert_eq!(found["limit"]["stage"], stage, "{found}");
        assert!(found["limit"]["share"].as_f64().unwrap() > 0.5, "{found}");
        let doubled = found["limit"]["frames_per_s_at_double_speed"].as_f64().unwrap();
        let rate = found["frames_per_s"].as_f64().unwrap();
        assert!(doubled > 1.2 * rate && doubled < 2.0 * rate, "{found}");
        let parts = found["parts"].as_object().unwrap();
        for part in ["frame", "physics", "traffic plans", "renderer traces", "snapshot to control"]
        {
            assert!(parts[part]["n"].as_u64().unwrap() >= 25, "{part}: {found}");
        }
        let roles: Vec<&str> = found["participants"]
            .as_array()
            .unwrap()
            .iter()
            .map(|member| member["role"].as_str().unwrap())
            .collect();
        assert_eq!(roles, ["sim-host", "traffic", "sensor-render", "client"]);
        sim.end();
    }
}

#[test]
fn the_trace_shows_each_process_and_an_arrow_through_each_frame() {
    let scratch = Scratch::new();
    let file = scratch.path().join("trace.json");
    let sim = Sim::start(&[]);
    profile_of(&sim, &["--frames", "30", "--trace", file.to_str().unwrap()]);
    sim.end();
    let events = trace_events(&file);
    let of = |phase: &'static str| events.iter().filter(move |event| event["ph"] == phase);
    let names: Vec<_> = of("M").filter(|event| event["name"] == "process_name").collect();
    assert_eq!(names.len(), 4, "{names:?}");
    // By track: begin and end of each slice.
    let mut tracks: BTreeMap<u64, Vec<(f64, f64)>> = BTreeMap::new();
    for event in of("X") {
        let (ts, dur) = (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap());
        assert_eq!(event["pid"], event["tid"]);
        tracks.entry(event["pid"].as_u64().unwrap()).or_default().push((ts, ts + dur));
    }
    assert_eq!(tracks.len(), 4);
    for (track, slices) in &mut tracks {
        assert!(slices.len() >= 25, "track {track} has {} slices", slices.len());
        slices.sort_by(|a, b| a.0.total_cmp(&b.0));
        for pair in slices.windows(2) {
            assert!(pair[0].1 <= pair[1].0 + 1e-3, "slices overlap on track {track}: {pair:?}");
        }
    }
    let mut flows: BTreeMap<(&str, u64), Vec<&Value>> = BTreeMap::new();
    for event in
        events.iter().filter(|event| ["s", "t", "f"].contains(&event["ph"].as_str().unwrap()))
    {
        let at = event["ts"].as_f64().unwrap();
        let slices = &tracks[&event["pid"].as_u64().unwrap()];
        let is_inside = slices.iter().any(|(begin, end)| *begin - 1e-3 <= at && at <= *end + 1e-3);
        assert!(is_inside, "no slice is around {event}");
        let id = (event["name"].as_str().unwrap(), event["id"].as_u64().unwrap());
        flows.entry(id).or_default().push(event);
    }
    assert!(flows.len() >= 50, "{} flows", flows.len());
    for (id, points) in &flows {
        let phases: String = points.iter().map(|event| event["ph"].as_str().unwrap()).collect();
        assert!(
            phases.starts_with('s') && phases.ends_with('f') && phases.len() >= 2,
            "{id:?}: {phases}"
        );
        assert!(
            points.is_sorted_by_key(|event| event["ts"].as_f64().unwrap()),
            "{id:?}: {points:?}"
        );
    }
}

fn trace_events(file: &Path) -> Vec<Value> {
    let mut trace: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    match trace["traceEvents"].take() {
        Value::Array(events) => events,
        other => panic!("no list of events: {other}"),
    }
}

#[test]
fn a_profile_starts_a_simulator_of_its_own_in_every_mode() {
    for more in [&[][..], &["--pipeline", "2"], &["--single-process"]] {
        let mut args = vec!["--start", "--map", small_map(), "--device", "cpu", "--frames", "30"];
        args.extend(["--vehicles", "3", "--width", "64", "--height", "48"]);
        args.extend(more);
        let found = profile(&args);
        assert_eq!(
            found["n"].as_u64().unwrap() + found["skipped"].as_u64().unwrap(),
            31,
            "{found}"
        );
        assert_eq!(found["limit"]["stage"], "rendering", "{found}");
        assert!(found["parts"]["renderer traces"]["n"].as_u64().unwrap() > 20, "{found}");
    }
}

#[test]
fn a_profile_without_a_simulator_says_how_to_start_one() {
    let output = omnibus().args(["profile", "--name", "no-such-simulator"]).output().unwrap();
    assert!(!output.status.success());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("no-such-simulator") && said.contains("--start"), "{said}");
}

/// Runs `omnibus` and returns what it prints.
fn printed(args: &[&str]) -> String {
    let output = omnibus().args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn each_stage_runs_alone_from_a_recording_with_its_inner_steps() {
    let scratch = Scratch::new();
    let path = |name: &str| scratch.path().join(name).to_str().unwrap().to_owned();
    let recording = path("drive.mcap");
    let record = ["record", "--map", small_map(), "--device", "null", "--vehicles", "3"];
    printed(&[&record[..], &["--frames", "60", "--out", &recording]].concat());
    let sensors = path("sensors.toml");
    let text = "[[sensor]]\nname = \"left\"\nkind = \"camera\"\nyaw_deg = 90\nwidth_px = 64\n\
                height_px = 48\noutputs = [\"color\", \"flow\"]\nposition_m = [0, 0, 2]\n\
                [[sensor]]\nname = \"top\"\nkind = \"lidar\"\nchannels = 8\ncolumns = 90\n\
                position_m = [0, 0, 2.4]\n";
    std::fs::write(&sensors, text).unwrap();
    let small = ["--frames", "40", "--device", "cpu", "--width", "64", "--height", "48"];
    for (stage, more, steps) in [
        ("physics", &[][..], &["commands", "physics step", "state hash"][..]),
        ("traffic", &[], &["plan", "save state"]),
        ("record", &[], &["frame kept", "segment written", "file closed"]),
        ("bus", &[], &["write", "send", "receive"]),
        (
            "render",
            &[],
            &[
                "scene update",
                "all sensors",
                "sensor front",
                "sensor lidar",
                "shadow rays",
                "encoding",
            ],
        ),
        (
            "render",
            &["--sensors", &sensors],
            &[
                "scene update",
                "all sensors",
                "sensor left",
                "sensor top",
                "shadow rays",
                "encoding",
            ],
        ),
    ] {
        let args = [&["--stage", stage, "--input", &recording], &small[..], more].concat();
        let found = profile(&args);
        assert_eq!((&found["kind"], &found["stage"]), (&"alone".into(), &stage.into()));
        let parts = found["parts"].as_object().unwrap();
        assert_eq!(parts.len(), steps.len() + 1, "{stage}: {:?}", parts.keys());
        let whole = &parts[stage];
        assert!(whole["n"].as_u64().unwrap() >= 35, "{stage}: {whole}");
        let times = ["p50_ms", "p90_ms", "p99_ms", "max_ms"].map(|k| whole[k].as_f64().unwrap());
        assert!(times[0] > 0.0 && times.is_sorted(), "{stage}: {times:?}");
        for step in steps {
            assert!(
                parts[*step]["n"].as_u64().unwrap() > 0,
                "{stage}: no {step}: {:?}",
                parts.keys()
            );
        }
        assert!(found["peak_mb"].as_f64().unwrap() > 10.0);
    }
}

#[test]
fn a_comparison_finds_a_difference_where_there_is_one() {
    let scratch = Scratch::new();
    let path = |name: &str| scratch.path().join(name).to_str().unwrap().to_owned();
    let (real, first, slower) = (path("real.json"), path("first.json"), path("slower.json"));
    let mut args = vec!["profile", "--start", "--map", small_map(), "--device", "cpu"];
    args.extend(["--frames", "60", "--vehicles", "3", "--width", "64", "--height", "48"]);
    args.extend(["--output", &real]);
    printed(&args);
    let mut result: Value = serde_json::from_slice(&std::fs::read(&real).unwrap()).unwrap();
    // Times that vary by 4 %, whatever the load of this machine.
    for (file, scale) in [(&first, 1.0), (&slower, 1.2)] {
        let samples: Vec<_> =
            (0..200).map(|i| (1e7 + f64::from(i * 7919 % 400) * 1e3) * scale).collect();
        for part in result["parts"].as_object_mut().unwrap().values_mut() {
            part["samples_nanos"] = samples.clone().into();
        }
        std::fs::write(file, result.to_string()).unwrap();
    }
    let verdicts = |a: &str, b: &str| -> (BTreeMap<String, String>, String) {
        let compared = profile(&["--compare", a, b]);
        let parts = compared["parts"].as_array().unwrap().iter();
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        let verdicts = parts.map(|part| (text(&part["part"]), text(&part["verdict"])));
        (verdicts.collect(), text(&compared["sentence"]))
    };
    for file in [&real, &first] {
        let (same, sentence) = verdicts(file, file);
        assert!(same.values().all(|verdict| verdict == "no difference shown"), "{same:?}");
        assert_eq!(sentence, "No difference shown in any part.");
    }
    let (other, sentence) = verdicts(&first, &slower);
    assert_eq!(other["renderer traces"], "slower", "{other:?}");
    assert!(sentence.contains("renderer traces (+20.0 %)"), "{sentence}");
    let (other, sentence) = verdicts(&slower, &first);
    assert_eq!(other["renderer traces"], "faster", "{other:?}");
    assert!(sentence.starts_with("The second run is faster in"), "{sentence}");
}

#[test]
fn top_without_a_terminal_prints_participants_stages_and_the_limit() {
    let sim = Sim::start_with(&[], &[("OMNIBUS_DELAY", "sensor-render:20000")]);
    let name = sim.instance().id().to_owned();
    let shown = while_ticking(&sim, || printed(&["top", "--name", &name, "--interval", "1.5"]));
    let host = sim.host_pid().to_string();
    for part in [
        &name,
        "synchronous",
        "frames/s",
        "sim-host",
        "traffic",
        "sensor-render",
        "ticker *",
        &host,
        "physics",
        "renderer traces",
        "snapshot to control",
        "batches of commands",
        "Rendering limits the frame rate",
        "q leaves",
    ] {
        assert!(shown.contains(part), "no {part:?}:\n{shown}");
    }
    sim.end();
}
