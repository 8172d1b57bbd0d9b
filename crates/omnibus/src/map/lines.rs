//! JSON lines for external checkers. World space is right-handed with z up; metres and radians.

use road::{LanePoint, LaneType, LaneTypes, Network, RoadMark};
use serde::Serialize;

use crate::map::{
    output::write_stdout,
    source::{Loaded, Source},
};

/// Arguments of `omnibus map waypoints`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct WaypointArgs {
    #[command(flatten)]
    source: Source,
    /// Distance between waypoints along s, in metres
    #[arg(long, value_name = "METRES", default_value_t = 2.0)]
    every: f64,
    /// Lane types, such as driving,sidewalk, or any
    #[arg(long, default_value = "driving", value_delimiter = ',')]
    types: Vec<String>,
    /// Also print the waypoints this far ahead and behind, on every branch
    #[arg(long, value_name = "METRES")]
    step: Option<f64>,
}

/// A lane, by its OpenDRIVE ids.
#[derive(Serialize)]
pub(super) struct LaneName<'a> {
    road: &'a str,
    section: u32,
    lane: i32,
}

/// A point on the centre of a lane, by OpenDRIVE ids and s.
#[derive(Serialize)]
pub(super) struct PointName<'a> {
    road: &'a str,
    section: u32,
    lane: i32,
    s_m: f64,
}

/// A road marking.
#[derive(Serialize)]
struct MarkLine {
    #[serde(rename = "type")]
    kind: &'static str,
    color: &'static str,
    width_m: f64,
    change: &'static str,
}

/// Everything about a waypoint.
#[derive(Serialize)]
pub(super) struct WaypointLine<'a> {
    #[serde(flatten)]
    name: PointName<'a>,
    id: u64,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    heading_rad: f64,
    pitch_rad: f64,
    roll_rad: f64,
    curvature_per_m: f64,
    width_m: f64,
    #[serde(rename = "type")]
    kind: &'static str,
    forward: bool,
    junction: Option<&'a str>,
    /// The lane changes that the markings allow, whatever lies beyond them.
    lane_change: &'static str,
    /// Lane ids of the neighbours.
    left: Option<i32>,
    right: Option<i32>,
    left_mark: Option<MarkLine>,
    right_mark: Option<MarkLine>,
    speed_limit_mps: Option<f64>,
    successors: Vec<LaneName<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<Vec<PointName<'a>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    previous: Option<Vec<PointName<'a>>>,
}

/// Returns the OpenDRIVE ids of a lane.
pub(super) fn lane_name(network: &Network, lane: road::LaneIndex) -> LaneName<'_> {
    let lane = network.lane(lane);
    LaneName { road: &network.roads()[lane.road as usize].id, section: lane.section, lane: lane.id }
}

/// Returns the OpenDRIVE ids and s of a point.
pub(super) fn point_name(network: &Network, at: LanePoint) -> PointName<'_> {
    let (road, section, lane, s_m) = network.road_space(at);
    PointName { road: &road.id, section: section as u32, lane, s_m }
}

/// Parses the lane types of `--types`.
pub(super) fn lane_types(words: &[String]) -> anyhow::Result<LaneTypes> {
    let mut types = LaneTypes(0);
    for word in words {
        types = types
            | match (word.as_str(), LaneType::from_text(word)) {
                ("any", _) => LaneTypes::ANY,
                (_, Some(kind)) => LaneTypes::only(kind),
                _ => {
                    let known: Vec<_> = LaneType::ALL.iter().map(|kind| kind.text()).collect();
                    anyhow::bail!("--types {word:?}: use any, {}", known.join(", "))
                }
            };
    }
    Ok(types)
}

/// Prints waypoints at equal distances.
pub(super) fn waypoints(args: &WaypointArgs) -> anyhow::Result<()> {
    for (name, metres) in [("--every", Some(args.every)), ("--step", args.step)] {
        let fits = metres.is_none_or(|metres| (1e-3..=1e6).contains(&metres));
        anyhow::ensure!(fits, "{name} is {}; use 0.001 to 1000000", metres.unwrap_or(0.0));
    }
    let types = lane_types(&args.types)?;
    let Loaded { network, .. } = args.source.load()?;
    write_stdout(|out| {
        for at in network.waypoints(args.every, types) {
            serde_json::to_writer(&mut *out, &waypoint_line(&network, at, args.step))?;
            out.write_all(b"\n")?;
        }
        Ok(())
    })
}

/// Describes one waypoint.
pub(super) fn waypoint_line(
    network: &Network,
    at: LanePoint,
    step_m: Option<f64>,
) -> WaypointLine<'_> {
    let lane = network.lane(at.lane);
    let pose = network.place(at);
    let marks = network.marks(at);
    let junction = lane.junction.map(|index| network.junctions()[index as usize].id.as_str());
    let id = |lane: Option<road::LaneIndex>| lane.map(|lane| network.lane(lane).id);
    let names = |points: Vec<LanePoint>| {
        points.into_iter().map(|at| point_name(network, at)).collect::<Vec<_>>()
    };
    WaypointLine {
        name: point_name(network, at),
        id: network.waypoint_id(at),
        x_m: pose.position.x,
        y_m: pose.position.y,
        z_m: pose.position.z,
        heading_rad: pose.heading_rad,
        pitch_rad: pose.pitch_rad,
        roll_rad: pose.roll_rad,
        curvature_per_m: pose.curvature_per_m,
        width_m: network.width(at),
        kind: lane.kind.text(),
        forward: lane.forward,
        junction,
        lane_change: match (marks.left_change, marks.right_change) {
            (false, false) => "none",
            (true, false) => "left",
            (false, true) => "right",
            (true, true) => "both",
        },
        left: id(lane.left),
        right: id(lane.right),
        left_mark: marks.left.map(mark_line),
        right_mark: marks.right.map(mark_line),
        speed_limit_mps: network.speed_limit(at),
        successors: lane.successors.iter().map(|next| lane_name(network, *next)).collect(),
        next: step_m.map(|step_m| names(network.advance(at, step_m))),
        previous: step_m.map(|step_m| names(network.retreat(at, step_m))),
    }
}

fn mark_line(mark: &RoadMark) -> MarkLine {
    MarkLine {
        kind: mark.kind.text(),
        color: mark.color.text(),
        width_m: mark.width_m,
        change: mark.change.text(),
    }
}

/// Prints each pair of connected driving lanes; the second is null where a lane ends.
pub(super) fn topology(source: &Source) -> anyhow::Result<()> {
    #[derive(Serialize)]
    struct Line<'a> {
        from: LaneName<'a>,
        to: Option<LaneName<'a>>,
    }
    let Loaded { network, .. } = source.load()?;
    write_stdout(|out| {
        let driving = network.lanes().iter().filter(|lane| LaneTypes::DRIVING.contains(lane.kind));
        for lane in driving {
            let ends = lane.successors.iter().map(|next| Some(lane_name(&network, *next)));
            let dead_end = lane.successors.is_empty().then_some(None);
            for to in ends.chain(dead_end) {
                serde_json::to_writer(
                    &mut *out,
                    &Line { from: lane_name(&network, lane.index), to },
                )?;
                out.write_all(b"\n")?;
            }
        }
        Ok(())
    })
}

/// Prints every position where a sign or traffic light applies.
pub(super) fn landmarks(source: &Source) -> anyhow::Result<()> {
    #[derive(Serialize)]
    struct Line<'a> {
        id: &'a str,
        name: &'a str,
        road: &'a str,
        s_m: f64,
        t_m: f64,
        orientation: &'static str,
        is_reference: bool,
        validity: &'a [(i32, i32)],
        #[serde(rename = "type")]
        kind: &'a str,
        subtype: &'a str,
        country: &'a str,
        value: Option<f64>,
        unit: &'a str,
        text: &'a str,
        is_dynamic: bool,
        width_m: f64,
        height_m: f64,
        z_offset_m: f64,
        h_offset_rad: f64,
        pitch_rad: f64,
        roll_rad: f64,
        signal: SignalPlace<'a>,
        controller: Option<&'a str>,
        lanes: Vec<PointName<'a>>,
    }
    #[derive(Serialize)]
    struct SignalPlace<'a> {
        road: &'a str,
        s_m: f64,
        t_m: f64,
        x_m: f64,
        y_m: f64,
        z_m: f64,
        heading_rad: f64,
    }
    let Loaded { network, .. } = source.load()?;
    let road_id = |road: u32| network.roads()[road as usize].id.as_str();
    write_stdout(|out| {
        for landmark in network.landmarks() {
            let signal = &network.signals()[landmark.signal as usize];
            let lanes = signal.lanes.iter();
            let points = lanes.map(|(lane, along_m)| LanePoint { lane: *lane, along_m: *along_m });
            let on_road = points.filter(|at| network.lane(at.lane).road == landmark.rules.road);
            let position = signal.pose.position;
            let line = Line {
                id: &signal.id,
                name: &signal.name,
                road: road_id(landmark.rules.road),
                s_m: landmark.rules.s,
                t_m: landmark.rules.t,
                orientation: landmark.rules.orientation.text(),
                is_reference: landmark.rules.is_reference,
                validity: &landmark.rules.validity,
                kind: &signal.kind,
                subtype: &signal.subtype,
                country: &signal.country,
                value: signal.value,
                unit: &signal.unit,
                text: &signal.text,
                is_dynamic: signal.dynamic,
                width_m: signal.width_m,
                height_m: signal.height_m,
                z_offset_m: signal.z_offset_m,
                h_offset_rad: signal.h_offset_rad,
                pitch_rad: signal.pitch_rad,
                roll_rad: signal.roll_rad,
                signal: SignalPlace {
                    road: road_id(signal.road),
                    s_m: signal.s,
                    t_m: signal.t,
                    x_m: position.x,
                    y_m: position.y,
                    z_m: position.z,
                    heading_rad: signal.pose.heading_rad,
                },
                controller: signal
                    .controller
                    .map(|c| network.controllers()[c as usize].id.as_str()),
                lanes: on_road.map(|at| point_name(&network, at)).collect(),
            };
            serde_json::to_writer(&mut *out, &line)?;
            out.write_all(b"\n")?;
        }
        Ok(())
    })
}

/// Prints the outline of every crosswalk.
pub(super) fn crosswalks(source: &Source) -> anyhow::Result<()> {
    #[derive(Serialize)]
    struct Line<'a> {
        id: &'a str,
        road: &'a str,
        s_m: f64,
        corners_m: Vec<[f64; 3]>,
    }
    let Loaded { network, .. } = source.load()?;
    write_stdout(|out| {
        for crosswalk in network.crosswalks() {
            let line = Line {
                id: &crosswalk.object.id,
                road: &network.roads()[crosswalk.object.road as usize].id,
                s_m: crosswalk.object.s,
                corners_m: crosswalk.corners.iter().map(|corner| corner.to_array()).collect(),
            };
            serde_json::to_writer(&mut *out, &line)?;
            out.write_all(b"\n")?;
        }
        Ok(())
    })
}
