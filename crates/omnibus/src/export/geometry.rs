//! Transforms of a plain data set in double precision.

use anyhow::ensure;
use glam::{DAffine3, DMat4, DQuat, DVec3};

use crate::collect::format::{Camera, Matrix4, Sensor, Transform};

/// Returns a transform; its quaternion gets length 1.
pub(crate) fn affine(transform: &Transform) -> DAffine3 {
    let rotation = DQuat::from_array(transform.rotation_xyzw.map(f64::from)).normalize();
    DAffine3::from_rotation_translation(
        rotation,
        DVec3::from_array(transform.position_m.map(f64::from)),
    )
}

/// Returns a transform that is given by rows.
pub(crate) fn affine_of_rows(rows: &Matrix4) -> DAffine3 {
    DAffine3::from_mat4(DMat4::from_cols_array_2d(rows).transpose())
}

/// Returns position and rotation of a rigid transform.
pub(crate) fn parts(transform: &DAffine3) -> (DVec3, DQuat) {
    (transform.translation, DQuat::from_mat3(&transform.matrix3).normalize())
}

/// Returns intrinsics for pixels whose centres have whole coordinates: KITTI, nuScenes and OpenCV
/// count so, where a plain data set has (0, 0) at the corner of the first pixel.
pub(crate) fn intrinsics_of_centres(intrinsics_px: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut shifted = *intrinsics_px;
    shifted[0][2] -= 0.5;
    shifted[1][2] -= 0.5;
    shifted
}

/// Refuses a camera with a lens for a format whose calibrations are those of rectified images.
pub(crate) fn without_lens(
    format: &str,
    scene: &str,
    sensor: &Sensor,
    camera: &Camera,
) -> anyhow::Result<()> {
    ensure!(
        camera.lens.is_none(),
        "{scene}: camera {} has a lens, but calibrations of {format} have no distortion; export to mcap, \
         coco, yolo or webdataset, or collect with a camera without lens",
        sensor.name
    );
    Ok(())
}
