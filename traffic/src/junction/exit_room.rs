//! Room to stand beyond a junction.

use std::ops::Range;

use protocol::light;

use super::state::{Junctions, Request, STANDING_GAP_M, View, request_lanes, reserved_lanes};
use crate::{occupancy::Occupant, tracks::NONE, vehicle_table::VehicleTable};

/// Waiting time at a line after which others leave room at the exit.
const STARVING_S: f32 = 45.0;
/// Speed below which a vehicle between two junctions stands.
const STANDING_MPS: f32 = 0.5;

impl Junctions {
    /// Returns whether there is room to stand beyond the junction, or else the agent that takes it
    /// (an index into the agents), or [`NONE`] if vehicles with reservations will.
    pub(super) fn exit_room(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        let (tracks, row) = (&view.map.tracks, request.row);
        let lanes = vehicles[row].route.lanes();
        if request.to >= lanes.len() {
            return Ok(());
        }
        let own = view.agents.driven[row];
        if let Some(agent) = self.stands_between(vehicles, request, view) {
            return Err(agent);
        }
        let exit = lanes[request.to];
        let mut need = view.agents.body[own as usize].length_m() + STANDING_GAP_M;
        for &holder in self.leaving_to.of(exit) {
            let holder = holder as usize;
            if holder == row || vehicles[holder].reservation == 0 || vehicles[holder].located == 0 {
                continue;
            }
            let end = reserved_lanes(&vehicles[holder]);
            let route = vehicles[holder].route.lanes();
            if end > 0 && end < route.len() && route[end] == exit {
                let body = view.agents.body[view.agents.driven[holder] as usize];
                need += body.length_m() + STANDING_GAP_M;
            }
        }
        need += self.room_of_starving(vehicles, request, exit, view);
        let begin = self.start(row, request.to);
        let (mut room, mut blocker) = (f32::INFINITY, own);
        for (k, &lane) in lanes.iter().enumerate().skip(request.to) {
            let start = self.start(row, k);
            if start - begin > need + 1.0 {
                break;
            }
            if k > request.to && tracks.in_zone(lane) {
                // The first of those that leave by this lane stops here.
                if matches!(self.light(&vehicles[row], row, k, view), light::RED | light::YELLOW) {
                    let free = self.line_m(&vehicles[row], row, k, view) - begin;
                    if free < room {
                        (room, blocker) = (free, NONE);
                    }
                }
                break;
            }
            for occupant in view.occupancy.on(lane) {
                let inside = view.agents.row[occupant.agent as usize];
                let counted = inside != NONE
                    && vehicles[inside as usize].reservation != 0
                    && start + occupant.front_m < begin + 1.0;
                if !view.occupancy.reacts_to(own, occupant.agent)
                    || counted
                    || start + occupant.front_m < begin
                {
                    continue;
                }
                // A moving vehicle makes room until this one arrives, but not beyond its own next
                // line.
                let until_m = if inside == NONE {
                    f32::INFINITY
                } else {
                    self.to_next_line(vehicles, inside as usize, view)
                };
                let gained_m = (2.0 * (occupant.speed_mps - 1.0)).max(0.0).min(until_m.max(0.0));
                let free = start + occupant.rear_m - begin + gained_m;
                if free < room {
                    (room, blocker) = (free, occupant.agent);
                }
            }
        }
        if room >= need { Ok(()) } else { Err(blocker) }
    }

    /// Returns the agent on the way before the last of its junctions that stands between two of them, where
    /// there is no room to stop behind it, or that has no reservation beyond: an index into the agents.
    fn stands_between(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Option<u32> {
        let (tracks, own) = (&view.map.tracks, view.agents.driven[request.row]);
        let way = || request_lanes(vehicles[request.row].route.lanes(), request);
        let (between, &last) = way().filter(|&(_, &lane)| !tracks.in_zone(lane)).last()?;
        let blocks = |occupant: &Occupant, lane: u32| {
            let row = view.agents.row[occupant.agent as usize];
            let is_to_wait = || {
                let vehicle = &vehicles[row as usize];
                let at = vehicle.route.lanes().iter().position(|&on| on == last);
                at.is_some_and(|at| reserved_lanes(vehicle) <= at + 1)
            };
            let stands = !tracks.in_zone(lane) && occupant.speed_mps.abs() < STANDING_MPS;
            (stands || row != NONE && is_to_wait()) && view.occupancy.reacts_to(own, occupant.agent)
        };
        way().take_while(|(k, _)| *k <= between).find_map(|(_, &lane)| {
            let found = view.occupancy.on(lane).iter().find(|occupant| blocks(occupant, lane));
            found.map(|occupant| occupant.agent)
        })
    }

    /// Lists the holders of reservations by the lane beyond their junctions.
    pub(super) fn list_leaving(&mut self, view: &View) {
        self.leaving_to.clear(view.map.tracks.count());
        for &(row, exit) in self.holding.iter().filter(|(_, exit)| *exit != NONE) {
            self.leaving_to.add_row(exit, row as u32);
        }
    }

    /// Lists the requests of vehicles that have waited for long, or will have within this frame.
    pub(super) fn list_starving(&mut self, vehicles: &VehicleTable, view: &View) {
        self.starving.clear();
        for (index, request) in self.requests.iter().enumerate() {
            let exit = vehicles[request.row].route.lanes().get(request.to);
            let is_near = vehicles[request.row].wait_s + 2.0 * view.delta_s > STARVING_S;
            if let Some(&exit) = exit.filter(|_| is_near) {
                self.starving.push((exit, index as u32));
            }
        }
        self.starving.sort_unstable();
    }

    /// Returns the requests of vehicles that have waited for long: the row, and the lanes of its route.
    pub(crate) fn starving(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        self.starving.iter().map(|&(_, index)| {
            let request = &self.requests[index as usize];
            (request.row, request.from..request.to)
        })
    }

    /// Returns the distance to the first line at which a row must stop without a further
    /// reservation.
    fn to_next_line(&self, vehicles: &VehicleTable, row: usize, view: &View) -> f32 {
        let lanes = vehicles[row].route.lanes();
        let next = (reserved_lanes(&vehicles[row])..lanes.len())
            .find(|&k| view.map.tracks.in_zone(lanes[k]));
        next.map_or(f32::INFINITY, |k| {
            self.start(row, k) - view.map.approaches.line_m[lanes[k] as usize]
        })
    }

    /// Returns the room that vehicles need which have waited at other lines for the same exit, for
    /// long and longer than this one. Without it, those that have a green light while the exit
    /// empties would fill it in every cycle.
    fn room_of_starving(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        exit: u32,
        view: &View,
    ) -> f32 {
        let own = (vehicles[request.row].wait_s, request.row);
        let starves = |other: &&Request| {
            let waited_s = vehicles[other.row].wait_s;
            let is_earlier = waited_s > own.0 || (waited_s == own.0 && other.row < own.1);
            other.row != request.row
                && is_earlier
                && waited_s > STARVING_S
                && vehicles[other.row].reservation == 0
                && vehicles[other.row].route.lanes().get(other.to) == Some(&exit)
        };
        let length_m = |row: usize| view.agents.body[view.agents.driven[row] as usize].length_m();
        let begin = self.starving.partition_point(|(lane, _)| *lane < exit);
        let starving = self.starving[begin..]
            .iter()
            .take_while(|(lane, _)| *lane == exit)
            .map(|&(_, index)| &self.requests[index as usize])
            .filter(starves);
        starving.map(|other| length_m(other.row) + STANDING_GAP_M).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;
    use protocol::{ActorId, ActorState, Pose, flag, kind};
    use road::{LaneTypes, Network};

    use super::*;
    use crate::{
        agents::Agents, map::Map, occupancy::Occupancy, spread::Spread, tests::maps,
        vehicle_table::Route,
    };

    /// Vehicles with a speed on the road along x.
    struct Scene {
        map: Map,
        agents: Agents,
        occupancy: Occupancy,
        vehicles: VehicleTable,
    }

    impl Scene {
        /// Places vehicles on autopilot with these positions, speeds and distances from the start of the first
        /// lane of their routes, which lead over these places, and one without autopilot.
        fn new(network: Arc<Network>, led: &[([f32; 3], &[f64])], parked_x: f32) -> Scene {
            let map = Map::new(&network, Box::new(Default::default));
            let actor = |id: usize, x: f32, speed: f32, flags: u32| ActorState {
                actor_id: ActorId(id as u32),
                kind: kind::VEHICLE,
                blueprint: u32::MAX,
                flags,
                pose: Pose::level(Vec3::new(x, -1.75, 0.0), 0.0),
                velocity_mps: [speed, 0.0, 0.0],
                ..ActorState::default()
            };
            let placed = led.iter().enumerate();
            let mut actors: Vec<ActorState> = placed
                .map(|(row, &([x, speed, _], _))| actor(row + 1, x, speed, flag::AUTOPILOT))
                .collect();
            actors.push(actor(led.len() + 1, parked_x, 0.0, 0));
            let (mut agents, mut occupancy) = (Agents::default(), Occupancy::default());
            agents.read(&actors, &map.bodies);
            occupancy.rebuild(&map.tracks, &map.grid, &agents, &[], Spread::Alone);
            let lane = |x: f64| {
                let place = glam::DVec3::new(x, -1.75, 0.0);
                network.nearest(place, LaneTypes::DRIVABLE).expect("a road").lane.0
            };
            let mut vehicles = VehicleTable::default();
            vehicles.retain(&(1..=led.len() as u32).collect::<Vec<_>>());
            for (row, &([.., arc_m], places)) in led.iter().enumerate() {
                vehicles[row].located = 1;
                vehicles[row].arc_m = arc_m;
                vehicles[row].route = Route::from_lane(lane(places[0]), 0);
                places[1..].iter().for_each(|&x| vehicles[row].route.push(lane(x)));
            }
            Scene { map, agents, occupancy, vehicles }
        }

        fn view(&self) -> View<'_> {
            View {
                map: &self.map,
                agents: &self.agents,
                occupancy: &self.occupancy,
                obstacles: &[],
                lights: &[light::GREEN; 8],
                seed: 0,
                delta_s: 0.05,
                spread: Spread::Alone,
                ignore_lights: &[0.0; 2],
                ignore_signs: &[0.0; 2],
            }
        }
    }

    /// Returns the request of a vehicle 8 m before a junction for all but the last of these lanes.
    fn request(row: usize, lanes: usize) -> Request {
        Request {
            row,
            from: 1,
            to: lanes - 1,
            line_m: 8.0,
            entry_m: 8.0,
            speed_mps: 0.0,
            rank: 0,
            from_right: 0,
            red: false,
        }
    }

    /// Returns whether the first of two vehicles that have waited this long for the same exit may
    /// take the room there, which suffices for one of them.
    fn has_room(wait_s: [f32; 2]) -> bool {
        // The junction ends at x = 10.
        let places: &[f64] = &[-20.0, 0.0, 20.0];
        let led = [([-20.0, 0.0, 140.0], places), ([-30.0, 0.0, 130.0], places)];
        let mut scene = Scene::new(maps::crossing(), &led, 22.35);
        (0..2).for_each(|row| scene.vehicles[row].wait_s = wait_s[row]);
        let mut junctions = Junctions::default();
        junctions.measure(&scene.vehicles, &scene.view());
        junctions.requests = vec![request(0, 3), request(1, 3)];
        junctions.list_starving(&scene.vehicles, &scene.view());
        junctions.exit_room(&scene.vehicles, &request(0, 3), &scene.view()).is_ok()
    }

    /// Returns whether a vehicle may pass two junctions without room to stand between them, while another one
    /// drives in the first and has a reservation for so many lanes.
    fn passes_both_behind(reserved_lanes: u32) -> bool {
        let places: &[f64] = &[-20.0, 0.0, 13.0, 26.0, 50.0];
        let led = [([-20.0, 0.0, 140.0], places), ([4.0, 2.0, 14.0], &places[1..])];
        let mut scene = Scene::new(maps::two_lit_crossings(26.0), &led, 150.0);
        scene.vehicles[1].reservation = 1;
        scene.vehicles[1].reservation_end = reserved_lanes;
        let mut junctions = Junctions::default();
        junctions.measure(&scene.vehicles, &scene.view());
        junctions.exit_room(&scene.vehicles, &request(0, 5), &scene.view()).is_ok()
    }

    #[test]
    fn no_vehicle_enters_behind_one_that_is_to_wait_before_the_next_junction() {
        assert!(passes_both_behind(3), "it passes both");
        assert!(!passes_both_behind(1), "it passes the first");
    }

    #[test]
    fn a_vehicle_that_has_waited_for_long_keeps_room_at_its_exit() {
        assert!(has_room([0.0, 30.0]), "the first to ask takes it");
        assert!(!has_room([0.0, 60.0]), "the other has waited for long");
        assert!(has_room([70.0, 60.0]), "but not as long");
    }
}
