//! Routes commanded by clients: positions and turns, and the lanes that lead there.
//!
//! A vehicle with such a route has a plan: a list of lanes, each the successor of the one before or
//! its neighbour. Its route follows the plan at forks, and it changes lanes where the plan does. A
//! vehicle that leaves the plan, because no gap was free or it lost its lane, gets a new plan from
//! its position.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use bytemuck::Zeroable;
use glam::Vec3;
use protocol::{RouteCommand, RouteStep, route_step};

use crate::{
    grid::{Grid, Pass},
    tracks::{NONE, TURN_RAD, Tracks},
    vehicle_table::Vehicle,
};

/// Lanes at most this much farther from a position than the nearest lane also count as passing it.
const TIE_M: f32 = 0.75;
/// Cost of a lane change, in decimetres of route.
const CHANGE_DM: u32 = 300;
/// Cost of a lane change that the markings forbid.
const FORBIDDEN_CHANGE_DM: u32 = 3_000;
/// Cost of a U-turn at a dead end, in decimetres of route.
const TURN_ROUND_DM: u32 = 2_000;
/// Shortest lane on which a lane change is planned.
const CHANGE_ROOM_M: f32 = 20.0;
/// Most lanes that a vehicle passes in one frame.
const LANES_PER_FRAME_MAX: usize = 4;
/// Number of lanes ahead in which the next junction is searched.
const LANES_AHEAD: usize = 400;

/// The commanded steps of one vehicle and the plan that carries them out.
#[derive(Clone, Debug, Default, PartialEq)]
struct ClientRoute {
    actor: u32,
    /// Steps that are not completed yet.
    steps: Vec<RouteStep>,
    /// The current lane and the lanes to take; empty until the route is planned.
    plan: Vec<PlannedLane>,
}

/// One lane of a plan, and the number of steps that are completed at `until_m` on it.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, Zeroable)]
#[repr(C)]
struct PlannedLane {
    lane: u32,
    done: u32,
    until_m: f32,
}

/// The routes of all vehicles that have one, ascending by actor id.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ClientRoutes(Vec<ClientRoute>);

impl ClientRoutes {
    /// Returns whether no vehicle has a route.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether `actor` has a route.
    pub(crate) fn has(&self, actor: u32) -> bool {
        self.plan(actor).is_some()
    }

    /// Adds the steps of a command, or replaces the route by them.
    pub(crate) fn apply(&mut self, command: &RouteCommand) {
        let actor = command.actor_id.0;
        let at = match self.0.binary_search_by_key(&actor, |client_route| client_route.actor) {
            Ok(at) => at,
            Err(at) => {
                self.0.insert(at, ClientRoute { actor, ..ClientRoute::default() });
                at
            }
        };
        let client_route = &mut self.0[at];
        if command.replace != 0 {
            client_route.steps.clear();
        }
        client_route
            .steps
            .extend_from_slice(&command.steps[..(command.count as usize).min(command.steps.len())]);
        client_route.plan.clear();
        if client_route.steps.is_empty() {
            self.0.remove(at);
        }
    }

    /// Removes the route of a destroyed actor.
    pub(crate) fn remove(&mut self, actor: u32) {
        self.0.retain(|client_route| client_route.actor != actor);
    }

    /// Returns the first place of the route of `actor`.
    pub(crate) fn first_place(&self, actor: u32) -> Option<Vec3> {
        let at = self.0.binary_search_by_key(&actor, |route| route.actor).ok()?;
        self.0[at].steps.first().map(|step| Vec3::from_array(step.position_m))
    }

    /// Removes the first step of the route of `actor`.
    pub(crate) fn pass_place(&mut self, actor: u32) {
        if let Ok(at) = self.0.binary_search_by_key(&actor, |route| route.actor) {
            self.0[at].steps.drain(..1);
            if self.0[at].steps.is_empty() {
                self.0.remove(at);
            }
        }
    }

    /// Advances the plan to the vehicle's lane, or makes a new plan if there is none. The drawn
    /// route beyond that lane is dropped, except what a reservation covers.
    pub(crate) fn update(&mut self, vehicle: &mut Vehicle, tracks: &Tracks, grid: &Grid) {
        let Ok(at) = self.0.binary_search_by_key(&vehicle.id, |client_route| client_route.actor)
        else {
            return;
        };
        let client_route = &mut self.0[at];
        let lane = vehicle.route.lane();
        // The plan may use the same lane again farther on.
        match client_route
            .plan
            .iter()
            .take(LANES_PER_FRAME_MAX)
            .position(|unfinished| unfinished.lane == lane)
        {
            Some(index) => {
                let before =
                    client_route.plan.drain(..index).map(|unfinished| unfinished.done).sum::<u32>();
                let own = &mut client_route.plan[0];
                let has_arrived = vehicle.arc_m >= own.until_m;
                let done = before + if has_arrived { std::mem::take(&mut own.done) } else { 0 };
                client_route.steps.drain(..done as usize);
            }
            None => {
                let passing = if vehicle.reservation == 0 {
                    1
                } else {
                    vehicle.reservation_end.wrapping_sub(vehicle.route.lanes_passed) as usize
                };
                let kept = passing.clamp(1, vehicle.route.lanes().len());
                vehicle.route.truncate(kept);
                client_route.make_plan(vehicle.route.lanes(), tracks, grid);
            }
        }
        if client_route.steps.is_empty() {
            self.0.remove(at);
        }
    }

    /// Returns the lane that the plan of `actor` names after the first `count` lanes of its route,
    /// the last of which is `last`; `None` if there is no plan or the route deviates from it.
    pub(crate) fn next(&self, actor: u32, count: usize, last: u32) -> Option<u32> {
        let plan = self.plan(actor)?;
        (plan.get(count - 1)?.lane == last)
            .then(|| plan.get(count).map(|unfinished| unfinished.lane))?
    }

    /// Returns to which side the plan of `actor` leaves `lane`: 1 left, -1 right, 0 neither; `None`
    /// without a plan.
    pub(crate) fn lane_change_side(&self, actor: u32, lane: u32, tracks: &Tracks) -> Option<f32> {
        let [own, next, ..] = self.plan(actor)? else { return Some(0.0) };
        // Steps that end on this lane are completed first.
        let leaves = own.lane == lane && own.done == 0;
        let beside = |side: u32| leaves && side != NONE && next.lane == side;
        Some(if beside(tracks.left[lane as usize]) {
            1.0
        } else if beside(tracks.right[lane as usize]) {
            -1.0
        } else {
            0.0
        })
    }

    fn plan(&self, actor: u32) -> Option<&[PlannedLane]> {
        let at = self.0.binary_search_by_key(&actor, |client_route| client_route.actor).ok()?;
        Some(&self.0[at].plan)
    }

    /// Appends all routes to `bytes`.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
        for client_route in &self.0 {
            let head = [
                client_route.actor,
                client_route.steps.len() as u32,
                client_route.plan.len() as u32,
            ];
            bytes.extend_from_slice(bytemuck::cast_slice(&head));
            bytes.extend_from_slice(bytemuck::cast_slice(&client_route.steps));
            bytes.extend_from_slice(bytemuck::cast_slice(&client_route.plan));
        }
    }

    /// Reads what [`ClientRoutes::write`] wrote; `None` if the bytes are cut off, out of order or
    /// name a lane beyond `lanes`.
    pub(crate) fn read(mut bytes: &[u8], lanes: usize) -> Option<ClientRoutes> {
        let mut all: Vec<ClientRoute> = Vec::new();
        while !bytes.is_empty() {
            let [actor, steps, legs] = take::<[u32; 3]>(&mut bytes, 1)?[0];
            let steps = take::<RouteStep>(&mut bytes, steps as usize)?;
            let plan = take::<PlannedLane>(&mut bytes, legs as usize)?;
            let done: usize = plan.iter().map(|unfinished| unfinished.done as usize).sum();
            let on_map = plan.iter().all(|unfinished| (unfinished.lane as usize) < lanes);
            let ascends = all.last().is_none_or(|before| before.actor < actor);
            if !on_map || !ascends || done > steps.len() || steps.is_empty() {
                return None;
            }
            all.push(ClientRoute { actor, steps, plan });
        }
        Some(ClientRoutes(all))
    }
}

fn take<T: bytemuck::Pod>(bytes: &mut &[u8], count: usize) -> Option<Vec<T>> {
    let size = count.checked_mul(size_of::<T>())?;
    let (part, rest) = bytes.split_at_checked(size)?;
    *bytes = rest;
    Some(part.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}

/// For each lane that a search reached: its cost, and the lane before it or [`NONE`].
type Reached = BTreeMap<u32, (u32, u32)>;

/// Returns the lane of least cost.
///
/// # Panics
/// If `lanes` is empty.
fn cheapest(lanes: &BTreeMap<u32, u32>) -> u32 {
    *lanes.iter().min_by_key(|&(lane, cost)| (cost, lane)).expect("a search has a source").0
}

impl ClientRoute {
    /// Plans from the last of the `driven` lanes, which are fixed. Steps that cannot be carried out
    /// from there are dropped.
    fn make_plan(&mut self, driven: &[u32], tracks: &Tracks, grid: &Grid) {
        let Some(&start) = driven.last() else { return };
        let mut stages: Vec<Reached> = Vec::new();
        let mut sources = BTreeMap::from([(start, 0)]);
        self.steps.retain(|step| {
            let best = cheapest(&sources);
            let goals = goals(step, best, tracks, grid);
            if step.kind != route_step::PLACE {
                sources = BTreeMap::from([(best, sources[&best])]);
            }
            let reached = search(&sources, &goals, tracks);
            let arrived = goals.iter().filter_map(|goal| Some((*goal, reached.get(goal)?.0)));
            let arrived: BTreeMap<u32, u32> = arrived.collect();
            if arrived.is_empty() {
                return false;
            }
            sources = arrived;
            stages.push(reached);
            true
        });
        let mut lane = cheapest(&sources);
        let mut paths: Vec<Vec<u32>> = Vec::new();
        for reached in stages.iter().rev() {
            let mut path = Vec::new();
            while reached[&lane].1 != NONE {
                path.push(lane);
                lane = reached[&lane].1;
            }
            path.reverse();
            paths.push(path);
        }
        let unfinished = |&lane: &u32| PlannedLane { lane, done: 0, until_m: 0.0 };
        self.plan = driven.iter().map(unfinished).collect();
        for (path, step) in paths.iter().rev().zip(&self.steps) {
            self.plan.extend(path.iter().map(unfinished));
            let Some(last) = self.plan.last_mut() else { return };
            last.done += 1;
            if step.kind == route_step::PLACE {
                let place = Vec3::from_array(step.position_m).truncate();
                let hint_m = tracks.nearest_sample(last.lane, place).0;
                let arc_m = tracks.project(last.lane, place, hint_m).arc_m;
                last.until_m = last.until_m.max(arc_m.min(tracks.length(last.lane)));
            }
        }
        change_early(&mut self.plan, driven.len(), tracks);
    }
}

/// Returns the lanes that complete a step for a vehicle that comes from `from`.
fn goals(step: &RouteStep, from: u32, tracks: &Tracks, grid: &Grid) -> BTreeSet<u32> {
    match step.kind {
        route_step::PLACE => lanes_by(Vec3::from_array(step.position_m), tracks, grid),
        route_step::LEFT | route_step::RIGHT | route_step::STRAIGHT => {
            turns(step.kind, from, tracks)
        }
        route_step::LANE_LEFT | route_step::LANE_RIGHT => {
            let Some(lane) = beyond_junction(from, tracks) else { return BTreeSet::new() };
            let sides =
                if step.kind == route_step::LANE_LEFT { &tracks.left } else { &tracks.right };
            let side = sides[lane as usize];
            (side != NONE).then_some(side).into_iter().collect()
        }
        _ => BTreeSet::new(),
    }
}

/// Returns the lanes that pass a position. In a junction these are often several.
fn lanes_by(place: Vec3, tracks: &Tracks, grid: &Grid) -> BTreeSet<u32> {
    let flat = place.truncate();
    let mut near: Vec<(f32, u32)> = Vec::new();
    for &Pass { lane, hint_m, .. } in grid.near(flat) {
        let projection = tracks.project(lane, flat, hint_m);
        let beyond = (projection.arc_m - projection.arc_m.clamp(0.0, tracks.length(lane))).abs();
        let above = ((tracks.at(lane, projection.arc_m).0.z - place.z).abs() - 2.0).max(0.0);
        near.push((projection.left_m.hypot(beyond) + 3.0 * above, lane));
    }
    if near.is_empty() {
        near.extend(tracks.nearest(flat).map(|(lane, _)| (0.0, lane)));
    }
    let least = near.iter().map(|&(distance, _)| distance).fold(f32::INFINITY, f32::min);
    near.iter().filter(|(distance, _)| *distance <= least + TIE_M).map(|&(_, lane)| lane).collect()
}

/// Returns `from`, or the first lane after the junction that contains it.
fn beyond_junction(from: u32, tracks: &Tracks) -> Option<u32> {
    let mut lane = from;
    for _ in 0..LANES_AHEAD {
        if !tracks.in_junction(lane) {
            return Some(lane);
        }
        lane = *tracks.next(lane).first()?;
    }
    None
}

/// Returns the lanes of the next junction that turn to the given side, from the current lane or its
/// neighbours; if there are none, the straightest.
fn turns(kind: u32, from: u32, tracks: &Tracks) -> BTreeSet<u32> {
    let Some(mut entry) = beyond_junction(from, tracks) else { return BTreeSet::new() };
    let mut lanes_left = LANES_AHEAD;
    let entries =
        |lane: u32| tracks.next(lane).iter().copied().filter(|&path| tracks.in_junction(path));
    while entries(entry).next().is_none() {
        let Some(&next) = tracks.next(entry).first().filter(|_| lanes_left > 0) else {
            return BTreeSet::new();
        };
        (entry, lanes_left) = (next, lanes_left - 1);
    }
    let mut bundle = vec![entry];
    for sides in [&tracks.left, &tracks.right] {
        let mut lane = sides[entry as usize];
        while lane != NONE && !bundle.contains(&lane) {
            bundle.push(lane);
            lane = sides[lane as usize];
        }
    }
    let turns_there = |path: u32| {
        let turn = tracks.turn_rad(path);
        match kind {
            route_step::LEFT => turn > TURN_RAD,
            route_step::RIGHT => turn < -TURN_RAD,
            _ => turn.abs() <= TURN_RAD,
        }
    };
    let found: BTreeSet<u32> =
        bundle.iter().flat_map(|&lane| entries(lane)).filter(|&path| turns_there(path)).collect();
    if found.is_empty() {
        let turn_abs = |path: &u32| tracks.turn_rad(*path).abs();
        entries(entry).min_by(|a, b| turn_abs(a).total_cmp(&turn_abs(b))).into_iter().collect()
    } else {
        found
    }
}

/// Returns whether the next junction after `from` offers a turn.
#[cfg(test)]
pub(crate) fn offers(kind: u32, from: u32, tracks: &Tracks) -> bool {
    turns(kind, from, tracks)
        .iter()
        .any(|&path| (tracks.turn_rad(path).abs() > TURN_RAD) == (kind != route_step::STRAIGHT))
}

/// Returns the cheapest paths from `sources`, which have initial costs, to all of `goals` that can
/// be reached (Dijkstra 1959).
fn search(sources: &BTreeMap<u32, u32>, goals: &BTreeSet<u32>, tracks: &Tracks) -> Reached {
    let mut reached = Reached::new();
    let mut missing = goals.clone();
    let mut queue: BinaryHeap<Reverse<(u32, u32, u32)>> =
        sources.iter().map(|(&lane, &cost)| Reverse((cost, lane, NONE))).collect();
    while let Some(Reverse((cost, lane, from))) = queue.pop() {
        if reached.contains_key(&lane) {
            continue;
        }
        reached.insert(lane, (cost, from));
        missing.remove(&lane);
        if missing.is_empty() {
            break;
        }
        for &next in tracks.next(lane) {
            let way_dm = (10.0 * tracks.length(next)) as u32 + 1;
            queue.push(Reverse((cost.saturating_add(way_dm), next, lane)));
        }
        let back = tracks.u_turn_lane[lane as usize];
        if back != NONE && tracks.next(lane).is_empty() {
            queue.push(Reverse((cost.saturating_add(TURN_ROUND_DM), back, lane)));
        }
        if tracks.in_junction(lane) {
            continue;
        }
        let index = lane as usize;
        let allowed = [tracks.left_change[index], tracks.right_change[index]];
        for (side, allowed) in [tracks.left[index], tracks.right[index]].into_iter().zip(allowed) {
            if side != NONE && tracks.has(side) {
                let easy = allowed && tracks.length(lane) > CHANGE_ROOM_M;
                let change_dm = if easy { CHANGE_DM } else { FORBIDDEN_CHANGE_DM };
                queue.push(Reverse((cost.saturating_add(change_dm), side, lane)));
            }
        }
    }
    reached
}

/// Moves lane changes to the first lanes that allow them. The search is indifferent to where on a
/// path they are; traffic is not.
fn change_early(plan: &mut [PlannedLane], driven: usize, tracks: &Tracks) {
    let beside = |lane: u32, other: u32| {
        let index = lane as usize;
        [&tracks.left, &tracks.right].into_iter().find(|sides| sides[index] == other)
    };
    let mut at = driven.max(1);
    while at + 1 < plan.len() {
        let [before, lane, after] = [plan[at - 1].lane, plan[at].lane, plan[at + 1].lane];
        let earlier = beside(lane, after)
            .filter(|_| plan[at].done == 0 && tracks.next(before).contains(&lane))
            .map(|sides| sides[before as usize])
            .filter(|&side| side != NONE && !tracks.in_junction(before))
            .filter(|&side| tracks.next(side).contains(&after));
        match earlier {
            Some(side) => {
                plan[at].lane = side;
                at = (at - 1).max(driven.max(1));
            }
            None => at += 1,
        }
    }
}
