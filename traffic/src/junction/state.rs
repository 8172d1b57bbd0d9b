//! State of the junction stage, shared by its parts.

use super::presence_list::{ByLane, Presence};
use crate::{
    agents::Agents,
    constraint::{JunctionConstraint, WaitReason},
    map::Map,
    obstacles::Obstacle,
    occupancy::Occupancy,
    spread::Spread,
    tracks::NONE,
    vehicle_table::{Vehicle, VehicleTable},
};

/// Deceleration that a light turning yellow may require.
pub(super) const YELLOW_BRAKE_MPS2: f32 = 3.0;
/// Deceleration on which plans are based.
pub(super) const BRAKE_MPS2: f32 = 2.0;
/// Gap to a standing leader beyond a junction.
pub(super) const STANDING_GAP_M: f32 = 2.5;
/// Gap to the stop line at standstill.
pub(super) const LINE_GAP_M: f32 = 0.5;

/// How far beyond the start of a junction the front of a vehicle may be that still waits before it.
pub(super) const BEYOND_M: f32 = 1.0;
/// How far beyond the line of a light the front of a vehicle is that is in the way of others there: more
/// than of one that stands in a queue, which waits with its front over the line.
pub(crate) const PASSED_M: f32 = 2.0 * BEYOND_M;

/// The next way through a junction for which a vehicle has no reservation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Request {
    pub(super) row: usize,
    /// First lane of the way in the route, and one past its last lane.
    pub(super) from: usize,
    pub(super) to: usize,
    /// Distance from the front bumper to the stop line, and to the first lane.
    pub(super) line_m: f32,
    pub(super) entry_m: f32,
    /// Speed of the vehicle along its heading.
    pub(super) speed_mps: f32,
    /// Lower goes first.
    pub(super) rank: i32,
    /// Number of vehicles of the same rank and time that come from its right.
    pub(super) from_right: u32,
    pub(super) red: bool,
}

/// What a row has or needs before reservations are granted.
#[derive(Clone, Copy)]
pub(super) enum Found {
    /// The row has a reservation, and the lane beyond it is this one; [`NONE`] if the route ends there.
    Holder(usize, u32),
    Request(Request),
}

/// To which vehicles the holder of a reservation yields.
#[derive(Clone, Copy)]
pub(super) struct Yielding {
    pub(super) row: usize,
    pub(super) constraint: JunctionConstraint,
    /// See [`Junctions::yields_to`] and [`Junctions::merges_behind`].
    pub(super) yields_to: u32,
    pub(super) merges_behind: u32,
}

/// Data and results of the stage in one frame, by row.
#[derive(Default)]
pub(crate) struct Junctions {
    pub(crate) constraints: Vec<JunctionConstraint>,
    pub(crate) waits: Vec<WaitReason>,
    /// The agent that a vehicle without a reservation waits for: an index into the agents, or
    /// `NONE`.
    pub(super) blockers: Vec<u32>,
    /// The agent that a holder yields to: an index into the agents, or `NONE`.
    pub(super) yields_to: Vec<u32>,
    /// The agent that a holder follows while it is on another lane of a merge: an index into the
    /// agents, or `NONE`.
    pub(super) merges_behind: Vec<u32>,
    pub(super) requests: Vec<Request>,
    /// Rows that have reservations: those that had one before any was granted in this frame, ascending,
    /// with the lanes beyond these or `NONE`, and then those of this frame.
    pub(super) holding: Vec<(usize, u32)>,
    /// The holders and requests by row.
    pub(super) found: Vec<Found>,
    pub(super) presences: Vec<Presence>,
    pub(super) yielding: Vec<Yielding>,
    pub(super) holders: ByLane<Presence>,
    pub(super) approaching: ByLane<Presence>,
    /// By lane: the rows whose reservations may end before it.
    pub(super) leaving_to: ByLane<u32>,
    /// Requests of vehicles that have waited for long: the lane beyond the junction, and the index
    /// of the request. Sorted.
    pub(super) starving: Vec<(u32, u32)>,
    /// By row: distances from the front bumper to the starts of the lanes of the route.
    starts: Vec<f32>,
    starts_from: Vec<u32>,
}

/// Inputs of the stage.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) agents: &'a Agents,
    pub(crate) occupancy: &'a Occupancy,
    /// Agents in the swept paths of vehicles.
    pub(crate) obstacles: &'a [Obstacle],
    /// By signal: the state that it shows.
    pub(crate) lights: &'a [u32],
    pub(crate) seed: u64,
    pub(crate) delta_s: f32,
    pub(crate) spread: Spread,
    /// By row: fraction of red lights to ignore.
    pub(crate) ignore_lights: &'a [f32],
    /// By row: fraction of signs to ignore.
    pub(crate) ignore_signs: &'a [f32],
}

impl Junctions {
    /// Measures the distances from each front bumper to the lanes of its route.
    pub(super) fn measure(&mut self, vehicles: &VehicleTable, view: &View) {
        let starts = (&mut self.starts, &mut self.starts_from);
        view.spread.ragged(vehicles.len(), starts, |row, starts| {
            let vehicle = &vehicles[row];
            if vehicle.located == 0 {
                return;
            }
            let agent = view.agents.driven[row] as usize;
            let mut start = -vehicle.arc_m - view.agents.body[agent].front_m;
            for &lane in vehicle.route.lanes() {
                starts.push(start);
                start += view.map.tracks.length(lane);
            }
            starts.push(start);
        });
    }

    /// Returns the distance from the front bumper of `row` to the start of lane `k` of its route.
    pub(crate) fn start(&self, row: usize, k: usize) -> f32 {
        self.starts[self.starts_from[row] as usize + k]
    }

    /// Returns the agent that `row` waits for or yields to: an index into the agents, or `NONE`.
    pub(crate) fn blocker(&self, row: usize) -> u32 {
        if self.yields_to[row] == NONE { self.blockers[row] } else { self.yields_to[row] }
    }

    /// Returns those distances for every lane that the route had at the beginning of the stage;
    /// none for a vehicle that was located since.
    pub(crate) fn starts(&self, row: usize) -> &[f32] {
        let (from, to) = (self.starts_from[row], self.starts_from[row + 1]);
        self.starts[from as usize..to as usize].split_last().map_or(&[], |(_, starts)| starts)
    }
}

/// Returns the lanes of a request with their indices in the route.
pub(super) fn request_lanes<'a>(
    lanes: &'a [u32],
    request: &Request,
) -> impl Iterator<Item = (usize, &'a u32)> {
    lanes.iter().enumerate().take(request.to).skip(request.from)
}

/// Returns the number of lanes of the route that the reservation covers.
pub(crate) fn reserved_lanes(vehicle: &Vehicle) -> usize {
    if vehicle.reservation == 0 {
        return 0;
    }
    vehicle.reservation_end.wrapping_sub(vehicle.route.lanes_passed) as usize
}
