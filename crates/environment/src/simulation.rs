//! The simulation core and the planner of traffic in one thread.

use std::{convert::Infallible, sync::Arc, thread};

use bake::Cache;
use bytemuck::Zeroable;
use protocol::{
    ActorState, Block, Command, Episode, JournalEntry, Name, Outcome, Stamp, TrafficHeader, flag,
    status,
};
use road::Network;
use sim_host::{Decision, Inputs, Outputs, Request, Services, Sim, decision_hash, physics::Ground};
use town::Town;
use traffic::Planner;

use crate::kinematic;

/// A world without bus and barrier. As in a run with processes, traffic decides on a frame what acts
/// in the next one, so that frames have the same state hashes.
///
/// Vehicles that are kinematic and on autopilot drive too, unlike in a run with processes: traffic
/// plans for them, and they move exactly as it means.
pub struct Simulation {
    sim: Sim,
    planner: Planner,
    /// The hash of the newest decision; `None` before the first.
    decided: Option<u64>,
    /// Requests for the next frame.
    requests: Vec<Request>,
    journal: Journal,
    sequence: u64,
    /// Bytes of the planner and of its decision; kept to reuse their allocations.
    saved: Vec<u8>,
    blocks: Vec<Block>,
    /// The actors as traffic sees them, if it drives kinematic vehicles.
    seen: Vec<ActorState>,
}

/// The flags of a kinematic vehicle that traffic drives.
const DRIVEN: u32 = flag::KINEMATIC | flag::AUTOPILOT;

/// Sets the velocities of kinematic vehicles to what traffic has planned for the next frame.
fn drive_kinematic(sim: &mut Sim, planner: &Planner) {
    let delta_s = sim.settings().delta_nanos as f32 * 1e-9;
    for control in planner.controls() {
        let Some(state) = sim.world().state(control.actor_id).filter(|s| s.has(DRIVEN)) else {
            continue;
        };
        let motion = planner.intended_motion(control, state);
        let ground = sim.world().physics().ground();
        let to = kinematic::velocity(state, &motion, ground, delta_s);
        let (linear, turn) = (to.velocity_mps, to.angular_velocity_radps);
        let done = sim.world_mut().drive_kinematic(control.actor_id, linear, turn);
        debug_assert!(done.is_ok(), "{done:?}");
    }
}

/// The commands of a frame with their outcomes, for traffic.
#[derive(Default)]
struct Journal(Vec<JournalEntry>);

impl Services for Journal {
    type Error = Infallible;

    fn journal(&mut self, entry: JournalEntry) {
        self.0.push(entry);
    }
}

impl Simulation {
    /// Creates a simulation at frame 0.
    pub fn new(network: Arc<Network>, town: &Town, seed: u64) -> Simulation {
        Simulation::of(|| Sim::new(town, seed), || Planner::new(Arc::clone(&network), seed))
    }

    /// Creates a simulation at frame 0 whose constant parts come from the cache if possible.
    /// `solids` is the town without its mesh.
    pub(crate) fn cached(
        cache: &Cache,
        network: &Arc<Network>,
        solids: &Town,
        episode: &Episode,
    ) -> Simulation {
        let Episode { open_drive, seed, .. } = episode;
        let sim = || {
            let mesh = || cache.ground_around(network, open_drive, *seed).mesh;
            Sim::on(Arc::new(Ground::cached(cache, open_drive, *seed, mesh)), solids, *seed)
        };
        Simulation::of(sim, || Planner::cached(cache, network, open_drive, *seed))
    }

    fn of(sim: impl FnOnce() -> Sim, planner: impl Fn() -> Planner + Sync) -> Simulation {
        // Both take about as long.
        let (sim, planner) = thread::scope(|scope| {
            let helper = thread::Builder::new().name("planner".to_owned());
            let helper = helper.spawn_scoped(scope, &planner);
            let sim = sim();
            let done = helper.ok().and_then(|helper| helper.join().ok());
            (sim, done.unwrap_or_else(&planner))
        });
        Simulation::with(sim, planner)
    }

    fn with(sim: Sim, planner: Planner) -> Simulation {
        Simulation {
            sim,
            planner,
            decided: None,
            requests: Vec::new(),
            journal: Journal::default(),
            sequence: 0,
            saved: Vec::new(),
            blocks: Vec::new(),
            seen: Vec::new(),
        }
    }

    /// Returns a simulation of the same map at frame 0, with another seed.
    pub fn restarted(&self, seed: u64) -> Simulation {
        Simulation::with(self.sim.restarted(seed), self.planner.restarted(seed))
    }

    /// Lets kinematic vehicles that are far from others move once a frame
    /// ([`sim_host::physics::Physics::set_far`]).
    pub(crate) fn set_far(&mut self, far_m: f32) {
        self.sim.world_mut().set_far(far_m);
    }

    /// The simulation core.
    pub fn sim(&self) -> &Sim {
        &self.sim
    }

    /// The stamp of the newest frame.
    pub fn stamp(&self) -> Stamp {
        self.sim.stamp()
    }

    /// Applies a command between two frames.
    pub fn apply(&mut self, command: Command) -> Outcome {
        let request = self.request_of(command);
        let Ok(()) = self.sim.apply_between_frames(&[request], &mut self.journal);
        self.journal.0.last().map_or_else(Outcome::zeroed, |entry| entry.outcome)
    }

    /// Lets the next frame apply a command.
    pub fn request(&mut self, command: Command) {
        let request = self.request_of(command);
        self.requests.push(request);
    }

    fn request_of(&mut self, command: Command) -> Request {
        self.sequence += 1;
        Request {
            client: Name::new("environment"),
            sequence: self.sequence,
            command: command.into(),
        }
    }

    /// Advances by one frame.
    pub fn step(&mut self) -> Outputs {
        let parts = self.planner.parts(&[]);
        let decision = self.decided.map(|hash| Decision { parts, hash });
        if decision.is_some() {
            drive_kinematic(&mut self.sim, &self.planner);
        }
        let inputs = Inputs { decision, requests: &self.requests };
        let Ok(outputs) = self.sim.step(&inputs, &mut self.journal);
        self.requests.clear();
        let done = self.journal.0.iter().all(|entry| entry.outcome.status == status::DONE);
        debug_assert!(done, "a command of the environment was refused");
        let Simulation { sim, planner, seen, journal, .. } = self;
        if sim.states().iter().any(|state| state.has(DRIVEN)) {
            seen.clear();
            seen.extend(sim.states().iter().map(|state| match state.has(DRIVEN) {
                true => ActorState { flags: state.flags & !flag::KINEMATIC, ..*state },
                false => *state,
            }));
            planner.plan(outputs.delta_nanos, seen, &journal.0);
        } else {
            planner.plan(outputs.delta_nanos, sim.states(), &journal.0);
        }
        self.journal.0.clear();
        self.decided = Some(self.hash_of_decision());
        outputs
    }

    /// Returns the hash of the message in which traffic would send its decision.
    fn hash_of_decision(&mut self) -> u64 {
        let Simulation { planner, saved, blocks, .. } = self;
        planner.save_into(saved);
        let parts = planner.parts(saved);
        let header = TrafficHeader::default().counting(&parts);
        blocks.clear();
        blocks.resize(header.layout().blocks, Block::zeroed());
        header.fill(blocks, &parts);
        decision_hash(bytemuck::cast_slice(blocks))
    }
}
