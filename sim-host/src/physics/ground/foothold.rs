//! The ground under who asked nearby before: a wheel rolls many substeps on one triangle.
//!
//! Cells are cut into parts. A triangle is *on top* in a part if of the cell's others none can be
//! found there at its height or above it, by a point that lies well within it. Whoever lies well
//! within such a triangle, and asks from above it, needs no search, and hears what a search would
//! say, to the bit: what is remembered is no state.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DVec2, Vec2};

use super::seat::Seat;
use super::{CELL_M, EMPTY, Ground, Hit, SEAM_M, Triangle};

/// So far within its edges a point lies well within a triangle.
const WITHIN_M: f32 = 5e-3;
/// What the grid's numbers, kept in f32, may be off; beyond [`EXTENT_MAX_M`] more.
const OFF_M: f64 = 1e-3;
const EXTENT_MAX_M: f64 = 4000.0;
/// Parts along the edge of a cell, and a seat's steps in each.
const PARTS: u32 = 4;
const PART_STEPS: u8 = 32;

/// Of each entry of the cells' lists, two bits for each part of its cell: whether it is known if
/// the triangle is on top there, and whether it is. Found out when somebody stands there.
#[derive(Default)]
pub(super) struct Tops(Vec<AtomicU32>);

impl Tops {
    pub(super) fn unknown(entries: usize) -> Tops {
        Tops((0..entries).map(|_| AtomicU32::new(0)).collect())
    }
}

/// Where somebody stood, and the triangle that is on top there.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics) struct Foothold {
    triangle: Triangle,
    entry: u32,
    cell: [u32; 2],
    part: u32,
}

impl Ground {
    /// What [`Ground::below`] says, sooner where `hold` still holds.
    #[inline]
    pub(in crate::physics) fn below_again(
        &self,
        x: f32,
        y: f32,
        z_from: f32,
        hold: &mut Option<Foothold>,
    ) -> Hit {
        let point = Vec2::new(x, y);
        let Some(seat) = Seat::of(self.origin, point) else { return self.floor() };
        if let Some(hold) = hold
            && hold.cell == seat.cell
        {
            let from_a = point - hold.triangle.a.truncate();
            let height_m = hold.triangle.height(from_a);
            let part = part_of(&seat);
            if hold.triangle.inside(from_a) >= WITHIN_M
                && height_m <= z_from
                && (hold.part == part || self.is_on_top(hold.entry as usize, seat.cell, part))
            {
                hold.part = part;
                return hold.triangle.hit(height_m);
            }
        }
        self.search(point, &seat, z_from, hold)
    }

    fn search(&self, point: Vec2, seat: &Seat, z_from: f32, hold: &mut Option<Foothold>) -> Hit {
        *hold = None;
        let (height_m, entry) = self.find(seat, point, z_from);
        if entry == EMPTY {
            return self.floor();
        }
        let triangle = &self.triangles[self.lists[entry as usize] as usize];
        let (cell, part) = (seat.cell, part_of(seat));
        if self.is_on_top(entry as usize, cell, part) {
            *hold = Some(Foothold { triangle: *triangle, entry, cell, part });
        }
        triangle.hit(height_m)
    }

    fn is_on_top(&self, entry: usize, cell: [u32; 2], part: u32) -> bool {
        let (is_known, is_on_top) = (1 << (2 * part), 2 << (2 * part));
        let bits = self.tops.0[entry].load(Ordering::Relaxed);
        if bits & is_known != 0 {
            return bits & is_on_top != 0;
        }
        let told = self.looks_on_top(entry, cell, part);
        let bits = if told { is_known | is_on_top } else { is_known };
        self.tops.0[entry].fetch_or(bits, Ordering::Relaxed);
        told
    }

    fn looks_on_top(&self, entry: usize, cell: [u32; 2], part: u32) -> bool {
        let triangle = |at: usize| &self.triangles[self.lists[at] as usize];
        let top = triangle(entry);
        let part = [part % PARTS, part / PARTS];
        let edge = f64::from(CELL_M) / f64::from(PARTS);
        let low = |k: usize| f64::from(cell[k] * PARTS + part[k]) * edge - 5.0 * OFF_M;
        let low =
            DVec2::new(low(0), low(1)) + (self.origin.as_dvec2() - top.a.as_dvec3().truncate());
        let part_of_top = PartOfTop::new(top, low, low + edge + 10.0 * OFF_M);
        let first = part.map(|part| part as u8 * PART_STEPS);
        let last = first.map(|first| first + PART_STEPS - 1);
        let mut others = self.range(cell).filter(|at| *at != entry);
        others.all(|at| {
            if !self.reaches[at].meets(first, last) {
                return true;
            }
            let other = triangle(at);
            // Of two that are level alike, a search finds the one that is listed first.
            let is_level = |t: &Triangle| t.gradient == Vec2::ZERO && t.a.z == top.a.z;
            (at > entry && is_level(top) && is_level(other)) || !part_of_top.may_be_hidden_by(other)
        })
    }
}

/// Rows of parts.
#[inline]
fn part_of(seat: &Seat) -> u32 {
    let [x, y] = seat.step.map(|step| u32::from(step / PART_STEPS));
    y * PARTS + x
}

/// The half plane `normal · p >= from`.
type Side = (DVec2, f64);

/// What lies well within a triangle and in an upright square, from the triangle's first corner.
struct PartOfTop<'a> {
    top: &'a Triangle,
    shrunk: [Side; 3],
    shrunk_at: Option<[DVec2; 3]>,
    square: [Side; 4],
    square_at: [DVec2; 4],
}

impl PartOfTop<'_> {
    fn new(top: &Triangle, low: DVec2, high: DVec2) -> PartOfTop<'_> {
        let shrunk = sides(top, DVec2::ZERO, f64::from(WITHIN_M) - OFF_M);
        let square =
            [(DVec2::X, low.x), (DVec2::Y, low.y), (-DVec2::X, -high.x), (-DVec2::Y, -high.y)];
        let square_at = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
        PartOfTop { top, shrunk_at: corners(&shrunk), shrunk, square, square_at }
    }

    /// Whether a point there may be on the other as well, and that one no lower.
    fn may_be_hidden_by(&self, other: &Triangle) -> bool {
        let PartOfTop { top, shrunk, shrunk_at, square, square_at } = self;
        let Some(shrunk_at) = shrunk_at else { return true };
        let shift = other.a.as_dvec3() - top.a.as_dvec3();
        let grown = sides(other, shift.truncate(), -f64::from(SEAM_M) - OFF_M);
        if are_apart(&grown, square_at) || are_apart(&grown, shrunk_at) {
            return false;
        }
        let Some(grown_at) = corners(&grown) else { return true };
        if are_apart(square, &grown_at) || are_apart(shrunk, &grown_at) {
            return false;
        }
        // Where they overlap, the other is nowhere higher than anywhere in each of the three.
        let slope = other.gradient.as_dvec2() - top.gradient.as_dvec2();
        let rise = shift.z - other.gradient.as_dvec2().dot(shift.truncate());
        let highest = |corners: &[DVec2]| {
            corners.iter().map(|at| rise + slope.dot(*at)).fold(f64::NEG_INFINITY, f64::max)
        };
        highest(shrunk_at).min(highest(&grown_at)).min(highest(square_at)) > -OFF_M
    }
}

/// Whether all corners of one lie beyond one side of the other.
fn are_apart(sides: &[Side], corners: &[DVec2]) -> bool {
    sides.iter().any(|(normal, from)| corners.iter().all(|at| normal.dot(*at) < *from))
}

/// The edges, moved inwards.
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

/// Where the edges cross; nothing if two are all but parallel, or it is far away.
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
