//! A cache of the triangle under a point: a wheel rolls on one triangle for many substeps.
//!
//! Each cell is divided into parts. A triangle is *topmost* in a part if no other triangle of the
//! cell can be found at its height or above it by a point well inside it. A query from a point well
//! inside such a triangle and above it needs no search, and returns the bits that a search would:
//! the cache is no part of the state.

use std::sync::{
    OnceLock,
    atomic::{AtomicU32, Ordering},
};

use glam::{DVec2, Vec2};

use super::{
    cell::{CELL_M, CellPoint},
    grid::{EMPTY, Grid},
    triangle::{Hit, SEAM_M, Triangle},
};

/// A point at least this far from each edge lies well inside a triangle.
const WITHIN_M: f32 = 5e-3;
/// Bound on the error of the grid's f32 numbers, out to [`EXTENT_MAX_M`].
const ERROR_M: f64 = 1e-3;
const EXTENT_MAX_M: f64 = 4000.0;
/// Parts along the edge of a cell, and steps of a [`CellPoint`] in each.
const PARTS: u32 = 4;
const PART_STEPS: u8 = 32;

/// For each entry of the cells' lists, two bits for each part of the cell: whether it is known if
/// the triangle is topmost there, and whether it is. Filled on the first query; chunks of entries
/// without a query take no memory.
pub(super) struct TopmostCache(Vec<OnceLock<Box<[AtomicU32; CHUNK]>>>);

/// Entries of a chunk.
const CHUNK: usize = 1024;

/// The triangle that the previous query found, which is topmost in a part of a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CachedTriangle {
    triangle: Triangle,
    entry: u32,
    cell: [u32; 2],
    part: u32,
}

impl TopmostCache {
    /// Creates a cache for this many entries, none of which is known.
    pub(super) fn unknown(entries: usize) -> TopmostCache {
        TopmostCache((0..entries.div_ceil(CHUNK)).map(|_| OnceLock::new()).collect())
    }

    /// Returns the hit on the cached triangle, or `None` if a search is needed.
    #[inline]
    pub(super) fn hit(
        &self,
        grid: &Grid,
        at: &CellPoint,
        point: Vec2,
        z_from: f32,
        cached: &mut Option<CachedTriangle>,
    ) -> Option<Hit> {
        if let Some(cached) = cached
            && cached.cell == at.cell
        {
            let from_a = point - cached.triangle.a.truncate();
            let height_m = cached.triangle.height(from_a);
            let part = part_of(at);
            if cached.triangle.inside(from_a) >= WITHIN_M
                && height_m <= z_from
                && (cached.part == part
                    || self.is_topmost(grid, cached.entry as usize, at.cell, part))
            {
                cached.part = part;
                return Some(cached.triangle.hit(height_m));
            }
        }
        None
    }

    /// Searches the grid and caches the triangle that it finds; `None` if there is no ground.
    pub(super) fn search(
        &self,
        grid: &Grid,
        at: &CellPoint,
        point: Vec2,
        z_from: f32,
        cached: &mut Option<CachedTriangle>,
    ) -> Option<Hit> {
        *cached = None;
        let (height_m, entry) = grid.find(at, point, z_from);
        if entry == EMPTY {
            return None;
        }
        let triangle = &grid.triangles[grid.lists[entry as usize] as usize];
        let (cell, part) = (at.cell, part_of(at));
        if self.is_topmost(grid, entry as usize, cell, part) {
            *cached = Some(CachedTriangle { triangle: *triangle, entry, cell, part });
        }
        Some(triangle.hit(height_m))
    }

    fn is_topmost(&self, grid: &Grid, entry: usize, cell: [u32; 2], part: u32) -> bool {
        let (is_known, is_topmost) = (1 << (2 * part), 2 << (2 * part));
        let chunk =
            self.0[entry / CHUNK].get_or_init(|| Box::new([const { AtomicU32::new(0) }; CHUNK]));
        let known = &chunk[entry % CHUNK];
        let bits = known.load(Ordering::Relaxed);
        if bits & is_known != 0 {
            return bits & is_topmost != 0;
        }
        let result = is_topmost_in(grid, entry, cell, part);
        let bits = if result { is_known | is_topmost } else { is_known };
        known.fetch_or(bits, Ordering::Relaxed);
        result
    }
}

fn is_topmost_in(grid: &Grid, entry: usize, cell: [u32; 2], part: u32) -> bool {
    let triangle = |at: usize| &grid.triangles[grid.lists[at] as usize];
    let top = triangle(entry);
    let part = [part % PARTS, part / PARTS];
    let edge = f64::from(CELL_M) / f64::from(PARTS);
    let low = |k: usize| f64::from(cell[k] * PARTS + part[k]) * edge - 5.0 * ERROR_M;
    let low = DVec2::new(low(0), low(1)) + (grid.origin.as_dvec2() - top.a.as_dvec3().truncate());
    let part_of_top = PartOfTop::new(top, low, low + edge + 10.0 * ERROR_M);
    let first = part.map(|part| part as u8 * PART_STEPS);
    let last = first.map(|first| first + PART_STEPS - 1);
    let mut others = grid.range(cell).filter(|at| *at != entry);
    others.all(|at| {
        if !grid.bounds[at].overlaps(first, last) {
            return true;
        }
        let other = triangle(at);
        // Of two level triangles at one height, a search finds the one that is listed first.
        let is_level = |t: &Triangle| t.gradient == Vec2::ZERO && t.a.z == top.a.z;
        (at > entry && is_level(top) && is_level(other)) || !part_of_top.may_be_hidden_by(other)
    })
}

/// Returns the part of a cell in which a point lies; parts are numbered by rows.
#[inline]
fn part_of(at: &CellPoint) -> u32 {
    let [x, y] = at.step.map(|step| u32::from(step / PART_STEPS));
    y * PARTS + x
}

/// The half plane `normal · p >= from`.
type Side = (DVec2, f64);

/// The intersection of the inner part of a triangle and a square, relative to the triangle's first
/// corner.
struct PartOfTop<'a> {
    top: &'a Triangle,
    shrunk: [Side; 3],
    shrunk_at: Option<[DVec2; 3]>,
    square: [Side; 4],
    square_at: [DVec2; 4],
}

impl PartOfTop<'_> {
    fn new(top: &Triangle, low: DVec2, high: DVec2) -> PartOfTop<'_> {
        let shrunk = sides(top, DVec2::ZERO, f64::from(WITHIN_M) - ERROR_M);
        let square =
            [(DVec2::X, low.x), (DVec2::Y, low.y), (-DVec2::X, -high.x), (-DVec2::Y, -high.y)];
        let square_at = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
        PartOfTop { top, shrunk_at: corners(&shrunk), shrunk, square, square_at }
    }

    /// Whether a point of this region may also lie on another triangle that is no lower there.
    fn may_be_hidden_by(&self, other: &Triangle) -> bool {
        let PartOfTop { top, shrunk, shrunk_at, square, square_at } = self;
        let Some(shrunk_at) = shrunk_at else { return true };
        let shift = other.a.as_dvec3() - top.a.as_dvec3();
        let grown = sides(other, shift.truncate(), -f64::from(SEAM_M) - ERROR_M);
        if are_apart(&grown, square_at) || are_apart(&grown, shrunk_at) {
            return false;
        }
        let Some(grown_at) = corners(&grown) else { return true };
        if are_apart(square, &grown_at) || are_apart(shrunk, &grown_at) {
            return false;
        }
        // In the overlap, the other is no higher than its highest point in each of the three.
        let slope = other.gradient.as_dvec2() - top.gradient.as_dvec2();
        let rise = shift.z - other.gradient.as_dvec2().dot(shift.truncate());
        let highest = |corners: &[DVec2]| {
            corners.iter().map(|at| rise + slope.dot(*at)).fold(f64::NEG_INFINITY, f64::max)
        };
        highest(shrunk_at).min(highest(&grown_at)).min(highest(square_at)) > -ERROR_M
    }
}

/// Whether one side separates all of these corners.
fn are_apart(sides: &[Side], corners: &[DVec2]) -> bool {
    sides.iter().any(|(normal, from)| corners.iter().all(|at| normal.dot(*at) < *from))
}

/// Returns the edges of a triangle with its first corner at `a`, moved inwards.
fn sides(triangle: &Triangle, a: DVec2, inwards_m: f64) -> [Side; 3] {
    let side = |normal: Vec2, offset: f32| {
        let normal = normal.as_dvec2();
        (normal, normal.dot(a) - f64::from(offset) + inwards_m)
    };
    [
        side(triangle.edge_ab, 0.0),
        side(triangle.edge_bc, triangle.offset_bc),
        side(triangle.edge_ca, 0.0),
    ]
}

/// Returns the intersections of neighbouring edges, or `None` if two are nearly parallel or an
/// intersection is farther away than [`EXTENT_MAX_M`].
fn corners(sides: &[Side; 3]) -> Option<[DVec2; 3]> {
    let mut found = [DVec2::ZERO; 3];
    for (index, corner) in found.iter_mut().enumerate() {
        let ((n, c), (m, d)) = (sides[index], sides[(index + 1) % 3]);
        let sine = n.perp_dot(m);
        if sine.abs() < 1e-4 {
            return None;
        }
        *corner = DVec2::new(c * m.y - d * n.y, d * n.x - c * m.x) / sine;
        let extent_m = corner.abs().max_element();
        if extent_m.is_nan() || extent_m > EXTENT_MAX_M {
            return None;
        }
    }
    Some(found)
}
