use glam::Vec3;

use super::traversal::Probe;
use crate::simd::{Float, Float8, V3};
use crate::wide::WideNode;

/// Volume that a packet of rays can reach, bounded by six planes.
///
/// Each plane is parallel to one coordinate axis, so it has two coefficients: projected to each of
/// the three coordinate planes, the packet lies between two lines. For a thin beam this equals the
/// test of a ray against a box, for eight boxes and all rays of the packet at once.
#[derive(Clone, Debug)]
pub(crate) struct Beam {
    planes: [Plane; 6],
    /// Axis along which the near side of a box is measured, from the origin of the packet.
    axis: [f32; 3],
    axis_rows: [usize; 3],
    axis_offset: f32,
}

/// Half-space `a * x + b * y + offset >= 0`. A box touches it if its best corner does; the rows
/// name that corner.
#[derive(Clone, Copy, Debug)]
struct Plane {
    a: f32,
    b: f32,
    offset: f32,
    row_a: usize,
    row_b: usize,
}

impl Plane {
    /// Half-space that contains everything.
    const OPEN: Plane = Plane { a: 0.0, b: 0.0, offset: 1.0, row_a: 0, row_b: 0 };

    #[inline(always)]
    fn new(axes: [usize; 2], a: f32, b: f32, offset: f32) -> Plane {
        let row = |axis: usize, sign: f32| 2 * axis + usize::from(sign > 0.0);
        Plane { a, b, offset, row_a: row(axes[0], a), row_b: row(axes[1], b) }
    }
}

/// Axes of the coordinate planes.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Bound on the rounding error of a point, as a share of the largest coordinate.
const ROUNDING: f32 = 6e-7;

impl Beam {
    /// Returns the beam of rays from one origin. `corners` are four directions whose convex hull
    /// contains all rays' directions. `axis · direction <= 1` for each ray, so that the distance of
    /// a box along the axis bounds the ray parameter. `reach` is the largest coordinate in this
    /// space.
    #[inline(always)]
    pub(crate) fn from_origin(origin: Vec3, corners: &[Vec3; 4], axis: Vec3, reach: f32) -> Beam {
        let mut planes = [Plane::OPEN; 6];
        let slack = ROUNDING * reach;
        for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
            let Some([left, right]) = sides(corners, [i, j]) else { continue };
            let o = [origin[i], origin[j]];
            for (side, [a, b]) in
                [[left[1], -left[0]], [-right[1], right[0]]].into_iter().enumerate()
            {
                let offset = slack * (a.abs() + b.abs()) - (a * o[0] + b * o[1]);
                planes[2 * pair + side] = Plane::new([i, j], a, b, offset);
            }
        }
        Beam::with_axis(planes, axis, -axis.dot(origin) - slack)
    }

    /// Returns the beam of rays with any of these origins, each within `margin` of one of the points, and any of
    /// these directions, which differ little. The near side of a box, measured against the mean direction, is at most
    /// 0 where the box reaches in front of an origin.
    #[inline(always)]
    pub(crate) fn spreading<F: Float>(
        points: &[V3<F>],
        active: &[F::Mask],
        directions: &[Vec3; 4],
        margin: f32,
        reach: f32,
    ) -> Beam {
        let mut planes = [Plane::OPEN; 6];
        let slack = ROUNDING * reach + margin;
        for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
            let Some([left, right]) = sides(directions, [i, j]) else { continue };
            for (side, [a, b]) in
                [[left[1], -left[0]], [-right[1], right[0]]].into_iter().enumerate()
            {
                let (least, _) = spread(points, active, [i, j], [a, b]);
                let offset = slack * (a.abs() + b.abs()) - least;
                planes[2 * pair + side] = Plane::new([i, j], a, b, offset);
            }
        }
        let axis = directions.iter().sum::<Vec3>() * 0.25;
        let [x, y, z] = axis.to_array();
        let (last_xy, _) = spread(points, active, [0, 1], [x, y]);
        let (last_z, _) = spread(points, active, [2, 2], [z, 0.0]);
        Beam::with_axis(planes, -axis, last_xy + last_z - 2.0 * slack)
    }

    #[inline(always)]
    fn with_axis(planes: [Plane; 6], axis: Vec3, axis_offset: f32) -> Beam {
        let axis = axis.to_array();
        let axis_rows = [0, 1, 2].map(|i| 2 * i + usize::from(axis[i] < 0.0));
        Beam { planes, axis, axis_rows, axis_offset }
    }
}

impl Probe for Beam {
    #[inline(always)]
    fn touch<E: Float8>(&self, node: &WideNode, limit: f32) -> (u32, [f32; 8]) {
        let row = |row: usize| E::load(node.row(row));
        let mut inside = E::splat(0.0);
        for (number, plane) in self.planes.iter().enumerate() {
            let side = row(plane.row_b).mul_add(E::splat(plane.b), E::splat(plane.offset));
            let side = row(plane.row_a).mul_add(E::splat(plane.a), side);
            inside = if number == 0 { side } else { inside.min(side) };
        }
        let [x, y, z] = self.axis;
        let near = row(self.axis_rows[0]).mul_add(E::splat(x), E::splat(self.axis_offset));
        let near = row(self.axis_rows[1]).mul_add(E::splat(y), near);
        let near = row(self.axis_rows[2]).mul_add(E::splat(z), near);
        let touched = inside.ge(E::splat(0.0)) & E::splat(limit).ge(near);
        (touched, near.to_array())
    }
}

/// Returns the outermost of four directions, projected to a coordinate plane: that on the left and that on the
/// right; `None` if they point almost everywhere.
#[inline(always)]
fn sides(directions: &[Vec3; 4], [i, j]: [usize; 2]) -> Option<[[f32; 2]; 2]> {
    let sum = directions[0] + directions[1] + directions[2] + directions[3];
    let middle = [sum[i], sum[j]];
    let (mut left, mut right) = ([0.0; 2], [0.0; 2]);
    let (mut most, mut least) = (f32::NEG_INFINITY, f32::INFINITY);
    let mut narrow = true;
    for direction in directions {
        let v = [direction[i], direction[j]];
        let along = middle[0] * v[0] + middle[1] * v[1];
        let across = middle[0] * v[1] - middle[1] * v[0];
        narrow &= along > across.abs() * 0.1 && along > 1e-12;
        let turn = across / along;
        if turn > most {
            (most, left) = (turn, v);
        }
        if turn < least {
            (least, right) = (turn, v);
        }
    }
    narrow.then_some([left, right])
}

/// Box along the axes.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    low: Vec3,
    high: Vec3,
}

impl Region {
    /// Returns the box around the active points and those that lie one of the `steps` from them, each within
    /// `margin`.
    #[inline(always)]
    pub(crate) fn around<F: Float>(
        points: &[V3<F>; 4],
        active: &[F::Mask; 4],
        steps: &[Vec3; 4],
        margin: f32,
        reach: f32,
    ) -> Region {
        let (low, high) = bounds(points, active);
        let [first, last] = steps
            .iter()
            .fold([Vec3::ZERO; 2], |[first, last], step| [first.min(*step), last.max(*step)]);
        let slack = Vec3::splat(margin + ROUNDING * reach);
        Region { low: low + first - slack, high: high + last + slack }
    }
}

impl Probe for Region {
    #[inline(always)]
    fn touch<E: Float8>(&self, node: &WideNode, _: f32) -> (u32, [f32; 8]) {
        let row = |row: usize| E::load(node.row(row));
        let mut touched = !0;
        for axis in 0..3 {
            touched &= E::splat(self.high[axis]).ge(row(2 * axis))
                & row(2 * axis + 1).ge(E::splat(self.low[axis]));
        }
        (touched, [0.0; 8])
    }
}

/// Returns the corners of the bounding box of the active points.
#[inline(always)]
pub(crate) fn bounds<F: Float>(points: &[V3<F>; 4], active: &[F::Mask; 4]) -> (Vec3, Vec3) {
    // Vectors that pass through a closure are not inlined.
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    for axis in 0..3 {
        (low[axis], high[axis]) = spread(points, active, [axis, axis], [1.0, 0.0]);
    }
    (low, high)
}

/// Returns the minimum and the maximum of `scales · (axis 0, axis 1)` over the active lanes.
#[inline(always)]
fn spread<F: Float>(
    points: &[V3<F>],
    active: &[F::Mask],
    axes: [usize; 2],
    scales: [f32; 2],
) -> (f32, f32) {
    let mut least = F::splat(f32::INFINITY);
    let mut most = F::splat(f32::NEG_INFINITY);
    for (point, active) in points.iter().zip(active) {
        let value = point.axis(axes[0]) * F::splat(scales[0]);
        let value = point.axis(axes[1]).mul_add(F::splat(scales[1]), value);
        least = value.or(*active, least).min(least);
        most = value.or(*active, most).max(most);
    }
    (least.smallest(), most.largest())
}
