//! Calls over TCP: a thread for each connection, its calls carried out in their order.

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

use client_lib::{Strategy, clock};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::msgpack::{Budget, DecodeError, Pack, Value, read};

/// Connections at a time; one more is closed at once.
const CONNECTIONS_MAX: usize = 1024;
/// Values that one request may keep: a batch of some ten thousand commands.
const VALUES_MAX: usize = 1 << 21;
/// Bytes of text that one request may keep: an OpenDRIVE map.
const BYTES_MAX: usize = 256 << 20;
/// Answers that are put off while more requests lie ready.
const ANSWERS_MAX: usize = 64 << 10;
/// A caller is looked out for as much longer than one of our own.
const WAKINGS: u64 = 4;
/// A client that takes nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(30);

/// Who calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Peer {
    /// Counts connections.
    pub(crate) number: u64,
    /// Where it is.
    pub(crate) address: SocketAddr,
    /// Under which address of ours it found us.
    pub(crate) local: SocketAddr,
}

/// What can be called.
pub(crate) trait Callee: Send + Sync + 'static {
    /// Carries out a call and writes the error and the result, one of them nil.
    fn call(&self, peer: &Peer, method: &str, params: &[Value], out: &mut Pack);

    /// This caller has hung up.
    fn hung_up(&self, _peer: &Peer) {}
}

/// Answers calls on this port until the process ends. Who has got an answer is waited for as
/// `strategy` says; it has threads of its own to wake before it calls again.
pub(crate) fn serve<C: Callee>(
    listener: TcpListener,
    name: &'static str,
    strategy: Strategy,
    callee: Arc<C>,
) -> io::Result<()> {
    let look_nanos = WAKINGS * strategy.spin_nanos;
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
            let (callee, inner) = (Arc::clone(&callee), Arc::clone(&count));
            let converse = move || {
                if let Err(e) = converse(&stream, &peer, look_nanos, &*callee) {
                    ::log::warn!("{name}: {} is cut off: {e}", peer.address);
                }
                callee.hung_up(&peer);
                inner.fetch_sub(1, Ordering::Relaxed);
            };
            let spawned = thread::Builder::new()
                .name(format!("{name}-{number}"))
                .stack_size(1 << 20)
                .spawn(converse);
            if spawned.is_err() {
                count.fetch_sub(1, Ordering::Relaxed);
            }
        }
    };
    thread::Builder::new().name(name.into()).spawn(work).map(drop)
}

/// A connection that is looked at for a while before its reader sleeps: who calls in a loop calls
/// again soon, and to be woken costs more than a call.
struct Eager<'a> {
    stream: &'a TcpStream,
    look_nanos: u64,
}

impl Read for Eager<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let begun = clock::now_nanos();
        while clock::now_nanos() - begun < self.look_nanos {
            let mut fds = [PollFd::new(self.stream, PollFlags::IN)];
            if poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }))? > 0 {
                break;
            }
            thread::yield_now();
        }
        self.stream.read(buffer)
    }
}

/// Answers one caller until it hangs up.
fn converse(
    stream: &TcpStream,
    peer: &Peer,
    look_nanos: u64,
    callee: &dyn Callee,
) -> Result<(), DecodeError> {
    let set = || {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(PATIENCE))
    };
    set().map_err(DecodeError::Io)?;
    let mut input = BufReader::with_capacity(64 << 10, Eager { stream, look_nanos });
    let mut answers = Pack::new();
    loop {
        let request = match next(&mut input) {
            Err(DecodeError::Ended) => return Ok(()),
            Err(DecodeError::Io(e)) if e.kind() == io::ErrorKind::ConnectionReset => return Ok(()),
            other => other?,
        };
        answer(&request, peer, callee, &mut answers);
        if input.buffer().is_empty() || answers.bytes().len() > ANSWERS_MAX {
            let mut output = stream;
            // Who does not take its answers is not served further.
            if output.write_all(answers.bytes()).is_err() {
                return Ok(());
            }
            answers.truncate(0);
        }
    }
}

/// One request, and whether all of it was kept.
fn next(input: &mut impl Read) -> Result<(Value, bool), DecodeError> {
    let mut budget = Budget::new(VALUES_MAX, BYTES_MAX);
    let value = read(input, &mut budget)?;
    Ok((value, budget.is_exceeded))
}

fn answer(
    (request, is_exceeded): &(Value, bool),
    peer: &Peer,
    callee: &dyn Callee,
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
        out.text("the request is larger than this server takes").nil();
        return;
    }
    callee.call(peer, method, params, out);
}
