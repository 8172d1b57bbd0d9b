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
}

impl Stack {
    pub(crate) fn new() -> Stack {
        Stack { entries: Box::new([Entry { near: 0.0, link: Link::EMPTY }; STACK]), height: 0 }
    }
}

/// Object that is tested against boxes: a beam or a single ray.
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

/// As [`walk`] with the limit 0, but in any order, which spares the sorting of nodes.
#[inline(always)]
pub(crate) fn walk_in_any_order<E: Float8, P: Probe, V: Visitor>(
    nodes: &[WideNode],
    root: Link,
    probe: &P,
    stack: &mut Stack,
    visitor: &mut V,
) {
    walk_in_order::<E, P, V, false>(nodes, root, probe, 0.0, stack, visitor);
}

#[inline(always)]
fn walk_in_order<E: Float8, P: Probe, V: Visitor, const NEAR_FIRST: bool>(
    nodes: &[WideNode],
    root: Link,
    probe: &P,
    mut limit: f32,
    stack: &mut Stack,
    visitor: &mut V,
) {
    let floor = stack.height;
    let mut link = root;
    loop {
        if link.is_leaf() {
            let (first, count) = link.primitives();
            limit = visitor.visit(stack, first, count);
        } else {
            let node = &nodes[link.0 as usize];
            let (mut touched, near) = probe.touch::<E>(node, limit);
            if touched & touched.wrapping_sub(1) == 0 {
                if touched != 0 {
                    link = node.children[touched.trailing_zeros() as usize & 7];
                    continue;
                }
            } else {
                let first = stack.height;
                while touched != 0 {
                    let slot = touched.trailing_zeros() as usize & 7;
                    touched &= touched - 1;
                    let near = if NEAR_FIRST { near[slot] } else { 0.0 };
                    let entry = Entry { near, link: node.children[slot] };
                    let mut at = stack.height;
                    while NEAR_FIRST && at > first && stack.entries[at - 1].near < entry.near {
                        stack.entries[at] = stack.entries[at - 1];
                        at -= 1;
                    }
                    stack.entries[at] = entry;
                    stack.height += 1;
                }
            }
        }
        loop {
            if stack.height == floor {
                return;
            }
            stack.height -= 1;
            let entry = stack.entries[stack.height];
            if entry.near <= limit {
                link = entry.link;
                break;
            }
        }
    }
}
