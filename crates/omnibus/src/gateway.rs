//! The CARLA server beside a host: a process of its own that is restarted when it dies.

use std::{
    net::{IpAddr, Ipv4Addr},
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
use carla_gateway::{CarlaServer, CarlaServerConfig};
use client_lib::Client;

/// The name of the role in `omnibus role`.
pub(crate) const ROLE: &str = "gateway";

/// Exit code of a server that cannot listen; a restart would fail too.
const EXIT_CANNOT_LISTEN: i32 = 3;
/// A server that ran at least this long is restarted without delay.
const STABLE_AFTER: Duration = Duration::from_secs(5);

/// The address at which CARLA clients reach the simulator.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CarlaServerArgs {
    /// The port for CARLA clients; streams use the next port. 0: any free ports
    #[arg(long, default_value_t = 2000)]
    carla_port: u16,
    /// Do not start the CARLA server
    #[arg(long)]
    no_carla: bool,
    /// The address to listen on; CARLA's protocol has no authentication
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
}

impl CarlaServerArgs {
    fn config(&self) -> CarlaServerConfig {
        CarlaServerConfig { port: self.carla_port, listen: self.listen }
    }
}

/// Runs the process of the CARLA server until its host ends.
pub(crate) fn run_process(args: &CarlaServerArgs, instance: &str) -> anyhow::Result<()> {
    // The host exists before this process, so an error here concerns the ports.
    let server = match CarlaServer::open(&args.config()) {
        Ok(server) => server,
        Err(e) => {
            log::warn!("{e}");
            std::process::exit(EXIT_CANNOT_LISTEN);
        }
    };
    server.serve(Client::connect(Some(instance), ROLE)?)?;
    Ok(())
}

/// Keeps the CARLA server running.
pub(crate) struct GatewaySupervisor {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl GatewaySupervisor {
    /// Starts the server, unless `--no-carla` is given.
    pub(crate) fn start(
        args: &CarlaServerArgs,
        instance: &Instance,
        in_process: bool,
    ) -> anyhow::Result<GatewaySupervisor> {
        let stop = Arc::new(AtomicBool::new(false));
        if args.no_carla {
            return Ok(GatewaySupervisor { stop, thread: None });
        }
        let (args, instance, stop_flag) = (args.clone(), instance.clone(), Arc::clone(&stop));
        let work = move || {
            let ended = if in_process {
                serve(&args, &instance)
            } else {
                supervise(&args, &instance, &stop_flag)
            };
            if let Err(e) = ended {
                log::warn!("{e:#}");
            }
        };
        let thread = std::thread::Builder::new().name("door".into()).spawn(work)?;
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
fn serve(args: &CarlaServerArgs, instance: &Instance) -> anyhow::Result<()> {
    let server = CarlaServer::open(&args.config())?;
    Ok(server.serve(Client::connect_in_process(instance, ROLE)?)?)
}

/// Runs the server as a process and restarts it when it dies.
fn supervise(args: &CarlaServerArgs, instance: &Instance, stop: &AtomicBool) -> anyhow::Result<()> {
    while !stop.load(Ordering::Acquire) {
        let begun = Instant::now();
        let mut child = spawn(args, instance).context("the CARLA door")?;
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if stop.load(Ordering::Acquire) {
                return stop_child(&mut child);
            }
            std::thread::park_timeout(Duration::from_millis(100));
        };
        if stop.load(Ordering::Acquire)
            || status.success()
            || status.code() == Some(EXIT_CANNOT_LISTEN)
        {
            return Ok(());
        }
        log::warn!("the CARLA door died ({status}); it is opened again");
        if begun.elapsed() < STABLE_AFTER {
            std::thread::park_timeout(Duration::from_secs(1));
        }
    }
    Ok(())
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

fn spawn(args: &CarlaServerArgs, instance: &Instance) -> std::io::Result<Child> {
    use std::os::unix::process::CommandExt;
    Command::new(std::env::current_exe()?)
        .args(["role", ROLE, "--instance", instance.id()])
        .args(["--carla-port", &args.carla_port.to_string()])
        .args(["--listen", &args.listen.to_string()])
        .stdin(Stdio::null())
        // Ctrl-C on the terminal reaches the host alone.
        .process_group(0)
        .spawn()
}
