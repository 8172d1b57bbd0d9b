use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec3A};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, bvh2::node::Bvh2Node};

/// Lowest and highest corner of an axis-aligned box.
pub(crate) type Box3 = (Vec3, Vec3);

/// Depth limits of a bottom-level and of a top-level hierarchy. Their sum is the length of the
/// traversal stack of the shaders (reference.wgsl), which the device clears for every ray and which
/// is therefore short.
pub(crate) const DEPTH_MAX: usize = 33;
pub(crate) const TOP_DEPTH_MAX: usize = 18;

/// Maximum number of primitives in one leaf.
pub(crate) const LEAF_MAX: u32 = 4;

/// Reference to an inner node, or to a leaf with its range of primitives.
///
/// Bit 31 marks a leaf; then bits 26 to 30 are the number of its primitives and bits 0 to 25 the
/// index of the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Link(pub(crate) u32);

impl Link {
    /// Leaf without primitives.
    pub(crate) const EMPTY: Link = Link(1 << 31);

    /// Number of primitives that a leaf can address.
    pub(crate) const PRIMITIVES_MAX: usize = 1 << 26;

    pub(crate) fn leaf(first: u32, count: u32) -> Link {
        debug_assert!(count < 32 && (first as usize) < Link::PRIMITIVES_MAX);
        Link(1 << 31 | count << 26 | first)
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 >> 31 != 0
    }

    /// Returns the first primitive of a leaf, and the number of primitives.
    #[inline(always)]
    pub(crate) fn primitives(self) -> (u32, u32) {
        (self.0 & 0x3ff_ffff, self.0 >> 26 & 31)
    }

    /// Returns the link after `nodes` nodes and `primitives` primitives were inserted before it.
    /// The sums wrap, so that a wrapped negative number moves the link back.
    pub(crate) fn moved(self, nodes: u32, primitives: u32) -> Link {
        if self.is_leaf() {
            match self.primitives() {
                (_, 0) => self,
                (first, count) => Link::leaf(first.wrapping_add(primitives), count),
            }
        } else {
            Link(self.0.wrapping_add(nodes))
        }
    }
}

/// Inner node of a binary hierarchy, with the boxes of both children. The shaders read the same 64
/// bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Node {
    pub(crate) low0: [f32; 3],
    pub(crate) child0: Link,
    pub(crate) high0: [f32; 3],
    pub(crate) child1: Link,
    pub(crate) low1: [f32; 3],
    pub(crate) reserved0: u32,
    pub(crate) high1: [f32; 3],
    pub(crate) reserved1: u32,
}

const _: () = assert!(size_of::<Node>() == 64);

impl Node {
    /// Node whose children are set later.
    pub(crate) const JOIN: Node = Node {
        low0: [0.0; 3],
        child0: Link::EMPTY,
        high0: [0.0; 3],
        child1: Link::EMPTY,
        low1: [0.0; 3],
        reserved0: 0,
        high1: [0.0; 3],
        reserved1: 0,
    };

    /// Returns the node with both links moved; see [`Link::moved`].
    pub(crate) fn moved(&self, nodes: u32, primitives: u32) -> Node {
        Node {
            child0: self.child0.moved(nodes, primitives),
            child1: self.child1.moved(nodes, primitives),
            ..*self
        }
    }
}

/// Bounding volume hierarchy over primitives that the caller stores in `order`.
pub(crate) struct Hierarchy {
    /// Inner nodes; a parent lies before its children.
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Link,
    /// Index of each primitive in the input of the builder, in the order of the leaves.
    pub(crate) order: Vec<u32>,
}

impl Hierarchy {
    /// Builds a hierarchy over triangles on the calling thread, no deeper than `depth_max`. With
    /// `fast`, the build is quicker and the rays are slower.
    pub(crate) fn over_triangles_serial(
        corners: &[[Vec3; 3]],
        depth_max: usize,
        fast: bool,
    ) -> Hierarchy {
        if corners.is_empty() {
            return Hierarchy { nodes: Vec::new(), root: Link::EMPTY, order: Vec::new() };
        }
        let triangles: Vec<Triangle> = corners
            .iter()
            .map(|[a, b, c]| Triangle { v0: (*a).into(), v1: (*b).into(), v2: (*c).into() })
            .collect();
        let mut config =
            if fast { BvhBuildParams::fast_build() } else { BvhBuildParams::medium_build() };
        if !fast {
            // Rays take a tenth less time than with 0.05 and 3, the setting's.
            config.reinsertion_batch_ratio = 0.3;
            config.collapse_traversal_cost = 1.0;
        }
        config.max_prims_per_leaf = LEAF_MAX;
        let tree = build_bvh2_from_tris(&triangles, config, &mut Default::default());
        let boxes: Vec<_> = corners.iter().map(bounds).collect();
        flatten(&tree, &boxes, depth_max)
    }

    /// Appends the nodes to `nodes` and returns the root; the primitives begin at
    /// `first_primitive`.
    pub(crate) fn append_to(self, nodes: &mut Vec<Node>, first_primitive: u32) -> Link {
        if nodes.is_empty() && first_primitive == 0 {
            *nodes = self.nodes;
            return self.root;
        }
        let base = nodes.len();
        nodes.resize(base + self.nodes.len(), Node::zeroed());
        self.copy_to(&mut nodes[base..], base as u32, first_primitive)
    }

    /// Copies the nodes to `nodes`, which lie behind `base` other nodes, and returns the root.
    pub(crate) fn copy_to(&self, nodes: &mut [Node], base: u32, first_primitive: u32) -> Link {
        for (to, node) in nodes.iter_mut().zip(&self.nodes) {
            *to = node.moved(base, first_primitive);
        }
        self.root.moved(base, first_primitive)
    }
}

/// Returns the bounding box of a triangle.
pub(crate) fn bounds([a, b, c]: &[Vec3; 3]) -> Box3 {
    (a.min(*b).min(*c), a.max(*b).max(*c))
}

/// Number of levels of inner nodes below a node of a tree, itself included, and number of its primitives.
#[derive(Clone, Copy, Default)]
struct Extent {
    levels: usize,
    primitives: usize,
}

impl Extent {
    /// Returns the extent of each node of a tree.
    fn all(tree: &Bvh2) -> Vec<Extent> {
        let mut extents = vec![Extent::default(); tree.nodes.len()];
        // Parents before children.
        let mut order = vec![0];
        let mut at = 0;
        while let Some(node) = order.get(at).map(|node| &tree.nodes[*node]) {
            if !node.is_leaf() {
                let first = node.first_index as usize;
                order.extend([first, first + 1]);
            }
            at += 1;
        }
        for at in order.into_iter().rev() {
            let node = &tree.nodes[at];
            extents[at] = if node.is_leaf() {
                Extent { levels: 0, primitives: node.prim_count as usize }
            } else {
                let first = node.first_index as usize;
                let (a, b) = (extents[first], extents[first + 1]);
                Extent {
                    levels: 1 + a.levels.max(b.levels),
                    primitives: a.primitives + b.primitives,
                }
            };
        }
        extents
    }

    /// Returns the number of levels of inner nodes of a hierarchy that halves the primitives.
    fn halved_levels(self) -> usize {
        let leaves = self.primitives.div_ceil(LEAF_MAX as usize);
        leaves.next_power_of_two().ilog2() as usize
    }
}

/// Copies the tree in depth-first order. Where it is deeper than `depth_max`, which happens where many
/// primitives coincide, the smallest parts that can be mended are replaced by hierarchies that halve their
/// primitives.
fn flatten(tree: &Bvh2, boxes: &[Box3], depth_max: usize) -> Hierarchy {
    let extents = Extent::all(tree);
    let mut nodes: Vec<Node> = Vec::with_capacity(tree.nodes.len() / 2);
    let mut order = Vec::with_capacity(boxes.len());
    let mut root = Link::EMPTY;
    // Each entry: node of the tree, index of its parent in `nodes`, which child it is, and the levels
    // above it.
    let mut stack = vec![(0usize, usize::MAX, 0, 0)];
    while let Some((at, parent, side, above)) = stack.pop() {
        let node = &tree.nodes[at];
        let first = node.first_index as usize;
        let is_lost = |child: usize| {
            above + 1 + extents[child].levels > depth_max
                && above + 1 + extents[child].halved_levels() > depth_max
        };
        let is_rebuilt = !node.is_leaf() && (is_lost(first) || is_lost(first + 1));
        let own = if is_rebuilt {
            let begin = order.len();
            collect(tree, node, &mut order);
            halve(boxes, &mut nodes, &mut order[begin..], begin).0
        } else if node.is_leaf() {
            let begin = order.len() as u32;
            collect(tree, node, &mut order);
            Link::leaf(begin, node.prim_count)
        } else {
            Link(nodes.len() as u32)
        };
        match nodes.get_mut(parent) {
            None => root = own,
            Some(parent) if side == 0 => parent.child0 = own,
            Some(parent) => parent.child1 = own,
        }
        if is_rebuilt || node.is_leaf() {
            continue;
        }
        let [a, b] = [tree.nodes[first].aabb, tree.nodes[first + 1].aabb];
        stack.push((first + 1, nodes.len(), 1, above + 1));
        stack.push((first, nodes.len(), 0, above + 1));
        nodes.push(node_of(a.min.to_vec3(), a.max.to_vec3(), b.min.to_vec3(), b.max.to_vec3()));
    }
    Hierarchy { nodes, root, order }
}

/// Appends the primitives below a node of the tree to `order`.
fn collect(tree: &Bvh2, node: &Bvh2Node, order: &mut Vec<u32>) {
    let mut stack = vec![*node];
    while let Some(node) = stack.pop() {
        let first = node.first_index as usize;
        if node.is_leaf() {
            order.extend(&tree.primitive_indices[first..first + node.prim_count as usize]);
        } else {
            stack.extend([tree.nodes[first + 1], tree.nodes[first]]);
        }
    }
}

pub(crate) fn node_of(low0: Vec3, high0: Vec3, low1: Vec3, high1: Vec3) -> Node {
    Node {
        low0: low0.to_array(),
        child0: Link::EMPTY,
        high0: high0.to_array(),
        child1: Link::EMPTY,
        low1: low1.to_array(),
        reserved0: 0,
        high1: high1.to_array(),
        reserved1: 0,
    }
}

/// Halves the primitives of `run` by count along the longest axis until they fit into leaves, so
/// that the depth is logarithmic for any input. `run` begins at position `first` of the order.
/// Returns the root and its box.
pub(crate) fn halve(
    boxes: &[Box3],
    nodes: &mut Vec<Node>,
    run: &mut [u32],
    first: usize,
) -> (Link, Box3) {
    let around = run
        .iter()
        .map(|i| boxes[*i as usize])
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (l, h)| {
            (low.min(l), high.max(h))
        });
    let count = run.len();
    if count as u32 <= LEAF_MAX {
        return (Link::leaf(first as u32, count as u32), around);
    }
    let axis = (around.1 - around.0).max_position();
    let middle = |i: &u32| boxes[*i as usize].0[axis] + boxes[*i as usize].1[axis];
    run.sort_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
    let own = nodes.len();
    nodes.push(node_of(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO));
    let (lower, upper) = run.split_at_mut(count / 2);
    let (child0, box0) = halve(boxes, nodes, lower, first);
    let (child1, box1) = halve(boxes, nodes, upper, first + count / 2);
    nodes[own] = Node { child0, child1, ..node_of(box0.0, box0.1, box1.0, box1.1) };
    (Link(own as u32), around)
}

/// Returns the bounding box of the box from `low` to `high` after `affine`.
pub(crate) fn transformed_box(affine: &glam::Affine3A, low: Vec3, high: Vec3) -> Box3 {
    let (center, half) = (Vec3A::from(low + high) * 0.5, Vec3A::from(high - low) * 0.5);
    let center = affine.transform_point3a(center);
    let m = &affine.matrix3;
    let half = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    ((center - half).to_vec3(), (center + half).to_vec3())
}

/// Appends the primitives below `link` to `seen`; returns the depth of the hierarchy below it.
#[cfg(test)]
pub(crate) fn count(nodes: &[Node], link: Link, depth: usize, seen: &mut Vec<u32>) -> usize {
    if link.is_leaf() {
        let (first, count) = link.primitives();
        seen.extend(first..first + count);
        return depth;
    }
    let node = &nodes[link.0 as usize];
    count(nodes, node.child0, depth + 1, seen).max(count(nodes, node.child1, depth + 1, seen))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_too_deep_is_halved() {
        // A plane, and triangles towards a point, each half as large as the one before: one per level.
        let plane = (0..2000).map(|i| (Vec3::new((1 + i % 50) as f32, (i / 50) as f32, 0.0), 1.0));
        let point = (0..60).map(|i| 0.5f32.powi(i)).map(|size| (Vec3::splat(-size), size));
        let corners: Vec<[Vec3; 3]> = plane
            .chain(point)
            .map(|(at, size)| [at, at + Vec3::X * size, at + Vec3::Y * size])
            .collect();
        let built = |depth_max| {
            let hierarchy = Hierarchy::over_triangles_serial(&corners, depth_max, false);
            let mut seen = Vec::new();
            let depth = count(&hierarchy.nodes, hierarchy.root, 0, &mut seen);
            assert!(depth <= depth_max, "depth {depth} of {depth_max}");
            let mut order = hierarchy.order.clone();
            order.sort_unstable();
            assert!(order == (0..2060).collect::<Vec<_>>() && seen.len() == 2060);
            let boxes = |node: &Node| {
                bytemuck::cast_slice::<f32, u32>(
                    &[node.low0, node.high0, node.low1, node.high1].concat(),
                )
                .to_vec()
            };
            (depth, hierarchy.nodes.iter().map(boxes).collect::<Vec<_>>())
        };
        let (depth, free) = built(200);
        assert!(depth > 20, "{depth}");
        let (_, limited) = built(depth - 3);
        let kept = limited.iter().filter(|node| free.contains(node)).count();
        assert!(kept + 20 > free.len(), "{kept} of {} nodes", free.len());
        built(11);
    }

    #[test]
    fn halving_keeps_every_triangle_inside_its_leaf() {
        let corners: Vec<[Vec3; 3]> = (0..300)
            .map(|i| {
                let at = Vec3::new((i % 17) as f32, (i % 5) as f32, i as f32);
                [at, at + Vec3::X, at + Vec3::Y]
            })
            .collect();
        let boxes: Vec<Box3> = corners.iter().map(bounds).collect();
        let (mut nodes, mut order) = (Vec::new(), (0..300).collect::<Vec<u32>>());
        let (root, ..) = halve(&boxes, &mut nodes, &mut order, 0);
        let hierarchy = Hierarchy { nodes, root, order };
        let mut seen = Vec::new();
        count(&hierarchy.nodes, hierarchy.root, 0, &mut seen);
        for node in &hierarchy.nodes {
            for (link, low, high) in
                [(node.child0, node.low0, node.high0), (node.child1, node.low1, node.high1)]
            {
                if link.is_leaf() {
                    let (first, count) = link.primitives();
                    for at in first..first + count {
                        let (l, h) = bounds(&corners[hierarchy.order[at as usize] as usize]);
                        assert!(l.cmpge(Vec3::from(low)).all() && h.cmple(Vec3::from(high)).all());
                    }
                }
            }
        }
        assert_eq!(seen.len(), 300);
    }
}
