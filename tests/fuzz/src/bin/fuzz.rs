//! Executes a fuzz target on files, or on mutations of its corpus.

use std::{fs, path::PathBuf, process::ExitCode};

use clap::Parser;
use omnibus_fuzz::{CountingAllocator, Session, TARGETS, target};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[derive(Parser)]
struct Args {
    /// The target: open_drive, recording, carla_log, msgpack, saved_state, gltf, commands.
    target: String,
    /// Files to execute; none: mutations of the corpus.
    files: Vec<PathBuf>,
    /// The number of mutations.
    #[arg(long, default_value_t = u64::MAX)]
    executions: u64,
    /// The seed of the mutations.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let Some(target) = target(&args.target) else {
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("there is no target {:?}; the targets are {}", args.target, names.join(", "));
        return ExitCode::FAILURE;
    };
    let mut session = Session::new(target, true);
    let executed = if args.files.is_empty() {
        session.run(args.executions, args.seed)
    } else {
        args.files.iter().try_fold(session.summary(), |_, path| {
            let bytes = fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
            session.execute(&bytes).map_err(|why| format!("{}: {why}", path.display()))?;
            Ok(session.summary())
        })
    };
    match executed {
        Ok(summary) => {
            println!("{}: {summary}", target.name);
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}
