//! Simulates recorded inputs in one thread and without the bus, and compares state hashes and actors
//! with the recording.

use std::{collections::VecDeque, convert::Infallible, fmt, sync::Arc};

use ::record::{RecordedFrame, Recording};
use anyhow::{Context, anyhow};
use bake::Cache;
use bus::clock;
use protocol::{
    ActorState, Block, BundleId, BundleReceipt, Command, CommandGroup, CreateBundle, Frame,
    JournalEntry, LightState, Name, Refusal, SensorCommand, SensorSpec, Stamp, TrafficHeader,
    TrafficParts, VehicleControl, WalkerControl, status,
};
use sim_host::{Inputs, Request, SavedState, Services, Sim, decision_hash, map_sum};
use traffic::Planner;

/// The extent of a re-simulation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Resimulated {
    /// Frames that were simulated and compared.
    pub frames: u64,
    /// Simulated time that they took.
    pub sim_nanos: u64,
    /// The first difference.
    pub difference: Option<Difference>,
}

/// Where a re-simulation differs first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The frame, as recorded.
    pub frame: Frame,
    /// The actor, command or hash that differs.
    pub what: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} differs: {}", self.frame, self.what)
    }
}

/// How long the parts of one simulated frame took, in nanoseconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StepNanos {
    /// Applying the decision of traffic and the commands.
    pub(crate) commands: u64,
    /// Physics.
    pub(crate) physics: u64,
    /// The state hash and what else follows physics.
    pub(crate) state_hash: u64,
    /// Planning, and saving the planner's state; `None` if the decision was recorded whole.
    pub(crate) plan: Option<(u64, u64)>,
}

/// Called with each simulated frame; returns whether to go on.
type Watch<'a> = dyn FnMut(&Sim, &RecordedFrame, &StepNanos) -> anyhow::Result<bool> + 'a;

/// Simulates what was recorded between two recorded times, from the whole world before them on.
pub fn resimulate(
    recording: &mut Recording,
    from_nanos: u64,
    until_nanos: u64,
) -> anyhow::Result<Resimulated> {
    resimulate_range(recording, from_nanos, until_nanos, &mut |_, _, _| Ok(true))
}

/// Simulates a recording from its beginning, and calls `watch` with each frame after the first.
pub(crate) fn resimulate_watched(
    recording: &mut Recording,
    watch: &mut Watch,
) -> anyhow::Result<Resimulated> {
    resimulate_range(recording, 0, u64::MAX, watch)
}

fn resimulate_range(
    recording: &mut Recording,
    from_nanos: u64,
    until_nanos: u64,
    watch: &mut Watch,
) -> anyhow::Result<Resimulated> {
    let file = recording.path().display().to_string();
    let profile = recording.info().profile;
    anyhow::ensure!(
        profile.has_inputs(),
        "{file} is a recording of profile {}, which keeps no inputs to simulate again",
        profile.name()
    );
    let first = recording
        .world_before(recording.segment_at(from_nanos))
        .with_context(|| format!("{file} holds no whole world to begin with"))?;
    let mut resimulation: Option<Resimulation> = None;
    let mut done = Resimulated::default();
    for segment in first..recording.segments() {
        if segment > first && recording.start_nanos(segment) >= until_nanos {
            break;
        }
        let episode = recording.info().episode.clone();
        for moment in recording.recorded_frames(segment)? {
            let found = match &mut resimulation {
                None => {
                    let mut new = Resimulation::new(&episode)?;
                    let found = new.begin(moment).map_err(|e| anyhow!("{file}: {e}"))?;
                    resimulation = Some(new);
                    found
                }
                Some(running) if is_load(moment) => {
                    running.begin(moment).map_err(|e| anyhow!("{file}: {e}"))?
                }
                Some(running) => {
                    let found = running.step(moment)?;
                    if !watch(&running.sim, moment, &running.nanos)? {
                        return Ok(done);
                    }
                    found
                }
            };
            done.frames += 1;
            done.sim_nanos += moment.delta_nanos;
            if let Some(what) = found {
                done.difference = Some(Difference { frame: moment.stamp.frame, what });
                return Ok(done);
            }
        }
    }
    Ok(done)
}

/// Returns whether a saved state was loaded before this frame.
fn is_load(moment: &RecordedFrame) -> bool {
    moment.world.is_some()
        && moment.journal.iter().any(|entry| {
            entry.outcome.status == status::DONE
                && matches!(entry.command.decode(), Some(Command::LoadState(_)))
        })
}

/// The newest decision of traffic.
#[derive(Default)]
struct Decided {
    frame: Frame,
    controls: Vec<VehicleControl>,
    walkers: Vec<WalkerControl>,
    lights: Vec<LightState>,
    hash: u64,
}

/// A frame on which traffic has not planned yet.
struct PendingFrame {
    stamp: Stamp,
    delta_nanos: u64,
    actors: Vec<ActorState>,
    journal: Vec<JournalEntry>,
}

/// The simulation and the traffic of a re-simulation.
struct Resimulation {
    sim: Sim,
    planner: Planner,
    blank: Vec<u8>,
    map: u64,
    decided: Decided,
    waiting: VecDeque<PendingFrame>,
    /// Of the last step.
    nanos: StepNanos,
}

/// Keeps the journal, and when the parts of a step ended. Creates bundles as they were recorded.
#[derive(Default)]
struct TimedServices {
    /// Ids of the bundles that are created.
    bundles: VecDeque<u32>,
    journal: Vec<JournalEntry>,
    applied_nanos: u64,
    stepped_nanos: u64,
}

impl TimedServices {
    /// Creates the services for these commands and their recorded outcomes.
    fn creating(entries: &[JournalEntry]) -> TimedServices {
        let bundles = entries.iter().filter_map(|entry| match entry.command.decode() {
            Some(Command::CreateBundle(_)) => Some(entry.outcome.id),
            _ => None,
        });
        TimedServices { bundles: bundles.collect(), ..TimedServices::default() }
    }
}

impl Services for TimedServices {
    type Error = Infallible;

    fn journal(&mut self, entry: JournalEntry) {
        self.journal.push(entry);
    }

    fn create_bundle(
        &mut self,
        _client: Name,
        _bundle: &CreateBundle,
        _sensors: &[SensorSpec],
        _receipt: BundleReceipt,
    ) -> Result<BundleId, Refusal> {
        let id = self.bundles.pop_front();
        id.map(BundleId).ok_or_else(|| Refusal::other("the recording has no such bundle"))
    }

    fn commands_applied(&mut self) {
        self.applied_nanos = clock::now_nanos();
    }

    fn physics_stepped(&mut self, _sim: &mut Sim) {
        self.stepped_nanos = clock::now_nanos();
    }
}

impl Resimulation {
    fn new(episode: &protocol::Episode) -> anyhow::Result<Resimulation> {
        let cache = Cache::from_environment();
        let network = cache.network(&episode.map, &episode.open_drive)?;
        let network = Arc::new(network);
        let town = cache.town_around(&network, &episode.open_drive, episode.seed);
        let sim = Sim::new(&town, episode.seed);
        let planner = Planner::with_cached_town(&cache, network, &episode.open_drive, episode.seed);
        let blank = planner.save();
        let map = map_sum(episode);
        Ok(Resimulation {
            sim,
            planner,
            blank,
            map,
            decided: Decided::default(),
            waiting: VecDeque::new(),
            nanos: StepNanos::default(),
        })
    }

    /// Continues from the end of a frame whose whole world was recorded.
    fn begin(&mut self, moment: &RecordedFrame) -> anyhow::Result<Option<String>> {
        let bytes = moment.world.as_ref().context("its first frame lacks the whole world")?;
        let state = SavedState::from_bytes(bytes, self.map)?;
        self.sim.restore(&state)?;
        self.waiting.clear();
        match &state.decision {
            Some((header, payload)) => self.take(header, payload, true)?,
            None => {
                self.decided = Decided::default();
                self.planner.restore(&self.blank)?;
            }
        }
        Ok(self.close(moment))
    }

    /// Advances by one frame, in the host's order: commands that were carried out between two
    /// frames, then [`Sim::step`] with the decision of traffic and the frame's own commands.
    fn step(&mut self, moment: &RecordedFrame) -> anyhow::Result<Option<String>> {
        self.nanos = StepNanos::default();
        let (early, late) =
            moment.journal.split_at_checked(moment.early as usize).context("bad journal")?;
        let (early, late) = (simulated(early), simulated(late));
        let mut services = TimedServices::creating(&early);
        let Ok(()) = self.sim.apply_between_frames(&requests(&early), &mut services);
        if let Some(what) = differing_outcome(&early, &services.journal) {
            return Ok(Some(what));
        }
        if let Some((header, payload)) = &moment.decision.whole {
            self.take(header, payload, true)?;
        } else if moment.decision.frame > self.decided.frame {
            self.plan_on(moment.decision.frame)?;
        }
        if self.decided.hash != moment.decision.hash {
            return Ok(Some(format!("what traffic decided on {}", self.decided.frame)));
        }
        let Decided { controls, walkers, lights, hash, .. } = &self.decided;
        let parts = TrafficParts { controls, walkers, lights, planner: &[] };
        let decision = sim_host::Decision { parts, hash: *hash };
        let requests = requests(&late);
        let inputs = Inputs { decision: Some(decision), requests: &requests };
        let mut services = TimedServices::creating(&late);
        let begin_nanos = clock::now_nanos();
        let Ok(_) = self.sim.step(&inputs, &mut services);
        let end_nanos = clock::now_nanos();
        let TimedServices { applied_nanos, stepped_nanos, .. } = services;
        self.nanos.commands = applied_nanos - begin_nanos;
        self.nanos.physics = stepped_nanos - applied_nanos;
        self.nanos.state_hash = end_nanos - stepped_nanos;
        if let Some(what) = differing_outcome(&late, &services.journal) {
            return Ok(Some(what));
        }
        Ok(self.close(moment))
    }

    /// Compares a frame with its recording, and queues it for traffic.
    fn close(&mut self, moment: &RecordedFrame) -> Option<String> {
        let actors = self.sim.states().to_vec();
        let found = differing(&moment.actors, &actors).or_else(|| {
            let hash = self.sim.state_hash();
            (hash != moment.state_hash)
                .then(|| format!("state hash {hash:016x}, recorded {:016x}", moment.state_hash))
        });
        self.waiting.push_back(PendingFrame {
            stamp: moment.stamp,
            delta_nanos: moment.delta_nanos,
            actors,
            journal: moment.journal.clone(),
        });
        found
    }

    fn take(
        &mut self,
        header: &TrafficHeader,
        payload: &[u8],
        with_planner: bool,
    ) -> anyhow::Result<()> {
        let blocks = bytemuck::pod_collect_to_vec::<u8, Block>(payload);
        let parts = header.parts(&blocks).context("a decision is cut off")?;
        self.decided = Decided {
            frame: header.stamp.frame,
            controls: parts.controls.to_vec(),
            walkers: parts.walkers.to_vec(),
            lights: parts.lights.to_vec(),
            hash: decision_hash(payload),
        };
        if with_planner {
            self.planner.restore(parts.planner)?;
        }
        while self.waiting.front().is_some_and(|seen| seen.stamp.frame <= header.stamp.frame) {
            self.waiting.pop_front();
        }
        Ok(())
    }

    /// Lets traffic plan on `frame` and skip the frames before it, as in the recorded run.
    fn plan_on(&mut self, frame: Frame) -> anyhow::Result<()> {
        let mut journal = Vec::new();
        let seen = loop {
            let seen = self.waiting.pop_front();
            let mut seen = seen.with_context(|| {
                format!("the snapshot of {frame} on which traffic planned is not recorded")
            })?;
            journal.append(&mut seen.journal);
            if seen.stamp.frame == frame {
                break seen;
            }
        };
        let begin_nanos = clock::now_nanos();
        self.planner.plan(seen.delta_nanos, &seen.actors, &journal);
        let planned_nanos = clock::now_nanos();
        let planner = self.planner.save();
        let saved_nanos = clock::now_nanos();
        self.nanos.plan = Some((planned_nanos - begin_nanos, saved_nanos - planned_nanos));
        let parts = self.planner.parts(&planner);
        let header = TrafficHeader { stamp: seen.stamp, ..TrafficHeader::default() };
        let header = header.counting(&parts);
        let mut blocks = vec![Block([0; 64]); header.layout().blocks];
        header.fill(&mut blocks, &parts);
        self.take(&header, bytemuck::cast_slice(&blocks), false)
    }
}

/// Returns the entries of a journal whose commands the simulation executes. Services of the host
/// are not simulated.
fn simulated(entries: &[JournalEntry]) -> Vec<JournalEntry> {
    let is_simulated = |entry: &&JournalEntry| {
        entry.command.decode().is_some_and(|command| match command.group() {
            CommandGroup::World(_) | CommandGroup::Standing(_) => true,
            // Hybrid physics is full around actors with sensors.
            CommandGroup::Sensor(SensorCommand::CreateBundle(_) | SensorCommand::Sensor(_)) => {
                entry.outcome.status == status::DONE
            }
            CommandGroup::Sensor(_) | CommandGroup::Service(_) => false,
        })
    };
    entries.iter().filter(is_simulated).copied().collect()
}

fn requests(entries: &[JournalEntry]) -> Vec<Request> {
    entries.iter().map(Request::from).collect()
}

/// Returns the first command whose outcome differs from the recorded one.
fn differing_outcome(recorded: &[JournalEntry], now: &[JournalEntry]) -> Option<String> {
    recorded.iter().zip(now).find_map(|(recorded, now)| {
        let (then, now) = (recorded.outcome.result(), now.outcome.result());
        let is_same = match (&now, &then) {
            (Ok(now), Ok(then)) => now == then,
            (Err(_), Err(_)) => true,
            _ => false,
        };
        let command = recorded.command.decode();
        (!is_same).then(|| format!("{command:?} ended as {now:?}, recorded {then:?}"))
    })
}

/// Returns the first actor that differs from the recorded one. A recording of inputs has none.
fn differing(recorded: &[ActorState], now: &[ActorState]) -> Option<String> {
    if recorded.is_empty() {
        return None;
    }
    let bits = |state: &ActorState| -> [u32; 32] { bytemuck::cast(*state) };
    for (was, is) in recorded.iter().zip(now) {
        if was.actor_id != is.actor_id {
            let first = was.actor_id.min(is.actor_id);
            return Some(format!("{first} is in only one of them"));
        }
        if bits(was) != bits(is) {
            let off_m = was.pose.position().distance(is.pose.position());
            return Some(format!("{} is {off_m} m from its recorded position", was.actor_id));
        }
    }
    (recorded.len() != now.len())
        .then(|| format!("there are {} actors, recorded {}", now.len(), recorded.len()))
}
