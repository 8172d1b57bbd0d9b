//! A hierarchy over boxes for one frame: top down, by the surface area heuristic over bins.
//!
//! I. Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*, 2007.

use glam::Vec3;

use crate::bvh::{Hierarchy, Link, Node, halve, node_of};

/// Places along each axis at which a division is tried, and one more; for few members fewer.
const BINS: usize = 16;

type Box3 = (Vec3, Vec3);

const NOTHING: Box3 = (Vec3::INFINITY, Vec3::NEG_INFINITY);

/// Over all the boxes, one to a leaf where that is not deeper than `depth_max`.
pub(crate) fn over(boxes: &[Box3], depth_max: usize) -> Hierarchy {
    let mut builder = Builder { boxes, nodes: Vec::with_capacity(boxes.len()), sides: Vec::new() };
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let root = builder.divide(&mut order, 0, depth_max).0;
    Hierarchy { nodes: builder.nodes, root, order }
}

struct Builder<'a> {
    boxes: &'a [Box3],
    nodes: Vec<Node>,
    /// Members of the upper side while they are parted.
    sides: Vec<u32>,
}

/// Where members are divided: those whose middle lies in the bins up to `last` go first.
struct Cut {
    axis: usize,
    bins: Bins,
    last: usize,
}

/// Equal intervals of one coordinate of twice the boxes' middles.
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
    /// The members, which begin at place `first` of the order: their root, and the box round them.
    fn divide(&mut self, members: &mut [u32], first: usize, depth_left: usize) -> (Link, Box3) {
        if let [one] = members {
            return (Link::leaf(first as u32, 1), self.boxes[*one as usize]);
        }
        let halving_depth = members.len().next_power_of_two().ilog2() as usize;
        let cut = if depth_left < halving_depth { None } else { self.cut(members) };
        let Some(cut) = cut else {
            return halve(self.boxes, &mut self.nodes, members, first);
        };
        let count = self.part(members, &cut);
        let own = self.nodes.len();
        self.nodes.push(node_of(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO));
        let (lower, upper) = members.split_at_mut(count);
        let (child0, box0) = self.divide(lower, first, depth_left - 1);
        let (child1, box1) = self.divide(upper, first + count, depth_left - 1);
        self.nodes[own] = Node { child0, child1, ..node_of(box0.0, box0.1, box1.0, box1.1) };
        (Link(own as u32), both(box0, box1))
    }

    /// The division that rays are expected to pay least for; none where all middles are one.
    fn cut(&self, members: &[u32]) -> Option<Cut> {
        let middles = members.iter().map(|at| middle(&self.boxes[*at as usize]));
        let (low, high) = middles.fold(NOTHING, |(low, high), m| (low.min(m), high.max(m)));
        let count = (2 * members.len()).min(BINS);
        let mut best: Option<(f32, Cut)> = None;
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
                *around = both(*around, *one);
            }
            for (last, cost) in costs(&held[..count]) {
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, Cut { axis, bins, last }));
                }
            }
        }
        best.map(|(_, cut)| cut)
    }

    /// Puts the lower side before the upper, each in the order it had, and counts it.
    fn part(&mut self, members: &mut [u32], cut: &Cut) -> usize {
        self.sides.clear();
        let mut count = 0;
        for at in 0..members.len() {
            let member = members[at];
            let middle = middle(&self.boxes[member as usize])[cut.axis];
            if cut.bins.of(middle) <= cut.last {
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

/// What each division of the bins into two that are not empty would cost: areas times counts.
fn costs(held: &[(u32, Box3)]) -> impl Iterator<Item = (usize, f32)> {
    let mut above = [(0, 0.0); BINS];
    let mut sum = (0, NOTHING);
    for (bin, (count, around)) in held.iter().enumerate().rev() {
        sum = (sum.0 + count, both(sum.1, *around));
        above[bin] = (sum.0, half_area(&sum.1) * sum.0 as f32);
    }
    let mut sum = (0, NOTHING);
    (0..held.len() - 1).filter_map(move |last| {
        sum = (sum.0 + held[last].0, both(sum.1, held[last].1));
        let (count, cost) = above[last + 1];
        let is_division = sum.0 > 0 && count > 0;
        is_division.then(|| (last, half_area(&sum.1) * sum.0 as f32 + cost))
    })
}

fn middle((low, high): &Box3) -> Vec3 {
    *low + *high
}

fn both(a: Box3, b: Box3) -> Box3 {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Of a box that holds something; else 0.
fn half_area((low, high): &Box3) -> f32 {
    let size = (*high - *low).max(Vec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::tests::count;

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
    fn every_box_lies_in_one_leaf_of_its_own_and_in_all_boxes_above() {
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
    fn neighbours_are_divided_from_those_far_away() {
        let near: Vec<Box3> =
            (0..8).map(|at| (Vec3::X * at as f32, Vec3::ONE * at as f32)).collect();
        let far = near.iter().map(|(l, h)| (*l + Vec3::Y * 900.0, *h + Vec3::Y * 900.0));
        let boxes: Vec<Box3> = near.iter().copied().chain(far).collect();
        let hierarchy = over(&boxes, 18);
        let root = &hierarchy.nodes[hierarchy.root.0 as usize];
        assert!(root.high0[1] < 100.0 && root.low1[1] > 800.0, "{root:?}");
    }

    #[test]
    fn it_is_not_deeper_than_it_may_be() {
        // Each next box twice as far away: the heuristic alone would cut off one at a time.
        let far: Vec<Box3> = (0..100)
            .map(|at| (Vec3::X * 1.5f32.powi(at), Vec3::ONE + Vec3::X * 1.5f32.powi(at)))
            .collect();
        let hierarchy = over(&far, 9);
        let mut seen = Vec::new();
        let depth = count(&hierarchy.nodes, hierarchy.root, 0, &mut seen);
        assert!(depth <= 9, "depth {depth}");
        assert_eq!(seen.len(), 100);
    }
}
