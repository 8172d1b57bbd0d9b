//! The floor of a junction: a surface just below its lanes that closes the gaps between them.

mod fringe;
mod raster;

use std::ops::Range;

use mesh::Mesh;

use crate::{
    junction::{Junction, JunctionKind},
    network::Network,
    parallel,
};
use fringe::Fringe;
use raster::Floor;

/// Returns the floors of all junctions with roads inside. `of_roads` gives the triangles of each
/// road in `mesh`.
pub(super) fn junctions(
    network: &Network,
    of_roads: &[Range<usize>],
    mesh: &Mesh,
    threads: usize,
) -> Vec<Mesh> {
    let junctions = network.junctions();
    // Some junctions have ten times as many triangles as others.
    let share = (junctions.len() / (threads * 8)).max(JUNCTIONS_MIN);
    let parts: Vec<_> = junctions.chunks(share).collect();
    let lay = |part: &&[Junction]| {
        let mut floors = Mesh::default();
        part.iter().for_each(|junction| lay(junction, of_roads, mesh, &mut floors));
        floors
    };
    parallel::share(&parts, threads, "road-floor", lay)
}

/// Fewest junctions in one part of the work.
const JUNCTIONS_MIN: usize = 4;

fn lay(junction: &Junction, of_roads: &[Range<usize>], mesh: &Mesh, floors: &mut Mesh) {
    if junction.kind != JunctionKind::Common || junction.roads.is_empty() {
        return;
    }
    let mut roads = junction.roads.clone();
    roads.extend(junction.connections.iter().map(|connection| connection.incoming));
    roads.sort_unstable();
    roads.dedup();
    let inside = junction.roads.iter().map(|road| of_roads[*road as usize].clone());
    let Some(mut floor) = Floor::round(mesh, inside) else { return };
    for &road in &roads {
        for triangle in of_roads[road as usize].clone() {
            floor.cover(mesh, triangle);
        }
    }
    floor.enclose();
    floor.smooth();
    floor.sink();
    floor.lay(floors);
    let mut fringe = Fringe::of(&floor);
    if !fringe.cells.is_empty() {
        for road in roads {
            for triangle in of_roads[road as usize].clone() {
                fringe.cover(mesh, triangle);
            }
        }
        fringe.lay(floors);
    }
}
