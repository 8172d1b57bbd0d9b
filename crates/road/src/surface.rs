//! The road surface as triangles.
//!
//! Every section becomes a grid: lines along the road (borders of lanes, edges of markings) and
//! stations across it. A column between two lines is a strip of cells. A marking is a cell with
//! another face, so no two faces are coplanar. Neighbouring columns share their vertices. Where
//! roads meet, short tongues reach below the other road and close the gaps that the file leaves;
//! where they lie side by side with a narrow gap, seams do. Where roads overlap, everything that is
//! not a lane for vehicles yields to those that are: the overlap is asphalt on asphalt, and it does
//! not matter which of the two a ray hits.

mod bodies;
mod columns;
mod cover;
mod faces;
mod floor;
mod object_paint;
mod paint;
mod polygon;
mod rails;
mod seam;
mod spans;
mod stations;
mod strip;
mod sweep;

use std::ops::Range;

use mesh::Mesh;

use crate::{blend::Blend, network::Network, parallel, structure::Structure};

/// Returns the surface of all roads, with stations at most `spacing_m` apart, closer in bends.
///
/// Sidewalks and medians that the file leaves level are raised by a kerb of 12 cm. All faces are of
/// object 0.
pub fn surface_mesh(network: &Network, spacing_m: f64) -> Mesh {
    surface(network, spacing_m, parallel::threads())
}

/// Builds the mesh on up to `threads` threads; the result does not depend on their number.
pub(crate) fn surface(network: &Network, spacing_m: f64, threads: usize) -> Mesh {
    let spacing = if spacing_m.is_finite() { spacing_m.clamp(0.25, 20.0) } else { 5.0 };
    let blends = Blend::of_junctions(network);
    let pave = |part: &Range<usize>| {
        let (mut mesh, mut ends) = (Mesh::default(), Vec::with_capacity(part.len()));
        let mut rims = Vec::new();
        for (road, index) in network.roads()[part.clone()].iter().zip(part.clone()) {
            let blend = road.junction.and_then(|junction| blends[junction as usize].as_ref());
            for section in 0..road.sections.len() {
                strip::section(network, index, section, spacing, blend, &mut mesh, &mut rims);
            }
            ends.push(mesh.triangles.len());
        }
        (mesh, ends, rims)
    };
    let parts = threads.min(network.lanes().len() / LANES_MIN).max(1);
    let mut mesh = Mesh::default();
    let mut of_roads: Vec<Range<usize>> = Vec::new();
    let mut rims = Vec::new();
    for (part, ends, of_part) in parallel::each(&network.road_ranges(parts), "road-pave", pave) {
        let base = mesh.triangles.len();
        for end in ends {
            let first = of_roads.last().map_or(0, |last| last.end);
            of_roads.push(first..base + end);
        }
        mesh.add(part);
        rims.extend(of_part);
    }
    let seams = seam::seams(network, &rims, threads);
    for floors in floor::junctions(network, &of_roads, &mesh, threads) {
        mesh.add(floors);
    }
    for seams in seams {
        mesh.add(seams);
    }
    mesh
}

/// Fewest lanes for each thread.
const LANES_MIN: usize = 100;

/// Returns the structures that the file describes on and over roads: guard rails, walls and fences
/// along them, tunnels with sides and roof, bridges with parapets and piers, and objects with an
/// outline and a height.
pub fn structures(network: &Network) -> Vec<Structure> {
    let mut sweep = sweep::Sweep::new(network);
    for span in network.spans() {
        spans::span(network, span, &mut sweep);
    }
    for object in network.objects() {
        rails::object(object, &mut sweep);
        bodies::object(object, &mut sweep);
    }
    sweep.into_structures()
}

/// Returns the paint of objects on the ground: their markings, the stripes of crosswalks. Heights
/// are those of the file; the caller has to drape the mesh over the ground. All faces are of object
/// 0.
pub fn object_paint(network: &Network) -> Mesh {
    object_paint::paint(network)
}
