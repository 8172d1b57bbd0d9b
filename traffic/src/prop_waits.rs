//! Vehicles that wait behind a prop, for the log.

use std::collections::BTreeMap;

use crate::{
    agents::Agents,
    leader::Leader,
    tracks::{NONE, Tracks},
    vehicle_table::VehicleTable,
};

/// Time at standstill behind a prop after which it is reported.
const REPORT_S: f32 = 5.0;
/// Largest gap at which a standing vehicle waits for its leader.
const GAP_M: f32 = 15.0;

/// A vehicle that cannot pass a prop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PropWait {
    /// The actor id of the vehicle.
    pub vehicle: u32,
    /// The actor id of the prop.
    pub prop: u32,
    /// Whether the road has another lane beside the vehicle's.
    pub has_lane_beside: bool,
}

/// The vehicles that wait behind props. They decide nothing, so that they are no part of the
/// planner's state.
#[derive(Default)]
pub(crate) struct PropWaits {
    /// By vehicle: the prop, and the time at standstill behind it.
    waiting: BTreeMap<u32, (u32, f32)>,
    /// Those that were found in the last frame for the first time.
    new: Vec<PropWait>,
}

impl PropWaits {
    /// Returns the waits that began to be reported in the last frame: each once.
    pub(crate) fn new_waits(&self) -> &[PropWait] {
        &self.new
    }

    /// Finds the vehicles that wait.
    pub(crate) fn update(
        &mut self,
        vehicles: &VehicleTable,
        tracks: &Tracks,
        agents: &Agents,
        leaders: &[Leader],
        delta_s: f32,
    ) {
        self.new.clear();
        let mut before = std::mem::take(&mut self.waiting);
        for (row, leader) in leaders.iter().enumerate() {
            let is_held = leader.gap_m < GAP_M && agents.is_standing_prop(leader.agent);
            if !is_held || agents.speed(agents.driven[row] as usize).abs() > 0.3 {
                continue;
            }
            let (vehicle, prop) = (vehicles.id[row], agents.id[leader.agent as usize]);
            let waited_s = before.remove(&vehicle).filter(|(of, _)| *of == prop);
            let waited_s = waited_s.map_or(0.0, |(_, secs)| secs);
            let now_s = waited_s + delta_s;
            if waited_s < REPORT_S && now_s >= REPORT_S {
                let lane = vehicles.route[row].lane() as usize;
                let has_lane_beside = tracks.left[lane] != NONE || tracks.right[lane] != NONE;
                self.new.push(PropWait { vehicle, prop, has_lane_beside });
            }
            self.waiting.insert(vehicle, (prop, now_s));
        }
    }
}
