//! Roofs.

use glam::{Quat, Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::{
    furnish::facade::{Frame, Look},
    mesh_builder::MeshBuilder,
    static_world::Detail,
};

/// What covers a pitched roof and its gables.
pub(super) struct Cover<'a> {
    /// The material of gables without a look.
    pub(super) gable: Material,
    pub(super) look: Option<&'a Look>,
}

impl Cover<'_> {
    fn gable(&self, builder: &mut MeshBuilder) {
        match self.look {
            Some(look) => look.wall().apply(builder),
            None => {
                builder.material(self.gable);
            }
        }
    }

    fn tiles(&self, builder: &mut MeshBuilder) {
        match self.look {
            Some(look) => look.tiles().apply(builder),
            None => {
                builder.material(Material::RoofTiles);
            }
        }
    }
}

/// Adds a flat roof with a parapet and equipment.
pub(super) fn flat(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    top: f32,
    (random, detail): (&mut RandomStream, Detail),
    look: Option<&Look>,
) {
    builder.material(Material::RoofFlat);
    builder.block(vec3(-x, -y, top - 0.02), vec3(x, y, top + 0.06));
    // The cornice protrudes, and the parapet stands on it.
    match look {
        Some(look) => look.trim().apply(builder),
        None => {
            builder.material(Material::Concrete);
        }
    }
    let parapet = look.map_or(0.95, |look| look.roof().parapet);
    let (out, thick, high) = (0.12, 0.30, top + parapet);
    for side in [-1.0f32, 1.0] {
        let (a, b) = (side * (x + out), side * (x - thick));
        builder.block(vec3(a.min(b), -y - out, top - 0.12), vec3(a.max(b), y + out, high));
        let (a, b) = (side * (y + out), side * (y - thick));
        builder.block(vec3(-x + thick, a.min(b), top - 0.12), vec3(x - thick, a.max(b), high));
    }
    let room = (x.min(y) - 2.2).max(0.0);
    if room < 1.0 {
        return;
    }
    let at = |random: &mut RandomStream, margin: f32| {
        let (x, y) = ((x - margin).max(0.0), (y - margin).max(0.0));
        vec3(random.between(-x, x), random.between(-y, y), top)
    };
    let house = at(random, 3.0);
    builder.material(Material::Concrete);
    builder.block(house + vec3(-1.6, -1.6, 0.0), house + vec3(1.6, 1.6, 2.7));
    let units = 2 + random.remainder(if detail == Detail::High { 8 } else { 4 });
    for _ in 0..units {
        let (unit, half) = (at(random, 1.8), random.between(0.45, 0.95));
        if (unit - house).abs().max_element() < 2.7 {
            continue;
        }
        builder.material(Material::Metal);
        builder.block(unit + vec3(-half, -0.6, 0.15), unit + vec3(half, 0.6, 1.25));
        builder.rod(unit + Vec3::Z * 1.25, unit + Vec3::Z * 1.40, 0.42, 8);
    }
    builder.material(Material::Metal);
    let vent = at(random, 1.2);
    builder.rod(vent, vent + Vec3::Z * 1.1, 0.16, 6);
    let Some(rule) = look.map(Look::roof) else { return };
    if random.chance(rule.antenna) {
        antenna(builder, at(random, 1.5), random.between(2.5, 4.5));
    }
    if random.chance(rule.skylights) {
        let first = at(random, 3.0);
        for light in 0..3 {
            let foot = first + Vec3::X * (1.5 * light as f32 - 1.5);
            builder.tinted(Material::Metal, [176, 178, 178]);
            builder.block(foot - vec3(0.55, 0.85, 0.0), foot + vec3(0.55, 0.85, 0.3));
            builder.tinted(Material::Glass, [96, 110, 118]);
            builder.block(foot - vec3(0.48, 0.78, -0.3), foot + vec3(0.48, 0.78, 0.36));
        }
    }
    if random.chance(rule.solar) {
        let first = at(random, 3.0);
        for panel in 0..4 {
            let foot = first + vec3(1.2 * panel as f32 - 1.8, 0.0, 0.5);
            let lean = Quat::from_rotation_x(0.45);
            builder.tinted(Material::Glass, [24, 34, 62]);
            builder.block_at(foot, vec3(0.56, 0.95, 0.025), lean);
        }
    }
}

/// Adds an antenna in the middle.
pub(super) fn mast(builder: &mut MeshBuilder, top: f32, height: f32) {
    builder.material(Material::Metal);
    builder.cone(Vec3::Z * top, Vec3::Z * (top + height), [0.28, 0.06], 6);
}

/// Adds a gable roof with the ridge along the street, or a hip roof; `pitch` is height over half
/// the depth.
pub(super) fn pitched(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    eaves: f32,
    pitch: f32,
    cover: &Cover,
    hipped: bool,
) {
    let (over, thick) = (0.45, 0.22);
    let ridge = eaves + y * pitch;
    let drop = over * pitch;
    let inset = if hipped { y.min(x * 0.8) } else { 0.0 };
    if !hipped {
        // Gable walls.
        cover.gable(builder);
        for side in [-1.0f32, 1.0] {
            let corners = [
                vec3(side * x, -side * y, eaves),
                vec3(side * x, side * y, eaves),
                vec3(side * x, 0.0, ridge),
            ];
            let [a, b, c] = corners.map(|corner| builder.vertex(corner));
            builder.triangle([a, b, c]);
        }
        if let Some(look) = cover.look {
            for side in [1, 3] {
                attic(builder, look, Frame::of_box([x, y], side), [eaves, ridge]);
            }
        }
    }
    cover.tiles(builder);
    let (ex, ey) = (x + over, y + over);
    let rx = ex - inset;
    let eave = |sx: f32, sy: f32, up: f32| vec3(sx * ex, sy * ey, eaves - drop + up);
    let top = |sx: f32, up: f32| vec3(sx * rx, 0.0, ridge + up);
    for up in [thick, 0.0] {
        let face = |builder: &mut MeshBuilder, mut corners: [Vec3; 4]| {
            if up == 0.0 {
                corners.reverse();
            }
            builder.quad(corners);
        };
        face(builder, [eave(-1.0, -1.0, up), eave(1.0, -1.0, up), top(1.0, up), top(-1.0, up)]);
        face(builder, [eave(1.0, 1.0, up), eave(-1.0, 1.0, up), top(-1.0, up), top(1.0, up)]);
        if hipped {
            face(builder, [eave(1.0, -1.0, up), eave(1.0, 1.0, up), top(1.0, up), top(1.0, up)]);
            face(
                builder,
                [eave(-1.0, 1.0, up), eave(-1.0, -1.0, up), top(-1.0, up), top(-1.0, up)],
            );
        }
    }
    // The edge of the covering, with its gutter.
    builder.material(Material::Wood);
    for side in [-1.0f32, 1.0] {
        builder.quad([
            eave(-side, -side, 0.0),
            eave(side, -side, 0.0),
            eave(side, -side, thick),
            eave(-side, -side, thick),
        ]);
        if hipped {
            builder.quad([
                eave(side, -side, 0.0),
                eave(side, side, 0.0),
                eave(side, side, thick),
                eave(side, -side, thick),
            ]);
        } else {
            for (a, b) in
                [(eave(side, -side, 0.0), top(side, 0.0)), (top(side, 0.0), eave(side, side, 0.0))]
            {
                builder.quad([a, b, b + Vec3::Z * thick, a + Vec3::Z * thick]);
            }
        }
    }
    builder.material(Material::Metal);
    for side in [-1.0f32, 1.0] {
        let gutter = vec3(0.0, side * (ey + 0.05), eaves - drop + 0.05);
        builder.rod(gutter - Vec3::X * ex, gutter + Vec3::X * ex, 0.07, 5);
    }
}

/// The size of the windows of attics, the height of their sill over the eaves, and the least distance from the covering
/// to them. Metres.
const ATTIC_M: [f32; 2] = [0.84, 1.12];
const ATTIC_SILL_M: f32 = 0.85;
const ATTIC_ROOM_M: f32 = 0.35;
/// The projection and the height of a sill. Metres.
const SILL_M: [f32; 2] = [0.07, 0.06];

/// Adds a sill with its upper edge at `z` on a wall, given by the rotation and the foot of its frame.
pub(super) fn sill(builder: &mut MeshBuilder, (turn, foot): (Quat, Vec3), x: [f32; 2], z: f32) {
    let [out, high] = SILL_M;
    let at = |x: f32, out: f32, z: f32| foot + turn * vec3(x, out, z);
    let [l, r] = [x[1], x[0]];
    builder.quad([at(l, out, z - high), at(r, out, z - high), at(r, out, z), at(l, out, z)]);
    builder.quad([at(l, out, z), at(r, out, z), at(r, 0.0, z), at(l, 0.0, z)]);
    builder.quad([
        at(l, 0.0, z - high),
        at(r, 0.0, z - high),
        at(r, out, z - high),
        at(l, out, z - high),
    ]);
}

/// Adds one or two windows to a gable between the heights of its eaves and its ridge, where they fit.
fn attic(builder: &mut MeshBuilder, look: &Look, frame: Frame, [eaves, ridge]: [f32; 2]) {
    let Frame { turn, foot, half } = frame;
    let [wide, high] = ATTIC_M;
    let low = eaves + ATTIC_SILL_M;
    let top = low + high;
    // The width of the gable at the heads of the windows.
    let room = half * (ridge - top) / (ridge - eaves) - ATTIC_ROOM_M;
    // Both gables of a building have the same windows.
    let mut random = look.stream(0xa771c);
    let apart = wide * random.between(0.75, 1.1);
    let places: &[f32] = match () {
        () if room > apart + wide * 0.5 && random.chance(0.6) => &[-1.0, 1.0],
        () if room > wide * 0.5 => &[0.0],
        () => return,
    };
    for place in places {
        let m = place * apart;
        let rect = |builder: &mut MeshBuilder, inset: f32, out: f32| {
            let (x, z) =
                ([m + wide * 0.5 - inset, m - wide * 0.5 + inset], [low + inset, top - inset]);
            let corners = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])];
            builder.quad(corners.map(|(x, z)| foot + turn * vec3(x, out, z)));
        };
        look.trim().apply(builder);
        rect(builder, -0.1, 0.012);
        sill(builder, (turn, foot), [m - wide * 0.5 - 0.12, m + wide * 0.5 + 0.12], low - 0.06);
        look.frame().apply(builder);
        rect(builder, 0.0, 0.018);
        let glass = [28.0, 32.0, 38.0].map(|c| (c + random.between(0.0, 16.0)) as u8);
        builder.tinted(Material::Glass, glass);
        rect(builder, 0.07, 0.026);
    }
}

/// Adds a gable roof over a wing, with the ridge along y.
pub(super) fn prism(builder: &mut MeshBuilder, x: [f32; 2], y: [f32; 2], eaves: f32, ridge: f32) {
    let middle = (x[0] + x[1]) * 0.5;
    let rings = [y[1], y[0]]
        .map(|y| vec![vec3(x[0], y, eaves), vec3(x[1], y, eaves), vec3(middle, y, ridge)]);
    builder.loft(&rings, |_, _| None);
}

/// Adds chimneys on the ridge.
pub(super) fn chimneys(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    eaves: f32,
    random: &mut RandomStream,
    count: u32,
) {
    for _ in 0..count {
        let foot = vec3(random.between(-0.7, 0.7) * x, random.between(-0.3, 0.3) * y, eaves);
        let top = foot + Vec3::Z * (y * 0.9 + 1.2);
        builder.material(Material::FacadeBrick);
        builder.block(foot - vec3(0.38, 0.32, 0.0), top + vec3(0.38, 0.32, 0.0));
        builder.material(Material::Concrete);
        builder.block(top - vec3(0.46, 0.40, 0.0), top + vec3(0.46, 0.40, 0.14));
    }
}

/// Adds an antenna with its foot at a point.
fn antenna(builder: &mut MeshBuilder, foot: Vec3, height: f32) {
    builder.tinted(Material::Metal, [120, 124, 126]);
    let top = foot + Vec3::Z * height;
    builder.rod(foot, top, 0.025, 4);
    for (drop, half) in [(0.1, 0.5), (0.4, 0.4), (0.7, 0.3)] {
        let middle = top - Vec3::Z * drop;
        builder.rod(middle - Vec3::X * half, middle + Vec3::X * half, 0.012, 3);
    }
}

/// The slopes of a gable roof. Metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    pub(super) half: [f32; 2],
    pub(super) eaves: f32,
    /// The rise over the run.
    pub(super) pitch: f32,
}

/// The thickness of the covering over the walls. Metres.
const COVER_M: f32 = 0.22;

impl Slope {
    /// The point of the covering at x, `up` of the way from the eaves to the ridge; `side` is 1 on
    /// the street's slope, -1 on the other.
    fn at(&self, x: f32, up: f32, side: f32, over: f32) -> Vec3 {
        let y = self.half[1] * (1.0 - up);
        vec3(x, side * y, self.eaves + COVER_M + over + self.half[1] * up * self.pitch)
    }

    /// Adds a rectangle that lies on a slope.
    fn sheet(&self, builder: &mut MeshBuilder, x: [f32; 2], up: [f32; 2], side: f32, over: f32) {
        let [l, r] = if side > 0.0 { [x[1], x[0]] } else { x };
        let corners = [(l, up[0]), (r, up[0]), (r, up[1]), (l, up[1])];
        builder.quad(corners.map(|(x, up)| self.at(x, up, side, over)));
    }

    /// Adds dormer windows on the street side.
    pub(super) fn dormers(
        &self,
        builder: &mut MeshBuilder,
        look: &Look,
        random: &mut RandomStream,
    ) {
        let [x, y] = self.half;
        let count = ((x * 2.0 / 3.6) as u32).clamp(1, 5);
        let wide = random.between(0.62, 0.8);
        let front = y * 0.74;
        let foot = self.eaves + (y - front) * self.pitch;
        let (high, rise) = (1.45, random.between(0.3, 0.75));
        for dormer in 0..count {
            let m = -x + x * 2.0 * (dormer as f32 + 0.5) / count as f32;
            look.wall().apply(builder);
            builder.block(vec3(m - wide, 0.2 * y, foot), vec3(m + wide, front, foot + high));
            look.frame().apply(builder);
            let pane = |builder: &mut MeshBuilder, x: [f32; 2], z: [f32; 2], out: f32| {
                let y = front + out;
                let corners = [(x[1], z[0]), (x[0], z[0]), (x[0], z[1]), (x[1], z[1])];
                builder.quad(corners.map(|(x, z)| vec3(x, y, z)));
            };
            let [low, top] = [foot + 0.32, foot + high - 0.08];
            pane(builder, [m - wide + 0.1, m + wide - 0.1], [low, top], 0.012);
            for (from, to) in [(m - wide + 0.16, m - 0.03), (m + 0.03, m + wide - 0.16)] {
                let rgb = [34.0, 38.0, 44.0].map(|c| (c + random.between(0.0, 14.0)) as u8);
                builder.tinted(Material::Glass, rgb);
                pane(builder, [from, to], [low + 0.06, top - 0.06], 0.024);
            }
            look.tiles().apply(builder);
            let top = foot + high;
            let ends = [0.1 * y, front + 0.18];
            prism(builder, [m - wide - 0.18, m + wide + 0.18], ends, top, top + rise);
        }
    }

    /// Adds windows that lie in the covering.
    pub(super) fn skylights(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let x = self.half[0];
        let count = 1 + random.remainder(3) as u32;
        for side in [1.0, -1.0] {
            for light in 0..count {
                let m = -x + x * 2.0 * (light as f32 + 0.5) / count as f32;
                let up = [0.36, 0.36 + 1.15 / (self.half[1] * (1.0 + self.pitch))];
                builder.tinted(Material::Metal, [84, 86, 90]);
                self.sheet(builder, [m - 0.5, m + 0.5], up, side, 0.05);
                builder.tinted(Material::Glass, [44, 52, 60]);
                let up = [up[0] + 0.012, up[1] - 0.012];
                self.sheet(builder, [m - 0.42, m + 0.42], up, side, 0.065);
            }
        }
    }

    /// Adds solar panels on one slope.
    pub(super) fn solar(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let x = self.half[0] - 0.8;
        let side = if random.chance(0.5) { 1.0 } else { -1.0 };
        let count = ((x * 2.0 / 1.1) as u32).min(4 + random.remainder(5) as u32);
        let first = random.between(-x, (x - 1.1 * count as f32).max(-x));
        for panel in 0..count {
            let l = first + 1.1 * panel as f32;
            for up in [[0.52, 0.69], [0.71, 0.88]] {
                builder.tinted(Material::Glass, [22, 30, 58]);
                self.sheet(builder, [l, l + 1.04], up, side, 0.09);
            }
        }
    }

    /// Adds an antenna on the ridge.
    pub(super) fn antenna(&self, builder: &mut MeshBuilder, random: &mut RandomStream) {
        let foot = self.at(random.between(-0.8, 0.8) * self.half[0], 0.98, 1.0, -0.3);
        antenna(builder, foot, random.between(1.6, 2.6));
    }
}
