use std::f32::consts::TAU;

use glam::{Quat, Vec3, vec3};
use mesh::{Face, Material, Mesh, Tag};

/// The band by which [`MeshBuilder::loft`] names the cap on its first ring.
pub(crate) const FIRST_CAP: usize = usize::MAX;
/// The band by which [`MeshBuilder::loft`] names the cap on its last ring.
pub(crate) const LAST_CAP: usize = usize::MAX - 1;

/// A mesh under construction: a few solids, all painted with the face that is current.
///
/// Every solid is closed and its triangles are counter-clockwise seen from outside.
#[derive(Debug)]
pub(crate) struct MeshBuilder {
    pub(crate) mesh: Mesh,
    face: Face,
}

impl MeshBuilder {
    /// An empty mesh.
    pub(crate) fn new(tag: Tag, material: Material, object: u32) -> MeshBuilder {
        MeshBuilder { mesh: Mesh::default(), face: Face::new(tag, material, object) }
    }

    /// What follows is of this tag and material.
    pub(crate) fn paint(&mut self, tag: Tag, material: Material) -> &mut MeshBuilder {
        self.face = Face::new(tag, material, self.face.object);
        self
    }

    /// What follows is of this material, in its own colour.
    pub(crate) fn material(&mut self, material: Material) -> &mut MeshBuilder {
        (self.face.material, self.face.tint) = (material as u8, 0);
        self
    }

    /// What follows is of this material, in an sRGB colour.
    pub(crate) fn tinted(&mut self, material: Material, rgb: [u8; 3]) -> &mut MeshBuilder {
        (self.face.material, self.face.tint) = (material as u8, Face::tint(rgb));
        self
    }

    /// What follows belongs to this object.
    pub(crate) fn object(&mut self, object: u32) -> &mut MeshBuilder {
        self.face.object = object;
        self
    }

    pub(crate) fn vertex(&mut self, point: Vec3) -> u32 {
        self.mesh.vertex(point.to_array())
    }

    /// A triangle between known corners; left out if two of them are the same point.
    pub(crate) fn triangle(&mut self, corners: [u32; 3]) {
        let [a, b, c] = corners.map(|corner| self.mesh.positions[corner as usize]);
        if a != b && b != c && c != a {
            self.mesh.triangle(corners, self.face);
        }
    }

    /// A flat quadrilateral, counter-clockwise.
    pub(crate) fn quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners.map(|corner| self.vertex(corner));
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// An axis-aligned box.
    pub(crate) fn block(&mut self, low: Vec3, high: Vec3) {
        self.block_at((low + high) * 0.5, (high - low) * 0.5, Quat::IDENTITY);
    }

    /// A box about `center`, turned by `turn`.
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

    /// What `build` makes is one closed solid: if it came out inside out, it is turned.
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

    /// A solid of revolution about an upright axis: (radius, height) from below to above.
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

    /// A pipe along a polyline.
    pub(crate) fn pipe(&mut self, points: &[Vec3], radius: f32, sides: u32) {
        for pair in points.windows(2) {
            self.rod(pair[0], pair[1], radius, sides);
        }
    }

    /// A finished mesh, `scale` times as large, as part of the current object.
    pub(crate) fn append(&mut self, mesh: &Mesh, scale: f32) {
        let base = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(mesh.positions.iter().map(|p| p.map(|x| x * scale)));
        self.mesh.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + base)));
        let object = self.face.object;
        self.mesh.faces.extend(mesh.faces.iter().map(|face| Face { object, ..*face }));
    }

    /// A cylinder or, with unequal radii, a truncated cone; a radius of 0 makes a tip.
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

    /// A cylinder.
    pub(crate) fn rod(&mut self, from: Vec3, to: Vec3, radius: f32, sides: u32) {
        self.cone(from, to, [radius; 2], sides);
    }

    /// A ball stretched to `radii`, of `rings` × `sides` facets.
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

    /// A skin over closed rings of equally many points, with both ends capped.
    ///
    /// Looking back from the last ring to the first, each runs counter-clockwise.
    /// `paint(band, side)` may give another material to the facets between rings `band` and
    /// `band + 1`, points `side` and `side + 1`; the caps are the bands [`FIRST_CAP`] and
    /// [`LAST_CAP`], with side 0.
    pub(crate) fn loft(
        &mut self,
        rings: &[Vec<Vec3>],
        paint: impl Fn(usize, usize) -> Option<Material>,
    ) {
        self.loft_with(rings, |usual, band, side| {
            paint(band, side).map_or(usual, |material| Face { material: material as u8, ..usual })
        });
    }

    /// As [`MeshBuilder::loft`]; `paint(usual, band, side)` says all of a facet's face.
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
                // A ring that is a point has one corner, so that its facets are triangles.
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

/// The corners' smallest and largest coordinates; zero for an empty mesh.
pub(crate) fn bounds(mesh: &Mesh) -> (Vec3, Vec3) {
    let mut points = mesh.positions.iter().map(|point| Vec3::from_array(*point));
    let Some(first) = points.next() else { return (Vec3::ZERO, Vec3::ZERO) };
    points.fold((first, first), |(low, high), point| (low.min(point), high.max(point)))
}
