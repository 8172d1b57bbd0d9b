//! The walkable ground of a town: its triangles, and the crossings among them.

use glam::{DVec2, DVec3, Vec3Swizzles};
use mesh::Tag;
use road::{LaneTypes, Network};
use town::{Object, Town};

use crate::{
    area::Area,
    cells::{Areas, Cells, Outlines},
    outline::{self, Loop, REACH_M, Relief},
    quiet,
};

/// The distance of the ground's edge from the kerb. Metres.
const INSET_M: f64 = 0.3;
/// Sides of a crosswalk shorter than this do not define its direction. Metres.
const SIDE_MIN_M: f64 = 1.0;
/// The clearance around obstacles on a sidewalk. Metres.
const CLEARANCE_M: f64 = 0.35;

/// Walkers step over what is lower. Metres.
const LOW_M: f64 = 0.2;

/// A height that is interpolated from the surroundings.
const UNKNOWN: f64 = f64::NAN;

/// The walkable ground of a town.
#[derive(Clone, Debug, Default)]
pub struct Ground {
    /// Its triangles.
    pub cells: Cells,
    /// What [`crate::Cell::crossing`] numbers: crosswalks, then places to cross quiet streets.
    pub crossings: Vec<Crossing>,
}

/// A place where walkers cross a road.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// [`Area::Crosswalk`] or [`Area::Road`].
    pub area: Area,
    /// Its outline, counter-clockwise, extended into the sidewalks at its ends.
    pub outline: Vec<DVec3>,
}

impl Ground {
    /// Triangulates the ground of `town`, which was furnished around `network`. Of its mesh only the
    /// ground is read, as [`Town::without_scenery`] leaves it.
    pub fn new(network: &Network, town: &Town) -> Ground {
        let (sidewalks, relief) = outline::sidewalks(&town.mesh, INSET_M);
        let crosswalks: Vec<Loop> = network
            .crosswalks()
            .filter(|walk| walk.corners.len() >= 3)
            .map(|walk| extended(network, walk.corners))
            .collect();
        let mut outlines = Outlines { sidewalks, ..Outlines::default() };
        let areas = Areas::of(&outlines);
        outlines.holes = obstacles_on(&areas, &relief, town);
        outlines.crosswalks = crosswalks.len();
        let quiet = quiet::strips(network, town, &areas, &crosswalks);
        outlines.crossings = crosswalks;
        outlines.crossings.extend(quiet);
        let cells = Cells::of(&outlines, |at| relief.height(at));
        let crossings = outlines.crossings.into_iter().enumerate().map(|(index, outline)| {
            let is_crosswalk = index < outlines.crosswalks;
            Crossing { area: if is_crosswalk { Area::Crosswalk } else { Area::Road }, outline }
        });
        Ground { cells, crossings: crossings.collect() }
    }
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

/// Returns the outlines of obstacles on sidewalks: poles, trunks, bins, and what stands there without
/// being solid, such as the tables of a café.
fn obstacles_on(sidewalks: &Areas, relief: &Relief, town: &Town) -> Vec<Loop> {
    let solids = town.colliders.iter().map(|it| (it.center, it.half_extents_m, it.yaw_rad));
    let stands = |object: &&Object| {
        let ground_m = relief.height(object.center.as_dvec3().xy());
        let half_m = f64::from(object.half_extents_m.z);
        let above_m = ground_m.map(|ground| f64::from(object.center.z) - ground);
        object.tag == Tag::Static
            && above_m.is_some_and(|m| m + half_m > LOW_M && m - half_m < LOW_M)
    };
    let objects = town.objects.iter().filter(stands);
    let objects = objects.map(|it| (it.center, it.half_extents_m, it.yaw_rad));
    let near = |at: DVec2| sidewalks.at(at).is_some();
    let all = solids.chain(objects).filter(|(_, half, _)| half.max_element() < 20.0);
    let outlines = all.filter_map(|(center, half, yaw_rad)| {
        let center = center.as_dvec3();
        let half = half.as_dvec3().xy() + CLEARANCE_M;
        let turn = DVec2::from_angle(f64::from(yaw_rad));
        let corner = |x: f64, y: f64| center.xy() + turn.rotate(half * DVec2::new(x, y));
        let corners = [corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0)];
        let is_on = near(center.xy()) || corners.iter().any(|at| near(*at));
        is_on.then(|| corners.map(|at| at.extend(UNKNOWN)).to_vec())
    });
    outlines.collect()
}
