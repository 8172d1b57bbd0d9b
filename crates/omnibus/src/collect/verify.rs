//! `omnibus collect --verify`: checks that the files of a data set are whole and agree.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    fmt, fs,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use glam::{Affine3A, Quat, Vec3, Vec3A};

use crate::collect::{
    CollectError, Collection,
    boxes::Seen,
    camera_model::{CameraModel, NEAR_M},
    decode,
    encode::{DEPTH_FAR, DEPTH_STEPS_PER_M, STATIC_BIT},
    folder::Folder,
    format::{ActorBox, Boxes, FrameLine, Metadata, Sensor, View},
    frame_list,
    inspect::check,
    schedule,
    sensors::{BOXES, sensor_from_optical},
    tracks::{TRACKS, Track, Tracks},
    verify_labels::LabelledImage,
};

/// How much nearer to a camera a lidar point may lie than the depth image shows around its pixel:
/// metres, and a fraction of its depth.
const DEPTH_TOLERANCE_M: f32 = 0.1;
const DEPTH_TOLERANCE: f32 = 0.01;
/// The fraction of the points of a frame that may lie nearer than that: wires and edges of leaves are
/// thinner than a pixel.
const NEARER_MAX: f32 = 0.03;
/// With fewer points in an image, nothing is said of them.
const POINTS_MIN: usize = 50;

/// What can be wrong with a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fault {
    Missing,
    Additional,
    Checksum,
    Contents,
    Stamp,
    Count,
    VisibleBox,
    LidarPoints,
    AmodalMask,
    Keypoints,
    Tracks,
    Depth,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Fault::Missing => "missing files",
            Fault::Additional => "additional files",
            Fault::Checksum => "files with another checksum",
            Fault::Contents => "files that do not hold what they should",
            Fault::Stamp => "stamps out of order",
            Fault::Count => "counts that disagree",
            Fault::VisibleBox => "boxes that disagree with the instance image",
            Fault::LidarPoints => "boxes that disagree with the lidar labels",
            Fault::AmodalMask => "masks that disagree with the instance image or the boxes",
            Fault::Keypoints => "keypoints that disagree with the instance image",
            Fault::Tracks => "tracks that disagree with the boxes",
            Fault::Depth => "frames whose lidar points disagree with the depth image",
        })
    }
}

/// The number of faults of each kind, and the first one: that of the earliest frame.
#[derive(Debug, Default)]
struct Faults(BTreeMap<Fault, (usize, u64, String)>);

impl Faults {
    fn add(&mut self, fault: Fault, frame: u64, example: String) {
        self.merge(fault, (1, frame, example));
    }

    fn merge(&mut self, fault: Fault, (count, frame, example): (usize, u64, String)) {
        let entry = self.0.entry(fault).or_insert((0, u64::MAX, String::new()));
        entry.0 += count;
        if entry.2.is_empty() || frame < entry.1 {
            (entry.1, entry.2) = (frame, example);
        }
    }
}

/// The faults as lines.
impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (fault, (count, _, example))) in self.0.iter().enumerate() {
            let end = if index + 1 < self.0.len() { "\n" } else { "" };
            write!(f, "{count} {fault}, the first: {example}{end}")?;
        }
        Ok(())
    }
}

/// How the points of a lidar agree with the depth images of a camera.
#[derive(Clone, Debug, Default)]
struct Agreement {
    points: usize,
    nearer: usize,
    /// The median difference in each frame. Metres.
    medians_m: Vec<f32>,
}

/// By lidar and camera.
type Agreements = BTreeMap<(String, String), Agreement>;

/// Data without faults.
#[derive(Debug, Default)]
pub(crate) struct Verified {
    /// The number of scenes; 0: a single data set.
    scenes: usize,
    frames: usize,
    files: usize,
    agreements: Agreements,
}

impl Verified {
    fn add(&mut self, scene: Verified) {
        self.scenes += 1;
        self.frames += scene.frames;
        self.files += scene.files;
        add_agreements(&mut self.agreements, scene.agreements);
    }
}

fn add_agreements(sum: &mut Agreements, more: Agreements) {
    for (pair, found) in more {
        let sum = sum.entry(pair).or_default();
        sum.points += found.points;
        sum.nearer += found.nearer;
        sum.medians_m.extend(found.medians_m);
    }
}

impl fmt::Display for Verified {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.scenes > 0 {
            write!(f, "{} scenes, ", self.scenes)?;
        }
        write!(f, "{} frames, {} files, no fault", self.frames, self.files)?;
        for ((lidar, camera), agreement) in &self.agreements {
            let Agreement { points, nearer, .. } = agreement;
            let percent = 100.0 * *nearer as f32 / (*points).max(1) as f32;
            write!(
                f,
                "\n{lidar} against the depth of {camera}: {points} points, median difference \
                 {:.1} cm; {percent:.2} % are nearer than the depth by more than {:.0} cm and {:.0} \
                 % of it, of at most {:.0} % in a frame",
                100.0 * median(&mut agreement.medians_m.clone()),
                100.0 * DEPTH_TOLERANCE_M,
                100.0 * DEPTH_TOLERANCE,
                100.0 * NEARER_MAX,
            )?;
        }
        Ok(())
    }
}

/// Checks everything in `dir`: a data set, or the scenes of a plan.
///
/// # Errors
///
/// Returns the number of faults and the first one, for each kind of fault, and of a plan for each scene;
/// a scene that is missing is a fault.
pub(crate) fn verify(dir: &Path) -> Result<Verified, CollectError> {
    let Some(collection) = Collection::open(dir)? else { return verify_scene(dir) };
    let mut sum = Verified::default();
    let mut faults = Vec::new();
    let names = collection.all_names();
    for name in &names {
        let mut of_scene = Vec::new();
        if collection.names.contains(name) {
            match verify_scene(&dir.join(name)) {
                Ok(verified) => sum.add(verified),
                Err(CollectError::Unsound { faults, .. }) => of_scene.push(faults),
                Err(why) => of_scene.push(why.to_string()),
            }
        }
        // What cannot be read is said above.
        of_scene.extend(collection.disagreement(name).unwrap_or_default());
        if !of_scene.is_empty() {
            let lines = of_scene.join("\n");
            faults.push(format!("{name}: {}", lines.replace('\n', &format!("\n{name}: "))));
        }
    }
    if faults.is_empty() {
        return Ok(sum);
    }
    let (count, scenes, faults) = (faults.len(), names.len(), faults.join("\n"));
    Err(CollectError::UnsoundScenes { dir: dir.to_owned(), count, scenes, faults })
}

/// Checks everything in the data set in `dir`.
fn verify_scene(dir: &Path) -> Result<Verified, CollectError> {
    let folder = Folder::new(dir);
    let Some(metadata) = folder.read_metadata()? else {
        let why = "no such file; is this a data set of omnibus collect?";
        return Err(CollectError::damaged(&folder.metadata(), why));
    };
    let mut faults = Faults::default();
    for (name, crc32) in &metadata.files_crc32 {
        match fs::read(dir.join(name)) {
            Ok(bytes) if crc32fast::hash(&bytes) == *crc32 => {}
            Ok(_) => faults.add(Fault::Checksum, 0, name.clone()),
            Err(e) => faults.add(Fault::Missing, 0, format!("{name}: {e}")),
        }
    }
    let lines = match frame_list::read(&folder.frames()) {
        Ok((lines, _)) => lines,
        Err(e) => {
            faults.add(Fault::Contents, 0, e.to_string());
            return Err(CollectError::Unsound { dir: dir.to_owned(), faults: faults.to_string() });
        }
    };
    check_list(&metadata, &lines, &mut faults);
    let mut expected: BTreeSet<PathBuf> =
        metadata.files_crc32.keys().map(PathBuf::from).chain(["metadata.json".into()]).collect();
    for line in &lines {
        for output in metadata.outputs.iter().filter(|o| line.has_file(&o.folder)) {
            let path = Folder::new(Path::new("")).frame_file(
                &output.folder,
                line.frame,
                &output.extension,
            );
            expected.insert(path);
        }
    }
    // A run that was killed leaves files of the frames that it was working on.
    if metadata.complete {
        for path in files_below(dir)? {
            if !expected.contains(&path) {
                faults.add(Fault::Additional, 0, path.display().to_string());
            }
        }
        check_tracks(&folder, &lines, &mut faults);
    }
    let agreements = check_frames(&folder, &metadata, &lines, &mut faults);
    if faults.0.is_empty() {
        let (frames, files) = (lines.len(), expected.len());
        return Ok(Verified { scenes: 0, frames, files, agreements });
    }
    Err(CollectError::Unsound { dir: dir.to_owned(), faults: faults.to_string() })
}

/// Checks the order of the frames, and their number.
fn check_list(metadata: &Metadata, lines: &[FrameLine], faults: &mut Faults) {
    if metadata.complete && lines.len() as u64 != metadata.frames_complete {
        let (listed, stated) = (lines.len(), metadata.frames_complete);
        let example = format!("frames.jsonl lists {listed} frames, metadata.json states {stated}");
        faults.add(Fault::Count, 0, example);
    }
    for (frame, why) in schedule::faults(metadata, lines) {
        faults.add(Fault::Stamp, frame, why);
    }
}

fn check_tracks(folder: &Folder, lines: &[FrameLine], faults: &mut Faults) {
    let path = folder.root().join(TRACKS);
    // Missing and damaged files are faults of their own.
    let Ok(text) = fs::read(&path) else { return };
    let Ok(found) = Tracks::read(folder, lines) else { return };
    match serde_json::from_slice::<Tracks>(&text) {
        Err(e) => faults.add(Fault::Contents, 0, format!("{TRACKS}: {e}")),
        Ok(tracks) => {
            let differs = |a: &BTreeMap<u32, Track>, b: &BTreeMap<u32, Track>| {
                a.keys().chain(b.keys()).find(|id| a.get(*id) != b.get(*id)).copied()
            };
            let id = differs(&tracks.actors, &found.actors)
                .or_else(|| differs(&tracks.objects, &found.objects));
            if let Some(id) = id {
                faults.add(Fault::Tracks, 0, format!("{TRACKS}: id {id}"));
            }
        }
    }
}

/// Returns the paths of all files in a folder, relative to it.
fn files_below(root: &Path) -> Result<Vec<PathBuf>, CollectError> {
    let (mut files, mut open) = (Vec::new(), vec![root.to_owned()]);
    while let Some(dir) = open.pop() {
        for entry in fs::read_dir(&dir).map_err(|e| CollectError::io(&dir, e))? {
            let path = entry.map_err(|e| CollectError::io(&dir, e))?.path();
            if path.is_dir() {
                open.push(path);
            } else {
                files.push(path.strip_prefix(root).unwrap_or(&path).to_owned());
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Checks all frames, on all processor cores.
fn check_frames(
    folder: &Folder,
    metadata: &Metadata,
    lines: &[FrameLine],
    faults: &mut Faults,
) -> Agreements {
    let next = AtomicUsize::new(0);
    let all = Mutex::new((std::mem::take(faults), Agreements::new()));
    let work = || {
        while let Some(line) = lines.get(next.fetch_add(1, Ordering::Relaxed)) {
            let mut frame = FrameCheck {
                folder,
                metadata,
                line,
                faults: Faults::default(),
                agreements: Agreements::new(),
            };
            frame.run();
            let FrameCheck { faults, agreements, .. } = frame;
            let mut all = all.lock().unwrap_or_else(PoisonError::into_inner);
            for (fault, found) in faults.0 {
                all.0.merge(fault, found);
            }
            add_agreements(&mut all.1, agreements);
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let (found, agreements) = all.into_inner().unwrap_or_else(PoisonError::into_inner);
    *faults = found;
    agreements
}

/// The checks of one frame.
struct FrameCheck<'a> {
    folder: &'a Folder,
    metadata: &'a Metadata,
    line: &'a FrameLine,
    faults: Faults,
    agreements: Agreements,
}

impl FrameCheck<'_> {
    fn add(&mut self, fault: Fault, example: String) {
        self.faults.add(fault, self.line.frame, example);
    }

    fn run(&mut self) {
        let (metadata, line) = (self.metadata, self.line);
        // The files that hold what they should.
        let mut files: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
        for output in metadata.outputs.iter().filter(|o| line.has_file(&o.folder)) {
            let path = self.folder.frame_file(&output.folder, line.frame, &output.extension);
            let name = path.strip_prefix(self.folder.root()).unwrap_or(&path).display().to_string();
            let bytes = match fs::read(&path) {
                Ok(bytes) => bytes,
                Err(e) => {
                    self.add(Fault::Missing, format!("{name}: {e}"));
                    continue;
                }
            };
            if line.files_crc32.get(&output.folder) != Some(&crc32fast::hash(&bytes)) {
                self.add(Fault::Checksum, name.clone());
            }
            match check(metadata, &output.folder, line, &bytes) {
                Ok(_) => drop(files.insert(&output.folder, bytes)),
                Err(why) => self.add(Fault::Contents, format!("{name}: {why}")),
            }
        }
        let boxes = files.get(BOXES).and_then(|text| serde_json::from_slice(text).ok());
        if let Some(boxes) = boxes {
            self.check_boxes(&boxes, &files);
            self.check_labels(&boxes, &files);
        }
        let sensors = &metadata.settings.sensors;
        for lidar in sensors.iter().filter(|sensor| sensor.lidar.is_some()) {
            for camera in sensors.iter().filter(|sensor| sensor.camera.is_some()) {
                self.check_depth(lidar, camera, &files);
            }
        }
    }

    /// Compares the boxes with what the instance images and the labels show.
    fn check_boxes(&mut self, boxes: &Boxes, files: &BTreeMap<&str, Vec<u8>>) {
        let frame = self.line.frame;
        let (metadata, ego) = (self.metadata, self.line.ego.actor_id);
        let points = |lidar: &BTreeMap<String, u32>, radar: &BTreeMap<String, u32>| {
            let all = lidar.iter().chain(radar);
            all.map(|(name, count)| (name.clone(), *count)).collect::<BTreeMap<_, _>>()
        };
        let actors = boxes
            .actors
            .iter()
            .map(|one| (one.actor_id, &one.cameras, points(&one.lidar_points, &one.radar_points)));
        let objects = boxes
            .objects
            .iter()
            .map(|one| (one.object_id, &one.cameras, points(&one.lidar_points, &one.radar_points)));
        let listed: Vec<_> = actors.chain(objects).collect();
        for sensor in &metadata.settings.sensors {
            let name = &sensor.name;
            if let Some(image) = self.image(files, name, "instance") {
                let mut seen = seen(&image);
                for (id, cameras, _) in &listed {
                    let shown = seen.remove(id);
                    let stated =
                        cameras.get(name).map(|View { visible_px, visible_box_px, .. }| Seen {
                            pixels: *visible_px,
                            edges_px: *visible_box_px,
                        });
                    if shown != stated {
                        let example = format!(
                            "frame {frame}, {name}, id {id}: the box states {}, the image shows {}",
                            text(stated),
                            text(shown)
                        );
                        self.add(Fault::VisibleBox, example);
                    }
                }
                let lacking = |id: &&u32| **id != 0 && **id < STATIC_BIT && **id != ego;
                if let Some(id) = seen.keys().filter(lacking).min() {
                    let example = format!("frame {frame}, {name}, id {id}: no box");
                    self.add(Fault::VisibleBox, example);
                }
            }
            if let Some(labels) = files.get(&format!("{name}/labels")[..]) {
                let mut counts: HashMap<u32, u32> = HashMap::new();
                for label in decode::words(labels).chunks_exact(2) {
                    *counts.entry(label[0]).or_default() += 1;
                }
                for (id, _, points) in &listed {
                    let (stated, found) = (points.get(name), counts.get(id));
                    if stated != found {
                        let [stated, found] = [stated, found].map(|n| n.copied().unwrap_or(0));
                        let example = format!(
                            "frame {frame}, {name}, id {id}: the box states {stated} returns, the \
                             labels hold {found}"
                        );
                        self.add(Fault::LidarPoints, example);
                    }
                }
            }
        }
    }

    /// Compares keypoints and amodal masks with the instance images.
    fn check_labels(&mut self, boxes: &Boxes, files: &BTreeMap<&str, Vec<u8>>) {
        let (frame, metadata) = (self.line.frame, self.metadata);
        let labels = metadata.settings.labels;
        let has_keypoints = |actor: &ActorBox| actor.keypoints_in_world_m.is_some();
        for actor in boxes.actors.iter().filter(|actor| {
            has_keypoints(actor) != (labels.keypoints && is_walker(&actor.blueprint))
        }) {
            let example = format!(
                "frame {frame}, id {}: keypoints in space: {}",
                actor.actor_id,
                has_keypoints(actor)
            );
            self.add(Fault::Keypoints, example);
        }
        let actors =
            boxes.actors.iter().map(|one| (one.actor_id, has_keypoints(one), &one.cameras));
        let objects = boxes.objects.iter().map(|one| (one.object_id, false, &one.cameras));
        let all: Vec<_> = actors.chain(objects).collect();
        for sensor in &metadata.settings.sensors {
            // What is wrong with the camera or its image is said elsewhere.
            let Some(Ok(camera)) = sensor.camera.as_ref().map(CameraModel::of_metadata) else {
                continue;
            };
            let Some(image) = self.image(files, &sensor.name, "instance") else { continue };
            let ids = image.ids();
            let labelled = LabelledImage { image: &image, ids: &ids, camera: &camera, labels };
            for (id, has_keypoints, cameras) in &all {
                let Some(view) = cameras.get(&sensor.name) else { continue };
                let masked = labelled.mask_fault(*id, view);
                let pointed = labelled.keypoints_fault(*id, *has_keypoints, view);
                for (fault, why) in [(Fault::AmodalMask, masked), (Fault::Keypoints, pointed)] {
                    if let Some(why) = why {
                        self.add(fault, format!("frame {frame}, {}, id {id}: {why}", sensor.name));
                    }
                }
            }
        }
    }

    /// Decodes an image of the frame, if its file is sound.
    fn image(
        &self,
        files: &BTreeMap<&str, Vec<u8>>,
        sensor: &str,
        output: &str,
    ) -> Option<decode::Image> {
        let folder = format!("{sensor}/{output}");
        decode::image(self.metadata.extension(&folder), files.get(&folder[..])?).ok()
    }

    /// Compares points of a lidar with the depth image of a camera.
    fn check_depth(&mut self, lidar: &Sensor, camera: &Sensor, files: &BTreeMap<&str, Vec<u8>>) {
        // Columns of a sweep have poses of their own, and fog is in no depth image.
        if lidar.lidar.as_ref().is_some_and(|lidar| lidar.sweep || lidar.weather) {
            return;
        }
        let Some(points) = files.get(&format!("{}/points", lidar.name)[..]) else { return };
        let Some(depth) = self.image(files, &camera.name, "depth") else { return };
        let pose = |sensor: &Sensor| {
            let pose = self.line.sensors.iter().find(|pose| pose.name == sensor.name)?;
            let transform = pose.world_from_sensor;
            let rotation = Quat::from_array(transform.rotation_xyzw);
            Some(Affine3A::from_rotation_translation(
                rotation,
                Vec3::from_array(transform.position_m),
            ))
        };
        let (Some(world_from_lidar), Some(world_from_camera)) = (pose(lidar), pose(camera)) else {
            return;
        };
        let model = match camera.camera.as_ref().map(CameraModel::of_metadata) {
            Some(Ok(model)) => model,
            Some(Err(why)) => {
                self.add(Fault::Contents, format!("metadata.json: camera {}: {why}", camera.name));
                return;
            }
            None => return,
        };
        let optical_from_lidar =
            (world_from_camera * sensor_from_optical()).inverse() * world_from_lidar;
        let found = compare(&decode::floats(points), &optical_from_lidar, &depth, &model);
        let Some((agreement, median_m)) = found else { return };
        if agreement.nearer as f32 > NEARER_MAX * agreement.points as f32 {
            let example = format!(
                "frame {}, {} and {}: {} of {} points are nearer than the depth shows, median \
                 difference {:.2} m",
                self.line.frame,
                lidar.name,
                camera.name,
                agreement.nearer,
                agreement.points,
                median_m
            );
            self.add(Fault::Depth, example);
        }
        self.agreements.insert((lidar.name.clone(), camera.name.clone()), agreement);
    }
}

/// Returns the pixels of every id in an instance image.
fn seen(image: &decode::Image) -> HashMap<u32, Seen> {
    let mut found: HashMap<u32, Seen> = HashMap::new();
    let ids = image.ids();
    for (row, line) in (0..).zip(ids.chunks_exact(image.width)) {
        let mut left = 0;
        for run in line.chunk_by(|a, b| a == b) {
            let right = left + run.len() as u32;
            let new = Seen { pixels: 0, edges_px: [left, row, right, row + 1] };
            let seen = found.entry(run[0]).or_insert(new);
            let [l, t, r, _] = seen.edges_px;
            seen.edges_px = [l.min(left), t, r.max(right), row + 1];
            seen.pixels += run.len() as u32;
            left = right;
        }
    }
    found
}

/// Returns whether actors of a blueprint have a skeleton.
fn is_walker(blueprint: &str) -> bool {
    town::blueprint(blueprint).is_some_and(|(_, made)| made.skeleton().is_some())
}

fn text(seen: Option<Seen>) -> String {
    match seen {
        Some(Seen { pixels, edges_px: [left, top, right, bottom] }) => {
            format!("{pixels} pixels in {left}, {top}, {right}, {bottom}")
        }
        None => "none".to_owned(),
    }
}

/// Compares points with the depths around their pixels. What hides a point from the camera is no
/// difference, because the two sensors look from different places. Returns the median difference of
/// the others, too; `None` if the image shows few points.
fn compare(
    points: &[f32],
    optical_from_lidar: &Affine3A,
    depth: &decode::Image,
    camera: &CameraModel,
) -> Option<(Agreement, f32)> {
    let steps = depth.sixteen();
    let metres = |step: u16| match step {
        DEPTH_FAR => f32::INFINITY,
        step => f32::from(step) / DEPTH_STEPS_PER_M,
    };
    let mut differences = Vec::new();
    let mut nearer = 0;
    for point in points.chunks_exact(4) {
        let at = optical_from_lidar.transform_point3a(Vec3A::new(point[0], point[1], point[2]));
        let depth_m = camera.depth(at);
        if depth_m < NEAR_M {
            continue;
        }
        let Some([u, v]) = camera.project(at) else { continue };
        if !(1.0..camera.width as f32 - 1.0).contains(&u)
            || !(1.0..camera.height as f32 - 1.0).contains(&v)
        {
            continue;
        }
        let (column, row) = (u as usize, v as usize);
        let (mut low, mut high) = (f32::INFINITY, 0.0_f32);
        for row in row - 1..=row + 1 {
            for step in &steps[row * depth.width + column - 1..][..3] {
                (low, high) = (low.min(metres(*step)), high.max(metres(*step)));
            }
        }
        let tolerance = DEPTH_TOLERANCE_M + DEPTH_TOLERANCE * depth_m;
        if depth_m > high + tolerance {
            continue;
        }
        differences.push((metres(steps[row * depth.width + column]) - depth_m).abs());
        nearer += usize::from(depth_m < low - tolerance);
    }
    if differences.len() < POINTS_MIN {
        return None;
    }
    let points = differences.len();
    let median_m = median(&mut differences);
    Some((Agreement { points, nearer, medians_m: vec![median_m] }, median_m))
}

fn median(values: &mut [f32]) -> f32 {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
