//! Countryside: long curved roads over hills, and villages where some of them meet.

use std::f64::consts::TAU;

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    lattice::{Bend, lattice},
    layout::Layout,
    plan::Plan,
    relief::Ground,
    street::{Class, Control, Node, Profile, Shape, Street},
};

const ROAD: Profile = Profile {
    class: Class::Rural,
    lanes: [1, 1],
    lane: 3.5,
    parking: [0.0; 2],
    sidewalk: [0.0; 2],
    shoulder: [1.2; 2],
    limit_kmh: 80.0,
};
const VILLAGE: Profile = Profile::town(1, 3.3, 2.0, 50.0);
const LANE: Profile = Profile::town(1, 3.4, 1.8, 30.0);

/// The distance from the middle of a village to its edge. Metres.
const VILLAGE_M: f64 = 115.0;
/// The length over which roads are straight at their ends. Metres.
const STRAIGHT_M: f64 = 75.0;

pub(super) fn layout(plan: &Plan) -> Layout {
    let size = plan.size_m;
    let mut random = RandomStream::named(plan.seed, 0xc00);
    let bend = Bend {
        extent: dvec2(size, size),
        center: DVec2::ZERO,
        block: (size / 2.0).min(430.0),
        jitter: 40.0,
        sway: 0.0,
        swirl: 0.0,
        bows: (0.0, 0.0, 0.0),
        thinned: 4,
    };
    let grid = lattice(&mut random, &bend, |_, _| ROAD);
    let mut nodes = grid.nodes(Control::Yield);
    let mut streets = grid.streets(|_| false);
    let mut arms = vec![0; nodes.len()];
    streets.iter().flat_map(|street| street.ends).for_each(|node| arms[node] += 1);
    let middle = grid.node(grid.rows / 2, grid.columns / 2);
    let is_village: Vec<bool> = (0..nodes.len())
        .map(|node| arms[node] > 2 && (random.chance(0.35) || node == middle))
        .collect();
    for street in &mut streets {
        street.follows_ground = true;
        meander(&mut random, street, &nodes, &is_village);
    }
    for node in (0..nodes.len()).filter(|node| is_village[*node]).collect::<Vec<_>>() {
        village(&mut random, &mut nodes, &mut streets, node);
    }
    let ground = Ground::new(plan, size, &nodes, &streets);
    Layout { nodes, streets, ground }
}

/// Adds bends to a road between its straight ends.
fn meander(random: &mut RandomStream, street: &mut Street, nodes: &[Node], is_village: &[bool]) {
    let Shape::Corners { via, .. } = &street.shape else { return };
    let mut corners = vec![nodes[street.ends[0]].position];
    corners.extend(via);
    corners.push(nodes[street.ends[1]].position);
    let mut bends = Vec::new();
    for (k, pair) in corners.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        let room = |end: usize| if is_village[end] { VILLAGE_M + STRAIGHT_M } else { STRAIGHT_M };
        let start = if k == 0 { room(street.ends[0]) } else { STRAIGHT_M };
        let last = k + 2 == corners.len();
        let stop = if last { room(street.ends[1]) } else { STRAIGHT_M };
        if k > 0 {
            bends.push(from);
        }
        let length = from.distance(to);
        let free = length - start - stop;
        let count = (free / 90.0) as usize;
        let along = (to - from) / length;
        let mut side = if random.chance(0.5) { 1.0 } else { -1.0 };
        for bend in 0..count {
            let at = start + free * (bend as f64 + 0.5) / count as f64;
            let off = side * f64::from(random.between(10.0, 30.0));
            bends.push(from + along * at + along.perp() * off);
            side = -side;
        }
    }
    let radii = vec![95.0; bends.len()];
    street.shape = Shape::Corners { via: bends, radii };
}

/// Adds a main street, kerbs and side lanes round a node where roads meet.
fn village(
    random: &mut RandomStream,
    nodes: &mut Vec<Node>,
    streets: &mut Vec<Street>,
    node: usize,
) {
    let center = nodes[node].position;
    let mut gates: Vec<(f64, usize)> = Vec::new();
    for index in 0..streets.len() {
        let ends = streets[index].ends;
        let Some(end) = ends.iter().position(|end| *end == node) else { continue };
        let bearing = streets[index].bearing(nodes, end);
        let gate = nodes.len();
        let position = center + DVec2::from_angle(bearing) * VILLAGE_M;
        nodes.push(Node::new(position, Control::Yield));
        streets[index].ends[end] = gate;
        let mut main = Street::new("High Street".to_string(), [node, gate], VILLAGE);
        main.follows_ground = true;
        streets.push(main);
        gates.push((bearing.rem_euclid(TAU), gate));
    }
    gates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lanes = 0;
    for k in 0..gates.len() {
        let (a, b) = (gates[k], gates[(k + 1) % gates.len()]);
        let angle = (b.0 - a.0).rem_euclid(TAU);
        if !(0.9..2.4).contains(&angle) {
            continue;
        }
        // Every gate of the village keeps a lane; without one it would not be a junction.
        let middle = DVec2::from_angle(a.0 + angle * 0.5);
        let reach = VILLAGE_M / (angle * 0.5).cos() * f64::from(random.between(0.86, 0.98));
        let via = vec![center + middle * reach];
        let mut lane = Street::new("Back Lane".to_string(), [a.1, b.1], LANE).over(via, 60.0);
        lane.follows_ground = true;
        streets.push(lane);
        lanes += 1;
    }
    if lanes > 1 && random.chance(0.4) {
        nodes[node].control = Control::Signals;
    }
}
