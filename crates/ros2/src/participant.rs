//! A participant of DDS: it announces its topics, finds those of others, and sends and receives
//! samples. Its topics are fixed when it is opened.

use std::{
    collections::BTreeMap,
    net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use crate::{
    discovery::{self, EndpointData, ParticipantData, Quality},
    error::Ros2Error,
    guid::{EntityId, Guid, GuidPrefix},
    reader::Reader,
    sockets::Sockets,
    submessage::{self, Datagram, Submessage},
    writer::{Sample, Writer},
};

/// How long others keep this participant after its last announcement: a killed process is
/// forgotten then.
const LEASE: Duration = Duration::from_secs(10);
/// Time between two announcements.
const ANNOUNCE_EVERY: Duration = Duration::from_secs(1);
/// Time between two requests for acknowledgement, after which a lost sample is sent again.
const ASK_EVERY: Duration = Duration::from_millis(10);
/// Participants that are followed, at most.
const REMOTES_MAX: usize = 1024;
/// The announcement of this participant is its only sample.
const ANNOUNCEMENT: u64 = 1;

/// A topic that a participant writes or reads.
#[derive(Clone, Debug)]
pub(crate) struct Topic {
    /// As ROS names it, with the slash.
    pub(crate) name: String,
    /// As ROS names it: `sensor_msgs/msg/Image`.
    pub(crate) message: &'static str,
    pub(crate) quality: Quality,
    /// Samples that are kept for readers that lack them.
    pub(crate) depth: usize,
}

impl Topic {
    /// Returns the endpoint, with the names that ROS gives topics and types in DDS.
    fn endpoint(&self, guid: Guid) -> EndpointData {
        let (package, message) = self.message.split_once("/msg/").unwrap_or(("", self.message));
        EndpointData {
            guid,
            topic: format!("rt{}", self.name),
            type_name: format!("{package}::msg::dds_::{message}_"),
            quality: self.quality,
            addresses: Vec::new(),
        }
    }
}

/// What a subscription does with each message: CDR with its encapsulation.
pub(crate) type Deliver = Box<dyn FnMut(&[u8]) + Send>;

/// A participant; dropped, it takes its leave.
pub(crate) struct Participant {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

struct Shared {
    own: ParticipantData,
    sockets: Sockets,
    is_network: bool,
    state: Mutex<State>,
    is_ended: AtomicBool,
}

struct State {
    remotes: BTreeMap<GuidPrefix, Remote>,
    /// The writers of discovery: of publications and of subscriptions.
    discovery_writers: [Writer; 2],
    /// The readers of discovery: of publications and of subscriptions.
    discovery_readers: [Reader; 2],
    writers: Vec<Writer>,
    readers: Vec<(Reader, Deliver)>,
}

/// Another participant.
struct Remote {
    lease: Duration,
    heard: Instant,
    discovery_address: SocketAddrV4,
    data_address: SocketAddrV4,
    /// Whether it is on this machine.
    is_local: bool,
}

impl Participant {
    /// Opens a participant in a domain.
    ///
    /// # Errors
    ///
    /// [`Ros2Error::Network`] if its ports cannot be opened.
    pub(crate) fn open(
        name: &str,
        domain: u16,
        is_network: bool,
        publications: &[Topic],
        subscriptions: Vec<(Topic, Deliver)>,
    ) -> Result<Participant, Ros2Error> {
        let network = |source| Ros2Error::Network { domain, source };
        let sockets = Sockets::open(domain, is_network).map_err(network)?;
        let addresses = sockets.own_addresses(is_network);
        let prefix = prefix();
        let own = ParticipantData {
            prefix,
            name: name.to_owned(),
            lease: LEASE,
            discovery_addresses: addresses.clone(),
            data_addresses: addresses,
        };
        let state = Mutex::new(State::new(prefix, publications, subscriptions));
        let is_ended = AtomicBool::new(false);
        let shared = Arc::new(Shared { own, sockets, is_network, state, is_ended });
        let mut participant = Participant { shared, threads: Vec::new() };
        for (name, work) in [
            ("dds-receive", Shared::receive_own as fn(&Shared)),
            ("dds-group", Shared::receive_group),
            ("dds-timer", Shared::keep_time),
        ] {
            let shared = Arc::clone(&participant.shared);
            let thread = std::thread::Builder::new().name(name.to_owned());
            let thread = thread.spawn(move || work(&shared)).map_err(network)?;
            participant.threads.push(thread);
        }
        Ok(participant)
    }

    /// Returns whether a publication has subscribers.
    pub(crate) fn has_subscribers(&self, publication: usize) -> bool {
        self.shared.state().writers[publication].has_readers()
    }

    /// Publishes a message. It waits for no subscriber.
    pub(crate) fn publish(&self, publication: usize, message: Vec<u8>) {
        let departure = self.shared.state().writers[publication].add(Sample::new(message));
        departure.send(&|to, datagram| self.shared.send(to, datagram));
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        self.shared.is_ended.store(true, Ordering::Release);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            let _ = thread.join();
        }
        self.shared.leave();
    }
}

impl State {
    fn new(
        prefix: GuidPrefix,
        publications: &[Topic],
        subscriptions: Vec<(Topic, Deliver)>,
    ) -> State {
        let kept = Quality { is_reliable: true, is_kept: true };
        let endpoint = |entity| EndpointData {
            guid: Guid { prefix, entity },
            topic: String::new(),
            type_name: String::new(),
            quality: kept,
            addresses: Vec::new(),
        };
        let mut state = State {
            remotes: BTreeMap::new(),
            discovery_writers: [EntityId::PUBLICATION_WRITER, EntityId::SUBSCRIPTION_WRITER]
                .map(|entity| Writer::new(endpoint(entity), usize::MAX)),
            discovery_readers: [EntityId::PUBLICATION_READER, EntityId::SUBSCRIPTION_READER]
                .map(|entity| Reader::new(endpoint(entity))),
            writers: Vec::new(),
            readers: Vec::new(),
        };
        for (number, topic) in (1..).zip(publications) {
            let endpoint = topic.endpoint(Guid { prefix, entity: EntityId::user_writer(number) });
            state.discovery_writers[0].add(Sample::new(endpoint.write()));
            state.writers.push(Writer::new(endpoint, topic.depth));
        }
        for (number, (topic, deliver)) in (1..).zip(subscriptions) {
            let endpoint = topic.endpoint(Guid { prefix, entity: EntityId::user_reader(number) });
            state.discovery_writers[1].add(Sample::new(endpoint.write()));
            state.readers.push((Reader::new(endpoint), deliver));
        }
        state
    }

    fn writer(&mut self, entity: EntityId) -> Option<&mut Writer> {
        let mut all = self.discovery_writers.iter_mut().chain(&mut self.writers);
        all.find(|writer| writer.data.guid.entity == entity)
    }

    /// The readers that a submessage is for: one, or all.
    fn readers(&mut self, entity: EntityId) -> impl Iterator<Item = &mut Reader> {
        let all = self.discovery_readers.iter_mut();
        let all = all.chain(self.readers.iter_mut().map(|(reader, _)| reader));
        all.filter(move |reader| entity == EntityId::UNKNOWN || reader.data.guid.entity == entity)
    }

    /// Forgets endpoints of others.
    fn forget(&mut self, is_gone: impl Fn(&Guid) -> bool + Copy) {
        let writers = self.discovery_writers.iter_mut().chain(&mut self.writers);
        writers.for_each(|writer| writer.forget(is_gone));
        self.readers(EntityId::UNKNOWN).for_each(|reader| reader.forget(is_gone));
    }
}

impl Shared {
    /// Nothing that a panic could leave half done is kept under this lock.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a datagram. One that is lost is requested again, or is not wanted any more.
    fn send(&self, to: SocketAddrV4, datagram: &[u8]) {
        let _ = self.sockets.unicast.send_to(datagram, to);
    }

    fn receive_own(&self) {
        self.receive(&self.sockets.unicast);
    }

    fn receive_group(&self) {
        self.receive(&self.sockets.group);
    }

    fn receive(&self, socket: &UdpSocket) {
        let mut datagram = vec![0; 1 << 16];
        while !self.is_ended.load(Ordering::Acquire) {
            // A timeout is no error: then it is time to look whether the end has come.
            let Ok((len, SocketAddr::V4(from))) = socket.recv_from(&mut datagram) else { continue };
            if !self.is_network && !self.sockets.is_local(from.ip()) {
                continue;
            }
            let own = self.own.prefix;
            let _ = submessage::read(&datagram[..len], &own, |sender, submessage| {
                if *sender != own {
                    self.take(sender, *from.ip(), submessage);
                }
            });
        }
    }

    /// Announces this participant, forgets others that are silent, and asks readers what they lack.
    fn keep_time(&self) {
        let mut announced: Option<Instant> = None;
        while !self.is_ended.load(Ordering::Acquire) {
            if announced.is_none_or(|last| last.elapsed() >= ANNOUNCE_EVERY) {
                announced = Some(Instant::now());
                self.sockets.announce(self.announcement(None).bytes());
                self.forget_silent();
            }
            let mut state = self.state();
            let State { discovery_writers, writers, .. } = &mut *state;
            for writer in discovery_writers.iter_mut().chain(writers) {
                writer.ask(&|to, datagram| self.send(to, datagram));
            }
            drop(state);
            std::thread::park_timeout(ASK_EVERY);
        }
    }

    fn announcement(&self, receiver: Option<&GuidPrefix>) -> Datagram {
        let mut datagram = Datagram::new(&self.own.prefix, receiver);
        datagram.data(EntityId::PARTICIPANT_WRITER, ANNOUNCEMENT, &self.own.write());
        datagram
    }

    fn leave(&self) {
        let mut datagram = Datagram::new(&self.own.prefix, None);
        datagram.gone(EntityId::PARTICIPANT_WRITER, ANNOUNCEMENT + 1, &self.own.key());
        self.sockets.announce(datagram.bytes());
        for remote in self.state().remotes.values() {
            self.send(remote.discovery_address, datagram.bytes());
        }
    }

    fn forget_silent(&self) {
        let mut state = self.state();
        let is_silent = |remote: &Remote| remote.heard.elapsed() > remote.lease;
        let silent = state.remotes.iter().filter(|(_, remote)| is_silent(remote));
        let silent: Vec<GuidPrefix> = silent.map(|(prefix, _)| *prefix).collect();
        for prefix in silent {
            state.remotes.remove(&prefix);
            state.forget(|guid| guid.prefix == prefix);
        }
    }

    /// Acts on one submessage of another participant.
    fn take(&self, sender: &GuidPrefix, from: Ipv4Addr, submessage: Submessage<'_>) {
        let send = |to, datagram: &[u8]| self.send(to, datagram);
        let of = |entity| Guid { prefix: *sender, entity };
        match submessage {
            Submessage::Data { writer, is_gone, payload, .. }
                if writer == EntityId::PARTICIPANT_WRITER =>
            {
                self.take_participant(sender, from, is_gone, payload);
            }
            Submessage::Data { reader, writer, number, is_gone, payload } => {
                self.take_data(reader, of(writer), number, is_gone, payload);
            }
            Submessage::Heartbeat { reader, writer, first, last, is_final } => {
                for reader in self.state().readers(reader) {
                    let answer = reader.answer(&of(writer), [first, last], is_final);
                    if let Some((to, datagram)) = answer {
                        self.send(to, datagram.bytes());
                    }
                }
            }
            Submessage::Gap { writer, first, missing } => {
                for reader in self.state().readers(EntityId::UNKNOWN) {
                    reader.skip(&of(writer), first, &missing);
                }
            }
            Submessage::Acknowledge { reader, writer, missing } => {
                if let Some(writer) = self.state().writer(writer) {
                    writer.acknowledge(&of(reader), &missing, &send);
                }
            }
            Submessage::RequestFragments { reader, writer, number, missing } => {
                if let Some(writer) = self.state().writer(writer) {
                    writer.send_fragments(&of(reader), number, &missing, &send);
                }
            }
        }
    }

    fn take_participant(&self, sender: &GuidPrefix, from: Ipv4Addr, is_gone: bool, data: &[u8]) {
        let mut state = self.state();
        if is_gone {
            if let Some(guid) = discovery::withdrawn(data)
                && guid.prefix == *sender
                && state.remotes.remove(sender).is_some()
            {
                state.forget(|guid| guid.prefix == *sender);
            }
            return;
        }
        let Some(data) = ParticipantData::read(data).filter(|data| data.prefix == *sender) else {
            return;
        };
        if let Some(remote) = state.remotes.get_mut(sender) {
            remote.heard = Instant::now();
            return;
        }
        let is_local = self.sockets.is_local(&from);
        let address = |addresses: &[SocketAddrV4]| self.reachable(addresses, is_local);
        let (Some(discovery_address), Some(data_address)) =
            (address(&data.discovery_addresses), address(&data.data_addresses))
        else {
            return;
        };
        if state.remotes.len() == REMOTES_MAX {
            return;
        }
        log::debug!("participant {:?} at {discovery_address}", data.name);
        let (lease, heard) = (data.lease, Instant::now());
        let remote = Remote { lease, heard, discovery_address, data_address, is_local };
        state.remotes.insert(*sender, remote);
        // It may not hear the group.
        self.send(discovery_address, self.announcement(Some(sender)).bytes());
        let of = |entity| Guid { prefix: *sender, entity };
        let kept = Quality { is_reliable: true, is_kept: true };
        let State { discovery_writers, discovery_readers, .. } = &mut *state;
        let readers = [EntityId::PUBLICATION_READER, EntityId::SUBSCRIPTION_READER];
        for (writer, reader) in discovery_writers.iter_mut().zip(readers) {
            let send = |to, datagram: &[u8]| self.send(to, datagram);
            writer.match_reader(of(reader), discovery_address, kept, &send);
        }
        let writers = [EntityId::PUBLICATION_WRITER, EntityId::SUBSCRIPTION_WRITER];
        for (reader, writer) in discovery_readers.iter_mut().zip(writers) {
            reader.match_writer(of(writer), discovery_address, kept);
        }
    }

    /// Returns the first address at which a participant can be reached from here.
    fn reachable(&self, addresses: &[SocketAddrV4], is_local: bool) -> Option<SocketAddrV4> {
        let can_reach = |address: &&SocketAddrV4| {
            if is_local { self.sockets.is_local(address.ip()) } else { !address.ip().is_loopback() }
        };
        addresses.iter().find(can_reach).copied()
    }

    fn take_data(
        &self,
        reader: EntityId,
        writer: Guid,
        number: u64,
        is_gone: bool,
        payload: &[u8],
    ) {
        let mut state = self.state();
        let discovered = match writer.entity {
            EntityId::PUBLICATION_WRITER => Some(0),
            EntityId::SUBSCRIPTION_WRITER => Some(1),
            _ => None,
        };
        if let Some(kind) = discovered {
            if state.discovery_readers[kind].take(&writer, number) {
                self.take_endpoint(&mut state, kind, &writer.prefix, is_gone, payload);
            }
            return;
        }
        for (own, deliver) in &mut state.readers {
            let is_meant = reader == EntityId::UNKNOWN || reader == own.data.guid.entity;
            if is_meant && own.take(&writer, number) && !is_gone {
                deliver(payload);
            }
        }
    }

    /// Takes in a writer (`kind` 0) or a reader (`kind` 1) of another participant.
    fn take_endpoint(
        &self,
        state: &mut State,
        kind: usize,
        sender: &GuidPrefix,
        is_gone: bool,
        payload: &[u8],
    ) {
        if is_gone {
            if let Some(gone) = discovery::withdrawn(payload).filter(|g| g.prefix == *sender) {
                state.forget(|guid| *guid == gone);
            }
            return;
        }
        let Some(endpoint) = EndpointData::read(payload).filter(|e| e.guid.prefix == *sender)
        else {
            return;
        };
        let Some(remote) = state.remotes.get(sender) else { return };
        let own_address = self.reachable(&endpoint.addresses, remote.is_local);
        let address = own_address.unwrap_or(remote.data_address);
        let is_same =
            |own: &EndpointData| own.topic == endpoint.topic && own.type_name == endpoint.type_name;
        if kind == 0 {
            let readers = state.readers.iter_mut().map(|(reader, _)| reader);
            for reader in readers.filter(|reader| is_same(&reader.data)) {
                reader.match_writer(endpoint.guid, address, endpoint.quality);
            }
            return;
        }
        for writer in state.writers.iter_mut().filter(|writer| is_same(&writer.data)) {
            let send = |to, datagram: &[u8]| self.send(to, datagram);
            if !writer.match_reader(endpoint.guid, address, endpoint.quality, &send) {
                let topic = &endpoint.topic;
                log::warn!("a subscriber of {topic} requests durability, which it does not have");
            }
        }
    }
}

/// Returns a name for a participant that no other one has: vendor, process and time.
fn prefix() -> GuidPrefix {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let mut prefix = [0; 12];
    prefix[..2].copy_from_slice(&submessage::VENDOR);
    prefix[2..6].copy_from_slice(&std::process::id().to_be_bytes());
    prefix[6..].copy_from_slice(&(now.as_nanos() as u64).to_be_bytes()[2..]);
    prefix
}
