//! The leader of a vehicle: the nearest agent ahead of it on its route.

use crate::{
    agents::Agents,
    occupancy::Occupancy,
    tracks::{NONE, Tracks},
    vehicle_table::Vehicle,
};

/// The agent that a vehicle follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Leader {
    /// Distance between the bumpers; infinity without a leader.
    pub(crate) gap_m: f32,
    /// Speed along the follower's track.
    pub(crate) speed_mps: f32,
    /// Index into the agents.
    pub(crate) agent: u32,
    /// Cosine of the angle between the leader's heading and the track.
    pub(crate) aligned: f32,
}

impl Leader {
    /// No leader.
    pub(crate) const NONE: Leader =
        Leader { gap_m: f32::INFINITY, speed_mps: 0.0, agent: u32::MAX, aligned: 1.0 };

    /// Returns the nearer of two leaders.
    pub(crate) fn nearer(self, other: Leader) -> Leader {
        if other.gap_m < self.gap_m { other } else { self }
    }
}

/// Returns the leader on the route within `horizon_m` of the front bumper.
///
/// An agent counts as ahead if its front is farther along: of two vehicles side by side in one
/// lane, the one behind yields.
pub(crate) fn leader(
    vehicle: &Vehicle,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    occupancy: &Occupancy,
    horizon_m: f32,
) -> Leader {
    leader_except(NONE, vehicle, row, (tracks, agents, occupancy), horizon_m)
}

/// As [`leader`], without one agent.
pub(crate) fn leader_except(
    except: u32,
    vehicle: &Vehicle,
    row: usize,
    (tracks, agents, occupancy): (&Tracks, &Agents, &Occupancy),
    horizon_m: f32,
) -> Leader {
    let own = agents.driven[row];
    let front = vehicle.arc_m + agents.body[own as usize].front_m;
    let mut begins = -front;
    let mut found = Leader::NONE;
    for (k, &lane) in vehicle.route.lanes().iter().enumerate() {
        if begins > horizon_m {
            break;
        }
        let from = if k == 0 { vehicle.arc_m } else { f32::NEG_INFINITY };
        found = found.nearer(first_ahead(occupancy, lane, [own, except], begins, from));
        if found.gap_m < begins + tracks.length(lane) - 10.0 {
            break;
        }
        begins += tracks.length(lane);
    }
    found
}

/// Returns the nearest occupant of `lane` other than `except` whose front is ahead of the bumper, which lies
/// at arc length `-begins`. With [`NONE`], all occupants count.
pub(crate) fn first_ahead(
    occupancy: &Occupancy,
    lane: u32,
    [own, except]: [u32; 2],
    begins: f32,
    middle_from: f32,
) -> Leader {
    let mut found = Leader::NONE;
    for occupant in occupancy.on(lane) {
        let nose = begins + occupant.front_m;
        let middle = 0.5 * (occupant.front_m + occupant.rear_m);
        if !occupancy.reacts_to(own, occupant.agent)
            || occupant.agent == except
            || middle < middle_from
        {
            continue;
        }
        if nose < 0.0 || (nose == 0.0 && occupant.agent > own) {
            continue;
        }
        let gap_m = begins + occupant.rear_m;
        if gap_m < found.gap_m {
            found = Leader {
                gap_m,
                speed_mps: occupant.speed_mps,
                agent: occupant.agent,
                aligned: occupant.aligned,
            };
        }
    }
    found
}
