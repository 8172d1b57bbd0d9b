//! The projection of a camera: from points to pixels and back.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::{LensSpec, SensorSpec, lens_model};

/// Newton's steps from a pixel to its ray. Tracers take as many.
pub const LENS_STEPS: usize = 10;

/// Largest undistorted radius of a Brown-Conrady lens: the tangent of 89 degrees.
const RADIUS_MAX: f64 = 57.3;

/// The projection of a camera.
///
/// Optical space is x right, y down, z forward; pixel (0, 0) is at the top left and its centre lies at
/// (0.5, 0.5). With the focal lengths fx and fy and the principal point (cx, cy), in pixels,
///
/// ```text
/// u = cx + fx x″    v = cy + fy y″
///
/// pinhole:        x″ = x / z                                        and likewise y″
/// Brown-Conrady:  x′ = x / z,  y′ = y / z,  r² = x′² + y′²
///                 x″ = x′ (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x′ y′ + p2 (r² + 2 x′²)
///                 y″ = y′ (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y′²) + 2 p2 x′ y′
/// fisheye:        θ = atan2(√(x² + y²), z)
///                 x″ = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) x / √(x² + y²)
/// ```
///
/// The sources are named at [`lens_model`]. A lens gives an image up to the radius at which its
/// polynomial stops rising; beyond it, one pixel would show two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    model: u32,
    focal_px: DVec2,
    center_px: DVec2,
    coefficients: [f64; 5],
    /// Largest undistorted radius: of a fisheye an angle, else a tangent.
    radius_max: f64,
    /// The distorted radius there, as a multiple of the focal length.
    image_radius_max: f64,
    /// Whether `radius_max` is where the polynomial stops rising.
    folds: bool,
}

impl Projection {
    /// Returns the projection of a camera.
    ///
    /// # Errors
    ///
    /// A number of the lens is out of range, or its polynomial falls inside of the image.
    pub fn of(spec: &SensorSpec) -> Result<Projection, String> {
        Projection::new(&spec.lens, [spec.width, spec.height], spec.fov_rad)
    }

    /// Returns the projection of a lens for an image of this size; see [`Projection::of`].
    pub fn new(lens: &LensSpec, size: [u32; 2], fov_rad: f32) -> Result<Projection, String> {
        lens.check(size, fov_rad)?;
        let size_px = DVec2::from_array(size.map(f64::from));
        let mut found = Projection {
            model: lens.model,
            focal_px: DVec2::from_array(lens.focal_px.map(f64::from)),
            center_px: DVec2::from_array(lens.center_px.map(f64::from)),
            coefficients: lens.coefficients.map(f64::from),
            radius_max: f64::INFINITY,
            image_radius_max: f64::INFINITY,
            folds: false,
        };
        if lens.model != lens_model::PINHOLE {
            found.limit(f64::from(lens.max_angle_rad));
        }
        if !lens.has_intrinsics() {
            let half = f64::from(fov_rad) * 0.5;
            let radius = if lens.model == lens_model::FISHEYE { half } else { half.tan() };
            if found.folds && radius > found.radius_max {
                return Err(format!(
                    "its polynomial falls from {:.3} rad from the optical axis on, inside of the field of \
                     view of {half:.3} rad to each side; check the order of the coefficients",
                    found.angle_max_rad(),
                ));
            }
            found.focal_px = DVec2::splat(size_px.x * 0.5 / found.image_radius(radius));
            found.center_px = size_px * 0.5;
        }
        Ok(found)
    }

    /// Checks the lens of a camera beyond [`Projection::of`]: inside of the circle around the principal
    /// point that meets the nearest edge of the image, every pixel has its own ray.
    pub fn check(spec: &SensorSpec) -> Result<(), String> {
        const GRID: u32 = 32;
        let found = Projection::of(spec)?;
        if found.model == lens_model::PINHOLE {
            return Ok(());
        }
        let size = DVec2::from_array([spec.width, spec.height].map(f64::from));
        let edges = found.center_px.min(size - found.center_px);
        let nearest_px = edges.min_element();
        let shown_px = found.image_radius_max * found.focal_px.min_element();
        if found.folds && shown_px < nearest_px {
            return Err(format!(
                "its polynomial falls from {:.3} rad from the optical axis on, {shown_px:.1} pixels from the \
                 principal point, but the nearest edge of the image is {nearest_px:.1} pixels away; check \
                 the order of the coefficients{}",
                found.angle_max_rad(),
                if found.model == lens_model::FISHEYE {
                    ", or give a smaller max_angle_rad"
                } else {
                    ""
                }
            ));
        }
        let is_within = |pixel: &DVec2| {
            pixel.distance(found.center_px) <= nearest_px
                && ((*pixel - found.center_px) / found.focal_px).length()
                    < 0.98 * found.image_radius_max
        };
        let pixels = (0..=GRID * (GRID + 2)).map(|at| {
            let at = DVec2::new(f64::from(at % (GRID + 1)), f64::from(at / (GRID + 1)));
            size * at / f64::from(GRID)
        });
        for pixel in pixels.filter(is_within) {
            let back = found.optical_ray(pixel).and_then(|ray| found.optical_pixel(ray));
            if back.is_none_or(|back| back.distance(pixel) > 0.1) {
                return Err(format!(
                    "it has no single ray for pixel ({:.0}, {:.0}): its distortion is too large there; \
                     check the order of the coefficients",
                    pixel.x, pixel.y
                ));
            }
        }
        Ok(())
    }

    /// Returns one of [`lens_model`].
    pub fn model(&self) -> u32 {
        self.model
    }

    /// Returns the focal lengths along the rows and the columns of the image, pixels.
    pub fn focal_px(&self) -> [f64; 2] {
        self.focal_px.to_array()
    }

    /// Returns column and row of the principal point, pixels.
    pub fn center_px(&self) -> [f64; 2] {
        self.center_px.to_array()
    }

    /// Returns the coefficients of the model.
    pub fn coefficients(&self) -> [f64; 5] {
        self.coefficients
    }

    /// Returns the largest undistorted radius that the lens shows, of a fisheye an angle, else a tangent,
    /// and the distorted radius there as a multiple of the focal length.
    pub fn radius_limits(&self) -> [f64; 2] {
        [self.radius_max, self.image_radius_max]
    }

    /// Returns the largest angle between a ray and the optical axis.
    pub fn angle_max_rad(&self) -> f64 {
        if self.model == lens_model::FISHEYE { self.radius_max } else { self.radius_max.atan() }
    }

    /// Returns whether [`Projection::optical_ray`] has unit length, instead of a length of 1 along the
    /// optical axis: then depths are distances along the ray.
    pub fn has_unit_rays(&self) -> bool {
        self.model == lens_model::FISHEYE
    }

    /// Projects a point in sensor space (x forward, y left, z up) to a pixel, which may lie outside of the
    /// image; `None` where the lens shows nothing.
    #[must_use]
    pub fn project(&self, point_in_sensor: Vec3) -> Option<Vec2> {
        let DVec3 { x, y, z } = point_in_sensor.as_dvec3();
        Some(self.optical_pixel(DVec3::new(-y, -z, x))?.as_vec2())
    }

    /// Returns the point in sensor space (x forward, y left, z up) that a pixel shows at `depth_m`, as
    /// depth images have it; `None` where the lens shows nothing.
    #[must_use]
    pub fn unproject(&self, pixel: Vec2, depth_m: f32) -> Option<Vec3> {
        let ray = self.optical_ray(pixel.as_dvec2())? * f64::from(depth_m);
        Some(DVec3::new(ray.z, -ray.x, -ray.y).as_vec3())
    }

    /// Returns the depth of a point in sensor space, as depth images have it: metres along the optical
    /// axis; of a fisheye, from the camera.
    #[must_use]
    pub fn depth_m(&self, point_in_sensor: Vec3) -> f32 {
        if self.has_unit_rays() { point_in_sensor.length() } else { point_in_sensor.x }
    }

    /// Projects a point in optical space; see [`Projection::project`].
    #[must_use]
    pub fn optical_pixel(&self, optical: DVec3) -> Option<DVec2> {
        let distorted = match self.model {
            lens_model::FISHEYE => {
                let from_axis = optical.truncate().length();
                let angle = from_axis.atan2(optical.z);
                if angle > self.radius_max {
                    return None;
                }
                let scale =
                    if from_axis > 0.0 { self.image_radius(angle) / from_axis } else { 0.0 };
                optical.truncate() * scale
            }
            _ if optical.z <= 0.0 => return None,
            lens_model::BROWN_CONRADY => {
                let at = optical.truncate() / optical.z;
                if at.length_squared() > self.radius_max * self.radius_max {
                    return None;
                }
                self.distort(at).0
            }
            _ => optical.truncate() / optical.z,
        };
        Some(self.center_px + self.focal_px * distorted)
    }

    /// Returns the ray of a pixel in optical space; a point is the ray times its depth. `None` where the
    /// lens shows nothing.
    #[must_use]
    pub fn optical_ray(&self, pixel: DVec2) -> Option<DVec3> {
        let distorted = (pixel - self.center_px) / self.focal_px;
        match self.model {
            lens_model::FISHEYE => {
                let wanted = distorted.length();
                if wanted > self.image_radius_max {
                    return None;
                }
                let mut angle = wanted.min(self.radius_max);
                for _ in 0..LENS_STEPS {
                    let error = self.image_radius(angle) - wanted;
                    let step = error / self.slope(angle * angle).max(1e-3);
                    angle = (angle - step).clamp(0.0, self.radius_max);
                }
                let scale = if wanted > 0.0 { angle.sin() / wanted } else { 1.0 };
                Some((distorted * scale).extend(angle.cos()))
            }
            lens_model::BROWN_CONRADY => {
                let mut at = distorted;
                for _ in 0..LENS_STEPS {
                    let (image, [a, b, d]) = self.distort(at);
                    let error = image - distorted;
                    let determinant = (a * d - b * b).max(1e-3);
                    let step = DVec2::new(d * error.x - b * error.y, a * error.y - b * error.x);
                    let most = DVec2::splat(self.radius_max);
                    at = (at - step / determinant).clamp(-most, most);
                }
                let error_px = (self.distort(at).0 - distorted) * self.focal_px;
                let is_shown = at.length() <= self.radius_max && error_px.length() < 0.1;
                is_shown.then(|| at.extend(1.0))
            }
            _ => Some(distorted.extend(1.0)),
        }
    }

    /// Returns a distorted point of a Brown-Conrady lens, and the derivatives of its column by the column,
    /// of its column by the row, which is that of its row by the column, and of its row by the row.
    fn distort(&self, at: DVec2) -> (DVec2, [f64; 3]) {
        let [k1, k2, p1, p2, k3] = self.coefficients;
        let DVec2 { x, y } = at;
        let square = at.length_squared();
        let radial = 1.0 + square * (k1 + square * (k2 + square * k3));
        let slope = 2.0 * (k1 + square * (2.0 * k2 + square * 3.0 * k3));
        let tangential = DVec2::new(
            2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let derivatives = [
            radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
            slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y,
            radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x,
        ];
        (at * radial + tangential, derivatives)
    }

    /// Returns the coefficients of the radial polynomial.
    fn radial(&self) -> [f64; 4] {
        let [a, b, c, d, e] = self.coefficients;
        if self.model == lens_model::FISHEYE { [a, b, c, d] } else { [a, b, e, 0.0] }
    }

    /// Returns the distorted radius of an undistorted one, without tangential distortion.
    fn image_radius(&self, radius: f64) -> f64 {
        let [a, b, c, d] = self.radial();
        let square = radius * radius;
        radius * (1.0 + square * (a + square * (b + square * (c + square * d))))
    }

    /// Returns the derivative of the distorted radius at the square of an undistorted one.
    fn slope(&self, square: f64) -> f64 {
        let [a, b, c, d] = self.radial();
        1.0 + square * (3.0 * a + square * (5.0 * b + square * (7.0 * c + square * 9.0 * d)))
    }

    /// Finds the radius up to which the lens shows anything.
    fn limit(&mut self, max_angle_rad: f64) {
        const SHARE: f64 = 1.02;
        let end = match self.model {
            lens_model::FISHEYE if max_angle_rad > 0.0 => max_angle_rad,
            lens_model::FISHEYE => std::f64::consts::PI,
            _ => RADIUS_MAX,
        };
        let mut below = 0.0;
        let mut radius = 1e-3_f64;
        while below < end {
            let here = radius.min(end);
            if self.slope(here * here) <= 0.0 {
                let mut above = here;
                for _ in 0..50 {
                    let middle = 0.5 * (below + above);
                    if self.slope(middle * middle) > 0.0 { below = middle } else { above = middle }
                }
                self.folds = true;
                break;
            }
            below = here;
            radius *= SHARE;
        }
        self.radius_max = below;
        self.image_radius_max = self.image_radius(below);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [1600, 900];

    fn lens(model: u32, coefficients: [f32; 5]) -> LensSpec {
        LensSpec {
            model,
            focal_px: [700.0, 690.0],
            center_px: [810.5, 440.0],
            coefficients,
            ..LensSpec::default()
        }
    }

    fn lenses() -> [LensSpec; 5] {
        [
            lens(lens_model::PINHOLE, [0.0; 5]),
            // Barrel and pincushion distortion, with decentring.
            lens(lens_model::BROWN_CONRADY, [-0.29, 0.11, 0.0008, -0.0006, -0.02]),
            lens(lens_model::BROWN_CONRADY, [0.2, 0.05, -0.002, 0.001, 0.0]),
            lens(lens_model::FISHEYE, [0.05, -0.01, 0.004, -0.0006, 0.0]),
            LensSpec {
                focal_px: [280.0; 2],
                max_angle_rad: 1.75,
                ..lens(lens_model::FISHEYE, [-0.01, 0.002, -0.001, 0.0, 0.0])
            },
        ]
    }

    fn camera(lens: LensSpec) -> SensorSpec {
        let [width, height] = SIZE;
        SensorSpec { lens, width, height, fov_rad: 1.2, ..SensorSpec::default() }
    }

    #[test]
    fn a_pixel_comes_back_from_its_ray() {
        // The corners of the second lens lie where its polynomial falls; the image circle of the last one has
        // a radius of 490 pixels.
        for (lens, least) in lenses().into_iter().zip([2304, 1900, 2304, 2304, 1100]) {
            assert_eq!(Projection::check(&camera(lens)), Ok(()), "{lens:?}");
            let projection = Projection::of(&camera(lens)).unwrap();
            let mut shown = 0;
            for row in (0..SIZE[1]).step_by(25) {
                for column in (0..SIZE[0]).step_by(25) {
                    let pixel = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
                    let Some(ray) = projection.optical_ray(pixel) else { continue };
                    let back = projection.optical_pixel(ray * 3.0).unwrap();
                    assert!(back.distance(pixel) < 1e-3, "{lens:?}: {pixel} is not {back}");
                    let length = if projection.has_unit_rays() { ray.length() } else { ray.z };
                    assert!((length - 1.0).abs() < 1e-12);
                    shown += 1;
                }
            }
            assert!(shown >= least, "{lens:?}: {shown}");
        }
    }

    #[test]
    fn points_are_projected_by_the_formulas_of_opencv() {
        // By cv2.projectPoints and cv2.fisheye.projectPoints of OpenCV 4.12; there, whole coordinates are
        // the centres of pixels.
        #[rustfmt::skip]
        let cases = [
            (0, [0.6, -0.3, 1.2], [1160.00000, 267.00000]),
            (0, [-2.0, 1.0, 3.0], [343.33333, 669.50000]),
            (1, [0.6, -0.3, 1.2], [1131.34614, 281.23007]),
            (1, [-2.0, 1.0, 3.0], [403.41971, 640.07767]),
            (2, [0.6, -0.3, 1.2], [1184.50273, 254.60021]),
            (2, [-2.0, 1.0, 3.0], [285.91317, 697.22494]),
            (3, [0.6, -0.3, 1.2], [1133.09985, 280.25793]),
            (3, [-2.0, 1.0, 3.0], [401.31414, 640.92374]),
            (4, [0.6, -0.3, 1.2], [937.34230, 375.82885]),
            (4, [-2.0, 1.0, 3.0], [650.20304, 519.39848]),
        ];
        for (lens, point, wanted) in cases {
            let projection = Projection::of(&camera(lenses()[lens])).unwrap();
            let pixel = projection.optical_pixel(DVec3::from_array(point)).unwrap();
            assert!(pixel.distance(DVec2::from_array(wanted) + 0.5) < 1e-3, "{pixel} {wanted:?}");
        }
    }

    #[test]
    fn a_field_of_view_ends_at_the_edges_of_the_image() {
        for (model, coefficients, fov_rad) in [
            (lens_model::PINHOLE, [0.0; 5], 1.4_f32),
            (lens_model::BROWN_CONRADY, [-0.1, 0.01, 0.0, 0.0, 0.0], 1.4),
            (lens_model::FISHEYE, [0.02, 0.0, 0.0, 0.0, 0.0], 3.4),
        ] {
            let lens = LensSpec { model, coefficients, ..LensSpec::default() };
            let projection = Projection::new(&lens, SIZE, fov_rad).unwrap();
            let ray = projection.optical_ray(DVec2::new(1600.0, 450.0)).unwrap();
            assert!((ray.x.atan2(ray.z) - f64::from(fov_rad) / 2.0).abs() < 1e-6, "{lens:?} {ray}");
        }
    }

    #[test]
    fn a_lens_shows_nothing_beyond_its_circle_or_where_its_polynomial_falls() {
        let [.., wide] = lenses();
        let wide = Projection::of(&camera(wide)).unwrap();
        assert!(wide.optical_pixel(DVec3::new(1.0, 0.0, -0.17)).is_some(), "behind, at 99.6°");
        assert_eq!(wide.optical_pixel(DVec3::new(1.0, 0.0, -0.2)), None, "at 101.3°");
        assert_eq!(wide.optical_ray(DVec2::new(810.5 + 500.0, 440.0)), None);
        // r - 0.3 r³ rises up to r = 1.054.
        let barrel = LensSpec {
            focal_px: [1200.0; 2],
            ..lens(lens_model::BROWN_CONRADY, [-0.3, 0.0, 0.0, 0.0, 0.0])
        };
        let barrel = Projection::of(&camera(barrel)).unwrap();
        assert!((barrel.radius_limits()[0] - (1.0_f64 / 0.9).sqrt()).abs() < 1e-7);
        assert!(barrel.optical_pixel(DVec3::new(1.0, 0.0, 1.0)).is_some());
        assert_eq!(barrel.optical_pixel(DVec3::new(1.1, 0.0, 1.0)), None);
        assert_eq!(barrel.optical_ray(DVec2::new(810.5 + 900.0, 440.0)), None);
    }

    #[test]
    fn a_bad_calibration_is_refused_by_its_facts() {
        let refused = |lens: LensSpec| Projection::check(&camera(lens)).unwrap_err();
        let [pinhole, barrel, _, fisheye, _] = lenses();
        let mut broken = barrel;
        broken.coefficients[1] = f32::NAN;
        assert_eq!(refused(broken), "k2 is NaN, not -100 to 100");
        let swapped = lens(lens_model::BROWN_CONRADY, [-0.29, 0.11, 0.0, 0.0, -0.6]);
        let why = refused(swapped);
        assert!(why.starts_with("its polynomial falls from 0.6"), "{why}");
        assert!(why.contains("the nearest edge of the image is 440.0 pixels away"), "{why}");
        let folded = LensSpec {
            focal_px: [0.0; 2],
            center_px: [0.0; 2],
            ..lens(lens_model::BROWN_CONRADY, [-2.0, 0.0, 0.0, 0.0, 0.0])
        };
        let why = refused(folded);
        assert!(why.contains("inside of the field of view of 0.600 rad to each side"), "{why}");
        let torn = lens(lens_model::BROWN_CONRADY, [0.0, 0.0, 9.0, 9.0, 0.0]);
        assert!(refused(torn).contains("no single ray for pixel"), "{}", refused(torn));
        let extra = LensSpec { coefficients: [0.1; 5], ..fisheye };
        assert!(refused(extra).contains("lens model 2 has only 4"), "{}", refused(extra));
        let angle = LensSpec { max_angle_rad: 1.0, ..pinhole };
        assert_eq!(refused(angle), "max_angle_rad is 1, not 0 to 0");
        assert!(refused(LensSpec { model: 7, ..pinhole }).starts_with("lens model is 7, not 0"));
        let half = LensSpec { focal_px: [0.0; 2], ..pinhole };
        assert!(refused(half).contains("but fx and fy are 0; give all four or none"));
        assert_eq!(
            refused(LensSpec { focal_px: [700.0, 0.0], ..pinhole }),
            "fy is 0, not 0.1 to 1000000"
        );
    }
}
