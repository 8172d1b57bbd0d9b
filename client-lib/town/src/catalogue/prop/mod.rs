//! Things that just stand there, by CARLA's ids.

use glam::{Quat, Vec3, vec3};
use road::{Material, Tag};

use super::{Blueprint, Kind};
use crate::clay::{self, Clay};

/// Id, tag, mass in kilograms, and what shapes it.
type Row = (&'static str, Tag, f32, fn(&mut Clay));

/// A few of CARLA's props.
pub(super) fn props() -> Vec<Blueprint> {
    let rows: [Row; 14] = [
        ("static.prop.barrel", Tag::Dynamic, 12.0, barrel),
        ("static.prop.bench01", Tag::Static, 60.0, bench),
        ("static.prop.bin", Tag::Static, 15.0, bin),
        ("static.prop.box01", Tag::Dynamic, 5.0, carton),
        ("static.prop.busstop", Tag::Static, 400.0, bus_stop),
        ("static.prop.constructioncone", Tag::Dynamic, 4.0, cone),
        ("static.prop.container", Tag::Static, 900.0, skip),
        ("static.prop.fountain", Tag::Static, 4000.0, fountain),
        ("static.prop.hydrant", Tag::Static, 90.0, hydrant),
        ("static.prop.mailbox", Tag::Static, 50.0, mailbox),
        ("static.prop.streetbarrier", Tag::Dynamic, 20.0, barrier),
        ("static.prop.trafficcone01", Tag::Dynamic, 3.0, cone),
        ("static.prop.trafficwarning", Tag::Dynamic, 40.0, warning),
        ("static.prop.warningconstruction", Tag::Dynamic, 15.0, barrier),
    ];
    rows.into_iter().map(|(id, tag, mass, shape)| prop(id, tag, mass, shape)).collect()
}

fn prop(id: &'static str, tag: Tag, mass_kg: f32, shape: fn(&mut Clay)) -> Blueprint {
    let mut clay = Clay::new(tag, Material::Plastic, 0);
    shape(&mut clay);
    let (low, high) = clay::bounds(&clay.mesh);
    Blueprint {
        id,
        kind: Kind::Prop,
        tag,
        base_type: "",
        special_type: "",
        half_extents_m: (high - low) * 0.5,
        center_m: (high + low) * 0.5,
        mesh: clay.mesh,
        wheels: Vec::new(),
        mass_kg,
        wheelbase_m: 0.0,
        default_color: [200, 90, 30],
    }
}

fn cone(clay: &mut Clay) {
    clay.material(Material::Rubber);
    clay.block(vec3(-0.18, -0.18, 0.0), vec3(0.18, 0.18, 0.04));
    for (from, to, material) in [
        (0.0, 0.35, Material::LampAmber),
        (0.35, 0.6, Material::Sign),
        (0.6, 1.0, Material::LampAmber),
    ] {
        let radius = |share: f32| 0.13 - 0.105 * share;
        clay.material(material);
        clay.cone(
            Vec3::Z * (0.04 + 0.66 * from),
            Vec3::Z * (0.04 + 0.66 * to),
            [radius(from), radius(to)],
            14,
        );
    }
}

fn barrier(clay: &mut Clay) {
    for z in [0.55f32, 0.85] {
        for stripe in 0..6 {
            clay.material(if stripe % 2 == 0 { Material::LampRed } else { Material::Sign });
            let y = -0.6 + 0.2 * stripe as f32;
            clay.block(vec3(-0.015, y, z), vec3(0.015, y + 0.2, z + 0.18));
        }
    }
    clay.material(Material::Metal);
    for y in [-0.5, 0.5] {
        clay.block(vec3(-0.03, y - 0.03, 0.04), vec3(0.03, y + 0.03, 1.05));
        clay.block(vec3(-0.28, y - 0.04, 0.0), vec3(0.28, y + 0.04, 0.05));
    }
}

fn barrel(clay: &mut Clay) {
    for band in 0..5 {
        clay.material(if band % 2 == 0 { Material::LampAmber } else { Material::Sign });
        let z = 0.2 * band as f32;
        clay.cone(Vec3::Z * z, Vec3::Z * (z + 0.2), [0.30 - z * 0.06, 0.29 - z * 0.06], 16);
    }
}

fn warning(clay: &mut Clay) {
    clay.material(Material::Metal);
    clay.block(vec3(-0.5, -0.8, 0.35), vec3(0.5, 0.8, 0.55));
    clay.material(Material::Rubber);
    for y in [-0.8, 0.8] {
        clay.rod(vec3(0.0, y - 0.08, 0.3), vec3(0.0, y + 0.08, 0.3), 0.3, 14);
    }
    clay.material(Material::Sign);
    clay.block(vec3(-0.05, -0.9, 0.8), vec3(0.0, 0.9, 2.1));
    clay.material(Material::LampAmber);
    for lamp in 0..5 {
        clay.ball(vec3(-0.05, -0.6 + 0.3 * lamp as f32, 1.8), vec3(0.03, 0.1, 0.1), 4, 8);
    }
}

fn carton(clay: &mut Clay) {
    clay.material(Material::Wood);
    clay.block(vec3(-0.25, -0.30, 0.0), vec3(0.25, 0.30, 0.40));
    clay.material(Material::Plastic);
    clay.block(vec3(-0.255, -0.03, 0.05), vec3(0.255, 0.03, 0.405));
}

fn bin(clay: &mut Clay) {
    clay.material(Material::Metal);
    clay.cone(Vec3::ZERO, Vec3::Z * 0.8, [0.22, 0.28], 12);
    clay.material(Material::Plastic);
    clay.cone(Vec3::Z * 0.8, Vec3::Z * 0.95, [0.30, 0.14], 12);
}

fn bench(clay: &mut Clay) {
    clay.material(Material::Wood);
    for slat in 0..4 {
        let x = -0.22 + 0.12 * slat as f32;
        clay.block(vec3(x, -0.8, 0.42), vec3(x + 0.10, 0.8, 0.45));
    }
    for slat in 0..3 {
        let z = 0.52 + 0.13 * slat as f32;
        clay.block(vec3(-0.27 - 0.02 * slat as f32, -0.8, z), vec3(-0.24, 0.8, z + 0.10));
    }
    clay.material(Material::Metal);
    for y in [-0.65, 0.65] {
        clay.block(vec3(-0.24, y - 0.03, 0.0), vec3(-0.18, y + 0.03, 0.42));
        clay.block(vec3(0.16, y - 0.03, 0.0), vec3(0.22, y + 0.03, 0.42));
        clay.block(vec3(-0.30, y - 0.02, 0.40), vec3(-0.25, y + 0.02, 0.9));
    }
}

fn bus_stop(clay: &mut Clay) {
    clay.material(Material::Metal);
    for (x, y) in [(-0.7, -1.9), (-0.7, 1.9), (0.7, -1.9), (0.7, 1.9)] {
        clay.block(vec3(x - 0.04, y - 0.04, 0.0), vec3(x + 0.04, y + 0.04, 2.4));
    }
    clay.block(vec3(-0.9, -2.1, 2.4), vec3(0.9, 2.1, 2.52));
    clay.material(Material::Glass);
    clay.block(vec3(-0.72, -1.86, 0.3), vec3(-0.69, 1.86, 2.3));
    clay.block(vec3(-0.66, 1.88, 0.3), vec3(0.66, 1.91, 2.3));
    clay.material(Material::Wood);
    clay.block(vec3(-0.6, -1.5, 0.42), vec3(-0.25, 1.2, 0.47));
    clay.material(Material::Metal);
    clay.block(vec3(-0.5, -1.3, 0.0), vec3(-0.4, -1.2, 0.42));
    clay.block(vec3(-0.5, 0.9, 0.0), vec3(-0.4, 1.0, 0.42));
    clay.material(Material::Sign);
    clay.block(vec3(0.3, -1.92, 0.5), vec3(0.7, -1.88, 2.2));
}

fn skip(clay: &mut Clay) {
    clay.material(Material::Metal);
    let (length, half, height) = (1.6, 0.85, 1.3);
    clay.block(vec3(-length, -half, 0.1), vec3(length, half, height));
    for rib in 0..6 {
        let x = -1.4 + 0.56 * rib as f32;
        clay.block(vec3(x - 0.04, -half - 0.05, 0.1), vec3(x + 0.04, half + 0.05, height));
    }
    clay.material(Material::Plastic);
    clay.block(vec3(-length - 0.03, -half - 0.06, height), vec3(length + 0.03, half + 0.06, 1.42));
    clay.material(Material::Rubber);
    for (x, y) in [(-1.3, -0.6), (-1.3, 0.6), (1.3, -0.6), (1.3, 0.6)] {
        clay.rod(vec3(x, y - 0.05, 0.1), vec3(x, y + 0.05, 0.1), 0.1, 10);
    }
}

fn fountain(clay: &mut Clay) {
    clay.material(Material::Concrete);
    clay.cone(Vec3::ZERO, Vec3::Z * 0.6, [2.5, 2.5], 24);
    clay.material(Material::Water);
    clay.cone(Vec3::Z * 0.58, Vec3::Z * 0.62, [2.3, 2.3], 24);
    clay.material(Material::Concrete);
    clay.cone(Vec3::Z * 0.5, Vec3::Z * 1.6, [0.35, 0.2], 12);
    clay.cone(Vec3::Z * 1.6, Vec3::Z * 1.85, [0.3, 1.1], 16);
    clay.cone(Vec3::Z * 1.8, Vec3::Z * 2.6, [0.16, 0.08], 10);
}

fn hydrant(clay: &mut Clay) {
    clay.material(Material::LampRed);
    clay.rod(Vec3::ZERO, Vec3::Z * 0.05, 0.16, 12);
    clay.rod(Vec3::Z * 0.05, Vec3::Z * 0.6, 0.11, 12);
    clay.ball(Vec3::Z * 0.6, vec3(0.13, 0.13, 0.14), 6, 12);
    clay.rod(vec3(0.0, -0.20, 0.42), vec3(0.0, 0.20, 0.42), 0.06, 10);
    clay.rod(vec3(0.0, 0.0, 0.38), vec3(0.19, 0.0, 0.38), 0.07, 10);
}

fn mailbox(clay: &mut Clay) {
    clay.material(Material::CarPaint);
    clay.block(vec3(-0.25, -0.25, 0.25), vec3(0.25, 0.25, 1.0));
    clay.rod(vec3(-0.25, 0.0, 1.0), vec3(0.25, 0.0, 1.0), 0.245, 14);
    clay.material(Material::Metal);
    for (x, y) in [(-0.2, -0.2), (-0.2, 0.2), (0.2, -0.2), (0.2, 0.2)] {
        clay.block(vec3(x - 0.03, y - 0.03, 0.0), vec3(x + 0.03, y + 0.03, 0.25));
    }
    clay.block_at(vec3(0.255, 0.0, 0.95), vec3(0.01, 0.18, 0.05), Quat::from_rotation_y(-0.2));
}
