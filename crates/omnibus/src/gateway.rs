//! The CARLA server beside a host: a process of its own that is restarted when it dies.

use std::{
    io::{self, stdin, stdout},
    net::{IpAddr, Ipv4Addr, TcpListener},
    os::{
        fd::{AsFd, BorrowedFd, OwnedFd},
        unix::process::CommandExt,
    },
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use anyhow::Context;
use bus::Instance;
use carla_gateway::{CarlaPorts, CarlaServer, CarlaServerConfig, CarlaServerError};
use client_lib::Client;
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    io::Errno,
    process::{Pid, PidfdFlags, pidfd_open},
};

/// The name of the role in `omnibus role`.
pub(crate) const ROLE: &str = "gateway";

/// A server that ran at least this long was stable.
const STABLE_AFTER: Duration = Duration::from_secs(1);
/// Deaths in a row of servers that were not stable, from which on the next start is delayed.
const EARLY_DEATHS_MAX: u32 = 3;

/// The address at which CARLA clients reach the simulator.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CarlaServerArgs {
    /// The port for CARLA clients; streams use the next port. 0: any free ports
    #[arg(long, default_value_t = 2000)]
    carla_port: u16,
    /// Do not start the CARLA server
    #[arg(long)]
    no_carla: bool,
    /// The address to listen on; CARLA's protocol has no authentication: whoever reaches the ports
    /// controls the simulator
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
    /// The folder in which CARLA clients record and replay, and no other; default:
    /// omnibus/recordings in $XDG_STATE_HOME, else in ~/.local/state
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
}

impl CarlaServerArgs {
    fn config(&self) -> CarlaServerConfig {
        let absolute = |folder: &PathBuf| std::path::absolute(folder).ok();
        let chosen = self.recordings.as_ref().and_then(absolute);
        CarlaServerConfig {
            port: self.carla_port,
            listen: self.listen,
            recordings: chosen.or_else(carla_gateway::default_recordings_folder),
        }
    }
}

/// Opens the ports for CARLA's clients, unless `--no-carla` is given.
///
/// The host's process keeps them open, so that clients of a server that is restarted do not reach
/// another simulator.
pub(crate) fn open_ports(args: &CarlaServerArgs) -> Result<Option<CarlaPorts>, CarlaServerError> {
    if args.no_carla {
        return Ok(None);
    }
    CarlaPorts::open(&args.config()).map(Some)
}

/// Runs the process of the CARLA server until its host ends. Its standard input and output are the
/// open ports.
pub(crate) fn run_process(args: &CarlaServerArgs, instance: &str) -> anyhow::Result<()> {
    let listener = |fd: BorrowedFd| fd.try_clone_to_owned().map(TcpListener::from);
    let ports =
        CarlaPorts { calls: listener(stdin().as_fd())?, streams: listener(stdout().as_fd())? };
    let server = CarlaServer::new(ports, &args.config())?;
    server.serve(Client::connect(Some(instance), ROLE)?)?;
    Ok(())
}

/// Keeps the CARLA server running.
pub(crate) struct GatewaySupervisor {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl GatewaySupervisor {
    /// Starts the server of these ports, if there are any.
    pub(crate) fn start(
        args: &CarlaServerArgs,
        ports: Option<CarlaPorts>,
        instance: &Instance,
        in_process: bool,
    ) -> anyhow::Result<GatewaySupervisor> {
        let stop = Arc::new(AtomicBool::new(false));
        let Some(ports) = ports else { return Ok(GatewaySupervisor { stop, thread: None }) };
        let (args, instance, stop_flag) = (args.clone(), instance.clone(), Arc::clone(&stop));
        let work = move || {
            let ended = if in_process {
                serve(&args, ports, &instance)
            } else {
                supervise(&args, &ports, &instance, &stop_flag)
            };
            if let Err(e) = ended {
                log::warn!("{e:#}");
            }
        };
        let thread = std::thread::Builder::new().name("gateway".into()).spawn(work)?;
        Ok(GatewaySupervisor { stop, thread: Some(thread) })
    }

    /// Waits for the server's end, which follows the host's.
    pub(crate) fn end(self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

/// Runs the server in threads of this process.
fn serve(args: &CarlaServerArgs, ports: CarlaPorts, instance: &Instance) -> anyhow::Result<()> {
    let server = CarlaServer::new(ports, &args.config())?;
    Ok(server.serve(Client::connect_in_process(instance, ROLE)?)?)
}

/// Runs the server as a process and restarts it when it dies.
fn supervise(
    args: &CarlaServerArgs,
    ports: &CarlaPorts,
    instance: &Instance,
    stop: &AtomicBool,
) -> anyhow::Result<()> {
    let mut early_deaths = 0;
    while !stop.load(Ordering::Acquire) {
        let begun = Instant::now();
        let mut child = spawn(args, ports, instance).context("the CARLA server")?;
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if stop.load(Ordering::Acquire) {
                return stop_child(&mut child);
            }
            await_end(&child)?;
        };
        if stop.load(Ordering::Acquire) || status.success() {
            return Ok(());
        }
        log::warn!("the CARLA server died ({status}); it is started again");
        early_deaths = if begun.elapsed() < STABLE_AFTER { early_deaths + 1 } else { 0 };
        if early_deaths >= EARLY_DEATHS_MAX {
            std::thread::park_timeout(Duration::from_secs(1));
        }
    }
    Ok(())
}

/// Sleeps until the child ends, for at most 100 ms.
fn await_end(child: &Child) -> io::Result<()> {
    let pid = Pid::from_raw(child.id() as i32).ok_or(io::ErrorKind::InvalidInput)?;
    // The child is not reaped yet, so that the number is still its own.
    let watched = pidfd_open(pid, PidfdFlags::empty())?;
    let timeout = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
    match poll(&mut [PollFd::new(&watched, PollFlags::IN)], Some(&timeout)) {
        Ok(_) | Err(Errno::INTR) => Ok(()),
        Err(e) => Err(e.into()),
    }
}

/// Waits for the child, which ends with its host; kills it after a second.
fn stop_child(child: &mut Child) -> anyhow::Result<()> {
    for _ in 0..100 {
        if child.try_wait()?.is_some() {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill()?;
    child.wait()?;
    Ok(())
}

fn spawn(args: &CarlaServerArgs, ports: &CarlaPorts, instance: &Instance) -> io::Result<Child> {
    let port = |listener: &TcpListener| listener.try_clone().map(|l| Stdio::from(OwnedFd::from(l)));
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["role", ROLE, "--instance", instance.id()]);
    if let Some(folder) = args.config().recordings {
        command.arg("--recordings").arg(folder);
    }
    command
        .args(["--carla-port", &args.carla_port.to_string()])
        .args(["--listen", &args.listen.to_string()])
        .stdin(port(&ports.calls)?)
        .stdout(port(&ports.streams)?)
        // Ctrl-C on the terminal reaches the host alone.
        .process_group(0)
        .spawn()
}
