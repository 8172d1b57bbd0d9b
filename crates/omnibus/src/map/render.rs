//! `omnibus map render`: draws the map as seen from above.

use std::path::PathBuf;

use glam::DVec2;
use road::{Lane, LanePoint, LaneType, MarkColor, MarkKind, Network, Road};

use crate::map::{
    canvas::{Color, Drawing, Shape},
    output::write_file,
    source::{Loaded, Source},
};

/// Arguments of `omnibus map render`.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    source: Source,
    /// The picture to write, .png or .svg
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Pixels of the longer side, 64 to 16384
    #[arg(long, default_value_t = 2048)]
    pixels: u32,
    /// Draw only a square around a point: X,Y,METRES of its side
    #[arg(long, value_name = "X,Y,METRES", allow_hyphen_values = true, value_delimiter = ',')]
    around: Vec<f64>,
    /// Leave out numbers, signals and spawn points
    #[arg(long)]
    plain: bool,
}

/// Draws the map.
pub(super) fn render(args: &RenderArgs) -> anyhow::Result<()> {
    anyhow::ensure!(
        (64..=16384).contains(&args.pixels),
        "--pixels is {}; use 64 to 16384",
        args.pixels
    );
    let extension = args.out.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let is_svg = extension.eq_ignore_ascii_case("svg");
    anyhow::ensure!(
        is_svg || extension.eq_ignore_ascii_case("png"),
        "--out {}: the name must end in .png or .svg",
        args.out.display()
    );
    let Loaded { network, .. } = args.source.load()?;
    let (low, high) = network.bounds();
    let (low, high) = match args.around.as_slice() {
        [] => (low.truncate() - MARGIN_M, high.truncate() + MARGIN_M),
        [x, y, metres] if *metres > 0.0 && metres.is_finite() => {
            (DVec2::new(*x, *y) - 0.5 * metres, DVec2::new(*x, *y) + 0.5 * metres)
        }
        other => anyhow::bail!("--around {other:?}: use X,Y,METRES"),
    };
    let pixels_per_m = f64::from(args.pixels) / (high - low).max_element();
    let side = |metres: f64| ((metres * pixels_per_m).ceil() as u32).clamp(1, args.pixels);
    let drawing = Drawing {
        low,
        size: [side(high.x - low.x), side(high.y - low.y)],
        pixels_per_m,
        background: [233, 238, 226, 255],
        shapes: shapes(&network, (low, high), pixels_per_m, args.plain),
    };
    write_file(
        &args.out,
        |file| {
            if is_svg { drawing.write_svg(file) } else { drawing.write_png(file) }
        },
    )?;
    let [width, height] = drawing.size;
    print_line!("{}: {width}x{height}, {pixels_per_m:.2} pixels a metre", args.out.display());
    Ok(())
}

const MARGIN_M: f64 = 15.0;
/// Letters and dots are drawn from this scale on, in pixels per metre.
const LANE_WORDS_FROM: f64 = 8.0;

fn shapes(network: &Network, window: (DVec2, DVec2), pixels_per_m: f64, plain: bool) -> Vec<Shape> {
    let step_m = (4.0 / pixels_per_m).clamp(0.5, 10.0);
    // Driving lanes cover everything else in a junction.
    let mut below = Vec::new();
    let mut above = Vec::new();
    let mut lines = Vec::new();
    for lane in network.lanes() {
        let edges = Edges::of(network, lane, step_m);
        if !edges.reaches(window) {
            continue;
        }
        let area = Shape::Area { corners: edges.outline(), color: color_of(lane.kind) };
        let driven = road::LaneTypes::DRIVABLE.contains(lane.kind);
        if driven {
            above.push(area)
        } else {
            below.push(area)
        }
        let in_junction = lane.junction.is_some();
        marks(network, lane, &edges, in_junction, &mut lines);
    }
    below.append(&mut above);
    let mut shapes = below;
    for crosswalk in network.crosswalks() {
        let corners = crosswalk.corners.iter().map(|corner| corner.truncate()).collect();
        shapes.push(Shape::Area { corners, color: [240, 240, 240, 150] });
    }
    shapes.append(&mut lines);
    if !plain {
        words(network, pixels_per_m, &mut shapes);
    }
    shapes
}

/// The two borders of a lane, along increasing s.
struct Edges {
    left: Vec<DVec2>,
    right: Vec<DVec2>,
}

impl Edges {
    fn of(network: &Network, lane: &Lane, step_m: f64) -> Edges {
        let steps = (lane.length_m / step_m).ceil().clamp(1.0, 1e5) as usize;
        let mut edges = Edges { left: Vec::new(), right: Vec::new() };
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            let share = if lane.forward { share } else { 1.0 - share };
            let along_m = lane.length_m * share;
            let half = 0.5 * network.width(LanePoint { lane: lane.index, along_m });
            let side = |left: f64| network.place_at(lane.index, along_m, left).position.truncate();
            let (left, right) = if lane.forward { (half, -half) } else { (-half, half) };
            edges.left.push(side(left));
            edges.right.push(side(right));
        }
        edges
    }

    fn outline(&self) -> Vec<DVec2> {
        self.left.iter().chain(self.right.iter().rev()).copied().collect()
    }

    fn reaches(&self, (low, high): (DVec2, DVec2)) -> bool {
        let points = || self.left.iter().chain(&self.right);
        let least = points().fold(DVec2::INFINITY, |least, at| least.min(*at));
        let most = points().fold(DVec2::NEG_INFINITY, |most, at| most.max(*at));
        least.cmple(high).all() && most.cmpge(low).all()
    }
}

/// Returns the markings on a lane's outer border, and on the road's centre line beside lane -1 or
/// 1.
fn marks(network: &Network, lane: &Lane, edges: &Edges, in_junction: bool, lines: &mut Vec<Shape>) {
    let road = &network.roads()[lane.road as usize];
    let section = &road.sections[lane.section as usize];
    let outer = if lane.id > 0 { &edges.left } else { &edges.right };
    let mut borders = vec![(&lane.marks, outer)];
    let has_right = section.lanes.iter().any(|other| network.lane(*other).id == -1);
    if lane.id == -1 {
        borders.push((&section.marks, &edges.left));
    } else if lane.id == 1 && !has_right {
        borders.push((&section.marks, &edges.right));
    }
    for (marks, points) in borders {
        for (number, mark) in marks.iter().enumerate() {
            let until = marks.get(number + 1).map_or(section.length_m, |next| next.from_m);
            let at = |ds: f64| {
                let share = if section.length_m > 0.0 { ds / section.length_m } else { 0.0 };
                (share * (points.len() - 1) as f64).round().clamp(0.0, points.len() as f64 - 1.0)
            };
            let part = &points[at(mark.from_m) as usize..=at(until).max(at(mark.from_m)) as usize];
            let color = match (mark.kind, mark.color) {
                (MarkKind::None, _) => continue,
                (MarkKind::Curb, _) => [120, 120, 116, 255],
                (_, MarkColor::Yellow) => [235, 190, 40, 255],
                _ if in_junction => [255, 255, 255, 160],
                _ => [255, 255, 255, 255],
            };
            let mut line = |points: &[DVec2]| {
                let points = points.to_vec();
                lines.push(Shape::Line { points, width_m: mark.width_m, width_px: 0.7, color });
            };
            if matches!(mark.kind, MarkKind::Broken | MarkKind::BrokenBroken) {
                part.chunks(4).for_each(|dash| line(&dash[..dash.len().min(3)]));
            } else {
                line(part);
            }
        }
    }
}

/// Draws numbers of roads and lanes, directions, signals and spawn points.
fn words(network: &Network, pixels_per_m: f64, shapes: &mut Vec<Shape>) {
    if pixels_per_m >= 1.5 {
        for lane in network.lanes() {
            arrow(network, lane, pixels_per_m, shapes);
        }
    }
    for at in network.spawn_points() {
        let at = network.place(at).position.truncate();
        shapes.push(Shape::Dot { at, radius_px: 2.2, color: [30, 120, 220, 230] });
    }
    for signal in network.signals() {
        let at = signal.pose.position.truncate();
        let color = if signal.dynamic { [215, 30, 30, 255] } else { [235, 140, 0, 255] };
        let radius_px = 3.0;
        let faces = DVec2::from_angle(signal.pose.heading_rad) * (7.0 / pixels_per_m);
        shapes.push(Shape::Line {
            points: vec![at, at + faces],
            width_m: 0.0,
            width_px: 1.4,
            color,
        });
        shapes.push(Shape::Dot { at, radius_px, color });
    }
    for road in network.roads() {
        let is_readable = road.length_m * pixels_per_m > 30.0;
        if road.junction.is_none() && is_readable {
            label(network, road, shapes);
        }
    }
    for junction in network.junctions() {
        let roads = junction.roads.iter().map(|road| &network.roads()[*road as usize]);
        let middles: Vec<DVec2> = roads.filter_map(|road| middle(network, road)).collect();
        if !middles.is_empty() {
            let at = middles.iter().sum::<DVec2>() / middles.len() as f64;
            let text = format!("J{}", junction.id);
            shapes.push(Shape::Words { at, text, dot_px: 2.0, color: [120, 20, 140, 255] });
        }
    }
}

fn middle(network: &Network, road: &Road) -> Option<DVec2> {
    let section = &road.sections[road.section_at(0.5 * road.length_m)];
    let lane = network.lane(*section.lanes.first()?);
    let within = (0.5 * road.length_m - section.start_m).clamp(0.0, lane.length_m);
    let along_m = if lane.forward { within } else { lane.length_m - within };
    Some(network.place_at(lane.index, along_m, 0.0).position.truncate())
}

fn label(network: &Network, road: &Road, shapes: &mut Vec<Shape>) {
    if let Some(at) = middle(network, road) {
        let text = road.id.clone();
        shapes.push(Shape::Words { at, text, dot_px: 1.6, color: [20, 20, 20, 255] });
    }
}

/// Draws the driving direction of a lane, and its id where there is room.
fn arrow(network: &Network, lane: &Lane, pixels_per_m: f64, shapes: &mut Vec<Shape>) {
    if lane.kind != LaneType::Driving || lane.length_m < 4.0 {
        return;
    }
    let pose = network.place_at(lane.index, 0.5 * lane.length_m, 0.0);
    let point = |forward: f64, left: f64| pose.point(forward, left, 0.0).truncate();
    let corners = vec![point(1.2, 0.0), point(-0.6, 0.5), point(-0.6, -0.5)];
    shapes.push(Shape::Area { corners, color: [255, 255, 255, 150] });
    if pixels_per_m >= LANE_WORDS_FROM {
        let at = point(-2.0, 0.0);
        let text = lane.id.to_string();
        shapes.push(Shape::Words { at, text, dot_px: 1.5, color: [255, 255, 255, 255] });
    }
}

fn color_of(kind: LaneType) -> Color {
    match kind {
        LaneType::Driving | LaneType::Entry | LaneType::Exit => [88, 90, 94, 255],
        LaneType::OnRamp | LaneType::OffRamp => [100, 96, 92, 255],
        LaneType::Bidirectional => [104, 92, 92, 255],
        LaneType::Sidewalk => [196, 190, 184, 255],
        LaneType::Shoulder | LaneType::Stop => [140, 140, 138, 255],
        LaneType::Biking => [168, 104, 92, 255],
        LaneType::Parking => [112, 116, 132, 255],
        LaneType::Median => [150, 172, 120, 255],
        LaneType::Border | LaneType::Restricted => [164, 160, 152, 255],
        LaneType::Rail | LaneType::Tram => [120, 104, 96, 255],
        _ => [190, 202, 170, 255],
    }
}
