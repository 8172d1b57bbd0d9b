//! Which parts of the road surface are bridges, and their undersides.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Vec2, Vec3};
use mesh::{Face, Material, Mesh, Tag};

use crate::furnish::{index::TriangleIndex, raster::coarsest_m};

/// The height above another surface from which on a surface is a bridge. Metres.
const HEADROOM_M: f32 = 2.6;
/// The thickness of bridges. Metres.
const DECK_M: f32 = 0.7;

/// Returns for each triangle of the roads whether it is part of a bridge.
///
/// A bridge is a surface above another road, and its approaches as far as an embankment would cover
/// the lower road.
/// up beside the lower road.
pub(super) fn bridges(roads: &Mesh) -> Vec<bool> {
    let count = roads.triangles.len();
    let middles: Vec<Vec3> = roads
        .triangles
        .iter()
        .map(|t| {
            t.iter().map(|i| Vec3::from_array(roads.positions[*i as usize])).sum::<Vec3>() / 3.0
        })
        .collect();
    let (low, high) = middles
        .iter()
        .fold((f32::MAX, f32::MIN), |(low, high), middle| (low.min(middle.z), high.max(middle.z)));
    if high - low < HEADROOM_M {
        return vec![false; count];
    }
    let floor = Floor::new(roads);
    let above = |middle: &Vec3| middle.z - floor.at(middle.truncate()) > HEADROOM_M;
    if !middles.iter().any(above) {
        return vec![false; count];
    }
    let index = TriangleIndex::new(roads, |_| true);
    let over: Vec<Option<f32>> = middles
        .iter()
        .map(|middle| {
            let lowest = above(middle).then(|| index.lowest(middle.truncate()))??;
            (middle.z - lowest > HEADROOM_M).then_some(middle.z - lowest)
        })
        .collect();
    let spans: Vec<(Vec3, f32)> = middles
        .iter()
        .zip(&over)
        .filter_map(|(middle, gap)| gap.map(|gap| (*middle, 3.0 + gap * 1.3)))
        .collect();
    let reach = Buckets::new(&spans);
    (0..count)
        .map(|number| {
            over[number].is_some()
                || reach.near(middles[number].truncate()).any(|span| {
                    let (at, radius) = spans[span];
                    let near = at.truncate().distance_squared(middles[number].truncate());
                    near < radius * radius && (at.z - middles[number].z).abs() < 1.2
                })
        })
        .collect()
}

/// The lowest vertex of any triangle that reaches into a cell of the plan.
struct Floor {
    low: Vec2,
    square_m: f32,
    columns: usize,
    rows: usize,
    heights: Vec<f32>,
}

/// The size of a cell, unless the plan is so large that there would be too many.
const SQUARE_M: f32 = 4.0;

impl Floor {
    fn new(mesh: &Mesh) -> Floor {
        let (low, high) = crate::mesh_builder::bounds(mesh);
        let square_m = SQUARE_M.max(coarsest_m((high - low).truncate()));
        let size = (high - low) / square_m;
        let (columns, rows) = (size.x as usize + 1, size.y as usize + 1);
        let heights = vec![f32::MAX; columns * rows];
        let mut floor = Floor { low: low.truncate(), square_m, columns, rows, heights };
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            let (lowest, highest) = (a.min(b).min(c), a.max(b).max(c));
            let (from, to) = (floor.cell(lowest.truncate()), floor.cell(highest.truncate()));
            for row in from.1..=to.1 {
                for height in &mut floor.heights[row * columns..][from.0..=to.0] {
                    *height = height.min(lowest.z);
                }
            }
        }
        floor
    }

    fn cell(&self, point: Vec2) -> (usize, usize) {
        let at = ((point - self.low) / self.square_m).max(Vec2::ZERO);
        ((at.x as usize).min(self.columns - 1), (at.y as usize).min(self.rows - 1))
    }

    fn at(&self, point: Vec2) -> f32 {
        let (column, row) = self.cell(point);
        self.heights[row * self.columns + column]
    }
}

/// Spans by cell of the plan; each is listed in every cell that it may reach.
struct Buckets {
    members: BTreeMap<(i32, i32), Vec<usize>>,
}

const BUCKET_M: f32 = 24.0;

impl Buckets {
    fn new(spans: &[(Vec3, f32)]) -> Buckets {
        let mut members = BTreeMap::<(i32, i32), Vec<usize>>::new();
        for (number, (at, radius)) in spans.iter().enumerate() {
            let low = ((at.truncate() - *radius) / BUCKET_M).floor().as_ivec2();
            let high = ((at.truncate() + *radius) / BUCKET_M).floor().as_ivec2();
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    members.entry((x, y)).or_default().push(number);
                }
            }
        }
        Buckets { members }
    }

    fn near(&self, point: Vec2) -> impl Iterator<Item = usize> + '_ {
        let key = (point / BUCKET_M).floor().as_ivec2();
        self.members.get(&(key.x, key.y)).into_iter().flatten().copied()
    }
}

/// The depth of the ground below a bridge at its ends. Metres.
pub(super) const ABUTMENT_M: f32 = DECK_M - 0.1;

/// The vertices of bridges, as bits of x and y.
pub(super) fn abutments(roads: &Mesh, decks: &[bool]) -> BTreeSet<(u32, u32)> {
    let triangles = roads.triangles.iter().zip(decks).filter(|(_, deck)| **deck);
    triangles
        .flat_map(|(triangle, _)| triangle)
        .map(|corner| {
            let [x, y, _] = roads.positions[*corner as usize];
            ((x + 0.0).to_bits(), (y + 0.0).to_bits())
        })
        .collect()
}

/// The undersides and sides of all bridges, as faces of object 0.
pub(super) fn undersides(roads: &Mesh, decks: &[bool], borders: &[[u32; 2]]) -> Mesh {
    let mut mesh = Mesh::default();
    let face = Face::new(Tag::Bridge, Material::Concrete, 0);
    let point = |corner: u32| roads.positions[corner as usize];
    let below = |corner: u32| {
        let [x, y, z] = point(corner);
        [x, y, z - DECK_M]
    };
    for (triangle, deck) in roads.triangles.iter().zip(decks) {
        if *deck {
            let [a, b, c] = triangle.map(|corner| mesh.vertex(below(corner)));
            mesh.triangle([a, c, b], face);
        }
    }
    for [from, to] in borders {
        mesh.quad([point(*to), point(*from), below(*from), below(*to)], face);
    }
    mesh
}
