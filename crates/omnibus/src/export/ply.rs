//! PLY: a point cloud for each measurement of a lidar, and the poses of each lidar.

use std::{
    fs::{self, File},
    io::{BufWriter, Write as _},
    path::Path,
};

use anyhow::{Context, ensure};
use glam::DAffine3;

use crate::export::{geometry::affine, parallel::Threads, set::Set, writing::writing};

/// Writes `SCENE/LIDAR/000041.ply` for each measurement, and `SCENE/LIDAR.log`.
pub(crate) fn write(set: &Set, root: &Path, threads: Threads) -> anyhow::Result<()> {
    let mut logs = Vec::new();
    for scene in set.scenes() {
        ensure!(scene.lidars().next().is_some(), "{} has no lidar, which PLY needs", scene.name);
        let mut of_scene = Vec::new();
        for (sensor, _) in scene.lidars() {
            let folder = root.join(&scene.name).join(&sensor.name);
            fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
            let path = root.join(&scene.name).join(format!("{}.log", sensor.name));
            let log = File::create(&path).with_context(|| path.display().to_string())?;
            of_scene.push((&sensor.name, BufWriter::new(log)));
        }
        logs.push(of_scene);
    }
    let convert = |index: usize| {
        let frame = set.frame(index)?;
        for (sensor, _) in frame.lidars() {
            let cloud = cloud(&frame.points(sensor)?, &frame.labels(sensor)?);
            let folder = root.join(&frame.scene.name).join(&sensor.name);
            let path = folder.join(format!("{:06}.ply", frame.line.frame));
            writing(|| fs::write(&path, cloud)).with_context(|| path.display().to_string())?;
        }
        Ok(frame.line)
    };
    threads.in_order(set.frames(), convert, |index, line| {
        let (scene, _) = set.place(index);
        for (name, log) in &mut logs[scene] {
            if let Some(pose) = line.sensors.iter().find(|pose| pose.name == **name) {
                write_pose(log, line.frame, &affine(&pose.world_from_sensor))?;
            }
        }
        Ok(())
    })?;
    for (_, mut log) in logs.into_iter().flatten() {
        log.flush().with_context(|| root.display().to_string())?;
    }
    Ok(())
}

/// Size of a point in a file.
const POINT_BYTES: usize = 21;

/// Returns a binary PLY file of returns: 16 bytes each of `points`, 8 bytes of `labels`.
fn cloud(points: &[u8], labels: &[u8]) -> Vec<u8> {
    let count = points.len() / 16;
    let head = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres, sensor space: x forward, y left, z up\n\
         element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         property float intensity\nproperty int instance\nproperty uchar tag\nend_header\n"
    );
    let mut file = Vec::with_capacity(head.len() + count * POINT_BYTES);
    file.extend_from_slice(head.as_bytes());
    for (point, label) in points.chunks_exact(16).zip(labels.chunks_exact(8)) {
        file.extend_from_slice(point);
        // Open3D knows no 32-bit unsigned numbers; ids have 24 bits, and tags 8.
        file.extend_from_slice(&label[..5]);
    }
    file
}

/// Appends a pose as Open3D's `read_pinhole_camera_trajectory` reads it: three integers, of which the first
/// is the frame, and the rows of the matrix from sensor to world space.
fn write_pose(
    log: &mut impl std::io::Write,
    frame: u64,
    world_from_sensor: &DAffine3,
) -> std::io::Result<()> {
    writeln!(log, "{frame} {frame} {}", frame + 1)?;
    let columns = world_from_sensor.matrix3.transpose().to_cols_array_2d();
    let position = world_from_sensor.translation.to_array();
    for ([x, y, z], at) in columns.into_iter().zip(position) {
        writeln!(log, "{x:.10} {y:.10} {z:.10} {at:.6}")?;
    }
    writeln!(log, "0 0 0 1")
}
