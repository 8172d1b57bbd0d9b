//! `map`: from OpenDRIVE text to a network, and its queries for the nearest lane.

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Instant,
};

use anyhow::Context;
use bake::Cache;
use glam::DVec3;
use road::{LaneTypes, Network};
use serde_json::Value;

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
};

const ROUNDS: usize = 5;
const LOADS: usize = 20;
const QUESTIONS: usize = 200_000;
/// The environment variable of the folder of maps that are not included.
const MAPS: &str = "OMNIBUS_MAPS";
/// The environment variable of a Python that has the `carla` wheel, version 0.9.16.
const PEER: &str = "OMNIBUS_CARLA_PYTHON";
/// How often the netconvert city is repeated to reach 11 MB, and 38 MB.
const COPIES: [usize; 2] = [11, 38];

/// One map to load.
struct Task {
    load: &'static str,
    mapped: &'static str,
    nearest: &'static str,
    title: String,
    text: String,
}

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let tasks = tasks(sink)?;
    for task in &tasks {
        let machine = Machine::look();
        let peer = peer(effort, task)?;
        load(effort, sink, task, &machine, peer)?;
        mapped(effort, sink, task, &machine)?;
        nearest(effort, sink, task, &machine, peer)?;
    }
    Ok(())
}

fn tasks(sink: &mut Sink) -> anyhow::Result<Vec<Task>> {
    let task = |[load, mapped, nearest]: [&'static str; 3], title: &str, text: String| Task {
        load,
        mapped,
        nearest,
        title: format!("{title}, {:.2} MB", text.len() as f64 / 1e6),
        text,
    };
    let Some(folder) = std::env::var_os(MAPS).map(PathBuf::from) else {
        sink.skip("map.*.town01", "OMNIBUS_MAPS names no folder of maps; our own town instead");
        let (name, text) = mapgen::default_map();
        return Ok(vec![task(["map.load.own", "map.mapped.own", "map.nearest.own"], name, text)]);
    };
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read_to_string(&path).with_context(|| path.display().to_string())
    };
    let acosta = read("sumo__acosta.xodr")?;
    Ok(vec![
        task(
            ["map.load.town01", "map.mapped.town01", "map.nearest.town01"],
            "Town01",
            read("carla2021-scenic__Town01.xodr")?,
        ),
        task(
            ["map.load.town03", "map.mapped.town03", "map.nearest.town03"],
            "Town03 of 2019",
            read("carla2019__Town03.xodr")?,
        ),
        task(
            ["map.load.city", "map.mapped.city", "map.nearest.city"],
            "a netconvert city (acosta, 11 times side by side)",
            side_by_side(&acosta, COPIES[0]),
        ),
        task(
            ["map.load.region", "map.mapped.region", "map.nearest.region"],
            "a netconvert region (acosta, 38 times side by side)",
            side_by_side(&acosta, COPIES[1]),
        ),
    ])
}

fn load(
    effort: Effort,
    sink: &mut Sink,
    task: &Task,
    machine: &Machine,
    peer: Option<[f64; 2]>,
) -> anyhow::Result<()> {
    let mut rounds = Vec::new();
    for _ in 0..effort.rounds(ROUNDS) {
        let mut nanos = Vec::new();
        for _ in 0..effort.count(LOADS) {
            let begun = Instant::now();
            let network = Network::parse(&task.text)?;
            nanos.push(begun.elapsed().as_nanos() as u64);
            std::hint::black_box(&network);
        }
        rounds.push(nanos);
    }
    let spread = Spread::of_rounds(&rounds, 1e6);
    let figure = Figure {
        name: task.load,
        workload: format!("{}, from text in memory to the first answer", task.title),
        unit: Unit::Millis,
        value: spread.p50,
        spread,
        peer: peer.map(|[load_ms, _]| Peer { name: "carla.Map 0.9.16", value: load_ms }),
    };
    sink.put(&figure, machine)
}

/// Measures loading from the cache, which each process maps for itself.
fn mapped(effort: Effort, sink: &mut Sink, task: &Task, machine: &Machine) -> anyhow::Result<()> {
    let folder = Folder(std::env::temp_dir().join(format!("bench-{}-cache", std::process::id())));
    let cache = Cache::in_folder(&folder.0);
    cache.network(&task.title, &task.text)?;
    let kept = std::fs::read_dir(&folder.0).with_context(|| folder.0.display().to_string())?;
    let bytes: u64 = kept.filter_map(|file| Some(file.ok()?.metadata().ok()?.len())).sum();
    let mut rounds = Vec::new();
    for _ in 0..effort.rounds(ROUNDS) {
        let mut nanos = Vec::new();
        for _ in 0..effort.count(LOADS) {
            let begun = Instant::now();
            let network = cache.network(&task.title, &task.text)?;
            nanos.push(begun.elapsed().as_nanos() as u64);
            std::hint::black_box(&network);
        }
        rounds.push(nanos);
    }
    let spread = Spread::of_rounds(&rounds, 1e6);
    let figure = Figure {
        name: task.mapped,
        workload: format!(
            "{}, from text in memory to a network whose baked form of {:.1} MB lies in the \
             system's cache of files, sums of text and file included",
            task.title,
            bytes as f64 / 1e6
        ),
        unit: Unit::Millis,
        value: spread.p50,
        spread,
        peer: None,
    };
    sink.put(&figure, machine)
}

/// A folder that is removed when it is dropped.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        // In a folder that the system cleans up.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn nearest(
    effort: Effort,
    sink: &mut Sink,
    task: &Task,
    machine: &Machine,
    peer: Option<[f64; 2]>,
) -> anyhow::Result<()> {
    let network = Network::parse(&task.text)?;
    let points = points(&network, effort.count(QUESTIONS));
    let mut rounds = Vec::new();
    for _ in 0..effort.rounds(ROUNDS) {
        // Reading the clock takes as long as a query, so a hundred queries are timed together.
        let mut nanos = Vec::new();
        for hundred in points.chunks(100) {
            let begun = Instant::now();
            for point in hundred {
                std::hint::black_box(network.nearest(*point, LaneTypes::DRIVING));
            }
            nanos.push((begun.elapsed().as_nanos() as f64 / hundred.len() as f64) as u64);
        }
        rounds.push(nanos);
    }
    let spread = Spread::of_rounds(&rounds, 1e3);
    let figure = Figure {
        name: task.nearest,
        workload: format!(
            "{}, nearest driving lane of points within 3 m of lanes, means of 100, one thread",
            task.title
        ),
        unit: Unit::Micros,
        value: spread.p50,
        spread,
        peer: peer.map(|[_, nearest_us]| Peer {
            name: "carla.Map.get_waypoint from Python",
            value: nearest_us,
        }),
    };
    sink.put(&figure, machine)
}

/// Returns points beside lanes, the same in each run.
fn points(network: &Network, count: usize) -> Vec<DVec3> {
    let mut state = 7u64;
    let mut share = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let lanes: Vec<_> =
        network.lanes().iter().filter(|lane| LaneTypes::DRIVING.contains(lane.kind)).collect();
    let point = |_| {
        let lane = lanes[(share() * lanes.len() as f64) as usize % lanes.len().max(1)];
        let pose = network.place_at(lane.index, share() * lane.length_m, 6.0 * share() - 3.0);
        pose.position
    };
    (0..if lanes.is_empty() { 0 } else { count }).map(point).collect()
}

/// Measures the same with CARLA's client: milliseconds to load, microseconds to find a lane.
fn peer(effort: Effort, task: &Task) -> anyhow::Result<Option<[f64; 2]>> {
    let Some(python) = std::env::var_os(PEER) else { return Ok(None) };
    let network = Network::parse(&task.text)?;
    let points = points(&network, 2000);
    let points: Vec<[f64; 3]> = points.iter().map(|at| [at.x, -at.y, at.z]).collect();
    let question = serde_json::json!({
        "text": task.text, "points": points, "loads": effort.rounds(3),
    });
    let mut child = Command::new(&python)
        .args(["-c", ASK])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("{PEER}={}", Path::new(&python).display()))?;
    child.stdin.take().context("its input")?.write_all(question.to_string().as_bytes())?;
    let output = child.wait_with_output()?;
    anyhow::ensure!(output.status.success(), "{PEER}: it could not ask carla.Map");
    let answer: Value = serde_json::from_slice(&output.stdout)?;
    let number = |key: &str| answer[key].as_f64().with_context(|| format!("{PEER} says no {key}"));
    Ok(Some([number("load_ms")?, number("nearest_us")?]))
}

const ASK: &str = r#"
import json, statistics, sys, time
import carla
asked = json.load(sys.stdin)
loads = []
for _ in range(asked["loads"]):
    begun = time.perf_counter()
    world = carla.Map("map", asked["text"])
    loads.append(time.perf_counter() - begun)
points = [carla.Location(*point) for point in asked["points"]]
begun = time.perf_counter()
for point in points:
    world.get_waypoint(point)
nearest = (time.perf_counter() - begun) / len(points)
print(json.dumps({"load_ms": statistics.median(loads) * 1e3, "nearest_us": nearest * 1e6}))
"#;

/// Returns a netconvert city of 11 MB; `None` if OMNIBUS_MAPS names no folder.
pub(crate) fn city() -> anyhow::Result<Option<String>> {
    let Some(folder) = std::env::var_os(MAPS).map(PathBuf::from) else { return Ok(None) };
    let path = folder.join("sumo__acosta.xodr");
    let acosta = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    Ok(Some(side_by_side(&acosta, COPIES[0])))
}

/// Repeats a map, each copy east of the one before, with ids of its own.
fn side_by_side(text: &str, copies: usize) -> String {
    const APART_M: f64 = 3000.0;
    let Some(end) = text.rfind("</OpenDRIVE>") else { return text.to_owned() };
    let begin = text.find("</header>").map_or(0, |at| at + "</header>".len());
    let mut all = text[..begin].to_owned();
    for copy in 0..copies {
        for line in text[begin..end].split_inclusive('\n') {
            let shifted = match attribute(line, " x=\"") {
                Some((before, x, after)) if line.contains("<geometry ") => {
                    let x: f64 = x.parse().unwrap_or(0.0);
                    format!("{before}{}{after}", x + APART_M * copy as f64)
                }
                _ => line.to_owned(),
            };
            let is_lane = ["<lane ", "<laneLink ", "<width "].iter().any(|tag| line.contains(tag));
            let is_lane_link = line.contains("cessor id=");
            if is_lane || is_lane_link {
                all.push_str(&shifted);
            } else {
                all.push_str(&renamed(&shifted, copy));
            }
        }
    }
    all.push_str("</OpenDRIVE>\n");
    all
}

fn renamed(line: &str, copy: usize) -> String {
    const KEYS: [&str; 6] = [
        " id=\"",
        " elementId=\"",
        " junction=\"",
        " incomingRoad=\"",
        " connectingRoad=\"",
        " signalId=\"",
    ];
    let mut line = line.to_owned();
    for key in KEYS {
        if let Some((before, id, after)) = attribute(&line, key)
            && id != "-1"
        {
            // Ids stay numbers, because CARLA reads no others.
            line = format!("{before}{}{id}{after}", copy + 1);
        }
    }
    line
}

/// Splits a line at the first attribute of that key: before, value, after.
fn attribute<'a>(line: &'a str, key: &str) -> Option<(&'a str, &'a str, &'a str)> {
    let from = line.find(key)? + key.len();
    let to = from + line[from..].find('"')?;
    Some((&line[..from], &line[from..to], &line[to..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_repeated_map_has_the_roads_of_every_copy() {
        let (_, text) = mapgen::default_map();
        let one = Network::parse(&text).unwrap();
        let three = Network::parse(&side_by_side(&text, 3)).unwrap();
        assert_eq!(three.roads().len(), 3 * one.roads().len());
        assert_eq!(three.junctions().len(), 3 * one.junctions().len());
        assert!(three.findings().is_empty(), "{:?}", three.findings().first());
        let width = |network: &Network| network.bounds().1.x - network.bounds().0.x;
        assert!((width(&three) - width(&one) - 6000.0).abs() < 1.0);
    }
}
