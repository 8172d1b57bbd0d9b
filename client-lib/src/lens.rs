//! The lens of a camera.

use protocol::{LensSpec, lens_model};

/// Lens of a camera. [`Projection`](crate::Projection) has the formulas; the coefficients are those of
/// OpenCV's `calib3d` and `fisheye`, in their order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Lens {
    /// A pinhole.
    #[default]
    Pinhole,
    /// Radial and tangential distortion (Brown 1971).
    BrownConrady {
        /// Radial distortion, second power.
        k1: f32,
        /// Radial distortion, fourth power.
        k2: f32,
        /// Tangential distortion.
        p1: f32,
        /// Tangential distortion.
        p2: f32,
        /// Radial distortion, sixth power.
        k3: f32,
    },
    /// A fisheye (Kannala and Brandt 2006), up to more than 180°. Depth is the distance from the camera.
    Fisheye {
        /// Distortion: powers 2, 4, 6 and 8 of the angle between ray and optical axis.
        k: [f32; 4],
        /// Largest angle between ray and optical axis, radians, at most π; the image is black beyond.
        /// `None`: as far as the formula holds.
        max_angle_rad: Option<f32>,
    },
}

impl Lens {
    /// Returns the lens in the protocol's layout, without intrinsics.
    pub(crate) fn wire(&self) -> LensSpec {
        match *self {
            Lens::Pinhole => LensSpec::default(),
            Lens::BrownConrady { k1, k2, p1, p2, k3 } => LensSpec {
                model: lens_model::BROWN_CONRADY,
                coefficients: [k1, k2, p1, p2, k3],
                ..LensSpec::default()
            },
            Lens::Fisheye { k: [k1, k2, k3, k4], max_angle_rad } => LensSpec {
                model: lens_model::FISHEYE,
                coefficients: [k1, k2, k3, k4, 0.0],
                max_angle_rad: max_angle_rad.unwrap_or(0.0),
                ..LensSpec::default()
            },
        }
    }
}
