//! What has lines: windows, bricks, slabs, tiles. The twin of pattern.wgsl.

use super::coats::Coats;
use super::grain::{hash, share, smooth};
use crate::coat::pattern;
use crate::simd::{Float, Mask, V3, Word};

/// Metres.
const FLOOR: f32 = 3.1;
const BAY: f32 = 3.64;

/// How much of a strip whose edge is `inside` metres away fills a pixel that is `pixel` wide.
#[inline(always)]
fn cover<F: Float>(inside: F, pixel: F) -> F {
    (inside / pixel + F::splat(0.5)).clamp01()
}

/// 1 where details of this size in metres can be seen, 0 where they blur.
#[inline(always)]
fn sharp<F: Float>(size: f32, pixel: F) -> F {
    (F::splat(1.6) - pixel * F::splat(1.6 / size)).clamp01()
}

/// Draws the coats' patterns for pixels that are `pixel` metres wide; `dark` is 1 by night.
#[inline(always)]
pub(crate) fn draw<F: Float>(coats: &mut Coats<F>, pixel: F, dark: f32) {
    let windows = has(coats, pattern::WINDOWS);
    let curtain = has(coats, pattern::CURTAIN);
    let bricks = has(coats, pattern::BRICKS);
    let slabs = has(coats, pattern::SLABS);
    let tiles = has(coats, pattern::TILES);
    if bricks.any() {
        let row = (coats.up * F::splat(1.0 / 0.075)).floor();
        let shift = (row * F::splat(0.5) - (row * F::splat(0.5)).floor())
            .mul_add(F::splat(0.25), coats.along);
        lines(coats, bricks, [shift, coats.up], [0.25, 0.075], 0.012, [0.22, 0.5], pixel);
    }
    if slabs.any() {
        lines(coats, slabs, [coats.along, coats.up], [0.6, 0.6], 0.012, [0.08, -0.35], pixel);
    }
    if tiles.any() {
        lines(coats, tiles, [coats.along, coats.up], [0.3, 0.36], 0.03, [0.2, -0.35], pixel);
    }
    if windows.any() {
        panes(coats, windows, [BAY, FLOOR], [0.62, 0.78], 1.75, pixel, dark);
    }
    if curtain.any() {
        panes(coats, curtain, [1.7, 1.55], [0.5, 0.735], 0.775, pixel, dark);
    }
}

#[inline(always)]
fn has<F: Float>(coats: &Coats<F>, bit: u32) -> F::Mask {
    !(coats.pattern & F::Word::splat(bit)).eq(F::Word::splat(0))
}

/// How far from the cell's edge; `x` is a share of the cell's size in metres.
#[inline(always)]
fn from_edge<F: Float>(x: F, size: f32) -> F {
    (F::splat(0.5) - (x - F::splat(0.5)).abs()) * F::splat(size)
}

/// Cells of a size, with joints between; each cell and the joints have a brightness of their own.
#[inline(always)]
fn lines<F: Float>(
    coats: &mut Coats<F>,
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
    let tone = share::<F>(hash::<F>(column.to_int(), row.to_int(), coats.seed)) - half;
    let wave = tone.mul_add(F::splat(2.0 * vary), in_joint * F::splat(bright));
    let wave = wave.mul_add(sharp(size[0].min(size[1]), pixel), F::splat(1.0));
    coats.albedo = coats.albedo * wave.or(mask, F::splat(1.0));
}

/// Rows of windows with frames; `half` of a window, and the height of its middle over its floor.
#[inline(always)]
fn panes<F: Float>(
    coats: &mut Coats<F>,
    mask: F::Mask,
    [bay, floor]: [f32; 2],
    half: [f32; 2],
    middle: f32,
    pixel: F,
    dark: f32,
) {
    let one = F::splat(1.0);
    let [left, width, low, high] = coats.wall;
    let columns = (width * F::splat(1.0 / bay)).floor().max(one);
    let pitch = width / columns;
    let x = (coats.along - left) / pitch.max(F::splat(0.01));
    let y = (coats.height - low) * F::splat(1.0 / floor);
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
    // Far away a facade is an even mixture of wall and panes.
    let even = half_across * F::splat(4.0 * half[1] / floor) / pitch.max(F::splat(0.01));
    let blurred = smooth(F::splat(0.8), F::splat(2.6), pixel);
    let frame = cover(inside, pixel).lerp(even, blurred);
    let pane = cover(inside - F::splat(0.07), pixel).lerp(even * F::splat(0.85), blurred);
    let word = hash::<F>(column.to_int(), row.to_int(), coats.seed);
    let (tone, lit) = (share::<F>(word), share::<F>(word * F::Word::splat(0x9e37_79b1)));
    let none = F::splat(0.0);
    let (frame, pane) = (frame.or(fits, none), pane.or(fits, none));
    // Curtains behind some.
    let cloth = smooth(F::splat(0.55), F::splat(0.95), tone).lerp(F::splat(0.2), blurred);
    let glass = V3::splat(glam::Vec3::new(0.02, 0.026, 0.03))
        .lerp(V3::splat(glam::Vec3::new(0.30, 0.28, 0.25)), cloth);
    let white = V3::splat(glam::Vec3::splat(0.5)).lerp(coats.albedo, F::splat(0.3));
    coats.albedo = coats.albedo.lerp(white, frame).lerp(glass, pane);
    coats.shine = coats.shine.lerp(F::splat(0.09), pane);
    coats.rough = coats.rough.lerp(F::splat(0.04), pane);
    let lamp = smooth(F::splat(0.62), F::splat(0.66), lit).lerp(F::splat(0.36), blurred);
    let lamp = lamp * pane * F::splat(dark) * tone.mul_add(F::splat(0.7), F::splat(0.3));
    let warm = V3::splat(glam::Vec3::new(1.5, 1.0, 0.5));
    coats.glow = warm.mul_add(lamp, coats.glow);
}
