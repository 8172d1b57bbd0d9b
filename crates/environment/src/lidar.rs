//! A planar lidar against upright boxes.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

/// The edge of a cell. Metres.
const CELL_M: f32 = 32.0;

/// An upright box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UprightBox {
    pub(crate) center: Vec3,
    pub(crate) half_extents_m: Vec3,
    /// The direction of its x axis, of unit length.
    pub(crate) axis: Vec2,
}

/// The boxes of a map, by square cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoxGrid {
    low: Vec2,
    columns: usize,
    rows: usize,
    first: Vec<u32>,
    /// The boxes of each cell. A box that reaches into several cells is in each of them.
    boxes: Vec<UprightBox>,
}

impl BoxGrid {
    pub(crate) fn new(all: &[UprightBox]) -> BoxGrid {
        let reach = |b: &UprightBox| Vec2::splat(b.half_extents_m.truncate().length());
        let bounds = |(low, high): (Vec2, Vec2), b: &UprightBox| {
            let center = b.center.truncate();
            (low.min(center - reach(b)), high.max(center + reach(b)))
        };
        let (low, high) = all.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), bounds);
        if all.is_empty() {
            return BoxGrid::default();
        }
        let size = ((high - low) / CELL_M).floor() + 1.0;
        let mut grid =
            BoxGrid { low, columns: size.x as usize, rows: size.y as usize, ..BoxGrid::default() };
        let mut placed: Vec<(u32, usize)> = Vec::new();
        for (index, b) in all.iter().enumerate() {
            let center = b.center.truncate();
            grid.for_cells(center - reach(b), center + reach(b), |cell| {
                placed.push((cell as u32, index));
            });
        }
        placed.sort_unstable();
        grid.first = vec![0; grid.columns * grid.rows + 1];
        for &(cell, _) in &placed {
            grid.first[cell as usize + 1] += 1;
        }
        for cell in 0..grid.columns * grid.rows {
            grid.first[cell + 1] += grid.first[cell];
        }
        grid.boxes = placed.into_iter().map(|(_, index)| all[index]).collect();
        grid
    }

    /// Calls `found` with every box within `range_m` of a point, some of them more than once, and
    /// some others.
    pub(crate) fn for_each_near(&self, at: Vec2, range_m: f32, mut found: impl FnMut(&UprightBox)) {
        if !self.boxes.is_empty() {
            self.for_cells(at - range_m, at + range_m, |cell| {
                let (first, end) = (self.first[cell], self.first[cell + 1]);
                self.boxes[first as usize..end as usize].iter().for_each(&mut found);
            });
        }
    }

    fn for_cells(&self, low: Vec2, high: Vec2, mut found: impl FnMut(usize)) {
        let (low, high) = ((low - self.low) / CELL_M, (high - self.low) / CELL_M);
        if high.x < 0.0 || high.y < 0.0 {
            return;
        }
        let right = (high.x as usize).min(self.columns - 1);
        let top = (high.y as usize).min(self.rows - 1);
        // A negative number becomes 0.
        for row in low.y as usize..=top {
            for column in low.x as usize..=right {
                found(row * self.columns + column);
            }
        }
    }
}

/// A lidar in the plane: ray `i` of `n` points `i / n` of a turn to the left of straight ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lidar {
    pub(crate) origin: Vec3,
    /// Straight ahead, of unit length.
    pub(crate) forward: Vec2,
    pub(crate) range_m: f32,
}

impl Lidar {
    /// Shortens the distances of the rays that meet a box. A box that contains the origin is not
    /// seen.
    pub(crate) fn meet(&self, b: &UprightBox, distances_m: &mut [f32]) {
        let center = (b.center - self.origin).truncate();
        let half = b.half_extents_m.truncate();
        let nearest_m = (self.range_m + half.length()).powi(2);
        if center.length_squared() > nearest_m
            || (b.center.z - self.origin.z).abs() > b.half_extents_m.z
        {
            return;
        }
        // In the frame of the box.
        let to_box = |v: Vec2| Vec2::new(b.axis.dot(v), b.axis.perp_dot(v));
        let origin = to_box(-center);
        if origin.abs().cmple(half).all() {
            return;
        }
        let angle = |v: Vec2| self.forward.angle_to(v);
        let middle = angle(center);
        let (side, ahead) = (b.axis.perp() * half.y, b.axis * half.x);
        let corners = [ahead + side, ahead - side, side - ahead, -side - ahead];
        // The box spans less than half a turn, because the origin is outside.
        let turns = corners.map(|corner| center.angle_to(center + corner));
        let step = TAU / distances_m.len() as f32;
        let (low, high) =
            turns.iter().fold((0.0f32, 0.0f32), |(low, high), &t| (low.min(t), high.max(t)));
        let first = ((middle + low) / step).ceil() as i32;
        let last = ((middle + high) / step).floor() as i32;
        for ray in first..=last {
            let index = ray.rem_euclid(distances_m.len() as i32) as usize;
            let direction = to_box(Vec2::from_angle(ray as f32 * step).rotate(self.forward));
            if let Some(m) = entry(origin, direction, half) {
                distances_m[index] = distances_m[index].min(m);
            }
        }
    }
}

/// Returns where a ray enters a box around zero, by the method of slabs (Kay and Kajiya, "Ray
/// tracing complex scenes", SIGGRAPH 1986).
pub(crate) fn entry(origin: Vec2, direction: Vec2, half: Vec2) -> Option<f32> {
    let inverse = direction.recip();
    let (a, b) = ((-half - origin) * inverse, (half - origin) * inverse);
    let enter = a.min(b).max_element();
    let leave = a.max(b).min_element();
    (enter >= 0.0 && enter <= leave).then_some(enter)
}
