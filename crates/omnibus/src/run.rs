//! `omnibus run`: a simulator until Ctrl-C. `omnibus collect`: a simulator with one collecting
//! client.

use std::{
    path::PathBuf,
    sync::{Arc, atomic::AtomicBool},
    thread::JoinHandle,
};

use anyhow::Context;
use bus::Instance;
use protocol::{Frame, Settings};
use rustix::process::{Pid, PidfdFlags, Signal, getpid, getppid, kill_process, pidfd_open};
use sim_host::HostError;

use crate::{
    collect as dataset,
    export::{ExportArgs, Format, export},
    gateway::{self, CarlaServerArgs, GatewaySupervisor},
    launch::WorldArgs,
    population::PopulationArgs,
};

/// Arguments of `omnibus run`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    world: WorldArgs,
    /// Wait for a client that ticks
    #[arg(long)]
    synchronous: bool,
    /// Simulated seconds per tick
    #[arg(long, default_value_t = 0.05)]
    fixed_delta: f64,
    /// Asynchronous: simulated seconds per real second; 0 runs as fast as possible
    #[arg(long, default_value_t = 1.0)]
    real_time_factor: f64,
    /// Synchronous: frames that rendering may lag behind, 0 to 3
    #[arg(long, default_value_t = 0)]
    pipeline: u32,
    /// Start without rendering
    #[arg(long)]
    no_rendering: bool,
    /// End, as with SIGTERM, when this process ends: the one that started the simulator
    #[arg(long, value_name = "PID")]
    parent: Option<i32>,
    #[command(flatten)]
    population: PopulationArgs,
    #[command(flatten)]
    carla: CarlaServerArgs,
}

/// Runs a simulator until Ctrl-C or SIGTERM.
pub(crate) fn run(args: &RunArgs) -> anyhow::Result<()> {
    anyhow::ensure!(
        args.pipeline <= protocol::PIPELINE_MAX,
        "--pipeline is {}; use 0 to {}",
        args.pipeline,
        protocol::PIPELINE_MAX
    );
    anyhow::ensure!(
        (0.0..=1000.0).contains(&args.real_time_factor),
        "--real-time-factor is {}; use 0 (as fast as it can) to 1000",
        args.real_time_factor
    );
    let settings = Settings {
        delta_nanos: nanos(args.fixed_delta)?,
        synchronous: args.synchronous.into(),
        pipeline: args.pipeline,
        real_time_permille: (args.real_time_factor * 1000.0) as u32,
        no_rendering: args.no_rendering.into(),
        ..Settings::default()
    };
    let weather = args.population.weather()?;
    let departures = args.population.departures(&args.world)?;
    let stop = stop_on_signals()?;
    if let Some(parent) = args.parent {
        end_with(parent)?;
    }
    // First, since a map may take long to load.
    let ports = gateway::open_ports(&args.carla)?;
    let host = match args.world.host(settings, Arc::clone(&stop)) {
        Err(why) if matches!(why.downcast_ref(), Some(HostError::Stopped)) => {
            print_line!("{why}");
            return Ok(());
        }
        host => host?,
    };
    let in_process = args.world.single_process;
    let gateway = GatewaySupervisor::start(&args.carla, ports, host.instance(), in_process)?;
    let seed = args.world.seed();
    let id = host.instance().id().to_owned();
    let announce = move || print_line!("simulator {id:?} runs");
    let population =
        args.population.start(host.instance(), in_process, seed, weather, departures, announce)?;
    let ended = host.run();
    // Its client ends with the host.
    population.map(JoinHandle::join);
    gateway.end();
    let last = ended?;
    print_line!("ended after {last}");
    Ok(())
}

/// Ends this process as SIGTERM does when its parent ends, however that ends. Unlike the kernel's own
/// signal (PR_SET_PDEATHSIG) it does not depend on the thread that started this process.
fn end_with(parent: i32) -> anyhow::Result<()> {
    let pid = Pid::from_raw(parent).filter(|pid| Some(*pid) == getppid());
    let watched = pid.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
    // Opened before the parent ended, or it is another process of that number.
    let watched = watched.filter(|_| getppid() == pid).with_context(|| {
        format!("--parent {parent}: that process did not start this one, or has ended")
    })?;
    let wait = move || {
        bus::process::wait_for_end(&watched);
        let _ = kill_process(getpid(), Signal::TERM);
    };
    std::thread::Builder::new().name("parent-watch".into()).spawn(wait)?;
    Ok(())
}

/// Arguments of `omnibus collect`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CollectArgs {
    #[command(flatten)]
    world: WorldArgs,
    #[command(flatten)]
    options: dataset::Options,
    /// Write the complete collection also as `omnibus export` does, into a folder of this name within --out
    #[arg(long, value_enum, value_name = "FORMAT", conflicts_with_all = ["shard", "prepare", "init"])]
    format: Option<Format>,
    /// Check a data set or the scenes of a plan instead: checksums, counts, stamps, boxes against
    /// images, lidar against depth
    #[arg(long, value_name = "DIR", exclusive = true)]
    verify: Option<PathBuf>,
}

/// Collects a data set in a simulator of its own, or the scenes of a plan each in one of its own.
pub(crate) fn collect(args: &CollectArgs) -> anyhow::Result<()> {
    let CollectArgs { world, options, format, verify } = args;
    if let Some(dir) = verify {
        print_line!("{}", dataset::verify(dir)?);
        return Ok(());
    }
    if let Some(name) = &options.init {
        // The text ends with a line feed of its own.
        print_line!("{}", dataset::template(name)?.trim_end());
        return Ok(());
    }
    let plan = options.resolve(world)?;
    if options.prepare {
        dataset::print_json(&dataset::prepare(options, &plan)?);
        return Ok(());
    }
    let stop = stop_on_signals()?;
    if let Some(parent) = options.parent {
        end_with(parent)?;
    }
    let map = plan.scene(options.scene.unwrap_or(0))?.map;
    let scene_world = WorldArgs { map, seed: Some(plan.seed), ..world.clone() };
    if options.has_scene_folders() {
        if plan.demand.routes.is_some() {
            plan.demand.departures(scene_world.network()?, plan.seed)?;
        }
        let collected = dataset::collect_scenes(options, &plan, &world.command_line(), &stop)?;
        if !options.json {
            print_line!("{collected}");
        }
        return write_format(options, *format);
    }
    // Errors in the map are reported before a folder is created.
    let network = scene_world.network()?;
    let job = dataset::Job::prepare(options, plan, network)?;
    let mut progress = dataset::Progress::new(options.json);
    progress.show_step("starting the simulator");
    let settings = Settings { no_rendering: 1, synchronous: 1, ..Settings::default() };
    let host = BackgroundHost::start(&scene_world, settings)?;
    let mut client = host.connect("collect")?;
    drop(progress);
    let collected = dataset::collect(job, &mut client, &stop);
    drop(client);
    let ended = host.end();
    match collected {
        Ok(summary) => {
            ended?;
            if options.json {
                dataset::print_json(&summary.json());
            } else {
                print_line!("{summary}");
            }
            write_format(options, *format)
        }
        // The reason why the host ended causes the client's error.
        Err(error) => match ended {
            Err(cause) => Err(cause.context(error.to_string())),
            Ok(_) => Err(error.into()),
        },
    }
}

/// Writes a complete collection in another format, unless it is there.
fn write_format(options: &dataset::Options, format: Option<Format>) -> anyhow::Result<()> {
    let Some(format) = format else { return Ok(()) };
    let args = ExportArgs::within(options.out()?, format);
    if args.out().exists() && options.resume {
        return Ok(());
    }
    let written = export(&args)?;
    if options.json {
        dataset::print_json(&serde_json::json!({ "event": "export", "out": args.out() }));
    } else {
        print_line!("{written}");
    }
    Ok(())
}

/// Converts seconds to nanoseconds, within the range that the host accepts.
pub(crate) fn nanos(seconds: f64) -> anyhow::Result<u64> {
    anyhow::ensure!(
        (1e-4..=10.0).contains(&seconds),
        "--fixed-delta is {seconds}, not 0.0001 to 10 (seconds)"
    );
    Ok((seconds * 1e9).round() as u64)
}

/// Returns a flag that Ctrl-C and SIGTERM set.
pub(crate) fn stop_on_signals() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop)).context("signal handler")?;
    }
    // A write beyond `ulimit -f` is then an error of that write, and does not end the process.
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())
        .context("signal handler")?;
    Ok(stop)
}

/// A simulator whose host runs in a thread of this process, for commands that are its only client.
pub struct BackgroundHost {
    instance: Instance,
    in_process: bool,
    stop: Arc<AtomicBool>,
    host: Option<JoinHandle<Result<Frame, HostError>>>,
}

impl BackgroundHost {
    /// Starts the host and waits until it accepts clients.
    pub fn start(args: &WorldArgs, settings: Settings) -> anyhow::Result<BackgroundHost> {
        let stop = Arc::new(AtomicBool::new(false));
        let (sender, receiver) = crossbeam::channel::bounded(1);
        let (world, flag) = (args.clone(), Arc::clone(&stop));
        let host =
            std::thread::Builder::new().name("sim-host".into()).spawn(move || {
                match world.host(settings, flag) {
                    Ok(host) => {
                        let _ = sender.send(Ok(host.instance().clone()));
                        host.run()
                    }
                    Err(e) => {
                        let _ = sender.send(Err(e));
                        Ok(Frame(0))
                    }
                }
            })?;
        let instance = receiver.recv().context("the host ended while it started")??;
        Ok(BackgroundHost { instance, in_process: args.single_process, stop, host: Some(host) })
    }

    /// Returns the name of the simulator.
    pub(crate) fn instance_id(&self) -> &str {
        self.instance.id()
    }

    /// Connects a client of this name.
    pub fn connect(&self, name: &str) -> anyhow::Result<client_lib::Client> {
        if self.in_process {
            return Ok(client_lib::Client::connect_in_process(&self.instance, name)?);
        }
        Ok(client_lib::Client::connect(Some(self.instance.id()), name)?)
    }

    /// Stops the host and returns the last frame, or the host's error.
    pub fn end(mut self) -> anyhow::Result<Frame> {
        self.stop.store(true, std::sync::atomic::Ordering::Release);
        let host = self.host.take().expect("it ends once");
        host.join().map_err(|_| anyhow::anyhow!("the host panicked"))?.map_err(Into::into)
    }
}

impl Drop for BackgroundHost {
    fn drop(&mut self) {
        self.stop.store(true, std::sync::atomic::Ordering::Release);
        if let Some(host) = self.host.take() {
            let _ = host.join();
        }
    }
}
