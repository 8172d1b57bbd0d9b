//! The grid of rays of a radar at one frame.

use glam::Vec3;
use protocol::Plane;

/// What a frame shows to a radar.
#[derive(Clone, Copy, Debug)]
pub struct RadarRays<'a> {
    /// The plane of the points, for its size and pose.
    pub plane: &'a Plane,
    /// Horizontal and vertical field of view, as of the [`Radar`](crate::Radar).
    pub fov_rad: [f32; 2],
    /// Points of the grid.
    pub points: &'a [[f32; 4]],
    /// Instance and tag of each.
    pub labels: &'a [[u32; 2]],
}

impl RadarRays<'_> {
    /// Returns where the ray nearest to a direction ended; `None` outside of the field of view and where
    /// it met nothing.
    pub(crate) fn nearest(&self, direction: Vec3) -> Option<Vec3> {
        let azimuth = direction.y.atan2(direction.x);
        let elevation = direction.z.clamp(-1.0, 1.0).asin();
        let [across, up] = [azimuth / self.fov_rad[0], elevation / self.fov_rad[1]];
        if across.abs() > 0.5 || up.abs() > 0.5 {
            return None;
        }
        let [columns, rows] = [self.plane.width, self.plane.height];
        let column = ((across + 0.5) * columns as f32) as u32;
        let row = ((0.5 - up) * (rows.max(2) - 1) as f32).round() as u32;
        let ray = column.min(columns.saturating_sub(1)) * rows + row;
        let [x, y, z, _] = *self.points.get(ray as usize)?;
        Some(Vec3::new(x, y, z)).filter(|at| *at != Vec3::ZERO)
    }
}
