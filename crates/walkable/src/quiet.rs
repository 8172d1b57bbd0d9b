//! Places to cross quiet streets away from crosswalks: strips from sidewalk to sidewalk.

use glam::{DVec2, DVec3, Vec3Swizzles};
use road::{LaneType, LaneTypes, Network};
use town::Town;

use crate::{
    cells::Areas,
    outline::{self, Loop, REACH_M},
};

/// Distance between two strips along a street. Metres.
const EVERY_M: f64 = 10.0;
/// Width of a strip. Metres.
const WIDTH_M: f64 = 2.0;
/// Widest street that is quiet: two lanes and a parking lane. Metres.
const STREET_MAX_M: f64 = 11.0;
/// Highest speed limit of a quiet street, 50 km/h. Metres per second.
const LIMIT_MAX_MPS: f64 = 14.0;
/// Distance of strips from crosswalks and ends of streets. Metres.
const APART_M: f64 = 14.0;
/// Distance of strips from parked cars and other solid things. Metres.
const CLEAR_M: f64 = 0.5;
/// Distance of the points on a strip that are compared with solid things. Metres.
const POINT_M: f64 = 0.5;
/// Resolution of the search across the street. Metres.
const STEP_M: f64 = 0.1;

/// Returns the strips of all quiet streets. `sidewalks` are the areas of the sidewalks.
pub(crate) fn strips(
    network: &Network,
    town: &Town,
    sidewalks: &Areas,
    crosswalks: &[Loop],
) -> Vec<Loop> {
    let mut strips: Vec<Loop> = Vec::new();
    for point in network.waypoints(EVERY_M, LaneTypes::only(LaneType::Sidewalk)) {
        let lane = network.lane(point.lane);
        // From the right side only, so that each strip is found once.
        let is_between = point.along_m > APART_M && lane.length_m - point.along_m > APART_M;
        if lane.junction.is_some() || lane.id > 0 || !is_between {
            continue;
        }
        let place = network.place(point);
        let along = DVec2::from_angle(place.heading_rad);
        // The driving direction of a lane to the right has the street to its left.
        let across = along.perp();
        let Some((from, to)) = far_side(sidewalks, place.position.xy(), across) else { continue };
        let middle = (from + to) / 2.0;
        let near = network.nearest(middle.extend(place.position.z), LaneTypes::DRIVING);
        let Some(near) = near else { continue };
        let is_quiet = network.lane(near.lane).junction.is_none()
            && network.speed_limit(near).unwrap_or(LIMIT_MAX_MPS) <= LIMIT_MAX_MPS;
        let is_apart = crosswalks
            .iter()
            .chain(&strips)
            .all(|line| line.iter().all(|corner| corner.xy().distance(middle) > APART_M));
        if is_quiet && is_apart && is_free(town, from, to) {
            let (from, to) = (from - across * REACH_M, to + across * REACH_M);
            let aside = along * (WIDTH_M / 2.0);
            let corners = [from - aside, from + aside, to + aside, to - aside];
            let height = network.place(near).position.z;
            let line: Vec<DVec3> = corners.iter().map(|corner| corner.extend(height)).collect();
            strips.push(outline::counter_clockwise(line));
        }
    }
    strips
}

/// Returns where the sidewalk ends on the way across the street, and where the opposite one begins.
fn far_side(sidewalks: &Areas, from: DVec2, across: DVec2) -> Option<(DVec2, DVec2)> {
    let is_paved = |at: DVec2| sidewalks.at(at).is_some();
    let steps = |count: f64| (0..(count / STEP_M) as u32).map(|step| f64::from(step) * STEP_M);
    if !is_paved(from) {
        return None;
    }
    let kerb = from + across * steps(8.0).find(|m| !is_paved(from + across * *m))?;
    let wide = steps(STREET_MAX_M).find(|m| is_paved(kerb + across * *m))?;
    (wide > 4.0).then(|| (kerb, kerb + across * wide))
}

/// Whether no solid thing stands between two points.
fn is_free(town: &Town, from: DVec2, to: DVec2) -> bool {
    let way = to - from;
    let points = (way.length() / POINT_M).ceil() as u32;
    let at = |point: u32| from + way * (f64::from(point) / f64::from(points));
    let kept_m = WIDTH_M / 2.0 + CLEAR_M;
    town.colliders.iter().all(|solid| {
        let (center, half) = (solid.center.as_dvec3().xy(), solid.half_extents_m.as_dvec3().xy());
        if center.distance(from + way / 2.0) > half.length() + way.length() + kept_m {
            return true;
        }
        let turned = DVec2::from_angle(-f64::from(solid.yaw_rad));
        (0..=points).all(|point| {
            let beside = turned.rotate(at(point) - center).abs() - half;
            beside.max(DVec2::ZERO).length() > kept_m
        })
    })
}
