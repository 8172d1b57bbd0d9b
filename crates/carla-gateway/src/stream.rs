//! The streaming port: sends the messages of each stream to its listeners.
//!
//! A listener connects, sends the number of its stream, and receives messages until it disconnects.
//! Each listener has its own queue and thread: a slow one loses messages of its own stream only.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    io::{self, Read, Write},
    net::{TcpListener, TcpStream},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Most simultaneous listeners; another one is closed at once.
const LISTENERS_MAX: usize = 1024;
/// Most bytes that wait for one listener, unless a single message is longer.
const BACKLOG_MAX: usize = 64 << 20;
/// Messages up to this length are sent by the publishing thread if no other message waits.
const DIRECT_SEND_MAX: usize = 32 << 10;
/// A listener that accepts no bytes for this long is disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// How long listeners to the state of an old episode receive nothing after a new one has begun. The
/// client that has loaded it closes its old listener, and crashes if that listener receives the new
/// episode.
const EPISODE_MUTE: Duration = Duration::from_secs(2);
/// Most streams of which a message is kept until their client connects.
const LATE_MAX: usize = 64;
/// Time between two checks whether an idle listener is still connected.
const IDLE: Duration = Duration::from_millis(500);

/// The number of the stream of episode states.
pub(crate) const WORLD: u32 = 1;

/// A message that begins with its length, shared by all listeners.
pub(crate) type Message = Arc<Vec<u8>>;

/// All streams and their listeners.
#[derive(Default)]
pub(crate) struct Streams {
    listening: Mutex<Listening>,
    connected: Condvar,
}

#[derive(Default)]
struct Listening {
    by_stream: BTreeMap<u32, Vec<Arc<Session>>>,
    /// Streams that a client has requested and to which it has not connected yet.
    expected: BTreeSet<u32>,
    /// Streams that a client has requested and to which none has connected yet, with the newest
    /// message since: on a loaded machine a client connects later than a tick waits for it.
    late: BTreeMap<u32, Option<Message>>,
    /// The newest state of the world, which a new listener receives at once.
    state: Option<Message>,
}

impl Streams {
    /// Serves listeners on this port until the process ends.
    pub(crate) fn serve(self: &Arc<Streams>, listener: TcpListener) -> io::Result<()> {
        let streams = Arc::clone(self);
        let count = Arc::new(AtomicUsize::new(0));
        let work = move || {
            for socket in listener.incoming().flatten() {
                if count.load(Ordering::Relaxed) >= LISTENERS_MAX {
                    continue;
                }
                count.fetch_add(1, Ordering::Relaxed);
                let (streams, inner) = (Arc::clone(&streams), Arc::clone(&count));
                let serve_listener = move || {
                    // Any error means that the listener is gone.
                    let _ = streams.serve_listener(socket);
                    inner.fetch_sub(1, Ordering::Relaxed);
                };
                let spawned = std::thread::Builder::new()
                    .name("carla-listener".into())
                    .stack_size(256 << 10)
                    .spawn(serve_listener);
                if spawned.is_err() {
                    count.fetch_sub(1, Ordering::Relaxed);
                }
            }
        };
        std::thread::Builder::new().name("carla-streams".into()).spawn(work).map(drop)
    }

    fn serve_listener(&self, mut socket: TcpStream) -> io::Result<()> {
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(WRITE_TIMEOUT))?;
        let mut id = [0; 4];
        socket.read_exact(&mut id)?;
        let stream = u32::from_le_bytes(id);
        socket.set_nonblocking(true)?;
        let session = Arc::new(Session::new(socket));
        {
            let mut listening = self.lock();
            listening.expected.remove(&stream);
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

    /// Mutes the present listeners of the world's stream for a while, because a new episode has
    /// begun.
    pub(crate) fn begin_episode(&self) {
        let mut listening = self.lock();
        listening.state = None;
        listening.late.clear();
        for session in listening.by_stream.get(&WORLD).into_iter().flatten() {
            session.lock().muted = Some((Instant::now() + EPISODE_MUTE, None));
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
        listening.expected.insert(stream);
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
                listening.expected.clear();
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
    socket: TcpStream,
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

impl Queue {
    fn is_full(&self, bytes: usize) -> bool {
        !self.messages.is_empty() && self.bytes + bytes > BACKLOG_MAX
    }
}

impl Session {
    fn new(socket: TcpStream) -> Session {
        Session {
            socket,
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
        let is_full = waiting.is_full(bytes);
        if is_full {
            self.note_loss(&mut waiting);
        }
        !is_full
    }

    fn note_loss(&self, waiting: &mut Queue) {
        waiting.dropped += 1;
        if waiting.dropped == 1 {
            let peer = self.socket.peer_addr().map_or_else(|_| "?".into(), |a| a.to_string());
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
            sent = (&self.socket).write(message).unwrap_or(0);
            if sent == message.len() {
                return;
            }
        }
        if waiting.is_full(message.len()) {
            self.note_loss(&mut waiting);
            return;
        }
        if waiting.messages.is_empty() && !waiting.is_writing {
            waiting.sent = sent;
        }
        waiting.bytes += message.len();
        waiting.messages.push_back(Arc::clone(message));
        drop(waiting);
        self.more.notify_one();
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
                let held = if is_over { waiting.muted.take() } else { None };
                drop(waiting);
                self.check_connected()?;
                if let Some((_, Some(message))) = held {
                    self.send(&message);
                }
                continue;
            };
            let sent = std::mem::take(&mut waiting.sent);
            waiting.is_writing = true;
            drop(waiting);
            self.write(&message[sent..])?;
            let mut waiting = self.lock();
            waiting.bytes -= message.len();
            waiting.is_writing = false;
        }
    }

    fn write(&self, mut bytes: &[u8]) -> io::Result<()> {
        let mut deadline = Instant::now() + WRITE_TIMEOUT;
        while !bytes.is_empty() {
            match (&self.socket).write(bytes) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(len) => {
                    bytes = &bytes[len..];
                    deadline = Instant::now() + WRITE_TIMEOUT;
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    if Instant::now() > deadline {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                    let mut fds = [PollFd::new(&self.socket, PollFlags::OUT)];
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
        match self.socket.peek(&mut [0]) {
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
    use super::*;

    #[test]
    fn a_listener_that_connects_late_receives_the_newest_message() {
        let streams = Arc::new(Streams::default());
        streams.expect(7);
        streams.await_expected(Duration::ZERO);
        for content in [1, 2] {
            assert!(streams.has_room(7, 5));
            streams.publish(7, Arc::new(vec![1, 0, 0, 0, content]));
        }
        assert!(!streams.has_room(8, 5), "no client has requested this stream");
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        streams.serve(listener).unwrap();
        let mut client = TcpStream::connect(address).unwrap();
        client.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
        client.write_all(&7u32.to_le_bytes()).unwrap();
        let mut received = [0; 5];
        client.read_exact(&mut received).unwrap();
        assert_eq!(received, [1, 0, 0, 0, 2]);
    }
}
