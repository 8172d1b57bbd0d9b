//! Builder of bottom-level hierarchies. Large meshes are partitioned into subtrees that threads
//! build in parallel. The partition depends on the mesh alone, so the result does not depend on the
//! number of threads.

use glam::Vec3;
use rayon::prelude::*;

use crate::bvh::{Box3, DEPTH_MAX, Hierarchy, Link, Node, bounds, node_of};

/// Maximum number of triangles of a subtree that one thread builds.
const SUBTREE_MAX: usize = 1 << 15;

/// Depth below which triangles are halved by count instead of by cost, so that a hierarchy of 2²⁶
/// triangles has at most 20 levels above its subtrees.
const SAH_DEPTH: usize = 8;

/// Number of triangles above which subtrees are built with the fast setting, at the cost of slower
/// rays.
const FAST_BUILD_MIN: usize = 4_000_000;

/// Bins along each axis; partitions are tried between neighbouring bins.
const BINS: usize = 32;

/// Triangles per parallel work item.
const CHUNK: usize = 1 << 16;

const NOTHING: Box3 = (Vec3::INFINITY, Vec3::NEG_INFINITY);

/// Hierarchy whose leaves are the subtrees.
enum Tree {
    Subtree(Hierarchy),
    Split(Box<[(Tree, Box3); 2]>),
}

impl Tree {
    /// Returns the number of nodes and of primitives.
    fn size(&self) -> (usize, usize) {
        match self {
            Tree::Subtree(subtree) => (subtree.nodes.len(), subtree.order.len()),
            Tree::Split(halves) => {
                let [left, right] = halves.each_ref().map(|(tree, _)| tree.size());
                (left.0 + right.0 + 1, left.1 + right.1)
            }
        }
    }
}

/// Function from the index of a triangle to its corners.
pub(crate) trait Corners: Fn(u32) -> [Vec3; 3] + Sync {}

impl<F: Fn(u32) -> [Vec3; 3] + Sync> Corners for F {}

/// Builds the hierarchy over those of the triangles 0 to `count` whose corners are finite, with all
/// threads of the pool, so that `above` levels may lie over it. Returns it with the box of all these
/// triangles. It is optimized for ray
/// traversal, because it is used for a whole episode.
pub(crate) fn over_triangles(
    count: usize,
    corners: &impl Corners,
    above: usize,
) -> (Hierarchy, Box3) {
    let is_finite = |at: &u32| corners(*at).iter().all(|corner| corner.is_finite());
    let mut members: Vec<u32> = (0..count as u32).into_par_iter().filter(is_finite).collect();
    if members.len() <= SUBTREE_MAX {
        return subtree(corners, &members, DEPTH_MAX - above, false);
    }
    let boxes: Vec<Box3> =
        (0..count as u32).into_par_iter().map(|at| bounds(&corners(at))).collect();
    let (tree, around) = build(corners, &boxes, &mut members, above);
    drop((boxes, members));
    let (nodes, primitives) = tree.size();
    let mut whole = Hierarchy {
        nodes: bytemuck::zeroed_vec(nodes),
        root: Link::EMPTY,
        order: bytemuck::zeroed_vec(primitives),
    };
    whole.root = write_tree(tree, &mut whole.nodes, &mut whole.order, (0, 0));
    (whole, around)
}

fn subtree(
    corners: &impl Corners,
    members: &[u32],
    depth_max: usize,
    fast: bool,
) -> (Hierarchy, Box3) {
    let own: Vec<_> = members.iter().map(|at| corners(*at)).collect();
    let mut subtree = Hierarchy::over_triangles_serial(&own, depth_max, fast);
    for at in &mut subtree.order {
        *at = members[*at as usize];
    }
    let around = own.iter().fold(NOTHING, |sum, own| union(sum, bounds(own)));
    (subtree, around)
}

fn build(
    corners: &impl Corners,
    boxes: &[Box3],
    members: &mut [u32],
    depth: usize,
) -> (Tree, Box3) {
    if members.len() <= SUBTREE_MAX {
        let (subtree, around) =
            subtree(corners, members, DEPTH_MAX - depth, boxes.len() > FAST_BUILD_MIN);
        return (Tree::Subtree(subtree), around);
    }
    let count = partition(boxes, members, depth);
    let (left, right) = members.split_at_mut(count);
    let (left, right) = rayon::join(
        || build(corners, boxes, left, depth + 1),
        || build(corners, boxes, right, depth + 1),
    );
    let around = union(left.1, right.1);
    (Tree::Split(Box::new([left, right])), around)
}

/// Writes a tree to `nodes` and `order`, parents before children. `base` is the number of nodes and
/// of primitives of the whole hierarchy that lie before.
fn write_tree(tree: Tree, nodes: &mut [Node], order: &mut [u32], base: (usize, usize)) -> Link {
    match tree {
        Tree::Subtree(subtree) => {
            order.copy_from_slice(&subtree.order);
            subtree.copy_to(nodes, base.0 as u32, base.1 as u32)
        }
        Tree::Split(halves) => {
            let [(left, (low0, high0)), (right, (low1, high1))] = *halves;
            let Some((own, nodes)) = nodes.split_first_mut() else { return Link::EMPTY };
            let (inner, outer) = left.size();
            let (left_nodes, right_nodes) = nodes.split_at_mut(inner);
            let (left_order, right_order) = order.split_at_mut(outer);
            let first = base.0 + 1;
            let (child0, child1) = rayon::join(
                || write_tree(left, left_nodes, left_order, (first, base.1)),
                || write_tree(right, right_nodes, right_order, (first + inner, base.1 + outer)),
            );
            *own = Node { child0, child1, ..node_of(low0, high0, low1, high1) };
            Link(base.0 as u32)
        }
    }
}

fn union(a: Box3, b: Box3) -> Box3 {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Returns half the surface area, which is proportional to the probability that a ray hits the box.
fn half_area((low, high): Box3) -> f32 {
    let size = (high - low).max(Vec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Returns twice the centre of a box.
fn middle((low, high): Box3) -> Vec3 {
    low + high
}

/// Partitions the members into two groups, neither of them empty. Returns the size of the first.
fn partition(boxes: &[Box3], members: &mut [u32], depth: usize) -> usize {
    let around = |members: &[u32]| {
        members.iter().fold(NOTHING, |(low, high), at| {
            let middle = middle(boxes[*at as usize]);
            (low.min(middle), high.max(middle))
        })
    };
    let around = members.par_chunks(CHUNK).map(around).reduce(|| NOTHING, union);
    let per_bin = BINS as f32 / (around.1 - around.0);
    let bin_of = |at: u32| {
        let bin = (middle(boxes[at as usize]) - around.0) * per_bin;
        bin.to_array().map(|bin| (bin as usize).min(BINS - 1))
    };
    if depth < SAH_DEPTH
        && let Some((axis, plane)) = best_plane(boxes, members, bin_of)
    {
        let mut count = 0;
        for index in 0..members.len() {
            if bin_of(members[index])[axis] < plane {
                members.swap(count, index);
                count += 1;
            }
        }
        return count;
    }
    let axis = (around.1 - around.0).max_position();
    let half = members.len() / 2;
    members.select_nth_unstable_by(half, |a, b| {
        let [x, y] = [a, b].map(|at| middle(boxes[*at as usize])[axis]);
        x.total_cmp(&y).then(a.cmp(b))
    });
    half
}

/// Returns the axis, and the bin at which the second group begins, of the partition with the lowest
/// expected ray cost.
fn best_plane(
    boxes: &[Box3],
    members: &[u32],
    bin_of: impl Fn(u32) -> [usize; 3] + Sync,
) -> Option<(usize, usize)> {
    const EMPTY: [[(Box3, u32); BINS]; 3] = [[(NOTHING, 0u32); BINS]; 3];
    let sorted = |members: &[u32]| {
        let mut bins = EMPTY;
        for at in members {
            for (axis, bin) in bin_of(*at).into_iter().enumerate() {
                let (around, count) = &mut bins[axis][bin];
                *around = union(*around, boxes[*at as usize]);
                *count += 1;
            }
        }
        bins
    };
    let merged = |mut bins: [[(Box3, u32); BINS]; 3], others: [[(Box3, u32); BINS]; 3]| {
        for (bin, other) in bins.iter_mut().flatten().zip(others.iter().flatten()) {
            *bin = (union(bin.0, other.0), bin.1 + other.1);
        }
        bins
    };
    let bins = members.par_chunks(CHUNK).map(sorted).reduce(|| EMPTY, merged);
    let mut best = (f32::INFINITY, None);
    for (axis, bins) in bins.iter().enumerate() {
        let mut costs = [0.0; BINS];
        let mut group = (NOTHING, 0);
        for plane in (1..BINS).rev() {
            group = (union(group.0, bins[plane].0), group.1 + bins[plane].1);
            costs[plane] = half_area(group.0) * group.1 as f32;
        }
        let after = |plane: usize| bins[plane..].iter().any(|(_, count)| *count > 0);
        let mut group = (NOTHING, 0);
        for plane in 1..BINS {
            group = (union(group.0, bins[plane - 1].0), group.1 + bins[plane - 1].1);
            let cost = costs[plane] + half_area(group.0) * group.1 as f32;
            if cost < best.0 && group.1 > 0 && after(plane) {
                best = (cost, Some((axis, plane)));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::count;

    /// More triangles than one subtree holds: a plane, and many equal triangles in one place.
    fn corners() -> Vec<[Vec3; 3]> {
        let plain = (0..SUBTREE_MAX as u32 * 2).map(|i| {
            let at = Vec3::new((i % 300) as f32, (i / 300) as f32, (i * 7 % 31) as f32);
            [at, at + Vec3::X, at + Vec3::Y + Vec3::Z]
        });
        let heap = (0..500).map(|_| [Vec3::ZERO, Vec3::X, Vec3::Y]);
        plain.chain(heap).collect()
    }

    fn by_threads(threads: usize) -> Hierarchy {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let corners = corners();
        pool.install(|| over_triangles(corners.len(), &|at| corners[at as usize], 0)).0
    }

    #[test]
    fn a_divided_hierarchy_holds_every_triangle_within_its_boxes() {
        let corners = corners();
        let (whole, _) = over_triangles(corners.len(), &|at| corners[at as usize], 0);
        let mut seen = Vec::new();
        let depth = count(&whole.nodes, whole.root, 0, &mut seen);
        assert!(depth <= DEPTH_MAX, "depth {depth}");
        seen.sort_unstable();
        assert!(seen == (0..corners.len() as u32).collect::<Vec<_>>());
        let mut order = whole.order.clone();
        order.sort_unstable();
        assert!(order == seen);
        for node in &whole.nodes {
            for (link, low, high) in
                [(node.child0, node.low0, node.high0), (node.child1, node.low1, node.high1)]
            {
                let around = (Vec3::from(low), Vec3::from(high));
                if link.is_leaf() {
                    let (first, count) = link.primitives();
                    for at in first..first + count {
                        let own = bounds(&corners[whole.order[at as usize] as usize]);
                        assert_eq!(union(around, own), around);
                    }
                } else {
                    let child = &whole.nodes[link.0 as usize];
                    for (low, high) in [(child.low0, child.high0), (child.low1, child.high1)] {
                        assert_eq!(union(around, (low.into(), high.into())), around);
                    }
                }
            }
        }
    }

    #[test]
    fn the_number_of_threads_does_not_change_the_hierarchy() {
        let (one, three) = (by_threads(1), by_threads(3));
        assert!(one.order == three.order && one.root == three.root);
        let bytes = |h: &Hierarchy| bytemuck::cast_slice::<Node, u8>(&h.nodes).to_vec();
        assert!(bytes(&one) == bytes(&three));
    }

    #[test]
    fn equal_triangles_are_all_kept_and_not_too_deep() {
        let corners = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 5000];
        for above in [0, 4] {
            let (hierarchy, _) =
                over_triangles(corners.len(), &|at: u32| corners[at as usize], above);
            let mut seen = Vec::new();
            let depth = count(&hierarchy.nodes, hierarchy.root, 0, &mut seen);
            seen.sort_unstable();
            assert!(depth + above <= DEPTH_MAX, "depth {depth}");
            assert_eq!(seen, (0..5000).collect::<Vec<_>>());
        }
    }
}
