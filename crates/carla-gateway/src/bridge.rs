//! The one client of the bus through which all of CARLA's clients act.
//!
//! ```text
//!  calls ──▶ Bridge ──commands, controls, ticks──▶ bus
//!  streams ◀── Bridge ◀──snapshots, measurements── bus
//! ```

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use client_lib::{
    ActorId, ActorState, Client, ClientError, Command, JournalEntry, Measurement, Pose, TEXT_BYTES,
    Transmit, VehicleControl, WalkerLimbs, Weather, kind,
};

use crate::{
    args::Refusal,
    born,
    cast::{Cast, SPECTATOR},
    lights::Lights,
    measure,
    motion::Motions,
    radio::is_radio,
    replay::Replayer,
    roadside::Roadsides,
    rpc::Peer,
    sensor::Kind,
    settings::EpisodeSettings,
    state::{Moment, StateMessage},
    statics::Statics,
    stream::{Streams, WORLD},
    street::Street,
    textures,
    weather::CarlaWeather,
};

/// How long a tick waits for those who were told the way to a stream.
const SUBSCRIBERS: Duration = Duration::from_millis(300);
/// Frames after which a sensor that nobody listens to costs nothing more.
const IDLE_FRAMES: u32 = 20;
/// Batches that may be sent in one frame of an asynchronous world.
const SENDS_MAX: u32 = 6;

/// The world, with all that CARLA's clients believe of it.
pub(crate) struct Bridge {
    pub(crate) client: Client,
    pub(crate) streams: Arc<Streams>,
    pub(crate) cast: Cast,
    pub(crate) settings: EpisodeSettings,
    pub(crate) weather: CarlaWeather,
    pub(crate) statics: Arc<Statics>,
    pub(crate) motions: Motions,
    pub(crate) lights: Lights,
    /// Lamps that clients have just switched, and how many frames ago.
    pub(crate) lamps: BTreeMap<u32, (u32, u32)>,
    /// The doors that clients opened, one bit each.
    pub(crate) doors: BTreeMap<u32, u32>,
    roadsides: Roadsides,
    pub(crate) replayer: Replayer,
    /// The number of the world that clients see.
    pub(crate) episode: u64,
    is_new_map: bool,
    pub(crate) has_new_lights: bool,
    /// What street lamps were told.
    pub(crate) street: Street,
    /// Commands that nobody waits for; they go before the next that somebody does wait for.
    commands: Vec<Command>,
    /// The newest pedals of each vehicle, and how many frames ago they were given.
    pedals: BTreeMap<u32, (VehicleControl, u32)>,
    /// Batches sent since the last frame.
    sends: u32,
    has_news: bool,
    /// Actors that no snapshot shows yet, until which frame that is no wonder, and where they are.
    spawned: BTreeMap<u32, (u64, Pose)>,
    /// The last frame that clients were shown.
    shown: u64,
    tickers: Vec<Peer>,
    pub(crate) imu_gravity_mps2: f32,
    begun: Instant,
}

impl Bridge {
    pub(crate) fn new(
        client: Client,
        streams: Arc<Streams>,
        statics: Arc<Statics>,
        stream_port: u16,
    ) -> Result<Bridge, ClientError> {
        let settings = EpisodeSettings::of(&client.settings());
        let network = client.map()?;
        let (cast, lights) = (Cast::new(&network, stream_port), Lights::new(&network));
        let roadsides = Roadsides::new(&network);
        let mut bridge = Bridge {
            client,
            streams,
            cast,
            settings,
            weather: CarlaWeather::of(&Weather::default()),
            statics,
            motions: Motions::default(),
            lights,
            lamps: BTreeMap::new(),
            doors: BTreeMap::new(),
            roadsides,
            episode: 0,
            is_new_map: false,
            has_new_lights: false,
            street: Street::default(),
            replayer: Replayer::default(),
            commands: Vec::new(),
            pedals: BTreeMap::new(),
            sends: 0,
            has_news: false,
            spawned: BTreeMap::new(),
            shown: 0,
            tickers: Vec::new(),
            imu_gravity_mps2: 9.81,
            begun: Instant::now(),
        };
        bridge.episode = bridge.standing();
        bridge.show_state();
        Ok(bridge)
    }

    /// Whether the world waits for CARLA's clients to tick it.
    pub(crate) fn is_synchronous(&self) -> bool {
        self.client.settings().synchronous != 0
    }

    /// Whether CARLA's clients tick the world themselves.
    pub(crate) fn is_ticking(&self) -> bool {
        self.is_synchronous() && self.client.holds_tick()
    }

    /// Advances the world, or, if it runs on its own clock, says which frame comes next.
    pub(crate) fn tick(&mut self, peer: &Peer) -> Result<u64, Refusal> {
        if !self.is_synchronous() {
            self.flush();
            return Ok(self.client.frame().0 + 1);
        }
        self.note_ticker(peer);
        self.streams.await_expected(SUBSCRIBERS);
        self.measure_what_is_wanted();
        self.wish_what_goes_on();
        self.flush();
        let frame = match self.client.tick() {
            Ok(frame) => frame,
            Err(e @ ClientError::Incomplete { frame, .. }) => {
                ::log::warn!("{} {e}", frame.0);
                frame
            }
            Err(e) => return Err(e.into()),
        };
        self.show();
        Ok(frame.0)
    }

    /// What clients requested once and holds for more than a frame.
    fn wish_what_goes_on(&mut self) {
        let world = self.client.world();
        self.commands.extend(self.motions.commands(world));
        self.commands.extend(self.lights.commands(world));
    }

    /// Two who tick each advance the world, as CARLA does; they are told of each other.
    fn note_ticker(&mut self, peer: &Peer) {
        if self.tickers.contains(peer) {
            return;
        }
        if let Some(other) = self.tickers.last() {
            ::log::warn!(
                "{} clients {} and {} both tick; each tick advances the world",
                self.shown,
                other.address,
                peer.address
            );
        }
        self.tickers.push(*peer);
    }

    /// A caller has hung up; when the last one who ticked has, others may tick.
    pub(crate) fn forget(&mut self, peer: &Peer) {
        self.tickers.retain(|ticker| ticker != peer);
        if self.tickers.is_empty() {
            self.client.leave_tick();
        }
    }

    /// A command whose outcome nobody waits for.
    pub(crate) fn command(&mut self, command: Command) {
        self.commands.push(command);
        self.has_news = true;
    }

    /// Pedals; the newest hold.
    pub(crate) fn steer(&mut self, control: VehicleControl) {
        self.pedals.insert(control.actor_id.0, (control, 0));
        self.has_news = true;
    }

    /// After each call: what it requested goes at once if the world runs on its own clock.
    pub(crate) fn send_news(&mut self) {
        if self.has_news && !self.is_synchronous() && self.sends < SENDS_MAX {
            self.flush();
        }
    }

    /// Sends what waits. Pedals are sent again for two frames: the bus keeps the newest batches
    /// only, and so each batch says all that is new.
    pub(crate) fn flush(&mut self) {
        self.has_news = false;
        if !self.pedals.is_empty() {
            let controls: Vec<_> = self.pedals.values().map(|(control, _)| *control).collect();
            self.sends += 1;
            if let Err(e) = self.client.control(&controls) {
                ::log::warn!("{} controls are lost: {e}", self.shown);
            }
        }
        if !self.commands.is_empty() {
            let commands = std::mem::take(&mut self.commands);
            self.sends += 1;
            if let Err(e) = self.client.send(&commands) {
                ::log::warn!("{} {} commands are lost: {e}", self.shown, commands.len());
            }
        }
    }

    /// Commands whose outcomes are waited for, after all that were requested before.
    pub(crate) fn request(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<JournalEntry>, Refusal> {
        let mut all = std::mem::take(&mut self.commands);
        let before = all.len();
        all.extend_from_slice(commands);
        if all.is_empty() {
            return Ok(Vec::new());
        }
        let mut outcomes = self.client.try_request(what, &all)?;
        Ok(outcomes.split_off(before.min(outcomes.len())))
    }

    /// One command whose outcome is waited for: the id concerned.
    pub(crate) fn request_one(
        &mut self,
        what: &'static str,
        command: Command,
    ) -> Result<u32, Refusal> {
        let outcomes = self.request(what, &[command])?;
        let outcome = outcomes.first().ok_or("the simulator gave no answer")?.outcome;
        outcome.result().map_err(Refusal::from)
    }

    /// An actor was spawned that the next snapshot shows first.
    pub(crate) fn note_spawned(&mut self, id: u32, pose: Pose) {
        self.spawned.insert(id, (self.client.frame().0 + 3, pose));
    }

    /// The newest state of an actor; one that no snapshot shows yet rests where it was spawned.
    pub(crate) fn state(&self, id: u32) -> Option<ActorState> {
        let actor_id = ActorId(id);
        let fresh = || self.spawned.get(&id).map(|(_, pose)| *pose);
        let rest = |pose| ActorState { actor_id, pose, ..ActorState::default() };
        self.client.world().actor(actor_id).copied().or_else(|| fresh().map(rest))
    }

    /// The limbs of a walker, if it has fallen.
    pub(crate) fn limbs(&self, id: u32) -> Option<WalkerLimbs> {
        WalkerLimbs::find(self.client.world().limbs(), ActorId(id)).copied()
    }

    /// Whether an actor is on the bus, be it in a snapshot yet or not.
    pub(crate) fn is_there(&self, id: u32) -> bool {
        self.spawned.contains_key(&id) || self.client.world().actor(ActorId(id)).is_some()
    }

    /// Shows clients what is new, if anything is.
    pub(crate) fn look(&mut self) {
        match self.client.refresh() {
            Ok(_) if self.client.frame().0 > self.shown => {
                if !self.is_synchronous() && self.episode == self.standing() {
                    self.wish_what_goes_on();
                }
                self.show();
                self.sends = 0;
                self.flush();
                self.measure_what_is_wanted();
            }
            Ok(_) => self.show_measurements(),
            Err(e) => ::log::warn!("{} {e}", self.shown),
        }
    }

    pub(crate) fn show(&mut self) {
        self.follow_episode();
        self.age_pedals();
        let keep = if self.is_synchronous() { 0 } else { 2 };
        self.lamps.retain(|_, (_, age)| {
            *age += 1;
            *age <= keep
        });
        self.show_state();
        self.show_measurements();
    }

    fn age_pedals(&mut self) {
        let keep = if self.is_synchronous() { 0 } else { 2 };
        let cast = &self.cast;
        let does_stick = |id: u32| {
            let actor = cast.known(id);
            actor.and_then(|a| a.description.get("sticky_control")) != Some("false")
        };
        self.pedals.retain(|id, (control, age)| {
            *age += 1;
            let actor_id = control.actor_id;
            let released = VehicleControl { actor_id, ..VehicleControl::default() };
            // Feet that do not stick to the pedals leave them after one frame.
            if *age > keep && *control != released && !does_stick(*id) {
                (*control, *age) = (released, 0);
            }
            *age <= keep
        });
    }

    /// The last frame that clients were shown.
    pub(crate) fn shown(&self) -> u64 {
        self.shown
    }

    /// Sends the newest snapshot to all who listen to the world.
    pub(crate) fn show_state(&mut self) {
        let world = self.client.world();
        let header = world.header();
        self.spawned.retain(|_, (until, _)| *until > header.stamp.frame.0);
        drop(self.cast.forget_gone(world, &self.spawned));
        self.shown = header.stamp.frame.0;
        self.lights.follow(world);
        let moment = Moment {
            frame: self.shown,
            sim_time_nanos: header.stamp.sim_time_nanos,
            delta_nanos: header.delta_nanos.max(1),
            episode: self.episode,
            platform_secs: self.begun.elapsed().as_secs_f64(),
            is_new_map: std::mem::take(&mut self.is_new_map),
            has_new_lights: std::mem::take(&mut self.has_new_lights),
        };
        if let Some(pose) = self.replayer.spectator(world)
            && let Some(spectator) = self.cast.own.get_mut(&SPECTATOR)
        {
            spectator.pose = pose;
        }
        let spectator = self.cast.own.get(&SPECTATOR).map_or_else(Default::default, |s| s.pose);
        let count = world.actors().len() + self.cast.own.len();
        let mut state = StateMessage::new(&moment, &spectator, count);
        for actor in world.actors() {
            match actor.kind {
                kind::TRAFFIC_LIGHT => {
                    let (sign, pole, timing) = self.lights.of(actor, &moment);
                    state.light(actor, sign, pole, &timing);
                }
                kind::VEHICLE => state.actor(actor, self.roadsides.of(actor, world, self.shown)),
                _ => state.actor(actor, Default::default()),
            }
        }
        for (id, own) in &self.cast.own {
            let (pose, velocity) = self.cast.place(own, world);
            state.fixture(*id, &pose, velocity, &own.sign);
        }
        self.streams.publish(WORLD, state.into_message());
    }

    /// Sends what bundles have measured.
    pub(crate) fn show_measurements(&mut self) {
        let world = self.client.world();
        let mut born = Vec::new();
        for (id, own) in &mut self.cast.own {
            let Some(sensor) = &mut own.sensor else { continue };
            while let Some(bundle) = &mut sensor.bundle {
                match bundle.receive() {
                    Ok(Some(measured)) if !sensor.is_of_rays() => born.push((*id, measured)),
                    Ok(Some(measured)) => {
                        if let Some(message) = measure::message_of(sensor, &measured, world) {
                            self.streams.publish(sensor.stream, message);
                        }
                        let size = measured.planes().first();
                        let bytes = size.map_or(0, |p| 4 * p.width as usize * p.height as usize);
                        let fov_deg = sensor.description.number("fov", 90.0).unwrap_or(90.0);
                        for (texture, stream) in &sensor.textures {
                            if self.streams.has_room(*stream, bytes)
                                && let Some(message) =
                                    textures::message_of(*texture, &measured, fov_deg)
                            {
                                self.streams.publish(*stream, message);
                            }
                        }
                    }
                    Ok(None) => break,
                    Err(e) => {
                        ::log::warn!("{} {}: {e}", self.shown, sensor.description.id);
                        break;
                    }
                }
            }
        }
        born.into_iter().for_each(|(id, measured)| self.show_born(id, &measured));
    }

    /// Sends what the host has measured for a sensor.
    fn show_born(&mut self, id: u32, measured: &Measurement) {
        let world = self.client.world();
        let Some(own) = self.cast.own.get_mut(&id) else { return };
        let carrier = own.parent;
        // Messages name actors, whom the cast knows: the sensor steps aside meanwhile.
        let Some(sensor) = own.sensor.take() else { return };
        let blueprints = self.client.blueprints();
        for message in
            born::messages_of(&sensor, carrier, measured, &mut self.cast, world, blueprints)
        {
            self.streams.publish(sensor.stream, message);
        }
        if let Some(own) = self.cast.own.get_mut(&id) {
            own.sensor = Some(sensor);
        }
    }

    /// Sends a text from a sensor with the next frame.
    pub(crate) fn transmit(&mut self, id: u32, text: &str) -> Result<(), Refusal> {
        self.make_rig(id)?;
        let sensor = self.cast.own_mut(id)?.sensor.as_ref();
        let sensor = sensor.filter(|s| s.kind == Kind::V2xCustom);
        let bundle = sensor.and_then(|s| s.bundle.as_ref()).map(client_lib::SensorBundle::id);
        let bundle = bundle.ok_or("only sensor.other.v2x_custom sends")?;
        let mut bytes = [0; TEXT_BYTES];
        let room = bytes.get_mut(..text.len()).ok_or("the text is longer than 100 bytes")?;
        room.copy_from_slice(text.as_bytes());
        self.command(Command::Transmit(Transmit { bundle, sensor: 0, text: bytes }));
        Ok(())
    }

    /// What inertial sensors feel at rest.
    pub(crate) fn set_imu_gravity(&mut self, mps2: f32) {
        self.imu_gravity_mps2 = mps2;
        for own in self.cast.own.values_mut() {
            if let Some(sensor) = own.sensor.as_mut().filter(|s| s.kind == Kind::Imu) {
                // Made for another gravity: it is made anew.
                sensor.rig_delta_nanos = 0;
            }
        }
    }

    /// Whether any bundle is to be looked after.
    pub(crate) fn has_rigs(&self) -> bool {
        self.cast.own.values().any(|o| o.sensor.as_ref().is_some_and(|s| s.bundle.is_some()))
    }

    /// Makes bundles for sensors that somebody listens to, takes those away that nobody does.
    pub(crate) fn measure_what_is_wanted(&mut self) {
        let mut make = Vec::new();
        let mut drop_rigs = Vec::new();
        let delta_nanos = self.client.settings().delta_nanos;
        for (id, own) in &mut self.cast.own {
            let Some(sensor) = &mut own.sensor else { continue };
            // Stations send whether anybody listens or not.
            let is_wanted = sensor.is_wanted(&self.streams) || is_radio(sensor.kind);
            let lacks = sensor.texture_outputs(&self.streams) & !sensor.rig_outputs;
            sensor.idle_frames = if is_wanted { 0 } else { sensor.idle_frames + 1 };
            // A lidar's columns are those of one tick.
            let is_stale = sensor.rig_delta_nanos != delta_nanos || lacks != 0;
            if (sensor.idle_frames > IDLE_FRAMES || is_stale)
                && let Some(bundle) = sensor.bundle.take()
            {
                drop_rigs.push(bundle);
            }
            if is_wanted && sensor.bundle.is_none() {
                make.push(*id);
            }
        }
        for bundle in drop_rigs {
            self.drop_rig(bundle);
        }
        for id in make {
            if let Err(Refusal(why)) = self.make_rig(id) {
                ::log::warn!("{} sensor {id}: {why}", self.shown);
            }
        }
    }

    /// Lets the renderer or the host measure for a sensor.
    pub(crate) fn make_rig(&mut self, id: u32) -> Result<(), Refusal> {
        let delta_nanos = self.client.settings().delta_nanos;
        let Some(own) = self.cast.own.get(&id) else { return Ok(()) };
        // What is mounted on one of our own stands in the world.
        let (carrier, pose) = if own.parent == 0 || Cast::is_own(own.parent) {
            (ActorId::NONE, self.cast.place(own, self.client.world()).0)
        } else {
            (ActorId(own.parent), own.pose)
        };
        let Some(sensor) = own.sensor.as_ref().filter(|s| s.bundle.is_none()) else {
            return Ok(());
        };
        let Some(mut spec) = sensor.spec(pose, delta_nanos, self.imu_gravity_mps2)? else {
            return Ok(());
        };
        spec.outputs |= sensor.texture_outputs(&self.streams);
        if !self.commands.is_empty() {
            let commands = std::mem::take(&mut self.commands);
            self.client.try_request("commands", &commands)?;
        }
        let bundle = self.client.create_bundle(&format!("carla-{id}"), carrier, &[spec], 2)?;
        if let Some(sensor) = self.cast.own.get_mut(&id).and_then(|own| own.sensor.as_mut()) {
            sensor.bundle = Some(bundle);
            sensor.rig_outputs = spec.outputs;
            sensor.rig_delta_nanos = delta_nanos;
            sensor.idle_frames = 0;
        }
        Ok(())
    }

    pub(crate) fn drop_rig(&mut self, bundle: client_lib::SensorBundle) {
        // One that went with its carrier is gone already.
        let _ = self.client.destroy_bundle(bundle);
    }

    /// The number of the world that the newest snapshot shows.
    fn standing(&self) -> u64 {
        self.client.world().header().stamp.episode.into()
    }

    /// If another world was loaded, by whomever: all that was believed of the old one is void.
    fn follow_episode(&mut self) {
        if self.episode == self.standing() {
            return;
        }
        if let Err(e) = self.begin_episode() {
            // The host read the same text.
            ::log::error!("{} the new world cannot be shown: {e}", self.shown);
        }
    }

    fn begin_episode(&mut self) -> Result<(), ClientError> {
        self.episode = self.standing();
        let episode = self.client.instance().episode()?;
        if episode != self.statics.episode {
            self.statics = Arc::new(Statics::new(episode, self.client.map()?));
            self.statics.prepare();
        }
        let network = self.client.map()?;
        self.cast = self.cast.in_world_of(&network);
        self.lights = Lights::new(&network);
        self.roadsides = Roadsides::new(&network);
        self.settings.follow(&self.client.settings());
        self.weather = CarlaWeather::of(&Weather::default());
        self.motions = Motions::default();
        self.replayer = Replayer::default();
        self.street = Street::default();
        self.lamps.clear();
        self.doors.clear();
        self.commands.clear();
        self.pedals.clear();
        self.spawned.clear();
        self.is_new_map = true;
        self.streams.begin_episode();
        Ok(())
    }

    /// Another world in the place of this one; an empty name for the same anew.
    pub(crate) fn load_world(&mut self, name: &str, hidden_layers: u32) -> Result<(), Refusal> {
        self.client.load_world(name, None, hidden_layers)?;
        self.show();
        Ok(())
    }
}
