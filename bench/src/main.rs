//! `bench`: benchmarks. Every figure is measured from outside, as a client of the `omnibus`
//! program beside this one, except `map`, which calls the crate `road`. README.md defines what is
//! timed.
//!
//! ```text
//!   bench ──spawns──▶ omnibus run ──▶ traffic, sensor-render
//!     │  └─ client-lib: tick, bundles, controls ─┘
//!     ├──spawns──▶ bench peer …   the same exchange over loopback TCP, in the same run
//!     └──spawns──▶ bench agent …  an agent; others are in C and Python
//! ```

mod agent;
mod camera;
mod carla;
mod collect;
mod cores;
mod crowd;
mod environment;
mod export;
mod figure;
mod handover;
mod host;
mod latency;
mod machine;
mod map;
mod peer;
mod quiet;
mod record;
mod recovery;
mod rest;
mod ros2;
mod scene;
mod sim;
mod stage;
mod start;
mod tick;
mod view;
mod world;

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use figure::Sink;

/// Measures Omnibus from outside and prints one line per figure
#[derive(Parser, Debug)]
#[command(name = "bench", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
    #[command(flatten)]
    effort: Effort,
    /// Also write one JSON object per line to this file
    #[arg(long, global = true, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The duration of measurements.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Effort {
    /// Approximate seconds per figure; some need more
    #[arg(long, global = true, default_value_t = 20.0)]
    pub(crate) seconds: f64,
    /// One short round of everything: a check, not for figures
    #[arg(long, global = true)]
    pub(crate) quick: bool,
}

impl Effort {
    /// Rounds of a figure; its value is their median.
    pub(crate) fn rounds(self, usual: usize) -> usize {
        if self.quick { 1 } else { usual }
    }

    /// Returns a count, or a twentieth of it with `--quick`.
    pub(crate) fn count(self, usual: usize) -> usize {
        if self.quick { usual.div_ceil(20) } else { usual }
    }

    /// Seconds per figure in total.
    pub(crate) fn seconds(self) -> f64 {
        if self.quick { self.seconds.min(2.0) } else { self.seconds }
    }
}

#[derive(Subcommand, Clone, Debug)]
enum Verb {
    /// An empty tick of four processes
    Tick,
    /// The steps of the host in a tick: empty, 100 and 1000 cars
    Host,
    /// Whole ticks with 100, 1000 and 10 000 cars, without sensors
    Crowd,
    /// The cost of 500 idle props per tick
    Rest,
    /// From the renderer's last write to the client's view
    Handover,
    /// Images per second
    Camera,
    /// Lidar rays per second
    Lidar,
    /// One step of physics
    Physics,
    /// One plan of traffic
    Traffic,
    /// Frames to disk by `omnibus collect`
    Collect,
    /// Data sets in the formats of others, beside plain writing
    Export,
    /// The cost of recording per tick, its size on disk, and its reading speed
    Record,
    /// Process start to first image
    Start,
    /// From a snapshot to the agent's control in effect
    Latency,
    /// From the kill of a process until its work is done again
    Recovery,
    /// The tick of a client beside floods, many connections and slow readers
    Quiet,
    /// Steps of a driving environment in one process
    Environment,
    /// The official carla package through the CARLA server
    CarlaClient,
    /// Images through the node of ROS 2 to Cyclone DDS, and the tick beside it
    Ros2,
    /// The tick beside pages of the viewer, one that reads and one that does not
    View,
    /// From OpenDRIVE text to a network that answers queries
    Map,
    /// From OpenDRIVE text to a furnished town for ray tracing
    World,
    /// All of them, except carla-client and ros2
    All,
    /// One end of an exchange over loopback TCP; bench starts these
    #[command(hide = true)]
    Peer(peer::Args),
    /// The agent in Rust; bench starts it
    #[command(hide = true)]
    Agent(agent::Args),
}

type Measure = fn(Effort, &mut Sink) -> anyhow::Result<()>;

const VERBS: [(&str, Measure); 20] = [
    ("tick", tick::measure),
    ("host", host::measure),
    ("crowd", crowd::measure),
    ("rest", rest::measure),
    ("handover", handover::measure),
    ("camera", camera::measure),
    ("lidar", camera::measure_lidar),
    ("physics", stage::physics),
    ("traffic", stage::traffic),
    ("collect", collect::measure),
    ("export", export::measure),
    ("record", record::measure),
    ("start", start::measure),
    ("latency", latency::measure),
    ("recovery", recovery::measure),
    ("quiet", quiet::measure),
    ("environment", environment::measure),
    ("view", view::measure),
    ("map", map::measure),
    ("world", world::measure),
];

fn main() -> std::process::ExitCode {
    let cli = Cli::parse();
    let ended = match &cli.verb {
        Verb::Peer(args) => peer::play(args),
        Verb::Agent(args) => agent::play(args),
        Verb::CarlaClient => Sink::open(cli.json.as_deref())
            .and_then(|mut sink| carla::measure(cli.effort, &mut sink)),
        Verb::Ros2 => Sink::open(cli.json.as_deref())
            .and_then(|mut sink| ros2::measure(cli.effort, &mut sink)),
        verb => measure(&format!("{verb:?}").to_lowercase(), &cli),
    };
    match ended {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("bench: {e:#}");
            std::process::ExitCode::FAILURE
        }
    }
}

/// Runs one benchmark or all; a figure that fails does not stop the others.
fn measure(verb: &str, cli: &Cli) -> anyhow::Result<()> {
    anyhow::ensure!(
        (0.1..=3600.0).contains(&cli.effort.seconds),
        "--seconds is {}, not 0.1 to 3600",
        cli.effort.seconds
    );
    sim::omnibus()?;
    let mut sink = Sink::open(cli.json.as_deref())?;
    let mut failed = Vec::new();
    for (name, work) in VERBS.iter().filter(|(name, _)| verb == "all" || verb == *name) {
        if let Err(e) = work(cli.effort, &mut sink) {
            eprintln!("bench: {name}: {e:#}");
            failed.push(*name);
        }
    }
    anyhow::ensure!(failed.is_empty(), "no figure of {}", failed.join(", "));
    Ok(())
}
