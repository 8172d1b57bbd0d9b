//! Control cages of bodies, clothes, hair and luggage: text files in `cages/`.
//!
//! A cage is a Wavefront OBJ file over the body that [`Body`] describes: x is forward, y left and z
//! up, as fractions of the height; with `# space head` in half heads from the middle of the head.
//! `g` names the piece of the body that a part moves with, `usemtl` a slot that the outfit gives a
//! colour. A file holds the left half, of which the right one is the mirror image, unless its
//! comment says `single`. `levels` is the number of subdivisions. Creases are those of OpenSubdiv.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::{
    catalogue::{
        obj::{self, CageError, Element},
        walker::body::{Body, Piece},
    },
    mesh_builder::MeshBuilder,
    subdivision::{Cage, edge},
};

/// A face of a cage: its piece, whether it is on the right, and the number of its slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch {
    pub(super) piece: Piece,
    pub(super) is_right: bool,
    slot: u32,
}

impl Patch {
    /// A patch on the left or in the middle.
    pub(super) fn of(piece: Piece) -> Patch {
        Patch { piece, is_right: false, slot: 0 }
    }
}

/// The control cage of a garment.
#[derive(Debug)]
pub(super) struct Garment<'a> {
    points: Vec<Vec3>,
    faces: Vec<(Vec<u32>, Patch)>,
    creases: Vec<(u32, u32, f32)>,
    slots: Vec<&'a str>,
    levels: u32,
    is_single: bool,
}

/// The number of subdivisions that a file may ask for.
const LEVELS_MAX: u32 = 3;

impl<'a> Garment<'a> {
    /// Reads a file.
    pub(super) fn parse(text: &'a str) -> Result<Garment<'a>, CageError> {
        let mut garment = Garment {
            points: Vec::new(),
            faces: Vec::new(),
            creases: Vec::new(),
            slots: Vec::new(),
            levels: 1,
            is_single: false,
        };
        let (mut piece, mut slot) = (None, None);
        obj::read(text, |element| {
            match element {
                Element::Vertex(point) => garment.points.push(point),
                Element::Group(name) => piece = Some(Piece::named(name).ok_or("unknown piece")?),
                Element::Material(name) => {
                    let known = garment.slots.iter().position(|slot| *slot == name);
                    slot = Some(known.unwrap_or_else(|| {
                        garment.slots.push(name);
                        garment.slots.len() - 1
                    }) as u32);
                }
                Element::Face(corners) => {
                    let (Some(piece), Some(slot)) = (piece, slot) else {
                        return Err("a face needs a piece and a slot");
                    };
                    garment.faces.push((corners, Patch { piece, is_right: false, slot }));
                }
                Element::Crease(a, b, sharp) => garment.creases.push((a, b, sharp)),
                Element::Comment(words) if words.first() == Some(&"space") => {
                    let at = words.iter().position(|word| word.starts_with("levels"));
                    let levels =
                        at.and_then(|at| words.get(at + 1)?.trim_matches(',').parse().ok());
                    garment.levels = levels.filter(|n| *n <= LEVELS_MAX).ok_or("unknown levels")?;
                    garment.is_single = words.contains(&"single");
                }
                Element::Comment(_) | Element::Nothing => {}
                Element::Line(_) => return Err("lines have no meaning here"),
            }
            Ok(())
        })?;
        let end = |what| CageError { line: text.lines().count(), what };
        if garment.faces.is_empty() {
            return Err(end("no faces"));
        }
        Ok(garment)
    }

    /// The name of a patch's slot.
    pub(super) fn slot(&self, patch: Patch) -> &'a str {
        self.slots[patch.slot as usize]
    }

    /// Returns the surface over a body, in metres of actor space, with as many polygons as the
    /// cage after its subdivisions.
    pub(super) fn fitted(&self, body: &Body) -> Cage<Patch> {
        let mut pieces = vec![Piece::Chest; self.points.len()];
        for (corners, patch) in &self.faces {
            corners.iter().for_each(|corner| pieces[*corner as usize] = patch.piece);
        }
        let place = |(point, piece): (&Vec3, &Piece)| body.placed(*piece, *point);
        let mut points: Vec<Vec3> = self.points.iter().zip(&pieces).map(place).collect();
        let mut faces = self.faces.clone();
        let mut creases = BTreeMap::new();
        for (a, b, sharp) in &self.creases {
            creases.insert(edge(*a, *b), *sharp);
        }
        if !self.is_single {
            let mut twin = Vec::with_capacity(points.len());
            for (index, point) in self.points.iter().enumerate() {
                if point.y == 0.0 {
                    twin.push(index as u32);
                } else {
                    twin.push(points.len() as u32);
                    points.push(points[index] * Vec3::new(1.0, -1.0, 1.0));
                }
            }
            faces.extend(self.faces.iter().map(|(corners, patch)| {
                let corners = corners.iter().rev().map(|corner| twin[*corner as usize]).collect();
                (corners, Patch { is_right: true, ..*patch })
            }));
            for (a, b, sharp) in &self.creases {
                creases.insert(edge(twin[*a as usize], twin[*b as usize]), *sharp);
            }
        }
        let cage = Cage { points, faces, creases };
        (0..self.levels).fold(cage, |cage, _| cage.subdivided())
    }
}

/// Adds the faces of a fitted garment for which `paint(patch, middle)` sets a material and an
/// object and returns true.
pub(super) fn add(
    builder: &mut MeshBuilder,
    cage: &Cage<Patch>,
    mut paint: impl FnMut(&mut MeshBuilder, Patch, Vec3) -> bool,
) {
    let mut numbers = vec![None; cage.points.len()];
    for (corners, patch) in &cage.faces {
        let sum: Vec3 = corners.iter().map(|corner| cage.points[*corner as usize]).sum();
        if !paint(builder, *patch, sum / corners.len() as f32) {
            continue;
        }
        let corners: Vec<u32> = corners
            .iter()
            .map(|corner| {
                let at = *corner as usize;
                *numbers[at].get_or_insert_with(|| builder.vertex(cage.points[at]))
            })
            .collect();
        for at in 1..corners.len() - 1 {
            builder.triangle([corners[0], corners[at], corners[at + 1]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_cages_are_refused_with_their_line() {
        let good =
            "# space body, levels 1\nv 0 0 0\nv 1 0 0\nv 1 1 0\ng arm\nusemtl top\nf 1 2 3\n";
        assert_eq!(Garment::parse(good).unwrap().faces.len(), 1);
        for (tail, what) in [
            ("g wing", "unknown piece"),
            ("f 1 2 4", "expected at least three vertices that exist"),
            ("v 1 2", "expected three coordinates"),
            ("l 1 2", "lines have no meaning here"),
            ("# space body, levels 9", "unknown levels"),
            ("# space body", "unknown levels"),
            ("t crease 2/1/0 0 3 1", "expected two vertices and a sharpness"),
        ] {
            let error = Garment::parse(&format!("{good}{tail}\n")).unwrap_err();
            let text = format!("{good}{tail}\n");
            assert_eq!((error.line, error.what), (8, what), "{tail} of {text}");
        }
        let early = Garment::parse("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").unwrap_err();
        assert_eq!((early.line, early.what), (4, "a face needs a piece and a slot"));
        assert_eq!(Garment::parse("g arm\n").unwrap_err().what, "no faces");
    }
}
