//! The lanes of the map in plain form, `lanes.json`, and the lane lines in a camera's image.

use glam::{Affine3A, DVec3, Vec3A};
use protocol::{ActorState, kind};
use road::{LaneIndex, LanePoint, LaneType, MarkKind, Network, RoadMark};
use serde::{Deserialize, Serialize};

use crate::collect::{
    CollectError,
    camera_model::{CameraModel, NEAR_M},
    folder::{Folder, write_atomically},
};

/// The distance between points of a line before those in a straight row are left out. Metres.
const STEP_M: f64 = 1.0;
/// How far a point may lie beside the straight line between its neighbours to be left out. Metres.
const STRAIGHT_M: f64 = 0.01;
/// Lane lines in images end here. Metres along the optical axis.
pub(crate) const RANGE_M: f32 = 80.0;

/// `lanes.json`: the map in world space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaneMap {
    pub(crate) lanes: Vec<LaneEntry>,
    pub(crate) boundaries: Vec<Boundary>,
    pub(crate) crosswalks: Vec<CrosswalkEntry>,
    pub(crate) stop_lines: Vec<StopLine>,
    pub(crate) signals: Vec<SignalEntry>,
}

/// One lane of one section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaneEntry {
    /// OpenDRIVE's id of the road.
    pub(crate) road: String,
    pub(crate) section: u32,
    /// OpenDRIVE's id of the lane.
    pub(crate) lane_id: i32,
    /// OpenDRIVE's type of the lane.
    #[serde(rename = "type")]
    pub(crate) kind: String,
    /// OpenDRIVE's id of the junction that the road belongs to.
    pub(crate) junction: Option<String>,
    /// Where the lane begins.
    pub(crate) speed_limit_mps: Option<f64>,
    /// Indices of lanes, in driving direction.
    pub(crate) successors: Vec<u32>,
    pub(crate) predecessors: Vec<u32>,
    pub(crate) left: Option<u32>,
    pub(crate) right: Option<u32>,
    /// Whether marks allow a change anywhere.
    pub(crate) may_change_left: bool,
    pub(crate) may_change_right: bool,
    /// The centre line in driving direction.
    pub(crate) points_m: Vec<[f64; 3]>,
}

/// A border between two lanes, or at the edge of a road, where it has one mark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Boundary {
    /// OpenDRIVE's id of the road.
    pub(crate) road: String,
    pub(crate) section: u32,
    /// OpenDRIVE's ids of the lanes on both sides, seen along the points; `None` at an edge.
    pub(crate) left_lane_id: Option<i32>,
    pub(crate) right_lane_id: Option<i32>,
    /// OpenDRIVE's names; `none` is no mark.
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) color: String,
    /// Of a single line.
    pub(crate) width_m: f64,
    /// In which directions of lane ids it may be crossed.
    pub(crate) lane_change: String,
    /// Along rising s.
    pub(crate) points_m: Vec<[f64; 3]>,
}

/// A crosswalk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CrosswalkEntry {
    /// OpenDRIVE's id of the object.
    pub(crate) id: String,
    pub(crate) road: String,
    /// The first corner is not repeated.
    pub(crate) corners_m: Vec<[f64; 3]>,
}

/// Where traffic of one lane waits for a signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StopLine {
    /// Index of the signal.
    pub(crate) signal: u32,
    /// Index of the lane.
    pub(crate) lane: u32,
    /// The left and the right end.
    pub(crate) points_m: [[f64; 3]; 2],
}

/// A traffic light or sign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SignalEntry {
    /// OpenDRIVE's attributes.
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) road: String,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) subtype: String,
    pub(crate) country: String,
    pub(crate) value: Option<f64>,
    pub(crate) unit: String,
    pub(crate) text: String,
    pub(crate) is_traffic_light: bool,
    /// Of a traffic light: its id in images and boxes.
    pub(crate) actor_id: Option<u32>,
    pub(crate) position_m: [f64; 3],
    /// The direction that its face looks in, counter-clockwise from x.
    pub(crate) heading_rad: f64,
    /// Indices of the lanes that it applies to.
    pub(crate) lanes: Vec<u32>,
}

/// A file of `lanes/`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FrameLanes {
    pub(crate) frame: u64,
    pub(crate) cameras: std::collections::BTreeMap<String, Vec<ImageLine>>,
}

/// A visible part of a boundary with a mark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ImageLine {
    /// Index of the boundary in `lanes.json`, and what it says.
    pub(crate) boundary: u32,
    pub(crate) road: String,
    pub(crate) left_lane_id: Option<i32>,
    pub(crate) right_lane_id: Option<i32>,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) color: String,
    pub(crate) points_px: Vec<[f32; 2]>,
}

impl LaneMap {
    /// Describes a map. `town` and `actors` say which actor a traffic light is.
    pub(crate) fn new(network: &Network, heads: &[town::Head], actors: &[ActorState]) -> LaneMap {
        let mut map = LaneMap {
            lanes: network.lanes().iter().map(|lane| lane_entry(network, lane)).collect(),
            ..LaneMap::default()
        };
        for road in network.roads() {
            for (number, section) in (0..).zip(&road.sections) {
                for border in borders(network, section) {
                    add_boundaries(&mut map.boundaries, network, &road.id, number, &border);
                }
            }
        }
        let road_id = |road: u32| network.roads()[road as usize].id.clone();
        map.crosswalks.extend(network.crosswalks().map(|walk| CrosswalkEntry {
            id: walk.object.id.clone(),
            road: road_id(walk.object.road),
            corners_m: walk.corners.iter().map(|corner| millimetres(*corner)).collect(),
        }));
        for (number, signal) in (0..).zip(network.signals()) {
            let lights = || actors.iter().filter(|actor| actor.kind == kind::TRAFFIC_LIGHT);
            let head = heads.iter().find(|head| head.signal == number);
            let actor = head.and_then(|head| {
                lights().find(|actor| actor.pose.position().distance(head.position) < 0.01)
            });
            map.signals.push(SignalEntry {
                id: signal.id.clone(),
                name: signal.name.clone(),
                road: road_id(signal.road),
                kind: signal.kind.clone(),
                subtype: signal.subtype.clone(),
                country: signal.country.clone(),
                value: signal.value,
                unit: signal.unit.clone(),
                text: signal.text.clone(),
                is_traffic_light: signal.dynamic,
                actor_id: actor.map(|actor| actor.actor_id.0),
                position_m: millimetres(signal.pose.position),
                heading_rad: signal.pose.heading_rad,
                lanes: signal.lanes.iter().map(|(lane, _)| lane.0).collect(),
            });
            if signal.dynamic || signal.kind == STOP_SIGN {
                map.stop_lines.extend(stop_lines(network, number, signal));
            }
        }
        map
    }

    /// Writes the file.
    pub(crate) fn write(&self, folder: &Folder) -> Result<(), CollectError> {
        let mut text = serde_json::to_vec(self).expect("plain data has a JSON form");
        text.push(b'\n');
        write_atomically(&folder.root().join(LANES), &text)
    }
}

/// The name of the file.
pub(crate) const LANES: &str = "lanes.json";

/// OpenDRIVE's type of a stop sign, in Germany's catalogue.
const STOP_SIGN: &str = "206";

fn lane_entry(network: &Network, lane: &road::Lane) -> LaneEntry {
    let junction = lane.junction.map(|index| network.junctions()[index as usize].id.clone());
    let index = |lane: LaneIndex| lane.0;
    LaneEntry {
        road: network.roads()[lane.road as usize].id.clone(),
        section: lane.section,
        lane_id: lane.id,
        kind: lane.kind.text().to_owned(),
        junction,
        speed_limit_mps: lane.speed_limit_mps,
        successors: lane.successors.iter().copied().map(index).collect(),
        predecessors: lane.predecessors.iter().copied().map(index).collect(),
        left: lane.left.map(index),
        right: lane.right.map(index),
        may_change_left: lane.left_change,
        may_change_right: lane.right_change,
        points_m: line(0.0, lane.length_m, |along_m| {
            network.place_at(lane.index, along_m, 0.0).position
        }),
    }
}

fn stop_lines(network: &Network, number: u32, signal: &road::Signal) -> Vec<StopLine> {
    let approaches = network.approaches(signal).into_iter();
    let driven = approaches.filter(|at| network.lane(at.lane).kind == LaneType::Driving);
    let across = |at: LanePoint| {
        let half = network.width(at) * 0.5;
        let end = |left| millimetres(network.place_at(at.lane, at.along_m, left).position);
        StopLine { signal: number, lane: at.lane.0, points_m: [end(half), end(-half)] }
    };
    driven.map(across).collect()
}

/// One border of a section, along one of its lanes.
struct Border<'a> {
    lane: &'a road::Lane,
    /// Whether it is the lane's border to the left along rising s.
    is_left: bool,
    left_lane_id: Option<i32>,
    right_lane_id: Option<i32>,
    marks: &'a [RoadMark],
}

/// Returns the borders of a section from left to right.
fn borders<'a>(network: &'a Network, section: &'a road::Section) -> Vec<Border<'a>> {
    let lanes: Vec<_> = section.lanes.iter().map(|lane| network.lane(*lane)).collect();
    let mut borders = Vec::new();
    for place in 0..=lanes.len() {
        let left = place.checked_sub(1).map(|at| lanes[at]);
        let right = lanes.get(place).copied();
        let ids = [left, right].map(|lane| lane.map(|lane| lane.id));
        // A lane has the marks of its outer border.
        let (lane, is_left, marks) = match (left, right) {
            (_, Some(right)) if right.id > 0 => (right, true, &right.marks),
            (Some(left), _) if left.id < 0 => (left, false, &left.marks),
            (_, Some(right)) => (right, true, &section.marks),
            (Some(left), None) => (left, false, &section.marks),
            (None, None) => continue,
        };
        let [left_lane_id, right_lane_id] = ids;
        borders.push(Border { lane, is_left, left_lane_id, right_lane_id, marks });
    }
    borders
}

/// Adds a border, in one part for each of its marks.
fn add_boundaries(
    boundaries: &mut Vec<Boundary>,
    network: &Network,
    road: &str,
    section: u32,
    border: &Border,
) {
    let lane = border.lane;
    let point = |ds: f64| {
        let along_m = if lane.forward { ds } else { lane.length_m - ds };
        let half = network.width(LanePoint { lane: lane.index, along_m }) * 0.5;
        let to_left = if border.is_left == lane.forward { half } else { -half };
        network.place_at(lane.index, along_m, to_left).position
    };
    let mut starts = vec![(0.0, None)];
    for mark in border.marks {
        if mark.from_m <= 1e-6 {
            starts.clear();
        }
        starts.push((mark.from_m.clamp(0.0, lane.length_m), Some(mark)));
    }
    let ends: Vec<f64> =
        starts.iter().skip(1).map(|start| start.0).chain([lane.length_m]).collect();
    for ((from, mark), to) in starts.into_iter().zip(ends) {
        if to - from < 1e-6 {
            continue;
        }
        boundaries.push(Boundary {
            road: road.to_owned(),
            section,
            left_lane_id: border.left_lane_id,
            right_lane_id: border.right_lane_id,
            kind: mark.map_or(MarkKind::None, |mark| mark.kind).text().to_owned(),
            color: mark.map_or("", |mark| mark.color.text()).to_owned(),
            width_m: mark.map_or(0.0, |mark| mark.width_m),
            lane_change: mark.map_or("both", |mark| mark.change.text()).to_owned(),
            points_m: line(from, to, point),
        });
    }
}

/// Returns points from `from` to `to`, without those in a straight row.
fn line(from: f64, to: f64, point: impl Fn(f64) -> DVec3) -> Vec<[f64; 3]> {
    let steps = ((to - from) / STEP_M).ceil().max(1.0) as usize;
    let at = |step: usize| point(from + (to - from) * step as f64 / steps as f64);
    let all: Vec<DVec3> = (0..=steps).map(at).collect();
    let mut kept = vec![0];
    while let Some(last) = kept.last().copied()
        && last < steps
    {
        // Twice as far as long as all points between lie on the straight line.
        let mut next = last + 1;
        let mut reach = 2;
        while last + reach <= steps && is_straight(&all[last..=last + reach]) {
            next = last + reach;
            reach *= 2;
        }
        kept.push(next);
    }
    kept.into_iter().map(|at| millimetres(all[at])).collect()
}

/// Whether all points lie close to the line from the first to the last.
fn is_straight(points: &[DVec3]) -> bool {
    let (first, last) = (points[0], points[points.len() - 1]);
    let along = (last - first).normalize_or_zero();
    let beside = |point: &DVec3| (point - first - along * (point - first).dot(along)).length();
    points.iter().all(|point| beside(point) < STRAIGHT_M)
}

fn millimetres(point: DVec3) -> [f64; 3] {
    // Adding zero turns -0 into 0.
    point.to_array().map(|value| (value * 1000.0).round() / 1000.0 + 0.0)
}

/// The boundaries with a mark, for projection.
pub(crate) struct LaneLines {
    boundaries: Vec<Boundary>,
    lines: Vec<Line>,
}

struct Line {
    boundary: u32,
    /// A ball around all points.
    center: Vec3A,
    radius_m: f32,
    points: Vec<Vec3A>,
}

impl LaneLines {
    pub(crate) fn new(map: LaneMap) -> LaneLines {
        let is_marked = |one: &&(u32, &Boundary)| one.1.kind != MarkKind::None.text();
        let line = |(boundary, one): (u32, &Boundary)| {
            let point = |at: &[f64; 3]| DVec3::from_array(*at).as_vec3a();
            let points: Vec<Vec3A> = one.points_m.iter().map(point).collect();
            let low = points.iter().copied().fold(Vec3A::MAX, Vec3A::min);
            let high = points.iter().copied().fold(Vec3A::MIN, Vec3A::max);
            let radius_m = low.distance(high) * 0.5;
            Line { boundary, center: (low + high) * 0.5, radius_m, points }
        };
        let lines = (0..).zip(&map.boundaries).filter(|one| is_marked(&one)).map(line).collect();
        LaneLines { boundaries: map.boundaries, lines }
    }

    /// Returns the lines in an image, whether or not something hides them.
    pub(crate) fn in_image(
        &self,
        optical_from_world: &Affine3A,
        camera: &CameraModel,
    ) -> Vec<ImageLine> {
        let mut found = Vec::new();
        for line in &self.lines {
            let center = optical_from_world.transform_point3a(line.center);
            let is_behind = camera.is_pinhole() && center.z + line.radius_m < NEAR_M;
            if is_behind || camera.depth(center) - line.radius_m > RANGE_M {
                continue;
            }
            let points: Vec<Vec3A> =
                line.points.iter().map(|at| optical_from_world.transform_point3a(*at)).collect();
            let parts = match camera.pinhole_edges() {
                Some(edges) => clipped(&points, camera, edges),
                None => bent(&points, camera),
            };
            for points_px in parts {
                let one = &self.boundaries[line.boundary as usize];
                found.push(ImageLine {
                    boundary: line.boundary,
                    road: one.road.clone(),
                    left_lane_id: one.left_lane_id,
                    right_lane_id: one.right_lane_id,
                    kind: one.kind.clone(),
                    color: one.color.clone(),
                    points_px,
                });
            }
        }
        found
    }
}

/// Returns the parts of a line in optical space that lie in the image and in range.
fn clipped(points: &[Vec3A], camera: &CameraModel, edges: [f32; 4]) -> Vec<Vec<[f32; 2]>> {
    let mut parts: Vec<Vec<[f32; 2]>> = Vec::new();
    let mut is_open = false;
    for ends in points.windows(2) {
        let Some(([a, b], is_cut)) = clipped_segment([ends[0], ends[1]], camera, edges) else {
            is_open = false;
            continue;
        };
        match parts.last_mut().filter(|_| is_open) {
            Some(part) => part.push(b),
            None => parts.push(vec![a, b]),
        }
        is_open = !is_cut;
    }
    parts
}

/// Returns the visible part of a segment in the image, and whether its end is cut off.
fn clipped_segment(
    [a, b]: [Vec3A; 2],
    camera: &CameraModel,
    [left, top, right, bottom]: [f32; 4],
) -> Option<([[f32; 2]; 2], bool)> {
    // The half spaces of what is in range, and of the four edges of the image; inside is positive.
    let inside = |p: Vec3A| {
        [
            p.z - NEAR_M,
            RANGE_M - p.z,
            p.x - left * p.z,
            right * p.z - p.x,
            p.y - top * p.z,
            bottom * p.z - p.y,
        ]
    };
    let (mut from, mut to) = (0.0_f32, 1.0_f32);
    for (here, there) in inside(a).into_iter().zip(inside(b)) {
        if here < 0.0 && there < 0.0 {
            return None;
        }
        if (here < 0.0) != (there < 0.0) {
            let share = here / (here - there);
            if here < 0.0 { from = from.max(share) } else { to = to.min(share) }
        }
    }
    let pixel = |share: f32| {
        let at = a.lerp(b, share);
        rounded(camera.project(Vec3A::new(at.x, at.y, at.z.max(NEAR_M))).unwrap_or_default())
    };
    (from < to).then(|| ([pixel(from), pixel(to)], to < 1.0))
}

/// Returns a pixel to a hundredth; a rounded point stays in the image.
fn rounded(pixel: [f32; 2]) -> [f32; 2] {
    pixel.map(|px| (px * 100.0).round() / 100.0 + 0.0)
}

/// Returns the parts of a line in optical space that lie in the image of a lens and in range, with points so
/// close to each other that the lines between them are straight in the image.
fn bent(points: &[Vec3A], camera: &CameraModel) -> Vec<Vec<[f32; 2]>> {
    const STEP_M: f32 = 0.5;
    const BEND_MAX_PX: f32 = 0.1;
    let size = [camera.width, camera.height].map(|size| size as f32);
    let pixel = |at: Vec3A| {
        let pixel = camera.project(at).filter(|_| camera.depth(at) <= RANGE_M)?;
        let is_inside = (0..2).all(|axis| (0.0..=size[axis]).contains(&pixel[axis]));
        is_inside.then_some(pixel)
    };
    let mut parts: Vec<Vec<[f32; 2]>> = Vec::new();
    let mut last: Option<(Vec3A, Option<[f32; 2]>)> = None;
    for ends in points.windows(2) {
        let steps = (ends[0].distance(ends[1]) / STEP_M).ceil().max(1.0);
        let first = usize::from(last.is_some());
        for step in first..=steps as usize {
            let at = ends[0].lerp(ends[1], step as f32 / steps);
            let here = pixel(at);
            let before = last.replace((at, here));
            let Some((was_at, was)) = before else {
                parts.extend(here.map(|here| vec![here]));
                continue;
            };
            if was.is_none() && here.is_none() {
                continue;
            }
            if was.is_some() && here.is_some() {
                if let Some(part) = parts.last_mut() {
                    part.extend(here);
                }
                continue;
            }
            // Where it crosses the edge of the image or of the range.
            let (mut inside, mut outside) =
                if here.is_some() { (at, was_at) } else { (was_at, at) };
            for _ in 0..16 {
                let middle = (inside + outside) * 0.5;
                if pixel(middle).is_some() { inside = middle } else { outside = middle }
            }
            let Some(cut) = pixel(inside) else { continue };
            match (here, parts.last_mut()) {
                (None, Some(part)) => part.push(cut),
                (Some(here), _) => parts.push(vec![cut, here]),
                (None, None) => {}
            }
        }
    }
    for part in &mut parts {
        straighten(part, BEND_MAX_PX);
        part.iter_mut().for_each(|pixel| *pixel = rounded(*pixel));
    }
    parts.retain(|part| part.len() > 1);
    parts
}

/// Leaves out points that are closer than `most` to the line without them (Ramer 1972, Douglas and Peucker
/// 1973).
fn straighten(points: &mut Vec<[f32; 2]>, most: f32) {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        (keep[first], keep[last]) = (true, true);
        let along = [0, 1].map(|axis| points[last][axis] - points[first][axis]);
        let length = along[0].hypot(along[1]).max(1e-6);
        let off = |at: usize| {
            let from = [0, 1].map(|axis| points[at][axis] - points[first][axis]);
            (along[0] * from[1] - along[1] * from[0]).abs() / length
        };
        let farthest = (first + 1..last).max_by(|a, b| off(*a).total_cmp(&off(*b)));
        if let Some(at) = farthest.filter(|at| off(*at) > most) {
            open.extend([(first, at), (at, last)]);
        }
    }
    let mut kept = keep.iter();
    points.retain(|_| kept.next().copied().unwrap_or(true));
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::collect::camera_model::tests::{fisheye, pinhole};

    fn clipped_by_pinhole(points: &[Vec3A]) -> Vec<Vec<[f32; 2]>> {
        let camera = pinhole();
        clipped(points, &camera, camera.pinhole_edges().unwrap())
    }

    fn straight() -> (Network, LaneMap) {
        let text = mapgen::named("Flatford").expect("a named town");
        let network = Network::parse(&text).expect("a map");
        let map = LaneMap::new(&network, &[], &[]);
        (network, map)
    }

    #[test]
    fn boundaries_lie_beside_the_centres_of_their_lanes() {
        let (network, map) = straight();
        assert_eq!(map.lanes.len(), network.lanes().len());
        let mut checked = 0;
        for lane in network.lanes().iter().filter(|lane| lane.kind == LaneType::Driving) {
            let entry = &map.lanes[lane.index.0 as usize];
            let of = |ids: [Option<i32>; 2]| ids.contains(&Some(lane.id));
            let beside: Vec<_> = map
                .boundaries
                .iter()
                .filter(|one| one.road == entry.road && one.section == entry.section)
                .filter(|one| of([one.left_lane_id, one.right_lane_id]))
                .collect();
            assert!(beside.len() >= 2, "a border on each side of {entry:?}");
            // Where the road begins, which is the end of a lane that is driven the other way.
            let along_m = if lane.forward { 0.0 } else { lane.length_m };
            let half = network.width(LanePoint { lane: lane.index, along_m }) * 0.5;
            let mut center = entry.points_m.iter().map(|point| DVec3::from_array(*point));
            let ends = if lane.forward {
                [center.next(), center.next()]
            } else {
                [center.next_back(), center.next_back()]
            };
            let [Some(first), Some(next)] = ends else { panic!("a line of one point: {entry:?}") };
            let ahead = (next - first).normalize_or_zero();
            for one in beside {
                let apart = DVec3::from_array(one.points_m[0]) - first;
                // A border of several marks has parts that begin further on.
                if apart.length() < half + 1.0 {
                    let is_on_the_right = one.left_lane_id == Some(lane.id);
                    let to_left = if is_on_the_right { -half } else { half };
                    let left = DVec3::Z.cross(ahead).dot(apart);
                    assert!((left - to_left).abs() < 0.05, "{left} {to_left} {one:?}");
                    checked += 1;
                }
            }
        }
        assert!(checked > 100, "{checked}");
        assert!(map.boundaries.iter().any(|one| one.kind == "broken"));
        assert!(map.signals.iter().any(|one| one.is_traffic_light));
        assert!(!map.crosswalks.is_empty() && !map.stop_lines.is_empty());
    }

    #[test]
    fn points_in_a_straight_row_are_left_out_and_bends_are_kept() {
        let row = line(0.0, 100.0, |s| DVec3::new(s, 0.0, 0.0));
        assert_eq!(row, [[0.0, 0.0, 0.0], [64.0, 0.0, 0.0], [96.0, 0.0, 0.0], [100.0, 0.0, 0.0]]);
        let bend = |s: f64| DVec3::new((s / 20.0).cos(), (s / 20.0).sin(), 0.0) * 20.0;
        let kept = line(0.0, 60.0, bend);
        assert!(kept.len() > 15, "{}", kept.len());
    }

    #[test]
    fn a_line_is_clipped_to_the_image_and_to_the_range() {
        // On the ground 1 m below, straight ahead from behind the camera to far away.
        let ahead = [Vec3A::new(0.0, 1.0, -5.0), Vec3A::new(0.0, 1.0, 300.0)];
        let parts = clipped_by_pinhole(&ahead);
        assert_eq!(parts, [vec![[100.0, 100.0], [100.0, 51.25]]], "from 2 m to 80 m");
        // Across: leaves the image on both sides.
        let across = [Vec3A::new(-50.0, 1.0, 10.0), Vec3A::new(50.0, 1.0, 10.0)];
        assert_eq!(clipped_by_pinhole(&across), [vec![[0.0, 60.0], [200.0, 60.0]]]);
        let behind = [Vec3A::new(0.0, 1.0, -5.0), Vec3A::new(0.0, 1.0, -1.0)];
        assert!(clipped_by_pinhole(&behind).is_empty());
        // Out and in again: two parts.
        let zigzag = [[0.0, 10.0], [30.0, 10.0], [0.0, 20.0]].map(|[x, z]| Vec3A::new(x, 1.0, z));
        assert_eq!(clipped_by_pinhole(&zigzag).len(), 2);
    }

    #[test]
    fn a_fisheye_bends_a_line_and_shows_it_beside_the_camera() {
        // On the ground 1 m below and 2 m to the right, from behind the camera to far ahead.
        let (camera, x, y) = (fisheye(), 2.0_f32, 1.0_f32);
        let line = [Vec3A::new(x, y, -20.0), Vec3A::new(x, y, 300.0)];
        let parts = bent(&line, &camera);
        assert_eq!(parts.len(), 1, "{parts:?}");
        let part = &parts[0];
        for [u, v] in part {
            // Parallel to the axis: on a straight line through the principal point.
            let (right, down) = (u - 100.0, v - 50.0);
            assert!((right * y - down * x).abs() < 0.05 * right.hypot(down).max(1.0), "{u} {v}");
        }
        // From the circle of 95 degrees, 99.5 pixels, to 80 m ahead.
        let radius = |[u, v]: [f32; 2]| (u - 100.0).hypot(v - 50.0);
        assert!((radius(part[0]) - 99.48).abs() < 0.3, "{part:?}");
        assert!((radius(part[part.len() - 1]) - 60.0 * (5.0_f32.sqrt() / 80.0).asin()).abs() < 0.1);
        // Ahead of the camera and across it is bent.
        let across = [Vec3A::new(-6.0, 1.0, 3.0), Vec3A::new(6.0, 1.0, 3.0)];
        let part = &bent(&across, &camera)[0];
        assert!(part.len() >= 7, "{part:?}");
        let middle = part.iter().map(|pixel| pixel[1]).fold(0.0, f32::max);
        assert!(middle - part[0][1] > 5.0, "{part:?}");
    }
}
