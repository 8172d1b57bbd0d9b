//! `omnibus`: a driving simulator that is a shared-memory bus.

/// Prints a line; who closed the pipe has heard enough.
macro_rules! say {
    ($($text:tt)*) => {{
        let _ = std::io::Write::write_fmt(
            &mut std::io::stdout(),
            format_args!("{}\n", format_args!($($text)*)),
        );
    }};
}

mod blueprints;
mod collect;
mod door;
mod inspect;
mod launch;
mod map;
mod maps;
mod record;
mod replay;
mod resimulate;
mod run;
mod stage;
mod unreal;

pub use launch::WorldArgs;
pub use resimulate::{Difference, Resimulated, resimulate};
pub use run::Beside;

use clap::{Parser, Subcommand};

/// A driving simulator that is a shared-memory bus.
#[derive(Parser, Debug)]
#[command(name = "omnibus", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand, Debug)]
enum Verb {
    /// Runs a simulator until Ctrl-C
    Run(run::RunArgs),
    /// Drives a car through traffic and writes down what its sensors measure
    Collect(run::CollectArgs),
    /// Writes down what happens in traffic, frame by frame
    Record(record::RecordArgs),
    /// Shows a recording again, or simulates it again
    Replay(replay::ReplayArgs),
    /// Says what a data set, a map or the running simulators are, and checks it
    Inspect(inspect::InspectArgs),
    /// Runs one stage alone at full speed and prints how long its frames take
    Stage(stage::StageArgs),
    /// Says what a map holds, checks, draws, converts or generates one
    Map(map::MapArgs),
    /// Lists every map that has a name, and where it comes from
    Maps(maps::MapsArgs),
    /// Says what can be spawned, and what it looks like
    Blueprints(blueprints::BlueprintsArgs),
    /// One stage's process; the host starts these
    #[command(hide = true)]
    Role(launch::RoleArgs),
}

/// Checks a command line without running it.
///
/// # Errors
///
/// Returns what the program would say before it ends with code 2.
pub fn check_args(args: impl IntoIterator<Item = std::ffi::OsString>) -> Result<(), String> {
    let args = unreal::translate(args.into_iter()).map_err(|e| format!("{e:#}"))?;
    Cli::try_parse_from(args).map(drop).map_err(|e| e.to_string())
}

/// Runs the command that this process was started with.
pub fn main() -> std::process::ExitCode {
    let args = match unreal::translate(std::env::args_os()) {
        Ok(args) => args,
        Err(e) => {
            eprintln!("omnibus: {e:#}");
            return std::process::ExitCode::FAILURE;
        }
    };
    let cli = Cli::parse_from(args);
    let ended = match &cli.verb {
        Verb::Run(args) => run::run(args),
        Verb::Collect(args) => run::collect(args),
        Verb::Record(args) => record::record(args),
        Verb::Replay(args) => replay::replay(args),
        Verb::Inspect(args) => inspect::inspect(args),
        Verb::Stage(args) => stage::stage(args),
        Verb::Map(args) => map::map(args),
        Verb::Maps(args) => maps::list(args),
        Verb::Blueprints(args) => blueprints::blueprints(args),
        Verb::Role(args) => launch::play_role(args),
    };
    match ended {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("omnibus: {e:#}");
            std::process::ExitCode::FAILURE
        }
    }
}
