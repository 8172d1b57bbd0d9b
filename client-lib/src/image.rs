//! Typed views of what a camera or lidar measured, in the renderer's own memory.

use glam::{Vec2, Vec3};
use protocol::{Plane, Pose, Projection, SensorSpec, output, sensor};

use crate::Measurement;

/// The pinhole projection of a camera; [`Projection`] includes its lens. Optical space is x right, y
/// down, z forward; pixel (0, 0) is at the top left and its centre lies at (0.5, 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Intrinsics {
    /// Focal length along the image's rows, pixels.
    pub fx: f32,
    /// Focal length along the image's columns, pixels.
    pub fy: f32,
    /// Column of the principal point, pixels.
    pub cx: f32,
    /// Row of the principal point, pixels.
    pub cy: f32,
}

impl Intrinsics {
    /// Returns focal lengths and a principal point, pixels. Calibrations by OpenCV and ROS count from the
    /// centre of pixel (0, 0): add 0.5 to their principal point.
    #[must_use]
    pub fn new([fx, fy]: [f32; 2], [cx, cy]: [f32; 2]) -> Intrinsics {
        Intrinsics { fx, fy, cx, cy }
    }

    /// Of an image whose horizontal field of view is `fov_rad`; pixels are square.
    #[must_use]
    pub fn from_fov(width: u32, height: u32, fov_rad: f32) -> Intrinsics {
        let focal = width as f32 / (2.0 * (fov_rad * 0.5).tan());
        Intrinsics { fx: focal, fy: focal, cx: width as f32 / 2.0, cy: height as f32 / 2.0 }
    }

    /// Projects a point in sensor space (x forward, y left, z up) to a pixel; `None` behind the
    /// camera.
    #[must_use]
    pub fn project(&self, point_in_sensor: Vec3) -> Option<Vec2> {
        let Vec3 { x, y, z } = point_in_sensor;
        (x > 0.0).then(|| Vec2::new(self.cx - self.fx * y / x, self.cy - self.fy * z / x))
    }

    /// Returns the point in sensor space (x forward, y left, z up) that a pixel shows at `depth_m`
    /// along the optical axis.
    #[must_use]
    pub fn unproject(&self, pixel: Vec2, depth_m: f32) -> Vec3 {
        let y = (self.cx - pixel.x) / self.fx * depth_m;
        let z = (self.cy - pixel.y) / self.fy * depth_m;
        Vec3::new(depth_m, y, z)
    }
}

/// One output of one camera at one frame.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Image<'a, T> {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Focal lengths and principal point.
    pub intrinsics: Intrinsics,
    /// The projection, with the lens.
    pub projection: Projection,
    /// The camera's pose at the measured frame.
    pub world_from_sensor: Pose,
    /// Pixels, row by row from the top left.
    pub data: &'a [T],
}

impl<'a, T> Image<'a, T> {
    /// One pixel; `None` outside the image.
    #[must_use]
    pub fn pixel(&self, column: u32, row: u32) -> Option<&'a T> {
        let index = row as usize * self.width as usize + column as usize;
        if column < self.width { self.data.get(index) } else { None }
    }

    /// The rows from the top.
    pub fn rows(&self) -> impl Iterator<Item = &'a [T]> + use<'a, T> {
        self.data.chunks_exact(self.width.max(1) as usize)
    }
}

/// The rays of one lidar at one frame.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct PointCloud<'a> {
    /// Azimuth steps.
    pub columns: u32,
    /// Rays of each step, from the highest elevation down.
    pub channels: u32,
    /// Azimuth of column 0, positive to the left.
    pub first_azimuth_rad: f32,
    /// The lidar's pose at the measured frame.
    pub world_from_sensor: Pose,
    /// x, y, z in sensor space (metres) and the [`PointAttribute`](crate::PointAttribute) (0 to 1;
    /// the intensity by default) of each ray, column by column and in
    /// each column from the highest channel down; all zeros where nothing was hit.
    pub points: &'a [[f32; 4]],
    /// Instance and semantic tag of each ray; empty if labels were not requested.
    pub labels: &'a [[u32; 2]],
}

impl<'a> PointCloud<'a> {
    /// The points that were hit, in sensor space (metres), with their
    /// [`PointAttribute`](crate::PointAttribute), 0 to 1.
    pub fn hits(&self) -> impl Iterator<Item = (Vec3, f32)> + use<'a> {
        let points = self.points.iter().filter(|point| **point != [0.0; 4]);
        points.map(|[x, y, z, intensity]| (Vec3::new(*x, *y, *z), *intensity))
    }
}

impl Measurement {
    /// The image of red, green, blue, 255 that camera `sensor` (its index in the bundle) gave;
    /// `None` if it rested at this frame or has no such output.
    #[must_use]
    pub fn color_image(&self, sensor: usize) -> Option<Image<'_, [u8; 4]>> {
        self.image(sensor, output::COLOR)
    }

    /// The image of metres along the optical axis, of a fisheye from the camera; see [`Measurement::color_image`].
    #[must_use]
    pub fn depth_image(&self, sensor: usize) -> Option<Image<'_, f32>> {
        self.image(sensor, output::DEPTH)
    }

    /// The image of semantic tags; see [`Measurement::color_image`].
    #[must_use]
    pub fn tag_image(&self, sensor: usize) -> Option<Image<'_, u8>> {
        self.image(sensor, output::TAG)
    }

    /// The image of actors and static objects; see [`Measurement::color_image`].
    #[must_use]
    pub fn instance_image(&self, sensor: usize) -> Option<Image<'_, u32>> {
        self.image(sensor, output::INSTANCE)
    }

    /// The image of surface normals in sensor space; see [`Measurement::color_image`].
    #[must_use]
    pub fn normal_image(&self, sensor: usize) -> Option<Image<'_, [f32; 3]>> {
        self.image(sensor, output::NORMAL)
    }

    /// The image of motion since the frame before, in pixels to the right and down; see
    /// [`Measurement::color_image`].
    #[must_use]
    pub fn flow_image(&self, sensor: usize) -> Option<Image<'_, [f32; 2]>> {
        self.image(sensor, output::FLOW)
    }

    /// The rays of lidar `sensor` (its index in the bundle); `None` if it rested at this frame.
    #[must_use]
    pub fn point_cloud(&self, sensor: usize) -> Option<PointCloud<'_>> {
        let plane = self.plane(sensor, output::POINTS)?;
        Some(cloud(plane, self.points(sensor)?, self.labels(sensor)))
    }

    /// The last returns of lidar `sensor`, as [`Measurement::last_points`].
    #[must_use]
    pub fn last_point_cloud(&self, sensor: usize) -> Option<PointCloud<'_>> {
        let plane = self.plane(sensor, output::LAST_POINTS)?;
        Some(cloud(plane, self.last_points(sensor)?, self.last_labels(sensor)))
    }

    fn image<T: bytemuck::Pod>(&self, sensor: usize, output: u32) -> Option<Image<'_, T>> {
        let Plane { width, height, world_from_sensor, .. } = *self.plane(sensor, output)?;
        let spec = self.sensors().get(sensor).filter(|spec| is_camera(spec))?;
        let projection = Projection::of(spec).ok()?;
        let [focal_px, center_px] = [projection.focal_px(), projection.center_px()];
        let [focal_px, center_px] = [focal_px, center_px].map(|pair| pair.map(|px| px as f32));
        let intrinsics = Intrinsics::new(focal_px, center_px);
        let data = bytemuck::cast_slice(self.data(sensor, output)?);
        Some(Image { width, height, intrinsics, projection, world_from_sensor, data })
    }
}

fn cloud<'a>(
    plane: &Plane,
    points: &'a [[f32; 4]],
    labels: Option<&'a [[u32; 2]]>,
) -> PointCloud<'a> {
    PointCloud {
        columns: plane.width,
        channels: plane.height,
        first_azimuth_rad: plane.first_azimuth_rad,
        world_from_sensor: plane.world_from_sensor,
        points,
        labels: labels.unwrap_or_default(),
    }
}

fn is_camera(spec: &SensorSpec) -> bool {
    spec.kind == sensor::CAMERA
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projected_point_comes_back() {
        let intrinsics = Intrinsics::from_fov(640, 480, 1.5);
        let point = Vec3::new(10.0, 2.0, -1.0);
        let pixel = intrinsics.project(point).unwrap();
        assert!(pixel.x < 320.0 && pixel.y > 240.0, "left of and below the centre: {pixel}");
        assert!(intrinsics.unproject(pixel, 10.0).abs_diff_eq(point, 1e-4));
        assert_eq!(intrinsics.project(Vec3::NEG_X), None);
    }
}
