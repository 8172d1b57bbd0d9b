//! The peers: the same exchanges over loopback TCP, without Nagle's delay, with blocking reads.

use std::{
    io::{ErrorKind, Read, Write},
    net::{Ipv4Addr, TcpListener, TcpStream},
    process::{Child, Command, Stdio},
    time::Duration,
};

use anyhow::Context;
use client_lib::clock;

/// Size of an empty world's snapshot: its header.
const SNAPSHOT_BYTES: usize = size_of::<client_lib::wire::SnapshotHeader>();
/// Size of an arrival message.
const ARRIVAL_BYTES: usize = 8;

/// Arguments of a peer's process.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    role: Part,
    /// The port where bench, or the peer's host, listens
    #[arg(long)]
    port: u16,
    /// The size of one image, for a sender
    #[arg(long, default_value_t = 0)]
    bytes: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    Host,
    Stage,
    Sender,
}

/// Runs one process until its connection closes.
pub(crate) fn play(args: &Args) -> anyhow::Result<()> {
    let stream = connect(args.port)?;
    let ended = match args.role {
        Part::Host => host(stream),
        Part::Stage => stage(stream),
        Part::Sender => send_images(stream, args.bytes),
    };
    match ended {
        // The other end has closed the connection.
        Err(e)
            if matches!(
                e.kind(),
                ErrorKind::UnexpectedEof | ErrorKind::ConnectionReset | ErrorKind::BrokenPipe
            ) =>
        {
            Ok(())
        }
        ended => Ok(ended?),
    }
}

fn connect(port: u16) -> anyhow::Result<TcpStream> {
    let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).context("loopback TCP")?;
    stream.set_nodelay(true)?;
    Ok(stream)
}

/// Receives a request, sends a snapshot to both stages, receives two arrivals, sends the snapshot.
fn host(mut client: TcpStream) -> std::io::Result<()> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let port = listener.local_addr()?.port();
    let _processes = [
        Spawned::start(&["stage", "--port", &port.to_string()])?,
        Spawned::start(&["stage", "--port", &port.to_string()])?,
    ];
    let mut stages = [listener.accept()?.0, listener.accept()?.0];
    for stage in &stages {
        stage.set_nodelay(true)?;
    }
    let (mut request, snapshot) = ([0; ARRIVAL_BYTES], [7; SNAPSHOT_BYTES]);
    loop {
        client.read_exact(&mut request)?;
        for stage in &mut stages {
            stage.write_all(&snapshot)?;
        }
        for stage in &mut stages {
            stage.read_exact(&mut request)?;
        }
        client.write_all(&snapshot)?;
    }
}

fn stage(mut host: TcpStream) -> std::io::Result<()> {
    let mut snapshot = [0; SNAPSHOT_BYTES];
    loop {
        host.read_exact(&mut snapshot)?;
        host.write_all(&snapshot[..ARRIVAL_BYTES])?;
    }
}

/// A millisecond after each request: sends the clock, then an image.
fn send_images(mut reader: TcpStream, bytes: usize) -> std::io::Result<()> {
    let mut message = vec![7; ARRIVAL_BYTES + bytes];
    let mut request = [0];
    loop {
        reader.read_exact(&mut request)?;
        std::thread::sleep(Duration::from_millis(1));
        message[..ARRIVAL_BYTES].copy_from_slice(&clock::now_nanos().to_le_bytes());
        reader.write_all(&message)?;
    }
}

/// A peer's process, which ends when it is dropped.
struct Spawned(Child);

impl Spawned {
    fn start(args: &[&str]) -> std::io::Result<Spawned> {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("peer").args(args).stdin(Stdio::null()).stdout(Stdio::null());
        Ok(Spawned(command.spawn()?))
    }
}

impl Drop for Spawned {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A connection to a peer's process.
pub(crate) struct Peer {
    stream: TcpStream,
    process: Spawned,
}

impl Peer {
    fn start(role: &str, bytes: usize) -> anyhow::Result<Peer> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).context("loopback TCP")?;
        let port = listener.local_addr()?.port().to_string();
        let process = Spawned::start(&[role, "--port", &port, "--bytes", &bytes.to_string()])?;
        let stream = listener.accept()?.0;
        stream.set_nodelay(true)?;
        Ok(Peer { stream, process })
    }

    /// Starts a host with two stages.
    pub(crate) fn ticking() -> anyhow::Result<Peer> {
        Peer::start("host", 0)
    }

    /// Starts a sender of images of this size.
    pub(crate) fn sending(bytes: usize) -> anyhow::Result<Peer> {
        Peer::start("sender", bytes)
    }

    /// Returns the process.
    pub(crate) fn pid(&self) -> u32 {
        self.process.0.id()
    }

    /// Runs one tick and returns the nanoseconds from request to snapshot.
    pub(crate) fn tick(&mut self) -> anyhow::Result<u64> {
        let mut snapshot = [0; SNAPSHOT_BYTES];
        let begin = clock::now_nanos();
        self.stream.write_all(&[0; ARRIVAL_BYTES])?;
        self.stream.read_exact(&mut snapshot)?;
        Ok(clock::now_nanos() - begin)
    }

    /// Receives one image and returns the nanoseconds from its first byte sent to its last byte
    /// read. With `is_polling` it reads without sleeping.
    pub(crate) fn receive(&mut self, image: &mut [u8], is_polling: bool) -> anyhow::Result<u64> {
        self.stream.set_nonblocking(false)?;
        self.stream.write_all(&[1])?;
        self.stream.set_nonblocking(is_polling)?;
        let mut sent = [0; ARRIVAL_BYTES];
        self.fill(&mut sent)?;
        self.fill(image)?;
        Ok(clock::now_nanos().saturating_sub(u64::from_le_bytes(sent)))
    }

    fn fill(&mut self, mut room: &mut [u8]) -> anyhow::Result<()> {
        while !room.is_empty() {
            match self.stream.read(room) {
                Ok(0) => anyhow::bail!("the peer over loopback TCP has ended"),
                Ok(len) => room = &mut room[len..],
                Err(e) if e.kind() == ErrorKind::WouldBlock => std::thread::yield_now(),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e.into()),
            }
        }
        Ok(())
    }
}
