//! The number of pixels that an actor or object would cover if nothing occluded it: its mesh drawn
//! alone.

use glam::{Affine3A, Vec3A};
use mesh::Mesh;

use crate::collect::sensors::Pinhole;

/// The near plane, in metres.
pub(crate) const NEAR_M: f32 = 0.05;

/// A part of a mesh.
#[derive(Clone, Copy)]
pub(crate) struct Part<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    /// The index in `triangles` that means the first of `positions`.
    pub(crate) first: u32,
}

impl Part<'_> {
    /// Returns a whole mesh.
    pub(crate) fn whole(mesh: &Mesh) -> Part<'_> {
        Part { positions: &mesh.positions, triangles: &mesh.triangles, first: 0 }
    }
}

/// A raster of one bit per pixel, reused between drawings.
#[derive(Default)]
pub(crate) struct Silhouette {
    bits: Vec<u64>,
    words_per_row: usize,
    rows: [usize; 2],
    /// The pixels of the corners, and their depths.
    corners: Vec<([f32; 2], f32)>,
}

impl Silhouette {
    /// Counts the pixels whose centre lies on the mesh, as the camera sees it. Rays are cast by the
    /// same rule.
    pub(crate) fn pixels(
        &mut self,
        part: Part,
        optical_from_mesh: &Affine3A,
        camera: &Pinhole,
    ) -> u32 {
        self.words_per_row = (camera.width as usize).div_ceil(64);
        self.bits.resize(self.words_per_row * camera.height as usize, 0);
        self.rows = [camera.height as usize, 0];
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        let optical =
            |position: [f32; 3]| optical_from_mesh.transform_point3a(Vec3A::from_array(position));
        for position in part.positions {
            let corner = optical(*position);
            corners.push((camera.project(corner), corner.z));
        }
        for triangle in part.triangles {
            let [a, b, c] = *triangle;
            let first = part.first;
            let [a, b, c] = [(a - first) as usize, (b - first) as usize, (c - first) as usize];
            let ((a_px, a_z), (b_px, b_z), (c_px, c_z)) = (corners[a], corners[b], corners[c]);
            if a_z.min(b_z).min(c_z) >= NEAR_M {
                self.fill([a_px, b_px, c_px], camera);
            } else {
                self.clip([a, b, c].map(|i| optical(part.positions[i])), camera);
            }
        }
        self.corners = corners;
        self.wipe()
    }

    /// Fills what lies before the near plane.
    fn clip(&mut self, corners: [Vec3A; 3], camera: &Pinhole) {
        let mut before = [Vec3A::ZERO; 4];
        let mut count = 0;
        for (index, here) in corners.iter().enumerate() {
            let next = corners[(index + 1) % 3];
            if here.z >= NEAR_M {
                before[count] = *here;
                count += 1;
            }
            if (here.z >= NEAR_M) != (next.z >= NEAR_M) {
                before[count] = here.lerp(next, (NEAR_M - here.z) / (next.z - here.z));
                count += 1;
            }
        }
        let pixels = before.map(|p| camera.project(p));
        for last in 2..count {
            self.fill([pixels[0], pixels[last - 1], pixels[last]], camera);
        }
    }

    /// Sets the pixels whose centres lie between the edges, row by row.
    fn fill(&mut self, corners: [[f32; 2]; 3], camera: &Pinhole) {
        let [[ax, ay], [bx, by], [cx, cy]] = corners;
        let first = pixel_from(ay.min(by).min(cy));
        // A centre on the lower or the right edge is outside, see below.
        let end = pixel_from(ay.max(by).max(cy)).min(camera.height as usize);
        // Most triangles of a far object lie between the centres.
        if first >= end || pixel_from(ax.min(bx).min(cx)) >= pixel_from(ax.max(bx).max(cx)) {
            return;
        }
        for row in first..end {
            let y = row as f32 + 0.5;
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for index in 0..3 {
                let ([ax, ay], [bx, by]) = (corners[index], corners[(index + 1) % 3]);
                if (ay <= y) == (by <= y) {
                    continue;
                }
                let x = ax + (bx - ax) * ((y - ay) / (by - ay));
                (left, right) = (left.min(x), right.max(x));
            }
            let (from, to) = (pixel_from(left), pixel_from(right).min(camera.width as usize));
            if from < to {
                self.set(row, from, to);
                self.rows = [self.rows[0].min(row), self.rows[1].max(row + 1)];
            }
        }
    }

    fn set(&mut self, row: usize, from: usize, to: usize) {
        let line = &mut self.bits[row * self.words_per_row..][..self.words_per_row];
        for (word, bits) in line.iter_mut().enumerate().take(to.div_ceil(64)).skip(from / 64) {
            let low = from.saturating_sub(word * 64).min(63) as u32;
            let high = (to - word * 64).min(64) as u32;
            *bits |= (u64::MAX << low) & (u64::MAX >> (64 - high));
        }
    }

    /// Counts the set pixels and clears the raster.
    fn wipe(&mut self) -> u32 {
        let [first, end] = self.rows;
        if first >= end {
            return 0;
        }
        let drawn = &mut self.bits[first * self.words_per_row..end * self.words_per_row];
        let count = drawn.iter().map(|word| word.count_ones()).sum();
        drawn.fill(0);
        count
    }
}

/// Returns the first pixel whose centre is not below an edge: the edge less 0.5, rounded up.
fn pixel_from(edge: f32) -> usize {
    // `f32::ceil` is a function call on processors that lack the instruction.
    let least = edge - 0.5;
    let cut = least as i32;
    (cut + i32::from((cut as f32) < least)).max(0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    const CAMERA: Pinhole = Pinhole { width: 200, height: 100, focal_px: 100.0 };

    /// A wall of 2 m by 1 m, centred at the origin, facing −z.
    fn wall() -> Part<'static> {
        const POSITIONS: [[f32; 3]; 4] =
            [[-1.0, -0.5, 0.0], [1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [-1.0, 0.5, 0.0]];
        Part { positions: &POSITIONS, triangles: &[[7, 8, 9], [7, 9, 10]], first: 7 }
    }

    fn pixels(x: f32, y: f32, z: f32) -> u32 {
        let at = Affine3A::from_translation(Vec3::new(x, y, z));
        Silhouette::default().pixels(wall(), &at, &CAMERA)
    }

    #[test]
    fn a_wall_fills_its_size_over_its_distance() {
        assert_eq!(pixels(0.0, 0.0, 4.0), 50 * 25, "2 m and 1 m at 4 m, 100 px a radian");
        assert_eq!(
            pixels(0.0, 0.0, 8.0),
            25 * 12,
            "a row whose middle is not covered is not counted"
        );
    }

    #[test]
    fn pixels_outside_or_behind_do_not_count() {
        assert_eq!(pixels(4.0, 0.0, 4.0), 25 * 25, "its right half is beyond the right edge");
        assert_eq!(pixels(-30.0, 0.0, 4.0), 0);
        assert_eq!(pixels(0.0, 0.0, -4.0), 0);
    }

    #[test]
    fn a_mesh_that_reaches_behind_the_camera_is_clipped_not_mirrored() {
        // A floor 0.5 m below, from 1 m behind to 1 m ahead: it fills the bottom of the image.
        let turn = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let floor = Affine3A::from_rotation_translation(turn, Vec3::new(0.0, 0.25, 0.0));
        let count = Silhouette::default().pixels(wall(), &floor, &CAMERA);
        // Row r + 0.5 below the middle sees 0.25 m down at z = 25 / (r + 0.5), nearer than 0.5 m
        // only beyond the image's edge.
        assert_eq!(count, 0);
        let lower = Affine3A::from_rotation_translation(turn, Vec3::new(0.0, 0.2, 0.0));
        let count = Silhouette::default().pixels(wall(), &lower, &CAMERA);
        assert_eq!(count, 10 * 200, "the ten rows that see it nearer than 0.5 m");
    }

    #[test]
    fn a_second_drawing_begins_on_an_empty_raster() {
        let mut raster = Silhouette::default();
        let at = Affine3A::from_translation(Vec3::new(0.0, 0.0, 4.0));
        let first = raster.pixels(wall(), &at, &CAMERA);
        assert_eq!(raster.pixels(wall(), &at, &CAMERA), first);
        let hidden = Affine3A::from_translation(Vec3::new(0.0, 0.0, -4.0));
        assert_eq!(raster.pixels(wall(), &hidden, &CAMERA), 0);
    }
}
