//! The arguments of `omnibus profile`.

use std::path::PathBuf;

use crate::launch::WorldArgs;

/// Arguments of `omnibus profile`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ProfileArgs {
    #[command(flatten)]
    pub(crate) world: WorldArgs,
    /// Start a simulator with default sensors and profile it, instead of a running one
    #[arg(long)]
    pub(crate) start: bool,
    /// Frames to profile
    #[arg(long, default_value_t = 300)]
    pub(crate) frames: u64,
    /// With --start: frames to simulate before the first that is profiled
    #[arg(long, default_value_t = 40)]
    pub(crate) warmup: u64,
    /// With --start: vehicles in traffic; the first carries the sensors
    #[arg(long, default_value_t = 50)]
    pub(crate) vehicles: usize,
    /// With --start: the camera's pixels across
    #[arg(long, default_value_t = 800)]
    pub(crate) width: u32,
    /// With --start: the camera's pixels down
    #[arg(long, default_value_t = 600)]
    pub(crate) height: u32,
    /// With --start: frames that rendering may lag behind, 0 to 3
    #[arg(long, default_value_t = 0)]
    pub(crate) pipeline: u32,
    /// Run one stage alone, fed from the recording of --input at full speed
    #[arg(long, value_enum, requires = "input", conflicts_with_all = ["start", "trace"])]
    pub(crate) stage: Option<AloneStage>,
    /// With --stage: a recording (see `omnibus record`)
    #[arg(long, value_name = "FILE", requires = "stage")]
    pub(crate) input: Option<PathBuf>,
    /// With --start or --stage render: sensors from this TOML file instead of the default ones
    #[arg(long, value_name = "FILE")]
    pub(crate) sensors: Option<PathBuf>,
    /// Compare two results of --output: which parts are faster or slower, and how surely
    #[arg(long, num_args = 2, value_names = ["A", "B"], conflicts_with_all = ["start", "stage", "trace"])]
    pub(crate) compare: Option<Vec<PathBuf>>,
    /// Write one trace of all processes to this file, for ui.perfetto.dev
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
    /// Write the result as JSON to this file, for --compare
    #[arg(long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Print the result as one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// The stages that run alone from a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum AloneStage {
    /// One step of the world: commands, physics, state hash
    Physics,
    /// One plan of traffic
    Traffic,
    /// One measurement of all sensors
    Render,
    /// One frame written to a recording
    Record,
    /// One snapshot through shared memory
    Bus,
}

impl AloneStage {
    pub(crate) fn name(self) -> &'static str {
        match self {
            AloneStage::Physics => "physics",
            AloneStage::Traffic => "traffic",
            AloneStage::Render => "render",
            AloneStage::Record => "record",
            AloneStage::Bus => "bus",
        }
    }
}
