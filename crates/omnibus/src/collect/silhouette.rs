//! The pixels that an actor or object would cover if nothing occluded it: its mesh drawn alone.

use glam::{Affine3A, Vec3A};
use mesh::Mesh;

use crate::collect::camera_model::{CameraModel, NEAR_M};

/// The most halvings of the edges of a triangle that a lens bends, and the deviation from a straight edge
/// from which on it is halved, in pixels.
const HALVINGS_MAX: u32 = 6;
const BEND_MAX_PX: f32 = 0.1;

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
    /// The pixels of the corners; `None` where the camera shows nothing.
    corners: Vec<Option<[f32; 2]>>,
}

impl Silhouette {
    /// Begins a drawing in the images of a camera.
    pub(crate) fn begin(&mut self, camera: &CameraModel) {
        self.wipe();
        self.words_per_row = (camera.width as usize).div_ceil(64);
        self.bits.resize(self.words_per_row * camera.height as usize, 0);
        self.rows = [camera.height as usize, 0];
    }

    /// Adds the pixels whose centre lies on the mesh, as the camera sees it. Rays are cast by the same
    /// rule.
    pub(crate) fn draw(&mut self, part: Part, optical_from_mesh: &Affine3A, camera: &CameraModel) {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        let optical =
            |position: [f32; 3]| optical_from_mesh.transform_point3a(Vec3A::from_array(position));
        corners.extend(part.positions.iter().map(|position| camera.project(optical(*position))));
        for triangle in part.triangles {
            let [a, b, c] = triangle.map(|corner| (corner - part.first) as usize);
            let pixels = [corners[a], corners[b], corners[c]];
            let place = || [a, b, c].map(|i| optical(part.positions[i]));
            match (camera.is_pinhole(), pixels) {
                (true, [Some(a), Some(b), Some(c)]) => self.fill([a, b, c], camera),
                (true, _) => self.clip(place(), camera),
                (false, _) => self.bend(place(), pixels, camera, 0),
            }
        }
        self.corners = corners;
    }

    /// Adds the pixels of a row from one column up to another.
    pub(crate) fn add(&mut self, row: usize, from: usize, to: usize) {
        self.set(row, from, to);
        self.rows = [self.rows[0].min(row), self.rows[1].max(row + 1)];
    }

    /// Returns the number of pixels of the drawing.
    pub(crate) fn count(&self) -> u32 {
        self.drawn().iter().map(|word| word.count_ones()).sum()
    }

    /// Returns the lengths of the runs of pixels without and with the drawing, in turn, down the columns
    /// from left to right.
    pub(crate) fn runs(&self, camera: &CameraModel) -> Vec<u32> {
        let [first, end] = self.rows;
        let mut used = vec![0; self.words_per_row];
        for row in self.drawn().chunks_exact(self.words_per_row) {
            used.iter_mut().zip(row).for_each(|(all, word)| *all |= word);
        }
        // Where the next run begins, and whether the pixels from there on are drawn.
        let (mut runs, mut begin, mut is_in) = (Vec::new(), 0, false);
        let columns = (0..camera.width as usize).filter(|x| used[x / 64] >> (x % 64) & 1 == 1);
        for column in columns {
            let top = column as u32 * camera.height;
            let (word, bit) = (column / 64, column % 64);
            for row in first..end {
                let is_drawn = self.bits[row * self.words_per_row + word] >> bit & 1 == 1;
                if is_drawn != is_in {
                    runs.push(top + row as u32 - begin);
                    (begin, is_in) = (top + row as u32, is_drawn);
                }
            }
            // Below the last row with a drawn pixel; with one in the image's last row the run goes on.
            if is_in && end < camera.height as usize {
                runs.push(top + end as u32 - begin);
                (begin, is_in) = (top + end as u32, false);
            }
            // The same for the rows above the first one of the next column.
            let next = column + 1;
            let goes_on = first == 0
                && next < camera.width as usize
                && used[next / 64] >> (next % 64) & 1 == 1;
            if is_in && !goes_on {
                runs.push(top + camera.height - begin);
                (begin, is_in) = (top + camera.height, false);
            }
        }
        let pixels = camera.width * camera.height;
        if begin < pixels || runs.is_empty() {
            runs.push(pixels - begin);
        }
        runs
    }

    /// Fills what lies before the near plane.
    fn clip(&mut self, corners: [Vec3A; 3], camera: &CameraModel) {
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
        let nearest = |p: Vec3A| Vec3A::new(p.x, p.y, p.z.max(NEAR_M));
        let pixels = before.map(|p| camera.project(nearest(p)).unwrap_or_default());
        for last in 2..count {
            self.fill([pixels[0], pixels[last - 1], pixels[last]], camera);
        }
    }

    /// Fills what a lens shows of a triangle, in parts whose edges are straight in the image.
    fn bend(
        &mut self,
        corners: [Vec3A; 3],
        pixels: [Option<[f32; 2]>; 3],
        camera: &CameraModel,
        halvings: u32,
    ) {
        if let [Some(a), Some(b), Some(c)] = pixels {
            let span = |axis: usize| {
                let [low, high] = [f32::min, f32::max].map(|of| of(of(a[axis], b[axis]), c[axis]));
                (low, high, high - low)
            };
            let size = [camera.width, camera.height].map(|size| size as f32);
            let spans = [span(0), span(1)];
            // A bent edge leaves the rectangle of its ends by less than the size of that.
            if spans
                .iter()
                .zip(size)
                .any(|((low, high, wide), size)| *high + wide < 0.0 || *low - wide > size)
            {
                return;
            }
            // Within a few pixels, every lens keeps lines straight.
            let is_small = spans.iter().all(|(.., wide)| *wide < 4.0);
            if is_small || halvings == HALVINGS_MAX {
                self.fill([a, b, c], camera);
                return;
            }
        } else if halvings == HALVINGS_MAX || pixels == [None; 3] && halvings > 2 {
            return;
        }
        let middles = [0, 1, 2].map(|i| (corners[i] + corners[(i + 1) % 3]) * 0.5);
        let middle_pixels = middles.map(|middle| camera.project(middle));
        if let [Some(a), Some(b), Some(c)] = pixels {
            let ends = [[a, b], [b, c], [c, a]];
            let is_straight = |(middle, [a, b]): (&Option<[f32; 2]>, [[f32; 2]; 2])| {
                middle.is_some_and(|middle| {
                    // The middle lies anywhere on the chord, because of perspective.
                    let (along, from) =
                        ([b[0] - a[0], b[1] - a[1]], [middle[0] - a[0], middle[1] - a[1]]);
                    let length = along[0].hypot(along[1]).max(1e-6);
                    (along[0] * from[1] - along[1] * from[0]).abs() < BEND_MAX_PX * length
                })
            };
            if middle_pixels.iter().zip(ends).all(is_straight) {
                self.fill([a, b, c], camera);
                return;
            }
        }
        let [a, b, c] = corners;
        let [ab, bc, ca] = middles;
        let [a_px, b_px, c_px] = pixels;
        let [ab_px, bc_px, ca_px] = middle_pixels;
        for (corners, pixels) in [
            ([a, ab, ca], [a_px, ab_px, ca_px]),
            ([ab, b, bc], [ab_px, b_px, bc_px]),
            ([ca, bc, c], [ca_px, bc_px, c_px]),
            ([ab, bc, ca], [ab_px, bc_px, ca_px]),
        ] {
            self.bend(corners, pixels, camera, halvings + 1);
        }
    }

    /// Sets the pixels whose centres lie between the edges, row by row.
    fn fill(&mut self, corners: [[f32; 2]; 3], camera: &CameraModel) {
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
                self.add(row, from, to);
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

    /// Returns the rows that have set pixels.
    fn drawn(&self) -> &[u64] {
        let [first, end] = self.rows;
        if first >= end {
            return &[];
        }
        &self.bits[first * self.words_per_row..end * self.words_per_row]
    }

    /// Clears the raster.
    fn wipe(&mut self) {
        let [first, end] = self.rows;
        if first < end {
            self.bits[first * self.words_per_row..end * self.words_per_row].fill(0);
        }
        self.rows = [0, 0];
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
    use crate::collect::camera_model::tests::{fisheye, pinhole};
    use glam::{Quat, Vec3};

    /// A wall of 2 m by 1 m, centred at the origin, facing −z.
    fn wall() -> Part<'static> {
        const POSITIONS: [[f32; 3]; 4] =
            [[-1.0, -0.5, 0.0], [1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [-1.0, 0.5, 0.0]];
        Part { positions: &POSITIONS, triangles: &[[7, 8, 9], [7, 9, 10]], first: 7 }
    }

    fn count(part: Part, optical_from_mesh: &Affine3A, camera: &CameraModel) -> u32 {
        let mut raster = Silhouette::default();
        raster.begin(camera);
        raster.draw(part, optical_from_mesh, camera);
        raster.count()
    }

    fn pixels(x: f32, y: f32, z: f32) -> u32 {
        let at = Affine3A::from_translation(Vec3::new(x, y, z));
        count(wall(), &at, &pinhole())
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
        let pixels = count(wall(), &floor, &pinhole());
        // Row r + 0.5 below the middle sees 0.25 m down at z = 25 / (r + 0.5), nearer than 0.5 m
        // only beyond the image's edge.
        assert_eq!(pixels, 0);
        let lower = Affine3A::from_rotation_translation(turn, Vec3::new(0.0, 0.2, 0.0));
        let pixels = count(wall(), &lower, &pinhole());
        assert_eq!(pixels, 10 * 200, "the ten rows that see it nearer than 0.5 m");
    }

    #[test]
    fn a_fisheye_bends_the_edges_of_a_wall() {
        // Its camera has 60 pixels a radian. A wall of 20 m by 10 m, 4 m ahead, fills most of the image.
        let camera = fisheye();
        let at = Affine3A::from_scale_rotation_translation(
            Vec3::splat(10.0),
            Quat::IDENTITY,
            Vec3::new(0.0, 0.0, 4.0),
        );
        let drawn = count(wall(), &at, &camera);
        let mut shown = 0;
        for (row, column) in (0..100).flat_map(|row| (0..200).map(move |column| (row, column))) {
            let pixel = glam::DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
            let Some(ray) = camera.projection.optical_ray(pixel) else { continue };
            let hit = ray * (4.0 / ray.z);
            shown += u32::from(ray.z > 0.0 && hit.x.abs() < 10.0 && hit.y.abs() < 5.0);
        }
        assert!(shown > 5000 && drawn.abs_diff(shown) <= shown / 200, "{drawn} of {shown}");
        // Beside the camera and a little behind it: 6 pixels of its near edge, 15 pixels high.
        let turn = Quat::from_rotation_y(1.8);
        let aside = Affine3A::from_rotation_translation(turn, turn * Vec3::new(0.0, 0.0, 4.0));
        assert!(count(wall(), &aside, &camera) > 60);
        assert_eq!(count(wall(), &aside, &pinhole()), 0);
    }

    #[test]
    fn a_second_drawing_begins_on_an_empty_raster() {
        let mut raster = Silhouette::default();
        let mut drawn = |camera: &CameraModel, z: f32| {
            raster.begin(camera);
            raster.draw(wall(), &Affine3A::from_translation(Vec3::new(0.0, 0.0, z)), camera);
            raster.count()
        };
        let first = drawn(&pinhole(), 4.0);
        assert_eq!(drawn(&pinhole(), 4.0), first);
        assert!(drawn(&fisheye(), 4.0) > 0);
        assert_eq!(drawn(&pinhole(), -4.0), 0);
    }

    #[test]
    fn runs_go_down_the_columns_and_sum_to_the_image() {
        let camera = pinhole();
        let mut raster = Silhouette::default();
        let mut runs = |rows: &[(usize, usize, usize)]| {
            raster.begin(&camera);
            rows.iter().for_each(|(row, from, to)| raster.add(*row, *from, *to));
            raster.runs(&camera)
        };
        assert_eq!(runs(&[]), [20_000]);
        // Two rows of three pixels from column 70 on, across a word of the raster only where it has them.
        assert_eq!(runs(&[(10, 70, 73), (11, 70, 73)]), [7010, 2, 98, 2, 98, 2, 20_000 - 7212],);
        // Two columns that fill the height are one run; the last pixel of the image ends the last run.
        let full: Vec<_> = (0..100).map(|row| (row, 63, 65)).collect();
        assert_eq!(runs(&full), [6300, 200, 13_500]);
        assert_eq!(runs(&[(99, 199, 200)]), [19_999, 1]);
        assert_eq!(runs(&[(0, 0, 1)]), [0, 1, 19_999]);
        // From the bottom of a column to the top of the next: one run.
        assert_eq!(runs(&[(99, 4, 5), (0, 5, 6)]), [499, 2, 19_499]);
        assert_eq!(runs(&[(99, 4, 5), (0, 6, 7)]), [499, 1, 100, 1, 19_399]);
    }
}
