//! Edges: the names that netconvert gives to the lanes of a road in one direction.

use road::{Lane, LaneIndex, LaneTypes, Network};

/// Lanes that netconvert numbers.
const NUMBERED: LaneTypes = LaneTypes(
    LaneTypes::DRIVABLE.0
        | LaneTypes::STOP.0
        | LaneTypes::RESTRICTED.0
        | LaneTypes::PARKING.0
        | LaneTypes::ROAD_WORKS.0
        | LaneTypes::TRAM.0
        | LaneTypes::RAIL.0,
);

/// All driving lanes of a road in one direction.
///
/// netconvert names them by the id of the road in the OpenDRIVE file: `-17` along the reference line
/// (the lanes with negative ids), `17` against it. A road that it cuts has `-17#0`, `-17#1` …
/// on both sides, numbered along the reference line: see [`Edge::piece`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Index of the road.
    pub road: u32,
    /// Whether its lanes lie on the right of the reference line: their ids are negative.
    pub right: bool,
    /// The number of the piece, of a road that is cut. Pieces are taken as the sections of the road:
    /// netconvert cuts roads also where lanes become too narrow, which a route does not tell.
    pub piece: Option<usize>,
}

impl Edge {
    /// Returns the edge of a name, or what the map lacks.
    pub(crate) fn parse(name: &str, network: &Network) -> Result<Edge, String> {
        let (base, piece) = match name.rsplit_once('#') {
            Some((base, piece)) => {
                let piece = piece.parse().map_err(|_| format!("\"#{piece}\" is no number"))?;
                (base, Some(piece))
            }
            None => (name, None),
        };
        let (id, right) = match base.strip_prefix('-') {
            Some(id) => (id, true),
            None => (base, false),
        };
        let Some(road) = network.roads().iter().position(|road| road.id == id) else {
            return Err(format!("the map has no road {id}"));
        };
        let edge = Edge { road: road as u32, right, piece };
        if network.roads()[road].junction.is_some() {
            return Err(format!("road {id} is part of a junction"));
        }
        if network.lanes().iter().any(|lane| edge.has(lane)) {
            return Ok(edge);
        }
        let side = if right { "negative" } else { "positive" };
        let other = if right { "no minus sign" } else { "a minus sign" };
        Err(format!("road {id} has no driving lane with a {side} id (the other side has {other})"))
    }

    /// Returns whether the edge is the same road in the same direction.
    pub(crate) fn continues(&self, other: &Edge) -> bool {
        self.road == other.road && self.right == other.right
    }

    /// Returns whether a lane belongs to the edge, whatever the piece.
    pub(crate) fn has(&self, lane: &Lane) -> bool {
        self.is_beside(lane) && LaneTypes::DRIVABLE.contains(lane.kind)
    }

    /// Returns the driving lanes where the edge begins, the right-most first.
    pub(crate) fn first_lanes(&self, network: &Network) -> Vec<LaneIndex> {
        let drives = |lane: &LaneIndex| self.has(network.lane(*lane));
        self.numbered_lanes(network).into_iter().filter(drives).collect()
    }

    /// Returns the lanes where the edge begins that netconvert numbers, from 0 at the right: driving
    /// lanes, and those for parking, for example.
    pub(crate) fn numbered_lanes(&self, network: &Network) -> Vec<LaneIndex> {
        let road = &network.roads()[self.road as usize];
        let own = || network.lanes().iter().filter(|lane| self.is_beside(lane));
        let sections = || own().filter(|lane| self.has(lane)).map(|lane| lane.section);
        let forward = own().find(|lane| self.has(lane)).is_none_or(|lane| lane.forward);
        // Pieces are numbered along the reference line.
        let section = match self.piece {
            Some(nth) => sections().min_by_key(|section| section.abs_diff(nth as u32)),
            None if forward => sections().min(),
            None => sections().max(),
        };
        let mut found: Vec<_> = own()
            .filter(|lane| Some(lane.section) == section && NUMBERED.contains(lane.kind))
            .collect();
        // From the outside inwards; the outside is on the right in right-hand traffic.
        found.sort_by_key(|lane| -lane.id.abs());
        if road.left_hand {
            found.reverse();
        }
        found.iter().map(|lane| lane.index).collect()
    }

    /// Returns whether a lane lies on the edge's side of its road.
    fn is_beside(&self, lane: &Lane) -> bool {
        lane.road == self.road && (lane.id < 0) == self.right
    }
}
