//! The way over the lanes of a map that a list of edges means: the cheapest one, where a change of
//! lanes costs as much as a detour.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
};

use glam::Vec3;
use road::{LaneIndex, LanePoint, LaneTypes, Network};

use crate::edge::Edge;

/// Cost of a lane change, in decimetres.
const CHANGE_DM: u64 = 300;
/// Distance before the end of an edge at which the way passes.
const BEFORE_END_M: f64 = 3.0;

/// A way over lanes.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    pub(crate) first: LaneIndex,
    /// By edge: a position on the lane on which the way leaves it.
    pub(crate) places: Vec<Vec3>,
}

/// Finds the way from one of `starts`, lanes of the first edge, over all edges to the end of the last.
/// `Err` is the index of an edge that does not lead to the next one.
pub(crate) fn find(network: &Network, edges: &[Edge], starts: &[LaneIndex]) -> Result<Way, usize> {
    // State: number of the edge that was reached last, and lane.
    type State = (usize, u32);
    let mut reached: BTreeMap<State, (u64, Option<State>)> = BTreeMap::new();
    let mut open = BinaryHeap::new();
    for &start in starts {
        reached.insert((0, start.0), (0, None));
        open.push(Reverse((0, (0, start.0))));
    }
    let mut farthest = 0;
    let mut goal = None;
    while let Some(Reverse((cost, at))) = open.pop() {
        if reached[&at].0 < cost {
            continue;
        }
        let (nth, index) = at;
        let lane = network.lane(LaneIndex(index));
        let is_on_edge = edges[nth].has(lane);
        farthest = farthest.max(nth);
        let leaves = |next: &LaneIndex| !edges[nth].has(network.lane(*next));
        if nth + 1 == edges.len() && is_on_edge && lane.successors.iter().all(leaves) {
            goal = Some(at);
            break;
        }
        let length_dm = (lane.length_m * 10.0).ceil() as u64 + 1;
        let ahead = lane.successors.iter().filter_map(|&next| {
            let to = network.lane(next);
            let to_nth = if edges[nth].has(to) && is_on_edge {
                nth
            } else if nth + 1 < edges.len() && edges[nth + 1].has(to) {
                nth + 1
            } else if to.junction.is_some() && LaneTypes::DRIVABLE.contains(to.kind) {
                nth
            } else {
                return None;
            };
            Some((cost + length_dm, (to_nth, next.0)))
        });
        let beside = [lane.left, lane.right].into_iter().flatten().filter(|&side| {
            let to = network.lane(side);
            is_on_edge && edges[nth].has(to) && to.forward == lane.forward
        });
        let beside = beside.map(|side| (cost + CHANGE_DM, (nth, side.0)));
        for (cost, to) in ahead.chain(beside).collect::<Vec<_>>() {
            if reached.get(&to).is_none_or(|(least, _)| cost < *least) {
                reached.insert(to, (cost, Some(at)));
                open.push(Reverse((cost, to)));
            }
        }
    }
    let Some(goal) = goal else { return Err(farthest) };
    let mut states = vec![goal];
    while let Some(before) = reached[&states[states.len() - 1]].1 {
        states.push(before);
    }
    states.reverse();
    let last_on = |nth: usize| {
        let own = states.iter().rev().filter(|(of, _)| *of == nth);
        own.map(|&(_, lane)| LaneIndex(lane)).find(|&lane| edges[nth].has(network.lane(lane)))
    };
    let places = (0..edges.len()).filter_map(last_on).map(|lane| {
        let length_m = network.lane(lane).length_m;
        let along_m = (length_m - BEFORE_END_M).max(0.5 * length_m);
        network.place(LanePoint { lane, along_m }).position.as_vec3()
    });
    Ok(Way { first: LaneIndex(states[0].1), places: places.collect() })
}

/// Returns the edges of the shortest way between two edges, both included; `None` if there is none.
pub(crate) fn between(network: &Network, from: &Edge, to: &Edge) -> Option<Vec<Edge>> {
    let mut reached: BTreeMap<u32, (u64, Option<u32>)> = BTreeMap::new();
    let mut open = BinaryHeap::new();
    for start in from.first_lanes(network) {
        reached.insert(start.0, (0, None));
        open.push(Reverse((0, start.0)));
    }
    while let Some(Reverse((cost, at))) = open.pop() {
        if reached[&at].0 < cost {
            continue;
        }
        let lane = network.lane(LaneIndex(at));
        if to.has(lane) {
            let mut lanes = vec![at];
            while let Some(before) = reached[&lanes[lanes.len() - 1]].1 {
                lanes.push(before);
            }
            let mut edges: Vec<Edge> = Vec::new();
            for &index in lanes.iter().rev() {
                let lane = network.lane(LaneIndex(index));
                let edge = Edge { road: lane.road, right: lane.id < 0, piece: None };
                if lane.junction.is_none() && edges.last().is_none_or(|last| *last != edge) {
                    edges.push(edge);
                }
            }
            return Some(edges);
        }
        let length_dm = (lane.length_m * 10.0).ceil() as u64 + 1;
        let ahead = lane.successors.iter().map(|next| (cost + length_dm, next.0));
        let beside = [lane.left, lane.right].into_iter().flatten().filter(|&side| {
            let to = network.lane(side);
            lane.junction.is_none() && to.forward == lane.forward
        });
        let beside = beside.map(|side| (cost + CHANGE_DM, side.0));
        for (cost, next) in ahead.chain(beside) {
            let drives = LaneTypes::DRIVABLE.contains(network.lane(LaneIndex(next)).kind);
            if drives && reached.get(&next).is_none_or(|(least, _)| cost < *least) {
                reached.insert(next, (cost, Some(at)));
                open.push(Reverse((cost, next)));
            }
        }
    }
    None
}
