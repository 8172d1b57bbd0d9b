//! Requests: which vehicles need a reservation, for which lanes, and in which order they are
//! assessed.

use std::ops::Range;

use glam::Vec2;
use protocol::light;

use super::state::{
    BEYOND_M, BRAKE_MPS2, Junctions, LINE_GAP_M, PASSED_M, Request, STANDING_GAP_M, View,
    YELLOW_BRAKE_MPS2, reserved_lanes,
};
use crate::{
    approach::Sign,
    occupancy::ordered,
    random::{Purpose, unit},
    signals::LEFT_TURN_RAD,
    tracks::NONE,
    vehicle_table::{Vehicle, VehicleTable},
};

/// Waiting time at the line after which rank does not count.
const PATIENCE_S: f32 = 15.0;

/// The rank of those that have waited that long.
const RANK_MIN: i32 = -1;
/// Time to the line above which requests are in no order, seconds.
const SOON_MAX: f32 = 100.0;

/// Deceleration up to which a vehicle without a reservation stops at yellow.
const STOP_BRAKE_MPS2: f32 = 5.0;

/// Speed below which a vehicle that has just started from its line can still stop up to [`BEYOND_M`]
/// beyond it.
pub(crate) const STARTING_MPS: f32 = 2.0;

/// Length from which a way through a junction is not extended by the next junction.
const CHAIN_M: f32 = 45.0;

impl Junctions {
    /// Returns the state of the light of route lane `k` for this vehicle; off without a light.
    pub(super) fn light(&self, vehicle: &Vehicle, row: usize, k: usize, view: &View) -> u32 {
        let lane = vehicle.route.lanes()[k] as usize;
        let signal = view.map.approaches.signal[lane];
        if signal == NONE {
            return light::OFF;
        }
        let fraction = view.ignore_lights[row];
        let nth = u64::from(vehicle.route.lanes_passed.wrapping_add(k as u32));
        if fraction > 0.0 && unit(view.seed, vehicle.id, Purpose::Light, nth) < fraction {
            return light::GREEN;
        }
        view.lights[signal as usize]
    }

    /// Returns whether the light before route lane `k` stops this vehicle, which has no reservation
    /// for it: red, or yellow unless the vehicle would come to a stand beyond the line only. It brakes
    /// already, harder than yellow alone would require at last.
    fn must_stop(&self, vehicle: &Vehicle, row: usize, k: usize, view: &View) -> bool {
        if self.has_passed_line(vehicle, row, k, view) {
            return false;
        }
        match self.light(vehicle, row, k, view) {
            light::RED => true,
            light::YELLOW => {
                let speed = view.agents.speed(view.agents.driven[row] as usize);
                let room_m = self.line_m(vehicle, row, k, view) + LINE_GAP_M;
                speed * speed < 2.0 * STOP_BRAKE_MPS2 * room_m
                    || self.can_stop(vehicle, row, k, view)
            }
            _ => false,
        }
    }

    /// Returns whether the front of a vehicle is so far beyond the line of the light before route lane `k`
    /// that no light stops it any more.
    pub(super) fn has_passed_line(
        &self,
        vehicle: &Vehicle,
        row: usize,
        k: usize,
        view: &View,
    ) -> bool {
        let lane = vehicle.route.lanes()[k];
        self.start(row, k) < view.map.approaches.light_line_m[lane as usize] - PASSED_M
    }

    /// Returns whether a vehicle can stop before the line of route lane `k` as a light that turns
    /// yellow requires it. One that has just started from the line would not pass the junction's
    /// begin within the yellow.
    pub(super) fn can_stop(&self, vehicle: &Vehicle, row: usize, k: usize, view: &View) -> bool {
        let speed = view.agents.speed(view.agents.driven[row] as usize);
        let free_m = (self.line_m(vehicle, row, k, view) - LINE_GAP_M).max(0.0);
        let beyond_m = self.line_m(vehicle, row, k, view) + BEYOND_M;
        speed * speed < 2.0 * YELLOW_BRAKE_MPS2 * free_m
            || (speed < STARTING_MPS && speed * speed < 2.0 * YELLOW_BRAKE_MPS2 * beyond_m)
            || speed < 0.5
    }

    /// Returns the distance from the front bumper to the line before route lane `k`.
    pub(super) fn line_m(&self, vehicle: &Vehicle, row: usize, k: usize, view: &View) -> f32 {
        let lane = vehicle.route.lanes()[k];
        self.start(row, k) - view.map.approaches.line_m[lane as usize]
    }

    /// Returns the sign before route lane `k`, if this vehicle obeys it.
    pub(super) fn sign(&self, vehicle: &Vehicle, row: usize, k: usize, view: &View) -> Sign {
        let fraction = view.ignore_signs[row];
        let nth = u64::from(vehicle.route.lanes_passed.wrapping_add(k as u32));
        if fraction > 0.0 && unit(view.seed, vehicle.id, Purpose::Sign, nth) < fraction {
            return Sign::None;
        }
        view.map.approaches.sign[vehicle.route.lanes()[k] as usize]
    }

    /// Returns the request for the next way through a junction without a reservation, if it is
    /// near.
    pub(super) fn request(&self, vehicle: &Vehicle, row: usize, view: &View) -> Option<Request> {
        let map = view.map;
        let lanes = vehicle.route.lanes();
        let agent = view.agents.driven[row] as usize;
        let speed = view.agents.speed(agent).max(0.0);
        let horizon = speed * speed / (2.0 * BRAKE_MPS2) + 2.0 * speed + 15.0;
        let mut k = reserved_lanes(vehicle);
        while k < lanes.len() {
            if self.start(row, k) > horizon.max(8.0 * speed) {
                return None;
            }
            if !map.tracks.in_zone(lanes[k]) {
                k += 1;
                continue;
            }
            let to = self.way_end(vehicle, row, k, view);
            let path = &lanes[k..to];
            let contested = path.iter().any(|&lane| !map.conflicts.of(lane).is_empty())
                || map.approaches.signal[lanes[k] as usize] != NONE
                || map.approaches.sign[lanes[k] as usize] == Sign::Stop;
            if !contested {
                k = to;
                continue;
            }
            let entry_m = self.start(row, k);
            let line_m = self.line_m(vehicle, row, k, view);
            let light = self.light(vehicle, row, k, view);
            let red = (k..to).any(|k| self.must_stop(vehicle, row, k, view));
            let rank = self.rank(vehicle, row, k, to, light, view);
            return Some(Request {
                row,
                from: k,
                to,
                line_m,
                entry_m,
                speed_mps: view.agents.speed(agent),
                rank,
                from_right: 0,
                red,
            });
        }
        None
    }

    /// Returns one past the last lane of the way through the junction that begins at `from`. The
    /// way continues through the next junction if there is no room to stand between the two, but
    /// only up to a length: a reservation for half a roundabout would wait for vehicles that wait
    /// behind its holder.
    pub(super) fn way_end(&self, vehicle: &Vehicle, row: usize, from: usize, view: &View) -> usize {
        let tracks = &view.map.tracks;
        let lanes = vehicle.route.lanes();
        let body = view.agents.body[view.agents.driven[row] as usize];
        let mut to = from;
        loop {
            while to < lanes.len() && tracks.in_zone(lanes[to]) {
                to += 1;
            }
            let mut next = to;
            while next < lanes.len() && !tracks.in_zone(lanes[next]) {
                next += 1;
            }
            let room = if next < lanes.len() {
                self.line_m(vehicle, row, next, view) - self.clear(vehicle, row, from..to, view)
            } else {
                f32::INFINITY
            };
            let far = self.start(row, to) - self.start(row, from) > CHAIN_M;
            if next < lanes.len() && !far && room < body.length_m() + STANDING_GAP_M {
                to = next;
            } else {
                return to;
            }
        }
    }

    /// Returns the distance to the end of the last conflict area of these lanes of the route, or to
    /// the start of the first if there is none.
    fn clear(&self, vehicle: &Vehicle, row: usize, of: Range<usize>, view: &View) -> f32 {
        let wide = view.agents.body[view.agents.driven[row] as usize].is_wide();
        let contested_m = |k: usize| {
            let lane = vehicle.route.lanes()[k] as usize;
            view.map.approaches.contested_m[lane][usize::from(wide)]
        };
        let last = of.clone().rev().find(|&k| contested_m(k) > 0.0);
        last.map_or(self.start(row, of.start), |k| self.start(row, k) + contested_m(k))
    }

    /// Returns the rank of a request; lower goes first.
    pub(super) fn rank(
        &self,
        vehicle: &Vehicle,
        row: usize,
        from: usize,
        to: usize,
        light: u32,
        view: &View,
    ) -> i32 {
        let map = view.map;
        if vehicle.wait_s > PATIENCE_S {
            return RANK_MIN;
        }
        let lanes = vehicle.route.lanes();
        let first = lanes[from] as usize;
        let mut last = from;
        while last + 1 < to && map.tracks.zone[lanes[last + 1] as usize] == map.tracks.zone[first] {
            last += 1;
        }
        let entry_direction = map.tracks.first_tangent(lanes[from]);
        let exit_direction = map.tracks.last_tangent(lanes[last]);
        let left = i32::from(entry_direction.angle_to(exit_direction) > LEFT_TURN_RAD);
        match light {
            light::OFF => {
                let posted = map.approaches.sign[first] != Sign::None;
                let sign = self.sign(vehicle, row, from, view) != Sign::None;
                let low = sign || map.approaches.beside_signals[first];
                // A vehicle that ignores a sign takes its road for a major one.
                let minor = map.approaches.minor[first] && sign == posted;
                left + 2 * i32::from(minor) + 4 * i32::from(low)
            }
            _ => left,
        }
    }

    /// Sorts the requests into the order in which they are assessed.
    pub(super) fn sort_requests(&mut self, vehicles: &VehicleTable, view: &View) {
        let tracks = &view.map.tracks;
        let mut keys = Vec::new();
        view.spread.map_into(self.requests.len(), &mut keys, |index| {
            let request = &self.requests[index];
            let vehicle = &vehicles[request.row];
            let speed = request.speed_mps.max(0.5);
            let soon = (request.line_m.max(0.0) / speed).min(SOON_MAX) as u32;
            let lane = vehicle.route.lanes()[request.from];
            Key {
                zone: tracks.zone[lane as usize],
                rank: request.rank,
                time: (u32::MAX - vehicle.wait_s as u32, soon),
                heading: tracks.first_tangent(lane),
            }
        });
        // Those of a zone lie side by side, so that only they are compared.
        let by_zone = |(index, key): (usize, &Key)| u64::from(key.zone) << 32 | index as u64;
        let mut zones: Vec<u64> = keys.iter().enumerate().map(by_zone).collect();
        zones.sort_unstable();
        let mut order = Vec::with_capacity(keys.len());
        for of_zone in zones.chunk_by(|a, b| a >> 32 == b >> 32) {
            for &index in of_zone {
                let index = index as u32;
                let key = &keys[index as usize];
                let is_right = |other: &&u64| {
                    let other = &keys[**other as u32 as usize];
                    (other.rank, other.time) == (key.rank, key.time)
                        && key.heading.perp_dot(other.heading) > 0.5
                };
                let from_right = of_zone.iter().filter(is_right).count() as u32;
                let request = &mut self.requests[index as usize];
                request.from_right = from_right;
                order.push(key.order(from_right, request.line_m, index));
            }
        }
        order.sort_unstable();
        self.requests = order.iter().map(|of| self.requests[*of as u32 as usize]).collect();
    }
}

/// What decides the order of a request among those of its zone.
struct Key {
    zone: u32,
    rank: i32,
    /// The vehicle that has waited longer goes first, then the one that arrives sooner.
    time: (u32, u32),
    /// Driving direction at the begin of the way.
    heading: Vec2,
}

impl Key {
    /// Returns a number that orders like rank, time, number of vehicles from the right, distance to the line
    /// and index of the request; the index is in its lowest bits. Requests are listed by row.
    fn order(&self, from_right: u32, line_m: f32, index: u32) -> u128 {
        let rank = (self.rank - RANK_MIN) as u8;
        let parts = [
            (u32::from(rank), 8),
            (self.time.0, 32),
            (self.time.1, 8),
            (from_right.min(u16::MAX.into()), 16),
            (ordered(line_m), 32),
            (index, 32),
        ];
        parts.iter().fold(0, |number, &(part, bits)| number << bits | u128::from(part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_order_by_rank_then_time_then_right_then_distance_then_row() {
        let number = |rank: i32, wait_s: u32, soon: u32, from_right: u32, line_m: f32, row: u32| {
            let time = (u32::MAX - wait_s, soon);
            Key { zone: 0, rank, time, heading: Vec2::X }.order(from_right, line_m, row)
        };
        let ascending = [
            number(RANK_MIN, 20, 100, 9, 50.0, 9),
            number(0, 5, 100, 9, 50.0, 9),
            number(0, 0, 1, 9, 50.0, 9),
            number(0, 0, 2, 0, 50.0, 9),
            number(0, 0, 2, 1, -3.0, 9),
            number(0, 0, 2, 1, 4.0, 1),
            number(0, 0, 2, 1, 4.0, 2),
            number(7, 0, 0, 0, -9.0, 0),
        ];
        assert!(ascending.is_sorted_by(|a, b| a < b), "{ascending:x?}");
        assert_eq!(ascending[6] as u32, 2, "the row is in the lowest bits");
    }
}
