use glam::{DVec2, Vec2, Vec3, vec2};
use mesh::{Mesh, Tag};
use rayon::prelude::*;
use road::{LaneType, Network};

use crate::{
    furnish::{
        bridge,
        density::Density,
        frontage::Frontage,
        index::TriangleIndex,
        outline,
        raster::{Raster, ground},
        relief::Relief,
        terrain,
    },
    static_world::Detail,
};

/// The margin of the town beyond its roads. Metres.
const FRINGE_M: f32 = 70.0;
/// The distance between stations of the road surface. Metres.
const STATION_M: f64 = 4.0;
/// Areas between lanes up to this size are traffic islands instead of lawns. Square metres.
const ISLAND_M2: f32 = 60.0;
/// Blocks up to this size are paved at this density or above. Square metres.
const BLOCK_M2: f32 = 14_000.0;
const PAVED_FROM: f32 = 0.62;
/// The approximate number of points of the open ground of a large map.
const OPEN_POINTS: f32 = 150_000.0;

/// The state that all furnishing steps share: roads, occupied ground, and relief.
pub(super) struct Plan<'a> {
    pub(super) network: &'a Network,
    pub(super) seed: u64,
    pub(super) detail: Detail,
    pub(super) raster: Raster,
    /// The corners of the town.
    pub(super) town: (Vec2, Vec2),
    /// The outer edges of roads.
    pub(super) outlines: Vec<Frontage>,
    pub(super) density: Density,
    /// Whether streets are slow and irregular, as in an old town.
    pub(super) is_old: bool,
    /// All ground that objects stand on: roads, and the ground between them.
    surface: [TriangleIndex; 2],
    relief: Relief,
    ground: Mesh,
}

impl Plan<'_> {
    pub(super) fn new(network: &Network, seed: u64, detail: Detail) -> Plan<'_> {
        let mut roads = road::surface_mesh(network, STATION_M);
        let (low, high) = crate::mesh_builder::bounds(&roads);
        let (low, high) = (low.truncate() - FRINGE_M, high.truncate() + FRINGE_M);
        // Kerbs and sides are vertical; only flat faces join the ground.
        let is_bridge = bridge::bridges(&roads);
        let lying = |want: bool| -> Vec<bool> {
            let lies = |number: usize| is_bridge[number] == want && lies(&roads, number);
            (0..is_bridge.len()).into_par_iter().map(lies).collect()
        };
        let (grounded, decks) = (lying(false), lying(true));
        // The raster and the index are independent, so they are built in parallel.
        let drawn = || {
            let mut raster = stamped(&roads, low, high);
            let on_ground = roads.triangles.iter().zip(&grounded).filter(|(_, lies)| **lies);
            let points = on_ground.flat_map(|(triangle, _)| triangle).map(|corner| {
                let [x, y, z] = roads.positions[*corner as usize];
                (vec2(x, y), z)
            });
            let relief = Relief::new(low, high, points);
            let outlines = outline::outlines(network, &raster, &relief);
            let density = Density::new(low, high, &outlines, (seed % 64) as f32);
            raster.stamp_patches(|area, middle| match area {
                ..ISLAND_M2 => ground::CLEAR,
                ..BLOCK_M2 if density.at(middle) > PAVED_FROM => ground::PAVED,
                _ => 0,
            });
            (raster, relief, outlines, density)
        };
        let laid = || {
            let edges = terrain::borders(&roads, &grounded);
            let covered = TriangleIndex::new(&roads, |number| grounded[number]);
            (edges, covered)
        };
        let ((raster, relief, outlines, density), (edges, covered)) = rayon::join(drawn, laid);
        let size = high - low;
        let coarse = (size.x * size.y / OPEN_POINTS).sqrt();
        let terrain = terrain::terrain(&terrain::Site {
            roads: &roads,
            edges: &edges,
            sunk: &bridge::abutments(&roads, &decks),
            covered: &covered,
            relief: &relief,
            raster: &raster,
            town: (low, high),
            spacing_m: if detail == Detail::High { 5.0 } else { coarse.max(8.0) },
        });
        // No objects stand on the hills round the town, whose triangles are long and thin.
        let in_town = |number: usize| {
            terrain.triangles[number].iter().all(|corner| {
                let [x, y, _] = terrain.positions[*corner as usize];
                vec2(x, y).cmpge(low).all() && vec2(x, y).cmple(high).all()
            })
        };
        let surface = [covered, TriangleIndex::new(&terrain, in_town)];
        if decks.contains(&true) {
            let borders = terrain::borders(&roads, &decks);
            roads.append(&bridge::undersides(&roads, &decks, &borders));
        }
        let mut ground = roads;
        ground.append(&terrain);
        Plan {
            network,
            seed,
            detail,
            raster,
            town: (low, high),
            outlines,
            density,
            is_old: is_old(network),
            surface,
            relief,
            ground,
        }
    }

    /// Takes the mesh of roads and terrain; empty after the first call.
    pub(super) fn take_ground(&mut self) -> Mesh {
        std::mem::take(&mut self.ground)
    }

    /// The height of the ground without bridges.
    pub(super) fn height(&self, point: Vec2) -> f32 {
        let near = self.relief.at(point);
        TriangleIndex::nearest_of(&self.surface, point, near).unwrap_or(near)
    }

    /// The height of the highest ground up to `limit`.
    pub(super) fn topmost(&self, point: Vec2, limit: f32) -> Option<f32> {
        let tops = self.surface.iter().filter_map(|index| index.topmost(point, limit));
        tops.reduce(f32::max)
    }

    /// The point on the ground.
    pub(super) fn foot(&self, point: Vec2) -> Vec3 {
        point.extend(self.height(point))
    }
}

/// The speed limit of the streets of an old town, and the fraction of the total length that must
/// have it. Metres per second.
const SLOW_MPS: f64 = 12.0;
const SLOW_SHARE: f64 = 0.95;
/// The limit of the alignment of an old town's streets: 1 where all are parallel or perpendicular,
/// 0 where bearings are uniformly distributed.
const SQUARE: f64 = 0.6;

/// Whether the streets are slow and irregular.
fn is_old(network: &Network) -> bool {
    let (mut length, mut slow, mut square) = (0.0, 0.0, DVec2::ZERO);
    for lane in network.lanes() {
        if lane.kind != LaneType::Driving || lane.junction.is_some() {
            continue;
        }
        let steps = (lane.length_m / HEADING_M).ceil().clamp(1.0, 1000.0);
        for step in 0..steps as usize {
            let along_m = lane.length_m * (step as f64 + 0.5) / steps;
            let heading = network.place_at(lane.index, along_m, 0.0).heading_rad;
            // Multiplied by four, the angles of parallel and perpendicular streets are equal.
            square += DVec2::from_angle(4.0 * heading) * (lane.length_m / steps);
        }
        length += lane.length_m;
        if lane.speed_limit_mps.is_some_and(|limit| limit < SLOW_MPS) {
            slow += lane.length_m;
        }
    }
    slow > SLOW_SHARE * length && square.length() < SQUARE * length
}

/// The distance between samples of a street's bearing. Metres.
const HEADING_M: f64 = 15.0;

/// Whether a triangle faces up.
fn lies(mesh: &Mesh, number: usize) -> bool {
    let [a, b, c] = mesh.triangles[number].map(|i| Vec3::from_array(mesh.positions[i as usize]));
    (b - a).cross(c - a).normalize_or_zero().z > 0.3
}

/// The raster with all roads, on any level.
fn stamped(roads: &Mesh, low: Vec2, high: Vec2) -> Raster {
    let mut raster = Raster::new(low, high);
    for (triangle, face) in roads.triangles.iter().zip(&roads.faces) {
        let outline = triangle.map(|corner| {
            let [x, y, _] = roads.positions[corner as usize];
            vec2(x, y)
        });
        let bits = match Tag::from_code(face.tag) {
            Some(Tag::SideWalks) => ground::WALK,
            Some(Tag::Terrain | Tag::Ground) => ground::VERGE,
            _ => ground::CARRIAGEWAY,
        };
        raster.stamp(&outline, bits);
    }
    raster
}
