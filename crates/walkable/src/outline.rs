//! The outlines of sidewalks: extracted from the triangles of the town, inset, simplified.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3Swizzles};
use mesh::{Material, Mesh, Tag};

/// The vertices of a closed line whose inside is to its left.
pub(crate) type Loop = Vec<DVec3>;

/// How far crossings extend into the sidewalks at their ends. Metres.
pub(crate) const REACH_M: f64 = 1.5;
/// Vertices nearer than this are merged. Metres.
const WELD_M: f64 = 0.01;
/// A vertex this near to the line between its neighbours is removed. Metres.
const STRAIGHT_M: f64 = 0.05;
/// Shorter loops are slivers between two triangles. Metres.
const LOOP_MIN_M: f64 = 2.0;
/// Beyond a side, another sidewalk is looked for at this distance, and both overlap by this. Metres.
const BEYOND_M: f64 = 0.15;
const OVERLAP_M: f64 = 0.1;
/// Highest step between two sidewalks. Metres.
const STEP_M: f64 = 0.5;
/// Sine of the turn below which two sides are one line.
const SHARP: f64 = 0.2;
/// Steeper faces are the sides of kerbs.
const NORMAL_Z_MIN: f32 = 0.7;

/// Returns the outlines of all sidewalks, inset by `inset_m` where they end, and the height of the
/// sidewalks.
pub(crate) fn sidewalks(mesh: &Mesh, inset_m: f64) -> (Vec<Loop>, Relief) {
    let mut relief = Relief::default();
    let mut weld = Weld::default();
    let mut edges: BTreeMap<(usize, usize), ()> = BTreeMap::new();
    for (triangle, face) in mesh.triangles.iter().zip(&mesh.faces) {
        let is_paved = face.object == 0
            && face.tag == Tag::SideWalks as u8
            && face.material != Material::Kerb as u8;
        if !is_paved {
            continue;
        }
        let corners = triangle.map(|at| glam::Vec3::from(mesh.positions[at as usize]));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        if normal.normalize_or_zero().z < NORMAL_Z_MIN {
            continue;
        }
        relief.add(corners.map(|corner| corner.as_dvec3()));
        let [a, b, c] = corners.map(|corner| weld.index(corner.as_dvec3()));
        for edge in [(a, b), (b, c), (c, a)] {
            // An edge that two triangles share is not part of the outline.
            if edge.0 != edge.1 && edges.remove(&(edge.1, edge.0)).is_none() {
                edges.insert(edge, ());
            }
        }
    }
    let loops = chain(edges.into_keys().collect());
    let positions =
        |line: Vec<usize>| line.into_iter().map(|at| weld.positions[at]).collect::<Loop>();
    let loops = loops
        .into_iter()
        .map(positions)
        .filter(|line| length_m(line) > LOOP_MIN_M)
        .map(|line| straighten(inset(&line, |side| by_m(&relief, side, inset_m))))
        .filter(|line| line.len() >= 3)
        .collect();
    (loops, relief)
}

/// The triangles of sidewalks, by the cells that they touch.
#[derive(Default)]
pub(crate) struct Relief {
    triangles: Vec<[DVec3; 3]>,
    cells: BTreeMap<[i64; 2], Vec<usize>>,
}

/// Edge of a cell of [`Relief`]. Metres.
const CELL_M: f64 = 4.0;

impl Relief {
    fn add(&mut self, corners: [DVec3; 3]) {
        let cell = |at: DVec2| (at / CELL_M).floor().to_array().map(|v| v as i64);
        let [a, b, c] = corners.map(|corner| corner.xy());
        let ([x, y], [u, v]) = (cell(a.min(b).min(c)), cell(a.max(b).max(c)));
        for column in x..=u {
            for row in y..=v {
                self.cells.entry([column, row]).or_default().push(self.triangles.len());
            }
        }
        self.triangles.push(corners);
    }

    /// Returns the height of the sidewalk at a point, if there is one.
    pub(crate) fn height(&self, at: DVec2) -> Option<f64> {
        let cell = (at / CELL_M).floor().to_array().map(|v| v as i64);
        let near = self.cells.get(&cell)?.iter().map(|index| self.triangles[*index]);
        let height = |[a, b, c]: [DVec3; 3]| {
            let (u, v, way) = ((b - a).xy(), (c - a).xy(), at - a.xy());
            let whole = u.perp_dot(v);
            let (along_u, along_v) = (way.perp_dot(v) / whole, u.perp_dot(way) / whole);
            let is_in = along_u >= -1e-6 && along_v >= -1e-6 && along_u + along_v <= 1.0 + 1e-6;
            is_in.then_some(a.z + (b.z - a.z) * along_u + (c.z - a.z) * along_v)
        };
        near.filter_map(height).next()
    }
}

/// Returns the loop with its inside to its left.
pub(crate) fn counter_clockwise(mut line: Loop) -> Loop {
    if sides(&line).map(|(a, b)| a.xy().perp_dot(b.xy())).sum::<f64>() < 0.0 {
        line.reverse();
    }
    line
}

/// Returns 1 if the side passes upwards to the right of the point, −1 if downwards, otherwise 0.
pub(crate) fn crossing(at: DVec2, a: DVec2, b: DVec2) -> i32 {
    let rises = a.y <= at.y && b.y > at.y;
    let falls = b.y <= at.y && a.y > at.y;
    let side = (b - a).perp_dot(at - a);
    if rises && side > 0.0 {
        1
    } else if falls && side < 0.0 {
        -1
    } else {
        0
    }
}

/// Returns each side of a loop.
pub(crate) fn sides(line: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
    line.iter().zip(line.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

fn length_m(line: &Loop) -> f64 {
    sides(line).map(|(a, b)| a.distance(b)).sum()
}

/// The positions of vertices, merged.
#[derive(Default)]
struct Weld {
    by_cell: BTreeMap<[i64; 3], usize>,
    positions: Vec<DVec3>,
}

impl Weld {
    fn index(&mut self, place: DVec3) -> usize {
        let cell = (place / WELD_M).round().to_array().map(|v| v as i64);
        *self.by_cell.entry(cell).or_insert_with(|| {
            self.positions.push(place);
            self.positions.len() - 1
        })
    }
}

/// Joins directed edges into closed lines.
fn chain(edges: Vec<(usize, usize)>) -> Vec<Vec<usize>> {
    let mut from: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (a, b) in edges {
        from.entry(a).or_default().push(b);
    }
    let mut loops = Vec::new();
    while let Some((&start, _)) = from.first_key_value() {
        let mut line = vec![start];
        let mut at = start;
        while let Some(next) = from.get_mut(&at).and_then(Vec::pop) {
            if from[&at].is_empty() {
                from.remove(&at);
            }
            at = next;
            if at == start {
                break;
            }
            line.push(at);
        }
        from.retain(|_, to| !to.is_empty());
        loops.push(line);
    }
    loops
}

/// Returns how far a side of a sidewalk moves inwards. A side beyond which another sidewalk goes on
/// moves outwards, so that both are connected.
fn by_m(relief: &Relief, (from, to): (DVec3, DVec3), inset_m: f64) -> f64 {
    let outwards = -(to - from).xy().normalize_or_zero().perp();
    let goes_on = |share: f64| {
        let at = from.lerp(to, share).xy() + outwards * BEYOND_M;
        relief.height(at).is_some_and(|height| (height - from.z).abs() < STEP_M)
    };
    let count = [0.2, 0.5, 0.8].into_iter().filter(|share| goes_on(*share)).count();
    if count >= 2 { -OVERLAP_M } else { inset_m }
}

/// Moves every side to its left by its own distance.
fn inset(line: &[DVec3], by_m: impl Fn((DVec3, DVec3)) -> f64) -> Loop {
    let count = line.len();
    let moved = (0..count).map(|i| {
        let (before, at, after) = (line[(i + count - 1) % count], line[i], line[(i + 1) % count]);
        let [a, b] = [at - before, after - at].map(|edge| edge.xy().normalize_or_zero().perp());
        let [by_a, by_b] = [by_m((before, at)), by_m((at, after))];
        let turn = a.perp_dot(b);
        let way = if turn.abs() > SHARP {
            DVec2::new(by_a * b.y - by_b * a.y, a.x * by_b - b.x * by_a) / turn
        } else {
            (a + b).normalize_or_zero() * ((by_a + by_b) / 2.0)
        };
        // At a sharp corner, at most twice the distance.
        at + way.clamp_length_max(2.0 * by_a.abs().max(by_b.abs())).extend(0.0)
    });
    moved.collect()
}

/// Removes vertices at which the line hardly turns.
fn straighten(line: Loop) -> Loop {
    let mut kept: Loop = Vec::with_capacity(line.len());
    let mut skipped: Vec<DVec3> = Vec::new();
    for (index, at) in line.iter().enumerate() {
        let next = line[(index + 1) % line.len()];
        let Some(last) = kept.last().copied() else {
            kept.push(*at);
            continue;
        };
        skipped.push(*at);
        let chord = next - last;
        let off_m = |place: &DVec3| {
            let share = (*place - last).dot(chord) / chord.length_squared().max(1e-9);
            place.distance(last + chord * share.clamp(0.0, 1.0))
        };
        if skipped.iter().any(|place| off_m(place) > STRAIGHT_M) {
            kept.push(*at);
            skipped.clear();
        }
    }
    kept
}
