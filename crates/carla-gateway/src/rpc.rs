//! Remote calls over TCP: a thread for each connection, whose calls are executed in order.

use std::{
    io::{self, BufRead, BufReader, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    sync::Arc,
    time::{Duration, Instant},
};

use client_lib::{Spin, Strategy, prefer_latency};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::{
    connections::{Connection, Connections, RareLog},
    msgpack::{Budget, DecodeError, Pack, Pool, Request, Value, read_request},
};

/// Most values of one request: a batch of 10^5 transforms has 1.3 million.
const VALUES_MAX: usize = 1 << 21;
/// Most bytes of text in one request: an OpenDRIVE map.
const BYTES_MAX: usize = 256 << 20;
/// Most bytes of answers that are collected while more requests wait to be read.
const ANSWERS_MAX: usize = 64 << 10;
/// A connection keeps a buffer of this size for its next answers.
const ANSWERS_KEPT: usize = 1 << 20;
/// A connection is polled this many times as long as a participant of the bus, whose clients need
/// not wake other threads first.
const POLL_FACTOR: u64 = 4;
/// A connection that accepts no bytes for this long is closed.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// A connection that sends no bytes of a request that it has begun for this long is closed.
const STALL_TIMEOUT: Duration = Duration::from_secs(30);
/// A connection whose request takes longer than this to arrive is closed.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(120);
/// The stack of a connection's thread. Bytes.
const STACK: usize = 1 << 20;

/// A connected client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Peer {
    /// The number of the connection, counted from 1.
    pub(crate) number: u64,
    /// The address of the client.
    pub(crate) address: SocketAddr,
    /// The local address to which the client has connected.
    pub(crate) local: SocketAddr,
}

/// A server's calls.
pub(crate) trait Handler: Send + Sync + 'static {
    /// Executes a call and writes the error and the result, one of which is nil.
    fn call(&self, peer: &Peer, method: &str, params: &[Value], out: &mut Pack);

    /// Called when a connection is closed.
    fn on_disconnect(&self, _peer: &Peer) {}
}

/// Answers calls on this port until the process ends.
///
/// After an answer, the connection is polled as `strategy` says, a few times as long. Large requests
/// of all connections share the memory of `pool`.
pub(crate) fn serve<C: Handler>(
    listener: TcpListener,
    name: &'static str,
    (connections, pool): (&Arc<Connections>, &Arc<Pool>),
    strategy: Strategy,
    handler: Arc<C>,
) -> io::Result<()> {
    let strategy = Strategy { spin_nanos: POLL_FACTOR * strategy.spin_nanos };
    let (disconnected, all) = (RareLog::default(), Arc::clone(connections));
    let server = Server {
        strategy,
        pool: Arc::clone(pool),
        connections: Arc::clone(connections),
        large: RareLog::default(),
    };
    let work = move |connection: &Arc<Connection>| {
        let Ok(local) = connection.socket.local_addr() else { return };
        let peer = Peer { number: connection.number, address: connection.address, local };
        prefer_latency(true);
        if let Err(e) = server.serve_connection(connection, &peer, &*handler) {
            disconnected.warn(|| format!("{name}: {} is disconnected: {e}", peer.address));
        }
        handler.on_disconnect(&peer);
    };
    all.accept(listener, name, STACK, work)
}

/// A reader that polls its connection before it sleeps: a client that calls in a loop calls again
/// soon, and waking a thread costs more than a call.
struct SpinningReader<'a> {
    stream: &'a TcpStream,
    strategy: Strategy,
    /// When the request that has begun must be complete.
    deadline: Option<Instant>,
}

impl SpinningReader<'_> {
    /// Returns whether bytes can be read within this time.
    fn is_readable(&self, within: Duration) -> io::Result<bool> {
        let mut fds = [PollFd::new(self.stream, PollFlags::IN)];
        let time =
            Timespec { tv_sec: within.as_secs() as i64, tv_nsec: i64::from(within.subsec_nanos()) };
        Ok(poll(&mut fds, Some(&time))? > 0)
    }
}

impl Read for SpinningReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut spin = Spin::begin(self.strategy);
        while let Some(spinning) = &mut spin {
            if self.is_readable(Duration::ZERO)? || !spinning.goes_on() {
                break;
            }
        }
        if let Some(deadline) = self.deadline {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || !self.is_readable(left.min(STALL_TIMEOUT))? {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "its request does not end"));
            }
        }
        self.stream.read(buffer)
    }
}

struct Server {
    strategy: Strategy,
    pool: Arc<Pool>,
    connections: Arc<Connections>,
    large: RareLog,
}

impl Server {
    /// Answers the calls of one connection until it is closed.
    fn serve_connection(
        &self,
        connection: &Connection,
        peer: &Peer,
        handler: &dyn Handler,
    ) -> Result<(), DecodeError> {
        let stream = &connection.socket;
        let set = || {
            stream.set_nodelay(true)?;
            stream.set_write_timeout(Some(WRITE_TIMEOUT))
        };
        set().map_err(DecodeError::Io)?;
        let reader = SpinningReader { stream, strategy: self.strategy, deadline: None };
        let mut input = BufReader::with_capacity(64 << 10, reader);
        let mut answers = Pack::new();
        loop {
            // A client may be idle as long as it likes, but not within a request.
            match input.fill_buf() {
                Ok([]) => return Ok(()),
                Ok(_) => {}
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) if e.kind() == io::ErrorKind::ConnectionReset => return Ok(()),
                Err(e) => return Err(DecodeError::Io(e)),
            }
            input.get_mut().deadline = Some(Instant::now() + REQUEST_TIMEOUT);
            let mut budget = Budget::of_pool(VALUES_MAX, BYTES_MAX, &self.pool);
            let request = read_request(&mut input, &mut budget);
            input.get_mut().deadline = None;
            if let Ok(request) = &request {
                connection.begin_call();
                answer(request, budget.is_exceeded, peer, handler, &mut answers);
                connection.end_call();
            }
            if budget.is_exceeded {
                // The official package does not show the error of every call.
                self.large.warn(|| format!("a request of {} is too large", peer.address));
            }
            drop(budget);
            let is_last = request.is_err();
            if is_last || input.buffer().is_empty() || answers.bytes().len() > ANSWERS_MAX {
                // A client that does not accept its answers is not served further.
                if !self.send(connection, &answers) {
                    return Ok(());
                }
                answers.truncate(0);
                if answers.capacity() > ANSWERS_KEPT {
                    answers = Pack::new();
                }
            }
            request?;
        }
    }

    /// Sends answers, and returns whether the client has accepted them.
    fn send(&self, connection: &Connection, answers: &Pack) -> bool {
        let mut output = &connection.socket;
        self.connections.set_unread(connection, answers.bytes().len());
        let is_sent = output.write_all(answers.bytes()).is_ok();
        self.connections.set_unread(connection, 0);
        is_sent
    }
}

fn answer(
    request: &Request,
    is_exceeded: bool,
    peer: &Peer,
    handler: &dyn Handler,
    out: &mut Pack,
) {
    // A notification has no answer; CARLA's clients never send one.
    let Some(id) = request.id else { return };
    out.list(4).uint(1).uint(id);
    if is_exceeded {
        out.text(&format!(
            "request too large: {} has more than {VALUES_MAX} values or {} MiB of text, or other \
             requests have taken the memory for large ones; send it in parts",
            request.method,
            BYTES_MAX >> 20
        ));
        out.nil();
        return;
    }
    handler.call(peer, &request.method, &request.params, out);
}
