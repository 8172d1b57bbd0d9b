//! The outer edges of all roads, junctions included, as closed lines round blocks and the town.

use std::collections::BTreeSet;

use glam::{Vec2, vec2};
use rayon::prelude::*;
use road::{LaneTypes, Network};

use super::{
    frontage::{Frontage, STEP_M, Station},
    raster::{Raster, ground},
    relief::Relief,
};

/// Shorter loops surround traffic islands. Metres.
const SHORTEST_M: f32 = 60.0;
/// The greatest width of a sidewalk that is measured. Metres.
const WALK_MAX_M: f32 = 6.0;
/// The speed limit where no lane specifies one. Metres per second.
const USUAL_MPS: f32 = 14.0;

/// Returns every outline, in the order of its lowest corner; the road lies on the left.
pub(super) fn outlines(network: &Network, raster: &Raster, relief: &Relief) -> Vec<Frontage> {
    let line = |contour: &Vec<Vec2>| {
        let line = smoothed(contour);
        let length: f32 = line.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        if length < SHORTEST_M {
            return None;
        }
        let frontage = frontage(network, raster, relief, &line);
        (frontage.len() > 1).then_some(frontage)
    };
    contours(raster).par_iter().filter_map(line).collect()
}

/// Stations along a line.
fn frontage(network: &Network, raster: &Raster, relief: &Relief, line: &[Vec2]) -> Frontage {
    let mut frontage = Vec::new();
    let mut limit_mps = USUAL_MPS;
    let (mut passed, mut next) = (0.0, 0.0);
    for at in 1..line.len() - 1 {
        passed += line[at].distance(line[at - 1]);
        if passed < next {
            continue;
        }
        next += STEP_M;
        let ahead = line[(at + 3).min(line.len() - 1)] - line[at.saturating_sub(3)];
        let Some(ahead) = ahead.try_normalize() else { continue };
        let (edge, out) = (line[at], -ahead.perp());
        let walk_m = walk_width(raster, edge, out);
        let inside = edge - out * (walk_m + 1.5);
        let probe = inside.extend(relief.at(inside)).as_dvec3();
        // Lanes inside junctions seldom specify a limit; the previous limit continues.
        if let Some(lane) = network.nearest(probe, LaneTypes::DRIVABLE)
            && let Some(limit) = network.lane(lane.lane).speed_limit_mps
        {
            limit_mps = limit as f32;
        }
        frontage.push(Station { edge, out, walk_m, limit_mps });
    }
    frontage
}

/// The walking distance from the edge to the carriageway. Metres.
fn walk_width(raster: &Raster, edge: Vec2, out: Vec2) -> f32 {
    let steps = (WALK_MAX_M * 2.0) as usize;
    let first = (1..=steps).find(|step| {
        let bits = raster.at(edge - out * (*step as f32 * 0.5));
        bits & ground::CARRIAGEWAY != 0
    });
    let width = first.unwrap_or(steps) as f32 * 0.5;
    let walked =
        [0.6, 1.0, 1.4].iter().any(|inside| raster.at(edge - out * *inside) & ground::WALK != 0);
    if walked && width > 1.0 { width - 0.5 } else { 0.0 }
}

/// The borders between road cells and other cells: closed chains of cell corners, the road on the
/// left.
fn contours(raster: &Raster) -> Vec<Vec<Vec2>> {
    let road = |column: i32, row: i32| raster.cell(column, row) & ground::ROAD != 0;
    let (columns, rows) = raster.size();
    // Edges that run east have the road above them; each closed chain has such an edge.
    let mut seen = BTreeSet::new();
    let mut all = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            if !road(column, row) || road(column, row - 1) || seen.contains(&(column, row)) {
                continue;
            }
            let (mut x, mut y) = (column, row);
            let (mut dx, mut dy) = (1, 0);
            let mut chain = Vec::new();
            loop {
                if (dx, dy) == (1, 0) && !seen.insert((x, y)) {
                    break;
                }
                chain.push(raster.corner(vec2(x as f32, y as f32)));
                (x, y) = (x + dx, y + dy);
                // The two cells ahead of the corner that was reached.
                let ahead = |side: i32| {
                    let (px, py) = (dx - side * dy, dy + side * dx);
                    road(x + (px - 1).div_euclid(2), y + (py - 1).div_euclid(2))
                };
                if ahead(-1) {
                    (dx, dy) = (dy, -dx);
                } else if !ahead(1) {
                    (dx, dy) = (-dy, dx);
                }
            }
            all.push(chain);
        }
    }
    all
}

/// A closed chain without its staircase; it starts and ends at the same point.
fn smoothed(chain: &[Vec2]) -> Vec<Vec2> {
    const REACH: usize = 4;
    let count = chain.len();
    (0..=count)
        .map(|at| {
            let window =
                (0..=2 * REACH).map(|step| chain[(at + count * REACH + step - REACH) % count]);
            window.sum::<Vec2>() / (2 * REACH + 1) as f32
        })
        .collect()
}
