//! Traffic in closed loop with physics, without processes and without the bus. Records everything
//! that happens to the vehicles, for examples and tests to judge.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::sync::Arc;

use glam::Vec3;
use mesh::{Mesh, RandomStream, Tag};
use protocol::{ActorId, ActorState, Name, Pose, Spawn, TrafficHeader, WorldCommand, flag};
use road::{LanePoint, LaneType, LaneTypes, Network};
use sim_host::{Decision, Inputs, NoServices, SavedState, Sim, physics::Ground};
use traffic::{Planner, VehiclePlan, WaitCause};

use crate::red_lights::RedLights;

const DELTA_NANOS: u64 = 50_000_000;
const DELTA_S: f32 = 0.05;
/// A vehicle that advances less than this is in a jam. Metres.
const JAM_M: f32 = 5.0;
/// Contacts within this time belong to the same collision.
const SAME_CRASH_S: f32 = 10.0;
const JAM_MAX_S: f32 = 120.0;
/// A vehicle that stands longer than this with a free path has given up.
const IDLE_MAX_S: f32 = 180.0;
/// A vehicle in one place for longer than this at the end is in a permanent jam.
const BLOCKED_MAX_S: f32 = 300.0;
const FREE_SHARE_MIN: f32 = 0.6;
const DRIVEN_MIN_KMPH: f32 = 5.0;

/// How far the centre of a wheel may be beside the road, over a cut kerb. Metres.
const BESIDE_M: f32 = 0.75;
/// Resolution of that measurement. Metres.
const BESIDE_STEP_M: f32 = 0.25;

/// The road users of a run.
#[derive(Clone, Copy, Debug)]
pub struct Cast {
    /// The requested number; as many are spawned as there is room for.
    pub vehicles: usize,
    /// Pedestrians, as many as there is room for.
    pub walkers: usize,
    /// The seed of scenery, traffic and spawn points.
    pub seed: u64,
    /// Sedans only, instead of a mixture of cars, vans, trucks, buses and two-wheelers.
    pub sedans: bool,
    /// Trucks and buses in that mixture, in percent; at most 94, since the rest are two-wheelers.
    pub wide_percent: usize,
}

/// Trucks and buses in the usual mixture, in percent.
pub const WIDE_PERCENT: usize = 8;
/// All but two-wheelers.
const MOTOR_PERCENT: usize = 94;

/// Observations of one vehicle.
#[derive(Default)]
struct Record {
    blueprint: &'static str,
    driven_m: f32,
    free_s: f32,
    free_share_s: f32,
    /// Without curves.
    straight_s: f32,
    straight_share_s: f32,
    /// Where, and since when, it has not advanced.
    anchor: Vec3,
    anchored_s: f32,
    longest_s: f32,
    longest_at: Vec3,
    longest_from_s: f32,
    /// What it has waited for since then, and what in its longest stay: seconds by cause.
    causes: BTreeMap<WaitCause, u32>,
    longest_causes: BTreeMap<WaitCause, u32>,
    /// How long it has stood with a free path, now and at most.
    idle_s: f32,
    idle_longest_s: f32,
    /// How far a wheel was beside the road, at most.
    beside_m: f32,
    beside_at: Vec3,
    beside_from_s: f32,
    astray_m: f32,
    astray_at: Vec3,
    astray_from_s: f32,
    lost_s: f32,
    top_mps: f32,
    toppled_s: f32,
}

/// Observations of one pedestrian.
struct Walker {
    id: ActorId,
    walked_m: f32,
    has_fallen: bool,
}

/// Two vehicles that touched, and what they planned with just before.
struct Crash {
    time_s: f32,
    pair: (ActorId, ActorId),
    impulse_ns: f32,
    story: Vec<String>,
}

/// Vehicles on autopilot on a map, with everything that happened to them.
pub struct World {
    network: Arc<Network>,
    sim: Sim,
    asphalt: Ground,
    planner: Planner,
    /// The actors before this index are traffic lights, those from it on vehicles, by id.
    vehicles_from: usize,
    records: Vec<Record>,
    crashes: Vec<Crash>,
    /// The last contact of each pair.
    touched_s: BTreeMap<(ActorId, ActorId), f32>,
    refused: usize,
    walkers: Vec<Walker>,
    red_lights: RedLights,
    /// The time, the vehicle and the signal.
    violations: Vec<(f32, ActorId, u32)>,
    teleports: usize,
    physics_nanos: u64,
    planner_nanos: u64,
    /// When the observations began.
    resumed_s: f32,
}

impl World {
    /// Furnishes a map and spawns the vehicles.
    pub fn new(network: Arc<Network>, cast: &Cast) -> World {
        let town = town::furnish(&network, cast.seed);
        let mut world = World {
            sim: Sim::new(&town, cast.seed),
            asphalt: asphalt(&town.mesh),
            planner: Planner::new(network.clone(), cast.seed),
            red_lights: RedLights::new(&network),
            walkers: Vec::new(),
            violations: Vec::new(),
            network,
            vehicles_from: town.heads.len(),
            records: Vec::new(),
            crashes: Vec::new(),
            touched_s: BTreeMap::new(),
            refused: 0,
            teleports: 0,
            physics_nanos: 0,
            planner_nanos: 0,
            resumed_s: 0.0,
        };
        world.populate(cast);
        world
    }

    /// Computes on this number of threads from now on; the results do not depend on it.
    pub fn set_threads(&mut self, threads: usize) {
        self.sim.world_mut().set_threads(threads);
        self.planner.set_threads(threads);
    }

    /// Returns everything that decides the future, for [`World::resume`].
    pub fn save(&self) -> Vec<u8> {
        let decision = Some((TrafficHeader::default(), self.planner.save()));
        let mut state = SavedState { decision, ..SavedState::default() };
        self.sim.save_into(&mut state);
        state.to_bytes()
    }

    /// Continues from a state of the same map and cast. What happened before is not part of it: no vehicle has
    /// driven, and none has waited.
    ///
    /// # Errors
    ///
    /// The bytes are no state of this build, map or cast; the world must not be used then.
    pub fn resume(&mut self, bytes: &[u8]) -> Result<(), String> {
        let state = SavedState::from_bytes(bytes, 0).map_err(|e| e.to_string())?;
        self.sim.restore(&state).map_err(|e| e.to_string())?;
        let (_, planner) = state.decision.ok_or("the state has none of the planner")?;
        self.planner.restore(&planner).map_err(|e| e.to_string())?;
        self.resumed_s = self.time_s();
        let actors = &self.sim.states()[self.vehicles_from..];
        for (record, actor) in self.records.iter_mut().zip(actors) {
            record.anchor = actor.pose.position();
        }
        Ok(())
    }

    /// Chooses vehicles as `omnibus collect` does: mostly cars, at shuffled spawn points.
    fn populate(&mut self, cast: &Cast) {
        let mut random = RandomStream::from_state(cast.seed);
        let mut places = self.network.spawn_points();
        for last in (1..places.len()).rev() {
            places.swap(last, random.below(last + 1));
        }
        while self.records.len() < cast.vehicles {
            let Some(place) = places.pop() else { break };
            let blueprint = if cast.sedans {
                "vehicle.tesla.model3"
            } else {
                vehicle(&mut random, cast.wide_percent).id
            };
            let (_, blueprint) = town::blueprint(blueprint).expect("it is in the catalogue");
            let spawn = Spawn {
                blueprint: Name::new(blueprint.id),
                flags: flag::AUTOPILOT,
                pose: pose(&self.network, place),
                ..Spawn::default()
            };
            match self.sim.apply_world(&WorldCommand::Spawn(spawn)) {
                Ok(id) => {
                    let state = self.sim.world().state(ActorId(id)).expect("it was spawned");
                    self.records.push(Record {
                        blueprint: blueprint.id,
                        anchor: state.pose.position(),
                        ..Record::default()
                    });
                }
                Err(_) => self.refused += 1,
            }
        }
        self.populate_sidewalks(cast, &mut random);
    }

    /// Spawns pedestrians on sidewalks, after the vehicles.
    fn populate_sidewalks(&mut self, cast: &Cast, random: &mut RandomStream) {
        let mut places = self.network.waypoints(1.5, LaneTypes::only(LaneType::Sidewalk));
        let blueprints: Vec<_> =
            town::catalogue().iter().filter(|b| b.id.starts_with("walker.")).collect();
        while self.walkers.len() < cast.walkers && !places.is_empty() {
            let place = places.swap_remove(random.below(places.len()));
            let at = self.network.place(place);
            let spawn = Spawn {
                blueprint: Name::new(blueprints[random.below(blueprints.len())].id),
                flags: flag::AUTOPILOT,
                pose: Pose::level(at.position.as_vec3() + Vec3::Z, at.heading_rad as f32),
                ..Spawn::default()
            };
            if let Ok(id) = self.sim.apply_world(&WorldCommand::Spawn(spawn)) {
                self.walkers.push(Walker { id: ActorId(id), walked_m: 0.0, has_fallen: false });
            }
        }
    }

    /// Advances by one frame: traffic plans on the newest snapshot, and the simulation core steps.
    pub fn tick(&mut self) {
        let begin = bus::clock::now_nanos();
        self.planner.plan(DELTA_NANOS, self.sim.states(), &[]);
        self.planner_nanos += bus::clock::now_nanos() - begin;
        self.look();
        let decision = Some(Decision { parts: self.planner.parts(&[]), hash: 0 });
        let begin = bus::clock::now_nanos();
        let Ok(_) = self.sim.step(&Inputs { decision, requests: &[] }, &mut NoServices::default());
        self.physics_nanos += bus::clock::now_nanos() - begin;
        self.judge();
    }

    /// Returns the simulated time, in seconds.
    pub fn time_s(&self) -> f32 {
        self.sim.stamp().sim_time_nanos as f32 * 1e-9
    }

    /// Records how the vehicles drove, in terms of the planner.
    fn look(&mut self) {
        let time_s = self.time_s();
        let from = self.vehicles_from;
        for record in &mut self.records {
            record.lost_s += DELTA_S;
        }
        if self.sim.stamp().frame.0.is_multiple_of(20) {
            self.count_causes();
        }
        self.red_lights.advance(&self.sim.states()[..from], DELTA_S);
        for vehicle_plan in self.planner.vehicle_plans() {
            let row = vehicle_plan.actor_id.0 as usize - 1 - from;
            let (record, actor) = (&mut self.records[row], &self.sim.states()[from + row]);
            record.lost_s -= DELTA_S;
            let ahead_m = town::catalogue()[actor.blueprint as usize].half_extents_m.x;
            if let Some(signal) = self.red_lights.follow(&vehicle_plan, ahead_m) {
                self.violations.push((time_s, actor.actor_id, signal));
            }
            let stands = vehicle_plan.is_free() && actor.velocity().length() < 0.2;
            record.idle_s = if stands { record.idle_s + DELTA_S } else { 0.0 };
            record.idle_longest_s = record.idle_longest_s.max(record.idle_s);
            if vehicle_plan.is_free() {
                let speed = actor.velocity().truncate().length();
                record.free_s += DELTA_S;
                record.free_share_s += DELTA_S * speed / vehicle_plan.limit_mps;
                if !vehicle_plan.is_in_curve() {
                    record.straight_s += DELTA_S;
                    record.straight_share_s += DELTA_S * speed / vehicle_plan.limit_mps;
                }
            }
            if vehicle_plan.cross_track_error_m.abs() > record.astray_m
                && !vehicle_plan.is_turning_around
            {
                record.astray_m = vehicle_plan.cross_track_error_m.abs();
                record.astray_at = actor.pose.position();
                record.astray_from_s = time_s;
            }
        }
    }

    /// Counts, once a second, what the queue of each vehicle waits for that stands.
    fn count_causes(&mut self) {
        for (row, record) in self.records.iter_mut().enumerate() {
            let id = ActorId((self.vehicles_from + row + 1) as u32);
            if record.anchored_s > 1.0
                && let Some(head) = self.planner.queue_head(id)
            {
                *record.causes.entry(head.cause).or_default() += 1;
            }
        }
    }

    /// Records what happened to the vehicles.
    fn judge(&mut self) {
        let time_s = self.time_s();
        for (record, actor) in self.records.iter_mut().zip(&self.sim.states()[self.vehicles_from..])
        {
            let (place, speed) = (actor.pose.position(), actor.velocity().length());
            record.driven_m += speed * DELTA_S;
            record.top_mps = record.top_mps.max(speed);
            record.anchored_s += DELTA_S;
            if place.distance(record.anchor) > JAM_M {
                (record.anchor, record.anchored_s) = (place, 0.0);
                record.causes.clear();
            }
            if record.anchored_s > record.longest_s {
                record.longest_s = record.anchored_s;
                record.longest_at = place;
                record.longest_from_s = time_s - record.anchored_s;
                if record.longest_s > JAM_MAX_S {
                    record.longest_causes.clone_from(&record.causes);
                }
            }
            if (actor.pose.rotation() * Vec3::Z).z < 0.5 {
                record.toppled_s += DELTA_S;
            }
            self.teleports += usize::from(actor.has(flag::TELEPORTED));
            // Not in every frame, because it takes longer than all other observations.
            if self.sim.stamp().frame.0.is_multiple_of(10) {
                let beside_m = beside(&self.asphalt, actor);
                if beside_m > record.beside_m {
                    record.beside_m = beside_m;
                    (record.beside_at, record.beside_from_s) = (place, time_s);
                }
            }
        }
        for walker in &mut self.walkers {
            let Some(actor) = self.sim.world().state(walker.id) else { continue };
            walker.walked_m += actor.velocity().truncate().length() * DELTA_S;
            walker.has_fallen |= actor.has(flag::FALLEN);
        }
        for collision in self.sim.world().physics().collisions().to_vec() {
            let pair = (collision.actor, collision.other);
            let last_s = self.touched_s.insert(pair, time_s);
            if last_s.is_none_or(|last_s| time_s - last_s > SAME_CRASH_S) {
                let both = [pair.0, pair.1];
                let story = self
                    .planner
                    .vehicle_plans()
                    .filter(|vehicle_plan| both.contains(&vehicle_plan.actor_id))
                    .map(|vehicle_plan| self.describe(&vehicle_plan))
                    .collect();
                let impulse_ns = collision.impulse_ns.length();
                self.crashes.push(Crash { time_s, pair, impulse_ns, story });
            }
        }
    }

    /// Prints what the planner assumes about these vehicles.
    pub fn print(&self, watch: &[u32]) {
        for vehicle_plan in self.planner.vehicle_plans().filter(|o| watch.contains(&o.actor_id.0)) {
            println!("{:.2} {}", self.time_s(), self.describe(&vehicle_plan));
        }
    }

    /// Writes a line for each light, walker and vehicle.
    pub fn write(&self, trace: &mut BufWriter<File>) -> std::io::Result<()> {
        for light in &self.sim.states()[..self.vehicles_from] {
            let (at, phase) = (light.pose.position(), light.phase);
            let (time_s, id) = (self.time_s(), light.actor_id.0);
            writeln!(trace, "{time_s:.0},{id},{:.1},{:.1},,,,,,,,,,,,,,,{phase}", at.x, at.y)?;
        }
        for walker in &self.walkers {
            let Some(actor) = self.sim.world().state(walker.id) else { continue };
            let (at, ahead) = (actor.pose.position(), actor.pose.rotation() * Vec3::X);
            writeln!(
                trace,
                "{:.0},{},{:.2},{:.2},{:.2},{:.2},,,,,,,,,,,walker,,",
                self.time_s(),
                walker.id.0,
                at.x,
                at.y,
                ahead.y.atan2(ahead.x),
                actor.velocity().truncate().length()
            )?;
        }
        for o in self.planner.vehicle_plans() {
            let actor = &self.sim.states()[o.actor_id.0 as usize - 1];
            let (at, nose) = (actor.pose.position(), actor.pose.rotation() * Vec3::X);
            let on = LanePoint { lane: o.lane, along_m: 0.0 };
            writeln!(
                trace,
                "{:.0},{},{:.1},{:.1},{:.2},{:.1},{:.1},{:.1},{},{},{},{:.1},{:.1},{:.1},{},{:.0},{:?},{},",
                self.time_s(),
                o.actor_id.0,
                at.x,
                at.y,
                nose.y.atan2(nose.x),
                actor.velocity().length(),
                o.limit_mps,
                o.desired_speed_mps,
                self.network.road_space(on).0.id,
                o.lane.0,
                o.leader.0,
                o.leader_m,
                o.stop_m,
                o.merge_m,
                o.reservation,
                o.waited_s,
                o.wait_reason,
                o.blocker.0,
            )?;
        }
        Ok(())
    }

    fn describe(&self, vehicle_plan: &VehiclePlan) -> String {
        let actor = &self.sim.states()[vehicle_plan.actor_id.0 as usize - 1];
        let at = LanePoint { lane: vehicle_plan.lane, along_m: 0.0 };
        let (road, section, lane, _) = self.network.road_space(at);
        format!(
            "{} {} at {:.1} v {:.1}, road {} section {section} lane {lane} ({}) at {:.1} m, {:.2} m astray, command {:.1} \
             of {:.1}; leader {} in {:.1} m, stop in {:.1}, merge in {:.1}; leave {}, waited {:.0} s for {:?} on {}{}{}; \
             pedals {:.2} {:.2} wheel {:.2}",
            vehicle_plan.actor_id.0,
            town::catalogue()[actor.blueprint as usize].id.trim_start_matches("vehicle."),
            actor.pose.position(),
            actor.velocity().length(),
            road.id,
            vehicle_plan.lane.0,
            vehicle_plan.along_m,
            vehicle_plan.cross_track_error_m,
            vehicle_plan.desired_speed_mps,
            vehicle_plan.limit_mps,
            vehicle_plan.leader.0,
            vehicle_plan.leader_m,
            vehicle_plan.stop_m,
            vehicle_plan.merge_m,
            vehicle_plan.reservation,
            vehicle_plan.waited_s,
            vehicle_plan.wait_reason,
            vehicle_plan.blocker.0,
            if vehicle_plan.reverses { ", backs out" } else { "" },
            if vehicle_plan.is_turning_around { ", turns round" } else { "" },
            actor.throttle,
            actor.brake,
            actor.steer,
        )
    }

    /// Prints all figures, and returns whether every goal is met.
    pub fn report(&self, name: &str, wall_s: f64) -> bool {
        let records = &self.records;
        let seen_s = self.time_s() - self.resumed_s;
        let frames = (seen_s / DELTA_S).round().max(1.0);
        let hours = seen_s / 3600.0;
        let free_s: f32 = records.iter().map(|r| r.free_s).sum();
        let share = records.iter().map(|r| r.free_share_s).sum::<f32>() / free_s.max(1.0);
        let straight_s: f32 = records.iter().map(|r| r.straight_s).sum();
        let straight =
            records.iter().map(|r| r.straight_share_s).sum::<f32>() / straight_s.max(1.0);
        let mut driven: Vec<f32> = records.iter().map(|r| r.driven_m).collect();
        driven.sort_by(f32::total_cmp);
        let mean = driven.iter().sum::<f32>() / driven.len().max(1) as f32;
        let short = driven.iter().filter(|&&m| m < 1000.0 * DRIVEN_MIN_KMPH * hours).count();
        let jams = records.iter().filter(|r| r.longest_s > JAM_MAX_S).count();
        let lost_s: f32 = records.iter().map(|r| r.lost_s).sum();
        let toppled = records.iter().filter(|r| r.toppled_s > 0.0).count();
        let longest = records.iter().map(|r| r.longest_s).fold(0.0, f32::max);
        let with_statics = self.crashes.iter().filter(|c| c.pair.1 == ActorId::NONE).count();
        println!(
            "{name}: {} vehicles ({} places refused), {seen_s:.0} s in {wall_s:.0} s wall; physics {:.0} us, planner {:.0} us \
             a frame; hash {:016x}",
            records.len(),
            self.refused,
            self.physics_nanos as f64 / 1e3 / f64::from(frames),
            self.planner_nanos as f64 / 1e3 / f64::from(frames),
            self.sim.world().physics().hash(),
        );
        println!(
            "{name}: free {:.1} % of the limit over {:.0} % of the time, {:.1} % where there is no curve; driven mean {mean:.0}, least {:.0} m, {short} short; \
             longest in one place {longest:.0} s, {jams} jams; {} collisions with vehicles, {with_statics} with \
             fixed things; {toppled} toppled, {} teleports, lost for {lost_s:.1} s",
            100.0 * share,
            100.0 * free_s / (seen_s * records.len().max(1) as f32),
            100.0 * straight,
            driven.first().copied().unwrap_or(0.0),
            self.crashes.len() - with_statics,
            self.teleports,
        );
        let fallen = self.walkers.iter().filter(|walker| walker.has_fallen).count();
        let walked: f32 = self.walkers.iter().map(|walker| walker.walked_m).sum();
        println!(
            "{name}: {} walkers, mean speed {:.2} m/s, {fallen} have fallen; {} vehicles passed a red light",
            self.walkers.len(),
            walked / (seen_s * self.walkers.len().max(1) as f32),
            self.violations.len()
        );
        for (time_s, id, signal) in self.violations.iter().take(10) {
            println!("  {time_s:.1} s: {} passed signal {signal} at red", id.0);
        }
        let mut causes = BTreeMap::<WaitCause, usize>::new();
        for record in records {
            // A stay that has only just become too long has no causes yet.
            let most = record.longest_causes.iter().max_by_key(|(_, seconds)| **seconds);
            *causes.entry(most.map_or(WaitCause::Idle, |(cause, _)| *cause)).or_default() +=
                usize::from(record.longest_s > JAM_MAX_S);
        }
        causes.retain(|_, jams| *jams > 0);
        println!(
            "{name}: heads of the queues of vehicles that stayed in one place wait for {causes:?}"
        );
        self.name_the_worst();
        straight >= FREE_SHARE_MIN
            && short + jams + toppled + self.teleports + self.crashes.len() == 0
            && self.violations.is_empty()
            && self.sim.world().physics().len() == records.len() + self.walkers.len()
    }

    /// Returns the faults on a generated town, a sentence each: a vehicle leaves the road,
    /// overturns or touches another, stands for long with a free path, or is in a jam at the end.
    /// [`World::brushes`] counts contacts with lamp posts: the corner of a bus swings over the
    /// kerb.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        for (row, record) in self.records.iter().enumerate() {
            let vehicle = format!("{} {}", self.vehicles_from + row + 1, record.blueprint);
            if record.beside_m > BESIDE_M {
                faults.push(format!(
                    "{vehicle} was {:.2} m off the road at {:.0}, {:.0} s",
                    record.beside_m, record.beside_at, record.beside_from_s
                ));
            }
            if record.idle_longest_s > IDLE_MAX_S {
                faults.push(format!(
                    "{vehicle} stood {:.0} s with its way free, at {:.0}",
                    record.idle_longest_s, record.longest_at
                ));
            }
            if record.anchored_s > BLOCKED_MAX_S {
                faults.push(format!(
                    "{vehicle} is in one place for {:.0} s at the end, at {:.0}",
                    record.anchored_s, record.anchor
                ));
            }
            if record.toppled_s > 0.0 {
                faults.push(format!("{vehicle} toppled"));
            }
        }
        for crash in self.crashes.iter().filter(|crash| crash.pair.1 != ActorId::NONE) {
            faults.push(format!(
                "{} and {} touched at {:.1} s, {:.0} Ns: {}",
                crash.pair.0.0,
                crash.pair.1.0,
                crash.time_s,
                crash.impulse_ns,
                crash.story.join("; ")
            ));
        }
        if self.teleports > 0
            || self.sim.world().physics().len() != self.records.len() + self.walkers.len()
        {
            faults.push(format!("{} were teleported or removed", self.teleports));
        }
        faults
    }

    /// Returns the number of contacts between two actors or with a static object.
    pub fn contacts(&self) -> usize {
        self.crashes.len()
    }

    /// Returns the number of contacts with static objects.
    pub fn brushes(&self) -> usize {
        self.crashes.iter().filter(|crash| crash.pair.1 == ActorId::NONE).count()
    }

    /// Returns the number of vehicles, their total distance in metres, and the longest stay in one
    /// place in seconds.
    pub fn figures(&self) -> (usize, f32, f32) {
        let driven = self.records.iter().map(|record| record.driven_m).sum();
        let longest = self.records.iter().map(|record| record.longest_s).fold(0.0, f32::max);
        (self.records.len(), driven, longest)
    }

    /// Returns the vehicles that stayed in one place for longer than this, a sentence each.
    pub fn standstills(&self, longest_s: f32) -> Vec<String> {
        let stands = |(row, record): (usize, &Record)| {
            let id = self.vehicles_from + row + 1;
            (record.longest_s > longest_s).then(|| {
                format!(
                    "{id} {} stood for {:.0} s at {:.0} from {:.0} s on",
                    record.blueprint, record.longest_s, record.longest_at, record.longest_from_s
                )
            })
        };
        self.records.iter().enumerate().filter_map(stands).collect()
    }

    fn name_the_worst(&self) {
        for crash in self.crashes.iter().take(20) {
            let (first, second) = (crash.pair.0.0, crash.pair.1.0);
            println!(
                "  {:.1} s: {first} and {second} collide, {:.0} Ns",
                crash.time_s, crash.impulse_ns
            );
            for line in &crash.story {
                println!("    {line}");
            }
        }
        let worst = |title: &str, of: &dyn Fn(&Record) -> f32, say: &dyn Fn(&Record) -> String| {
            let mut order: Vec<usize> = (0..self.records.len()).collect();
            order.sort_by(|&a, &b| of(&self.records[b]).total_cmp(&of(&self.records[a])));
            println!("  {title}:");
            for row in order.into_iter().take(6) {
                let record = &self.records[row];
                let id = self.vehicles_from + row + 1;
                println!("    {id} {}: {}", record.blueprint, say(record));
            }
        };
        worst("least driven", &|r| -r.driven_m, &|r| {
            format!("{:.0} m, top speed {:.1} m/s", r.driven_m, r.top_mps)
        });
        worst("longest in one place", &|r| r.longest_s, &|r| {
            let (long, at, from) = (r.longest_s, r.longest_at, r.longest_from_s);
            format!("{long:.0} s at {at:.0} from {from:.0} s on: {:?}", r.longest_causes)
        });
        worst("farthest off the road", &|r| r.beside_m, &|r| {
            format!("{:.2} m at {:.0}, {:.1} s", r.beside_m, r.beside_at, r.beside_from_s)
        });
        worst("farthest astray", &|r| r.astray_m, &|r| {
            format!("{:.2} m at {:.0}, {:.1} s", r.astray_m, r.astray_at, r.astray_from_s)
        });
        let stands = |vehicle_plan: &VehiclePlan| {
            let row = vehicle_plan.actor_id.0 as usize - 1 - self.vehicles_from;
            vehicle_plan.leader_m > 4.0 && self.records[row].anchored_s > 0.5 * JAM_MAX_S
        };
        for vehicle_plan in self.planner.vehicle_plans().filter(stands).take(20) {
            println!("  stands: {}", self.describe(&vehicle_plan));
        }
    }
}

/// The surface that vehicles drive on.
fn asphalt(mesh: &Mesh) -> Ground {
    let road = [Tag::Roads, Tag::RoadLine].map(|tag| tag as u8);
    let keep: Vec<usize> =
        (0..mesh.faces.len()).filter(|face| road.contains(&mesh.faces[*face].tag)).collect();
    Ground::new(&Mesh {
        positions: mesh.positions.clone(),
        triangles: keep.iter().map(|face| mesh.triangles[*face]).collect(),
        faces: keep.iter().map(|face| mesh.faces[*face]).collect(),
    })
}

/// Returns how far the outermost wheel is beside the asphalt.
fn beside(asphalt: &Ground, actor: &ActorState) -> f32 {
    let (origin, rotation) = (actor.pose.position(), actor.pose.rotation());
    let wheels = &town::catalogue()[actor.blueprint as usize].wheels;
    let beside = wheels.iter().map(|wheel| {
        let place = origin + rotation * wheel.position_m;
        let inward = rotation * Vec3::Y * -wheel.position_m.y.signum() * BESIDE_STEP_M;
        let is_on = |step: &u32| {
            let at = place + inward * *step as f32;
            let below = asphalt.below(at.x, at.y, at.z + 0.5);
            below.on_map && (at.z - below.height_m).abs() < 2.0
        };
        (0..10).find(is_on).unwrap_or(10) as f32 * BESIDE_STEP_M
    });
    beside.fold(0.0, f32::max)
}

fn pose(network: &Network, at: LanePoint) -> Pose {
    let place = network.place(at);
    Pose::new(place.position.as_vec3() + Vec3::Z * 0.5, place.rotation().as_quat())
}

/// Draws a blueprint: mostly cars.
fn vehicle(random: &mut RandomStream, wide_percent: usize) -> &'static town::Blueprint {
    let drawn = random.below(100);
    let kinds = if drawn + wide_percent < MOTOR_PERCENT {
        &["car", "van"][..]
    } else if drawn < MOTOR_PERCENT {
        &["truck", "bus"]
    } else {
        &["motorcycle", "bicycle"]
    };
    let choice: Vec<_> =
        town::catalogue().iter().filter(|b| kinds.contains(&b.base_type)).collect();
    choice[random.below(choice.len())]
}
