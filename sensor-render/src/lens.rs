use glam::{DVec2, DVec3, Vec3};
use protocol::Projection;

/// Lens of a camera as tracers use it: [`Projection`] in single precision. The shaders read the same
/// numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    pub(crate) is_fisheye: bool,
    /// Focal lengths along the rows and the columns. Pixels.
    pub(crate) focal: [f32; 2],
    pub(crate) coefficients: [f32; 5],
    /// Largest undistorted radius: of a fisheye an angle, else a tangent.
    pub(crate) radius_max: f32,
    /// Distorted radius there, as a multiple of the focal length.
    pub(crate) image_radius_max: f32,
    projection: Projection,
}

impl Lens {
    pub(crate) fn new(projection: Projection) -> Lens {
        let [radius_max, image_radius_max] = projection.radius_limits().map(|limit| limit as f32);
        Lens {
            is_fisheye: projection.has_unit_rays(),
            focal: projection.focal_px().map(|focal| focal as f32),
            coefficients: projection.coefficients().map(|coefficient| coefficient as f32),
            radius_max,
            image_radius_max,
            projection,
        }
    }

    /// Returns the ray through the centre of a pixel in optical space; `None` where the lens shows nothing.
    pub(crate) fn ray(&self, x: u32, y: u32) -> Option<Vec3> {
        let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        Some(self.projection.optical_ray(pixel)?.as_vec3())
    }

    /// Projects a point in optical space; returns column and row in pixels from the centre of pixel
    /// (0, 0). `None` where the lens shows nothing.
    pub(crate) fn project(&self, optical: DVec3) -> Option<[f32; 2]> {
        let pixel = self.projection.optical_pixel(optical)? - 0.5;
        Some(pixel.to_array().map(|pixel| pixel as f32))
    }
}
