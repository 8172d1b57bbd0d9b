//! The lanes ahead of a vehicle: where its route may lead.

use std::collections::BTreeSet;

use client_lib::{
    glam::Vec3,
    road::{LaneIndex, LanePoint, LaneTypes, Network},
};

/// How far the lanes are followed, metres.
const AHEAD_M: f64 = 80.0;
/// The distance between two points, metres.
const STEP_M: f64 = 3.0;
/// A vehicle farther from its nearest lane is not on a road, metres.
const OFF_ROAD_M: f64 = 6.0;

/// Returns the centre lines of the lanes that a vehicle can follow without changing lanes, each as
/// points x, y in metres; at a fork, those of all branches.
pub(crate) fn lanes_ahead(network: &Network, position: Vec3) -> Vec<Vec<[f32; 2]>> {
    let position = position.as_dvec3();
    let Some(at) = network.nearest(position, LaneTypes::DRIVABLE) else { return Vec::new() };
    if network.place(at).position.distance(position) > OFF_ROAD_M {
        return Vec::new();
    }
    let mut lines = Vec::new();
    let mut seen: BTreeSet<LaneIndex> = BTreeSet::new();
    let mut open = vec![(at, AHEAD_M)];
    while let Some((from, left_m)) = open.pop() {
        if !seen.insert(from.lane) {
            continue;
        }
        let lane = network.lane(from.lane);
        let to_m = lane.length_m.min(from.along_m + left_m);
        let steps = ((to_m - from.along_m) / STEP_M).ceil().max(1.0);
        let point = |step: u32| {
            let along_m = from.along_m + (to_m - from.along_m) * f64::from(step) / steps;
            let place = network.place(LanePoint { lane: from.lane, along_m }).position;
            [place.x as f32, place.y as f32]
        };
        lines.push((0..=steps as u32).map(point).collect());
        let rest_m = left_m - (lane.length_m - from.along_m);
        if rest_m > 0.0 {
            let next = |lane: &LaneIndex| (LanePoint { lane: *lane, along_m: 0.0 }, rest_m);
            open.extend(lane.successors.iter().map(next));
        }
    }
    lines
}
