use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};

use bus::{ActorId, ActorState, Pose, kind};
use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};
use rayon::prelude::*;
use road::Mesh;
use town::{Looks, Rig};

use crate::bvh::{Hierarchy, Link, Node};
use crate::wall::{Wall, find_walls};
use crate::wide::{WideNode, widen};

/// Marks the ids of static objects in images.
pub(crate) const STATIC: u32 = 0x8000_0000;

/// Other looks for a blueprint: its index, its looks, and how their pieces move.
pub(crate) type Replaced = (u32, Looks, Rig);

/// One blueprint's looks, if it is one piece that does not move in itself.
#[derive(Clone, Copy, Debug)]
pub struct BlueprintMesh<'a> {
    /// In actor space; an empty mesh is never seen.
    pub mesh: &'a Mesh,
}

/// The pieces of one blueprint, and how they move.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Of the pieces' bottom levels, one for each joint.
    pub(crate) first_level: u32,
    /// None: it is one piece that does not move.
    pub(crate) rig: Option<Cow<'static, Rig>>,
    /// Of all of it at rest, for those that never move.
    pub(crate) whole: Option<u32>,
}

impl Figure {
    /// Those of the catalogue, whose bottom levels follow each other; and which blueprints are
    /// parked, whose levels in one piece come after them.
    pub(crate) fn all(parked: &[ActorState]) -> (Vec<Figure>, Vec<u32>) {
        let mut first_level = 0;
        let mut figures: Vec<Figure> = town::catalogue()
            .iter()
            .map(|blueprint| {
                let rig = blueprint.rig();
                let rig_of = (!rig.is_still()).then_some(Cow::Borrowed(rig));
                let figure = Figure { first_level, rig: rig_of, whole: None };
                first_level += rig.joints.len() as u32;
                figure
            })
            .collect();
        let mut kinds: Vec<u32> = parked.iter().map(|one| one.blueprint).collect();
        kinds.sort_unstable();
        kinds.dedup();
        for (kind, level) in kinds.iter().zip(first_level..) {
            figures[*kind as usize].whole = Some(level);
        }
        (figures, kinds)
    }
}

/// One triangle with all that a hit needs to know. The shaders read the same 48 bytes.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub(crate) struct Triangle {
    pub(crate) corner: [f32; 3],
    /// Tag in bits 0 to 7, material in bits 8 to 15, tint in bits 16 to 31 ([`road::Face::tint`]).
    pub(crate) face: u32,
    pub(crate) edge1: [f32; 3],
    pub(crate) object: u32,
    pub(crate) edge2: [f32; 3],
    /// Index into the scene's walls; 0: none.
    pub(crate) wall: u32,
}

const _: () = assert!(size_of::<Triangle>() == 48);

impl Triangle {
    #[cfg(test)]
    pub(crate) fn tag(&self) -> u8 {
        self.face as u8
    }

    #[inline(always)]
    pub(crate) fn material(&self) -> u8 {
        (self.face >> 8) as u8
    }

    /// A colour in the material's place; 0: the material's own.
    #[inline(always)]
    pub(crate) fn tint(&self) -> u16 {
        (self.face >> 16) as u16
    }
}

/// The bottom level of one mesh.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Level {
    pub(crate) root: Link,
    /// In the wide hierarchy.
    pub(crate) wide_root: Link,
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
}

impl Level {
    const EMPTY: Level =
        Level { root: Link::EMPTY, wide_root: Link::EMPTY, low: Vec3::ZERO, high: Vec3::ZERO };

    pub(crate) fn is_empty(&self) -> bool {
        self.root == Link::EMPTY
    }
}

/// All that stays the same for an episode: the town and the looks of every blueprint.
///
/// Triangles lie in the order of the leaves of one bottom level for the town and one for each piece
/// of a blueprint.
#[derive(Debug)]
pub struct Scene {
    /// No two scenes of a process have the same.
    pub(crate) serial: u64,
    pub(crate) nodes: Vec<Node>,
    /// The same hierarchies, eight children to a node.
    pub(crate) wide: Vec<WideNode>,
    /// No coordinate of the town or a blueprint is larger than this.
    pub(crate) reach: f32,
    pub(crate) triangles: Vec<Triangle>,
    /// The first is none.
    pub(crate) walls: Vec<Wall>,
    pub(crate) ground: Level,
    /// Of every piece of every blueprint, then of all of each that is parked.
    pub(crate) levels: Vec<Level>,
    /// By blueprint.
    pub(crate) figures: Vec<Figure>,
    /// Vehicles that never move.
    pub(crate) parked: Vec<ActorState>,
}

impl Scene {
    /// Builds the bottom levels. Triangles with a corner that is not finite cannot be hit and are
    /// left out.
    ///
    /// # Panics
    /// If all meshes together hold 2²⁶ triangles or more.
    pub fn new(static_mesh: &Mesh, blueprints: &[BlueprintMesh]) -> Scene {
        let meshes: Vec<&Mesh> = blueprints.iter().map(|blueprint| blueprint.mesh).collect();
        let figure = |first_level| Figure { first_level, rig: None, whole: None };
        Scene::of_pieces(static_mesh, &meshes, (0..meshes.len() as u32).map(figure).collect())
    }

    /// The scene of a town and of every blueprint that can be spawned in it.
    pub fn of_town(town: &town::Town) -> Scene {
        Scene::furnished(town, &[])
    }

    /// As [`Scene::of_town`], with other looks for some blueprints.
    pub(crate) fn furnished(town: &town::Town, replaced: &[Replaced]) -> Scene {
        let parked = town.parked.iter().map(|one| stand(town, one)).collect();
        Scene::with_catalogue(&town.mesh, parked, replaced)
    }

    /// Every blueprint of the catalogue, in the pieces that move.
    pub(crate) fn with_catalogue(
        static_mesh: &Mesh,
        parked: Vec<ActorState>,
        replaced: &[Replaced],
    ) -> Scene {
        let (mut figures, kinds) = Figure::all(&parked);
        let mut looks: Vec<&Looks> = town::catalogue().par_iter().map(|b| b.looks()).collect();
        for (index, found, rig) in replaced {
            looks[*index as usize] = found;
            figures[*index as usize].rig = Some(Cow::Owned(rig.clone()));
        }
        let wholes = kinds.iter().map(|kind| &looks[*kind as usize].whole);
        let meshes: Vec<&Mesh> =
            looks.iter().flat_map(|looks| &looks.pieces).chain(wholes).collect();
        Scene { parked, ..Scene::of_pieces(static_mesh, &meshes, figures) }
    }

    fn of_pieces(static_mesh: &Mesh, pieces: &[&Mesh], figures: Vec<Figure>) -> Scene {
        let mut scene = Scene {
            serial: new_serial(),
            nodes: Vec::new(),
            wide: Vec::new(),
            reach: 1000.0,
            triangles: Vec::new(),
            walls: vec![Wall::NONE],
            ground: Level::EMPTY,
            levels: Vec::with_capacity(pieces.len()),
            figures,
            parked: Vec::new(),
        };
        let (ground, looks) = rayon::join(
            || Part::new(static_mesh),
            || pieces.par_iter().map(|mesh| Part::new(mesh)).collect::<Vec<_>>(),
        );
        scene.ground = scene.add(ground);
        let own = scene.triangles.len();
        scene.levels = looks.into_iter().map(|part| scene.add(part)).collect();
        let Scene { nodes, wide, triangles, walls, ground, levels, .. } = &mut scene;
        rayon::join(
            || {
                for level in [ground].into_iter().chain(levels) {
                    level.wide_root = widen(nodes, level.root, wide);
                }
            },
            || find_walls(&mut triangles[..own], walls),
        );
        scene
    }

    /// How many triangles lie in memory: the town's and each blueprint's once.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Appends the bottom level of a mesh; it is not widened yet.
    fn add(&mut self, part: Part) -> Level {
        let first = self.triangles.len();
        assert!(
            first + part.triangles.len() < Link::PRIMITIVES_MAX,
            "the scene holds {} triangles, {} is the most",
            first + part.triangles.len(),
            Link::PRIMITIVES_MAX - 1
        );
        let root = part.hierarchy.append_to(&mut self.nodes, first as u32);
        let Part { low, high, .. } = part;
        if !part.triangles.is_empty() {
            self.reach = self.reach.max(low.abs().max(high.abs()).max_element());
        }
        self.triangles.extend(part.triangles);
        Level { root, wide_root: Link::EMPTY, low, high }
    }
}

/// A parked vehicle as an actor; its id is that of the static object.
fn stand(town: &town::Town, parked: &town::Parked) -> ActorState {
    let [r, g, b] = town.objects[parked.object as usize].color;
    ActorState {
        actor_id: ActorId(STATIC | (parked.object + 1)),
        blueprint: parked.blueprint,
        kind: kind::VEHICLE,
        pose: Pose::new(parked.position, Quat::from_array(parked.rotation)),
        color: u32::from_le_bytes([r, g, b, 255]),
        ..Default::default()
    }
}

/// No two scenes of a process have the same.
pub(crate) fn new_serial() -> u64 {
    static SERIAL: AtomicU64 = AtomicU64::new(1);
    SERIAL.fetch_add(1, Ordering::Relaxed)
}

/// What one mesh brings into the scene.
struct Part {
    hierarchy: Hierarchy,
    /// In the order of the leaves.
    triangles: Vec<Triangle>,
    low: Vec3,
    high: Vec3,
}

impl Part {
    fn new(mesh: &Mesh) -> Part {
        let mut kept = Vec::with_capacity(mesh.triangles.len());
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let points = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            if points.iter().all(|point| point.is_finite()) {
                kept.push(index);
                corners.push(points);
            }
        }
        let hierarchy = Hierarchy::over_triangles(&corners);
        let triangle = |at: &u32| {
            let [a, b, c] = corners[*at as usize];
            let face = mesh.faces[kept[*at as usize]];
            Triangle {
                corner: a.to_array(),
                face: u32::from(face.tag)
                    | u32::from(face.material) << 8
                    | u32::from(face.tint) << 16,
                edge1: (b - a).to_array(),
                object: face.object,
                edge2: (c - a).to_array(),
                wall: 0,
            }
        };
        let triangles = hierarchy.order.par_iter().map(triangle).collect();
        let (low, high) = corners
            .iter()
            .flatten()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        Part { hierarchy, triangles, low, high }
    }
}
