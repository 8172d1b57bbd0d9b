use bus::{ActorState, Stamp, Weather, kind};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::Scene;
use crate::bvh::{Hierarchy, Link, Node, moved_box};
use crate::wide::{WideNode, widen};

/// Bits of [`Instance::lights`].
pub(crate) mod lights {
    /// The driver brakes.
    pub(crate) const BRAKE: u32 = 1 << 0;
    /// A traffic light's phase is in bits 8 and up.
    pub(crate) const SIGNAL: u32 = 1 << 1;
    /// Where the phase begins.
    pub(crate) const PHASE_SHIFT: u32 = 8;
}

/// One actor, ready for rays. The shaders read the same 80 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Instance {
    /// Rows of `actor_from_world`.
    pub(crate) actor_from_world: [[f32; 4]; 3],
    /// Of the blueprint's bottom level.
    pub(crate) root: Link,
    /// The actor's id.
    pub(crate) id: u32,
    /// Red in bits 0 to 7, green, blue; sRGB.
    pub(crate) color: u32,
    /// Bits of [`lights`].
    pub(crate) lights: u32,
    /// Index into the scene's blueprints.
    pub(crate) blueprint: u32,
    pub(crate) reserved: [u32; 3],
}

const _: () = assert!(size_of::<Instance>() == 80);

/// What moves: one frame's actors, its weather and its time.
#[derive(Debug, Default)]
pub struct World {
    pub(crate) stamp: Stamp,
    pub(crate) delta_nanos: u64,
    pub(crate) weather: Weather,
    /// In the order of the top level's leaves.
    pub(crate) instances: Vec<Instance>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) root: Option<Link>,
    /// The same top level, eight children to a node.
    pub(crate) wide: Vec<WideNode>,
    pub(crate) wide_root: Option<Link>,
}

impl World {
    /// An empty world, before its first frame.
    pub fn new() -> World {
        World::default()
    }

    /// The frame that the actors stand in.
    pub fn stamp(&self) -> Stamp {
        self.stamp
    }

    /// Puts the actors of one snapshot where they are, and rebuilds the top level over them.
    ///
    /// `delta_nanos` is the simulated time that the frame took; spinning lidars sweep as far.
    /// `paint` says the paint of a vehicle as red, green and blue. Actors whose blueprint has no
    /// mesh, or is not in the scene, are not seen; nor are those with an invalid pose.
    pub fn place(
        &mut self,
        scene: &Scene,
        stamp: Stamp,
        delta_nanos: u64,
        weather: &Weather,
        actors: &[ActorState],
        paint: impl Fn(&ActorState) -> [u8; 3],
    ) {
        self.stamp = stamp;
        self.delta_nanos = delta_nanos;
        self.weather = *weather;
        let mut instances = Vec::with_capacity(actors.len() + scene.parked.len());
        let mut boxes: Vec<(Vec3, Vec3)> = Vec::with_capacity(actors.len() + scene.parked.len());
        for actor in actors.iter().chain(&scene.parked) {
            let Some(level) = scene.blueprints.get(actor.blueprint as usize) else { continue };
            if level.is_empty() || !actor.pose.is_valid() {
                continue;
            }
            let world_from_actor = actor.pose.affine();
            boxes.push(moved_box(&world_from_actor, level.low, level.high));
            instances.push(Instance {
                actor_from_world: rows(&world_from_actor.inverse()),
                root: level.root,
                id: actor.actor_id.0,
                color: {
                    let [red, green, blue] = paint(actor);
                    u32::from_le_bytes([red, green, blue, 255])
                },
                lights: lights_of(actor),
                blueprint: actor.blueprint,
                reserved: [0; 3],
            });
        }
        let top = Hierarchy::over_boxes(&boxes);
        self.instances.clear();
        self.instances.extend(top.order.iter().map(|&at| instances[at as usize]));
        self.root = (!instances.is_empty()).then_some(top.root);
        self.wide.clear();
        let wide_root = widen(&top.nodes, top.root, &mut self.wide);
        self.wide_root = (!instances.is_empty()).then_some(wide_root);
        self.nodes = top.nodes;
    }
}

fn lights_of(actor: &ActorState) -> u32 {
    match actor.kind {
        kind::VEHICLE if actor.brake > 0.02 => lights::BRAKE,
        kind::TRAFFIC_LIGHT => lights::SIGNAL | actor.phase.min(3) << lights::PHASE_SHIFT,
        _ => 0,
    }
}

/// The three rows of an affine transform.
fn rows(affine: &glam::Affine3A) -> [[f32; 4]; 3] {
    let (m, t) = (&affine.matrix3, affine.translation);
    [0, 1, 2].map(|row| [m.x_axis[row], m.y_axis[row], m.z_axis[row], t[row]])
}
