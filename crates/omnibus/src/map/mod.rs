//! `omnibus map`: what a map is and says, for people and for outside checkers.

mod canvas;
mod export;
mod generate;
pub(crate) mod glyphs;
mod ground;
mod info;
mod lines;
mod query;
mod render;
mod route;
mod validate;

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow};
use clap::Subcommand;
use road::Network;

use crate::launch::WorldArgs;

/// What `omnibus map` takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MapArgs {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Clone, Debug, Subcommand)]
enum Verb {
    /// Says what a map holds
    Info(Source),
    /// Lists everything that does not fit together, each with its line; fails if there are errors
    Validate(Source),
    /// Waypoints as JSON lines
    Waypoints(lines::WaypointArgs),
    /// Which driving lane goes on into which, as JSON lines
    Topology(Source),
    /// Signs and lights, and where they rule, as JSON lines
    Landmarks(Source),
    /// Crosswalks, as JSON lines
    Crosswalks(Source),
    /// What is at given points, as JSON lines
    Query(query::QueryArgs),
    /// The shortest way from A to B
    Route(route::RouteArgs),
    /// Draws the map as seen from above
    Render(render::RenderArgs),
    /// Writes the OpenDRIVE of a town that nobody has drawn
    Generate(generate::GenerateArgs),
    /// Writes the furnished town as glTF (.glb) or OBJ (.obj)
    Export(export::ExportArgs),
}

/// Which map.
#[derive(Clone, Debug, clap::Args)]
struct Source {
    /// An OpenDRIVE file, or the name of a map (see `omnibus maps`)
    map: String,
    /// A folder of OpenDRIVE files, for maps by name; else the one that OMNIBUS_MAPS names
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
}

/// A map that was read.
struct Loaded {
    name: String,
    text: String,
    network: Network,
}

impl Source {
    fn load(&self) -> anyhow::Result<Loaded> {
        let world = WorldArgs { maps: self.maps.clone(), ..WorldArgs::of_map(&self.map) };
        let episode = world.episode()?;
        let network = Network::parse(&episode.open_drive)
            .map_err(|e| anyhow!("{}:{}: {}", episode.map, e.line, e.reason))?;
        Ok(Loaded { name: episode.map, text: episode.open_drive, network })
    }
}

/// Does what was asked.
pub(crate) fn map(args: &MapArgs) -> anyhow::Result<()> {
    match &args.verb {
        Verb::Info(source) => info::info(source),
        Verb::Validate(source) => validate::validate(source),
        Verb::Waypoints(args) => lines::waypoints(args),
        Verb::Topology(source) => lines::topology(source),
        Verb::Landmarks(source) => lines::landmarks(source),
        Verb::Crosswalks(source) => lines::crosswalks(source),
        Verb::Query(args) => query::query(args),
        Verb::Route(args) => route::route(args),
        Verb::Render(args) => render::render(args),
        Verb::Generate(args) => generate::generate(args),
        Verb::Export(args) => export::export(args),
    }
}

/// A new file, whole or not at all: it gets its name when all of it is there.
fn write_file(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    let written: anyhow::Result<()> = (|| {
        let mut file = std::io::BufWriter::new(std::fs::File::create(&part)?);
        fill(&mut file)?;
        file.into_inner().map_err(|e| e.into_error())?;
        std::fs::rename(&part, path)?;
        Ok(())
    })();
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    written.with_context(|| format!("writing {}", path.display()))
}

/// Standard output for many lines. Who closes the pipe has heard enough.
fn speak(fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> anyhow::Result<()> {
    let mut out = std::io::BufWriter::with_capacity(1 << 16, std::io::stdout().lock());
    match fill(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        ended => ended.context("standard output"),
    }
}
