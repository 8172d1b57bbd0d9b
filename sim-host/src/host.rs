//! The host: creates the instance and runs ticks.

use std::{
    collections::BTreeMap,
    sync::{Arc, atomic::Ordering},
};

use bake::Cache;
use bus::{BusNode, HostPorts, Instance, OwnedInstance, Strategy, clock, process};
use protocol::{Command, Episode, Frame, HideLayers, Outcome, StandingCommand};

use crate::{
    HostError,
    barrier::{Barrier, Verdict},
    bundles::Bundles,
    flow::FlowControl,
    journal::{Inbox, JournalWriter},
    keyframes::Keyframes,
    maps::MapThread,
    physics_sensors::PhysicsSensors,
    processes::SystemProcesses,
    progress::StageProgress,
    request::Request,
    shell::{HostConfig, Shell, TickTimes},
    sim::{Decision, Inputs, Outputs, Sim},
    supervisor::{Launcher, Processes, Reports, Supervisor},
    world::World,
};

/// The number of the first episode.
const FIRST_EPISODE: u32 = 1;

/// Shared memory that the channels of a world without bundles may need, in bytes.
const SHARED_MEMORY_MIN: u64 = 64 << 20;

/// The running host: the simulation core, and the process around it.
pub struct Host {
    pub(crate) sim: Sim,
    pub(crate) shell: Shell,
}

impl Host {
    /// Creates the instance, builds the world and starts the stages; the host is then at frame 0.
    ///
    /// # Errors
    ///
    /// The map cannot be read, there is too little shared memory, a stage does not start, or the
    /// host is stopped before that.
    pub fn start(config: HostConfig, launcher: Box<dyn Launcher>) -> Result<Host, HostError> {
        let cache = Cache::from_environment();
        let Episode { open_drive, seed, .. } = config.episode.clone();
        let stop = Arc::clone(&config.stop);
        let is_stopped = || stop.load(Ordering::Acquire);
        // A bad map is reported before anything starts.
        let map = MapThread::start(&cache, &config.episode)?;
        map.await_valid(is_stopped)?;
        let free = bus::free_bytes()?;
        if free < SHARED_MEMORY_MIN {
            return Err(HostError::SharedMemory { free, needed: SHARED_MEMORY_MIN });
        }
        let owned_instance = Instance::create(config.name.as_deref())?;
        owned_instance.instance().write_blueprints(&blueprints())?;
        owned_instance.instance().write_maps(&config.maps.names())?;
        let node = owned_instance.node(launcher.is_single_process())?;
        let instance = owned_instance.instance().clone();
        let processes = |reports| -> std::io::Result<Box<dyn Processes>> {
            Ok(Box::new(SystemProcesses::new(&instance, launcher, reports)?))
        };
        let world = || {
            let (world, town) = map.finish(is_stopped)?;
            if let Some(town) = town {
                cache.keep_town(&open_drive, seed, &town);
            }
            Ok(world)
        };
        Host::create(config, owned_instance, node, &cache, processes, world)
    }

    /// Starts the stages of an instance, and the world while they start; the host is then at frame 0.
    pub(crate) fn create(
        config: HostConfig,
        owned_instance: OwnedInstance,
        node: BusNode,
        cache: &Cache,
        processes: impl FnOnce(Reports) -> std::io::Result<Box<dyn Processes>>,
        world: impl FnOnce() -> Result<World, HostError>,
    ) -> Result<Host, HostError> {
        let instance = owned_instance.instance().clone();
        instance.write_episode(FIRST_EPISODE, &config.episode)?;
        let control = owned_instance.control()?;
        let pid = process::own_pid();
        control.initialise(pid, process::start_time(pid).unwrap_or(0), config.strategy);
        control.set_settings(&config.settings);
        control.set_episode(FIRST_EPISODE);
        let ports = HostPorts::create(node)?;
        let mut supervisor = Supervisor::new(&instance, &control, processes)?;
        // The stages build their towns at the same time.
        let mut roles = BTreeMap::new();
        for (slot, role) in config.stages.iter().enumerate() {
            roles.insert(slot, *role);
            supervisor
                .start(*role, slot)
                .map_err(|e| HostError::Start { role: role.name(), why: e.to_string() })?;
        }
        let world = world()?;
        let mut sim = Sim::of(world);
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        sim.world_mut().set_threads(threads);
        let hide = HideLayers { layers: config.hidden_layers, hidden: 1 };
        let first =
            [StandingCommand::SetSettings(config.settings), StandingCommand::HideLayers(hide)];
        let mut lines = Vec::new();
        for command in first {
            let outcome = sim
                .apply_standing(&command, sim.stamp())
                .map_err(|refusal| HostError::Map(refusal.reason))?;
            lines.push(Request::of_host(command.into()).ended(Outcome { id: 0, ..outcome }));
        }
        let mut shell = Shell {
            control,
            barrier: Barrier::default(),
            settings: config.settings,
            ports,
            supervisor,
            inbox: Inbox::default(),
            journal: JournalWriter::default(),
            keyframes: Keyframes::default(),
            bundles: Bundles::default(),
            physics_sensors: PhysicsSensors::default(),
            decided: None,
            recording: None,
            recording_error: None,
            recorded_decision: Frame(0),
            replay: None,
            early: 0,
            tick: TickTimes::default(),
            is_ticking: false,
            closed_nanos: 0,
            kept: Vec::new(),
            prefers_latency: false,
            deferred: Vec::new(),
            flow: FlowControl::default(),
            episode_number: FIRST_EPISODE,
            cache: cache.clone(),
            journal_from: BTreeMap::new(),
            roles,
            deaths: BTreeMap::new(),
            served_count: 0,
            progress: StageProgress::default(),
            config,
            owned_instance,
        };
        shell.keyframes.close(sim.stamp(), lines, Frame(0));
        shell.send_snapshot(&sim, &Outputs { delta_nanos: 0, ..sim.outputs() }, 0)?;
        shell.await_stages()?;
        Ok(Host { sim, shell })
    }

    /// Returns the instance.
    pub fn instance(&self) -> &Instance {
        self.shell.owned_instance.instance()
    }

    /// Returns the newest frame.
    pub fn frame(&self) -> Frame {
        self.shell.barrier.frame()
    }

    /// Runs until the host is stopped. The stages are ended and the instance removed in every case.
    ///
    /// # Errors
    ///
    /// A stage died and is not restarted, or the bus fails.
    pub fn run(mut self) -> Result<Frame, HostError> {
        self.serve()?;
        Ok(self.frame())
    }

    /// Runs ticks until the host is stopped.
    pub(crate) fn serve(&mut self) -> Result<(), HostError> {
        let mut due_nanos = clock::now_nanos();
        while !self.shell.is_stopped() {
            if self.is_synchronous() {
                self.await_request()?;
                if !self.shell.is_requested() {
                    continue;
                }
                self.tick()?;
                self.serve_deferred()?;
            } else {
                due_nanos = self.pace(due_nanos)?;
                if !self.is_synchronous() && !self.shell.is_stopped() {
                    self.tick()?;
                    self.serve_deferred()?;
                }
                self.shell.service_slots()?;
            }
        }
        Ok(())
    }

    fn is_synchronous(&self) -> bool {
        self.sim.settings().synchronous != 0
    }

    /// In synchronous mode: sleeps until the ticking client requests a frame, and serves other
    /// participants meanwhile.
    fn await_request(&mut self) -> Result<(), HostError> {
        let mut last_count = self.shell.control.host.count();
        loop {
            self.shell.service_slots()?;
            // Commands that come with a request belong to the tick.
            if self.shell.is_requested() {
                return Ok(());
            }
            self.serve_urgent()?;
            if !self.is_synchronous() || self.shell.is_stopped() {
                return Ok(());
            }
            let deadline = Some(clock::now_nanos() + self.shell.pause_nanos());
            let (event, last) = (&self.shell.control.host, last_count);
            let new_count = event.listen(self.shell.config.strategy, deadline, || {
                let count = event.count();
                (count != last).then_some(count)
            });
            last_count = new_count.unwrap_or(last_count);
            if self.shell.is_requested() {
                return Ok(());
            }
        }
    }

    /// In asynchronous mode: sleeps until the next frame is due.
    fn pace(&mut self, due_nanos: u64) -> Result<u64, HostError> {
        let now = clock::now_nanos();
        let Some(step) = (self.sim.settings().delta_nanos * 1000)
            .checked_div(self.sim.settings().real_time_permille.into())
        else {
            return Ok(now);
        };
        if due_nanos <= now {
            // A host that is too slow does not catch up on missed frames.
            return Ok(if now - due_nanos > step { now + step } else { due_nanos + step });
        }
        let mut last_count = self.shell.control.host.count();
        while clock::now_nanos() < due_nanos && !self.shell.is_stopped() {
            let wake_nanos = clock::now_nanos() + self.shell.pause_nanos();
            let (event, last) = (&self.shell.control.host, last_count);
            let new_count = event.listen(Strategy::BATCH, Some(due_nanos.min(wake_nanos)), || {
                let count = event.count();
                (count != last).then_some(count)
            });
            last_count = new_count.unwrap_or(last_count);
            self.shell.service_slots()?;
            self.serve_urgent()?;
            if self.is_synchronous() {
                break;
            }
        }
        Ok(due_nanos + step)
    }

    /// Receives what decides the next frame: the newest decision of traffic, and the commands of
    /// clients in their order.
    pub(crate) fn drain_inputs(&mut self) -> Result<Vec<Request>, HostError> {
        self.shell.answer_queries(&self.sim)?;
        self.shell.receive_decided()?;
        let others = self.shell.batches_of_frame();
        let ticking = self.shell.ticking();
        let Shell { inbox, ports, journal, early, .. } = &mut self.shell;
        *early = journal.len();
        inbox.drain(ports, true)?;
        // Commands of the host itself, so that the journal, recordings and re-simulations have them.
        let bodies = self.sim.world().bodies_to_remove();
        let mut requests: Vec<_> =
            bodies.map(|id| Request::of_host(Command::Destroy(id))).collect();
        requests.append(&mut inbox.take(ticking, others));
        Ok(requests)
    }

    /// Advances the simulation core by one frame.
    pub(crate) fn step(&mut self, requests: &[Request]) -> Result<Outputs, HostError> {
        // The shell executes commands while the core reads the decision.
        let decided = self.shell.decided.take();
        let decision = decided.as_ref().and_then(|decided| {
            let parts = decided.header().parts(decided.payload())?;
            Some(Decision { parts, hash: decided.hash() })
        });
        let stepped = self.sim.step(&Inputs { decision, requests }, &mut self.shell);
        self.shell.decided = decided;
        stepped
    }

    /// Applies commands that came with a tick and belong between two frames.
    fn serve_deferred(&mut self) -> Result<(), HostError> {
        let requests = std::mem::take(&mut self.shell.deferred);
        if requests.is_empty() {
            return Ok(());
        }
        self.serve_requests(&requests)
    }

    /// Applies commands between two frames whose outcomes clients wait for.
    fn serve_urgent(&mut self) -> Result<(), HostError> {
        serve_urgent(&mut self.sim, &mut self.shell)
    }

    fn serve_requests(&mut self, requests: &[Request]) -> Result<(), HostError> {
        serve_requests(&mut self.sim, &mut self.shell, requests)
    }

    /// Waits until all participants have arrived at `frame`. Clients are served meanwhile as between
    /// two frames: the published frame changes no more, and none of them waits for what others
    /// measure.
    pub(crate) fn await_arrivals(&mut self, frame: Frame) -> Result<Verdict, HostError> {
        let Host { sim, shell } = self;
        shell.await_arrivals(frame, |shell| serve_urgent(sim, shell))
    }
}

fn serve_urgent(sim: &mut Sim, shell: &mut Shell) -> Result<(), HostError> {
    if shell.inbox.drain(&shell.ports, false)? {
        let (ticking, counts) = (shell.ticking(), shell.batches_between_frames());
        let requests = shell.inbox.take_urgent(ticking, counts);
        if !requests.is_empty() {
            serve_requests(sim, shell, &requests)?;
        }
    }
    shell.answer_queries(sim)
}

fn serve_requests(sim: &mut Sim, shell: &mut Shell, requests: &[Request]) -> Result<(), HostError> {
    sim.apply_between_frames(requests, shell)?;
    shell.publish_early(sim)
}

/// Returns the catalogue in the form that participants read.
fn blueprints() -> Vec<protocol::BlueprintInfo> {
    let info = |b: &town::Blueprint| protocol::BlueprintInfo {
        id: b.id.to_owned(),
        tag: b.tag as u8,
        half_extents_m: b.half_extents_m.to_array(),
        center_m: b.center_m.to_array(),
    };
    town::catalogue().iter().map(info).collect()
}
