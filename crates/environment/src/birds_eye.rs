//! The bird's-eye raster: what is around a vehicle, seen from above, straight ahead upwards.

use glam::Vec2;

use crate::{
    lidar::UprightBox,
    road_raster::{MARKING, ROAD, RoadRaster},
};

/// The channels of a bird's-eye raster, in this order: where vehicles drive, road markings, the
/// route, other actors, solid objects, the ego vehicle.
pub const BIRDS_EYE_CHANNELS: usize = 6;
const ROUTE: usize = 2;
pub(crate) const ACTORS: usize = 3;
pub(crate) const SOLIDS: usize = 4;
pub(crate) const EGO: usize = 5;

/// A bird's-eye raster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BirdsEye {
    /// Pixels along an edge, 8 to 512.
    pub size_px: usize,
    /// Edge of a pixel. Metres, 0.1 to 4.
    pub pixel_m: f32,
}

impl Default for BirdsEye {
    fn default() -> BirdsEye {
        BirdsEye { size_px: 84, pixel_m: 0.5 }
    }
}

/// A raster while it is drawn.
pub(crate) struct Canvas<'a> {
    size: usize,
    pixels_per_m: f32,
    /// The middle of the raster in world space.
    origin: Vec2,
    /// Upwards, of unit length.
    forward: Vec2,
    pixels: &'a mut [u8],
}

impl<'a> Canvas<'a> {
    /// Begins an empty raster in `out`.
    pub(crate) fn new(
        of: &BirdsEye,
        origin: Vec2,
        forward: Vec2,
        out: &'a mut Vec<u8>,
    ) -> Canvas<'a> {
        out.clear();
        out.resize(BIRDS_EYE_CHANNELS * of.size_px * of.size_px, 0);
        Canvas { size: of.size_px, pixels_per_m: 1.0 / of.pixel_m, origin, forward, pixels: out }
    }

    /// Returns the distance from the middle to a corner. Metres.
    pub(crate) fn reach_m(&self) -> f32 {
        0.5 * self.size as f32 / self.pixels_per_m * std::f32::consts::SQRT_2
    }

    fn channel(&mut self, channel: usize) -> &mut [u8] {
        let area = self.size * self.size;
        &mut self.pixels[channel * area..(channel + 1) * area]
    }

    /// Draws roads and markings.
    pub(crate) fn roads(&mut self, raster: &RoadRaster) {
        let (size, area) = (self.size, self.size * self.size);
        let pixel_m = 1.0 / self.pixels_per_m;
        let (down, right) = (-self.forward * pixel_m, -self.forward.perp() * pixel_m);
        let middle = 0.5 * size as f32 - 0.5;
        let corner = self.origin - (down + right) * middle;
        let (roads, markings) = self.pixels[..2 * area].split_at_mut(area);
        let rows = roads.chunks_exact_mut(size).zip(markings.chunks_exact_mut(size));
        for (row, (roads, markings)) in rows.enumerate() {
            let left = corner + down * row as f32;
            for (column, (road, marking)) in roads.iter_mut().zip(markings).enumerate() {
                let bits = raster.at(left + right * column as f32);
                *road = if bits & ROAD != 0 { 255 } else { 0 };
                *marking = if bits & MARKING != 0 { 255 } else { 0 };
            }
        }
    }

    /// Draws a stretch of the route as wide as its lane.
    pub(crate) fn route(&mut self, from: Vec2, to: Vec2, half_width_m: f32) {
        let along = to - from;
        let length = along.length();
        if length > 0.0 {
            let half = Vec2::new(0.5 * length, half_width_m);
            self.rectangle(ROUTE, 0.5 * (from + to), half, along / length);
        }
    }

    /// Draws a box from above.
    pub(crate) fn upright_box(&mut self, channel: usize, b: &UprightBox) {
        self.rectangle(channel, b.center.truncate(), b.half_extents_m.truncate(), b.axis);
    }

    /// Sets the pixels whose centres lie in a rectangle with the given direction of its first edge.
    fn rectangle(&mut self, channel: usize, center: Vec2, half_m: Vec2, axis: Vec2) {
        // In pixels, right and down from the upper left corner.
        let (forward, scale) = (self.forward, self.pixels_per_m);
        let turned = |v: Vec2| Vec2::new(-forward.perp_dot(v), -forward.dot(v));
        let size = self.size as f32;
        let center = turned(center - self.origin) * scale + 0.5 * size;
        // A thin thing is as wide as a pixel.
        let (axis, half) = (turned(axis), (half_m * scale).max(Vec2::splat(0.5)));
        let reach = Vec2::new(
            axis.x.abs() * half.x + axis.y.abs() * half.y,
            axis.y.abs() * half.x + axis.x.abs() * half.y,
        );
        let low = (center - reach - 0.5).ceil().max(Vec2::ZERO);
        let high = (center + reach - 0.5).floor().min(Vec2::splat(size - 1.0));
        if !(low.x <= high.x && low.y <= high.y) {
            return;
        }
        let (columns, width) = (low.x as usize..=high.x as usize, self.size);
        let pixels = self.channel(channel);
        for row in low.y as usize..=high.y as usize {
            for column in columns.clone() {
                let offset = Vec2::new(column as f32, row as f32) + 0.5 - center;
                if axis.dot(offset).abs() <= half.x && axis.perp_dot(offset).abs() <= half.y {
                    pixels[row * width + column] = 255;
                }
            }
        }
    }
}
