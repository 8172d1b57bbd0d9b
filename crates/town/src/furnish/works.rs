//! Construction sites: the ground round unfinished buildings, and excavated sidewalks.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec3, vec2, vec3};
use mesh::{Material, RandomStream, Tag};

use crate::{
    furnish::{
        building::Style,
        density::Density,
        frontage::Frontage,
        lots::Garden,
        plan::Plan,
        prop::place_prop,
        raster::{ground, rectangle},
        scene::{ObjectProperties, Place, Scene},
    },
    static_world::{Detail, Layer},
};

/// The length of a fence panel. Metres.
const PANEL_M: f32 = 2.4;
/// The least width of a sidewalk that is dug up. Metres.
const WIDE_WALK_M: f32 = 2.4;

/// Furnishes the ground in front of every unfinished building.
pub(super) fn sites(plan: &mut Plan, scene: &mut Scene, gardens: &[Garden]) {
    let sites = gardens.iter().enumerate().filter(|(_, one)| one.style == Style::Shell);
    for (number, garden) in sites {
        let mut random = RandomStream::named(plan.seed, 0x517e + number as u64 * 16);
        fence(plan, scene, garden, &mut random);
        let along = garden.out.perp();
        let yaw = along.to_angle();
        let things = [
            "static.prop.container",
            "static.prop.ironplank",
            "static.prop.barrel",
            "static.prop.barrel",
            "static.prop.dirtdebris01",
            "static.prop.warningconstruction",
        ];
        for id in things {
            for _ in 0..6 {
                let across = random.between(-0.45, 0.45) * garden.width_m;
                let at = garden.gate
                    + garden.out * random.between(1.6, garden.front_m - 1.6)
                    + along * across;
                if place_prop(plan, scene, id, (at, yaw), ground::ANY) {
                    break;
                }
            }
        }
    }
}

/// Adds a wire fence along the street, with an opening for lorries.
fn fence(plan: &mut Plan, scene: &mut Scene, garden: &Garden, random: &mut RandomStream) {
    let along = garden.out.perp();
    let count = (garden.width_m / PANEL_M) as u32;
    let gate = random.remainder(count.max(2) as usize - 1) as u32;
    for panel in (0..count).filter(|panel| *panel != gate && *panel != gate + 1) {
        let across = (panel as f32 + 0.5 - count as f32 * 0.5) * PANEL_M;
        let middle = garden.gate + garden.out * 0.7 + along * across;
        let yaw_rad = along.to_angle();
        let outline = rectangle(middle, vec2(PANEL_M * 0.48, 0.1), yaw_rad);
        if !plan.raster.is_free(&outline, ground::ANY & !ground::FURNITURE) {
            continue;
        }
        plan.raster.stamp(&outline, ground::FURNITURE);
        let place = Place { foot: plan.foot(middle), yaw_rad };
        let properties =
            ObjectProperties { tag: Tag::Fence, layer: Layer::Walls, color: [160, 164, 168] };
        let half = PANEL_M * 0.49;
        scene.add(properties, place, |builder| {
            builder.material(Material::Concrete);
            // Below the panel, so that those of neighbours do not overlap.
            for [low, high] in [[-half - 0.02, -half + 0.28], [half - 0.28, half + 0.02]] {
                builder.block(vec3(low, -0.3, -0.1), vec3(high, 0.3, 0.12));
            }
            builder.material(Material::Metal);
            for side in [-half, half] {
                builder.rod(vec3(side, 0.0, 0.1), vec3(side, 0.0, 2.0), 0.025, 5);
            }
            let bars = if plan.detail == Detail::Low { 2 } else { 6 };
            for bar in 0..bars {
                let z = 0.25 + 1.7 * bar as f32 / (bars - 1) as f32;
                builder.rod(vec3(-half, 0.0, z), vec3(half, 0.0, z), 0.008, 3);
            }
            let wires = if plan.detail == Detail::Low { 2 } else { 12 };
            for wire in 1..wires {
                let x = -half + 2.0 * half * wire as f32 / wires as f32;
                builder.rod(vec3(x, 0.0, 0.25), vec3(x, 0.0, 1.95), 0.006, 3);
            }
        });
        scene.solid(&place, vec3(-half, -0.1, -0.2), vec3(half, 0.1, 2.0));
    }
}

/// Digs up a sidewalk here and there; half of its width stays free for pedestrians.
pub(super) fn diggings(
    plan: &mut Plan,
    scene: &mut Scene,
    frontages: &[Frontage],
    density: &Density,
) {
    for (number, frontage) in frontages.iter().enumerate() {
        let mut random = RandomStream::named(plan.seed, 0xd16 + number as u64 * 16);
        for station in frontage.iter().skip(4).step_by(12) {
            let wanted = random.chance(0.045 * density.at(station.edge));
            if !wanted || station.walk_m < WIDE_WALK_M {
                continue;
            }
            let half = vec2(random.between(1.2, 2.4), (station.walk_m * 0.5 - 0.5).min(1.1) * 0.5);
            let center = station.edge - station.out * (half.y + 0.35);
            let along = station.out.perp();
            let yaw_rad = along.to_angle();
            let taken = ground::BESIDE;
            if !plan.raster.is_free(&rectangle(center, half + vec2(0.8, 0.1), yaw_rad), taken) {
                continue;
            }
            // Soil beside a trench, barriers at both ends, cones towards pedestrians.
            let foot = plan.foot(center);
            let properties =
                ObjectProperties { tag: Tag::Static, layer: Layer::Props, color: [90, 70, 50] };
            scene.add(properties, Place { foot, yaw_rad }, |builder| {
                builder.material(Material::Soil);
                builder.block(vec3(-half.x, -half.y, -0.1), vec3(half.x, half.y, 0.02));
                let heap = vec3(0.25 * half.x, 0.0, 0.0);
                builder.ball(heap, vec3(half.x * 0.6, half.y * 0.8, 0.5), 6, 12);
                builder.material(Material::Metal);
                let pipe = Vec3::Z * 0.08 + Vec3::Y * (half.y - 0.1);
                builder.rod(pipe - Vec3::X * half.x, pipe + Vec3::X * half.x * 0.6, 0.07, 8);
            });
            for (end, turn) in [(-1.0f32, PI), (1.0, 0.0)] {
                let at = center + along * end * (half.x + 0.45);
                place_prop(plan, scene, "static.prop.streetbarrier", (at, yaw_rad + turn), taken);
            }
            let count = (half.x * 2.0 / 1.2) as i32;
            for step in 0..=count {
                let across = -half.x + 2.0 * half.x * step as f32 / count.max(1) as f32;
                let at = center + along * across - station.out * (half.y + 0.2);
                let cone = "static.prop.constructioncone";
                place_prop(plan, scene, cone, (at, yaw_rad + FRAC_PI_2), taken);
            }
            plan.raster.stamp(&rectangle(center, half, yaw_rad), ground::FURNITURE);
        }
    }
}
