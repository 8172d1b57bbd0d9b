//! The data sets that are exported, read frame by frame.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{BufRead, BufReader},
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use anyhow::{bail, ensure};

use crate::collect::{
    CollectError, Collection,
    decode::{self, Image},
    folder::Folder,
    format::{ActorBox, Boxes, Camera, FrameLine, Lidar, Metadata, Sensor},
    map_lines::{LANES, LaneMap},
};

/// Data sets of `omnibus collect` in the order of the scenes.
pub(crate) struct Set {
    scenes: Vec<Scene>,
}

/// One data set of `omnibus collect`.
pub(crate) struct Scene {
    /// The name of its folder; no other scene has it.
    pub(crate) name: String,
    pub(crate) metadata: Metadata,
    folder: Folder,
    list: File,
    /// Where each line of the list begins, and the end of the last.
    bounds: Vec<u64>,
}

/// A complete frame of a scene.
pub(crate) struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) line: FrameLine,
    /// The text of the line.
    pub(crate) text: Vec<u8>,
}

impl Set {
    /// Opens the data sets in these folders; in a folder that is none, those in its `scene-*`.
    pub(crate) fn open(dirs: &[PathBuf]) -> anyhow::Result<Set> {
        let mut scenes = Vec::new();
        let mut names = BTreeSet::new();
        for dir in
            dirs.iter().map(|dir| scene_folders(dir)).collect::<Result<Vec<_>, _>>()?.concat()
        {
            let mut scene = Scene::open(&dir)?;
            let stem = scene.name.clone();
            let mut ordinal = 1;
            while !names.insert(scene.name.clone()) {
                ordinal += 1;
                scene.name = format!("{stem}-{ordinal}");
            }
            scenes.push(scene);
        }
        Ok(Set { scenes })
    }

    /// Returns the scenes.
    pub(crate) fn scenes(&self) -> &[Scene] {
        &self.scenes
    }

    /// Returns the number of frames of all scenes.
    pub(crate) fn frames(&self) -> usize {
        self.scenes.iter().map(Scene::frames).sum()
    }

    /// Returns the scene of a frame, and its position there; `index` counts over all scenes.
    pub(crate) fn place(&self, mut index: usize) -> (usize, usize) {
        for (number, scene) in self.scenes.iter().enumerate() {
            if index < scene.frames() {
                return (number, index);
            }
            index -= scene.frames();
        }
        panic!("frame {index} beyond the end");
    }

    /// Reads the line of a frame; `index` counts over all scenes.
    pub(crate) fn frame(&self, index: usize) -> Result<Frame<'_>, CollectError> {
        let (scene, index) = self.place(index);
        self.scenes[scene].frame(index)
    }
}

/// Returns the data sets in a folder.
fn scene_folders(dir: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let Some(collection) = Collection::open(dir)? else { return Ok(vec![dir.to_owned()]) };
    let folders: Vec<_> = collection.folders().collect();
    ensure!(!folders.is_empty(), "{}: no scene has begun yet", dir.display());
    Ok(folders)
}

impl Scene {
    fn open(dir: &Path) -> anyhow::Result<Scene> {
        let folder = Folder::new(dir);
        let Some(metadata) = folder.read_metadata()? else {
            bail!("{} is gone", folder.metadata().display());
        };
        for sensor in &metadata.settings.sensors {
            // Names become parts of paths.
            let is_plain = |c: char| c.is_ascii_alphanumeric() || "_- ".contains(c);
            ensure!(
                !sensor.name.is_empty() && sensor.name.chars().all(is_plain),
                "{}: the sensor name {:?} has characters other than letters, digits, _ and -",
                folder.metadata().display(),
                sensor.name
            );
        }
        let path = folder.frames();
        let list = File::open(&path).map_err(|e| CollectError::io(&path, e))?;
        let bounds = line_bounds(&list).map_err(|e| CollectError::io(&path, e))?;
        ensure!(bounds.len() > 1, "{} lists no complete frame", path.display());
        if !metadata.complete {
            let (complete, wanted) = (bounds.len() - 1, metadata.frames_requested);
            log::warn!("{} is unfinished: {complete} of {wanted} frames", dir.display());
        }
        let whole = fs::canonicalize(dir).map_err(|e| CollectError::io(dir, e))?;
        let name = whole.file_name().map_or_else(|| "scene".into(), |name| name.to_string_lossy());
        // In WebDataset the key of a sample ends at the first dot.
        let name = name.replace(|c: char| !(c.is_ascii_alphanumeric() || c == '-'), "_");
        Ok(Scene { name, metadata, folder, list, bounds })
    }

    /// Returns the number of complete frames.
    pub(crate) fn frames(&self) -> usize {
        self.bounds.len() - 1
    }

    /// Reads the line of a frame.
    pub(crate) fn frame(&self, index: usize) -> Result<Frame<'_>, CollectError> {
        let (from, to) = (self.bounds[index], self.bounds[index + 1]);
        let mut text = vec![0; (to - from) as usize];
        let path = self.folder.frames();
        self.list.read_exact_at(&mut text, from).map_err(|e| CollectError::io(&path, e))?;
        let line = serde_json::from_slice(&text)
            .map_err(|e| CollectError::damaged(&path, format!("line {}: {e}", index + 1)))?;
        Ok(Frame { scene: self, line, text })
    }

    /// Returns the cameras that have colour images, in the order of the sensors.
    pub(crate) fn cameras(&self) -> impl Iterator<Item = (&Sensor, &Camera)> {
        let sensors = self.metadata.settings.sensors.iter();
        sensors.filter(|s| self.has(s, "color")).filter_map(|s| Some((s, s.camera.as_ref()?)))
    }

    /// Returns whether the data set has an output of a sensor, as `depth`.
    pub(crate) fn has(&self, sensor: &Sensor, output: &str) -> bool {
        let folder = format!("{}/{output}", sensor.name);
        self.metadata.outputs.iter().any(|output| output.folder == folder)
    }

    /// Returns the first sensor of a kind, as `imu`.
    pub(crate) fn sensor_of_kind(&self, kind: &str) -> Option<&Sensor> {
        self.metadata.settings.sensors.iter().find(|sensor| sensor.kind == kind)
    }

    /// Returns the path of the OpenDRIVE text of the world.
    pub(crate) fn map(&self) -> PathBuf {
        self.folder.root().join("map.xodr")
    }

    /// Returns the radars in the order of the sensors.
    pub(crate) fn radars(&self) -> impl Iterator<Item = &Sensor> {
        self.metadata.settings.sensors.iter().filter(|sensor| sensor.radar.is_some())
    }

    /// Reads the lanes of the map.
    pub(crate) fn lane_map(&self) -> Result<LaneMap, CollectError> {
        let path = self.folder.root().join(LANES);
        let text = fs::read(&path).map_err(|e| CollectError::io(&path, e))?;
        serde_json::from_slice(&text).map_err(|e| CollectError::damaged(&path, e))
    }

    /// Returns the lidars in the order of the sensors.
    pub(crate) fn lidars(&self) -> impl Iterator<Item = (&Sensor, &Lidar)> {
        self.metadata.settings.sensors.iter().filter_map(|s| Some((s, s.lidar.as_ref()?)))
    }
}

impl<'a> Frame<'a> {
    /// Returns the radars that measured in this frame.
    pub(crate) fn radars(&self) -> impl Iterator<Item = &'a Sensor> {
        self.scene.radars().filter(|sensor| self.line.measures(&sensor.name))
    }

    /// Returns the cameras with colour images that measured in this frame.
    pub(crate) fn cameras(&self) -> impl Iterator<Item = (&'a Sensor, &'a Camera)> {
        self.scene.cameras().filter(|(sensor, _)| self.line.measures(&sensor.name))
    }

    /// Returns the lidars that measured in this frame.
    pub(crate) fn lidars(&self) -> impl Iterator<Item = (&'a Sensor, &'a Lidar)> {
        self.scene.lidars().filter(|(sensor, _)| self.line.measures(&sensor.name))
    }

    /// Returns `town_front_000041` for the camera `front` of the scene `town`.
    pub(crate) fn name(&self, sensor: &Sensor) -> String {
        format!("{}_{}_{:06}", self.scene.name, sensor.name, self.line.frame)
    }

    /// Returns a file of the frame: `front/color` and `png` give `front/color/000041.png`.
    pub(crate) fn path(&self, output: &str, extension: &str) -> PathBuf {
        self.scene.folder.frame_file(output, self.line.frame, extension)
    }

    /// Reads a file of the frame.
    pub(crate) fn bytes(&self, output: &str, extension: &str) -> Result<Vec<u8>, CollectError> {
        let path = self.path(output, extension);
        fs::read(&path).map_err(|e| CollectError::io(&path, e))
    }

    /// Decodes an image of a camera: `color`, `depth`, `instance` or `tag`.
    pub(crate) fn image(
        &self,
        sensor: &Sensor,
        camera: &Camera,
        output: &str,
    ) -> Result<Image, CollectError> {
        let output = format!("{}/{output}", sensor.name);
        let extension = self.scene.metadata.extension(&output);
        let image = decode::image(extension, &self.bytes(&output, extension)?)
            .map_err(|why| CollectError::damaged(&self.path(&output, extension), why))?;
        let wanted = (camera.width_px as usize, camera.height_px as usize);
        if (image.width, image.height) != wanted {
            let why = format!(
                "{} x {} pixels, but metadata.json states {} x {}",
                image.width, image.height, wanted.0, wanted.1
            );
            return Err(CollectError::damaged(&self.path(&output, extension), why));
        }
        Ok(image)
    }

    /// Reads the boxes of everything that a sensor saw: actors, and objects of the town as actors at rest
    /// with the id that they have in images.
    pub(crate) fn boxes(&self) -> Result<Vec<ActorBox>, CollectError> {
        let path = self.path("boxes", "json");
        let Boxes { mut actors, objects, .. } =
            serde_json::from_slice(&self.bytes("boxes", "json")?)
                .map_err(|e| CollectError::damaged(&path, e))?;
        actors.extend(objects.into_iter().map(|object| ActorBox {
            actor_id: object.object_id,
            blueprint: object.blueprint.unwrap_or_default(),
            tag: object.tag,
            tag_name: object.tag_name,
            size_m: object.size_m,
            world_from_box: object.world_from_box,
            velocity_mps: [0.0; 3],
            traffic_light_state: None,
            lidar_points: object.lidar_points,
            radar_points: object.radar_points,
            keypoints_in_world_m: None,
            cameras: object.cameras,
        }));
        Ok(actors)
    }

    /// Reads the returns of a lidar: x, y, z in sensor space and intensity, as little-endian f32.
    pub(crate) fn points(&self, sensor: &Sensor) -> Result<Vec<u8>, CollectError> {
        self.returns(sensor, "points", 16)
    }

    /// Reads the id and the tag of each return of a lidar or detection of a radar, as little-endian u32.
    pub(crate) fn labels(&self, sensor: &Sensor) -> Result<Vec<u8>, CollectError> {
        self.returns(sensor, "labels", 8)
    }

    /// Reads the detections of a radar: range rate, azimuth, altitude and distance, as little-endian f32.
    pub(crate) fn detections(&self, sensor: &Sensor) -> Result<Vec<u8>, CollectError> {
        self.returns(sensor, "detections", 16)
    }

    /// Reads the powers of the detections of a radar with a receiver: power, ratio of signal to noise and
    /// cross-section, as little-endian f32.
    pub(crate) fn powers(&self, sensor: &Sensor) -> Result<Vec<u8>, CollectError> {
        self.returns(sensor, "powers", 12)
    }

    fn returns(&self, sensor: &Sensor, what: &str, size: u64) -> Result<Vec<u8>, CollectError> {
        let output = format!("{}/{what}", sensor.name);
        let bytes = self.bytes(&output, "bin")?;
        let count = self.line.point_counts.get(&sensor.name).copied().unwrap_or_default();
        if bytes.len() as u64 != count * size {
            let why = format!("{} bytes, but {count} points need {}", bytes.len(), count * size);
            return Err(CollectError::damaged(&self.path(&output, "bin"), why));
        }
        Ok(bytes)
    }
}

/// Returns where each complete line begins, and the end of the last one.
fn line_bounds(list: &File) -> std::io::Result<Vec<u64>> {
    let mut reader = BufReader::new(list);
    let mut bounds = vec![0];
    let mut at = 0;
    loop {
        let buffer = reader.fill_buf()?;
        if buffer.is_empty() {
            return Ok(bounds);
        }
        let ends = buffer.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        bounds.extend(ends.map(|(index, _)| at + index as u64 + 1));
        let len = buffer.len();
        at += len as u64;
        reader.consume(len);
    }
}
