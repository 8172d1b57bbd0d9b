//! Invalid input gives one clear error; nothing hangs, nothing is lost.

use std::{fs, process::Output};

use client_lib::{
    Pose, RefusalCode, Replay, Spawn,
    wire::{camera, lidar},
};
use glam::Vec3;
use protocol::{ActorId, BundleId, Command, Settings, Teleport, output};

use crate::kit::{Scratch, Sim, omnibus, small_map};

fn run(args: &[&str]) -> Output {
    omnibus().args(args).output().unwrap()
}

/// Returns the one line of error that a refused command prints.
pub(crate) fn refusal(args: &[&str]) -> String {
    // Other tests may have the port.
    let other = args[0] != "run" || args.contains(&"--carla-port");
    let output = run(&[args, if other { &[] } else { &["--no-carla"] }].concat());
    assert!(!output.status.success(), "{args:?} was not refused");
    let said = String::from_utf8(output.stderr).unwrap();
    println!("{} -> {}", args.join(" "), said.trim_end());
    assert_eq!(said.lines().count(), 1, "{said}");
    said
}

pub(crate) fn names(said: &str, words: &[&str]) {
    for word in words {
        assert!(said.contains(word), "{said:?} does not say {word:?}");
    }
}

#[test]
fn a_bad_map_is_named_with_its_line() {
    let scratch = Scratch::new();
    let bad = scratch.path().join("bad.xodr");
    let text = fs::read_to_string(small_map()).unwrap();
    let map = bad.to_str().unwrap();
    names(&refusal(&["run", "--map", "/no/such.xodr"]), &["/no/such.xodr", "No such file"]);
    names(&refusal(&["run", "--map", "Nowhere"]), &["Nowhere", "Millbrook"]);
    for (content, words) in [
        ("".to_owned(), &["bad.xodr"][..]),
        ("hello".to_owned(), &["bad.xodr"]),
        (text[..text.len() / 2].to_owned(), &["bad.xodr", "line"]),
        (text.replacen("length=\"", "length=\"x", 1), &["bad.xodr", "line", "length"]),
    ] {
        fs::write(&bad, content).unwrap();
        names(&refusal(&["run", "--map", map]), words);
    }
    fs::write(&bad, [0xff, 0xfe, 0x00]).unwrap();
    names(&refusal(&["run", "--map", map]), &["UTF-8"]);
}

#[test]
fn invalid_arguments_are_named_with_the_valid_ones() {
    names(&refusal(&["run", "--device", "tpu"]), &["--device", "tpu"]);
    names(&refusal(&["run", "--threads", "100000"]), &["--threads is 100000", "1024"]);
    names(&refusal(&["run", "--wait", "never"]), &["never", "balanced"]);
    names(&refusal(&["run", "--name", "UPPER"]), &["UPPER", "a-z"]);
    names(&refusal(&["run", "--fixed-delta", "70"]), &["--fixed-delta", "70"]);
    names(&refusal(&["run", "--device", "gpu:77", "--map", small_map()]), &["gpu:77"]);
    let alone = ["stage", "physics", "--single-process", "--map", small_map()];
    names(&refusal(&alone), &["--single-process", "stage tick"]);
}

#[test]
fn inspect_and_replay_find_a_recording_in_the_current_folder() {
    let scratch = Scratch::new();
    fs::write(scratch.path().join("torn.mcap"), b"\x89MCAP0\r\n").unwrap();
    for verb in ["inspect", "replay"] {
        let mut command = omnibus();
        command.current_dir(scratch.path()).args([verb, "torn.mcap"]);
        let output = command.output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{verb}");
        assert!(error.contains("torn.mcap") && !error.contains("No such file"), "{verb}: {error}");
    }
}

#[test]
fn a_recording_is_never_written_over() {
    let scratch = Scratch::new();
    let kept = scratch.path().join("kept.mcap");
    fs::write(&kept, "precious").unwrap();
    let out = kept.to_str().unwrap();
    names(&refusal(&["record", "--map", small_map(), "--out", out]), &[out, "there already"]);
    assert_eq!(fs::read_to_string(&kept).unwrap(), "precious");
}

#[test]
fn a_name_in_use_is_refused_and_the_other_simulator_goes_on() {
    let sim = Sim::start(&[]);
    let said = refusal(&["run", "--name", sim.instance().id(), "--map", small_map()]);
    names(&said, &[sim.instance().id(), "already runs"]);
    sim.ticker().tick().unwrap();
    sim.end();
}

#[test]
fn a_refused_command_is_named_and_the_world_goes_on() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    let mut refused = |code: RefusalCode, command: Command, words: &[&str]| {
        let error = client.request("command", &[command]).unwrap_err();
        println!("{code:?} -> {error}");
        assert_eq!(error.refusal(), Some(code), "{error}");
        names(&error.to_string(), words);
    };
    let spawn = |name: &str, pose| {
        Command::Spawn(protocol::Spawn {
            blueprint: protocol::Name::new(name),
            pose,
            ..Default::default()
        })
    };
    refused(
        RefusalCode::UnknownBlueprint,
        spawn("vehicle.no.such", place),
        &["vehicle.no.such", "omnibus blueprints"],
    );
    refused(
        RefusalCode::SpawnCollision,
        spawn("vehicle.audi.tt", place),
        &["vehicle.audi.tt", "would stand in"],
    );
    let nowhere = Pose { position_m: [f32::NAN, 0.0, 0.0], ..place };
    refused(RefusalCode::OutOfRange, spawn("vehicle.audi.tt", nowhere), &["finite"]);
    refused(RefusalCode::UnknownActor, Command::Destroy(ActorId(9999)), &["9999", "never spawned"]);
    let far = Pose::level(Vec3::X * 1e7, 0.0);
    refused(
        RefusalCode::OutOfRange,
        Command::Teleport(Teleport { actor_id: car, pose: far }),
        &["10000000", "50000"],
    );
    refused(RefusalCode::WrongKind, Command::Jump(car), &["walker"]);
    refused(RefusalCode::NotFound, Command::DestroyBundle(BundleId(77)), &["77"]);
    let settings = Settings { delta_nanos: 0, ..Settings::default() };
    refused(RefusalCode::OutOfRange, Command::SetSettings(settings), &["delta_nanos is 0"]);
    let good = camera("c", Pose::IDENTITY, 64, 48, 1.5, output::COLOR);
    let range = RefusalCode::OutOfRange;
    let none = protocol::EffectsSpec::default();
    let glaring = protocol::EffectsSpec { bloom: 3.0, ..none };
    let slow = protocol::EffectsSpec { readout_secs: 0.01, ..none };
    for (spec, code, words) in [
        (protocol::SensorSpec { width: 0, ..good }, range, &["\"c\"", "width is 0"]),
        (protocol::SensorSpec { fov_rad: 9.0, ..good }, range, &["\"c\"", "fov_rad is 9"]),
        (
            protocol::SensorSpec { effects: glaring, ..good },
            range,
            &["\"c\"", "bloom is 3, not 0 to 1"],
        ),
        (
            protocol::SensorSpec { effects: slow, outputs: output::FLOW, ..good },
            RefusalCode::Unsupported,
            &["\"c\"", "readout_secs is above 0, but optical flow"],
        ),
        (
            lidar("l", Pose::IDENTITY, 8, 90, [0.5, -0.5], 50.0),
            range,
            &["\"l\"", "lower_rad is 0.5"],
        ),
        (protocol::SensorSpec { kind: 77, ..good }, range, &["\"c\"", "77"]),
        (
            protocol::SensorSpec { width: 8192, height: 8192, outputs: 0xf, ..good },
            RefusalCode::Full,
            &["/dev/shm", "MB free; enlarge it"],
        ),
    ] {
        let (hold, count) = if spec.width == 8192 { (8, 16) } else { (2, 1) };
        let name = |index: usize| {
            protocol::Name::new(&format!("{}{}", spec.name, ["", "b"][index.min(1)].repeat(index)))
        };
        let specs: Vec<_> =
            (0..count).map(|i| protocol::SensorSpec { name: name(i), ..spec }).collect();
        let Err(said) = client.create_bundle("r", car, &specs, hold) else {
            panic!("{spec:?} was granted")
        };
        println!("sensor -> {said}");
        assert_eq!(said.refusal(), Some(code), "{said}");
        names(&said.to_string(), words);
    }
    client.destroy(car).unwrap();
    let error = client.destroy(car).unwrap_err();
    assert!(error.to_string().contains("was destroyed"));
    assert_eq!(error.refusal(), Some(RefusalCode::UnknownActor));
    let error = client.telemetry(car).unwrap_err();
    assert_eq!(error.refusal(), Some(RefusalCode::UnknownActor), "a query is refused alike");
    let error = client.load_map("NoSuchTown").unwrap_err();
    assert_eq!(error.refusal(), Some(RefusalCode::Map), "{error}");
    let error = client.start_replay("/no/such.mcap", Replay::default()).unwrap_err();
    assert_eq!(error.refusal(), Some(RefusalCode::File), "{error}");
    client.tick().unwrap();
    drop(client);
    sim.end();
}

#[test]
fn a_stage_of_another_build_is_refused() {
    let sim = Sim::start(&[]);
    let control = sim.instance().control().unwrap();
    let ours = sim.client("before");
    let refusal = || {
        let connected = client_lib::Client::connect(Some(sim.instance().id()), "late");
        connected.err().unwrap().to_string()
    };
    control.override_build(0xabc);
    let said = refusal();
    println!("other build -> {said}");
    let build = format!("{:016x}", protocol::BUILD);
    names(&said, &[&build, "0000000000000abc", "omnibus --version"]);
    assert!(client_lib::VERSION.contains(&build), "{}", client_lib::VERSION);
    control.override_protocol(99);
    let said = refusal();
    println!("other protocol -> {said}");
    names(&said, &["protocol", "99", "one checkout"]);
    drop(ours);
    sim.end();
}

#[test]
fn a_client_that_stops_reading_loses_only_its_own_frames() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let at = Pose::new(Vec3::Z * 60.0, glam::Quat::IDENTITY);
    let spec = camera("c", at, 64, 48, 1.5, output::DEPTH);
    let mut sleeper = sim.client("sleeper");
    let mut asleep = sleeper.create_bundle("asleep", ActorId::NONE, [spec], 2).unwrap();
    let mut awake = client.create_bundle("awake", ActorId::NONE, [spec], 2).unwrap();
    // It holds as many measurements as allowed, and never returns them.
    let mut held = Vec::new();
    for _ in 0..300 {
        let (frame, measured) = client.tick_and_collect(&mut [&mut awake]).unwrap();
        assert_eq!(measured[0].as_ref().unwrap().frame(), frame);
        if held.len() < 2 {
            held.extend(asleep.receive().unwrap());
        }
    }
    let over = asleep.receive().map(|m| m.is_some()).unwrap_err().to_string();
    println!("a reader that holds all -> {over}");
    names(&over, &["borrows the largest number"]);
    held.clear();
    let next = asleep.receive().unwrap().unwrap();
    assert!(asleep.missed() > 200 && next.frame().0 > 250, "{}", asleep.missed());
    // Its next snapshot is the newest one.
    sleeper.refresh().unwrap();
    assert_eq!(sleeper.frame(), client.frame());
    drop((client, sleeper, awake, asleep, next));
    sim.end();
}

#[test]
fn a_data_set_is_never_overwritten_and_a_folder_that_cannot_be_written_is_named() {
    let scratch = Scratch::new();
    let out = scratch.path().join("set");
    let out = out.to_str().unwrap();
    let small = [
        "--map",
        small_map(),
        "--device",
        "cpu",
        "--width",
        "64",
        "--height",
        "48",
        "--vehicles",
        "3",
        "--warmup",
        "2",
    ];
    fn with<'a>(small: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
        [&["collect"], small, more].concat()
    }
    let made = run(&with(&small, &["--frames", "4", "--out", out]));
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    names(
        &refusal(&with(&small, &["--frames", "4", "--out", out])),
        &[out, "complete data set of 4 frames"],
    );
    names(
        &refusal(&with(&small, &["--frames", "4", "--out", "/proc/nowhere"])),
        &["/proc/nowhere"],
    );
    let file = scratch.path().join("file");
    fs::write(&file, "").unwrap();
    names(&refusal(&with(&small, &["--frames", "4", "--out", file.to_str().unwrap()])), &["file"]);
    names(&refusal(&with(&small, &["--frames", "0", "--out", out])), &["frames is 0"]);
    // An invalid map leaves no folder behind.
    let fresh = scratch.path().join("fresh");
    refusal(&["collect", "--map", "/no/such.xodr", "--out", fresh.to_str().unwrap()]);
    assert!(!fresh.exists());
}

/// Runs `omnibus` with a small file system mounted at `at`, for it alone; `None` where mounting is
/// not allowed.
fn with_little_room(at: &str, size: &str, args: &[&str]) -> Option<(bool, String)> {
    let mount = format!("mount -t tmpfs -o size={size} tmpfs {at} && exec \"$0\" \"$@\"");
    let may = std::process::Command::new("unshare")
        .args(["-m", "sh", "-c", &format!("mount -t tmpfs -o size={size} tmpfs {at}")])
        .output();
    if !may.is_ok_and(|output| output.status.success()) {
        println!("skipped: this user may not mount");
        return None;
    }
    let program = omnibus();
    let output = std::process::Command::new("unshare")
        .args(["-m", "sh", "-c", &mount])
        .arg(program.get_program())
        .args(args)
        .env("OMNIBUS_CACHE", "")
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    println!("{said}");
    Some((output.status.success(), said))
}

#[test]
fn too_little_shared_memory_is_refused_before_anything_is_created() {
    let args = ["run", "--map", small_map(), "--device", "cpu", "--no-carla"];
    let Some((went_well, said)) = with_little_room("/dev/shm", "16m", &args) else { return };
    assert!(!went_well);
    names(&said, &["/dev/shm has 16 MB free", "needs 64 MB"]);
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn a_full_disk_ends_a_collection_with_one_error_and_complete_frames() {
    let scratch = Scratch::new();
    let out = scratch.path().join("set");
    let (room, out) = (scratch.path().to_str().unwrap(), out.to_str().unwrap());
    let args = ["collect", "--map", small_map(), "--device", "cpu", "--vehicles", "3", "--frames"];
    let args = [&args[..], &["500", "--width", "320", "--height", "240", "--out", out]].concat();
    let Some((went_well, said)) = with_little_room(room, "8m", &args) else { return };
    assert!(!went_well);
    names(&said, &["the disk is full", "of 500 frames are complete", "--resume"]);
}

/// Runs the program under test in a shell, after `before`.
fn after(before: &str, args: &[&str]) -> (bool, String) {
    let program = env!("CARGO_BIN_EXE_role");
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", &format!("{before}; exec \"$0\" \"$@\""), program]).args(args);
    shell.env("OMNIBUS_CACHE", std::env::temp_dir().join("omnibus-it-cache"));
    let output = shell.output().unwrap();
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn too_few_open_files_are_refused_by_their_limit() {
    let scratch = Scratch::new();
    let out = scratch.path().join("a.mcap");
    let record = ["record", "--map", small_map(), "--device", "cpu", "--frames", "3", "--out"];
    let record = [&record[..], &[out.to_str().unwrap()]].concat();
    let (went_well, said) = after("ulimit -n 64", &record);
    assert!(!went_well);
    names(&said, &["needs 256 open files", "64 are allowed", "ulimit -n 256"]);
    assert_eq!(said.lines().count(), 1, "{said}");
    // A soft limit is raised.
    let (went_well, said) = after("ulimit -S -n 64", &record);
    assert!(went_well, "{said}");

    let sim = Sim::start(&[]);
    let (went_well, said) = after("ulimit -n 12", &["client", sim.instance().id(), "3"]);
    assert!(!went_well);
    names(&said, &["may have 12 files open (ulimit -n)"]);
    sim.end();
}
