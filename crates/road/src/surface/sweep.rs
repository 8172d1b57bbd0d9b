//! Solid bodies swept along a road.

use glam::DVec3;
use mesh::{Face, Mesh, Tag};

use super::cover::Cover;
use crate::{
    network::Network,
    structure::{Solid, Structure},
};

/// Most stations; a broken file may ask for any number.
const STATIONS_MAX: usize = 200_000;

/// Largest length of solid boxes, their distance from the path that they follow, and their climb,
/// metres.
const SOLID_M: f64 = 16.0;
const BEND_M: f64 = 0.04;
const CLIMB_M: f64 = 0.15;
/// Cross-sections of one structure: what continues along a road is cut into structures of this
/// size, so that each has a bounding box that locates it.
const STATIONS_PER_STRUCTURE: usize = 26;

/// Returns where structures begin and end among this many cross-sections; neighbours share the one
/// at their ends.
pub(super) fn structure_ranges(count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    (0..count.saturating_sub(1))
        .step_by(STATIONS_PER_STRUCTURE - 1)
        .map(move |at| at..(at + STATIONS_PER_STRUCTURE).min(count))
}

/// Collects bodies.
pub(super) struct Sweep<'a> {
    network: &'a Network,
    structures: Vec<Structure>,
    stations: usize,
}

/// A cross-section of a body: corners in a loop that, seen along the path, begins at the top left
/// and proceeds to the right; and the loop's quadrilaterals that close its ends, as seen from
/// behind.
pub(super) struct Outline<const N: usize, const C: usize> {
    pub(super) caps: [[usize; 4]; C],
}

/// A plain box: top left, top right, bottom right, bottom left.
pub(super) const BOX: Outline<4, 1> = Outline { caps: [[3, 2, 1, 0]] };

/// A gate: the outer left and right top, the outer and inner right foot, the inner right and left
/// top, the inner and outer left foot.
pub(super) const GATE: Outline<8, 3> = Outline { caps: [[7, 6, 5, 0], [5, 4, 1, 0], [3, 2, 1, 4]] };

impl<'a> Sweep<'a> {
    pub(super) fn new(network: &'a Network) -> Sweep<'a> {
        Sweep { network, structures: Vec::new(), stations: 0 }
    }

    pub(super) fn into_structures(mut self) -> Vec<Structure> {
        self.structures.retain(|one| !one.mesh.triangles.is_empty());
        self.structures
    }

    /// Begins a new structure.
    pub(super) fn begin(&mut self, tag: Tag, is_ground: bool) {
        let (mesh, solids) = (Mesh::default(), Vec::new());
        self.structures.push(Structure { tag, is_ground, mesh, solids });
    }

    /// Returns whether this many more stations may be built.
    pub(super) fn admits(&mut self, stations: usize) -> bool {
        self.stations += stations;
        self.stations <= STATIONS_MAX
    }

    /// Adds a body through these cross-sections, except where the `foot` of one would stand on a
    /// paved lane of another road than `road`. Returns which of them are free.
    pub(super) fn body<const N: usize, const C: usize>(
        &mut self,
        outline: &Outline<N, C>,
        rows: &[[DVec3; N]],
        road: u32,
        face: Face,
        foot: impl Fn(&[DVec3; N]) -> DVec3,
    ) -> Vec<bool> {
        let cover = Cover::new(self.network, road);
        let free: Vec<bool> = rows.iter().map(|row| !cover.paved(foot(row))).collect();
        for (at, pair) in rows.windows(2).enumerate() {
            if !(free[at] && free[at + 1]) {
                continue;
            }
            let [from, to] = [&pair[0], &pair[1]];
            for corner in 0..N {
                let next = (corner + 1) % N;
                self.quad([from[corner], from[next], to[next], to[corner]], face);
            }
            let begins = at == 0 || !free[at - 1];
            let ends = at + 2 == rows.len() || !free[at + 2];
            for cap in outline.caps {
                if begins {
                    self.quad(cap.map(|corner| from[corner]), face);
                }
                if ends {
                    let [a, b, c, d] = cap.map(|corner| to[corner]);
                    self.quad([d, c, b, a], face);
                }
            }
        }
        free
    }

    /// Makes the volume between these cross-sections of a box solid, and `below_m` below it, where
    /// they are free: in boxes as long as the path is straight.
    pub(super) fn solid(&mut self, rows: &[[DVec3; 4]], free: &[bool], below_m: f64) {
        let middle = |at: usize| rows[at].iter().sum::<DVec3>() / 4.0;
        let straight = |from: usize, to: usize| {
            let (a, b) = (middle(from), middle(to));
            let way = (b - a).normalize_or_zero();
            a.distance(b) < SOLID_M
                && (from + 1..to).all(|at| (middle(at) - a).cross(way).length() < BEND_M)
                && (b.z - a.z).abs() < CLIMB_M
        };
        let mut from = 0;
        while from + 1 < rows.len() {
            if !(free[from] && free[from + 1]) {
                from += 1;
                continue;
            }
            let mut to = from + 1;
            while to + 1 < rows.len() && free[to + 1] && straight(from, to + 1) {
                to += 1;
            }
            self.add_solid(&rows[from], &rows[to], below_m);
            from = to;
        }
    }

    fn add_solid(&mut self, from: &[DVec3; 4], to: &[DVec3; 4], below_m: f64) {
        let [a, b] = [from, to].map(|row| row.iter().sum::<DVec3>() / 4.0);
        let along = (b - a).truncate();
        let left = along.normalize_or_zero().perp().extend(0.0);
        let across = |row: &[DVec3; 4], middle: DVec3| {
            row.iter().map(|corner| left.dot(*corner - middle).abs()).fold(0.0, f64::max)
        };
        let all = || from.iter().chain(to);
        let low = all().map(|corner| corner.z).fold(f64::INFINITY, f64::min) - below_m;
        let high = all().map(|corner| corner.z).fold(f64::NEG_INFINITY, f64::max);
        let half_y = across(from, a).max(across(to, b));
        if along.length() < 1e-3 || high <= low {
            return;
        }
        let Some(structure) = self.structures.last_mut() else { return };
        structure.solids.push(Solid {
            center: a.midpoint(b).truncate().extend(0.5 * (low + high)),
            // A little longer than its share, so that boxes in a bend leave no gap.
            half_extents_m: DVec3::new(0.5 * along.length() + half_y, half_y, 0.5 * (high - low)),
            yaw_rad: along.to_angle(),
        });
    }

    /// Adds an upright box about `middle` of its foot.
    pub(super) fn post(&mut self, middle: DVec3, half_m: f64, height_m: f64, face: Face) {
        let corner = |x: f64, y: f64, up: f64| middle + DVec3::new(x * half_m, y * half_m, up);
        let row = |x: f64| {
            let [top, foot] = [height_m, 0.0];
            [corner(x, 1.0, top), corner(x, -1.0, top), corner(x, -1.0, foot), corner(x, 1.0, foot)]
        };
        let [from, to] = [row(-1.0), row(1.0)];
        for at in 0..4 {
            let next = (at + 1) % 4;
            self.quad([from[at], from[next], to[next], to[at]], face);
        }
        self.quad(BOX.caps[0].map(|at| from[at]), face);
        let [a, b, c, d] = BOX.caps[0].map(|at| to[at]);
        self.quad([d, c, b, a], face);
    }

    /// Adds a mesh to the newest structure.
    pub(super) fn add(&mut self, mesh: &Mesh) {
        if let Some(structure) = self.structures.last_mut() {
            structure.mesh.append(mesh);
        }
    }

    /// Adds a solid box to the newest structure.
    pub(super) fn add_box(&mut self, solid: Solid) {
        if let Some(structure) = self.structures.last_mut() {
            structure.solids.push(solid);
        }
    }

    /// Returns whether a point lies on a paved lane of any road, including `road`.
    pub(super) fn is_paved(&self, road: u32, point: DVec3) -> bool {
        let other = if road == 0 { 1 } else { 0 };
        Cover::new(self.network, road).paved(point) || Cover::new(self.network, other).paved(point)
    }

    fn quad(&mut self, corners: [DVec3; 4], face: Face) {
        if let Some(structure) = self.structures.last_mut() {
            structure.mesh.quad(corners.map(|corner| corner.as_vec3().to_array()), face);
        }
    }
}
