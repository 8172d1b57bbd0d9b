//! The text labels of YOLO: a line for each object, class and 2-D box.

use std::{fmt::Write as _, fs, path::Path};

use anyhow::Context;

use crate::export::{
    class::{COCO, class, coco},
    images::Images,
    parallel::Threads,
    set::{Frame, Set},
    split::{PARTS, Split},
};

/// Writes the data set.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    split: &Split,
    threads: Threads,
) -> anyhow::Result<()> {
    for folder in PARTS.iter().flat_map(|part| [["images", part], ["labels", part]]) {
        let path = root.join(folder.join("/"));
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
    }
    let convert = |index: usize| {
        let place = set.place(index);
        write_frame(&set.frame(index)?, root, PARTS[split.part(place)], images)?;
        Ok(split.part(place))
    };
    let mut counts = [0; 2];
    threads.in_order(set.frames(), convert, |_, part| {
        counts[part] += 1;
        Ok(())
    })?;
    // Readers demand the key, so that without a validation part it names the only part.
    let validation = PARTS[usize::from(counts[1] > 0)];
    let mut yaml = format!("train: images/train\nval: images/{validation}\nnames:\n");
    for (number, (_, name, _)) in COCO.iter().enumerate() {
        writeln!(yaml, "  {number}: {name}").expect("memory is written");
    }
    let path = root.join("data.yaml");
    fs::write(&path, yaml).with_context(|| path.display().to_string())
}

fn write_frame(frame: &Frame, root: &Path, part: &str, images: &Images) -> anyhow::Result<()> {
    let boxes = frame.boxes()?;
    for (sensor, camera) in frame.cameras() {
        let name = frame.name(sensor);
        let image = format!("images/{part}/{name}.{}", images.extension());
        images.place(frame, sensor, camera, &root.join(image))?;
        let (width, height) = (f64::from(camera.width_px), f64::from(camera.height_px));
        let mut text = String::new();
        for actor in &boxes {
            let category = class(actor).and_then(coco);
            let number = COCO.iter().position(|(id, ..)| Some(*id) == category);
            let (Some(number), Some(view)) = (number, actor.cameras.get(&sensor.name)) else {
                continue;
            };
            let [left, top, right, bottom] = view.visible_box_px.map(f64::from);
            let [x, y] = [(left + right) / 2.0 / width, (top + bottom) / 2.0 / height];
            let [w, h] = [(right - left) / width, (bottom - top) / height];
            writeln!(text, "{number} {x:.6} {y:.6} {w:.6} {h:.6}").expect("memory is written");
        }
        let labels = root.join(format!("labels/{part}/{name}.txt"));
        fs::write(&labels, text).with_context(|| labels.display().to_string())?;
    }
    Ok(())
}
