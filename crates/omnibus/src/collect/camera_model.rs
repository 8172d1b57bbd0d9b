//! The projection of a camera, for what is drawn into its images.

use glam::{DVec2, DVec3, Vec3A};
use protocol::{LensSpec, Projection, SensorSpec, lens_model};

use crate::collect::format::{Camera, LensName};

/// A camera: optical space is x right, y down, z forward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraModel {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Focal length along the columns of the image.
    pub(crate) focal_px: f32,
    pub(crate) projection: Projection,
    /// Focal lengths and principal point of a pinhole.
    pinhole: Option<[[f32; 2]; 2]>,
}

/// The least depth that a pinhole projects, in metres.
pub(crate) const NEAR_M: f32 = 0.05;

impl CameraModel {
    /// Returns the projection of a camera that [`Projection::check`] has accepted.
    pub(crate) fn of(spec: &SensorSpec) -> CameraModel {
        let projection = Projection::of(spec).expect("the lens was checked with its plan");
        CameraModel::new([spec.width, spec.height], projection)
    }

    /// Returns the projection of a camera of `metadata.json`; the error says what is wrong with it.
    pub(crate) fn of_metadata(camera: &Camera) -> Result<CameraModel, String> {
        let [[fx, _, cx], [_, fy, cy], _] = camera.intrinsics_px;
        let mut lens = LensSpec {
            focal_px: [fx, fy].map(|px| px as f32),
            center_px: [cx, cy].map(|px| px as f32),
            ..LensSpec::default()
        };
        if let Some(given) = &camera.lens {
            lens.model = match given.model {
                LensName::BrownConrady => lens_model::BROWN_CONRADY,
                LensName::Fisheye => lens_model::FISHEYE,
            };
            for (coefficient, given) in lens.coefficients.iter_mut().zip(&given.coefficients) {
                *coefficient = *given as f32;
            }
            lens.max_angle_rad = given.max_angle_rad.unwrap_or(0.0) as f32;
        }
        let size = [camera.width_px, camera.height_px];
        Ok(CameraModel::new(size, Projection::new(&lens, size, 0.0)?))
    }

    fn new([width, height]: [u32; 2], projection: Projection) -> CameraModel {
        let pair = |pair: [f64; 2]| pair.map(|px| px as f32);
        let (focal_px, center_px) = (pair(projection.focal_px()), pair(projection.center_px()));
        let is_pinhole = projection.model() == lens_model::PINHOLE;
        CameraModel {
            width,
            height,
            focal_px: focal_px[1],
            projection,
            pinhole: is_pinhole.then_some([focal_px, center_px]),
        }
    }

    /// Returns whether straight lines are straight in the image.
    pub(crate) fn is_pinhole(&self) -> bool {
        self.pinhole.is_some()
    }

    /// Returns the pixel of a point, which may lie outside of the image; `None` nearer than [`NEAR_M`], and
    /// where the lens shows nothing.
    #[inline]
    pub(crate) fn project(&self, optical: Vec3A) -> Option<[f32; 2]> {
        if self.depth(optical) < NEAR_M {
            return None;
        }
        if let Some([[fx, fy], [cx, cy]]) = self.pinhole {
            return Some([cx + optical.x * (fx / optical.z), cy + optical.y * (fy / optical.z)]);
        }
        let [x, y, z] = optical.to_array().map(f64::from);
        let pixel = self.projection.optical_pixel(DVec3::new(x, y, z))?;
        Some(pixel.to_array().map(|px| px as f32))
    }

    /// Returns the depth of a point as depth images have it.
    #[inline]
    pub(crate) fn depth(&self, optical: Vec3A) -> f32 {
        if self.projection.has_unit_rays() { optical.length() } else { optical.z }
    }

    /// Returns the slopes of the edges of a pinhole's image: left, top, right, bottom.
    pub(crate) fn pinhole_edges(&self) -> Option<[f32; 4]> {
        let [[fx, fy], [cx, cy]] = self.pinhole?;
        let [width, height] = [self.width as f32, self.height as f32];
        Some([-cx / fx, -cy / fy, (width - cx) / fx, (height - cy) / fy])
    }

    /// Returns the angle between the left and the right edge of the image, in the row of the principal
    /// point; what the lens does not show does not count.
    pub(crate) fn horizontal_fov_rad(&self) -> f64 {
        let row = self.projection.center_px()[1];
        let from_axis = |column: f64| match self.projection.optical_ray(DVec2::new(column, row)) {
            Some(ray) => ray.x.abs().atan2(ray.z),
            None => self.projection.angle_max_rad(),
        };
        from_axis(0.0) + from_axis(self.width.into())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    fn model(lens: LensSpec) -> CameraModel {
        let size = [200, 100];
        CameraModel::new(size, Projection::new(&lens, size, 0.0).unwrap())
    }

    /// A pinhole of 200 × 100 pixels, 100 pixels a radian.
    pub(crate) fn pinhole() -> CameraModel {
        model(LensSpec { focal_px: [100.0; 2], center_px: [100.0, 50.0], ..LensSpec::default() })
    }

    /// A fisheye of 200 × 100 pixels, 60 pixels a radian, that sees up to 95 degrees from its axis.
    pub(crate) fn fisheye() -> CameraModel {
        model(LensSpec {
            model: lens_model::FISHEYE,
            focal_px: [60.0; 2],
            center_px: [100.0, 50.0],
            max_angle_rad: 1.658,
            ..LensSpec::default()
        })
    }
}
