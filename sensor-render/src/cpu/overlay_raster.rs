//! Draws debug shapes into the colour images of cameras. Twin of overlay_raster.wgsl.

use glam::Vec3;

use crate::glyphs::{ADVANCE, GLYPHS, SIZE};
use crate::hit::T_MIN;
use crate::overlay::{Capsule, Overlay, TEXT_NEAR_M, Text};
use crate::rays::Camera;
use crate::simd::LANES;

/// Number of image rows per pixel of a glyph's dot.
const ROWS_PER_DOT: u32 = 240;
const BLACK: u32 = 0xff00_0000;

/// Rasterizer for one tile of an image.
pub(crate) struct OverlayRaster<'a> {
    overlay: &'a Overlay,
    camera: &'a Camera,
    texts: Vec<ScreenText<'a>>,
    /// Capsules that may be visible in the current packet.
    near: Vec<u32>,
    stack: Vec<crate::bvh::Link>,
}

/// Text in image space.
struct ScreenText<'a> {
    text: &'a Text,
    depth: f32,
    left: f32,
    top: f32,
    /// Side length of a dot. Pixels.
    side: f32,
}

/// Nearest shape at a pixel.
#[derive(Clone, Copy)]
struct Fragment {
    t: f32,
    color: u32,
}

impl Fragment {
    /// Returns the nearer of two; at equal distance one that does not depend on their order.
    #[inline(always)]
    fn nearer(self, t: f32, color: u32) -> Fragment {
        if t < self.t || (t == self.t && color < self.color) { Fragment { t, color } } else { self }
    }
}

impl<'a> OverlayRaster<'a> {
    /// Returns a rasterizer; `None` if there are no shapes.
    pub(crate) fn new(overlay: &'a Overlay, camera: &'a Camera) -> Option<OverlayRaster<'a>> {
        if overlay.is_empty() {
            return None;
        }
        let texts = overlay.texts.iter().filter_map(|text| place(text, camera)).collect();
        Some(OverlayRaster { overlay, camera, texts, near: Vec::new(), stack: Vec::new() })
    }

    /// Finds the shapes that may be visible in the 8 × 8 pixels from (x, y) on. Returns whether
    /// there are any.
    #[inline(never)]
    pub(crate) fn find_shapes(&mut self, x: u32, y: u32) -> bool {
        let OverlayRaster { overlay, camera, .. } = *self;
        self.near.clear();
        if !overlay.capsules.is_empty() {
            // A lens bends the edges of the block by less than a pixel.
            let more = u32::from(camera.lens.is_some());
            let (left, top) = (x.saturating_sub(more), y.saturating_sub(more));
            let (right, bottom) = (x + 7 + more, y + 7 + more);
            let corners = [(left, top), (right, top), (left, bottom), (right, bottom)]
                .map(|(x, y)| camera.direction(x, y)?.try_normalize());
            let sum = corners.iter().flatten().sum::<Vec3>();
            let axis = sum.normalize_or(camera.forward);
            // Where the lens does not show a corner, every shape may be visible.
            let cosines = corners.iter().map(|corner| corner.map_or(-1.0, |c| c.dot(axis)));
            let cosine = (cosines.fold(1.0, f32::min) - 1e-6).max(-1.0);
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            let widening = overlay.pixels * camera.pixel;
            let is_near = |low: [f32; 3], high: [f32; 3]| {
                let (low, high) = (Vec3::from(low), Vec3::from(high));
                let (middle, half) = ((low + high) * 0.5 - camera.origin, (high - low) * 0.5);
                let half = half.length();
                let around = half + widening * (middle.length() + half);
                let along = middle.dot(axis);
                let across = (middle - axis * along).length();
                cosine < 0.0 || along > -around && across * cosine - along * sine <= around
            };
            self.stack.push(overlay.root);
            while let Some(link) = self.stack.pop() {
                if link.is_leaf() {
                    let (first, count) = link.primitives();
                    self.near.extend(first..first + count);
                } else {
                    let node = &overlay.nodes[link.0 as usize];
                    if is_near(node.low0, node.high0) {
                        self.stack.push(node.child0);
                    }
                    if is_near(node.low1, node.high1) {
                        self.stack.push(node.child1);
                    }
                }
            }
        }
        let is_close = |text: &ScreenText| {
            let [right, bottom] = [text.left + text.width(), text.top + text.height()];
            let (x, y) = (x as f32, y as f32);
            x + 8.0 >= text.left && x <= right && y + 8.0 >= text.top && y <= bottom
        };
        !self.near.is_empty() || self.texts.iter().any(is_close)
    }

    /// Draws over the colours of 4 × 4 pixels from (x, y) on, where no surface is nearer than the
    /// shape.
    #[inline(never)]
    pub(crate) fn draw(
        &self,
        x: u32,
        y: u32,
        depths: &[f32; LANES],
        colors: &mut [[u8; 4]; LANES],
    ) {
        for lane in 0..LANES as u32 {
            let (x, y) = (x + lane % 4, y + lane / 4);
            let Some(direction) = self.camera.direction(x, y) else { continue };
            let mut fragment = Fragment { t: f32::INFINITY, color: !0 };
            for at in &self.near {
                let capsule = &self.overlay.capsules[*at as usize];
                if let Some(t) = meet(capsule, self.camera, direction) {
                    fragment = fragment.nearer(t, capsule.color);
                }
            }
            for text in &self.texts {
                if let Some(color) = text.dot(x as f32, y as f32) {
                    fragment = fragment.nearer(text.depth, color);
                }
            }
            // The depth of the sky is infinite.
            if fragment.t < depths[lane as usize] {
                colors[lane as usize] = fragment.color.to_le_bytes();
            }
        }
    }
}

/// Returns the ray parameter of the hit: the point of closest approach, moved towards the camera by
/// half the chord through the capsule.
#[inline(always)]
fn meet(capsule: &Capsule, camera: &Camera, direction: Vec3) -> Option<f32> {
    let begin = Vec3::from(capsule.begin);
    let along = Vec3::from(capsule.end) - begin;
    let from_begin = camera.origin - begin;
    let (a, b, c) = (direction.dot(direction), direction.dot(along), along.dot(along));
    let (d, e) = (direction.dot(from_begin), along.dot(from_begin));
    let apart = a * c - b * b;
    let share = if apart > 1e-6 * a * c { ((a * e - b * d) / apart).clamp(0.0, 1.0) } else { 0.0 };
    let t = (b * share - d) / a;
    let gap = from_begin + direction * t - along * share;
    let reach = capsule.radius.max(capsule.pixels * camera.pixel * t);
    let room = reach * reach - gap.dot(gap);
    let front = t - (room.max(0.0) / a).sqrt();
    (t > T_MIN && room >= 0.0).then(|| front.max(T_MIN))
}

fn place<'a>(text: &'a Text, camera: &Camera) -> Option<ScreenText<'a>> {
    if text.count == 0 {
        return None;
    }
    let to = Vec3::from(text.at) - camera.origin;
    let ([across, down], depth) = camera.project(&camera.view(), to, TEXT_NEAR_M)?;
    let side = (camera.height / ROWS_PER_DOT).max(1) as f32;
    let half = [(text.count * ADVANCE - 1) as f32, SIZE[1] as f32].map(|dots| dots * side * 0.5);
    Some(ScreenText { text, depth, left: across - half[0], top: down - half[1], side })
}

impl ScreenText<'_> {
    fn width(&self) -> f32 {
        (self.text.count * ADVANCE) as f32 * self.side
    }

    fn height(&self) -> f32 {
        (SIZE[1] + 1) as f32 * self.side
    }

    /// Returns the colour at a pixel, if the text covers it.
    #[inline(always)]
    fn dot(&self, x: f32, y: f32) -> Option<u32> {
        let column = ((x - self.left) / self.side).floor() as i32;
        let row = ((y - self.top) / self.side).floor() as i32;
        if self.is_set(column, row) {
            return Some(self.text.color);
        }
        let is_shaded = self.text.shadow != 0 && self.is_set(column - 1, row - 1);
        is_shaded.then_some(BLACK)
    }

    #[inline(always)]
    fn is_set(&self, column: i32, row: i32) -> bool {
        let [across, down] = SIZE.map(|dots| dots as i32);
        if column < 0 || row < 0 || row >= down {
            return false;
        }
        let (letter, column) = (column / ADVANCE as i32, column % ADVANCE as i32);
        if letter >= self.text.count as i32 || column >= across {
            return false;
        }
        let glyph = GLYPHS[self.text.letters[letter as usize] as usize];
        glyph >> (row * across + column) & 1 != 0
    }
}
