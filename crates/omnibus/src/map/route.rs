//! `omnibus map route`: the shortest route between two points.

use glam::DVec3;
use road::{LanePoint, LaneTypes, Network};
use serde::Serialize;

use crate::map::{
    lines::{PointName, point_name, waypoint_line},
    output::write_stdout,
    source::{Loaded, Source},
};

/// Arguments of `omnibus map route`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RouteArgs {
    #[command(flatten)]
    source: Source,
    /// The start: ROAD:LANE:S, or X,Y in metres
    #[arg(allow_hyphen_values = true)]
    from: String,
    /// The destination: ROAD:LANE:S, or X,Y in metres
    #[arg(allow_hyphen_values = true)]
    to: String,
    /// Print the lanes as JSON lines
    #[arg(long)]
    json: bool,
    /// Print waypoints at this distance as JSON lines
    #[arg(long, value_name = "METRES")]
    every: Option<f64>,
}

/// One lane of the route.
#[derive(Serialize)]
struct Line<'a> {
    from: PointName<'a>,
    to: PointName<'a>,
    changes_lane: bool,
}

/// Prints the route.
pub(super) fn route(args: &RouteArgs) -> anyhow::Result<()> {
    let fits = args.every.is_none_or(|every| (0.01..=1e6).contains(&every));
    anyhow::ensure!(fits, "--every is {}; use 0.01 to 1000000", args.every.unwrap_or(0.0));
    let Loaded { name, network, .. } = args.source.load()?;
    let (from, to) = (place(&network, &args.from)?, place(&network, &args.to)?);
    let Some(route) = network.route(from, to) else {
        anyhow::bail!("{name}: no way leads from {} to {}", args.from, args.to)
    };
    if let Some(every) = args.every {
        return write_stdout(|out| {
            for at in route.points(every) {
                serde_json::to_writer(&mut *out, &waypoint_line(&network, at, None))?;
                out.write_all(b"\n")?;
            }
            Ok(())
        });
    }
    let point = |lane, along_m| point_name(&network, LanePoint { lane, along_m });
    write_stdout(|out| {
        for leg in &route.legs {
            let (from, to) = (point(leg.lane, leg.from_m), point(leg.lane, leg.to_m));
            if args.json {
                serde_json::to_writer(&mut *out, &Line { from, to, changes_lane: leg.changes })?;
                out.write_all(b"\n")?;
                continue;
            }
            let lane = network.lane(leg.lane);
            let how = if leg.changes { ", then changes lane" } else { "" };
            writeln!(
                out,
                "{:>9.1} m on road {} section {} lane {}{how}",
                leg.to_m - leg.from_m,
                network.roads()[lane.road as usize].id,
                lane.section,
                lane.id,
            )?;
        }
        if !args.json {
            let changes = route.legs.iter().filter(|leg| leg.changes).count();
            writeln!(out, "{:>9.1} m in all, {changes} changes of lane", route.length_m)?;
        }
        Ok(())
    })
}

/// Returns a point from OpenDRIVE ids and s, or from its position.
fn place(network: &Network, text: &str) -> anyhow::Result<LanePoint> {
    let named: Vec<&str> = text.split(':').collect();
    if let [road, lane, s] = named.as_slice()
        && let (Ok(lane), Ok(s)) = (lane.parse(), s.parse())
    {
        return network.lane_point(road, lane, s).ok_or_else(|| {
            anyhow::anyhow!("{text:?}: road {road} has no lane {lane} at s {s}, or is not there")
        });
    }
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|cell| cell.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    let point = match numbers.as_deref() {
        Some([x, y]) => DVec3::new(*x, *y, 0.0),
        Some([x, y, z]) => DVec3::new(*x, *y, *z),
        _ => anyhow::bail!("{text:?} is no place; write ROAD:LANE:S, or X,Y in metres"),
    };
    let nearest = network.nearest(point, LaneTypes::DRIVABLE);
    nearest.ok_or_else(|| anyhow::anyhow!("{text:?}: the map has no lanes to drive on"))
}
