//! The host process around the simulation core: participants, channels, the journal, sensor
//! bundles, recordings, replays and saved states.

use std::{
    collections::BTreeMap,
    sync::{Arc, atomic::AtomicBool},
};

use bake::Cache;
use bus::{
    ControlPageMapping, Ending, HostInstant, HostPorts, OwnedInstance, Queues, Role, Strategy,
    clock,
};
use protocol::{
    ActorId, BundleId, BundleReceipt, Command, CreateBundle, Episode, Frame, JournalEntry, Name,
    Outcome, QueryHeader, Refusal, SensorSpec, ServiceCommand, Settings, SnapshotHeader, Stamp,
    Transmit, layout,
};

use crate::{
    HostError,
    barrier::{Barrier, Verdict},
    bundles::Bundles,
    decision::Decided,
    flow::FlowControl,
    journal::{Inbox, JournalWriter},
    keyframes::Keyframes,
    maps::Maps,
    physics::Physics,
    physics_sensors::{PhysicsSensors, are_physics_sensors, needs_roads},
    progress::StageProgress,
    recording::Recording,
    replay::Replay,
    request::Request,
    sim::{Outputs, Services, Sim},
    supervisor::Supervisor,
};

mod episode;
mod flow;
mod recorder;
mod replays;
mod slots;
mod stalls;
mod states;

/// The configuration of a host.
pub struct HostConfig {
    /// Name of the instance; `None` for one derived from the process id.
    pub name: Option<String>,
    /// The first episode.
    pub episode: Episode,
    /// The source of other maps.
    pub maps: Arc<dyn Maps>,
    /// Initial settings.
    pub settings: Settings,
    /// Layers of the town that are hidden initially, as bits of [`protocol::layer`].
    pub hidden_layers: u32,
    /// The wait strategy of the host and all participants.
    pub strategy: Strategy,
    /// Time that a tick waits for a participant; `None` waits forever.
    pub deadline_nanos: Option<u64>,
    /// Whether a stage that dies is restarted.
    pub restart: bool,
    /// What happens when a stage lives but does not arrive by the deadline of a synchronous frame.
    pub on_stall: OnStall,
    /// The roles of the stages to start.
    pub stages: Vec<Role>,
    /// Set by the caller to stop the host.
    pub stop: Arc<AtomicBool>,
}

/// What happens to a synchronous frame at which a stage has not arrived by the deadline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnStall {
    /// The frame ends late, and names the stage.
    #[default]
    Late,
    /// The stage is killed and started again, and completes the frame.
    Restart,
}

/// Longest sleep of an idle host before it checks its participants.
pub(crate) const IDLE_NANOS: u64 = 100_000_000;
/// A stage that starts, or builds its copy of another town, has failed when its process has used no
/// processor time for this long. On a loaded machine the start may take any time.
pub(crate) const START_NANOS: u64 = 60_000_000_000;
/// Time between two log lines about a stage that has not started.
const START_LOG_NANOS: u64 = 20_000_000_000;

/// The host process around the simulation core.
pub(crate) struct Shell {
    pub control: ControlPageMapping,
    pub barrier: Barrier,
    /// The settings on the control page.
    pub settings: Settings,
    /// Before the ports: the stages end while their channels are there.
    pub supervisor: Supervisor,
    pub ports: HostPorts,
    pub inbox: Inbox,
    pub journal: JournalWriter,
    pub keyframes: Keyframes,
    pub bundles: Bundles,
    pub physics_sensors: PhysicsSensors,
    /// The newest decision of traffic, from which a restarted traffic continues.
    pub decided: Option<Decided>,
    pub recording: Option<Recording>,
    /// Why the last recording ended before it was stopped, until a client is told.
    pub recording_error: Option<String>,
    /// The frame of the decision that acted in the frame recorded last.
    pub recorded_decision: Frame,
    pub replay: Option<Replay>,
    /// Number of journal entries of the coming frame that were applied before its tick began.
    pub early: usize,
    pub tick: TickTimes,
    /// Whether a tick is in progress; commands that belong between two frames are then deferred.
    pub is_ticking: bool,
    /// When the last frame was complete.
    pub closed_nanos: u64,
    /// Dead renderers whose ports are still on the bus, for clients that have not read them.
    pub kept: Vec<u32>,
    /// Whether this thread runs as soon as it is woken: while there are sensors to be measured.
    pub prefers_latency: bool,
    /// Commands that came with a tick and belong between two frames.
    pub deferred: Vec<Request>,
    /// How far clients have read.
    pub flow: FlowControl,
    /// Number of the current episode.
    pub episode_number: u32,
    pub cache: Cache,
    /// For each stage that participates, the serial of the first journal part that it was sent.
    pub journal_from: BTreeMap<usize, u64>,
    pub roles: BTreeMap<usize, Role>,
    /// For each stage, the frame of its last death and the number of deaths in that frame.
    pub deaths: BTreeMap<usize, (Frame, u32)>,
    /// The count of notifications when the slots were served last.
    pub served_count: u32,
    /// For each stage, its last progress in asynchronous mode.
    pub progress: StageProgress,
    pub config: HostConfig,
    // The last field, so that the files are removed after the ports are closed.
    pub owned_instance: OwnedInstance,
}

/// The times at which the parts of a tick ended, on the host's clock.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TickTimes {
    pub begin_nanos: u64,
    pub applied_nanos: u64,
    pub stepped_nanos: u64,
}

impl Services for Shell {
    type Error = HostError;

    fn journal(&mut self, entry: JournalEntry) {
        self.journal.write(entry);
    }

    fn create_bundle(
        &mut self,
        client: Name,
        bundle: &CreateBundle,
        sensors: &[SensorSpec],
        receipt: BundleReceipt,
    ) -> Result<BundleId, Refusal> {
        let id = self.bundles.create(client, bundle, sensors, &mut self.ports)?;
        match self.mount(id, bundle, sensors, receipt) {
            Ok(()) => Ok(id),
            Err(why) => {
                let _ = self.bundles.destroy(id, &mut self.ports);
                Err(why)
            }
        }
    }

    fn destroy_bundle(&mut self, bundle: BundleId) -> Result<(), Refusal> {
        self.physics_sensors.unmount(bundle);
        self.bundles.destroy(bundle, &mut self.ports)
    }

    fn actor_destroyed(&mut self, actor: ActorId) {
        self.remove_bundles(self.bundles.on(actor));
    }

    fn transmit(&mut self, command: &Transmit) -> Result<u32, Refusal> {
        self.physics_sensors.transmit(command)
    }

    fn execute(
        &mut self,
        sim: &mut Sim,
        request: Request,
        command: &ServiceCommand,
    ) -> Result<(), HostError> {
        self.show_settings(sim.settings());
        let result = match command {
            ServiceCommand::SaveState(_)
            | ServiceCommand::LoadState(_)
            | ServiceCommand::LoadMap(_)
            | ServiceCommand::StartReplay(_)
                if self.is_ticking =>
            {
                self.deferred.push(request);
                return Ok(());
            }
            ServiceCommand::LoadMap(command) => return self.load_map(sim, request, command),
            ServiceCommand::LoadState(file) => return self.load_state(sim, request, file),
            ServiceCommand::StartReplay(command) => self.start_replay(sim, command)?,
            ServiceCommand::SaveState(file) => self.save_state(sim, file),
            ServiceCommand::StopReplay(command) => {
                self.stop_replay(sim, command.keep_actors != 0);
                Ok(0)
            }
            ServiceCommand::StartRecorder(command) => self.start_recorder(sim, command),
            ServiceCommand::StopRecorder(_) => self.stop_recorder(),
        };
        let outcome = result.map_or_else(|why| Outcome::refused(&why), Outcome::done);
        self.journal.write(request.ended(outcome));
        Ok(())
    }

    fn commands_applied(&mut self) {
        self.tick.applied_nanos = clock::now_nanos();
    }

    fn observe(&mut self, physics: &Physics, dt_s: f32) {
        if !self.physics_sensors.is_empty() {
            self.physics_sensors.observe(physics, dt_s);
        }
    }

    fn physics_stepped(&mut self, sim: &mut Sim) {
        self.show_recorded(sim);
        self.tick.stepped_nanos = clock::now_nanos();
    }
}

impl Shell {
    /// Whether the host was asked to stop.
    pub(crate) fn is_stopped(&self) -> bool {
        self.config.stop.load(std::sync::atomic::Ordering::Acquire) || self.control.is_ending()
    }

    /// Whether the ticking client requested a frame that is not complete.
    pub(crate) fn is_requested(&self) -> bool {
        let ticker = self.control.ticker();
        ticker.is_some_and(|slot| self.control.slot(slot).request() > self.barrier.frame())
    }

    /// The name of the client that requests frames.
    pub(crate) fn ticking(&self) -> Option<Name> {
        self.control.ticker().map(|slot| self.control.slot(slot).name())
    }

    /// Receives the decisions of traffic and keeps the newest.
    pub(crate) fn receive_decided(&mut self) -> Result<(), HostError> {
        while let Some(sample) = self.ports.traffic.receive()? {
            let last = self.decided.as_ref().map(|last| last.header().stamp.frame);
            if last.is_none_or(|last| sample.header().stamp.frame > last) {
                self.decided = Some(Decided::Received(sample));
            }
        }
        Ok(())
    }

    /// Answers the queries that have arrived. They change nothing, and no journal holds them.
    pub(crate) fn answer_queries(&mut self, sim: &Sim) -> Result<(), HostError> {
        while let Some(batch) = self.ports.query.receive()? {
            let responses: Vec<_> = batch.payload().iter().map(|one| sim.answer(one)).collect();
            let header = QueryHeader { stamp: sim.stamp(), ..*batch.header() };
            self.ports.response.send(header, &responses)?;
            self.control.complete.notify_all();
        }
        Ok(())
    }

    /// Mounts a bundle of physics sensors, which the host measures.
    fn mount(
        &mut self,
        id: BundleId,
        bundle: &CreateBundle,
        specs: &[SensorSpec],
        receipt: BundleReceipt,
    ) -> Result<(), Refusal> {
        if !are_physics_sensors(specs) {
            return Ok(());
        }
        if specs.iter().any(needs_roads) && !self.physics_sensors.has_roads() {
            let Episode { map, open_drive, .. } = &self.config.episode;
            let network =
                self.cache.network(map, open_drive).map_err(|e| Refusal::map(e.to_string()))?;
            self.physics_sensors.set_roads(network);
        }
        let (_, bytes) = layout(specs);
        let writer = self.ports.bundle(id, bytes).map_err(|e| Refusal::full(e.to_string()))?;
        self.physics_sensors.mount(id, bundle.parent, specs, receipt, writer);
        Ok(())
    }

    /// Removes bundles whose actor or client is gone.
    pub(crate) fn remove_bundles(&mut self, bundles: Vec<BundleId>) {
        for bundle in bundles {
            self.physics_sensors.unmount(bundle);
            let _ = self.bundles.destroy(bundle, &mut self.ports);
            let line = Request::of_host(Command::DestroyBundle(bundle));
            self.journal.write(line.ended(Outcome::done(bundle.0)));
        }
    }

    /// Publishes the settings on the control page, if a command changed them.
    pub(crate) fn show_settings(&mut self, settings: &Settings) {
        if self.settings != *settings {
            self.settings = *settings;
            self.set_lags(|shell, role| shell.lag(role));
            self.control.set_settings(settings);
        }
    }

    /// Returns the number of frames by which a stage may trail.
    pub(crate) fn lag(&self, role: Role) -> u64 {
        match (role, self.settings.synchronous != 0) {
            (Role::Render, true) => self.settings.pipeline.into(),
            (_, true) => 0,
            // In asynchronous mode the host waits for no stage.
            (_, false) => u64::MAX / 2,
        }
    }

    pub(crate) fn set_lags(&mut self, lag: impl Fn(&Shell, Role) -> u64) {
        for (slot, role) in self.roles.clone() {
            let lag = lag(self, role);
            self.control.slot(slot).set_lag(lag);
            self.barrier.set_lag(slot, lag);
        }
    }

    /// Publishes the journal, then the snapshot and the measurements of physics sensors, and raises
    /// the tick word last: a participant that sees the word finds all of them.
    pub(crate) fn publish(&mut self, sim: &Sim, outputs: &Outputs) -> Result<(), HostError> {
        let stamp = outputs.stamp;
        self.show_settings(sim.settings());
        self.announce(stamp)?;
        let entries = self.journal.take_frame(stamp);
        self.send_journal()?;
        let header = self.send_snapshot(sim, outputs, entries.len() as u32)?;
        self.physics_sensors.send(sim.world(), &header)?;
        let kept = if self.recording.is_some() { entries.clone() } else { Vec::new() };
        let planned = self.planned();
        self.keyframes.close(stamp, entries, planned);
        self.record(sim, &header, &kept);
        if self.prefers_latency == self.bundles.is_empty() {
            self.prefers_latency = !self.prefers_latency;
            bus::prefer_latency(self.prefers_latency);
        }
        self.mark_published(stamp.frame);
        self.control.set_awaited(stamp.frame, self.barrier.mask());
        self.control.tick.raise(stamp.frame.0);
        Ok(())
    }

    /// Stores the stage clock of a frame that is about to be seen, and how much waits.
    fn mark_published(&self, frame: Frame) {
        let TickTimes { begin_nanos, applied_nanos, stepped_nanos } = self.tick;
        for (instant, nanos) in [
            (HostInstant::Begun, begin_nanos),
            (HostInstant::PhysicsBegun, applied_nanos),
            (HostInstant::PhysicsEnded, stepped_nanos),
            (HostInstant::Published, clock::now_nanos()),
        ] {
            self.control.mark_host(instant, frame, nanos);
        }
        for seen in self.inbox.control_frames() {
            self.control.mark_host(HostInstant::ControlApplied, *seen, applied_nanos);
        }
        let recorded = self.recording.as_ref().map_or(0, |recording| recording.recorder.queued());
        self.control.set_queues(Queues {
            commands: self.inbox.len() as u64,
            journal_parts: self.journal.backlog() as u64,
            recorded_frames: recorded as u64,
        });
    }

    /// Completes a frame.
    pub(crate) fn close(&mut self, frame: Frame, verdict: &Verdict) {
        self.closed_nanos = clock::now_nanos();
        self.control.mark_host(HostInstant::Closed, frame, self.closed_nanos);
        self.control.close(frame, ending(verdict));
    }

    /// Sends clients the outcomes that they do not have.
    fn announce(&mut self, stamp: Stamp) -> Result<(), HostError> {
        self.journal.announce(&self.ports, stamp)?;
        self.control.set_outcomes_sent(self.journal.outcome_serial());
        Ok(())
    }

    /// Publishes the journal entries of the coming frame that are written so far.
    pub(crate) fn publish_early(&mut self, sim: &Sim) -> Result<(), HostError> {
        self.show_settings(sim.settings());
        let stamp = Stamp { frame: sim.stamp().frame.next(), ..sim.stamp() };
        self.announce(stamp)?;
        self.control.complete.notify_all();
        Ok(())
    }

    /// Returns the frame up to which traffic has planned.
    fn planned(&self) -> Frame {
        let traffic = self.roles.iter().find(|(_, role)| **role == Role::Traffic);
        let done = traffic.and_then(|(slot, _)| self.barrier.done(*slot));
        done.unwrap_or(self.barrier.frame())
    }

    /// Sends stages what they have room for of the journal.
    pub(crate) fn send_journal(&mut self) -> Result<(), HostError> {
        if self.journal.is_sent() {
            return Ok(());
        }
        let sent = self.journal.sent();
        let unread = |(slot, from): (&usize, &u64)| {
            sent - self.control.slot(*slot).journal_read().clamp(*from, sent)
        };
        let unread = self.journal_from.iter().map(unread).max().unwrap_or(0);
        let room = (bus::channel("journal").depth as u64).saturating_sub(unread);
        if self.journal.send_backlog(&self.ports, room)? {
            self.control.complete.notify_all();
        }
        if !self.journal.is_sent() {
            // Stages that wait for a frame have not read what they were sent for others.
            self.control.tick.notify_all();
        }
        Ok(())
    }

    /// Publishes the snapshot of the newest frame, and returns its header.
    pub(crate) fn send_snapshot(
        &mut self,
        sim: &Sim,
        outputs: &Outputs,
        journal_entries: u32,
    ) -> Result<SnapshotHeader, HostError> {
        let states = sim.states();
        let limbs = sim.world().limbs();
        let mut loan = self.ports.snapshot.loan(states.len(), limbs.len())?;
        let (actors_out, limbs_out) = loan.parts_mut();
        actors_out.copy_from_slice(states);
        limbs_out.copy_from_slice(limbs);
        let TickTimes { begin_nanos, applied_nanos, stepped_nanos } = self.tick;
        let header = SnapshotHeader {
            stamp: outputs.stamp,
            delta_nanos: outputs.delta_nanos,
            begin_nanos,
            applied_nanos,
            stepped_nanos,
            published_nanos: clock::now_nanos(),
            state_hash: outputs.state_hash,
            collisions: outputs.collisions,
            journal_entries,
            journal_serial: self.journal.serial(),
            ..SnapshotHeader::default()
        };
        loan.send(header)?;
        Ok(header)
    }

    /// Waits until every stage has joined, as long as those that have not use their processor.
    pub(crate) fn await_stages(&mut self) -> Result<(), HostError> {
        let begun = clock::now_nanos();
        let mut log_nanos = begun + START_LOG_NANOS;
        // The processor time of the stage that is awaited, and when it last increased.
        let mut progress = (None, begun);
        loop {
            self.service_slots()?;
            let alive = self.control.alive();
            let missing = self.roles.iter().find(|(slot, _)| alive & 1 << **slot == 0);
            let Some((&slot, role)) = missing.filter(|_| !self.is_stopped()) else {
                return Ok(());
            };
            let now = clock::now_nanos();
            if now > log_nanos.min(progress.1 + START_NANOS) {
                let used = self.supervisor.processor_ticks(slot);
                if used.is_none() || progress.0 != Some((slot, used)) {
                    progress = (Some((slot, used)), now);
                } else if now > progress.1 + START_NANOS {
                    let idle = START_NANOS / 1_000_000_000;
                    let why = format!("its process has used no processor time for {idle} s");
                    return Err(HostError::Start { role: role.name(), why });
                }
                log::info!(
                    "{} {} is starting, for {} s now; is the machine loaded?",
                    self.barrier.frame().0,
                    role.name(),
                    (now - begun) / 1_000_000_000
                );
                log_nanos = now + START_LOG_NANOS;
            }
            self.control
                .host
                .listen(Strategy::BATCH, Some(clock::now_nanos() + 5_000_000), || None::<()>);
        }
    }

    /// Waits until all participants have arrived at `frame`. Calls `serve` at first and whenever a
    /// client or a participant has sent something.
    pub(crate) fn await_arrivals(
        &mut self,
        frame: Frame,
        serve: impl FnMut(&mut Shell) -> Result<(), HostError>,
    ) -> Result<Verdict, HostError> {
        // In asynchronous mode the host waits for no participant.
        self.await_all(frame, self.config.deadline_nanos, 0, serve)
    }

    /// Returns the processor time of the stages in `mask` that have not arrived, in clock ticks.
    fn processor_ticks(&self, mask: u64) -> u64 {
        let missing = self.barrier.missing() & mask;
        let slots = self.roles.keys().filter(|slot| missing & 1 << **slot != 0);
        slots.filter_map(|slot| self.supervisor.processor_ticks(*slot)).sum()
    }

    /// Waits until all participants have arrived at `frame`; in asynchronous mode, until those of
    /// `mask` have. The stages of `mask` may take longer than `timeout_nanos` while they use their
    /// processor.
    fn await_all(
        &mut self,
        frame: Frame,
        timeout_nanos: Option<u64>,
        mask: u64,
        mut serve: impl FnMut(&mut Shell) -> Result<(), HostError>,
    ) -> Result<Verdict, HostError> {
        let is_synchronous = self.settings.synchronous != 0;
        let mut deadline = timeout_nanos.map(|d| clock::now_nanos() + d);
        let mut used = self.processor_ticks(mask);
        // What was notified while the frame was computed is not served yet.
        let mut last_count = self.served_count;
        loop {
            let members: Vec<_> = self.barrier.slots().collect();
            for slot in members {
                self.barrier.arrive(slot, self.control.slot(slot).ack());
            }
            let now = clock::now_nanos();
            if deadline.is_some_and(|d| now >= d) && self.processor_ticks(mask) != used {
                // Stages that build a town are waited for as long as they work on it.
                used = self.processor_ticks(mask);
                deadline = timeout_nanos.map(|d| now + d);
            }
            let has_stages = !is_synchronous && self.barrier.missing() & mask == 0;
            let is_late = has_stages || deadline.is_some_and(|d| now >= d);
            let verdict = self.barrier.verdict(is_late);
            if let Verdict::Late(mask) = verdict
                && is_synchronous
                && !self.is_stopped()
                && self.config.on_stall == OnStall::Restart
                && self.restart_stalled(mask)
            {
                deadline = timeout_nanos.map(|d| now + d);
                continue;
            }
            if verdict != Verdict::Open || self.is_stopped() {
                if let Verdict::Late(mask) = verdict
                    && is_synchronous
                {
                    log::warn!(
                        "{} {} has not arrived after {:.1} s; is it alive? --deadline-secs 0 waits forever",
                        frame.0,
                        self.barrier.names(mask),
                        timeout_nanos.unwrap_or(0) as f64 / 1e9
                    );
                }
                return Ok(if is_synchronous { verdict } else { Verdict::Complete });
            }
            serve(self)?;
            let wake_nanos = clock::now_nanos() + self.pause_nanos();
            let wake_nanos = Some(deadline.unwrap_or(u64::MAX).min(wake_nanos));
            let (control, last) = (&self.control, last_count);
            let members = self.barrier.mask();
            let live_all = || control.alive() & members == members;
            let new_count = control.host.listen(self.config.strategy, wake_nanos, || {
                let count = control.host.count();
                (count != last || live_all() && control.missing(frame) == 0).then_some(count)
            });
            last_count = new_count.unwrap_or(last_count);
            if control.missing(frame) != 0 || !live_all() {
                self.service_slots()?;
            }
        }
    }
}

/// Returns the verdict of a frame in the form of the control page.
fn ending(verdict: &Verdict) -> Ending {
    match *verdict {
        Verdict::Late(mask) => Ending::Late(mask),
        Verdict::Degraded(mask) => Ending::Degraded(mask),
        Verdict::Open | Verdict::Complete => Ending::Complete,
    }
}
