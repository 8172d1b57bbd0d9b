//! The streaming port: who listens to which stream, and what is on its way to whom.
//!
//! A listener connects, says the number of its stream, and takes messages until it hangs up. Each
//! has a queue and a thread of its own: who is slow loses messages of its own stream and nothing
//! else.

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

/// Listeners at a time; one more is closed at once.
const LISTENERS_MAX: usize = 1024;
/// Bytes that may wait for one listener, unless a single message is longer.
const BACKLOG_MAX: usize = 64 << 20;
/// Messages up to this length are sent by who has them, if nothing waits before them.
const SHORT: usize = 32 << 10;
/// A listener that takes nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(30);
/// After a new episode has begun, who listened to the old one hears nothing for so long: the client
/// that asked for it takes its old listener down, and crashes if that hears of the new episode.
const CHANGE: Duration = Duration::from_secs(2);
/// How often an idle listener is looked after.
const IDLE: Duration = Duration::from_millis(500);

/// The number of the stream of episode states.
pub(crate) const WORLD: u32 = 1;

/// A message, its length in front: one copy for all listeners.
pub(crate) type Message = Arc<Vec<u8>>;

/// All streams.
#[derive(Default)]
pub(crate) struct Streams {
    listening: Mutex<Listening>,
    come: Condvar,
}

#[derive(Default)]
struct Listening {
    by_stream: BTreeMap<u32, Vec<Arc<Session>>>,
    /// Streams that somebody asked the way to and did not come to yet.
    expected: BTreeSet<u32>,
    /// The newest state of the world: a newcomer gets it at once.
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
                let attend = move || {
                    // However it ends, the listener has gone.
                    let _ = streams.attend(socket);
                    inner.fetch_sub(1, Ordering::Relaxed);
                };
                let spawned = std::thread::Builder::new()
                    .name("carla-listener".into())
                    .stack_size(256 << 10)
                    .spawn(attend);
                if spawned.is_err() {
                    count.fetch_sub(1, Ordering::Relaxed);
                }
            }
        };
        std::thread::Builder::new().name("carla-streams".into()).spawn(work).map(drop)
    }

    fn attend(&self, mut socket: TcpStream) -> io::Result<()> {
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(PATIENCE))?;
        let mut id = [0; 4];
        socket.read_exact(&mut id)?;
        let stream = u32::from_le_bytes(id);
        socket.set_nonblocking(true)?;
        let session = Arc::new(Session::new(socket));
        {
            let mut listening = self.lock();
            listening.expected.remove(&stream);
            listening.by_stream.entry(stream).or_default().push(Arc::clone(&session));
            if stream == WORLD
                && let Some(state) = &listening.state
            {
                session.send(state);
            }
            self.come.notify_all();
        }
        let ended = session.work();
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

    /// Hands a message to everybody who listens to a stream.
    pub(crate) fn publish(&self, stream: u32, message: Message) {
        let mut listening = self.lock();
        if let Some(sessions) = listening.by_stream.get(&stream) {
            sessions.iter().for_each(|session| session.send(&message));
        }
        if stream == WORLD {
            listening.state = Some(message);
        }
    }

    /// A new episode begins: the states that come are not for those who listen now, for a while.
    pub(crate) fn begin_episode(&self) {
        let mut listening = self.lock();
        listening.state = None;
        for session in listening.by_stream.get(&WORLD).into_iter().flatten() {
            session.lock().quiet = Some((Instant::now() + CHANGE, None));
        }
    }

    /// Whether somebody listens to a stream, or is on the way.
    pub(crate) fn is_wanted(&self, stream: u32) -> bool {
        let listening = self.lock();
        listening.by_stream.contains_key(&stream) || listening.expected.contains(&stream)
    }

    /// Whether a message of so many bytes would reach anybody: if not, it need not be made.
    pub(crate) fn has_room(&self, stream: u32, bytes: usize) -> bool {
        let listening = self.lock();
        let sessions = listening.by_stream.get(&stream).into_iter().flatten();
        // Each is asked: who loses a message is told of it.
        sessions.filter(|session| session.has_room(bytes)).count() > 0
    }

    /// Somebody was told the way to a stream.
    pub(crate) fn expect(&self, stream: u32) {
        self.lock().expected.insert(stream);
    }

    /// Waits until everybody has come who was told the way, but not for long: a client subscribes
    /// on a connection of its own, and its next call must not overtake that.
    pub(crate) fn await_expected(&self, at_most: Duration) {
        let deadline = Instant::now() + at_most;
        let mut listening = self.lock();
        while !listening.expected.is_empty() {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                listening.expected.clear();
                return;
            }
            let waited = self.come.wait_timeout(listening, left);
            listening = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Listening> {
        self.listening.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One listener.
struct Session {
    socket: TcpStream,
    waiting: Mutex<Waiting>,
    more: Condvar,
    is_closed: AtomicBool,
}

#[derive(Default)]
struct Waiting {
    messages: VecDeque<Message>,
    /// Bytes of the first message that are already sent.
    sent: usize,
    bytes: usize,
    /// The thread is at the first message.
    is_writing: bool,
    dropped: u64,
    /// Until when nothing is sent, and what is sent then.
    quiet: Option<(Instant, Option<Message>)>,
}

impl Waiting {
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

    fn lock(&self) -> MutexGuard<'_, Waiting> {
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

    fn note_loss(&self, waiting: &mut Waiting) {
        waiting.dropped += 1;
        if waiting.dropped == 1 {
            let peer = self.socket.peer_addr().map_or_else(|_| "?".into(), |a| a.to_string());
            ::log::warn!("listener {peer} is too slow; it loses messages");
        }
    }

    /// Never waits.
    fn send(&self, message: &Message) {
        if self.is_closed.load(Ordering::Relaxed) {
            return;
        }
        let mut waiting = self.lock();
        if let Some((until, newest)) = &mut waiting.quiet {
            if Instant::now() < *until {
                *newest = Some(Arc::clone(message));
                return;
            }
            waiting.quiet = None;
        }
        let mut sent = 0;
        if waiting.messages.is_empty() && !waiting.is_writing && message.len() <= SHORT {
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

    /// Sends what waits, until the listener hangs up.
    fn work(&self) -> io::Result<()> {
        loop {
            let mut waiting = self.lock();
            if waiting.messages.is_empty() {
                let slept = self.more.wait_timeout(waiting, IDLE);
                waiting = slept.unwrap_or_else(PoisonError::into_inner).0;
            }
            let Some(message) = waiting.messages.pop_front() else {
                let is_over = waiting.quiet.as_ref().is_some_and(|(u, _)| Instant::now() >= *u);
                let held = if is_over { waiting.quiet.take() } else { None };
                drop(waiting);
                self.is_there()?;
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
        let mut deadline = Instant::now() + PATIENCE;
        while !bytes.is_empty() {
            match (&self.socket).write(bytes) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(len) => {
                    bytes = &bytes[len..];
                    deadline = Instant::now() + PATIENCE;
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

    /// A listener says nothing after its first word; if there is something to read, it is the end.
    fn is_there(&self) -> io::Result<()> {
        match self.socket.peek(&mut [0]) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(_) => Err(io::ErrorKind::InvalidData.into()),
            Err(e) if e.kind() == io::ErrorKind::WouldBlock => Ok(()),
            Err(e) => Err(e),
        }
    }
}

/// The way to a stream, as the official client reads it: at the address of its RPC host.
pub(crate) fn token(stream: u32, port: u16) -> [u8; 24] {
    let mut token = [0; 24];
    token[..4].copy_from_slice(&stream.to_le_bytes());
    token[4..6].copy_from_slice(&port.to_le_bytes());
    token[6] = 1;
    token
}
