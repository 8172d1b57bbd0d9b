//! The composition root: maps each role to its function, run as a process of this program or as a
//! thread.

use std::{
    any::Any,
    ffi::OsString,
    io,
    os::unix::process::CommandExt,
    panic::catch_unwind,
    path::PathBuf,
    process::Command,
    str::FromStr,
    sync::{Arc, atomic::AtomicBool},
};

use anyhow::{Context, anyhow};
use bus::{Instance, Role, Strategy};
use clap::ValueEnum;
use protocol::{Episode, Settings};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use sensor_render::{MeshList, Quality, RenderConfig};
use sim_host::{Host, HostConfig, Launcher, OnStall, Stage};

use crate::{
    gateway::{self, CarlaServerArgs},
    maps,
};

/// Arguments of every command that starts a simulator.
#[derive(Clone, Debug, clap::Args)]
pub struct WorldArgs {
    /// An OpenDRIVE file, or the name of a map (see `omnibus maps`)
    #[arg(long)]
    pub map: Option<String>,
    /// A folder of OpenDRIVE files that maps are found in by name; default: OMNIBUS_MAPS
    #[arg(long, value_name = "DIR")]
    pub maps: Option<PathBuf>,
    /// The seed of scenery and traffic; default: 1, or that of the plan
    #[arg(long)]
    pub seed: Option<u64>,
    /// The name of the instance, to run several
    #[arg(long)]
    pub name: Option<String>,
    /// The tracer: auto, cpu, gpu:N, or null (measures nothing, for benchmarks)
    #[arg(long, default_value = "auto")]
    pub device: String,
    /// Threads of the CPU tracer; 0: one per core
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// The rays per pixel of colour images: low (1), standard (4) or epic (16); default: standard, or that
    /// of the plan. Of a running simulator, cameras may name their own
    #[arg(long)]
    pub quality: Option<Quality>,
    /// A list of glTF files that replace meshes, one per line: id = "file.glb"
    #[arg(long, value_name = "FILE")]
    pub meshes: Option<PathBuf>,
    /// How processes wait: latency, balanced or batch
    #[arg(long, default_value = "balanced")]
    pub wait: String,
    /// Seconds that a tick waits for a participant; 0: no limit
    #[arg(long, default_value_t = 10.0)]
    pub deadline_secs: f64,
    /// What a synchronous tick does when a stage has not arrived within --deadline-secs
    #[arg(long, value_enum, default_value_t = StallArg::Late)]
    pub on_stall: StallArg,
    /// End the run when a stage dies instead of restarting the stage
    #[arg(long)]
    pub no_restart: bool,
    /// Run the stages as threads of one process
    #[arg(long)]
    pub single_process: bool,
    /// Layers to leave out of the town: buildings, foliage, parked-vehicles, props, street-lights,
    /// walls
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',')]
    pub hide: Vec<String>,
}

/// Options of [`WorldArgs`] that matter only to a running simulator.
pub(crate) const SIMULATOR_OPTIONS: [&str; 8] =
    ["name", "meshes", "wait", "deadline-secs", "on-stall", "no-restart", "hide", "single-process"];

/// The values of `--on-stall`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum StallArg {
    /// The frame ends late and names the stage; a collection ends, to be resumed
    Late,
    /// The stage is killed and started again, and completes the frame
    Restart,
}

impl From<StallArg> for OnStall {
    fn from(value: StallArg) -> OnStall {
        match value {
            StallArg::Late => OnStall::Late,
            StallArg::Restart => OnStall::Restart,
        }
    }
}

impl Default for WorldArgs {
    fn default() -> WorldArgs {
        WorldArgs {
            map: None,
            maps: None,
            seed: None,
            name: None,
            device: "auto".to_owned(),
            threads: 0,
            quality: None,
            meshes: None,
            wait: "balanced".to_owned(),
            deadline_secs: 10.0,
            on_stall: StallArg::Late,
            no_restart: false,
            single_process: false,
            hide: Vec::new(),
        }
    }
}

impl WorldArgs {
    /// Returns the arguments of this map with defaults for everything else.
    pub fn of_map(map: &str) -> WorldArgs {
        WorldArgs { map: Some(map.to_owned()), ..WorldArgs::default() }
    }

    /// Returns the seed of scenery and traffic.
    pub fn seed(&self) -> u64 {
        self.seed.unwrap_or(1)
    }

    fn quality(&self) -> Quality {
        self.quality.unwrap_or(Quality::Standard)
    }

    /// Returns the command line of these arguments, without map and seed.
    pub(crate) fn command_line(&self) -> Vec<OsString> {
        let on_stall = self.on_stall.to_possible_value().expect("no value is hidden");
        let values = [
            ("--device", Some(self.device.clone())),
            ("--threads", Some(self.threads.to_string())),
            ("--quality", self.quality.map(|quality| quality.to_string())),
            ("--wait", Some(self.wait.clone())),
            ("--deadline-secs", Some(self.deadline_secs.to_string())),
            ("--on-stall", Some(on_stall.get_name().to_owned())),
            ("--name", self.name.clone()),
            ("--hide", (!self.hide.is_empty()).then(|| self.hide.join(","))),
        ];
        let mut line = Vec::new();
        for (option, value) in values {
            line.extend(value.into_iter().flat_map(|value| [option.into(), value.into()]));
        }
        for (option, path) in [("--maps", &self.maps), ("--meshes", &self.meshes)] {
            line.extend(path.iter().flat_map(|path| [option.into(), path.into()]));
        }
        for (option, is_set) in
            [("--no-restart", self.no_restart), ("--single-process", self.single_process)]
        {
            line.extend(is_set.then(|| option.into()));
        }
        line
    }

    /// Returns an error if an option is given that only a running simulator uses.
    pub(crate) fn expect_no_simulator(&self, what: &str) -> anyhow::Result<()> {
        let usual = WorldArgs::of_map("");
        // In the order of `SIMULATOR_OPTIONS`.
        let is_given = [
            self.name != usual.name,
            self.meshes != usual.meshes,
            self.wait != usual.wait,
            self.deadline_secs != usual.deadline_secs,
            self.on_stall != usual.on_stall,
            self.no_restart != usual.no_restart,
            !self.hide.is_empty(),
            self.single_process != usual.single_process,
        ];
        match SIMULATOR_OPTIONS.iter().zip(is_given).find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(anyhow!("--{option} has no effect on {what}")),
            None => Ok(()),
        }
    }

    /// Returns the roads of the map.
    pub(crate) fn network(&self) -> anyhow::Result<road::Network> {
        let Episode { map, open_drive, .. } = self.episode()?;
        Ok(bake::Cache::from_environment().network(&map, &open_drive)?)
    }

    /// Returns the map's name, text and seed.
    pub(crate) fn episode(&self) -> anyhow::Result<Episode> {
        let (map, open_drive) = match &self.map {
            None => {
                let (name, text) = mapgen::default_map();
                (name.to_owned(), text)
            }
            Some(name) => (name.clone(), ::maps::text(name, self.maps.as_deref())?),
        };
        Ok(Episode { map, seed: self.seed(), open_drive })
    }

    /// Returns the layers of `--hide` as bits.
    fn hidden_layers(&self) -> anyhow::Result<u32> {
        let bit = |name: &String| {
            let layer = town::Layer::ALL.into_iter().find(|layer| layer.name() == name);
            layer.map(town::Layer::bit).ok_or_else(|| {
                let all = town::Layer::ALL.map(town::Layer::name).join(", ");
                anyhow!("unknown layer --hide {name:?}; use {all}")
            })
        };
        self.hide.iter().map(bit).try_fold(0, |sum, bit| Ok(sum | bit?))
    }

    /// Returns the renderer's configuration from `--device`, `--threads` and `--meshes`.
    pub(crate) fn render(&self) -> anyhow::Result<RenderConfig> {
        if let Some(list) = &self.meshes {
            // A list with an error is rejected before anything starts; a broken file in it is not.
            MeshList::read(list).context("--meshes")?;
        }
        render_config(&self.device, self.threads, self.quality(), self.meshes.clone())
    }

    /// Starts a host that runs until `stop` is set.
    pub(crate) fn host(&self, settings: Settings, stop: Arc<AtomicBool>) -> anyhow::Result<Host> {
        raise_file_limit()?;
        let strategy = Strategy::by_name(&self.wait)
            .ok_or_else(|| anyhow!("--wait {:?}: use latency, balanced or batch", self.wait))?;
        if !(0.0..=1e6).contains(&self.deadline_secs) {
            return Err(anyhow!("--deadline-secs is {}, not 0 to 1000000", self.deadline_secs));
        }
        let deadline = (self.deadline_secs * 1e9) as u64;
        let config = HostConfig {
            name: self.name.clone(),
            episode: self.episode()?,
            maps: Arc::new(maps::MapLibrary { folder: self.maps.clone() }),
            settings,
            hidden_layers: self.hidden_layers()?,
            strategy,
            deadline_nanos: (deadline > 0).then_some(deadline),
            restart: !self.no_restart,
            on_stall: self.on_stall.into(),
            stages: vec![Role::Traffic, Role::Render],
            stop,
        };
        let render = self.render()?;
        let launcher: Box<dyn Launcher> = if self.single_process {
            Box::new(ThreadLauncher { render })
        } else {
            Box::new(ProcessLauncher {
                device: self.device.clone(),
                threads: self.threads,
                quality: self.quality(),
                meshes: self.meshes.clone(),
            })
        };
        Ok(Host::start(config, launcher)?)
    }
}

/// Files that a host, its stages and their clients may have open. A host alone has about 80.
const OPEN_FILES_MIN: u64 = 256;
/// Room for hundreds of clients and connections.
const OPEN_FILES_WANTED: u64 = 1 << 16;

/// Raises the limit of open files of this process, and so of the stages that it starts.
fn raise_file_limit() -> anyhow::Result<()> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let wanted = maximum.unwrap_or(OPEN_FILES_WANTED).min(OPEN_FILES_WANTED);
    anyhow::ensure!(
        wanted >= OPEN_FILES_MIN,
        "a simulator needs {OPEN_FILES_MIN} open files in each process, and {wanted} are allowed; \
         raise the limit (ulimit -n {OPEN_FILES_MIN})"
    );
    if current.is_some_and(|current| current < wanted) {
        let limit = Rlimit { current: Some(wanted), maximum };
        setrlimit(Resource::Nofile, limit).context("limit of open files")?;
    }
    Ok(())
}

fn render_config(
    device: &str,
    threads: usize,
    quality: Quality,
    meshes: Option<PathBuf>,
) -> anyhow::Result<RenderConfig> {
    let null = device == "null";
    let device = if null { "cpu" } else { device };
    let device = FromStr::from_str(device).map_err(|e: String| anyhow!("--device: {e}"))?;
    anyhow::ensure!(
        threads <= THREADS_MAX,
        "--threads is {threads}, not 0 (one for each core) to {THREADS_MAX}"
    );
    Ok(RenderConfig { device, null, threads, quality, meshes })
}

/// More threads than any machine has cores.
const THREADS_MAX: usize = 1024;

/// Starts stages as processes of this program.
struct ProcessLauncher {
    device: String,
    threads: usize,
    quality: Quality,
    meshes: Option<PathBuf>,
}

impl Launcher for ProcessLauncher {
    fn launch(
        &mut self,
        role: Role,
        slot: usize,
        life: u64,
        instance: &Instance,
        _on_end: Box<dyn FnOnce() + Send>,
    ) -> io::Result<Stage> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .args(["role", role.name(), "--instance", instance.id()])
            .args(["--slot", &slot.to_string()])
            .args(["--device", &self.device, "--threads", &self.threads.to_string()])
            .args(["--quality", self.quality.name()])
            .env("OMNIBUS_LIFE", life.to_string())
            // Ctrl-C on the terminal reaches the host alone, which ends the others.
            .process_group(0);
        if let Some(meshes) = &self.meshes {
            command.arg("--meshes").arg(meshes);
        }
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            // Without it Mesa prints a warning, although no window is opened.
            command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
        }
        Ok(Stage::Process(command.spawn()?))
    }

    fn is_single_process(&self) -> bool {
        false
    }
}

/// Starts stages as threads of this process.
struct ThreadLauncher {
    render: RenderConfig,
}

impl Launcher for ThreadLauncher {
    fn launch(
        &mut self,
        role: Role,
        slot: usize,
        _life: u64,
        instance: &Instance,
        on_end: Box<dyn FnOnce() + Send>,
    ) -> io::Result<Stage> {
        let (instance, render) = (instance.clone(), self.render.clone());
        let work = move || {
            let _ = run_role_reporting(role, &instance, slot, true, render);
            on_end();
        };
        std::thread::Builder::new().name(role.name().into()).spawn(work).map(Stage::Thread)
    }

    fn is_single_process(&self) -> bool {
        true
    }
}

/// Runs [`run_role`] and reports an early end, a panic included, to the host before the slot is
/// free.
fn run_role_reporting(
    role: Role,
    instance: &Instance,
    slot: usize,
    in_process: bool,
    render: RenderConfig,
) -> anyhow::Result<()> {
    let outcome = catch_unwind(|| run_role(role, instance, slot, in_process, render));
    let ended =
        outcome.unwrap_or_else(|panic| Err(anyhow!("panicked: {}", panic_message(&*panic))));
    let Err(e) = ended else { return Ok(()) };
    if instance.control().map_or(true, |control| control.is_ending()) {
        // Any error here is a consequence of the host's end.
        return Ok(());
    }
    instance.write_exit_message(slot, &format!("{e:#}"));
    Err(e)
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("unknown panic")
}

/// Runs one stage until its host ends.
fn run_role(
    role: Role,
    instance: &Instance,
    slot: usize,
    in_process: bool,
    render: RenderConfig,
) -> anyhow::Result<()> {
    match role {
        Role::Traffic => Ok(traffic::run(instance, slot, in_process)?),
        Role::Render => Ok(sensor_render::run(instance, slot, in_process, render)?),
        Role::Host | Role::Client => Err(anyhow!("{} is not a stage", role.name())),
    }
}

/// Arguments of the process of a stage.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct RoleArgs {
    role: String,
    #[arg(long)]
    instance: String,
    #[arg(long, default_value_t = 0)]
    slot: usize,
    #[command(flatten)]
    carla: CarlaServerArgs,
    #[arg(long, default_value = "auto")]
    device: String,
    #[arg(long, default_value_t = 0)]
    threads: usize,
    #[arg(long, default_value_t = Quality::Standard)]
    quality: Quality,
    #[arg(long)]
    meshes: Option<PathBuf>,
}

/// Runs the process of a stage.
pub(crate) fn run_role_process(args: &RoleArgs) -> anyhow::Result<()> {
    if args.role == gateway::ROLE {
        return gateway::run_process(&args.carla, &args.instance);
    }
    let role = [Role::Traffic, Role::Render]
        .into_iter()
        .find(|r| r.name() == args.role)
        .ok_or_else(|| anyhow!("unknown role {:?}", args.role))?;
    let instance = Instance::named(&args.instance)?;
    let render = render_config(&args.device, args.threads, args.quality, args.meshes.clone())?;
    if run_role_reporting(role, &instance, args.slot, false, render).is_err() {
        // The host prints the reason.
        std::process::exit(1);
    }
    Ok(())
}
