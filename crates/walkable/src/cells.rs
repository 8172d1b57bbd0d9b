//! Walkable ground as a triangulation with neighbours.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3Swizzles};
use spade::{
    ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation,
    handles::FixedVertexHandle,
};

use crate::{
    area::Area,
    cut::cut,
    outline::{Loop, crossing, sides},
};

/// The outlines that define walkable ground.
#[derive(Default)]
pub(crate) struct Outlines {
    pub(crate) sidewalks: Vec<Loop>,
    /// Crosswalks, and then places to cross quiet streets.
    pub(crate) crossings: Vec<Loop>,
    /// How many of `crossings` are crosswalks.
    pub(crate) crosswalks: usize,
    /// Obstacles.
    pub(crate) holes: Vec<Loop>,
}

/// Walkable ground as triangles, counter-clockwise from above. World space, metres.
#[derive(Clone, Debug, Default)]
pub struct Cells {
    /// The vertices.
    pub positions: Vec<DVec3>,
    /// The triangles.
    pub triangles: Vec<Cell>,
}

/// One triangle of walkable ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Its vertices.
    pub corners: [u32; 3],
    /// By corner: the triangle beyond the side that begins there.
    pub neighbours: [Option<u32>; 3],
    /// What kind of ground it is.
    pub area: Area,
    /// The crossing that it belongs to; `None` on sidewalks.
    pub crossing: Option<u32>,
}

/// Vertices of outlines nearer than this are merged. Metres.
const WELD_M: f64 = 0.02;

#[derive(Clone, Copy)]
struct Corner {
    at: Point2<f64>,
    /// NaN where two outlines cross, and for obstacles.
    z: f64,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

impl Cells {
    /// Triangulates the ground. `height` returns the height of the sidewalk where there is one.
    pub(crate) fn of(ground: &Outlines, height: impl Fn(DVec2) -> Option<f64>) -> Cells {
        let mut plane = ConstrainedDelaunayTriangulation::<Corner>::new();
        let mut known = BTreeMap::new();
        let areas = Areas::of(ground);
        let outlines = ground.sidewalks.iter().chain(&ground.holes).chain(&ground.crossings);
        let lines: Vec<_> = outlines.flat_map(|line| sides(line)).collect();
        let crossings_from = lines.len() - ground.crossings.iter().map(Vec::len).sum::<usize>();
        for (index, line) in cut(&lines).iter().enumerate() {
            for pair in line.windows(2) {
                // Sidewalks go on under the ends of crossings.
                let middle = (pair[0] + pair[1]).xy() / 2.0;
                let is_covered = index >= crossings_from
                    && matches!(areas.at(middle), Some((Area::Sidewalk, _)));
                if is_covered {
                    continue;
                }
                let ends = [0, 1].map(|end| corner(&mut plane, &mut known, pair[end]));
                if let [Some(from), Some(to)] = ends
                    && from != to
                {
                    // A line that still crosses another one within the merging distance is skipped.
                    let _ = plane.try_add_constraint(from, to);
                }
            }
        }
        let heights = heights(&plane, height);
        let mut cells = Cells::default();
        let mut numbers = BTreeMap::new();
        let mut faces = Vec::new();
        for face in plane.inner_faces() {
            let corners = face.vertices();
            let middle =
                corners.iter().map(|c| place(c.position())).sum::<DVec2>() / corners.len() as f64;
            if let Some(area) = areas.at(middle) {
                numbers.insert(face.fix().index(), faces.len() as u32);
                faces.push((face, area));
            }
        }
        let mut corners = BTreeMap::new();
        for (face, area) in &faces {
            let sides = face.adjacent_edges();
            let corners = sides.map(|side| {
                let from = side.from();
                let index = from.fix().index();
                *corners.entry(index).or_insert_with(|| {
                    cells.positions.push(place(from.position()).extend(heights[index]));
                    cells.positions.len() as u32 - 1
                })
            });
            let neighbours = sides.map(|side| {
                let other = side.rev().face().as_inner()?;
                numbers.get(&other.fix().index()).copied()
            });
            let (area, crossing) = *area;
            cells.triangles.push(Cell { corners, neighbours, area, crossing });
        }
        cells
    }
}

fn corner(
    plane: &mut ConstrainedDelaunayTriangulation<Corner>,
    known: &mut BTreeMap<[i64; 2], FixedVertexHandle>,
    at: DVec3,
) -> Option<FixedVertexHandle> {
    let cell = (at.xy() / WELD_M).round();
    let key = cell.to_array().map(|v| v as i64);
    if let Some(handle) = known.get(&key) {
        return Some(*handle);
    }
    let welded = cell * WELD_M;
    let handle = plane.insert(Corner { at: Point2::new(welded.x, welded.y), z: at.z }).ok()?;
    known.insert(key, handle);
    Some(handle)
}

fn place(at: Point2<f64>) -> DVec2 {
    DVec2::new(at.x, at.y)
}

/// Returns the height of every vertex. Where neither the vertex nor `height` defines one, it is the
/// mean of its neighbours, weighted by inverse distance.
fn heights(
    plane: &ConstrainedDelaunayTriangulation<Corner>,
    height: impl Fn(DVec2) -> Option<f64>,
) -> Vec<f64> {
    let known = |corner: &Corner| match corner.z.is_nan() {
        true => height(place(corner.at)).unwrap_or(f64::NAN),
        false => corner.z,
    };
    let mut heights: Vec<f64> = plane.vertices().map(|v| known(v.data())).collect();
    for _ in 0..8 {
        let mut is_whole = true;
        for vertex in plane.vertices() {
            if !heights[vertex.fix().index()].is_nan() {
                continue;
            }
            let around = vertex.out_edges().map(|edge| {
                let far = edge.length_2().sqrt().max(0.01);
                (heights[edge.to().fix().index()], 1.0 / far)
            });
            let known = around.filter(|(z, _)| !z.is_nan());
            let (sum, weight) = known.fold((0.0, 0.0), |(s, w), (z, one)| (s + z * one, w + one));
            if weight > 0.0 {
                heights[vertex.fix().index()] = sum / weight;
            } else {
                is_whole = false;
            }
        }
        if is_whole {
            break;
        }
    }
    heights.into_iter().map(|z| if z.is_nan() { 0.0 } else { z }).collect()
}

/// The sides of outlines, by the integer rows of y that they cross.
pub(crate) struct Areas {
    rows: BTreeMap<i64, Vec<(DVec2, DVec2, Kind)>>,
    crosswalks: u32,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Hole,
    Sidewalk,
    Crossing(u32),
}

impl Areas {
    pub(crate) fn of(ground: &Outlines) -> Areas {
        let mut rows: BTreeMap<i64, Vec<_>> = BTreeMap::new();
        let holes = ground.holes.iter().map(|line| (line, Kind::Hole));
        let sidewalks = ground.sidewalks.iter().map(|line| (line, Kind::Sidewalk));
        let crossings =
            ground.crossings.iter().zip(0..).map(|(line, at)| (line, Kind::Crossing(at)));
        for (line, kind) in holes.chain(sidewalks).chain(crossings) {
            for (a, b) in sides(line) {
                let (low, high) = (a.y.min(b.y).floor() as i64, a.y.max(b.y).floor() as i64);
                for row in low..=high {
                    rows.entry(row).or_default().push((a.xy(), b.xy(), kind));
                }
            }
        }
        // The sides of one outline lie together, in the order of precedence.
        rows.values_mut().for_each(|row| row.sort_by_key(|(.., kind)| *kind));
        Areas { rows, crosswalks: ground.crosswalks as u32 }
    }

    /// Returns the kind of walkable ground at a point, if any, and the crossing; by winding numbers.
    pub(crate) fn at(&self, at: DVec2) -> Option<(Area, Option<u32>)> {
        let row = self.rows.get(&(at.y.floor() as i64))?;
        for sides in row.chunk_by(|(.., a), (.., b)| a == b) {
            let winding: i32 = sides.iter().map(|(a, b, _)| crossing(at, *a, *b)).sum();
            if winding <= 0 {
                continue;
            }
            return match sides[0].2 {
                Kind::Hole => None,
                Kind::Sidewalk => Some((Area::Sidewalk, None)),
                Kind::Crossing(index) if index < self.crosswalks => {
                    Some((Area::Crosswalk, Some(index)))
                }
                Kind::Crossing(index) => Some((Area::Road, Some(index))),
            };
        }
        None
    }
}
