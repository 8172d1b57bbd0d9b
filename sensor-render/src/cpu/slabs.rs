//! Rays tested against the boxes of a node's children: sixteen at once against all eight, and packets from one origin
//! against single boxes.

use glam::Vec3;

use crate::simd::{Float, Mask, V3};
use crate::wide::WideNode;

/// Bound on the rounding error of the side of a box, as a share of the largest coordinate.
const ROUNDING: f32 = 6e-7;

/// Sixteen rays, each of which is tested against the boxes of eight children (T. Kay, J. Kajiya 1986, *Ray Tracing
/// Complex Scenes*: a box is where three slabs meet).
///
/// A node costs about as much as for one ray, since the tests do not wait for each other, and rays with little in
/// common cost no more than close ones.
#[derive(Clone, Debug)]
pub(super) struct Slabs<F: Float> {
    /// `side * inverse + near` is the parameter at which a ray enters between two sides, `side * inverse + far` the
    /// one at which it leaves.
    inverse: V3<F>,
    near: V3<F>,
    far: V3<F>,
    /// Rows of a node's bounds that the rays reach first, by axis.
    rows: [usize; 3],
    /// Whether some rays reach the other rows first.
    is_mixed: bool,
}

impl<F: Float> Slabs<F> {
    /// Returns rays with these origins and directions. Only those of `active` are tested. `reach` is the largest
    /// coordinate in this space.
    #[inline(always)]
    pub(super) fn new(origins: V3<F>, directions: V3<F>, active: F::Mask, reach: f32) -> Slabs<F> {
        let inverse = inverse(directions);
        let mut rows = [0, 2, 4];
        let mut is_mixed = false;
        for (axis, row) in rows.iter_mut().enumerate() {
            let back = inverse.axis(axis).lt(F::splat(0.0));
            let (some, all) = ((back & active).any(), !(!back & active).any());
            *row += usize::from(some);
            is_mixed |= some != all;
        }
        let (shift, slack) = (-origins.times(inverse), F::splat(ROUNDING * reach));
        let V3 { x, y, z } = inverse;
        let slack = V3 { x: x.abs() * slack, y: y.abs() * slack, z: z.abs() * slack };
        Slabs { inverse, near: shift - slack, far: shift + slack, rows, is_mixed }
    }

    /// Returns which of a node's children any ray meets before its `end`, one bit each. Rays that end at minus
    /// infinity meet none.
    #[inline(always)]
    pub(super) fn meet(&self, node: &WideNode, end: F) -> u32 {
        if self.is_mixed {
            self.meet_in::<true>(node, end)
        } else {
            self.meet_in::<false>(node, end)
        }
    }

    #[inline(always)]
    fn meet_in<const MIXED: bool>(&self, node: &WideNode, end: F) -> u32 {
        let Slabs { inverse, near, far, .. } = *self;
        let rows = if MIXED { [0, 2, 4] } else { self.rows };
        let firsts = rows.map(|row| node.row(row));
        let lasts = rows.map(|row| node.row(row ^ 1));
        let mut met = 0;
        for child in 0..8 {
            let (mut enter, mut leave) = (F::splat(0.0), end);
            for axis in 0..3 {
                let inverse = inverse.axis(axis);
                let (near, far) = (near.axis(axis), far.axis(axis));
                let (first, last) = (F::splat(firsts[axis][child]), F::splat(lasts[axis][child]));
                let (first, last) = if MIXED {
                    let (first, last) = (first * inverse, last * inverse);
                    (first.min(last) + near, first.max(last) + far)
                } else {
                    (first.mul_add(inverse, near), last.mul_add(inverse, far))
                };
                (enter, leave) = (enter.max(first), leave.min(last));
            }
            met |= u32::from(leave.ge(enter).any()) << child;
        }
        met
    }
}

/// Sixteen rays per group from one origin, each of which is tested against single boxes.
#[derive(Clone, Debug)]
pub(super) struct OriginSlabs<F: Float, const G: usize> {
    /// Origin, less and more than it by the rounding error.
    low: Vec3,
    high: Vec3,
    inverse: [V3<F>; G],
}

impl<F: Float, const G: usize> OriginSlabs<F, G> {
    #[inline(always)]
    pub(super) fn new(origin: Vec3, directions: &[V3<F>; G], reach: f32) -> Self {
        let mut inverses = *directions;
        for own in &mut inverses {
            *own = inverse(*own);
        }
        let slack = Vec3::splat(ROUNDING * reach);
        OriginSlabs { low: origin - slack, high: origin + slack, inverse: inverses }
    }

    /// Returns the groups with a ray that meets the box of a child before its `end`, one bit each.
    #[inline(always)]
    pub(super) fn meet(&self, node: &WideNode, child: usize, end: &[F; G]) -> u32 {
        let [low_x, high_x, low_y, high_y, low_z, high_z] = node.sides(child);
        let low = V3::<F>::splat(Vec3::new(low_x, low_y, low_z)) - V3::splat(self.high);
        let high = V3::<F>::splat(Vec3::new(high_x, high_y, high_z)) - V3::splat(self.low);
        let mut met = 0;
        for (group, (inverse, end)) in self.inverse.iter().zip(end).enumerate() {
            let (a, b) = (low.times(*inverse), high.times(*inverse));
            let enter = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z).max(F::splat(0.0)));
            let leave = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z).min(*end));
            met |= u32::from(leave.ge(enter).any()) << group;
        }
        met
    }
}

/// Returns how many of a ray's parameters a metre along each axis is.
#[inline(always)]
fn inverse<F: Float>(directions: V3<F>) -> V3<F> {
    V3 { x: reciprocal(directions.x), y: reciprocal(directions.y), z: reciprocal(directions.z) }
}

/// Returns 1 / `x`, of numbers close to 0 a large number.
#[inline(always)]
fn reciprocal<F: Float>(x: F) -> F {
    let least = F::splat(1e-12);
    F::splat(1.0) / least.or(x.abs().lt(least), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Link;
    use crate::simd::{Isa, Kernel, LANES};

    /// Largest coordinate of the test, so that slacks are far below the sizes of the boxes. Metres.
    const REACH: f32 = 100.0;

    struct Meet<'a> {
        rays: &'a [[Vec3; 2]; LANES],
        active: u16,
        node: &'a WideNode,
        end: f32,
    }

    impl Kernel for Meet<'_> {
        /// Children that any ray meets, and those of the first ray's origin that any ray meets from there.
        type Output = [u32; 2];

        #[inline(always)]
        fn run<F: Float>(self) -> [u32; 2] {
            let Meet { rays, active, node, end } = self;
            let active = F::Mask::from_bits(active);
            let end = F::splat(end).or(active, F::splat(f32::NEG_INFINITY));
            let met = Slabs::new(part(rays, 0), part(rays, 1), active, REACH).meet(node, end);
            let slabs = OriginSlabs::new(rays[0][0], &[part(rays, 1)], REACH);
            let mut one_by_one = 0;
            for child in 0..8 {
                one_by_one |= slabs.meet(node, child, &[end]) << child;
            }
            [met, one_by_one]
        }
    }

    /// Returns the origins or the directions of rays.
    #[inline(always)]
    fn part<F: Float>(rays: &[[Vec3; 2]; LANES], part: usize) -> V3<F> {
        V3 {
            x: F::from_array(rays.map(|ray| ray[part].x)),
            y: F::from_array(rays.map(|ray| ray[part].y)),
            z: F::from_array(rays.map(|ray| ray[part].z)),
        }
    }

    /// Returns by how much a ray of at most the length `end` passes through a box, negative if it misses it: in
    /// double precision, of rays with a coordinate of 0 too.
    fn depth([origin, direction]: [Vec3; 2], [low, high]: [Vec3; 2], end: f32) -> f64 {
        let (mut enter, mut leave) = (0.0f64, f64::from(end));
        for axis in 0..3 {
            let [origin, direction, low, high] =
                [origin[axis], direction[axis], low[axis], high[axis]].map(f64::from);
            if direction == 0.0 {
                let inside = (origin - low).min(high - origin);
                leave = if inside < 0.0 { -1.0 } else { leave };
                if inside.abs() < 0.01 {
                    return 0.0;
                }
                continue;
            }
            let (a, b) = ((low - origin) / direction, (high - origin) / direction);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        }
        leave - enter
    }

    #[test]
    fn a_child_is_met_if_any_active_ray_passes_through_its_box() {
        let mut dice = 1u64;
        let mut roll = |least: f32, most: f32| {
            dice = dice
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            least + (most - least) * (dice >> 40) as f32 / (1u64 << 24) as f32
        };
        let (mut met_count, mut missed) = (0, 0);
        for round in 0..400 {
            let boxes: [[Vec3; 2]; 8] = std::array::from_fn(|_| {
                let low = Vec3::from_array(std::array::from_fn(|_| roll(-9.0, 9.0)));
                [low, low + Vec3::from_array(std::array::from_fn(|_| roll(0.5, 9.0)))]
            });
            let links = boxes.map(|[low, high]| (Link::leaf(0, 1), (low, high)));
            let node = WideNode::join(links);
            // Every second time, rays with directions of the same signs.
            let away = if round % 2 == 0 { -1.0 } else { 0.2 };
            let one_origin = round % 4 < 2;
            let first = Vec3::from_array(std::array::from_fn(|_| roll(-9.0, 9.0)));
            let rays: [[Vec3; 2]; LANES] = std::array::from_fn(|lane| {
                let own = Vec3::from_array(std::array::from_fn(|_| roll(-9.0, 9.0)));
                let mut direction = Vec3::from_array(std::array::from_fn(|_| roll(away, 1.0)));
                if round % 8 == 0 && lane % 3 == 0 {
                    direction.z = 0.0;
                }
                [if one_origin { first } else { own }, direction]
            });
            let (active, end) = (roll(0.0, 65535.0) as u16 & 0x1111 | 1, roll(0.5, 20.0));
            for isa in Isa::all() {
                let [met, one_by_one] = isa.run(Meet { rays: &rays, active, node: &node, end });
                for (child, bounds) in boxes.iter().enumerate() {
                    let traced = (0..LANES).filter(|lane| active >> lane & 1 != 0);
                    let deepest =
                        traced.map(|lane| depth(rays[lane], *bounds, end)).fold(f64::MIN, f64::max);
                    // Boxes are larger by the rounding errors.
                    if (-0.3..0.001).contains(&deepest) {
                        continue;
                    }
                    let expected = deepest > 0.0;
                    assert_eq!(met >> child & 1 != 0, expected, "{round}: {deepest}");
                    if one_origin {
                        assert_eq!(one_by_one >> child & 1 != 0, expected, "{round}: {deepest}");
                    }
                    met_count += usize::from(expected);
                    missed += usize::from(!expected);
                }
            }
        }
        assert!(met_count > 100 && missed > 100, "{met_count} met, {missed} missed");
    }
}
