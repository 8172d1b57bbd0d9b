//! The files of nuScenes' radars.

use std::io::Write as _;

use glam::{DVec3, Vec3};

use crate::{
    collect::{CollectError, decode, format::Sensor},
    export::{geometry::affine, set::Frame},
};

/// Slower detections have the dynamic property \"stationary\". Metres per second.
const MOVING_FROM_MPS: f32 = 0.2;

/// The head of a file up to the number of detections: the fields of nuScenes, in its order.
const HEAD: &str = "# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS x y z dyn_prop id rcs vx vy vx_comp vy_comp is_quality_valid ambig_state x_rms y_rms \
                    invalid_state pdh0 vx_rms vy_rms
SIZE 4 4 4 1 2 4 4 4 4 4 1 1 1 1 1 1 1 1
TYPE F F F I I F F F F F I I I I I I I I
COUNT 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1
";

/// Returns the file of a radar.
pub(crate) fn file(frame: &Frame, sensor: &Sensor) -> Result<Vec<u8>, CollectError> {
    let rows = decode::floats(&frame.detections(sensor)?);
    let has_powers = sensor.radar.as_ref().is_some_and(|radar| radar.receiver.is_some());
    let powers = if has_powers { decode::floats(&frame.powers(sensor)?) } else { Vec::new() };
    let pose = frame.line.sensors.iter().find(|pose| pose.name == sensor.name);
    let velocity = DVec3::from_array(frame.line.ego.velocity_mps.map(f64::from));
    let own = pose.map_or(DVec3::ZERO, |pose| {
        affine(&pose.world_from_sensor).inverse().transform_vector3(velocity)
    });
    Ok(pcd(&rows, &powers, own.as_vec3()))
}

/// Returns the file of detections: range rate, azimuth, altitude, distance. `powers` are power, ratio of
/// signal to noise and cross-section of each, or empty. `own` is the velocity of the radar in its own
/// space, which the compensated velocities do not include.
fn pcd(rows: &[f32], powers: &[f32], own: Vec3) -> Vec<u8> {
    // The devkit takes a first point that is not a number for an empty cloud, and no points for an error.
    let count = (rows.len() / 4).max(1);
    let mut file = HEAD.as_bytes().to_vec();
    let _ = write!(
        file,
        "WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    );
    if rows.is_empty() {
        put(&mut file, Vec3::NAN, 0, 0, [0.0; 5]);
    }
    for (id, row) in (0..).zip(rows.chunks_exact(4)) {
        let (rate, azimuth, altitude, depth_m) = (row[0], row[1], row[2], row[3]);
        let level = altitude.cos();
        let to = Vec3::new(azimuth.cos() * level, azimuth.sin() * level, altitude.sin());
        // A radar measures the part of a velocity along the ray.
        let [relative, absolute] = [rate, rate + own.dot(to)].map(|rate| to * rate);
        let stationary = u8::from((rate + own.dot(to)).abs() < MOVING_FROM_MPS);
        let cross_section_dbsm = powers.get(id as usize * 3 + 2).copied().unwrap_or(0.0);
        put(
            &mut file,
            to * depth_m,
            stationary,
            id,
            [cross_section_dbsm, relative.x, relative.y, absolute.x, absolute.y],
        );
    }
    // The devkit takes a file that ends with its last detection for one that was cut off.
    file.push(b'\n');
    file
}

/// Appends a detection: its position, whether it is stationary, its cross-section and its velocities.
fn put(file: &mut Vec<u8>, at: Vec3, stationary: u8, id: i16, numbers: [f32; 5]) {
    file.extend(at.to_array().iter().flat_map(|v| v.to_le_bytes()));
    file.push(stationary);
    file.extend(id.to_le_bytes());
    file.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    // Valid, unambiguous, a false alarm with less than 25 %, without known errors.
    let [is_quality_valid, ambig_state, invalid_state, pdh0] = [1, 3, 0, 1];
    file.extend([is_quality_valid, ambig_state, 0, 0, invalid_state, pdh0, 0, 0]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_detection_has_the_fields_of_nuscenes() {
        // A wall at rest, 20 m away at 60 degrees to the left, seen from a car at 10 m/s.
        let rows = [-5.0, 60.0f32.to_radians(), 0.0, 20.0];
        let file = pcd(&rows, &[], Vec3::X * 10.0);
        let text = b"DATA binary\n";
        let body = file.windows(text.len()).position(|part| part == text).unwrap() + text.len();
        let head = std::str::from_utf8(&file[..body]).unwrap();
        assert!(head.contains("\nWIDTH 1\n") && head.contains("\nPOINTS 1\n"), "{head}");
        let fields = head.lines().find(|line| line.starts_with("FIELDS")).unwrap();
        assert_eq!(fields.split_whitespace().count(), 19, "{fields}");
        let row = &file[body..file.len() - 1];
        assert_eq!(row.len(), 43);
        let float = |at: usize| f32::from_le_bytes(row[at..at + 4].try_into().unwrap());
        let near = |at: usize, wanted: f32| {
            assert!((float(at) - wanted).abs() < 1e-4, "{at}: {} {wanted}", float(at));
        };
        near(0, 10.0);
        near(4, 20.0 * 0.75f32.sqrt());
        near(8, 0.0);
        assert_eq!((row[12], &row[13..15]), (1, &[0, 0][..]), "stationary");
        near(19, -2.5);
        near(23, -5.0 * 0.75f32.sqrt());
        near(27, 0.0);
        near(31, 0.0);
        assert_eq!(row[35..], [1, 3, 0, 0, 0, 1, 0, 0]);
        let empty = pcd(&[], &[], Vec3::ZERO);
        assert_eq!(empty.len(), body + 44);
        assert!(f32::from_le_bytes(empty[body..body + 4].try_into().unwrap()).is_nan());
    }
}
