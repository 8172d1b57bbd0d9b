//! What every style draws: nodes, and the streets between them.

use glam::DVec2;

use super::curve::{self, Piece, wrapped};
use super::relief::Ground;

/// Half of what is level on top of a hump. Metres.
const HUMP_FLAT_M: f64 = 40.0;

/// Where streets meet.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) position: DVec2,
    pub(super) control: Control,
    /// Above the ground, for what stands on embankments and bridges. Metres.
    pub(super) lift: f64,
    /// The ground that counts is that of this place, where it is not the node's own.
    pub(super) level_with: Option<DVec2>,
}

impl Node {
    pub(super) fn new(position: DVec2, control: Control) -> Node {
        Node { position, control, lift: 0.0, level_with: None }
    }
}

/// Who goes first where streets meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Control {
    /// Lights.
    Signals,
    /// Who comes from a smaller street gives way.
    Yield,
    /// Who comes from a smaller street stops.
    Stop,
    /// Who enters a roundabout gives way.
    Ring,
    /// Lanes part and join side by side.
    Weave,
    /// The end of a street, with room to turn round.
    Turning,
}

/// What kind of street.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Class {
    /// The circle of a roundabout.
    Ring,
    Town,
    Rural,
    Ramp,
    Motorway,
}

/// What a street looks like across. Metres; of two values the first is for the side on the right
/// of who goes from its start to its end, the second for the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Profile {
    pub(super) class: Class,
    /// Driving lanes: forward, backward.
    pub(super) lanes: [usize; 2],
    pub(super) lane: f64,
    /// 0 where nobody may park.
    pub(super) parking: [f64; 2],
    /// 0 where nobody walks.
    pub(super) sidewalk: [f64; 2],
    /// 0 where the kerb is.
    pub(super) shoulder: [f64; 2],
    pub(super) limit_kmh: f64,
}

impl Profile {
    /// A street with sidewalks and as many lanes either way.
    pub(super) const fn town(lanes: usize, lane: f64, sidewalk: f64, limit_kmh: f64) -> Profile {
        Profile {
            class: Class::Town,
            lanes: [lanes; 2],
            lane,
            parking: [0.0; 2],
            sidewalk: [sidewalk; 2],
            shoulder: [0.0; 2],
            limit_kmh,
        }
    }

    /// The same with cars parked on these sides.
    pub(super) const fn parked(self, parking: [f64; 2], limit_kmh: f64) -> Profile {
        Profile { parking, limit_kmh, ..self }
    }

    /// From the reference line, which is the middle, to the kerb, where nobody parks.
    pub(super) fn half(&self) -> f64 {
        (self.lanes[0] + self.lanes[1]) as f64 * self.lane * 0.5
    }

    /// How far left of the reference line the two directions meet.
    pub(super) fn parting(&self) -> f64 {
        (self.lanes[0] as f64 - self.lanes[1] as f64) * self.lane * 0.5
    }

    /// Of the outermost lane of a side, be it sidewalk or shoulder; 0 without one.
    pub(super) fn edge(&self, side: usize) -> f64 {
        self.sidewalk[side].max(self.shoulder[side])
    }

    /// The lane number of a side's outermost lane, without its sign.
    pub(super) fn edge_id(&self, side: usize) -> i32 {
        self.lanes[side] as i32 + 1 + i32::from(self.parking[side] > 0.0)
    }

    /// All lanes that are driven on.
    pub(super) fn all_lanes(&self) -> usize {
        self.lanes[0] + self.lanes[1]
    }
}

/// How a street gets from one end to the other.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Corners on the way, to be rounded with these radii.
    Corners { via: Vec<DVec2>, radii: Vec<f64> },
    /// Exactly so, from mouth to mouth.
    Exact(Vec<Piece>),
}

/// A street between two nodes.
#[derive(Clone, Debug)]
pub(super) struct Street {
    pub(super) name: String,
    /// Nodes at its start and end.
    pub(super) ends: [usize; 2],
    pub(super) shape: Shape,
    pub(super) profile: Profile,
    /// Whether it goes up and down with the ground, not just from end to end.
    pub(super) follows: bool,
    /// So far from its start it rises by so much, from and to so far away.
    pub(super) hump: Option<(f64, f64, f64)>,
    /// An acceleration lane at its start: full width for the first, narrowing for the second length.
    pub(super) merge: Option<(f64, f64)>,
    /// A deceleration lane at its end: widening for the first, full width for the second length.
    pub(super) leave: Option<(f64, f64)>,
    /// Whether the right shoulder is nothing at its start, at its end: a ramp is too near.
    pub(super) pinched: [bool; 2],
    /// How much broader its sidewalks are in the middle.
    pub(super) square: [f64; 2],
    /// Half of what is carried by a bridge, about its middle.
    pub(super) bridge: f64,
}

impl Street {
    /// A straight one.
    pub(super) fn new(name: String, ends: [usize; 2], profile: Profile) -> Street {
        Street {
            name,
            ends,
            shape: Shape::Corners { via: Vec::new(), radii: Vec::new() },
            profile,
            follows: false,
            hump: None,
            merge: None,
            leave: None,
            pinched: [false; 2],
            square: [0.0; 2],
            bridge: 0.0,
        }
    }

    /// Over these corners.
    pub(super) fn over(self, via: Vec<DVec2>, radius: f64) -> Street {
        let radii = vec![radius; via.len()];
        Street { shape: Shape::Corners { via, radii }, ..self }
    }

    /// Exactly along these pieces.
    pub(super) fn along(self, pieces: Vec<Piece>) -> Street {
        Street { shape: Shape::Exact(pieces), ..self }
    }

    /// The bearing in which it leaves its start (0) or its end (1).
    pub(super) fn bearing(&self, nodes: &[Node], end: usize) -> f64 {
        match &self.shape {
            Shape::Corners { via, .. } => {
                let here = nodes[self.ends[end]].position;
                let far = nodes[self.ends[1 - end]].position;
                let next = if end == 0 { via.first() } else { via.last() };
                wrapped((*next.unwrap_or(&far) - here).to_angle())
            }
            Shape::Exact(pieces) if end == 0 => wrapped(pieces[0].start.heading),
            Shape::Exact(pieces) => pieces[pieces.len() - 1].end().turned().heading,
        }
    }

    /// How many driving lanes there are more at an end, on the right of its start.
    pub(super) fn extra(&self, end: usize) -> usize {
        usize::from(if end == 0 { self.merge.is_some() } else { self.leave.is_some() })
    }
}

/// A whole plan.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) nodes: Vec<Node>,
    pub(super) streets: Vec<Street>,
    pub(super) ground: Ground,
}

impl Layout {
    /// How high a node lies. Metres.
    pub(super) fn height(&self, node: usize) -> f64 {
        let node = &self.nodes[node];
        self.ground.height(node.level_with.unwrap_or(node.position)) + node.lift
    }

    /// Heights along a street whose line is this: distance, height and slope, from end to end.
    pub(super) fn heights(&self, street: &Street, line: &[Piece]) -> Vec<[f64; 3]> {
        let length = curve::length(line);
        let ends = street.ends.map(|end| self.height(end));
        let count = if street.follows { (length / 45.0).round().max(1.0) as usize } else { 1 };
        let step = length / count as f64;
        let high = |k: usize| match k {
            0 => ends[0],
            k if k == count => ends[1],
            k => {
                let place = curve::at(line, k as f64 * step).position;
                let hump = street.hump.map_or(0.0, |(at, high, reach)| {
                    let away = (k as f64 * step - at).abs() - HUMP_FLAT_M;
                    let near = (1.0 - away.max(0.0) / reach).clamp(0.0, 1.0);
                    high * near * near * (3.0 - 2.0 * near)
                });
                self.ground.height(place) + hump
            }
        };
        let knots = (0..=count).map(|k| {
            let inner = k > 0 && k < count;
            let slope = if inner { (high(k + 1) - high(k - 1)) / (2.0 * step) } else { 0.0 };
            [k as f64 * step, high(k), slope]
        });
        knots.collect()
    }
}

/// Streets by node: one list for each.
pub(super) fn links_at(nodes: usize, ends: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<usize>> {
    let mut at = vec![Vec::new(); nodes];
    for (link, [a, b]) in ends.enumerate() {
        at[a].push(link);
        at[b].push(link);
    }
    at
}
