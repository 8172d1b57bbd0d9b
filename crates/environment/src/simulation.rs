//! The simulation core and the planner of traffic in one thread.

use std::{convert::Infallible, sync::Arc};

use bytemuck::Zeroable;
use protocol::{Block, Command, JournalEntry, Name, Outcome, Stamp, TrafficHeader, status};
use road::Network;
use sim_host::{Decision, Inputs, Outputs, Request, Services, Sim, decision_hash};
use town::Town;
use traffic::Planner;

/// A world without bus and barrier. As in a run with processes, traffic decides on a frame what acts
/// in the next one, so that frames have the same state hashes.
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
        Simulation::of(Sim::new(town, seed), Planner::new(network, seed))
    }

    fn of(sim: Sim, planner: Planner) -> Simulation {
        Simulation {
            sim,
            planner,
            decided: None,
            requests: Vec::new(),
            journal: Journal::default(),
            sequence: 0,
            saved: Vec::new(),
            blocks: Vec::new(),
        }
    }

    /// Returns a simulation of the same map at frame 0, with another seed.
    pub fn restarted(&self, seed: u64) -> Simulation {
        Simulation::of(self.sim.restarted(seed), self.planner.restarted(seed))
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
        let decision = self.decided.map(|hash| Decision {
            controls: self.planner.controls(),
            lights: self.planner.lights(),
            hash,
        });
        let inputs = Inputs { decision, requests: &self.requests };
        let Ok(outputs) = self.sim.step(&inputs, &mut self.journal);
        self.requests.clear();
        let done = self.journal.0.iter().all(|entry| entry.outcome.status == status::DONE);
        debug_assert!(done, "a command of the environment was refused");
        self.planner.plan(outputs.delta_nanos, self.sim.states(), &self.journal.0);
        self.journal.0.clear();
        self.decided = Some(self.hash_of_decision());
        outputs
    }

    /// Returns the hash of the message in which traffic would send its decision.
    fn hash_of_decision(&mut self) -> u64 {
        let Simulation { planner, saved, blocks, .. } = self;
        planner.save_into(saved);
        let header = TrafficHeader {
            control_count: planner.controls().len() as u32,
            light_count: planner.lights().len() as u32,
            planner_len: saved.len() as u64,
            ..TrafficHeader::default()
        };
        blocks.clear();
        blocks.resize(header.layout().blocks, Block::zeroed());
        header.fill(blocks, planner.controls(), planner.lights(), saved);
        decision_hash(bytemuck::cast_slice(blocks))
    }
}
