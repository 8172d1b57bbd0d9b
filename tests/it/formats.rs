//! Data sets in the formats of others: what `omnibus export` writes is read by the official readers,
//! and its geometry is compared with the pixels and points of the data sets that it was made from.
//!
//! The readers are Python packages, installed once into a folder of their own. Without Python or
//! the registry these tests are skipped. The programs are in `tests/python/formats`.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};

use client_lib::Profile;

use crate::{
    carla::environment,
    kit::{Scratch, Sim, note_skipped, omnibus},
    record::Bustle,
};

/// All that the readers need, without what they need for other purposes: about 390 MB when installed, most of
/// it OpenCV.
const PACKAGES: &[&str] = &[
    "--no-deps",
    "numpy",
    "pillow",
    "pycocotools==2.0.11",
    "pyyaml",
    "webdataset==1.0.2",
    "braceexpand",
    "nuscenes-devkit==1.2.0",
    "pyquaternion",
    "opencv-python-headless",
    "cachetools",
    "tqdm",
    "matplotlib",
    "contourpy",
    "cycler",
    "fonttools",
    "kiwisolver",
    "packaging",
    "pyparsing",
    "python-dateutil",
    "six",
    "mcap==1.6.0",
    "mcap-protobuf-support==0.6.0",
    "foxglove-schemas-protobuf==0.4.0",
    "protobuf",
    "lz4",
    "zstandard",
];

fn python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let check = "import PIL, cv2, matplotlib.pyplot, mcap_protobuf, numpy, pycocotools, webdataset";
    FOUND.get_or_init(|| environment("omnibus-it-formats-2", PACKAGES, check)).clone()
}

/// LeRobot reads its data sets with `datasets`; the package itself needs PyTorch and Python 3.12.
/// About 420 MB when installed, most of it Arrow and pandas.
fn lerobot_python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let packages = ["datasets>=4.8,<5", "pandas>=2,<3", "pillow"];
    let check = "import PIL, datasets, pandas";
    FOUND.get_or_init(|| environment("omnibus-it-lerobot", &packages, check)).clone()
}

/// About 630 MB when installed.
fn open3d_python() -> Result<PathBuf, String> {
    static FOUND: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let packages = ["open3d-cpu>=0.19", "pillow"];
    FOUND.get_or_init(|| environment("omnibus-it-open3d", &packages, "import PIL, open3d")).clone()
}

/// The default sensors, and a radar.
const SENSORS: &str = "
[[sensor]]
name = \"front\"
kind = \"camera\"
position_m = [1.5, 0.0, 2.0]
outputs = [\"color\", \"depth\", \"tag\", \"instance\"]

[[sensor]]
name = \"lidar\"
kind = \"lidar\"
position_m = [0.0, 0.0, 2.4]

[[sensor]]
name = \"RADAR_FRONT\"
kind = \"radar\"
position_m = [2.5, 0.0, 0.6]
";

/// A folder with two small scenes of different towns.
fn scenes() -> &'static Path {
    static SCENES: OnceLock<PathBuf> = OnceLock::new();
    SCENES.get_or_init(|| {
        let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("formats-scenes");
        let _ = fs::remove_dir_all(&root);
        fs::create_dir_all(&root).unwrap();
        let sensors = root.join("sensors.toml");
        fs::write(&sensors, SENSORS).unwrap();
        for (scene, map, seed) in [("scene-a", "Flatford", "4"), ("scene-b", "Millbrook", "9")] {
            let output = omnibus()
                .args(["collect", "--map", map, "--seed", seed, "--device", "cpu", "--out"])
                .arg(root.join(scene))
                .args(["--vehicles", "60", "--walkers", "30", "--frames", "6", "--every", "5"])
                .args(["--width", "320", "--height", "240", "--amodal-masks", "--sensors"])
                .arg(&sensors)
                .output()
                .unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        root
    })
}

fn export(scenes: &Path, format: &str, out: &Path, more: &[&str]) -> Output {
    let mut command = omnibus();
    command.arg("export").arg(scenes).args(["--format", format, "--out"]).arg(out).args(more);
    command.output().unwrap()
}

fn exported(format: &str, out: &Path, more: &[&str]) {
    let output = export(scenes(), format, out, more);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Exports the scenes and runs the program that checks the result.
fn check(test: &str, format: &str, more: &[&str]) {
    let python = match format {
        "lerobot" => lerobot_python(),
        "ply" => open3d_python(),
        _ => python(),
    };
    let python = match python {
        Ok(python) => python,
        Err(why) => return note_skipped(test, &format!("no Python environment: {why}")),
    };
    let folder = Scratch::new();
    let out = folder.path().join("set");
    exported(format, &out, more);
    let script = format!("{}/python/formats/check_{format}.py", env!("CARGO_MANIFEST_DIR"));
    let ended = Command::new(python).arg(script).arg(&out).arg(scenes()).output().unwrap();
    println!("{}", String::from_utf8_lossy(&ended.stdout));
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{format}: {}\n{said}", ended.status);
}

#[test]
fn coco_s_own_reader_finds_the_pixels_of_each_instance() {
    check("coco_s_own_reader_finds_the_pixels_of_each_instance", "coco", &["--validation", "0.5"]);
}

#[test]
fn boxes_of_yolo_enclose_the_pixels_of_each_instance() {
    check("boxes_of_yolo_enclose_the_pixels_of_each_instance", "yolo", &[]);
}

#[test]
fn webdataset_s_own_reader_finds_the_files_of_each_frame() {
    let test = "webdataset_s_own_reader_finds_the_files_of_each_frame";
    check(test, "webdataset", &["--shard-samples", "5"]);
}

#[test]
fn nuscenes_own_reader_finds_pixels_and_points_in_every_box() {
    check("nuscenes_own_reader_finds_pixels_and_points_in_every_box", "nuscenes", &[]);
}

#[test]
fn boxes_and_points_of_kitti_project_as_its_readme_says() {
    check("boxes_and_points_of_kitti_project_as_its_readme_says", "kitti", &[]);
}

#[test]
fn open3d_reads_the_points_labels_and_poses_of_every_lidar() {
    check("open3d_reads_the_points_labels_and_poses_of_every_lidar", "ply", &[]);
}

#[test]
fn mcap_s_own_reader_finds_the_schemas_of_foxglove() {
    check("mcap_s_own_reader_finds_the_schemas_of_foxglove", "mcap", &[]);
}

#[test]
fn images_of_every_format_hold_the_same_and_are_exported_as_the_same() {
    let folder = Scratch::new();
    for format in ["png", "jpeg", "npy", "npy.zst"] {
        let set = folder.path().join(format);
        let output = omnibus()
            .args(["collect", "--map", "Flatford", "--seed", "4", "--device", "cpu", "--out"])
            .arg(&set)
            .args(["--vehicles", "20", "--walkers", "10", "--frames", "3", "--every", "5"])
            .args(["--width", "160", "--height", "120", "--image-format", format])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let verified = omnibus().args(["collect", "--verify"]).arg(&set).output().unwrap();
        let text = String::from_utf8_lossy(&verified.stdout);
        assert!(verified.status.success() && text.contains("no fault"), "{format}: {text}");
        assert!(text.contains("lidar against the depth of front"), "{format}: {text}");
    }
    let exported = ["png", "npy", "npy.zst"].map(|format| {
        let out = folder.path().join(format!("yolo-{format}"));
        let output = export(&folder.path().join(format), "yolo", &out, &[]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        // The names hold that of the data set.
        let named = |(path, bytes): (PathBuf, Vec<u8>)| {
            (path.to_string_lossy().replace(&format!("{}_", format.replace('.', "_")), ""), bytes)
        };
        files(&out).into_iter().map(named).collect::<BTreeMap<_, _>>()
    });
    for other in &exported[1..] {
        let (one, other) = (&exported[0], other);
        assert!(one.keys().eq(other.keys()), "{:?} {:?}", one.keys(), other.keys());
        for (path, bytes) in one.iter().filter(|(path, _)| path.contains("images/")) {
            assert!(bytes == &other[path], "{path}");
        }
    }
    let python = match python() {
        Ok(python) => python,
        Err(why) => {
            let test = "images_of_every_format_hold_the_same_and_are_exported_as_the_same";
            return note_skipped(test, &format!("no Python environment: {why}"));
        }
    };
    let script = format!("{}/python/formats/check_images.py", env!("CARGO_MANIFEST_DIR"));
    let ended = Command::new(python).arg(script).arg(folder.path()).output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
}

#[test]
fn lerobot_s_reader_finds_states_controls_and_images() {
    check("lerobot_s_reader_finds_states_controls_and_images", "lerobot", &[]);
}

/// A recording with vehicles that come, go, and collide; where everything is says `omnibus inspect`.
#[test]
fn an_exported_recording_has_the_places_and_events_of_the_recording() {
    let test = "an_exported_recording_has_the_places_and_events_of_the_recording";
    let python = match python() {
        Ok(python) => python,
        Err(why) => return note_skipped(test, &format!("no Python environment: {why}")),
    };
    let folder = Scratch::new();
    let path = |name: &str| folder.path().join(name);
    let recorded = path("busy.mcap");
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    let mut bustle = Bustle::new(&mut client);
    client.start_recorder(recorded.to_str().unwrap(), Profile::State).unwrap();
    for _ in 0..60 {
        bustle.act(&mut client);
        client.tick().unwrap();
    }
    client.stop_recorder().unwrap();
    drop(client);
    sim.end();
    let told = |args: &[&str]| {
        let output = omnibus().args(args).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
        output.stdout
    };
    let [recorded, out] = [&recorded, &path("out")].map(|path| path.to_str().unwrap().to_owned());
    let said = told(&["export", &recorded, "--format", "mcap", "--out", &out]);
    assert!(String::from_utf8(said).unwrap().starts_with("60 frames of 1 recording in"));
    fs::write(path("places"), told(&["inspect", &recorded, "--info", "--all"])).unwrap();
    let collisions = ["inspect", &recorded, "--collisions", "a,a", "--json"];
    fs::write(path("collisions"), told(&collisions)).unwrap();
    let script = format!("{}/python/formats/check_recording.py", env!("CARGO_MANIFEST_DIR"));
    let files = ["out/busy.mcap", "places", "collisions"].map(path);
    let ended = Command::new(python).arg(script).args(files).output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{}\n{said}", ended.status);
}

const FORMATS: [&str; 8] =
    ["coco", "kitti", "lerobot", "mcap", "nuscenes", "ply", "webdataset", "yolo"];

/// The files below a folder, by their path in it.
fn files(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(root).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn an_export_has_the_same_bytes_whatever_the_number_of_threads() {
    let folder = Scratch::new();
    for format in FORMATS {
        let written = ["1", "4"].map(|threads| {
            let out = folder.path().join(format!("{format}-{threads}"));
            exported(format, &out, &["--threads", threads, "--jpeg", "80"]);
            files(&out)
        });
        let [one, four] = &written;
        assert!(!one.is_empty() && one.keys().eq(four.keys()), "{format}");
        for (path, bytes) in one {
            assert!(four[path] == *bytes, "{format}: {} differs", path.display());
        }
    }
}

#[test]
fn an_export_that_fails_names_the_file_and_leaves_nothing() {
    let folder = Scratch::new();
    let broken = folder.path().join("broken");
    for (path, bytes) in files(scenes()) {
        let to = broken.join(path);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::write(to, bytes).unwrap();
    }
    let names = fs::read_dir(broken.join("scene-b/boxes")).unwrap();
    let mut names: Vec<_> = names.map(|entry| entry.unwrap().path()).collect();
    names.sort();
    fs::write(&names[3], "{\"frame\":1").unwrap();
    let missing = broken.join("scene-b/front/color").join(names[4].file_name().unwrap());
    fs::remove_file(missing.with_extension("png")).unwrap();
    let labels = broken.join("scene-b/lidar/labels").join(names[4].file_name().unwrap());
    fs::remove_file(labels.with_extension("bin")).unwrap();
    for format in FORMATS {
        let out = folder.path().join(format!("out-{format}"));
        let output = export(&broken, format, &out, &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{format}: {said}");
        // The first fault in the order of the frames; WebDataset takes boxes as they are, others none.
        let takes_boxes = !["webdataset", "lerobot", "ply"].contains(&format);
        let at_fault = if takes_boxes { &names[3] } else { &missing };
        let name = at_fault.file_name().unwrap().to_str().unwrap();
        let name = name.trim_end_matches(".json");
        assert!(said.contains(name) && !said.contains("panicked"), "{format}: {said}");
    }
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(left, [broken]);
}

#[test]
fn a_collection_is_written_in_another_format_as_an_export_writes_it() {
    let folder = Scratch::new();
    let set = folder.path().join("set");
    let collect = |more: &[&str]| {
        let mut command = omnibus();
        command.args(["collect", "--map", "Flatford", "--device", "cpu", "--frames", "2"]);
        command.args(["--vehicles", "5", "--walkers", "2", "--width", "64", "--height", "48"]);
        command.arg("--out").arg(&set).args(more).output().unwrap()
    };
    let refused = collect(&["--format", "coco", "--shard", "0/2"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--shard"), "{refused:?}");
    assert!(!set.exists());
    let first = collect(&["--format", "coco", "--scenes", "2"]);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    // All scenes are there: another format is added, and one that is there stays.
    for (format, lines) in [("yolo", 1), ("coco", 0)] {
        let more = collect(&["--format", format, "--scenes", "2", "--resume", "--json"]);
        assert!(more.status.success(), "{}", String::from_utf8_lossy(&more.stderr));
        let said = String::from_utf8(more.stdout).unwrap();
        assert_eq!(said.matches("\"event\":\"export\"").count(), lines, "{said}");
    }
    for format in ["coco", "yolo"] {
        let out = folder.path().join(format);
        assert!(export(&set, format, &out, &[]).status.success());
        assert!(files(&out) == files(&set.join(format)), "{format}");
        assert!(files(&out).len() > 4, "{:?}", files(&out).keys());
    }
}

#[test]
fn episodes_of_lerobot_share_rate_and_cameras() {
    let folder = Scratch::new();
    let copy = folder.path().join("scenes");
    for path in ["scene-a", "scene-b"]
        .iter()
        .flat_map(|scene| ["metadata.json", "frames.jsonl"].map(|name| Path::new(scene).join(name)))
    {
        fs::create_dir_all(copy.join(&path).parent().unwrap()).unwrap();
        fs::copy(scenes().join(&path), copy.join(path)).unwrap();
    }
    let metadata = copy.join("scene-b/metadata.json");
    let text = fs::read_to_string(&metadata).unwrap();
    for (from, to, expected) in [
        (
            "\"every_frames\": 5",
            "\"every_frames\": 4",
            "scene-b has 5 frames a second, scene-a has 4",
        ),
        (
            "\"width_px\": 320",
            "\"width_px\": 321",
            "scene-b has the cameras [(\"front\", 321, 240)]",
        ),
    ] {
        assert!(text.contains(from), "{text}");
        fs::write(&metadata, text.replace(from, to)).unwrap();
        let output = export(&copy, "lerobot", &folder.path().join("out"), &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && said.contains(expected), "{said}");
    }
    // A frame is missing.
    fs::write(&metadata, text).unwrap();
    let lines = copy.join("scene-a/frames.jsonl");
    let text = fs::read_to_string(&lines).unwrap();
    let kept: Vec<_> = text.lines().enumerate().filter(|(index, _)| *index != 2).collect();
    let kept: String = kept.iter().map(|(_, line)| format!("{line}\n")).collect();
    fs::write(&lines, kept).unwrap();
    let output = export(&copy, "lerobot", &folder.path().join("out"), &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("is a frame missing?"), "{said}");
}

#[test]
fn an_export_refuses_what_it_cannot_do() {
    let folder = Scratch::new();
    let refusal = |from: &Path, out: &Path, more: &[&str]| {
        let output = export(from, "coco", out, more);
        assert!(!output.status.success());
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!said.contains("panicked"), "{said}");
        said
    };
    let out = folder.path().join("out");
    let said = refusal(folder.path(), &out, &[]);
    assert!(said.contains("scene-*/metadata.json"), "{said}");
    let said = refusal(scenes(), folder.path(), &[]);
    assert!(said.contains("exists; choose another --out"), "{said}");
    let said = refusal(scenes(), &out, &["--validation", "1"]);
    assert!(said.contains("--validation is 1"), "{said}");
    let plan = folder.path().join("some.mcap");
    fs::write(&plan, "no recording").unwrap();
    let said = refusal(&plan, &out, &[]);
    assert!(said.contains("is no folder; a recording has no images"), "{said}");
    let output = export(&plan, "mcap", &out, &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && said.contains("some.mcap"), "{said}");
    // What a killed export left makes room; what is not of an export does not.
    let partial = folder.path().join("out.partial");
    fs::create_dir(&partial).unwrap();
    let said = refusal(scenes(), &out, &[]);
    assert!(said.contains("out.partial exists and is no rest of an export"), "{said}");
    fs::write(partial.join(".lock"), "").unwrap();
    fs::write(partial.join("half.png"), "").unwrap();
    exported("coco", &out, &[]);
    assert!(!partial.exists() && !out.join("half.png").exists() && !out.join(".lock").exists());
}
