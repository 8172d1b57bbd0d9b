//! Builder of top-level hierarchies, which are used for one frame: top down, with the binned
//! surface area heuristic.
//!
//! I. Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*, 2007.

use glam::Vec3;

use crate::bvh::{Box3, Hierarchy, Link, Node, TOP_DEPTH_MAX, halve, node_of};

/// Maximum number of bins along each axis; partitions are tried between neighbouring bins.
const BINS: usize = 16;

const NOTHING: Box3 = (Vec3::INFINITY, Vec3::NEG_INFINITY);

/// Builds a hierarchy over boxes, one per leaf, with a fast builder, since it is used for one
/// frame.
pub(crate) fn over_boxes(boxes: &[Box3]) -> Hierarchy {
    if boxes.is_empty() {
        return Hierarchy { nodes: Vec::new(), root: Link::EMPTY, order: Vec::new() };
    }
    // The hierarchy of a frame joins two of these.
    over(boxes, TOP_DEPTH_MAX - 1)
}

/// Builds a hierarchy over boxes, one per leaf where that is not deeper than `depth_max`.
fn over(boxes: &[Box3], depth_max: usize) -> Hierarchy {
    let mut builder = Builder { boxes, nodes: Vec::with_capacity(boxes.len()), sides: Vec::new() };
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let root = builder.divide(&mut order, 0, depth_max).0;
    Hierarchy { nodes: builder.nodes, root, order }
}

struct Builder<'a> {
    boxes: &'a [Box3],
    nodes: Vec<Node>,
    /// Scratch buffer: members of the upper group during a partition.
    sides: Vec<u32>,
}

/// A partition: members whose centre lies in bins up to `last` form the first group.
struct Partition {
    axis: usize,
    bins: Bins,
    last: usize,
}

/// Equal intervals of one coordinate of the doubled centres of the boxes.
#[derive(Clone, Copy)]
struct Bins {
    low: f32,
    per_unit: f32,
    count: usize,
}

impl Bins {
    fn of(&self, middle: f32) -> usize {
        (((middle - self.low) * self.per_unit) as usize).min(self.count - 1)
    }
}

impl Builder<'_> {
    /// Builds the hierarchy over `members`, which begin at position `first` of the order. Returns
    /// its root and its box.
    fn divide(&mut self, members: &mut [u32], first: usize, depth_left: usize) -> (Link, Box3) {
        if let [one] = members {
            return (Link::leaf(first as u32, 1), self.boxes[*one as usize]);
        }
        let halving_depth = members.len().next_power_of_two().ilog2() as usize;
        let best_partition =
            if depth_left < halving_depth { None } else { self.best_partition(members) };
        let Some(best_partition) = best_partition else {
            return halve(self.boxes, &mut self.nodes, members, first);
        };
        let count = self.partition(members, &best_partition);
        let own = self.nodes.len();
        self.nodes.push(node_of(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO));
        let (lower, upper) = members.split_at_mut(count);
        let (child0, box0) = self.divide(lower, first, depth_left - 1);
        let (child1, box1) = self.divide(upper, first + count, depth_left - 1);
        self.nodes[own] = Node { child0, child1, ..node_of(box0.0, box0.1, box1.0, box1.1) };
        (Link(own as u32), union(box0, box1))
    }

    /// Returns the partition with the lowest expected ray cost, or `None` if all centres coincide.
    fn best_partition(&self, members: &[u32]) -> Option<Partition> {
        let middles = members.iter().map(|at| middle(&self.boxes[*at as usize]));
        let (low, high) = middles.fold(NOTHING, |(low, high), m| (low.min(m), high.max(m)));
        let count = (2 * members.len()).min(BINS);
        let mut best: Option<(f32, Partition)> = None;
        for axis in 0..3 {
            let per_unit = count as f32 / (high[axis] - low[axis]);
            if !per_unit.is_finite() {
                continue;
            }
            let bins = Bins { low: low[axis], per_unit, count };
            let mut held = [(0, NOTHING); BINS];
            for at in members {
                let one = &self.boxes[*at as usize];
                let (number, around) = &mut held[bins.of(middle(one)[axis])];
                *number += 1;
                *around = union(*around, *one);
            }
            for (last, cost) in costs(&held[..count]) {
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, Partition { axis, bins, last }));
                }
            }
        }
        best.map(|(_, best_partition)| best_partition)
    }

    /// Moves the first group before the second, keeping the order within each. Returns the size of
    /// the first group.
    fn partition(&mut self, members: &mut [u32], best_partition: &Partition) -> usize {
        self.sides.clear();
        let mut count = 0;
        for at in 0..members.len() {
            let member = members[at];
            let middle = middle(&self.boxes[member as usize])[best_partition.axis];
            if best_partition.bins.of(middle) <= best_partition.last {
                members[count] = member;
                count += 1;
            } else {
                self.sides.push(member);
            }
        }
        members[count..].copy_from_slice(&self.sides);
        count
    }
}

/// Returns, for each partition into two groups that are not empty, its last lower bin and its cost:
/// the sum of area times count of both groups.
fn costs(held: &[(u32, Box3)]) -> impl Iterator<Item = (usize, f32)> {
    let mut above = [(0, 0.0); BINS];
    let mut sum = (0, NOTHING);
    for (bin, (count, around)) in held.iter().enumerate().rev() {
        sum = (sum.0 + count, union(sum.1, *around));
        above[bin] = (sum.0, half_area(&sum.1) * sum.0 as f32);
    }
    let mut sum = (0, NOTHING);
    (0..held.len() - 1).filter_map(move |last| {
        sum = (sum.0 + held[last].0, union(sum.1, held[last].1));
        let (count, cost) = above[last + 1];
        let is_division = sum.0 > 0 && count > 0;
        is_division.then(|| (last, half_area(&sum.1) * sum.0 as f32 + cost))
    })
}

fn middle((low, high): &Box3) -> Vec3 {
    *low + *high
}

fn union(a: Box3, b: Box3) -> Box3 {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Returns half the surface area of a box; 0 for an empty box.
fn half_area((low, high): &Box3) -> f32 {
    let size = (*high - *low).max(Vec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::count;

    fn scattered(number: u32) -> Vec<Box3> {
        let part = |at: u32, of: u32| (at * 7919 * (of + 1) % 1009) as f32 / 1009.0;
        let place = |at| Vec3::new(part(at, 1) * 500.0, part(at, 2) * 500.0, part(at, 3) * 20.0);
        (0..number).map(|at| (place(at), place(at) + Vec3::new(4.0, 2.0, 1.5))).collect()
    }

    fn check(hierarchy: &Hierarchy, link: Link, boxes: &[Box3], around: &Box3) {
        let is_inside = |inner: &Box3, outer: &Box3| {
            inner.0.cmpge(outer.0).all() && inner.1.cmple(outer.1).all()
        };
        if link.is_leaf() {
            let (first, count) = link.primitives();
            for at in first..first + count {
                assert!(is_inside(&boxes[hierarchy.order[at as usize] as usize], around));
            }
            return;
        }
        let node = &hierarchy.nodes[link.0 as usize];
        for (child, low, high) in
            [(node.child0, node.low0, node.high0), (node.child1, node.low1, node.high1)]
        {
            let own = (Vec3::from(low), Vec3::from(high));
            assert!(is_inside(&own, around));
            check(hierarchy, child, boxes, &own);
        }
    }

    #[test]
    fn every_box_has_its_own_leaf_and_lies_in_all_boxes_above() {
        for number in [1, 2, 3, 17, 500] {
            let boxes = scattered(number);
            let hierarchy = over(&boxes, 18);
            let mut seen = Vec::new();
            let depth = count(&hierarchy.nodes, hierarchy.root, 0, &mut seen);
            seen.sort_unstable();
            assert!(depth <= 18, "{number} boxes: depth {depth}");
            assert_eq!(seen, (0..number).collect::<Vec<_>>());
            assert_eq!(hierarchy.nodes.len(), number as usize - 1);
            check(&hierarchy, hierarchy.root, &boxes, &(Vec3::MIN, Vec3::MAX));
        }
    }

    #[test]
    fn distant_groups_are_separated_first() {
        let near: Vec<Box3> =
            (0..8).map(|at| (Vec3::X * at as f32, Vec3::ONE * at as f32)).collect();
        let far = near.iter().map(|(l, h)| (*l + Vec3::Y * 900.0, *h + Vec3::Y * 900.0));
        let boxes: Vec<Box3> = near.iter().copied().chain(far).collect();
        let hierarchy = over(&boxes, 18);
        let root = &hierarchy.nodes[hierarchy.root.0 as usize];
        assert!(root.high0[1] < 100.0 && root.low1[1] > 800.0, "{root:?}");
    }

    #[test]
    fn the_depth_limit_holds() {
        // Each box is 1.5 times as far away as the one before: the heuristic alone would separate
        // one box per level.
        let far: Vec<Box3> = (0..100)
            .map(|at| (Vec3::X * 1.5f32.powi(at), Vec3::ONE + Vec3::X * 1.5f32.powi(at)))
            .collect();
        let hierarchy = over(&far, 9);
        let mut seen = Vec::new();
        let depth = count(&hierarchy.nodes, hierarchy.root, 0, &mut seen);
        assert!(depth <= 9, "depth {depth}");
        assert_eq!(seen.len(), 100);
    }

    #[test]
    fn the_most_actors_at_one_position_are_not_too_deep() {
        let boxes = vec![(Vec3::ZERO, Vec3::ONE); protocol::ACTORS_MAX];
        let hierarchy = over_boxes(&boxes);
        let depth = count(&hierarchy.nodes, hierarchy.root, 0, &mut Vec::new());
        assert!(depth <= TOP_DEPTH_MAX, "depth {depth}");
    }
}
