//! Large meshes are divided before their hierarchies are built, so that threads can share the
//! work. Where they are divided depends on the mesh alone.

use glam::Vec3;

use crate::bvh::{DEPTH_MAX, Hierarchy, Link, Node, bounds, node_of};

/// More triangles than this are divided.
const SHARE_MAX: usize = 1 << 15;

/// Below this depth shares are halved by count, so that a hierarchy of 2²⁶ triangles is at most
/// 20 levels deep above its shares.
const CAREFUL_DEPTH: usize = 8;

/// Hierarchies over more triangles are built in haste, at the cost of the rays.
const MANY: usize = 4_000_000;

/// Planes that are tried along each axis, and one more.
const BINS: usize = 32;

type Box3 = (Vec3, Vec3);

const NOTHING: Box3 = (Vec3::INFINITY, Vec3::NEG_INFINITY);

/// A hierarchy above those of its shares.
enum Tree {
    Share(Hierarchy),
    Fork(Box<[(Tree, Box3); 2]>),
}

/// The hierarchy over these triangles, built by all threads of the pool.
pub(crate) fn divided(corners: &[[Vec3; 3]]) -> Hierarchy {
    if corners.len() <= SHARE_MAX {
        return Hierarchy::over_share(corners, DEPTH_MAX, false);
    }
    let boxes: Vec<Box3> = corners.iter().map(bounds).collect();
    let mut members: Vec<u32> = (0..corners.len() as u32).collect();
    let (tree, _) = build(corners, &boxes, &mut members, 0);
    let mut whole = Hierarchy {
        nodes: Vec::with_capacity(corners.len() / 2),
        root: Link::EMPTY,
        order: Vec::with_capacity(corners.len()),
    };
    whole.root = put(&tree, &mut whole);
    whole
}

fn build(corners: &[[Vec3; 3]], boxes: &[Box3], members: &mut [u32], depth: usize) -> (Tree, Box3) {
    if members.len() <= SHARE_MAX {
        let own: Vec<_> = members.iter().map(|at| corners[*at as usize]).collect();
        let mut share = Hierarchy::over_share(&own, DEPTH_MAX - depth, corners.len() > MANY);
        for at in &mut share.order {
            *at = members[*at as usize];
        }
        let around = members.iter().fold(NOTHING, |sum, at| united(sum, boxes[*at as usize]));
        return (Tree::Share(share), around);
    }
    let count = divide(boxes, members, depth);
    let (left, right) = members.split_at_mut(count);
    let (left, right) = rayon::join(
        || build(corners, boxes, left, depth + 1),
        || build(corners, boxes, right, depth + 1),
    );
    let around = united(left.1, right.1);
    (Tree::Fork(Box::new([left, right])), around)
}

/// Appends a tree, parents before children.
fn put(tree: &Tree, whole: &mut Hierarchy) -> Link {
    match tree {
        Tree::Share(share) => {
            let first = whole.order.len() as u32;
            whole.order.extend(&share.order);
            share.append_to(&mut whole.nodes, first)
        }
        Tree::Fork(halves) => {
            let [(left, (low0, high0)), (right, (low1, high1))] = &**halves;
            let at = whole.nodes.len();
            let node = node_of(*low0, *high0, *low1, *high1);
            whole.nodes.push(node);
            let child0 = put(left, whole);
            let child1 = put(right, whole);
            whole.nodes[at] = Node { child0, child1, ..node };
            Link(at as u32)
        }
    }
}

fn united(a: Box3, b: Box3) -> Box3 {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Half the surface: proportional to how likely a ray is to pass.
fn half_area((low, high): Box3) -> f32 {
    let size = (high - low).max(Vec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Twice the middle.
fn middle((low, high): Box3) -> Vec3 {
    low + high
}

/// Sorts the members into two groups, and says how many are in the first: neither is empty.
fn divide(boxes: &[Box3], members: &mut [u32], depth: usize) -> usize {
    let around = members.iter().fold(NOTHING, |(low, high), at| {
        let middle = middle(boxes[*at as usize]);
        (low.min(middle), high.max(middle))
    });
    let per_bin = BINS as f32 / (around.1 - around.0);
    let bin_of = |at: u32| {
        let bin = (middle(boxes[at as usize]) - around.0) * per_bin;
        bin.to_array().map(|bin| (bin as usize).min(BINS - 1))
    };
    if depth < CAREFUL_DEPTH
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

/// The axis, and the bin at which its second group begins, where rays cost least.
fn best_plane(
    boxes: &[Box3],
    members: &[u32],
    bin_of: impl Fn(u32) -> [usize; 3],
) -> Option<(usize, usize)> {
    let mut bins = [[(NOTHING, 0u32); BINS]; 3];
    for at in members {
        for (axis, bin) in bin_of(*at).into_iter().enumerate() {
            let (around, count) = &mut bins[axis][bin];
            *around = united(*around, boxes[*at as usize]);
            *count += 1;
        }
    }
    let mut best = (f32::INFINITY, None);
    for (axis, bins) in bins.iter().enumerate() {
        let mut costs = [0.0; BINS];
        let mut group = (NOTHING, 0);
        for plane in (1..BINS).rev() {
            group = (united(group.0, bins[plane].0), group.1 + bins[plane].1);
            costs[plane] = half_area(group.0) * group.1 as f32;
        }
        let after = |plane: usize| bins[plane..].iter().any(|(_, count)| *count > 0);
        let mut group = (NOTHING, 0);
        for plane in 1..BINS {
            group = (united(group.0, bins[plane - 1].0), group.1 + bins[plane - 1].1);
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
    use crate::bvh::tests::count;

    /// More than a share: a plain, and many equal triangles in one place.
    fn corners() -> Vec<[Vec3; 3]> {
        let plain = (0..SHARE_MAX as u32 * 2).map(|i| {
            let at = Vec3::new((i % 300) as f32, (i / 300) as f32, (i * 7 % 31) as f32);
            [at, at + Vec3::X, at + Vec3::Y + Vec3::Z]
        });
        let heap = (0..500).map(|_| [Vec3::ZERO, Vec3::X, Vec3::Y]);
        plain.chain(heap).collect()
    }

    fn by_threads(threads: usize) -> Hierarchy {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| divided(&corners()))
    }

    #[test]
    fn a_divided_hierarchy_holds_every_triangle_within_its_boxes() {
        let corners = corners();
        let whole = divided(&corners);
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
                        assert_eq!(united(around, own), around);
                    }
                } else {
                    let child = &whole.nodes[link.0 as usize];
                    for (low, high) in [(child.low0, child.high0), (child.low1, child.high1)] {
                        assert_eq!(united(around, (low.into(), high.into())), around);
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
}
