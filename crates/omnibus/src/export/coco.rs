//! COCO: images, and a mask of each object that they show.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::Path,
};

use anyhow::{Context, bail};
use client_lib::{KEYPOINT_LINKS, KEYPOINTS};
use serde::Serialize;
use serde_json::json;

use crate::{
    collect::{
        CollectError,
        decode::Image,
        format::{View, ViewKeypoints},
        rle::Rle,
    },
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
    segmentation: Rle,
    iscrowd: u8,
    /// Beyond the format: the same for an object in all images of a scene.
    instance_id: u32,
    occluded_fraction: f32,
    truncated_fraction: f32,
    #[serde(flatten)]
    keypoints: Option<Keypoints>,
    #[serde(flatten)]
    amodal: Option<Amodal>,
}

/// The keypoints of a person.
#[derive(Serialize)]
struct Keypoints {
    /// Column, row and visibility of each, in turn.
    keypoints: Vec<f32>,
    /// Those inside of the image.
    num_keypoints: u32,
}

impl From<&ViewKeypoints> for Keypoints {
    fn from(found: &ViewKeypoints) -> Keypoints {
        let hundredths = |px: f32| (px * 100.0).round() / 100.0;
        let triple =
            |(px, seen): (&[f32; 2], &u8)| [hundredths(px[0]), hundredths(px[1]), f32::from(*seen)];
        Keypoints {
            keypoints: found.px.iter().zip(&found.visibility).flat_map(triple).collect(),
            num_keypoints: found.visibility.iter().filter(|seen| **seen > 0).count() as u32,
        }
    }
}

/// Beyond the format: the mask of an object if nothing occluded it.
#[derive(Serialize)]
struct Amodal {
    amodal_segmentation: Rle,
    amodal_bbox: [u32; 4],
    amodal_area: u32,
}

impl Amodal {
    /// Takes the mask of a view that has one.
    fn of(view: &View) -> Result<Option<Amodal>, String> {
        let Some(amodal_segmentation) = view.amodal_mask.clone() else { return Ok(None) };
        let runs = amodal_segmentation.runs()?;
        let height = amodal_segmentation.size[0].max(1);
        let [mut left, mut top, mut right, mut bottom] = [u32::MAX, u32::MAX, 0, 0];
        let (mut begin, mut area) = (0, 0);
        for pair in runs.chunks(2) {
            let [skipped, length] = [pair[0], pair.get(1).copied().unwrap_or(0)];
            begin += skipped;
            let end = begin + length;
            if length > 0 {
                let [first, last] = [begin, end - 1].map(|pixel| [pixel / height, pixel % height]);
                (left, right) = (left.min(first[0]), right.max(last[0] + 1));
                // A run that goes on in the next column spans the height.
                let is_one = first[0] == last[0];
                top = top.min(if is_one { first[1] } else { 0 });
                bottom = bottom.max(if is_one { last[1] + 1 } else { height });
            }
            (begin, area) = (end, area + length);
        }
        let amodal_bbox = if area == 0 { [0; 4] } else { [left, top, right - left, bottom - top] };
        Ok(Some(Amodal { amodal_segmentation, amodal_bbox, amodal_area: area }))
    }
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
        .map(|(id, name, group)| {
            let mut category = json!({ "id": id, "name": name, "supercategory": group });
            if *name == "person" {
                category["keypoints"] = json!(KEYPOINTS);
                category["skeleton"] = json!(KEYPOINT_LINKS);
            }
            category
        })
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
                segmentation: Rle::new([camera.width_px, camera.height_px], &mask.runs),
                iscrowd: 0,
                instance_id: actor.actor_id,
                occluded_fraction: view.occluded_fraction,
                truncated_fraction: view.truncated_fraction,
                keypoints: view.keypoints.as_ref().map(Keypoints::from),
                amodal: Amodal::of(view)
                    .map_err(|why| CollectError::damaged(&frame.path("boxes", "json"), why))?,
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
