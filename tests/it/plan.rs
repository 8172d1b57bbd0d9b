//! Collections of several scenes: a scene follows from its plan and its index, whatever happens meanwhile.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::{Child, Stdio},
    time::Duration,
};

use protocol::{ActorId, Pose, kind, output};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::kit::{Scratch, Sim, eventually, omnibus, run_asynchronously, small_map};

const PLAN: &str = "
scenes = 3
frames = 12
every = 3
warmup = 20
hours = [12.0, 17.0]

[[weather]]
preset = \"clear\"

[[weather]]
preset = \"rain\"

[traffic]
vehicles = 6
vehicles_near = 4
walkers = 4
radius_m = 60.0
in_view = 9.0

[[event]]
at_secs = 0.5
weather = { preset = \"fog\" }
crossing = { ahead_m = 12.0, speed_mps = 1.5 }

[[sensor]]
name = \"left\"
kind = \"camera\"
position_m = [1.5, 0.4, 1.6]
yaw_deg = 60.0
width_px = 64
height_px = 48
outputs = [\"color\", \"instance\"]

[[sensor]]
name = \"front\"
kind = \"camera\"
position_m = [1.5, 0.0, 1.6]
width_px = 96
height_px = 48
outputs = [\"color\", \"depth\", \"tag\", \"instance\"]

[[sensor]]
name = \"top\"
kind = \"lidar\"
position_m = [0.0, 0.0, 2.2]
channels = 8
columns = 180
noise_m = 0.02
";

/// Writes a plan with the small map, and returns its path.
fn plan_in(folder: &Path) -> PathBuf {
    let path = folder.join("plan.toml");
    fs::write(&path, format!("maps = [\"{}\"]\n{PLAN}", small_map())).unwrap();
    path
}

pub(crate) fn collect(plan: &Path, out: &Path, more: &[&str]) -> Child {
    let mut command = omnibus();
    command.arg("collect").arg(plan).arg("--out").arg(out);
    command.args(["--device", "cpu"]).args(more);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits for a collection that ends well; returns what it printed.
pub(crate) fn finish(child: Child) -> String {
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Every file below a folder, by its path.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if entry.file_name() != ".lock" {
                found.insert(
                    path.strip_prefix(folder).unwrap().to_owned(),
                    fs::read(&path).unwrap(),
                );
            }
        }
    }
    found
}

pub(crate) fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (files(one), files(other));
    let names = |set: &BTreeMap<PathBuf, Vec<u8>>| set.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    for (path, bytes) in &one {
        assert!(*bytes == other[path], "{} differs", path.display());
    }
}

#[test]
fn a_scene_is_the_same_in_every_shard_and_after_every_kill() {
    let scratch = Scratch::new();
    let plan = plan_in(scratch.path());
    let out = |name: &str| scratch.path().join(name);
    finish(collect(&plan, &out("whole"), &[]));
    // Two shards write into one folder.
    let shards = ["0/2", "1/2"].map(|shard| collect(&plan, &out("shards"), &["--shard", shard]));
    shards.into_iter().for_each(|shard| drop(finish(shard)));
    assert_same(&out("whole"), &out("shards"));
    // A single scene, into a folder of its own.
    finish(collect(&plan, &out("second"), &["--scene", "1", "--pipeline", "3"]));
    assert_same(&out("whole").join("scene-0001"), &out("second"));

    // The whole collection is killed, and goes on.
    let mut killed = collect(&plan, &out("killed"), &[]);
    let first = out("killed").join("scene-0000/frames.jsonl");
    await_that(|| fs::read_to_string(&first).is_ok_and(|lines| lines.lines().count() > 2));
    killed.kill().unwrap();
    killed.wait().unwrap();
    // The process of the scene ends by itself; its folder is free again.
    await_that(|| {
        let lock = fs::File::open(out("killed").join("scene-0000/.lock"));
        lock.map_or(true, |file| file.try_lock().is_ok())
    });
    finish(collect(&plan, &out("killed"), &["--resume"]));
    assert_same(&out("whole"), &out("killed"));

    // The process of a scene is killed; the collection continues it.
    let child = collect(&plan, &out("scene-killed"), &[]);
    let first = out("scene-killed").join("scene-0000/frames.jsonl");
    await_that(|| fs::read_to_string(&first).is_ok_and(|lines| lines.lines().count() > 2));
    kill_process(child_of(child.id()), Signal::KILL).unwrap();
    finish(child);
    assert_same(&out("whole"), &out("scene-killed"));
}

fn await_that(condition: impl Fn() -> bool) {
    while !condition() {
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The first child of a process.
fn child_of(pid: u32) -> Pid {
    let path = format!("/proc/{pid}/task/{pid}/children");
    let children = fs::read_to_string(path).unwrap();
    let first = children.split_whitespace().next().expect("the scene runs");
    Pid::from_raw(first.parse().unwrap()).unwrap()
}

#[test]
fn a_plan_decides_sensors_weather_events_and_road_users_and_json_lines_tell_the_progress() {
    let scratch = Scratch::new();
    let plan = plan_in(scratch.path());
    let out = scratch.path().join("set");
    let said = finish(collect(&plan, &out, &["--json", "--scenes", "2"]));
    let events: Vec<Value> = said.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let last = events.last().unwrap();
    assert_eq!((&last["event"], last["frames"].as_u64()), (&Value::from("complete"), Some(24)));
    // Two cameras with six outputs together.
    assert_eq!(last["images"].as_u64(), Some(24 * 6));
    let scenes: Vec<_> = events.iter().filter(|e| e["event"] == "scene_complete").collect();
    assert_eq!(scenes.iter().map(|e| e["scene"].as_u64().unwrap()).collect::<Vec<_>>(), [0, 1]);
    assert!(events.iter().any(|e| e["step"] == "placing the road users"));

    let read = |scene: &str, file: &str| -> Value {
        let text = fs::read_to_string(out.join(scene).join(file)).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let precipitation = |scene: &str| {
        let settings = &read(scene, "metadata.json")["settings"];
        settings["weather"]["precipitation"].as_f64().unwrap()
    };
    assert_eq!((precipitation("scene-0000"), precipitation("scene-0001")), (0.0, 60.0));
    let metadata = read("scene-0000", "metadata.json");
    let sensors = metadata["settings"]["sensors"].as_array().unwrap();
    let widths: Vec<_> = sensors.iter().map(|s| s["camera"]["width_px"].as_u64()).collect();
    assert_eq!(widths[..3], [Some(64), Some(96), None]);
    assert_eq!(metadata["spawned_actors"]["vehicles_spawned"], 6);

    // The pedestrian who crosses is in the images of the camera ahead.
    let has_walker = |line: &str| {
        let frame = serde_json::from_str::<Value>(line).unwrap()["frame"].as_u64().unwrap();
        let boxes = read("scene-0000", &format!("boxes/{frame:06}.json"));
        let actors = boxes["actors"].as_array().unwrap().clone();
        actors.iter().any(|a| {
            a["tag_name"] == "Pedestrian" && a["cameras"]["front"]["visible_px"].as_u64() > Some(5)
        })
    };
    let lines = fs::read_to_string(out.join("scene-0000/frames.jsonl")).unwrap();
    assert!(lines.lines().skip(4).any(has_walker), "no pedestrian crosses");

    // Another plan is refused, with the value that differs.
    let other = collect(&plan, &out, &["--scenes", "2", "--vehicles", "7", "--resume"]);
    let output = other.wait_with_output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success());
    assert!(error.contains("traffic.vehicles 6, this command has 7"), "{error}");
}

#[test]
fn a_street_of_the_default_plan_has_road_users() {
    let scratch = Scratch::new();
    let out = scratch.path().join("set");
    let mut command = omnibus();
    command.args(["collect", "--frames", "10", "--every", "20", "--device", "cpu"]);
    command.args(["--width", "400", "--height", "300", "--out"]).arg(&out);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut counts = BTreeMap::<String, usize>::new();
    for entry in fs::read_dir(out.join("boxes")).unwrap().flatten() {
        let boxes: Value = serde_json::from_slice(&fs::read(entry.path()).unwrap()).unwrap();
        for actor in boxes["actors"].as_array().unwrap() {
            let edges = &actor["cameras"]["front"]["visible_box_px"];
            // 12 of 300 pixels are 25 of 600.
            if edges[3].as_u64() >= edges[1].as_u64().map(|top| top + 12) && edges[3].is_u64() {
                *counts.entry(actor["tag_name"].as_str().unwrap().to_owned()).or_default() += 1;
            }
        }
    }
    let of = |name: &str| counts.get(name).copied().unwrap_or(0);
    assert!(of("Pedestrian") >= 10 && of("Car") >= 5, "in ten images: {counts:?}");
}

#[test]
fn plans_to_start_from_are_printed_and_faults_of_a_plan_are_named() {
    let printed = |name: &str| {
        let output = omnibus().args(["collect", "--init", name]).output().unwrap();
        (
            output.status.success(),
            String::from_utf8_lossy(&output.stdout).into_owned(),
            output.stderr,
        )
    };
    for name in ["carla-default", "nuscenes", "kitti", "waymo"] {
        let (went_well, text, _) = printed(name);
        assert!(went_well && text.contains("[[sensor]]"), "{name}");
    }
    let (went_well, _, error) = printed("cityscapes");
    assert!(!went_well);
    assert!(String::from_utf8_lossy(&error).contains("use carla-default"));

    let scratch = Scratch::new();
    let error_of = |text: &str| {
        let plan = scratch.path().join("wrong.toml");
        fs::write(&plan, text).unwrap();
        let output = collect(&plan, &scratch.path().join("none"), &[]).wait_with_output().unwrap();
        assert!(!output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    for (text, said) in [
        ("frames = 3\nfrmaes = 4", "frmaes"),
        ("frames = 0", "frames is 0"),
        ("maps = [\"Atlantis\"]", "no map is named \"Atlantis\""),
        ("[[weather]]\npreset = \"hail\"", "hail"),
        ("frames = \"many\"", "invalid type"),
    ] {
        let error = error_of(text);
        assert!(error.contains(said) && error.contains("omnibus: "), "{error}");
        assert!(!error.contains("panicked"), "{error}");
    }
}

#[test]
fn no_camera_of_a_plan_to_start_from_shows_the_ego() {
    let scratch = Scratch::new();
    for name in ["carla-default", "nuscenes", "kitti", "waymo"] {
        let printed = omnibus().args(["collect", "--init", name]).output().unwrap().stdout;
        let plan = scratch.path().join(format!("{name}.toml"));
        fs::write(&plan, printed).unwrap();
        let set = scratch.path().join(name);
        let few = ["--scene", "0", "--frames", "1", "--every", "1", "--warmup", "5"];
        finish(collect(&plan, &set, &few));
        let text = fs::read(set.join("metadata.json")).unwrap();
        let metadata: Value = serde_json::from_slice(&text).unwrap();
        let ego = metadata["spawned_actors"]["ego_actor_id"].as_u64().unwrap();
        let sensors = metadata["settings"]["sensors"].as_array().unwrap();
        let cameras: Vec<_> = sensors.iter().filter(|s| s.get("camera").is_some()).collect();
        assert!(!cameras.is_empty());
        for camera in cameras {
            let camera = camera["name"].as_str().unwrap();
            let images = files(&set.join(camera).join("instance"));
            let (_, image) = images.first_key_value().unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(image)).read_info().unwrap();
            let mut ids = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut ids).unwrap();
            let is_ego =
                |id: &&[u8]| u64::from(id[0]) + 256 * u64::from(id[1]) == ego && id[2] == 0;
            let count = ids.chunks_exact(3).filter(is_ego).count();
            assert_eq!(count, 0, "pixels of the ego in {camera} of {name}");
        }
    }
}

/// The mean brightness of an image over the first road of a new world, 0 to 255.
fn brightness(args: &[&str]) -> f64 {
    let sim = Sim::start(args);
    let mut client = sim.client("look");
    run_asynchronously(&mut client);
    eventually("the population is there", || {
        client.await_frame().unwrap();
        client.world().states().iter().filter(|s| s.kind == kind::VEHICLE).count() == 2
    });
    let above = Pose::level(glam::Vec3::new(0.0, 0.0, 30.0), 0.0);
    let camera = client_lib::wire::camera("eye", above, 32, 24, 1.5, output::COLOR);
    let mut bundle = client.create_bundle("eye", ActorId::NONE, [camera], 2).unwrap();
    let measured = client.await_measurement(&mut bundle).unwrap();
    let pixels = measured.color(0).unwrap();
    let sum: f64 =
        pixels.iter().map(|[r, g, b, _]| f64::from(*r) + f64::from(*g) + f64::from(*b)).sum();
    let mean = sum / 3.0 / pixels.len() as f64;
    drop((bundle, client));
    sim.end();
    mean
}

#[test]
fn a_simulator_starts_with_road_users_and_weather() {
    let [noon, midnight] = ["12", "0"]
        .map(|hour| brightness(&["--vehicles", "2", "--time", hour, "--weather", "overcast"]));
    assert!(noon > 60.0 && midnight < 0.6 * noon, "{noon} {midnight}");

    let sim = Sim::start(&["--vehicles", "3", "--walkers", "4"]);
    let mut client = sim.client("look");
    run_asynchronously(&mut client);
    let positions = |client: &mut client_lib::Client| {
        client.await_frame().unwrap();
        let states = client.world().states();
        let of = |wanted| states.iter().filter(move |s| s.kind == wanted);
        let walkers: Vec<_> = of(kind::WALKER).map(|s| s.pose.position()).collect();
        (of(kind::VEHICLE).count(), walkers)
    };
    let mut start = Vec::new();
    eventually("all are there", || {
        let (vehicles, walkers) = positions(&mut client);
        start = walkers;
        (vehicles, start.len()) == (3, 4)
    });
    eventually("every pedestrian has walked a metre", || {
        let (_, walkers) = positions(&mut client);
        walkers.iter().zip(&start).all(|(now, then)| now.distance(*then) > 1.0)
    });
    drop(client);
    let log = sim.end();
    assert!(log.contains("3 vehicles and 4 pedestrians are in the world"), "{log}");

    let output = omnibus().args(["run", "--weather", "hail", "--no-carla"]).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && error.contains("hail"), "{error}");
}

#[test]
fn verify_and_inspect_take_a_folder_of_scenes_and_name_each_scene_with_a_fault() {
    let scratch = Scratch::new();
    let plan = plan_in(scratch.path());
    let out = scratch.path().join("set");
    finish(collect(&plan, &out, &["--frames", "2"]));
    let run = |verb: &[&str]| {
        let output = omnibus().args(verb).arg(&out).output().unwrap();
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        (output.status.success(), text)
    };
    let verify = || run(&["collect", "--verify"]);
    let (is_sound, text) = verify();
    assert!(is_sound && text.starts_with("3 scenes, 6 frames, "), "{text}");
    assert_eq!(text.matches("top against the depth of front").count(), 1, "{text}");
    let (is_sound, text) = run(&["inspect"]);
    assert!(is_sound && text.contains("3 of 3 scenes are complete: 6 frames, "), "{text}");

    let list = fs::read_to_string(out.join("scene-0001/frames.jsonl")).unwrap();
    let first: Value = serde_json::from_str(list.lines().next().unwrap()).unwrap();
    let color = format!("front/color/{:06}.png", first["frame"].as_u64().unwrap());
    fs::remove_file(out.join("scene-0001").join(&color)).unwrap();
    for verb in [&["collect", "--verify"][..], &["inspect"]] {
        let (is_sound, text) = run(verb);
        assert!(!is_sound && text.contains("1 of 3 scenes have faults"), "{text}");
        let named = text.lines().filter(|line| line.starts_with("scene-")).collect::<Vec<_>>();
        assert!(matches!(named[..], [line] if line.contains(&color)), "{text}");
    }
    fs::remove_dir_all(out.join("scene-0001")).unwrap();
    let (is_sound, text) = verify();
    let missing = "scene-0001: missing: plan.toml has 3 scenes; omnibus collect ";
    assert!(!is_sound && text.contains(missing) && text.contains("--resume"), "{text}");
    let (is_sound, text) = run(&["inspect"]);
    assert!(is_sound && text.contains("2 of 3 scenes are complete"), "{text}");
    // What it says to try is what helps.
    finish(collect(&out.join("plan.toml"), &out, &["--resume"]));
    let (is_sound, text) = verify();
    assert!(is_sound, "{text}");
}

const RATES: &str = "
frames = 14
warmup = 10
sun_altitudes_deg = [40.0, 10.0]

[traffic]
vehicles = 6
vehicles_near = 6
walkers = 4
radius_m = 60.0

[[sensor]]
name = \"front\"
kind = \"camera\"
position_m = [1.5, 0.0, 1.6]
width_px = 96
height_px = 48
rate_hz = 8.0
outputs = [\"color\", \"depth\", \"tag\", \"instance\"]

[[sensor]]
name = \"rear\"
kind = \"camera\"
yaw_deg = 180.0
position_m = [-1.5, 0.0, 1.6]
width_px = 64
height_px = 48
rate_hz = 4.0
outputs = [\"color\", \"instance\"]

[[sensor]]
name = \"top\"
kind = \"lidar\"
position_m = [0.0, 0.0, 2.2]
channels = 8
columns = 180
rate_hz = 10.0
";

/// The lines of the list of frames.
fn lines(set: &Path) -> Vec<Value> {
    let text = fs::read_to_string(set.join("frames.jsonl")).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn sensors_measure_at_their_rates_and_every_reader_takes_frames_without_some_of_them() {
    let scratch = Scratch::new();
    let plan = scratch.path().join("plan.toml");
    fs::write(&plan, format!("maps = [\"{}\"]\n{RATES}", small_map())).unwrap();
    let out = |name: &str| scratch.path().join(name);
    finish(collect(&plan, &out("set"), &["--scene", "0"]));
    let lines = lines(&out("set"));
    let frame = |line: &Value| line["frame"].as_u64().unwrap();
    let measured = |sensor: &str| -> Vec<u64> {
        let has = |line: &&Value| {
            line["sensors"].as_array().unwrap().iter().any(|pose| pose["name"] == sensor)
        };
        lines.iter().filter(has).map(frame).collect()
    };
    assert_eq!(lines.len(), 14);
    let mut together = Vec::new();
    for (sensor, rate_hz, output, extension) in [
        ("front", 8.0, "color", "png"),
        ("rear", 4.0, "instance", "png"),
        ("top", 10.0, "points", "bin"),
    ] {
        let frames = measured(sensor);
        // The first measurement of the bundle was some whole number of 1 s before a frame in which all
        // measure; from there on, each is in the first frame at or after its time.
        let start = *measured("rear").iter().find(|f| measured("top").contains(f)).unwrap();
        let expected: Vec<u64> = (0..40)
            .map(|count| start + (f64::from(count) * 20.0 / rate_hz - 1e-6).ceil().max(0.0) as u64)
            .filter(|at| *at <= frame(lines.last().unwrap()))
            .collect();
        let from_start: Vec<u64> = frames.iter().copied().filter(|at| *at >= start).collect();
        assert_eq!(from_start, expected, "{sensor}");
        let mut files: Vec<u64> = fs::read_dir(out("set").join(sensor).join(output))
            .unwrap()
            .map(|entry| {
                let name = entry.unwrap().file_name().into_string().unwrap();
                name.strip_suffix(&format!(".{extension}")).unwrap().parse().unwrap()
            })
            .collect();
        files.sort();
        assert_eq!(files, frames, "{sensor}");
        together.push(frames);
    }
    // Half of the kept frames have each sun, whatever their distance in time.
    let altitude = |line: &Value| line["weather"]["sun_altitude_rad"].as_f64().unwrap();
    assert_eq!(lines.iter().filter(|line| altitude(line) > 0.5).count(), 7);
    for verb in [&["collect", "--verify"][..], &["inspect"]] {
        let output = omnibus().args(verb).arg(out("set")).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }

    // The readers of exports.
    let export = |format: &str| {
        let mut command = omnibus();
        command.arg("export").arg(out("set")).args(["--format", format, "--out"]);
        let output = command.arg(out(format)).output().unwrap();
        assert!(output.status.success(), "{format}: {}", String::from_utf8_lossy(&output.stderr));
        files(&out(format))
    };
    let images = together[0].len() + together[1].len();
    let count = |files: &BTreeMap<PathBuf, Vec<u8>>, part: &str| {
        files.keys().filter(|path| path.to_string_lossy().contains(part)).count()
    };
    assert_eq!(count(&export("coco"), "images/"), images);
    assert_eq!(count(&export("yolo"), "images/"), images);
    assert_eq!(count(&export("webdataset"), ".tar"), 1);
    assert_eq!(count(&export("mcap"), ".mcap"), 1);
    let [front, rear, top] = &together[..] else { panic!("three sensors") };
    let pairs = front.iter().filter(|at| top.contains(at)).count();
    let kitti = export("kitti");
    assert_eq!((count(&kitti, "image_2/"), count(&kitti, "velodyne/")), (pairs, pairs));
    let samples = rear.iter().filter(|at| front.contains(at) && top.contains(at)).count();
    let nuscenes = export("nuscenes");
    let table = |name: &str| -> Vec<Value> {
        let path = Path::new("v1.0-trainval").join(format!("{name}.json"));
        serde_json::from_slice(&nuscenes[&path]).unwrap()
    };
    assert!(samples >= 1);
    assert_eq!(table("sample").len(), samples);
    assert_eq!(table("sample_data").len(), front.len() + rear.len() + top.len());
    assert_eq!(count(&nuscenes, "sweeps/"), front.len() + rear.len() + top.len() - 3 * samples);
    let tokens: Vec<_> = table("sample").iter().map(|row| row["token"].clone()).collect();
    assert!(table("sample_data").iter().all(|row| tokens.contains(&row["sample_token"])));

    // A run that was killed continues, with the same bytes.
    let mut killed = collect(&plan, &out("killed"), &["--scene", "0", "--pipeline", "3"]);
    let list = out("killed/frames.jsonl");
    await_that(|| fs::read_to_string(&list).is_ok_and(|lines| lines.lines().count() > 4));
    killed.kill().unwrap();
    killed.wait().unwrap();
    finish(collect(&plan, &out("killed"), &["--scene", "0", "--resume"]));
    assert_same(&out("set"), &out("killed"));

    let faster = fs::read_to_string(&plan).unwrap().replace("rate_hz = 8.0", "rate_hz = 30.0");
    fs::write(&plan, faster).unwrap();
    let refused = collect(&plan, &out("none"), &[]).wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        error.contains("\"front\": rate_hz is 30") && error.contains("but 20.000 frames"),
        "{error}"
    );
}

/// The sensors of a plan with one camera that writes instances alone.
const INSTANCES: &str = "
[[sensor]]
name = \"front\"
kind = \"camera\"
position_m = [1.5, 0.0, 2.0]
width_px = 400
height_px = 300
outputs = [\"instance\"]
";

#[test]
fn road_users_that_replace_others_do_not_appear_in_the_images() {
    let scratch = Scratch::new();
    let (plan, set) = (scratch.path().join("plan.toml"), scratch.path().join("set"));
    fs::write(&plan, format!("frames = 240\nseed = 2\n{INSTANCES}")).unwrap();
    finish(collect(&plan, &set, &["--scene", "0"]));
    let mut seen = BTreeSet::new();
    // They are replaced after every twentieth frame.
    let (mut at_once, mut later) = (0, 0);
    for (index, line) in lines(&set).iter().enumerate() {
        let frame = line["frame"].as_u64().unwrap();
        let text = fs::read(set.join(format!("boxes/{frame:06}.json"))).unwrap();
        let boxes: Value = serde_json::from_slice(&text).unwrap();
        for actor in boxes["actors"].as_array().unwrap() {
            let edge =
                |at: usize| actor["cameras"]["front"]["visible_box_px"][at].as_u64().unwrap();
            let is_new = seen.insert(actor["actor_id"].as_u64().unwrap());
            if is_new && index > 0 && edge(3) - edge(1) >= 6 {
                *if frame % 20 == 1 { &mut at_once } else { &mut later } += 1;
            }
        }
    }
    assert!(at_once <= 1 && later >= 5, "{at_once} at once, {later} later");
}

#[test]
fn densities_decide_how_many_road_users_are_near() {
    let scratch = Scratch::new();
    let plan = scratch.path().join("plan.toml");
    let place = |per_km: [f32; 2]| {
        let set = scratch.path().join(format!("set-{}-{}", per_km[0], per_km[1]));
        let traffic = format!(
            "[traffic]\nvehicles = 0\nvehicles_per_km = {:.1}\nwalkers_per_km = {:.1}\nin_view = 0.0\n",
            per_km[0], per_km[1]
        );
        fs::write(&plan, format!("frames = 1\nwarmup = 5\n{traffic}{INSTANCES}")).unwrap();
        finish(collect(&plan, &set, &["--scene", "0"]));
        let read = |name: &str| -> Value {
            serde_json::from_slice(&fs::read(set.join(name)).unwrap()).unwrap()
        };
        let metadata = read("metadata.json");
        assert_eq!(metadata["settings"]["vehicles_per_km"], f64::from(per_km[0]));
        let vehicles = metadata["spawned_actors"]["vehicles_spawned"].as_u64().unwrap();
        let tracks = read("tracks.json");
        let actors = tracks["actors"].as_object().unwrap().values();
        (vehicles, actors.filter(|track| track["tag_name"] == "Pedestrian").count())
    };
    let (none, no_walkers) = place([0.0, 0.0]);
    let (some, few) = place([20.0, 20.0]);
    let (twice, many) = place([40.0, 200.0]);
    assert_eq!((none, no_walkers), (0, 0));
    // Within 120 m are 0.3 to 2 km of lanes.
    assert!((6..=40).contains(&some) && twice.abs_diff(2 * some) <= 1, "{some} {twice}");
    assert!(many > few + 3, "{few} {many}");
}
