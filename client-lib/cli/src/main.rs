//! `omnibus`: a driving simulator that is a shared-memory bus.

mod launch;
mod run;

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
    /// Lists the maps that ship
    Maps,
    /// Lists what can be spawned
    Blueprints,
    /// One stage's process; the host starts these
    #[command(hide = true)]
    Role(launch::RoleArgs),
}

fn main() -> std::process::ExitCode {
    let cli = Cli::parse();
    let ended = match &cli.verb {
        Verb::Run(args) => run::run(args),
        Verb::Maps => {
            town::names().for_each(|name| println!("{name}"));
            Ok(())
        }
        Verb::Blueprints => {
            town::catalogue().iter().for_each(|blueprint| println!("{}", blueprint.id));
            Ok(())
        }
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
