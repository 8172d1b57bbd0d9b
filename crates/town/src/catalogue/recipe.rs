//! From which table a blueprint's mesh is built.

use mesh::Tag;

use crate::mesh_builder::MeshBuilder;

/// Builds a prop in a size of its own; the prop is scaled to its size afterwards.
pub(crate) type Shape = fn(&mut MeshBuilder);

/// How a blueprint's looks are made.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Recipe {
    /// By its place in the table of vehicles.
    Vehicle(usize),
    /// By its number.
    Walker(usize),
    Prop(Tag, [f32; 3], Shape),
    Signal,
}
