//! What every style draws: nodes, and the streets between them.

use glam::DVec2;

use crate::curve::{Piece, wrapped};

/// Where streets meet.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) position: DVec2,
    pub(crate) control: Control,
    /// Above the ground, for what stands on embankments and bridges. Metres.
    pub(crate) lift: f64,
    /// The ground that counts is that of this place, where it is not the node's own.
    pub(crate) level_with: Option<DVec2>,
}

impl Node {
    pub(crate) fn new(position: DVec2, control: Control) -> Node {
        Node { position, control, lift: 0.0, level_with: None }
    }
}

/// Who goes first where streets meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Control {
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
pub(crate) enum Class {
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
pub(crate) struct Profile {
    pub(crate) class: Class,
    /// Driving lanes: forward, backward.
    pub(crate) lanes: [usize; 2],
    pub(crate) lane: f64,
    /// 0 where nobody may park.
    pub(crate) parking: [f64; 2],
    /// 0 where nobody walks.
    pub(crate) sidewalk: [f64; 2],
    /// 0 where the kerb is.
    pub(crate) shoulder: [f64; 2],
    pub(crate) limit_kmh: f64,
}

impl Profile {
    /// A street with sidewalks and as many lanes either way.
    pub(crate) const fn town(lanes: usize, lane: f64, sidewalk: f64, limit_kmh: f64) -> Profile {
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
    pub(crate) const fn parked(self, parking: [f64; 2], limit_kmh: f64) -> Profile {
        Profile { parking, limit_kmh, ..self }
    }

    /// From the reference line, which is the middle, to the kerb, where nobody parks.
    pub(crate) fn half(&self) -> f64 {
        (self.lanes[0] + self.lanes[1]) as f64 * self.lane * 0.5
    }

    /// How far left of the reference line the two directions meet.
    pub(crate) fn parting(&self) -> f64 {
        (self.lanes[0] as f64 - self.lanes[1] as f64) * self.lane * 0.5
    }

    /// Of the outermost lane of a side, be it sidewalk or shoulder; 0 without one.
    pub(crate) fn edge(&self, side: usize) -> f64 {
        self.sidewalk[side].max(self.shoulder[side])
    }

    /// The lane number of a side's outermost lane, without its sign.
    pub(crate) fn edge_id(&self, side: usize) -> i32 {
        self.lanes[side] as i32 + 1 + i32::from(self.parking[side] > 0.0)
    }

    /// All lanes that are driven on.
    pub(crate) fn all_lanes(&self) -> usize {
        self.lanes[0] + self.lanes[1]
    }
}

/// How a street gets from one end to the other.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// Corners on the way, to be rounded with these radii.
    Corners { via: Vec<DVec2>, radii: Vec<f64> },
    /// Exactly so, from mouth to mouth.
    Exact(Vec<Piece>),
}

/// A street between two nodes.
#[derive(Clone, Debug)]
pub(crate) struct Street {
    pub(crate) name: String,
    /// Nodes at its start and end.
    pub(crate) ends: [usize; 2],
    pub(crate) shape: Shape,
    pub(crate) profile: Profile,
    /// Whether it goes up and down with the ground, not just from end to end.
    pub(crate) follows: bool,
    /// So far from its start it rises by so much, from and to so far away.
    pub(crate) hump: Option<(f64, f64, f64)>,
    /// An acceleration lane at its start: full width for the first, narrowing for the second length.
    pub(crate) merge: Option<(f64, f64)>,
    /// A deceleration lane at its end: widening for the first, full width for the second length.
    pub(crate) leave: Option<(f64, f64)>,
    /// Whether the right shoulder is nothing at its start, at its end: a ramp is too near.
    pub(crate) pinched: [bool; 2],
    /// How much broader its sidewalks are in the middle.
    pub(crate) square: [f64; 2],
    /// Half of what is carried by a bridge, about its middle.
    pub(crate) bridge: f64,
}

impl Street {
    /// A straight one.
    pub(crate) fn new(name: String, ends: [usize; 2], profile: Profile) -> Street {
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
    pub(crate) fn over(self, via: Vec<DVec2>, radius: f64) -> Street {
        let radii = vec![radius; via.len()];
        Street { shape: Shape::Corners { via, radii }, ..self }
    }

    /// Exactly along these pieces.
    pub(crate) fn along(self, pieces: Vec<Piece>) -> Street {
        Street { shape: Shape::Exact(pieces), ..self }
    }

    /// The bearing in which it leaves its start (0) or its end (1).
    pub(crate) fn bearing(&self, nodes: &[Node], end: usize) -> f64 {
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
    pub(crate) fn extra(&self, end: usize) -> usize {
        usize::from(if end == 0 { self.merge.is_some() } else { self.leave.is_some() })
    }
}

/// Streets by node: one list for each.
pub(crate) fn links_at(nodes: usize, ends: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<usize>> {
    let mut at = vec![Vec::new(); nodes];
    for (link, [a, b]) in ends.enumerate() {
        at[a].push(link);
        at[b].push(link);
    }
    at
}
