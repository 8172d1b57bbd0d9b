//! Litter on sidewalks and in gutters, grass along edges, and gully grates beside kerbs.
//!
//! None of it is solid: vehicles and walkers pass over it.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        density::Density,
        frontage::{Frontage, STEP_M, Station},
        plan::Plan,
        raster::ground,
        scene::{ObjectProperties, Place, Scene},
    },
    mesh_builder::MeshBuilder,
    static_world::{Detail, Layer},
};

/// The probability of litter at a station of a dense street.
const LITTER: f32 = 0.16;
/// The distance between gully grates. Metres.
const GULLY_M: f32 = 26.0;
/// The probability of grass at a station without a paved neighbour.
const GRASS: f32 = 0.12;

/// Adds everything along all frontages; nothing in low detail.
pub(super) fn strew(plan: &Plan, scene: &mut Scene, frontages: &[Frontage], density: &Density) {
    if plan.detail == Detail::Low {
        return;
    }
    for (number, frontage) in frontages.iter().enumerate() {
        let mut random = RandomStream::named(plan.seed, 0x117e + number as u64 * 16);
        let mut next_gully = random.between(6.0, GULLY_M);
        for (step, station) in frontage.iter().enumerate() {
            if station.walk_m < 1.0 {
                continue;
            }
            let along = step as f32 * STEP_M;
            if along > next_gully {
                next_gully = along + GULLY_M;
                gully(plan, scene, station);
            }
            if random.chance(LITTER * density.at(station.edge)) {
                litter(plan, scene, station, &mut random);
            }
            let verge = station.edge + station.out * 0.35;
            let free = plan.raster.at(verge) & (ground::ANY | ground::PAVED) == 0;
            if free && random.chance(GRASS) {
                grass(plan, scene, station, &mut random);
            }
        }
    }
}

/// Adds a grate in the gutter before the kerb.
fn gully(plan: &Plan, scene: &mut Scene, station: &Station) {
    let at = station.edge - station.out * (station.walk_m + 0.28);
    if plan.raster.at(at) & ground::CARRIAGEWAY == 0 {
        return;
    }
    let properties =
        ObjectProperties { tag: Tag::Static, layer: Layer::Props, color: [70, 70, 72] };
    let place = Place { foot: plan.foot(at), yaw_rad: station.out.perp().to_angle() };
    scene.add(properties, place, |builder| {
        let sheet = |builder: &mut MeshBuilder, [l, r]: [f32; 2], [b, t]: [f32; 2], z: f32| {
            builder.quad([vec3(l, b, z), vec3(r, b, z), vec3(r, t, z), vec3(l, t, z)]);
        };
        // Rusty iron is as dull as stone.
        builder.tinted(Material::Concrete, [74, 70, 66]);
        sheet(builder, [-0.26, 0.26], [-0.17, 0.17], 0.004);
        builder.tinted(Material::Plastic, [14, 14, 15]);
        for slot in 0..6 {
            let x = -0.21 + 0.072 * slot as f32;
            sheet(builder, [x, x + 0.036], [-0.13, 0.13], 0.006);
        }
    });
}

/// Adds some litter: paper, leaves, a bottle or a can.
fn litter(plan: &Plan, scene: &mut Scene, station: &Station, random: &mut RandomStream) {
    // It gathers at walls and in the gutter.
    let from_edge = match random.unit() {
        dice if dice < 0.45 => random.between(0.05, 0.4),
        dice if dice < 0.65 => random.between(0.4, station.walk_m - 0.3),
        _ => station.walk_m + random.between(0.12, 0.4),
    };
    let at = station.edge - station.out * from_edge
        + station.out.perp() * random.between(-0.5, 0.5) * STEP_M;
    if plan.raster.at(at) & (ground::CARRIAGEWAY | ground::WALK) == 0
        || plan.raster.at(at) & (ground::FURNITURE | ground::BUILT) != 0
    {
        return;
    }
    let properties =
        ObjectProperties { tag: Tag::Static, layer: Layer::Props, color: [150, 146, 138] };
    let place = Place { foot: plan.foot(at), yaw_rad: random.between(0.0, TAU) };
    let dice = random.unit();
    let mut inside = RandomStream::named(random.bits(), 0x117);
    scene.add(properties, place, |builder| match dice {
        _ if dice < 0.4 => fallen_leaves(builder, &mut inside),
        _ if dice < 0.75 => paper(builder, &mut inside),
        _ if dice < 0.9 => bottle(builder, &mut inside),
        _ => can(builder, &mut inside),
    });
}

fn fallen_leaves(builder: &mut MeshBuilder, random: &mut RandomStream) {
    const HUES: [[u8; 3]; 4] = [[132, 96, 46], [104, 74, 40], [150, 122, 56], [96, 92, 48]];
    for _ in 0..10 + random.remainder(14) {
        let at = Vec2::from_angle(random.between(0.0, TAU)) * random.unit() * 0.5;
        let along = Vec2::from_angle(random.between(0.0, TAU)) * random.between(0.02, 0.05);
        let aside = along.perp() * 0.65;
        builder.tinted(Material::Leaves, *random.pick(&HUES));
        let mut point = |p: Vec2| (at + p).extend(0.005 + 0.02 * random.unit());
        let corners = [-along, -aside, along, aside].map(&mut point);
        builder.quad(corners);
    }
}

fn paper(builder: &mut MeshBuilder, random: &mut RandomStream) {
    const HUES: [[u8; 3]; 4] = [[206, 202, 190], [188, 178, 156], [196, 84, 70], [96, 130, 166]];
    for _ in 0..1 + random.remainder(3) {
        let at = Vec2::from_angle(random.between(0.0, TAU)) * random.unit() * 0.35;
        let turn = Vec2::from_angle(random.between(0.0, TAU));
        let size = vec2(random.between(0.05, 0.14), random.between(0.04, 0.1));
        builder.tinted(Material::Cloth, *random.pick(&HUES));
        let mut point = |x: f32, y: f32, z: f32| {
            let p = turn.rotate(vec2(x, y) * size) + at;
            builder.vertex(p.extend(z))
        };
        // A sheet with a fold.
        let (rise, lift) = (random.between(0.01, 0.05), random.between(0.004, 0.04));
        let [a, b] = [point(-1.0, -1.0, 0.004), point(-1.0, 1.0, lift)];
        let [c, d] = [point(0.1, 1.0, rise), point(-0.1, -1.0, rise)];
        let [e, f] = [point(1.0, 1.0, 0.004), point(1.0, -1.0, lift)];
        for corners in [[a, d, c], [a, c, b], [d, f, e], [d, e, c]] {
            builder.triangle(corners);
        }
    }
}

fn bottle(builder: &mut MeshBuilder, random: &mut RandomStream) {
    let hue = *random.pick(&[[40, 74, 44], [70, 50, 28], [128, 142, 140]]);
    builder.tinted(Material::Glass, hue);
    let radius = 0.034;
    let at = |x: f32| vec3(x, 0.0, radius);
    builder.rod(at(-0.12), at(0.05), radius, 8);
    builder.cone(at(0.05), at(0.09), [radius, 0.014], 8);
    builder.rod(at(0.09), at(0.14), 0.014, 6);
}

fn can(builder: &mut MeshBuilder, random: &mut RandomStream) {
    let hue = *random.pick(&[[176, 34, 38], [44, 82, 150], [170, 172, 174]]);
    builder.tinted(Material::Metal, hue);
    let (radius, half) = (0.033, Vec3::X * 0.055);
    builder.rod(Vec3::Z * radius - half, Vec3::Z * radius + half, radius, 8);
}

/// Adds a tuft of grass beside the edge of a sidewalk.
fn grass(plan: &Plan, scene: &mut Scene, station: &Station, random: &mut RandomStream) {
    let at = station.edge
        + station.out * random.between(0.12, 0.3)
        + station.out.perp() * random.between(-0.6, 0.6);
    let properties =
        ObjectProperties { tag: Tag::Vegetation, layer: Layer::Foliage, color: [90, 120, 56] };
    let place = Place { foot: plan.foot(at), yaw_rad: station.out.perp().to_angle() };
    let mut inside = RandomStream::named(random.bits(), 0x67a5);
    scene.add(properties, place, |builder| {
        for _ in 0..36 {
            let foot = vec3(inside.between(-1.3, 1.3), inside.between(-0.14, 0.14), -0.02);
            let high = 0.06 + 0.2 * inside.unit() * inside.unit();
            let lean = Vec2::from_angle(inside.between(0.0, TAU)) * high * inside.between(0.1, 0.6);
            let side = Vec2::from_angle(inside.between(0.0, TAU)).extend(0.0) * 0.008;
            let bright = inside.between(0.75, 1.2);
            builder.tinted(Material::Leaves, [92.0, 122.0, 52.0].map(|c| (c * bright) as u8));
            let [a, b, c] = [foot - side, foot + side, foot + lean.extend(high + 0.02)]
                .map(|point| builder.vertex(point));
            builder.triangle([a, b, c]);
        }
    });
}
