//! A city grid of avenues and streets.

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    lattice::{Bend, Lattice, Place, lattice},
    layout::Layout,
    layouts::style::Blocks,
    plan::Plan,
    relief::Ground,
    street::{Control, Node, Profile, Street, links_at},
};

pub(super) const AVENUE: Profile = Profile::town(2, 3.5, 4.0, 50.0);
pub(super) const STREET: Profile = Profile::town(1, 3.5, 3.0, 40.0);
pub(super) const PARKED: Profile = STREET.parked([2.3; 2], 30.0);

/// Draws a city grid.
pub(crate) fn layout(plan: &Plan, blocks: Blocks) -> Layout {
    let size = plan.size_m.clamp(250.0, 3000.0);
    let mut random = RandomStream::named(plan.seed, 0x61d);
    let (nodes, streets, _) = streets(&mut random, dvec2(size, size), DVec2::ZERO, blocks);
    let ground = Ground::new(plan, size, &nodes, &streets);
    Layout { nodes, streets, ground }
}

/// Returns the nodes and streets of a grid, and the grid itself.
pub(super) fn streets(
    random: &mut RandomStream,
    extent: DVec2,
    center: DVec2,
    blocks: Blocks,
) -> (Vec<Node>, Vec<Street>, Lattice) {
    let tees = blocks == Blocks::Tees;
    let bend = Bend {
        extent,
        center,
        block: if blocks == Blocks::Mixed { 105.0 } else { 125.0 },
        jitter: 5.0,
        sway: extent.max_element() * if blocks == Blocks::Mixed { 0.05 } else { 0.0 },
        swirl: 0.0,
        bows: if blocks == Blocks::Broad { (0.0, 0.0, 0.0) } else { (0.28, 0.07, 0.14) },
        thinned: if tees { 0 } else { 7 },
    };
    let mut ring = None;
    let mut grid = lattice(random, &bend, |random, place: Place| {
        let ring = *ring.get_or_insert_with(|| random.chance(0.5));
        let avenue = place.is_middle() || (place.across && ring && place.line == 0);
        if blocks == Blocks::Broad || (avenue && !tees) {
            AVENUE
        } else if random.chance(0.45) {
            PARKED
        } else {
            STREET
        }
    });
    if tees {
        // Alternate rows are offset, as in a brick wall.
        let columns = grid.columns;
        for link in &mut grid.links {
            let (row, column) = (link.ends[0] / columns, link.ends[0] % columns);
            let inner = column > 0 && column + 1 < columns;
            link.alive = link.place.across || !inner || (row + column) % 2 == 0;
        }
    }
    let mut nodes = grid.nodes(Control::Signals);
    let streets = grid.streets(|_| false);
    let at = links_at(nodes.len(), streets.iter().map(|street| street.ends));
    for (index, (node, here)) in nodes.iter_mut().zip(&at).enumerate() {
        let avenue = here.iter().any(|street| streets[*street].profile.all_lanes() > 2);
        if here.len() == 3 && !avenue && index.is_multiple_of(2) {
            node.control = if tees { Control::Yield } else { Control::Stop };
        }
    }
    (nodes, streets, grid)
}
