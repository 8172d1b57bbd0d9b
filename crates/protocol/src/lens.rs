//! The lens of a camera.

use bytemuck::{Pod, Zeroable};

/// Values of [`LensSpec::model`].
pub mod lens_model {
    /// A pinhole.
    pub const PINHOLE: u32 = 0;
    /// Radial and tangential distortion: D. C. Brown, *Close-range camera calibration*,
    /// Photogrammetric Engineering, 1971; coefficients k1, k2, p1, p2, k3 as in OpenCV's `calib3d`.
    pub const BROWN_CONRADY: u32 = 1;
    /// A fisheye: J. Kannala and S. Brandt, *A Generic Camera Model and Calibration Method for
    /// Conventional, Wide-Angle, and Fish-Eye Lenses*, PAMI 2006; coefficients k1 to k4 as in OpenCV's
    /// `fisheye`.
    pub const FISHEYE: u32 = 2;
}

/// The lens of a camera; all 0 is a pinhole with the field of view of its
/// [`crate::SensorSpec::fov_rad`]. [`crate::Projection`] has the formulas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LensSpec {
    /// One of [`lens_model`].
    pub model: u32,
    /// Focal lengths along the rows and the columns of the image, pixels. Both 0: pixels are square, the
    /// field of view gives the focal length, and the principal point is the middle of the image.
    pub focal_px: [f32; 2],
    /// Column and row of the principal point, pixels; the centre of pixel (0, 0) lies at (0.5, 0.5).
    pub center_px: [f32; 2],
    /// Coefficients of the model, in its order; the others are 0.
    pub coefficients: [f32; 5],
    /// Fisheye: largest angle between a ray and the optical axis; the image is black beyond. 0: as far as
    /// the formula holds, at most π.
    pub max_angle_rad: f32,
    /// Reserved; 0.
    pub reserved: [u32; 3],
}

const _: () = assert!(size_of::<LensSpec>() == 56);

impl LensSpec {
    /// Returns whether the focal lengths and the principal point are given, instead of a field of view.
    pub fn has_intrinsics(&self) -> bool {
        self.focal_px != [0.0; 2]
    }

    /// Checks the range of each number of a camera of this size; the error names the first that is out of
    /// range.
    pub(crate) fn check(&self, size: [u32; 2], fov_rad: f32) -> Result<(), String> {
        let in_range = |what: &str, value: f32, low: f32, high: f32| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(format!("{what} is {value}, not {low} to {high}"))
            }
        };
        let (names, fov_max_rad): (&[&str], f32) = match self.model {
            lens_model::PINHOLE => (&[], 3.1),
            lens_model::BROWN_CONRADY => (&["k1", "k2", "p1", "p2", "k3"], 3.1),
            lens_model::FISHEYE => (&["k1", "k2", "k3", "k4"], 6.283_186),
            other => {
                return Err(format!(
                    "lens model is {other}, not 0 (pinhole), 1 (Brown-Conrady) or 2 (fisheye)"
                ));
            }
        };
        if self.has_intrinsics() {
            for (what, focal) in ["fx", "fy"].into_iter().zip(self.focal_px) {
                in_range(what, focal, 0.1, 1e6)?;
            }
            for ((what, center), size) in ["cx", "cy"].into_iter().zip(self.center_px).zip(size) {
                in_range(what, center, -(size as f32), 2.0 * size as f32)?;
            }
        } else {
            in_range("fov_rad", fov_rad, 0.01, fov_max_rad)?;
            if self.center_px != [0.0; 2] {
                let [cx, cy] = self.center_px;
                return Err(format!(
                    "cx and cy are {cx} and {cy}, but fx and fy are 0; give all four or none"
                ));
            }
        }
        for (index, coefficient) in self.coefficients.into_iter().enumerate() {
            match names.get(index) {
                Some(name) => in_range(name, coefficient, -100.0, 100.0)?,
                None if coefficient == 0.0 => {}
                None => {
                    return Err(format!(
                        "coefficient {} of the lens is {coefficient}, but lens model {} has only {}",
                        index + 1,
                        self.model,
                        names.len()
                    ));
                }
            }
        }
        let angle_max_rad =
            if self.model == lens_model::FISHEYE { std::f32::consts::PI } else { 0.0 };
        in_range("max_angle_rad", self.max_angle_rad, 0.0, angle_max_rad)
    }
}
