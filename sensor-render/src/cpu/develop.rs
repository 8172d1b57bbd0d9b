//! Develops the films of cameras with effects. Twin of develop.wgsl.

use glam::Vec3;

use super::overlay_raster::OverlayRaster;
use crate::film::{
    BIN_FIRST, BINS, BINS_PER_STOP, COARSER, Development, METER_SHARES, OUTER_RADIUS, OUTER_SHARE,
};
use crate::light::Light;
use crate::outputs::TILE_ROWS;
use crate::rays::Camera;
use crate::simd::LANES;
use crate::tone_curve::{CURVE, CURVE_FIRST_BITS, CURVE_STEP_BITS, LUMA};
use crate::world::World;

/// Parts of a stop's bin that a cell is divided into.
const PARTS: u32 = 256;

/// Film of one camera.
pub(crate) struct Film {
    how: Development,
    width: u32,
    height: u32,
    /// Mean radiance of each pixel, and depth of the nearest surface.
    pub(crate) pixels: Vec<[f32; 4]>,
    /// Factor from radiance to exposed radiance.
    exposure: f32,
    fine: Cells,
    coarse: Cells,
}

impl Film {
    /// Returns an empty film; `None` if the camera has no effects.
    pub(crate) fn new(camera: &Camera, world: &World, light: &Light) -> Option<Film> {
        let how = Development::new(camera, light, world.delta_nanos)?;
        let pixels = vec![[0.0; 4]; camera.width as usize * camera.height as usize];
        let (fine, coarse) = (Cells::new(how.grid), Cells::new(how.coarse));
        let Camera { width, height, .. } = *camera;
        Some(Film { how, width, height, pixels, exposure: 0.0, fine, coarse })
    }

    /// Reads the meter, and computes bloom.
    pub(crate) fn expose(&mut self) {
        let how = &self.how;
        self.fine = Cells::of_pixels(&self.pixels, [self.width, self.height], how);
        self.exposure = if how.exposure > 0.0 {
            how.exposure
        } else {
            let metered = metered(&self.fine.radiances);
            (how.key / metered).clamp(how.exposure_min, how.exposure_max)
        };
        if how.bloom > 0.0 {
            self.coarse = self.fine.coarser(how.coarse);
            self.fine.blur(how.bloom_radius);
            self.coarse.blur(how.bloom_radius * (OUTER_RADIUS / COARSER as f32));
        }
    }

    /// Develops rows of the image from row `first` on, and draws the debug shapes.
    pub(crate) fn print(&self, world: &World, camera: &Camera, first: u32, rows: &mut [[u8; 4]]) {
        for (row, y) in rows.chunks_exact_mut(self.width as usize).zip(first..) {
            for (color, x) in row.iter_mut().zip(0..) {
                *color = self.color(x, y);
            }
        }
        if let Some(mut raster) = OverlayRaster::new(&world.overlay, camera) {
            self.draw(&mut raster, first, rows);
        }
    }

    /// Returns the colour of a pixel.
    fn color(&self, x: u32, y: u32) -> [u8; 4] {
        let how = &self.how;
        let from_center = [x as f32 - how.center[0], y as f32 - how.center[1]];
        let mut light = self.focused([x, y], from_center);
        if how.bloom > 0.0 {
            let at = [x, y].map(|pixel| (pixel as f32 + 0.5) / how.side as f32);
            let inner = self.fine.between(at.map(|at| at - 0.5));
            let outer = self.coarse.between(at.map(|at| at / COARSER as f32 - 0.5));
            light = light.lerp(inner.lerp(outer, OUTER_SHARE), how.bloom);
        }
        let [across, down] = [0, 1].map(|side| from_center[side] * how.pixel[side]);
        let stretch = 1.0 + across * across + down * down;
        let natural = 1.0 / (stretch * stretch);
        let exposed = light * (self.exposure * (1.0 + (natural - 1.0) * how.vignette));
        let noisy = if how.shot > 0.0 {
            let deviation = (exposed * how.shot + how.read).to_array().map(f32::sqrt);
            let normal = [0, 1, 2].map(|channel| normal(x, y, how.seed, channel));
            exposed + Vec3::from(deviation) * Vec3::from(normal)
        } else {
            exposed
        };
        let balanced = how.balance.map(|row| Vec3::from_slice(&row).dot(noisy));
        let values = Vec3::from(balanced.map(|light| curve(&how.curve, light)));
        let muted = values.lerp(Vec3::splat(values.dot(LUMA)), how.muted);
        let [red, green, blue] = muted.to_array().map(|value| (value + 0.5) as u8);
        [red, green, blue, 255]
    }

    /// Returns the radiance at a pixel, whose red and blue parts come from beside it with chromatic
    /// aberration.
    fn focused(&self, [x, y]: [u32; 2], from_center: [f32; 2]) -> Vec3 {
        let how = &self.how;
        let here = self.pixels[(y * self.width + x) as usize];
        if how.chromatic_aberration == 0.0 {
            return Vec3::from_slice(&here);
        }
        let scale = 1.0 + how.chromatic_aberration;
        let at = |scale: f32| [0, 1].map(|side| how.center[side] + from_center[side] * scale);
        let size = [self.width, self.height];
        let pixel = |x: u32, y: u32| Vec3::from_slice(&self.pixels[(y * self.width + x) as usize]);
        let red = between(at(1.0 / scale), size, pixel).x;
        let blue = between(at(scale), size, pixel).z;
        Vec3::new(red, here[1], blue)
    }

    /// Draws the debug shapes in front of the surfaces.
    fn draw(&self, raster: &mut OverlayRaster, first: u32, rows: &mut [[u8; 4]]) {
        let (width, count) = (self.width as usize, rows.len() as u32 / self.width);
        for x in (0..self.width).step_by(8) {
            if !raster.find_shapes(x, first) {
                continue;
            }
            for (right, below) in [(0, 0), (4, 0), (0, 4), (4, 4)] {
                let left = x + right;
                let lanes: [Option<usize>; LANES] = std::array::from_fn(|lane| {
                    let (x, y) = (left + lane as u32 % 4, below + lane as u32 / 4);
                    (x < self.width && y < count).then_some(y as usize * width + x as usize)
                });
                let behind = first as usize * width;
                let depths = lanes.map(|at| at.map_or(0.0, |at| self.pixels[behind + at][3]));
                let mut colors = lanes.map(|at| at.map_or([0; 4], |at| rows[at]));
                raster.draw(left, first + below, &depths, &mut colors);
                for (at, color) in lanes.into_iter().zip(colors) {
                    if let Some(at) = at {
                        rows[at] = color;
                    }
                }
            }
        }
    }
}

const _: () = assert!(TILE_ROWS == 8);

/// Mean radiances on a grid.
struct Cells {
    columns: u32,
    rows: u32,
    radiances: Vec<Vec3>,
}

impl Cells {
    fn new([columns, rows]: [u32; 2]) -> Cells {
        Cells { columns, rows, radiances: vec![Vec3::ZERO; (columns * rows) as usize] }
    }

    /// Returns the means of blocks of pixels.
    fn of_pixels(pixels: &[[f32; 4]], size: [u32; 2], how: &Development) -> Cells {
        let pixel = |x: u32, y: u32| Vec3::from_slice(&pixels[(y * size[0] + x) as usize]);
        Cells::means(how.grid, how.side, size, pixel)
    }

    /// Returns the means of blocks of these cells.
    fn coarser(&self, grid: [u32; 2]) -> Cells {
        let cell = |x: u32, y: u32| self.radiances[(y * self.columns + x) as usize];
        Cells::means(grid, COARSER, [self.columns, self.rows], cell)
    }

    /// Returns the means of blocks of `side` × `side` elements of an image of a size.
    fn means(
        grid: [u32; 2],
        side: u32,
        [width, height]: [u32; 2],
        element: impl Fn(u32, u32) -> Vec3,
    ) -> Cells {
        let mut cells = Cells::new(grid);
        for (cell, number) in cells.radiances.iter_mut().zip(0..) {
            let [left, top] = [number % grid[0] * side, number / grid[0] * side];
            let (right, bottom) = ((left + side).min(width), (top + side).min(height));
            let mut sum = Vec3::ZERO;
            for y in top..bottom {
                for x in left..right {
                    sum += element(x, y);
                }
            }
            *cell = sum / ((right - left) * (bottom - top)) as f32;
        }
        cells
    }

    /// Blurs with a Gaussian of a standard deviation in cells. Beyond the edges lies what lies at them.
    fn blur(&mut self, deviation: f32) {
        let reach = (3.0 * deviation).ceil() as i32;
        let weights: Vec<f32> =
            (-reach..=reach).map(|away| gauss(away as f32, deviation)).collect();
        let whole = 1.0 / weights.iter().sum::<f32>();
        let (columns, rows) = (self.columns as i32, self.rows as i32);
        let across = |cells: &[Vec3], along: [i32; 2]| -> Vec<Vec3> {
            let cell = |number: i32| {
                let [x, y] = [number % columns, number / columns];
                let mut sum = Vec3::ZERO;
                for (weight, away) in weights.iter().zip(-reach..) {
                    let x = (x + away * along[0]).clamp(0, columns - 1);
                    let y = (y + away * along[1]).clamp(0, rows - 1);
                    sum += cells[(y * columns + x) as usize] * *weight;
                }
                sum * whole
            };
            (0..columns * rows).map(cell).collect()
        };
        self.radiances = across(&self.radiances, [1, 0]);
        self.radiances = across(&self.radiances, [0, 1]);
    }

    /// Returns the radiance at a place in cells from the centre of the first one.
    fn between(&self, at: [f32; 2]) -> Vec3 {
        let cell = |x: u32, y: u32| self.radiances[(y * self.columns + x) as usize];
        between(at, [self.columns, self.rows], cell)
    }
}

/// Interpolates linearly at a place in elements from the centre of the first one; beyond the edges lies
/// what lies at them.
fn between(at: [f32; 2], size: [u32; 2], element: impl Fn(u32, u32) -> Vec3) -> Vec3 {
    let [x, y] = [0, 1].map(|side| at[side].clamp(0.0, (size[side] - 1) as f32));
    let (left, top) = (x as u32, y as u32);
    let (right, bottom) = ((left + 1).min(size[0] - 1), (top + 1).min(size[1] - 1));
    let (u, v) = (x - left as f32, y - top as f32);
    let above = element(left, top).lerp(element(right, top), u);
    let below = element(left, bottom).lerp(element(right, bottom), u);
    above.lerp(below, v)
}

fn gauss(away: f32, deviation: f32) -> f32 {
    (-0.5 * away * away / (deviation * deviation)).exp()
}

/// Returns the mean of a logarithmic light meter, without the darkest and the brightest cells and those that
/// the lens does not show.
fn metered(cells: &[Vec3]) -> f32 {
    let mut bins = [0u32; BINS];
    for cell in cells {
        let luminance = luminance(*cell);
        if luminance > 0.0 {
            let place = (luminance.log2() - BIN_FIRST) * BINS_PER_STOP;
            let place = place.clamp(0.0, BINS as f32 - 1.001);
            let bin = place as usize;
            // Divided between two bins, so that the mean is as exact as the logarithm.
            let upper = ((place - bin as f32) * PARTS as f32) as u32;
            bins[bin] += PARTS - upper;
            bins[bin + 1] += upper;
        }
    }
    let total = bins.iter().sum::<u32>() as f32;
    let [low, high] = METER_SHARES.map(|share| total * share);
    let (mut passed, mut sum, mut weight) = (0.0f32, 0.0, 0.0f32);
    for (count, bin) in bins.into_iter().zip(0u16..) {
        let next = passed + count as f32;
        let counted = (next.min(high) - passed.max(low)).max(0.0);
        sum += counted * (BIN_FIRST + f32::from(bin) * (1.0 / BINS_PER_STOP));
        weight += counted;
        passed = next;
    }
    // A black image has no light to measure.
    if weight > 0.0 { (sum / weight).exp2() } else { BIN_FIRST.exp2() }
}

/// Returns the luminance of a linear colour, ITU-R BT.709.
fn luminance(color: Vec3) -> f32 {
    color.x * 0.2126 + color.y * 0.7152 + color.z * 0.0722
}

/// Returns a random number with mean 0 and variance 1: the sum of four equally distributed ones, which has
/// nearly a normal distribution up to 3.5 standard deviations.
fn normal(x: u32, y: u32, seed: u32, channel: u32) -> f32 {
    let mut sum = 0;
    for word in [2 * channel, 2 * channel + 1] {
        let word = hash(x, y, seed.wrapping_add(word.wrapping_mul(0x68bc_21eb)));
        sum += (word & 0xffff) + (word >> 16);
    }
    // Each has a variance of 1 / 12 of the square of its range.
    (sum as f32 - 2.0 * 65_535.0) * (1.732_050_8 / 65_536.0)
}

/// Returns the hash of one pixel; see `hash_of` in grain.wgsl.
fn hash(x: u32, y: u32, seed: u32) -> u32 {
    let h = x.wrapping_mul(0x9e37_79b1).wrapping_add(y.wrapping_mul(0x85eb_ca77));
    let h = h.wrapping_add(seed);
    let h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
    let h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
    h ^ h >> 15
}

/// Returns the value of a pixel by the tone curve, from 0 to 255.
fn curve(table: &[f32; CURVE], light: f32) -> f32 {
    let last = CURVE_FIRST_BITS + ((CURVE as u32 - 1) << CURVE_STEP_BITS) - 1;
    let low = f32::from_bits(CURVE_FIRST_BITS);
    let bits = light.max(low).to_bits().min(last) - CURVE_FIRST_BITS;
    let entry = (bits >> CURVE_STEP_BITS) as usize;
    let part = (bits & ((1 << CURVE_STEP_BITS) - 1)) as f32 / (1 << CURVE_STEP_BITS) as f32;
    table[entry] + (table[entry + 1] - table[entry]) * part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_mean_0_and_variance_1_and_differs_between_channels_and_frames() {
        let of = |seed: u32, channel: u32| -> Vec<f32> {
            (0..40_000).map(|pixel| normal(pixel % 200, pixel / 200, seed, channel)).collect()
        };
        let all = [of(1, 0), of(1, 1), of(2, 0)];
        for numbers in &all {
            let mean = numbers.iter().sum::<f32>() / numbers.len() as f32;
            let variance = numbers.iter().map(|x| x * x).sum::<f32>() / numbers.len() as f32;
            assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
        }
        for other in &all[1..] {
            let product = all[0].iter().zip(other).map(|(a, b)| a * b).sum::<f32>();
            assert!((product / 40_000.0).abs() < 0.02, "{product}");
        }
    }

    #[test]
    fn the_meter_reads_the_mean_of_logarithms_without_the_extremes() {
        let grey = |radiance: f32| Vec3::splat(radiance);
        let half = [vec![grey(0.125); 50], vec![grey(0.5); 50]].concat();
        assert!((metered(&half) - 0.25).abs() < 1e-3, "{}", metered(&half));
        let lamp = [vec![grey(0.25); 95], vec![grey(1000.0); 5]].concat();
        assert!((metered(&lamp) - 0.25).abs() < 1e-3, "{}", metered(&lamp));
        let dark = [vec![grey(0.25); 40], vec![grey(0.0); 60]].concat();
        assert!((metered(&dark) - 0.25).abs() < 1e-3, "outside of the lens {}", metered(&dark));
        assert!(metered(&[Vec3::ZERO; 9]) > 0.0);
    }

    #[test]
    fn bloom_keeps_the_light_and_blurs_by_its_radius() {
        let mut cells = Cells::new([81, 61]);
        cells.radiances[30 * 81 + 40] = Vec3::splat(100.0);
        cells.blur(3.0);
        let sum: f32 = cells.radiances.iter().map(|cell| cell.x).sum();
        assert!((sum - 100.0).abs() < 0.01, "{sum}");
        let variance = |side: fn(usize) -> f32| {
            let cells = cells.radiances.iter().enumerate();
            cells.map(|(at, cell)| cell.x * side(at).powi(2)).sum::<f32>() / sum
        };
        for variance in
            [variance(|at| (at % 81) as f32 - 40.0), variance(|at| (at / 81) as f32 - 30.0)]
        {
            assert!((variance.sqrt() - 3.0).abs() < 0.06, "{variance}");
        }
    }
}
