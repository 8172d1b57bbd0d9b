//! A connection to a running simulator, with both halves in one value.

use std::sync::Arc;

use bus::{Instance, StageClock, Strategy, Watch};
use protocol::{BlueprintInfo, Frame};
use road::Network;

use crate::{
    ClientError, Command, Controller, Deadlines, Measurement, Observer, Outcome, PendingTick,
    Queries, SensorBundle, Settings, Ticket, World, connection::Connection, wire,
};

/// A connection to a running simulator.
///
/// `Send`, not shared: one thread at a time uses it. [`Client::split`] makes two halves of it, for
/// two threads.
#[derive(Debug)]
pub struct Client {
    observer: Observer,
    controller: Controller,
}

/// How to connect: see [`Client::options`].
#[derive(Clone, Debug)]
#[must_use = "call connect()"]
pub struct ConnectOptions {
    name: String,
    instance: Option<String>,
    deadlines: Deadlines,
    strategy: Option<Strategy>,
}

impl ConnectOptions {
    /// Connects to the simulator of this name instead of the only one that runs.
    pub fn instance(mut self, instance: &str) -> ConnectOptions {
        self.instance = Some(instance.to_owned());
        self
    }

    /// Sets how long calls wait.
    pub fn deadlines(mut self, deadlines: Deadlines) -> ConnectOptions {
        self.deadlines = deadlines;
        self
    }

    /// Sets how this client waits; without it, as the host was told on its command line.
    pub fn wait_strategy(mut self, strategy: Strategy) -> ConnectOptions {
        self.strategy = Some(strategy);
        self
    }

    /// Connects.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`] if no such simulator runs, several run and none is named, or the host
    /// was built from another version.
    pub fn connect(self) -> Result<Client, ClientError> {
        let instance = Instance::find(self.instance.as_deref())?;
        Client::join(&instance, &self.name, false, self.deadlines, self.strategy)
    }
}

impl Client {
    /// Connects to the instance of this name, or to the only one that runs. `name` is the client's
    /// own: commands of one frame are carried out in the order of names.
    ///
    /// # Errors
    ///
    /// As for [`ConnectOptions::connect`].
    pub fn connect(instance: Option<&str>, name: &str) -> Result<Client, ClientError> {
        let options = Client::options(name);
        match instance {
            Some(instance) => options.instance(instance).connect(),
            None => options.connect(),
        }
    }

    /// How to connect under this name: deadlines and the wait strategy can be chosen.
    pub fn options(name: &str) -> ConnectOptions {
        ConnectOptions {
            name: name.to_owned(),
            instance: None,
            deadlines: Deadlines::default(),
            strategy: None,
        }
    }

    /// Connects to a host in this process.
    ///
    /// # Errors
    ///
    /// As for [`ConnectOptions::connect`].
    pub fn connect_in_process(instance: &Instance, name: &str) -> Result<Client, ClientError> {
        Client::join(instance, name, true, Deadlines::default(), None)
    }

    fn join(
        instance: &Instance,
        name: &str,
        is_local: bool,
        deadlines: Deadlines,
        strategy: Option<Strategy>,
    ) -> Result<Client, ClientError> {
        let (connection, ports) = Connection::join(instance, name, is_local, strategy)?;
        let connection = Arc::new(connection);
        let observer = Observer::new(Arc::clone(&connection), ports.snapshot, deadlines)?;
        let controller = Controller::new(connection, ports.control, deadlines);
        Ok(Client { observer, controller })
    }

    /// Splits the client into its two halves, each for a thread of its own. The slot of the client
    /// is given back when both are dropped.
    #[must_use]
    pub fn split(self) -> (Observer, Controller) {
        (self.observer, self.controller)
    }

    /// The half that sees the world.
    #[must_use]
    pub fn observer(&mut self) -> &mut Observer {
        &mut self.observer
    }

    /// The half that changes the world.
    #[must_use]
    pub fn controller(&mut self) -> &mut Controller {
        &mut self.controller
    }

    pub(crate) fn connection(&self) -> &Arc<Connection> {
        self.observer.connection()
    }

    /// How long calls wait.
    #[must_use]
    pub fn deadlines(&self) -> Deadlines {
        self.controller.deadlines()
    }

    /// Sets how long calls wait.
    pub fn set_deadlines(&mut self, deadlines: Deadlines) {
        self.observer.set_deadlines(deadlines);
        self.controller.set_deadlines(deadlines);
    }

    /// How this client waits: as the host was told, unless [`ConnectOptions::wait_strategy`] said
    /// otherwise.
    #[must_use]
    pub fn strategy(&self) -> Strategy {
        self.connection().participant.strategy()
    }

    /// See [`Observer::instance`].
    #[must_use]
    pub fn instance(&self) -> &Instance {
        self.observer.instance()
    }

    /// See [`Observer::blueprints`].
    #[must_use]
    pub fn blueprints(&self) -> &[BlueprintInfo] {
        self.observer.blueprints()
    }

    /// See [`Observer::episode`].
    #[must_use]
    pub fn episode(&self) -> u32 {
        self.observer.episode()
    }

    /// See [`Observer::settings`].
    #[must_use]
    pub fn settings(&self) -> Settings {
        self.observer.settings()
    }

    /// See [`Observer::map`].
    ///
    /// # Errors
    ///
    /// As for [`Observer::map`].
    pub fn map(&self) -> Result<Arc<Network>, ClientError> {
        self.observer.map()
    }

    /// See [`Observer::world`].
    #[must_use]
    pub fn world(&self) -> &World {
        self.observer.world()
    }

    /// See [`Observer::frame`].
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.observer.frame()
    }

    /// See [`Observer::refresh`].
    ///
    /// # Errors
    ///
    /// As for [`Observer::refresh`].
    pub fn refresh(&mut self) -> Result<bool, ClientError> {
        self.observer.refresh()
    }

    /// See [`Observer::await_frame`]: for clients that do not tick.
    ///
    /// # Errors
    ///
    /// As for [`Observer::await_frame`].
    pub fn await_frame(&mut self) -> Result<Frame, ClientError> {
        self.observer.await_frame()
    }

    /// See [`Observer::await_measurement`].
    ///
    /// # Errors
    ///
    /// As for [`Observer::await_measurement`].
    pub fn await_measurement(
        &mut self,
        bundle: &mut SensorBundle,
    ) -> Result<Measurement, ClientError> {
        self.observer.await_measurement(bundle)
    }

    /// See [`Observer::stage_clock`].
    #[must_use]
    pub fn stage_clock(&self, frame: Frame) -> StageClock {
        self.observer.stage_clock(frame)
    }

    /// See [`Observer::watch`].
    #[must_use]
    pub fn watch(&self) -> Watch {
        self.observer.watch()
    }

    /// See [`Controller::take_tick`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::take_tick`].
    pub fn take_tick(&mut self) -> Result<(), ClientError> {
        self.controller.take_tick()
    }

    /// See [`Controller::holds_tick`].
    #[must_use]
    pub fn holds_tick(&self) -> bool {
        self.controller.holds_tick()
    }

    /// See [`Controller::leave_tick`].
    pub fn leave_tick(&mut self) {
        self.controller.leave_tick();
    }

    /// See [`Controller::hand_tick_to`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::hand_tick_to`].
    pub fn hand_tick_to(&mut self, name: &str) -> Result<(), ClientError> {
        self.controller.hand_tick_to(name)
    }

    /// See [`Controller::join_barrier`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::join_barrier`].
    pub fn join_barrier(&mut self) -> Result<(), ClientError> {
        self.controller.join_barrier()
    }

    /// See [`Controller::leave_barrier`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::leave_barrier`].
    pub fn leave_barrier(&mut self) -> Result<(), ClientError> {
        self.controller.leave_barrier()
    }

    /// See [`Controller::arrive`].
    pub fn arrive(&mut self) {
        self.controller.arrive();
    }

    /// Advances the world by one tick and takes the new snapshot in. When it returns, every
    /// participant has done its work, and without pipelining all measurements of the frame lie in
    /// their bundles.
    ///
    /// # Errors
    ///
    /// As for [`Controller::tick`]. After [`ClientError::Incomplete`] the snapshot was taken in
    /// nevertheless.
    pub fn tick(&mut self) -> Result<Frame, ClientError> {
        let ticked = self.controller.request_tick()?.wait();
        if let Ok(frame) | Err(ClientError::Incomplete { frame, .. }) = ticked {
            self.observer.refresh()?;
            bus::fault::point(bus::Role::Client, "loan_held", frame, self.connection().first);
        }
        ticked
    }

    /// Returns the queries of this client, for any thread.
    #[must_use]
    pub fn queries(&self) -> Queries {
        Queries::new(self.connection(), self.deadlines().answer)
    }

    /// See [`Controller::request_tick`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::request_tick`].
    pub fn request_tick(&mut self) -> Result<PendingTick, ClientError> {
        self.controller.request_tick()
    }

    /// See [`Controller::current_tick`].
    pub fn current_tick(&self) -> PendingTick {
        self.controller.current_tick()
    }

    /// Advances the world by one tick and returns what each bundle measured at that very frame. A
    /// bundle whose sensors all rest at this frame gives `None`.
    ///
    /// Measurements of earlier frames that were not received yet are dropped, and counted by
    /// [`SensorBundle::missed`]. They exist after a late frame ([`ClientError::Incomplete`]) and
    /// whenever rendering is pipelined ([`Settings::pipeline`]); to get every one of them, call
    /// [`Client::tick`] and [`SensorBundle::receive`] instead.
    ///
    /// # Errors
    ///
    /// As for [`Client::tick`] and [`SensorBundle::receive`]; [`ClientError::WorldGone`].
    pub fn tick_and_collect(
        &mut self,
        bundles: &mut [&mut SensorBundle],
    ) -> Result<(Frame, Vec<Option<Measurement>>), ClientError> {
        let frame = self.tick()?;
        let mut measurements = Vec::with_capacity(bundles.len());
        for bundle in bundles {
            bundle.check(self.episode())?;
            measurements.push(bundle.receive_at(frame)?);
        }
        Ok((frame, measurements))
    }

    /// See [`Controller::control`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::control`].
    pub fn control<C: Copy + Into<wire::VehicleControl>>(
        &mut self,
        controls: &[C],
    ) -> Result<(), ClientError> {
        self.controller.control(controls)
    }

    /// See [`Controller::send`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::send`].
    pub fn send<C: Copy + Into<Command>>(&mut self, commands: &[C]) -> Result<(), ClientError> {
        self.controller.send(commands)
    }

    /// See [`Controller::submit`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::submit`].
    pub fn submit<C: Copy + Into<Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
    ) -> Result<Ticket, ClientError> {
        self.controller.submit(what, commands)
    }

    /// See [`Controller::poll`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::poll`].
    pub fn poll(&mut self, ticket: &Ticket) -> Result<Option<Vec<Outcome>>, ClientError> {
        self.controller.poll(ticket)
    }

    /// See [`Controller::try_request`].
    ///
    /// # Errors
    ///
    /// As for [`Controller::try_request`].
    pub fn try_request<C: Copy + Into<Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
    ) -> Result<Vec<Outcome>, ClientError> {
        self.controller.try_request(what, commands)
    }

    /// Sends commands that are carried out at once if the world stands still, else with its next
    /// frame. Returns the ids of what they made or changed.
    ///
    /// # Errors
    ///
    /// As for [`Controller::try_request`]; the first refusal is [`ClientError::Refused`], though
    /// the other commands were carried out.
    pub fn request<C: Copy + Into<Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
    ) -> Result<Vec<u32>, ClientError> {
        let outcomes = self.try_request(what, commands)?;
        outcomes.iter().map(Outcome::id).collect()
    }

    /// Sends one command and waits until it was carried out.
    pub(crate) fn request_one(
        &mut self,
        what: &'static str,
        command: protocol::Command,
    ) -> Result<u32, ClientError> {
        let outcomes = self.try_request(what, &[command])?;
        outcomes[0].id()
    }

    /// As [`Client::request_one`], for a command that may load a world.
    pub(crate) fn request_world(
        &mut self,
        what: &'static str,
        command: protocol::Command,
    ) -> Result<u32, ClientError> {
        let deadline = self.deadlines().world;
        let outcomes = self.controller.request_within(what, &[command], deadline)?;
        outcomes[0].id()
    }
}
