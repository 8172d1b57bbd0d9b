//! `omnibus map generate`: generates a town and writes its OpenDRIVE.

use std::path::PathBuf;

use mapgen::Character;

use crate::map::output::{write_file, write_stdout};

/// Arguments of `omnibus map generate`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct GenerateArgs {
    /// The seed; the same seed generates the same town
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The character of the town: grid, old-town, suburb, highway, roundabouts or countryside
    #[arg(long, default_value = "grid", value_parser = character)]
    character: Character,
    /// The width of the town in metres, up to 3000; default: by character
    #[arg(long, value_name = "METRES")]
    size: Option<f64>,
    /// The difference between the highest and the lowest ground in metres; default: by character
    #[arg(long, value_name = "METRES")]
    relief: Option<f64>,
    /// The name of the map; default: CHARACTER-SEED
    #[arg(long)]
    name: Option<String>,
    /// The file to write; default: standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

fn character(name: &str) -> Result<Character, String> {
    let known = || Character::ALL.map(Character::name).join(", ");
    Character::by_name(name).ok_or_else(|| format!("use one of {}", known()))
}

/// Generates the town.
pub(super) fn generate(args: &GenerateArgs) -> anyhow::Result<()> {
    let character = args.character;
    let ((least, most), usual) = (character.size_range_m(), character.default_size_and_relief_m());
    let (size_m, relief_m) = (args.size.unwrap_or(usual.0), args.relief.unwrap_or(usual.1));
    anyhow::ensure!(
        (least..=most).contains(&size_m),
        "--size is {size_m}; a town of character {} has {least} to {most} (metres)",
        character.name()
    );
    anyhow::ensure!(
        (0.0..=200.0).contains(&relief_m),
        "--relief is {relief_m}; use 0 to 200 (metres)"
    );
    let name = args.name.clone();
    let text = mapgen::generate(&mapgen::Plan {
        name: name.unwrap_or_else(|| format!("{}-{}", character.name(), args.seed)),
        seed: args.seed,
        size_m,
        character,
        relief_m,
    });
    match &args.out {
        None => write_stdout(|out| out.write_all(text.as_bytes())),
        Some(path) => {
            write_file(path, |file| Ok(file.write_all(text.as_bytes())?))?;
            print_line!("{}: {:.2} MB", path.display(), text.len() as f64 / 1e6);
            Ok(())
        }
    }
}
