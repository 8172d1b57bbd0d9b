//! WebDataset: tar files in which the files of a sample follow each other and share their stem.

use std::{
    fs::File,
    io::{BufWriter, Read, Write},
    path::Path,
};

use anyhow::Context;
use tar::{Builder, Header};

use crate::export::{
    images::Images,
    parallel::Threads,
    set::{Frame, Set},
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
            let mut tar = Builder::new(BufWriter::with_capacity(1 << 20, File::create(&path)?));
            for index in from..to {
                append(&mut tar, &set.frame(index)?, images)?;
            }
            tar.into_inner()?.flush()?;
            anyhow::Ok(())
        };
        write().with_context(|| path.display().to_string())
    };
    threads.in_order(shards, shard, |_, ()| Ok(()))
}

/// Appends the files of a frame: `town_000041.front.color.png` and so on.
fn append(tar: &mut Builder<impl Write>, frame: &Frame, images: &Images) -> anyhow::Result<()> {
    let key = format!("{}_{:06}", frame.scene.name, frame.line.frame);
    let mut put = |name: &str, parts: &[&[u8]]| {
        let mut header = Header::new_ustar();
        header.set_size(parts.iter().map(|part| part.len() as u64).sum());
        // No clock and no user, so that the same data have the same bytes.
        header.set_mode(0o644);
        header.set_mtime(0);
        let parts = parts.iter().fold(Box::new(std::io::empty()) as Box<dyn Read>, chain);
        tar.append_data(&mut header, format!("{key}.{name}"), parts)
    };
    for (sensor, camera) in frame.scene.cameras() {
        let name = &sensor.name;
        let color = images.file(frame, sensor, camera)?;
        put(&format!("{name}.color.{}", images.extension()), &[&color])?;
        let others = ["depth", "instance", "tag"];
        for output in others.into_iter().filter(|output| frame.scene.has(sensor, output)) {
            let file = frame.bytes(&format!("{name}/{output}"), "png")?;
            put(&format!("{name}.{output}.png"), &[&file])?;
        }
    }
    for (sensor, _) in frame.scene.lidars() {
        let name = &sensor.name;
        let (points, labels) = (frame.points(sensor)?, frame.labels(sensor)?);
        put(&format!("{name}.points.npy"), &[&npy("<f4", points.len() / 16, 4), &points])?;
        put(&format!("{name}.labels.npy"), &[&npy("<u4", labels.len() / 8, 2), &labels])?;
    }
    let sensors = serde_json::to_vec(&frame.scene.metadata.settings.sensors)?;
    put("boxes.json", &[&frame.bytes("boxes", "json")?])?;
    put("frame.json", &[&frame.text])?;
    put("sensors.json", &[&sensors])?;
    Ok(())
}

fn chain<'a>(before: Box<dyn Read + 'a>, part: &&'a [u8]) -> Box<dyn Read + 'a> {
    Box::new(before.chain(*part))
}

/// Returns the head of a file of numpy, version 1.0: an array by rows.
fn npy(kind: &str, rows: usize, columns: usize) -> Vec<u8> {
    let text =
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let mut head = b"\x93NUMPY\x01\x00".to_vec();
    // The data begin at a multiple of 64 bytes; a line feed ends the text.
    let len = (10 + text.len() + 1).next_multiple_of(64) - 10;
    head.extend((len as u16).to_le_bytes());
    head.extend(text.as_bytes());
    head.resize(10 + len - 1, b' ');
    head.push(b'\n');
    head
}
