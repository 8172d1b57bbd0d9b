//! The parts that every layout consists of: nodes, and the streets between them.

use glam::DVec2;

use crate::curve::{Piece, wrapped};

/// A point where streets meet or end.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) position: DVec2,
    pub(crate) control: Control,
    /// The height above the ground, on embankments and bridges. Metres.
    pub(crate) lift: f64,
    /// The position whose ground height the node has, where that is not the node's own.
    pub(crate) level_with: Option<DVec2>,
}

impl Node {
    pub(crate) fn new(position: DVec2, control: Control) -> Node {
        Node { position, control, lift: 0.0, level_with: None }
    }
}

/// The priority rule at a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Control {
    /// Traffic signals.
    Signals,
    /// Traffic from minor streets yields.
    Yield,
    /// Traffic from minor streets stops.
    Stop,
    /// Traffic that enters a roundabout yields.
    Ring,
    /// Lanes diverge and merge without crossing.
    Weave,
    /// The end of a street with a turning loop.
    Turning,
}

/// The class of a street.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Class {
    /// The carriageway of a roundabout.
    Ring,
    Town,
    Rural,
    Ramp,
    Motorway,
}

/// The cross section of a street. Metres. Of two values, the first is for the right side, seen from
/// the street's start, and the second for the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Profile {
    pub(crate) class: Class,
    /// The number of driving lanes: forward, backward.
    pub(crate) lanes: [usize; 2],
    pub(crate) lane: f64,
    /// The width of the parking lane; 0 without one.
    pub(crate) parking: [f64; 2],
    /// The width of the sidewalk; 0 without one.
    pub(crate) sidewalk: [f64; 2],
    /// The width of the shoulder; 0 without one.
    pub(crate) shoulder: [f64; 2],
    pub(crate) limit_kmh: f64,
}

impl Profile {
    /// The profile of a town street with sidewalks and the same number of lanes in both directions.
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

    /// The same profile with parking lanes of these widths.
    pub(crate) const fn parked(self, parking: [f64; 2], limit_kmh: f64) -> Profile {
        Profile { parking, limit_kmh, ..self }
    }

    /// Half the width of all driving lanes: from the reference line in the middle to the kerb.
    /// Metres.
    pub(crate) fn half(&self) -> f64 {
        (self.lanes[0] + self.lanes[1]) as f64 * self.lane * 0.5
    }

    /// The offset of the line between the two directions, to the left of the reference line.
    /// Metres.
    pub(crate) fn division(&self) -> f64 {
        (self.lanes[0] as f64 - self.lanes[1] as f64) * self.lane * 0.5
    }

    /// The width of a side's sidewalk or shoulder; 0 without one. Metres.
    pub(crate) fn edge(&self, side: usize) -> f64 {
        self.sidewalk[side].max(self.shoulder[side])
    }

    /// The absolute lane id of a side's outermost lane.
    pub(crate) fn edge_id(&self, side: usize) -> i32 {
        self.lanes[side] as i32 + 1 + i32::from(self.parking[side] > 0.0)
    }

    /// The number of driving lanes in both directions.
    pub(crate) fn all_lanes(&self) -> usize {
        self.lanes[0] + self.lanes[1]
    }
}

/// The course of a street between its ends.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// A polyline through these corners, rounded with these radii.
    Corners { via: Vec<DVec2>, radii: Vec<f64> },
    /// Exactly these pieces, from mouth to mouth.
    Exact(Vec<Piece>),
}

/// A street between two nodes.
#[derive(Clone, Debug)]
pub(crate) struct Street {
    pub(crate) name: String,
    /// The nodes at its start and end.
    pub(crate) ends: [usize; 2],
    pub(crate) shape: Shape,
    pub(crate) profile: Profile,
    /// Whether its height follows the ground between its ends.
    pub(crate) follows_ground: bool,
    /// A hump: its distance from the start, its height, and the length of each slope. Metres.
    pub(crate) hump: Option<(f64, f64, f64)>,
    /// An acceleration lane at its start: the length at full width, and the length of its taper.
    /// Metres.
    pub(crate) acceleration: Option<(f64, f64)>,
    /// A deceleration lane at its end: the length of its taper, and the length at full width.
    /// Metres.
    pub(crate) deceleration: Option<(f64, f64)>,
    /// Whether the right shoulder has no width at its start, at its end, because a ramp is too
    /// close.
    pub(crate) without_shoulder: [bool; 2],
    /// How much wider each sidewalk is in the middle of the street. Metres.
    pub(crate) extra_sidewalk: [f64; 2],
    /// Half the length of the bridge about the street's middle; 0 without one. Metres.
    pub(crate) bridge: f64,
}

impl Street {
    /// A straight street.
    pub(crate) fn new(name: String, ends: [usize; 2], profile: Profile) -> Street {
        Street {
            name,
            ends,
            shape: Shape::Corners { via: Vec::new(), radii: Vec::new() },
            profile,
            follows_ground: false,
            hump: None,
            acceleration: None,
            deceleration: None,
            without_shoulder: [false; 2],
            extra_sidewalk: [0.0; 2],
            bridge: 0.0,
        }
    }

    /// The same street through these corners.
    pub(crate) fn over(self, via: Vec<DVec2>, radius: f64) -> Street {
        let radii = vec![radius; via.len()];
        Street { shape: Shape::Corners { via, radii }, ..self }
    }

    /// The same street along exactly these pieces.
    pub(crate) fn along(self, pieces: Vec<Piece>) -> Street {
        Street { shape: Shape::Exact(pieces), ..self }
    }

    /// The bearing of the street at its start (0) or end (1), away from the node. Radians.
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

    /// The number of additional driving lanes at an end, on the right side.
    pub(crate) fn extra(&self, end: usize) -> usize {
        usize::from(if end == 0 {
            self.acceleration.is_some()
        } else {
            self.deceleration.is_some()
        })
    }
}

/// The indices of the streets at each node.
pub(crate) fn links_at(nodes: usize, ends: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<usize>> {
    let mut at = vec![Vec::new(); nodes];
    for (link, [a, b]) in ends.enumerate() {
        at[a].push(link);
        at[b].push(link);
    }
    at
}
