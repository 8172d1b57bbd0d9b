//! What the two halves of a client share: the participant slot, the command port and the journal.

use std::{
    os::fd::OwnedFd,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use bake::Cache;
use bus::{
    ClientPorts, Instance, Interrupted, Participant, Reader, Role, SnapshotReader, Writer, clock,
    fault, process,
};
use protocol::{
    BATCH_MAX, BatchHeader, BlueprintInfo, Command, Frame, Name, Query, QueryHeader, RawCommand,
    Response, Stamp, VehicleControl,
};
use road::Network;

use crate::{ClientError, inbox::Inbox, static_world::StaticWorld};

/// How long calls wait before they fail with [`ClientError::Timeout`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Deadlines {
    /// For the outcome of a command, and for a measurement: 30 s at first.
    pub answer: Duration,
    /// For a command that loads a map or a recording of another map: 180 s at first.
    pub world: Duration,
    /// For a frame: [`Client::tick`](crate::Client::tick) and
    /// [`Client::await_frame`](crate::Client::await_frame). `None`, as at first, waits until the
    /// host ends.
    pub frame: Option<Duration>,
}

impl Default for Deadlines {
    fn default() -> Self {
        Deadlines { answer: Duration::from_secs(30), world: Duration::from_secs(180), frame: None }
    }
}

impl Deadlines {
    /// The same deadlines with another one for outcomes and measurements.
    #[must_use]
    pub fn with_answer(self, answer: Duration) -> Deadlines {
        Deadlines { answer, ..self }
    }

    /// The same deadlines with another one for loading a world.
    #[must_use]
    pub fn with_world(self, world: Duration) -> Deadlines {
        Deadlines { world, ..self }
    }

    /// The same deadlines with another one for frames.
    #[must_use]
    pub fn with_frame(self, frame: Option<Duration>) -> Deadlines {
        Deadlines { frame, ..self }
    }
}

/// A moment of the monotonic clock, nanoseconds.
pub(crate) fn after(wait: Duration) -> u64 {
    let nanos = u64::try_from(wait.as_nanos()).unwrap_or(u64::MAX);
    clock::now_nanos().saturating_add(nanos)
}

/// The parts of a connection that a half owns alone.
pub(crate) struct OwnPorts {
    pub(crate) snapshot: SnapshotReader,
    pub(crate) control: Writer<BatchHeader, VehicleControl>,
}

/// The channels of queries and their responses.
struct Queries {
    query: Writer<QueryHeader, Query>,
    response: Reader<QueryHeader, Response>,
    /// The number of the last batch.
    sequence: u64,
}

/// The most commands of a request that wait for their outcomes before more are sent: less than the
/// channel holds.
const UNANSWERED_MAX: usize = 8 * BATCH_MAX;
/// How long a request waits for the outcomes of its first commands before it gives up.
const SEND_TIMEOUT: Duration = Duration::from_secs(60);

/// A slot of the control page, and what goes with it. The last half that is dropped leaves.
pub(crate) struct Connection {
    command: Mutex<Writer<BatchHeader, RawCommand>>,
    inbox: Mutex<Inbox>,
    queries: Mutex<Queries>,
    pub(crate) bundles: bus::BundleReaders,
    /// The parsed map, and the number of its world.
    network: Mutex<Option<(u32, Arc<Network>)>>,
    /// The furnished town, and the number of its world.
    static_world: Mutex<Option<(u32, Arc<StaticWorld>)>>,
    pub(crate) blueprints: Vec<BlueprintInfo>,
    name: Name,
    sequence: AtomicU64,
    /// The newest frame that this client took in.
    frame: AtomicU64,
    pub(crate) first: Frame,
    /// The process of the host; `None` if it had ended when this client joined.
    host: Option<OwnedFd>,
    // Last: a participant leaves when its ports are gone.
    pub(crate) participant: Participant,
}

/// Nothing that a panic could leave half done is kept under these locks.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Connection {
    /// Joins an instance; `is_local`: its host is in this process.
    pub(crate) fn join(
        instance: &Instance,
        name: &str,
        is_local: bool,
        strategy: Option<bus::Strategy>,
    ) -> Result<(Connection, OwnPorts), ClientError> {
        let name = unique(instance, name)?;
        let mut participant = Participant::join(instance, Role::Client, name, None, is_local)?;
        if let Some(strategy) = strategy {
            participant.set_strategy(strategy);
        }
        fault::joining(Role::Client);
        let ClientPorts { snapshot, outcomes, command, control, query, response, bundles } =
            ClientPorts::open(participant.node()?)?;
        participant.ready()?;
        let first = participant.words().ack();
        let (host, started) = participant.control().host_process();
        let connection = Connection {
            command: Mutex::new(command),
            inbox: Mutex::new(Inbox::new(
                outcomes,
                participant.control().clone(),
                participant.slot(),
            )),
            queries: Mutex::new(Queries { query, response, sequence: 0 }),
            bundles,
            network: Mutex::new(None),
            static_world: Mutex::new(None),
            blueprints: instance.blueprints()?,
            name,
            sequence: AtomicU64::new(0),
            frame: AtomicU64::new(first.0),
            first,
            host: process::watch(host, started),
            participant,
        };
        Ok((connection, OwnPorts { snapshot, control }))
    }

    pub(crate) fn inbox(&self) -> MutexGuard<'_, Inbox> {
        lock(&self.inbox)
    }

    pub(crate) fn name(&self) -> Name {
        self.name
    }

    pub(crate) fn frame(&self) -> Frame {
        Frame(self.frame.load(Ordering::Relaxed))
    }

    pub(crate) fn set_frame(&self, frame: Frame) {
        self.frame.store(frame.0, Ordering::Relaxed);
    }

    /// The number of the world that stands.
    pub(crate) fn episode(&self) -> u32 {
        self.participant.control().episode()
    }

    /// The header of a batch of `len` commands or controls, with the next numbers of this client.
    pub(crate) fn batch(&self, len: usize, now: bool) -> BatchHeader {
        BatchHeader {
            stamp: Stamp { frame: self.frame(), ..Stamp::default() },
            client: self.name,
            sequence: self.sequence.fetch_add(len as u64, Ordering::Relaxed),
            now: now.into(),
            slot: self.participant.slot() as u32,
        }
    }

    /// Sends commands, written in place, in as many batches as they need. With an inbox, their
    /// outcomes are awaited. Returns the number of the first.
    pub(crate) fn send(
        &self,
        commands: impl ExactSizeIterator<Item = RawCommand>,
        now: bool,
        inbox: Option<&mut Inbox>,
    ) -> Result<u64, ClientError> {
        let writer = lock(&self.command);
        // Numbered under the lock: batches leave in the order of their numbers.
        let header = self.batch(commands.len(), now);
        let first = header.sequence;
        match inbox {
            None => self.send_batches(&writer, header, commands, |_, _| Ok(()))?,
            Some(inbox) => {
                inbox.open(first, commands.len());
                let sent = self.send_batches(&writer, header, commands, |sent, last| {
                    // A bundle has no outcome before the last of its sensors has arrived.
                    let is_sensor = matches!(last.decode(), Some(Command::Sensor(_)));
                    if now && !is_sensor {
                        self.await_outcomes(inbox, first, sent)
                    } else {
                        inbox.take_in(self.name)
                    }
                });
                if sent.is_err() {
                    inbox.close(first);
                }
                sent?;
            }
        }
        Ok(first)
    }

    /// Waits until few of the `sent` commands numbered from `first` have no outcome: a client whose
    /// channel is full could not read, and lose outcomes.
    fn await_outcomes(
        &self,
        inbox: &mut Inbox,
        first: u64,
        sent: usize,
    ) -> Result<(), ClientError> {
        let mut has_room = || match inbox.take_in(self.name) {
            Ok(()) => (sent - inbox.ended(first) <= UNANSWERED_MAX).then_some(Ok(())),
            Err(e) => Some(Err(e)),
        };
        if let Some(ended) = has_room() {
            return ended;
        }
        let waited = self.participant.await_answer(after(SEND_TIMEOUT), has_room);
        waited.map_err(|why| self.interrupted(why, "room for more commands", SEND_TIMEOUT))?
    }

    /// Sends commands numbered as in `header`; calls `between` after each batch but the last, with the
    /// number of commands sent and the last of them.
    fn send_batches(
        &self,
        writer: &Writer<BatchHeader, RawCommand>,
        mut header: BatchHeader,
        mut commands: impl ExactSizeIterator<Item = RawCommand>,
        mut between: impl FnMut(usize, RawCommand) -> Result<(), ClientError>,
    ) -> Result<(), ClientError> {
        let mut sent = 0;
        while commands.len() > 0 {
            let count = commands.len().min(BATCH_MAX);
            let mut loan = writer.loan(count)?;
            let rooms = loan.payload_mut().iter_mut();
            rooms.zip(&mut commands).for_each(|(room, command)| *room = command);
            let last = loan.payload_mut()[count - 1];
            loan.send(header)?;
            header.sequence += count as u64;
            sent += count;
            if commands.len() > 0 {
                self.participant.control().host.notify();
                between(sent, last)?;
            } else if header.now != 0 {
                self.participant.control().host.notify();
            }
        }
        Ok(())
    }

    /// Sends queries and waits for the response to each, in their order.
    pub(crate) fn query(
        &self,
        what: &'static str,
        queries: &[Query],
        deadline: Duration,
    ) -> Result<Vec<Response>, ClientError> {
        let mut ports = lock(&self.queries);
        ports.sequence += 1;
        // Responses to other clients' queries, and to own ones that timed out.
        while ports.response.receive()?.is_some() {}
        let (client, sequence) = (self.name, ports.sequence);
        let stamp = Stamp { frame: self.frame(), ..Stamp::default() };
        ports.query.send(QueryHeader { stamp, client, sequence }, queries)?;
        self.participant.control().host.notify();
        let answered = self.participant.await_answer(after(deadline), || {
            loop {
                match ports.response.receive() {
                    Ok(Some(sample)) => {
                        let header = sample.header();
                        if header.client == client && header.sequence == sequence {
                            return Some(Ok(sample.payload().to_vec()));
                        }
                    }
                    Ok(None) => return None,
                    Err(e) => return Some(Err(e)),
                }
            }
        });
        Ok(answered.map_err(|why| self.interrupted(why, what, deadline))??)
    }

    /// The road network of the world that stands, parsed or read from the cache once for each.
    pub(crate) fn network(&self) -> Result<Arc<Network>, ClientError> {
        let mut known = lock(&self.network);
        let standing = self.episode();
        if let Some((number, network)) = &*known
            && *number == standing
        {
            return Ok(Arc::clone(network));
        }
        let (number, episode) = self.participant.instance().numbered_episode()?;
        let network = Cache::from_environment().network(&episode.map, &episode.open_drive)?;
        let network = Arc::new(network);
        *known = Some((number, Arc::clone(&network)));
        Ok(network)
    }

    /// The town of the world that is running, read from the cache or furnished once for each.
    pub(crate) fn static_world(&self) -> Result<Arc<StaticWorld>, ClientError> {
        let mut known = lock(&self.static_world);
        let standing = self.episode();
        if let Some((number, world)) = &*known
            && *number == standing
        {
            return Ok(Arc::clone(world));
        }
        let network = self.network()?;
        let (number, episode) = self.participant.instance().numbered_episode()?;
        let cache = Cache::from_environment();
        let town = cache.town_around(&network, &episode.open_drive, episode.seed);
        let world = Arc::new(StaticWorld::new(town));
        *known = Some((number, Arc::clone(&world)));
        Ok(world)
    }

    /// Whether the host has ended or is about to, even if that was not noticed yet.
    pub(crate) fn has_host_ended(&self) -> bool {
        self.participant.is_over() || !self.host.as_ref().is_some_and(process::is_running)
    }

    pub(crate) fn host_ended(&self) -> ClientError {
        ClientError::HostEnded { last: self.frame() }
    }

    /// Why a wait of `waited` for `what` failed.
    pub(crate) fn interrupted(
        &self,
        why: Interrupted,
        what: &str,
        waited: Duration,
    ) -> ClientError {
        match why {
            Interrupted::HostEnds => self.host_ended(),
            Interrupted::Deadline => ClientError::Timeout { what: what.to_owned(), waited },
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        fault::point(Role::Client, "leaving", self.frame(), self.first);
        let slot = self.participant.slot();
        self.participant.control().pass_tick(Some(slot), None);
    }
}

impl std::fmt::Debug for Connection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Connection")
            .field("instance", &self.participant.instance().id())
            .field("name", &self.name)
            .field("frame", &self.frame())
            .finish_non_exhaustive()
    }
}

/// A name that no other participant has: outcomes are found by the client's name, so a second
/// client of the same name gets a number.
fn unique(instance: &Instance, wanted: &str) -> Result<Name, ClientError> {
    let control = instance.control()?;
    let is_taken = |name: Name| {
        let mut slots = control.slots().iter();
        slots.any(|s| s.state() != bus::SlotState::Free && s.name() == name)
    };
    let mut name = Name::new(wanted);
    let mut number = 2;
    while is_taken(name) {
        name = Name::new(&format!("{wanted:.24}-{number}"));
        number += 1;
    }
    Ok(name)
}
