//! Vehicles that wait behind a prop, for the log.

use crate::{
    agents::Agents,
    leader::Leader,
    passing::STANDSTILL_S,
    tracks::{NONE, Tracks},
    vehicle_table::VehicleTable,
};

/// A vehicle that cannot pass a prop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PropWait {
    /// The actor id of the vehicle.
    pub vehicle: u32,
    /// The actor id of the prop.
    pub prop: u32,
    /// Whether the road has another lane beside the vehicle's in its direction.
    pub has_lane_beside: bool,
}

/// Lists the vehicles that have stood behind a prop for [`STANDSTILL_S`] since this frame, of the rows
/// that are `facing` one.
pub(crate) fn find(
    vehicles: &VehicleTable,
    tracks: &Tracks,
    agents: &Agents,
    leaders: &[Leader],
    facing: &[usize],
    delta_s: f32,
    found: &mut Vec<PropWait>,
) {
    found.clear();
    for &row in facing {
        let waited_s = vehicles[row].prop_wait_s;
        if waited_s >= STANDSTILL_S && waited_s - delta_s < STANDSTILL_S {
            let lane = vehicles[row].route.lane() as usize;
            found.push(PropWait {
                vehicle: vehicles[row].id,
                prop: agents.id[leaders[row].agent as usize],
                has_lane_beside: tracks.left[lane] != NONE || tracks.right[lane] != NONE,
            });
        }
    }
}
