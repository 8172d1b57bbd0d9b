//! The planner of all vehicles on autopilot and of the traffic lights.

use std::sync::Arc;

use crate::{
    agents::Agents,
    car_following::{self, SpeedPolicy},
    demand::Demand,
    detectors, drive,
    drivers::{Driver, Drivers},
    emergency::Emergencies,
    junction::{self, Junctions},
    lamps, lane_change,
    leader::{self, Leader},
    map::{self, Map},
    meeting, merging,
    obstacles::{self, Obstacle},
    occupancy::Occupancy,
    params::Params,
    passing, pedals,
    prop_waits::{self, PropWait},
    recover, route,
    spread::{Spread, Threads},
    standstill::{self, QueueHead, Standstill, Stays},
    state::{PlannerState, RestoreError},
    tracks::lookup::Memo,
    vehicle_plan::{IntendedMotion, VehiclePlan},
    vehicle_table::Vehicle,
    walkers,
};
use bake::Cache;
use glam::Vec3;
use protocol::{
    ActorId, ActorState, JournalEntry, LightState, TrafficParts, VehicleControl, WalkerControl,
    flag, lamp,
};

/// Plans for every vehicle on autopilot and every traffic light, one frame at a time.
///
/// It is a pure function: the same map, seed and sequence of snapshots and journals give the same
/// bits. Decisions on frame N act in frame N + 1.
pub struct Planner {
    pub(crate) map: Arc<Map>,
    seed: u64,
    pub(crate) state: PlannerState,
    controls: Vec<VehicleControl>,
    walker_controls: Vec<WalkerControl>,
    lights: Vec<LightState>,
    scratch: Scratch,
    prop_waits: Vec<PropWait>,
    stays: Stays,
    standstills: Vec<Standstill>,
    threads: Threads,
}

/// Data of one frame; kept to reuse its allocations.
#[derive(Default)]
struct Scratch {
    agents: Agents,
    /// By row: the projection of the vehicle onto its route.
    memos: Vec<Memo>,
    occupancy: Occupancy,
    claims: Vec<(u32, u32, f32)>,
    obstacles: Vec<Obstacle>,
    emergencies: Emergencies,
    junctions: Junctions,
    demand: Demand,
    driven_ids: Vec<u32>,
    /// The ids, the seed and the parameters that the columns of settings belong to.
    settings_of: Option<(Vec<u32>, u64, Params)>,
    /// By signal: the state that it shows.
    light_states: Vec<u32>,
    leaders: Vec<Leader>,
    /// The rows of vehicles that a prop is ahead of.
    facing_props: Vec<usize>,
    desired_speeds: Vec<f32>,
    speed_policies: Vec<SpeedPolicy>,
    offsets_left_m: Vec<f32>,
    gaps: Vec<f32>,
    drivers: Drivers,
    ignore_lights: Vec<f32>,
    ignore_signs: Vec<f32>,
    walkers: walkers::Scratch,
}

impl Planner {
    /// Creates a planner for a map. `seed` decides all random turns, and what stands on the sidewalks:
    /// the town is furnished when the first walker is on autopilot.
    pub fn new(network: Arc<road::Network>, seed: u64) -> Planner {
        Planner::of(Arc::new(Map::new(&network, map::furnished_ground(&network, seed))), seed)
    }

    /// As [`Planner::new`], with the town from the cache if possible; otherwise it is kept. `open_drive`
    /// is the text of `network`.
    pub fn with_cached_town(
        cache: &Cache,
        network: Arc<road::Network>,
        open_drive: &str,
        seed: u64,
    ) -> Planner {
        let ground = map::cached_ground(cache, &network, open_drive, seed);
        Planner::of(Arc::new(Map::new(&network, ground)), seed)
    }

    /// As [`Planner::with_cached_town`], with lanes from the cache too.
    pub fn cached(
        cache: &Cache,
        network: &Arc<road::Network>,
        open_drive: &str,
        seed: u64,
    ) -> Planner {
        let ground = map::cached_ground(cache, network, open_drive, seed);
        Planner::of(Arc::new(Map::cached(cache, network, open_drive, ground)), seed)
    }

    /// Returns a planner of the same map that has planned nothing, with another seed.
    pub fn restarted(&self, seed: u64) -> Planner {
        let threads = self.threads.clone();
        Planner { threads, ..Planner::of(Arc::clone(&self.map), seed) }
    }

    /// Plans in this number of threads from now on, where there are enough actors: 1 at first, 0 for
    /// one per core that this process may use, but not more than 8. What is planned does not depend
    /// on it.
    pub fn set_threads(&mut self, threads: usize) {
        self.threads = Threads::new(threads);
    }

    pub(crate) fn of(map: Arc<Map>, seed: u64) -> Planner {
        let clocks = vec![0; map.signals.cycles()];
        Planner {
            map,
            seed,
            state: PlannerState { clocks, ..PlannerState::default() },
            controls: Vec::new(),
            walker_controls: Vec::new(),
            lights: Vec::new(),
            scratch: Scratch::default(),
            prop_waits: Vec::new(),
            stays: Stays::default(),
            standstills: Vec::new(),
            threads: Threads::new(1),
        }
    }

    /// Plans on the snapshot of one frame: its `actors`, and its commands in `journal`.
    /// `delta_nanos` is the length of a frame.
    pub fn plan(&mut self, delta_nanos: u64, actors: &[ActorState], journal: &[JournalEntry]) {
        let mut sorted = Vec::new();
        let actors = if actors.is_sorted_by_key(|actor| actor.actor_id.0) {
            actors
        } else {
            sorted.extend_from_slice(actors);
            sorted.sort_unstable_by_key(|actor| actor.actor_id.0);
            &sorted
        };
        self.apply(journal);
        let threads = self.threads.clone();
        threads.run(actors.len(), |spread| self.plan_frame(delta_nanos, actors, spread));
    }

    /// Plans on the snapshot of one frame, `spread` over threads.
    fn plan_frame(&mut self, delta_nanos: u64, actors: &[ActorState], spread: Spread) {
        self.read(actors, spread);
        self.locate(spread);
        self.perceive(spread);
        self.show_lights(actors);
        self.arbitrate(delta_nanos, spread);
        self.look_ahead(spread);
        self.change_lanes(delta_nanos, spread);
        self.drive(delta_nanos, spread);
        self.lead(delta_nanos);
        prop_waits::find(
            &self.state.vehicles,
            &self.map.tracks,
            &self.scratch.agents,
            &self.scratch.leaders,
            &self.scratch.facing_props,
            seconds(delta_nanos),
            &mut self.prop_waits,
        );
        let view = standstill::View {
            vehicles: &self.state.vehicles,
            agents: &self.scratch.agents,
            leaders: &self.scratch.leaders,
            junctions: &self.scratch.junctions,
        };
        self.stays.find(&view, seconds(delta_nanos), spread, &mut self.standstills);
        self.plan_lights(actors, delta_nanos, spread);
    }

    /// Returns the controls of every vehicle on autopilot, ascending by actor id.
    pub fn controls(&self) -> &[VehicleControl] {
        &self.controls
    }

    /// Returns the controls of every walker on autopilot, ascending by actor id.
    pub fn walker_controls(&self) -> &[WalkerControl] {
        &self.walker_controls
    }

    /// Returns everything that was decided in the last frame; `planner` is the result of
    /// [`Planner::save`].
    pub fn parts<'a>(&'a self, planner: &'a [u8]) -> TrafficParts<'a> {
        TrafficParts {
            controls: &self.controls,
            walkers: &self.walker_controls,
            lights: &self.lights,
            planner,
        }
    }

    /// Returns the motion that a control of [`Planner::controls`] means for a vehicle in `state`, as
    /// if engine, brakes and tyres did exactly what the planner assumes of them.
    pub fn intended_motion(&self, control: &VehicleControl, state: &ActorState) -> IntendedMotion {
        let body = self.map.bodies.of(state.blueprint);
        let forward = state.pose.rotation() * Vec3::X;
        let backwards = control.flags & flag::REVERSE != 0;
        let direction = if backwards { -1.0 } else { 1.0 };
        let speed_mps = state.velocity().dot(forward);
        let along_mps = direction * speed_mps;
        IntendedMotion {
            direction,
            speed_mps,
            acceleration_mps2: pedals::acceleration(control.throttle, control.brake, along_mps),
            wheel_steer_rad: pedals::wheel_angle_rad(control.steer, body.max_steer_rad, speed_mps),
            wheelbase_m: body.wheelbase_m,
        }
    }

    /// Returns the state of every traffic light that is an actor, ascending by actor id.
    pub fn lights(&self) -> &[LightState] {
        &self.lights
    }

    /// Returns the vehicles that have begun to wait behind a prop which they cannot pass: each wait
    /// once, in the frame in which it has lasted 5 s.
    pub fn new_prop_waits(&self) -> &[PropWait] {
        &self.prop_waits
    }

    /// Returns the vehicles that have stayed in one place for 120 s, with the heads of their queues:
    /// each standstill once, in the frame in which it has lasted that long.
    pub fn new_standstills(&self) -> &[Standstill] {
        &self.standstills
    }

    /// Returns the head of the queue in which a vehicle stood in the last frame; `None` if it is no
    /// vehicle on autopilot near a road.
    pub fn queue_head(&self, vehicle: ActorId) -> Option<QueueHead> {
        let vehicles = &self.state.vehicles[..self.controls.len()];
        let row = vehicles.binary_search_by_key(&vehicle.0, |row| row.id).ok()?;
        let view = standstill::View {
            vehicles: &self.state.vehicles,
            agents: &self.scratch.agents,
            leaders: &self.scratch.leaders,
            junctions: &self.scratch.junctions,
        };
        (vehicles[row].located == 1).then(|| standstill::head(row, &view))
    }

    /// Returns the state that a planner needs beside the next snapshot to continue. Equal planners
    /// have equal bytes.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.save_into(&mut bytes);
        bytes
    }

    /// Writes what [`Planner::save`] returns into a buffer, whose previous content is dropped.
    pub fn save_into(&self, bytes: &mut Vec<u8>) {
        bytes.clear();
        self.state.write(self.seed, self.map.tracks.count(), bytes);
    }

    /// Continues from a state that was saved on the same map, seed included.
    ///
    /// # Errors
    ///
    /// [`RestoreError`] if the bytes are no planner state of this build and map; the planner is
    /// unchanged then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), RestoreError> {
        let (seed, state) =
            PlannerState::read(bytes, self.map.tracks.count(), self.map.signals.cycles())?;
        (self.seed, self.state) = (seed, state);
        self.controls.clear();
        self.walker_controls.clear();
        self.lights.clear();
        (self.stays, self.standstills) = (Stays::default(), Vec::new());
        Ok(())
    }

    /// Returns what was planned for each vehicle on autopilot in the last frame, ascending by actor
    /// id. Vehicles that are near no road are left out.
    pub fn vehicle_plans(&self) -> impl Iterator<Item = VehiclePlan> + '_ {
        let vehicles = &self.state.vehicles;
        (0..self.controls().len())
            .filter(|&row| vehicles[row].located == 1)
            .map(|row| self.vehicle_plan(row))
    }

    /// Returns what was planned for a located row in the last frame.
    fn vehicle_plan(&self, row: usize) -> VehiclePlan {
        let (vehicles, tracks, scratch) = (&self.state.vehicles, &self.map.tracks, &self.scratch);
        let (leader, constraint) = (&scratch.leaders[row], &scratch.junctions.constraints[row]);
        let lane = vehicles[row].route.lane();
        let agent = scratch.agents.driven[row] as usize;
        let tracking_point_m = scratch.agents.body[agent].tracking_point_m();
        let place = scratch.agents.position[agent].truncate()
            + scratch.agents.forward[agent] * tracking_point_m;
        let (on, hint_m) = route::ahead(&vehicles[row], tracks, tracking_point_m);
        let left_m = tracks.project(on, place, hint_m).left_m;
        let id = |agent: u32| scratch.agents.id.get(agent as usize).copied();
        VehiclePlan {
            actor_id: ActorId(vehicles[row].id),
            lane: road::LaneIndex(lane),
            along_m: vehicles[row].arc_m,
            cross_track_error_m: left_m - route::shift_at(&vehicles[row], tracking_point_m).left_m,
            limit_mps: tracks.limit_mps[lane as usize],
            desired_speed_mps: scratch.desired_speeds[row],
            leader: ActorId(id(leader.agent).unwrap_or(ActorId::NONE.0)),
            leader_m: leader.gap_m,
            stop_m: constraint.stop_m,
            merge_m: constraint.merge_leader_m,
            reservation: vehicles[row].reservation,
            waited_s: vehicles[row].wait_s,
            wait_reason: scratch.junctions.waits[row],
            blocker: ActorId(id(scratch.junctions.blocker(row)).unwrap_or(ActorId::NONE.0)),
            reverses: vehicles[row].reverse_s > 0.0,
            is_turning_around: vehicles[row].u_turn == 1,
        }
    }

    /// Returns the seed of random decisions.
    fn random_seed(&self) -> u64 {
        self.state.params.random_seed(self.seed)
    }

    /// Applies the commands of a frame.
    fn apply(&mut self, journal: &[JournalEntry]) {
        for entry in journal {
            self.state.apply(&entry.command, entry.outcome.status);
        }
    }

    /// Reads the agents of a snapshot, and the parameters of each vehicle.
    fn read(&mut self, actors: &[ActorState], spread: Spread) {
        let draws = self.random_seed();
        let scratch = &mut self.scratch;
        scratch.agents.read(actors, &self.map.bodies);
        scratch.driven_ids.clear();
        let agents = &scratch.agents;
        scratch.driven_ids.extend(agents.driven.iter().map(|&agent| agents.id[agent as usize]));
        self.state.vehicles.retain(&scratch.driven_ids);
        self.state.walkers.retain(agents.led.iter().map(|&agent| agents.id[agent as usize]));
        let params = &self.state.params;
        let class = |row: usize| agents.body[agents.driven[row] as usize].class;
        scratch.drivers.update(&scratch.driven_ids, class, draws, params.driver_spread());
        let drivers = scratch.drivers.rows();
        let ids = &scratch.driven_ids;
        let is_same =
            |of: &(Vec<u32>, u64, Params)| of.0 == *ids && (of.1, &of.2) == (draws, params);
        if scratch.settings_of.as_ref().is_some_and(is_same) {
            return;
        }
        let count = ids.len();
        let policy = |row: usize| match (params.speed_mps(ids[row]), &drivers[row]) {
            (Some(mps), _) => SpeedPolicy::Fixed(mps),
            (None, _) if params.sets_speed(ids[row]) => {
                SpeedPolicy::Reduced(params.speed_reduction(ids[row]))
            }
            (None, Driver { speed_factor: factor, top_mps, .. }) => {
                SpeedPolicy::Own { factor: *factor, top_mps: *top_mps }
            }
        };
        spread.map_into(count, &mut scratch.speed_policies, policy);
        let offset_left_m = |row: usize| params.offset_left_m(ids[row]);
        spread.map_into(count, &mut scratch.offsets_left_m, offset_left_m);
        spread.map_into(count, &mut scratch.ignore_signs, |row| params.ignore_signs(ids[row]));
        spread.map_into(count, &mut scratch.ignore_lights, |row| params.ignore_lights(ids[row]));
        spread.map_into(count, &mut scratch.gaps, |row| params.gap_m(ids[row]));
        scratch.settings_of = Some((ids.clone(), draws, params.clone()));
    }

    /// Locates every vehicle on its route.
    fn locate(&mut self, spread: Spread) {
        let (map, draws) = (&self.map, self.random_seed());
        let Scratch { agents, memos, .. } = &mut self.scratch;
        let PlannerState { vehicles, client_routes, .. } = &mut self.state;
        route::locate_all(
            vehicles,
            client_routes,
            &map.tracks,
            &map.grid,
            agents,
            memos,
            (draws, spread),
        );
    }

    /// Determines which agents occupy which tracks and obstruct wide vehicles.
    fn perceive(&mut self, spread: Spread) {
        let draws = self.random_seed();
        let scratch = &mut self.scratch;
        let (vehicles, agents) = (&self.state.vehicles, &scratch.agents);
        spread.list(vehicles.len(), &mut scratch.claims, |row, claims| {
            let vehicle = &vehicles[row];
            if claims_lane(vehicle) {
                claims.push((agents.driven[row], vehicle.route.lane(), vehicle.arc_m));
            }
        });
        let map = &self.map;
        let aside = scratch.claims.iter().map(|&(agent, ..)| agents.row[agent as usize] as usize);
        let passed = passing::passed_props(vehicles, aside, &map.tracks, agents);
        scratch.walkers.clear();
        if !scratch.agents.led.is_empty() {
            let ground = map.walker_ground();
            scratch.walkers.stand(ground, &scratch.agents);
            let Scratch { walkers, agents, claims, .. } = scratch;
            walkers.claims(&self.state.walkers, ground, agents, claims);
        }
        let agents = &scratch.agents;
        scratch.occupancy.apply_ignores(agents, &self.state.params, draws);
        scratch.occupancy.ignore(&passed);
        scratch.occupancy.rebuild(&map.tracks, &map.grid, agents, &scratch.claims, spread);
        let (occupancy, obstacles) = (&scratch.occupancy, &mut scratch.obstacles);
        obstacles::find(vehicles, &map.tracks, agents, occupancy, spread, obstacles);
        meeting::find(vehicles, map, agents, occupancy, spread, obstacles);
    }

    /// Reads the states of the lights from the snapshot; lights that are no actors show their plan.
    fn show_lights(&mut self, actors: &[ActorState]) {
        let (light_states, plan) = (&mut self.scratch.light_states, &self.map.signals);
        light_states.clear();
        light_states.extend((0..plan.count() as u32).map(|s| plan.shows(s, &self.state.clocks)));
        for actor in self.scratch.agents.lights.iter().map(|&index| &actors[index as usize]) {
            if let Some(light) = light_states.get_mut(actor.signal as usize) {
                *light = actor.phase;
            }
        }
    }

    /// Grants reservations for junctions.
    fn arbitrate(&mut self, delta_nanos: u64, spread: Spread) {
        let draws = self.random_seed();
        let scratch = &mut self.scratch;
        let view = junction::View {
            map: &self.map,
            agents: &scratch.agents,
            occupancy: &scratch.occupancy,
            obstacles: &scratch.obstacles,
            lights: &scratch.light_states,
            seed: draws,
            delta_s: seconds(delta_nanos),
            spread,
            ignore_lights: &scratch.ignore_lights,
            ignore_signs: &scratch.ignore_signs,
        };
        scratch.junctions.arbitrate(&mut self.state.vehicles, &mut self.state.reservations, &view);
    }

    /// Determines leader and desired speed of every vehicle.
    fn look_ahead(&mut self, spread: Spread) {
        let scratch = &mut self.scratch;
        let (vehicles, tracks) = (&self.state.vehicles, &self.map.tracks);
        let (agents, occupancy) = (&scratch.agents, &scratch.occupancy);
        let policies = &scratch.speed_policies;
        let results = (&mut scratch.desired_speeds, &mut scratch.leaders);
        spread.map_into_pair(vehicles.len(), results, |row| {
            let vehicle = &vehicles[row];
            if vehicle.located == 0 {
                return (0.0, Leader::NONE);
            }
            let agent = agents.driven[row] as usize;
            let speed = agents.speed(agent);
            let factor = agents.body[agent].curve_speed_factor();
            let mut desired =
                car_following::desired_speed(vehicle, tracks, speed, policies[row], factor);
            if vehicle.passes_prop() {
                desired = desired.min(passing::SPEED_MPS);
            }
            let horizon_m = 30.0 + 4.0 * speed.max(0.0) + 0.25 * speed * speed;
            let mut leader = leader::leader(vehicle, row, tracks, agents, occupancy, horizon_m);
            if recover::has_evaded(vehicles, row, (tracks, agents), &leader) {
                let view = (tracks, agents, occupancy);
                leader = leader::leader_except(leader.agent, vehicle, row, view, horizon_m);
            }
            (desired, leader)
        });
        for obstacle in &scratch.obstacles {
            let leader = &mut scratch.leaders[obstacle.row];
            *leader = leader.nearer(obstacle.leader);
        }
        let constraints = &mut scratch.junctions.constraints;
        let leaders = &scratch.leaders;
        merging::make_room(vehicles, tracks, agents, occupancy, leaders, spread, constraints);
    }

    /// Starts U-turns, passes of props and lane changes.
    fn change_lanes(&mut self, delta_nanos: u64, spread: Spread) {
        let seed = self.random_seed();
        let scratch = &mut self.scratch;
        let tracks = &self.map.tracks;
        let (agents, occupancy) = (&scratch.agents, &scratch.occupancy);
        route::start_u_turns(&mut self.state.vehicles, tracks, agents, occupancy, spread);
        let view = passing::View {
            map: &self.map,
            agents: &scratch.agents,
            occupancy: &scratch.occupancy,
            leaders: &scratch.leaders,
            params: &self.state.params,
            delta_s: seconds(delta_nanos),
            spread,
        };
        passing::plan(&mut self.state.vehicles, &view, &mut scratch.facing_props);
        let view = lane_change::View {
            map: &self.map,
            agents: &scratch.agents,
            occupancy: &scratch.occupancy,
            leaders: &scratch.leaders,
            desired_speeds: &scratch.desired_speeds,
            drivers: scratch.drivers.rows(),
            seed,
            delta_s: seconds(delta_nanos),
            spread,
        };
        let PlannerState { vehicles, params, client_routes, .. } = &mut self.state;
        lane_change::plan(vehicles, params, client_routes, &view);
    }

    /// Plans for the walkers.
    fn lead(&mut self, delta_nanos: u64) {
        self.walker_controls.clear();
        if self.scratch.agents.led.is_empty() {
            return;
        }
        let seed = self.state.params.walker_seed(self.seed);
        let scratch = &mut self.scratch;
        let PlannerState { walkers, client_routes, vehicles, params, clocks, .. } = &mut self.state;
        let view = walkers::View {
            map: &self.map,
            ground: self.map.walker_ground(),
            agents: &scratch.agents,
            occupancy: &scratch.occupancy,
            obstacles: &scratch.obstacles,
            leaders: &scratch.leaders,
            vehicles,
            params,
            light_states: &scratch.light_states,
            clocks,
            seed,
            delta_s: seconds(delta_nanos),
        };
        let memory = &mut scratch.walkers;
        walkers::plan(walkers, client_routes, memory, &view, &mut self.walker_controls);
    }

    /// Turns the decisions into controls.
    fn drive(&mut self, delta_nanos: u64, spread: Spread) {
        let seed = self.random_seed();
        let scratch = &mut self.scratch;
        let PlannerState { vehicles, params, weather, .. } = &mut self.state;
        let (map, agents) = (&self.map, &scratch.agents);
        let (occupancy, emergencies) = (&scratch.occupancy, &mut scratch.emergencies);
        emergencies.find(vehicles, &map.tracks, agents, occupancy, spread);
        let view = drive::View {
            map,
            agents,
            occupancy: &scratch.occupancy,
            light_states: &scratch.light_states,
            leaders: &scratch.leaders,
            emergencies: &scratch.emergencies,
            constraints: &scratch.junctions.constraints,
            desired_speeds: &scratch.desired_speeds,
            offsets_left_m: &scratch.offsets_left_m,
            drivers: scratch.drivers.rows(),
            seed,
            gaps: &scratch.gaps,
        };
        spread.update_into(vehicles, &mut self.controls, |row, vehicle| {
            let actor_id = ActorId(vehicle.id);
            if vehicle.located == 0 {
                // The vehicle stands on a map without roads.
                return VehicleControl { actor_id, brake: 1.0, ..VehicleControl::default() };
            }
            let control = drive::control(vehicle, row, &view, seconds(delta_nanos));
            let mut control = VehicleControl { actor_id, ..control };
            if params.lamps(vehicle.id) {
                let mps = agents.speed(agents.driven[row] as usize);
                let lit = lamps::lamps(vehicle, &map.tracks, weather, &control, mps);
                control.lamps = lamp::SWITCHED | lit;
            }
            control
        });
    }

    /// Advances the signal plan by one frame.
    fn plan_lights(&mut self, actors: &[ActorState], delta_nanos: u64, spread: Spread) {
        let scratch = &mut self.scratch;
        detectors::count(
            &mut scratch.demand,
            &self.map,
            &self.state.vehicles,
            &scratch.agents,
            &scratch.occupancy,
            &scratch.junctions,
            spread,
        );
        let lights = &scratch.light_states;
        let (vehicles, junctions) = (&self.state.vehicles, &scratch.junctions);
        detectors::prefer(&mut scratch.demand, &self.map, vehicles, junctions, lights);
        if !scratch.agents.led.is_empty() {
            scratch.walkers.call(&self.map, &mut scratch.demand);
        }
        self.map.signals.advance(&mut self.state.clocks, &scratch.demand, delta_nanos);
        self.lights.clear();
        for actor in self.scratch.agents.lights.iter().map(|&index| &actors[index as usize]) {
            let phase = self.map.signals.shows(actor.signal, &self.state.clocks);
            self.lights.push(LightState { actor_id: actor.actor_id, phase });
        }
    }
}

/// Returns whether a vehicle has claimed its lane though it may not be on it.
fn claims_lane(vehicle: &Vehicle) -> bool {
    vehicle.shift_m != 0.0 || vehicle.passes_prop()
}

fn seconds(nanos: u64) -> f32 {
    (nanos as f64 * 1e-9) as f32
}
