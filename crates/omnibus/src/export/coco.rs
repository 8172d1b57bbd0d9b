//! COCO: images, and a mask of each object that they show.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::Path,
};

use anyhow::{Context, bail};
use serde::Serialize;
use serde_json::json;

use crate::{
    collect::decode::Image,
    export::{
        class::{COCO, class, coco},
        images::Images,
        parallel::Threads,
        set::{Frame, Set},
        split::{PARTS, Split},
        table::Table,
    },
};

#[derive(Serialize)]
struct ImageEntry {
    id: u64,
    file_name: String,
    width: u32,
    height: u32,
    /// Beyond the format: where the image is from.
    scene: String,
    camera: String,
    frame: u64,
}

#[derive(Serialize)]
struct Annotation {
    id: u64,
    image_id: u64,
    category_id: u32,
    bbox: [u32; 4],
    area: u32,
    segmentation: Segmentation,
    iscrowd: u8,
    /// Beyond the format: the same for an object in all images of a scene.
    instance_id: u32,
    occluded_fraction: f32,
    truncated_fraction: f32,
}

#[derive(Serialize)]
struct Segmentation {
    /// Height and width.
    size: [u32; 2],
    counts: String,
}

/// Writes the data set.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    split: &Split,
    threads: Threads,
) -> anyhow::Result<()> {
    for scene in set.scenes() {
        let (name, mut cameras) = (&scene.name, scene.cameras());
        let bare = cameras.find(|(camera, _)| !scene.has(camera, "instance"));
        if let Some((camera, _)) = bare {
            let camera = &camera.name;
            bail!("{name}: the camera {camera} has no instance images, from which masks are made");
        }
    }
    for part in PARTS {
        let folder = root.join("images").join(part);
        fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let annotations = root.join("annotations");
    fs::create_dir(&annotations).with_context(|| annotations.display().to_string())?;
    let mut parts = Vec::new();
    for part in PARTS {
        let table = |name: &str| Table::create(&annotations.join(format!("{name}_{part}.part")));
        parts.push([table("images")?, table("instances")?]);
    }
    let convert = |index: usize| {
        let part = split.part(set.place(index));
        let folder = root.join("images").join(PARTS[part]);
        Ok((part, frame_entries(&set.frame(index)?, &folder, images)?))
    };
    threads.in_order(set.frames(), convert, |_, (part, entries)| {
        let [image_table, annotation_table] = &mut parts[part];
        for (mut image, annotations) in entries {
            image.id = image_table.count() + 1;
            image_table.push(&image)?;
            for mut annotation in annotations {
                annotation.id = annotation_table.count() + 1;
                annotation.image_id = image.id;
                annotation_table.push(&annotation)?;
            }
        }
        Ok(())
    })?;
    for (part, tables) in PARTS.into_iter().zip(parts) {
        tables.into_iter().try_for_each(Table::finish)?;
        join(&annotations, part).with_context(|| annotations.display().to_string())?;
    }
    Ok(())
}

/// Makes `instances_train.json` of the two tables of a part.
fn join(folder: &Path, part: &str) -> io::Result<()> {
    let file = File::create(folder.join(format!("instances_{part}.json")))?;
    let mut file = BufWriter::new(file);
    let categories: Vec<_> = COCO
        .iter()
        .map(|(id, name, group)| json!({ "id": id, "name": name, "supercategory": group }))
        .collect();
    let info = json!({ "description": "made by omnibus export", "version": protocol::VERSION });
    write!(file, "{{\"info\":{info},\"licenses\":[],\"categories\":{}", json!(categories))?;
    for (key, table) in [("images", "images"), ("annotations", "instances")] {
        let path = folder.join(format!("{table}_{part}.part"));
        write!(file, ",\n\"{key}\":")?;
        io::copy(&mut File::open(&path)?, &mut file)?;
        fs::remove_file(&path)?;
    }
    writeln!(file, "}}")?;
    file.flush()
}

/// Places the images of a frame, and returns their entries without the ids.
fn frame_entries(
    frame: &Frame,
    folder: &Path,
    images: &Images,
) -> anyhow::Result<Vec<(ImageEntry, Vec<Annotation>)>> {
    let boxes = frame.boxes()?;
    let mut entries = Vec::new();
    for (sensor, camera) in frame.cameras() {
        let file_name = format!("{}.{}", frame.name(sensor), images.extension());
        images.place(frame, sensor, camera, &folder.join(&file_name))?;
        let ids = frame.image(sensor, camera, "instance")?;
        let masks = masks(&ids);
        let mut annotations = Vec::new();
        for actor in &boxes {
            let category = class(actor).and_then(coco);
            let (Some(category_id), Some(view)) = (category, actor.cameras.get(&sensor.name))
            else {
                continue;
            };
            let Some(mask) = masks.get(&actor.actor_id) else { continue };
            annotations.push(Annotation {
                id: 0,
                image_id: 0,
                category_id,
                bbox: mask.bbox(),
                area: mask.area,
                segmentation: Segmentation {
                    size: [camera.height_px, camera.width_px],
                    counts: compressed(&mask.runs),
                },
                iscrowd: 0,
                instance_id: actor.actor_id,
                occluded_fraction: view.occluded_fraction,
                truncated_fraction: view.truncated_fraction,
            });
        }
        let image = ImageEntry {
            id: 0,
            file_name,
            width: camera.width_px,
            height: camera.height_px,
            scene: frame.scene.name.clone(),
            camera: sensor.name.clone(),
            frame: frame.line.frame,
        };
        entries.push((image, annotations));
    }
    Ok(entries)
}

/// The pixels of an object, down the columns from left to right.
struct Mask {
    /// Lengths of runs without and with the object, in turn.
    runs: Vec<u32>,
    /// Where the last run ends.
    end: u32,
    area: u32,
    /// Left, top, right, bottom edge.
    edges: [u32; 4],
}

impl Mask {
    fn bbox(&self) -> [u32; 4] {
        let [left, top, right, bottom] = self.edges;
        [left, top, right - left, bottom - top]
    }
}

/// Returns the mask of each id of an instance image; the sky has none.
fn masks(image: &Image) -> BTreeMap<u32, Mask> {
    let id = |pixel: &[u8]| u32::from_le_bytes([pixel[0], pixel[1], pixel[2], 0]);
    let (width, height) = (image.width, image.height);
    // Transposed first: the order of the masks is that of columns.
    let mut ids = vec![0; width * height];
    for (y, row) in image.bytes.chunks_exact(width * 3).enumerate() {
        for (x, pixel) in row.chunks_exact(3).enumerate() {
            ids[x * height + y] = id(pixel);
        }
    }
    let mut masks: BTreeMap<u32, Mask> = BTreeMap::new();
    for (x, column) in (0u32..).zip(ids.chunks_exact(height)) {
        let mut y = 0;
        for run in column.chunk_by(|a, b| a == b) {
            let (top, len) = (y, run.len() as u32);
            y += len;
            if run[0] == 0 {
                continue;
            }
            let mask = masks.entry(run[0]).or_insert_with(|| Mask {
                runs: Vec::new(),
                end: 0,
                area: 0,
                edges: [x, top, x, top],
            });
            let from = x * height as u32 + top;
            match mask.runs.last_mut() {
                // It goes on in the next column.
                Some(last) if from == mask.end => *last += len,
                _ => mask.runs.extend([from - mask.end, len]),
            }
            mask.end = from + len;
            mask.area += len;
            let [left, highest, _, lowest] = mask.edges;
            mask.edges = [left, highest.min(top), x + 1, lowest.max(top + len)];
        }
    }
    let pixels = (width * height) as u32;
    for mask in masks.values_mut().filter(|mask| mask.end < pixels) {
        mask.runs.push(pixels - mask.end);
    }
    masks
}

/// Returns runs as COCO's text: `rleToString` of `maskApi.c` in cocoapi. From the fourth on a run is
/// written as the difference from the one before the last; five bits per character, the lowest first.
fn compressed(runs: &[u32]) -> String {
    let mut text = String::new();
    for (index, run) in runs.iter().enumerate() {
        let before = if index > 2 { i64::from(runs[index - 2]) } else { 0 };
        let mut rest = i64::from(*run) - before;
        loop {
            let mut bits = (rest & 0x1f) as u8;
            rest >>= 5;
            let is_last = if bits & 0x10 == 0 { rest == 0 } else { rest == -1 };
            if !is_last {
                bits |= 0x20;
            }
            text.push(char::from(bits + 48));
            if is_last {
                break;
            }
        }
    }
    text
}
