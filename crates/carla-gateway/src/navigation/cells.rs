//! Walkable ground as a triangulation with neighbours.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3Swizzles};
use spade::{
    ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation,
    handles::FixedVertexHandle,
};

use super::{
    area::Area,
    cut::cut,
    outline::{Loop, crossing, sides},
};

/// The outlines that define walkable ground.
#[derive(Default)]
pub(super) struct Ground {
    pub(super) sidewalks: Vec<Loop>,
    pub(super) crosswalks: Vec<Loop>,
    /// Obstacles.
    pub(super) holes: Vec<Loop>,
}

/// Vertices and triangles, counter-clockwise from above.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<Cell>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) corners: [u32; 3],
    /// By corner: the triangle beyond the side that begins there.
    pub(super) neighbours: [Option<u32>; 3],
    pub(super) area: Area,
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
    pub(super) fn of(ground: &Ground, height: impl Fn(DVec2) -> Option<f64>) -> Cells {
        let mut plane = ConstrainedDelaunayTriangulation::<Corner>::new();
        let mut known = BTreeMap::new();
        let outlines = ground.sidewalks.iter().chain(&ground.crosswalks).chain(&ground.holes);
        for line in cut(&outlines.flat_map(|line| sides(line)).collect::<Vec<_>>()) {
            let corners: Vec<_> =
                line.iter().filter_map(|at| corner(&mut plane, &mut known, *at)).collect();
            for pair in corners.windows(2).filter(|pair| pair[0] != pair[1]) {
                // A line that still crosses another one within the merging distance is skipped.
                let _ = plane.try_add_constraint(pair[0], pair[1]);
            }
        }
        let heights = heights(&plane, height);
        let areas = Areas::of(ground);
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
            cells.triangles.push(Cell { corners, neighbours, area: *area });
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
pub(super) struct Areas {
    rows: BTreeMap<i64, Vec<(DVec2, DVec2, Kind)>>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Sidewalk,
    Crosswalk,
    Hole,
}

impl Areas {
    pub(super) fn of(ground: &Ground) -> Areas {
        let mut rows: BTreeMap<i64, Vec<_>> = BTreeMap::new();
        for (lines, kind) in [
            (&ground.sidewalks, Kind::Sidewalk),
            (&ground.crosswalks, Kind::Crosswalk),
            (&ground.holes, Kind::Hole),
        ] {
            for (a, b) in lines.iter().flat_map(|line| sides(line)) {
                let (low, high) = (a.y.min(b.y).floor() as i64, a.y.max(b.y).floor() as i64);
                for row in low..=high {
                    rows.entry(row).or_default().push((a.xy(), b.xy(), kind));
                }
            }
        }
        Areas { rows }
    }

    /// Returns the kind of walkable ground at a point, if any, by winding numbers.
    pub(super) fn at(&self, at: DVec2) -> Option<Area> {
        let row = self.rows.get(&(at.y.floor() as i64))?;
        let mut windings = [0; 3];
        for (a, b, kind) in row {
            windings[*kind as usize] += crossing(at, *a, *b);
        }
        match windings {
            [_, _, hole] if hole > 0 => None,
            [sidewalk, ..] if sidewalk > 0 => Some(Area::Sidewalk),
            [_, crosswalk, _] if crosswalk > 0 => Some(Area::Crosswalk),
            _ => None,
        }
    }
}
