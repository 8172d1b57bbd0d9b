//! `omnibus map generate`: a town that nobody has drawn, as OpenDRIVE.

use std::path::PathBuf;

use super::{speak, write_file};

/// What `omnibus map generate` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct GenerateArgs {
    /// Same seed, same town
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// From edge to edge, 250 to 3000
    #[arg(long, value_name = "METRES", default_value_t = 640.0)]
    size: f64,
    /// From the lowest to the highest junction
    #[arg(long, value_name = "METRES", default_value_t = 5.0)]
    relief: f64,
    /// What it is called; else town-SEED
    #[arg(long)]
    name: Option<String>,
    /// The file to write; else standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the town.
pub(super) fn generate(args: &GenerateArgs) -> anyhow::Result<()> {
    anyhow::ensure!(
        (250.0..=3000.0).contains(&args.size),
        "--size is {}; use 250 to 3000 (metres)",
        args.size
    );
    anyhow::ensure!(
        (0.0..=200.0).contains(&args.relief),
        "--relief is {}; use 0 to 200 (metres)",
        args.relief
    );
    let text = town::generate(&town::Plan {
        name: args.name.clone().unwrap_or_else(|| format!("town-{}", args.seed)),
        seed: args.seed,
        size_m: args.size,
        character: town::Character::Grid,
        relief_m: args.relief,
    });
    match &args.out {
        None => speak(|out| out.write_all(text.as_bytes())),
        Some(path) => {
            write_file(path, |file| Ok(file.write_all(text.as_bytes())?))?;
            say!("{}: {:.2} MB", path.display(), text.len() as f64 / 1e6);
            Ok(())
        }
    }
}
