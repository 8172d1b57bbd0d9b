//! A client's part in an instance.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use bake::Cache;
use bus::{
    ClientPorts, Ending, Event, Instance, Interrupted, Participant, Role, Strategy, Watch, clock,
    fault,
};
use glam::Vec3;
use protocol::{
    ActorId, Autopilot, BatchHeader, BlueprintInfo, BundleId, Command, CreateBundle, FilePath,
    Frame, JournalEntry, LoadMap, Name, Nothing, Pose, RawCommand, RouteCommand, RouteStep,
    SensorSpec, Settings, Stamp, StartRecorder, StartReplay, StopReplay, TEXT_BYTES, Teleport,
    Transmit, VehicleControl, Weather, flag, load,
};
use road::Network;

use crate::{
    ClientError, Measurement, Profile, Replay, SensorBundle, World,
    file::{absolute, file_error, read, saved_path, told},
};

/// How long a client waits for what the host should do at once.
const PATIENCE_SECS: u64 = 30;
/// How long it waits for another world: a city may have to be furnished.
const WORLD_SECS: u64 = 180;

/// A connection to a running host.
pub struct Client {
    ports: ClientPorts,
    participant: Participant,
    name: Name,
    sequence: u64,
    world: Option<World>,
    blueprints: Vec<BlueprintInfo>,
    /// The map, and the number of its world.
    network: Option<(u32, Arc<Network>)>,
    frame: Frame,
    first: Frame,
}

/// What to spawn, where.
#[derive(Clone, Copy, Debug)]
pub struct Spawn(protocol::Spawn);

impl Spawn {
    /// A blueprint at a pose; a vehicle is set onto the road below it.
    pub fn new(blueprint: &str, pose: Pose) -> Spawn {
        Spawn(protocol::Spawn {
            blueprint: Name::new(blueprint),
            pose,
            ..protocol::Spawn::default()
        })
    }

    /// Driven by traffic.
    pub fn autopilot(mut self) -> Spawn {
        self.0.flags |= flag::AUTOPILOT;
        self
    }

    /// Moved by teleports only.
    pub fn kinematic(mut self) -> Spawn {
        self.0.flags |= flag::KINEMATIC;
        self
    }

    /// A walker that falls when it is hit.
    pub fn ragdoll_on_hit(mut self) -> Spawn {
        self.0.flags |= flag::RAGDOLL_ON_HIT;
        self
    }

    /// Painted: red, green, blue.
    pub fn color(mut self, [r, g, b]: [u8; 3]) -> Spawn {
        self.0.color = u32::from_le_bytes([r, g, b, 255]);
        self
    }

    /// For a batch: see [`Client::try_request`].
    pub fn decode(self) -> Command {
        Command::Spawn(self.0)
    }

    /// What the user calls it.
    pub fn role(mut self, role: &str) -> Spawn {
        self.0.role = Name::new(role);
        self
    }
}

impl Client {
    /// Connects to the instance of this name, or to the only one that runs. `name` is the client's
    /// own: commands of one frame apply in the order of names.
    pub fn connect(instance: Option<&str>, name: &str) -> Result<Client, ClientError> {
        Client::join(&Instance::find(instance)?, name, false)
    }

    /// Connects to a host in this very process.
    pub fn connect_in_process(instance: &Instance, name: &str) -> Result<Client, ClientError> {
        Client::join(instance, name, true)
    }

    fn join(instance: &Instance, name: &str, within: bool) -> Result<Client, ClientError> {
        let name = unique(instance, name)?;
        let participant = Participant::join(instance, Role::Client, name, None, within)?;
        fault::joining(Role::Client);
        let ports = ClientPorts::open(participant.node()?)?;
        participant.ready()?;
        let first = participant.words().ack();
        let mut client = Client {
            ports,
            name,
            sequence: 0,
            world: None,
            blueprints: instance.blueprints()?,
            network: None,
            frame: first,
            first,
            participant,
        };
        client.refresh()?;
        Ok(client)
    }

    /// The instance it is connected to.
    pub fn instance(&self) -> &Instance {
        self.participant.instance()
    }

    /// What can be spawned; a place in this list is [`protocol::ActorState::blueprint`].
    pub fn blueprints(&self) -> &[BlueprintInfo] {
        &self.blueprints
    }

    /// The road network of the running map. It is read once for each map that is loaded, out of
    /// the cache of baked maps where possible.
    ///
    /// # Errors
    ///
    /// The map's text is not in the instance, or cannot be parsed.
    pub fn map(&mut self) -> Result<&Network, ClientError> {
        self.load_network().map(|network| &**network)
    }

    /// The same network as [`Client::map`], shared: it outlives the map and the client.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn shared_map(&mut self) -> Result<Arc<Network>, ClientError> {
        self.load_network().cloned()
    }

    fn load_network(&mut self) -> Result<&Arc<Network>, ClientError> {
        let standing = self.participant.control().episode();
        if self.network.as_ref().is_none_or(|(number, _)| *number != standing) {
            let (number, episode) = self.instance().numbered_episode()?;
            let network = Cache::from_environment()
                .network(&episode.map, &episode.open_drive)
                .map_err(|e| ClientError::Map(e.to_string()))?;
            self.network = Some((number, Arc::new(network)));
        }
        Ok(self.network.as_ref().map(|(_, network)| network).expect("set above"))
    }

    /// The names of the maps that can be loaded.
    pub fn available_maps(&self) -> Result<Vec<String>, ClientError> {
        Ok(self.instance().maps()?)
    }

    /// Destroys the world and loads a map in its place: a name (see `omnibus maps`), or a path.
    /// Everybody in it and every bundle is gone; frames count on, simulated time begins anew, time
    /// passes as before. When this returns, `world()` shows the new world as it was loaded, which
    /// is that of a simulator started with this map and seed, bit for bit. A map that cannot be
    /// loaded is refused, and the old world goes on.
    pub fn load_map(&mut self, name: &str) -> Result<Frame, ClientError> {
        self.load_world(name, None, 0)
    }

    /// The same map anew.
    pub fn reload_map(&mut self) -> Result<Frame, ClientError> {
        self.load_world("", None, 0)
    }

    /// As [`Client::load_map`], an empty name for the map that runs; with another seed, or without
    /// layers of the town (bits of [`protocol::layer`]).
    pub fn load_world(
        &mut self,
        name: &str,
        seed: Option<u64>,
        hidden_layers: u32,
    ) -> Result<Frame, ClientError> {
        let is_path = name.ends_with(".xodr") || Path::new(name).is_absolute();
        let map = match name {
            "" => FilePath::default(),
            _ if is_path && Path::new(name).exists() => told(&absolute(Path::new(name))?)?,
            _ => told(Path::new(name))?,
        };
        let flags = if seed.is_some() { load::SEED } else { 0 };
        let command = LoadMap { map, seed: seed.unwrap_or_default(), hidden_layers, flags };
        let outcomes = self.try_within("load_map", &[Command::LoadMap(command)], WORLD_SECS)?;
        let refused = |why: &str| ClientError::Refused { what: "load_map", why: why.to_owned() };
        let number = outcomes[0].outcome.result().map_err(refused)?;
        self.await_world(number)
    }

    /// The line comes with the frame; the frame is over when every stage stands.
    fn await_world(&mut self, number: u32) -> Result<Frame, ClientError> {
        let frame = Frame(self.participant.control().tick.get());
        self.participant.await_complete(frame, None).map_err(|_| self.host_ended())?;
        while self.world().header().stamp.episode < number {
            self.await_frame()?;
        }
        Ok(self.frame)
    }

    /// The number of the world that stands: those before it are gone, with all that was in them.
    pub fn episode(&self) -> u32 {
        self.participant.control().episode()
    }

    /// Places for vehicles, half a metre above the road.
    pub fn spawn_points(&mut self) -> Result<Vec<Pose>, ClientError> {
        Ok(spawn_poses(self.map()?))
    }

    /// How time passes; the answer stands when this returns.
    pub fn apply_settings(&mut self, settings: Settings) -> Result<(), ClientError> {
        self.request("settings", &[Command::SetSettings(settings)]).map(drop)
    }

    /// How time passes now, whoever said so.
    pub fn settings(&self) -> Settings {
        self.participant.control().settings()
    }

    /// Takes the tick and makes the world wait for it: each tick is `delta_nanos` long.
    pub fn synchronise(&mut self, delta_nanos: u64) -> Result<(), ClientError> {
        self.take_tick()?;
        self.apply_settings(Settings { synchronous: 1, delta_nanos, ..self.settings() })
    }

    /// Becomes the one who ticks. Refused by name while another is.
    pub fn take_tick(&mut self) -> Result<(), ClientError> {
        let control = self.participant.control();
        let me = self.participant.slot();
        if control.ticker() == Some(me) || control.pass_tick(None, Some(me)) {
            return Ok(());
        }
        let holder = control.ticker().map(|slot| control.slot(slot).name().to_string());
        Err(ClientError::TickTaken { holder: holder.unwrap_or_default() })
    }

    /// Whether this client is the one who ticks.
    pub fn holds_tick(&self) -> bool {
        self.participant.control().ticker() == Some(self.participant.slot())
    }

    /// Gives the tick back, if this client holds it: whoever wants it next may take it.
    pub fn leave_tick(&mut self) {
        let me = self.participant.slot();
        self.participant.control().pass_tick(Some(me), None);
    }

    /// Lets the client of this name tick from now on.
    pub fn hand_tick_to(&mut self, name: &str) -> Result<(), ClientError> {
        let control = self.participant.control();
        let me = self.participant.slot();
        let is_live = |slot: &bus::Slot| {
            slot.state() == bus::SlotState::Live && slot.role() == Some(Role::Client)
        };
        let to = (0..bus::SLOTS)
            .find(|&i| is_live(control.slot(i)) && control.slot(i).name() == Name::new(name))
            .ok_or_else(|| ClientError::Refused {
                what: "hand the tick over",
                why: format!("no client is named {name:?}"),
            })?;
        if control.pass_tick(Some(me), Some(to)) {
            return Ok(());
        }
        let holder = control.ticker().map(|slot| control.slot(slot).name().to_string());
        Err(ClientError::TickTaken { holder: holder.unwrap_or_else(|| "nobody".to_owned()) })
    }

    /// From now on every tick that another client makes waits until this one has arrived: agents
    /// in lockstep. Take the frame ([`Client::await_frame`]), send controls, and
    /// [`Client::arrive`]. Who holds the tick itself is not waited for.
    pub fn join_barrier(&mut self) -> Result<(), ClientError> {
        self.request_barrier(true, "a part in the barrier")
    }

    /// From now on no tick waits for this client.
    pub fn leave_part(&mut self) -> Result<(), ClientError> {
        self.request_barrier(false, "leave from the barrier")
    }

    fn request_barrier(&mut self, wanted: bool, what: &str) -> Result<(), ClientError> {
        if wanted && self.participant.control().ticker() == Some(self.participant.slot()) {
            return Err(ClientError::Refused {
                what: "take part",
                why: "this client makes the ticks; they do not wait for it".to_owned(),
            });
        }
        let words = self.participant.words();
        words.request_barrier(wanted);
        self.participant.control().host.ring();
        let deadline = clock::now_nanos() + PATIENCE_SECS * 1_000_000_000;
        let granted = self
            .participant
            .await_answer(deadline, || (words.in_barrier() == wanted).then_some(()));
        granted.map_err(|why| self.waited_in_vain(why, what))
    }

    /// This client is done with the frame that `world()` shows.
    pub fn arrive(&mut self) {
        self.participant.arrive(self.frame);
    }

    /// Advances the world by one tick. When it returns, every participant has done its work: in
    /// strict mode all measurements of the frame lie in their bundles.
    pub fn tick(&mut self) -> Result<Frame, ClientError> {
        self.take_tick()?;
        if !self.participant.control().is_synchronous() {
            return Err(ClientError::Asynchronous);
        }
        let control = self.participant.control();
        // A frame of the asynchronous world may still be under way.
        let frame = Frame(control.complete.get().max(control.tick.get())).next();
        fault::point(Role::Client, "requesting", frame, self.first);
        control.request(self.participant.slot(), frame);
        fault::point(Role::Client, "requested", frame, self.first);
        let ending = self.participant.await_complete(frame, None).map_err(|_| self.host_ended())?;
        self.refresh()?;
        fault::point(Role::Client, "loan_held", frame, self.first);
        let (how, mask) = match ending {
            Ending::Complete => return Ok(frame),
            Ending::Late(mask) => ("late", mask),
            Ending::Degraded(mask) => ("degraded", mask),
        };
        let who = self.participant.control().names(mask);
        Err(ClientError::Incomplete { frame, how, who })
    }

    /// Ticks, and hands over what each bundle measured at that very frame: one receive a bundle. A bundle
    /// whose sensors all rest at this frame gives none.
    pub fn tick_and_collect(
        &mut self,
        bundles: &mut [&mut SensorBundle],
    ) -> Result<(Frame, Vec<Option<Measurement>>), ClientError> {
        let frame = self.tick()?;
        let mut measurements = Vec::with_capacity(bundles.len());
        for bundle in bundles {
            bundle.check(self.episode())?;
            let mut found = None;
            while bundle.last() < frame {
                let Some(next) = bundle.receive()? else { break };
                found = (next.frame() == frame).then_some(next);
            }
            measurements.push(found);
        }
        Ok((frame, measurements))
    }

    /// Waits for `bundle`'s next measurement: for pipelined and asynchronous worlds.
    pub fn await_measurement(
        &mut self,
        bundle: &mut SensorBundle,
    ) -> Result<Measurement, ClientError> {
        let deadline = clock::now_nanos() + PATIENCE_SECS * 1_000_000_000;
        let id = bundle.id().0;
        let control = self.participant.control();
        let found = self.participant.await_answer(deadline, || match bundle.receive() {
            Ok(None) => bundle.check(control.episode()).err().map(Err),
            Ok(Some(measurement)) => Some(Ok(measurement)),
            Err(e) => Some(Err(e)),
        });
        found.map_err(|why| self.waited_in_vain(why, &format!("a measurement of bundle {id}")))?
    }

    /// Waits until the world has advanced past what `world()` shows, and takes the newest
    /// snapshot. For clients that do not tick.
    pub fn await_frame(&mut self) -> Result<Frame, ClientError> {
        self.participant.next_frame(self.frame, None).map_err(|_| self.host_ended())?;
        self.refresh()?;
        Ok(self.frame)
    }

    /// How everybody on this bus waits, as the host was told.
    pub fn strategy(&self) -> Strategy {
        self.participant.control().strategy()
    }

    /// For another thread of this process: sees frames come while this client does other things.
    pub fn watch(&self) -> Watch {
        self.participant.watch()
    }

    /// Takes the newest snapshot, if a newer one is there. Never blocks.
    pub fn refresh(&mut self) -> Result<bool, ClientError> {
        let mut is_newer = false;
        while let Some(snapshot) = self.ports.snapshot.receive()? {
            if snapshot.header().stamp.frame >= self.frame {
                self.frame = snapshot.header().stamp.frame;
                self.world = Some(World::new(snapshot));
                is_newer = true;
            }
        }
        Ok(is_newer)
    }

    /// The world at the newest frame this client took in.
    pub fn world(&self) -> &World {
        self.world.as_ref().expect("a snapshot comes with the connection")
    }

    /// The newest frame this client took in.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Puts an actor into the world. It is there when this returns; the next frame shows it.
    pub fn spawn(&mut self, spawn: Spawn) -> Result<ActorId, ClientError> {
        Ok(ActorId(self.request("spawn", &[Command::Spawn(spawn.0)])?[0]))
    }

    /// Takes an actor out of the world.
    pub fn destroy(&mut self, actor: ActorId) -> Result<(), ClientError> {
        self.request("destroy", &[Command::Destroy(actor)]).map(drop)
    }

    /// Puts an actor elsewhere, at rest.
    pub fn teleport(&mut self, actor_id: ActorId, pose: Pose) -> Result<(), ClientError> {
        self.request("teleport", &[Command::Teleport(Teleport { actor_id, pose })]).map(drop)
    }

    /// Hands an actor to traffic, or takes it back.
    pub fn set_autopilot(&mut self, actor_id: ActorId, on: bool) -> Result<(), ClientError> {
        let command = Command::Autopilot(Autopilot { actor_id, on: on.into() });
        self.request("autopilot", &[command]).map(drop)
    }

    /// Tells a vehicle on autopilot where to go: places that it comes by over the shortest way,
    /// turns that it takes at the junctions that come next. It changes lanes for that where it is
    /// safe, and goes round the block if it could not. When the last step is done, and with none,
    /// it goes where it likes.
    pub fn guide(&mut self, actor_id: ActorId, steps: &[RouteStep]) -> Result<(), ClientError> {
        let commands: Vec<Command> =
            RouteCommand::way(actor_id, steps).into_iter().map(Command::RouteCommand).collect();
        self.request("guide", &commands).map(drop)
    }

    /// Sun, clouds, rain, fog.
    pub fn set_weather(&mut self, weather: Weather) -> Result<(), ClientError> {
        self.request("weather", &[Command::SetWeather(weather)]).map(drop)
    }

    /// Writes down what happens from the next frame on; says where. `name` follows CARLA's rule:
    /// with a `/`, `\\` or `:` it is a path, else a file in the folder for recordings
    /// ([`saved_folder`]).
    pub fn start_recorder(&mut self, name: &str, profile: Profile) -> Result<PathBuf, ClientError> {
        let path = saved_path(name)?;
        let command = StartRecorder { path: told(&path)?, profile: profile as u32, reserved: 0 };
        self.request("start_recorder", &[Command::StartRecorder(command)])?;
        Ok(path)
    }

    /// Closes the recording, if one goes on; says how many frames it has.
    pub fn stop_recorder(&mut self) -> Result<u64, ClientError> {
        let command = Command::StopRecorder(Nothing::default());
        Ok(self.request("stop_recorder", &[command])?[0].into())
    }

    /// Shows a recording beside those who are there; names as for [`Client::start_recorder`]. The
    /// first of its frames shows with the next tick. If it was recorded in another world, that world
    /// is loaded first, as by [`Client::load_world`].
    pub fn start_replay(&mut self, name: &str, replay: Replay) -> Result<(), ClientError> {
        let nanos = |seconds: f64| (seconds * 1e9) as i64;
        let command = StartReplay {
            path: told(&saved_path(name)?)?,
            from_nanos: nanos(replay.from_s),
            duration_nanos: nanos(replay.duration_s).max(0) as u64,
            time_factor: replay.time_factor,
            ignore_hero: replay.ignore_hero.into(),
        };
        let number = self.episode();
        let outcomes =
            self.try_within("start_replay", &[Command::StartReplay(command)], WORLD_SECS)?;
        let refused =
            |why: &str| ClientError::Refused { what: "start_replay", why: why.to_owned() };
        outcomes[0].outcome.result().map_err(refused)?;
        if self.episode() != number {
            self.await_world(self.episode())?;
        }
        Ok(())
    }

    /// Ends the replay. Who was shown stays, vehicles on autopilot, or goes.
    pub fn stop_replay(&mut self, keep_actors: bool) -> Result<(), ClientError> {
        let command = StopReplay { keep_actors: keep_actors.into(), reserved: 0 };
        self.request("stop_replay", &[Command::StopReplay(command)]).map(drop)
    }

    /// Everything that decides the future, between two frames: actors, traffic, what was requested
    /// and not carried out yet. Good for the map, the seed and the build it was made with.
    pub fn save_state(&mut self) -> Result<Vec<u8>, ClientError> {
        let path = self.scratch("state");
        let saved = self.save_state_to(&path).and_then(|()| read(&path));
        let _ = fs::remove_file(&path);
        saved
    }

    /// The same, into a file.
    pub fn save_state_to(&mut self, path: &Path) -> Result<(), ClientError> {
        let file = told(&absolute(path)?)?;
        self.request("save_state", &[Command::SaveState(file)]).map(drop)
    }

    /// Goes on from a saved state: from the next frame on everything happens as it did, or would
    /// have, after it was saved. Frames count on; simulated time and ids are those of the state.
    pub fn load_state(&mut self, state: &[u8]) -> Result<(), ClientError> {
        let path = self.scratch("state");
        fs::write(&path, state).map_err(|e| file_error(&path, &e))?;
        let loaded = self.load_state_from(&path);
        let _ = fs::remove_file(&path);
        loaded
    }

    /// The same, from a file.
    pub fn load_state_from(&mut self, path: &Path) -> Result<(), ClientError> {
        let file = told(&absolute(path)?)?;
        self.request("load_state", &[Command::LoadState(file)]).map(drop)
    }

    /// A file in the instance's own folder, which goes with it.
    fn scratch(&self, what: &str) -> PathBuf {
        self.instance().root().join(format!("{what}-{}", self.participant.slot()))
    }

    /// Mounts sensors on an actor, or into the world (`ActorId::NONE`), as one bundle: measured
    /// together, handed over together. `max_borrowed` measurements may be held at a time.
    pub fn create_bundle(
        &mut self,
        name: &str,
        parent: ActorId,
        sensors: &[SensorSpec],
        max_borrowed: u32,
    ) -> Result<SensorBundle, ClientError> {
        let bundle = CreateBundle {
            parent,
            sensor_count: sensors.len() as u32,
            max_borrowed,
            reserved: 0,
            name: Name::new(name),
        };
        let mut commands = vec![Command::CreateBundle(bundle)];
        commands.extend(sensors.iter().map(|s| Command::Sensor(*s)));
        let id = BundleId(self.request("bundle", &commands)?[0]);
        Ok(SensorBundle::new(id, self.episode(), sensors.to_vec(), self.ports.bundle(id)?))
    }

    /// Sends a text by radio with the next frame, from a [`crate::message`] sensor of a bundle; at
    /// most [`protocol::TEXT_BYTES`] bytes.
    pub fn transmit(
        &mut self,
        bundle: &SensorBundle,
        sensor: usize,
        text: &str,
    ) -> Result<(), ClientError> {
        let command = transmission(bundle.id(), sensor, text)?;
        self.request("transmit", &[command]).map(drop)
    }

    /// Takes a bundle away.
    pub fn destroy_bundle(&mut self, bundle: SensorBundle) -> Result<(), ClientError> {
        self.request("bundle", &[Command::DestroyBundle(bundle.id())]).map(drop)
    }

    /// Pedals and wheels, from the next frame on; the latest hold. Does not wait.
    pub fn control(&mut self, controls: &[VehicleControl]) -> Result<(), ClientError> {
        let header = self.batch(controls.len(), false);
        Ok(self.ports.control.send(header, controls)?)
    }

    /// Commands that act with the next tick; what became of them is not waited for.
    pub fn send(&mut self, commands: &[Command]) -> Result<(), ClientError> {
        let header = self.batch(commands.len(), false);
        let commands: Vec<RawCommand> = commands.iter().map(|w| (*w).into()).collect();
        Ok(self.ports.command.send(header, &commands)?)
    }

    /// Commands that are carried out at once if the world stands still, else with its next frame.
    /// Answers the ids; the first refusal is an error, though the others were carried out.
    pub fn request(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<u32>, ClientError> {
        let outcomes = self.try_request(what, commands)?;
        let ids = outcomes.iter().map(|entry| {
            let why = |text: &str| ClientError::Refused { what, why: text.to_owned() };
            entry.outcome.result().map_err(why)
        });
        ids.collect()
    }

    /// Like [`Client::request`], with each command's own outcome.
    pub fn try_request(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<JournalEntry>, ClientError> {
        self.try_within(what, commands, PATIENCE_SECS)
    }

    fn try_within(
        &mut self,
        what: &'static str,
        commands: &[Command],
        secs: u64,
    ) -> Result<Vec<JournalEntry>, ClientError> {
        self.ports.journal.begin_here()?;
        let header = self.batch(commands.len(), true);
        let commands: Vec<RawCommand> = commands.iter().map(|w| (*w).into()).collect();
        self.ports.command.send(header, &commands)?;
        self.participant.control().host.ring();
        let (first, last) = (header.sequence, header.sequence + commands.len() as u64);
        let mut outcomes = Vec::with_capacity(commands.len());
        let (name, journal) = (self.name, &mut self.ports.journal);
        let deadline = clock::now_nanos() + secs * 1_000_000_000;
        let answered = self.participant.await_answer(deadline, || {
            match journal.poll() {
                Ok(false) => {}
                Ok(true) => return Some(Err(ClientError::JournalOverrun)),
                Err(e) => return Some(Err(e.into())),
            }
            for event in journal.until(Frame(u64::MAX)) {
                if let Event::Entry(_, entry) = event
                    && entry.client == name
                    && (first..last).contains(&entry.sequence)
                {
                    outcomes.push(entry);
                }
            }
            (outcomes.len() == commands.len()).then_some(Ok(()))
        });
        answered.map_err(|why| self.waited_in_vain(why, what))??;
        Ok(outcomes)
    }

    fn batch(&mut self, len: usize, now: bool) -> BatchHeader {
        let sequence = self.sequence;
        self.sequence += len as u64;
        BatchHeader {
            stamp: Stamp { frame: self.frame, ..Stamp::default() },
            client: self.name,
            sequence,
            now: now.into(),
            slot: self.participant.slot() as u32,
        }
    }

    fn host_ended(&self) -> ClientError {
        ClientError::HostEnded { last: self.frame }
    }

    fn waited_in_vain(&self, why: Interrupted, what: &str) -> ClientError {
        match why {
            Interrupted::HostEnds => self.host_ended(),
            Interrupted::Deadline => {
                ClientError::Timeout { what: what.to_owned(), secs: PATIENCE_SECS }
            }
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        fault::point(Role::Client, "leaving", self.frame, self.first);
        let me = self.participant.slot();
        self.participant.control().pass_tick(Some(me), None);
    }
}

fn transmission(bundle: BundleId, sensor: usize, text: &str) -> Result<Command, ClientError> {
    let mut bytes = [0; TEXT_BYTES];
    let room = bytes.get_mut(..text.len()).ok_or_else(|| ClientError::Refused {
        what: "transmit",
        why: format!("the text has {} bytes; {TEXT_BYTES} is the limit", text.len()),
    })?;
    room.copy_from_slice(text.as_bytes());
    Ok(Command::Transmit(Transmit { bundle, sensor: sensor as u32, text: bytes }))
}

/// Places for vehicles on a map, half a metre above the road.
pub fn spawn_poses(network: &Network) -> Vec<Pose> {
    let pose = |at| {
        let place = network.place(at);
        let position = place.position.as_vec3() + Vec3::Z * 0.5;
        Pose::new(position, place.rotation().as_quat())
    };
    network.spawn_points().into_iter().map(pose).collect()
}

/// Outcomes are found by the client's name: a second client of the same name gets a number.
fn unique(instance: &Instance, wanted: &str) -> Result<Name, ClientError> {
    let control = instance.control()?;
    let is_taken = |name: Name| {
        let mut slots = control.slots().iter();
        slots.any(|s| s.state() != bus::SlotState::Free && s.name() == name)
    };
    let mut name = Name::new(wanted);
    let mut number = 2;
    while is_taken(name) {
        name = Name::new(&format!("{:.24}-{number}", wanted));
        number += 1;
    }
    Ok(name)
}
