//! Lamps that illuminate surfaces: street lights and the lamps of vehicles.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec2, Vec3, Vec4};
use mesh::Material;

use crate::bvh::Link;
use crate::hit::NONE;
use crate::light::Light;
use crate::scene::{Blas, Scene};
use crate::surface_material::SurfaceMaterial;
use crate::world::World;

/// Values of [`Lamp::kind`]: how the radiant intensity depends on the direction.
pub(crate) mod kind {
    /// Street light: more to the sides than straight down, most at 65° from the vertical and almost nothing above
    /// 80°, as luminaires do for an even road without glare.
    pub(crate) const STREET: u32 = 0;
    /// Low beam: nothing above the horizontal.
    pub(crate) const LOW_BEAM: u32 = 1;
    /// High beam.
    pub(crate) const HIGH_BEAM: u32 = 2;
    /// Diffuse: by the cosine of the angle.
    pub(crate) const DIFFUSE: u32 = 3;
}

/// Point light. The shaders read the same 48 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Lamp {
    pub(crate) position: [f32; 3],
    /// One of [`kind`].
    pub(crate) kind: u32,
    /// Direction of its axis, of unit length.
    pub(crate) direction: [f32; 3],
    /// Distance from which on it illuminates nothing. Metres.
    pub(crate) reach: f32,
    /// Radiant intensity along the axis: the irradiance at 1 m, in the units of [`Light`].
    pub(crate) intensity: [f32; 3],
    pub(crate) reserved: u32,
}

impl Lamp {
    /// Returns the approximate largest irradiance in a cell, over the intensity: `to_corner` leads from the lamp
    /// to the lower left corner, `away` to the nearest point, both horizontally.
    fn share_in(&self, to_corner: Vec2, side: f32, away: Vec2) -> f32 {
        // A lamp hangs a few metres above the surfaces.
        let at = |to: Vec2| self.share_towards(to) / (to.length_squared() + 25.0);
        if self.kind == kind::STREET || away == Vec2::ZERO {
            return 1.0 / (away.length_squared() + 25.0);
        }
        // The middle of a cell beside a beam may be dark where a corner is bright.
        let shares = [0.0, 0.5, 1.0];
        let places = shares.into_iter().flat_map(|x| shares.map(|y| Vec2::new(x, y)));
        places.map(|share| at(to_corner + share * side)).fold(at(away), f32::max)
    }

    /// Returns the approximate share of its intensity that a lamp sends in a horizontal direction.
    fn share_towards(&self, to: Vec2) -> f32 {
        let ahead = Vec2::new(self.direction[0], self.direction[1]);
        let along = ahead.dot(to.normalize_or_zero()).max(0.0);
        let squared = along * along;
        match self.kind {
            kind::DIFFUSE => along,
            _ => squared * squared,
        }
    }
}

/// Lamps of one cell of the grid; [`NONE`] is an empty entry, behind the others.
pub(crate) type Cell = [u32; CELL_LAMPS];

/// Lamps of a cell at most: a street with lamps and vehicles on both sides has more than eight, and one that is
/// dropped leaves an edge in the light on the ground.
const CELL_LAMPS: usize = 16;

/// Lamps of a frame, and for each cell of a horizontal grid those that illuminate it most.
#[derive(Clone, Debug, Default)]
pub(crate) struct LampGrid {
    pub(crate) lamps: Vec<Lamp>,
    /// Corner of the grid.
    pub(crate) low: Vec2,
    /// Side of a cell. Metres.
    pub(crate) side: f32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    /// Cells row by row.
    pub(crate) cells: Vec<Cell>,
}

/// Smallest side of a cell in metres, and largest number of columns and rows.
const SIDE_MIN_M: f32 = 16.0;
const CELLS_MAX: f32 = 128.0;

/// Lamps of the scene that was rendered last.
#[derive(Debug, Default)]
pub(crate) struct SceneLamps {
    /// [`Scene::serial`], and its lamps.
    parts: Option<(u64, LampParts)>,
}

impl SceneLamps {
    /// Returns the lamps that shine in a frame; none by day, when they would not be noticed.
    pub(crate) fn grid(&mut self, scene: &Scene, world: &World, light: &Light) -> LampGrid {
        let mut grid = LampGrid::default();
        if light.horizon.w <= 0.0 {
            return grid;
        }
        let known = self.parts.take().filter(|(serial, _)| *serial == scene.serial);
        let (_, parts) =
            self.parts.insert(known.unwrap_or_else(|| (scene.serial, LampParts::of(scene))));
        // Lamps are as much brighter than real ones as nights are: at dusk they add little to daylight.
        let gain = light.horizon.w * light.horizon.w;
        let emission = |part: &LampPart, instance: u32| {
            SurfaceMaterial::new(scene, world, light, part.triangle, instance).emission * gain
        };
        for part in &parts.town {
            grid.lamps.extend(part.lamp(emission(part, NONE), &Affine3A::IDENTITY));
        }
        for (instance, number) in world.instances.iter().zip(0..) {
            let parts = &parts.blases[instance.blas as usize];
            if !parts.is_empty() {
                let rows = instance.actor_from_world.map(Vec4::from);
                let [x, y, z] = rows.map(|row| row.truncate());
                // The rows are those of a rotation, so its transpose is the inverse.
                let origin = -(x * rows[0].w + y * rows[1].w + z * rows[2].w);
                let world_from_piece =
                    Affine3A::from_mat3_translation(glam::Mat3::from_cols(x, y, z), origin);
                for part in parts {
                    grid.lamps.extend(part.lamp(emission(part, number), &world_from_piece));
                }
            }
        }
        grid.assign();
        grid
    }
}

impl LampGrid {
    /// Assigns the lamps to the cells within their reach.
    fn assign(&mut self) {
        let at = |lamp: &Lamp| Vec2::new(lamp.position[0], lamp.position[1]);
        let nothing = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        let (low, high) = self.lamps.iter().fold(nothing, |(low, high), lamp| {
            (low.min(at(lamp) - lamp.reach), high.max(at(lamp) + lamp.reach))
        });
        if self.lamps.is_empty() {
            return;
        }
        self.low = low;
        self.side = ((high - low).max_element() / CELLS_MAX).max(SIDE_MIN_M);
        let [columns, rows] = ((high - low) / self.side).to_array().map(|n| n as u32 + 1);
        (self.columns, self.rows) = (columns, rows);
        self.cells = vec![[NONE; CELL_LAMPS]; (columns * rows) as usize];
        let mut strengths = vec![[0.0f32; CELL_LAMPS]; self.cells.len()];
        for (lamp, number) in self.lamps.iter().zip(0..) {
            let center = at(lamp) - low;
            let bound = |v: Vec2| (v / self.side).max(Vec2::ZERO).to_array().map(|n| n as u32);
            let [left, bottom] = bound(center - lamp.reach);
            let [right, top] = bound(center + lamp.reach);
            let brightness = Vec3::from(lamp.intensity).max_element();
            for row in bottom..=top.min(rows - 1) {
                for column in left..=right.min(columns - 1) {
                    let corner = Vec2::new(column as f32, row as f32) * self.side;
                    let away = center.clamp(corner, corner + self.side) - center;
                    if away.length() >= lamp.reach {
                        continue;
                    }
                    let strength = brightness * lamp.share_in(corner - center, self.side, away);
                    let cell = (row * columns + column) as usize;
                    insert(&mut self.cells[cell], &mut strengths[cell], number, strength);
                }
            }
        }
    }
}

/// Inserts a lamp in the order of falling strength; the weakest is dropped from a full cell.
fn insert(cell: &mut Cell, strengths: &mut [f32; CELL_LAMPS], mut number: u32, mut strength: f32) {
    for (entry, own) in cell.iter_mut().zip(strengths) {
        if *entry == NONE || strength > *own {
            std::mem::swap(entry, &mut number);
            std::mem::swap(own, &mut strength);
            if number == NONE {
                return;
            }
        }
    }
}

/// Lamps of the town and of each bottom-level hierarchy, at rest.
#[derive(Debug)]
struct LampParts {
    town: Vec<LampPart>,
    /// By index of the bottom-level hierarchy.
    blases: Vec<Vec<LampPart>>,
}

/// Triangles that emit light together.
#[derive(Clone, Copy, Debug)]
struct LampPart {
    /// One of them, which decides the emission.
    triangle: u32,
    kind: u32,
    position: Vec3,
    direction: Vec3,
    /// Radiant intensity over emitted radiance. Square metres.
    area: f32,
    reach: f32,
}

impl LampPart {
    /// Returns the lamp that shines with an emitted radiance; `None` if it is off.
    fn lamp(&self, emission: Vec3, world_from_piece: &Affine3A) -> Option<Lamp> {
        (emission.max_element() > 0.0).then(|| Lamp {
            position: world_from_piece.transform_point3(self.position).to_array(),
            kind: self.kind,
            direction: world_from_piece.transform_vector3(self.direction).to_array(),
            reach: self.reach,
            intensity: (emission * self.area).to_array(),
            reserved: 0,
        })
    }
}

impl LampParts {
    fn of(scene: &Scene) -> LampParts {
        LampParts {
            town: street_lights(scene),
            blases: scene.blases.iter().map(|blas| vehicle_lamps(scene, blas)).collect(),
        }
    }
}

/// Returns one lamp for each object of the town that has [`Material::LampWhite`].
fn street_lights(scene: &Scene) -> Vec<LampPart> {
    let mut objects: BTreeMap<u32, (u32, Vec3, Vec3)> = BTreeMap::new();
    for (triangle, index) in scene.triangles[..scene.town_ends[2] as usize].iter().zip(0..) {
        if triangle.material() == Material::LampWhite as u8 {
            let empty = (index, Vec3::INFINITY, Vec3::NEG_INFINITY);
            let (_, low, high) = objects.entry(triangle.object).or_insert(empty);
            for corner in triangle.corners() {
                (*low, *high) = (low.min(corner), high.max(corner));
            }
        }
    }
    let part = |(triangle, low, high): (u32, Vec3, Vec3)| LampPart {
        triangle,
        kind: kind::STREET,
        position: low.midpoint(high).with_z(low.z - 0.05),
        direction: Vec3::NEG_Z,
        area: 1.0,
        reach: 45.0,
    };
    objects.into_values().map(part).collect()
}

/// Returns the lamps of a piece of a vehicle: left and right ones of a kind as one, at the front and
/// at the rear.
fn vehicle_lamps(scene: &Scene, blas: &Blas) -> Vec<LampPart> {
    const HEAD: u8 = Material::LampWhite as u8;
    const HIGH: u8 = Material::LampHigh as u8;
    const RED: u8 = Material::LampRed as u8;
    const REVERSE: u8 = Material::LampReverse as u8;
    const LEFT: u8 = Material::IndicatorLeft as u8;
    const RIGHT: u8 = Material::IndicatorRight as u8;
    let mut found: BTreeMap<(u8, bool), (u32, Vec3, f32)> = BTreeMap::new();
    // Signs on the roof are lit, but are no headlamps.
    let highest = blas.low.z + 0.62 * (blas.high.z - blas.low.z);
    for index in blas_triangles(scene, blas) {
        let triangle = &scene.triangles[index as usize];
        let code = triangle.material();
        if !matches!(code, HEAD | HIGH | RED | REVERSE | LEFT | RIGHT) {
            continue;
        }
        let normal = Vec3::from(triangle.edge1).cross(Vec3::from(triangle.edge2));
        let area = normal.length() * 0.5;
        let [a, b, c] = triangle.corners();
        let center = (a + b + c) / 3.0;
        let is_front = center.x > blas.low.midpoint(blas.high).x;
        let faces_out = normal.x.abs() > normal.length() * 0.3;
        if !faces_out || center.z > highest || (code == HEAD && !is_front) {
            continue;
        }
        let (_, sum, areas) = found.entry((code, is_front)).or_insert((index, Vec3::ZERO, 0.0));
        (*sum, *areas) = (*sum + center * area, *areas + area);
    }
    let part = |((code, is_front), (triangle, sum, areas)): ((u8, bool), (u32, Vec3, f32))| {
        let center = sum / areas;
        let (x, direction) = match is_front {
            true => (blas.high.x + 0.05, Vec3::X),
            false => (blas.low.x - 0.05, Vec3::NEG_X),
        };
        let (kind, area, reach) = match code {
            HEAD => (kind::LOW_BEAM, 2.33, 70.0),
            HIGH => (kind::HIGH_BEAM, 4.0, 120.0),
            REVERSE => (kind::DIFFUSE, 0.6, 15.0),
            _ => (kind::DIFFUSE, 0.25, 8.0),
        };
        LampPart { triangle, kind, position: center.with_x(x), direction, area, reach }
    };
    found.into_iter().map(part).collect()
}

/// Returns the indices of the triangles of a hierarchy.
fn blas_triangles(scene: &Scene, blas: &Blas) -> Vec<u32> {
    let (mut links, mut triangles) = (vec![blas.root], Vec::new());
    while let Some(link) = links.pop() {
        if link == Link::EMPTY {
            continue;
        }
        if link.is_leaf() {
            let (first, count) = link.primitives();
            triangles.extend(first..first + count);
        } else {
            let node = &scene.nodes[link.0 as usize];
            links.extend([node.child0, node.child1]);
        }
    }
    triangles.sort_unstable();
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(kind: u32, [x, y]: [f32; 2], direction: Vec3, intensity: f32, reach: f32) -> Lamp {
        Lamp {
            position: [x, y, 0.6],
            kind,
            direction: direction.to_array(),
            reach,
            intensity: [intensity; 3],
            reserved: 0,
        }
    }

    #[test]
    fn a_beam_that_grazes_a_cell_is_among_its_lamps() {
        // The grid begins at x = -110, with a cell from x = 2 to 18 beside a beam along y at x = 1.5.
        let mut lamps = vec![
            lamp(kind::DIFFUSE, [-100.0, 0.0], Vec3::NEG_Z, 1.0, 10.0),
            lamp(kind::LOW_BEAM, [1.5, 0.0], Vec3::Y, 50.0, 70.0),
        ];
        let weak = |at: u32| lamp(kind::DIFFUSE, [9.0, at as f32 * 0.2], Vec3::NEG_Z, 1.0, 10.0);
        lamps.extend((0..20).map(weak));
        let mut grid = LampGrid { lamps, ..LampGrid::default() };
        grid.assign();
        assert_eq!((grid.low, grid.side), (Vec2::new(-110.0, -70.0), 16.0));
        let at = ((Vec2::new(2.5, 5.0) - grid.low) / grid.side).floor();
        let cell = grid.cells[(at.y as u32 * grid.columns + at.x as u32) as usize];
        assert!(cell.contains(&1), "{cell:?}");
    }
}
