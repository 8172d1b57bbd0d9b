//! The bridge as the threads of all connections use it: locked while a call reads or changes it, and
//! free while a call waits for the host.
//!
//! A call that waits for the host submits its commands under the lock, so that commands leave in the
//! order of the calls, releases the lock while it waits, and takes it again to apply the outcome.
//! Other connections are served meanwhile. The messages of images are made and sent without the lock,
//! too.
//!
//! | lock | held by |
//! |---|---|
//! | the turn | ticks, loads of worlds and whatever else publishes, from begin to end: one at a time |
//! | `spawns` | a spawn, shared, until its attributes are known; a publication, alone: no snapshot is published that shows an actor without them |
//! | `bundles` | the creation of a sensor bundle: no sensor gets two |
//! | the bridge | a call while it reads or changes something; never across a wait |
//!
//! They are taken in this order. A spawn and the creation of a bundle do not take the turn, since a
//! tick holds it until all images of its frame are measured.

use std::{
    ops::{Deref, DerefMut},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use client_lib::{
    BundleId, ClientError, Layers, Outcome, Queries,
    wire::{self, Command, JournalEntry, LoadMap},
};

use crate::{
    args::RpcError,
    bridge::{Bridge, bundles::Bundles, snapshot_episode},
    rpc::Peer,
    statics::Statics,
};

/// For how long a connection with much to do leaves the bridge to others.
const WAY: Duration = Duration::from_micros(100);
/// How long a tick waits for clients that have requested a stream to connect to it.
const SUBSCRIPTION_TIMEOUT: Duration = Duration::from_secs(2);

/// The bridge and its locks.
pub(crate) struct SharedBridge {
    bridge: Mutex<Bridge>,
    /// The number of threads that wait for the bridge.
    waiting: AtomicUsize,
    turn: Mutex<()>,
    spawns: RwLock<()>,
    bundles: Mutex<()>,
}

/// The bridge, locked by the thread of one connection. Methods that wait for the host release the
/// lock meanwhile.
pub(crate) struct LockedBridge<'a> {
    shared: &'a SharedBridge,
    /// `None` only inside [`LockedBridge::unlocked`].
    guard: Option<MutexGuard<'a, Bridge>>,
}

/// The right to publish. It ends when this is dropped.
#[must_use = "the turn ends when this is dropped"]
struct Turn<'a>(#[expect(dead_code, reason = "held, not read")] MutexGuard<'a, ()>);

/// A spawn whose attributes are not known yet. It ends when this is dropped.
#[must_use = "the spawn ends when this is dropped"]
pub(crate) struct OpenSpawn<'a>(
    #[expect(dead_code, reason = "held, not read")] RwLockReadGuard<'a, ()>,
);

impl SharedBridge {
    pub(crate) fn new(bridge: Bridge) -> SharedBridge {
        SharedBridge {
            bridge: Mutex::new(bridge),
            waiting: AtomicUsize::new(0),
            turn: Mutex::new(()),
            spawns: RwLock::new(()),
            bundles: Mutex::new(()),
        }
    }

    /// Locks the bridge.
    pub(crate) fn lock(&self) -> LockedBridge<'_> {
        LockedBridge { shared: self, guard: Some(self.lock_bridge()) }
    }

    fn lock_bridge(&self) -> MutexGuard<'_, Bridge> {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let guard = lock(&self.bridge);
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        guard
    }
}

/// Locks a mutex, also after a panic of another holder.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Deref for LockedBridge<'_> {
    type Target = Bridge;

    fn deref(&self) -> &Bridge {
        self.guard.as_ref().expect("the bridge is locked except while a call waits")
    }
}

impl DerefMut for LockedBridge<'_> {
    fn deref_mut(&mut self) -> &mut Bridge {
        self.guard.as_mut().expect("the bridge is locked except while a call waits")
    }
}

impl<'a> LockedBridge<'a> {
    /// Waits without the lock. Whatever the call has read before may have changed afterwards.
    pub(crate) fn unlocked<T>(&mut self, wait: impl FnOnce() -> T) -> T {
        self.guard = None;
        let result = wait();
        self.guard = Some(self.shared.lock_bridge());
        result
    }

    /// Lets another connection use the bridge, if one waits for it: a thread that only unlocks and
    /// locks a mutex usually gets it again.
    pub(crate) fn give_way(&mut self) {
        if self.shared.waiting.load(Ordering::Relaxed) > 0 {
            self.unlocked(|| std::thread::sleep(WAY));
        }
    }

    /// Waits for the turn, without the lock. A thread that has the turn must not call this.
    fn take_turn(&mut self) -> Turn<'a> {
        let shared = self.shared;
        self.unlocked(|| Turn(lock(&shared.turn)))
    }

    /// Begins a spawn, after a publication that is under way. A thread that has begun one must not
    /// call this.
    pub(crate) fn begin_spawn(&mut self) -> OpenSpawn<'a> {
        let shared = self.shared;
        let read = || shared.spawns.read().unwrap_or_else(PoisonError::into_inner);
        self.unlocked(|| OpenSpawn(read()))
    }

    /// Publishes the newest snapshot, and then what was measured. The caller has the turn.
    fn publish(&mut self) {
        let shared = self.shared;
        let write = || shared.spawns.write().unwrap_or_else(PoisonError::into_inner);
        let spawns = self.unlocked(write);
        self.publish_frame();
        drop(spawns);
        self.publish_measurements();
    }

    /// Sends all that sensor bundles have measured. The caller has the turn, so that the
    /// measurements of a sensor are sent in their order.
    fn publish_measurements(&mut self) {
        loop {
            let measured = self.publish_measured();
            if !measured.is_any {
                return;
            }
            let streams = Arc::clone(&self.streams);
            self.unlocked(|| measured.rendered.into_iter().for_each(|one| one.send(&streams)));
        }
    }

    /// Reads the map of a world that was loaded, without the lock, before a snapshot of it is taken
    /// in. The caller has the turn.
    fn load_map(&mut self) {
        let number = self.client.episode();
        let is_known = |known: &Option<(u32, _)>| known.as_ref().is_some_and(|(n, _)| *n == number);
        if u64::from(number) == self.episode.number || is_known(&self.next_statics) {
            return;
        }
        let (instance, before) = (self.client.instance().clone(), Arc::clone(&self.statics));
        match self.unlocked(|| Statics::load(&instance, &before)) {
            Ok(loaded) => self.next_statics = Some(loaded),
            // The same error is reported when the episode begins.
            Err(e) => log::debug!("the map of episode {number}: {e}"),
        }
    }

    /// Returns what is fixed for the episode, with its town, which is awaited without the lock.
    pub(crate) fn statics_with_town(&mut self) -> Arc<Statics> {
        let statics = Arc::clone(&self.statics);
        self.unlocked(|| {
            statics.town();
        });
        statics
    }

    /// Advances a synchronous world by a tick and returns the new frame. Of an asynchronous world,
    /// returns the next frame.
    ///
    /// # Errors
    ///
    /// Returns an error if the host ends or does not finish the tick.
    pub(crate) fn tick(&mut self, peer: &Peer) -> Result<u64, RpcError> {
        let _turn = self.is_synchronous().then(|| self.take_turn());
        if !self.is_synchronous() {
            self.flush();
            return Ok(self.client.frame().0 + 1);
        }
        let frame = self.published_frame();
        self.tickers.add(peer, frame);
        let streams = Arc::clone(&self.streams);
        self.unlocked(|| streams.await_expected(SUBSCRIPTION_TIMEOUT));
        self.update_bundles();
        self.update_friction();
        self.queue_held_motions();
        self.flush();
        let requested = self.client.request_tick()?;
        let frame = match self.unlocked(|| requested.wait()) {
            Ok(frame) => frame,
            Err(e @ ClientError::Incomplete { frame, .. }) => {
                log::warn!("{} {e}", frame.0);
                frame
            }
            Err(e) => return Err(e.into()),
        };
        self.load_map();
        self.client.refresh()?;
        self.publish();
        Ok(frame.0)
    }

    /// Sends commands after all that are queued, and returns their outcomes.
    ///
    /// # Errors
    ///
    /// Returns an error if the host does not answer.
    pub(crate) fn request(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<JournalEntry>, RpcError> {
        let outcomes = self.request_outcomes(what, commands)?;
        Ok(outcomes.into_iter().map(Outcome::into_entry).collect())
    }

    fn request_outcomes(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<Outcome>, RpcError> {
        let mut all = self.outbox.take_commands();
        let before = all.len();
        all.extend_from_slice(commands);
        if all.is_empty() {
            return Ok(Vec::new());
        }
        let deadline = self.client.deadlines().answer;
        let mut outcomes = self.submit_and_wait(what, &all, deadline)?;
        let outcomes = outcomes.split_off(before.min(outcomes.len()));
        for (command, outcome) in commands.iter().zip(&outcomes) {
            self.episode.standing.apply(command, &outcome.into_entry().outcome);
        }
        Ok(outcomes)
    }

    /// Sends commands before all that are queued, and waits for their outcomes without the lock.
    fn submit_and_wait<C: Copy + Into<client_lib::Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
        deadline: Duration,
    ) -> Result<Vec<Outcome>, ClientError> {
        let ticket = self.client.submit(what, commands)?;
        self.unlocked(|| ticket.wait(deadline))
    }

    /// Sends a command and returns the id of the actor or bundle that it concerns.
    ///
    /// # Errors
    ///
    /// Returns an error if the host does not answer or refuses the command.
    pub(crate) fn request_one(
        &mut self,
        what: &'static str,
        command: Command,
    ) -> Result<u32, RpcError> {
        let outcomes = self.request(what, &[command])?;
        let outcome = outcomes.first().ok_or("the host returned no outcome")?.outcome;
        outcome.result().map_err(RpcError::from)
    }

    /// Sends one command before all that are queued, and returns the id of its outcome.
    ///
    /// # Errors
    ///
    /// Returns an error if the host does not answer or refuses the command.
    pub(crate) fn request_first(
        &mut self,
        what: &'static str,
        command: client_lib::Command,
        deadline: Duration,
    ) -> Result<u32, RpcError> {
        let outcomes = self.submit_and_wait(what, &[command], deadline)?;
        Ok(outcomes.first().ok_or("the host returned no outcome")?.id()?)
    }

    /// Waits until the host has executed all queued commands.
    pub(crate) fn flush_and_wait(&mut self) -> Result<(), RpcError> {
        self.request("commands", &[]).map(drop)
    }

    /// Sends queries and waits for the responses without the lock.
    ///
    /// # Errors
    ///
    /// Returns an error if the host does not answer.
    pub(crate) fn query<T>(
        &mut self,
        query: impl FnOnce(&Queries) -> Result<T, ClientError>,
    ) -> Result<T, RpcError> {
        let queries = self.client.queries();
        Ok(self.unlocked(|| query(&queries))?)
    }

    /// Publishes what is new in a world that another client ticks or that ticks by itself.
    pub(crate) fn update(&mut self) {
        let _turn = self.take_turn();
        self.load_map();
        match self.client.refresh() {
            Ok(_) if self.client.frame().0 > self.published_frame() => {
                if !self.is_synchronous() && self.episode.number == snapshot_episode(&self.client) {
                    self.update_friction();
                    self.queue_held_motions();
                }
                self.publish();
                self.outbox.begin_frame();
                self.flush();
                self.update_bundles();
            }
            Ok(_) => {
                self.follow_commands();
                self.publish_measurements();
            }
            Err(e) => log::warn!("{} {e}", self.published_frame()),
        }
    }

    /// Creates bundles for sensors that have listeners, and destroys those without.
    fn update_bundles(&mut self) {
        let Bridge { bundles, episode, streams, client, .. } = &mut **self;
        let delta_nanos = client.wire_settings().delta_nanos;
        let (obsolete, missing) = bundles.changes(episode, streams, delta_nanos);
        // A dropped bundle is destroyed.
        drop(obsolete);
        for id in missing {
            if let Err(RpcError(why)) = self.create_bundle(id) {
                log::warn!("{} sensor {id}: {why}", self.published_frame());
            }
        }
    }

    /// Creates the bundle of a sensor, unless it has one or needs none.
    ///
    /// # Errors
    ///
    /// Returns an error if an attribute of the sensor is invalid or the host refuses the bundle.
    pub(crate) fn create_bundle(&mut self, id: u32) -> Result<(), RpcError> {
        let shared = self.shared;
        let _alone = self.unlocked(|| lock(&shared.bundles));
        let Bridge { bundles, episode, streams, client, .. } = &mut **self;
        let Some(new) = bundles.new_bundle(episode, client, streams, id)? else { return Ok(()) };
        let outcomes = self.request_outcomes("bundle", &new.commands)?;
        let ids = outcomes.iter().map(Outcome::id).collect::<Result<Vec<_>, _>>()?;
        let bundle = BundleId(*ids.first().ok_or("the host returned no outcome")?);
        let Bridge { episode, client, .. } = &mut **self;
        Bundles::open(&new, bundle, episode, client, id)
    }

    /// Queues a text that a radio sends with the next frame.
    ///
    /// # Errors
    ///
    /// Returns an error if the sensor cannot send text or the text is too long.
    pub(crate) fn transmit(&mut self, id: u32, text: &str) -> Result<(), RpcError> {
        self.create_bundle(id)?;
        let command = Bundles::transmission(&mut self.episode, id, text)?;
        self.command(command);
        Ok(())
    }

    /// Loads another world in the place of this one; an empty name loads the same map again.
    /// `loader`: the client, if it closes its listener to the present world afterwards.
    ///
    /// # Errors
    ///
    /// Returns an error if the host refuses the map.
    pub(crate) fn load_world(
        &mut self,
        name: &str,
        hidden_layers: u32,
        loader: Option<&Peer>,
    ) -> Result<(), RpcError> {
        let _turn = self.take_turn();
        self.loader = loader.copied();
        let loaded = self.request_world(name, hidden_layers);
        if let (Err(_), Some(loader)) = (&loaded, loader) {
            self.end_load(loader);
        }
        loaded
    }

    fn request_world(&mut self, name: &str, hidden_layers: u32) -> Result<(), RpcError> {
        let layers = Layers::from_bits_retain(hidden_layers);
        let command = client_lib::Command::load_world(name, None, layers)?;
        let deadline = self.client.deadlines().world;
        let number = self.request_first("load_map", command, deadline)?;
        self.reset_standing(number, hidden_layers);
        self.await_world(number)?;
        self.publish();
        Ok(())
    }

    /// Starts a replay, which may load another world.
    ///
    /// # Errors
    ///
    /// Returns an error if the host refuses the file.
    pub(crate) fn start_replay(&mut self, command: client_lib::Command) -> Result<(), RpcError> {
        let _turn = self.take_turn();
        let number = self.client.episode();
        let deadline = self.client.deadlines().world;
        // When this returns, the host has opened the file.
        self.request_first("start_replay", command, deadline)?;
        let loaded = self.client.episode();
        if loaded != number {
            self.reset_standing(loaded, 0);
            self.await_world(loaded)?;
        }
        self.publish();
        Ok(())
    }

    /// Resets what a new world does not take over. The gateway's own commands are not among those
    /// that it follows.
    fn reset_standing(&mut self, number: u32, hidden_layers: u32) {
        self.follow_commands();
        let loaded = Command::LoadMap(LoadMap::default());
        self.episode.standing.apply(&loaded, &wire::Outcome::done(number));
        self.episode.standing.hidden.set_layers(hidden_layers, true);
    }

    /// Takes the first snapshot of this world in, and waits until every stage has built it.
    fn await_world(&mut self, number: u32) -> Result<(), ClientError> {
        loop {
            self.load_map();
            self.client.refresh()?;
            if self.client.world().header().stamp.episode >= number {
                break;
            }
            let (watch, last) = (self.client.watch(), self.client.frame());
            let ended = |_| ClientError::HostEnded { last };
            self.unlocked(|| watch.next_frame(last, None)).map_err(ended)?;
        }
        // The host answers before it begins the frame, so this is asked for after the snapshot.
        let first = self.client.current_tick();
        match self.unlocked(|| first.wait()) {
            Ok(_) | Err(ClientError::Incomplete { .. }) => Ok(()),
            Err(e) => Err(e),
        }
    }
}
