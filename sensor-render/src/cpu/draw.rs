//! What is drawn over the world, into the colours of cameras: the twin of draw.wgsl.

use glam::Vec3;

use crate::glyphs::{ADVANCE, GLYPHS, SIZE};
use crate::hit::T_MIN;
use crate::simd::LANES;
use crate::overlay::{Overlay, Rod, Text};
use crate::rays::Camera;

/// A text as high as this share of an image's rows has dots of one pixel.
const ROWS_PER_DOT: u32 = 240;
/// Nearer than this to a camera's plane no text is shown. Metres.
const NEAR_M: f32 = 0.05;
const BLACK: u32 = 0xff00_0000;

/// Draws into one piece of an image.
pub(crate) struct Brush<'a> {
    overlay: &'a Overlay,
    camera: &'a Camera,
    texts: Vec<Placed<'a>>,
    /// Rods that may be seen in the packet.
    near: Vec<u32>,
    stack: Vec<crate::bvh::Link>,
}

/// A text in an image.
struct Placed<'a> {
    text: &'a Text,
    depth: f32,
    left: f32,
    top: f32,
    /// Pixels of a dot.
    side: f32,
}

/// What is drawn at a pixel.
#[derive(Clone, Copy)]
struct Mark {
    t: f32,
    color: u32,
}

impl Mark {
    /// The nearer of two; of those as near, one that does not depend on their order.
    #[inline(always)]
    fn nearer(self, t: f32, color: u32) -> Mark {
        if t < self.t || (t == self.t && color < self.color) { Mark { t, color } } else { self }
    }
}

impl<'a> Brush<'a> {
    /// Nobody, if nothing is drawn.
    pub(crate) fn new(overlay: &'a Overlay, camera: &'a Camera) -> Option<Brush<'a>> {
        if overlay.is_empty() {
            return None;
        }
        let texts = overlay.texts.iter().filter_map(|text| place(text, camera)).collect();
        Some(Brush { overlay, camera, texts, near: Vec::new(), stack: Vec::new() })
    }

    /// Finds what may be seen in the 8 by 8 pixels from (x, y) on. Says whether there is anything.
    #[inline(never)]
    pub(crate) fn look_at(&mut self, x: u32, y: u32) -> bool {
        let Brush { overlay, camera, .. } = *self;
        self.near.clear();
        if !overlay.rods.is_empty() {
            let direction = |x: u32, y: u32| direction(camera, x, y).normalize_or(camera.forward);
            let corners = [(0, 0), (7, 0), (0, 7), (7, 7)].map(|(r, d)| direction(x + r, y + d));
            let axis = corners.iter().sum::<Vec3>().normalize_or(camera.forward);
            let cosine = corners.iter().map(|c| c.dot(axis)).fold(1.0, f32::min) - 1e-6;
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            let widening = overlay.pixels * camera.pixel;
            let is_near = |low: [f32; 3], high: [f32; 3]| {
                let (low, high) = (Vec3::from(low), Vec3::from(high));
                let (middle, half) = ((low + high) * 0.5 - camera.origin, (high - low) * 0.5);
                let half = half.length();
                let around = half + widening * (middle.length() + half);
                let along = middle.dot(axis);
                let across = (middle - axis * along).length();
                along > -around && across * cosine - along * sine <= around
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
        let is_close = |text: &Placed| {
            let [right, bottom] = [text.left + text.width(), text.top + text.height()];
            let (x, y) = (x as f32, y as f32);
            x + 8.0 >= text.left && x <= right && y + 8.0 >= text.top && y <= bottom
        };
        !self.near.is_empty() || self.texts.iter().any(is_close)
    }

    /// Draws over the colours of 4 by 4 pixels from (x, y) on, where nothing nearer than `depths`.
    #[inline(never)]
    pub(crate) fn paint(
        &self,
        x: u32,
        y: u32,
        depths: &[f32; LANES],
        colors: &mut [[u8; 4]; LANES],
    ) {
        for lane in 0..LANES as u32 {
            let (x, y) = (x + lane % 4, y + lane / 4);
            let direction = direction(self.camera, x, y);
            let mut mark = Mark { t: f32::INFINITY, color: !0 };
            for at in &self.near {
                let rod = &self.overlay.rods[*at as usize];
                if let Some(t) = meet(rod, self.camera, direction) {
                    mark = mark.nearer(t, rod.color);
                }
            }
            for text in &self.texts {
                if let Some(color) = text.dot(x as f32, y as f32) {
                    mark = mark.nearer(text.depth, color);
                }
            }
            // Sky is infinitely far away.
            if mark.t < depths[lane as usize] {
                colors[lane as usize] = mark.color.to_le_bytes();
            }
        }
    }
}

/// As long as the depth of 1.
#[inline(always)]
fn direction(camera: &Camera, x: u32, y: u32) -> Vec3 {
    let (x, y) = (x as f32 - camera.center[0], y as f32 - camera.center[1]);
    camera.forward + camera.right * x + camera.down * y
}

/// Where a ray meets the rod: where both are closest, and thence half the rod's thickness nearer.
#[inline(always)]
fn meet(rod: &Rod, camera: &Camera, direction: Vec3) -> Option<f32> {
    let begin = Vec3::from(rod.begin);
    let along = Vec3::from(rod.end) - begin;
    let from_begin = camera.origin - begin;
    let (a, b, c) = (direction.dot(direction), direction.dot(along), along.dot(along));
    let (d, e) = (direction.dot(from_begin), along.dot(from_begin));
    let apart = a * c - b * b;
    let share = if apart > 1e-6 * a * c { ((a * e - b * d) / apart).clamp(0.0, 1.0) } else { 0.0 };
    let t = (b * share - d) / a;
    let gap = from_begin + direction * t - along * share;
    let reach = rod.radius.max(rod.pixels * camera.pixel * t);
    let room = reach * reach - gap.dot(gap);
    let front = t - (room.max(0.0) / a).sqrt();
    (t > T_MIN && room >= 0.0).then(|| front.max(T_MIN))
}

fn place<'a>(text: &'a Text, camera: &Camera) -> Option<Placed<'a>> {
    let to = Vec3::from(text.at) - camera.origin;
    let depth = to.dot(camera.forward);
    if depth < NEAR_M || text.count == 0 {
        return None;
    }
    let side = (camera.height / ROWS_PER_DOT).max(1) as f32;
    let scale = 1.0 / (camera.pixel * camera.pixel * depth);
    let across = to.dot(camera.right) * scale + camera.center[0];
    let down = to.dot(camera.down) * scale + camera.center[1];
    let half = [(text.count * ADVANCE - 1) as f32, SIZE[1] as f32].map(|dots| dots * side * 0.5);
    Some(Placed { text, depth, left: across - half[0], top: down - half[1], side })
}

impl Placed<'_> {
    fn width(&self) -> f32 {
        (self.text.count * ADVANCE) as f32 * self.side
    }

    fn height(&self) -> f32 {
        (SIZE[1] + 1) as f32 * self.side
    }

    /// What it has at a pixel.
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
