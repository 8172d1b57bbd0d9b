//! Roundabouts, found by their shape: lanes that lead round a small circle.
//!
//! Who is in a roundabout goes before who enters it, whether a sign says so or not: if those who
//! enter went first, the circle would fill up until nobody can leave it.

use glam::Vec2;

use crate::tracks::Tracks;

/// No roundabout is longer than this.
const LENGTH_MAX_M: f32 = 400.0;
/// And none has more lanes, one after the other.
const LANES_MAX: usize = 64;
/// How round it must be: area by the area of a circle of the same length. A square has 0.79.
const ROUND: f32 = 0.86;
/// Ways that part are compared after so much.
const GLANCE_M: f32 = 12.0;

/// By lane: whether it is part of the circle of a roundabout.
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

/// The circle that begins and ends with `lane`, driven to the left (`side` 1) or right (−1).
fn circle(tracks: &Tracks, lane: u32, side: f32) -> Option<Vec<u32>> {
    let (mut lanes, mut length_m) = (vec![lane], tracks.length(lane));
    let mut at = lane;
    loop {
        at = inmost(tracks, at, side)?;
        if at == lane {
            break;
        }
        length_m += tracks.length(at);
        if length_m > LENGTH_MAX_M || lanes.len() == LANES_MAX || lanes.contains(&at) {
            return None;
        }
        lanes.push(at);
    }
    let points: Vec<Vec2> = lanes
        .iter()
        .flat_map(|&on| (0..tracks.samples(on).0).map(move |k| (on, k)))
        .map(|(on, k)| tracks.sample_point(on, k).truncate())
        .collect();
    let pairs = points.iter().zip(points.iter().cycle().skip(1));
    // From the first point, so that large coordinates do not cost precision.
    let twice: f32 = pairs.map(|(a, b)| (*a - points[0]).perp_dot(*b - points[0])).sum();
    let round = 0.5 * twice * side * 4.0 * std::f32::consts::PI / (length_m * length_m);
    (round > ROUND).then_some(lanes)
}

/// Of the lanes that follow, the one that keeps nearest to the inside.
fn inmost(tracks: &Tracks, lane: u32, side: f32) -> Option<u32> {
    let ways = tracks.next(lane);
    let glance_m = ways.iter().map(|&way| tracks.length(way)).fold(GLANCE_M, f32::min);
    let from = tracks.at(lane, tracks.length(lane)).1;
    let inward = |way: u32| side * from.angle_to(tracks.at(way, glance_m).1);
    ways.iter().copied().max_by(|&a, &b| inward(a).total_cmp(&inward(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::maps;

    #[test]
    fn a_circle_is_a_roundabout_and_a_block_is_none() {
        let round = Tracks::new(&maps::loop_road(20.0, 0.0));
        assert_eq!(circles(&round), vec![true; 4]);
        let block = Tracks::new(&maps::loop_road(6.0, 60.0));
        assert_eq!(circles(&block), vec![false; 8]);
        let ring_road = Tracks::new(&maps::loop_road(200.0, 0.0));
        assert_eq!(circles(&ring_road), vec![false; 4]);
    }
}
