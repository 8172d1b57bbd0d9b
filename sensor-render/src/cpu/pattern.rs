//! Regular patterns: windows, bricks, slabs, tiles, number plates. Twin of pattern.wgsl.

use super::grain::{hash, share, smooth};
use super::surface_materials::SurfaceMaterials;
use crate::plate;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::surface_material::pattern;

/// Height of a floor and width of a window bay. Metres.
const FLOOR: f32 = 3.1;
const BAY: f32 = 3.64;

/// Returns the coverage of a pixel of width `pixel` whose centre lies `inside` metres within the
/// edge of a shape.
#[inline(always)]
pub(super) fn cover<F: Float>(inside: F, pixel: F) -> F {
    (inside / pixel + F::splat(0.5)).clamp01()
}

/// Returns 1 where details of this size in metres are resolved, falling to 0 where they blur.
#[inline(always)]
fn sharp<F: Float>(size: f32, pixel: F) -> F {
    (F::splat(1.6) - pixel * F::splat(1.6 / size)).clamp01()
}

/// Draws the patterns of surfaces for pixels that are `pixel` metres wide; `dark` is 1 at night.
#[inline(always)]
pub(crate) fn draw<F: Float>(surfaces: &mut SurfaceMaterials<F>, pixel: F, dark: f32) {
    let windows = has(surfaces, pattern::WINDOWS);
    let curtain = has(surfaces, pattern::CURTAIN);
    let slabs = has(surfaces, pattern::SLABS);
    let tiles = has(surfaces, pattern::TILES);
    if slabs.any() {
        lines(
            surfaces,
            slabs,
            [surfaces.along, surfaces.up],
            [0.6, 0.6],
            0.012,
            [0.08, -0.35],
            pixel,
        );
    }
    if tiles.any() {
        lines(
            surfaces,
            tiles,
            [surfaces.along, surfaces.up],
            [0.3, 0.36],
            0.03,
            [0.2, -0.35],
            pixel,
        );
    }
    if windows.any() {
        panes(surfaces, windows, [BAY, FLOOR], [0.62, 0.78], 1.75, pixel, dark);
    }
    if curtain.any() {
        panes(surfaces, curtain, [1.7, 1.55], [0.5, 0.735], 0.775, pixel, dark);
    }
    let plates = has(surfaces, pattern::PLATE);
    if plates.any() {
        characters(surfaces, plates, pixel);
    }
}

/// Length of a brick with its joint, 250 mm as of DIN 4172, and its height, 75 mm as of British bricks of 65 mm, and
/// width of the joint, 10 mm to 12 mm of both. Metres.
const BRICK_M: [f32; 2] = [0.25, 0.075];
const JOINT_M: f32 = 0.011;
/// Share of joints in the area of a wall of such bricks.
const JOINTS: f32 = 0.18;
/// Albedo of old lime mortar, and what hot places of the kiln leave of the light of a brick, by colour.
const MORTAR: glam::Vec3 = glam::Vec3::new(0.25, 0.235, 0.21);
const BURNT: glam::Vec3 = glam::Vec3::new(0.52, 0.54, 0.64);
/// The same of bricks that lay far from the fire.
const PALE: glam::Vec3 = glam::Vec3::new(1.22, 1.3, 1.3);

/// Draws courses of bricks, each with a brightness of its own, some of them burnt or pale, with joints of mortar.
#[inline(always)]
pub(crate) fn lay_bricks<F: Float>(surfaces: &mut SurfaceMaterials<F>, pixel: F) {
    let mask = has(surfaces, pattern::BRICKS);
    if !mask.any() {
        return;
    }
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let y = surfaces.up * F::splat(1.0 / BRICK_M[1]);
    let row = y.floor();
    let x = surfaces.along.mul_add(F::splat(1.0 / BRICK_M[0]), row * half - (row * half).floor());
    let column = x.floor();
    let edge = from_edge(x - column, BRICK_M[0]).min(from_edge(y - row, BRICK_M[1]));
    let seen = sharp(BRICK_M[1], pixel);
    let joint = one - cover(edge - F::splat(JOINT_M * 0.5), pixel);
    let joint = F::splat(JOINTS).lerp(joint, seen);
    let word = hash::<F>(column.to_int(), row.to_int(), surfaces.seed);
    let kind = share::<F>(word * F::Word::splat(0x9e37_79b1));
    let tone = (share::<F>(word) - half).mul_add(seen * F::splat(0.36), one);
    let burnt = smooth(F::splat(0.82), F::splat(0.92), kind) * seen;
    let pale = smooth(F::splat(0.18), F::splat(0.06), kind) * seen;
    let white = V3::splat(glam::Vec3::ONE);
    let hue = white.lerp(V3::splat(BURNT), burnt).times(white.lerp(V3::splat(PALE), pale));
    let wall = surfaces.albedo.times(hue * tone).lerp(V3::splat(MORTAR), joint);
    surfaces.albedo = wall.or(mask, surfaces.albedo);
}

/// Draws the characters and the edge of number plates.
#[inline(always)]
fn characters<F: Float>(surfaces: &mut SurfaceMaterials<F>, mask: F::Mask, pixel: F) {
    let [left, width, low, height] = surfaces.wall;
    let [wide, high] = plate::SIZE_M;
    let x = (surfaces.along - left) / width.max(F::splat(0.01)) * F::splat(wide);
    let y = (surfaces.up - low) / height.max(F::splat(0.01)) * F::splat(high);
    let (seeds, xs, ys) = (surfaces.seed.to_array(), x.to_array(), y.to_array());
    let (mut apart, mut left) = ([1.0; LANES], mask.bits());
    while left != 0 {
        let lane = left.trailing_zeros() as usize % LANES;
        left &= left - 1;
        apart[lane] = plate::distance(seeds[lane], xs[lane], ys[lane]);
    }
    let (half, edge) = (F::splat(plate::HALF_LINE_M), F::splat(0.004));
    let line = cover(half - F::from_array(apart), pixel) * ((half + half) / pixel).clamp01();
    let inside = x.min(F::splat(wide) - x).min(y.min(F::splat(high) - y));
    let border = cover(edge - inside, pixel) * (edge / pixel).clamp01();
    let ink = line.max(border * F::splat(0.7)).or(mask, F::splat(0.0));
    surfaces.albedo = surfaces.albedo.lerp(V3::splat(glam::Vec3::splat(plate::INK)), ink);
}

#[inline(always)]
pub(super) fn has<F: Float>(surfaces: &SurfaceMaterials<F>, bit: u32) -> F::Mask {
    !(surfaces.pattern & F::Word::splat(bit)).eq(F::Word::splat(0))
}

/// Returns the distance from the edge of a cell in metres; `x` is a share of the cell's size.
#[inline(always)]
fn from_edge<F: Float>(x: F, size: f32) -> F {
    (F::splat(0.5) - (x - F::splat(0.5)).abs()) * F::splat(size)
}

/// Draws cells with joints between them; each cell and the joints vary in brightness.
#[inline(always)]
fn lines<F: Float>(
    surfaces: &mut SurfaceMaterials<F>,
    mask: F::Mask,
    at: [F; 2],
    size: [f32; 2],
    joint: f32,
    [vary, bright]: [f32; 2],
    pixel: F,
) {
    let [x, y] = [at[0] * F::splat(1.0 / size[0]), at[1] * F::splat(1.0 / size[1])];
    let (column, row) = (x.floor(), y.floor());
    let half = F::splat(0.5);
    let edge = from_edge(x - column, size[0]).min(from_edge(y - row, size[1]));
    let in_joint = F::splat(1.0) - cover(edge - F::splat(joint * 0.5), pixel);
    let tone = share::<F>(hash::<F>(column.to_int(), row.to_int(), surfaces.seed)) - half;
    let wave = tone.mul_add(F::splat(2.0 * vary), in_joint * F::splat(bright));
    let wave = wave.mul_add(sharp(size[0].min(size[1]), pixel), F::splat(1.0));
    surfaces.albedo = surfaces.albedo * wave.or(mask, F::splat(1.0));
}

/// Draws rows of windows with frames. `half` is the half size of a window, `middle` the height of
/// its centre above its floor.
#[inline(always)]
fn panes<F: Float>(
    surfaces: &mut SurfaceMaterials<F>,
    mask: F::Mask,
    [bay, floor]: [f32; 2],
    half: [f32; 2],
    middle: f32,
    pixel: F,
    dark: f32,
) {
    let one = F::splat(1.0);
    let [left, width, low, high] = surfaces.wall;
    let columns = (width * F::splat(1.0 / bay)).floor().max(one);
    let pitch = width / columns;
    let x = (surfaces.along - left) / pitch.max(F::splat(0.01));
    let y = (surfaces.height - low) * F::splat(1.0 / floor);
    let (column, row) = (x.floor(), y.floor());
    let across = ((x - column - F::splat(0.5)) * pitch).abs();
    let upward = ((y - row) * F::splat(floor) - F::splat(middle)).abs();
    let fits = mask
        & (row + one).mul_add(F::splat(-floor), high).ge(F::splat(-0.6))
        & row.ge(F::splat(0.0))
        & pitch.ge(F::splat(half[0] * 2.0 + 0.1));
    if !fits.any() {
        return;
    }
    let half_across = F::splat(half[0]).max(
        pitch
            .mul_add(F::splat(0.5), F::splat(-0.08))
            .or(F::splat(2.0).ge(pitch), F::splat(half[0])),
    );
    let inside = (half_across - across).min(F::splat(half[1]) - upward);
    // At a distance, a façade is a uniform mixture of wall and panes.
    let even = half_across * F::splat(4.0 * half[1] / floor) / pitch.max(F::splat(0.01));
    let blurred = smooth(F::splat(0.8), F::splat(2.6), pixel);
    let frame = cover(inside, pixel).lerp(even, blurred);
    let pane = cover(inside - F::splat(0.07), pixel).lerp(even * F::splat(0.85), blurred);
    let word = hash::<F>(column.to_int(), row.to_int(), surfaces.seed);
    let (tone, lit) = (share::<F>(word), share::<F>(word * F::Word::splat(0x9e37_79b1)));
    let none = F::splat(0.0);
    let (frame, pane) = (frame.or(fits, none), pane.or(fits, none));
    // Some windows have curtains.
    let cloth = smooth(F::splat(0.55), F::splat(0.95), tone).lerp(F::splat(0.2), blurred);
    let glass = V3::splat(glam::Vec3::new(0.02, 0.026, 0.03))
        .lerp(V3::splat(glam::Vec3::new(0.25, 0.235, 0.21)), cloth);
    let white = V3::splat(glam::Vec3::splat(0.5)).lerp(surfaces.albedo, F::splat(0.3));
    surfaces.albedo = surfaces.albedo.lerp(white, frame).lerp(glass, pane);
    surfaces.specular = surfaces.specular.lerp(F::splat(0.09), pane);
    surfaces.roughness = surfaces.roughness.lerp(F::splat(0.04), pane);
    let lamp = smooth(F::splat(0.62), F::splat(0.66), lit).lerp(F::splat(0.36), blurred);
    let lamp = lamp * pane * F::splat(dark) * tone.mul_add(F::splat(0.7), F::splat(0.3));
    let warm = V3::splat(glam::Vec3::new(1.5, 1.0, 0.5));
    surfaces.emission = warm.mul_add(lamp, surfaces.emission);
}
