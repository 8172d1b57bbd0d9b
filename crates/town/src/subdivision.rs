//! Catmull-Clark subdivision with semi-sharp creases.
//!
//! Catmull and Clark 1978, "Recursively generated B-spline surfaces on arbitrary topological
//! meshes"; creases as in DeRose, Kass and Truong 1998, "Subdivision surfaces in character
//! animation". Edges that are still sharp at the end become narrow strips
//! ([`Cage::bevelled`]).

use std::collections::BTreeMap;

use glam::Vec3;

/// A control cage: polygons with an attribute each, and edges with a sharpness.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cage<T> {
    pub(crate) points: Vec<Vec3>,
    /// The corners of each polygon, counter-clockwise seen from outside, and its attribute.
    pub(crate) faces: Vec<(Vec<u32>, T)>,
    /// The sharpness of edges, lower index first: how many subdivisions treat an edge as sharp. 0
    /// for all others; infinite for edges that stay sharp.
    pub(crate) creases: BTreeMap<(u32, u32), f32>,
}

/// The key of an edge in [`Cage::creases`].
pub(crate) fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// The polygons beside an edge; a border has one, and stays sharp.
#[derive(Default)]
struct Sides {
    faces: Vec<u32>,
}

impl<T: Copy> Cage<T> {
    fn edges(&self) -> BTreeMap<(u32, u32), Sides> {
        let mut edges = BTreeMap::<(u32, u32), Sides>::new();
        for ((corners, _), face) in self.faces.iter().zip(0..) {
            for (at, a) in corners.iter().enumerate() {
                let b = corners[(at + 1) % corners.len()];
                edges.entry(edge(*a, b)).or_default().faces.push(face);
            }
        }
        edges
    }

    /// The sharpness of an edge: infinite unless exactly two polygons meet there.
    fn sharpness(&self, key: (u32, u32), sides: &Sides) -> f32 {
        let given = self.creases.get(&key).copied().unwrap_or(0.0);
        if sides.faces.len() == 2 { given } else { f32::INFINITY }
    }

    /// Returns the cage after one subdivision, all of quadrilaterals. Points keep their indices;
    /// those of faces follow, then those of edges.
    pub(crate) fn subdivided(&self) -> Cage<T> {
        let edges = self.edges();
        let mean = |points: &mut dyn Iterator<Item = Vec3>| {
            let (sum, count) = points.fold((Vec3::ZERO, 0.0), |(sum, n), p| (sum + p, n + 1.0));
            sum / f32::max(count, 1.0)
        };
        let point = |index: u32| self.points[index as usize];
        let centers: Vec<Vec3> = self
            .faces
            .iter()
            .map(|(corners, _)| mean(&mut corners.iter().map(|corner| point(*corner))))
            .collect();
        let first_edge = (self.points.len() + self.faces.len()) as u32;
        let mut creases = BTreeMap::new();
        let mut around = vec![Vertex::default(); self.points.len()];
        let mut edge_points = Vec::with_capacity(edges.len());
        let mut numbers = BTreeMap::new();
        for ((key, sides), number) in edges.iter().zip(first_edge..) {
            let sharp = self.sharpness(*key, sides);
            let middle = (point(key.0) + point(key.1)) * 0.5;
            let smooth = mean(&mut sides.faces.iter().map(|face| centers[*face as usize])) * 0.5
                + middle * 0.5;
            edge_points.push(smooth.lerp(middle, sharp.min(1.0)));
            numbers.insert(*key, number);
            for (own, other) in [(key.0, key.1), (key.1, key.0)] {
                around[own as usize].meet(point(other), sharp);
                if sharp > 1.0 && sides.faces.len() == 2 {
                    creases.insert(edge(own, number), sharp - 1.0);
                }
            }
        }
        for ((corners, _), center) in self.faces.iter().zip(&centers) {
            for corner in corners {
                let vertex = &mut around[*corner as usize];
                (vertex.centers, vertex.faces) = (vertex.centers + *center, vertex.faces + 1.0);
            }
        }
        let mut points: Vec<Vec3> =
            self.points.iter().zip(&around).map(|(own, vertex)| vertex.moved(*own)).collect();
        points.extend(&centers);
        points.extend(edge_points);
        let mut faces = Vec::with_capacity(self.faces.len() * 4);
        for ((corners, attribute), center) in self.faces.iter().zip(self.points.len() as u32..) {
            for (at, corner) in corners.iter().enumerate() {
                let after = corners[(at + 1) % corners.len()];
                let before = corners[(at + corners.len() - 1) % corners.len()];
                let [next, last] = [edge(*corner, after), edge(before, *corner)];
                faces.push((vec![*corner, numbers[&next], center, numbers[&last]], *attribute));
            }
        }
        Cage { points, faces, creases }
    }
    /// Returns the cage with a strip of this width instead of each line of sharp edges, so that normals which are
    /// interpolated between corners turn within the strip. Metres.
    ///
    /// A line ends in a triangle where it ends or meets another one. Points keep their indices; the
    /// second sides of strips follow.
    pub(crate) fn bevelled(&self, wide: f32) -> Cage<T> {
        let edges = self.edges();
        let mut lines = BTreeMap::<(u32, u32), [u32; 2]>::new();
        let mut ends = BTreeMap::<u32, Vec<u32>>::new();
        for (key, sides) in edges {
            if let (true, [one, other]) = (self.creases.contains_key(&key), &sides.faces[..]) {
                lines.insert(key, [*one, *other]);
                ends.entry(key.0).or_default().push(key.1);
                ends.entry(key.1).or_default().push(key.0);
            }
        }
        ends.retain(|_, far| far.len() == 2);
        let mut around = BTreeMap::<u32, Vec<u32>>::new();
        for ((corners, _), face) in self.faces.iter().zip(0..) {
            for corner in corners.iter().filter(|corner| ends.contains_key(corner)) {
                around.entry(*corner).or_default().push(face);
            }
        }
        let mut points = self.points.clone();
        let mut faces = self.faces.clone();
        for (point, far) in &ends {
            let own = self.points[*point as usize];
            let [before, after] = [far[0], far[1]].map(|end| self.points[end as usize]);
            let along = (after - before).normalize_or_zero();
            let sides = self.sides(*point, &around[point], &lines);
            let [(near, one), (_, other)] = &sides[..] else { continue };
            let moved = |towards: Vec3| {
                let aside = (towards - own).reject_from(along).normalize_or_zero();
                own + aside * wide * 0.5
            };
            let twin = points.len() as u32;
            points[*point as usize] = moved(*one);
            points.push(moved(*other));
            for face in around[point].iter().filter(|face| !near.contains(face)) {
                let corners = &mut faces[*face as usize].0;
                corners.iter_mut().filter(|at| **at == *point).for_each(|at| *at = twin);
            }
        }
        for ((a, b), sides) in &lines {
            // The corners of both faces at the ends of the edge, in their new places.
            let [one, other] = sides.map(|face| {
                let (old, new) = (&self.faces[face as usize].0, &faces[face as usize].0);
                let place = |at: u32| old.iter().position(|c| *c == at).map(|c| new[c]);
                [place(*a), place(*b)].map(|at| at.unwrap_or(*a))
            });
            let (old, attribute) = &self.faces[sides[0] as usize];
            let next = |at: usize| old[(at + 1) % old.len()];
            let is_forward = (0..old.len()).any(|at| old[at] == *a && next(at) == *b);
            let mut strip = vec![one[1], one[0], other[0], other[1]];
            if !is_forward {
                strip.reverse();
            }
            strip.dedup();
            if strip.first() == strip.last() {
                strip.pop();
            }
            if strip.len() > 2 {
                faces.push((strip, *attribute));
            }
        }
        Cage { points, faces, creases: BTreeMap::new() }
    }

    /// The polygons around a point on both sides of a line through it, the side of the first polygon
    /// first, and the middle of each side.
    fn sides(
        &self,
        point: u32,
        around: &[u32],
        lines: &BTreeMap<(u32, u32), [u32; 2]>,
    ) -> Vec<(Vec<u32>, Vec3)> {
        let touches = |one: u32, other: u32| {
            let shared = |at: &&u32| self.faces[other as usize].0.contains(at);
            let common = self.faces[one as usize].0.iter().filter(shared);
            common.copied().any(|at| at != point && !lines.contains_key(&edge(point, at)))
        };
        let mut left = around.to_vec();
        let mut sides = Vec::new();
        while let Some(first) = left.first().copied() {
            let mut side = vec![first];
            let mut at = 0;
            left.remove(0);
            while let Some(face) = side.get(at).copied() {
                let (near, far): (Vec<u32>, Vec<u32>) =
                    left.iter().partition(|other| touches(face, **other));
                side.extend(near);
                left = far;
                at += 1;
            }
            let corners = side.iter().flat_map(|face| &self.faces[*face as usize].0);
            let (sum, count) = corners.fold((Vec3::ZERO, 0.0), |(sum, count), corner| {
                (sum + self.points[*corner as usize], count + 1.0)
            });
            sides.push((side, sum / count));
        }
        sides
    }
}

/// What surrounds a vertex.
#[derive(Clone, Copy, Default)]
struct Vertex {
    neighbours: Vec3,
    edges: f32,
    centers: Vec3,
    faces: f32,
    /// The sum of the far ends of sharp edges, their number and the sum of their sharpness.
    sharp_ends: Vec3,
    sharp_edges: f32,
    sharpness: f32,
}

impl Vertex {
    fn meet(&mut self, other: Vec3, sharp: f32) {
        self.neighbours += other;
        self.edges += 1.0;
        if sharp > 0.0 {
            self.sharp_ends += other;
            self.sharp_edges += 1.0;
            self.sharpness += sharp;
        }
    }

    /// The position after one subdivision.
    fn moved(&self, own: Vec3) -> Vec3 {
        if self.edges == 0.0 {
            return own;
        }
        let n = self.edges;
        // (Q + 2 R + (n - 3) S) / n with R, the mean of the middles of the edges, written out.
        let smooth =
            (self.centers / self.faces.max(1.0) + (self.neighbours / n + own) + own * (n - 3.0))
                / n;
        let sharp = match self.sharp_edges {
            ..2.0 => return smooth,
            2.0 => own * 0.75 + self.sharp_ends * 0.125,
            _ => own,
        };
        smooth.lerp(sharp, (self.sharpness / self.sharp_edges).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Cage<u8> {
        let points = (0..8u32)
            .map(|corner| {
                Vec3::from_array([1, 2, 4].map(|bit| if corner & bit == 0 { -1.0 } else { 1.0 }))
            })
            .collect();
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = faces.iter().zip(0..).map(|(face, side)| (face.to_vec(), side)).collect();
        Cage { points, faces, creases: BTreeMap::new() }
    }

    fn times(cage: &Cage<u8>, times: u32) -> Cage<u8> {
        (0..times).fold(cage.clone(), |cage, _| cage.subdivided())
    }

    #[test]
    fn a_cube_has_the_points_of_catmull_and_clark() {
        let once = cube().subdivided();
        assert_eq!((once.points.len(), once.faces.len()), (8 + 6 + 12, 24));
        // A corner: (Q + 2R + 0 S) / 3 with Q = 1/3 and R = 2/3 in each coordinate.
        assert!((once.points[7] - Vec3::splat(5.0 / 9.0)).length() < 1e-6, "{}", once.points[7]);
        assert!(once.points[8].abs().element_sum() == 1.0, "the middle of a side stays");
        // The middle of an edge: a quarter of its ends and of the middles of both sides.
        assert!(once.points[14..].iter().all(|p| (p.abs().element_sum() - 1.5).abs() < 1e-6));
        assert!(once.faces.iter().all(|(corners, side)| corners.len() == 4 && *side < 6));
    }

    #[test]
    fn a_vertex_converges_to_its_limit_position() {
        // (n² S + 4 ΣE + ΣF) / (n (n + 5)) after the first subdivision: Halstead et al. 1993.
        let once = cube().subdivided();
        let n = 3.0f32;
        let [mut edges, mut faces] = [Vec3::ZERO; 2];
        for (corners, _) in once.faces.iter().filter(|(corners, _)| corners[0] == 7) {
            edges += once.points[corners[1] as usize];
            faces += once.points[corners[2] as usize];
        }
        let limit = (once.points[7] * n * n + edges * 4.0 + faces) / (n * (n + 5.0));
        let far = times(&cube(), 7);
        assert!((far.points[7] - limit).length() < 1e-4, "{} {limit}", far.points[7]);
        // All of the limit surface is nearly a ball.
        let radii = far.points.iter().map(|p| p.length());
        let (low, high) = radii.fold((9.0f32, 0.0f32), |(a, b), r| (a.min(r), b.max(r)));
        assert!(low > 0.8 * high && high < 1.1, "{low} to {high}");
    }

    #[test]
    fn creases_stay_sharp_as_often_as_they_say() {
        let with = |sharp: f32| {
            let mut cage = cube();
            let keys: Vec<_> = cage.edges().keys().copied().collect();
            cage.creases = keys.into_iter().map(|key| (key, sharp)).collect();
            cage
        };
        let sharp = times(&with(f32::INFINITY), 3);
        let reach = |p: &Vec3| p.abs().max_element();
        assert!(sharp.points.iter().all(|p| (reach(p) - 1.0).abs() < 1e-6), "a cube stays a cube");
        assert_eq!(times(&with(2.0), 2).points[7], Vec3::ONE);
        assert!(times(&with(2.0), 3).points[7].length() < 1.6);
        let half = with(0.5).subdivided().points[7];
        assert!((half - Vec3::splat((1.0 + 5.0 / 9.0) * 0.5)).length() < 1e-6, "{half}");
    }

    #[test]
    fn a_bevel_replaces_sharp_edges_by_strips_and_stays_closed() {
        // The upper edges of a cube: a line without ends.
        let mut cage = cube();
        let upper = cage.faces[1].0.clone();
        let ring = (0..4).map(|at| edge(upper[at], upper[(at + 1) % 4]));
        cage.creases = ring.map(|key| (key, 1.0)).collect();
        let round = cage.bevelled(0.2);
        assert_eq!((round.points.len(), round.faces.len()), (8 + 4, 6 + 4));
        let directed = round.faces.iter().flat_map(|(corners, _)| {
            (0..corners.len()).map(|at| (corners[at], corners[(at + 1) % corners.len()]))
        });
        let directed: std::collections::BTreeSet<_> = directed.collect();
        assert!(directed.iter().all(|(a, b)| directed.contains(&(*b, *a))), "closed");
        assert!(round.points[..4].iter().all(|p| p.abs() == Vec3::ONE), "others stay");
        // A line through two opposite edges of the top ends in triangles.
        let mut open = cube();
        let fine = {
            open.creases = [(edge(4, 5), f32::INFINITY)].into();
            open.subdivided()
        };
        let cut = fine.bevelled(0.01);
        let triangles = cut.faces.iter().filter(|(corners, _)| corners.len() == 3).count();
        assert_eq!((cut.points.len(), triangles), (fine.points.len() + 1, 2));
        // Both sides of the strip have half of its width.
        let moved = (0..fine.points.len()).find(|at| cut.points[*at] != fine.points[*at]).unwrap();
        for side in [moved, fine.points.len()] {
            let far = cut.points[side].distance(fine.points[moved]);
            assert!((far - 0.005).abs() < 1e-6, "{far}");
        }
    }

    #[test]
    fn a_border_is_a_cubic_b_spline() {
        // Two squares side by side: the border does not depend on what is inside.
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, 1.0), (1.0, 2.0), (2.0, 1.0)];
        let cage = Cage {
            points: points.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            faces: vec![(vec![0, 1, 4, 3], 0u8), (vec![1, 2, 5, 4], 1)],
            creases: BTreeMap::new(),
        };
        let once = cage.subdivided();
        let expected = Vec3::new(1.0, 2.0 * 0.75 + 2.0 * 0.125, 0.0);
        assert!((once.points[4] - expected).length() < 1e-6, "{}", once.points[4]);
        assert!(once.points.contains(&Vec3::new(0.5, 1.5, 0.0)), "the middle of a border edge");
    }
}
