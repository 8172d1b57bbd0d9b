//! The planner of all vehicles on autopilot and of the traffic lights.

use std::sync::Arc;

use protocol::{ActorState, JournalEntry, LightState, Stamp, VehicleControl, flag, kind, lamp};

use crate::{
    agents::Agents,
    car_following::{self, SpeedPolicy},
    constraint::JunctionConstraint,
    demand::Demand,
    detectors,
    junction::{self, Junctions},
    lamps, lane_change,
    leader::{self, Leader},
    map::Map,
    obstacles::{self, Obstacle},
    occupancy::Occupancy,
    pedals, recover, route,
    state::{PlannerState, RestoreError},
    steer,
    vehicle_plan::VehiclePlan,
};

/// Delay between a decision and the middle of its effect: it acts in the next frame, for one frame.
const DELAY_FRAMES: f32 = 1.0;
/// Delay of the steering system.
const DELAY_STEERING_S: f32 = 0.05;

/// Plans for every vehicle on autopilot and every traffic light, one frame at a time.
///
/// It is a pure function: the same map, seed and sequence of snapshots and journals give the same
/// bits. Decisions on frame N act in frame N + 1.
pub struct Planner {
    pub(crate) map: Arc<Map>,
    seed: u64,
    pub(crate) state: PlannerState,
    controls: Vec<VehicleControl>,
    lights: Vec<LightState>,
    scratch: Scratch,
}

/// Data of one frame; kept to reuse its allocations.
#[derive(Default)]
struct Scratch {
    agents: Agents,
    occupancy: Occupancy,
    claims: Vec<(u32, u32, f32)>,
    obstacles: Vec<Obstacle>,
    junctions: Junctions,
    demand: Demand,
    driven_ids: Vec<u32>,
    /// By signal: the state that it shows.
    light_states: Vec<u32>,
    leaders: Vec<Leader>,
    desired_speeds: Vec<f32>,
    speed_policies: Vec<SpeedPolicy>,
    offsets_left_m: Vec<f32>,
    gaps: Vec<f32>,
    ignore_lights: Vec<f32>,
    ignore_signs: Vec<f32>,
}

impl Planner {
    /// Creates a planner for a map. `seed` decides all random turns.
    pub fn new(network: Arc<road::Network>, seed: u64) -> Planner {
        let map = Map::new(&network);
        let clocks = vec![0; map.signals.cycles()];
        Planner {
            map: Arc::new(map),
            seed,
            state: PlannerState { clocks, ..PlannerState::default() },
            controls: Vec::new(),
            lights: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Plans on one snapshot. `actors` hold at the stamp's frame; `delta_nanos` is the length of a
    /// frame; `journal` holds the commands of this frame.
    pub fn plan(
        &mut self,
        _stamp: &Stamp,
        delta_nanos: u64,
        actors: &[ActorState],
        journal: &[JournalEntry],
    ) {
        let mut sorted = Vec::new();
        let actors = if actors.is_sorted_by_key(|actor| actor.actor_id.0) {
            actors
        } else {
            sorted.extend_from_slice(actors);
            sorted.sort_unstable_by_key(|actor| actor.actor_id.0);
            &sorted
        };
        self.apply(journal);
        self.read(actors);
        self.locate();
        self.perceive();
        self.show_lights(actors);
        self.arbitrate(delta_nanos);
        self.look_ahead();
        self.change_lanes(delta_nanos);
        self.drive(delta_nanos);
        self.plan_lights(actors, delta_nanos);
    }

    /// Returns the controls of every vehicle on autopilot, ascending by actor id.
    pub fn controls(&self) -> &[VehicleControl] {
        &self.controls
    }

    /// Returns the state of every traffic light that is an actor, ascending by actor id.
    pub fn lights(&self) -> &[LightState] {
        &self.lights
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
        self.lights.clear();
        Ok(())
    }

    /// Returns what was planned for each vehicle on autopilot in the last frame, ascending by actor
    /// id. Vehicles that are near no road are left out.
    pub fn vehicle_plans(&self) -> impl Iterator<Item = VehiclePlan> + '_ {
        let vehicles = &self.state.vehicles;
        (0..self.controls().len())
            .filter(|&row| vehicles.located[row] == 1)
            .map(|row| self.vehicle_plan(row))
    }

    fn vehicle_plan(&self, row: usize) -> VehiclePlan {
        let (vehicles, tracks, scratch) = (&self.state.vehicles, &self.map.tracks, &self.scratch);
        let (leader, constraint) = (&scratch.leaders[row], &scratch.junctions.constraints[row]);
        let lane = vehicles.route[row].lane();
        let agent = scratch.agents.driven[row] as usize;
        let tracking_point_m = scratch.agents.body[agent].tracking_point_m();
        let place = scratch.agents.position[agent].truncate()
            + scratch.agents.forward[agent] * tracking_point_m;
        let (on, hint_m) = route::ahead(vehicles, row, tracks, tracking_point_m);
        let left_m = tracks.project(on, place, hint_m).left_m;
        let id = |agent: u32| scratch.agents.id.get(agent as usize).copied();
        VehiclePlan {
            actor_id: protocol::ActorId(vehicles.id[row]),
            lane: road::LaneIndex(lane),
            along_m: vehicles.arc_m[row],
            cross_track_error_m: left_m - route::shift_at(vehicles, row, tracking_point_m).0,
            limit_mps: tracks.limit_mps[lane as usize],
            desired_speed_mps: scratch.desired_speeds[row],
            leader: protocol::ActorId(id(leader.agent).unwrap_or(protocol::ActorId::NONE.0)),
            leader_m: leader.gap_m,
            stop_m: constraint.stop_m,
            merge_m: constraint.merge_leader_m,
            reservation: vehicles.reservation[row],
            waited_s: vehicles.wait_s[row],
            wait_reason: scratch.junctions.waits[row],
            blocker: protocol::ActorId(
                id(scratch.junctions.blockers[row]).unwrap_or(protocol::ActorId::NONE.0),
            ),
            reverses: vehicles.reverse_s[row] > 0.0,
            is_turning_around: vehicles.u_turn[row] == 1,
        }
    }

    /// Returns the seed of random decisions.
    fn random_seed(&self) -> u64 {
        self.state.params.random_seed(self.seed)
    }

    fn apply(&mut self, journal: &[JournalEntry]) {
        for entry in journal {
            self.state.apply(&entry.command, entry.outcome.status);
        }
    }

    fn read(&mut self, actors: &[ActorState]) {
        let scratch = &mut self.scratch;
        scratch.agents.read(actors, &self.map.bodies);
        scratch.driven_ids.clear();
        let agents = &scratch.agents;
        scratch.driven_ids.extend(agents.driven.iter().map(|&agent| agents.id[agent as usize]));
        self.state.vehicles.retain(&scratch.driven_ids);
        let params = &self.state.params;
        let param = |column: &mut Vec<f32>, of: &dyn Fn(u32) -> f32| {
            column.clear();
            column.extend(scratch.driven_ids.iter().map(|&id| of(id)));
        };
        scratch.speed_policies.clear();
        scratch.speed_policies.extend(scratch.driven_ids.iter().map(
            |&id| match params.speed_mps(id) {
                Some(mps) => SpeedPolicy::Fixed(mps),
                None => SpeedPolicy::Reduced(params.speed_reduction(id)),
            },
        ));
        param(&mut scratch.offsets_left_m, &|id| params.offset_left_m(id));
        param(&mut scratch.ignore_signs, &|id| params.ignore_signs(id));
        param(&mut scratch.gaps, &|id| params.gap_m(id));
        param(&mut scratch.ignore_lights, &|id| params.ignore_lights(id));
    }

    fn locate(&mut self) {
        let (map, agents, draws) = (&self.map, &self.scratch.agents, self.random_seed());
        let PlannerState { vehicles, client_routes, .. } = &mut self.state;
        route::locate_all(vehicles, client_routes, &map.tracks, &map.grid, agents, draws);
    }

    fn perceive(&mut self) {
        let draws = self.random_seed();
        let scratch = &mut self.scratch;
        let vehicles = &self.state.vehicles;
        scratch.claims.clear();
        for row in (0..vehicles.id.len()).filter(|&row| vehicles.shift_m[row] != 0.0) {
            scratch.claims.push((
                scratch.agents.driven[row],
                vehicles.route[row].lane(),
                vehicles.arc_m[row],
            ));
        }
        let map = &self.map;
        scratch.occupancy.apply_ignores(&scratch.agents, &self.state.params, draws);
        scratch.occupancy.rebuild(&map.tracks, &map.grid, &scratch.agents, &scratch.claims);
        obstacles::find(vehicles, &map.tracks, &scratch.agents, &mut scratch.obstacles);
        let (agents, occupancy) = (&scratch.agents, &scratch.occupancy);
        scratch.obstacles.retain(|obstacle| {
            occupancy.reacts_to(agents.driven[obstacle.row], obstacle.leader.agent)
        });
    }

    /// Reads the states of the lights from the snapshot; lights that are no actors show their plan.
    fn show_lights(&mut self, actors: &[ActorState]) {
        let (light_states, plan) = (&mut self.scratch.light_states, &self.map.signals);
        light_states.clear();
        light_states.extend((0..plan.count() as u32).map(|s| plan.shows(s, &self.state.clocks)));
        for actor in actors.iter().filter(|actor| actor.kind == kind::TRAFFIC_LIGHT) {
            if let Some(light) = light_states.get_mut(actor.signal as usize) {
                *light = actor.phase;
            }
        }
    }

    fn arbitrate(&mut self, delta_nanos: u64) {
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
            ignore_lights: &scratch.ignore_lights,
            ignore_signs: &scratch.ignore_signs,
        };
        scratch.junctions.arbitrate(&mut self.state.vehicles, &mut self.state.reservations, &view);
    }

    fn look_ahead(&mut self) {
        let scratch = &mut self.scratch;
        let (vehicles, tracks) = (&self.state.vehicles, &self.map.tracks);
        scratch.leaders.clear();
        scratch.desired_speeds.clear();
        for row in 0..vehicles.id.len() {
            if vehicles.located[row] == 0 {
                scratch.leaders.push(Leader::NONE);
                scratch.desired_speeds.push(0.0);
                continue;
            }
            let agent = scratch.agents.driven[row] as usize;
            let speed = scratch.agents.speed(agent);
            let curve_speed_factor = scratch.agents.body[agent].curve_speed_factor();
            let desired = car_following::desired_speed(
                vehicles,
                row,
                tracks,
                speed,
                scratch.speed_policies[row],
                curve_speed_factor,
            );
            scratch.desired_speeds.push(desired);
            scratch.leaders.push(leader::leader(
                vehicles,
                row,
                tracks,
                &scratch.agents,
                &scratch.occupancy,
                30.0 + 4.0 * speed.max(0.0) + 0.25 * speed * speed,
            ));
        }
        for obstacle in &scratch.obstacles {
            let leader = &mut scratch.leaders[obstacle.row];
            *leader = leader.nearer(obstacle.leader);
        }
    }

    fn change_lanes(&mut self, delta_nanos: u64) {
        let scratch = &self.scratch;
        for row in 0..self.state.vehicles.id.len() {
            if self.state.vehicles.located[row] == 1 {
                route::start_u_turn(
                    &mut self.state.vehicles,
                    row,
                    &self.map.tracks,
                    &scratch.agents,
                    &scratch.occupancy,
                );
            }
        }
        let load = route::LaneLoad::count(&self.state.vehicles, &self.map.tracks);
        let view = lane_change::View {
            map: &self.map,
            load: &load,
            agents: &scratch.agents,
            occupancy: &scratch.occupancy,
            leaders: &scratch.leaders,
            desired_speeds: &scratch.desired_speeds,
            seed: self.random_seed(),
            delta_s: seconds(delta_nanos),
        };
        let PlannerState { vehicles, params, client_routes, .. } = &mut self.state;
        lane_change::plan(vehicles, params, client_routes, &view);
    }

    fn drive(&mut self, delta_nanos: u64) {
        self.controls.clear();
        for row in 0..self.state.vehicles.id.len() {
            let control = if self.state.vehicles.located[row] == 1 {
                self.drive_one(row, seconds(delta_nanos))
            } else {
                // The vehicle stands on a map without roads.
                VehicleControl { brake: 1.0, ..VehicleControl::default() }
            };
            let actor_id = protocol::ActorId(self.state.vehicles.id[row]);
            let lamps = self.lamps(row, &control);
            self.controls.push(VehicleControl { actor_id, lamps, ..control });
        }
    }

    /// Returns the lights of a vehicle that switches them automatically.
    fn lamps(&self, row: usize, control: &VehicleControl) -> u32 {
        let PlannerState { vehicles, params, weather, .. } = &self.state;
        if !params.lamps(vehicles.id[row]) || vehicles.located[row] == 0 {
            return 0;
        }
        let agents = &self.scratch.agents;
        let mps = agents.speed(agents.driven[row] as usize);
        lamp::SWITCHED | lamps::lamps(vehicles, row, &self.map.tracks, weather, control, mps)
    }

    fn drive_one(&mut self, row: usize, delta_s: f32) -> VehicleControl {
        let (scratch, map) = (&self.scratch, &self.map);
        let (vehicles, agents, tracks) = (&mut self.state.vehicles, &scratch.agents, &map.tracks);
        let agent = agents.driven[row] as usize;
        let speed = agents.speed(agent);
        let (front_m, max_steer_rad) =
            (agents.body[agent].front_m, agents.body[agent].max_steer_rad);

        let delay_s = DELAY_FRAMES * delta_s + DELAY_STEERING_S;
        let (wheels, deviation) =
            steer::steer(vehicles, row, tracks, agents, delay_s, scratch.offsets_left_m[row]);
        let off_track = recover::is_off_track(&deviation);

        let mut leader = scratch.leaders[row];
        if vehicles.shift_m[row] != 0.0 {
            leader = self.leader_beside(row, leader);
        }
        let vehicles = &mut self.state.vehicles;
        let mut constraint = scratch.junctions.constraints[row];
        let end_m = car_following::route_end(vehicles, row, tracks, front_m);
        if end_m < 100.0 {
            let last = vehicles.route[row].last();
            let back = tracks.u_turn_lane[last as usize] != crate::tracks::NONE;
            let room_m = if back { route::U_TURN_ROOM_M } else { 1.0 };
            constraint.stop_m = constraint.stop_m.min((end_m - room_m).max(0.0));
        }
        stop_at_midblock_signals(
            map,
            vehicles,
            row,
            &scratch.light_states,
            front_m,
            speed,
            &mut constraint,
        );
        let mut desired = scratch.desired_speeds[row];
        if off_track {
            desired = desired.min(recover::OFF_TRACK_MPS);
        }
        let mut accel = car_following::accelerate(
            speed.max(0.0),
            desired,
            &leader,
            &constraint,
            scratch.gaps[row],
        );
        if off_track && !recover::is_free(agents, agent, 1.0, 1.0 + speed.max(0.0)) {
            accel = accel.min(-3.0);
        }

        let maneuver = recover::decide(vehicles, row, agents, &deviation, &leader, accel, delta_s);
        if maneuver == recover::Maneuver::Hold {
            accel = accel.min(-1.0);
        }
        if maneuver == recover::Maneuver::Reverse {
            let backward = -speed;
            let mut accel_integral = vehicles.accel_integral[row];
            let pressed = pedals::press(
                recover::reverse_accel(backward),
                -agents.acceleration[agent],
                backward,
                -agents.pitch_sin[agent],
                delta_s,
                &mut accel_integral,
            );
            vehicles.accel_integral[row] = accel_integral;
            let angle = -wheels.clamp(-0.6, 0.6);
            return control(
                pressed,
                pedals::steer_input(angle, max_steer_rad, speed),
                flag::REVERSE,
            );
        }
        let mut accel_integral = vehicles.accel_integral[row];
        let pressed = pedals::press(
            accel,
            agents.acceleration[agent],
            speed,
            agents.pitch_sin[agent],
            delta_s,
            &mut accel_integral,
        );
        vehicles.accel_integral[row] = accel_integral;
        control(pressed, pedals::steer_input(wheels, max_steer_rad, speed), 0)
    }

    /// During a lane change, the leader on the lane that is left counts too, unless the vehicle
    /// will be clear of it.
    fn leader_beside(&self, row: usize, leader: Leader) -> Leader {
        let (vehicles, tracks) = (&self.state.vehicles, &self.map.tracks);
        let (scratch, full) = (&self.scratch, vehicles.shift_m[row]);
        let own = scratch.agents.driven[row];
        let body = scratch.agents.body[own as usize];
        let mut begins = -vehicles.arc_m[row] - body.front_m;
        for &lane in vehicles.route[row].lanes() {
            if begins > vehicles.shift_over_m[row] {
                break;
            }
            let index = lane as usize;
            let beside = if full > 0.0 { tracks.left[index] } else { tracks.right[index] };
            if beside == crate::tracks::NONE {
                break;
            }
            // Neighbouring lanes run side by side but may differ in length.
            let scale = tracks.length(beside) / tracks.length(lane).max(0.1);
            let from = if begins < 0.0 { vehicles.arc_m[row] * scale } else { f32::NEG_INFINITY };
            let start =
                if begins < 0.0 { -vehicles.arc_m[row] * scale - body.front_m } else { begins };
            let old = leader::first_ahead(&scratch.occupancy, beside, own, start, from);
            if old.gap_m.is_finite() {
                let (there, _) = route::shift_at(vehicles, row, old.gap_m.max(0.0));
                let apart = full.abs() - there.abs();
                let clear =
                    body.half_width_m + scratch.agents.body[old.agent as usize].half_width_m;
                return if apart < clear + 0.3 && old.gap_m < leader.gap_m { old } else { leader };
            }
            begins += tracks.length(lane);
        }
        leader
    }

    fn plan_lights(&mut self, actors: &[ActorState], delta_nanos: u64) {
        let scratch = &mut self.scratch;
        detectors::count(
            &mut scratch.demand,
            &self.map,
            &self.state.vehicles,
            &scratch.agents,
            &scratch.occupancy,
            &scratch.junctions,
        );
        self.map.signals.advance(&mut self.state.clocks, &scratch.demand, delta_nanos);
        self.lights.clear();
        for actor in actors.iter().filter(|actor| actor.kind == kind::TRAFFIC_LIGHT) {
            let phase = self.map.signals.shows(actor.signal, &self.state.clocks);
            self.lights.push(LightState { actor_id: actor.actor_id, phase });
        }
    }
}

/// Adds stops before mid-block traffic lights.
fn stop_at_midblock_signals(
    map: &Map,
    vehicles: &crate::vehicle_table::VehicleTable,
    row: usize,
    light_states: &[u32],
    front_m: f32,
    speed: f32,
    constraint: &mut JunctionConstraint,
) {
    let midblock = &map.approaches.midblock;
    if midblock.is_empty() {
        return;
    }
    let mut begins = -vehicles.arc_m[row] - front_m;
    for &lane in vehicles.route[row].lanes() {
        if begins > 200.0 {
            return;
        }
        let from = midblock.partition_point(|stop| stop.0 < lane);
        for &(_, arc_m, signal) in midblock[from..].iter().take_while(|stop| stop.0 == lane) {
            let line_m = begins + arc_m - 0.5;
            let light = light_states[signal as usize];
            let stops = light == protocol::light::RED || light == protocol::light::YELLOW;
            if stops && line_m > -0.5 && speed * speed < 6.0 * line_m.max(0.1) {
                constraint.stop_m = constraint.stop_m.min(line_m.max(0.0));
            }
        }
        begins += map.tracks.length(lane);
    }
}

fn control(pressed: pedals::Pedals, steer: f32, flags: u32) -> VehicleControl {
    VehicleControl {
        flags,
        throttle: pressed.throttle,
        brake: pressed.brake,
        steer,
        ..VehicleControl::default()
    }
}

fn seconds(nanos: u64) -> f32 {
    (nanos as f64 * 1e-9) as f32
}
