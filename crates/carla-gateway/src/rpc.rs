//! Remote calls over TCP: a thread for each connection, whose calls are executed in order.

use std::{
    io::{self, BufReader, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    sync::{
        Arc,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use client_lib::{Spin, Strategy, prefer_latency};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::msgpack::{Budget, DecodeError, Pack, Value, read};

/// Most simultaneous connections; another one is closed at once.
const CONNECTIONS_MAX: usize = 1024;
/// Most values of one request: a batch of about ten thousand commands.
const VALUES_MAX: usize = 1 << 21;
/// Most bytes of text in one request: an OpenDRIVE map.
const BYTES_MAX: usize = 256 << 20;
/// Most bytes of answers that are collected while more requests wait to be read.
const ANSWERS_MAX: usize = 64 << 10;
/// A connection is polled this many times as long as a participant of the bus, whose clients need
/// not wake other threads first.
const POLL_FACTOR: u64 = 4;
/// A connection that accepts no bytes for this long is closed.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);

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
/// After an answer, the connection is polled as `strategy` says, a few times as long.
pub(crate) fn serve<C: Handler>(
    listener: TcpListener,
    name: &'static str,
    strategy: Strategy,
    handler: Arc<C>,
) -> io::Result<()> {
    let strategy = Strategy { spin_nanos: POLL_FACTOR * strategy.spin_nanos };
    let (count, last) = (Arc::new(AtomicUsize::new(0)), AtomicU64::new(0));
    let work = move || {
        for stream in listener.incoming().flatten() {
            if count.load(Ordering::Relaxed) >= CONNECTIONS_MAX {
                continue;
            }
            let (Ok(address), Ok(local)) = (stream.peer_addr(), stream.local_addr()) else {
                continue;
            };
            let number = last.fetch_add(1, Ordering::Relaxed) + 1;
            let peer = Peer { number, address, local };
            count.fetch_add(1, Ordering::Relaxed);
            let (handler, inner) = (Arc::clone(&handler), Arc::clone(&count));
            let serve_connection = move || {
                prefer_latency(true);
                if let Err(e) = serve_connection(&stream, &peer, strategy, &*handler) {
                    log::warn!("{name}: {} is disconnected: {e}", peer.address);
                }
                handler.on_disconnect(&peer);
                inner.fetch_sub(1, Ordering::Relaxed);
            };
            let spawned = thread::Builder::new()
                .name(format!("{name}-{number}"))
                .stack_size(1 << 20)
                .spawn(serve_connection);
            if spawned.is_err() {
                count.fetch_sub(1, Ordering::Relaxed);
            }
        }
    };
    thread::Builder::new().name(name.into()).spawn(work).map(drop)
}

/// A reader that polls its connection before it sleeps: a client that calls in a loop calls again
/// soon, and waking a thread costs more than a call.
struct SpinningReader<'a> {
    stream: &'a TcpStream,
    strategy: Strategy,
}

impl Read for SpinningReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut spin = Spin::begin(self.strategy);
        while let Some(spinning) = &mut spin {
            let mut fds = [PollFd::new(self.stream, PollFlags::IN)];
            let is_readable = poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }))? > 0;
            if is_readable || !spinning.goes_on() {
                break;
            }
        }
        self.stream.read(buffer)
    }
}

/// Answers the calls of one connection until it is closed.
fn serve_connection(
    stream: &TcpStream,
    peer: &Peer,
    strategy: Strategy,
    handler: &dyn Handler,
) -> Result<(), DecodeError> {
    let set = || {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))
    };
    set().map_err(DecodeError::Io)?;
    let mut input = BufReader::with_capacity(64 << 10, SpinningReader { stream, strategy });
    let mut answers = Pack::new();
    loop {
        let request = match next(&mut input) {
            Err(DecodeError::Ended) => return Ok(()),
            Err(DecodeError::Io(e)) if e.kind() == io::ErrorKind::ConnectionReset => return Ok(()),
            other => other?,
        };
        answer(&request, peer, handler, &mut answers);
        if input.buffer().is_empty() || answers.bytes().len() > ANSWERS_MAX {
            let mut output = stream;
            // A client that does not accept its answers is not served further.
            if output.write_all(answers.bytes()).is_err() {
                return Ok(());
            }
            answers.truncate(0);
        }
    }
}

/// Reads one request, and returns with it whether parts were discarded because it exceeds the
/// limits.
fn next(input: &mut impl Read) -> Result<(Value, bool), DecodeError> {
    let mut budget = Budget::new(VALUES_MAX, BYTES_MAX);
    let value = read(input, &mut budget)?;
    Ok((value, budget.is_exceeded))
}

fn answer(
    (request, is_exceeded): &(Value, bool),
    peer: &Peer,
    handler: &dyn Handler,
    out: &mut Pack,
) {
    let Value::List(parts) = request else { return };
    // A notification has no id and no answer; CARLA's clients never send one.
    let [Value::Int(0), Value::Int(id), Value::Text(method), Value::List(params)] = &parts[..]
    else {
        return;
    };
    out.list(4).uint(1).uint(*id as u64);
    if *is_exceeded {
        out.text("request too large: the limits are 2097152 values and 256 MiB of text").nil();
        return;
    }
    handler.call(peer, method, params, out);
}
