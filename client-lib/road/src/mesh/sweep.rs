//! Solid bodies swept along a road.

use super::cover::Cover;
use crate::network::Network;
use crate::surface::{Face, Mesh};
use glam::DVec3;

/// A broken file may ask for any number; more stations than this are not built.
const STATIONS_MAX: usize = 200_000;

/// Collects bodies.
pub(super) struct Sweep<'a> {
    network: &'a Network,
    mesh: Mesh,
    stations: usize,
}

/// A cross-section through a body: corners in a loop that, looked at along the way, begins at the
/// left on top and goes on to the right; and the loops' quadrilaterals that close its ends, as
/// they are seen from behind.
pub(super) struct Outline<const N: usize, const C: usize> {
    pub(super) caps: [[usize; 4]; C],
}

/// A plain box: left top, right top, right bottom, left bottom.
pub(super) const BOX: Outline<4, 1> = Outline { caps: [[3, 2, 1, 0]] };

/// A gate: the outer left and right top, the outer and inner right foot, the inner right and left
/// top, the inner and outer left foot.
pub(super) const GATE: Outline<8, 3> = Outline { caps: [[7, 6, 5, 0], [5, 4, 1, 0], [3, 2, 1, 4]] };

impl<'a> Sweep<'a> {
    pub(super) fn new(network: &'a Network) -> Sweep<'a> {
        Sweep { network, mesh: Mesh::default(), stations: 0 }
    }

    pub(super) fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// Whether there is room for so many stations more.
    pub(super) fn admits(&mut self, stations: usize) -> bool {
        self.stations += stations;
        self.stations <= STATIONS_MAX
    }

    /// A body through these cross-sections, but not where `point` of it would stand on a paved
    /// lane of another road than `road`.
    pub(super) fn body<const N: usize, const C: usize>(
        &mut self,
        outline: &Outline<N, C>,
        rows: &[[DVec3; N]],
        road: u32,
        face: Face,
        foot: impl Fn(&[DVec3; N]) -> DVec3,
    ) {
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
    }

    /// A box on end, about `middle` of its foot.
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

    fn quad(&mut self, corners: [DVec3; 4], face: Face) {
        self.mesh.quad(corners.map(|corner| corner.as_vec3().to_array()), face);
    }
}
