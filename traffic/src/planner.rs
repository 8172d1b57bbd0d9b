//! The planner of all vehicles on autopilot, and of the lights.

use std::sync::Arc;

use protocol::{ActorState, JournalEntry, LightState, Stamp, VehicleControl, flag, kind, lamp};

use crate::{
    agents::Crowd,
    change,
    constraint::Halt,
    demand::Demand,
    detectors,
    follow::{self, Pace},
    junction::{self, Junctions},
    lamps,
    leader::{self, Leader},
    map::Map,
    memory::{Memory, MindError},
    occupancy::Occupancy,
    outlook::Outlook,
    pedals, recover, route, steer,
    sweep::{self, Obstacle},
};

/// Frames of delay between a decision and the middle of its effect: it acts in the next frame,
/// for one frame.
const DELAY_FRAMES: f32 = 1.0;
/// And what the steering gear adds.
const DELAY_STEERING_S: f32 = 0.05;

/// Plans for every vehicle on autopilot and every light, one frame at a time.
///
/// Pure: the same map, seed and sequence of snapshots and journals give the same bits. What it
/// decides on frame N is meant to act in frame N + 1.
pub struct Planner {
    pub(crate) map: Arc<Map>,
    seed: u64,
    pub(crate) memory: Memory,
    controls: Vec<VehicleControl>,
    lights: Vec<LightState>,
    scratch: Scratch,
}

/// What lives for one frame only; kept for its allocations.
#[derive(Default)]
struct Scratch {
    crowd: Crowd,
    occupancy: Occupancy,
    claims: Vec<(u32, u32, f32)>,
    obstacles: Vec<Obstacle>,
    junctions: Junctions,
    demand: Demand,
    wanted: Vec<u32>,
    /// By signal.
    shown: Vec<u32>,
    leaders: Vec<Leader>,
    desired_speeds: Vec<f32>,
    paces: Vec<Pace>,
    offsets_left_m: Vec<f32>,
    gaps: Vec<f32>,
    ignore_lights: Vec<f32>,
    ignore_signs: Vec<f32>,
}

impl Planner {
    /// A planner that knows the map and nothing else yet. `seed` decides every random turn.
    pub fn new(network: Arc<road::Network>, seed: u64) -> Planner {
        let map = Map::new(&network);
        let clocks = vec![0; map.signals.cycles()];
        Planner {
            map: Arc::new(map),
            seed,
            memory: Memory { clocks, ..Memory::default() },
            controls: Vec::new(),
            lights: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Plans on one snapshot: `actors` hold at the stamp's frame; `delta_nanos` is how long a frame takes;
    /// `journal` is what was requested for in this frame.
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
        self.heed(journal);
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

    /// Pedals and wheel of every vehicle on autopilot, ascending by actor id.
    pub fn controls(&self) -> &[VehicleControl] {
        &self.controls
    }

    /// The colour of every light that is an actor, ascending by actor id.
    pub fn lights(&self) -> &[LightState] {
        &self.lights
    }

    /// All that must be known beyond the next snapshot in order to go on; equal minds have equal
    /// bytes.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.save_into(&mut bytes);
        bytes
    }

    /// Like [`Planner::save`], into a buffer whose old content is dropped.
    pub fn save_into(&self, bytes: &mut Vec<u8>) {
        bytes.clear();
        self.memory.write(self.seed, self.map.tracks.count(), bytes);
    }

    /// Goes on from a planner that was saved on the same map. The seed comes with it.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), MindError> {
        let (seed, memory) =
            Memory::read(bytes, self.map.tracks.count(), self.map.signals.cycles())?;
        (self.seed, self.memory) = (seed, memory);
        self.controls.clear();
        self.lights.clear();
        Ok(())
    }

    /// What every vehicle on autopilot reckoned with in the last frame, ascending by actor id.
    /// Vehicles that no road is near are left out.
    pub fn outlooks(&self) -> impl Iterator<Item = Outlook> + '_ {
        let rows = &self.memory.rows;
        (0..self.controls().len()).filter(|&row| rows.placed[row] == 1).map(|row| self.outlook(row))
    }

    fn outlook(&self, row: usize) -> Outlook {
        let (rows, tracks, scratch) = (&self.memory.rows, &self.map.tracks, &self.scratch);
        let (leader, halt) = (&scratch.leaders[row], &scratch.junctions.halts[row]);
        let lane = rows.route[row].lane();
        let body = scratch.crowd.driven[row] as usize;
        let lead_m = scratch.crowd.body[body].lead_m();
        let place = scratch.crowd.position[body].truncate() + scratch.crowd.forward[body] * lead_m;
        let (on, hint_m) = route::ahead(rows, row, tracks, lead_m);
        let left_m = tracks.project(on, place, hint_m).left_m;
        let id = |body: u32| scratch.crowd.id.get(body as usize).copied();
        Outlook {
            actor_id: protocol::ActorId(rows.id[row]),
            lane: road::LaneIndex(lane),
            along_m: rows.arc_m[row],
            astray_m: left_m - route::shift_at(rows, row, lead_m).0,
            limit_mps: tracks.limit_mps[lane as usize],
            desired_speed_mps: scratch.desired_speeds[row],
            leader: protocol::ActorId(id(leader.body).unwrap_or(protocol::ActorId::NONE.0)),
            leader_m: leader.gap_m,
            stop_m: halt.stop_m,
            merge_m: halt.behind_m,
            leave: rows.order[row],
            waited_s: rows.wait_s[row],
            waits_for: scratch.junctions.waits[row],
            waits_on: protocol::ActorId(
                id(scratch.junctions.blockers[row]).unwrap_or(protocol::ActorId::NONE.0),
            ),
            reverses: rows.reverse_s[row] > 0.0,
            turns_round: rows.turning[row] == 1,
        }
    }

    /// What random turns and whims are drawn from.
    fn draws(&self) -> u64 {
        self.memory.params.draws(self.seed)
    }

    fn heed(&mut self, journal: &[JournalEntry]) {
        for entry in journal {
            self.memory.heed(&entry.command, entry.outcome.status);
        }
    }

    fn read(&mut self, actors: &[ActorState]) {
        let scratch = &mut self.scratch;
        scratch.crowd.read(actors, &self.map.bodies);
        scratch.wanted.clear();
        let crowd = &scratch.crowd;
        scratch.wanted.extend(crowd.driven.iter().map(|&body| crowd.id[body as usize]));
        self.memory.rows.keep(&scratch.wanted);
        let params = &self.memory.params;
        let param = |column: &mut Vec<f32>, of: &dyn Fn(u32) -> f32| {
            column.clear();
            column.extend(scratch.wanted.iter().map(|&id| of(id)));
        };
        scratch.paces.clear();
        scratch.paces.extend(scratch.wanted.iter().map(|&id| match params.speed_mps(id) {
            Some(mps) => Pace::Fixed(mps),
            None => Pace::Slower(params.slower(id)),
        }));
        param(&mut scratch.offsets_left_m, &|id| params.offset_left_m(id));
        param(&mut scratch.ignore_signs, &|id| params.ignore_signs(id));
        param(&mut scratch.gaps, &|id| params.gap_m(id));
        param(&mut scratch.ignore_lights, &|id| params.ignore_lights(id));
    }

    fn locate(&mut self) {
        let (map, crowd, draws) = (&self.map, &self.scratch.crowd, self.draws());
        let Memory { rows, guides, .. } = &mut self.memory;
        route::follow(rows, guides, &map.tracks, &map.grid, crowd, draws);
    }

    fn perceive(&mut self) {
        let draws = self.draws();
        let scratch = &mut self.scratch;
        let rows = &self.memory.rows;
        scratch.claims.clear();
        for row in (0..rows.id.len()).filter(|&row| rows.shift_m[row] != 0.0) {
            scratch.claims.push((
                scratch.crowd.driven[row],
                rows.route[row].lane(),
                rows.arc_m[row],
            ));
        }
        let map = &self.map;
        scratch.occupancy.overlook(&scratch.crowd, &self.memory.params, draws);
        scratch.occupancy.lay(&map.tracks, &map.grid, &scratch.crowd, &scratch.claims);
        sweep::look(rows, &map.tracks, &scratch.crowd, &mut scratch.obstacles);
        let (crowd, occupancy) = (&scratch.crowd, &scratch.occupancy);
        scratch
            .obstacles
            .retain(|obstacle| occupancy.minds(crowd.driven[obstacle.row], obstacle.leader.body));
    }

    /// Lights count as what they show in the snapshot; those that are no actors, as planned.
    fn show_lights(&mut self, actors: &[ActorState]) {
        let (shown, plan) = (&mut self.scratch.shown, &self.map.signals);
        shown.clear();
        shown.extend((0..plan.count() as u32).map(|s| plan.shows(s, &self.memory.clocks)));
        for actor in actors.iter().filter(|actor| actor.kind == kind::TRAFFIC_LIGHT) {
            if let Some(light) = shown.get_mut(actor.signal as usize) {
                *light = actor.phase;
            }
        }
    }

    fn arbitrate(&mut self, delta_nanos: u64) {
        let draws = self.draws();
        let scratch = &mut self.scratch;
        let view = junction::View {
            map: &self.map,
            crowd: &scratch.crowd,
            occupancy: &scratch.occupancy,
            obstacles: &scratch.obstacles,
            lights: &scratch.shown,
            seed: draws,
            delta_s: seconds(delta_nanos),
            ignore_lights: &scratch.ignore_lights,
            ignore_signs: &scratch.ignore_signs,
        };
        scratch.junctions.arbitrate(&mut self.memory.rows, &mut self.memory.orders, &view);
    }

    fn look_ahead(&mut self) {
        let scratch = &mut self.scratch;
        let (rows, tracks) = (&self.memory.rows, &self.map.tracks);
        scratch.leaders.clear();
        scratch.desired_speeds.clear();
        for row in 0..rows.id.len() {
            if rows.placed[row] == 0 {
                scratch.leaders.push(Leader::NONE);
                scratch.desired_speeds.push(0.0);
                continue;
            }
            let body = scratch.crowd.driven[row] as usize;
            let speed = scratch.crowd.speed(body);
            let curve_share = scratch.crowd.body[body].curve_share();
            let desired =
                follow::desired_pace(rows, row, tracks, speed, scratch.paces[row], curve_share);
            scratch.desired_speeds.push(desired);
            scratch.leaders.push(leader::leader(
                rows,
                row,
                tracks,
                &scratch.crowd,
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
        for row in 0..self.memory.rows.id.len() {
            if self.memory.rows.placed[row] == 1 {
                route::turn_round(
                    &mut self.memory.rows,
                    row,
                    &self.map.tracks,
                    &scratch.crowd,
                    &scratch.occupancy,
                );
            }
        }
        let load = route::Load::count(&self.memory.rows, &self.map.tracks);
        let view = change::View {
            map: &self.map,
            load: &load,
            crowd: &scratch.crowd,
            occupancy: &scratch.occupancy,
            leaders: &scratch.leaders,
            desired_speeds: &scratch.desired_speeds,
            seed: self.draws(),
            delta_s: seconds(delta_nanos),
        };
        let Memory { rows, params, guides, .. } = &mut self.memory;
        change::consider(rows, params, guides, &view);
    }

    fn drive(&mut self, delta_nanos: u64) {
        self.controls.clear();
        for row in 0..self.memory.rows.id.len() {
            let control = if self.memory.rows.placed[row] == 1 {
                self.drive_one(row, seconds(delta_nanos))
            } else {
                // A map without roads: stand.
                VehicleControl { brake: 1.0, ..VehicleControl::default() }
            };
            let actor_id = protocol::ActorId(self.memory.rows.id[row]);
            let lamps = self.lamps(row, &control);
            self.controls.push(VehicleControl { actor_id, lamps, ..control });
        }
    }

    /// The lamps of a vehicle that sees to them by itself.
    fn lamps(&self, row: usize, control: &VehicleControl) -> u32 {
        let Memory { rows, params, weather, .. } = &self.memory;
        if !params.lamps(rows.id[row]) || rows.placed[row] == 0 {
            return 0;
        }
        let crowd = &self.scratch.crowd;
        let mps = crowd.speed(crowd.driven[row] as usize);
        lamp::SWITCHED | lamps::lamps(rows, row, &self.map.tracks, weather, control, mps)
    }

    fn drive_one(&mut self, row: usize, delta_s: f32) -> VehicleControl {
        let (scratch, map) = (&self.scratch, &self.map);
        let (rows, crowd, tracks) = (&mut self.memory.rows, &scratch.crowd, &map.tracks);
        let body = crowd.driven[row] as usize;
        let speed = crowd.speed(body);
        let (front_m, lock_rad) = (crowd.body[body].front_m, crowd.body[body].lock_rad);

        let delay_s = DELAY_FRAMES * delta_s + DELAY_STEERING_S;
        let (wheels, deviation) =
            steer::steer(rows, row, tracks, crowd, delay_s, scratch.offsets_left_m[row]);
        let trouble = recover::is_in_trouble(&deviation);

        let mut leader = scratch.leaders[row];
        if rows.shift_m[row] != 0.0 {
            leader = self.leader_beside(row, leader);
        }
        let rows = &mut self.memory.rows;
        let mut halt = scratch.junctions.halts[row];
        let end_m = follow::route_end(rows, row, tracks, front_m);
        if end_m < 100.0 {
            let last = *rows.route[row].lanes().last().expect("a route has a lane");
            let back = tracks.back[last as usize] != crate::tracks::NONE;
            let room_m = if back { route::TURN_ROOM_M } else { 1.0 };
            halt.stop_m = halt.stop_m.min((end_m - room_m).max(0.0));
        }
        midway_lights(map, rows, row, &scratch.shown, front_m, speed, &mut halt);
        let mut desired = scratch.desired_speeds[row];
        if trouble {
            desired = desired.min(recover::CAREFUL_MPS);
        }
        let mut gain =
            follow::accelerate(speed.max(0.0), desired, &leader, &halt, scratch.gaps[row]);
        if trouble && !recover::is_free(crowd, body, 1.0, 1.0 + speed.max(0.0)) {
            gain = gain.min(-3.0);
        }

        let way = recover::way_out(rows, row, crowd, &deviation, &leader, gain, delta_s);
        if way == recover::Way::Hold {
            gain = gain.min(-1.0);
        }
        if way == recover::Way::Back {
            let backward = -speed;
            let mut effort = rows.effort[row];
            let press = pedals::press(
                recover::back_gain(backward),
                -crowd.acceleration[body],
                backward,
                -crowd.climb[body],
                delta_s,
                &mut effort,
            );
            rows.effort[row] = effort;
            let angle = -wheels.clamp(-0.6, 0.6);
            return control(press, pedals::wheel(angle, lock_rad, speed), flag::REVERSE);
        }
        let mut effort = rows.effort[row];
        let press = pedals::press(
            gain,
            crowd.acceleration[body],
            speed,
            crowd.climb[body],
            delta_s,
            &mut effort,
        );
        rows.effort[row] = effort;
        control(press, pedals::wheel(wheels, lock_rad, speed), 0)
    }

    /// While changing lanes, who is in front on the lane that is being left counts too, unless the
    /// change will be clear of him.
    fn leader_beside(&self, row: usize, leader: Leader) -> Leader {
        let (rows, tracks) = (&self.memory.rows, &self.map.tracks);
        let (scratch, full) = (&self.scratch, rows.shift_m[row]);
        let own = scratch.crowd.driven[row];
        let body = scratch.crowd.body[own as usize];
        let mut begins = -rows.arc_m[row] - body.front_m;
        for &lane in rows.route[row].lanes() {
            if begins > rows.shift_over_m[row] {
                break;
            }
            let index = lane as usize;
            let beside = if full > 0.0 { tracks.left[index] } else { tracks.right[index] };
            if beside == crate::tracks::NONE {
                break;
            }
            // Neighbours run side by side, but not always at the same length.
            let scale = tracks.length(beside) / tracks.length(lane).max(0.1);
            let from = if begins < 0.0 { rows.arc_m[row] * scale } else { f32::NEG_INFINITY };
            let start = if begins < 0.0 { -rows.arc_m[row] * scale - body.front_m } else { begins };
            let old = leader::first_ahead(&scratch.occupancy, beside, own, start, from);
            if old.gap_m.is_finite() {
                let (there, _) = route::shift_at(rows, row, old.gap_m.max(0.0));
                let apart = full.abs() - there.abs();
                let clear = body.half_width_m + scratch.crowd.body[old.body as usize].half_width_m;
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
            &self.memory.rows,
            &scratch.crowd,
            &scratch.occupancy,
            &scratch.junctions,
        );
        self.map.signals.advance(&mut self.memory.clocks, &scratch.demand, delta_nanos);
        self.lights.clear();
        for actor in actors.iter().filter(|actor| actor.kind == kind::TRAFFIC_LIGHT) {
            let phase = self.map.signals.shows(actor.signal, &self.memory.clocks);
            self.lights.push(LightState { actor_id: actor.actor_id, phase });
        }
    }
}

/// Stops before lights that stand away from junctions.
fn midway_lights(
    map: &Map,
    rows: &crate::rows::Rows,
    row: usize,
    shown: &[u32],
    front_m: f32,
    speed: f32,
    halt: &mut Halt,
) {
    let midway = &map.approaches.midway;
    if midway.is_empty() {
        return;
    }
    let mut begins = -rows.arc_m[row] - front_m;
    for &lane in rows.route[row].lanes() {
        if begins > 200.0 {
            return;
        }
        let from = midway.partition_point(|stop| stop.0 < lane);
        for &(_, arc_m, signal) in midway[from..].iter().take_while(|stop| stop.0 == lane) {
            let line_m = begins + arc_m - 0.5;
            let light = shown[signal as usize];
            let stops = light == protocol::light::RED || light == protocol::light::YELLOW;
            if stops && line_m > -0.5 && speed * speed < 6.0 * line_m.max(0.1) {
                halt.stop_m = halt.stop_m.min(line_m.max(0.0));
            }
        }
        begins += map.tracks.length(lane);
    }
}

fn control(press: pedals::Pedals, steer: f32, flags: u32) -> VehicleControl {
    VehicleControl {
        flags,
        throttle: press.throttle,
        brake: press.brake,
        steer,
        ..VehicleControl::default()
    }
}

fn seconds(nanos: u64) -> f32 {
    (nanos as f64 * 1e-9) as f32
}
