//! Checks a data set against its own lists: every file of every listed frame.

use std::{
    collections::BTreeMap,
    fmt::{self, Write as _},
    fs,
    path::Path,
};

use crate::collect::{
    CollectError, Collection, decode,
    folder::Folder,
    format::{Boxes, FrameLine, Metadata},
    frame_list,
    map_lines::FrameLanes,
    schedule,
    sensors::{BOXES, LANES},
};

/// The contents of a data set.
struct Report {
    metadata: Metadata,
    count: usize,
    frames: [u64; 2],
    bytes: BTreeMap<String, u64>,
    boxes: u64,
    points: u64,
}

/// Reads every file in `dir`, which holds a data set or the scenes of a plan, and describes it.
///
/// # Errors
///
/// Returns the first fault and the number of faults, of a plan for each scene. Scenes that are missing are
/// none.
pub(crate) fn inspect(dir: &Path) -> Result<String, CollectError> {
    let Some(collection) = Collection::open(dir)? else {
        return Ok(inspect_scene(dir)?.to_string());
    };
    let (mut text, mut faults) = (String::new(), Vec::new());
    let (mut frames, mut bytes, mut boxes, mut points, mut complete) = (0, 0, 0, 0, 0);
    for name in &collection.names {
        let report = match inspect_scene(&dir.join(name)) {
            Ok(report) => report,
            Err(CollectError::Faulty { count, first, .. }) => {
                faults.push(format!("{name}: {count} faults, the first: {first}"));
                continue;
            }
            Err(why) => {
                faults.push(format!("{name}: {why}"));
                continue;
            }
        };
        let of_scene: u64 = report.bytes.values().sum();
        let settings = &report.metadata.settings;
        let end = if report.metadata.complete { "" } else { "; unfinished" };
        let _ = writeln!(
            text,
            "{name}: {} of {} frames, {:.1} MB, map {}, seed {}{end}",
            report.count,
            report.metadata.frames_requested,
            of_scene as f64 / 1e6,
            settings.map,
            settings.scene_seed,
        );
        frames += report.count;
        bytes += of_scene;
        boxes += report.boxes;
        points += report.points;
        complete += u64::from(report.metadata.complete);
    }
    if !faults.is_empty() {
        let (count, scenes, faults) = (faults.len(), collection.names.len(), faults.join("\n"));
        return Err(CollectError::UnsoundScenes { dir: dir.to_owned(), count, scenes, faults });
    }
    let scenes = collection.all_names().len();
    let _ = write!(
        text,
        "{complete} of {scenes} scenes are complete: {frames} frames, {:.1} MB, {boxes} boxes, {points} \
         points, no fault",
        bytes as f64 / 1e6
    );
    if complete < scenes as u64 && collection.plan.is_some() {
        let _ = write!(text, "\n{} continues there", collection.continuation());
    }
    Ok(text)
}

/// Reads every file of the data set in `dir`.
fn inspect_scene(dir: &Path) -> Result<Report, CollectError> {
    let folder = Folder::new(dir);
    let Some(metadata) = folder.read_metadata()? else {
        let why = "no such file; is this a data set of omnibus collect?";
        return Err(CollectError::damaged(&folder.metadata(), why));
    };
    let (lines, _) = frame_list::read(&folder.frames())?;
    let mut faults = Vec::new();
    // A run that was killed did not write how far it got.
    if metadata.complete && lines.len() as u64 != metadata.frames_complete {
        let (listed, stated) = (lines.len(), metadata.frames_complete);
        faults.push(format!("frames.jsonl lists {listed} frames, metadata.json states {stated}"));
    }
    faults.extend(schedule::faults(&metadata, &lines).into_iter().map(|(_, why)| why));
    let mut report = Report {
        count: lines.len(),
        frames: [lines.first(), lines.last()].map(|line| line.map_or(0, |l| l.frame)),
        bytes: BTreeMap::new(),
        boxes: lines.iter().map(|l| l.box_count).sum(),
        points: lines.iter().flat_map(|l| l.point_counts.values()).sum(),
        metadata,
    };
    for line in &lines {
        for output in report.metadata.outputs.iter().filter(|o| line.has_file(&o.folder)) {
            let path = folder.frame_file(&output.folder, line.frame, &output.extension);
            let checked = fs::read(&path)
                .map_err(|e| e.to_string())
                .and_then(|file| check(&report.metadata, &output.folder, line, &file));
            match checked {
                Ok(len) => *report.bytes.entry(output.folder.clone()).or_default() += len,
                Err(why) => faults.push(format!("{}: {why}", path.display())),
            }
        }
    }
    match faults.first() {
        None => Ok(report),
        Some(first) => Err(CollectError::Faulty {
            dir: dir.to_owned(),
            count: faults.len(),
            first: first.clone(),
        }),
    }
}

/// Checks one file against the line of its frame and returns its length.
pub(crate) fn check(
    metadata: &Metadata,
    folder: &str,
    line: &FrameLine,
    file: &[u8],
) -> Result<u64, String> {
    let (name, output) = folder.split_once('/').unwrap_or((folder, ""));
    let sensor = metadata.settings.sensors.iter().find(|s| s.name == name);
    if folder == BOXES {
        let boxes: Boxes = serde_json::from_slice(file).map_err(|e| e.to_string())?;
        expect("frame", boxes.frame, line.frame)?;
        expect("boxes", boxes.count(), line.box_count)?;
    } else if folder == LANES {
        let lanes: FrameLanes = serde_json::from_slice(file).map_err(|e| e.to_string())?;
        expect("frame", lanes.frame, line.frame)?;
    } else if let Some(camera) = sensor.and_then(|s| s.camera.as_ref()) {
        let image = decode::image(metadata.extension(folder), file)?;
        expect("width", image.width as u64, camera.width_px.into())?;
        expect("height", image.height as u64, camera.height_px.into())?;
    } else if let Some(points) = line.point_counts.get(name) {
        let size = match output {
            "labels" => 8,
            "powers" => 12,
            _ => 16,
        };
        expect("bytes", file.len() as u64, points * size)?;
    } else {
        return Err("no sensor in metadata.json writes it".to_owned());
    }
    Ok(file.len() as u64)
}

fn expect(what: &str, found: u64, wanted: u64) -> Result<(), String> {
    if found == wanted { Ok(()) } else { Err(format!("{what} {found}, not {wanted}")) }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Metadata { settings, spawned_actors, tracers, frames_requested, complete, .. } =
            &self.metadata;
        let [first, last] = self.frames;
        let end = if *complete { "" } else { "; unfinished, --resume continues it" };
        writeln!(
            f,
            "{} of {frames_requested} frames, {first} to {last}, no fault{end}",
            self.count
        )?;
        writeln!(
            f,
            "map {}, seed {}, {} s a frame, {} vehicles beside the ego, tracer {}",
            settings.map,
            settings.seed,
            settings.fixed_delta_nanos as f64 / 1e9,
            spawned_actors.vehicles_spawned,
            tracers.join(", "),
        )?;
        for (folder, bytes) in &self.bytes {
            writeln!(f, "{:>10.1} MB  {folder}", *bytes as f64 / 1e6)?;
        }
        write!(f, "{} boxes, {} points of lidars and radars", self.boxes, self.points)
    }
}
