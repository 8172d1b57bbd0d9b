//! The front and rear ends of cars, to which lamps, grilles and plates are fitted.

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{
        cage::Surface,
        profile::{Measure, Silhouette},
    },
    mesh_builder::{FIRST_CAP, LAST_CAP, MeshBuilder},
};

/// The distance by which lamps protrude from the body. Metres.
pub(super) const OUT_M: f32 = 0.012;
/// The rise of the lower edge of a head lamp at its inner end, as a fraction of its height.
const SWEEP: f32 = 0.42;
/// The steps across an opening.
const OPENING: i32 = 8;
/// The section of the rim of an opening: distances outwards from the edge of the opening, and out of the body.
/// Metres.
const RIM_M: [(f32, f32); 4] = [(0.013, -0.010), (0.008, 0.008), (-0.005, 0.012), (-0.009, -0.004)];

/// The front or rear end of a car.
pub(super) struct End<'a> {
    pub(super) shape: &'a Silhouette,
    pub(super) measure: &'a Measure<'a>,
    pub(super) is_front: bool,
    /// The body, which parts follow.
    pub(super) surface: &'a Surface,
}

impl End<'_> {
    /// The point where the body is `u` half widths wide, and its outward normal there: x and y of
    /// both.
    pub(super) fn place(&self, u: f32) -> ([f32; 2], [f32; 2]) {
        let from_end = |depth: f32| if self.is_front { depth } else { 1.0 - depth };
        let half = self.measure.body_m * 0.5;
        let wide = |depth: f32| self.shape.plan(from_end(depth));
        let (mut near, mut far) = (0.0f32, 0.30f32);
        if wide(near) < u {
            for _ in 0..18 {
                let middle = (near + far) * 0.5;
                if wide(middle) < u { near = middle } else { far = middle }
            }
        } else {
            far = near;
        }
        let depth = far;
        let length = self.measure.size_m.x;
        let run =
            if depth > 0.005 { (wide(depth + 0.004) - wide(depth - 0.004)) * half } else { 0.0 };
        let normal = glam::vec2(run.max(0.0), 0.008 * length).normalize_or(glam::Vec2::Y);
        let forward = if self.is_front { 1.0 } else { -1.0 };
        // Across the end the surface faces forward; at the corner it faces sideways.
        let ahead = if depth > 0.005 { normal.x.max(0.15) } else { 1.0 };
        let aside = if depth > 0.005 { normal.y } else { 0.0 };
        let sum = (ahead * ahead + aside * aside).sqrt();
        ([self.measure.at(from_end(depth)), u * half * 0.985], [forward * ahead / sum, aside / sum])
    }

    /// How far lamps rise from the middle to the corner. Metres.
    pub(super) fn rise(&self, u: f32) -> f32 {
        let most = if self.is_front { 0.035 } else { 0.02 };
        (u - 0.5).max(0.0) * most * 2.0
    }

    /// Adds a band round the end that narrows towards both of its ends.
    pub(super) fn cover(
        &self,
        builder: &mut MeshBuilder,
        side: f32,
        u: [f32; 2],
        z: [f32; 2],
        out: f32,
    ) {
        if let Some(grid) = self.lens(side, u, z, 8) {
            self.shell(builder, &grid, out);
        }
    }

    /// Adds such a band with edges of plastic.
    pub(super) fn framed(
        &self,
        builder: &mut MeshBuilder,
        side: f32,
        u: [f32; 2],
        z: [f32; 2],
        out: f32,
    ) {
        if let Some(grid) = self.lens(side, u, z, 6) {
            let rings = lifted(&grid, out);
            let faces = grid[0].len() - 1;
            let is_edge = |band, at| band == FIRST_CAP || band == LAST_CAP || at >= faces;
            builder.solid(|builder| {
                builder.loft(&rings, |band, at| is_edge(band, at).then_some(Material::Plastic));
            });
        }
    }

    /// The points of the body below such a band, in this many steps.
    fn lens(
        &self,
        side: f32,
        u: [f32; 2],
        z: [f32; 2],
        steps: u32,
    ) -> Option<Vec<Vec<(Vec3, Vec3)>>> {
        let line = |step: u32| -> Option<Vec<(Vec3, Vec3)>> {
            let t = step as f32 / steps as f32;
            let fraction = u[0] + (u[1] - u[0]) * t;
            let lift = self.rise(fraction);
            // An ellipse of fourth degree, a rectangle with rounded corners; the lower edge rises
            // towards the middle of the car.
            let open = (1.0 - (2.0 * t - 1.0).powi(4)).sqrt().max(0.25);
            let sweep = if self.is_front { SWEEP * (1.0 - t) * (1.0 - t) } else { 0.0 };
            let middle = (z[0] + z[1]) * 0.5 + lift;
            (0..4)
                .map(|row| {
                    let up = row as f32 / 3.0;
                    let rise = (up - 0.5) * open + sweep * open * (1.0 - up);
                    self.round(side, fraction, middle + (z[1] - z[0]) * rise)
                })
                .collect()
        };
        (0..=steps).map(line).collect()
    }

    pub(super) fn forward(&self) -> f32 {
        if self.is_front { 1.0 } else { -1.0 }
    }

    /// The point of the body at the end, seen along x, `y` beside the middle.
    pub(super) fn ahead(&self, y: f32, z: f32) -> Option<(Vec3, Vec3)> {
        let inside = self.measure.nose_m - self.measure.size_m.x * 0.5;
        self.surface.cast(vec3(inside, y, z), Vec3::X * self.forward())
    }

    /// The lowest height at which parts are fitted: 6 cm above the ground clearance, or the lower
    /// edge of a body that ends higher.
    pub(super) fn low(&self) -> f32 {
        let low = self.shape.clearance_m + 0.06;
        let wide = self.measure.body_m * 0.5 * 0.68;
        let fits = |z: &f32| [0.0, wide].iter().all(|y| self.ahead(*y, *z).is_some());
        let heights = (0..20).map(|step| low + 0.01 * step as f32);
        heights.into_iter().find(fits).unwrap_or(low)
    }

    /// The point of the body round the end: `u` of 1 lies at the corner, beyond it the side.
    pub(super) fn round(&self, side: f32, u: f32, z: f32) -> Option<(Vec3, Vec3)> {
        let half = self.measure.body_m * 0.5;
        let end = if self.is_front { 0.0 } else { self.measure.size_m.x };
        let from = vec3(self.measure.nose_m - end - self.forward() * half, 0.0, z);
        let (sin, cos) = (u * 1.12 * std::f32::consts::FRAC_PI_4).sin_cos();
        self.surface.cast(from, vec3(cos * self.forward(), sin * side, 0.0))
    }

    /// Adds a shell over the body: a grid of points of the body, lifted by `out`, with edges that
    /// end below the body.
    pub(super) fn shell(&self, builder: &mut MeshBuilder, grid: &[Vec<(Vec3, Vec3)>], out: f32) {
        let rings = lifted(grid, out);
        builder.solid(|builder| builder.loft(&rings, |_, _| None));
    }

    /// Adds a band round the end on one side (1 left, −1 right), between two fractions of the half
    /// width and two heights.
    pub(super) fn wrap(&self, builder: &mut MeshBuilder, side: f32, u: [f32; 2], z: [f32; 2]) {
        let steps = 8;
        let line = |step: u32| -> Option<Vec<(Vec3, Vec3)>> {
            let fraction = u[0] + (u[1] - u[0]) * step as f32 / steps as f32;
            // Lamps rise and narrow towards the sides.
            let lift = self.rise(fraction);
            (0..4)
                .map(|row| {
                    let z = z[0] + (z[1] - z[0]) * row as f32 / 3.0;
                    self.round(side, fraction, z + lift)
                })
                .collect()
        };
        if let Some(grid) = (0..=steps).map(line).collect::<Option<Vec<_>>>() {
            return self.shell(builder, &grid, OUT_M * 0.8);
        }
        let rings: Vec<Vec<Vec3>> = (0..=steps)
            .map(|step| {
                let fraction = u[0] + (u[1] - u[0]) * step as f32 / steps as f32;
                let ([x, y], [nx, ny]) = self.place(fraction);
                let (base, out) = (vec3(x, y * side, 0.0), vec3(nx, ny * side, 0.0));
                let (inner, outer) = (base - out * 0.06, base + out * OUT_M);
                vec![
                    inner + Vec3::Z * z[0],
                    outer + Vec3::Z * z[0],
                    outer + Vec3::Z * z[1],
                    inner + Vec3::Z * z[1],
                ]
            })
            .collect();
        builder.solid(|builder| builder.loft(&rings, |_, _| None));
    }

    /// The point of the body at the end, at a fraction of the half width on one side and at a height.
    pub(super) fn spot(&self, side: f32, [u, z]: [f32; 2]) -> Vec3 {
        let ([x, y], _) = self.place(u);
        let hit = self.ahead(u * self.measure.body_m * 0.5 * side, z);
        hit.map_or(vec3(x, y * side, z), |hit| hit.0)
    }

    /// Adds a forward-facing disc that protrudes by this distance.
    pub(super) fn disc(
        &self,
        builder: &mut MeshBuilder,
        side: f32,
        [u, z]: [f32; 2],
        radius: f32,
        out: f32,
    ) {
        let (at, forward) = (self.spot(side, [u, z]), self.forward());
        builder.cone(
            at - Vec3::X * 0.10 * forward,
            at + Vec3::X * forward * out,
            [radius, radius * 0.92],
            14,
        );
    }

    /// Adds a dark opening with round corners across the middle, as wide as two half widths at its
    /// upper and its lower edge, within a rim of a material.
    pub(super) fn opening(
        &self,
        builder: &mut MeshBuilder,
        [upper, lower]: [f32; 2],
        z: [f32; 2],
        rim: Material,
    ) {
        let line = |step: i32| -> Option<Vec<(Vec3, Vec3)>> {
            let t = step as f32 / OPENING as f32 * 2.0 - 1.0;
            let open = (1.0 - t.powi(4)).sqrt().max(0.5);
            (0..4)
                .map(|row| {
                    let up = 0.5 + (row as f32 / 3.0 - 0.5) * open;
                    self.ahead(t * (lower + (upper - lower) * up), z[0] + (z[1] - z[0]) * up)
                })
                .collect()
        };
        builder.tinted(Material::Plastic, [12, 12, 13]);
        let Some(grid) = (0..=OPENING).map(line).collect::<Option<Vec<_>>>() else {
            return self.plate(builder, upper, z, 0.004);
        };
        self.shell(builder, &grid, 0.004);
        // The edge of the opening, once round.
        let last = grid.len() - 1;
        let mut edge: Vec<(Vec3, Vec3)> = grid.iter().map(|line| line[3]).collect();
        edge.extend([grid[last][2], grid[last][1]]);
        edge.extend(grid.iter().rev().map(|line| line[0]));
        edge.extend([grid[0][1], grid[0][2]]);
        let middle = edge.iter().map(|(at, _)| *at).sum::<Vec3>() / edge.len() as f32;
        let ring = |at: usize| -> Vec<Vec3> {
            let (own, normal) = edge[at % edge.len()];
            let [before, after] = [at + edge.len() - 1, at + 1].map(|at| edge[at % edge.len()].0);
            let aside = (after - before).cross(normal).normalize_or_zero();
            let out = if aside.dot(own - middle) < 0.0 { -aside } else { aside };
            RIM_M.map(|(wide, high)| own + out * wide + normal * high).to_vec()
        };
        let rings: Vec<Vec<Vec3>> = (0..=edge.len()).map(ring).collect();
        builder.material(rim);
        builder.solid(|builder| builder.loft(&rings, |_, _| None));
    }

    /// Adds an upright plate across the middle that protrudes slightly.
    pub(super) fn plate(&self, builder: &mut MeshBuilder, half: f32, z: [f32; 2], out: f32) {
        let line = |step: u32| -> Option<Vec<(Vec3, Vec3)>> {
            let y = half * (step as f32 / 4.0 - 1.0);
            (0..4).map(|row| self.ahead(y, z[0] + (z[1] - z[0]) * row as f32 / 3.0)).collect()
        };
        if let Some(grid) = (0..=8).map(line).collect::<Option<Vec<_>>>() {
            return self.shell(builder, &grid, out);
        }
        let x = self.place(0.0).0[0];
        let forward = if self.is_front { 1.0 } else { -1.0 };
        let (a, b) = (x - forward * 0.05, x + forward * out);
        builder.block(vec3(a.min(b), -half, z[0]), vec3(a.max(b), half, z[1]));
    }
}

/// Returns the rings of a shell over a grid of points of the body: the points, lifted by `out`, and two below the body.
fn lifted(grid: &[Vec<(Vec3, Vec3)>], out: f32) -> Vec<Vec<Vec3>> {
    let ring = |line: &Vec<(Vec3, Vec3)>| {
        let lifted = line.iter().map(|(at, normal)| *at + *normal * out);
        let sunk = [line.len() - 1, 0].map(|end| line[end].0 - line[end].1 * 0.03);
        lifted.chain(sunk).collect()
    };
    grid.iter().map(ring).collect()
}
