//! Parked vehicles and plants: a part of the top-level hierarchy that is built once per scene.

use bytemuck::Zeroable;
use glam::Vec3;
use mesh::ObjectId;
use protocol::GivenPoses;

use crate::bvh::{Box3, Link, Node};
use crate::instance::{Instance, lights};
use crate::pieces::pieces;
use crate::sah_build::over_boxes;
use crate::scene::Scene;
use crate::wide::{WideNode, widen};

/// Top-level hierarchy over the parked vehicles and plants of a scene. Its links count a node before it, at which
/// the hierarchy of a frame joins it with that of the actors.
#[derive(Debug)]
pub(crate) struct ParkedHierarchy {
    /// In the order of the leaves.
    pub(crate) instances: Vec<Instance>,
    /// The first node is the one that joins.
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Link,
    pub(crate) wide: Vec<WideNode>,
    pub(crate) wide_root: Link,
    pub(crate) around: Box3,
}

impl ParkedHierarchy {
    pub(crate) fn of(scene: &Scene) -> ParkedHierarchy {
        let (mut instances, mut boxes) = (Vec::new(), Vec::new());
        let poses = GivenPoses::default();
        for actor in &scene.parked {
            let geometry = Instance {
                id: actor.actor_id.0,
                color: actor.color | 0xff00_0000,
                lights: lights::PARKED,
                ..Instance::zeroed()
            };
            pieces(scene, actor, (&poses, None), true, |blas, world_from_piece| {
                let (bounds, piece) = geometry.placed(scene, blas, world_from_piece);
                boxes.push(bounds);
                instances.push(piece);
            });
        }
        for plant in &scene.plants {
            let Some(blas) = scene.plant_blas(plant) else { continue };
            let geometry = Instance {
                id: ObjectId::from_index(plant.object).instance(),
                lights: lights::PARKED,
                ..Instance::zeroed()
            };
            let (bounds, piece) = geometry.placed(scene, blas, &plant.world_from_model());
            boxes.push(bounds);
            instances.push(Instance { size_squared: plant.scale * plant.scale, ..piece });
        }
        let top = over_boxes(&boxes);
        let mut nodes = vec![Node::JOIN];
        let root = top.root.moved(1, 0);
        nodes.extend(top.nodes.iter().map(|node| node.moved(1, 0)));
        let mut wide = vec![WideNode::EMPTY];
        let wide_root = widen(&nodes, root, &mut wide);
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let around =
            boxes.iter().fold(nothing, |(low, high), own| (low.min(own.0), high.max(own.1)));
        let instances = top.order.iter().map(|&at| instances[at as usize]).collect();
        ParkedHierarchy { instances, nodes, root, wide, wide_root, around }
    }
}
