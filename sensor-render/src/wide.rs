use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::bvh::{Link, Node};

/// A node with eight children, for beams of rays: the rows of `bounds` are x low, x high, y low,
/// y high, z low, z high, each for all children.
///
/// The rest is [`Link::EMPTY`] with a box that nothing touches. The last row is never read: with
/// it any row number masked to three bits exists.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct WideNode {
    pub(crate) bounds: [[f32; 8]; 8],
    pub(crate) children: [Link; 8],
    pub(crate) reserved: [u32; 8],
}

/// Far outside of any scene.
const NOWHERE: f32 = 1e30;

impl WideNode {
    fn empty() -> WideNode {
        let mut bounds = [[NOWHERE; 8]; 8];
        for axis in 0..3 {
            bounds[2 * axis + 1] = [-NOWHERE; 8];
        }
        WideNode { bounds, children: [Link::EMPTY; 8], reserved: [0; 8] }
    }

    /// The same node, see [`Link::moved`].
    pub(crate) fn moved(&self, nodes: u32, primitives: u32) -> WideNode {
        let children = self.children.map(|child| child.moved(nodes, primitives));
        WideNode { children, ..*self }
    }

    fn put(&mut self, slot: usize, child: &Child, link: Link) {
        for axis in 0..3 {
            self.bounds[2 * axis][slot] = child.low[axis];
            self.bounds[2 * axis + 1][slot] = child.high[axis];
        }
        self.children[slot] = link;
    }
}

/// A node of the binary hierarchy as its parent sees it.
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

    /// Half the surface: proportional to how likely a ray is to pass.
    fn half_area(&self) -> f32 {
        let size = self.high - self.low;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// Appends the hierarchy below `root`, widened, to `wide`; its leaves stay as they are.
pub(crate) fn widen(nodes: &[Node], root: Link, wide: &mut Vec<WideNode>) -> Link {
    if root.is_leaf() {
        return root;
    }
    let base = wide.len();
    wide.push(WideNode::empty());
    let mut todo = vec![(root, base)];
    while let Some((link, at)) = todo.pop() {
        let mut children = [Child { link: Link::EMPTY, low: Vec3::ZERO, high: Vec3::ZERO }; 8];
        children[..2].copy_from_slice(&Child::both(&nodes[link.0 as usize]));
        let mut count = 2;
        // Opens the largest inner child until there are eight.
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
                wide.push(WideNode::empty());
                todo.push((child.link, link.0 as usize));
            }
            wide[at].put(slot, child, link);
        }
    }
    Link(base as u32)
}
