//! Requests: which vehicles need a reservation, for which lanes, and in which order they are
//! assessed.

use protocol::light;

use super::state::{
    BRAKE_MPS2, Junctions, LINE_GAP_M, Request, STANDING_GAP_M, View, YELLOW_BRAKE_MPS2,
    reserved_lanes,
};
use crate::{
    approach::Sign,
    occupancy::ordered,
    random::{Purpose, unit},
    signals::LEFT_TURN_RAD,
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Waiting time at the line after which rank does not count.
const PATIENCE_S: f32 = 15.0;

/// Length from which a way through a junction is not extended by the next junction.
const CHAIN_M: f32 = 45.0;

impl Junctions {
    /// Returns the state of the light of route lane `k` for this vehicle; off without a light.
    pub(super) fn light(&self, vehicles: &VehicleTable, row: usize, k: usize, view: &View) -> u32 {
        let lane = vehicles.route[row].lanes()[k] as usize;
        let signal = view.map.approaches.signal[lane];
        if signal == NONE {
            return light::OFF;
        }
        let fraction = view.ignore_lights[row];
        let nth = u64::from(vehicles.route[row].lanes_passed.wrapping_add(k as u32));
        if fraction > 0.0 && unit(view.seed, vehicles.id[row], Purpose::Light, nth) < fraction {
            return light::GREEN;
        }
        view.lights[signal as usize]
    }

    /// Returns the sign before route lane `k`, if this vehicle obeys it.
    pub(super) fn sign(&self, vehicles: &VehicleTable, row: usize, k: usize, view: &View) -> Sign {
        let fraction = view.ignore_signs[row];
        let nth = u64::from(vehicles.route[row].lanes_passed.wrapping_add(k as u32));
        if fraction > 0.0 && unit(view.seed, vehicles.id[row], Purpose::Sign, nth) < fraction {
            return Sign::None;
        }
        view.map.approaches.sign[vehicles.route[row].lanes()[k] as usize]
    }

    /// Returns the request for the next way through a junction without a reservation, if it is
    /// near.
    pub(super) fn request(
        &self,
        vehicles: &VehicleTable,
        row: usize,
        view: &View,
    ) -> Option<Request> {
        let map = view.map;
        let lanes = vehicles.route[row].lanes();
        let agent = view.agents.driven[row] as usize;
        let speed = view.agents.speed(agent).max(0.0);
        let horizon = speed * speed / (2.0 * BRAKE_MPS2) + 2.0 * speed + 15.0;
        let mut k = reserved_lanes(vehicles, row);
        while k < lanes.len() {
            if self.start(row, k) > horizon.max(8.0 * speed) {
                return None;
            }
            if !map.tracks.in_zone(lanes[k]) {
                k += 1;
                continue;
            }
            let to = self.way_end(vehicles, row, k, view);
            let path = &lanes[k..to];
            let contested = path.iter().any(|&lane| !map.conflicts.of(lane).is_empty())
                || map.approaches.signal[lanes[k] as usize] != NONE
                || map.approaches.sign[lanes[k] as usize] == Sign::Stop;
            if !contested {
                k = to;
                continue;
            }
            let entry_m = self.start(row, k);
            let line_m = entry_m - map.approaches.line_m[lanes[k] as usize];
            let light = self.light(vehicles, row, k, view);
            let free_m = (line_m - LINE_GAP_M).max(0.0);
            let late = speed * speed > 2.0 * YELLOW_BRAKE_MPS2 * free_m;
            let red = light == light::RED || (light == light::YELLOW && !late);
            let rank = self.rank(vehicles, row, k, to, light, view);
            return Some(Request { row, from: k, to, line_m, entry_m, rank, from_right: 0, red });
        }
        None
    }

    /// Returns one past the last lane of the way through the junction that begins at `from`. The
    /// way continues through the next junction if there is no room to stand between the two, but
    /// only up to a length: a reservation for half a roundabout would wait for vehicles that wait
    /// behind its holder.
    pub(super) fn way_end(
        &self,
        vehicles: &VehicleTable,
        row: usize,
        from: usize,
        view: &View,
    ) -> usize {
        let tracks = &view.map.tracks;
        let lanes = vehicles.route[row].lanes();
        let body = view.agents.body[view.agents.driven[row] as usize];
        let mut to = from;
        loop {
            while to < lanes.len() && tracks.in_zone(lanes[to]) {
                to += 1;
            }
            let mut room = 0.0;
            let mut next = to;
            while next < lanes.len() && !tracks.in_zone(lanes[next]) {
                room += tracks.length(lanes[next]);
                next += 1;
            }
            if next < lanes.len() {
                room -= view.map.approaches.line_m[lanes[next] as usize];
            }
            let far = self.start(row, to) - self.start(row, from) > CHAIN_M;
            if next < lanes.len() && !far && room < body.length_m() + STANDING_GAP_M {
                to = next;
            } else {
                return to;
            }
        }
    }

    /// Returns the rank of a request; lower goes first.
    pub(super) fn rank(
        &self,
        vehicles: &VehicleTable,
        row: usize,
        from: usize,
        to: usize,
        light: u32,
        view: &View,
    ) -> i32 {
        let map = view.map;
        if vehicles.wait_s[row] > PATIENCE_S {
            return -1;
        }
        let lanes = vehicles.route[row].lanes();
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
                let sign = self.sign(vehicles, row, from, view) != Sign::None;
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
        let bucket = |vehicles: &VehicleTable, request: &Request| {
            // The vehicle that has waited longer goes first, then the one that arrives sooner.
            let speed = view.agents.speed(view.agents.driven[request.row] as usize).max(0.5);
            let soon = (request.line_m.max(0.0) / speed).min(100.0) as u32;
            (u32::MAX - vehicles.wait_s[request.row] as u32, soon)
        };
        let zone = |request: &Request| {
            let lane = vehicles.route[request.row].lanes()[request.from];
            tracks.zone[lane as usize]
        };
        // Those of a zone lie side by side, so that only they are compared.
        let mut by_zone: Vec<(u32, usize)> =
            self.requests.iter().enumerate().map(|(a, request)| (zone(request), a)).collect();
        by_zone.sort_unstable();
        for (of_zone, a) in zone_pairs(&by_zone) {
            let own_request = self.requests[a];
            let lane = vehicles.route[own_request.row].lanes()[own_request.from];
            let heading = tracks.first_tangent(lane);
            let others = of_zone.iter().map(|&(_, other)| &self.requests[other]);
            let from_right = others.filter(|other| {
                let from = vehicles.route[other.row].lanes()[other.from];
                other.rank == own_request.rank
                    && bucket(vehicles, other) == bucket(vehicles, &own_request)
                    && heading.perp_dot(tracks.first_tangent(from)) > 0.5
            });
            self.requests[a].from_right = from_right.count() as u32;
        }
        self.requests
            .sort_by_key(|r| (r.rank, bucket(vehicles, r), r.from_right, ordered(r.line_m), r.row));
    }
}

/// Returns each request with all requests of its zone, of a list that is sorted by zone.
fn zone_pairs(by_zone: &[(u32, usize)]) -> impl Iterator<Item = (&[(u32, usize)], usize)> {
    let zones = by_zone.chunk_by(|a, b| a.0 == b.0);
    zones.flat_map(|of_zone| of_zone.iter().map(move |&(_, request)| (of_zone, request)))
}
