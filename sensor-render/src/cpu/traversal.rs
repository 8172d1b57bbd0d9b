use crate::bvh::{DEPTH_MAX, Link, TOP_DEPTH_MAX};
use crate::simd::Float8;
use crate::wide::WideNode;

/// Stack of links to visit. All traversals of a thread share one, because the traversal of an
/// instance's hierarchy begins within that of the top level.
#[derive(Debug)]
pub(crate) struct Stack {
    entries: Box<[Entry; STACK]>,
    height: usize,
}

/// Each level leaves at most seven entries on the stack; two hierarchies are traversed at once.
const STACK: usize = 8 * (DEPTH_MAX + TOP_DEPTH_MAX + 2);

#[derive(Clone, Copy, Debug)]
struct Entry {
    near: f32,
    link: Link,
    /// Index of the parent node, and which of its children it is.
    parent: u32,
    child: u32,
}

impl Entry {
    const NONE: Entry = Entry { near: 0.0, link: Link::EMPTY, parent: 0, child: 0 };
}

impl Stack {
    pub(crate) fn new() -> Stack {
        Stack { entries: Box::new([Entry::NONE; STACK]), height: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        self.entries[self.height] = entry;
        self.height += 1;
    }

    /// Pushes an entry below those above `floor` that are nearer.
    #[inline(always)]
    fn push_in_order<const NEAR_FIRST: bool>(&mut self, entry: Entry, floor: usize) {
        let mut at = self.height;
        while NEAR_FIRST && at > floor && self.entries[at - 1].near < entry.near {
            self.entries[at] = self.entries[at - 1];
            at -= 1;
        }
        self.entries[at] = entry;
        self.height += 1;
    }
}

/// Object that is tested against boxes: a beam, or rays.
pub(crate) trait Probe {
    /// Returns which of a node's children may be hit before `limit`, one bit each, and the
    /// parameter at which each begins.
    fn touch<E: Float8>(&self, node: &WideNode, limit: f32) -> (u32, [f32; 8]);
}

/// Action at the leaves of a traversal.
pub(crate) trait Visitor {
    /// Intersects the primitives of a leaf. Returns the new limit along the beam's axis, or minus
    /// infinity to end the traversal.
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32;

    /// Returns whether any ray meets the box of a child that the probe touches. It is called before what lies
    /// below is visited.
    #[inline(always)]
    fn enters(&mut self, _node: &WideNode, _child: usize) -> bool {
        true
    }
}

/// Calls `visitor` for the leaves below `root` that `probe` touches before `limit`, near ones
/// first.
#[inline(always)]
pub(crate) fn walk<E: Float8, P: Probe, V: Visitor>(
    nodes: &[WideNode],
    root: Link,
    probe: &P,
    limit: f32,
    stack: &mut Stack,
    visitor: &mut V,
) {
    walk_in_order::<E, P, V, true>(nodes, root, probe, limit, stack, visitor);
}

/// As [`walk`] with the limit 0, but in any order, which spares the sorting of nodes. Returns the last limit.
#[inline(always)]
pub(crate) fn walk_in_any_order<E: Float8, P: Probe, V: Visitor>(
    nodes: &[WideNode],
    root: Link,
    probe: &P,
    stack: &mut Stack,
    visitor: &mut V,
) -> f32 {
    walk_in_order::<E, P, V, false>(nodes, root, probe, 0.0, stack, visitor)
}

#[inline(always)]
fn walk_in_order<E: Float8, P: Probe, V: Visitor, const NEAR_FIRST: bool>(
    nodes: &[WideNode],
    root: Link,
    probe: &P,
    mut limit: f32,
    stack: &mut Stack,
    visitor: &mut V,
) -> f32 {
    let floor = stack.height;
    let mut link = root;
    loop {
        if link.is_leaf() {
            let (first, count) = link.primitives();
            limit = visitor.visit(stack, first, count);
        } else {
            let node = &nodes[link.0 as usize];
            let (mut touched, near) = probe.touch::<E>(node, limit);
            if touched != 0 {
                let entry = |child: u32| {
                    let slot = child as usize & 7;
                    let near = if NEAR_FIRST { near[slot] } else { 0.0 };
                    Entry { near, link: node.children[slot], parent: link.0, child }
                };
                // One or two children are the common cases, which need no sorting on the stack.
                let mut nearest = entry(touched.trailing_zeros());
                touched &= touched - 1;
                if touched != 0 {
                    let second = entry(touched.trailing_zeros());
                    touched &= touched - 1;
                    let is_second = !NEAR_FIRST || second.near <= nearest.near;
                    let farther;
                    (nearest, farther) =
                        if is_second { (second, nearest) } else { (nearest, second) };
                    let floor = stack.height;
                    stack.push(farther);
                    while touched != 0 {
                        let mut other = entry(touched.trailing_zeros());
                        touched &= touched - 1;
                        if !NEAR_FIRST || other.near <= nearest.near {
                            std::mem::swap(&mut nearest, &mut other);
                        }
                        stack.push_in_order::<NEAR_FIRST>(other, floor);
                    }
                }
                if visitor.enters(node, nearest.child as usize) {
                    link = nearest.link;
                    continue;
                }
            }
        }
        loop {
            if stack.height == floor {
                return limit;
            }
            stack.height -= 1;
            let entry = stack.entries[stack.height];
            if entry.near <= limit
                && visitor.enters(&nodes[entry.parent as usize], entry.child as usize)
            {
                link = entry.link;
                break;
            }
        }
    }
}
