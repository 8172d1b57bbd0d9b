//! Routes over walkable ground: A* over triangles, and the shortest way through them.

use std::{cmp::Reverse, collections::BinaryHeap};

use glam::Vec2;

use crate::{
    area::Area,
    funnel::{self, Portal},
    surface::Surface,
};

/// Extra cost of each crossing. Metres of way.
const CROSSWALK_M: f32 = 6.0;
const ROAD_M: f32 = 8.0;
/// Most triangles that a search visits.
const VISITS_MAX: usize = 30_000;
/// No triangle.
const NONE: u32 = u32::MAX;

/// How one walker walks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// Whether it crosses quiet streets away from crosswalks.
    pub crosses: bool,
    /// Where on the width of the ground it prefers to walk: 0 at the right side, 1 at the left.
    pub side: f32,
}

/// Memory of the search, kept to reuse its allocations. It does not influence results.
#[derive(Clone, Debug, Default)]
pub struct Search {
    nodes: Vec<Node>,
    open: BinaryHeap<Reverse<(u32, u32)>>,
    round: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Node {
    /// The search that reached it last.
    round: u32,
    is_closed: bool,
    before: u32,
    cost_m: f32,
    entry: Vec2,
}

impl Search {
    /// Returns the points at which a walker turns on its way from one triangle and point to another;
    /// the last is the destination. `None` if no way leads there.
    pub fn route(
        &mut self,
        surface: &Surface,
        from: (u32, Vec2),
        to: (u32, Vec2),
        walk: Walk,
    ) -> Option<Vec<Vec2>> {
        let cells = self.cells(surface, from, to, walk)?;
        let portals = cells.windows(2).map(|pair| portal(surface, pair[0], pair[1], walk.side));
        let portals: Option<Vec<Portal>> = portals.collect();
        Some(funnel::shortest(from.1, to.1, &portals?))
    }

    /// Returns the triangles from start to destination.
    fn cells(
        &mut self,
        surface: &Surface,
        from: (u32, Vec2),
        to: (u32, Vec2),
        walk: Walk,
    ) -> Option<Vec<u32>> {
        self.nodes.resize(surface.cells().len(), Node::default());
        self.round += 1;
        self.open.clear();
        let round = self.round;
        let start = Node { round, before: NONE, entry: from.1, ..Node::default() };
        self.nodes[from.0 as usize] = start;
        self.open.push(Reverse((0, from.0)));
        let mut visits = 0;
        while let Some(Reverse((_, at))) = self.open.pop() {
            let node = &mut self.nodes[at as usize];
            if std::mem::replace(&mut node.is_closed, true) {
                continue;
            }
            if at == to.0 {
                return Some(self.way_to(at));
            }
            let here = *node;
            visits += 1;
            if visits > VISITS_MAX {
                return None;
            }
            for (side, next) in surface.cell(at).neighbours.into_iter().enumerate() {
                let Some(next) = next else { continue };
                let Some(toll_m) = toll_m(surface, at, next, walk) else { continue };
                let corners = surface.corners(at);
                let entry = corners[side].midpoint(corners[(side + 1) % 3]);
                let cost_m = here.cost_m + here.entry.distance(entry) + toll_m;
                let known = &mut self.nodes[next as usize];
                if known.round == round && (known.is_closed || known.cost_m <= cost_m) {
                    continue;
                }
                *known = Node { round, is_closed: false, before: at, cost_m, entry };
                // The bits of positive numbers have their order.
                let total = (cost_m + entry.distance(to.1)).to_bits();
                self.open.push(Reverse((total, next)));
            }
        }
        None
    }

    fn way_to(&self, last: u32) -> Vec<u32> {
        let mut way = vec![last];
        let mut at = last;
        while self.nodes[at as usize].before != NONE {
            at = self.nodes[at as usize].before;
            way.push(at);
        }
        way.reverse();
        way
    }
}

/// Returns the extra cost of a step between neighbours; `None` if the walker may not take it.
fn toll_m(surface: &Surface, from: u32, to: u32, walk: Walk) -> Option<f32> {
    let (here, there) = (surface.cell(from), surface.cell(to));
    if here.crossing == there.crossing {
        return Some(0.0);
    }
    match there.area {
        Area::Sidewalk => Some(0.0),
        Area::Crosswalk => Some(CROSSWALK_M),
        Area::Road => walk.crosses.then_some(ROAD_M),
    }
}

/// Returns the part of the side between two triangles through which a walker passes.
fn portal(surface: &Surface, from: u32, to: u32, side: f32) -> Option<Portal> {
    let shared = surface.cell(from).neighbours.iter().position(|next| *next == Some(to))?;
    let corners = surface.corners(from);
    // The corners of a triangle are counter-clockwise: seen on the way out, its side runs from right
    // to left.
    Some(Portal::band(corners[shared], corners[(shared + 1) % 3], side))
}
