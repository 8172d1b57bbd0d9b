//! Swept paths: the width that a vehicle needs along a track. In curves the front overhang swings
//! out and the rear axle cuts in.

use glam::{Vec2, Vec3};

use crate::{
    body::{Body, Class},
    tracks::Tracks,
};

/// Half the width of a car.
const CAR_M: f32 = 1.05;
/// Half the width of a bus.
pub(crate) const BUS_M: f32 = 1.45;

/// A large car.
const CAR: Body = Body {
    front_m: 2.5,
    rear_m: 2.5,
    half_width_m: CAR_M,
    height_m: 1.6,
    wheelbase_m: 2.9,
    max_steer_rad: 0.61,
    cruise_speed_mps: 40.0,
    class: Class::Car,
};
/// A bus: no vehicle needs more room.
const BUS: Body = Body {
    front_m: 5.3,
    rear_m: 5.1,
    half_width_m: BUS_M,
    height_m: 3.2,
    wheelbase_m: 5.3,
    max_steer_rad: 0.85,
    cruise_speed_mps: 40.0,
    class: Class::Bus,
};
/// Fraction of the steering angle that is available while driving.
const MAX_STEER_FACTOR: f32 = 0.85;
/// Distance before a track over which vehicles are examined.
const RUN_UP_M: f32 = 16.0;
/// Distance after a track over which vehicles are examined.
pub(crate) const RUN_OUT_M: f32 = 12.0;

/// Bound on the error of a computed angle between two directions, radians.
const ANGLE_ERROR_RAD: f32 = 1e-3;

/// Most lanes before or after a track that are followed.
const LANES_MAX: u32 = 16;

/// Reach to the left and to the right of a track's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub(crate) left_m: f32,
    pub(crate) right_m: f32,
}

impl Reach {
    /// Returns the reach on the side of `offset`.
    pub(crate) fn towards(&self, tangent: Vec2, offset: Vec2) -> f32 {
        if tangent.perp_dot(offset) > 0.0 { self.left_m } else { self.right_m }
    }
}

/// A point of a track, and the reach there of vehicles that drive along the track.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Station {
    pub(crate) arc_m: f32,
    pub(crate) point: Vec3,
    pub(crate) tangent: Vec2,
    pub(crate) car: Reach,
    pub(crate) bus: Reach,
}

/// Returns the stations of `lane`, and those before and after it as far as vehicles on it reach.
pub(crate) fn stations(tracks: &Tracks, lane: u32) -> Vec<Station> {
    let (length, step_m) = (tracks.length(lane), tracks.samples(lane).1.max(0.5));
    let before = (RUN_UP_M / step_m).ceil() as i32;
    let after = ((length + RUN_OUT_M) / step_m).ceil() as i32;
    let straight = |body: &Body| Reach { left_m: body.half_width_m, right_m: body.half_width_m };
    let mut path: Vec<Station> = (-before..=after)
        .map(|k| {
            let arc_m = k as f32 * step_m;
            let (point, tangent) = place(tracks, lane, arc_m);
            Station { arc_m, point, tangent, car: straight(&CAR), bus: straight(&BUS) }
        })
        .collect();
    sweep(&mut path, step_m, &CAR, |station| &mut station.car);
    sweep(&mut path, step_m, &BUS, |station| &mut station.bus);
    path
}

/// Returns a point on `lane`, or on the lanes before and after it, of which some are shorter than a vehicle.
pub(crate) fn place(tracks: &Tracks, lane: u32, arc_m: f32) -> (Vec3, Vec2) {
    let (mut on, mut at_m) = (lane, arc_m);
    let first = |lanes: &[u32]| lanes.first().copied().filter(|&lane| tracks.has(lane));
    for _ in 0..LANES_MAX {
        if at_m < 0.0
            && let Some(before) = first(tracks.previous(on))
        {
            on = before;
            at_m += tracks.length(before);
        } else if at_m > tracks.length(on)
            && let Some(next) = first(tracks.next(on))
        {
            at_m -= tracks.length(on);
            on = next;
        } else {
            break;
        }
    }
    let (point, tangent, _) = tracks.at(on, at_m);
    (point, tangent)
}

/// Drives a vehicle along the path: the tracking point follows the path, the rear axle follows the
/// tracking point. Where the path is tighter than the turning circle, the vehicle swings out and
/// returns.
fn sweep(path: &mut [Station], step_m: f32, body: &Body, reach: fn(&mut Station) -> &mut Reach) {
    let axle_m = body.axle_to_tracking_point_m();
    let mut forward = path[0].tangent;
    let mut rear = path[0].point.truncate() - forward * axle_m;
    // Along the vehicle, from the tracking point.
    let (tail_m, nose_m) =
        (-body.rear_m - body.tracking_point_m(), body.front_m - body.tracking_point_m());
    let marks = ((nose_m - tail_m) / step_m).ceil() as usize;
    for at in 0..path.len() {
        let lead = follow(&mut forward, &mut rear, path[at].point.truncate(), body, step_m);
        for mark in 0..=marks {
            let along_m = tail_m + (nose_m - tail_m) * mark as f32 / marks as f32;
            for side in [body.half_width_m, -body.half_width_m] {
                let corner = lead + forward * along_m + forward.perp() * side;
                let Some(near) =
                    nearest(path, at as i32 + (along_m / step_m).round() as i32, corner)
                else {
                    continue;
                };
                let station = &mut path[near];
                let left_m = station.tangent.perp_dot(corner - station.point.truncate());
                let reach = reach(station);
                reach.left_m = reach.left_m.max(left_m);
                reach.right_m = reach.right_m.max(-left_m);
            }
        }
    }
}

/// Drives a vehicle this far, with its rear axle at `rear`, so that its tracking point comes to `lead`, or as
/// near as its steering allows. Returns where the tracking point is then.
pub(crate) fn follow(
    forward: &mut Vec2,
    rear: &mut Vec2,
    lead: Vec2,
    body: &Body,
    by_m: f32,
) -> Vec2 {
    let axle_m = body.axle_to_tracking_point_m();
    let target = (lead - *rear).normalize_or(*forward);
    let bounded = || {
        let (turn, most) = (forward.angle_to(target), by_m * turn_max_per_m(body));
        (turn.abs() > most).then_some(most.copysign(turn))
    };
    let is_small = is_small_turn(*forward, target, body, by_m);
    let Some(turn) = (if is_small { None } else { bounded() }) else {
        *forward = target;
        *rear = lead - *forward * axle_m;
        return lead;
    };
    *forward = Vec2::from_angle(turn).rotate(*forward);
    *rear += *forward * by_m;
    *rear + *forward * axle_m
}

/// Returns whether a turn is so small that the vehicle can make it whatever the exact angle is: an angle is no
/// larger than its tangent.
fn is_small_turn(forward: Vec2, target: Vec2, body: &Body, by_m: f32) -> bool {
    let least_per_m = 0.9 * MAX_STEER_FACTOR * body.max_steer_rad / body.wheelbase_m;
    let (along, across) = (forward.dot(target), forward.perp_dot(target).abs());
    across + ANGLE_ERROR_RAD * along <= by_m * least_per_m * along
}

/// Returns the largest turn per metre, radians.
pub(crate) fn turn_max_per_m(body: &Body) -> f32 {
    (MAX_STEER_FACTOR * body.max_steer_rad).tan() / body.wheelbase_m
}

/// Returns the station nearest to `corner` among those around `guess`.
fn nearest(path: &[Station], guess: i32, corner: Vec2) -> Option<usize> {
    (guess - 4..=guess + 4)
        .filter(|&k| k >= 0 && (k as usize) < path.len())
        .map(|k| (path[k as usize].point.truncate().distance_squared(corner), k as usize))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::maps;

    /// Returns how far a car reaches to the outside of a loop to the left.
    fn outside_m(radius_m: f64) -> f32 {
        let tracks = Tracks::new(&maps::loop_road(radius_m, 20.0));
        let curve = (0..tracks.count() as u32).filter(|&lane| tracks.has(lane)).nth(1).unwrap();
        stations(&tracks, curve).iter().map(|station| station.car.right_m).fold(0.0, f32::max)
    }

    #[test]
    fn a_vehicle_swings_out_of_a_curve_below_its_turning_circle() {
        // The lane lies outside the reference line.
        assert!(outside_m(12.0) < CAR_M + 0.7, "{}", outside_m(12.0));
        assert!(outside_m(1.5) > CAR_M + 1.0, "{}", outside_m(1.5));
    }
}
