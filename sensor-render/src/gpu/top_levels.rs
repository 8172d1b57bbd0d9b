//! Top levels of a world and of its time slices in one buffer.

use crate::bvh::{Link, Node};
use crate::instance::Instance;
use crate::rays::Camera;
use crate::time_slices::RAYS_MAX;
use crate::world::World;

/// Place of a time slice behind the world: its own nodes begin with the one that joins, and parked vehicles
/// and plants are those of the world.
#[derive(Clone, Copy)]
struct Place {
    node: u32,
    instance: u32,
    parked: [u32; 2],
}

impl Place {
    /// Returns a link of the slice in the joined buffer.
    fn moved(&self, link: Link) -> Link {
        let [nodes, instances] = self.parked;
        if link.is_leaf() {
            let (first, count) = link.primitives();
            if first < instances || count == 0 {
                return link;
            }
            return Link::leaf(first - instances + self.instance, count);
        }
        match link.0 {
            0 => Link(self.node),
            at if at < nodes => link,
            at => Link(at - nodes + self.node + 1),
        }
    }
}

/// Returns the time slices with their places.
fn places(world: &World) -> Vec<(&World, Place)> {
    let parked = world.parked_counts().map(|count| count as u32);
    let mut place =
        Place { node: world.nodes.len() as u32, instance: world.instances.len() as u32, parked };
    let mut placed = Vec::new();
    for slice in world.all_slices() {
        placed.push((slice, place));
        place.node += slice.nodes.len() as u32 - parked[0] + 1;
        place.instance += slice.instances.len() as u32 - parked[1];
    }
    placed
}

/// Returns the nodes and instances of a world and its time slices; `None` if it has no slices.
pub(crate) fn joined(world: &World) -> Option<(Vec<Node>, Vec<Instance>)> {
    world.all_slices().next()?;
    let (mut nodes, mut instances) = (world.nodes.clone(), world.instances.clone());
    for (slice, place) in places(world) {
        let [parked_nodes, parked_instances] = place.parked.map(|count| count as usize);
        let own = std::iter::once(&slice.nodes[0]).chain(&slice.nodes[parked_nodes..]);
        nodes.extend(own.map(|node| Node {
            child0: place.moved(node.child0),
            child1: place.moved(node.child1),
            ..*node
        }));
        instances.extend_from_slice(&slice.instances[parked_instances..]);
    }
    Some((nodes, instances))
}

/// Returns the roots that the rays of a pixel of a camera are traced in; `None` without motion blur.
pub(crate) fn roots(world: &World, camera: &Camera) -> Option<[u32; RAYS_MAX]> {
    let slices = world.slices_of(camera)?;
    let placed = places(world);
    let mut roots = [Link::EMPTY.0; RAYS_MAX];
    for (root, slice) in roots.iter_mut().zip(slices) {
        let place = placed.iter().find(|(placed, _)| std::ptr::eq(*placed, slice));
        if let (Some((_, place)), Some(link)) = (place, slice.root) {
            *root = place.moved(link).0;
        }
    }
    Some(roots)
}
