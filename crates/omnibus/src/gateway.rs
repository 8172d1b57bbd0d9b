//! The CARLA door beside a host: a process of its own, started again when it dies.

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
use carla_gateway::{Door, DoorConfig};
use client_lib::Client;

/// What `omnibus role` calls it.
pub(crate) const ROLE: &str = "gateway";

/// A door that could not be opened would not open the next time either.
const EXIT_CANNOT_LISTEN: i32 = 3;
/// A door that held for so long is opened again at once.
const STABLE_AFTER: Duration = Duration::from_secs(5);

/// Where CARLA's clients find the simulator.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CarlaServerArgs {
    /// Where CARLA's clients connect; streams go through the next port. 0: any free ports
    #[arg(long, default_value_t = 2000)]
    carla_port: u16,
    /// Let no CARLA client in
    #[arg(long)]
    no_carla: bool,
    /// The address to listen on; CARLA's protocol has no authentication
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
}

impl CarlaServerArgs {
    fn config(&self) -> DoorConfig {
        DoorConfig { port: self.carla_port, listen: self.listen }
    }
}

/// The door's process, until its host ends.
pub(crate) fn run_process(args: &CarlaServerArgs, instance: &str) -> anyhow::Result<()> {
    // The host is there before the door, so what is wrong is wrong with the ports.
    let door = match Door::open(&args.config()) {
        Ok(door) => door,
        Err(e) => {
            log::warn!("{e}");
            std::process::exit(EXIT_CANNOT_LISTEN);
        }
    };
    door.serve(Client::connect(Some(instance), ROLE)?)?;
    Ok(())
}

/// Who opens the door again.
pub(crate) struct GatewaySupervisor {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl GatewaySupervisor {
    /// Opens the door, unless nobody is to be let in.
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

    /// After the host: the door ends with it.
    pub(crate) fn end(self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

/// As threads of this process.
fn serve(args: &CarlaServerArgs, instance: &Instance) -> anyhow::Result<()> {
    let door = Door::open(&args.config())?;
    Ok(door.serve(Client::connect_in_process(instance, ROLE)?)?)
}

/// As a process, started again when it dies.
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

/// It sees its host end; who does not is helped.
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
        // A Ctrl-C on the terminal is for the host alone.
        .process_group(0)
        .spawn()
}
