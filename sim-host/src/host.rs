//! The host: founds the instance, lets processes in and out, and ticks.

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use bake::Cache;
use bus::{
    ControlPageMapping, Ending, HostPorts, Instance, OwnedInstance, Role, Strategy, clock, process,
};
use protocol::{
    BundleId, Command, Episode, Frame, HideLayers, JournalEntry, Name, Outcome, Settings,
    SnapshotHeader, Stamp,
};

use crate::{
    HostError,
    barrier::{Barrier, Verdict},
    bundles::Bundles,
    drawings::Drawings,
    journal::{Inbox, JournalWriter, Request},
    physics_sensors::{PhysicsSensors, are_physics_sensors, needs_roads},
    standing::Standing,
    supervisor::{Launcher, Supervisor},
    world::World,
};

mod episode;
mod fork;
mod recording;
mod replay;
mod slots;

pub use episode::Maps;
use episode::build_world;
use fork::Decided;
use recording::Recording;
use replay::Replay;

/// What a host is started with.
pub struct HostConfig {
    /// The instance's name; none: one from the process id.
    pub name: Option<String>,
    /// What world.
    pub episode: Episode,
    /// Where other worlds come from.
    pub maps: Box<dyn Maps>,
    /// How time passes at first.
    pub settings: Settings,
    /// Layers of the town that are switched off at first, as bits of [`protocol::layer`].
    pub hidden_layers: u32,
    /// How everybody waits.
    pub strategy: Strategy,
    /// How long a tick waits for a participant; none: for ever.
    pub deadline_nanos: Option<u64>,
    /// Whether a stage that dies is started anew.
    pub restart: bool,
    /// Which stages there are.
    pub stages: Vec<Role>,
    /// Set by whoever wants the host to end.
    pub stop: Arc<AtomicBool>,
}

/// No number of the weather or of traffic's params means anything beyond this.
const NUMBER_MAX: f32 = 1e6;

/// How long a stage may take until it is ready: it builds its own copy of the town.
const START_NANOS: u64 = 60_000_000_000;
/// How long an idle host sleeps at most before it looks around.
const IDLE_NANOS: u64 = 100_000_000;

/// The number of the world that a host starts with.
const FIRST: u32 = 1;

/// What the channels of a world without bundles may take.
const SHARED_MEMORY_MIN: u64 = 64 << 20;

/// The running host.
pub struct Host {
    pub(crate) control: ControlPageMapping,
    pub(crate) barrier: Barrier,
    pub(crate) world: World,
    pub(crate) settings: Settings,
    ports: HostPorts,
    supervisor: Supervisor,
    inbox: Inbox,
    pen: JournalWriter,
    bundles: Bundles,
    pub(crate) physics_sensors: PhysicsSensors,
    standing: Standing,
    drawings: Drawings,
    /// What traffic decided last: its planner goes to its successor.
    decided: Option<Decided>,
    decided_hash: u64,
    recording: Option<Recording>,
    replay: Option<Replay>,
    /// The frame on which was planned what acted in the frame recorded last.
    recorded_decision: Frame,
    /// How many lines of the coming frame's journal were carried out before its tick began.
    early: usize,
    /// A tick is under way: what must stand between two frames waits.
    is_ticking: bool,
    deferred: Vec<Request>,
    /// Lines that follow the one being carried out.
    retold: Vec<JournalEntry>,
    sim_time_nanos: u64,
    /// Counts the worlds that were loaded.
    number: u32,
    cache: Cache,
    /// How often each slot asked for a journal keyframe, as far as we answered.
    resyncs: BTreeMap<usize, u64>,
    roles: BTreeMap<usize, Role>,
    /// How often each stage died in the frame of its last death.
    deaths: BTreeMap<usize, (Frame, u32)>,
    config: HostConfig,
    // Last, so that the files go after the ports.
    owned_instance: OwnedInstance,
}

impl Host {
    /// Founds the instance, builds the world, starts the stages, and is at frame 0.
    pub fn start(config: HostConfig, launcher: Box<dyn Launcher>) -> Result<Host, HostError> {
        let cache = Cache::from_environment();
        let Episode { map, open_drive, seed } = config.episode.clone();
        // A bad map is reported before anything starts.
        let town_source = cache
            .town_source(&map, &open_drive, seed)
            .map_err(|e| HostError::Map(e.to_string()))?;
        let free = bus::free_bytes()?;
        if free < SHARED_MEMORY_MIN {
            return Err(HostError::SharedMemory { free, needed: SHARED_MEMORY_MIN });
        }
        let owned_instance = Instance::create(config.name.as_deref())?;
        let instance = owned_instance.instance().clone();
        instance.write_blueprints(&blueprints())?;
        instance.write_maps(&config.maps.names())?;
        instance.write_episode(FIRST, &config.episode)?;
        let control = owned_instance.control()?;
        let pid = process::own_pid();
        control.initialise(pid, process::start_time(pid).unwrap_or(0), config.strategy);
        control.set_settings(&config.settings);
        control.set_episode(FIRST);
        let ports = HostPorts::create(owned_instance.node(launcher.is_single_process())?)?;
        let mut supervisor = Supervisor::new(&instance, &control, launcher)?;
        // The stages build their towns while we build ours.
        let mut roles = BTreeMap::new();
        for (slot, role) in config.stages.iter().enumerate() {
            roles.insert(slot, *role);
            supervisor
                .start(*role, slot)
                .map_err(|e| HostError::Start { role: role.name(), why: e.to_string() })?;
        }
        let loaded = town_source.load().map_err(|e| HostError::Map(e.to_string()))?;
        let (mut world, town) = build_world(loaded, seed);
        let hide = Command::HideLayers(HideLayers { layers: config.hidden_layers, hidden: 1 });
        world.apply(&hide).map_err(HostError::Map)?;
        if let Some(town) = town {
            cache.keep_town(&open_drive, seed, &town);
        }
        let mut host = Host {
            control,
            barrier: Barrier::default(),
            world,
            settings: config.settings,
            ports,
            supervisor,
            inbox: Inbox::default(),
            pen: JournalWriter::default(),
            bundles: Bundles::default(),
            physics_sensors: PhysicsSensors::default(),
            standing: Standing::default(),
            drawings: Drawings::default(),
            decided: None,
            decided_hash: 0,
            recording: None,
            replay: None,
            recorded_decision: Frame(0),
            early: 0,
            is_ticking: false,
            deferred: Vec::new(),
            retold: Vec::new(),
            sim_time_nanos: 0,
            number: FIRST,
            cache,
            resyncs: BTreeMap::new(),
            roles,
            deaths: BTreeMap::new(),
            config,
            owned_instance,
        };
        let settings = Request::of_host(Command::SetSettings(host.settings));
        let first = [settings, Request::of_host(hide)];
        let first = first.map(|request| request.ended(Outcome::done(0)));
        host.standing.close(host.stamp(Frame(0)), first.to_vec());
        host.send_snapshot(SnapshotHeader { stamp: host.stamp(Frame(0)), ..Default::default() })?;
        host.await_stages()?;
        Ok(host)
    }

    /// Its instance.
    pub fn instance(&self) -> &Instance {
        self.owned_instance.instance()
    }

    /// Where the world is.
    pub fn frame(&self) -> Frame {
        self.barrier.frame()
    }

    fn await_stages(&mut self) -> Result<(), HostError> {
        let deadline = clock::now_nanos() + START_NANOS;
        loop {
            self.look_after_slots()?;
            let all = (1u64 << self.roles.len()) - 1;
            if self.control.alive() & all == all || self.is_stopped() {
                return Ok(());
            }
            if clock::now_nanos() > deadline {
                let missing =
                    self.roles.iter().find(|(slot, _)| self.control.alive() & 1 << **slot == 0);
                return Err(HostError::Start {
                    role: missing.map_or("a stage", |(_, role)| role.name()),
                    why: format!("it was not ready after {} s", START_NANOS / 1_000_000_000),
                });
            }
            self.control
                .host
                .listen(Strategy::BATCH, Some(clock::now_nanos() + 5_000_000), || None::<()>);
        }
    }

    /// Runs until told to stop. However it ends, nothing is left behind.
    pub fn run(mut self) -> Result<Frame, HostError> {
        let ended = self.serve();
        let frame = self.frame();
        self.supervisor.shut_down();
        ended.map(|()| frame)
    }

    fn is_stopped(&self) -> bool {
        self.config.stop.load(Ordering::Acquire) || self.control.is_ending()
    }

    fn serve(&mut self) -> Result<(), HostError> {
        let mut due_nanos = clock::now_nanos();
        while !self.is_stopped() {
            if self.settings.synchronous != 0 {
                self.await_request()?;
                if !self.is_requested() {
                    continue;
                }
                self.tick()?;
                self.serve_deferred()?;
            } else {
                due_nanos = self.pace(due_nanos)?;
                if self.settings.synchronous == 0 && !self.is_stopped() {
                    self.tick()?;
                    self.serve_deferred()?;
                }
                self.look_after_slots()?;
            }
        }
        Ok(())
    }

    fn is_requested(&self) -> bool {
        let ticker = self.control.ticker();
        ticker.is_some_and(|slot| self.control.slot(slot).request() > self.barrier.frame())
    }

    /// Synchronous: sleeps until the ticking client asks; serves who comes in the meantime.
    fn await_request(&mut self) -> Result<(), HostError> {
        let mut heard = self.control.host.count();
        loop {
            self.look_after_slots()?;
            // Commands that come with a request are the tick's own.
            if self.is_requested() {
                return Ok(());
            }
            self.serve_urgent()?;
            if self.settings.synchronous == 0 || self.is_stopped() {
                return Ok(());
            }
            let (bell, last) = (&self.control.host, heard);
            let deadline = Some(clock::now_nanos() + IDLE_NANOS);
            let rung = bell.listen(self.config.strategy, deadline, || {
                let count = bell.count();
                (count != last).then_some(count)
            });
            heard = rung.unwrap_or(heard);
            if self.is_requested() {
                return Ok(());
            }
        }
    }

    /// Asynchronous: sleeps until the next frame is due.
    fn pace(&mut self, due_nanos: u64) -> Result<u64, HostError> {
        let now = clock::now_nanos();
        let Some(step) =
            (self.settings.delta_nanos * 1000).checked_div(self.settings.real_time_permille.into())
        else {
            return Ok(now);
        };
        if due_nanos <= now {
            // Too slow for the asked pace: no debt is piled up.
            return Ok(if now - due_nanos > step { now + step } else { due_nanos + step });
        }
        let mut heard = self.control.host.count();
        while clock::now_nanos() < due_nanos && !self.is_stopped() {
            let (bell, last) = (&self.control.host, heard);
            let rung = bell.listen(Strategy::BATCH, Some(due_nanos.min(now + IDLE_NANOS)), || {
                let count = bell.count();
                (count != last).then_some(count)
            });
            heard = rung.unwrap_or(heard);
            self.look_after_slots()?;
            self.serve_urgent()?;
            if self.settings.synchronous != 0 {
                break;
            }
        }
        Ok(due_nanos + step)
    }

    pub(crate) fn stamp(&self, frame: Frame) -> Stamp {
        Stamp { frame, sim_time_nanos: self.sim_time_nanos, episode: self.number, reserved: 0 }
    }

    pub(crate) fn take_in_what_traffic_decided(&mut self) -> Result<(), HostError> {
        self.receive_decided()?;
        self.early = self.pen.len();
        self.sim_time_nanos += self.settings.delta_nanos;
        let Some(decided) = &self.decided else { return Ok(()) };
        let Some((controls, lights, _)) = decided.header().parts(decided.payload()) else {
            return Ok(());
        };
        self.decided_hash = decided.hash();
        self.world.follow_traffic(controls, lights);
        Ok(())
    }

    fn receive_decided(&mut self) -> Result<(), HostError> {
        while let Some(sample) = self.ports.traffic.receive()? {
            let last = self.decided.as_ref().map(|last| last.header().stamp.frame);
            if last.is_none_or(|last| sample.header().stamp.frame > last) {
                self.decided = Some(Decided::Received(sample));
            }
        }
        Ok(())
    }

    pub(crate) fn apply_commands(&mut self) -> Result<(), HostError> {
        self.inbox.drain(&self.ports)?;
        let requests = self.inbox.take();
        self.is_ticking = true;
        let carried_out = self.carry_out(&requests);
        self.is_ticking = false;
        carried_out
    }

    /// What came with a tick but must stand between two.
    fn serve_deferred(&mut self) -> Result<(), HostError> {
        let requests = std::mem::take(&mut self.deferred);
        if requests.is_empty() {
            return Ok(());
        }
        self.carry_out(&requests)?;
        let stamp = self.stamp(self.barrier.frame().next());
        self.pen.publish(&self.ports, stamp)?;
        self.control.complete.notify_all();
        Ok(())
    }

    /// Between two frames: what somebody waits for.
    fn serve_urgent(&mut self) -> Result<(), HostError> {
        if self.inbox.drain(&self.ports)? {
            let requests = self.inbox.take_urgent();
            self.carry_out(&requests)?;
            let stamp = self.stamp(self.barrier.frame().next());
            self.pen.publish(&self.ports, stamp)?;
            self.control.complete.notify_all();
        }
        Ok(())
    }

    fn carry_out(&mut self, requests: &[Request]) -> Result<(), HostError> {
        let mut index = 0;
        while index < requests.len() {
            let request = requests[index];
            index += 1;
            let Some(command) = request.command.decode() else {
                self.pen.write(request.ended(Outcome::refused("a command of no kind we know")));
                continue;
            };
            let is_between = |command: &Command| {
                matches!(
                    command,
                    Command::SaveState(_)
                        | Command::LoadState(_)
                        | Command::LoadMap(_)
                        | Command::StartReplay(_)
                )
            };
            if self.is_ticking && is_between(&command) {
                self.deferred.push(request);
                continue;
            }
            if let Command::LoadMap(command) = command {
                self.load_map(request, &command)?;
                continue;
            }
            if let Command::StartReplay(command) = command {
                let outcome = self.start_replay(&command)?;
                self.pen.write(request.ended(outcome));
                continue;
            }
            if let Command::CreateBundle(bundle) = command {
                let follow = requests[index..].iter().take(bundle.sensor_count as usize);
                let specs: Vec<_> = follow
                    .take_while(|r| r.client == request.client)
                    .map_while(|r| match r.command.decode() {
                        Some(Command::Sensor(spec)) => Some(spec),
                        _ => None,
                    })
                    .collect();
                let outcome = self.create_bundle(request.client, &bundle, &specs);
                self.pen.write(request.ended(outcome));
                for request in &requests[index..index + specs.len()] {
                    self.pen.write(request.ended(outcome));
                }
                index += specs.len();
                continue;
            }
            if let Command::Ask(ask) = command {
                let outcome = self.world.answer(&ask);
                self.pen.write(request.ended(outcome));
                continue;
            }
            if let Command::Draw(shape) = command {
                let drawn = self.drawings.draw(&shape, self.coming());
                self.pen.write(request.ended(drawn.unwrap_or_else(|why| Outcome::refused(&why))));
                continue;
            }
            let outcome = match self.grant(&command) {
                Ok(id) => Outcome::done(id),
                Err(why) => Outcome::refused(&why),
            };
            self.pen.write(request.ended(outcome));
            for entry in std::mem::take(&mut self.retold) {
                self.pen.write(entry);
            }
        }
        Ok(())
    }

    /// The first frame that shows what is requested now.
    fn coming(&self) -> Stamp {
        let now = self.stamp(self.barrier.frame());
        if self.is_ticking {
            return now;
        }
        let sim_time_nanos = now.sim_time_nanos + self.settings.delta_nanos;
        Stamp { frame: now.frame.next(), sim_time_nanos, ..now }
    }

    fn create_bundle(
        &mut self,
        client: Name,
        bundle: &protocol::CreateBundle,
        specs: &[protocol::SensorSpec],
    ) -> Outcome {
        if bundle.parent != protocol::ActorId::NONE && self.world.state(bundle.parent).is_none() {
            return Outcome::refused(&format!("{} is not there to carry a bundle", bundle.parent));
        }
        match self.bundles.create(client, bundle, specs, &mut self.ports) {
            Ok(id) => match self.mount(id, bundle, specs) {
                Ok(()) => Outcome::done(id.0),
                Err(why) => {
                    let _ = self.bundles.destroy(id, &mut self.ports);
                    Outcome::refused(&why)
                }
            },
            Err(why) => Outcome::refused(&why),
        }
    }

    /// A bundle whose sensors are born of physics is measured here.
    fn mount(
        &mut self,
        id: BundleId,
        bundle: &protocol::CreateBundle,
        specs: &[protocol::SensorSpec],
    ) -> Result<(), String> {
        if !are_physics_sensors(specs) {
            return Ok(());
        }
        if specs.iter().any(needs_roads) && !self.physics_sensors.has_roads() {
            let Episode { map, open_drive, .. } = &self.config.episode;
            let network = self.cache.network(map, open_drive).map_err(|e| e.to_string())?;
            self.physics_sensors.set_roads(network);
        }
        let (_, bytes) = protocol::layout(specs);
        let writer = self.ports.bundle(id, bytes).map_err(|e| e.to_string())?;
        self.physics_sensors.mount(id, bundle.parent, specs, writer);
        Ok(())
    }

    /// Physics, felt by whoever measures it.
    pub(crate) fn step(&mut self) {
        if self.physics_sensors.is_empty() {
            self.world.step(&self.settings);
        } else {
            let physics_sensors = &mut self.physics_sensors;
            self.world.step_seen(&self.settings, |physics, dt| physics_sensors.feel(physics, dt));
        }
    }

    fn grant(&mut self, command: &Command) -> Result<u32, String> {
        match command {
            Command::DestroyBundle(bundle) => {
                self.physics_sensors.unmount(*bundle);
                self.bundles.destroy(*bundle, &mut self.ports).map(|()| bundle.0)
            }
            Command::SetSettings(settings) => self.change_settings(settings).map(|()| 0),
            Command::SetWeather(weather) => {
                check_weather(weather)?;
                self.world.apply(command)
            }
            Command::TrafficParam(param) => {
                if param.value.abs() <= NUMBER_MAX {
                    Ok(param.actor_id.0)
                } else {
                    Err(format!(
                        "traffic param {} is {}, not a number within ±{NUMBER_MAX}",
                        param.param, param.value
                    ))
                }
            }
            Command::RouteCommand(guide) => {
                self.world.can_be_guided(guide).map(|()| guide.actor_id.0)
            }
            Command::Sensor(spec) => {
                Err(format!("sensor {:?} follows no bundle that announced it", spec.name))
            }
            Command::Transmit(command) => self.physics_sensors.transmit(command),
            Command::EraseShapes(erase) => {
                self.drawings.erase(erase);
                Ok(0)
            }
            Command::StartRecorder(command) => self.start_recorder(command),
            Command::StopRecorder(_) => self.stop_recorder(),
            Command::SaveState(file) => self.save_state(file),
            Command::LoadState(file) => self.load_state(file),
            Command::StopReplay(command) => self.stop_replay(command.keep_actors != 0),
            Command::Destroy(actor) => {
                let id = self.world.apply(command)?;
                self.take_down(self.bundles.on(*actor));
                Ok(id)
            }
            _ => self.world.apply(command),
        }
    }

    /// Bundles that nobody carries or nobody reads any more.
    fn take_down(&mut self, bundles: Vec<BundleId>) {
        for bundle in bundles {
            self.physics_sensors.unmount(bundle);
            let _ = self.bundles.destroy(bundle, &mut self.ports);
            let line = Request::of_host(Command::DestroyBundle(bundle));
            self.pen.write(line.ended(Outcome::done(bundle.0)));
        }
    }

    fn change_settings(&mut self, settings: &Settings) -> Result<(), String> {
        let (delta, substep) = (settings.delta_nanos, settings.substep_max_nanos);
        if !(100_000..=10_000_000_000).contains(&delta) {
            return Err(format!(
                "delta_nanos is {delta}, not 100000 to 10000000000 (0.1 ms to 10 s)"
            ));
        }
        if !(100_000..=100_000_000).contains(&substep) {
            return Err(format!("substep_max_nanos is {substep}, not 100000 to 100000000"));
        }
        if settings.pipeline > protocol::PIPELINE_MAX {
            return Err(format!(
                "pipeline is {}, PIPELINE_MAX is {}",
                settings.pipeline,
                protocol::PIPELINE_MAX
            ));
        }
        self.settings = *settings;
        self.set_lags(|host, role| host.lag(role));
        self.control.set_settings(settings);
        Ok(())
    }

    fn lag(&self, role: Role) -> u64 {
        match (role, self.settings.synchronous != 0) {
            (Role::Render, true) => self.settings.pipeline.into(),
            (_, true) => 0,
            // Nobody is waited for.
            (_, false) => u64::MAX / 2,
        }
    }

    /// Journal first, snapshot and what sensors felt second, the tick word last: who sees the word
    /// finds all of it.
    pub(crate) fn publish(&mut self, header: SnapshotHeader) -> Result<(), HostError> {
        let stamp = header.stamp;
        self.pen.publish(&self.ports, stamp)?;
        let journal_entries = self.pen.len() as u32;
        let header = self.send_snapshot(SnapshotHeader { journal_entries, ..header })?;
        self.physics_sensors.send(&self.world, &header)?;
        let entries = self.pen.take_frame();
        let kept = if self.recording.is_some() { entries.clone() } else { Vec::new() };
        self.standing.close(stamp, entries);
        self.drawings.forget(stamp);
        self.record(&header, &kept);
        self.control.set_awaited(stamp.frame, self.barrier.mask());
        self.control.tick.raise(stamp.frame.0);
        Ok(())
    }

    fn send_snapshot(&mut self, mut header: SnapshotHeader) -> Result<SnapshotHeader, HostError> {
        let states = self.world.states();
        let limbs = self.world.limbs();
        let mut loan = self.ports.snapshot.loan(states.len(), limbs.len())?;
        let (actors_out, limbs_out) = loan.parts_mut();
        actors_out.copy_from_slice(states);
        limbs_out.copy_from_slice(limbs);
        header.state_hash = self.world.state_hash(&header.stamp, &self.settings, self.decided_hash);
        header.collisions = self.world.collisions() as u32;
        header.published_nanos = clock::now_nanos();
        loan.send(header)?;
        Ok(header)
    }

    pub(crate) fn await_arrivals(&mut self, frame: Frame) -> Result<Verdict, HostError> {
        // Asynchronous: nobody is waited for.
        self.await_all(frame, self.config.deadline_nanos, 0)
    }

    /// Waits until everybody has arrived at `frame`, or in an asynchronous world those of `mask`.
    fn await_all(
        &mut self,
        frame: Frame,
        patience_nanos: Option<u64>,
        mask: u64,
    ) -> Result<Verdict, HostError> {
        let is_synchronous = self.settings.synchronous != 0;
        let deadline = patience_nanos.map(|d| clock::now_nanos() + d);
        let mut heard = self.control.host.count();
        loop {
            let members: Vec<_> = self.barrier.slots().collect();
            for slot in members {
                self.barrier.arrive(slot, self.control.slot(slot).ack());
            }
            let now = clock::now_nanos();
            let is_enough = !is_synchronous && self.barrier.missing() & mask == 0;
            let is_late = is_enough || deadline.is_some_and(|d| now >= d);
            let verdict = self.barrier.verdict(is_late);
            if verdict != Verdict::Open || self.is_stopped() {
                if let Verdict::Late(mask) = verdict
                    && is_synchronous
                {
                    log::warn!(
                        "{} {} has not arrived after {:.1} s; is it alive? --deadline-secs 0 waits for ever",
                        frame.0,
                        self.barrier.names(mask),
                        patience_nanos.unwrap_or(0) as f64 / 1e9
                    );
                }
                return Ok(if is_synchronous { verdict } else { Verdict::Complete });
            }
            let (control, last) = (&self.control, heard);
            let look_again = Some(deadline.unwrap_or(u64::MAX).min(now + IDLE_NANOS));
            let rung = control.host.listen(self.config.strategy, look_again, || {
                let count = control.host.count();
                (count != last || control.missing(frame) == 0).then_some(count)
            });
            heard = rung.unwrap_or(heard);
            if control.missing(frame) != 0
                || (self.control.alive().count_ones() as usize) < self.barrier.slots().len()
            {
                self.look_after_slots()?;
            }
        }
    }
}

pub(crate) fn ending(verdict: &Verdict) -> Ending {
    match *verdict {
        Verdict::Late(mask) => Ending::Late(mask),
        Verdict::Degraded(mask) => Ending::Degraded(mask),
        Verdict::Open | Verdict::Complete => Ending::Complete,
    }
}

fn check_weather(weather: &protocol::Weather) -> Result<(), String> {
    let values: &[f32] = bytemuck::cast_slice(std::slice::from_ref(weather));
    match values.iter().find(|v| !v.is_finite() || v.abs() > NUMBER_MAX) {
        Some(value) => {
            Err(format!("the weather holds {value}, which is not a number within ±{NUMBER_MAX}"))
        }
        None => Ok(()),
    }
}

fn blueprints() -> Vec<protocol::BlueprintInfo> {
    let info = |b: &town::Blueprint| protocol::BlueprintInfo {
        id: b.id.to_owned(),
        tag: b.tag as u8,
        half_extents_m: b.half_extents_m.to_array(),
        center_m: b.center_m.to_array(),
    };
    town::catalogue().iter().map(info).collect()
}
