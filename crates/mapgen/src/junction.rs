//! Crossings: where the arms end, which lane leads to which, and which arm has priority.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec2;

use crate::{
    curve::{self, Piece, Pose, wrapped},
    layout::Layout,
    street::{Class, Control, Profile, Shape, Street, links_at},
};

/// The end of a street at a junction.
#[derive(Clone, Debug)]
pub(crate) struct Arm {
    pub(crate) street: usize,
    /// The end of the street: 0 its start, 1 its end.
    pub(crate) end: usize,
    /// Where the street's reference line begins, heading away from the junction.
    pub(crate) mouth: Pose,
    pub(crate) profile: Profile,
    /// Driving lanes here beyond the profile's, on the right of the street's start.
    extra: usize,
}

impl Arm {
    /// The number of lanes that lead into the junction.
    pub(crate) fn ins(&self) -> usize {
        self.profile.lanes[self.in_side()] + if self.end == 1 { self.extra } else { 0 }
    }

    /// The number of lanes that lead out of the junction.
    pub(crate) fn outs(&self) -> usize {
        self.profile.lanes[self.out_side()] + if self.end == 0 { self.extra } else { 0 }
    }

    /// The side of the street on which traffic arrives.
    pub(crate) fn in_side(&self) -> usize {
        1 - self.end
    }

    /// The side of the street on which traffic leaves.
    pub(crate) fn out_side(&self) -> usize {
        self.end
    }

    /// The lane id of the `index`-th lane from the middle that leads into the junction.
    pub(crate) fn incoming(&self, index: usize) -> i32 {
        (index as i32 + 1) * if self.end == 1 { -1 } else { 1 }
    }

    /// The lane id of the `index`-th lane from the middle that leads out of the junction.
    pub(crate) fn outgoing(&self, index: usize) -> i32 {
        -self.incoming(index)
    }

    /// The lane id of a side's sidewalk or shoulder.
    pub(crate) fn edge_lane(&self, side: usize) -> i32 {
        let extra = if side == 0 { self.extra as i32 } else { 0 };
        (self.profile.edge_id(side) + extra) * if side == 0 { -1 } else { 1 }
    }

    /// The offset of the line between the two directions, to the left of departing traffic. Metres.
    fn division(&self) -> f64 {
        self.profile.division() * if self.end == 0 { 1.0 } else { -1.0 }
    }

    /// The left border of an incoming lane, in driving direction.
    fn entry(&self, lane: usize) -> Pose {
        self.mouth.turned().right(lane as f64 * self.profile.lane + self.division())
    }

    /// The left border of an outgoing lane, in driving direction.
    fn exit(&self, lane: usize) -> Pose {
        self.mouth.right(lane as f64 * self.profile.lane - self.division())
    }

    /// The width of a side's sidewalk or shoulder where it meets the junction. Metres.
    pub(crate) fn edge(&self, streets: &[Street], side: usize) -> f64 {
        let without_shoulder = side == 0 && streets[self.street].without_shoulder[self.end];
        if without_shoulder { 0.0 } else { self.profile.edge(side) }
    }
}

/// A connection through a junction, for one lane or for pedestrians.
#[derive(Clone, Debug)]
pub(crate) struct Turn {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// The incoming and outgoing lane, counted from the middle; none where only a sidewalk
    /// connects.
    pub(crate) lanes: Option<(usize, usize)>,
    /// Whether the connection carries the sidewalk or shoulder on its right, on its left.
    pub(crate) edges: [bool; 2],
    pub(crate) pieces: Vec<Piece>,
}

/// What a sign demands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    Yield,
    Stop,
}

/// What regulates a junction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Rule {
    /// Signals: groups of arms that have green at the same time.
    Signals(Vec<Vec<usize>>),
    /// Signs: these arms have one.
    Signs(Sign, Vec<usize>),
}

#[derive(Clone, Debug)]
pub(crate) struct Junction {
    pub(crate) node: usize,
    /// The arms, in counter-clockwise order.
    pub(crate) arms: Vec<Arm>,
    pub(crate) turns: Vec<Turn>,
    pub(crate) rule: Rule,
}

/// Returns all junctions, in the order of their nodes.
pub(crate) fn junctions(layout: &Layout) -> Vec<Junction> {
    let at = links_at(layout.nodes.len(), layout.streets.iter().map(|street| street.ends));
    (0..layout.nodes.len())
        .filter(|node| !at[*node].is_empty())
        .map(|node| {
            let arms = arms(layout, node, &at[node]);
            let control = layout.nodes[node].control;
            let turns = match control {
                Control::Weave => weave(layout, &arms),
                Control::Turning => turning(&arms),
                _ => turns(layout, &arms),
            };
            Junction { node, rule: rule(control, &arms), arms, turns }
        })
        .collect()
}

/// The least distance between the two mouths of a street. Metres.
const ROOM_M: f64 = 16.0;

/// The smallest radius of a bend in a town street. Metres.
const BEND_MIN_M: f64 = 15.0;

/// Whether every street has enough length left between its two junctions: each mouth lies well
/// before the other, and no bend between them is too tight.
pub(crate) fn has_room(layout: &Layout) -> bool {
    layout.streets.iter().zip(mouths(layout)).all(|(street, mouths)| match mouths {
        [Some(start), Some(end)] if matches!(street.shape, Shape::Corners { .. }) => {
            let gap = end.position - start.position;
            gap.dot(start.direction()) > ROOM_M
                && -gap.dot(end.direction()) > ROOM_M
                && tightest(street, [start, end]) < 1.0 / BEND_MIN_M
        }
        _ => true,
    })
}

/// The tightest curvature of a street. 1/m.
fn tightest(street: &Street, mouths: [Pose; 2]) -> f64 {
    line(street, mouths).iter().map(|piece| piece.curvature.abs()).fold(0.0, f64::max)
}

/// The width of a bus or fire engine with clearance, and the additional width that it sweeps per
/// curvature of a bend: half the square of the distance from its rear axle to its front. Metres,
/// square metres.
const BUS_M: f64 = 2.7;
const BUS_SWEEP_M2: f64 = 34.0;
/// The greatest width of a lane. Metres.
const LANE_MAX_M: f64 = 4.6;

/// Widens lanes so that two buses can pass each other in the bends of a street.
pub(crate) fn widen_bends(layout: &mut Layout) {
    let mouths = mouths(layout);
    for (street, mouths) in layout.streets.iter_mut().zip(mouths) {
        let [Some(start), Some(end)] = mouths else { continue };
        if street.profile.lanes.contains(&0) {
            continue;
        }
        let wide = (BUS_M + BUS_SWEEP_M2 * tightest(street, [start, end])).min(LANE_MAX_M);
        street.profile.lane = street.profile.lane.max(wide);
    }
}

/// The mouths of every street, at its start and its end.
fn mouths(layout: &Layout) -> Vec<[Option<Pose>; 2]> {
    let at = links_at(layout.nodes.len(), layout.streets.iter().map(|street| street.ends));
    let mut mouths = vec![[None; 2]; layout.streets.len()];
    for (node, here) in at.iter().enumerate() {
        for arm in arms(layout, node, here) {
            mouths[arm.street][arm.end] = Some(arm.mouth);
        }
    }
    mouths
}

/// The distance from the corner of the kerb to where its rounding begins, for a right angle.
/// Metres.
const CORNER_ROOM: f64 = 2.5;
/// The smallest radius of a kerb between lanes 3.5 m wide. Metres.
const CORNER_MIN_M: f64 = 7.0;
/// As [`CORNER_ROOM`], outside towns, where vehicles turn faster.
const WIDE_ROOM: f64 = 5.5;
/// The smallest distance of a mouth from the middle of the junction. Metres.
const MOUTH_MIN: f64 = 9.0;
/// Of a turning loop: the distance from its middle to its mouth, the radius of its inner border,
/// and the radius of the bends at its mouth, which lets a bus leave beside an entering vehicle.
/// Metres.
const LOOP_M: (f64, f64, f64) = (23.4, 9.5, 24.0);

fn arms(layout: &Layout, node: usize, streets: &[usize]) -> Vec<Arm> {
    let center = layout.nodes[node].position;
    let mut arms: Vec<Arm> = Vec::new();
    for &street in streets {
        let one = &layout.streets[street];
        let end = usize::from(one.ends[0] != node);
        let mouth = match &one.shape {
            Shape::Exact(pieces) if end == 0 => pieces[0].start,
            Shape::Exact(pieces) => pieces[pieces.len() - 1].end().turned(),
            _ => Pose { position: center, heading: one.bearing(&layout.nodes, end) },
        };
        arms.push(Arm { street, end, mouth, profile: one.profile, extra: one.extra(end) });
    }
    arms.sort_by(|a, b| wrapped(a.mouth.heading).total_cmp(&wrapped(b.mouth.heading)));
    let distances: Vec<f64> = (0..arms.len()).map(|index| mouth_m(&arms, index)).collect();
    for (arm, distance) in arms.iter_mut().zip(distances) {
        if matches!(layout.streets[arm.street].shape, Shape::Corners { .. }) {
            let turning = layout.nodes[node].control == Control::Turning;
            arm.mouth = arm.mouth.ahead(if turning { LOOP_M.0 } else { distance });
        }
    }
    arms
}

/// The distance from the middle at which an arm must end so that its kerbs can be rounded. Metres.
fn mouth_m(arms: &[Arm], index: usize) -> f64 {
    let own = &arms[index];
    let mut distance: f64 = MOUTH_MIN;
    for (step, side) in [(1, own.in_side()), (arms.len() - 1, own.out_side())] {
        let other = &arms[(index + step) % arms.len()];
        let angle = wrapped(other.mouth.heading - own.mouth.heading).abs();
        if !(0.05..=PI - 0.3).contains(&angle) {
            continue;
        }
        let beside = if step == 1 { other.out_side() } else { other.in_side() };
        let (half, other_half) = (own.profile.half(), other.profile.half());
        let corner = (other_half + half * angle.cos()) / angle.sin();
        let town = own.profile.class == Class::Town && other.profile.class == Class::Town;
        let room = if town { CORNER_ROOM } else { WIDE_ROOM };
        // The narrower the lane, the larger the kerb radius that a truck needs.
        let narrow = own.profile.lane.min(other.profile.lane);
        let least = CORNER_MIN_M + (3.5 - narrow).max(0.0) * 5.0;
        let edge = own.profile.edge(side).max(other.profile.edge(beside));
        let radius = (edge + room).max(least);
        distance = distance.max(corner + radius / (angle * 0.5).tan());
    }
    distance
}

fn turns(layout: &Layout, arms: &[Arm]) -> Vec<Turn> {
    let count = arms.len();
    let mut ways: Vec<(usize, usize, usize, usize)> = Vec::new();
    for from in (0..count).filter(|from| arms[*from].ins() > 0) {
        let lanes = arms[from].ins();
        for step in 1..count {
            let to = (from + step) % count;
            let exits = arms[to].outs();
            if exits == 0 {
                continue;
            }
            // The turn of an arriving vehicle: 0 straight ahead, positive to the left.
            let bend = bend(arms, from, to);
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
    let mut turns: Vec<Turn> = Vec::new();
    for (from, to, from_lane, to_lane) in ways {
        // Traffic keeps right: the corner on the right of an arriving arm lies before the next arm
        // in counter-clockwise order.
        let outer = to == (from + 1) % count;
        let edge = outer
            && from_lane == arms[from].ins() - 1
            && to_lane == arms[to].outs() - 1
            && edges_agree(layout, arms, from, to);
        turns.push(Turn {
            from,
            to,
            lanes: Some((from_lane, to_lane)),
            edges: [edge, false],
            pieces: curve::between(arms[from].entry(from_lane), arms[to].exit(to_lane)),
        });
    }
    for from in 0..count {
        let to = (from + 1) % count;
        let bare =
            !turns.iter().any(|turn| (turn.from, turn.to, turn.edges[0]) == (from, to, true));
        if count > 1 && bare && edges_agree(layout, arms, from, to) {
            let kerb = |arm: &Arm, pose: Pose| pose.right(arm.profile.half());
            let entry = kerb(&arms[from], arms[from].mouth.turned());
            let exit = kerb(&arms[to], arms[to].mouth);
            let pieces = curve::between(entry, exit);
            turns.push(Turn { from, to, lanes: None, edges: [true, false], pieces });
        }
    }
    turns
}

/// The angle by which the connection between two arms turns to the left. Radians.
fn bend(arms: &[Arm], from: usize, to: usize) -> f64 {
    wrapped(arms[to].mouth.heading - arms[from].mouth.heading - PI)
}

/// Whether both sides of the corner between two arms have a sidewalk, or both a shoulder.
fn edges_agree(layout: &Layout, arms: &[Arm], from: usize, to: usize) -> bool {
    let (a, b) = (&arms[from], &arms[to]);
    let (here, there) = (a.in_side(), b.out_side());
    let both = a.edge(&layout.streets, here) > 0.0 && b.edge(&layout.streets, there) > 0.0;
    both && (a.profile.sidewalk[here] > 0.0) == (b.profile.sidewalk[there] > 0.0)
}

/// Adds connections until every outgoing lane is reached and every incoming lane leads on.
fn feed_every_exit(arms: &[Arm], ways: &mut Vec<(usize, usize, usize, usize)>) {
    for to in 0..arms.len() {
        for lane in 0..arms[to].outs() {
            if ways.iter().any(|way| (way.1, way.3) == (to, lane)) {
                continue;
            }
            // From the arm that is most nearly opposite.
            let others = (0..arms.len()).filter(|from| *from != to && arms[*from].ins() > 0);
            let straightest =
                others.min_by(|a, b| bend(arms, *a, to).abs().total_cmp(&bend(arms, *b, to).abs()));
            if let Some(from) = straightest {
                ways.push((from, to, lane.min(arms[from].ins() - 1), lane));
            }
        }
    }
    for from in 0..arms.len() {
        for lane in 0..arms[from].ins() {
            if ways.iter().any(|way| (way.0, way.2) == (from, lane)) {
                continue;
            }
            // The inner lane turns left, the outer lane right.
            let others = (0..arms.len()).filter(|to| *to != from && arms[*to].outs() > 0);
            let side = if lane == 0 { 1.0 } else { -1.0 };
            let best = others.max_by(|a, b| {
                (bend(arms, from, *a) * side).total_cmp(&(bend(arms, from, *b) * side))
            });
            if let Some(to) = best {
                ways.push((from, to, lane, lane.min(arms[to].outs() - 1)));
            }
        }
    }
}

/// Connects the lanes of a carriageway; a ramp branches off the outermost lane, or adds a lane.
fn weave(layout: &Layout, arms: &[Arm]) -> Vec<Turn> {
    let mut turns: Vec<Turn> = Vec::new();
    let mut go = |from: usize, to: usize, from_lane: usize, to_lane: usize| {
        turns.push(Turn {
            from,
            to,
            lanes: Some((from_lane, to_lane)),
            edges: [false; 2],
            pieces: curve::between(arms[from].entry(from_lane), arms[to].exit(to_lane)),
        });
    };
    let find = |ramp: bool, fits: fn(&Arm) -> bool| {
        arms.iter().position(|arm| (arm.profile.class == Class::Ramp) == ramp && fits(arm))
    };
    if let (Some(from), Some(to)) = (find(false, |a| a.ins() > 0), find(false, |a| a.outs() > 0)) {
        let lanes = arms[from].ins();
        // A deceleration lane leads to the exit only.
        (0..lanes - arms[from].extra).for_each(|lane| go(from, to, lane, lane));
        if let Some(exit) = find(true, |arm| arm.outs() > 0) {
            go(from, exit, lanes - 1, 0);
        }
        if let Some(entry) = find(true, |arm| arm.ins() > 0) {
            go(entry, to, 0, lanes);
        }
    }
    // Shoulders continue along the outermost lanes.
    for turn in &mut turns {
        let (from, to) = (&arms[turn.from], &arms[turn.to]);
        let Some((from_lane, to_lane)) = turn.lanes else { continue };
        let has = |arm: &Arm, side| arm.edge(&layout.streets, side) > 0.0;
        let (right, left) = (from.in_side(), from.out_side());
        let last = from_lane + 1 == from.ins() && to_lane + 1 == to.outs();
        turn.edges[0] = last && has(from, right) && has(to, to.out_side());
        turn.edges[1] = from_lane == 0 && to_lane == 0 && has(from, left) && has(to, to.in_side());
    }
    turns
}

/// The connection round a turning loop and back.
fn turning(arms: &[Arm]) -> Vec<Turn> {
    let (_, radius, bend) = LOOP_M;
    let angle = (bend / (bend + radius)).acos();
    let mut at = arms[0].entry(0);
    let parts = [(bend, -angle), (radius, PI + 2.0 * angle), (bend, -angle)];
    let pieces = parts.map(|(radius, turn): (f64, f64)| {
        let piece =
            Piece { start: at, length: radius * turn.abs(), curvature: turn.signum() / radius };
        at = piece.end();
        piece
    });
    let edge = arms[0].profile.sidewalk[0] > 0.0 && arms[0].profile.sidewalk[1] > 0.0;
    let pieces = pieces.to_vec();
    vec![Turn { from: 0, to: 0, lanes: Some((0, 0)), edges: [edge, false], pieces }]
}

fn rule(control: Control, arms: &[Arm]) -> Rule {
    let minor = || -> Vec<usize> {
        let arriving: Vec<usize> = (0..arms.len()).filter(|arm| arms[*arm].ins() > 0).collect();
        let weight = |arm: usize| {
            let profile = &arms[arm].profile;
            (profile.class, profile.all_lanes(), profile.limit_kmh as u32)
        };
        let most = arriving.iter().map(|arm| weight(*arm)).max();
        let less: Vec<usize> =
            arriving.iter().copied().filter(|arm| Some(weight(*arm)) != most).collect();
        match (arms.len(), less.is_empty() || less.len() + 1 >= arriving.len()) {
            (_, false) => less,
            (3, true) => vec![stem(arms)],
            (_, true) => arriving.into_iter().filter(|arm| arm % 2 == 1).collect(),
        }
    };
    match control {
        Control::Signals => Rule::Signals(groups(arms)),
        Control::Yield => Rule::Signs(Sign::Yield, minor()),
        Control::Stop => Rule::Signs(Sign::Stop, minor()),
        Control::Ring => {
            let enters =
                |arm: &usize| arms[*arm].profile.class != Class::Ring && arms[*arm].ins() > 0;
            Rule::Signs(Sign::Yield, (0..arms.len()).filter(enters).collect())
        }
        Control::Weave | Control::Turning => Rule::Signs(Sign::Yield, Vec::new()),
    }
}

/// Arms that are most nearly opposite each other have green together.
fn groups(arms: &[Arm]) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..arms.len()).filter(|arm| arms[*arm].ins() > 0).collect();
    let mut groups = Vec::new();
    while !left.is_empty() {
        let mut best: Option<(f64, usize, usize)> = None;
        for (k, &a) in left.iter().enumerate() {
            for &b in &left[k + 1..] {
                let off = bend(arms, a, b).abs();
                if off < 0.7 && best.is_none_or(|(least, ..)| off < least - 1e-9) {
                    best = Some((off, a, b));
                }
            }
        }
        let group = best.map_or_else(|| vec![left[0]], |(_, a, b)| vec![a, b]);
        left.retain(|arm| !group.contains(arm));
        groups.push(group);
    }
    groups
}

/// Of three arms, the one that ends at the other two.
fn stem(arms: &[Arm]) -> usize {
    let opposite = |arm: usize| {
        let bearing = |index: usize| arms[index % 3].mouth.heading;
        let gap = (bearing(arm + 2) - bearing(arm + 1)).rem_euclid(TAU);
        (gap - PI).abs()
    };
    (0..3).min_by(|a, b| opposite(*a).total_cmp(&opposite(*b))).unwrap_or(0)
}

/// The reference line of a street, from mouth to mouth.
pub(crate) fn line(street: &Street, mouths: [Pose; 2]) -> Vec<Piece> {
    match &street.shape {
        Shape::Exact(pieces) => pieces.clone(),
        Shape::Corners { via, radii } => {
            let (mut via, mut radii) = (via.clone(), radii.clone());
            let is_hidden = |corner: Option<&DVec2>, mouth: Pose| {
                corner.is_some_and(|at| (*at - mouth.position).dot(mouth.direction()) < HIDDEN_M)
            };
            let mut hidden = [is_hidden(via.first(), mouths[0]), is_hidden(via.last(), mouths[1])];
            if via.len() == 1 && hidden != [false; 2] {
                // Both ends use the same corner: each gets a copy of its own.
                via.push(via[0]);
                radii.push(radii[0]);
                hidden = [true; 2];
            }
            let last = via.len().saturating_sub(1);
            for (end, corner) in [(0, 0), (1, last)] {
                if hidden[end] {
                    via[corner] = mouths[end].position + mouths[end].direction() * CORNER_M;
                }
            }
            let mut corners: Vec<DVec2> = vec![mouths[0].position];
            corners.extend(via);
            corners.push(mouths[1].position);
            curve::rounded(&corners, &radii)
        }
    }
}

/// A junction may reach up to the first corner of a street or beyond it. Where less than this is
/// left, the corner is moved. Metres.
const HIDDEN_M: f64 = 3.0;
/// The distance from the street's mouth to which the corner is moved. Metres.
const CORNER_M: f64 = 8.0;
