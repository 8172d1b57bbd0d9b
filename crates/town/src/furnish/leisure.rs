//! The ground between and behind houses: playgrounds, picnic lawns, car parks, gardens.

use std::f32::consts::TAU;

use glam::{Vec2, vec2};
use mesh::{Material, RandomStream};

use super::{
    building::Style,
    density::Density,
    lots::Garden,
    parked::{self, slab},
    plan::Plan,
    prop::place_prop,
    raster::{ground, rectangle},
    scene::Scene,
};

/// The density from which on there are playgrounds.
const LIVED_IN: f32 = 0.22;

/// The distance between the places that are examined. Metres.
const PITCH_M: f32 = 46.0;

/// Adds a car park, a playground or a picnic lawn where there is room between houses.
pub(super) fn parks(plan: &mut Plan, scene: &mut Scene, density: &Density) {
    let (low, high) = plan.town;
    let size = ((high - low) / PITCH_M).as_uvec2();
    for cell in 0..size.x * size.y {
        let mut random = RandomStream::named(plan.seed, 0x9a4c + u64::from(cell) * 16);
        let corner = vec2((cell % size.x) as f32, (cell / size.x) as f32);
        let at = low + (corner + vec2(random.unit(), random.unit())) * PITCH_M;
        let yaw = random.between(0.0, TAU);
        let has_room =
            |half: Vec2| plan.raster.is_free(&rectangle(at, half + 2.0, yaw), ground::ANY);
        let half = vec2(7.0, 5.0);
        if density.at(at) < LIVED_IN || !has_room(half) {
            continue;
        }
        if random.chance(0.5) && has_room(parked::LOT_M) {
            parked::lot(plan, scene, at, yaw, &mut random);
        } else if random.chance(0.5) {
            playground(plan, scene, at, yaw, half);
        } else {
            picnic(plan, scene, at, yaw, &mut random);
        }
    }
}

fn playground(plan: &mut Plan, scene: &mut Scene, at: Vec2, yaw: f32, half: Vec2) {
    slab(plan, scene, at, half, yaw, Material::Soil);
    let things = [
        ("static.prop.swing", vec2(-3.5, 1.5), 0.0),
        ("static.prop.slide", vec2(3.2, 1.0), 0.6),
        ("static.prop.trampoline", vec2(0.2, -2.2), 0.0),
        ("static.prop.bench01", vec2(-4.0, 6.2), -TAU / 4.0),
        ("static.prop.bench02", vec2(3.0, 6.2), -TAU / 4.0),
        ("static.prop.bin", vec2(0.0, 6.2), 0.0),
    ];
    arrange(plan, scene, at, yaw, &things);
}

fn picnic(plan: &mut Plan, scene: &mut Scene, at: Vec2, yaw: f32, random: &mut RandomStream) {
    let things = [
        ("static.prop.table", vec2(0.0, 0.0), 0.2),
        ("static.prop.plastictable", vec2(4.0, 1.5), 0.9),
        ("static.prop.plasticchair", vec2(4.0, 2.7), -1.4),
        ("static.prop.plasticchair", vec2(5.2, 1.2), 2.8),
        ("static.prop.barbeque", vec2(-2.5, 2.5), 1.0),
        ("static.prop.bench03", vec2(-4.5, -1.0), 0.4),
        ("static.prop.trashcan01", vec2(-4.5, 1.0), 0.0),
        ("static.prop.fountain", vec2(0.5, -5.5), 0.0),
    ];
    let some = if random.chance(0.4) { things.len() } else { things.len() - 1 };
    arrange(plan, scene, at, yaw, &things[..some]);
}

/// Adds the objects behind houses.
pub(super) fn backyards(plan: &mut Plan, scene: &mut Scene, gardens: &[Garden]) {
    const THINGS: [&str; 10] = [
        "static.prop.doghouse",
        "static.prop.gnome",
        "static.prop.clothesline",
        "static.prop.barbeque",
        "static.prop.plastictable",
        "static.prop.plasticchair",
        "static.prop.trampoline",
        "static.prop.swingcouch",
        "static.prop.pergola",
        "static.prop.plantpot04",
    ];
    let homes = |one: &Garden| matches!(one.style, Style::Villa | Style::Terrace);
    for (number, garden) in gardens.iter().enumerate().filter(|(_, one)| homes(one)) {
        let mut random = RandomStream::named(plan.seed, 0xbac4 + number as u64 * 16);
        for _ in 0..2 {
            let id: &str = random.pick::<&str>(&THINGS);
            let at = garden.gate
                + garden.out * (garden.back_m + random.between(2.5, 7.0))
                + garden.out.perp() * random.between(-0.4, 0.4) * garden.width_m;
            place_prop(plan, scene, id, (at, random.between(0.0, TAU)), ground::ANY);
        }
    }
}

/// Places objects at positions and bearings in a space about `at`.
fn arrange(plan: &mut Plan, scene: &mut Scene, at: Vec2, yaw: f32, things: &[(&str, Vec2, f32)]) {
    for (id, offset, turn) in things {
        let place = (at + Vec2::from_angle(yaw).rotate(*offset), yaw + turn);
        // The lawn was free, and objects may stand on it.
        place_prop(plan, scene, id, place, ground::ROAD | ground::BUILT | ground::CLEAR);
    }
}
