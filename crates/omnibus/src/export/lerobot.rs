//! LeRobot's format, version 3.0: a scene is an episode, and a frame is a row with its images.

use std::{collections::BTreeMap, fs, path::Path};

use anyhow::{Context, ensure};
use glam::{DVec3, EulerRot};
use serde_json::{Map, Value, json};

use crate::{
    collect::format::{FrameLine, WeatherSettings},
    export::{
        geometry::{affine, parts},
        images::Images,
        parallel::Threads,
        parquet::{Column, Table, Values},
        set::{Scene, Set},
        statistics::{Histogram, NAMES, Statistics},
    },
};

/// An episode begins a new file where the one before would exceed this.
const FILE_MEBIBYTES: u64 = 100;
/// Files in a folder.
const CHUNK_FILES: usize = 1000;
/// Images of each camera and episode whose pixels count in the statistics.
const SAMPLED_IMAGES: usize = 10;

/// The numbers of a row in the vehicle's space, and its pose in the world.
const STATE: [&str; 11] = [
    "velocity_x_mps",
    "velocity_y_mps",
    "yaw_rate_radps",
    "acceleration_x_mps2",
    "acceleration_y_mps2",
    "position_x_m",
    "position_y_m",
    "position_z_m",
    "yaw_rad",
    "pitch_rad",
    "roll_rad",
];
const ACTION: [&str; 3] = ["throttle", "brake", "steer"];
const WEATHER: [&str; 9] = [
    "cloudiness",
    "precipitation",
    "precipitation_deposits",
    "wind_intensity",
    "sun_azimuth_rad",
    "sun_altitude_rad",
    "fog_density",
    "fog_distance_m",
    "wetness",
];

/// What all scenes share.
struct Layout {
    fps: f64,
    /// Name, width and height of each camera.
    cameras: Vec<(String, u32, u32)>,
    /// The tasks by the names of the maps.
    tasks: Vec<String>,
}

/// A row of the table of episodes.
struct Episode {
    task: usize,
    frames: usize,
    first_frame: usize,
    file: usize,
    statistics: Vec<(String, Statistics)>,
}

/// Writes the data set.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    threads: Threads,
) -> anyhow::Result<()> {
    let layout = Layout::of(set)?;
    let mut open: Option<Table> = None;
    let mut episodes: Vec<Episode> = Vec::new();
    let (mut file, mut first_frame, mut frames_in_file) = (0, 0, 0);
    for (index, scene) in set.scenes().iter().enumerate() {
        let bytes = open.as_ref().map_or(0, Table::bytes);
        let frames = scene.frames();
        if is_full(bytes, frames_in_file, frames) {
            open.take().map_or(Ok(()), Table::finish)?;
            file += 1;
            frames_in_file = 0;
        }
        let task = layout.task_index(scene);
        let columns = columns(scene, &lines(scene, threads)?, [index, first_frame, task]);
        let table = match &mut open {
            Some(table) => table,
            None => open.insert(layout.table(root, file, &columns)?),
        };
        let mut statistics: Vec<_> = columns.iter().map(of_column).collect();
        let mut group = table.group()?;
        columns.iter().try_for_each(|column| group.put(column))?;
        for (sensor, camera) in scene.cameras() {
            let convert = |index: usize| {
                let frame = scene.frame(index)?;
                let name = format!("{}.{}", frame.name(sensor), images.extension());
                let pixels = match is_sampled(index, frames) {
                    true => Some(frame.image(sensor, camera, "color")?),
                    false => None,
                };
                Ok((images.file(&frame, sensor, camera)?, name, pixels))
            };
            let mut histogram = Histogram::new();
            group.put_images(|put| {
                threads.in_order(frames, convert, |_, (file, name, pixels)| {
                    pixels.iter().for_each(|pixels| histogram.add(pixels));
                    put(file, name)
                })
            })?;
            statistics.push((image_name(&sensor.name), histogram.statistics()));
        }
        group.finish()?;
        episodes.push(Episode { task, frames, first_frame, file, statistics });
        first_frame += frames;
        frames_in_file += frames;
    }
    open.map_or(Ok(()), Table::finish)?;
    layout.write_metadata(root, &episodes)
}

/// Returns whether an episode of as large frames as those in a file exceeds it.
fn is_full(bytes: u64, frames_in_file: usize, frames: usize) -> bool {
    let all = (frames_in_file + frames) as u64;
    frames_in_file > 0 && bytes * all / frames_in_file as u64 >= FILE_MEBIBYTES << 20
}

/// Reads the lines of a scene.
fn lines(scene: &Scene, threads: Threads) -> anyhow::Result<Vec<FrameLine>> {
    let mut lines: Vec<FrameLine> = Vec::new();
    let read = |index: usize| Ok(FrameLine { ego_sensors: Vec::new(), ..scene.frame(index)?.line });
    threads.in_order(scene.frames(), read, |index, line| {
        let first_nanos = lines.first().map_or(line.sim_time_nanos, |first| first.sim_time_nanos);
        let expected_nanos = first_nanos + index as u64 * period_nanos(scene);
        ensure!(
            line.sim_time_nanos == expected_nanos,
            "{}: frame {} is at {} ns, and would be at {expected_nanos} ns if all had the same \
             distance, as LeRobot requires; is a frame missing?",
            scene.name,
            line.frame,
            line.sim_time_nanos
        );
        lines.push(line);
        Ok(())
    })?;
    Ok(lines)
}

/// Returns the simulated time from one frame to the next.
fn period_nanos(scene: &Scene) -> u64 {
    scene.metadata.settings.fixed_delta_nanos * scene.metadata.settings.every_frames
}

/// Returns whether the pixels of an image count in the statistics: of a few at equal distances.
fn is_sampled(index: usize, frames: usize) -> bool {
    index * SAMPLED_IMAGES % frames < SAMPLED_IMAGES
}

fn image_name(camera: &str) -> String {
    format!("observation.images.{camera}")
}

fn of_column(column: &Column) -> (String, Statistics) {
    let values: Vec<f64> = match &column.values {
        Values::Floats(values) => values.iter().map(|value| f64::from(*value)).collect(),
        Values::Doubles(values) => values.clone(),
        Values::Integers(values) => values.iter().map(|value| *value as f64).collect(),
        Values::Texts(_) => Vec::new(),
    };
    (column.name.clone(), Statistics::of(&values, column.shape.iter().product()))
}

impl Layout {
    fn of(set: &Set) -> anyhow::Result<Layout> {
        let mut layout = Layout { fps: 0.0, cameras: Vec::new(), tasks: Vec::new() };
        let mut first: Option<&Scene> = None;
        for scene in set.scenes() {
            let fps = 1e9 / period_nanos(scene) as f64;
            let cameras: Vec<_> = (scene.cameras())
                .map(|(sensor, camera)| (sensor.name.clone(), camera.width_px, camera.height_px))
                .collect();
            let first = first.get_or_insert_with(|| {
                layout = Layout { fps, cameras: cameras.clone(), tasks: Vec::new() };
                scene
            });
            let (ours, theirs) = (&scene.name, &first.name);
            ensure!(
                fps == layout.fps,
                "{ours} has {fps} frames a second, {theirs} has {}; a data set of LeRobot has one \
                 rate: export them apart",
                layout.fps
            );
            ensure!(
                cameras == layout.cameras,
                "{ours} has the cameras {cameras:?}, {theirs} has {:?}; a data set of LeRobot has \
                 the same cameras in all episodes: export them apart",
                layout.cameras
            );
            let task = task(scene);
            if !layout.tasks.contains(&task) {
                layout.tasks.push(task);
            }
        }
        Ok(layout)
    }

    fn task_index(&self, scene: &Scene) -> usize {
        let task = task(scene);
        self.tasks.iter().position(|known| *known == task).expect("every scene has a task")
    }

    fn image_names(&self) -> Vec<String> {
        self.cameras.iter().map(|(camera, ..)| image_name(camera)).collect()
    }

    /// Creates a file of data.
    fn table(&self, root: &Path, file: usize, columns: &[Column]) -> anyhow::Result<Table> {
        let folder = root.join(format!("data/chunk-{:03}", file / CHUNK_FILES));
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let path = folder.join(format!("file-{:03}.parquet", file % CHUNK_FILES));
        // By this `datasets` reads images without `info.json`.
        let images = self.image_names();
        let features: Map<_, _> =
            images.iter().map(|name| (name.clone(), json!({ "_type": "Image" }))).collect();
        let text = json!({ "info": { "features": features } }).to_string();
        Table::create(&path, columns, &images, &[("huggingface", text)])
    }

    /// Writes the files of `meta`.
    fn write_metadata(&self, root: &Path, episodes: &[Episode]) -> anyhow::Result<()> {
        let meta = root.join("meta");
        let chunk = meta.join("episodes/chunk-000");
        fs::create_dir_all(&chunk).with_context(|| chunk.display().to_string())?;
        let put = |name: &str, value: &Value| {
            let path = meta.join(name);
            let text = serde_json::to_vec_pretty(value)?;
            fs::write(&path, text).with_context(|| path.display().to_string())
        };
        put("info.json", &self.info(episodes))?;
        let mut all: BTreeMap<&str, Statistics> = BTreeMap::new();
        for (name, statistics) in episodes.iter().flat_map(|episode| &episode.statistics) {
            match all.get_mut(&name[..]) {
                Some(joined) => joined.join(statistics),
                None => drop(all.insert(name, statistics.clone())),
            }
        }
        let images = self.image_names();
        let stats: Map<_, _> = (all.iter())
            .map(|(name, of)| {
                ((*name).to_owned(), of.json(images.iter().any(|image| image == name)))
            })
            .collect();
        put("stats.json", &stats.into())?;
        let tasks = [
            column("task_index", &[], Values::Integers((0..self.tasks.len() as i64).collect())),
            column("task", &[], Values::Texts(self.tasks.clone())),
        ];
        write_table(&meta.join("tasks.parquet"), &tasks, &[("pandas", pandas_index())])?;
        write_table(&chunk.join("file-000.parquet"), &self.episode_columns(episodes), &[])
    }

    fn info(&self, episodes: &[Episode]) -> Value {
        let vector = |dtype: &str, names: &[&str]| json!({ "dtype": dtype, "shape": [names.len()], "names": names });
        let scalar = |dtype: &str| json!({ "dtype": dtype, "shape": [1], "names": null });
        let mut features = Map::new();
        for (name, feature) in [
            ("observation.state", vector("float32", &STATE)),
            ("action", vector("float32", &ACTION)),
            ("weather", vector("float32", &WEATHER)),
            ("timestamp", scalar("float32")),
            ("frame_index", scalar("int64")),
            ("episode_index", scalar("int64")),
            ("index", scalar("int64")),
            ("task_index", scalar("int64")),
        ] {
            features.insert(name.to_owned(), feature);
        }
        for (camera, width, height) in &self.cameras {
            let names = ["height", "width", "channels"];
            let feature = json!({ "dtype": "image", "shape": [height, width, 3], "names": names });
            features.insert(image_name(camera), feature);
        }
        // LeRobot's type is int; a rate that is none stays exact.
        let fps = if self.fps.fract() == 0.0 { json!(self.fps as u64) } else { json!(self.fps) };
        json!({
            "codebase_version": "v3.0",
            "robot_type": "omnibus",
            "total_episodes": episodes.len(),
            "total_frames": episodes.iter().map(|episode| episode.frames).sum::<usize>(),
            "total_tasks": self.tasks.len(),
            "chunks_size": CHUNK_FILES,
            "data_files_size_in_mb": FILE_MEBIBYTES,
            "video_files_size_in_mb": 2 * FILE_MEBIBYTES,
            "fps": fps,
            "splits": { "train": format!("0:{}", episodes.len()) },
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": null,
            "features": features,
        })
    }

    fn episode_columns(&self, episodes: &[Episode]) -> Vec<Column> {
        let integers = |of: &dyn Fn(usize, &Episode) -> usize| {
            let all = episodes.iter().enumerate();
            Values::Integers(all.map(|(index, episode)| of(index, episode) as i64).collect())
        };
        let tasks = episodes.iter().map(|episode| self.tasks[episode.task].clone()).collect();
        let mut columns = vec![
            column("episode_index", &[], integers(&|index, _| index)),
            column("tasks", &[1], Values::Texts(tasks)),
            column("length", &[], integers(&|_, episode| episode.frames)),
            column("data/chunk_index", &[], integers(&|_, episode| episode.file / CHUNK_FILES)),
            column("data/file_index", &[], integers(&|_, episode| episode.file % CHUNK_FILES)),
            column("dataset_from_index", &[], integers(&|_, episode| episode.first_frame)),
            column(
                "dataset_to_index",
                &[],
                integers(&|_, episode| episode.first_frame + episode.frames),
            ),
            column("meta/episodes/chunk_index", &[], integers(&|_, _| 0)),
            column("meta/episodes/file_index", &[], integers(&|_, _| 0)),
        ];
        let images = self.image_names();
        for (index, (name, first)) in episodes[0].statistics.iter().enumerate() {
            let width = first.numbers[0].len();
            let shape = if images.contains(name) { vec![width, 1, 1] } else { vec![width] };
            for (number, kind) in NAMES.iter().enumerate() {
                let numbers = episodes.iter().map(|e| &e.statistics[index].1.numbers[number][..]);
                let values = Values::Doubles(numbers.collect::<Vec<_>>().concat());
                columns.push(column(&format!("stats/{name}/{kind}"), &shape, values));
            }
            let count = integers(&|_, episode| episode.statistics[index].1.count as usize);
            columns.push(column(&format!("stats/{name}/count"), &[1], count));
        }
        columns
    }
}

fn task(scene: &Scene) -> String {
    format!("drive through {}", scene.metadata.settings.map)
}

fn column(name: &str, shape: &[usize], values: Values) -> Column {
    Column { name: name.to_owned(), shape: shape.to_vec(), values }
}

/// Writes a file of one row group.
fn write_table(path: &Path, columns: &[Column], metadata: &[(&str, String)]) -> anyhow::Result<()> {
    let mut table = Table::create(path, columns, &[], metadata)?;
    let mut group = table.group()?;
    columns.iter().try_for_each(|column| group.put(column))?;
    group.finish()?;
    table.finish()
}

/// Returns the description of [`Layout`]'s tasks for `pandas`, whose index they are:
/// <https://pandas.pydata.org/docs/development/developer.html>.
fn pandas_index() -> String {
    let column = |name: &str, pandas: &str, numpy: &str| {
        json!({ "name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy,
            "metadata": null })
    };
    let columns = [column("task_index", "int64", "int64"), column("task", "unicode", "object")];
    json!({ "index_columns": ["task"], "column_indexes": [], "columns": columns }).to_string()
}

/// Returns the columns of an episode without images; `index` is that of the episode, of its first
/// frame and of its task.
fn columns(scene: &Scene, lines: &[FrameLine], index: [usize; 3]) -> Vec<Column> {
    let [episode, first_frame, task] = index.map(|index| index as i64);
    let floats = |name: &str, width: usize, of: &dyn Fn(usize) -> Vec<f32>| {
        let values = (0..lines.len()).flat_map(of).collect();
        column(name, &[width], Values::Floats(values))
    };
    let integers = |name: &str, of: &dyn Fn(i64) -> i64| {
        column(name, &[], Values::Integers((0..lines.len() as i64).map(of).collect()))
    };
    let timestamp = |index: usize| (index as u64 * period_nanos(scene)) as f64 / 1e9;
    let timestamps = (0..lines.len()).map(|index| timestamp(index) as f32).collect();
    vec![
        floats("observation.state", STATE.len(), &|index| state(&lines[index]).to_vec()),
        // What acts after the frame: the controls of the next one.
        floats("action", ACTION.len(), &|index| {
            let control = &lines[(index + 1).min(lines.len() - 1)].ego.control;
            vec![control.throttle, control.brake, control.steer]
        }),
        floats("weather", WEATHER.len(), &|index| weather(&lines[index].weather).to_vec()),
        column("timestamp", &[], Values::Floats(timestamps)),
        integers("frame_index", &|index| index),
        integers("episode_index", &|_| episode),
        integers("index", &|index| first_frame + index),
        integers("task_index", &|_| task),
    ]
}

/// Returns the numbers of [`STATE`].
fn state(line: &FrameLine) -> [f32; 11] {
    let ego = &line.ego;
    let place = affine(&ego.world_from_vehicle);
    let (position, world_from_vehicle) = parts(&place);
    let in_vehicle =
        |vector: [f32; 3]| world_from_vehicle.inverse() * DVec3::from_array(vector.map(f64::from));
    let velocity = in_vehicle(ego.velocity_mps);
    let acceleration = in_vehicle(ego.acceleration_mps2);
    let (yaw, pitch, roll) = world_from_vehicle.to_euler(EulerRot::ZYX);
    [
        velocity.x,
        velocity.y,
        in_vehicle(ego.angular_velocity_radps).z,
        acceleration.x,
        acceleration.y,
        position.x,
        position.y,
        position.z,
        yaw,
        pitch,
        roll,
    ]
    .map(|number| number as f32)
}

/// Returns the numbers of [`WEATHER`].
fn weather(weather: &WeatherSettings) -> [f32; 9] {
    [
        weather.cloudiness,
        weather.precipitation,
        weather.precipitation_deposits,
        weather.wind_intensity,
        weather.sun_azimuth_rad,
        weather.sun_altitude_rad,
        weather.fog_density,
        weather.fog_distance_m,
        weather.wetness,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_episode_begins_a_file_where_it_would_exceed_the_one_before() {
        let mebibyte = 1 << 20;
        assert!(!is_full(0, 0, 1_000_000));
        assert!(!is_full(40 * mebibyte, 100, 149));
        assert!(is_full(40 * mebibyte, 100, 150));
    }

    #[test]
    fn ten_images_of_an_episode_are_sampled() {
        let sampled = |frames| (0..frames).filter(|index| is_sampled(*index, frames)).count();
        assert_eq!([1, 6, 10, 11, 99, 200, 1001].map(sampled), [1, 6, 10, 10, 10, 10, 10]);
    }
}
