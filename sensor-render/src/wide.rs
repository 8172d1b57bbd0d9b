use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::bvh::{Box3, Link, Node};

/// Node with eight children, for packets and groups of rays. The rows of `bounds` are low x, high x, low y,
/// high y, low z, high z, each for all children.
///
/// Unused children are [`Link::EMPTY`] with a box that no ray hits.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    bounds: [[f32; 8]; 6],
    pub(crate) children: [Link; 8],
    reserved: [u32; 8],
}

/// A coordinate far outside of any scene.
const OUTSIDE: f32 = 1e30;

impl WideNode {
    pub(crate) const EMPTY: WideNode = {
        let (far, near) = ([OUTSIDE; 8], [-OUTSIDE; 8]);
        let bounds = [far, near, far, near, far, near];
        WideNode { bounds, children: [Link::EMPTY; 8], reserved: [0; 8] }
    };

    /// Node with boxes that contain everything.
    pub(crate) const EVERYWHERE: WideNode = {
        let (far, near) = ([OUTSIDE; 8], [-OUTSIDE; 8]);
        let bounds = [near, far, near, far, near, far];
        WideNode { bounds, children: [Link::EMPTY; 8], reserved: [0; 8] }
    };

    /// Returns a row of the bounds, numbered from 0 to 5.
    #[inline(always)]
    pub(crate) fn row(&self, number: usize) -> &[f32; 8] {
        // The node consists of eight rows, so that a masked number is a valid index.
        &bytemuck::cast_ref::<WideNode, [[f32; 8]; 8]>(self)[number & 7]
    }

    /// Returns the bounds of a child: low x, high x, low y, high y, low z, high z.
    #[inline(always)]
    pub(crate) fn sides(&self, child: usize) -> [f32; 6] {
        self.bounds.map(|row| row[child & 7])
    }

    /// Returns a node with up to eight children, each with its box.
    pub(crate) fn join<const N: usize>(children: [(Link, Box3); N]) -> WideNode {
        let mut node = WideNode::EMPTY;
        for (slot, (link, (low, high))) in children.into_iter().enumerate() {
            node.set_child(slot, &Child { link, low, high }, link);
        }
        node
    }

    /// Sets a child to `link` with the box of a child of another node.
    #[inline(always)]
    pub(crate) fn copy_child(&mut self, slot: usize, node: &WideNode, of: usize, link: Link) {
        for (own, other) in self.bounds.iter_mut().zip(&node.bounds) {
            own[slot] = other[of];
        }
        self.children[slot] = link;
    }

    /// Returns the node with all links moved; see [`Link::moved`].
    pub(crate) fn moved(&self, nodes: u32, primitives: u32) -> WideNode {
        let children = self.children.map(|child| child.moved(nodes, primitives));
        WideNode { children, ..*self }
    }

    fn set_child(&mut self, slot: usize, child: &Child, link: Link) {
        for axis in 0..3 {
            self.bounds[2 * axis][slot] = child.low[axis];
            self.bounds[2 * axis + 1][slot] = child.high[axis];
        }
        self.children[slot] = link;
    }
}

/// Child of a binary node, with its box.
#[derive(Clone, Copy)]
struct Child {
    link: Link,
    low: Vec3,
    high: Vec3,
}

impl Child {
    fn both(node: &Node) -> [Child; 2] {
        let child = |link, low: [f32; 3], high: [f32; 3]| Child {
            link,
            low: Vec3::from(low),
            high: Vec3::from(high),
        };
        [child(node.child0, node.low0, node.high0), child(node.child1, node.low1, node.high1)]
    }

    /// Returns half the surface area, which is proportional to the probability that a ray hits the
    /// box.
    fn half_area(&self) -> f32 {
        let size = self.high - self.low;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// Converts the binary hierarchy below `root` to nodes with eight children, appends these to `wide`
/// and returns the new root. Leaves stay the same.
pub(crate) fn widen(nodes: &[Node], root: Link, wide: &mut Vec<WideNode>) -> Link {
    if root.is_leaf() {
        return root;
    }
    let base = wide.len();
    wide.push(WideNode::EMPTY);
    let mut todo = vec![(root, base)];
    while let Some((link, at)) = todo.pop() {
        let mut children = [Child { link: Link::EMPTY, low: Vec3::ZERO, high: Vec3::ZERO }; 8];
        children[..2].copy_from_slice(&Child::both(&nodes[link.0 as usize]));
        let mut count = 2;
        // Replaces the largest inner child by its two children until there are eight.
        while count < 8 {
            let open = (0..count).filter(|i| !children[*i].link.is_leaf());
            let Some(largest) =
                open.max_by(|a, b| children[*a].half_area().total_cmp(&children[*b].half_area()))
            else {
                break;
            };
            let [a, b] = Child::both(&nodes[children[largest].link.0 as usize]);
            children[largest] = a;
            children[count] = b;
            count += 1;
        }
        for (slot, child) in children[..count].iter().enumerate() {
            let mut link = child.link;
            if !link.is_leaf() {
                link = Link(wide.len() as u32);
                wide.push(WideNode::EMPTY);
                todo.push((child.link, link.0 as usize));
            }
            wide[at].set_child(slot, child, link);
        }
    }
    Link(base as u32)
}
