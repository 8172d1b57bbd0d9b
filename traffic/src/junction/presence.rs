//! The vehicles that are in a junction or will be, and their time windows in conflict areas.

use super::presence_list::Presence;
use super::state::{BRAKE_MPS2, Junctions, View, request_lanes, reserved_lanes};
use crate::{
    grid::Pass,
    tracks::NONE,
    vehicle_table::{Vehicle, VehicleTable},
};

/// Largest ratio of a vehicle's speed to the curve speed.
const CURVE_SPEED_OVERSHOOT: f32 = 1.2;

impl Junctions {
    /// Lists the holders of reservations and the vehicles that request one, by lane.
    pub(super) fn list_presences(&mut self, vehicles: &VehicleTable, view: &View) {
        let tracks = &view.map.tracks;
        self.holders.clear(tracks.count());
        self.approaching.clear(tracks.count());
        self.list_leaving(view);
        self.list_starving(vehicles, view);
        let mut presences = std::mem::take(&mut self.presences);
        view.spread.list(self.holding.len(), &mut presences, |index, presences| {
            let (row, _) = self.holding[index];
            let vehicle = &vehicles[row];
            let lanes = vehicle.route.lanes().iter().copied().enumerate();
            let lanes = lanes.take(reserved_lanes(vehicle));
            presences.extend(self.presences_of(vehicle, row, lanes, 0, view));
        });
        presences.iter().for_each(|&presence| self.holders.add(presence));
        // A vehicle that has waited for long goes before others, but not while its exit is blocked:
        // no vehicle could enter the junction then.
        view.spread.list(self.requests.len(), &mut presences, |index, presences| {
            let request = &self.requests[index];
            let is_blocked = request.rank < 0 && self.exit_room(vehicles, request, view).is_err();
            if request.red || is_blocked {
                return;
            }
            let vehicle = &vehicles[request.row];
            let lanes = request_lanes(vehicle.route.lanes(), request);
            let lanes = lanes.map(|(k, &lane)| (k, lane));
            presences.extend(self.presences_of(vehicle, request.row, lanes, request.rank, view));
        });
        presences.iter().for_each(|&presence| self.approaching.add(presence));
        self.presences = presences;
        self.list_external(view);
    }

    /// Returns the presences of a row on those of these `lanes` of its route that lie in conflict zones.
    fn presences_of(
        &self,
        vehicle: &Vehicle,
        row: usize,
        lanes: impl Iterator<Item = (usize, u32)>,
        rank: i32,
        view: &View,
    ) -> impl Iterator<Item = Presence> {
        lanes.filter(|&(_, lane)| view.map.tracks.in_zone(lane)).map(move |(k, lane)| Presence {
            lane,
            agent: view.agents.driven[row],
            start_m: self.start(row, k),
            rank,
            top_mps: self.top_mps(vehicle, row, k, view),
        })
    }

    /// Adds vehicles that clients drive as holders of every lane that they may take.
    pub(super) fn list_external(&mut self, view: &View) {
        let (tracks, agents) = (&view.map.tracks, view.agents);
        for agent in (0..agents.count()).filter(|&agent| agents.row[agent] == NONE) {
            if agents.velocity[agent].length_squared() < 0.25 {
                continue;
            }
            for &Pass { lane, .. } in view.map.grid.near(agents.position[agent].truncate()) {
                let Some(occupant) =
                    view.occupancy.on(lane).iter().find(|o| o.agent == agent as u32)
                else {
                    continue;
                };
                if occupant.aligned < 0.8 || occupant.speed_mps < 0.5 {
                    continue;
                }
                if tracks.in_zone(lane) {
                    let start_m = -occupant.front_m;
                    let top_mps = f32::INFINITY;
                    let agent = agent as u32;
                    self.holders.add(Presence { lane, agent, start_m, rank: 0, top_mps });
                }
                let left_m = tracks.length(lane) - occupant.front_m;
                if left_m < 3.0 * occupant.speed_mps {
                    for &next in tracks.next(lane).iter().filter(|&&l| tracks.in_zone(l)) {
                        self.holders.add(Presence {
                            lane: next,
                            agent: agent as u32,
                            start_m: left_m,
                            rank: 0,
                            top_mps: f32::INFINITY,
                        });
                    }
                }
            }
        }
    }

    /// Returns the time window in which a vehicle may be on a stretch of the lane of its presence.
    pub(super) fn arrival(&self, view: &View, of: &Presence, on: (f32, f32)) -> (f32, f32) {
        self.window(view, of.agent, of.start_m, on, of.lane, of.top_mps)
    }

    /// Returns the highest speed of a row on its way to lane `k` of its route, as far as curves
    /// allow: bounds its earliest arrival.
    pub(super) fn top_mps(&self, vehicle: &Vehicle, row: usize, k: usize, view: &View) -> f32 {
        let speed = view.agents.velocity[view.agents.driven[row] as usize].length();
        let lanes = &vehicle.route.lanes()[..=k];
        let speeds_mps = lanes.iter().map(|&lane| view.map.tracks.top_curve_speed(lane));
        speeds_mps.fold(speed, f32::max) * CURVE_SPEED_OVERSHOOT
    }

    /// Returns the time window in which a vehicle may be on a stretch of a lane, from its earliest
    /// arrival to its latest departure, in seconds from now.
    pub(super) fn window(
        &self,
        view: &View,
        agent: u32,
        start_m: f32,
        on: (f32, f32),
        lane: u32,
        top_mps: f32,
    ) -> (f32, f32) {
        let agent = agent as usize;
        let tracks = &view.map.tracks;
        let speed = view.agents.velocity[agent].length();
        let limit = tracks.limit_mps[lane as usize];
        let factor = view.agents.body[agent].curve_speed_factor();
        let speed_mps = (tracks.curve_speed_at(lane, on.0) * factor).min(limit).max(2.0);
        let enter_m = start_m + on.0;
        let leave_m = start_m + on.1 + view.agents.body[agent].length_m();
        let cruise_mps = view.agents.body[agent].cruise_speed_mps;
        let (late, accel) =
            (cruise_mps.min(0.85 * speed_mps), view.agents.body[agent].least_accel_mps2());
        (
            travel_s(enter_m, speed, top_mps.min(limit * 1.1), 3.0),
            latest_travel_s(leave_m, speed, late, accel),
        )
    }
}

/// Returns the time to drive `distance_m` from `speed`, accelerating by `accel` m/s² up to `top`;
/// not positive if the place lies behind.
pub(super) fn travel_s(distance_m: f32, speed: f32, top: f32, accel: f32) -> f32 {
    if distance_m <= 0.0 {
        return 0.0;
    }
    if speed >= top {
        return distance_m / speed.max(0.1);
    }
    let ramp_m = (top * top - speed * speed) / (2.0 * accel);
    if distance_m <= ramp_m {
        ((speed * speed + 2.0 * accel * distance_m).sqrt() - speed) / accel
    } else {
        (top - speed) / accel + (distance_m - ramp_m) / top
    }
}

/// Returns the latest time to drive `distance_m`: a vehicle faster than `top` slows down to it at
/// once.
fn latest_travel_s(distance_m: f32, speed: f32, top: f32, accel: f32) -> f32 {
    if distance_m <= 0.0 || speed <= top {
        return travel_s(distance_m, speed, top, accel);
    }
    let slowing_m = (speed * speed - top * top) / (2.0 * BRAKE_MPS2);
    if distance_m <= slowing_m {
        (speed - (speed * speed - 2.0 * BRAKE_MPS2 * distance_m).sqrt()) / BRAKE_MPS2
    } else {
        (speed - top) / BRAKE_MPS2 + (distance_m - slowing_m) / top
    }
}
