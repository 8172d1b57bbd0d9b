//! nuScenes: relational tables of scenes, samples, poses and annotations, beside the sensors' files.

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, ensure};
use glam::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};

use crate::{
    collect::{
        decode,
        format::{ActorBox, Camera, Lidar, Sensor},
    },
    export::{
        geometry::{affine, affine_of_rows, intrinsics_of_centres, parts, without_lens},
        images::Images,
        nuscenes_map::{self, Area},
        nuscenes_radar,
        nuscenes_words::{self as words, token},
        parallel::Threads,
        set::{Frame, Scene, Set},
        table::Table,
    },
};

/// The version that tools expect.
const VERSION: &str = "v1.0-trainval";

/// A sensor of a scene under its name in nuScenes.
struct Channel<'a> {
    name: String,
    sensor: &'a Sensor,
    calibrated_sensor_token: String,
    /// The frames in which the sensor measured, by position in the list of frames.
    measured: Vec<usize>,
}

/// A scene, and what its frames need of its mounts.
struct Mounted<'a> {
    scene: &'a Scene,
    /// From the middle of the rear axle, which is the origin in nuScenes, to that of the vehicle.
    ego_from_vehicle: DAffine3,
    /// The corner of the map that is the origin of nuScenes' world.
    origin: DVec3,
    channels: Vec<Channel<'a>>,
    /// The frames in which every sensor measured: nuScenes' key frames. The files of others are sweeps.
    samples: Vec<usize>,
}

/// The tables that grow with the frames.
struct Tables {
    sample: Table,
    ego_pose: Table,
    sample_data: Table,
    sample_annotation: Table,
    instance: Table,
}

/// The rows of a frame.
struct Rows {
    scene: usize,
    /// Of key frames.
    sample: Option<Value>,
    ego_pose: Value,
    sample_data: Vec<Value>,
    annotations: Vec<Annotation>,
}

/// A row of `sample_annotation` that does not know its neighbours yet.
struct Annotation {
    actor: u32,
    category_token: String,
    token: String,
    row: Value,
}

/// An object of a scene, whose last row waits for the next one.
struct Instance {
    category_token: String,
    first_token: String,
    count: u64,
    last: Annotation,
}

/// Writes the data set.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    threads: Threads,
) -> anyhow::Result<()> {
    let folder = root.join(VERSION);
    fs::create_dir(&folder).with_context(|| folder.display().to_string())?;
    let areas = nuscenes_map::areas(set, threads)?;
    let scenes: Vec<Mounted> = (set.scenes().iter())
        .map(|scene| Mounted::of(scene, areas[&scene.metadata.settings.map_fnv1a64].low))
        .collect::<anyhow::Result<_>>()?;
    for scene in &scenes {
        for channel in &scene.channels {
            let has_sweeps = channel.measured.len() > scene.samples.len();
            for folder in if has_sweeps { &["samples", "sweeps"][..] } else { &["samples"] } {
                let path = root.join(folder).join(&channel.name);
                fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
            }
        }
    }
    write_fixed_tables(&folder, &scenes)?;
    write_maps(&folder, root, set, &areas)?;

    let table = |name: &str| Table::create(&folder.join(format!("{name}.json")));
    let mut tables = Tables {
        sample: table("sample")?,
        ego_pose: table("ego_pose")?,
        sample_data: table("sample_data")?,
        sample_annotation: table("sample_annotation")?,
        instance: table("instance")?,
    };
    let mut live = (0, BTreeMap::new());
    let convert = |index: usize| {
        let (scene, index) = set.place(index);
        scenes[scene].rows(scene, index, root, images)
    };
    threads.in_order(set.frames(), convert, |_, rows| {
        if rows.scene != live.0 {
            tables.end_instances(&scenes[live.0].scene.name, std::mem::take(&mut live.1))?;
            live.0 = rows.scene;
        }
        tables.push(rows, &mut live.1)
    })?;
    tables.end_instances(&scenes[live.0].scene.name, live.1)?;
    let Tables { sample, ego_pose, sample_data, sample_annotation, instance } = tables;
    [sample, ego_pose, sample_data, sample_annotation, instance]
        .into_iter()
        .try_for_each(Table::finish)
}

impl Tables {
    fn push(&mut self, rows: Rows, live: &mut BTreeMap<u32, Instance>) -> anyhow::Result<()> {
        rows.sample.iter().try_for_each(|row| self.sample.push(row))?;
        self.ego_pose.push(&rows.ego_pose)?;
        rows.sample_data.iter().try_for_each(|row| self.sample_data.push(row))?;
        for mut annotation in rows.annotations {
            match live.get_mut(&annotation.actor) {
                None => {
                    let instance = Instance {
                        category_token: annotation.category_token.clone(),
                        first_token: annotation.token.clone(),
                        count: 1,
                        last: annotation,
                    };
                    live.insert(instance.last.actor, instance);
                }
                Some(instance) => {
                    annotation.row["prev"] = json!(instance.last.token);
                    instance.last.row["next"] = json!(annotation.token);
                    self.sample_annotation.push(&instance.last.row)?;
                    instance.count += 1;
                    instance.last = annotation;
                }
            }
        }
        Ok(())
    }

    fn end_instances(&mut self, scene: &str, live: BTreeMap<u32, Instance>) -> anyhow::Result<()> {
        for (actor, instance) in live {
            self.sample_annotation.push(&instance.last.row)?;
            self.instance.push(&json!({
                "token": instance_token(scene, actor),
                "category_token": instance.category_token,
                "nbr_annotations": instance.count,
                "first_annotation_token": instance.first_token,
                "last_annotation_token": instance.last.token,
            }))?;
        }
        Ok(())
    }
}

fn instance_token(scene: &str, actor: u32) -> String {
    token(&["instance", scene, &actor.to_string()])
}

fn write_fixed_tables(folder: &Path, scenes: &[Mounted]) -> anyhow::Result<()> {
    let write = |name: &str, rows: Vec<Value>| {
        let mut table = Table::create(&folder.join(format!("{name}.json")))?;
        rows.iter().try_for_each(|row| table.push(row))?;
        table.finish()
    };
    write("category", words::categories())?;
    write("attribute", words::attributes())?;
    write("visibility", words::visibilities())?;
    let mut sensors = BTreeMap::new();
    let mut calibrated_sensors = Vec::new();
    for mounted in scenes {
        for channel in &mounted.channels {
            let sensor_token = token(&["sensor", &channel.name]);
            let modality = &channel.sensor.kind;
            let row =
                json!({ "token": sensor_token, "channel": channel.name, "modality": modality });
            sensors.insert(channel.name.clone(), row);
            calibrated_sensors.push(mounted.calibration(channel, &sensor_token));
        }
    }
    write("sensor", sensors.into_values().collect())?;
    write("calibrated_sensor", calibrated_sensors)?;
    let mut logs = Vec::new();
    let mut rows = Vec::new();
    for Mounted { scene, samples, .. } in scenes {
        let name = &scene.name;
        let settings = &scene.metadata.settings;
        let log_token = token(&["log", name]);
        logs.push(json!({
            "token": log_token,
            "logfile": name,
            "vehicle": settings.ego_blueprint,
            // A simulated day has no date.
            "date_captured": "1970-01-01",
            "location": settings.map,
        }));
        rows.push(json!({
            "token": token(&["scene", name]),
            "log_token": log_token,
            "nbr_samples": samples.len(),
            "name": name,
            "description": format!("map {}, seed {}", settings.map, settings.seed),
            "first_sample_token": sample_token(name, 0),
            "last_sample_token": sample_token(name, samples.len() - 1),
        }));
    }
    write("log", logs)?;
    write("scene", rows)
}

fn write_maps(
    folder: &Path,
    root: &Path,
    set: &Set,
    areas: &BTreeMap<String, Area>,
) -> anyhow::Result<()> {
    let maps = root.join("maps");
    fs::create_dir(&maps).with_context(|| maps.display().to_string())?;
    let mut table = Table::create(&folder.join("map.json"))?;
    for (hash, area) in areas {
        let of_map = || set.scenes().iter().filter(|s| s.metadata.settings.map_fnv1a64 == *hash);
        let Some(scene) = of_map().next() else { continue };
        let token_of_map = token(&["map", hash]);
        let filename = format!("maps/{token_of_map}.png");
        nuscenes_map::draw(scene, area, &root.join(&filename))?;
        let logs: Vec<String> = of_map().map(|scene| token(&["log", &scene.name])).collect();
        table.push(&json!({
            "token": token_of_map,
            "log_tokens": logs,
            "category": "semantic_prior",
            "filename": filename,
        }))?;
    }
    table.finish()
}

fn sample_token(scene: &str, index: usize) -> String {
    token(&["sample", scene, &index.to_string()])
}

fn data_token(scene: &str, channel: &str, index: usize) -> String {
    token(&["sample_data", scene, channel, &index.to_string()])
}

/// Returns the tokens of the neighbours in a row of `count`; empty at its ends.
fn neighbours(index: usize, count: usize, token: impl Fn(usize) -> String) -> [String; 2] {
    let prev = index.checked_sub(1).map(&token).unwrap_or_default();
    let next = if index + 1 < count { token(index + 1) } else { String::new() };
    [prev, next]
}

/// Returns position, and rotation as w, x, y, z.
fn translation_rotation(transform: &DAffine3) -> ([f64; 3], [f64; 4]) {
    let (position, q) = parts(transform);
    (position.to_array(), [q.w, q.x, q.y, q.z])
}

impl<'a> Mounted<'a> {
    fn of(scene: &'a Scene, origin: DVec3) -> anyhow::Result<Mounted<'a>> {
        let blueprint = town::blueprint(&scene.metadata.settings.ego_blueprint);
        let wheelbase_m = blueprint.map_or(0.0, |(_, made)| f64::from(made.wheelbase_m));
        let mut channels: Vec<Channel> = Vec::new();
        for (sensor, camera) in scene.cameras() {
            without_lens("nuScenes", &scene.name, sensor, camera)?;
            let name = words::camera_channel(sensor, camera);
            let is_taken = channels.iter().any(|channel| channel.name == name);
            let name = if is_taken { words::own_channel("CAM", sensor) } else { name };
            channels.push(Channel::of(scene, name, sensor));
        }
        for (number, (sensor, _)) in scene.lidars().enumerate() {
            let own = words::own_channel("LIDAR", sensor);
            let name = if number == 0 { "LIDAR_TOP".to_owned() } else { own };
            channels.push(Channel::of(scene, name, sensor));
        }
        for sensor in scene.radars() {
            channels.push(Channel::of(scene, words::own_channel("RADAR", sensor), sensor));
        }
        let ego_from_vehicle = DAffine3::from_translation(DVec3::X * 0.5 * wheelbase_m);
        let mut samples = Vec::new();
        for index in 0..scene.frames() {
            let line = scene.frame(index)?.line;
            for channel in &mut channels {
                if line.measures(&channel.sensor.name) {
                    channel.measured.push(index);
                }
            }
            if channels.iter().all(|channel| channel.measured.last() == Some(&index)) {
                samples.push(index);
            }
        }
        ensure!(
            !samples.is_empty(),
            "{}: its sensors measure together in none of its {} frames, so that nuScenes' samples cannot \
             be made; use rates of which each is a multiple of the lowest",
            scene.name,
            scene.frames()
        );
        Ok(Mounted { scene, ego_from_vehicle, origin, channels, samples })
    }

    fn calibration(&self, channel: &Channel, sensor_token: &str) -> Value {
        let sensor = channel.sensor;
        let (vehicle_from_sensor, intrinsics) = match &sensor.camera {
            Some(camera) => (
                affine_of_rows(&camera.vehicle_from_optical),
                json!(intrinsics_of_centres(&camera.intrinsics_px)),
            ),
            // Their radar has x ahead and y to the left.
            None if sensor.radar.is_some() => {
                (affine_of_rows(&sensor.vehicle_from_sensor), json!([]))
            }
            None => {
                // Their lidar has x to the right and y ahead.
                let from_theirs = DMat3::from_cols(DVec3::NEG_Y, DVec3::X, DVec3::Z);
                let vehicle_from_sensor = affine_of_rows(&sensor.vehicle_from_sensor);
                (vehicle_from_sensor * DAffine3::from_mat3(from_theirs), json!([]))
            }
        };
        let (translation, rotation) =
            translation_rotation(&(self.ego_from_vehicle * vehicle_from_sensor));
        json!({
            "token": channel.calibrated_sensor_token,
            "sensor_token": sensor_token,
            "translation": translation,
            "rotation": rotation,
            "camera_intrinsic": intrinsics,
        })
    }

    /// Writes the files of a frame and returns its rows.
    fn rows(
        &self,
        scene: usize,
        index: usize,
        root: &Path,
        images: &Images,
    ) -> anyhow::Result<Rows> {
        let frame = self.scene.frame(index)?;
        let name = &self.scene.name;
        let timestamp = frame.line.sim_time_nanos / 1000;
        // A sweep belongs to the sample after it; those after the last sample, to the last.
        let number = self.samples.partition_point(|sample| *sample < index);
        let is_sample = self.samples.get(number) == Some(&index);
        let token_of_sample = sample_token(name, number.min(self.samples.len() - 1));
        let [prev, next] =
            neighbours(number, self.samples.len(), |number| sample_token(name, number));
        let sample = is_sample.then(|| {
            json!({
                "token": token_of_sample,
                "timestamp": timestamp,
                "prev": prev,
                "next": next,
                "scene_token": token(&["scene", name]),
            })
        });
        let ego_token = token(&["ego_pose", name, &index.to_string()]);
        let global_from_world = DAffine3::from_translation(-self.origin);
        let global_from_ego = global_from_world
            * affine(&frame.line.ego.world_from_vehicle)
            * self.ego_from_vehicle.inverse();
        let (translation, rotation) = translation_rotation(&global_from_ego);
        let ego_pose = json!({
            "token": ego_token,
            "timestamp": timestamp,
            "rotation": rotation,
            "translation": translation,
        });
        let mut sample_data = Vec::new();
        let folder = if is_sample { "samples" } else { "sweeps" };
        for channel in &self.channels {
            let Ok(ordinal) = channel.measured.binary_search(&index) else { continue };
            let [prev, next] = neighbours(ordinal, channel.measured.len(), |ordinal| {
                data_token(name, &channel.name, channel.measured[ordinal])
            });
            let stem = format!("{folder}/{0}/{name}__{0}__{timestamp:012}", channel.name);
            let stored = write_file(&frame, channel.sensor, root, &stem, images)?;
            sample_data.push(json!({
                "token": data_token(name, &channel.name, index),
                "sample_token": token_of_sample,
                "ego_pose_token": ego_token,
                "calibrated_sensor_token": channel.calibrated_sensor_token,
                "timestamp": timestamp,
                "fileformat": stored.format,
                "is_key_frame": is_sample,
                "height": stored.size[1],
                "width": stored.size[0],
                "filename": stored.name,
                "prev": prev,
                "next": next,
            }));
        }
        let lidar = self.scene.lidars().next().map(|(sensor, _)| sensor.name.as_str());
        let annotate = |actor: &ActorBox| {
            let category_token = token(&["category", words::category(actor)?]);
            let token_of_row = token(&[
                "sample_annotation",
                name,
                &actor.actor_id.to_string(),
                &index.to_string(),
            ]);
            let (translation, rotation) =
                translation_rotation(&(global_from_world * affine(&actor.world_from_box)));
            let [length, width, height] = actor.size_m;
            let points = lidar.and_then(|lidar| actor.lidar_points.get(lidar)).unwrap_or(&0);
            let row = json!({
                "token": token_of_row,
                "sample_token": token_of_sample,
                "instance_token": instance_token(name, actor.actor_id),
                "visibility_token": words::visibility(actor),
                "attribute_tokens": words::attribute(actor).map(|a| token(&["attribute", a])).into_iter().collect::<Vec<_>>(),
                "translation": translation,
                "size": [width, length, height],
                "rotation": rotation,
                "prev": "",
                "next": "",
                "num_lidar_pts": points,
                "num_radar_pts": actor.radar_points.values().sum::<u32>(),
            });
            Some(Annotation { actor: actor.actor_id, category_token, token: token_of_row, row })
        };
        let boxes = if is_sample { frame.boxes()? } else { Vec::new() };
        let annotations = boxes.iter().filter_map(annotate).collect();
        Ok(Rows { scene, sample, ego_pose, sample_data, annotations })
    }
}

impl<'a> Channel<'a> {
    fn of(scene: &Scene, name: String, sensor: &'a Sensor) -> Channel<'a> {
        let calibrated_sensor_token = token(&["calibrated_sensor", &scene.name, &name]);
        Channel { name, sensor, calibrated_sensor_token, measured: Vec::new() }
    }
}

/// A file of a sensor.
struct Stored {
    name: String,
    format: &'static str,
    /// Width and height; 0 for points.
    size: [u32; 2],
}

fn write_file(
    frame: &Frame,
    sensor: &Sensor,
    root: &Path,
    stem: &str,
    images: &Images,
) -> anyhow::Result<Stored> {
    match (&sensor.camera, &sensor.lidar) {
        (Some(camera), _) => {
            let Camera { width_px, height_px, .. } = camera;
            let name = format!("{stem}.{}", images.extension());
            images.place(frame, sensor, camera, &root.join(&name))?;
            Ok(Stored { name, format: images.extension(), size: [*width_px, *height_px] })
        }
        (None, Some(lidar)) => {
            let name = format!("{stem}.pcd.bin");
            let path = root.join(&name);
            let file = points(&frame.points(sensor)?, lidar);
            fs::write(&path, file).with_context(|| path.display().to_string())?;
            Ok(Stored { name, format: "pcd", size: [0, 0] })
        }
        (None, None) => {
            let name = format!("{stem}.pcd");
            let path = root.join(&name);
            let file = nuscenes_radar::file(frame, sensor)?;
            fs::write(&path, file).with_context(|| path.display().to_string())?;
            Ok(Stored { name, format: "pcd", size: [0, 0] })
        }
    }
}

/// Returns x, y, z, intensity 0 to 255 and ring of each point, as f32: x to the right, y ahead, ring
/// 0 the lowest.
fn points(plain: &[u8], lidar: &Lidar) -> Vec<u8> {
    let last = f64::from(lidar.channels.saturating_sub(1));
    let span = lidar.upper_elevation_rad - lidar.lower_elevation_rad;
    let mut file = Vec::with_capacity(plain.len() / 4 * 5);
    for point in decode::floats(plain).chunks_exact(4) {
        let [x, y, z, intensity] = [point[0], point[1], point[2], point[3]];
        let elevation = f64::from(z).atan2(f64::from(x).hypot(f64::from(y)));
        let share = if span > 0.0 { (elevation - lidar.lower_elevation_rad) / span } else { 0.0 };
        let by_table = lidar.elevations_rad.iter().rev().map(|rad| (rad - elevation).abs());
        let nearest = by_table.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let ring = nearest.map_or((share * last).round(), |(ring, _)| ring as f64);
        let ring = ring.clamp(0.0, last) as f32;
        file.extend([-y, x, z, intensity * 255.0, ring].iter().flat_map(|v| v.to_le_bytes()));
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_the_axes_and_the_ring_of_nuscenes() {
        let lidar = Lidar {
            channels: 3,
            columns: 8,
            upper_elevation_rad: 0.1,
            lower_elevation_rad: -0.1,
            range_m: 100.0,
            ..Lidar::default()
        };
        // 10 m ahead, 1 m to the left, straight; and 10 m to the left, below.
        let plain = [10.0f32, 1.0, 0.0, 0.5, 0.0, 10.0, -1.0, 1.0];
        let plain: Vec<u8> = plain.iter().flat_map(|v| v.to_le_bytes()).collect();
        let found = decode::floats(&points(&plain, &lidar));
        assert_eq!(found, [-1.0, 10.0, 0.0, 127.5, 1.0, -10.0, 0.0, -1.0, 255.0, 0.0]);
    }

    #[test]
    fn rows_at_the_ends_have_one_neighbour() {
        let name = |index: usize| index.to_string();
        assert_eq!(neighbours(0, 1, name), ["", ""]);
        assert_eq!(neighbours(0, 3, name), ["", "1"]);
        assert_eq!(neighbours(2, 3, name), ["1", ""]);
    }
}
