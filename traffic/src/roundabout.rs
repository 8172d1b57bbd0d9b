//! Roundabouts, detected by their shape: lanes that form a small circle.
//!
//! Vehicles in a roundabout have right of way over entering ones, with or without a sign. Otherwise
//! the circle would fill up until no vehicle could leave it.

use glam::Vec2;

use crate::tracks::Tracks;

/// Largest circumference of a roundabout.
const LENGTH_MAX_M: f32 = 400.0;
/// Largest number of consecutive lanes of a roundabout.
const LANES_MAX: usize = 64;
/// Least isoperimetric ratio, 4π area / length²: a circle has 1, a square 0.79.
const ROUND: f32 = 0.86;
/// Distance after a fork at which the branches are compared.
const BRANCH_M: f32 = 12.0;

/// Returns for each lane whether it is part of the circle of a roundabout.
pub(crate) fn circles(tracks: &Tracks) -> Vec<bool> {
    let mut circles = vec![false; tracks.count()];
    for lane in 0..tracks.count() as u32 {
        if !tracks.has(lane) || circles[lane as usize] {
            continue;
        }
        for side in [1.0, -1.0] {
            for &on in circle(tracks, lane, side).iter().flatten() {
                circles[on as usize] = true;
            }
        }
    }
    circles
}

/// Returns the circle that begins and ends with `lane`, driven to the left (`side` 1) or right
/// (−1).
fn circle(tracks: &Tracks, lane: u32, side: f32) -> Option<Vec<u32>> {
    let (mut lanes, mut length_m) = (vec![lane], tracks.length(lane));
    let mut at = lane;
    loop {
        if length_m > LENGTH_MAX_M {
            return None;
        }
        at = inmost(tracks, at, side)?;
        if at == lane {
            break;
        }
        if lanes.len() == LANES_MAX || lanes.contains(&at) {
            return None;
        }
        length_m += tracks.length(at);
        lanes.push(at);
    }
    let points: Vec<Vec2> = lanes
        .iter()
        .flat_map(|&on| (0..tracks.samples(on).0).map(move |k| (on, k)))
        .map(|(on, k)| tracks.sample_point(on, k).truncate())
        .collect();
    let pairs = points.iter().zip(points.iter().cycle().skip(1));
    // Relative to the first point, so that large coordinates do not cost precision.
    let twice: f32 = pairs.map(|(a, b)| (*a - points[0]).perp_dot(*b - points[0])).sum();
    let round = 0.5 * twice * side * 4.0 * std::f32::consts::PI / (length_m * length_m);
    (round > ROUND).then_some(lanes)
}

/// Returns the successor that stays nearest to the inside.
fn inmost(tracks: &Tracks, lane: u32, side: f32) -> Option<u32> {
    let branches = tracks.next(lane);
    let branch_m = branches.iter().map(|&branch| tracks.length(branch)).fold(BRANCH_M, f32::min);
    let from = tracks.at(lane, tracks.length(lane)).1;
    let inward = |branch: u32| side * from.angle_to(tracks.at(branch, branch_m).1);
    branches.iter().copied().max_by(|&a, &b| inward(a).total_cmp(&inward(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::maps;

    #[test]
    fn a_circle_is_a_roundabout_and_a_block_is_not() {
        let round = Tracks::new(&maps::loop_road(20.0, 0.0));
        assert_eq!(circles(&round), [true]);
        let block = Tracks::new(&maps::loop_road(6.0, 60.0));
        assert_eq!(circles(&block), vec![false; 8]);
        let ring_road = Tracks::new(&maps::loop_road(200.0, 0.0));
        assert_eq!(circles(&ring_road), [false]);
    }
}
