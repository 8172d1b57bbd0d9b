use bytemuck::{Pod, Zeroable};

use crate::{material::Material, tag::Tag};

/// The attributes of one triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct Face {
    /// Code of its [`Tag`].
    pub tag: u8,
    /// Code of its [`Material`].
    pub material: u8,
    /// A colour that replaces the material's: sRGB in 5-6-5 bits with red highest
    /// ([`Face::tint`]). 0 keeps the colour of the material.
    pub tint: u16,
    /// Number of the object in its mesh: 0 is road and ground, objects count from 1.
    pub object: u32,
}

impl Face {
    /// Returns the code of an sRGB colour for the field `tint`. Black becomes the darkest grey,
    /// because 0 keeps the colour of the material.
    pub const fn tint([red, green, blue]: [u8; 3]) -> u16 {
        let code = (red as u16 >> 3) << 11 | (green as u16 >> 2) << 5 | blue as u16 >> 3;
        if code == 0 { 0x0821 } else { code }
    }

    /// Creates a face of object `object` in the material's own colour.
    pub fn new(tag: Tag, material: Material, object: u32) -> Face {
        Face { tag: tag as u8, material: material as u8, tint: 0, object }
    }
}

/// Triangles in one space, in metres; counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions of the vertices in metres.
    pub positions: Vec<[f32; 3]>,
    /// Indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Attributes of the triangles, one for each.
    pub faces: Vec<Face>,
}

impl Mesh {
    /// Appends one vertex and returns its index.
    pub fn vertex(&mut self, position: [f32; 3]) -> u32 {
        self.positions.push(position);
        (self.positions.len() - 1) as u32
    }

    /// Appends one triangle, given by the indices of its vertices.
    pub fn triangle(&mut self, corners: [u32; 3], face: Face) {
        self.triangles.push(corners);
        self.faces.push(face);
    }

    /// Appends the quadrilateral `[a, b, c, d]` (counter-clockwise) as the triangles abc and acd.
    pub fn quad(&mut self, corners: [[f32; 3]; 4], face: Face) {
        let [a, b, c, d] = corners.map(|corner| self.vertex(corner));
        self.triangle([a, b, c], face);
        self.triangle([a, c, d], face);
    }

    /// Appends all of `other`. Its faces keep their object numbers.
    pub fn append(&mut self, other: &Mesh) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
        self.faces.extend_from_slice(&other.faces);
    }

    /// Appends all of `other` as [`Mesh::append`] does, and takes its buffers over instead of
    /// copying them if this mesh is empty.
    pub fn add(&mut self, other: Mesh) {
        if self.positions.is_empty() && self.triangles.is_empty() {
            *self = other;
        } else {
            self.append(&other);
        }
    }
}
