//! The table entry from which the mesh of a blueprint is built.

use mesh::Tag;

use crate::mesh_builder::MeshBuilder;

/// A function that builds a prop in arbitrary units; the result is scaled to the prop's size.
pub(crate) type Shape = fn(&mut MeshBuilder);

/// The source of a blueprint's mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MeshSource {
    /// The index in the table of vehicles.
    Vehicle(usize),
    /// The index in the table of walkers.
    Walker(usize),
    Prop(Tag, [f32; 3], Shape),
    Signal,
}
