//! Routes: the shortest path along lanes, with lane changes where markings allow them.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::{
    lane::{LaneIndex, LanePoint},
    network::Network,
};

/// The shortest path from one point to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Length in metres of s; a lane change adds none.
    pub length_m: f64,
    /// Lanes in the order of travel.
    pub legs: Vec<Leg>,
}

/// One lane of a route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// The lane.
    pub lane: LaneIndex,
    /// Where it is entered, metres along it.
    pub from_m: f64,
    /// Where it is left, metres along it.
    pub to_m: f64,
    /// Whether it is left to a neighbour instead of at its end.
    pub changes: bool,
}

/// Cost of a lane change, metres of detour.
const CHANGE_M: f64 = 20.0;

/// A lane by how it is reached: at its start, or where the route begins (or beside it).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    lane: LaneIndex,
    from_start: bool,
}

/// The best known way to reach a node.
#[derive(Clone, Copy)]
struct Reached {
    cost: f64,
    from: Option<Node>,
    is_final: bool,
}

/// Finite, non-negative floats sort like their bits.
type Open = BinaryHeap<Reverse<(u64, Node)>>;

impl Network {
    /// Returns the shortest route between two points; `None` if there is none.
    pub fn route(&self, from: LanePoint, to: LanePoint) -> Option<Route> {
        let begin = from.along_m.clamp(0.0, self.lane(from.lane).length_m);
        let goal = to.along_m.clamp(0.0, self.lane(to.lane).length_m);
        // Two for each lane, see `Node`. The cost is that of arriving at the node's entry.
        let mut reached: Vec<Option<Reached>> = vec![None; 2 * self.lanes().len()];
        let place = |node: Node| 2 * node.lane.0 as usize + usize::from(node.from_start);
        let mut open = Open::new();
        let offer = |open: &mut Open, reached: &mut [Option<Reached>], to, cost: f64, from| {
            let known = &mut reached[place(to)];
            if known.is_none_or(|known| !known.is_final && cost < known.cost) {
                *known = Some(Reached { cost, from, is_final: false });
                open.push(Reverse((cost.to_bits(), to)));
            }
        };
        offer(&mut open, &mut reached, Node { lane: from.lane, from_start: false }, 0.0, None);
        let mut best: Option<(f64, Node)> = None;
        while let Some(Reverse((bits, node))) = open.pop() {
            let cost = f64::from_bits(bits);
            let Some(here) = &mut reached[place(node)] else { continue };
            if here.is_final || here.cost < cost {
                continue;
            }
            here.is_final = true;
            if best.is_some_and(|(best, _)| best <= cost) {
                break;
            }
            let lane = self.lane(node.lane);
            let entry = if node.from_start { 0.0 } else { begin.min(lane.length_m) };
            if node.lane == to.lane && goal >= entry {
                let all = cost + goal - entry;
                if best.is_none_or(|(best, _)| all < best) {
                    best = Some((all, node));
                }
            }
            for next in &lane.successors {
                let next = Node { lane: *next, from_start: true };
                offer(&mut open, &mut reached, next, cost + lane.length_m - entry, Some(node));
            }
            let left = lane.left.filter(|_| lane.left_change);
            let right = lane.right.filter(|_| lane.right_change);
            for side in [left, right].into_iter().flatten() {
                let side = Node { lane: side, ..node };
                offer(&mut open, &mut reached, side, cost + CHANGE_M, Some(node));
            }
        }
        let (_, last) = best?;
        let mut nodes = vec![last];
        while let Some(before) = nodes.last().and_then(|n| reached[place(*n)]).and_then(|r| r.from)
        {
            nodes.push(before);
        }
        nodes.reverse();
        Some(self.legs(&nodes, begin, goal))
    }

    /// Distributes the lane changes of a run of neighbours evenly over the length that they share.
    fn legs(&self, nodes: &[Node], begin: f64, goal: f64) -> Route {
        let mut route = Route { length_m: 0.0, legs: Vec::new() };
        let side_by_side = |a: &Node, b: &Node| {
            let (a, b) = (self.lane(a.lane), self.lane(b.lane));
            a.road == b.road && a.section == b.section
        };
        let beside = |a: &Node, b: &Node| {
            a.from_start == b.from_start && side_by_side(a, b) && a.lane != b.lane
        };
        let runs: Vec<&[Node]> = nodes.chunk_by(beside).collect();
        for (number, run) in runs.iter().enumerate() {
            let length_m = self.lane(run[0].lane).length_m;
            let entry = if run[0].from_start { 0.0 } else { begin };
            let exit = if number + 1 == runs.len() { goal } else { length_m };
            route.length_m += exit - entry;
            let step = (exit - entry) / run.len() as f64;
            for (index, node) in run.iter().enumerate() {
                route.legs.push(Leg {
                    lane: node.lane,
                    from_m: entry + step * index as f64,
                    to_m: entry + step * (index + 1) as f64,
                    changes: index + 1 < run.len(),
                });
            }
        }
        route
    }
}

impl Route {
    /// Returns points every `every_m` metres along the route, including both ends.
    pub fn points(&self, every_m: f64) -> Vec<LanePoint> {
        let mut points = Vec::new();
        let every_m = if every_m.is_finite() { every_m.max(0.01) } else { 1.0 };
        let mut next_m = 0.0;
        for leg in &self.legs {
            while next_m <= leg.to_m - leg.from_m {
                points.push(LanePoint { lane: leg.lane, along_m: leg.from_m + next_m });
                next_m += every_m;
            }
            next_m -= leg.to_m - leg.from_m;
        }
        if let Some(last) = self.legs.last() {
            let end = LanePoint { lane: last.lane, along_m: last.to_m };
            if points.last() != Some(&end) {
                points.push(end);
            }
        }
        points
    }
}
