//! Seams close the narrow gaps that files leave between roads side by side: from the rim of one
//! road a seam reaches to the rim of the other, and a little below it.

use glam::{DVec2, DVec3};
use mesh::Mesh;

use super::{cover::Cover, faces::ASPHALT};
use crate::{network::Network, parallel};

/// Wider gaps are intended, metres; on open roads, and where one of the roads lies in a junction:
/// there cells of the floor, a metre wide, end in such gaps.
const GAP_M: f64 = 0.3;
const JUNCTION_GAP_M: f64 = 1.45;
/// Roads whose rims differ more in height do not meet, metres; and the additional tolerance for
/// each metre between them.
const STEP_M: f64 = 0.05;
const SLOPE: f64 = 0.05;
/// Rims on either side of a wider gap face each other: the cosine of their angle.
const FACING: f64 = 0.9;
/// Distance between the places at which a gap is measured, metres.
const PIECE_M: f64 = 0.5;
/// How often a piece is halved to find where a gap begins.
const HALVES: u32 = 4;
/// Rims this near to each other touch, metres.
const TOUCH_M: f64 = 0.1;
/// How far a seam reaches below the other road, how deep, and how far it lies below its rim,
/// metres.
const TONGUE_M: f64 = 0.1;
const TONGUE_DEPTH_M: f64 = 0.015;
const SINK_M: f64 = 0.002;

/// An outer edge of the surface for vehicles, with the surface on its left.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rim {
    pub(super) road: u32,
    pub(super) points: Vec<DVec3>,
}

/// Returns the seams between all these rims.
pub(super) fn seams(network: &Network, rims: &[Rim], threads: usize) -> Vec<Mesh> {
    let grid = Grid::new(network, rims);
    let share = (rims.len() / (threads * 8)).max(RIMS_MIN);
    let parts: Vec<&[Rim]> = rims.chunks(share).collect();
    parallel::share(&parts, threads, "road-seam", |part| {
        let mut mesh = Mesh::default();
        for rim in *part {
            let mut places = places(network, rim, &grid);
            thin(&mut places);
            lay(&places, &mut mesh);
        }
        mesh
    })
}

/// Fewest rims in one part of the work.
const RIMS_MIN: usize = 64;

/// A place on a rim, and what lies beyond it.
#[derive(Clone, Copy)]
struct Place {
    point: DVec3,
    out: DVec2,
    beyond: Beyond,
    is_corner: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Beyond {
    /// Nothing within the reach of a seam.
    Open,
    /// The place lies inside another road.
    Inside,
    /// The place lies inside another road and so near its rim that both may leave a gap between
    /// corners.
    Touch(f64),
    /// The rim of another road.
    Rim(DVec3),
}

fn places(network: &Network, rim: &Rim, grid: &Grid) -> Vec<Place> {
    let cover = Cover::new(network, rim.road);
    let outs: Vec<DVec2> = rim
        .points
        .windows(2)
        .map(|pair| -(pair[1] - pair[0]).truncate().normalize_or_zero().perp())
        .collect();
    // At a bend the seam points outwards between both sides, so that it leaves no gap.
    let out_at = |point: usize| {
        let before = outs[point.saturating_sub(1)];
        let after = outs[point.min(outs.len() - 1)];
        let both = (before + after).normalize_or_zero();
        if before.dot(after) > 0.3 { both } else { after }
    };
    let mut places: Vec<Place> = Vec::new();
    for (number, edge) in edges(network, rim).enumerate() {
        let near = grid.near(&edge);
        let pieces = if near.is_empty() {
            1
        } else {
            (edge.from.distance(edge.to) / PIECE_M).ceil().clamp(1.0, 200.0) as usize
        };
        let outs = [out_at(number), out_at(number + 1)];
        let place = |share: f64| {
            let point = edge.from.lerp(edge.to, share);
            let out = outs[0].lerp(outs[1], share).normalize_or_zero();
            let beyond = beyond(&cover, &edge, point, out, &near);
            Place { point, out, beyond, is_corner: share == 0.0 || share == 1.0 }
        };
        let first = place(0.0);
        match places.last_mut() {
            // A corner's neighbour may be known only at its second edge.
            Some(corner) if corner.beyond == Beyond::Open => *corner = first,
            Some(_) => {}
            None => places.push(first),
        }
        for piece in 1..=pieces {
            let share = |piece: usize| piece as f64 / pieces as f64;
            let last = place(share(piece));
            refine([share(piece - 1), share(piece)], last.beyond, &place, &mut places, HALVES);
            places.push(last);
        }
    }
    places
}

/// Where what lies beyond changes between the last place and the next one, adds places between
/// them.
fn refine(
    [from, to]: [f64; 2],
    last: Beyond,
    place: &impl Fn(f64) -> Place,
    places: &mut Vec<Place>,
    halves: u32,
) {
    let changes = places.last().is_some_and(|first| {
        std::mem::discriminant(&first.beyond) != std::mem::discriminant(&last)
    });
    if !changes || halves == 0 {
        return;
    }
    let middle = place(0.5 * (from + to));
    refine([from, 0.5 * (from + to)], middle.beyond, place, places, halves - 1);
    places.push(middle);
    refine([0.5 * (from + to), to], last, place, places, halves - 1);
}

/// Returns what lies beyond a place of a rim, among the edges `near`.
fn beyond(cover: &Cover, own: &Edge, point: DVec3, out: DVec2, near: &[Edge]) -> Beyond {
    let mut first: Option<(f64, Beyond)> = None;
    let mut touched = None;
    for edge in near {
        let along = (edge.to - edge.from).truncate();
        let across = out.perp_dot(along);
        let offset = (edge.from - point).truncate();
        let away = offset.perp_dot(along) / across;
        // A gap that widens quickly is a corner.
        let straight = if away > GAP_M { FACING } else { 0.2 };
        if across.abs() <= straight * along.length() {
            continue;
        }
        let share = offset.perp_dot(out) / across;
        if !(0.0..=1.0).contains(&share) || away < -TOUCH_M {
            continue;
        }
        // The surface of the edge lies to its left; a ray from there leaves it.
        let is_exit = across > 0.0;
        // A road may face itself in the middle of a tight turn.
        if edge.road == own.road && (is_exit || away < TOUCH_M) {
            continue;
        }
        let foot = edge.from.lerp(edge.to, share);
        let reach = own.reach(edge);
        if away > reach || (foot.z - point.z).abs() > STEP_M + SLOPE * away {
            continue;
        }
        if away < 0.0 {
            if !is_exit {
                touched = Some(touched.map_or(foot.z, |z: f64| z.min(foot.z)));
            }
        } else if first.is_none_or(|(before, _)| away < before) {
            first = Some((away, if is_exit { Beyond::Inside } else { Beyond::Rim(foot) }));
        }
    }
    let found = match first {
        Some((away, Beyond::Rim(foot))) if away > TOUCH_M && cover.paved(point.midpoint(foot)) => {
            Beyond::Inside
        }
        Some((_, found)) => found,
        None => Beyond::Open,
    };
    match (found, touched) {
        (Beyond::Inside | Beyond::Open, Some(z)) => Beyond::Touch(z.min(point.z)),
        _ => found,
    }
}

/// Removes places that lie on the line between their neighbours.
fn thin(places: &mut Vec<Place>) {
    let all = std::mem::take(places);
    for (at, place) in all.iter().enumerate() {
        let spare = match (places.last(), all.get(at + 1)) {
            (Some(before), Some(after)) if !place.is_corner => {
                match [before.beyond, place.beyond, after.beyond] {
                    [Beyond::Open, Beyond::Open, Beyond::Open]
                    | [Beyond::Inside, Beyond::Inside, Beyond::Inside]
                    | [Beyond::Touch(_), Beyond::Touch(_), Beyond::Touch(_)] => true,
                    [Beyond::Rim(first), Beyond::Rim(foot), Beyond::Rim(last)] => {
                        let way = (last - first).normalize_or_zero();
                        (foot - first).cross(way).length() < STRAIGHT_M
                    }
                    _ => false,
                }
            }
            _ => false,
        };
        if !spare {
            places.push(*place);
        }
    }
}

/// Largest distance of a removed place from the line between its neighbours, metres.
const STRAIGHT_M: f64 = 0.0005;

/// Joins neighbouring places by seams.
fn lay(places: &[Place], mesh: &mut Mesh) {
    for pair in places.windows(2) {
        let meets = |place: &Place| matches!(place.beyond, Beyond::Rim(_) | Beyond::Touch(_));
        let [Some(first), Some(second)] = [foot(&pair[0], &pair[1]), foot(&pair[1], &pair[0])]
        else {
            continue;
        };
        if !pair.iter().any(meets) {
            continue;
        }
        let feet = [first, second];
        let rims = feet.map(|foot| foot - DVec3::Z * SINK_M);
        let ends: [DVec3; 2] =
            std::array::from_fn(|at| feet[at] + (pair[at].out * TONGUE_M).extend(-TONGUE_DEPTH_M));
        let points = [pair[0].point, rims[0], ends[0], pair[1].point, rims[1], ends[1]];
        let [a, b, c, d, e, f] = points.map(|point| mesh.vertex(point.as_vec3().to_array()));
        for [from, out, next, back] in [[a, b, e, d], [b, c, f, e]] {
            mesh.triangle([from, out, next], ASPHALT);
            mesh.triangle([from, next, back], ASPHALT);
        }
    }
}

/// Returns where the seam from a place ends, above its tongue; its tip where a gap closes.
fn foot(place: &Place, beside: &Place) -> Option<DVec3> {
    let at = |z: f64| Some(place.point.truncate().extend(z));
    match (place.beyond, beside.beyond) {
        (Beyond::Rim(foot), _) => Some(foot),
        (Beyond::Touch(z), _) => at(z),
        (Beyond::Inside, Beyond::Rim(beside)) => at(place.point.z.min(beside.z)),
        (Beyond::Inside, Beyond::Touch(z)) => at(place.point.z.min(z)),
        _ => None,
    }
}

/// One edge of a rim, from corner to corner.
#[derive(Clone, Copy)]
struct Edge {
    road: u32,
    in_junction: bool,
    from: DVec3,
    to: DVec3,
}

impl Edge {
    /// Returns how wide a gap between two edges may be.
    fn reach(&self, other: &Edge) -> f64 {
        if self.in_junction || other.in_junction { JUNCTION_GAP_M } else { GAP_M }
    }

    /// Returns whether a seam may lead from one to the other, by their bounding boxes.
    fn is_near(&self, other: &Edge) -> bool {
        let reach = self.reach(other);
        let apart = |low: DVec3, high: DVec3| low.cmpgt(high + reach).any();
        !apart(self.from.min(self.to), other.from.max(other.to))
            && !apart(other.from.min(other.to), self.from.max(self.to))
    }
}

/// Edges by the squares that they cross.
struct Grid {
    edges: Vec<Edge>,
    low: DVec2,
    square_m: f64,
    columns: usize,
    rows: usize,
    /// Where the members of each square begin.
    starts: Vec<u32>,
    members: Vec<u32>,
}

const SQUARE_M: f64 = 4.0;
/// Most squares; on larger maps squares are larger.
const SQUARES_MAX: f64 = 4e6;

impl Grid {
    fn new(network: &Network, rims: &[Rim]) -> Grid {
        let edges: Vec<Edge> = rims.iter().flat_map(|rim| edges(network, rim)).collect();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for end in edges.iter().flat_map(|edge| [edge.from, edge.to]) {
            (low, high) = (low.min(end.truncate()), high.max(end.truncate()));
        }
        let size = (high - low).max(DVec2::ONE);
        let square_m = SQUARE_M.max((size.x * size.y / SQUARES_MAX).sqrt());
        let [columns, rows] = [size.x, size.y].map(|size| (size / square_m) as usize + 1);
        let mut grid = Grid {
            edges,
            low,
            square_m,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            members: Vec::new(),
        };
        if grid.edges.is_empty() {
            return grid;
        }
        let mut starts = std::mem::take(&mut grid.starts);
        for edge in &grid.edges {
            grid.squares(edge, 0.0).for_each(|square| starts[square + 1] += 1);
        }
        for square in 0..columns * rows {
            starts[square + 1] += starts[square];
        }
        let mut next = starts.clone();
        let mut members = vec![0; starts[columns * rows] as usize];
        for (number, edge) in grid.edges.iter().enumerate() {
            for square in grid.squares(edge, 0.0) {
                members[next[square] as usize] = number as u32;
                next[square] += 1;
            }
        }
        (grid.starts, grid.members) = (starts, members);
        grid
    }

    /// Returns the edges that a seam from this one may reach.
    fn near(&self, edge: &Edge) -> Vec<Edge> {
        let mut found: Vec<u32> = Vec::new();
        for square in self.squares(edge, JUNCTION_GAP_M) {
            let members = self.starts[square] as usize..self.starts[square + 1] as usize;
            let near = |number: &u32| edge.is_near(&self.edges[*number as usize]);
            found.extend(self.members[members].iter().copied().filter(near));
        }
        found.sort_unstable();
        found.dedup();
        found.into_iter().map(|number| self.edges[number as usize]).collect()
    }

    /// Returns the squares that an edge's bounding box, extended by `margin`, touches.
    fn squares(&self, edge: &Edge, margin: f64) -> impl Iterator<Item = usize> + use<> {
        let at = |point: DVec3, margin: f64| {
            let place = ((point.truncate() - self.low + margin) / self.square_m).max(DVec2::ZERO);
            [(place.x as usize).min(self.columns - 1), (place.y as usize).min(self.rows - 1)]
        };
        let from = at(edge.from.min(edge.to), -margin);
        let to = at(edge.from.max(edge.to), margin);
        let columns = self.columns;
        (from[1]..=to[1]).flat_map(move |row| (from[0]..=to[0]).map(move |x| row * columns + x))
    }
}

/// Returns the edges of a rim in their order.
fn edges(network: &Network, rim: &Rim) -> impl Iterator<Item = Edge> {
    let in_junction = network.roads()[rim.road as usize].junction.is_some();
    let road = rim.road;
    rim.points.windows(2).map(move |pair| Edge { road, in_junction, from: pair[0], to: pair[1] })
}
