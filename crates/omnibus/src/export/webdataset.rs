//! WebDataset: tar files in which the files of a sample follow each other and share their stem.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::Path,
};

use anyhow::Context;
use tar::Header;

use crate::{
    collect::npy,
    export::{
        images::Images,
        parallel::Threads,
        set::{Frame, Set},
        writing::writing,
    },
};

/// Writes the shards.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    shard_samples: usize,
    threads: Threads,
) -> anyhow::Result<()> {
    let shards = set.frames().div_ceil(shard_samples);
    let shard = |shard: usize| {
        let path = root.join(format!("shard-{shard:06}.tar"));
        let from = shard * shard_samples;
        let to = (from + shard_samples).min(set.frames());
        let write = || {
            // Files are larger than the buffer, and pass by it without a copy.
            let mut tar = BufWriter::new(File::create(&path)?);
            for index in from..to {
                append(&mut tar, &set.frame(index)?, images)?;
            }
            // Two blocks of zeros are the end.
            tar.write_all(&[0; 2 * BLOCK])?;
            tar.flush()?;
            anyhow::Ok(())
        };
        write().with_context(|| path.display().to_string())
    };
    threads.in_order(shards, shard, |_, ()| Ok(()))
}

/// The size of a header; contents are filled up to a multiple of it.
const BLOCK: usize = 512;

/// Appends a file of these parts.
fn put(tar: &mut impl Write, name: &str, parts: &[&[u8]]) -> io::Result<()> {
    let len: usize = parts.iter().map(|part| part.len()).sum();
    let mut header = Header::new_ustar();
    header.set_path(name)?;
    header.set_size(len as u64);
    // No clock and no user, so that the same data have the same bytes.
    header.set_mode(0o644);
    header.set_mtime(0);
    header.set_cksum();
    tar.write_all(header.as_bytes())?;
    parts.iter().try_for_each(|part| tar.write_all(part))?;
    tar.write_all(&[0; BLOCK][..len.next_multiple_of(BLOCK) - len])
}

/// Appends the files of a frame: `town_000041.front.color.png` and so on.
fn append(tar: &mut impl Write, frame: &Frame, images: &Images) -> anyhow::Result<()> {
    let key = format!("{}_{:06}", frame.scene.name, frame.line.frame);
    let mut put =
        |name: &str, parts: &[&[u8]]| writing(|| put(tar, &format!("{key}.{name}"), parts));
    for (sensor, camera) in frame.cameras() {
        let name = &sensor.name;
        let color = images.file(frame, sensor, camera)?;
        put(&format!("{name}.color.{}", images.extension()), &[&color])?;
        let others = ["depth", "instance", "tag"];
        for output in others.into_iter().filter(|output| frame.scene.has(sensor, output)) {
            let folder = format!("{name}/{output}");
            let extension = frame.scene.metadata.extension(&folder);
            put(&format!("{name}.{output}.{extension}"), &[&frame.bytes(&folder, extension)?])?;
        }
    }
    for (sensor, _) in frame.lidars() {
        let name = &sensor.name;
        let (points, labels) = (frame.points(sensor)?, frame.labels(sensor)?);
        put(&format!("{name}.points.npy"), &[&array("<f4", points.len() / 16, 4), &points])?;
        put(&format!("{name}.labels.npy"), &[&array("<u4", labels.len() / 8, 2), &labels])?;
    }
    for sensor in frame.radars() {
        let name = &sensor.name;
        let (found, labels) = (frame.detections(sensor)?, frame.labels(sensor)?);
        put(&format!("{name}.detections.npy"), &[&array("<f4", found.len() / 16, 4), &found])?;
        put(&format!("{name}.labels.npy"), &[&array("<u4", labels.len() / 8, 2), &labels])?;
    }
    let sensors = serde_json::to_vec(&frame.scene.metadata.settings.sensors)?;
    put("boxes.json", &[&frame.bytes("boxes", "json")?])?;
    if frame.scene.metadata.outputs.iter().any(|output| output.folder == "lanes") {
        put("lanes.json", &[&frame.bytes("lanes", "json")?])?;
    }
    put("frame.json", &[&frame.text])?;
    put("sensors.json", &[&sensors])?;
    Ok(())
}

/// Returns the head of an array by rows.
fn array(kind: &str, rows: usize, columns: usize) -> Vec<u8> {
    let mut head = Vec::new();
    npy::head(kind, &format!("({rows}, {columns})"), &mut head);
    head
}
