//! `omnibus map query`: describes given points.

use std::path::PathBuf;

use anyhow::Context;
use glam::{DQuat, DVec3};
use serde::Serialize;

use crate::map::{
    ground::Ground,
    lines::{WaypointLine, lane_types, waypoint_line},
    output::write_stdout,
    source::{Loaded, Source},
};

/// Arguments of `omnibus map query`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct QueryArgs {
    #[command(flatten)]
    source: Source,
    /// A CSV file of x,y or x,y,z, metres; "-" reads standard input
    #[arg(long, value_name = "CSV")]
    points: PathBuf,
    /// Lane types among which the nearest waypoint is searched
    #[arg(long, default_value = "driving", value_delimiter = ',')]
    types: Vec<String>,
    /// The seed of the terrain beside the roads
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// What lies at one point. Null where there is no such lane, or no ground.
#[derive(Serialize)]
struct Line<'a> {
    x_m: f64,
    y_m: f64,
    waypoint: Option<WaypointLine<'a>>,
    /// Distance from the waypoint to the left, as seen in driving direction.
    left_m: Option<f64>,
    /// Whether the point lies on the lane of the waypoint, seen from above.
    on_lane: bool,
    ground_m: Option<f64>,
    normal: Option<[f32; 3]>,
    tag: Option<String>,
}

/// Describes each point. Without z the topmost ground is used, and the lane nearest to it.
pub(super) fn query(args: &QueryArgs) -> anyhow::Result<()> {
    let types = lane_types(&args.types)?;
    let points = points(args)?;
    let Loaded { network, .. } = args.source.load()?;
    let town = town::furnish(&network, args.seed);
    let ground = Ground::new(&town.mesh);
    write_stdout(|out| {
        for (x, y, z) in points {
            let below = ground.below(x, y, z);
            let height = z.or(below.as_ref().map(|hit| hit.height_m)).unwrap_or(0.0);
            let point = DVec3::new(x, y, height);
            let nearest = network.nearest(point, types);
            let offset = nearest.map(|at| {
                let pose = network.place(at);
                DQuat::from_rotation_z(-pose.heading_rad) * (point - pose.position)
            });
            let half = nearest.map(|at| 0.5 * network.width(at));
            let on_lane = offset
                .zip(half)
                .is_some_and(|(offset, half)| offset.y.abs() <= half && offset.x.abs() <= 0.01);
            let line = Line {
                x_m: x,
                y_m: y,
                waypoint: nearest.map(|at| waypoint_line(&network, at, None)),
                left_m: offset.map(|offset| offset.y),
                on_lane,
                ground_m: below.as_ref().map(|hit| hit.height_m),
                normal: below.as_ref().map(|hit| hit.normal.to_array()),
                tag: below.as_ref().map(|hit| format!("{:?}", hit.tag)),
            };
            serde_json::to_writer(&mut *out, &line)?;
            out.write_all(b"\n")?;
        }
        Ok(())
    })
}

/// Most bytes of a file of points.
const POINTS_MAX: u64 = 1 << 30;

type Point = (f64, f64, Option<f64>);

fn points(args: &QueryArgs) -> anyhow::Result<Vec<Point>> {
    let name = args.points.display();
    let text = if args.points.as_os_str() == "-" {
        std::io::read_to_string(std::io::stdin()).context("standard input")?
    } else {
        let bytes = bus::read_regular(&args.points, POINTS_MAX);
        let bytes = bytes.with_context(|| format!("points {name}"))?;
        String::from_utf8(bytes).with_context(|| format!("points {name}"))?
    };
    let mut points = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let values: Option<Vec<f64>> = cells
            .iter()
            .map(|cell| cell.parse().ok().filter(|v: &f64| v.is_finite() && v.abs() < 1e7))
            .collect();
        match values.as_deref() {
            Some([x, y]) => points.push((*x, *y, None)),
            Some([x, y, z]) => points.push((*x, *y, Some(*z))),
            // The first line may hold column names; empty lines are skipped.
            None if number == 1 => {}
            _ if line.trim().is_empty() => {}
            _ => anyhow::bail!("{name}:{number}: {line:?} is not x,y or x,y,z in metres"),
        }
    }
    Ok(points)
}
