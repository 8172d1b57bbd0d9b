//! Destinations, ways to them, and the velocity along a way.

use glam::Vec2;
use walkable::Search;

use super::{
    groups::Groups,
    pace,
    table::{WalkerTable, goal},
    view::View,
};
use crate::{
    client_route::ClientRoutes,
    random::{Purpose, unit},
};

/// Most searches for ways in one frame; other walkers wait for the next one.
const SEARCHES_MAX: usize = 16;
/// Distances of a destination that a walker chooses itself. Metres.
const NEAR_M: f32 = 25.0;
const FAR_M: f32 = 260.0;
/// Draws for one destination.
const TRIES: u32 = 24;
/// Farthest from the ground that a client's place may be. Metres.
const PLACE_REACH_M: f32 = 50.0;
/// A point of a way is passed at this distance. Metres.
const PASSED_M: f32 = 0.4;
/// A point is passed beside it too, up to this distance and with so much free ground towards the next one. Metres.
const BESIDE_M: f32 = 1.2;
const FREE_M: f32 = 2.0;
/// The last point of a way is passed at this distance. Metres.
const ARRIVED_M: f32 = 0.8;

/// Gives a way to every walker that has none.
pub(super) fn choose(
    table: &mut WalkerTable,
    routes: &mut ClientRoutes,
    search: &mut Search,
    standing: &[Option<(u32, Vec2)>],
    groups: &Groups,
    view: &View<'_>,
) {
    let mut searches = 0;
    for row in 0..table.count() {
        let Some((cell, at)) = standing[row] else { continue };
        let id = table.id(row);
        pass_points(table, row, (cell, at), view);
        let client_place = routes.first_place(id);
        if table.way(row).is_empty() && table.goal(row) == goal::CLIENT {
            routes.pass_place(id);
            table.set_way(row, goal::NONE, Vec::new());
            continue;
        }
        let companion = groups.leader(row).filter(|_| client_place.is_none());
        let crossing = view.ground.surface.cell(cell).crossing;
        // At the end of a crossing it steps off the road as soon as it can.
        let ends = |on: u32| view.ground.crossings[on as usize].is_end(at);
        let is_stuck = table.is_stuck(row) && !crossing.is_some_and(ends);
        let is_own = client_place.is_none() && companion.is_none() && table.goal(row) == goal::OWN;
        if is_stuck && !is_own {
            table.set_way(row, goal::NONE, Vec::new());
        }
        let is_due = match (client_place, companion) {
            (Some(_), _) => table.goal(row) != goal::CLIENT,
            (None, Some(leader)) => {
                groups.is_lost(row) && {
                    let to = standing[leader].map(|(_, at)| at);
                    let last = table.way(row).last();
                    // The companion has gone on since.
                    last.zip(to).is_none_or(|(end, now)| end.distance(now) > 2.0)
                }
            }
            (None, None) => table.way(row).is_empty() || table.goal(row) > goal::OWN || is_stuck,
        };
        if companion.is_some() && !groups.is_lost(row) && !table.way(row).is_empty() {
            table.set_way(row, goal::NONE, Vec::new());
        }
        if !is_due || searches >= SEARCHES_MAX {
            continue;
        }
        searches += 1;
        let (kind, to) = match (client_place, companion) {
            (Some(place), _) => {
                (goal::CLIENT, view.ground.surface.nearest(place.truncate(), PLACE_REACH_M))
            }
            (None, Some(leader)) => (goal::COMPANION, standing[leader]),
            (None, None) => (goal::OWN, draw(table, row, (cell, at), view)),
        };
        let way = to.and_then(|to| {
            let walk = pace::walk(view, id, cell);
            let connects = view.ground.connects(cell, to.0, walk.crosses);
            connects.then(|| search.route(&view.ground.surface, (cell, at), to, walk)).flatten()
        });
        // In a crowd that does not move, others stand ahead that come towards it.
        let ahead = table
            .way(row)
            .first()
            .filter(|_| crossing.is_none() && table.turns_round(row))
            .map(|&to| to - at);
        let leads_ahead = |way: &Vec<Vec2>| {
            ahead.zip(way.first()).is_some_and(|(ahead, &to)| (to - at).dot(ahead) > 0.0)
        };
        match way {
            // It tries again in the next frame.
            Some(way) if leads_ahead(&way) => (),
            Some(way) => table.set_way(row, kind, way),
            // No way leads to this place of the client.
            None if kind == goal::CLIENT => routes.pass_place(id),
            None => table.set_way(row, goal::NONE, Vec::new()),
        }
    }
}

/// Returns a destination at random.
fn draw(
    table: &mut WalkerTable,
    row: usize,
    (cell, at): (u32, Vec2),
    view: &View<'_>,
) -> Option<(u32, Vec2)> {
    let id = table.id(row);
    let crosses = pace::crosses(view, id, cell);
    let mut next = || {
        let state = table.row(row);
        state.draws = state.draws.wrapping_add(1);
        unit(view.seed, id, Purpose::WalkerGoal, state.draws.into())
    };
    let mut any = None;
    for _ in 0..TRIES {
        let to = view.ground.point([next(), next(), next()])?;
        if view.ground.connects(cell, to.0, crosses) {
            if (NEAR_M..FAR_M).contains(&to.1.distance(at)) {
                return Some(to);
            }
            any = Some(to);
        }
    }
    any
}

/// Removes the points of a way that a walker has passed.
fn pass_points(table: &mut WalkerTable, row: usize, (cell, at): (u32, Vec2), view: &View<'_>) {
    // There may be a hole between a walker beside a corner and the way beyond.
    let is_free = |to: Vec2| {
        let ahead = (to - at).clamp_length_max(FREE_M);
        let (_, there) = view.ground.surface.step(cell, at, at + ahead, |_| true);
        (there - at).dot(ahead) > 0.5 * ahead.length_squared()
    };
    while let Some(&point) = table.way(row).first() {
        let is_passed = match table.way(row).get(1) {
            Some(next) => {
                let along = (*next - point).normalize_or_zero();
                point.distance(at) < PASSED_M
                    || (point.distance(at) < BESIDE_M
                        && (at - point).dot(along) > 0.0
                        && is_free(*next))
            }
            None => point.distance(at) < ARRIVED_M,
        };
        if !is_passed {
            return;
        }
        table.pass_point(row);
    }
}

/// Returns the velocity that a walker on the ground prefers.
pub(super) fn velocity(
    table: &WalkerTable,
    row: usize,
    on: (u32, Vec2),
    groups: &Groups,
    view: &View<'_>,
) -> Vec2 {
    if groups.leader(row).is_some() && !groups.is_lost(row) && table.goal(row) != goal::CLIENT {
        return groups.beside(row, on.1, view);
    }
    let Some(&point) = table.way(row).first() else { return Vec2::ZERO };
    let is_crossing = view.ground.surface.cell(on.0).crossing.is_some();
    let speed = if is_crossing { groups.speed_mps(row) } else { groups.patient_speed_mps(row) };
    (point - on.1).normalize_or_zero() * speed
}
