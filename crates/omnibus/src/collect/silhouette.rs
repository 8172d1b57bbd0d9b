//! The number of pixels that an actor would cover if nothing occluded it: its mesh drawn alone.

use glam::{Affine3A, Vec3A};
use mesh::Mesh;

use crate::collect::sensors::Pinhole;

/// The near plane, in metres.
pub(crate) const NEAR_M: f32 = 0.05;

/// A raster of one bit per pixel, reused between drawings.
#[derive(Default)]
pub(crate) struct Silhouette {
    bits: Vec<u64>,
    words_per_row: usize,
    rows: [usize; 2],
    corners: Vec<Vec3A>,
}

impl Silhouette {
    /// Counts the pixels whose centre lies on the mesh, as the camera sees it. Rays are cast by the
    /// same rule.
    pub(crate) fn pixels(
        &mut self,
        mesh: &Mesh,
        optical_from_mesh: &Affine3A,
        camera: &Pinhole,
    ) -> u32 {
        self.words_per_row = (camera.width as usize).div_ceil(64);
        self.bits.resize(self.words_per_row * camera.height as usize, 0);
        self.rows = [camera.height as usize, 0];
        self.corners.clear();
        let corner = |p: &[f32; 3]| optical_from_mesh.transform_point3a(Vec3A::from_array(*p));
        self.corners.extend(mesh.positions.iter().map(corner));
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| self.corners[i as usize]);
            self.triangle([a, b, c], camera);
        }
        self.wipe()
    }

    fn triangle(&mut self, corners: [Vec3A; 3], camera: &Pinhole) {
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
        let ys = corners.map(|c| c[1]);
        let top = ys.iter().copied().fold(f32::INFINITY, f32::min);
        let bottom = ys.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let first = (top - 0.5).ceil().max(0.0) as usize;
        let end = ((bottom - 0.5).floor() + 1.0).clamp(0.0, camera.height as f32) as usize;
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
            let from = (left - 0.5).ceil().max(0.0) as usize;
            let to = (right - 0.5).ceil().clamp(0.0, camera.width as f32) as usize;
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};
    use mesh::{Face, Material, Tag};

    const CAMERA: Pinhole = Pinhole { width: 200, height: 100, focal_px: 100.0 };

    /// A wall of 2 m by 1 m, centred at the origin, facing −z.
    fn wall() -> Mesh {
        let mut mesh = Mesh::default();
        let face = Face::new(Tag::Wall, Material::Concrete, 0);
        let at = |x: f32, y: f32| [x, y, 0.0];
        mesh.quad([at(-1.0, -0.5), at(1.0, -0.5), at(1.0, 0.5), at(-1.0, 0.5)], face);
        mesh
    }

    fn pixels(x: f32, y: f32, z: f32) -> u32 {
        let at = Affine3A::from_translation(Vec3::new(x, y, z));
        Silhouette::default().pixels(&wall(), &at, &CAMERA)
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
        let count = Silhouette::default().pixels(&wall(), &floor, &CAMERA);
        // Row r + 0.5 below the middle sees 0.25 m down at z = 25 / (r + 0.5), nearer than 0.5 m
        // only beyond the image's edge.
        assert_eq!(count, 0);
        let lower = Affine3A::from_rotation_translation(turn, Vec3::new(0.0, 0.2, 0.0));
        let count = Silhouette::default().pixels(&wall(), &lower, &CAMERA);
        assert_eq!(count, 10 * 200, "the ten rows that see it nearer than 0.5 m");
    }

    #[test]
    fn a_second_drawing_begins_on_an_empty_raster() {
        let mut raster = Silhouette::default();
        let at = Affine3A::from_translation(Vec3::new(0.0, 0.0, 4.0));
        let first = raster.pixels(&wall(), &at, &CAMERA);
        assert_eq!(raster.pixels(&wall(), &at, &CAMERA), first);
        let hidden = Affine3A::from_translation(Vec3::new(0.0, 0.0, -4.0));
        assert_eq!(raster.pixels(&wall(), &hidden, &CAMERA), 0);
    }
}
