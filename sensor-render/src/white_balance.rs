//! White balance: which light a camera shows as white.

use glam::{DMat3, DVec2, DVec3, Mat3};

/// Linear sRGB to CIE XYZ, IEC 61966-2-1, by columns.
const XYZ_FROM_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(0.412_456_4, 0.212_672_9, 0.019_333_9),
    DVec3::new(0.357_576_1, 0.715_152_2, 0.119_192),
    DVec3::new(0.180_437_5, 0.072_175, 0.950_304_1),
);

/// XYZ to the responses of cones, K. M. Lam, *Metamerism and Colour Constancy* (Bradford), 1985.
const CONES_FROM_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// Length in the CIE 1960 diagram of a tint of 1.
const TINT: f64 = 0.05;

/// Returns the matrix of linear sRGB that shows light of a correlated colour temperature as light of 6500 K
/// is shown, which needs none. With a `tint` above 0 that light is more magenta, and the image greener.
pub(crate) fn matrix(temperature_k: f32, tint: f32) -> Mat3 {
    let (from, to) = (white(f64::from(temperature_k), f64::from(tint)), white(6500.0, 0.0));
    let [from, to] = [from, to].map(|xyz| CONES_FROM_XYZ * xyz);
    let adapted = CONES_FROM_XYZ.inverse() * DMat3::from_diagonal(to / from) * CONES_FROM_XYZ;
    (XYZ_FROM_RGB.inverse() * adapted * XYZ_FROM_RGB).as_mat3()
}

/// Returns the colour of a black body in XYZ with Y = 1, moved by `tint` across the line of black bodies.
fn white(temperature_k: f64, tint: f64) -> DVec3 {
    let at = black_body(temperature_k);
    let along = black_body(temperature_k + 1.0) - black_body(temperature_k - 1.0);
    let DVec2 { x: u, y: v } = at + DVec2::new(-along.y, along.x).normalize() * (TINT * tint);
    // CIE 1960 to CIE 1931.
    let [x, y] = [3.0 * u, 2.0 * v].map(|side| side / (2.0 * u - 8.0 * v + 4.0));
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Returns the colour of a black body in the CIE 1960 diagram: M. Krystek, *An algorithm to calculate
/// correlated colour temperature*, Color Research and Application, 1985.
fn black_body(t: f64) -> DVec2 {
    let u = (0.860_117_757 + 1.541_182_54e-4 * t + 1.286_412_12e-7 * t * t)
        / (1.0 + 8.424_202_35e-4 * t + 7.081_451_63e-7 * t * t);
    let v = (0.317_398_726 + 4.228_062_45e-5 * t + 4.204_816_91e-8 * t * t)
        / (1.0 - 2.897_418_16e-5 * t + 1.614_560_53e-7 * t * t);
    DVec2::new(u, v)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn light_of_6500_kelvin_needs_no_balance() {
        assert!(matrix(6500.0, 0.0).abs_diff_eq(Mat3::IDENTITY, 1e-6));
    }

    #[test]
    fn a_camera_for_lamp_light_shows_daylight_blue_and_one_for_shade_orange() {
        let lamp = matrix(3200.0, 0.0) * Vec3::ONE;
        assert!(lamp.z > 1.3 * lamp.x, "{lamp}");
        let shade = matrix(10_000.0, 0.0) * Vec3::ONE;
        assert!(shade.x > 1.1 * shade.z, "{shade}");
    }

    #[test]
    fn a_tint_above_0_makes_the_image_greener_and_one_below_more_magenta() {
        let green = matrix(6500.0, 0.5) * Vec3::ONE;
        assert!(green.y > green.x && green.y > green.z, "{green}");
        let magenta = matrix(6500.0, -0.5) * Vec3::ONE;
        assert!(magenta.y < magenta.x && magenta.y < magenta.z, "{magenta}");
    }
}
