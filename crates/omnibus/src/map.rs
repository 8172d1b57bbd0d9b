//! `omnibus map`: describes a map, for people and for external checkers.

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

/// Arguments of `omnibus map`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MapArgs {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Clone, Debug, Subcommand)]
enum Verb {
    /// Describes what a map contains
    Info(Source),
    /// Lists every contradiction in the map with its line; fails if there are errors
    Validate(Source),
    /// Prints waypoints as JSON lines
    Waypoints(lines::WaypointArgs),
    /// Prints which driving lane continues in which, as JSON lines
    Topology(Source),
    /// Prints signs and traffic lights, and the positions where they apply, as JSON lines
    Landmarks(Source),
    /// Prints crosswalks as JSON lines
    Crosswalks(Source),
    /// Prints what lies at given points, as JSON lines
    Query(query::QueryArgs),
    /// Prints the shortest route from A to B
    Route(route::RouteArgs),
    /// Draws the map as seen from above
    Render(render::RenderArgs),
    /// Generates a town and writes its OpenDRIVE
    Generate(generate::GenerateArgs),
    /// Writes the furnished town as glTF (.glb) or OBJ (.obj)
    Export(export::ExportArgs),
}

/// Runs the subcommand.
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
