//! Bodies from control cages: text files in `cages/`, subdivided when the mesh is built.
//!
//! A cage is a Wavefront OBJ file of the left half of a vehicle. x runs from the nose (0) to the tail
//! (1), y is in half widths and z in heights. `usemtl` names a [`Material`], `g` a part: `body`,
//! `roof`, `door_front`, `door_rear`. The groups `arch_front` and `arch_rear` have lines along the
//! edges of the wheel arches, which follow the wheels of each model. `# axles` gives the x of each
//! axle: one for the cab of a truck, two for a whole vehicle. Creases are lines `t crease 2/1/0 from to sharpness`, as in OpenSubdiv's shapes, with
//! indices from 0.

use std::{collections::BTreeMap, f32::consts::PI};

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{
        obj::{self, CageError, Element},
        profile::{Measure, RELIEF},
    },
    subdivision::{Cage, edge},
};

/// The part of a car that a face belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Body,
    Roof,
    /// The number of the door, in CARLA's order.
    Door(u32),
}

/// The attributes of a face of a cage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Skin {
    pub(super) part: Part,
    pub(super) material: Material,
}

/// The left half of a car, in fractions.
#[derive(Debug)]
pub(super) struct HalfCar {
    points: Vec<Vec3>,
    faces: Vec<(Vec<u32>, Skin)>,
    creases: Vec<(u32, u32, f32)>,
    arches: [Vec<Vec<u32>>; 2],
    axles: Vec<f32>,
}

/// The radius of the control points of a wheel arch in wheel radii; the edge lies further inside.
const ARCH: f32 = 1.25;
/// The angles at which an arch begins and ends, above the horizontal. Radians.
const ARCH_ENDS: [f32; 2] = [PI * 200.0 / 180.0, -PI * 20.0 / 180.0];

fn material(name: &str) -> Option<Material> {
    [Material::CarPaint, Material::Glass, Material::Plastic, Material::Metal, Material::Rubber]
        .into_iter()
        .find(|material| format!("{material:?}") == name)
}

/// Whether these are the x of one or two axles between nose and tail, front first.
fn are_axles(axles: &[f32]) -> bool {
    let inside = axles.iter().all(|x| 0.0 < *x && *x < 1.0);
    inside && matches!(axles.len(), 1 | 2) && axles.is_sorted_by(|a, b| a < b)
}

impl HalfCar {
    /// Reads a file.
    pub(super) fn parse(text: &str) -> Result<HalfCar, CageError> {
        let mut car = HalfCar {
            points: Vec::new(),
            faces: Vec::new(),
            creases: Vec::new(),
            arches: [Vec::new(), Vec::new()],
            axles: Vec::new(),
        };
        let mut skin = Skin { part: Part::Body, material: Material::CarPaint };
        let mut arch = None;
        obj::read(text, |element| {
            match element {
                Element::Vertex(point) => car.points.push(point),
                Element::Group(name) => {
                    arch = None;
                    match name {
                        "body" => skin.part = Part::Body,
                        "roof" => skin.part = Part::Roof,
                        "door_front" => skin.part = Part::Door(0),
                        "door_rear" => skin.part = Part::Door(2),
                        "arch_front" => arch = Some(0),
                        "arch_rear" => arch = Some(1),
                        _ => return Err("unknown group"),
                    }
                }
                Element::Material(name) => {
                    skin.material = material(name).ok_or("unknown material")?;
                }
                Element::Face(corners) => car.faces.push((corners, skin)),
                Element::Line(points) => {
                    let arch = arch.ok_or("expected a line of an arch")?;
                    let lines: &mut Vec<Vec<u32>> = &mut car.arches[arch];
                    lines.push(points);
                }
                Element::Crease(a, b, sharp) => car.creases.push((a, b, sharp)),
                Element::Comment(words) if words.first() == Some(&"axles") => {
                    match obj::numbers(&words[1..]) {
                        Some(axles) if are_axles(&axles) => car.axles = axles,
                        _ => return Err("expected the x of one or two axles"),
                    }
                }
                Element::Comment(_) | Element::Nothing => {}
            }
            Ok(())
        })?;
        let end = |what| CageError { line: text.lines().count(), what };
        match () {
            () if car.axles.is_empty() => Err(end("no axles")),
            () if car.faces.is_empty() => Err(end("no faces")),
            () => Ok(car),
        }
    }

    /// Returns the cage of a whole car of these dimensions, in actor space.
    pub(super) fn placed(&self, measure: &Measure) -> Cage<Skin> {
        // A wheel of each axle; a cage of one axle is the cab of a vehicle.
        let wheels = || measure.wheels.iter().step_by(2).zip(&self.axles);
        let [nose, tail] = [measure.nose_m - RELIEF, measure.nose_m - measure.size_m.x + RELIEF];
        let mut knots = vec![(0.0, nose)];
        knots.extend(wheels().map(|(wheel, axle)| (*axle, wheel.position_m.x)));
        knots.push((1.0, tail));
        let x = |fraction: f32| {
            let inner = &knots[1..knots.len() - 1];
            let at = inner.iter().filter(|knot| fraction > knot.0).count();
            let ((x0, y0), (x1, y1)) = (knots[at], knots[at + 1]);
            y0 + (y1 - y0) * ((fraction - x0) / (x1 - x0))
        };
        let half = measure.body_m * 0.5;
        let mut points: Vec<Vec3> =
            self.points.iter().map(|p| vec3(x(p.x), p.y * half, p.z * measure.size_m.z)).collect();
        for (lines, (wheel, _)) in self.arches.iter().zip(wheels()) {
            for line in lines {
                for (number, point) in line.iter().enumerate() {
                    let t = number as f32 / (line.len() - 1) as f32;
                    let angle = ARCH_ENDS[0] + (ARCH_ENDS[1] - ARCH_ENDS[0]) * t;
                    let reach = wheel.radius_m * ARCH;
                    let point = &mut points[*point as usize];
                    point.x = wheel.position_m.x - reach * angle.cos();
                    point.z = wheel.position_m.z + reach * angle.sin();
                }
            }
        }
        let mut twin = Vec::with_capacity(points.len());
        for index in 0..points.len() as u32 {
            let point = points[index as usize];
            if point.y.abs() < 1e-4 {
                points[index as usize].y = 0.0;
                twin.push(index);
            } else {
                twin.push(points.len() as u32);
                points.push(vec3(point.x, -point.y, point.z));
            }
        }
        let mut faces = self.faces.clone();
        faces.extend(self.faces.iter().map(|(corners, skin)| {
            let corners = corners.iter().rev().map(|corner| twin[*corner as usize]).collect();
            let part = match skin.part {
                Part::Door(number) => Part::Door(number + 1),
                part => part,
            };
            (corners, Skin { part, ..*skin })
        }));
        let mut creases = BTreeMap::new();
        for (a, b, sharp) in &self.creases {
            creases.insert(edge(*a, *b), *sharp);
            creases.insert(edge(twin[*a as usize], twin[*b as usize]), *sharp);
        }
        Cage { points, faces, creases }
    }
}

/// The triangles of a body, on which lamps and seams are placed.
pub(super) struct Surface(Vec<[Vec3; 3]>);

impl Surface {
    pub(super) fn of<T>(cage: &Cage<T>) -> Surface {
        let corners =
            |face: &[u32], which: [usize; 3]| which.map(|c| cage.points[face[c] as usize]);
        let both = |(face, _): &(Vec<u32>, T)| {
            (1..face.len() - 1).map(|c| corners(face, [0, c, c + 1])).collect::<Vec<_>>()
        };
        Surface(cage.faces.iter().flat_map(both).collect())
    }

    /// The last point of the surface on a ray (Möller and Trumbore 1997), and its normal.
    pub(super) fn cast(&self, from: Vec3, along: Vec3) -> Option<(Vec3, Vec3)> {
        let hit = |[a, b, c]: &[Vec3; 3]| {
            let (u, v) = (*b - *a, *c - *a);
            let p = along.cross(v);
            let det = u.dot(p);
            if det.abs() < 1e-9 {
                return None;
            }
            let s = (from - *a) / det;
            let q = s.cross(u);
            let (x, y, far) = (s.dot(p), along.dot(q), v.dot(q));
            let inside = x >= -1e-4 && y >= -1e-4 && x + y <= 1.0002 && far > 0.0;
            inside.then(|| (far, u.cross(v).normalize_or_zero()))
        };
        let hits = self.0.iter().filter_map(hit);
        let (far, normal) = hits.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((from + along * far, normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{profile::Silhouette, silhouettes::*, tall::*};

    const CAGED: [&Silhouette; 19] = [
        &SEDAN,
        &LIFTBACK,
        &HATCHBACK,
        &MONOVOLUME,
        &BRICK,
        &SUV,
        &COUPE,
        &WEDGE,
        &FASTBACK,
        &DOME,
        &CLASSIC,
        &BUBBLE,
        &VAN,
        &MICROBUS,
        &COACH,
        &CAB,
        &SNOUT,
        &OFF_ROADER,
        &JEEP,
    ];

    #[test]
    fn every_cage_is_closed_but_for_its_underside() {
        for shape in CAGED {
            let car = HalfCar::parse(shape.cage).unwrap();
            let mut edges = BTreeMap::<(u32, u32), i32>::new();
            for (corners, _) in &car.faces {
                for (at, a) in corners.iter().enumerate() {
                    let b = corners[(at + 1) % corners.len()];
                    *edges.entry(edge(*a, b)).or_default() += 1;
                }
            }
            let point = |index: u32| car.points[index as usize];
            for ((a, b), count) in edges {
                let is_middle = point(a).y == 0.0 && point(b).y == 0.0;
                let is_low = point(a).z.max(point(b).z) < 0.58;
                assert!(count == 2 || count == 1 && (is_middle || is_low), "{a} {b}: {count}");
            }
            for (axle, arch) in car.arches.iter().enumerate() {
                assert_eq!(arch.len(), if axle < car.axles.len() { 2 } else { 0 });
            }
        }
    }

    #[test]
    fn broken_cages_are_refused_with_their_line() {
        let good = "# axles 0.2 0.8\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
        assert_eq!(HalfCar::parse(good).unwrap().faces.len(), 1);
        for (tail, line) in [
            ("f 1 2 4", 6),
            ("f 1 2", 6),
            ("v 1 2", 6),
            ("v 1 2 x", 6),
            ("g wing", 6),
            ("usemtl Chocolate", 6),
            ("l 1 2", 6),
            ("t crease 2/1/0 0 9 1", 6),
            ("t corner 1/1/0 0 1", 6),
            ("curve", 6),
            ("# axles 0.8 0.2", 6),
            ("# axles", 6),
            ("# axles 1.2", 6),
            ("# axles 0.2 0.5 0.8", 6),
        ] {
            assert_eq!(
                HalfCar::parse(&format!("{good}{tail}\n")).unwrap_err().line,
                line,
                "{tail}"
            );
        }
        assert_eq!(HalfCar::parse("").unwrap_err().what, "no axles");
    }
}
