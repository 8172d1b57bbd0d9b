//! The parts of a car's body that distinguish models: lamps, grille, plates, additions.

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{
        cage::Surface,
        end::{End, OUT_M},
        fittings, lamp,
        number_plate::number_plate,
        profile::{Measure, Silhouette, Skin},
    },
    mesh_builder::MeshBuilder,
};

/// Head lamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lamps {
    /// Narrow lamps that wrap round the corner.
    Slim,
    /// Wide lamps that wrap round the corner.
    Wide,
    /// Tall lamps at the corners.
    Tall,
    /// One round lamp on each side.
    Round,
    /// Two round lamps on each side.
    Twin,
    /// One band across the whole front.
    Bar,
}

/// The part between the head lamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Grille {
    /// None.
    Bare,
    /// A low, wide opening.
    Wide,
    /// A frame from the edge of the bonnet to the bumper.
    Frame,
    /// Two openings side by side.
    Kidneys,
    /// Seven vertical slots.
    Slots,
    /// A chrome band from lamp to lamp.
    Chrome,
    /// A round badge on a plain front.
    Badge,
}

/// Tail lamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Tail {
    /// Lamps that wrap round the corner.
    Corner,
    /// One band across the whole tail.
    Bar,
    /// Upright lamps at the edges.
    Upright,
    /// Round lamps.
    Round,
}

/// An addition of some models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extra {
    Nothing,
    /// Rails along the roof.
    Rails,
    /// A rack on the roof with cases.
    Rack,
    /// A rear spoiler.
    Spoiler,
    /// A spare wheel on the tail.
    Spare,
    /// Two stripes of this colour over bonnet, roof and boot.
    Stripes([u8; 3]),
    /// An upper half of this colour.
    Roof([u8; 3]),
    /// A light bar, doors of this colour, and a push bumper.
    Police([u8; 3]),
    /// A sign on the roof.
    Taxi,
}

/// The greatest height of the upper edge of a head lamp, of UN Regulation No. 48, 6.2.4.2, and that of wide lamps between
/// their edges, about that of coaches. Metres.
const LAMP_TOP_M: f32 = 1.2;
const LAMP_HIGH_M: f32 = 0.22;
/// The height of the middle of roof rails over the roof. Metres.
const RAIL_LIFT_M: f32 = 0.032;
/// The radius of a badge, and the size of a letter of a model's name. Metres.
const BADGE_M: f32 = 0.042;
const LETTER_M: f32 = 0.03;

/// The trim of a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trim(pub(super) Lamps, pub(super) Grille, pub(super) Tail, pub(super) Extra);

impl Extra {
    /// The length that protrudes behind the tail. Metres.
    pub(super) fn trailing_m(self) -> f32 {
        if self == Extra::Spare { 0.18 } else { 0.0 }
    }

    /// The height that stands on the roof. Metres.
    pub(super) fn roof_load_m(self) -> f32 {
        match self {
            Extra::Police(_) => 0.12,
            Extra::Taxi => 0.14,
            Extra::Rack => 0.16,
            Extra::Rails => 0.04,
            _ => 0.0,
        }
    }
}

/// Adds everything but mirrors and handles.
pub(super) fn fit(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    trim: &Trim,
    surface: &Surface,
) {
    front(builder, shape, measure, trim, surface);
    rear(builder, shape, measure, trim, surface);
    extra(builder, shape, measure, trim.3, surface);
}

/// Adds the front end only.
pub(super) fn front(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    Trim(lamps, grille, ..): &Trim,
    surface: &Surface,
) {
    let end = End { shape, measure, is_front: true, surface };
    let (height, half) = (measure.size_m.z, measure.body_m * 0.5);
    let top = (shape.top(0.02) * height - 0.03).min(LAMP_TOP_M);
    let low = end.low();
    let tall = top - low;
    let (from, to) = match lamps {
        Lamps::Slim => (top - tall * 0.27, top - 0.01),
        Lamps::Wide => (top - 0.03 - (tall * 0.36 - 0.03).min(LAMP_HIGH_M), top - 0.03),
        Lamps::Tall => (top - tall * 0.52, top - 0.01),
        Lamps::Bar => (top - 0.055, top - 0.015),
        Lamps::Round | Lamps::Twin => (top - tall * 0.40, top - 0.03),
    };
    let middle = (from + to) * 0.5;
    for (side, indicator) in [(1.0, Material::IndicatorLeft), (-1.0, Material::IndicatorRight)] {
        match lamps {
            Lamps::Slim | Lamps::Wide | Lamps::Tall => {
                let inner = if *lamps == Lamps::Tall { 0.62 } else { 0.48 };
                lamp::cluster(builder, &end, side, inner, [from, to], indicator);
                fog_lamp(builder, &end, side, [0.74, low + tall * 0.12]);
                continue;
            }
            Lamps::Bar => {
                builder.material(Material::LampWhite);
                end.wrap(builder, side, [0.0, 0.84], [from, to]);
                builder.material(Material::LampHigh);
                end.wrap(builder, side, [0.60, 0.80], [from - 0.12, from - 0.05]);
                builder.material(indicator);
                end.wrap(builder, side, [0.84, 0.96], [from, to]);
            }
            Lamps::Round => {
                let radius = (tall * 0.20).clamp(0.08, 0.115);
                let axis = Vec3::X * end.forward();
                let lenses = [Material::LampWhite, Material::LampHigh];
                let at = seat(&end, side, [0.70, middle], radius);
                lamp::bowl(builder, at, axis, radius * 1.1, lenses);
                lamp::dome(builder, at, axis, radius * 1.1);
                builder.material(indicator);
                end.disc(builder, side, [0.72, middle - radius * 1.9], radius * 0.42, OUT_M);
            }
            Lamps::Twin => {
                let radius = (tall * 0.17).clamp(0.06, 0.09);
                for (u, lens) in [(0.82, Material::LampWhite), (0.60, Material::LampHigh)] {
                    let at = seat(&end, side, [u, middle], radius);
                    lamp::bowl(builder, at, Vec3::X * end.forward(), radius, [lens; 2]);
                    lamp::dome(builder, at, Vec3::X * end.forward(), radius);
                }
                builder.material(indicator);
                end.wrap(builder, side, [0.64, 0.84], [low + tall * 0.18, low + tall * 0.28]);
            }
        }
        fog_lamp(builder, &end, side, [0.76, low + tall * 0.12]);
    }
    let paint = if shape.is_angular { Material::Plastic } else { Material::CarPaint };
    let span = |builder: &mut MeshBuilder, half_width: f32, z: [f32; 2]| {
        end.plate(builder, half_width, z, 0.004)
    };
    match grille {
        Grille::Bare => {
            end.opening(builder, [half * 0.54, half * 0.60], [low, low + tall * 0.20], paint);
        }
        Grille::Wide => {
            let upper = [from + tall * 0.04, to - 0.02];
            end.opening(builder, [half * 0.42, half * 0.37], upper, paint);
            bars(builder, &end, half * 0.36, [upper[0] + 0.01, upper[1] - 0.01]);
            let lower = [low, low + tall * 0.28];
            end.opening(builder, [half * 0.52, half * 0.60], lower, paint);
            bars(builder, &end, half * 0.50, [lower[0] + 0.02, lower[1] - 0.02]);
        }
        Grille::Frame => {
            let upper = [low + tall * 0.42, top - 0.03];
            end.opening(builder, [half * 0.38, half * 0.31], upper, Material::Metal);
            bars(builder, &end, half * 0.29, [upper[0] + 0.02, upper[1] - 0.015]);
            end.opening(builder, [half * 0.54, half * 0.62], [low, low + tall * 0.22], paint);
        }
        Grille::Kidneys => {
            for y in [half * 0.14, -half * 0.14] {
                let ([x, _], _) = end.place(0.0);
                for (grow, out, material) in
                    [(1.0, 0.005, Material::Metal), (0.8, 0.008, Material::Plastic)]
                {
                    builder.material(material);
                    builder.block(
                        vec3(x - 0.05, y - half * 0.11 * grow, middle - tall * 0.14 * grow),
                        vec3(x + out, y + half * 0.11 * grow, middle + tall * 0.14 * grow),
                    );
                }
            }
            end.opening(builder, [half * 0.54, half * 0.60], [low, low + tall * 0.24], paint);
        }
        Grille::Slots => {
            builder.material(Material::Plastic);
            let ([x, _], _) = end.place(0.0);
            for slot in 0..7 {
                let y = half * (-0.36 + 0.12 * slot as f32);
                let line = |step: u32| -> Option<Vec<(Vec3, Vec3)>> {
                    let y = y + half * 0.035 * (step as f32 - 1.0);
                    let z = |row: u32| middle + tall * (-0.24 + 0.42 * row as f32 / 3.0);
                    (0..4).map(|row| end.ahead(y, z(row))).collect()
                };
                if let Some(grid) = (0..3).map(line).collect::<Option<Vec<_>>>() {
                    end.shell(builder, &grid, 0.004);
                    continue;
                }
                builder.block(
                    vec3(x - 0.03, y - half * 0.035, middle - tall * 0.24),
                    vec3(x + 0.004, y + half * 0.035, middle + tall * 0.22),
                );
            }
            // A separate bumper.
            builder.block(
                vec3(x - 0.06, -half * 0.90, low - 0.03),
                vec3(x + 0.006, half * 0.90, low + 0.13),
            );
        }
        Grille::Chrome => {
            builder.material(Material::Metal);
            span(builder, half * 0.50, [from, to]);
            builder.material(Material::Plastic);
            for bar in 0..4 {
                let z = from + (to - from) * (0.10 + 0.22 * bar as f32);
                end.plate(builder, half * 0.48, [z, z + (to - from) * 0.12], 0.006);
            }
            builder.material(Material::Metal);
            for side in [1.0, -1.0] {
                end.wrap(builder, side, [0.0, 0.97], [low + tall * 0.02, low + tall * 0.17]);
            }
        }
        Grille::Badge => {
            builder.material(Material::Metal);
            end.disc(builder, 1.0, [0.0, middle + 0.05], 0.14, OUT_M);
            for side in [1.0, -1.0] {
                end.wrap(builder, side, [0.0, 0.97], [low - 0.02, low + 0.10]);
            }
        }
    }
    let has_bonnet = shape.cowl().is_some_and(|(cowl, _)| cowl > 0.05);
    let has_place = matches!(grille, Grille::Bare | Grille::Wide | Grille::Frame | Grille::Kidneys);
    if has_bonnet && has_place && !shape.is_angular {
        badge(builder, &end, top - 0.02);
    }
    number_plate(builder, &end, low + tall * 0.17);
}

/// The place of a round lamp that faces ahead: at the foremost of its middle and its upper and lower edge, so that the
/// edge of the bonnet does not cover it.
fn seat(end: &End, side: f32, [u, z]: [f32; 2], radius: f32) -> Vec3 {
    let at = [0.0, radius, -radius].map(|dz| end.spot(side, [u, z + dz]));
    let ahead = at.map(|at| at.x * end.forward()).into_iter().fold(f32::MIN, f32::max);
    at[0].with_x(ahead * end.forward())
}

/// Adds a fog lamp in a dark recess, at a fraction of the half width on one side and at a height.
fn fog_lamp(builder: &mut MeshBuilder, end: &End, side: f32, [u, z]: [f32; 2]) {
    let Some((at, normal)) = end.ahead(u * end.measure.body_m * 0.5 * side, z) else {
        builder.material(Material::LampFog);
        return end.disc(builder, side, [u, z], 0.036, OUT_M);
    };
    // Both discs follow the body, which is round here.
    for (material, radius, out) in
        [(Material::Plastic, 0.062, OUT_M * 0.5), (Material::LampFog, 0.036, OUT_M)]
    {
        builder.material(material);
        if material == Material::Plastic {
            builder.tinted(material, [12, 12, 13]);
        }
        builder.cone(at - normal * 0.05, at + normal * out, [radius, radius * 0.92], 14);
    }
}

/// Adds a maker's badge in the middle of an end, on a body from a cage.
fn badge(builder: &mut MeshBuilder, end: &End, z: f32) {
    if let Some((at, normal)) = end.ahead(0.0, z) {
        for (material, rgb, radius, out) in [
            (Material::Metal, [176, 178, 180], BADGE_M, 0.005),
            (Material::Metal, [96, 99, 104], BADGE_M * 0.72, 0.007),
        ] {
            builder.tinted(material, rgb);
            builder.cone(at - normal * 0.02, at + normal * out, [radius, radius * 0.94], 14);
        }
    }
}

/// Adds the name of a model: a row of six plates as large as letters.
fn lettering(builder: &mut MeshBuilder, end: &End, z: f32) {
    builder.tinted(Material::Metal, [150, 152, 154]);
    let across = -Vec3::Y * end.forward() * LETTER_M * 0.5;
    for letter in 0..6 {
        let y = (letter as f32 - 2.5) * LETTER_M * 1.7;
        let Some((at, normal)) = end.ahead(y, z) else { continue };
        let (at, up) = (at + normal * 0.003, across.cross(normal).normalize_or_zero());
        let up = up.with_y(0.0) * (up.z.signum() * LETTER_M * 0.5);
        builder.quad([at + across - up, at - across - up, at - across + up, at + across + up]);
    }
}

/// Adds the bars of a grille, across an opening.
fn bars(builder: &mut MeshBuilder, end: &End, half: f32, z: [f32; 2]) {
    builder.tinted(Material::Plastic, [40, 41, 44]);
    let count = ((z[1] - z[0]) / 0.032).floor().clamp(1.0, 8.0) as u32;
    for bar in 0..count {
        let middle = z[0] + (z[1] - z[0]) * (bar as f32 + 0.5) / count as f32;
        let along = |step: u32| end.ahead(half * (step as f32 / 2.0 - 1.0), middle);
        match (0..=4).map(along).collect::<Option<Vec<_>>>() {
            Some(line) => {
                let edge =
                    |(at, normal): &(Vec3, Vec3), z: f32| *at + *normal * 0.012 + Vec3::Z * z;
                for pair in line.windows(2) {
                    let [a, b] = [0.007, -0.007].map(|z| [edge(&pair[0], z), edge(&pair[1], z)]);
                    let corners = [a[0], a[1], b[1], b[0]];
                    let front = (a[1] - a[0]).cross(b[0] - a[0]).x * end.forward() > 0.0;
                    builder.quad(if front { corners } else { [a[1], a[0], b[0], b[1]] });
                }
            }
            None => end.plate(builder, half, [middle - 0.006, middle + 0.006], 0.012),
        }
    }
}

fn rear(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    Trim(_, _, tail, _): &Trim,
    surface: &Surface,
) {
    let end = End { shape, measure, is_front: false, surface };
    let (height, half) = (measure.size_m.z, measure.body_m * 0.5);
    // Lamps of a van do not follow its roof.
    let top = if shape.has_tall_tail() { shape.belt(0.990) + 0.06 } else { shape.top(0.990) };
    let top = top * height - 0.05;
    let low = end.low();
    let tall = (top - low).min(0.75);
    let upright = *tail == Tail::Upright;
    for (side, indicator) in [(1.0, Material::IndicatorLeft), (-1.0, Material::IndicatorRight)] {
        match tail {
            Tail::Corner => {
                let (from, to) = (top - tall * 0.34, top - 0.02);
                let cut = from + (to - from) * 0.30;
                lamp::ribs(builder, &end, side, [0.52, 0.965], [cut, to], Material::LampRed);
                lamp::ribs(builder, &end, side, [0.70, 0.965], [from, cut], indicator);
                lamp::ribs(builder, &end, side, [0.52, 0.69], [from, cut], Material::LampReverse);
            }
            Tail::Bar => {
                // On flat sheets a narrow band below the edge.
                let deep = if shape.is_angular { 0.075 } else { tall * 0.20 };
                let (from, to) = (top - deep, top - 0.03);
                lamp::ribs(builder, &end, side, [0.0, 0.80], [from, to], Material::LampRed);
                lamp::ribs(builder, &end, side, [0.80, 0.965], [from, to], indicator);
                builder.material(Material::LampReverse);
                let high = if shape.is_angular { low + 0.16 } else { from - 0.01 };
                end.wrap(builder, side, [0.42, 0.56], [high - 0.06, high]);
            }
            Tail::Upright => {
                let (from, to) = (top - tall * 0.72, top - 0.04);
                let at = |fraction: f32| from + (to - from) * fraction;
                for (material, z) in [
                    (Material::LampReverse, [at(0.0), at(0.22)]),
                    (indicator, [at(0.22), at(0.48)]),
                    (Material::LampRed, [at(0.48), to]),
                ] {
                    lamp::ribs(builder, &end, side, [0.80, 0.965], z, material);
                }
            }
            Tail::Round => {
                let z = top - tall * 0.24;
                let radius = (tall * 0.13).clamp(0.055, 0.085);
                let axis = Vec3::X * end.forward();
                let at = end.spot(side, [0.74, z]);
                lamp::bowl(builder, at, axis, radius, [Material::LampRed; 2]);
                builder.material(indicator);
                end.disc(builder, side, [0.74, z - radius * 2.1], radius * 0.8, OUT_M);
                builder.material(Material::LampReverse);
                end.disc(builder, side, [0.54, z], radius * 0.7, OUT_M);
            }
        }
        builder.tinted(Material::LampFog, [120, 20, 18]);
        end.wrap(builder, side, [0.55, 0.66], [low + 0.02, low + 0.06]);
    }
    if !shape.has_tall_tail() && !shape.is_angular {
        let is_bar = *tail == Tail::Bar;
        if !is_bar {
            badge(builder, &end, top - tall * 0.17);
        }
        lettering(builder, &end, top - if is_bar { tall * 0.27 } else { tall * 0.17 + 0.085 });
    }
    let valance = [low, low + tall * 0.20];
    // Openings of an unpainted bumper have an unpainted rim.
    let rim = if shape.is_angular { Material::Plastic } else { Material::CarPaint };
    end.opening(builder, [half * 0.60, half * 0.68], valance, rim);
    // That of flat sheets is in their unpainted bumper.
    let share = if shape.is_angular {
        0.10
    } else if upright {
        0.24
    } else {
        0.34
    };
    let z = low + tall * share;
    number_plate(builder, &end, z);
    if shape.is_angular || upright {
        return;
    }
    // Tail pipes end in the dark panel between the bumper and the ground.
    for side in [1.0, -1.0] {
        let at = end.spot(side, [0.46, low + tall * 0.08]);
        let out = Vec3::X * end.forward();
        builder.material(Material::Metal);
        builder.rod(at - out * 0.12, at + out * 0.010, 0.034, 10);
        builder.tinted(Material::Rubber, [6, 6, 6]);
        builder.rod(at, at + out * 0.012, 0.027, 10);
    }
}

fn extra(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    extra: Extra,
    surface: &Surface,
) {
    let (length, height) = (measure.size_m.x, measure.size_m.z);
    let half = measure.body_m * 0.5;
    let (roof_from, roof_to) = (shape.windows.0 + 0.10, shape.windows.1 - 0.06);
    let roof = half * shape.roof;
    match extra {
        Extra::Nothing | Extra::Roof(_) => {}
        Extra::Rails => {
            builder.material(Material::Metal);
            for y in [roof * 0.80, -roof * 0.80] {
                // They follow the roof, which is lower at its sides than in its middle.
                let point = |step: u32| {
                    let fraction = roof_from + (roof_to - roof_from) * step as f32 / 6.0;
                    let from = vec3(measure.at(fraction), y, 0.3);
                    let lift = if step == 0 || step == 6 { -0.03 } else { RAIL_LIFT_M };
                    surface.cast(from, Vec3::Z).map(|(at, _)| at + Vec3::Z * lift)
                };
                let points: Vec<Vec3> = (0..=6).filter_map(point).collect();
                builder.pipe(&points, 0.017, 6);
            }
        }
        Extra::Rack => {
            builder.material(Material::Metal);
            let z = height + 0.05;
            for y in [roof * 0.8, -roof * 0.8] {
                builder.rod(
                    vec3(measure.at(roof_from), y, z),
                    vec3(measure.at(roof_to), y, z),
                    0.015,
                    6,
                );
            }
            for bar in 0..6 {
                let x = measure.at(roof_from + (roof_to - roof_from) * bar as f32 / 5.0);
                builder.rod(vec3(x, -roof * 0.85, z), vec3(x, roof * 0.85, z), 0.012, 5);
                builder.rod(vec3(x, roof * 0.8, height - 0.04), vec3(x, roof * 0.8, z), 0.012, 5);
                builder.rod(vec3(x, -roof * 0.8, height - 0.04), vec3(x, -roof * 0.8, z), 0.012, 5);
            }
            let x = measure.at((roof_from + roof_to) * 0.5);
            builder.tinted(Material::Cloth, [110, 74, 50]);
            builder.block(vec3(x - 0.2, -roof * 0.6, z), vec3(x + 0.4, roof * 0.2, z + 0.11));
        }
        Extra::Spoiler => {
            builder.material(Material::CarPaint);
            let pane = shape.top.iter().rev().find(|point| point.2 == Skin::Pane);
            if let Some(pane) = pane {
                // A lip at the end of the roof that continues the roof and follows its curve.
                let x = measure.at(pane.0) + 0.06;
                let ring = |step: i32| -> Option<Vec<Vec3>> {
                    let t = step as f32 / 4.0 - 1.0;
                    let (at, _) = surface.cast(vec3(x, half * 0.56 * t, 0.3), Vec3::Z)?;
                    let long = 0.19 * (1.0 - 0.35 * t.powi(4));
                    let section = [(0.0, 0.004), (-long, -0.004), (-long, -0.018), (0.0, -0.045)];
                    Some(section.map(|(dx, dz)| at + vec3(dx, 0.0, dz)).to_vec())
                };
                let Some(rings) = (0..=8).map(ring).collect::<Option<Vec<_>>>() else { return };
                builder.solid(|builder| builder.loft(&rings, |_, _| None));
            }
        }
        Extra::Spare => {
            let (x, z) = (measure.nose_m - length, height * 0.50);
            builder.material(Material::Rubber);
            let foot = vec3(x + 0.04, 0.0, z);
            builder.cone(foot, foot - Vec3::X * 0.20, [0.34, 0.36], 20);
            builder.material(Material::Metal);
            builder.cone(foot - Vec3::X * 0.10, foot - Vec3::X * 0.22, [0.24, 0.20], 14);
        }
        Extra::Stripes(rgb) => {
            builder.tinted(Material::Plastic, rgb);
            for y in [half * 0.22, -half * 0.22] {
                let mut before: Option<(Vec3, Vec3)> = None;
                for step in 0..=40 {
                    let fraction = 0.03 + 0.94 * step as f32 / 40.0;
                    let is_glass = shape.top.windows(2).any(|pair| {
                        pair[0].2 == Skin::Pane && fraction > pair[0].0 && fraction < pair[1].0
                    });
                    let x = measure.at(fraction);
                    let at = |y: f32| {
                        let hit = surface.cast(vec3(x, y, 0.3), Vec3::Z);
                        let z = hit.map_or(shape.top(fraction) * height, |(at, _)| at.z);
                        vec3(x, y, z + 0.004)
                    };
                    let here = (at(y + half * 0.10), at(y - half * 0.10));
                    if let Some(last) = before.filter(|_| !is_glass) {
                        builder.quad([here.0, here.1, last.1, last.0]);
                    }
                    before = (!is_glass).then_some(here);
                }
            }
        }
        Extra::Police(_) => {
            let center = vec3(measure.at(0.50), 0.0, height + extra.roof_load_m());
            fittings::beacons(builder, center, 0.55, extra.roof_load_m() + 0.02);
            builder.material(Material::Metal);
            let x = measure.nose_m;
            let top = shape.top(0.01) * height;
            for y in [0.30, -0.30] {
                builder.block(
                    vec3(x - 0.05, y - 0.03, shape.clearance_m + 0.05),
                    vec3(x, y + 0.03, top),
                );
            }
            builder.rod(
                vec3(x - 0.025, -0.36, top - 0.05),
                vec3(x - 0.025, 0.36, top - 0.05),
                0.025,
                8,
            );
        }
        Extra::Taxi => {
            let center = vec3(measure.at(0.50), 0.0, height + extra.roof_load_m());
            fittings::taxi_sign(builder, center, extra.roof_load_m() + 0.02);
        }
    }
}
