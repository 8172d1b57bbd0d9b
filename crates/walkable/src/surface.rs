//! Walkable ground to walk on: the triangle at a point, and steps that do not leave the ground.

use glam::Vec2;

use crate::{
    cells::Cell,
    ground::{Crossing, Ground},
};

/// Edge of a square of the lookup. Metres.
const SQUARE_M: f32 = 4.0;
/// Points this far outside of a side still count as inside. Metres.
const EDGE_M: f32 = 1e-3;
/// Points this near to a line lie on it: more than steps leave between.
const ON_LINE_M: f32 = 3e-3;
/// Most sides that one step passes.
const SIDES_MAX: usize = 64;
/// Length of a detour, and by how much it turns. Metres, radians.
const DETOUR_M: f32 = 0.4;
const DETOUR_TURNS_RAD: [f32; 5] = [0.0, 0.4, -0.4, 0.8, -0.8];

/// Walkable ground with a lookup by place, in the ground plane of world space.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    points: Vec<Vec2>,
    cells: Vec<Cell>,
    crossings: Vec<Crossing>,
    low: Vec2,
    columns: usize,
    /// By square: begin of its triangles in `listed`; one more entry than squares.
    first: Vec<u32>,
    listed: Vec<u32>,
}

impl Surface {
    /// Indexes the triangles of `ground`.
    pub fn new(ground: &Ground) -> Surface {
        let points: Vec<Vec2> =
            ground.cells.positions.iter().map(|at| at.truncate().as_vec2()).collect();
        let low = points.iter().copied().fold(Vec2::INFINITY, Vec2::min);
        let high = points.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max);
        let mut surface = Surface {
            points,
            cells: ground.cells.triangles.clone(),
            crossings: ground.crossings.clone(),
            low,
            ..Surface::default()
        };
        if surface.cells.is_empty() {
            return surface;
        }
        let [columns, rows] = ((high - low) / SQUARE_M).to_array().map(|size| size as usize + 1);
        surface.columns = columns;
        let mut squares: Vec<Vec<u32>> = vec![Vec::new(); columns * rows];
        for index in 0..surface.cells.len() as u32 {
            let [a, b, c] = surface.corners(index);
            let ([x, y], [u, v]) =
                (surface.square(a.min(b).min(c)), surface.square(a.max(b).max(c)));
            for row in y..=v {
                for column in x..=u {
                    squares[row * columns + column].push(index);
                }
            }
        }
        surface.first.push(0);
        for square in squares {
            surface.listed.extend(square);
            surface.first.push(surface.listed.len() as u32);
        }
        surface
    }

    /// Returns the triangles.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Returns one triangle.
    pub fn cell(&self, index: u32) -> &Cell {
        &self.cells[index as usize]
    }

    /// Returns what [`Cell::crossing`] numbers.
    pub fn crossings(&self) -> &[Crossing] {
        &self.crossings
    }

    /// Returns the corners of a triangle, counter-clockwise.
    pub fn corners(&self, index: u32) -> [Vec2; 3] {
        self.cells[index as usize].corners.map(|corner| self.points[corner as usize])
    }

    /// Returns the column and the row of a point, those of the nearest square outside of the map.
    fn square(&self, at: Vec2) -> [usize; 2] {
        ((at - self.low) / SQUARE_M).to_array().map(|cell| cell.max(0.0) as usize)
    }

    fn listed(&self, [column, row]: [usize; 2]) -> &[u32] {
        let square = row * self.columns + column;
        match (column < self.columns, self.first.get(square + 1)) {
            (true, Some(&end)) => &self.listed[self.first[square] as usize..end as usize],
            _ => &[],
        }
    }

    /// Returns the first triangle that contains a point. On the line between a sidewalk and a crossing,
    /// that is the sidewalk's: a walker that waits there has not begun to cross.
    pub fn cell_at(&self, at: Vec2) -> Option<u32> {
        let is_in = |index: &&u32| {
            let corners = self.corners(**index);
            is_within(&corners, at, ON_LINE_M)
        };
        let all = self.listed(self.square(at)).iter().filter(is_in).copied();
        all.min_by_key(|index| (self.cell(*index).crossing.is_some(), *index))
    }

    /// Returns the triangle at a point, or the nearest one within `reach_m`, and the nearest point
    /// in it.
    pub fn nearest(&self, at: Vec2, reach_m: f32) -> Option<(u32, Vec2)> {
        if let Some(cell) = self.cell_at(at) {
            return Some((cell, at));
        }
        let ([x, y], [u, v]) = (self.square(at - reach_m), self.square(at + reach_m));
        let mut nearest: Option<(f32, u32, Vec2)> = None;
        for row in y..=v {
            for column in x..=u {
                for &index in self.listed([column, row]) {
                    let there = nearest_in(&self.corners(index), at);
                    let far = there.distance_squared(at);
                    let is_nearer = nearest
                        .is_none_or(|(best, cell, _)| far < best || (far == best && index < cell));
                    if far <= reach_m * reach_m && is_nearer {
                        nearest = Some((far, index, there));
                    }
                }
            }
        }
        nearest.map(|(_, cell, there)| (cell, there))
    }

    /// Moves from a point of a triangle towards another point over the triangles that `allows`
    /// admits, and along their outer sides. Returns the last triangle and the point reached there.
    pub fn step(
        &self,
        cell: u32,
        from: Vec2,
        to: Vec2,
        allows: impl Fn(&Cell) -> bool,
    ) -> (u32, Vec2) {
        let (mut cell, mut at, mut to) = (cell, from, to);
        for _ in 0..SIDES_MAX {
            let corners = self.corners(cell);
            if is_within(&corners, to, EDGE_M) {
                return (cell, to);
            }
            let beyond_m = [0, 1, 2].map(|side| outside_m(&corners, side, to));
            // Beyond the tip of a sliver, a point is near to the lines of all sides.
            let is_at_tip = beyond_m.iter().all(|&m| m <= EDGE_M);
            let least_m = if is_at_tip { 0.0 } else { EDGE_M };
            let mut exit: Option<(f32, usize)> = None;
            for (side, beyond_m) in beyond_m.into_iter().enumerate() {
                if beyond_m <= least_m {
                    continue;
                }
                let before_m = (-outside_m(&corners, side, at)).max(0.0);
                let share = before_m / (before_m + beyond_m);
                if exit.is_none_or(|(first, _)| share < first) {
                    exit = Some((share, side));
                }
            }
            let Some((share, side)) = exit else { return (cell, to) };
            let there = at.lerp(to, share);
            match self.cell(cell).neighbours[side].filter(|next| allows(self.cell(*next))) {
                Some(next) => cell = next,
                None => {
                    let along = (corners[(side + 1) % 3] - corners[side]).normalize_or_zero();
                    to = there + along * (to - there).dot(along);
                }
            }
            at = there;
        }
        (cell, at)
    }
}

impl Surface {
    /// Returns where one may go from a point of a triangle that has no short step in a direction, up to 0.4 m from
    /// it and 46 degrees beside the direction; `None` if there is nothing.
    ///
    /// Where corners of several triangles meet, a step of some millimetres may end in the tip of one that
    /// `allows` does not admit, or between two outer sides. A detour ends beyond, in an admitted triangle.
    pub fn detour(
        &self,
        cell: u32,
        from: Vec2,
        direction: Vec2,
        allows: impl Fn(&Cell) -> bool,
    ) -> Option<Vec2> {
        DETOUR_TURNS_RAD.into_iter().find_map(|turn_rad| {
            let direction = Vec2::from_angle(turn_rad).rotate(direction.normalize_or_zero());
            let (last, there) = self.step(cell, from, from + direction * DETOUR_M, |_| true);
            let has_come = (there - from).dot(direction) > 0.5 * DETOUR_M;
            (has_come && allows(self.cell(last))).then_some(there)
        })
    }
}

/// Returns whether a point lies in a triangle or no farther from it than `margin_m`.
fn is_within(corners: &[Vec2; 3], at: Vec2, margin_m: f32) -> bool {
    let most_m = (0..3).map(|side| outside_m(corners, side, at)).fold(f32::NEG_INFINITY, f32::max);
    let is_near = || nearest_in(corners, at).distance_squared(at) <= margin_m * margin_m;
    most_m <= 0.0 || (most_m <= margin_m && is_near())
}

/// Returns how far a point lies outside of a side of a triangle; negative inside.
fn outside_m(corners: &[Vec2; 3], side: usize, at: Vec2) -> f32 {
    let (from, to) = (corners[side], corners[(side + 1) % 3]);
    (at - from).perp_dot((to - from).normalize_or_zero())
}

/// Returns the point of a triangle that is nearest to a point outside of it.
fn nearest_in(corners: &[Vec2; 3], at: Vec2) -> Vec2 {
    let on_side = |side: usize| {
        let (from, to) = (corners[side], corners[(side + 1) % 3]);
        let way = to - from;
        let along = (at - from).dot(way) / way.length_squared().max(1e-12);
        from + way * along.clamp(0.0, 1.0)
    };
    let points = [0, 1, 2].map(on_side);
    let far = points.map(|point| point.distance_squared(at));
    let best = if far[0] <= far[1] { 0 } else { 1 };
    points[if far[best] <= far[2] { best } else { 2 }]
}
