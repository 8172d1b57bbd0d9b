//! Streets that meet at roundabouts.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    curve::{Piece, Pose},
    lattice::{Bend, Place, lattice},
    layout::Layout,
    plan::Plan,
    relief::Ground,
    street::{Class, Control, Node, Profile, Street, links_at},
};

const ROAD: Profile = Profile::town(1, 3.5, 3.0, 50.0);
const HOME: Profile = Profile::town(1, 3.4, 2.5, 30.0).parked([2.2; 2], 30.0);
const CIRCLE: Profile = Profile {
    class: Class::Ring,
    lanes: [1, 0],
    lane: 5.0,
    sidewalk: [3.0, 0.0],
    limit_kmh: 30.0,
    ..ROAD
};

/// The length on the circle between the point where a street joins and the free arc. Metres.
const JOIN_M: f64 = 12.5;
/// The shortest free arc. Metres.
const FREE_M: f64 = 4.0;
/// The smallest and the largest radius of a circle. Metres.
const RADIUS_M: (f64, f64) = (17.0, 30.0);

pub(super) fn layout(plan: &Plan) -> Layout {
    let size = plan.size_m;
    let mut random = RandomStream::named(plan.seed, 0x0b0);
    let bend = Bend {
        extent: dvec2(size, size),
        center: DVec2::ZERO,
        block: 150.0,
        jitter: 10.0,
        sway: size.min(900.0) * 0.05,
        swirl: 0.2,
        bows: (0.5, 0.06, 0.12),
        thinned: 7,
    };
    let grid = lattice(&mut random, &bend, |random, place: Place| {
        if place.is_middle() || random.chance(0.5) { ROAD } else { HOME }
    });
    let mut nodes = grid.nodes(Control::Yield);
    let mut streets = grid.streets(|_| false);
    let middle = grid.node(grid.rows / 2, grid.columns / 2);
    let chosen: Vec<usize> =
        (0..nodes.len()).filter(|node| random.chance(0.6) || *node == middle).collect();
    for node in chosen {
        ring(&mut nodes, &mut streets, node);
    }
    let at = links_at(nodes.len(), streets.iter().map(|street| street.ends));
    for (node, here) in nodes.iter_mut().zip(&at) {
        if node.control == Control::Yield && here.len() > 3 && random.chance(0.6) {
            node.control = Control::Signals;
        }
    }
    let ground = Ground::new(plan, size, &nodes, &streets);
    Layout { nodes, streets, ground }
}

/// Replaces a crossing by a roundabout: one node per arm on a circle, and one-way streets between
/// them. The crossing stays where its arms are too close to each other.
pub(super) fn ring(nodes: &mut Vec<Node>, streets: &mut Vec<Street>, node: usize) {
    let center = nodes[node].position;
    let mut arms: Vec<(f64, usize, usize)> = Vec::new();
    for (index, street) in streets.iter().enumerate() {
        for end in [0, 1] {
            if street.ends[end] == node {
                arms.push((street.bearing(nodes, end).rem_euclid(TAU), index, end));
            }
        }
    }
    arms.sort_by(|a, b| a.0.total_cmp(&b.0));
    if arms.len() < 3 {
        return;
    }
    let gap = |k: usize| {
        let next = arms[(k + 1) % arms.len()].0;
        (next - arms[k].0).rem_euclid(TAU)
    };
    let least = (0..arms.len()).map(gap).fold(TAU, f64::min);
    let radius = ((2.0 * JOIN_M + FREE_M) / least).max(RADIUS_M.0);
    if radius > RADIUS_M.1 {
        return;
    }
    let first = nodes.len();
    for &(bearing, street, end) in &arms {
        let position = center + DVec2::from_angle(bearing) * radius;
        let level_with = Some(center);
        nodes.push(Node { position, control: Control::Ring, lift: 0.0, level_with });
        streets[street].ends[end] = nodes.len() - 1;
    }
    for k in 0..arms.len() {
        let from = arms[k].0 + JOIN_M / radius;
        let start =
            Pose { position: center + DVec2::from_angle(from) * radius, heading: from + FRAC_PI_2 };
        let length = gap(k) * radius - 2.0 * JOIN_M;
        let piece = Piece { start, length, curvature: 1.0 / radius };
        let ends = [first + k, first + (k + 1) % arms.len()];
        streets.push(Street::new("Roundabout".to_string(), ends, CIRCLE).along(vec![piece]));
    }
}
