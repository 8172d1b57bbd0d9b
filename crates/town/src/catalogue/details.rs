//! Fine parts of bodies from cages: gaps round bonnet, boot lid and rear doors, wipers, an antenna.

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{
        blueprint::Wheel,
        cage::Surface,
        end::End,
        profile::{Measure, SHELL, Silhouette, Skin},
    },
    mesh_builder::MeshBuilder,
};

/// The width of a gap between two panels, 3.5 to 5 mm on cars of today, and a little more, so that it is not lost between
/// rays. Metres.
const GAP_M: f32 = 0.006;
/// The width of the dark bands along the sills, and of the seals below the windows. Metres.
const SILL_M: f32 = 0.05;
const SEAL_M: f32 = 0.014;
/// The width of the dark bands below both bumpers, and of those round the wheel arches of cars with more than this
/// ground clearance. Metres.
const VALANCE_M: f32 = 0.075;
const FLARE_M: f32 = 0.06;
/// How far they stand out of the body, which is round below them. Metres.
const VALANCE_OUT_M: f32 = 0.003;
const FLARE_OUT_M: f32 = 0.009;
const RUGGED_M: f32 = 0.2;
/// The height of the dark band that stands for a gap over the body. Metres.
const LIFT_M: f32 = 0.003;

/// A point of the body and its outward normal.
type Spot = (Vec3, Vec3);
/// Points of the body above each other.
type Column = [Spot; 5];

/// Adds all that fits the body.
pub(super) fn fit(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    surface: &Surface,
) {
    let body = Body { shape, measure, surface };
    for line in body.bonnet().into_iter().chain(body.lid()) {
        gap(builder, &line, GAP_M);
    }
    for line in body.bumpers() {
        gap(builder, &line, GAP_M);
    }
    for line in body.sills() {
        gap(builder, &line, SILL_M);
    }
    for columns in body.valances() {
        cladding(builder, &columns);
    }
    if shape.doors > 0 && !body.is_van() && !shape.is_angular && shape.clearance_m > RUGGED_M {
        for line in body.arches() {
            band(builder, &line, FLARE_M, FLARE_OUT_M);
        }
    }
    body.belts(builder);
    body.wipers(builder);
    body.antenna(builder);
    if body.is_van() {
        body.rear_doors(builder);
        body.sliding_door(builder);
    }
}

/// Adds a dark band along a line of the body, which stands for a gap.
fn gap(builder: &mut MeshBuilder, line: &[Spot], wide: f32) {
    band(builder, line, wide, LIFT_M);
}

/// Adds a dark band along a line of the body, at a height over it.
fn band(builder: &mut MeshBuilder, line: &[Spot], wide: f32, out: f32) {
    builder.tinted(Material::Plastic, [10, 10, 11]);
    let edges: Vec<[Vec3; 2]> = (0..line.len())
        .map(|at| {
            let (point, normal) = line[at];
            let ahead = line[(at + 1).min(line.len() - 1)].0 - line[at.saturating_sub(1)].0;
            let aside = ahead.cross(normal).normalize_or_zero() * wide * 0.5;
            [point + normal * out - aside, point + normal * out + aside]
        })
        .collect();
    for pair in edges.windows(2) {
        builder.quad([pair[0][0], pair[0][1], pair[1][1], pair[1][0]]);
    }
}

/// Adds unpainted plastic over the body, which lies between its columns.
fn cladding(builder: &mut MeshBuilder, columns: &[Column]) {
    builder.tinted(Material::Plastic, [10, 10, 11]);
    let raised = |(at, normal): Spot| at + normal * VALANCE_OUT_M;
    for pair in columns.windows(2) {
        let [right, left] = [pair[0].map(raised), pair[1].map(raised)];
        for row in 0..right.len() - 1 {
            let corners = [right[row], left[row], left[row + 1], right[row + 1]];
            let [a, b, c, d] = corners;
            let is_outward = (c - a).cross(d - b).dot(pair[0][row].1) > 0.0;
            builder.quad(if is_outward { corners } else { [a, d, c, b] });
        }
    }
}

/// A body and its dimensions.
struct Body<'a> {
    shape: &'a Silhouette,
    measure: &'a Measure<'a>,
    surface: &'a Surface,
}

impl Body<'_> {
    fn half(&self) -> f32 {
        self.measure.body_m * 0.5
    }

    fn tail(&self) -> End<'_> {
        let Body { shape, measure, surface } = *self;
        End { shape, measure, is_front: false, surface }
    }

    fn is_van(&self) -> bool {
        self.shape.has_tall_tail() && self.shape.doors > 0
    }

    /// The uppermost point at a fraction of the length, `y` beside the middle.
    fn above(&self, fraction: f32, y: f32) -> Option<Spot> {
        let (at, normal) = self.surface.cast(vec3(self.measure.at(fraction), y, 0.3), Vec3::Z)?;
        (normal.z > 0.15).then_some((at, normal))
    }

    /// A line over the top from one point to another: fractions of the length, and of the half
    /// width.
    fn over(&self, from: [f32; 2], to: [f32; 2], steps: u32) -> Vec<Spot> {
        let at = |step: u32| {
            let t = step as f32 / steps as f32;
            let [x, u] = [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * t);
            self.above(x, u * self.shape.plan(x) * self.half())
        };
        (0..=steps).map_while(at).collect()
    }

    /// The gaps round the bonnet: both sides and the front edge.
    fn bonnet(&self) -> Vec<Vec<Spot>> {
        let Some((cowl, _)) = self.shape.cowl().filter(|(cowl, _)| *cowl > 0.12) else {
            return Vec::new();
        };
        let front = 0.045;
        let side = |side: f32| self.over([front, 0.66 * side], [cowl - 0.012, 0.80 * side], 24);
        vec![side(1.0), side(-1.0), self.over([front, 0.66], [front, -0.66], 28)]
    }

    /// The gaps of a boot lid or tailgate: over the deck behind the rear window, and down the tail.
    fn lid(&self) -> Vec<Vec<Spot>> {
        if self.is_van() || self.shape.doors == 0 {
            return Vec::new();
        }
        let top = self.shape.top;
        let pane = top.iter().rposition(|point| point.2 == Skin::Pane);
        let pane = pane.filter(|pane| top[*pane].0 > 0.5 && pane + 1 < top.len());
        // A load bed has none.
        let deck = pane.map(|pane| top[pane + 1].0 + 0.012);
        let end = self.tail();
        let height = self.measure.size_m.z;
        let high = self.shape.top(0.975) * height - 0.05;
        let low = self.shape.clearance_m + 0.06 + (high - self.shape.clearance_m) * 0.24;
        let y = self.half() * 0.70;
        let mut lines = Vec::new();
        for side in [1.0f32, -1.0] {
            if let Some(deck) = deck.filter(|deck| *deck < 0.93) {
                lines.push(self.over([deck, 0.74 * side], [0.975, 0.74 * side], 14));
            }
            let down = |step: u32| end.ahead(y * side, high + (low - high) * step as f32 / 18.0);
            lines.push((0..=18).map_while(down).collect());
        }
        let across = |step: u32| end.ahead(y * (1.0 - step as f32 / 14.0), low);
        lines.push((0..=28).map_while(across).collect());
        lines
    }

    /// A point of the side (1 left, −1 right) at a fraction of the length and a height.
    fn beside(&self, side: f32, fraction: f32, z: f32) -> Option<Spot> {
        self.surface.cast(vec3(self.measure.at(fraction), 0.0, z), Vec3::Y * side)
    }

    /// The upper edges of both bumpers, from corner to corner.
    fn bumpers(&self) -> Vec<Vec<Spot>> {
        self.round_ends(|end| {
            let at_end = if end.is_front { 0.02 } else { 0.98 };
            let top = end.shape.top(at_end).min(end.shape.belt(at_end)) * end.measure.size_m.z;
            end.shape.clearance_m + (top - end.shape.clearance_m) * 0.52
        })
    }

    /// The bands of unpainted plastic below both bumpers, from corner to corner: columns from the lower to the upper
    /// edge.
    fn valances(&self) -> Vec<Vec<Column>> {
        if self.shape.doors == 0 {
            return Vec::new();
        }
        let Body { shape, measure, surface } = *self;
        let band = |is_front: bool| -> Vec<Column> {
            let end = End { shape, measure, is_front, surface };
            let foot = end.low() + 0.005 - VALANCE_M * 0.5;
            let column = |step: i32| -> Option<Column> {
                let u = step as f32 * 0.05;
                let at = |z: f32| end.round(u.signum(), u.abs(), z);
                // The lower edge of the body, which ends higher at its corners.
                let mut heights = (0..16).map(|step| foot + 0.01 * step as f32);
                let foot = heights.find(|z| at(*z).is_some())?;
                let rows = [0.0, 0.25, 0.5, 0.75, 1.0].map(|up| at(foot + up * VALANCE_M));
                let [Some(a), Some(b), Some(c), Some(d), Some(e)] = rows else { return None };
                Some([a, b, c, d, e])
            };
            (-24..=24).filter_map(column).collect()
        };
        vec![band(true), band(false)]
    }

    /// A line round the front and one round the rear of a body with doors, each at a height of its end.
    fn round_ends(&self, height: impl Fn(&End) -> f32) -> Vec<Vec<Spot>> {
        if self.shape.doors == 0 {
            return Vec::new();
        }
        let Body { shape, measure, surface } = *self;
        let line = |is_front: bool| -> Vec<Spot> {
            let end = End { shape, measure, is_front, surface };
            let z = height(&end);
            let at = |step: i32| {
                let u = step as f32 * 0.04;
                end.round(u.signum(), u.abs(), z)
            };
            (-30..=30).filter_map(at).collect()
        };
        vec![line(true), line(false)]
    }

    /// The bands along the lower edges of both sides, between the wheels.
    fn sills(&self) -> Vec<Vec<Spot>> {
        let Measure { size_m, nose_m, wheels, .. } = *self.measure;
        let arch = |front: bool| {
            let of = wheels.iter().filter(|wheel| (wheel.position_m.x > 0.0) == front);
            let back = if front { -1.0 } else { 1.0 };
            let ends = of.map(|wheel| wheel.position_m.x + back * (wheel.radius_m * 1.14 + 0.03));
            ends.reduce(f32::max).map(|x| (nose_m - x) / size_m.x)
        };
        let (Some(from), Some(to)) = (arch(true), arch(false)) else { return Vec::new() };
        let line = |side: f32, z: f32| -> Vec<Spot> {
            let at = |step: u32| self.beside(side, from + (to - from) * step as f32 / 6.0, z);
            (0..=6).filter_map(at).filter(|(_, normal)| normal.y.abs() > 0.3).collect()
        };
        let low = self.shape.clearance_m + 0.03;
        [1.0, -1.0].map(|side| [low, low + SILL_M].map(|z| line(side, z))).concat()
    }

    /// The bands of unpainted plastic round the wheel arches.
    fn arches(&self) -> Vec<Vec<Spot>> {
        let around = |wheel: &Wheel| -> Vec<Spot> {
            let hub = wheel.position_m;
            let at = |step: u32| {
                let (sin, cos) = (std::f32::consts::PI * (step as f32 / 12.0)).sin_cos();
                let reach = wheel.radius_m * 1.22 + FLARE_M * 0.5;
                let from = vec3(hub.x + cos * reach * hub.y.signum(), 0.0, hub.z + sin * reach);
                self.surface.cast(from, Vec3::Y * hub.y.signum())
            };
            (0..=12).filter_map(at).filter(|(_, normal)| normal.y.abs() > 0.3).collect()
        };
        self.measure.wheels.iter().map(around).collect()
    }

    /// The seals below the windows of the doors.
    fn belts(&self, builder: &mut MeshBuilder) {
        for (door, (from, to)) in self.shape.door_cuts().into_iter().enumerate() {
            for (side, right) in [(1.0, 0), (-1.0, 1)] {
                let at = |step: u32| {
                    let fraction = from + 0.006 + (to - from - 0.012) * step as f32 / 4.0;
                    let z = self.shape.belt(fraction) * self.measure.size_m.z - 0.012;
                    self.beside(side, fraction, z)
                };
                builder.object(SHELL + 1 + 2 * door as u32 + right);
                gap(builder, &(0..=4).filter_map(at).collect::<Vec<_>>(), SEAL_M);
            }
        }
        if self.shape.doors > 0 {
            builder.object(SHELL);
        }
    }

    /// Two wipers at rest, along the lower edge of the windscreen.
    fn wipers(&self, builder: &mut MeshBuilder) {
        let Some((cowl, _)) = self.shape.cowl() else { return };
        let top = self.shape.top.iter().find(|point| point.0 > cowl + 1e-3);
        let Some(rise) = top.map(|point| point.0 - cowl) else { return };
        builder.tinted(Material::Plastic, [16, 16, 17]);
        for (from, to) in [(0.70, 0.08), (0.04, -0.58)] {
            let at = |step: u32| {
                let t = step as f32 / 5.0;
                let x = cowl + rise * (0.10 + 0.10 * t);
                let y = self.half() * (from + (to - from) * t) * 0.86;
                self.above(x, y).map(|(at, normal)| at + normal * 0.014)
            };
            let blade: Vec<Vec3> = (0..=5).map_while(at).collect();
            builder.pipe(&blade, 0.008, 5);
            let Some(end) = blade.get(2) else { continue };
            let base = self.above(cowl + rise * 0.03, self.half() * from * 0.80);
            if let Some((at, _)) = base {
                builder.rod(at - Vec3::Z * 0.01, *end + Vec3::Z * 0.012, 0.007, 5);
            }
        }
    }

    /// A fin at the rear of the roof, where it is lower than the vehicle's height.
    fn antenna(&self, builder: &mut MeshBuilder) {
        let top = self.shape.top;
        let Some(pane) = top.iter().rfind(|point| point.2 == Skin::Pane && point.0 > 0.5) else {
            return;
        };
        let Some((foot, _)) = self.above(pane.0 - 0.035, 0.0) else { return };
        let tall = (self.measure.size_m.z - foot.z - 0.003).min(0.055);
        if tall < 0.025 {
            return;
        }
        builder.material(Material::CarPaint);
        // Rings from the base to the tip, which leans back.
        let ring = |up: f32, grow: f32| -> Vec<Vec3> {
            (0..8)
                .map(|side| {
                    let (sin, cos) = (std::f32::consts::TAU * side as f32 / 8.0).sin_cos();
                    let x = cos * 0.075 * grow - 0.045 * up;
                    foot + vec3(x, sin * 0.020 * grow, tall * up - 0.008 * (1.0 - up))
                })
                .collect()
        };
        let rings = [ring(0.0, 1.0), ring(0.45, 0.70), ring(0.85, 0.38), ring(1.0, 0.16)];
        builder.solid(|builder| builder.loft(&rings, |_, _| None));
    }

    /// Two doors at the tail of a van: windows, gaps, a handle.
    fn rear_doors(&self, builder: &mut MeshBuilder) {
        let end = self.tail();
        let (height, half) = (self.measure.size_m.z, self.half());
        let (low, high) = (self.shape.clearance_m + 0.22, height * 0.90);
        let upright = |y: f32| -> Vec<Spot> {
            let at = |step: u32| end.ahead(y, low + (high - low) * step as f32 / 8.0);
            (0..=8).map_while(at).collect()
        };
        for y in [0.0, half * 0.84, -half * 0.84] {
            gap(builder, &upright(y), GAP_M);
        }
        for z in [low, high] {
            let at = |step: u32| end.ahead(half * 0.84 * (1.0 - step as f32 / 6.0), z);
            gap(builder, &(0..=12).map_while(at).collect::<Vec<_>>(), GAP_M);
        }
        for side in [1.0, -1.0] {
            let pane = |builder: &mut MeshBuilder, y: [f32; 2], z: [f32; 2], out: f32| {
                let line = |step: u32| -> Option<Vec<Spot>> {
                    let y = side * half * (y[0] + (y[1] - y[0]) * step as f32 / 4.0);
                    (0..4)
                        .map(|row| end.ahead(y, z[0] + (z[1] - z[0]) * row as f32 / 3.0))
                        .collect()
                };
                if let Some(grid) = (0..=4).map(line).collect::<Option<Vec<_>>>() {
                    end.shell(builder, &grid, out);
                }
            };
            builder.tinted(Material::Rubber, [18, 18, 20]);
            pane(builder, [0.08, 0.72], [height * 0.54, height * 0.80], 0.003);
            builder.material(Material::Glass);
            pane(builder, [0.105, 0.695], [height * 0.55, height * 0.79], 0.007);
            builder.tinted(Material::Metal, [60, 62, 66]);
            for z in [0.24, 0.50, 0.80] {
                pane(builder, [0.82, 0.90], [height * z, height * z + 0.06], 0.02);
            }
        }
        if let Some((at, _)) = end.ahead(-half * 0.10, height * 0.42) {
            builder.tinted(Material::Plastic, [20, 20, 22]);
            builder.block(at - vec3(0.025, 0.09, 0.02), at + vec3(0.02, 0.09, 0.02));
        }
    }

    /// The gaps and the rail of a sliding door on the right of a van.
    fn sliding_door(&self, builder: &mut MeshBuilder) {
        let height = self.measure.size_m.z;
        let beside = |fraction: f32, z: f32| {
            self.surface.cast(vec3(self.measure.at(fraction), 0.0, z), -Vec3::Y)
        };
        let (from, to) = (self.shape.windows.1 + 0.022, self.shape.windows.1 + 0.24);
        let (low, high) = (self.shape.clearance_m + 0.10, height * 0.86);
        let upright = |fraction: f32| -> Vec<Spot> {
            let at = |step: u32| beside(fraction, low + (high - low) * step as f32 / 8.0);
            (0..=8).map_while(at).collect()
        };
        let along = |from: f32, to: f32, z: f32| -> Vec<Spot> {
            let at = |step: u32| beside(from + (to - from) * step as f32 / 8.0, z);
            (0..=8).map_while(at).collect()
        };
        for line in [upright(from), upright(to), along(from, to, low), along(from, to, high)] {
            gap(builder, &line, GAP_M);
        }
        gap(builder, &along(to, (to + 0.22).min(0.94), height * 0.47), 0.03);
        if let Some((at, _)) = beside(from + 0.025, height * 0.46) {
            builder.tinted(Material::Plastic, [20, 20, 22]);
            builder.block(at - vec3(0.09, 0.02, 0.02), at + vec3(0.09, 0.02, 0.02));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{blueprint, car, silhouettes, tall};

    fn with<T>(id: &str, shape: &Silhouette, test: impl FnOnce(&Body) -> T) -> T {
        let (_, one) = blueprint(id).unwrap();
        let size_m = one.half_extents_m * 2.0;
        let nose_m = one.center_m.x + one.half_extents_m.x;
        let measure = Measure { size_m, body_m: size_m.y * 0.9, nose_m, wheels: &one.wheels };
        let cage = car::cage(shape.cage, &measure).subdivided();
        let surface = Surface::of(&cage);
        test(&Body { shape, measure: &measure, surface: &surface })
    }

    #[test]
    fn gaps_of_bonnet_and_lid_are_symmetric_lines_on_the_body() {
        with("vehicle.lincoln.mkz_2020", &silhouettes::SEDAN, |body| {
            let [bonnet, lid] = [body.bonnet(), body.lid()];
            assert_eq!([bonnet.len(), lid.len()], [3, 5]);
            for pair in [[&bonnet[0], &bonnet[1]], [&lid[0], &lid[2]], [&lid[1], &lid[3]]] {
                assert_eq!(pair[0].len(), pair[1].len());
                for ((left, _), (right, _)) in pair[0].iter().zip(pair[1]) {
                    let mirrored = left.abs_diff_eq(vec3(right.x, -right.y, right.z), 1e-3);
                    assert!(mirrored, "{left} {right}");
                }
            }
            // The sides end below the windscreen, ahead of the doors.
            let last = bonnet[0].last().unwrap().0.x;
            let cowl = body.measure.at(body.shape.cowl().unwrap().0);
            assert!(last > cowl && last < cowl + 0.15, "{last} {cowl}");
        });
        with("vehicle.mitsubishi.fusorosa", &tall::COACH, |body| {
            assert!(body.bonnet().is_empty() && body.lid().is_empty());
        });
    }

    #[test]
    fn the_body_does_not_rise_through_a_gap_between_two_points_of_it() {
        with("vehicle.lincoln.mkz_2020", &silhouettes::SEDAN, |body| {
            for line in body.bonnet() {
                for pair in line.windows(2) {
                    let middle = (pair[0].0 + pair[1].0) * 0.5;
                    let (below, normal) =
                        body.surface.cast(middle.with_z(0.3), Vec3::Z).expect("a bonnet");
                    let over = (middle + pair[0].1 * LIFT_M - below).dot(normal);
                    assert!(over > 0.0, "{over} m over the bonnet at {middle}");
                }
            }
        });
    }

    #[test]
    fn dark_plastic_runs_below_the_bumpers_and_round_the_arches_of_rugged_cars() {
        with("vehicle.nissan.patrol_2021", &silhouettes::SUV, |body| {
            assert!(body.shape.clearance_m > RUGGED_M);
            let valances = body.valances();
            assert_eq!(valances.len(), 2);
            for line in &valances {
                assert!(line.len() > 40, "from corner to corner: {}", line.len());
                let [left, right] = [line.first(), line.last()].map(|end| end.unwrap()[2].0.y);
                assert!((left + right).abs() < 1e-3 && left.abs() > body.half() * 0.6, "{left}");
            }
            let arches = body.arches();
            assert_eq!(arches.len(), 4);
            for (line, wheel) in arches.iter().zip(body.measure.wheels) {
                assert!(line.len() >= 10, "{}", line.len());
                for (at, normal) in line {
                    let reach = (*at - wheel.position_m).with_y(0.0).length();
                    assert!(
                        (reach / wheel.radius_m - 1.22 - 0.5 * FLARE_M / wheel.radius_m).abs()
                            < 1e-3
                    );
                    assert!(normal.y * wheel.position_m.y > 0.0);
                }
            }
        });
        with("vehicle.mitsubishi.fusorosa", &tall::COACH, |body| {
            assert!(body.valances().is_empty());
        });
    }

    #[test]
    fn the_band_of_a_gap_has_its_width_and_lies_above_the_body() {
        let mut builder = MeshBuilder::new(mesh::Tag::Car, Material::CarPaint, 0);
        let line: Vec<Spot> = (0..5).map(|x| (vec3(x as f32, 0.0, 1.0), Vec3::Z)).collect();
        gap(&mut builder, &line, 0.1);
        let (low, high) = crate::mesh_builder::bounds(&builder.mesh);
        assert!(low.abs_diff_eq(vec3(0.0, -0.05, 1.0 + LIFT_M), 1e-6), "{low}");
        assert!(high.abs_diff_eq(vec3(4.0, 0.05, 1.0 + LIFT_M), 1e-6), "{high}");
        for corners in &builder.mesh.triangles {
            let [a, b, c] = corners.map(|at| Vec3::from_array(builder.mesh.positions[at as usize]));
            assert!((b - a).cross(c - a).z > 0.0, "a band faces outwards");
        }
    }
}
