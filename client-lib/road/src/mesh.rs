//! The road surface as triangles.
//!
//! Every section becomes a grid: lines along the road (borders of lanes, edges of markings) and
//! stations across it. A column between two lines is a strip of cells; a marking is a cell with
//! another face, so nothing lies on top of anything. Neighbouring columns share their vertices.
//! Where roads meet, short tongues reach below the other road and close what gap the file leaves.
//! Where roads overlap, everything that is not a lane for vehicles yields to those that are:
//! the overlap is asphalt on asphalt, and it does not matter which of them a ray finds.

mod columns;
mod cover;
mod floor;
mod paint;
mod rails;
mod spans;
mod stations;
mod strip;
mod sweep;

use crate::network::Network;
use crate::surface::Mesh;
use std::ops::Range;

/// Every road's surface, with stations at most `spacing_m` apart, nearer in bends.
///
/// Sidewalks and medians that the file leaves level are raised by a kerb of 12 cm. All faces are
/// of object 0.
pub fn surface_mesh(network: &Network, spacing_m: f64) -> Mesh {
    let spacing = if spacing_m.is_finite() { spacing_m.clamp(0.25, 20.0) } else { 5.0 };
    let mut mesh = Mesh::default();
    let mut of_roads: Vec<Range<usize>> = Vec::new();
    let blends = cover::Blend::of_junctions(network);
    for (index, road) in network.roads().iter().enumerate() {
        let first = mesh.triangles.len();
        let blend = road.junction.and_then(|junction| blends[junction as usize].as_ref());
        for section in 0..road.sections.len() {
            strip::section(network, index, section, spacing, blend, &mut mesh);
        }
        of_roads.push(first..mesh.triangles.len());
    }
    floor::junctions(network, &of_roads, &mut mesh);
    mesh
}

/// What stands on and over roads by the file's word: guard rails, walls and fences that go on
/// along them, tunnels with sides and roof, bridges with parapets and what carries them. All
/// faces are of object 0.
pub fn structure_mesh(network: &Network) -> Mesh {
    let mut sweep = sweep::Sweep::new(network);
    for span in network.spans() {
        spans::span(network, span, &mut sweep);
    }
    for object in network.objects() {
        rails::object(object, &mut sweep);
    }
    sweep.into_mesh()
}
