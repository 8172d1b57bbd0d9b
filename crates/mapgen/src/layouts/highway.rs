//! A motorway round a small town: two carriageways, interchanges with ramps and overpasses.

use std::f64::consts::PI;

use glam::{DVec2, dvec2};
use mesh::RandomStream;

use crate::{
    curve::{self, Piece, Pose},
    layout::Layout,
    layouts::{
        grid,
        style::{Blocks, Course},
    },
    plan::Plan,
    relief::Ground,
    street::{Class, Control, Node, Profile, Shape, Street},
};

const RAMP: Profile = Profile {
    class: Class::Ramp,
    lanes: [1, 0],
    lane: 3.6,
    parking: [0.0; 2],
    sidewalk: [0.0; 2],
    shoulder: [1.5, 0.0],
    limit_kmh: 60.0,
};
const CROSS: Profile = Profile::town(1, 3.5, 2.0, 50.0);

/// Half the width of the median between the carriageways. Metres.
const MEDIAN_M: f64 = 3.0;
/// The distance along the motorway from the overpass to where ramps diverge and merge. Metres.
const RAMP_M: f64 = 215.0;
/// Half the length over which a ramp diverges, and over which it merges. Metres.
const PART_M: f64 = 15.0;
const JOIN_M: f64 = 15.0;
/// The distance from the middle of the motorway to where ramps and cross street meet. Metres.
const TERMINAL_M: f64 = 72.0;
/// The distance from there to the ends of the ramps. Metres.
const RAMP_MOUTH_M: f64 = 17.0;
/// The distance from there to the town, over which the street descends. Metres.
const DESCENT_M: f64 = 185.0;
/// The height of a road above the road that it crosses. Metres.
const CLEARANCE_M: f64 = 7.0;
/// An acceleration lane: its full length, and the length of its taper. Metres.
const ACCELERATION_M: (f64, f64) = (170.0, 70.0);
/// A deceleration lane: the length of its taper, and its full length. Metres.
const DECELERATION_M: (f64, f64) = (60.0, 150.0);

/// Draws a motorway, and a town of such blocks inside it.
pub(crate) fn layout(plan: &Plan, course: Course, blocks: Blocks) -> Layout {
    let size = plan.size_m;
    let mut random = RandomStream::named(plan.seed, 0xa00);
    let lanes = if size > 1150.0 && course == Course::Ring { 3 } else { 2 };
    let mut sketch = Sketch {
        nodes: Vec::new(),
        streets: Vec::new(),
        main: Profile {
            class: Class::Motorway,
            lanes: [lanes, 0],
            shoulder: [2.5, 1.0],
            limit_kmh: 100.0,
            ..RAMP
        },
    };
    let route = match course {
        Course::Ring => ring(size),
        Course::Eight => eight(size),
    };
    let (nodes, streets, lattice) = grid::streets(&mut random, route.town.1, route.town.0, blocks);
    (sketch.nodes, sketch.streets) = (nodes, streets);
    let edge = edge_nodes(lattice.rows, lattice.columns);
    let mut terminals = Vec::new();
    for exit in &route.exits {
        terminals.push(sketch.exit(exit, &edge, exit.heading));
    }
    let away = MEDIAN_M + sketch.main.shoulder[1] + sketch.main.half();
    let right = curve::beside(&route.axis, -away);
    let left = curve::reversed(&curve::beside(&route.axis, away));
    for (side, carriageway) in [right, left].iter().enumerate() {
        sketch.carriageway(carriageway, side, &route, &terminals);
    }
    let Sketch { nodes, streets, .. } = sketch;
    let ground = Ground::new(plan, size, &nodes, &streets);
    Layout { nodes, streets, ground }
}

/// The course of a motorway, and what lies inside it.
struct Route {
    axis: Vec<Piece>,
    exits: Vec<Exit>,
    /// The middle and the extent of the town. Metres.
    town: (DVec2, DVec2),
    /// Where the motorway crosses itself, and the heading of the upper level there.
    crossing: Option<(DVec2, f64)>,
}

/// An interchange: its point on the axis, and the heading of the axis there.
struct Exit {
    at: DVec2,
    heading: f64,
}

fn ring(size: f64) -> Route {
    let (w, h) = (size * 0.5, size * 0.4);
    let corners = [dvec2(-w, -h), dvec2(w, -h), dvec2(w, h), dvec2(-w, h)];
    let radius = (w - 275.0).min(h * 0.9).min(320.0);
    let deep = h - TERMINAL_M - DESCENT_M;
    let exits =
        vec![Exit { at: dvec2(0.0, -h), heading: 0.0 }, Exit { at: dvec2(0.0, h), heading: PI }];
    Route {
        axis: curve::closed(&corners, radius),
        exits,
        town: (DVec2::ZERO, dvec2(size * 0.58, (2.0 * deep).max(260.0))),
        crossing: None,
    }
}

fn eight(size: f64) -> Route {
    let at = |x: f64, y: f64| dvec2(x, y) * (size / 1280.0);
    let corners = [
        at(-20.0, -450.0),
        at(640.0, -450.0),
        at(640.0, 450.0),
        at(-20.0, 450.0),
        at(-420.0, -430.0),
        at(-660.0, -430.0),
        at(-660.0, 430.0),
        at(-420.0, 430.0),
    ];
    let axis = curve::closed(&corners, 130.0 * size / 1280.0);
    // The intersection of the two long diagonals.
    let (from, rise) = (corners[3], corners[4] - corners[3]);
    let (other, fall) = (corners[7], corners[0] - corners[7]);
    let crossing = from + rise * ((other - from).perp_dot(fall) / rise.perp_dot(fall));
    let exits = vec![Exit { at: at(640.0, 0.0), heading: PI * 0.5 }];
    let (west, east) = (at(90.0, 0.0).x, at(640.0, 0.0).x - TERMINAL_M - DESCENT_M);
    let town = (dvec2((west + east) * 0.5, 0.0), dvec2(east - west, at(0.0, 620.0).y));
    Route { axis, exits, town, crossing: Some((crossing, rise.to_angle())) }
}

/// The nodes on the town's edge without a street outwards, except the corners.
fn edge_nodes(rows: usize, columns: usize) -> Vec<usize> {
    (0..rows * columns)
        .filter(|node| {
            let (row, column) = (node / columns, node % columns);
            let (end, side) = (row == 0 || row + 1 == rows, column == 0 || column + 1 == columns);
            end != side
        })
        .collect()
}

struct Sketch {
    nodes: Vec<Node>,
    streets: Vec<Street>,
    main: Profile,
}

impl Sketch {
    fn node(&mut self, position: DVec2, control: Control) -> usize {
        self.nodes.push(Node::new(position, control));
        self.nodes.len() - 1
    }

    /// Adds the cross street of an interchange; returns the nodes where its ramps meet it, on the
    /// right and on the left of the axis.
    fn exit(&mut self, exit: &Exit, edge: &[usize], heading: f64) -> [usize; 2] {
        let inward = DVec2::from_angle(heading).perp();
        let ends = [-1.0, 1.0].map(|side| {
            let terminal = self.node(exit.at + inward * TERMINAL_M * side, Control::Signals);
            self.nodes[terminal].level_with = Some(exit.at);
            self.nodes[terminal].lift = CLEARANCE_M;
            terminal
        });
        let mut over = Street::new("Overpass".to_string(), ends, CROSS);
        over.bridge = 24.0;
        self.streets.push(over);
        let aim = exit.at + inward * (TERMINAL_M + DESCENT_M);
        let away = |node: &usize| self.nodes[*node].position.distance(aim);
        let near = edge.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)));
        if let Some(gate) = near {
            let (from, to) = (self.nodes[ends[1]].position, self.nodes[gate].position);
            let via = vec![from + inward * 70.0, to - inward * 55.0];
            let mut street = Street::new("Link Road".to_string(), [ends[1], gate], CROSS);
            street.shape = Shape::Corners { via, radii: vec![90.0, 60.0] };
            self.streets.push(street);
            self.nodes[gate].control = Control::Signals;
        }
        ends
    }

    /// Adds one carriageway with its ramps, divided where ramps diverge and merge.
    fn carriageway(&mut self, line: &[Piece], side: usize, route: &Route, ends: &[[usize; 2]]) {
        // Along the line: the node's distance, half its length, the node, whether a ramp merges
        // there.
        let mut cuts: Vec<(f64, f64, usize, bool)> = Vec::new();
        let aside = self.main.half() + RAMP.half();
        for (exit, terminals) in route.exits.iter().zip(ends) {
            let middle = curve::nearest(line, exit.at);
            let total = curve::length(line);
            let terminal = terminals[side];
            let center = self.nodes[terminal].position;
            let along = |at: f64| curve::at(line, at.rem_euclid(total));
            let heading = along(middle).heading;
            let meet = |ahead: f64| Pose { position: center, heading }.ahead(ahead);

            let part = middle - RAMP_M;
            let node = self.node(along(part).position, Control::Weave);
            let from = along(part + PART_M).right(aside);
            let pieces = curve::between(from, meet(-RAMP_MOUTH_M));
            let ramp = Street::new("Exit".to_string(), [node, terminal], RAMP).along(pieces);
            self.streets.push(ramp);
            cuts.push((part.rem_euclid(total), PART_M, node, false));

            let join = middle + RAMP_M;
            let node = self.node(along(join).position, Control::Weave);
            let to = along(join - JOIN_M).right(aside);
            let pieces = curve::between(meet(RAMP_MOUTH_M), to);
            let ramp = Street::new("Entry".to_string(), [terminal, node], RAMP).along(pieces);
            self.streets.push(ramp);
            cuts.push((join.rem_euclid(total), JOIN_M, node, true));
        }
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        for k in 0..cuts.len() {
            let (from, to) = (cuts[k], cuts[(k + 1) % cuts.len()]);
            let pieces = curve::cut(line, from.0 + from.1, to.0 - to.1);
            let length = curve::length(&pieces);
            let name = format!("Motorway {}", if side == 0 { "A" } else { "B" });
            let mut street = Street::new(name, [from.2, to.2], self.main).along(pieces);
            street.follows_ground = true;
            street.acceleration = from.3.then_some(ACCELERATION_M);
            let room = length - if from.3 { ACCELERATION_M.0 + ACCELERATION_M.1 } else { 0.0 };
            street.deceleration = (!to.3 && room > DECELERATION_M.0 + DECELERATION_M.1 + 20.0)
                .then_some(DECELERATION_M);
            street.without_shoulder = [!from.3, to.3];
            street.hump = route.crossing.map(|(at, heading)| {
                let heading = if side == 0 { heading } else { heading + PI };
                let along = curve::passing(line, at, heading) - (from.0 + from.1);
                (along.rem_euclid(curve::length(line)), CLEARANCE_M, 230.0)
            });
            self.streets.push(street);
        }
    }
}
