//! Poles for the signals and signs of the map, and the positions of lamp boxes.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3, vec3};
use mesh::{Material, Tag};
use road::Signal;

use crate::{
    furnish::{
        facade,
        plan::Plan,
        raster::{ground, square},
        scene::{ObjectProperties, Place, Scene},
    },
    mesh_builder::MeshBuilder,
    static_world::{Head, Layer},
};

/// The height of a lamp box's lower edge beside the road, and above it. Metres.
const HEAD_BESIDE_M: f32 = 2.6;
const HEAD_OVER_M: f32 = 5.0;
/// The height of a sign's lower edge where the map has none. Metres.
const PLATE_M: f32 = 2.0;

/// Adds poles and signs for all signals of the map.
pub(super) fn furnish(plan: &mut Plan, scene: &mut Scene) {
    let network = plan.network;
    for (number, signal) in network.signals().iter().enumerate() {
        let kind = signal.kind.as_str();
        // Stop lines and the like are painted and need no pole.
        let painted = signal.height_m < 0.05 && matches!(kind, "294" | "-1" | "1000003");
        if signal.dynamic {
            light(plan, scene, signal, number as u32);
        } else if !painted {
            sign(plan, scene, signal);
        }
    }
}

/// The position of the signal on the plan, and the bearing of its face.
fn pose_of(signal: &Signal) -> (Vec2, f32) {
    (signal.pose.position.truncate().as_vec2(), signal.pose.heading_rad as f32)
}

/// The nearest position for a pole: at the signal, or beside the ground above which the signal hangs and
/// which vehicles need.
fn pole_place(plan: &Plan, at: Vec2) -> Option<Vec2> {
    let taken = ground::CARRIAGEWAY | ground::BUILT | ground::SWEPT;
    let free = |point: Vec2| plan.raster.is_free(&square(point, 0.2), taken);
    if free(at) {
        return Some(at);
    }
    for ring in 1..40 {
        let radius = ring as f32 * 0.5;
        let count = 8 + ring * 2;
        for step in 0..count {
            let point = at + Vec2::from_angle(TAU * step as f32 / count as f32) * radius;
            if free(point) {
                return Some(point);
            }
        }
    }
    None
}

fn light(plan: &mut Plan, scene: &mut Scene, signal: &Signal, number: u32) {
    let (at, yaw_rad) = pose_of(signal);
    let pole = pole_place(plan, at);
    let gap = pole.map_or(f32::INFINITY, |pole| pole.distance(at));
    let low = match signal.z_offset_m as f32 {
        said if said > 1.8 => said,
        _ if gap > 0.6 => HEAD_OVER_M,
        _ => HEAD_BESIDE_M,
    };
    let base = signal.pose.position.z as f32 - signal.z_offset_m as f32;
    let ground = pole.map_or(base, |pole| plan.height(pole));
    // The box hangs in front of the pole, or of the arm above the road.
    let clear = Vec2::from_angle(yaw_rad) * 0.12;
    let head = (at + clear).extend(base.max(ground) + low);
    scene.head(Head { signal: number, position: head, yaw_rad });

    // Far from all edges the box hangs on a wire that is not modelled.
    let Some(pole) = pole else { return };
    let foot = pole.extend(ground);
    let beam = head.z - foot.z + 0.5;
    let arm = at - pole;
    let place = Place { foot, yaw_rad: if gap > 0.6 { arm.to_angle() } else { yaw_rad } };
    let properties = ObjectProperties { tag: Tag::Pole, layer: Layer::Props, color: [70, 74, 76] };
    scene.add(properties, place, |builder| {
        builder.material(Material::Metal);
        builder.cone(Vec3::Z * -0.5, Vec3::Z * 0.35, [0.16, 0.12], 8);
        builder.cone(Vec3::Z * 0.35, Vec3::Z * (beam + 0.5), [0.08, 0.06], 8);
        if gap > 0.6 {
            let start = Vec3::Z * beam;
            builder.cone(start, start + Vec3::X * (gap + 0.25), [0.07, 0.045], 8);
            builder.rod(start - Vec3::Z * 0.8, start + Vec3::X * (gap * 0.35), 0.03, 5);
        } else {
            // Brackets to the box.
            for z in [beam - 0.35, beam + 0.25] {
                builder.rod(Vec3::Z * z, vec3(0.14, 0.0, z), 0.025, 5);
            }
            builder.material(Material::Plastic);
            builder.block(vec3(0.05, -0.08, 1.0), vec3(0.17, 0.08, 1.3));
        }
    });
    scene.solid_post(&place, 0.14, beam + 0.5);
    plan.raster.stamp(&square(pole, 0.5), ground::FURNITURE);
}

fn sign(plan: &mut Plan, scene: &mut Scene, signal: &Signal) {
    let (at, yaw_rad) = pose_of(signal);
    let Some(pole) = pole_place(plan, at) else { return };
    if pole.distance(at) > 6.0 {
        return;
    }
    let foot = plan.foot(pole);
    let low = if signal.z_offset_m > 0.6 { signal.z_offset_m as f32 } else { PLATE_M };
    let size = [signal.width_m, signal.height_m].map(|size| (size as f32).clamp(0.4, 3.0));
    let half = [size[0] * 0.5, size[1] * 0.5];
    let center = Vec3::Z * (low + half[1]);
    let place = Place { foot, yaw_rad };
    let properties =
        ObjectProperties { tag: Tag::TrafficSign, layer: Layer::Props, color: [200, 30, 30] };
    scene.add(properties, place, |builder| {
        builder.paint(Tag::Pole, Material::Metal);
        builder.rod(Vec3::Z * -0.5, Vec3::Z * (low + size[1] * 0.9), 0.035, 6);
        builder.paint(Tag::TrafficSign, Material::Sign);
        plate(builder, signal, center, half);
    });
    scene.solid_post(&place, 0.05, low + size[1]);
    plan.raster.stamp(&square(pole, 0.5), ground::FURNITURE);
}

/// Adds a plate facing along x, in the shape of the sign's type.
fn plate(builder: &mut MeshBuilder, signal: &Signal, center: Vec3, [half_y, half_z]: [f32; 2]) {
    let kind = signal.kind.as_str();
    let disc = half_y.min(half_z).clamp(0.3, 0.5);
    // (corners, angle of the first one, radius, border)
    let (corners, first, radius, border) = match kind {
        "206" => (8, FRAC_PI_2 * 0.25, disc, Some(Material::LampRed)),
        "205" => (3, -FRAC_PI_2, disc * 1.15, Some(Material::LampRed)),
        "101" | "102" | "103" | "105" | "123" | "133" | "138" => {
            (3, FRAC_PI_2, disc * 1.15, Some(Material::LampRed))
        }
        "306" => (4, FRAC_PI_2, disc, Some(Material::LampAmber)),
        "274" | "267" | "250" | "260" | "276" | "283" => (20, 0.0, disc, Some(Material::LampRed)),
        "278" | "282" | "209" | "222" => (20, 0.0, disc, None),
        _ => {
            builder
                .block(center + vec3(0.04, -half_y, -half_z), center + vec3(0.07, half_y, half_z));
            return;
        }
    };
    let ring = |radius: f32, x: f32| -> Vec<Vec3> {
        (0..corners)
            .map(|corner| {
                let angle = first + TAU * corner as f32 / corners as f32;
                center + vec3(x, angle.cos() * radius, angle.sin() * radius)
            })
            .collect()
    };
    let inner = if kind == "206" || border.is_none() { radius } else { radius * 0.78 };
    builder.material(Material::Metal);
    builder.loft(&[ring(radius, 0.035), ring(radius, 0.05)], |_, _| None);
    builder.material(border.unwrap_or(Material::Sign));
    builder.loft(&[ring(radius, 0.05), ring(radius, 0.055)], |_, _| None);
    if kind == "206" {
        builder.material(Material::Sign);
        builder.block(
            center + vec3(0.055, -radius * 0.62, -radius * 0.18),
            center + vec3(0.06, radius * 0.62, radius * 0.18),
        );
    } else if inner < radius {
        builder.material(if kind == "306" { Material::LampAmber } else { Material::Sign });
        builder.loft(&[ring(inner, 0.055), ring(inner, 0.06)], |_, _| None);
        if kind == "274" {
            builder.material(Material::Plastic);
            let limit = [signal.value.map(|value| value.to_string()), Some(signal.subtype.clone())];
            let is_number = |text: &String| text.parse::<u32>().is_ok();
            let text = limit.into_iter().flatten().find(is_number).unwrap_or_default();
            for quad in facade::write(&text, inner * 1.4, inner * 0.95) {
                builder.quad(quad.map(|at| center + vec3(0.063, at.x, at.y)));
            }
        }
    }
}
