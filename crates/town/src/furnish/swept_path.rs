//! The ground that a bus sweeps where it turns: its front swings out and its rear cuts in, beyond the
//! edges of its lane.

use glam::{Vec2, vec2};
use rayon::prelude::*;
use road::{LaneIndex, LaneTypes, Network};

use crate::furnish::{
    plan::Plan,
    raster::{ground, rectangle},
};

/// Half the length and half the width of `vehicle.mitsubishi.fusorosa`, and its wheelbase. Metres. No
/// vehicle of the catalogue needs more room.
const BUS_M: Vec2 = vec2(5.2, 1.45);
const WHEELBASE_M: f32 = 5.3;
/// The distance from the rear axle to the middle of a bus, and to the point that follows the centre of the
/// lane, as in the crate `traffic`. Metres.
const TO_MIDDLE_M: f32 = 0.5 * WHEELBASE_M + 0.1;
const TO_LEAD_M: f32 = 0.84 * WHEELBASE_M;
/// The largest steering angle of a bus while driving: 85 % of that at a standstill. Radians.
const STEER_MAX_RAD: f32 = 0.85 * 0.85;
/// The radius from which on a bus needs at most 0.7 m more than its width. Metres.
const STRAIGHT_M: f32 = 30.0;
/// The free width on each side of a bus: it keeps up to 0.25 m off the centre of its lane, away from
/// oncoming traffic, and deviates from that. Metres.
const SPARE_M: f32 = 0.4;
/// The way before and after a lane on which a bus still turns because of it. Metres.
const RUN_M: f64 = 16.0;
/// The distance between points of the way. Metres.
const STEP_M: f64 = 1.0;

/// Keeps objects off the ground that buses sweep where they turn.
pub(super) fn keep_clear(plan: &mut Plan) {
    for outline in outlines(plan.network) {
        plan.raster.stamp(&outline, ground::SWEPT);
    }
}

/// The outlines of a bus where it turns on any lane, with the width that it needs.
pub(super) fn outlines(network: &Network) -> Vec<[Vec2; 4]> {
    let drives = |lane: &LaneIndex| LaneTypes::DRIVABLE.contains(network.lane(*lane).kind);
    let lanes: Vec<LaneIndex> = network.lanes().iter().map(|lane| lane.index).collect();
    let turning = |lane: LaneIndex| sweep(&way(network, lane, drives));
    lanes.into_par_iter().filter(drives).flat_map_iter(turning).collect()
}

/// Points along the centre of a lane, and of those before and after it.
fn way(network: &Network, lane: LaneIndex, drives: impl Fn(&LaneIndex) -> bool) -> Vec<Vec2> {
    let own = network.lane(lane);
    let first = |lanes: &[LaneIndex]| lanes.iter().copied().find(&drives);
    let before = first(&own.predecessors)
        .map(|lane| (lane, (network.lane(lane).length_m - RUN_M).max(0.0), f64::INFINITY));
    let after = first(&own.successors).map(|lane| (lane, 0.0, RUN_M));
    let stretches = [before, Some((lane, 0.0, f64::INFINITY)), after];
    let mut points = Vec::new();
    for (lane, from_m, to_m) in stretches.into_iter().flatten() {
        let length_m = network.lane(lane).length_m.min(to_m) - from_m;
        let steps = (length_m / STEP_M).ceil().max(1.0);
        // Each stretch ends where the next one begins.
        for step in 0..steps as usize {
            let along_m = from_m + length_m * step as f64 / steps;
            points.push(network.place_at(lane, along_m, 0.0).position.truncate().as_vec2());
        }
    }
    points
}

/// Drives a bus along a way, as traffic steers it: its leading point follows the way, its rear axle
/// follows the leading point, and where the way is tighter than its turning circle it swings out.
/// Returns the outlines where it turns.
fn sweep(way: &[Vec2]) -> Vec<[Vec2; 4]> {
    let mut outlines = Vec::new();
    let Some(mut forward) = way.get(1).and_then(|next| (next - way[0]).try_normalize()) else {
        return outlines;
    };
    let mut rear = way[0] - forward * TO_LEAD_M;
    for pair in way.windows(2) {
        let step_m = pair[0].distance(pair[1]);
        let turn_max = step_m * STEER_MAX_RAD.tan() / WHEELBASE_M;
        let turn = forward.angle_to((pair[1] - rear).normalize_or(forward));
        forward = Vec2::from_angle(turn.clamp(-turn_max, turn_max)).rotate(forward);
        if turn.abs() <= turn_max {
            rear = pair[1] - forward * TO_LEAD_M;
        } else {
            rear += forward * step_m;
        }
        if turn.abs() * STRAIGHT_M > step_m {
            let half = BUS_M + vec2(0.0, SPARE_M);
            outlines.push(rectangle(rear + forward * TO_MIDDLE_M, half, forward.to_angle()));
        }
    }
    outlines
}
