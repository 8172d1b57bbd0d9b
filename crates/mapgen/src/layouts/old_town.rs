//! A European old town: crooked lanes round a market square, many of them one-way.

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    junction::{has_room, widen_bends},
    lattice::{Bend, Place, lattice},
    layout::Layout,
    plan::Plan,
    relief::Ground,
    street::{Control, Profile, Shape, Street, links_at},
};

const MAIN: Profile = Profile::town(1, 3.5, 2.6, 40.0);
const LANE: Profile = Profile::town(1, 3.3, 1.8, 30.0);
const ONE_WAY: Profile = Profile { lanes: [1, 0], lane: 3.7, ..LANE };

pub(super) fn layout(plan: &Plan) -> Layout {
    // Where junctions leave a street too little room, the town is drawn again, less distorted.
    let mut crookedness = 1.0;
    loop {
        let mut layout = drawn(plan, crookedness);
        widen_bends(&mut layout);
        if crookedness < 0.1 || has_room(&layout) {
            return layout;
        }
        crookedness *= 0.8;
    }
}

fn drawn(plan: &Plan, crookedness: f64) -> Layout {
    let size = plan.size_m;
    let mut random = RandomStream::named(plan.seed, 0x01d);
    let bend = Bend {
        extent: dvec2(size, size),
        center: DVec2::ZERO,
        block: 86.0,
        jitter: 9.0 * crookedness as f32,
        sway: size.min(700.0) * 0.07 * crookedness,
        swirl: crookedness * if plan.seed.is_multiple_of(2) { 0.55 } else { -0.55 },
        bows: (0.75, 0.04, 0.09),
        thinned: 5,
    };
    let grid =
        lattice(&mut random, &bend, |_, place: Place| if place.is_middle() { MAIN } else { LANE });
    let mut nodes = grid.nodes(Control::Yield);
    let mut streets = grid.streets(|_| false);
    make_one_way(&mut random, &mut streets, nodes.len());
    let at = links_at(nodes.len(), streets.iter().map(|street| street.ends));
    for (node, here) in nodes.iter_mut().zip(&at) {
        let main = here.iter().filter(|street| streets[**street].profile.limit_kmh > 35.0).count();
        if here.len() > 3 && (main > 2 || random.chance(0.15)) {
            node.control = Control::Signals;
        }
    }
    // The market square: the streets on both sides of the central block have wide sidewalks.
    let (row, column) = (grid.rows / 2, grid.columns / 2);
    for (south, side) in [(row - 1, 1), (row, 0)] {
        let ends = [grid.node(south, column - 1), grid.node(south, column)];
        let depth =
            grid.nodes[grid.node(row, column)].distance(grid.nodes[grid.node(row - 1, column)]);
        if let Some(street) = streets.iter_mut().find(|street| street.ends == ends) {
            street.extra_sidewalk[side] = (depth * 0.5 - 14.0).clamp(0.0, 26.0);
            street.name = "Market Square".to_string();
        }
    }
    let ground = Ground::new(plan, size, &nodes, &streets);
    Layout { nodes, streets, ground }
}

/// Makes about half of the lanes one-way, but none that would make a street unreachable.
fn make_one_way(random: &mut RandomStream, streets: &mut [Street], nodes: usize) {
    let at = links_at(nodes, streets.iter().map(|street| street.ends));
    for index in 0..streets.len() {
        if streets[index].profile != LANE || !random.chance(0.55) {
            continue;
        }
        let before = streets[index].clone();
        let parking = if random.chance(0.4) { 2.2 } else { 0.0 };
        streets[index].profile = Profile { parking: [parking, 0.0], ..ONE_WAY };
        if random.chance(0.5) {
            turn(&mut streets[index]);
        }
        if !is_connected(streets, &at) {
            streets[index] = before;
        }
    }
}

/// Reverses a street.
fn turn(street: &mut Street) {
    street.ends.reverse();
    if let Shape::Corners { via, radii } = &mut street.shape {
        via.reverse();
        radii.reverse();
    }
}

/// Whether every direction of every street is reachable from every other without a U-turn.
fn is_connected(streets: &[Street], at: &[Vec<usize>]) -> bool {
    // Direction 2k is street k from its start, 2k + 1 from its end.
    let open = |way: usize| streets[way / 2].profile.lanes[way % 2] > 0;
    let reach = |back: bool| {
        let mut seen = vec![false; streets.len() * 2];
        let first = (0..seen.len()).find(|way| open(*way)).unwrap_or(0);
        seen[first] = true;
        let mut waiting = vec![first];
        while let Some(way) = waiting.pop() {
            // The node that it leads to, or comes from.
            let end = (way % 2 == 0) != back;
            let node = streets[way / 2].ends[usize::from(end)];
            for &street in &at[node] {
                let starts = streets[street].ends[0] == node;
                let next = 2 * street + usize::from(starts == back);
                if street != way / 2 && open(next) && !std::mem::replace(&mut seen[next], true) {
                    waiting.push(next);
                }
            }
        }
        (0..seen.len()).all(|way| seen[way] || !open(way))
    };
    reach(false) && reach(true)
}
