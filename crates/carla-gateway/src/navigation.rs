//! The navigation mesh by which CARLA's clients steer pedestrians.
//!
//! ```text
//!  town's ground ──sidewalks, inset──▶ outline ─▶ cells ─▶ detour ──▶ request_file
//!  map's crosswalks, extended ──────────────┘    (triangles)  (a Detour tile)
//! ```
//!
//! Sidewalks and crosswalks form one planar triangulation in which each triangle has its
//! neighbours.

mod area;
mod cells;
mod cut;
mod detour;
mod outline;

#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3, Vec3Swizzles};
use road::{LaneTypes, Network};
use town::Town;

use self::{
    cells::{Areas, Cells, Ground},
    outline::Loop,
};

/// The distance of the mesh from the kerb. Metres.
const INSET_M: f64 = 0.3;
/// How far crosswalks extend into the sidewalks at their ends. Metres.
const REACH_M: f64 = 1.5;
/// Sides of a crosswalk shorter than this do not define its direction. Metres.
const SIDE_MIN_M: f64 = 1.0;
/// The clearance around obstacles on a sidewalk. Metres.
const CLEARANCE_M: f64 = 0.25;

/// A height that is interpolated from the surroundings.
const UNKNOWN: f64 = f64::NAN;

/// Returns the navigation mesh of a map as a file, or `None` if there is no walkable ground.
pub(crate) fn file(network: &Network, town: &Town) -> Option<Vec<u8>> {
    let cells = cells(network, town);
    (!cells.triangles.is_empty()).then(|| detour::file(&cells))
}

fn cells(network: &Network, town: &Town) -> Cells {
    let (sidewalks, relief) = outline::sidewalks(&town.mesh, INSET_M);
    let crosswalks: Vec<Loop> = network
        .crosswalks()
        .filter(|walk| walk.corners.len() >= 3)
        .map(|walk| extended(network, walk.corners))
        .collect();
    let mut ground = Ground { sidewalks, ..Ground::default() };
    ground.holes = obstacles_on(&Areas::of(&ground), town);
    ground.crosswalks = crosswalks;
    Cells::of(&ground, |at| relief.height(at))
}

/// Returns the outline of a crosswalk, its ends extended into the sidewalks.
fn extended(network: &Network, corners: &[DVec3]) -> Loop {
    let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let road = network.nearest(center, LaneTypes::DRIVING).map(|at| network.place(at));
    let heading = road.map_or(0.0, |place| place.heading_rad);
    let across = DVec2::from_angle(heading).perp();
    // The crosswalk's own sides define the direction, since they may not be perpendicular to the
    // road.
    let along = |(a, b): (DVec3, DVec3)| (b - a).xy().normalize_or_zero();
    let across = outline::sides(corners)
        .filter(|(a, b)| a.distance(*b) > SIDE_MIN_M)
        .map(along)
        .max_by(|a, b| a.dot(across).abs().total_cmp(&b.dot(across).abs()))
        .unwrap_or(across);
    let points: Vec<DVec3> = corners
        .iter()
        .map(|corner| {
            let side = (corner.xy() - center.xy()).dot(across);
            *corner + (across * side.signum() * REACH_M).extend(0.0)
        })
        .collect();
    outline::counter_clockwise(points)
}

/// Returns the outlines of obstacles on sidewalks: poles, trunks, bins.
fn obstacles_on(sidewalks: &Areas, town: &Town) -> Vec<Loop> {
    let solids = town.colliders.iter().filter(|solid| solid.half_extents_m.max_element() < 20.0);
    let near = |at: DVec2| sidewalks.at(at).is_some();
    let outlines = solids.filter_map(|solid| {
        let center = solid.center.as_dvec3();
        let half = solid.half_extents_m.as_dvec3().xy() + CLEARANCE_M;
        let turn = DVec2::from_angle(f64::from(solid.yaw_rad));
        let corner = |x: f64, y: f64| center.xy() + turn.rotate(half * DVec2::new(x, y));
        let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
        let is_on = near(center.xy()) || corners.iter().any(|at| near(*at));
        is_on.then(|| corners.map(|at| at.extend(UNKNOWN)).to_vec())
    });
    outlines.collect()
}
