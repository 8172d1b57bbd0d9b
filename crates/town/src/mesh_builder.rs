use std::f32::consts::TAU;

use glam::{Quat, Vec3, vec3};
use mesh::{Face, Material, Mesh, Tag};

use crate::subdivision::Cage;

/// The band that [`MeshBuilder::loft`] passes for the cap on its first ring.
pub(crate) const FIRST_CAP: usize = usize::MAX;
/// The band that [`MeshBuilder::loft`] passes for the cap on its last ring.
pub(crate) const LAST_CAP: usize = usize::MAX - 1;

/// A mesh under construction from solids. New triangles get the current face.
///
/// Every solid is closed, and its triangles are counter-clockwise seen from outside.
#[derive(Debug)]
pub(crate) struct MeshBuilder {
    pub(crate) mesh: Mesh,
    face: Face,
}

impl MeshBuilder {
    /// Starts an empty mesh.
    pub(crate) fn new(tag: Tag, material: Material, object: u32) -> MeshBuilder {
        MeshBuilder { mesh: Mesh::default(), face: Face::new(tag, material, object) }
    }

    /// Sets the tag and the material of further triangles.
    pub(crate) fn paint(&mut self, tag: Tag, material: Material) -> &mut MeshBuilder {
        self.face = Face::new(tag, material, self.face.object);
        self
    }

    /// Sets the material of further triangles, in the material's own colour.
    pub(crate) fn material(&mut self, material: Material) -> &mut MeshBuilder {
        (self.face.material, self.face.tint) = (material as u8, 0);
        self
    }

    /// Sets the material of further triangles, in an sRGB colour.
    pub(crate) fn tinted(&mut self, material: Material, rgb: [u8; 3]) -> &mut MeshBuilder {
        (self.face.material, self.face.tint) = (material as u8, Face::tint(rgb));
        self
    }

    /// Sets the object of further triangles.
    pub(crate) fn object(&mut self, object: u32) -> &mut MeshBuilder {
        self.face.object = object;
        self
    }

    pub(crate) fn vertex(&mut self, point: Vec3) -> u32 {
        self.mesh.vertex(point.to_array())
    }

    /// Adds a triangle between existing vertices, unless two of them coincide.
    pub(crate) fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|corner| self.mesh.positions[corner as usize]);
        if a != b && b != c && c != a {
            self.mesh.triangle(corners, self.face);
        }
    }

    /// Adds the polygons of a cage; `paint(usual, attribute)` returns the face of a polygon.
    pub(crate) fn cage<T: Copy>(&mut self, cage: &Cage<T>, paint: impl Fn(Face, T) -> Face) {
        let base = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(cage.points.iter().map(|point| point.to_array()));
        let usual = self.face;
        for (corners, attribute) in &cage.faces {
            self.face = paint(usual, *attribute);
            for at in 1..corners.len() - 1 {
                self.triangle([base + corners[0], base + corners[at], base + corners[at + 1]]);
            }
        }
        self.face = usual;
    }

    /// Adds a flat quadrilateral, given counter-clockwise.
    pub(crate) fn quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners.map(|corner| self.vertex(corner));
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// Adds an axis-aligned box.
    pub(crate) fn block(&mut self, low: Vec3, high: Vec3) {
        self.block_at((low + high) * 0.5, (high - low) * 0.5, Quat::IDENTITY);
    }

    /// Adds a box about `center`, rotated by `turn`.
    pub(crate) fn block_at(&mut self, center: Vec3, half: Vec3, turn: Quat) {
        let base = self.mesh.positions.len() as u32;
        for corner in 0..8u32 {
            let sign = |bit: u32| if corner & bit != 0 { 1.0 } else { -1.0 };
            self.vertex(center + turn * (half * vec3(sign(1), sign(2), sign(4))));
        }
        const SIDES: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        for [a, b, c, d] in SIDES {
            self.triangle([base + a, base + b, base + c]);
            self.triangle([base + a, base + c, base + d]);
        }
    }

    /// Adds the closed solid that `build` makes; reverses its triangles if they face inwards.
    pub(crate) fn solid(&mut self, build: impl FnOnce(&mut MeshBuilder)) {
        let first = self.mesh.triangles.len();
        build(self);
        let corners = |t: &[u32; 3]| t.map(|i| Vec3::from_array(self.mesh.positions[i as usize]));
        let Some(start) = self.mesh.triangles.get(first).map(|t| corners(t)[0]) else { return };
        let volume = |t: &[u32; 3]| {
            let [a, b, c] = corners(t).map(|corner| corner - start);
            a.dot(b.cross(c))
        };
        let volume: f32 = self.mesh.triangles[first..].iter().map(volume).sum();
        if volume < 0.0 {
            self.mesh.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
        }
    }

    /// Adds a solid of revolution about a vertical axis: (radius, height) from bottom to top.
    pub(crate) fn lathe(&mut self, foot: Vec3, profile: &[(f32, f32)], sides: u32) {
        let ring = |(radius, height): &(f32, f32)| -> Vec<Vec3> {
            (0..sides)
                .map(|side| {
                    let angle = TAU * side as f32 / sides as f32;
                    foot + vec3(angle.cos() * radius, angle.sin() * radius, *height)
                })
                .collect()
        };
        self.loft(&profile.iter().map(ring).collect::<Vec<_>>(), |_, _| None);
    }

    /// Adds a pipe along a polyline.
    pub(crate) fn pipe(&mut self, points: &[Vec3], radius: f32, sides: u32) {
        for pair in points.windows(2) {
            self.rod(pair[0], pair[1], radius, sides);
        }
    }

    /// Adds a finished mesh, scaled by `scale`, as part of the current object.
    pub(crate) fn append(&mut self, mesh: &Mesh, scale: f32) {
        let base = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(mesh.positions.iter().map(|p| p.map(|x| x * scale)));
        self.mesh.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + base)));
        let object = self.face.object;
        self.mesh.faces.extend(mesh.faces.iter().map(|face| Face { object, ..*face }));
    }

    /// Adds a cylinder or, with unequal radii, a truncated cone; a radius of 0 makes a tip.
    pub(crate) fn cone(&mut self, from: Vec3, to: Vec3, radii: [f32; 2], sides: u32) {
        let turn = Quat::from_rotation_arc(Vec3::Z, (to - from).normalize_or(Vec3::Z));
        let ring = |center: Vec3, radius: f32| -> Vec<Vec3> {
            (0..sides)
                .map(|side| {
                    let angle = TAU * side as f32 / sides as f32;
                    center + turn * (radius * vec3(angle.cos(), angle.sin(), 0.0))
                })
                .collect()
        };
        self.loft(&[ring(from, radii[0]), ring(to, radii[1])], |_, _| None);
    }

    /// Adds a cylinder.
    pub(crate) fn rod(&mut self, from: Vec3, to: Vec3, radius: f32, sides: u32) {
        self.cone(from, to, [radius; 2], sides);
    }

    /// Adds an ellipsoid with these `radii`, of `rings` × `sides` facets.
    pub(crate) fn ball(&mut self, center: Vec3, radii: Vec3, rings: u32, sides: u32) {
        let stack: Vec<Vec<Vec3>> = (0..=rings)
            .map(|ring| {
                let polar = TAU * 0.5 * ring as f32 / rings as f32;
                (0..sides)
                    .map(|side| {
                        let angle = TAU * side as f32 / sides as f32;
                        let (sin, cos) = if ring == 0 || ring == rings {
                            (0.0, if ring == 0 { 1.0 } else { -1.0 })
                        } else {
                            polar.sin_cos()
                        };
                        center + radii * vec3(sin * angle.cos(), sin * angle.sin(), -cos)
                    })
                    .collect()
            })
            .collect();
        self.loft(&stack, |_, _| None);
    }

    /// Adds a surface over closed rings of equally many points, with caps at both ends.
    ///
    /// Seen from the last ring towards the first, each ring runs counter-clockwise. `paint(band,
    /// side)` may return another material for the facets between rings `band` and `band + 1`,
    /// points `side` and `side + 1`; the caps are the bands [`FIRST_CAP`] and [`LAST_CAP`], with
    /// side 0.
    pub(crate) fn loft(
        &mut self,
        rings: &[Vec<Vec3>],
        paint: impl Fn(usize, usize) -> Option<Material>,
    ) {
        self.loft_with(rings, |usual, band, side| {
            paint(band, side).map_or(usual, |material| Face { material: material as u8, ..usual })
        });
    }

    /// As [`MeshBuilder::loft`]; `paint(usual, band, side)` returns the whole face of a facet.
    pub(crate) fn loft_with(
        &mut self,
        rings: &[Vec<Vec3>],
        paint: impl Fn(Face, usize, usize) -> Face,
    ) {
        let sides = rings[0].len();
        let usual = self.face;
        let indices: Vec<Vec<u32>> = rings
            .iter()
            .map(|ring| {
                // A ring that is a point has one vertex, so its facets are triangles.
                if ring.iter().all(|point| *point == ring[0]) {
                    vec![self.vertex(ring[0]); sides]
                } else {
                    ring.iter().map(|point| self.vertex(*point)).collect()
                }
            })
            .collect();
        for band in 0..rings.len() - 1 {
            for side in 0..sides {
                let next = (side + 1) % sides;
                self.face = paint(usual, band, side);
                let (low, high) = (&indices[band], &indices[band + 1]);
                self.triangle([low[side], low[next], high[next]]);
                self.triangle([low[side], high[next], high[side]]);
                self.face = usual;
            }
        }
        for (cap, ring, flip) in
            [(FIRST_CAP, &indices[0], true), (LAST_CAP, &indices[rings.len() - 1], false)]
        {
            self.face = paint(usual, cap, 0);
            for side in 1..sides - 1 {
                let [a, b] = if flip { [side + 1, side] } else { [side, side + 1] };
                self.triangle([ring[0], ring[a], ring[b]]);
            }
            self.face = usual;
        }
    }
}

/// The smallest and the largest coordinates of a mesh; zero for an empty mesh.
pub(crate) fn bounds(mesh: &Mesh) -> (Vec3, Vec3) {
    let mut points = mesh.positions.iter().map(|point| Vec3::from_array(*point));
    let Some(first) = points.next() else { return (Vec3::ZERO, Vec3::ZERO) };
    points.fold((first, first), |(low, high), point| (low.min(point), high.max(point)))
}
