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
