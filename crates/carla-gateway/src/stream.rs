//! The streaming port: sends the messages of each stream to its listeners.
//!
//! A listener connects, sends the number of its stream, and receives messages until it disconnects.
//! Each listener has its own queue and thread: a slow one loses messages of its own stream only.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    io::{self, Read, Write},
    net::{IpAddr, TcpListener},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    time::{Duration, Instant},
};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::connections::{Connection, Connections};

/// The stack of a listener's thread. Bytes.
const STACK: usize = 256 << 10;
/// Most bytes that wait for one listener, unless a single message is longer.
const BACKLOG_MAX: usize = 64 << 20;
/// Messages up to this length are sent by the publishing thread if no other message waits.
const DIRECT_SEND_MAX: usize = 32 << 10;
/// A listener that accepts no bytes for this long is disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// Longest time that the listeners of a client that loads a world receive nothing.
const MUTE_MAX: Duration = Duration::from_secs(30);
/// Most streams of which a message is kept until their client connects.
const LATE_MAX: usize = 64;
/// Time between two checks whether an idle listener is still connected.
const IDLE: Duration = Duration::from_millis(500);

/// The number of the stream of episode states.
pub(crate) const WORLD: u32 = 1;

/// A message that begins with its length, shared by all listeners.
pub(crate) type Message = Arc<Vec<u8>>;

/// All streams and their listeners.
pub(crate) struct Streams {
    listening: Mutex<Listening>,
    connected: Condvar,
    /// The highest number of a stream.
    last: AtomicU32,
}

impl Default for Streams {
    fn default() -> Streams {
        Streams {
            listening: Mutex::default(),
            connected: Condvar::new(),
            last: AtomicU32::new(WORLD),
        }
    }
}

#[derive(Default)]
struct Listening {
    by_stream: BTreeMap<u32, Vec<Arc<Session>>>,
    /// Streams that a client has requested and to which it has not connected yet.
    expected: BTreeSet<u32>,
    /// Streams for which a tick has waited in vain since a client has connected to them last. No
    /// tick waits for them again: a client could otherwise delay every tick.
    in_vain: BTreeSet<u32>,
    /// Streams that a client has requested and to which none has connected yet, with the newest
    /// message since: on a loaded machine a client connects later than a tick waits for it.
    late: BTreeMap<u32, Option<Message>>,
    /// The newest state of the world, which a new listener receives at once.
    state: Option<Message>,
}

impl Streams {
    /// Serves listeners on this port until the process ends.
    pub(crate) fn serve(
        self: &Arc<Streams>,
        listener: TcpListener,
        connections: &Arc<Connections>,
    ) -> io::Result<()> {
        let (streams, all) = (Arc::clone(self), Arc::clone(connections));
        let work = move |connection: &Arc<Connection>| {
            // Any error means that the listener is gone.
            let _ = streams.serve_listener(connection, &all);
        };
        connections.accept(listener, "carla-streams", STACK, work)
    }

    fn serve_listener(
        &self,
        connection: &Arc<Connection>,
        all: &Arc<Connections>,
    ) -> io::Result<()> {
        let mut socket = &connection.socket;
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(WRITE_TIMEOUT))?;
        let mut id = [0; 4];
        socket.read_exact(&mut id)?;
        let stream = u32::from_le_bytes(id);
        if !(WORLD..=self.last.load(Ordering::Relaxed)).contains(&stream) {
            let peer = connection.address;
            log::debug!("carla-streams: {peer} is disconnected: there is no stream {stream}");
            return Ok(());
        }
        socket.set_nonblocking(true)?;
        connection.note_use();
        let session = Arc::new(Session::new(Arc::clone(connection), Arc::clone(all)));
        {
            let mut listening = self.lock();
            listening.expected.remove(&stream);
            listening.in_vain.remove(&stream);
            if let Some(Some(message)) = listening.late.remove(&stream) {
                session.send(&message);
            }
            listening.by_stream.entry(stream).or_default().push(Arc::clone(&session));
            if stream == WORLD
                && let Some(state) = &listening.state
            {
                session.send(state);
            }
            self.connected.notify_all();
        }
        let ended = session.send_queued();
        session.is_closed.store(true, Ordering::Relaxed);
        let mut listening = self.lock();
        if let Some(sessions) = listening.by_stream.get_mut(&stream) {
            sessions.retain(|s| !Arc::ptr_eq(s, &session));
            if sessions.is_empty() {
                listening.by_stream.remove(&stream);
            }
        }
        ended
    }

    /// Returns the number of a new stream. A number is used once, so that listeners to a stream of
    /// a former map receive nothing.
    pub(crate) fn next_number(&self) -> u32 {
        self.last.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Sends a message to all listeners of a stream.
    pub(crate) fn publish(&self, stream: u32, message: Message) {
        let mut listening = self.lock();
        if let Some(sessions) = listening.by_stream.get(&stream) {
            sessions.iter().for_each(|session| session.send(&message));
        }
        if let Some(kept) = listening.late.get_mut(&stream) {
            *kept = Some(Arc::clone(&message));
        }
        if stream == WORLD {
            listening.state = Some(message);
        }
    }

    /// Begins a new episode. The listeners to the world at the address of the client that loads it
    /// receive nothing until [`end_load`](Self::end_load), 30 seconds at most.
    ///
    /// That client closes its old listener when its call returns, and opens a new one. If the old
    /// listener receives the new episode before, its thread keeps the old subscription; the new one
    /// has the same key and is destroyed while its socket is in use, so that the client crashes.
    pub(crate) fn begin_episode(&self, loader: Option<IpAddr>) {
        let mut listening = self.lock();
        listening.state = None;
        listening.late.clear();
        for session in listening.by_stream.get(&WORLD).into_iter().flatten() {
            if Some(session.connection.address.ip()) == loader {
                session.lock().muted = Some((Instant::now() + MUTE_MAX, None));
            }
        }
    }

    /// Ends the silence of the listeners at the address of a client that has loaded a world: they
    /// receive the newest state.
    pub(crate) fn end_load(&self, loader: IpAddr) {
        let listening = self.lock();
        for session in listening.by_stream.get(&WORLD).into_iter().flatten() {
            if session.connection.address.ip() == loader {
                session.unmute();
            }
        }
    }

    /// Returns whether a stream has a listener or expects one.
    pub(crate) fn is_wanted(&self, stream: u32) -> bool {
        let listening = self.lock();
        listening.by_stream.contains_key(&stream) || listening.expected.contains(&stream)
    }

    /// Returns whether any listener would receive a message of this length. If not, the message
    /// need not be made.
    pub(crate) fn has_room(&self, stream: u32, bytes: usize) -> bool {
        let listening = self.lock();
        let sessions = listening.by_stream.get(&stream).into_iter().flatten();
        // Every listener is tried, so that each one counts its loss.
        let has_room = sessions.filter(|session| session.has_room(bytes)).count() > 0;
        has_room || listening.late.contains_key(&stream)
    }

    /// Expects a listener: a client has requested the stream.
    pub(crate) fn expect(&self, stream: u32) {
        let mut listening = self.lock();
        if !listening.in_vain.contains(&stream) {
            listening.expected.insert(stream);
        }
        if stream != WORLD && !listening.by_stream.contains_key(&stream) {
            listening.late.entry(stream).or_default();
            // The oldest streams have the lowest numbers.
            while listening.late.len() > LATE_MAX {
                listening.late.pop_first();
            }
        }
    }

    /// Waits until all expected listeners have connected, at most for this long: a client
    /// subscribes on another connection, which its next call must not overtake.
    pub(crate) fn await_expected(&self, at_most: Duration) {
        let deadline = Instant::now() + at_most;
        let mut listening = self.lock();
        while !listening.expected.is_empty() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let late = std::mem::take(&mut listening.expected);
                listening.in_vain.extend(late);
                return;
            }
            let waited = self.connected.wait_timeout(listening, left);
            listening = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Listening> {
        self.listening.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A listener.
struct Session {
    connection: Arc<Connection>,
    all: Arc<Connections>,
    waiting: Mutex<Queue>,
    more: Condvar,
    is_closed: AtomicBool,
}

#[derive(Default)]
struct Queue {
    messages: VecDeque<Message>,
    /// Bytes of the first message that are already sent.
    sent: usize,
    bytes: usize,
    /// The thread is sending the first message.
    is_writing: bool,
    dropped: u64,
    /// Until when nothing is sent, and the message to send then.
    muted: Option<(Instant, Option<Message>)>,
}

impl Session {
    fn new(connection: Arc<Connection>, all: Arc<Connections>) -> Session {
        Session {
            connection,
            all,
            waiting: Mutex::default(),
            more: Condvar::new(),
            is_closed: AtomicBool::new(false),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn has_room(&self, bytes: usize) -> bool {
        let mut waiting = self.lock();
        let is_full = self.is_full(&waiting, bytes);
        if is_full {
            self.note_loss(&mut waiting);
        }
        !is_full
    }

    fn is_full(&self, waiting: &Queue, bytes: usize) -> bool {
        let is_long = waiting.bytes + bytes > BACKLOG_MAX || self.all.is_crowded();
        !waiting.messages.is_empty() && is_long
    }

    fn note_loss(&self, waiting: &mut Queue) {
        waiting.dropped += 1;
        if waiting.dropped == 1 {
            let peer = self.connection.address;
            log::warn!("listener {peer} is too slow: messages are dropped");
        }
    }

    /// Queues a message, or sends it at once. Never blocks.
    fn send(&self, message: &Message) {
        if self.is_closed.load(Ordering::Relaxed) {
            return;
        }
        let mut waiting = self.lock();
        if let Some((until, newest)) = &mut waiting.muted {
            if Instant::now() < *until {
                *newest = Some(Arc::clone(message));
                return;
            }
            waiting.muted = None;
        }
        let mut sent = 0;
        if waiting.messages.is_empty() && !waiting.is_writing && message.len() <= DIRECT_SEND_MAX {
            sent = (&self.connection.socket).write(message).unwrap_or(0);
            if sent == message.len() {
                self.connection.note_use();
                return;
            }
        }
        if self.is_full(&waiting, message.len()) {
            self.note_loss(&mut waiting);
            return;
        }
        if waiting.messages.is_empty() && !waiting.is_writing {
            waiting.sent = sent;
        }
        waiting.bytes += message.len();
        self.all.set_unread(&self.connection, waiting.bytes);
        waiting.messages.push_back(Arc::clone(message));
        drop(waiting);
        self.more.notify_one();
    }

    /// Sends the newest message that was held back, and holds back no more.
    fn unmute(&self) {
        let muted = self.lock().muted.take();
        if let Some((_, Some(message))) = muted {
            self.send(&message);
        }
    }

    /// Sends queued messages until the listener disconnects.
    fn send_queued(&self) -> io::Result<()> {
        loop {
            let mut waiting = self.lock();
            if waiting.messages.is_empty() {
                let slept = self.more.wait_timeout(waiting, IDLE);
                waiting = slept.unwrap_or_else(PoisonError::into_inner).0;
            }
            let Some(message) = waiting.messages.pop_front() else {
                let is_over = waiting.muted.as_ref().is_some_and(|(u, _)| Instant::now() >= *u);
                drop(waiting);
                self.check_connected()?;
                if is_over {
                    self.unmute();
                }
                continue;
            };
            let sent = std::mem::take(&mut waiting.sent);
            waiting.is_writing = true;
            drop(waiting);
            self.write(&message[sent..])?;
            let mut waiting = self.lock();
            waiting.bytes -= message.len();
            self.all.set_unread(&self.connection, waiting.bytes);
            waiting.is_writing = false;
        }
    }

    fn write(&self, mut bytes: &[u8]) -> io::Result<()> {
        let mut deadline = Instant::now() + WRITE_TIMEOUT;
        while !bytes.is_empty() {
            match (&self.connection.socket).write(bytes) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(len) => {
                    self.connection.note_use();
                    bytes = &bytes[len..];
                    deadline = Instant::now() + WRITE_TIMEOUT;
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    if Instant::now() > deadline {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                    let mut fds = [PollFd::new(&self.connection.socket, PollFlags::OUT)];
                    let second = Timespec { tv_sec: 1, tv_nsec: 0 };
                    let _ = poll(&mut fds, Some(&second));
                }
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    /// Returns an error if the listener has disconnected. It sends nothing after the number of its
    /// stream, so anything to read is an error too.
    fn check_connected(&self) -> io::Result<()> {
        match self.connection.socket.peek(&mut [0]) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(_) => Err(io::ErrorKind::InvalidData.into()),
            Err(e) if e.kind() == io::ErrorKind::WouldBlock => Ok(()),
            Err(e) => Err(e),
        }
    }
}

/// Returns the token of a stream, with which the official client connects to the address of its
/// server.
pub(crate) fn token(stream: u32, port: u16) -> [u8; 24] {
    let mut token = [0; 24];
    token[..4].copy_from_slice(&stream.to_le_bytes());
    token[4..6].copy_from_slice(&port.to_le_bytes());
    token[6] = 1;
    token
}

#[cfg(test)]
mod tests {
    use std::net::TcpStream;

    use super::*;

    /// Connects to the streaming port and sends these bytes.
    fn listener_to(streams: &Arc<Streams>, bytes: &[u8]) -> TcpStream {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        streams.serve(listener, &Arc::new(Connections::new())).unwrap();
        let mut client = TcpStream::connect(address).unwrap();
        client.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        client.write_all(bytes).unwrap();
        client
    }

    #[test]
    fn a_listener_to_a_stream_that_does_not_exist_is_disconnected() {
        let streams = Arc::new(Streams::default());
        for bytes in [&b"POST"[..], &0u32.to_le_bytes(), &2u32.to_le_bytes()] {
            let mut client = listener_to(&streams, bytes);
            assert_eq!(client.read(&mut [0]).unwrap(), 0, "{bytes:?}");
        }
    }

    /// A listener at another address receives every state.
    #[test]
    fn listeners_of_a_client_that_loads_a_world_receive_nothing_until_it_listens_again() {
        let streams = Arc::new(Streams::default());
        let state = |content| Arc::new(vec![1, 0, 0, 0, content]);
        let next = |client: &mut TcpStream| {
            let mut received = [0; 5];
            client.read_exact(&mut received).unwrap();
            received[4]
        };
        let loader = IpAddr::from([127, 0, 0, 1]);
        for (address, received) in [(loader, 3), ([127, 0, 0, 2].into(), 2)] {
            streams.publish(WORLD, state(1));
            let mut client = listener_to(&streams, &WORLD.to_le_bytes());
            assert_eq!(next(&mut client), 1);
            streams.begin_episode(Some(address));
            streams.publish(WORLD, state(2));
            streams.publish(WORLD, state(3));
            streams.end_load(address);
            assert_eq!(next(&mut client), received);
            streams.publish(WORLD, state(4));
            assert_eq!(next(&mut client), if received == 2 { 3 } else { 4 });
        }
    }

    #[test]
    fn a_stream_is_awaited_in_vain_once_until_a_client_connects() {
        let streams = Arc::new(Streams::default());
        let stream = streams.next_number();
        streams.expect(stream);
        assert!(streams.is_wanted(stream));
        streams.await_expected(Duration::ZERO);
        streams.expect(stream);
        assert!(streams.lock().expected.is_empty());
        streams.publish(stream, Arc::new(vec![0; 4]));
        let mut client = listener_to(&streams, &stream.to_le_bytes());
        client.read_exact(&mut [0; 4]).unwrap();
        streams.expect(stream);
        assert!(streams.lock().expected.contains(&stream));
    }

    #[test]
    fn a_listener_that_connects_late_receives_the_newest_message() {
        let streams = Arc::new(Streams::default());
        let stream = streams.next_number();
        streams.expect(stream);
        streams.await_expected(Duration::ZERO);
        for content in [1, 2] {
            assert!(streams.has_room(stream, 5));
            streams.publish(stream, Arc::new(vec![1, 0, 0, 0, content]));
        }
        assert!(!streams.has_room(stream + 1, 5), "no client has requested this stream");
        let mut client = listener_to(&streams, &stream.to_le_bytes());
        let mut received = [0; 5];
        client.read_exact(&mut received).unwrap();
        assert_eq!(received, [1, 0, 0, 0, 2]);
    }
}
