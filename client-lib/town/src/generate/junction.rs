//! Crossings: where the arms end, which lane leads to which, who has green together.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::curve::{self, Piece, Pose, wrapped};
use super::layout::{Layout, Profile, links_at};

/// A street's end at a junction.
#[derive(Clone, Debug)]
pub(super) struct Arm {
    pub(super) street: usize,
    /// Which end of the street: 0 its start, 1 its end.
    pub(super) end: usize,
    /// In which direction it leaves.
    pub(super) bearing: f64,
    /// From the node to where the street begins. Metres.
    pub(super) mouth: f64,
    pub(super) profile: Profile,
}

impl Arm {
    /// The lane number of the `index`-th lane from the middle that leads into the junction.
    pub(super) fn incoming(&self, index: usize) -> i32 {
        (index as i32 + 1) * if self.end == 1 { -1 } else { 1 }
    }

    /// The lane number of the `index`-th lane from the middle that leads out of the junction.
    pub(super) fn outgoing(&self, index: usize) -> i32 {
        -self.incoming(index)
    }
}

/// A way through a junction, for one lane.
#[derive(Clone, Debug)]
pub(super) struct Turn {
    pub(super) from: usize,
    pub(super) to: usize,
    /// Lanes from the middle.
    pub(super) from_lane: usize,
    pub(super) to_lane: usize,
    /// It carries the sidewalk round the corner.
    pub(super) sidewalk: bool,
    pub(super) pieces: Vec<Piece>,
}

/// Who may go.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Rule {
    /// Groups of arms that have green together.
    Signals(Vec<Vec<usize>>),
    /// These arms stop.
    Stop(Vec<usize>),
}

#[derive(Clone, Debug)]
pub(super) struct Junction {
    pub(super) node: usize,
    /// Counter-clockwise.
    pub(super) arms: Vec<Arm>,
    pub(super) turns: Vec<Turn>,
    pub(super) rule: Rule,
}

/// All junctions, in the order of their nodes.
pub(super) fn junctions(layout: &Layout) -> Vec<Junction> {
    let at = links_at(layout.nodes.len(), layout.streets.iter().map(|street| street.ends));
    (0..layout.nodes.len())
        .filter_map(|node| {
            let arms = arms(layout, node, &at[node]);
            (arms.len() > 2).then(|| {
                let turns = turns(layout, node, &arms);
                let rule = rule(node, &arms);
                Junction { node, arms, turns, rule }
            })
        })
        .collect()
}

/// From the kerb's corner to where its rounding begins, for a right angle. Metres.
const CORNER_ROOM: f64 = 2.5;

fn arms(layout: &Layout, node: usize, streets: &[usize]) -> Vec<Arm> {
    let mut arms: Vec<Arm> = Vec::new();
    for &street in streets {
        let one = &layout.streets[street];
        for end in [0, 1] {
            if one.ends[end] == node {
                let bearing = one.bearing(&layout.nodes, end);
                arms.push(Arm { street, end, bearing, mouth: 9.0, profile: one.profile });
            }
        }
    }
    arms.sort_by(|a, b| a.bearing.total_cmp(&b.bearing));
    for index in 0..arms.len() {
        for other in [(index + 1) % arms.len(), (index + arms.len() - 1) % arms.len()] {
            let angle = wrapped(arms[other].bearing - arms[index].bearing).abs();
            if angle > PI - 0.3 {
                continue;
            }
            let (own, beside) = (arms[index].profile, arms[other].profile);
            let corner = (beside.half() + own.half() * angle.cos()) / angle.sin();
            let radius = own.sidewalk.max(beside.sidewalk) + CORNER_ROOM;
            arms[index].mouth = arms[index].mouth.max(corner + radius / (angle * 0.5).tan());
        }
    }
    arms
}

fn turns(layout: &Layout, node: usize, arms: &[Arm]) -> Vec<Turn> {
    let count = arms.len();
    let mut ways: Vec<(usize, usize, usize, usize)> = Vec::new();
    for from in 0..count {
        let lanes = arms[from].profile.lanes;
        for step in 1..count {
            let to = (from + step) % count;
            let exits = arms[to].profile.lanes;
            // Seen by someone arriving: 0 ahead, positive to the left.
            let bend = wrapped(arms[to].bearing - arms[from].bearing - PI);
            if bend.abs() < FRAC_PI_2 * 0.5 {
                ways.extend((0..lanes).map(|lane| (from, to, lane, lane.min(exits - 1))));
            } else if bend > 0.0 {
                ways.push((from, to, 0, 0));
            } else {
                ways.push((from, to, lanes - 1, exits - 1));
            }
        }
    }
    feed_every_exit(arms, &mut ways);
    ways.dedup();
    ways.iter()
        .map(|&(from, to, from_lane, to_lane)| {
            // Streets keep right: the corner on the right of an arriving arm is the one before the
            // next arm counter-clockwise from it.
            let outer = to == (from + 1) % count;
            Turn {
                from,
                to,
                from_lane,
                to_lane,
                sidewalk: outer
                    && from_lane == arms[from].profile.lanes - 1
                    && to_lane == arms[to].profile.lanes - 1,
                pieces: path(layout, node, &arms[from], &arms[to], from_lane, to_lane),
            }
        })
        .collect()
}

/// Adds ways until every lane that leaves the junction is reached, and every lane that arrives
/// leads on.
fn feed_every_exit(arms: &[Arm], ways: &mut Vec<(usize, usize, usize, usize)>) {
    for to in 0..arms.len() {
        for lane in 0..arms[to].profile.lanes {
            if ways.iter().any(|way| (way.1, way.3) == (to, lane)) {
                continue;
            }
            // From the arm most nearly opposite.
            let straightest = (0..arms.len()).filter(|from| *from != to).min_by(|a, b| {
                let bend = |arm: usize| wrapped(arms[to].bearing - arms[arm].bearing - PI).abs();
                bend(*a).total_cmp(&bend(*b))
            });
            if let Some(from) = straightest {
                ways.push((from, to, lane.min(arms[from].profile.lanes - 1), lane));
            }
        }
    }
    for from in 0..arms.len() {
        for lane in 0..arms[from].profile.lanes {
            if !ways.iter().any(|way| (way.0, way.2) == (from, lane)) {
                let next = if lane == 0 { arms.len() - 1 } else { 1 };
                let to = (from + next) % arms.len();
                ways.push((from, to, lane, lane.min(arms[to].profile.lanes - 1)));
            }
        }
    }
}

/// The reference line of a turn: the left border of its lane.
fn path(
    layout: &Layout,
    node: usize,
    from: &Arm,
    to: &Arm,
    from_lane: usize,
    to_lane: usize,
) -> Vec<Piece> {
    let center = layout.nodes[node].position;
    let mouth = |arm: &Arm, heading: f64| Pose {
        position: center + glam::DVec2::from_angle(arm.bearing) * arm.mouth,
        heading,
    };
    let entry = mouth(from, from.bearing + PI).right(from_lane as f64 * from.profile.lane);
    let exit = mouth(to, to.bearing).right(to_lane as f64 * to.profile.lane);
    curve::between(entry, exit)
}

fn rule(node: usize, arms: &[Arm]) -> Rule {
    let avenue = arms.iter().any(|arm| arm.profile.lanes > 1);
    if arms.len() == 3 && !avenue && node.is_multiple_of(2) {
        return Rule::Stop(vec![stem(arms)]);
    }
    if arms.len() == 3 {
        let stem = stem(arms);
        let through = (0..3).filter(|arm| *arm != stem).collect();
        return Rule::Signals(vec![through, vec![stem]]);
    }
    // Opposite arms go together.
    Rule::Signals(vec![vec![0, 2], vec![1, 3]])
}

/// Of three arms, the one that ends on the other two.
fn stem(arms: &[Arm]) -> usize {
    let opposite = |arm: usize| {
        let bearing = |index: usize| arms[index % 3].bearing;
        let gap = (bearing(arm + 2) - bearing(arm + 1)).rem_euclid(TAU);
        (gap - PI).abs()
    };
    (0..3).min_by(|a, b| opposite(*a).total_cmp(&opposite(*b))).unwrap_or(0)
}
