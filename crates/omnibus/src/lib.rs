//! The `omnibus` command: a driving simulator whose processes share memory.

/// Prints a line to standard output. A closed pipe is not an error.
macro_rules! print_line {
    ($($text:tt)*) => {{
        let _ = std::io::Write::write_fmt(
            &mut std::io::stdout(),
            format_args!("{}\n", format_args!($($text)*)),
        );
    }};
}

mod blueprints;
mod carla_args;
mod collect;
mod export;
mod gallery;
mod gateway;
mod inspect;
mod launch;
mod logging;
mod map;
mod maps;
mod population;
mod profile;
mod record;
mod replay;
mod resimulate;
mod ros2;
mod run;
mod saved;
mod sensors_file;
mod stage;
mod top;
mod view;
mod view_data_set;

pub use launch::WorldArgs;
pub use resimulate::{Difference, Resimulated, resimulate};
pub use run::BackgroundHost;

use anyhow::Context as _;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

/// A driving simulator that is a shared-memory bus
#[derive(Parser, Debug)]
#[command(name = "omnibus", version = protocol::VERSION, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand, Debug)]
enum Verb {
    /// Runs a simulator until Ctrl-C
    Run(run::RunArgs),
    /// Drives a car through traffic and writes the measurements of its sensors to a data set
    Collect(Box<run::CollectArgs>),
    /// Writes data sets of `collect` in another format
    Export(export::ExportArgs),
    /// Records traffic in a simulator of its own, frame by frame
    Record(record::RecordArgs),
    /// Replays a recording, or simulates it again
    Replay(replay::ReplayArgs),
    /// Describes and checks a data set, a recording, a map, or the running simulators
    Inspect(inspect::InspectArgs),
    /// Measures where the time of a frame goes, and names the stage that limits the frame rate
    Profile(profile::ProfileArgs),
    /// Shows a running simulator: participants, frame rate, stages, queues, the limiting stage
    Top(top::TopArgs),
    /// Publishes a vehicle and its sensors to ROS 2, and drives it by control messages
    Ros2(ros2::Ros2Args),
    /// Shows a running simulator or a recording in a browser: cameras, lidar, map, stages; drives a car
    View(view::ViewArgs),
    /// Draws places of the maps by day, at dusk, at night, in rain and in fog
    Gallery(gallery::GalleryArgs),
    /// Runs one stage alone at full speed and prints how long its frames take
    Stage(stage::StageArgs),
    /// Describes, checks, draws, converts or generates a map
    Map(map::MapArgs),
    /// Lists every named map and its source
    Maps(maps::MapsArgs),
    /// Lists the blueprints that can be spawned, or draws them
    Blueprints(blueprints::BlueprintsArgs),
    /// Runs the process of one stage; the host starts these
    #[command(hide = true)]
    Role(launch::RoleArgs),
}

fn command() -> clap::Command {
    Cli::command().mut_subcommand("stage", stage::group_options)
}

/// Checks a command line without running it.
///
/// # Errors
///
/// Returns the message that the program would print before it ends with code 2.
pub fn check_args(args: impl IntoIterator<Item = std::ffi::OsString>) -> Result<(), String> {
    let args = carla_args::translate(args.into_iter()).map_err(|e| format!("{e:#}"))?;
    command().try_get_matches_from(args).map(drop).map_err(|e| e.to_string())
}

/// Runs the command of this process's command line.
pub fn main() -> std::process::ExitCode {
    let begun = logging::init().and_then(|()| explain_full_memory());
    let args = match begun.and_then(|()| carla_args::translate(std::env::args_os())) {
        Ok(args) => args,
        Err(e) => {
            eprintln!("omnibus: {e:#}");
            return std::process::ExitCode::FAILURE;
        }
    };
    let matches = command().get_matches_from(args);
    let cli = match Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(e) => e.exit(),
    };
    let ended = match &cli.verb {
        Verb::Run(args) => run::run(args),
        Verb::Collect(args) => run::collect(args),
        Verb::Export(args) => export::export(args).map(|written| print_line!("{written}")),
        Verb::Record(args) => record::record(args),
        Verb::Replay(args) => replay::replay(args),
        Verb::Inspect(args) => inspect::inspect(args),
        Verb::Profile(args) => profile::profile(args),
        Verb::Top(args) => top::top(args),
        Verb::Ros2(args) => ros2::ros2(args),
        Verb::View(args) => view::view(args),
        Verb::Gallery(args) => gallery::gallery(args),
        Verb::Stage(args) => stage::stage(args),
        Verb::Map(args) => map::map(args),
        Verb::Maps(args) => maps::list(args),
        Verb::Blueprints(args) => blueprints::blueprints(args),
        Verb::Role(args) => launch::run_role_process(args),
    };
    match ended {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("omnibus: {e:#}");
            std::process::ExitCode::FAILURE
        }
    }
}

/// Exit code of a process for which there was no memory behind a mapped page.
const EXIT_NO_MEMORY: i32 = 74;

/// Ends this process with an explanation where the kernel would kill it: at an access to mapped
/// memory that does not exist. Messages are refused before that; what other processes write at the
/// same moment cannot be foreseen.
fn explain_full_memory() -> anyhow::Result<()> {
    let end = || {
        const WHY: &[u8] =
            b"omnibus: a mapped page has no memory (SIGBUS): /dev/shm is full, or a \
            file of the map cache was cut off; free some of /dev/shm, or make it larger\n";
        let _ = rustix::io::write(std::io::stderr(), WHY);
        signal_hook::low_level::exit(EXIT_NO_MEMORY)
    };
    #[expect(unsafe_code, reason = "an action in a signal handler")]
    // SAFETY: write(2) and _exit(2) are safe in a signal handler, and nothing is allocated.
    let registered = unsafe { signal_hook::low_level::register(signal_hook::consts::SIGBUS, end) };
    registered.map(drop).context("signal handler")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_of_stage_says_which_options_only_tick_takes() {
        let mut command = command();
        let help = command.find_subcommand_mut("stage").unwrap().render_long_help().to_string();
        let heading = help.find(stage::TICK_ONLY).unwrap();
        for option in launch::SIMULATOR_OPTIONS {
            let at = help.find(&format!("--{option}")).unwrap();
            assert!(at > heading, "--{option} is listed as an option of every stage:\n{help}");
            let line = ["omnibus", "stage", "tick", "--name", "a"].map(Into::into);
            assert!(check_args(line).is_ok());
        }
        assert!(help.find("--frames").unwrap() < heading);
    }
}
