use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};
use mesh::Mesh;
use protocol::{ActorId, ActorState, Pose, kind};
use rayon::prelude::*;
use town::{Geometry, Rig};

use crate::bvh::{Hierarchy, Link, Node};
use crate::wall::{Wall, find_walls};
use crate::wide::{WideNode, widen};

/// Marks the ids of static objects in images.
pub(crate) const STATIC: u32 = mesh::ObjectId::STATIC_BIT;

/// Other looks for a blueprint: its index, its looks, and how their pieces move.
pub(crate) type Replaced = (u32, Geometry, Rig);

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
    /// Tag in bits 0 to 7, material in bits 8 to 15, tint in bits 16 to 31 ([`mesh::Face::tint`]).
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

    /// No coordinate is larger than this.
    fn reach(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.low.abs().max(self.high.abs()).max_element() }
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
    /// Where the town's nodes, wide nodes and triangles end; the blueprints' follow.
    pub(crate) town_ends: [u32; 3],
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
        let mut looks: Vec<&Geometry> =
            town::catalogue().par_iter().map(|b| b.geometry()).collect();
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
            town_ends: [0; 3],
            levels: Vec::with_capacity(pieces.len()),
            figures,
            parked: Vec::new(),
        };
        let (ground, looks) = rayon::join(
            || Part::new(static_mesh),
            || pieces.par_iter().map(|mesh| Part::new(mesh)).collect::<Vec<_>>(),
        );
        scene.ground = scene.add(ground);
        let ends = [scene.nodes.len(), scene.triangles.len()].map(|end| end as u32);
        scene.levels = looks.into_iter().map(|part| scene.add(part)).collect();
        let town_wide = scene.finish_town(ends[1]);
        let Scene { nodes, wide, levels, .. } = &mut scene;
        for level in levels {
            level.wide_root = widen(nodes, level.root, wide);
        }
        scene.town_ends = [ends[0], town_wide, ends[1]];
        scene
    }

    /// Widens the town's hierarchy and finds its walls; says where its wide nodes end.
    fn finish_town(&mut self, triangle_end: u32) -> u32 {
        let Scene { nodes, wide, triangles, walls, ground, .. } = self;
        let own = &mut triangles[..triangle_end as usize];
        rayon::join(
            || ground.wide_root = widen(nodes, ground.root, wide),
            || find_walls(own, walls),
        );
        wide.len() as u32
    }

    /// As [`Scene::furnished`] for another state of the same town, with the blueprints' bottom
    /// levels of this scene; none if the town parks what this scene does not hold in one piece.
    pub(crate) fn refurnished(&self, town: &town::Town) -> Option<Scene> {
        let is_known = |one: &town::Parked| self.figures[one.blueprint as usize].whole.is_some();
        if !town.parked.iter().all(is_known) {
            return None;
        }
        let mut scene = Scene {
            serial: new_serial(),
            nodes: Vec::new(),
            wide: Vec::new(),
            reach: self.levels.iter().fold(1000.0, |reach, level| reach.max(level.reach())),
            triangles: Vec::new(),
            walls: vec![Wall::NONE],
            ground: Level::EMPTY,
            town_ends: [0; 3],
            levels: Vec::new(),
            figures: self.figures.clone(),
            parked: town.parked.iter().map(|one| stand(town, one)).collect(),
        };
        scene.ground = scene.add(Part::new(&town.mesh));
        let triangle_end = scene.triangles.len() as u32;
        let wide_end = scene.finish_town(triangle_end);
        scene.town_ends = [scene.nodes.len() as u32, wide_end, triangle_end];
        let [nodes, wide, triangles] = self.town_ends.map(|end| end as usize);
        let [by_nodes, by_wide, by_triangles] =
            [0, 1, 2].map(|kind: usize| scene.town_ends[kind].wrapping_sub(self.town_ends[kind]));
        let node = |node: &Node| node.moved(by_nodes, by_triangles);
        scene.nodes.extend(self.nodes[nodes..].iter().map(node));
        scene.wide.extend(self.wide[wide..].iter().map(|node| node.moved(by_wide, by_triangles)));
        scene.triangles.extend_from_slice(&self.triangles[triangles..]);
        let level = |level: &Level| Level {
            root: level.root.moved(by_nodes, by_triangles),
            wide_root: level.wide_root.moved(by_wide, by_triangles),
            ..*level
        };
        scene.levels = self.levels.iter().map(level).collect();
        Some(scene)
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
        let Part { hierarchy, mut triangles, low, high } = part;
        let root = hierarchy.append_to(&mut self.nodes, first as u32);
        let level = Level { root, wide_root: Link::EMPTY, low, high };
        self.reach = self.reach.max(level.reach());
        if first == 0 {
            self.triangles = triangles;
        } else {
            self.triangles.append(&mut triangles);
        }
        level
    }
}

/// A parked vehicle as an actor; its id is that of the static object.
fn stand(town: &town::Town, parked: &town::Parked) -> ActorState {
    let [r, g, b] = town.objects[parked.object as usize].color;
    ActorState {
        actor_id: ActorId(mesh::ObjectId::from_index(parked.object).instance()),
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
        let corners = |at: u32| {
            mesh.triangles[at as usize].map(|i| Vec3::from_array(mesh.positions[i as usize]))
        };
        let (hierarchy, (low, high)) = Hierarchy::over_triangles(mesh.triangles.len(), &corners);
        let triangle = |at: &u32| {
            let [a, b, c] = corners(*at);
            let face = mesh.faces[*at as usize];
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
        Part { hierarchy, triangles, low, high }
    }
}
