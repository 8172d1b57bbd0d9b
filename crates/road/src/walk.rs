//! Walks along lanes: what comes next, what came before, where vehicles may start.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    lane::{LaneIndex, LanePoint, LaneType, LaneTypes},
    network::Network,
};

/// A walk with more branches than this is cut off.
const BRANCHES_MAX: usize = 4096;

impl Network {
    /// Returns the points `distance_m` ahead, one for each branch. A branch that ends before is
    /// left out.
    pub fn advance(&self, at: LanePoint, distance_m: f64) -> Vec<LanePoint> {
        self.walk(at, distance_m, true)
    }

    /// Returns the points `distance_m` behind, one for each branch that leads here.
    pub fn retreat(&self, at: LanePoint, distance_m: f64) -> Vec<LanePoint> {
        self.walk(at, distance_m, false)
    }

    fn walk(&self, at: LanePoint, distance_m: f64, ahead: bool) -> Vec<LanePoint> {
        let mut found = Vec::new();
        if !(distance_m.is_finite() && distance_m >= 0.0) {
            return found;
        }
        // Lanes without length may form a ring; a walk ends after this many lanes without progress.
        let idle_lanes = self.lanes().len() as u32 + 1;
        let first = self.lane(at.lane);
        let along = at.along_m.clamp(0.0, first.length_m);
        let before = if ahead { along } else { first.length_m - along };
        let mut open = vec![(at.lane, before + distance_m, idle_lanes)];
        let mut steps = 0;
        while let Some((index, from_start, idle_lanes)) = open.pop() {
            let lane = self.lane(index);
            if from_start <= lane.length_m {
                let along_m = if ahead { from_start } else { lane.length_m - from_start };
                found.push(LanePoint { lane: index, along_m });
                continue;
            }
            steps += 1;
            if found.len() + open.len() > BRANCHES_MAX || steps > 64 * BRANCHES_MAX {
                break;
            }
            let idle_lanes = if lane.length_m > 0.0 { idle_lanes } else { idle_lanes - 1 };
            if idle_lanes == 0 {
                continue;
            }
            let next = if ahead { &lane.successors } else { &lane.predecessors };
            let rest = from_start - lane.length_m;
            open.extend(next.iter().rev().map(|next| (*next, rest, idle_lanes)));
        }
        found
    }

    /// Returns pairs of driving lanes of which the second continues the first.
    pub fn topology(&self) -> Vec<(LaneIndex, LaneIndex)> {
        let drives = |lane: LaneIndex| LaneTypes::DRIVABLE.contains(self.lane(lane).kind);
        let lanes = self.lanes().iter().filter(|lane| drives(lane.index));
        lanes
            .flat_map(|lane| lane.successors.iter().map(|next| (lane.index, *next)))
            .filter(|(_, next)| drives(*next))
            .collect()
    }

    /// Returns places on driving lanes outside junctions where a vehicle may spawn: wide enough,
    /// with room to drive on, and apart from each other.
    pub fn spawn_points(&self) -> Vec<LanePoint> {
        let mut taken: BTreeMap<(i64, i64), Vec<DVec3>> = BTreeMap::new();
        let mut points = Vec::new();
        for lane in self.lanes() {
            if lane.kind != LaneType::Driving || lane.junction.is_some() {
                continue;
            }
            let after = if lane.successors.is_empty() { DEAD_END_M } else { ROOM_M };
            let mut along_m = ROOM_M;
            while along_m <= lane.length_m - after {
                let at = LanePoint { lane: lane.index, along_m };
                along_m += SPACING_M;
                let position = self.place(at).position;
                if self.width(at) >= WIDTH_MIN_M && claim(&mut taken, position) {
                    points.push(at);
                }
            }
        }
        points
    }
}

const ROOM_M: f64 = 5.0;
const DEAD_END_M: f64 = 25.0;
const SPACING_M: f64 = 10.0;
const WIDTH_MIN_M: f64 = 2.4;
const APART_M: f64 = 2.6;

/// Returns whether no other place is near `position`, and claims it.
fn claim(taken: &mut BTreeMap<(i64, i64), Vec<DVec3>>, position: DVec3) -> bool {
    let cell = |value: f64| (value / APART_M).floor() as i64;
    let (x, y) = (cell(position.x), cell(position.y));
    for near in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y))) {
        if let Some(others) = taken.get(&near)
            && others.iter().any(|other| other.distance(position) < APART_M)
        {
            return false;
        }
    }
    taken.entry((x, y)).or_default().push(position);
    true
}
