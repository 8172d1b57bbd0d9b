use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};
use mesh::{Material, Mesh};
use protocol::{ActorId, ActorState, Pose, kind};
use rayon::prelude::*;
use town::{Geometry, Plant, Posture, Rig};

use crate::{
    bvh::{Hierarchy, Link, Node, node_of},
    parallel_build::over_triangles,
    smooth::{CornerNormals, corner_normals, leaf_normals},
    triangle::Triangle,
    wall::{Wall, find_walls},
    wide::{WideNode, widen},
};

/// Replacement geometry of a blueprint: its index in the catalogue, its meshes, and its skeleton.
pub(crate) type Replaced = (u32, Geometry, Rig);

/// Geometry of a blueprint that consists of one rigid piece.
#[derive(Clone, Copy, Debug)]
pub struct BlueprintMesh<'a> {
    /// Mesh in actor space; an actor with an empty mesh is invisible.
    pub mesh: &'a Mesh,
}

/// Bottom-level hierarchies of one blueprint, and how its pieces move.
#[derive(Clone, Debug)]
pub(crate) struct BlueprintGeometry {
    /// Index of the first piece in [`Scene::blases`]; there is one piece for each joint.
    pub(crate) first_blas: u32,
    /// Skeleton; `None` if the blueprint is one rigid piece.
    pub(crate) rig: Option<Cow<'static, Rig>>,
    /// Index of the hierarchy of the whole blueprint at rest, for parked vehicles.
    pub(crate) whole: Option<u32>,
}

impl BlueprintGeometry {
    /// Returns the geometry of every blueprint of the catalogue, with consecutive pieces, and the
    /// blueprints of the parked vehicles, whose whole hierarchies follow all pieces.
    pub(crate) fn all(parked: &[ActorState]) -> (Vec<BlueprintGeometry>, Vec<u32>) {
        let mut first_blas = 0;
        let mut geometries: Vec<BlueprintGeometry> = town::catalogue()
            .iter()
            .map(|blueprint| {
                let rig = blueprint.rig();
                let rig_of = (!rig.is_still()).then_some(Cow::Borrowed(rig));
                let geometry = BlueprintGeometry { first_blas, rig: rig_of, whole: None };
                first_blas += rig.joints.len() as u32;
                geometry
            })
            .collect();
        let mut kinds: Vec<u32> = parked.iter().map(|one| one.blueprint).collect();
        kinds.sort_unstable();
        kinds.dedup();
        for (kind, blas) in kinds.iter().zip(first_blas..) {
            geometries[*kind as usize].whole = Some(blas);
        }
        (geometries, kinds)
    }
}

/// The meshes of the blueprints, each once, and of which of them each hierarchy is made.
struct SharedMeshes<'a> {
    meshes: Vec<&'a Mesh>,
    /// For each hierarchy the indices of its meshes.
    made_of: Vec<Vec<u32>>,
}

impl<'a> SharedMeshes<'a> {
    /// Returns a hierarchy for each mesh.
    fn each(meshes: Vec<&'a Mesh>) -> SharedMeshes<'a> {
        let made_of = (0..meshes.len() as u32).map(|mesh| vec![mesh]).collect();
        SharedMeshes { meshes, made_of }
    }

    /// Returns a hierarchy for each piece of each blueprint, then one for each of `kinds` as it is parked:
    /// at rest and empty.
    fn of(found: &[(&'a Geometry, &Rig)], kinds: &[u32]) -> SharedMeshes<'a> {
        let (mut meshes, mut made_of, mut at_rest) = (Vec::new(), Vec::new(), Vec::new());
        for (geometry, rig) in found {
            let first = meshes.len() as u32;
            meshes.extend(&geometry.pieces);
            let occupants = meshes.len() as u32;
            let has_occupants = !geometry.occupants.triangles.is_empty();
            meshes.extend(has_occupants.then_some(&geometry.occupants));
            made_of.extend((0..rig.joints.len()).map(|piece| {
                let body = has_occupants && rig.is_body(piece);
                let piece = first + piece as u32;
                if body { vec![piece, occupants] } else { vec![piece] }
            }));
            let mut shown = Vec::new();
            rig.place(&Posture::default(), |piece, _| shown.push(first + piece as u32));
            at_rest.push(shown);
        }
        made_of.extend(kinds.iter().map(|kind| at_rest[*kind as usize].clone()));
        SharedMeshes { meshes, made_of }
    }
}

/// Levels that may lie over the hierarchy of one mesh of a blueprint, to join several.
const JOIN_LEVELS: usize = 5;

/// Maximum number of triangles of a scene: a leaf names its first triangle with 26 bits.
const TRIANGLES_MAX: usize = Link::PRIMITIVES_MAX - 1;

/// Reason why a scene cannot be built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The meshes of the map and of the blueprints have too many triangles together.
    #[error(
        "too many triangles: the map and the blueprints have {count} triangles, the renderer \
         takes at most {max}; try a smaller map or simpler meshes"
    )]
    TooManyTriangles {
        /// Number of triangles of the map and of all blueprints.
        count: usize,
        /// Maximum number of triangles.
        max: usize,
    },
}

/// Checks the number of triangles before any of them is copied.
fn check_count(count: usize, max: usize) -> Result<(), SceneError> {
    if count > max { Err(SceneError::TooManyTriangles { count, max }) } else { Ok(()) }
}

/// Bottom-level acceleration structure (BLAS) of one mesh.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Blas {
    pub(crate) root: Link,
    /// Root in the hierarchy with eight children per node.
    pub(crate) wide_root: Link,
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
}

impl Blas {
    const EMPTY: Blas =
        Blas { root: Link::EMPTY, wide_root: Link::EMPTY, low: Vec3::ZERO, high: Vec3::ZERO };

    pub(crate) fn is_empty(&self) -> bool {
        self.root == Link::EMPTY
    }

    /// Returns the largest absolute coordinate.
    fn reach(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.low.abs().max(self.high.abs()).max_element() }
    }
}

/// Everything that stays the same for an episode: the town and the geometry of every blueprint.
///
/// Triangles are stored in the order of the leaves. There is one bottom-level hierarchy for the
/// town and one for each piece of each blueprint.
#[derive(Debug)]
pub struct Scene {
    /// Number that identifies this scene within the process.
    pub(crate) serial: u64,
    pub(crate) nodes: Vec<Node>,
    /// The same hierarchies with eight children per node.
    pub(crate) wide: Vec<WideNode>,
    /// Largest absolute coordinate of the town and of the blueprints, at least 1000 m, in the space of
    /// the smallest plant. Bounds rounding errors.
    pub(crate) reach: f32,
    pub(crate) triangles: Vec<Triangle>,
    /// Normals at the corners of the triangles of the models of plants and of the blueprints.
    pub(crate) smooth: Vec<CornerNormals>,
    /// First triangle of the models of plants; those of the town lie before.
    pub(crate) smooth_from: u32,
    /// Walls of façades; index 0 is [`Wall::NONE`].
    pub(crate) walls: Vec<Wall>,
    pub(crate) town_blas: Blas,
    /// Numbers of nodes, wide nodes and triangles of the town; those of the models of plants and of
    /// the blueprints follow.
    pub(crate) town_ends: [u32; 3],
    /// Hierarchies of every piece of every blueprint, then those of whole parked blueprints, which share
    /// the triangles of their pieces, then those of the models of plants.
    pub(crate) blases: Vec<Blas>,
    /// Geometry by index of the blueprint.
    pub(crate) geometries: Vec<BlueprintGeometry>,
    /// Parked vehicles, which never move.
    pub(crate) parked: Vec<ActorState>,
    /// Models of plants, in ascending order.
    pub(crate) plant_models: Vec<u32>,
    /// Trees and bushes.
    pub(crate) plants: Vec<Plant>,
}

impl Scene {
    /// Builds the scene of a static mesh and of blueprints that are one rigid piece each. Triangles
    /// with a corner that is not finite are left out.
    ///
    /// # Errors
    /// [`SceneError::TooManyTriangles`] if all meshes together hold 2²⁶ triangles or more.
    pub fn new(static_mesh: &Mesh, blueprints: &[BlueprintMesh]) -> Result<Scene, SceneError> {
        let meshes: Vec<&Mesh> = blueprints.iter().map(|blueprint| blueprint.mesh).collect();
        let geometry = |first_blas| BlueprintGeometry { first_blas, rig: None, whole: None };
        let geometries = (0..meshes.len() as u32).map(geometry).collect();
        Scene::from_meshes(static_mesh, &[], &SharedMeshes::each(meshes), geometries)
    }

    /// Builds the scene of a town and of every blueprint of the catalogue.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn of_town(town: &town::Town) -> Result<Scene, SceneError> {
        Scene::of_town_with(town, &[])
    }

    /// As [`Scene::of_town`], with replaced geometry for some blueprints.
    pub(crate) fn of_town_with(
        town: &town::Town,
        replaced: &[Replaced],
    ) -> Result<Scene, SceneError> {
        let parked = town.parked.iter().map(|one| parked_actor(town, one)).collect();
        Scene::with_catalogue(&town.mesh, &town.plants, parked, replaced)
    }

    /// Builds the scene of a static mesh, of plants, and of every blueprint of the catalogue, in the
    /// pieces that move.
    pub(crate) fn with_catalogue(
        static_mesh: &Mesh,
        plants: &[Plant],
        parked: Vec<ActorState>,
        replaced: &[Replaced],
    ) -> Result<Scene, SceneError> {
        let (mut geometries, kinds) = BlueprintGeometry::all(&parked);
        let mut found: Vec<(&Geometry, &Rig)> =
            town::catalogue().par_iter().map(|b| (b.geometry(), b.rig())).collect();
        for (index, geometry, rig) in replaced {
            found[*index as usize] = (geometry, rig);
            geometries[*index as usize].rig = Some(Cow::Owned(rig.clone()));
        }
        let shared = SharedMeshes::of(&found, &kinds);
        Ok(Scene { parked, ..Scene::from_meshes(static_mesh, plants, &shared, geometries)? })
    }

    fn from_meshes(
        static_mesh: &Mesh,
        plants: &[Plant],
        shared: &SharedMeshes,
        geometries: Vec<BlueprintGeometry>,
    ) -> Result<Scene, SceneError> {
        let mut plant_models: Vec<u32> = plants.iter().map(|plant| plant.model).collect();
        plant_models.sort_unstable();
        plant_models.dedup();
        plant_models.retain(|model| *model < town::plant_count());
        let models: Vec<&Mesh> =
            plant_models.par_iter().filter_map(|model| town::plant_mesh(*model)).collect();
        let counts = models.iter().chain(&shared.meshes).map(|mesh| mesh.triangles.len());
        check_count(static_mesh.triangles.len() + counts.sum::<usize>(), TRIANGLES_MAX)?;
        let mut scene = Scene {
            serial: new_serial(),
            nodes: Vec::new(),
            wide: Vec::new(),
            reach: 1000.0,
            triangles: Vec::new(),
            smooth: Vec::new(),
            smooth_from: 0,
            walls: vec![Wall::NONE],
            town_blas: Blas::EMPTY,
            town_ends: [0; 3],
            blases: Vec::new(),
            geometries,
            parked: Vec::new(),
            plant_models,
            plants: plants.to_vec(),
        };
        let (town_blas, (models, parts)) = rayon::join(
            || Part::new(static_mesh, 0),
            || {
                let models = models.par_iter().map(|mesh| Part::new(mesh, 0).smooth());
                let models: Vec<Part> = models.collect();
                let parts = shared.meshes.par_iter();
                let parts = parts.map(|mesh| Part::new(mesh, JOIN_LEVELS).smooth());
                (models, parts.collect::<Vec<_>>())
            },
        );
        scene.town_blas = scene.add(town_blas);
        let ends = [scene.nodes.len(), scene.triangles.len()].map(|end| end as u32);
        scene.smooth_from = scene.triangles.len() as u32;
        let models: Vec<Blas> = models.into_iter().map(|part| scene.add(part)).collect();
        // A parent lies before its children.
        let joins = shared.made_of.iter().map(|meshes| meshes.len() - 1).sum::<usize>();
        let mut join = scene.nodes.len();
        scene.nodes.resize(join + joins, Node::JOIN);
        let parts: Vec<Blas> = parts.into_iter().map(|part| scene.add(part)).collect();
        for meshes in &shared.made_of {
            let parts = meshes.iter().map(|mesh| parts[*mesh as usize]);
            let parts: Vec<Blas> = parts.filter(|part| !part.is_empty()).collect();
            // The body comes first and is the largest.
            let blas = match parts.split_at(parts.len().min(1)) {
                ([], _) => Blas::EMPTY,
                ([part], []) => *part,
                halves => scene.join(halves.into(), &mut join),
            };
            scene.blases.push(blas);
        }
        scene.blases.extend(models);
        scene.reach_into_plants();
        let town_wide = scene.widen_town(ends[1]);
        let Scene { nodes, wide, blases, .. } = &mut scene;
        for blas in blases {
            blas.wide_root = widen(nodes, blas.root, wide);
        }
        scene.town_ends = [ends[0], town_wide, ends[1]];
        Ok(scene)
    }

    /// Builds the town's wide hierarchy and finds its walls. Returns the number of its wide nodes.
    fn widen_town(&mut self, triangle_end: u32) -> u32 {
        let Scene { nodes, wide, triangles, walls, town_blas, .. } = self;
        let own = &mut triangles[..triangle_end as usize];
        rayon::join(
            || town_blas.wide_root = widen(nodes, town_blas.root, wide),
            || find_walls(own, walls),
        );
        wide.len() as u32
    }

    /// Builds the scene of another state of the same town, and reuses the blueprint geometry of
    /// this scene. Returns `None` if the town parks a blueprint whose whole hierarchy this scene
    /// lacks, or has a plant whose model it lacks.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub(crate) fn with_town(&self, town: &town::Town) -> Result<Option<Scene>, SceneError> {
        let is_known = |one: &town::Parked| self.geometries[one.blueprint as usize].whole.is_some();
        let has_model = |one: &Plant| self.plant_models.binary_search(&one.model).is_ok();
        if !town.parked.iter().all(is_known) || !town.plants.iter().all(has_model) {
            return Ok(None);
        }
        let blueprints = self.triangles.len() - self.town_ends[2] as usize;
        check_count(town.mesh.triangles.len() + blueprints, TRIANGLES_MAX)?;
        let mut scene = Scene {
            serial: new_serial(),
            nodes: Vec::new(),
            wide: Vec::new(),
            reach: self.blases.iter().fold(1000.0, |reach, blas| reach.max(blas.reach())),
            triangles: Vec::new(),
            smooth: self.smooth.clone(),
            smooth_from: 0,
            walls: vec![Wall::NONE],
            town_blas: Blas::EMPTY,
            town_ends: [0; 3],
            blases: Vec::new(),
            geometries: self.geometries.clone(),
            parked: town.parked.iter().map(|one| parked_actor(town, one)).collect(),
            plant_models: self.plant_models.clone(),
            plants: town.plants.clone(),
        };
        scene.town_blas = scene.add(Part::new(&town.mesh, 0));
        scene.reach_into_plants();
        let triangle_end = scene.triangles.len() as u32;
        let wide_end = scene.widen_town(triangle_end);
        scene.town_ends = [scene.nodes.len() as u32, wide_end, triangle_end];
        let [nodes, wide, triangles] = self.town_ends.map(|end| end as usize);
        let [by_nodes, by_wide, by_triangles] =
            [0, 1, 2].map(|kind: usize| scene.town_ends[kind].wrapping_sub(self.town_ends[kind]));
        scene.smooth_from = self.smooth_from.wrapping_add(by_triangles);
        let node = |node: &Node| node.moved(by_nodes, by_triangles);
        scene.nodes.extend(self.nodes[nodes..].iter().map(node));
        scene.wide.extend(self.wide[wide..].iter().map(|node| node.moved(by_wide, by_triangles)));
        scene.triangles.extend_from_slice(&self.triangles[triangles..]);
        let blas = |blas: &Blas| Blas {
            root: blas.root.moved(by_nodes, by_triangles),
            wide_root: blas.wide_root.moved(by_wide, by_triangles),
            ..*blas
        };
        scene.blases = self.blases.iter().map(blas).collect();
        Ok(Some(scene))
    }

    /// Makes the largest coordinate hold in the spaces of plants that are smaller than their models.
    fn reach_into_plants(&mut self) {
        let smallest = self.plants.iter().map(|plant| plant.scale).fold(1.0, f32::min);
        self.reach /= smallest.max(0.01);
    }

    /// Returns the index of the hierarchy of a plant's model.
    pub(crate) fn plant_blas(&self, plant: &Plant) -> Option<u32> {
        let model = self.plant_models.binary_search(&plant.model).ok()?;
        Some((self.blases.len() - self.plant_models.len() + model) as u32)
    }

    /// Returns the number of triangles in memory: those of the town, and those of each blueprint
    /// and of each model of a plant once.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Returns the hierarchy over those of two halves. Its nodes are the next ones from number `free`.
    fn join(&mut self, halves: [&[Blas]; 2], free: &mut usize) -> Blas {
        let own = *free;
        *free += 1;
        let [a, b] = halves.map(|parts| match parts {
            [part] => *part,
            _ => self.join(parts.split_at(parts.len() / 2).into(), free),
        });
        let boxes = node_of(a.low, a.high, b.low, b.high);
        self.nodes[own] = Node { child0: a.root, child1: b.root, ..boxes };
        Blas { root: Link(own as u32), low: a.low.min(b.low), high: a.high.max(b.high), ..a }
    }

    /// Appends the hierarchy of a mesh; its wide hierarchy is built later.
    fn add(&mut self, part: Part) -> Blas {
        let first = self.triangles.len();
        let Part { hierarchy, mut triangles, mut smooth, low, high } = part;
        self.smooth.append(&mut smooth);
        let root = hierarchy.append_to(&mut self.nodes, first as u32);
        let blas = Blas { root, wide_root: Link::EMPTY, low, high };
        self.reach = self.reach.max(blas.reach());
        if first == 0 {
            self.triangles = triangles;
        } else {
            self.triangles.append(&mut triangles);
        }
        blas
    }
}

/// Returns a parked vehicle as an actor; its id is that of the static object.
fn parked_actor(town: &town::Town, parked: &town::Parked) -> ActorState {
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

/// Hierarchy and triangles of one mesh.
struct Part {
    hierarchy: Hierarchy,
    /// Triangles in the order of the leaves.
    triangles: Vec<Triangle>,
    /// Normals at their corners; empty where faces are flat.
    smooth: Vec<CornerNormals>,
    low: Vec3,
    high: Vec3,
}

impl Part {
    /// Builds the hierarchy of a mesh, so that `above` levels may lie over it.
    fn new(mesh: &Mesh, above: usize) -> Part {
        let corners = |at: u32| {
            mesh.triangles[at as usize].map(|i| Vec3::from_array(mesh.positions[i as usize]))
        };
        let (hierarchy, (low, high)) = over_triangles(mesh.triangles.len(), &corners, above);
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
        Part { hierarchy, triangles, smooth: Vec::new(), low, high }
    }

    /// Returns the part with normals at the corners, or of leaves.
    fn smooth(self) -> Part {
        let is_leaf = |triangle: &&Triangle| {
            let material = triangle.material();
            material == Material::Leaves as u8 || material == Material::Needles as u8
        };
        let (leaves, others): (Vec<&Triangle>, Vec<&Triangle>) =
            self.triangles.iter().partition(is_leaf);
        let corners = |of: Vec<&Triangle>| -> Vec<[Vec3; 3]> {
            of.into_iter().map(Triangle::corners).collect()
        };
        let mut of_leaves = leaf_normals(&corners(leaves)).into_iter();
        let mut of_others = corner_normals(&corners(others)).into_iter();
        let smooth = self.triangles.iter().filter_map(|triangle| match is_leaf(&triangle) {
            true => of_leaves.next(),
            false => of_others.next(),
        });
        Part { smooth: smooth.collect(), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{DEPTH_MAX, count};
    use crate::smooth::LEAF;

    #[test]
    fn trunks_are_smooth_and_leaves_have_one_normal() {
        let (_, mesh) = (0..town::plant_count())
            .filter_map(|model| Some((model, town::plant_mesh(model)?)))
            .find(|(_, mesh)| mesh.faces.iter().any(|face| face.material == Material::Leaves as u8))
            .unwrap();
        let part = Part::new(mesh, 0).smooth();
        assert_eq!(part.smooth.len(), part.triangles.len());
        let mut curved = 0;
        for (triangle, words) in part.triangles.iter().zip(&part.smooth) {
            assert_eq!(words[3] == LEAF, triangle.material() != Material::Bark as u8);
            curved += usize::from(words[3] != LEAF && words[0] != words[1]);
        }
        assert!(curved > 50, "{curved}");
    }

    #[test]
    fn parked_vehicles_share_the_triangles_of_those_that_drive() {
        let vehicles = (0..).zip(town::catalogue()).filter(|(_, b)| b.kind == town::Kind::Vehicle);
        let parked: Vec<ActorState> = vehicles
            .map(|(blueprint, _)| ActorState { blueprint, ..ActorState::default() })
            .collect();
        let scene = |parked| Scene::with_catalogue(&Mesh::default(), &[], parked, &[]).unwrap();
        let (empty, scene) = (scene(Vec::new()), scene(parked.clone()));
        assert_eq!(empty.triangle_count(), scene.triangle_count());
        let triangles_of = |blas: u32| {
            let mut seen = Vec::new();
            let root = scene.blases[blas as usize].root;
            let depth = count(&scene.nodes, root, 0, &mut seen);
            assert!(depth <= DEPTH_MAX, "depth {depth}");
            seen
        };
        for actor in parked {
            let made = &town::catalogue()[actor.blueprint as usize];
            let geometry = &scene.geometries[actor.blueprint as usize];
            let mut driven = Vec::new();
            made.rig().place(&Posture::default(), |piece, _| {
                driven.append(&mut triangles_of(geometry.first_blas + piece as u32));
            });
            let mut parked = triangles_of(geometry.whole.unwrap());
            driven.sort_unstable();
            parked.sort_unstable();
            assert!(parked.windows(2).all(|two| two[0] < two[1]), "{}: one twice", made.id);
            assert_eq!(parked.len(), made.mesh().triangles.len(), "{}", made.id);
            assert_eq!(
                driven.len(),
                parked.len() + made.geometry().occupants.triangles.len(),
                "{}",
                made.id
            );
            driven.retain(|triangle| parked.binary_search(triangle).is_ok());
            assert_eq!(driven, parked, "{}", made.id);
        }
    }

    #[test]
    fn too_many_triangles_are_an_error_and_not_a_panic() {
        assert_eq!(check_count(TRIANGLES_MAX, TRIANGLES_MAX), Ok(()));
        let error = check_count(TRIANGLES_MAX + 1, TRIANGLES_MAX).unwrap_err();
        assert_eq!(
            error.to_string(),
            "too many triangles: the map and the blueprints have 67108864 triangles, the renderer \
             takes at most 67108863; try a smaller map or simpler meshes"
        );
    }
}
