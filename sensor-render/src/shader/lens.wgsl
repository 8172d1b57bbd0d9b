// Rays of lenses: the inverse of their distortion. Twin of cpu/lens.rs.

const FISHEYE = 2u;
const LENS_STEPS = 10u;

// Direction of the ray at a column and row in pixels from the principal point; w: whether the lens shows
// it.
fn lens_direction(index: u32, at: vec2f) -> vec4f {
    if (cameras[index].lens == FISHEYE) {
        return fisheye(index, at);
    }
    return brown_conrady(index, at);
}

// Newton's steps for the angle between ray and axis.
fn fisheye(index: u32, at: vec2f) -> vec4f {
    let k = cameras[index].coefficients;
    let slopes = k * vec4f(3.0, 5.0, 7.0, 9.0);
    let wanted = length(at * cameras[index].pixel);
    let most = cameras[index].radius_max;
    var angle = min(wanted, most);
    for (var step = 0u; step < LENS_STEPS; step++) {
        let square = angle * angle;
        let error = angle * (1.0 + square * (k.x + square * (k.y + square * (k.z + square * k.w)))) - wanted;
        let slope =
            1.0 + square * (slopes.x + square * (slopes.y + square * (slopes.z + square * slopes.w)));
        angle = clamp(angle - error / max(slope, 1e-3), 0.0, most);
    }
    let half = half_sine_cosine(angle);
    let ahead = 1.0 - 2.0 * half.x * half.x;
    let whole = angle * angle;
    // The sine over the angle.
    let scale = half_sinc(angle) * half.y
        / (1.0 + whole * (k.x + whole * (k.y + whole * (k.z + whole * k.w))));
    let direction = cameras[index].forward.xyz * ahead
        + (cameras[index].right.xyz * at.x + cameras[index].down.xyz * at.y) * scale;
    return vec4f(direction, select(0.0, 1.0, wanted <= cameras[index].image_radius_max));
}

// Sine and cosine of half an angle of at most pi, by their series: devices round their own functions too
// coarsely.
fn half_sine_cosine(angle: f32) -> vec2f {
    let square = angle * angle * 0.25;
    let cosine = 1.0 + square * (-0.5 + square * (4.1666666e-2 + square * (-1.3888889e-3
        + square * (2.4801587e-5 + square * (-2.7557319e-7 + square * 2.0876757e-9)))));
    return vec2f(half_sinc(angle) * angle * 0.5, cosine);
}

// Sine of half an angle, divided by that half.
fn half_sinc(angle: f32) -> f32 {
    let square = angle * angle * 0.25;
    return 1.0 + square * (-0.16666667 + square * (8.333333e-3 + square * (-1.984127e-4
        + square * (2.7557319e-6 + square * (-2.5052108e-8 + square * 1.6059044e-10)))));
}

// Newton's steps in two dimensions.
fn brown_conrady(index: u32, at: vec2f) -> vec4f {
    let wanted = at * cameras[index].pixel;
    let most = cameras[index].radius_max;
    var p = wanted;
    for (var step = 0u; step < LENS_STEPS; step++) {
        let image = distort(index, p);
        let error = image.at - wanted;
        let d = image.derivatives;
        let determinant = max(d.x * d.z - d.y * d.y, 1e-3);
        let toward = vec2f(d.z * error.x - d.y * error.y, d.x * error.y - d.y * error.x);
        p = clamp(p - toward / determinant, vec2f(-most), vec2f(most));
    }
    let off = (distort(index, p).at - wanted) * cameras[index].focal;
    let is_shown = dot(p, p) <= most * most && dot(off, off) <= 0.01;
    p *= cameras[index].focal;
    let direction =
        cameras[index].forward.xyz + cameras[index].right.xyz * p.x + cameras[index].down.xyz * p.y;
    return vec4f(direction, select(0.0, 1.0, is_shown));
}

struct Distorted {
    at: vec2f,
    // Of the column by the column, of the column by the row, which is that of the row by the column, and of
    // the row by the row.
    derivatives: vec3f,
}

fn distort(index: u32, p: vec2f) -> Distorted {
    // k1, k2, p1, p2.
    let k = cameras[index].coefficients;
    let k3 = cameras[index].coefficient5;
    let square = dot(p, p);
    let radial = 1.0 + square * (k.x + square * (k.y + square * k3));
    let slope = 2.0 * (k.x + square * (2.0 * k.y + square * 3.0 * k3));
    let xy = p.x * p.y;
    let at = p * radial + vec2f(
        2.0 * k.z * xy + k.w * (square + 2.0 * p.x * p.x),
        k.z * (square + 2.0 * p.y * p.y) + 2.0 * k.w * xy);
    let derivatives = vec3f(
        radial + slope * p.x * p.x + 2.0 * k.z * p.y + 6.0 * k.w * p.x,
        slope * xy + 2.0 * k.z * p.x + 2.0 * k.w * p.y,
        radial + slope * p.y * p.y + 6.0 * k.z * p.y + 2.0 * k.w * p.x);
    return Distorted(at, derivatives);
}
