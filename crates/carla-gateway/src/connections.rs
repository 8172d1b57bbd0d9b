//! The open connections of all ports. A port has room for so many; the connection that has been
//! idle longest gives way to a new one.
//!
//! A client that has made a call may be idle as long as it likes while there is room. One that has
//! never made any is the first to give way, and one that waits for the answer to a call never does.

use std::{
    collections::BTreeMap,
    io,
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use client_lib::clock;
use rustix::process::{Resource, getrlimit};

/// Most connections of a port, if the process may open as many files.
const PER_PORT_MAX: usize = 1024;
/// Files that the process opens beside its connections: the bus, its log, maps, recordings.
const OTHER_FILES: usize = 256;
/// Ports share the remaining files, and leave some to the sensors of the bus.
const SHARES: usize = 4;
/// Fewest connections of a port, however few files the process may open.
const PER_PORT_MIN: usize = 16;
/// Most bytes of answers and messages that wait for clients to read them, over all connections.
const UNREAD_MAX: usize = 512 << 20;
/// Time after a failure to accept or to serve a connection.
const RETRY: Duration = Duration::from_millis(10);
/// Time between two lines of the log about the same matter.
const QUIET: Duration = Duration::from_secs(10);

/// An open connection.
pub(crate) struct Connection {
    pub(crate) socket: TcpStream,
    /// Counted from 1, over all ports.
    pub(crate) number: u64,
    pub(crate) address: SocketAddr,
    port: &'static str,
    /// When it was last used; 0: never. Nanoseconds.
    used_nanos: AtomicU64,
    is_in_call: AtomicBool,
    /// Bytes that wait for the client to read them.
    unread: AtomicUsize,
}

impl Connection {
    /// Notes that the client uses the connection now.
    pub(crate) fn note_use(&self) {
        self.used_nanos.store(clock::now_nanos().max(1), Ordering::Relaxed);
    }

    /// Notes that a call begins; the connection does not give way until it ends.
    pub(crate) fn begin_call(&self) {
        self.is_in_call.store(true, Ordering::Relaxed);
    }

    /// Notes that the call has ended.
    pub(crate) fn end_call(&self) {
        self.note_use();
        self.is_in_call.store(false, Ordering::Relaxed);
    }

    fn close(&self) {
        // Its thread then reads the end of the stream; an error means that it is closed already.
        let _ = self.socket.shutdown(Shutdown::Both);
    }
}

/// The open connections of all ports.
pub(crate) struct Connections {
    open: Mutex<BTreeMap<u64, Arc<Connection>>>,
    last: AtomicU64,
    per_port: usize,
    unread: AtomicUsize,
    full: RareLog,
    failed: RareLog,
    slow: RareLog,
}

impl Connections {
    /// Creates the table, with as much room as the limit of open files admits.
    pub(crate) fn new() -> Connections {
        let files = getrlimit(Resource::Nofile).current;
        let files = files.map_or(usize::MAX, |files| files as usize);
        let share = files.saturating_sub(OTHER_FILES) / SHARES;
        Connections::with_room(share.clamp(PER_PORT_MIN, PER_PORT_MAX))
    }

    fn with_room(per_port: usize) -> Connections {
        Connections {
            open: Mutex::default(),
            last: AtomicU64::new(0),
            per_port,
            unread: AtomicUsize::new(0),
            full: RareLog::default(),
            failed: RareLog::default(),
            slow: RareLog::default(),
        }
    }

    /// Accepts connections until the process ends, and serves each one on a thread of its own with
    /// this many bytes of stack.
    pub(crate) fn accept(
        self: &Arc<Connections>,
        listener: TcpListener,
        port: &'static str,
        stack: usize,
        serve: impl Fn(&Arc<Connection>) + Send + Sync + 'static,
    ) -> io::Result<()> {
        let (all, serve) = (Arc::clone(self), Arc::new(serve));
        let work = move || {
            loop {
                let begun = listener.accept().and_then(|(socket, address)| {
                    let Some(connection) = all.add(socket, address, port) else { return Ok(()) };
                    let serve = Arc::clone(&serve);
                    thread::Builder::new()
                        .name(format!("{port}-{}", connection.0.number))
                        .stack_size(stack)
                        .spawn(move || serve(&connection.0))
                        .map(drop)
                });
                // Without descriptors, memory or threads, the system accepts no connection, and
                // reports it at once and again.
                if let Err(e) = begun {
                    all.make_room(port, &e);
                    thread::sleep(RETRY);
                }
            }
        };
        thread::Builder::new().name(port.into()).spawn(work).map(drop)
    }

    /// Adds a connection; `None` if there is no room, and no other one gives way.
    fn add(
        self: &Arc<Connections>,
        socket: TcpStream,
        address: SocketAddr,
        port: &'static str,
    ) -> Option<Open> {
        let mut open = self.lock();
        if open.values().filter(|one| one.port == port).count() >= self.per_port {
            let idlest = idlest(&open, |one| one.port == port);
            let room = self.per_port;
            let Some(idlest) = idlest else {
                self.full.warn(|| {
                    format!("{port}: {address} is refused: all {room} connections are in calls")
                });
                return None;
            };
            self.full.warn(|| {
                format!(
                    "{port}: {room} connections are open; {} has been idle longest and is closed \
                     for a new one",
                    idlest.address
                )
            });
            idlest.close();
            open.remove(&idlest.number);
        }
        let number = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        let connection = Arc::new(Connection {
            socket,
            number,
            address,
            port,
            used_nanos: AtomicU64::new(0),
            is_in_call: AtomicBool::new(false),
            unread: AtomicUsize::new(0),
        });
        open.insert(number, Arc::clone(&connection));
        Some(Open(connection, Arc::clone(self)))
    }

    /// Closes the connection of any port that has been idle longest.
    fn make_room(&self, port: &str, why: &io::Error) {
        let is_transient = matches!(
            why.kind(),
            io::ErrorKind::ConnectionAborted
                | io::ErrorKind::ConnectionReset
                | io::ErrorKind::Interrupted
        );
        if is_transient {
            return;
        }
        let mut open = self.lock();
        let idlest = idlest(&open, |_| true);
        self.failed.warn(|| {
            let closed = idlest.as_ref().map_or_else(String::new, |idlest| {
                format!("; {} has been idle longest and is closed", idlest.address)
            });
            format!("{port}: cannot accept a connection: {why} (see ulimit -n){closed}")
        });
        if let Some(idlest) = idlest {
            idlest.close();
            open.remove(&idlest.number);
        }
    }

    /// Notes how many bytes wait for a client. Beyond [`UNREAD_MAX`] over all connections, those
    /// with the most are closed: each is a client that has requested much and does not read.
    pub(crate) fn set_unread(&self, connection: &Connection, bytes: usize) {
        let before = connection.unread.swap(bytes, Ordering::Relaxed);
        let all = self.unread.fetch_add(bytes.wrapping_sub(before), Ordering::Relaxed);
        if bytes <= before || all.wrapping_add(bytes).wrapping_sub(before) <= UNREAD_MAX {
            return;
        }
        let open = self.lock();
        let Some(slowest) = open.values().max_by_key(|one| one.unread.load(Ordering::Relaxed))
        else {
            return;
        };
        self.slow.warn(|| {
            format!(
                "{}: {} has not read {} MiB and is closed: all connections together have {} MiB \
                 unread",
                slowest.port,
                slowest.address,
                slowest.unread.load(Ordering::Relaxed) >> 20,
                UNREAD_MAX >> 20
            )
        });
        slowest.close();
    }

    /// Returns whether so much waits for clients to read it that no more messages are queued.
    pub(crate) fn is_crowded(&self) -> bool {
        self.unread.load(Ordering::Relaxed) > UNREAD_MAX / 2
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<Connection>>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns the connection that gives way first.
fn idlest(
    open: &BTreeMap<u64, Arc<Connection>>,
    is_meant: impl Fn(&Connection) -> bool,
) -> Option<Arc<Connection>> {
    open.values()
        .filter(|one| is_meant(one) && !one.is_in_call.load(Ordering::Relaxed))
        .min_by_key(|one| (one.used_nanos.load(Ordering::Relaxed), one.number))
        .cloned()
}

/// A connection that is being served. It is removed from the table when this is dropped.
struct Open(Arc<Connection>, Arc<Connections>);

impl Drop for Open {
    fn drop(&mut self) {
        let Open(connection, all) = self;
        all.set_unread(connection, 0);
        all.lock().remove(&connection.number);
    }
}

/// Lines of the log that a client could otherwise write without limit.
#[derive(Default)]
pub(crate) struct RareLog(Mutex<(Option<Instant>, u64)>);

impl RareLog {
    /// Logs a line, unless there was one within the last ten seconds.
    pub(crate) fn warn(&self, line: impl FnOnce() -> String) {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (at, left_out) = &mut *last;
        if at.is_some_and(|at| at.elapsed() < QUIET) {
            *left_out += 1;
            return;
        }
        match std::mem::take(left_out) {
            0 => log::warn!("{}", line()),
            count => log::warn!("{} ({count} such lines were left out)", line()),
        }
        *at = Some(Instant::now());
    }
}

#[cfg(test)]
mod tests;
