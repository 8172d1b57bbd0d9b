//! The one bus client through which all of CARLA's clients act.
//!
//! ```text
//!  calls ──▶ Bridge ──commands, controls, ticks──▶ bus
//!  streams ◀── Bridge ◀──snapshots, measurements── bus
//! ```
//!
//! | part | keeps |
//! |---|---|
//! | [`Outbox`] | commands and controls that wait to be sent |
//! | [`EpisodeState`] | everything that ends with the episode |
//! | [`Bundles`] | how sensor bundles are created |
//! | [`Publisher`] | what was sent to the listeners of streams |
//! | [`Tickers`] | the connections that tick the world |

pub(crate) mod bundles;
pub(crate) mod episode_state;
pub(crate) mod outbox;
pub(crate) mod publish;
pub(crate) mod tickers;

use std::sync::Arc;

use client_lib::{
    ActorId, Client, ClientError, Pose,
    wire::{ActorState, Command, Outcome, VehicleControl, WalkerLimbs},
};

use self::{
    bundles::Bundles,
    episode_state::EpisodeState,
    outbox::Outbox,
    publish::{Measured, Publisher},
    tickers::Tickers,
};
use crate::{
    proxy_actors::ProxyActors,
    rpc::Peer,
    settings::EpisodeSettings,
    statics::{SharedStatics, Statics},
    stream::Streams,
};

/// Frames for which an asynchronous world repeats controls and vehicle lights.
const ASYNCHRONOUS_FRAMES: u32 = 2;

/// The world as CARLA's clients see and change it.
pub(crate) struct Bridge {
    pub(crate) client: Client,
    pub(crate) streams: Arc<Streams>,
    pub(crate) statics: Arc<Statics>,
    pub(crate) settings: EpisodeSettings,
    pub(crate) episode: EpisodeState,
    shared_statics: Arc<SharedStatics>,
    pub(crate) bundles: Bundles,
    pub(crate) outbox: Outbox,
    pub(crate) publisher: Publisher,
    pub(crate) tickers: Tickers,
    /// The map of an episode that has begun and of which no snapshot was taken in yet.
    pub(crate) next_statics: Option<(u32, Arc<Statics>)>,
    /// The client that loads a world, until it listens to the state of that world.
    pub(crate) loader: Option<Peer>,
}

impl Bridge {
    /// Creates the bridge and publishes the newest snapshot.
    ///
    /// # Errors
    ///
    /// Returns an error if the map cannot be loaded.
    pub(crate) fn new(
        mut client: Client,
        streams: Arc<Streams>,
        shared_statics: Arc<SharedStatics>,
        stream_port: u16,
    ) -> Result<Bridge, ClientError> {
        client.follow_wire_commands()?;
        let settings = EpisodeSettings::of(&client.wire_settings());
        let number = snapshot_episode(&client);
        let network = client.map()?;
        let actors = ProxyActors::new(&network, stream_port);
        let mut bridge = Bridge {
            episode: EpisodeState::new(number, &network, actors),
            client,
            streams,
            statics: shared_statics.get(),
            settings,
            shared_statics,
            bundles: Bundles::new(),
            outbox: Outbox::default(),
            publisher: Publisher::new(),
            tickers: Tickers::default(),
            next_statics: None,
            loader: None,
        };
        bridge.publish_state();
        Ok(bridge)
    }

    /// Returns whether the world waits for a client to tick it.
    pub(crate) fn is_synchronous(&self) -> bool {
        self.client.wire_settings().synchronous != 0
    }

    /// Returns whether CARLA's clients tick the world.
    pub(crate) fn is_ticking(&self) -> bool {
        self.is_synchronous() && self.client.holds_tick()
    }

    /// Queues what clients requested once and what holds for more than a frame.
    pub(crate) fn queue_held_motions(&mut self) {
        let Bridge { outbox, episode, client, statics, .. } = self;
        outbox.extend(episode.commands(client.world()));
        let actors = &episode.actors;
        let role = |id| actors.known(id).and_then(|actor| actor.description.get("role_name"));
        let is_hero = |id| role(id) == Some("hero");
        outbox.extend(episode.respawn.commands(client.world(), statics.network(), is_hero));
        outbox.extend(episode.dead_ends.commands(client.world(), statics.network()));
    }

    /// Removes a closed connection. After the last ticking one, other bus clients may tick.
    pub(crate) fn on_disconnect(&mut self, peer: &Peer) {
        if self.tickers.remove(peer) {
            self.client.leave_tick();
        }
        self.end_load(peer);
    }

    /// Notes that a client is about to listen to the state of the world, or has disconnected. If it
    /// is the one that has loaded the world, its other listeners receive the state, too.
    pub(crate) fn end_load(&mut self, peer: &Peer) {
        if self.loader.take_if(|loader| loader == peer).is_some() {
            self.streams.end_load(peer.address.ip());
        }
    }

    /// Queues a command whose outcome is not awaited. What it switches is read back at once.
    pub(crate) fn command(&mut self, command: Command) {
        self.episode.standing.apply(&command, &Outcome::done(0));
        self.outbox.command(command);
    }

    /// Sets the control of a vehicle; the newest one holds.
    pub(crate) fn set_control(&mut self, control: VehicleControl) {
        self.outbox.control(control);
    }

    /// Sends what a call has queued, if the world does not wait for a tick.
    pub(crate) fn flush_after_call(&mut self) {
        if self.outbox.is_due() && !self.is_synchronous() {
            self.flush();
        }
    }

    pub(crate) fn flush(&mut self) {
        self.outbox.flush(&mut self.client, self.publisher.frame());
    }

    /// Adds an actor that the next snapshot shows first.
    pub(crate) fn add_spawned(&mut self, id: u32, pose: Pose) {
        self.episode.spawned.add(id, self.client.frame().0, pose);
    }

    /// Returns the newest state of an actor. One that no snapshot shows yet is at rest where it
    /// was spawned.
    pub(crate) fn actor_state(&self, id: u32) -> Option<ActorState> {
        let actor_id = ActorId(id);
        let at_rest = |pose| ActorState { actor_id, pose, ..ActorState::default() };
        let shown = self.client.world().state(actor_id).copied();
        shown.or_else(|| self.episode.spawned.pose(id).map(at_rest))
    }

    /// Returns the limbs of a walker if it has fallen.
    pub(crate) fn limbs(&self, id: u32) -> Option<WalkerLimbs> {
        WalkerLimbs::find(self.client.world().limbs(), ActorId(id)).copied()
    }

    /// Returns whether an actor is on the bus, whether or not a snapshot shows it yet.
    pub(crate) fn exists(&self, id: u32) -> bool {
        self.episode.spawned.contains(id) || self.client.world().state(ActorId(id)).is_some()
    }

    /// Publishes the newest snapshot.
    pub(crate) fn publish_frame(&mut self) {
        self.follow_commands();
        self.follow_episode();
        self.episode.standing.end_frame(self.client.world().header().stamp);
        let keep = if self.is_synchronous() { 0 } else { ASYNCHRONOUS_FRAMES };
        let actors = &self.episode.actors;
        self.outbox.age_controls(keep, |id| {
            let actor = actors.known(id);
            actor.and_then(|a| a.description.get("sticky_control")) != Some("false")
        });
        self.episode.vehicles.age_lights(keep);
        self.publish_state();
    }

    /// Returns the last frame that clients were sent.
    pub(crate) fn published_frame(&self) -> u64 {
        self.publisher.frame()
    }

    fn publish_state(&mut self) {
        self.publisher.state(&self.client, &mut self.episode, &self.streams);
    }

    /// Takes one measurement from each sensor bundle and sends those of the host.
    pub(crate) fn publish_measured(&mut self) -> Measured {
        let Bridge { publisher, client, episode, statics, streams, .. } = self;
        publisher.measurements(client, episode, statics, streams)
    }

    /// Returns whether there are sensor bundles to be received from.
    pub(crate) fn has_bundles(&self) -> bool {
        let mut sensors = self.episode.actors.proxies.values().filter_map(|p| p.sensor.as_ref());
        sensors.any(|sensor| sensor.bundle.is_some())
    }

    /// Returns what inertial sensors at rest measure. Metres per second squared.
    pub(crate) fn imu_gravity_mps2(&self) -> f32 {
        self.bundles.imu_gravity_mps2
    }

    /// Sets what inertial sensors at rest measure. Metres per second squared.
    pub(crate) fn set_imu_gravity(&mut self, mps2: f32) {
        self.bundles.set_imu_gravity(mps2, &mut self.episode);
    }

    /// Applies what other clients of the bus have switched.
    pub(crate) fn follow_commands(&mut self) {
        loop {
            let entry = match self.client.next_wire_command() {
                Ok(Some(entry)) => entry,
                Ok(None) => return,
                Err(e) => {
                    log::warn!("{} commands of other clients: {e}", self.published_frame());
                    return;
                }
            };
            let Some(command) = entry.command.decode() else { continue };
            self.episode.has_new_lights |= matches!(command, Command::SetStreetLights(_));
            self.episode.standing.apply(&command, &entry.outcome);
        }
    }

    /// Replaces the state of the episode if any client has loaded another world.
    fn follow_episode(&mut self) {
        if self.episode.number == snapshot_episode(&self.client) {
            return;
        }
        if let Err(e) = self.begin_episode() {
            // The host has loaded the same map, so this is a fault of the gateway or the system.
            let frame = self.published_frame();
            log::error!("{frame} cannot load the map of the new episode: {e}");
        }
    }

    fn begin_episode(&mut self) -> Result<(), ClientError> {
        // Set first: an episode whose map cannot be loaded is not tried again at each frame.
        self.episode.number = snapshot_episode(&self.client);
        let statics = match self.next_statics.take() {
            Some((number, statics)) if u64::from(number) == self.episode.number => statics,
            _ => Statics::load(self.client.instance(), &self.statics)?.1,
        };
        if !Arc::ptr_eq(&statics, &self.statics) {
            statics.prepare();
            self.shared_statics.set(Arc::clone(&statics));
            self.statics = statics;
        }
        let network = self.statics.network();
        let actors = self.episode.actors.for_map(network);
        let standing = std::mem::take(&mut self.episode.standing);
        self.episode = EpisodeState::new(self.episode.number, network, actors);
        self.episode.standing = standing;
        self.episode.is_new_map = true;
        self.settings.follow(&self.client.wire_settings());
        self.outbox.clear();
        self.streams.begin_episode(self.loader.map(|loader| loader.address.ip()));
        Ok(())
    }
}

/// Returns the number of the episode that the newest snapshot belongs to.
pub(crate) fn snapshot_episode(client: &Client) -> u64 {
    client.world().header().stamp.episode.into()
}
