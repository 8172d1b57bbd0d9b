//! `omnibus map`: what a map is and says, for people and for outside checkers.

mod canvas;
mod export;
mod generate;
pub(crate) mod glyphs;
mod ground;
mod info;
mod lines;
mod output;
mod query;
mod render;
mod route;
mod source;
mod validate;

use clap::Subcommand;

use crate::map::source::Source;

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
