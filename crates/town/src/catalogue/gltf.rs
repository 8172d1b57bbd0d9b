//! glTF 2.0 files that replace procedural meshes.
//!
//! glTF is right-handed with y up and z forward: its z, x, y are x, y, z here. A node that has the
//! name of a joint of the blueprint's rig (`wheel_fl`, `door_rr`, `crl_thigh__L`) moves as that
//! joint about the node's origin, together with the nodes below it. All other nodes are the body.

use std::borrow::Cow;

use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::json::{Root, validation::Checked};
use ::gltf::{Accessor, Document, Gltf, Node, Semantic, mesh::Mode};
use glam::{Mat4, Vec3, vec3};
use mesh::{Face, Material, Mesh, Tag};

use super::{
    blueprint::Blueprint,
    geometry::Geometry,
    rig::{Motion, Rig},
};

/// Why a glTF file cannot replace a mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The bytes are not glTF.
    #[error("not a binary glTF 2.0 file: {0}")]
    Syntax(#[from] ::gltf::Error),
    /// A buffer is in another file.
    #[error("buffer {0} is in another file; export the model as one .glb")]
    Elsewhere(usize),
    /// The file ends before one of its parts.
    #[error("{0} contains {1}, which ends beyond the file's {2} bytes")]
    Short(Cow<'static, str>, usize, usize),
    /// The elements of an accessor overlap.
    #[error("a view has a stride of {0} bytes, but its elements have {1}")]
    Stride(usize, usize),
    /// An index has no target.
    #[error("dangling reference to {0}")]
    Dangling(&'static str),
    /// The nodes form a cycle, or there are too many.
    #[error("the nodes form a cycle, or are more than {NODES_MAX}")]
    Endless,
    /// The file has no triangles.
    #[error("no triangles")]
    Empty,
    /// The file has too many triangles.
    #[error("too many triangles: {0}, the maximum is {TRIANGLES_MAX}; decimate the model")]
    Large(usize),
    /// A vertex or the origin of a joint is not finite or too far away.
    #[error(
        "node {0} has a vertex or an origin that is not finite, or further than 1 km from the origin"
    )]
    Far(String),
    /// An accessor has another component type than glTF demands.
    #[error("unsupported type of the {1} of node {0}: expected {2}")]
    Type(String, &'static str, &'static str),
    /// An index exceeds the number of vertices.
    #[error("vertex index out of range in node {0}: {1} of {2} vertices")]
    Corner(String, u32, usize),
}

/// The most triangles that a file may have.
const TRIANGLES_MAX: usize = 200_000;
/// The most nodes, counted once for each time they are placed.
const NODES_MAX: u32 = 10_000;

/// Returns the geometry of a blueprint with the meshes of a file, and the rig that moves it.
pub fn replaced(blueprint: &Blueprint, glb: &[u8]) -> Result<(Geometry, Rig), MeshError> {
    // Validation in the glTF crate itself assumes what is checked here first.
    let Gltf { document, blob } = Gltf::from_slice_without_validation(glb)?;
    if let Some(what) = dangling(document.as_json()) {
        return Err(MeshError::Dangling(what));
    }
    let blob = blob.unwrap_or_default();
    for buffer in document.buffers() {
        if !matches!(buffer.source(), ::gltf::buffer::Source::Bin) {
            return Err(MeshError::Elsewhere(buffer.index()));
        }
    }
    for view in document.views() {
        let end = view.offset().saturating_add(view.length());
        if end > blob.len() {
            return Err(MeshError::Short("a view".into(), end, blob.len()));
        }
    }
    check_accessors(&document)?;
    let mut taker = Taker {
        blueprint,
        blob: &blob,
        mesh: Mesh::default(),
        rig: blueprint.rig().clone(),
        nodes: 0,
    };
    let body = taker.joint_of_body();
    let scene = document.default_scene().or_else(|| document.scenes().next());
    for node in scene.iter().flat_map(|scene| scene.nodes()) {
        taker.take(&node, Mat4::IDENTITY, body, 0)?;
    }
    let count = taker.mesh.triangles.len();
    match count {
        0 => Err(MeshError::Empty),
        1..=TRIANGLES_MAX => Ok((Geometry::of(&taker.rig, taker.mesh), taker.rig)),
        _ => Err(MeshError::Large(count)),
    }
}

/// Checks that everything the file refers to is in the file.
fn dangling(root: &Root) -> Option<&'static str> {
    let [nodes, meshes, accessors] = [root.nodes.len(), root.meshes.len(), root.accessors.len()];
    let (views, buffers, materials) =
        (root.buffer_views.len(), root.buffers.len(), root.materials.len());
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let found = [
        ("a scene", root.scene.is_none_or(|scene| scene.value() < root.scenes.len())),
        ("a scene's node", root.scenes.iter().flat_map(|s| &s.nodes).all(|n| n.value() < nodes)),
        (
            "a node's child",
            root.nodes.iter().flat_map(|n| n.children.iter().flatten()).all(|c| c.value() < nodes),
        ),
        ("a node's mesh", root.nodes.iter().all(|n| n.mesh.is_none_or(|m| m.value() < meshes))),
        (
            "a mesh's corners",
            primitives().all(|p| {
                p.attributes
                    .iter()
                    .all(|(name, at)| matches!(name, Checked::Valid(_)) && at.value() < accessors)
            }),
        ),
        (
            "a mesh's indices",
            primitives().all(|p| p.indices.is_none_or(|at| at.value() < accessors)),
        ),
        (
            "a mesh's material",
            primitives().all(|p| p.material.is_none_or(|m| m.value() < materials)),
        ),
        ("a kind of primitives", primitives().all(|p| matches!(p.mode, Checked::Valid(_)))),
        (
            "an accessor's type",
            root.accessors.iter().all(|a| {
                matches!((&a.component_type, &a.type_), (Checked::Valid(_), Checked::Valid(_)))
            }),
        ),
        (
            "an accessor's view",
            root.accessors.iter().all(|a| a.buffer_view.is_some_and(|v| v.value() < views)),
        ),
        ("a dense accessor", root.accessors.iter().all(|a| a.sparse.is_none())),
        ("a view's buffer", root.buffer_views.iter().all(|v| v.buffer.value() < buffers)),
    ];
    found.into_iter().find(|(_, is_there)| !is_there).map(|(what, _)| what)
}

/// Checks that every accessor lies within its buffer view, which the reader assumes.
fn check_accessors(document: &Document) -> Result<(), MeshError> {
    for accessor in document.accessors() {
        let Some(view) = accessor.view() else { continue };
        let stride = view.stride().unwrap_or(accessor.size());
        if stride < accessor.size() {
            return Err(MeshError::Stride(stride, accessor.size()));
        }
        let rows = accessor.count().saturating_sub(1).saturating_mul(stride);
        let end = accessor.offset().saturating_add(rows).saturating_add(accessor.size());
        if accessor.count() > 0 && end > view.length() {
            return Err(MeshError::Short("an accessor".into(), end, view.length()));
        }
    }
    Ok(())
}

struct Taker<'a> {
    blueprint: &'a Blueprint,
    blob: &'a [u8],
    mesh: Mesh,
    rig: Rig,
    nodes: u32,
}

impl Taker<'_> {
    fn joint_of_body(&self) -> u32 {
        let shell = self.rig.joints.iter().position(|joint| joint.motion == Motion::Ajar);
        shell.unwrap_or(0) as u32
    }

    /// Reads a node and the nodes below it.
    fn take(&mut self, node: &Node, above: Mat4, joint: u32, depth: u32) -> Result<(), MeshError> {
        self.nodes += 1;
        if depth > 64 || self.nodes > NODES_MAX {
            return Err(MeshError::Endless);
        }
        let placed = above * Mat4::from_cols_array_2d(&node.transform().matrix());
        let name = node.name().unwrap_or_default();
        let found = self.rig.joints.iter().position(|joint| joint.name.eq_ignore_ascii_case(name));
        if let Some(found) = found {
            let origin = ours(placed.transform_point3(Vec3::ZERO));
            check_near(name, origin)?;
            self.pivot(found, origin);
        }
        let joint = found.map_or(joint, |found| found as u32);
        for primitive in node.mesh().iter().flat_map(|mesh| mesh.primitives()) {
            if primitive.mode() == Mode::Triangles && primitive.get(&Semantic::Positions).is_some()
            {
                self.take_primitive(&primitive, placed, joint, name)?;
            }
        }
        node.children().try_for_each(|child| self.take(&child, placed, joint, depth + 1))
    }

    /// A joint turns about the origin of its node, unless that is the origin of the whole file.
    fn pivot(&mut self, joint: usize, origin: Vec3) {
        if origin == Vec3::ZERO {
            return;
        }
        match &mut self.rig.joints[joint].motion {
            Motion::Wheel { hub_m, .. } => *hub_m = origin,
            Motion::Door { hinge_m, .. } => *hinge_m = origin,
            Motion::Steer { pivot_m, .. } => *pivot_m = origin,
            _ => {}
        }
    }

    fn take_primitive(
        &mut self,
        primitive: &::gltf::Primitive,
        placed: Mat4,
        joint: u32,
        name: &str,
    ) -> Result<(), MeshError> {
        let is = |accessor: &Accessor, types: &[DataType], shape: Dimensions| {
            types.contains(&accessor.data_type()) && accessor.dimensions() == shape
        };
        let corners = primitive.get(&Semantic::Positions);
        if !corners.as_ref().is_some_and(|a| is(a, &[DataType::F32], Dimensions::Vec3)) {
            return Err(MeshError::Type(name.to_owned(), "corners", "three floats"));
        }
        let whole = [DataType::U8, DataType::U16, DataType::U32];
        if primitive.indices().is_some_and(|a| !is(&a, &whole, Dimensions::Scalar)) {
            return Err(MeshError::Type(name.to_owned(), "indices", "whole numbers"));
        }
        let count = corners.map_or(0, |corners| corners.count());
        if self.mesh.positions.len().saturating_add(count) > 3 * TRIANGLES_MAX {
            return Err(MeshError::Large(count / 3));
        }
        let reader = primitive.reader(|_| Some(self.blob));
        let base = self.mesh.positions.len() as u32;
        let mut count = 0u32;
        for position in reader.read_positions().into_iter().flatten() {
            let point = ours(placed.transform_point3(Vec3::from_array(position)));
            check_near(name, point)?;
            self.mesh.vertex(point.to_array());
            count += 1;
        }
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..count).collect(),
        };
        if let Some(wrong) = indices.iter().find(|index| **index >= count) {
            return Err(MeshError::Corner(name.to_owned(), *wrong, count as usize));
        }
        // A file may place one mesh many times.
        let triangles = self.mesh.triangles.len() + indices.len() / 3;
        if triangles > TRIANGLES_MAX {
            return Err(MeshError::Large(triangles));
        }
        // A mirroring transform reverses the winding of triangles.
        let is_mirrored = placed.determinant() < 0.0;
        let face = face_of(&primitive.material(), self.blueprint.tag, joint);
        for corners in indices.chunks_exact(3) {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(|index| base + index);
            self.mesh.triangle(if is_mirrored { [a, c, b] } else { [a, b, c] }, face);
        }
        Ok(())
    }
}

fn check_near(name: &str, point: Vec3) -> Result<(), MeshError> {
    if point.is_finite() && point.abs().max_element() <= 1000.0 {
        return Ok(());
    }
    Err(MeshError::Far(name.to_owned()))
}

fn ours(point: Vec3) -> Vec3 {
    vec3(point.z, point.x, point.y)
}

/// A material named like a [`Material`] is that material; any other becomes metal, glass or plastic
/// of its base colour.
fn face_of(material: &::gltf::Material, tag: Tag, joint: u32) -> Face {
    let name = material.name().unwrap_or_default();
    let known = Material::ALL.iter().find(|m| format!("{m:?}").eq_ignore_ascii_case(name));
    if let Some(known) = known {
        return Face::new(tag, *known, joint);
    }
    let pbr = material.pbr_metallic_roughness();
    let [red, green, blue, alpha] = pbr.base_color_factor();
    if alpha < 0.7 {
        return Face::new(tag, Material::Glass, joint);
    }
    let coat = if pbr.metallic_factor() > 0.5 && material.index().is_some() {
        Material::Metal
    } else {
        Material::Plastic
    };
    let encode = |c: f32| (c.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8;
    let tint = Face::tint([red, green, blue].map(encode));
    Face { tint, ..Face::new(tag, coat, joint) }
}
