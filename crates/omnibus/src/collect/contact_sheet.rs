//! The contact sheet: an overview of some frames of a data set in one picture.
//!
//! A row is a frame: colour with the boxes of visible actors, depth and tags of the camera that has the
//! most of these, and the first lidar from above.

use std::{fs, path::PathBuf};

use mesh::Tag;

use crate::collect::{
    CollectError,
    decode::{self, Image},
    encode::{DEPTH_FAR, DEPTH_STEPS_PER_M, Encoder},
    folder::{Folder, write_atomically},
    format::{Boxes, FrameLine, Metadata, Sensor},
    frame_list,
    sensors::BOXES,
    sheet::{Sheet, mean},
};

/// The name of the file.
pub(crate) const NAME: &str = "contact-sheet.png";

const ROWS: usize = 5;
const TILE_WIDTH: usize = 400;
/// Half the side of the square that a lidar tile shows, in metres.
const LIDAR_SHOWN_M: f32 = 45.0;

/// Writes the contact sheet of a data set and returns its path.
pub(crate) fn make(folder: &Folder, metadata: &Metadata) -> Result<PathBuf, CollectError> {
    let (mut lines, _) = frame_list::read(&folder.frames())?;
    let outputs = |sensor: &Sensor| {
        let is_written = |output: &&str| {
            let folder = format!("{}/{output}", sensor.name);
            metadata.outputs.iter().any(|written| written.folder == folder)
        };
        ["color", "depth", "tag"].into_iter().filter(is_written).count()
    };
    let cameras = metadata.settings.sensors.iter().filter(|s| s.camera.is_some());
    // The first of those with the most outputs.
    let camera = cameras.rev().max_by_key(|sensor| outputs(sensor));
    let lidar = metadata.settings.sensors.iter().find(|s| s.lidar.is_some());
    // Frames in which both measure, if there are any; else those of the camera.
    let measures = |line: &FrameLine, sensor: Option<&Sensor>| {
        sensor.is_none_or(|sensor| line.measures(&sensor.name))
    };
    let has_both = |line: &FrameLine| measures(line, camera) && measures(line, lidar);
    let is_shown = |line: &FrameLine| measures(line, camera);
    if lines.iter().any(has_both) {
        lines.retain(has_both);
    } else {
        lines.retain(is_shown);
    }
    let rows = lines.len().min(ROWS);
    let height = camera
        .and_then(|s| s.camera.as_ref())
        .map_or(TILE_WIDTH * 3 / 4, |c| TILE_WIDTH * c.height_px as usize / c.width_px as usize);
    let mut sheet = Sheet::new(4, rows, [TILE_WIDTH, height.max(1)]);
    for row in 0..rows {
        // Evenly over the whole set, including the first and the last frame.
        let line = &lines[row * (lines.len() - 1) / (rows - 1).max(1)];
        if let Some(camera) = camera {
            draw_camera(&mut sheet, row, (folder, metadata), camera, line)?;
        }
        if let Some(lidar) = lidar.filter(|lidar| line.measures(&lidar.name)) {
            draw_lidar(&mut sheet, row, folder, lidar, line)?;
        }
    }
    let path = folder.root().join(NAME);
    let mut encoder = Encoder::default();
    encoder.picture([sheet.width as u32, sheet.height as u32], &sheet.pixels)?;
    write_atomically(&path, &encoder.file)?;
    Ok(path)
}

fn draw_camera(
    sheet: &mut Sheet,
    row: usize,
    (folder, metadata): (&Folder, &Metadata),
    camera: &Sensor,
    line: &FrameLine,
) -> Result<(), CollectError> {
    let image = |output: &str| {
        read_image(folder, metadata, &format!("{}/{output}", camera.name), line.frame)
    };
    let width = camera.camera.as_ref().map_or(TILE_WIDTH, |c| c.width_px as usize);
    let scale = width as f32 / sheet.tile[0] as f32;
    let at = |image: &Image, x: usize, y: usize| {
        let [u, v] = [x, y].map(|p| ((p as f32 + 0.5) * scale) as usize);
        v.min(image.height - 1) * image.width + u.min(image.width - 1)
    };
    if let Some(color) = image("color")? {
        sheet.draw(0, row, |x, y| mean(&color, [x, y], scale));
    }
    if let Some(depth) = image("depth")? {
        let depths = depth.sixteen();
        sheet.draw(1, row, |x, y| depth_shade(depths[at(&depth, x, y)]));
    }
    if let Some(tag) = image("tag")? {
        sheet.draw(2, row, |x, y| tag_color(tag.bytes[at(&tag, x, y)]));
    }
    let boxes = folder.frame_file(BOXES, line.frame, "json");
    let text = fs::read(&boxes).map_err(|e| CollectError::io(&boxes, e))?;
    let found: Boxes =
        serde_json::from_slice(&text).map_err(|e| CollectError::damaged(&boxes, e))?;
    for actor in &found.actors {
        if let Some(view) = actor.cameras.get(&camera.name) {
            let edges = view.visible_box_px.map(|p| (p as f32 / scale) as usize);
            sheet.outline(0, row, edges, tag_color(actor.tag));
        }
    }
    Ok(())
}

fn draw_lidar(
    sheet: &mut Sheet,
    row: usize,
    folder: &Folder,
    lidar: &Sensor,
    line: &FrameLine,
) -> Result<(), CollectError> {
    let read = |output: &str| {
        let path = folder.frame_file(&format!("{}/{output}", lidar.name), line.frame, "bin");
        fs::read(&path).map_err(|e| CollectError::io(&path, e))
    };
    let points = decode::floats(&read("points")?);
    let labels = read("labels")?;
    let [width, height] = sheet.tile;
    let scale = height as f32 * 0.5 / LIDAR_SHOWN_M;
    for (point, label) in points.chunks_exact(4).zip(labels.chunks_exact(8)) {
        // Forward is up, left is left.
        let x = width as f32 * 0.5 - point[1] * scale;
        let y = height as f32 * 0.5 - point[0] * scale;
        if (0.0..width as f32).contains(&x) && (0.0..height as f32).contains(&y) {
            sheet.dot(3, row, [x as usize, y as usize], tag_color(label[4]));
        }
    }
    Ok(())
}

/// Reads an image; `None` if there is no such output.
fn read_image(
    folder: &Folder,
    metadata: &Metadata,
    output: &str,
    frame: u64,
) -> Result<Option<Image>, CollectError> {
    let extension = metadata.extension(output);
    let path = folder.frame_file(output, frame, extension);
    match fs::read(&path) {
        Ok(file) => {
            decode::image(extension, &file).map(Some).map_err(|e| CollectError::damaged(&path, e))
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(CollectError::io(&path, e)),
    }
}

/// Returns the grey of a depth: white is near, each tenfold distance is equally darker.
fn depth_shade(steps: u16) -> [u8; 3] {
    if steps == DEPTH_FAR {
        return [10, 12, 30];
    }
    let metres = (f32::from(steps) / DEPTH_STEPS_PER_M).max(1.0);
    [(255.0 * (1.0 - metres.log10() / 2.9).clamp(0.0, 1.0)) as u8; 3]
}

/// Returns the colour of a tag in the CityScapes palette, which CARLA uses.
fn tag_color(code: u8) -> [u8; 3] {
    Tag::from_code(code).map_or([0; 3], Tag::color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_brighter_than_far_and_the_sky_has_its_own_colour() {
        let shade = |metres: f32| depth_shade((metres * DEPTH_STEPS_PER_M) as u16)[0];
        assert!(shade(2.0) > shade(20.0) && shade(20.0) > shade(200.0));
        assert_ne!(depth_shade(DEPTH_FAR), depth_shade(DEPTH_FAR - 1));
    }
}
