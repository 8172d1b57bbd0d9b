//! The planner of walkers on autopilot: where they go, when they cross, and how they avoid others.
//!
//! ```text
//! snapshot ─▶ stand on the ground ─▶ goals, routes ─▶ groups ─▶ crossings ─▶ avoidance ─▶ controls
//! ```
//!
//! A walker walks to a destination over sidewalks and crosswalks, a share of them also across quiet
//! streets. It begins to cross when the lights and the approaching vehicles allow it; from then on,
//! the vehicles wait for it ([`claims`]).

mod approaching;
mod aside;
mod avoidance;
mod crossings;
mod goals;
mod ground;
mod groups;
mod linear_program;
mod pace;
mod table;
mod view;

use glam::Vec2;
use protocol::{ActorId, WalkerControl};
use walkable::Search;

use self::{
    approaching::Approaching,
    aside::InSweptPaths,
    crossings::{Crossings, Leave},
    groups::Groups,
};
#[cfg(test)]
pub(crate) use self::{
    crossings::WALK_S,
    ground::{CrossedLane, Crossing},
};
pub(crate) use self::{ground::WalkerGround, table::WalkerTable, view::View};
use crate::{
    agents::Agents, client_route::ClientRoutes, demand::Demand, map::Map, neighbours::Neighbours,
};

/// Farthest that a walker stands from the ground to return to it. Metres.
const RETURN_M: f32 = 30.0;
/// Distance from the ground beyond which a walker returns to it. Metres.
const OFF_GROUND_M: f32 = 0.4;
/// Time for which a walker that has stepped out of a swept path leaves it to the vehicle. Seconds.
const ASIDE_S: f32 = 6.0;
/// Length of free ground that a walker needs to step aside. Metres.
const ROOM_M: f32 = 0.5;
/// Angle from the way out of a swept path at which a walker steps aside where that way is not free.
const SLANT_RAD: f32 = std::f32::consts::FRAC_PI_3;
/// Distance before a crossing at which a walker decides whether to begin. Metres.
const GATE_M: f32 = 0.5;
/// Distance from the kerb at which a walker waits, if there is room, and its speed on the way there. Metres,
/// metres per second.
const FROM_KERB_M: f32 = 0.4;
const TO_KERB_MPS: f32 = 0.6;
/// Distance before the middle of a lane from which on a walker that crosses towards it claims it. Metres.
const CLAIM_M: f32 = 9.0;
/// Distance beyond the middle of a lane up to which a walker claims it. Metres.
const CLEARED_M: f32 = 1.7;

/// Data of one frame; kept to reuse its allocations.
#[derive(Default)]
pub(crate) struct Scratch {
    search: Search,
    /// By row: the triangle under the walker and the nearest point in it, if there is one near.
    standing: Vec<Option<(u32, Vec2)>>,
    groups: Groups,
    approaching: Approaching,
    /// Vehicles and props by place.
    bodies: Neighbours,
    /// By row: the velocity that it prefers.
    wanted: Vec<Vec2>,
    /// By row: the crossing before which it has to wait.
    held: Vec<Option<u32>>,
    /// By row: the crossing that it may enter.
    granted: Vec<Option<u32>>,
    /// By row: whether it stands on the road at the end of a crossing and is to leave it.
    leaves_road: Vec<bool>,
    in_swept_paths: InSweptPaths,
}

impl Scratch {
    /// Forgets the frame before.
    pub(crate) fn clear(&mut self) {
        self.standing.clear();
        self.held.clear();
    }

    /// Finds the ground under every walker.
    pub(crate) fn stand(&mut self, ground: &WalkerGround, agents: &Agents) {
        self.standing.clear();
        self.standing.extend(agents.led.iter().map(|&agent| {
            let at = agents.position[agent as usize].truncate();
            ground.surface.nearest(at, RETURN_M)
        }));
    }

    /// Returns the stretches of lanes that walkers on crossings are about to walk over: agent, lane,
    /// arc length. A walker that only returns to a crossing claims nothing: it may be unable to; nor
    /// does one that stands at its end, on the sidewalk, or one that has given way to a
    /// vehicle and stands. One that stands at the end on the road claims lanes so near that vehicles
    /// would touch it.
    pub(crate) fn claims(
        &self,
        table: &WalkerTable,
        ground: &WalkerGround,
        agents: &Agents,
        claims: &mut Vec<(u32, u32, f32)>,
    ) {
        for (row, (&agent, standing)) in agents.led.iter().zip(&self.standing).enumerate() {
            let at = agents.position[agent as usize].truncate();
            let Some((cell, near)) = *standing else { continue };
            let Some(crossing) = ground.surface.cell(cell).crossing else { continue };
            if near.distance(at) > OFF_GROUND_M {
                continue;
            }
            let crossing = &ground.crossings[crossing as usize];
            let along_m = (at - crossing.center).dot(crossing.axis);
            let along_mps = agents.velocity[agent as usize].dot(crossing.axis);
            if table.gives_way(row) && along_mps.abs() < pace::SLOW_MPS {
                continue;
            }
            // One that stands at the end has crossed and waits for another crossing, or is about to
            // begin.
            let leaves_end = along_mps * -along_m.signum() > pace::SLOW_MPS;
            if along_m.abs() > crossing.half_length_m && !leaves_end {
                continue;
            }
            let claim_m = if crossing.is_end(at) && !leaves_end { CLEARED_M } else { CLAIM_M };
            let ahead = along_mps.signum();
            for lane in &crossing.lanes {
                let to_m = (lane.along_m - along_m) * ahead;
                if (-CLEARED_M..claim_m).contains(&to_m) {
                    // Vehicles stop before the crossing; those that are on it before the walker.
                    claims.push((agent, lane.lane, lane.arc_m - crossing.half_width_m));
                    claims.push((agent, lane.lane, lane.arc_m));
                }
            }
        }
    }

    /// Registers walkers that wait at lights: another phase than that of the vehicles is to follow.
    pub(crate) fn call(&self, map: &Map, demand: &mut Demand) {
        let ground = map.walker_ground();
        for crossing in self.held.iter().flatten() {
            for &signal in &ground.crossings[*crossing as usize].signals {
                let Some((cycle, phase)) = map.signals.slot(signal) else { continue };
                let phases = map.signals.phases(cycle);
                if phases > 1 {
                    demand.add(cycle as usize, ((phase + 1) % phases).into(), false);
                }
            }
        }
    }
}

/// Plans for every walker on autopilot.
pub(crate) fn plan(
    table: &mut WalkerTable,
    routes: &mut ClientRoutes,
    scratch: &mut Scratch,
    view: &View<'_>,
    controls: &mut Vec<WalkerControl>,
) {
    controls.clear();
    if view.agents.led.is_empty() {
        return;
    }
    let Scratch {
        search,
        standing,
        groups,
        approaching,
        bodies,
        wanted,
        held,
        granted,
        leaves_road,
        in_swept_paths,
    } = scratch;
    let agents = view.agents;
    groups.find(table, standing, view);
    approaching.find(view);
    in_swept_paths.find(view);
    goals::choose(table, routes, search, standing, groups, view);
    wanted.clear();
    held.clear();
    granted.clear();
    leaves_road.clear();
    for row in 0..table.count() {
        let at = agents.position[agents.led[row] as usize].truncate();
        let mut velocity = match standing[row] {
            // Far from any ground, a walker stays where it is.
            None => Vec2::ZERO,
            Some((_, near)) if near.distance(at) > OFF_GROUND_M => {
                (near - at).clamp_length(0.0, pace::speed(view, table.id(row)))
            }
            Some(on) => goals::velocity(table, row, on, groups, view),
        };
        let gate = gate(row, standing, velocity, approaching, view);
        let holds = |(crossing, leave)| (leave == Leave::Wait).then_some(crossing);
        let grants = |(crossing, leave)| (leave == Leave::Go).then_some(crossing);
        let is_held = gate.is_some_and(|gate| holds(gate).is_some());
        let is_stuck = table.is_stuck(row);
        let is_on_ground = |(_, near): &(u32, Vec2)| near.distance(at) <= OFF_GROUND_M;
        let state = table.row(row);
        state.aside_s = (state.aside_s - view.delta_s).max(0.0);
        let (own, mut back_over) = (velocity, None);
        let outwards = standing[row].map_or(Vec2::ZERO, |(cell, _)| to_kerb(cell, at, view.ground));
        // One that comes no farther at the end of a crossing leaves the road too, and looks for another way there.
        if is_held || (is_stuck && outwards != Vec2::ZERO) {
            velocity = outwards;
        }
        // A walker off the ground returns to it, whatever waits for it meanwhile.
        if let Some(on) = standing[row].filter(is_on_ground) {
            let crossings = Crossings { view, approaching };
            let aside = aside(row, on, own, is_held, in_swept_paths, &crossings);
            if let Some((aside, over)) = aside {
                (velocity, state.aside_s, back_over) = (aside, ASIDE_S, over);
            } else if state.aside_s > 0.0
                && (view.ground.surface.cell(on.0).crossing.is_some()
                    || !in_swept_paths.has(agents.led[row]))
            {
                // On a crossing it stands also if another vehicle waits for it: going on would stop the one to which
                // it has given way.
                velocity = Vec2::ZERO;
            }
        }
        wanted.push(velocity);
        leaves_road.push(velocity.dot(outwards) > 0.0);
        held.push(gate.and_then(holds));
        granted.push(back_over.or(gate.and_then(grants)));
    }
    let solid = |agent: &u32| !agents.walks[*agent as usize];
    let placed = |agent: u32| (agent, agents.position[agent as usize].truncate());
    bodies.rebuild((0..agents.count() as u32).filter(solid).map(placed));
    let crowd = avoidance::Crowd { bodies, groups, wanted, leaves_road, view };
    for row in 0..table.count() {
        let velocity = match standing[row] {
            None => Vec2::ZERO,
            Some(on) => {
                let chosen = crowd.velocity(row);
                crowd.slowed(row, on_ground(row, on, chosen, granted[row], view))
            }
        };
        table.watch(row, wanted[row], velocity, held[row].is_some(), view.delta_s);
        let speed_mps = velocity.length();
        controls.push(WalkerControl {
            actor_id: ActorId(table.id(row)),
            speed_mps,
            direction: velocity.normalize_or_zero().to_array(),
        });
    }
}

/// Returns the velocity with which a walker leaves a vehicle the room for which it waits, and the
/// crossing to which it goes back; `None` if the walker has no need to, or no ground for it: then it
/// goes on, which takes it out of the path too.
fn aside(
    row: usize,
    (cell, at): (u32, Vec2),
    wanted: Vec2,
    is_held: bool,
    in_swept_paths: &InSweptPaths,
    crossings: &Crossings,
) -> Option<(Vec2, Option<u32>)> {
    if in_swept_paths.is_empty() {
        return None;
    }
    let surface = &crossings.view.ground.surface;
    let here = surface.cell(cell).crossing;
    let out = in_swept_paths.aside(crossings.view.agents.led[row]);
    let crossing = here.filter(|_| !is_held);
    let back = match crossing {
        // On a crossing a walker goes on, unless a vehicle stands in its way that waits for it or for
        // others here: then all of them go back, also to the end of the crossing before.
        Some(crossing) => {
            let waits = |vehicle: u32| in_swept_paths.holds_up(vehicle);
            if !crossings.is_blocked(crossing, at, wanted, waits) {
                return None;
            }
            let axis = crossings.view.ground.crossings[crossing as usize].axis;
            Some(axis * -wanted.dot(axis).signum() * aside::ASIDE_MPS)
        }
        None if out.is_none() => return None,
        None => is_held.then_some(-wanted.normalize_or_zero() * aside::ASIDE_MPS),
    };
    let allows = |next: &walkable::Cell| {
        crossing.is_some() || next.crossing.is_none() || next.crossing == here
    };
    let step = |velocity: Vec2, allows: &dyn Fn(&walkable::Cell) -> bool| {
        let direction = velocity.normalize_or_zero();
        let (last, there) = surface.step(cell, at, at + direction * ROOM_M, allows);
        let has_room = (there - at).dot(direction) > 0.5 * ROOM_M;
        has_room.then(|| (surface.cell(last).crossing, there))
    };
    // A pole or a corner of the ground may leave no room straight out of the path.
    let slanting = [SLANT_RAD, -SLANT_RAD].map(|angle| {
        out.filter(|_| is_held && here.is_none()).map(|out| Vec2::from_angle(angle).rotate(out))
    });
    [out, back].into_iter().chain(slanting).flatten().find_map(|velocity| {
        // At a corner, another crossing may end behind a walker that waits.
        let over_end = || {
            let ends = |(over, there): &(Option<u32>, Vec2)| {
                let crossings = &crossings.view.ground.crossings;
                over.is_some_and(|over| crossings[over as usize].is_end(*there))
            };
            step(velocity, &|_| true).filter(ends)
        };
        let (over, _) = step(velocity, &allows).or_else(over_end)?;
        Some((velocity, over))
    })
}

/// Returns the crossing that lies ahead of a walker, or at the end of which it stands before it begins, and
/// whether it may begin to cross.
fn gate(
    row: usize,
    standing: &[Option<(u32, Vec2)>],
    wanted: Vec2,
    approaching: &Approaching,
    view: &View<'_>,
) -> Option<(u32, Leave)> {
    let (cell, at) = standing[row]?;
    let surface = &view.ground.surface;
    let here = surface.cell(cell).crossing;
    let ahead = at + wanted.normalize_or_zero() * GATE_M;
    let (last, _) = surface.step(cell, at, ahead, |_| true);
    let there = surface.cell(last).crossing.filter(|there| Some(*there) != here);
    let velocity = view.agents.velocity[view.agents.led[row] as usize];
    let begins = |crossing: &u32| {
        let on = &view.ground.crossings[*crossing as usize];
        let inwards = on.axis * (on.center - at).dot(on.axis).signum();
        on.is_end(at) && velocity.length() < pace::SLOW_MPS && wanted.dot(inwards) > pace::SLOW_MPS
    };
    let crossing = here.filter(begins).or(there)?;
    let crossings = Crossings { view, approaching };
    Some((crossing, crossings.leave(crossing, at, wanted)))
}

/// Returns the velocity with which a walker leaves the road at the end of a crossing, where it would stop the
/// vehicles that turn; zero elsewhere.
fn to_kerb(cell: u32, at: Vec2, ground: &WalkerGround) -> Vec2 {
    let Some(crossing) = ground.surface.cell(cell).crossing else { return Vec2::ZERO };
    let on = &ground.crossings[crossing as usize];
    let along_m = (at - on.center).dot(on.axis);
    let is_on_road = along_m.abs() < on.half_length_m + FROM_KERB_M;
    if is_on_road && on.is_end(at) { on.axis * along_m.signum() * TO_KERB_MPS } else { Vec2::ZERO }
}

/// Returns the part of a velocity that keeps a walker on its ground during the next frame, and off
/// the crossings that it may not enter.
fn on_ground(
    row: usize,
    (cell, near): (u32, Vec2),
    velocity: Vec2,
    granted: Option<u32>,
    view: &View<'_>,
) -> Vec2 {
    let at = view.agents.position[view.agents.led[row] as usize].truncate();
    if near.distance(at) > 0.05 {
        // It returns to the ground first.
        return velocity;
    }
    let surface = &view.ground.surface;
    let here = surface.cell(cell).crossing;
    let allows = |next: &walkable::Cell| {
        next.crossing.is_none() || next.crossing == here || next.crossing == granted
    };
    let stands = |velocity: Vec2| velocity.length() < pace::STANDING_MPS;
    let (_, there) = surface.step(cell, near, near + velocity * view.delta_s, allows);
    let mut bounded = (there - at) / view.delta_s;
    if stands(bounded)
        && !stands(velocity)
        && let Some(there) = surface.detour(cell, near, velocity, allows)
    {
        bounded = (there - at).clamp_length_max(velocity.length() * view.delta_s) / view.delta_s;
    }
    if stands(bounded) { Vec2::ZERO } else { bounded }
}
