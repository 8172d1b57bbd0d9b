//! glTF 2.0 files in the place of procedural meshes.
//!
//! glTF is right-handed with y up and looks along z: its z, x, y are our x, y, z. A node that is
//! called as a joint of the blueprint's rig (`wheel_fl`, `door_rr`, `crl_thigh__L`), and what lies
//! below it, moves as that joint, about the node's own origin; everything else is the body.

use std::borrow::Cow;

use ::gltf::accessor::{DataType, Dimensions};
use ::gltf::json::{Root, validation::Checked};
use ::gltf::{Accessor, Document, Gltf, Node, Semantic, mesh::Mode};
use glam::{Mat4, Vec3, vec3};
use mesh::{Face, Material, Mesh, Tag};

use super::{
    blueprint::Blueprint,
    looks::Looks,
    rig::{Motion, Rig},
};

/// Why a file cannot take a mesh's place.
#[derive(Debug, thiserror::Error)]
pub enum MeshFault {
    /// It is no glTF.
    #[error("it is no binary glTF 2.0: {0}")]
    Syntax(#[from] ::gltf::Error),
    /// It refers to another file.
    #[error("its buffer {0} lies in another file; export it as one .glb")]
    Elsewhere(usize),
    /// A part of it is missing.
    #[error("{0} holds {1}, which ends beyond the file's {2} bytes")]
    Short(Cow<'static, str>, usize, usize),
    /// A number that names nothing.
    #[error("it names {0} that it does not hold")]
    Dangling(&'static str),
    /// Nodes within nodes within nodes.
    #[error("its nodes hold each other, or are more than {NODES_MAX}")]
    Endless,
    /// Nothing to see.
    #[error("it holds no triangle")]
    Empty,
    /// Too much to see.
    #[error("it holds {0} triangles, {TRIANGLES_MAX} is the most; decimate it")]
    Large(usize),
    /// A corner nowhere.
    #[error("node {0} has a corner that is not finite, or further than 1 km from its origin")]
    Far(String),
    /// Numbers of another type than glTF asks for.
    #[error("the {1} of node {0} are not {2}")]
    Type(String, &'static str, &'static str),
    /// Indices beyond the corners.
    #[error("node {0} names corner {1} of {2}")]
    Corner(String, u32, usize),
}

/// The most triangles that a file may bring.
const TRIANGLES_MAX: usize = 200_000;
/// The most nodes, counted as often as they are placed.
const NODES_MAX: u32 = 10_000;

/// What a blueprint looks like with the meshes of a file, and how it moves then.
pub fn replaced(blueprint: &Blueprint, glb: &[u8]) -> Result<(Looks, Rig), MeshFault> {
    // The crate's own checks take for granted what they check.
    let Gltf { document, blob } = Gltf::from_slice_without_validation(glb)?;
    if let Some(what) = dangling(document.as_json()) {
        return Err(MeshFault::Dangling(what));
    }
    let blob = blob.unwrap_or_default();
    for buffer in document.buffers() {
        if !matches!(buffer.source(), ::gltf::buffer::Source::Bin) {
            return Err(MeshFault::Elsewhere(buffer.index()));
        }
    }
    for view in document.views() {
        let end = view.offset().saturating_add(view.length());
        if end > blob.len() {
            return Err(MeshFault::Short("a view".into(), end, blob.len()));
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
        0 => Err(MeshFault::Empty),
        1..=TRIANGLES_MAX => Ok((Looks::of(&taker.rig, taker.mesh), taker.rig)),
        _ => Err(MeshFault::Large(count)),
    }
}

/// What a file refers to that it does not hold, or cannot hold.
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

/// That every accessor lies within its view: the reader takes it for granted.
fn check_accessors(document: &Document) -> Result<(), MeshFault> {
    for accessor in document.accessors() {
        let Some(view) = accessor.view() else { continue };
        let stride = view.stride().unwrap_or(accessor.size());
        let rows = accessor.count().saturating_sub(1).saturating_mul(stride);
        let end = accessor.offset().saturating_add(rows).saturating_add(accessor.size());
        if accessor.count() > 0 && end > view.length() {
            return Err(MeshFault::Short("an accessor".into(), end, view.length()));
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

    /// A node and what lies below it.
    fn take(&mut self, node: &Node, above: Mat4, joint: u32, depth: u32) -> Result<(), MeshFault> {
        self.nodes += 1;
        if depth > 64 || self.nodes > NODES_MAX {
            return Err(MeshFault::Endless);
        }
        let placed = above * Mat4::from_cols_array_2d(&node.transform().matrix());
        let name = node.name().unwrap_or_default();
        let found = self.rig.joints.iter().position(|joint| joint.name.eq_ignore_ascii_case(name));
        if let Some(found) = found {
            self.pivot(found, ours(placed.transform_point3(Vec3::ZERO)));
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

    /// A joint turns about its node's origin, unless that is the whole file's.
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
    ) -> Result<(), MeshFault> {
        let is = |accessor: &Accessor, types: &[DataType], shape: Dimensions| {
            types.contains(&accessor.data_type()) && accessor.dimensions() == shape
        };
        let corners = primitive.get(&Semantic::Positions);
        if !corners.is_some_and(|a| is(&a, &[DataType::F32], Dimensions::Vec3)) {
            return Err(MeshFault::Type(name.to_owned(), "corners", "three floats"));
        }
        let whole = [DataType::U8, DataType::U16, DataType::U32];
        if primitive.indices().is_some_and(|a| !is(&a, &whole, Dimensions::Scalar)) {
            return Err(MeshFault::Type(name.to_owned(), "indices", "whole numbers"));
        }
        let reader = primitive.reader(|_| Some(self.blob));
        let base = self.mesh.positions.len() as u32;
        let mut count = 0u32;
        for position in reader.read_positions().into_iter().flatten() {
            let point = ours(placed.transform_point3(Vec3::from_array(position)));
            if !point.is_finite() || point.abs().max_element() > 1000.0 {
                return Err(MeshFault::Far(name.to_owned()));
            }
            self.mesh.vertex(point.to_array());
            count += 1;
        }
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().collect(),
            None => (0..count).collect(),
        };
        if let Some(wrong) = indices.iter().find(|index| **index >= count) {
            return Err(MeshFault::Corner(name.to_owned(), *wrong, count as usize));
        }
        // A mirrored node turns its triangles inside out.
        let is_mirrored = placed.determinant() < 0.0;
        let face = face_of(&primitive.material(), self.blueprint.tag, joint);
        for corners in indices.chunks_exact(3) {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(|index| base + index);
            self.mesh.triangle(if is_mirrored { [a, c, b] } else { [a, b, c] }, face);
        }
        Ok(())
    }
}

fn ours(point: Vec3) -> Vec3 {
    vec3(point.z, point.x, point.y)
}

/// A material that is called as one of ours is that one; any other is metal, glass or plastic of
/// its base colour.
fn face_of(material: &::gltf::Material, tag: Tag, joint: u32) -> Face {
    let name = material.name().unwrap_or_default();
    let known = Material::ALL.iter().find(|m| format!("{m:?}").eq_ignore_ascii_case(name));
    if let Some(known) = known {
        return Face::new(tag, *known, joint);
    }
    let looks = material.pbr_metallic_roughness();
    let [red, green, blue, alpha] = looks.base_color_factor();
    if alpha < 0.7 {
        return Face::new(tag, Material::Glass, joint);
    }
    let coat = if looks.metallic_factor() > 0.5 && material.index().is_some() {
        Material::Metal
    } else {
        Material::Plastic
    };
    let encode = |c: f32| (c.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8;
    let tint = Face::tint([red, green, blue].map(encode));
    Face { tint, ..Face::new(tag, coat, joint) }
}
