//! The half of a client that changes the world.

use std::{sync::Arc, time::Duration};

use bus::{Role, SlotInstant, Writer, fault};
use protocol::{BatchHeader, Frame, Name, RawCommand};

use crate::{
    ClientError, Command, Deadlines, Outcome, PendingTick, Ticket,
    connection::{Connection, after},
    wire,
};

/// Sends controls and commands and advances the world: one half of a
/// [`Client`](crate::Client::split). It is `Send`, so that it can act on another thread than its
/// [`Observer`](crate::Observer).
pub struct Controller {
    control: Writer<BatchHeader, wire::VehicleControl>,
    deadlines: Deadlines,
    connection: Arc<Connection>,
}

impl Controller {
    pub(crate) fn new(
        connection: Arc<Connection>,
        control: Writer<BatchHeader, wire::VehicleControl>,
        deadlines: Deadlines,
    ) -> Controller {
        Controller { control, deadlines, connection }
    }

    pub(crate) fn connection(&self) -> &Arc<Connection> {
        &self.connection
    }

    /// How long calls wait.
    #[must_use]
    pub fn deadlines(&self) -> Deadlines {
        self.deadlines
    }

    /// Sets how long calls wait.
    pub fn set_deadlines(&mut self, deadlines: Deadlines) {
        self.deadlines = deadlines;
    }

    /// Sets pedals and wheels from the next frame on; the latest hold. Does not wait. Its only heap
    /// allocation is the transport's count of owners of the loan.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`] if the channel has no room.
    pub fn control<C: Copy + Into<wire::VehicleControl>>(
        &mut self,
        controls: &[C],
    ) -> Result<(), ClientError> {
        let mut loan = self.control.loan(controls.len())?;
        let rooms = loan.payload_mut().iter_mut();
        rooms.zip(controls).for_each(|(room, control)| *room = (*control).into());
        let header = self.connection.batch(controls.len(), false);
        self.connection.participant.mark(SlotInstant::ControlSent, header.stamp.frame);
        Ok(loan.send(header)?)
    }

    /// Sends commands that are carried out with the next tick. Does not wait for their outcomes,
    /// and allocates no more than [`Controller::control`].
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`] if the host has not taken earlier commands for 2 s.
    pub fn send<C: Copy + Into<Command>>(&mut self, commands: &[C]) -> Result<(), ClientError> {
        self.connection.send(commands.iter().map(|command| raw(*command)), false, None).map(drop)
    }

    /// Sends commands that are carried out at once if the world stands still, else with its next
    /// frame. Does not wait: the ticket is for [`Controller::poll`] and [`Controller::wait`].
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`] if the host has not taken earlier commands for 2 s.
    pub fn submit<C: Copy + Into<Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
    ) -> Result<Ticket, ClientError> {
        let mut inbox = self.connection.inbox();
        inbox.prepare(self.connection.name())?;
        let raw_commands = commands.iter().map(|command| raw(*command));
        let first = self.connection.send(raw_commands, true, Some(&mut inbox))?;
        drop(inbox);
        Ok(Ticket::new(&self.connection, what, first, commands.len()))
    }

    /// Returns the outcomes of a ticket's commands, in their order, once; `None` while the host has
    /// not carried all of them out. Never blocks.
    ///
    /// # Errors
    ///
    /// [`ClientError::JournalOverrun`] if this client did not poll for so long that outcomes were
    /// overwritten.
    pub fn poll(&mut self, ticket: &Ticket) -> Result<Option<Vec<Outcome>>, ClientError> {
        ticket.poll(&self.connection)
    }

    /// Waits for the outcomes of a ticket's commands.
    ///
    /// # Errors
    ///
    /// As for [`Controller::poll`]; [`ClientError::Timeout`] after `deadline`;
    /// [`ClientError::HostEnded`].
    pub fn wait(
        &mut self,
        ticket: &Ticket,
        deadline: Duration,
    ) -> Result<Vec<Outcome>, ClientError> {
        ticket.wait(deadline)
    }

    /// Sends commands that are carried out at once if the world stands still, else with its next
    /// frame, and waits for each one's outcome.
    ///
    /// # Errors
    ///
    /// As for [`Controller::wait`]. A refused command is an outcome, not an error.
    pub fn try_request<C: Copy + Into<Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
    ) -> Result<Vec<Outcome>, ClientError> {
        self.request_within(what, commands, self.deadlines.answer)
    }

    pub(crate) fn request_within<C: Copy + Into<Command>>(
        &mut self,
        what: &'static str,
        commands: &[C],
        deadline: Duration,
    ) -> Result<Vec<Outcome>, ClientError> {
        let ticket = self.submit(what, commands)?;
        self.wait(&ticket, deadline)
    }

    /// Takes the tick if no other client holds it.
    ///
    /// # Errors
    ///
    /// [`ClientError::TickTaken`] names the client that holds it.
    pub fn take_tick(&mut self) -> Result<(), ClientError> {
        let control = self.connection.participant.control();
        let own = self.connection.participant.slot();
        if control.ticker() == Some(own) || control.pass_tick(None, Some(own)) {
            return Ok(());
        }
        Err(self.tick_taken())
    }

    /// Returns whether this client holds the tick.
    #[must_use]
    pub fn holds_tick(&self) -> bool {
        let participant = &self.connection.participant;
        participant.control().ticker() == Some(participant.slot())
    }

    /// Gives the tick back, if this client holds it, so that another client can take it.
    pub fn leave_tick(&mut self) {
        let own = self.connection.participant.slot();
        self.connection.participant.control().pass_tick(Some(own), None);
    }

    /// Hands the tick to the client of this name.
    ///
    /// # Errors
    ///
    /// [`ClientError::NoSuchClient`]; [`ClientError::TickTaken`] if this client does not hold it.
    pub fn hand_tick_to(&mut self, name: &str) -> Result<(), ClientError> {
        let control = self.connection.participant.control();
        let own = self.connection.participant.slot();
        let is_live = |slot: &bus::Slot| {
            slot.state() == bus::SlotState::Live && slot.role() == Some(Role::Client)
        };
        let to = (0..bus::SLOTS)
            .find(|&i| is_live(control.slot(i)) && control.slot(i).name() == Name::new(name))
            .ok_or_else(|| ClientError::NoSuchClient { name: name.to_owned() })?;
        if control.pass_tick(Some(own), Some(to)) {
            return Ok(());
        }
        Err(self.tick_taken())
    }

    fn tick_taken(&self) -> ClientError {
        let control = self.connection.participant.control();
        let holder = control.ticker().map(|slot| control.slot(slot).name().to_string());
        ClientError::TickTaken { holder: holder.unwrap_or_default() }
    }

    /// Makes every tick of another client wait until this one has arrived: agents in lockstep. At
    /// each frame the agent observes the frame, sends controls, and calls [`Controller::arrive`].
    ///
    /// # Errors
    ///
    /// [`ClientError::HoldsTick`] if this client holds the tick itself; [`ClientError::Timeout`];
    /// [`ClientError::HostEnded`].
    pub fn join_barrier(&mut self) -> Result<(), ClientError> {
        if self.holds_tick() {
            return Err(ClientError::HoldsTick);
        }
        self.request_barrier(true, "admission to the barrier")
    }

    /// Lets ticks pass without waiting for this client.
    ///
    /// # Errors
    ///
    /// [`ClientError::Timeout`]; [`ClientError::HostEnded`].
    pub fn leave_barrier(&mut self) -> Result<(), ClientError> {
        self.request_barrier(false, "release from the barrier")
    }

    fn request_barrier(&mut self, is_wanted: bool, what: &str) -> Result<(), ClientError> {
        let participant = &self.connection.participant;
        let words = participant.words();
        words.request_barrier(is_wanted);
        participant.control().host.notify();
        let waited = self.deadlines.answer;
        let is_granted = || (words.in_barrier() == is_wanted).then_some(());
        let granted = participant.await_answer(after(waited), is_granted);
        granted.map_err(|why| self.connection.interrupted(why, what, waited))
    }

    /// Reports that this client's work for the frame that it observed last is done.
    pub fn arrive(&mut self) {
        self.connection.participant.arrive(self.connection.frame());
    }

    /// Advances the world by one tick. When it returns, every participant has done its work, and
    /// without pipelining all measurements of the frame lie in their bundles. The
    /// [`Observer`](crate::Observer) takes the new snapshot in by itself.
    ///
    /// # Errors
    ///
    /// [`ClientError::TickTaken`], [`ClientError::Asynchronous`], [`ClientError::Incomplete`] if a
    /// participant was late or died, [`ClientError::HostEnded`], [`ClientError::Timeout`].
    pub fn tick(&mut self) -> Result<Frame, ClientError> {
        self.request_tick()?.wait()
    }

    /// Requests the next frame and does not wait for it: [`PendingTick::wait`] does.
    ///
    /// # Errors
    ///
    /// [`ClientError::TickTaken`]; [`ClientError::Asynchronous`].
    pub fn request_tick(&mut self) -> Result<PendingTick, ClientError> {
        self.take_tick()?;
        let Connection { participant, first, .. } = &*self.connection;
        let control = participant.control();
        if !control.is_synchronous() {
            return Err(ClientError::Asynchronous);
        }
        // A frame of the asynchronous world may still be under way.
        let frame = Frame(control.complete.get().max(control.tick.get())).next();
        fault::point(Role::Client, "requesting", frame, *first);
        control.request(participant.slot(), frame);
        fault::point(Role::Client, "requested", frame, *first);
        Ok(PendingTick::new(&self.connection, frame, self.deadlines.frame))
    }

    /// Returns the frame that the host computes, or the last one if it computes none.
    pub fn current_tick(&self) -> PendingTick {
        let frame = Frame(self.connection.participant.control().tick.get());
        PendingTick::new(&self.connection, frame, self.deadlines.frame)
    }
}

impl std::fmt::Debug for Controller {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Controller")
            .field("connection", &self.connection)
            .field("deadlines", &self.deadlines)
            .finish_non_exhaustive()
    }
}

fn raw(command: impl Into<Command>) -> RawCommand {
    let Command(command) = command.into();
    command.into()
}
