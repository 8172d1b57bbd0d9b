//! Rays of lenses: the inverse of their distortion. Twin of lens.wgsl.

use glam::Vec3;
use protocol::LENS_STEPS;

use crate::lens::Lens;
use crate::rays::Camera;
use crate::simd::{Float, V3};

/// Returns the directions of rays at columns and rows in pixels from the principal point, and which of
/// them the lens shows; [`protocol::Projection::optical_ray`] is the formula.
#[inline(always)]
pub(crate) fn directions<F: Float>(
    camera: &Camera,
    lens: &Lens,
    across: F,
    down: F,
) -> (V3<F>, F::Mask) {
    if lens.is_fisheye {
        fisheye(camera, lens, across, down)
    } else {
        brown_conrady(camera, lens, across, down)
    }
}

/// Fisheye: Newton's steps for the angle between ray and axis.
#[inline(always)]
fn fisheye<F: Float>(camera: &Camera, lens: &Lens, across: F, down: F) -> (V3<F>, F::Mask) {
    let [k1, k2, k3, k4, _] = lens.coefficients;
    let k @ [k1, k2, k3, k4] = [F::splat(k1), F::splat(k2), F::splat(k3), F::splat(k4)];
    let (one, zero) = (F::splat(1.0), F::splat(0.0));
    let (x, y) = (across * F::splat(camera.pixel), down * F::splat(camera.pixel_down));
    let wanted = (x * x + y * y).sqrt();
    let shown = F::splat(lens.image_radius_max).ge(wanted);
    let most = F::splat(lens.radius_max);
    let slopes = [k1 * F::splat(3.0), k2 * F::splat(5.0), k3 * F::splat(7.0), k4 * F::splat(9.0)];
    let mut angle = wanted.min(most);
    for _ in 0..LENS_STEPS {
        let square = angle * angle;
        let error = angle * radial(k, square) - wanted;
        let slope = slopes[3].mul_add(square, slopes[2]).mul_add(square, slopes[1]);
        let slope = slope.mul_add(square, slopes[0]).mul_add(square, one);
        angle = (angle - error / slope.max(F::splat(1e-3))).max(zero).min(most);
    }
    // Sine and cosine of half the angle, at most π / 2, by their series: devices round their own
    // functions too coarsely.
    let half = angle * F::splat(0.5);
    let square = half * half;
    let (sine, cosine) = (series(SINE, square), series(COSINE, square));
    let forward = (half * sine) * (half * sine) * F::splat(-2.0) + one;
    let scale = sine * cosine / radial(k, angle * angle);
    let across = V3::splat(camera.right) * (across * scale);
    let across = V3::splat(camera.down).mul_add(down * scale, across);
    (V3::splat(camera.forward).mul_add(forward, across), shown)
}

/// Returns how much farther from the principal point than its angle a fisheye images a ray; `square` is
/// the square of the angle.
#[inline(always)]
fn radial<F: Float>([k1, k2, k3, k4]: [F; 4], square: F) -> F {
    let inner = k4.mul_add(square, k3).mul_add(square, k2).mul_add(square, k1);
    inner.mul_add(square, F::splat(1.0))
}

/// Returns the sum of terms, the last one first, times powers of `square`.
#[inline(always)]
fn series<F: Float>([last, rest @ ..]: [f32; 7], square: F) -> F {
    let mut sum = F::splat(last);
    for term in rest {
        sum = sum.mul_add(square, F::splat(term));
    }
    sum
}

/// Terms of the series of sin h / h and cos h in h², the last one first.
#[rustfmt::skip]
const SINE: [f32; 7] = [
    1.605_904_4e-10, -2.505_210_8e-8, 2.755_731_9e-6, -1.984_127e-4, 8.333_333e-3, -0.166_666_67, 1.0,
];
#[rustfmt::skip]
const COSINE: [f32; 7] = [
    2.087_675_7e-9, -2.755_732e-7, 2.480_158_7e-5, -1.388_888_9e-3, 4.166_666_6e-2, -0.5, 1.0,
];

/// Brown-Conrady: Newton's steps in two dimensions.
#[inline(always)]
fn brown_conrady<F: Float>(camera: &Camera, lens: &Lens, across: F, down: F) -> (V3<F>, F::Mask) {
    let (wanted_x, wanted_y) =
        (across * F::splat(camera.pixel), down * F::splat(camera.pixel_down));
    let most = F::splat(lens.radius_max);
    let (mut x, mut y) = (wanted_x, wanted_y);
    for _ in 0..LENS_STEPS {
        let (image_x, image_y, [a, b, d]) = distort(lens, x, y);
        let (error_x, error_y) = (image_x - wanted_x, image_y - wanted_y);
        let determinant = (a * d - b * b).max(F::splat(1e-3));
        let step_x = (d * error_x - b * error_y) / determinant;
        let step_y = (a * error_y - b * error_x) / determinant;
        x = (x - step_x).max(-most).min(most);
        y = (y - step_y).max(-most).min(most);
    }
    let (image_x, image_y, _) = distort(lens, x, y);
    let (x, y) = (x * F::splat(lens.focal[0]), y * F::splat(lens.focal[1]));
    let off_x = (image_x - wanted_x) * F::splat(lens.focal[0]);
    let off_y = (image_y - wanted_y) * F::splat(lens.focal[1]);
    let (u, v) = (x * F::splat(camera.pixel), y * F::splat(camera.pixel_down));
    let shown = (most * most).ge(u * u + v * v) & F::splat(0.01).ge(off_x * off_x + off_y * off_y);
    let direction = V3::splat(camera.right).mul_add(x, V3::splat(camera.forward));
    (V3::splat(camera.down).mul_add(y, direction), shown)
}

/// Returns a distorted point and the derivatives of its column by the column, of its column by the row,
/// which is that of its row by the column, and of its row by the row.
#[inline(always)]
fn distort<F: Float>(lens: &Lens, x: F, y: F) -> (F, F, [F; 3]) {
    let [k1, k2, p1, p2, k3] = lens.coefficients;
    let (k1, k2, k3) = (F::splat(k1), F::splat(k2), F::splat(k3));
    let (p1, p2) = (F::splat(p1), F::splat(p2));
    let (two, three, six) = (F::splat(2.0), F::splat(3.0), F::splat(6.0));
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let square = xx + yy;
    let radial = k3.mul_add(square, k2).mul_add(square, k1).mul_add(square, F::splat(1.0));
    let slope = (k3 * three).mul_add(square, k2 * two).mul_add(square, k1) * two;
    let image_x = x * radial + two * p1 * xy + p2 * xx.mul_add(two, square);
    let image_y = y * radial + p1 * yy.mul_add(two, square) + two * p2 * xy;
    let derivatives = [
        radial + slope * xx + two * p1 * y + six * p2 * x,
        slope * xy + two * p1 * x + two * p2 * y,
        radial + slope * yy + six * p1 * y + two * p2 * x,
    ];
    (image_x, image_y, derivatives)
}

/// Bounds of rays: four directions whose convex hull contains them, and an axis with
/// `axis · direction <= 1` for each.
pub(crate) struct Bounds {
    pub(crate) corners: [Vec3; 4],
    pub(crate) axis: Vec3,
    /// Whether the rays lie close to the axis; if not, the corners are meaningless.
    pub(crate) is_narrow: bool,
}

/// Returns the bounds of the rays that the lens shows; at least one is shown.
#[inline(always)]
pub(crate) fn bounds<F: Float, const G: usize>(
    camera: &Camera,
    lens: &Lens,
    directions: &[V3<F>; G],
    shown: &[F::Mask; G],
) -> Bounds {
    let [right, down] = [camera.right / camera.pixel, camera.down / camera.pixel_down];
    let (mut axis, mut sides) = (camera.forward, [right, down]);
    if lens.is_fisheye {
        // A plane across the mean direction, since rays may point backwards.
        let mut sum = V3::splat(Vec3::ZERO);
        for (direction, shown) in directions.iter().zip(shown) {
            sum = sum + direction.or(*shown, V3::splat(Vec3::ZERO));
        }
        let (x, y, z) = (sum.x.to_array(), sum.y.to_array(), sum.z.to_array());
        axis =
            Vec3::new(x.iter().sum(), y.iter().sum(), z.iter().sum()).normalize_or(camera.forward);
        let along = if axis.dot(right).abs() < 0.7 { right } else { camera.forward };
        let first = (along - axis * axis.dot(along)).normalize_or(right);
        sides = [first, axis.cross(first)];
    }
    let infinite = F::splat(f32::INFINITY);
    let mut along = infinite;
    let (mut low, mut high) = ([infinite; 2], [-infinite; 2]);
    for (direction, shown) in directions.iter().zip(shown) {
        let ahead = direction.dot(V3::splat(axis));
        along = along.min(ahead.or(*shown, infinite));
        for side in 0..2 {
            let at = direction.dot(V3::splat(sides[side])) / ahead;
            low[side] = low[side].min(at.or(*shown, infinite));
            high[side] = high[side].max(at.or(*shown, -infinite));
        }
    }
    // Slightly wider than the outermost rays, to allow for rounding.
    let more = 0.02 * camera.pixel + 1e-6;
    let [left, top] = [low[0].smallest() - more, low[1].smallest() - more];
    let [right, bottom] = [high[0].largest() + more, high[1].largest() + more];
    let corner = |x: f32, y: f32| axis + sides[0] * x + sides[1] * y;
    Bounds {
        corners: [
            corner(left, top),
            corner(right, top),
            corner(right, bottom),
            corner(left, bottom),
        ],
        axis,
        is_narrow: along.smallest() > 0.5,
    }
}
