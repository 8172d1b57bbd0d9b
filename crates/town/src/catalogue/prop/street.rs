//! Props of roads and sidewalks.

use std::f32::consts::{FRAC_PI_4, PI, TAU};

use glam::{Quat, Vec3, vec3};
use mesh::{Material, Tag};

use crate::{
    catalogue::prop::{
        garden::bench,
        parts::{Row, heap, hue::*, legs, slab},
    },
    mesh_builder::MeshBuilder,
};

const D: Tag = Tag::Dynamic;
const S: Tag = Tag::Static;
const SIGN: Tag = Tag::TrafficSign;

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    ("static.prop.streetbarrier", D, [0.38, 1.25, 1.05], 20.0, street_barrier),
    ("static.prop.constructioncone", D, [0.36, 0.36, 0.70], 4.0, |c| cone(c, 2)),
    ("static.prop.trafficcone01", D, [0.45, 0.45, 0.85], 5.0, |c| cone(c, 3)),
    ("static.prop.trafficcone02", D, [0.40, 0.40, 1.10], 7.0, delineator),
    ("static.prop.ironplank", D, [2.40, 1.20, 0.03], 120.0, iron_plank),
    ("static.prop.warningconstruction", D, [0.50, 1.00, 1.20], 12.0, |c| folding_sign(c, ORANGE)),
    ("static.prop.brokentile01", D, [0.40, 0.35, 0.06], 3.0, |c| tiles(c, 3)),
    ("static.prop.brokentile02", D, [0.55, 0.50, 0.08], 5.0, |c| tiles(c, 5)),
    ("static.prop.brokentile03", D, [0.30, 0.30, 0.05], 2.0, |c| tiles(c, 2)),
    ("static.prop.brokentile04", D, [0.70, 0.45, 0.10], 7.0, |c| tiles(c, 8)),
    ("static.prop.dirtdebris01", D, [1.60, 1.20, 0.30], 120.0, |c| debris(c, 1)),
    ("static.prop.dirtdebris02", D, [2.20, 1.60, 0.45], 250.0, |c| debris(c, 2)),
    ("static.prop.dirtdebris03", D, [1.00, 0.80, 0.18], 50.0, |c| debris(c, 3)),
    ("static.prop.trafficwarning", D, [3.00, 2.33, 3.30], 600.0, arrow_trailer),
    ("static.prop.warningaccident", D, [0.40, 0.90, 1.05], 8.0, |c| folding_sign(c, RED)),
    ("static.prop.chainbarrier", S, [0.16, 1.60, 0.90], 25.0, |c| chain(c, true)),
    ("static.prop.chainbarrierend", S, [0.16, 0.16, 0.90], 15.0, |c| chain(c, false)),
    ("static.prop.bench01", S, [0.66, 1.75, 0.90], 60.0, |c| bench(c, 1)),
    ("static.prop.bench02", S, [0.45, 1.80, 0.45], 160.0, |c| bench(c, 2)),
    ("static.prop.foodcart", D, [2.40, 1.30, 2.40], 260.0, food_cart),
    ("static.prop.kiosk_01", S, [2.60, 2.60, 3.00], 1500.0, kiosk),
    ("static.prop.fountain", S, [5.00, 5.00, 2.60], 9000.0, fountain),
    ("static.prop.maptable", S, [0.50, 1.40, 1.50], 90.0, map_table),
    ("static.prop.advertisement", S, [0.30, 1.40, 2.60], 250.0, advertisement),
    ("static.prop.streetsign", SIGN, [0.60, 0.60, 2.60], 25.0, |c| street_sign(c, 0)),
    ("static.prop.streetsign01", SIGN, [0.12, 0.75, 2.50], 20.0, |c| street_sign(c, 1)),
    ("static.prop.streetsign04", SIGN, [0.12, 0.90, 3.00], 28.0, |c| street_sign(c, 4)),
    ("static.prop.busstop", S, [1.70, 4.20, 2.55], 700.0, |c| bus_stop(c, true)),
    ("static.prop.busstoplb", S, [1.30, 2.80, 2.45], 450.0, |c| bus_stop(c, false)),
    ("static.prop.atm", S, [0.70, 0.80, 1.75], 350.0, atm),
    ("static.prop.mailbox", S, [0.52, 0.52, 1.25], 60.0, mailbox),
    ("static.prop.streetfountain", S, [0.50, 0.40, 1.10], 90.0, street_fountain),
    ("static.prop.vendingmachine", S, [0.85, 1.00, 1.85], 320.0, vending_machine),
    // Not part of CARLA's catalogue.
    ("static.prop.hydrant", S, [0.40, 0.40, 0.75], 90.0, hydrant),
    ("static.prop.calibrator", D, [0.60, 1.20, 1.60], 20.0, calibrator),
];

fn cone(builder: &mut MeshBuilder, bands: u32) {
    builder.material(Material::Rubber);
    let ring = |z: f32, half: f32| {
        let c = half * 0.3;
        vec![
            vec3(half, -half + c, z),
            vec3(half, half - c, z),
            vec3(half - c, half, z),
            vec3(-half + c, half, z),
            vec3(-half, half - c, z),
            vec3(-half, -half + c, z),
            vec3(-half + c, -half, z),
            vec3(half - c, -half, z),
        ]
    };
    if bands == 3 {
        builder.tinted(Material::Plastic, ORANGE);
    }
    builder.loft(&[ring(0.0, 0.18), ring(0.03, 0.18), ring(0.04, 0.14)], |_, _| None);
    let parts = bands * 2 + 1;
    for part in 0..parts {
        let radius = |fraction: f32| 0.13 - 0.105 * fraction;
        let (from, to) = (part as f32 / parts as f32, (part + 1) as f32 / parts as f32);
        if part % 2 == 0 {
            builder.tinted(Material::Plastic, ORANGE);
        } else {
            builder.tinted(Material::Sign, WHITE);
        }
        let at = |fraction: f32| Vec3::Z * (0.04 + 0.66 * fraction);
        builder.cone(at(from), at(to), [radius(from), radius(to)], 18);
    }
}

/// A slim post on a heavy base.
fn delineator(builder: &mut MeshBuilder) {
    builder.material(Material::Rubber);
    builder.lathe(Vec3::ZERO, &[(0.20, 0.0), (0.20, 0.05), (0.08, 0.09)], 12);
    for band in 0..6 {
        if band % 2 == 0 {
            builder.tinted(Material::Plastic, ORANGE);
        } else {
            builder.tinted(Material::Sign, WHITE);
        }
        let z = 0.09 + 0.16 * band as f32;
        builder.cone(Vec3::Z * z, Vec3::Z * (z + 0.16), [0.055, 0.053], 12);
    }
    builder.tinted(Material::Plastic, ORANGE);
    builder.lathe(Vec3::Z * 1.05, &[(0.053, 0.0), (0.04, 0.03), (0.03, 0.05)], 12);
}

fn street_barrier(builder: &mut MeshBuilder) {
    for z in [0.55f32, 0.85] {
        for stripe in 0..6 {
            builder.tinted(Material::Sign, if stripe % 2 == 0 { RED } else { WHITE });
            let y = -0.62 + 0.2067 * stripe as f32;
            for side in [1.0f32, -1.0] {
                let x = side * 0.016;
                let lean = 0.05;
                let front = [
                    vec3(x, y + lean, z),
                    vec3(x, y + 0.2067 + lean, z),
                    vec3(x, y + 0.2067 - lean, z + 0.18),
                    vec3(x, y - lean, z + 0.18),
                ];
                let clip = front.map(|p| vec3(p.x, p.y.clamp(-0.62, 0.62), p.z));
                let [a, b, c, d] = clip;
                builder.quad(if side > 0.0 { [a, b, c, d] } else { [d, c, b, a] });
            }
        }
        builder.tinted(Material::Plastic, WHITE);
        slab(builder, [0.0, 0.0, z + 0.09], [0.03, 1.24, 0.18]);
    }
    builder.tinted(Material::Metal, GREY);
    for y in [-0.5, 0.5] {
        builder.block(vec3(-0.025, y - 0.025, 0.04), vec3(0.025, y + 0.025, 1.05));
        builder.tinted(Material::Rubber, BLACK);
        slab(builder, [0.0, y, 0.03], [0.38, 0.12, 0.06]);
        builder.tinted(Material::Metal, GREY);
    }
    for y in [-0.5, 0.5] {
        builder.material(Material::LampAmber);
        builder.rod(vec3(-0.03, y, 1.0), vec3(0.03, y, 1.0), 0.05, 12);
    }
}

fn iron_plank(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREY);
    slab(builder, [0.0, 0.0, 0.012], [2.4, 1.2, 0.024]);
    builder.tinted(Material::Metal, DARK);
    for row in 0..12 {
        for column in 0..6 {
            let turn = Quat::from_rotation_z(if (row + column) % 2 == 0 { 0.785 } else { -0.785 });
            let at = vec3(-1.1 + 0.2 * row as f32, -0.5 + 0.2 * column as f32, 0.026);
            builder.block_at(at, vec3(0.06, 0.012, 0.003), turn);
        }
    }
}

/// A triangular sign on folding legs.
fn folding_sign(builder: &mut MeshBuilder, hue: [u8; 3]) {
    let corner =
        |angle: f32, reach: f32, x: f32| vec3(x, angle.sin() * reach, 0.56 + angle.cos() * reach);
    let ring = |reach: f32, x: f32| -> Vec<Vec3> {
        (0..3).map(|k| corner(-TAU * k as f32 / 3.0, reach, x)).collect()
    };
    builder.tinted(Material::Sign, hue);
    builder.loft(&[ring(0.52, -0.01), ring(0.52, 0.01)], |_, _| None);
    builder.tinted(Material::Sign, if hue == ORANGE { YELLOW } else { WHITE });
    builder.loft(&[ring(0.36, 0.008), ring(0.36, 0.014)], |_, _| None);
    builder.tinted(Material::Plastic, BLACK);
    if hue == ORANGE {
        // A simplified pictogram of a man with a shovel.
        builder.ball(vec3(0.015, 0.02, 0.70), vec3(0.006, 0.03, 0.035), 3, 8);
        slab(builder, [0.016, 0.0, 0.60], [0.004, 0.05, 0.14]);
        builder.block_at(
            vec3(0.016, -0.07, 0.55),
            vec3(0.003, 0.10, 0.012),
            Quat::from_rotation_x(0.6),
        );
        slab(builder, [0.016, 0.03, 0.48], [0.004, 0.03, 0.12]);
        slab(builder, [0.016, -0.12, 0.45], [0.004, 0.12, 0.05]);
    } else {
        slab(builder, [0.016, 0.0, 0.62], [0.004, 0.06, 0.22]);
        builder.rod(vec3(0.014, 0.0, 0.45), vec3(0.018, 0.0, 0.45), 0.035, 10);
    }
    builder.material(Material::Metal);
    for y in [-0.3, 0.3] {
        builder.rod(vec3(0.0, y, 0.32), vec3(0.20, y * 1.1, 0.0), 0.014, 5);
        builder.rod(vec3(0.0, y, 0.32), vec3(-0.20, y * 1.1, 0.0), 0.014, 5);
    }
}

fn tiles(builder: &mut MeshBuilder, pieces: u32) {
    for piece in 0..pieces {
        let angle = piece as f32 * 2.399;
        let reach = 0.03 + 0.055 * (piece as f32).sqrt();
        let at = vec3(angle.cos() * reach, angle.sin() * reach, 0.0);
        let size = 0.05 + 0.02 * (piece % 3) as f32;
        let tilt = Quat::from_rotation_z(angle) * Quat::from_rotation_x(0.22 * (piece % 3) as f32);
        builder.tinted(Material::RoofTiles, if piece % 3 == 1 { TERRACOTTA } else { STONE });
        let ring = |z: f32| -> Vec<Vec3> {
            [(1.0, -0.7), (0.8, 0.9), (-0.4, 1.0), (-1.0, 0.1), (-0.6, -0.9)]
                .map(|(x, y): (f32, f32)| at + tilt * vec3(x * size, y * size, z) + Vec3::Z * 0.02)
                .to_vec()
        };
        builder.loft(&[ring(-0.008), ring(0.008)], |_, _| None);
    }
}

fn debris(builder: &mut MeshBuilder, number: u32) {
    builder.tinted(Material::Soil, BROWN);
    heap(builder, [0.0, 0.0], [0.8, 0.6, 0.26], number + 20);
    heap(builder, [0.35, 0.2], [0.4, 0.35, 0.2], number + 30);
    for stone in 0..10 + 3 * number {
        let angle = stone as f32 * 2.399;
        let reach = 0.25 + 0.045 * stone as f32 % 0.55;
        let size = 0.04 + 0.02 * (stone % 4) as f32;
        builder.tinted(Material::Concrete, if stone % 3 == 0 { GREY } else { STONE });
        let at =
            vec3(angle.cos() * reach, angle.sin() * reach * 0.8, 0.26 - 0.28 * reach + size * 0.3);
        builder.ball(at.max(vec3(-9.0, -9.0, 0.02)), vec3(size, size * 0.8, size * 0.6), 3, 6);
    }
}

/// A trailer with a board of arrow lamps.
fn arrow_trailer(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, ORANGE);
    slab(builder, [-0.2, 0.0, 0.55], [1.6, 1.5, 0.16]);
    builder.rod(vec3(0.5, 0.0, 0.5), vec3(1.5, 0.0, 0.45), 0.05, 8);
    slab(builder, [-0.3, 0.0, 0.78], [0.8, 0.8, 0.34]);
    builder.tinted(Material::Metal, GREY);
    for y in [-0.5, 0.5] {
        slab(builder, [-0.2, y, 1.25], [0.08, 0.08, 1.4]);
    }
    builder.rod(vec3(1.35, 0.0, 0.0), vec3(1.35, 0.0, 0.6), 0.03, 6);
    for y in [-0.92, 0.92] {
        builder.material(Material::Rubber);
        builder.rod(vec3(-0.25, y - 0.1, 0.32), vec3(-0.25, y + 0.1, 0.32), 0.32, 18);
        builder.tinted(Material::Metal, GREY);
        builder.rod(vec3(-0.25, y - 0.11, 0.32), vec3(-0.25, y + 0.11, 0.32), 0.18, 10);
    }
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [-0.28, 0.0, 2.55], [0.10, 2.33, 1.5]);
    for (edge, z) in [(1.5, 3.28), (1.5, 1.82)] {
        builder.tinted(Material::Sign, if edge > z { RED } else { ORANGE });
        slab(builder, [-0.28, 0.0, z], [0.12, 2.33, 0.04]);
    }
    builder.material(Material::LampAmber);
    let lamp = |builder: &mut MeshBuilder, y: f32, z: f32| {
        builder.rod(vec3(-0.36, y, z), vec3(-0.30, y, z), 0.085, 12);
    };
    for step in 0..6 {
        lamp(builder, 0.85 - 0.3 * step as f32, 2.55);
    }
    for step in 1..4 {
        let (y, z) = (-0.85 + 0.22 * step as f32, 0.18 * step as f32);
        lamp(builder, y, 2.55 + z);
        lamp(builder, y, 2.55 - z);
    }
    builder.tinted(Material::Sign, WHITE);
    slab(builder, [-1.0, 0.0, 0.5], [0.04, 1.5, 0.12]);
    builder.material(Material::LampRed);
    for y in [-0.6, 0.6] {
        slab(builder, [-1.03, y, 0.5], [0.04, 0.16, 0.10]);
    }
    builder.tinted(Material::Metal, GREY);
    slab(builder, [-1.4, 0.0, 0.30], [0.2, 1.9, 0.06]);
}

fn chain(builder: &mut MeshBuilder, links: bool) {
    let post = |builder: &mut MeshBuilder, y: f32| {
        builder.tinted(Material::Metal, BLACK);
        builder.lathe(
            Vec3::Y * y,
            &[
                (0.08, 0.0),
                (0.08, 0.04),
                (0.045, 0.08),
                (0.04, 0.72),
                (0.06, 0.74),
                (0.06, 0.77),
                (0.04, 0.79),
            ],
            12,
        );
        builder.ball(vec3(0.0, y, 0.84), Vec3::splat(0.06), 5, 10);
    };
    post(builder, -0.72);
    if links {
        post(builder, 0.72);
        builder.tinted(Material::Metal, GREY);
        for link in 0..22 {
            let along = |k: f32| {
                let y = -0.70 + 1.40 * k / 22.0;
                vec3(0.0, y, 0.46 + 0.26 * (y / 0.7) * (y / 0.7))
            };
            let (a, b) = (along(link as f32), along(link as f32 + 1.0));
            let middle = (a + b) * 0.5;
            let turn = Quat::from_rotation_arc(Vec3::Y, (b - a).normalize_or(Vec3::Y));
            let half =
                if link % 2 == 0 { vec3(0.022, 0.045, 0.007) } else { vec3(0.007, 0.045, 0.022) };
            builder.block_at(middle, half, turn);
        }
    }
}

fn food_cart(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREY);
    slab(builder, [0.0, 0.0, 0.75], [1.9, 0.9, 0.75]);
    builder.tinted(Material::Sign, RED);
    slab(builder, [0.0, 0.0, 0.70], [1.92, 0.92, 0.34]);
    builder.tinted(Material::Metal, WHITE);
    slab(builder, [0.0, 0.0, 1.15], [2.0, 1.0, 0.05]);
    builder.tinted(Material::Metal, GREY);
    for (x, y) in [(0.9, 0.42), (0.9, -0.42), (-0.9, 0.42), (-0.9, -0.42)] {
        builder.rod(vec3(x, y, 1.15), vec3(x, y, 2.1), 0.02, 6);
    }
    // A striped canopy.
    for stripe in 0..8 {
        builder.tinted(Material::Cloth, if stripe % 2 == 0 { RED } else { WHITE });
        let (from, to) = (-1.1 + 0.275 * stripe as f32, -1.1 + 0.275 * (stripe + 1) as f32);
        let roof = |x: f32| vec![vec3(x, 0.65, 2.05), vec3(x, 0.0, 2.4), vec3(x, -0.65, 2.05)];
        builder.loft(&[roof(from), roof(to)], |_, _| None);
        for y in [-0.65, 0.65] {
            slab(builder, [(from + to) * 0.5, y, 1.98], [0.275, 0.02, 0.14]);
        }
    }
    builder.material(Material::Rubber);
    for y in [-0.50, 0.50] {
        builder.rod(vec3(-0.35, y - 0.03, 0.32), vec3(-0.35, y + 0.03, 0.32), 0.32, 18);
        builder.tinted(Material::Metal, GREY);
        builder.rod(vec3(-0.35, y - 0.04, 0.32), vec3(-0.35, y + 0.04, 0.32), 0.24, 10);
        builder.material(Material::Rubber);
    }
    builder.tinted(Material::Metal, DARK);
    builder.rod(vec3(0.75, 0.0, 0.0), vec3(0.75, 0.0, 0.4), 0.03, 6);
    builder.pipe(
        &[vec3(0.95, -0.4, 0.9), vec3(1.2, -0.4, 1.0), vec3(1.2, 0.4, 1.0), vec3(0.95, 0.4, 0.9)],
        0.02,
        6,
    );
    builder.tinted(Material::Plastic, YELLOW);
    builder.rod(vec3(-0.6, 0.2, 1.17), vec3(-0.6, 0.2, 1.36), 0.05, 8);
    builder.tinted(Material::Plastic, RED);
    builder.rod(vec3(-0.45, 0.2, 1.17), vec3(-0.45, 0.2, 1.36), 0.05, 8);
    builder.material(Material::Glass);
    slab(builder, [0.3, 0.0, 1.35], [0.8, 0.6, 0.35]);
}

fn octagon(reach: f32, z: f32) -> Vec<Vec3> {
    (0..8)
        .map(|k| {
            let angle = FRAC_PI_4 * (k as f32 + 0.5);
            vec3(angle.cos() * reach, angle.sin() * reach, z)
        })
        .collect()
}

fn kiosk(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREEN);
    builder.loft(&[octagon(1.2, 0.0), octagon(1.2, 0.95)], |_, _| None);
    builder.material(Material::Glass);
    builder.loft(&[octagon(1.12, 0.95), octagon(1.12, 2.1)], |_, _| None);
    builder.tinted(Material::Metal, GREEN);
    for corner in octagon(1.16, 1.5) {
        slab(builder, corner.to_array(), [0.09, 0.09, 1.3]);
    }
    builder.loft(&[octagon(1.40, 2.1), octagon(1.40, 2.22), octagon(1.25, 2.30)], |_, _| None);
    builder.loft(&[octagon(1.2, 2.3), octagon(0.6, 2.72), octagon(0.12, 2.86)], |_, _| None);
    builder.ball(Vec3::Z * 2.92, Vec3::splat(0.1), 4, 8);
    builder.material(Material::Wood);
    slab(builder, [1.2, 0.0, 0.98], [0.3, 1.0, 0.05]);
    for paper in 0..6 {
        let hues = [WHITE, YELLOW, SKY, RED, WHITE, PINK];
        builder.tinted(Material::Sign, hues[paper]);
        slab(builder, [1.14, -0.42 + 0.17 * paper as f32, 0.55], [0.02, 0.14, 0.5]);
    }
    builder.tinted(Material::Sign, YELLOW);
    slab(builder, [1.30, 0.0, 2.16], [0.04, 1.0, 0.10]);
}

fn fountain(builder: &mut MeshBuilder) {
    builder.material(Material::Concrete);
    builder.lathe(
        Vec3::ZERO,
        &[
            (2.5, 0.0),
            (2.5, 0.1),
            (2.35, 0.14),
            (2.38, 0.5),
            (2.5, 0.54),
            (2.5, 0.6),
            (2.2, 0.6),
            (2.2, 0.45),
        ],
        28,
    );
    builder.material(Material::Water);
    builder.lathe(Vec3::Z * 0.45, &[(2.2, 0.0), (2.2, 0.04)], 28);
    builder.material(Material::Concrete);
    builder.lathe(
        Vec3::ZERO,
        &[
            (0.5, 0.4),
            (0.35, 0.7),
            (0.22, 1.2),
            (0.28, 1.45),
            (1.05, 1.75),
            (1.1, 1.85),
            (1.0, 1.82),
            (0.2, 1.75),
        ],
        18,
    );
    builder.material(Material::Water);
    builder.lathe(Vec3::Z * 1.76, &[(1.0, 0.0), (1.0, 0.03)], 18);
    builder.material(Material::Concrete);
    builder.lathe(
        Vec3::Z * 1.75,
        &[
            (0.18, 0.0),
            (0.10, 0.35),
            (0.4, 0.50),
            (0.42, 0.55),
            (0.08, 0.58),
            (0.06, 0.75),
            (0.0, 0.85),
        ],
        14,
    );
}

fn map_table(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, DARK);
    for y in [-0.6, 0.6] {
        slab(builder, [0.0, y, 0.55], [0.08, 0.08, 1.1]);
    }
    let turn = Quat::from_rotation_y(0.75);
    builder.block_at(Vec3::Z * 1.2, vec3(0.42, 0.70, 0.025), turn);
    builder.tinted(Material::Sign, WHITE);
    builder.block_at(Vec3::Z * 1.2 + turn * Vec3::Z * 0.026, vec3(0.38, 0.66, 0.003), turn);
    for (x, y, half_x, half_y, hue) in [
        (0.1, -0.3, 0.2, 0.25, LIME),
        (-0.15, 0.3, 0.15, 0.3, LIME),
        (0.0, 0.05, 0.37, 0.03, YELLOW),
        (0.12, 0.3, 0.03, 0.35, YELLOW),
        (-0.2, -0.3, 0.12, 0.2, SKY),
    ] {
        builder.tinted(Material::Sign, hue);
        builder.block_at(
            Vec3::Z * 1.2 + turn * vec3(x, y, 0.030),
            vec3(half_x, half_y, 0.002),
            turn,
        );
    }
}

fn advertisement(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, DARK);
    slab(builder, [0.0, 0.0, 0.25], [0.22, 0.5, 0.5]);
    slab(builder, [0.0, 0.0, 1.55], [0.30, 1.40, 2.1]);
    for side in [1.0f32, -1.0] {
        let x = side * 0.152;
        builder.tinted(Material::Sign, SKY);
        slab(builder, [x, 0.0, 1.58], [0.006, 1.24, 1.84]);
        builder.tinted(Material::Sign, RED);
        slab(builder, [x * 1.01, 0.0, 1.0], [0.008, 1.24, 0.5]);
        builder.tinted(Material::Sign, WHITE);
        slab(builder, [x * 1.02, 0.0, 1.02], [0.009, 0.9, 0.14]);
        builder.tinted(Material::Sign, YELLOW);
        builder.rod(vec3(x, 0.2, 1.95), vec3(x * 1.03, 0.2, 1.95), 0.26, 20);
    }
}

fn street_sign(builder: &mut MeshBuilder, make: u32) {
    builder.tinted(Material::Metal, GREY);
    builder.rod(Vec3::ZERO, Vec3::Z * 2.5, 0.03, 8);
    let disc =
        |builder: &mut MeshBuilder, z: f32, radius: f32, x: f32, hue: [u8; 3], sides: u32| {
            builder.tinted(Material::Sign, hue);
            let (a, b) = (vec3(x - 0.004, 0.0, z), vec3(x + 0.004, 0.0, z));
            builder.rod(a, b, radius, sides);
        };
    match make {
        0 => {
            // Two street names at right angles.
            builder.tinted(Material::Sign, BLUE);
            slab(builder, [0.0, 0.0, 2.42], [0.02, 0.9, 0.2]);
            slab(builder, [0.0, 0.0, 2.18], [0.9, 0.02, 0.2]);
            builder.tinted(Material::Sign, WHITE);
            slab(builder, [0.0, 0.0, 2.42], [0.026, 0.7, 0.06]);
            slab(builder, [0.0, 0.0, 2.18], [0.7, 0.026, 0.06]);
            builder.tinted(Material::Metal, GREY);
            builder.ball(Vec3::Z * 2.55, Vec3::splat(0.05), 4, 8);
        }
        1 => {
            disc(builder, 2.15, 0.36, 0.045, RED, 24);
            disc(builder, 2.15, 0.28, 0.050, WHITE, 24);
            builder.tinted(Material::Plastic, BLACK);
            slab(builder, [0.056, 0.08, 2.15], [0.006, 0.10, 0.24]);
            slab(builder, [0.056, -0.09, 2.15], [0.006, 0.10, 0.24]);
        }
        _ => {
            builder.tinted(Material::Sign, BLUE);
            slab(builder, [0.045, 0.0, 2.05], [0.01, 0.9, 0.9]);
            builder.tinted(Material::Sign, WHITE);
            slab(builder, [0.052, -0.14, 2.05], [0.006, 0.14, 0.6]);
            builder.rod(vec3(0.050, 0.03, 2.20), vec3(0.056, 0.03, 2.20), 0.18, 18);
            builder.tinted(Material::Sign, BLUE);
            builder.rod(vec3(0.052, 0.05, 2.20), vec3(0.058, 0.05, 2.20), 0.07, 14);
            builder.tinted(Material::Sign, WHITE);
            slab(builder, [0.045, 0.0, 1.45], [0.01, 0.7, 0.2]);
        }
    }
}

fn bus_stop(builder: &mut MeshBuilder, large: bool) {
    let half = if large { 1.95 } else { 1.3 };
    builder.tinted(Material::Metal, DARK);
    for y in [-half, half] {
        slab(builder, [-0.62, y, 1.2], [0.08, 0.08, 2.4]);
        if large {
            slab(builder, [0.62, y, 1.2], [0.08, 0.08, 2.4]);
        }
    }
    slab(builder, [0.0, 0.0, 2.43], [if large { 1.7 } else { 1.4 }, half * 2.0 + 0.25, 0.08]);
    if large {
        builder.tinted(Material::Sign, YELLOW);
        slab(builder, [0.86, 0.0, 2.50], [0.04, 1.6, 0.14]);
    } else {
        builder.material(Material::Metal);
        builder.loft(
            &[-1.0f32, 1.0].map(|side| {
                (0..=8)
                    .map(|step| {
                        let angle = PI * step as f32 / 8.0;
                        vec3(0.7 * angle.cos(), side * half, 2.46 + 0.1 * angle.sin())
                    })
                    .rev()
                    .collect::<Vec<_>>()
            }),
            |_, _| None,
        );
    }
    builder.material(Material::Glass);
    for pane in 0..if large { 3 } else { 2 } {
        let count = if large { 3.0 } else { 2.0 };
        let width = half * 2.0 / count;
        let y = -half + width * (pane as f32 + 0.5);
        slab(builder, [-0.62, y, 1.25], [0.02, width - 0.12, 1.9]);
    }
    slab(builder, [0.0, half, 1.25], [if large { 1.1 } else { 0.7 }, 0.02, 1.9]);
    builder.material(Material::Wood);
    slab(builder, [-0.35, 0.0, 0.46], [0.38, half * 1.3, 0.05]);
    builder.tinted(Material::Metal, DARK);
    for y in [-half * 0.5, half * 0.5] {
        slab(builder, [-0.35, y, 0.22], [0.06, 0.06, 0.44]);
    }
    builder.tinted(Material::Sign, SKY);
    slab(builder, [0.1, -half, 1.3], [0.9, 0.10, 1.7]);
    builder.tinted(Material::Sign, PINK);
    slab(builder, [0.1, -half, 1.3], [0.7, 0.11, 0.7]);
}

fn atm(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, BLUE);
    slab(builder, [0.0, 0.0, 0.5], [0.70, 0.80, 1.0]);
    slab(builder, [-0.10, 0.0, 1.35], [0.50, 0.80, 0.80]);
    builder.tinted(Material::Metal, GREY);
    let turn = Quat::from_rotation_y(0.5);
    builder.block_at(vec3(0.22, 0.0, 1.03), vec3(0.16, 0.34, 0.02), turn);
    builder.material(Material::Glass);
    slab(builder, [0.152, 0.05, 1.32], [0.02, 0.42, 0.30]);
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.155, -0.28, 1.30], [0.02, 0.14, 0.03]);
    for key in 0..12 {
        let (row, column) = (key / 3, key % 3);
        let at = vec3(0.22, 0.0, 1.03)
            + turn * vec3(-0.10 + 0.055 * row as f32, -0.06 + 0.06 * column as f32, 0.022);
        builder.block_at(at, vec3(0.02, 0.022, 0.006), turn);
    }
    builder.tinted(Material::Sign, WHITE);
    slab(builder, [0.155, 0.0, 1.64], [0.02, 0.7, 0.14]);
    builder.tinted(Material::Sign, YELLOW);
    slab(builder, [0.17, 0.0, 1.64], [0.01, 0.3, 0.08]);
}

fn mailbox(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, YELLOW);
    let arc = |x: f32| -> Vec<Vec3> {
        let mut ring = vec![vec3(x, 0.25, 0.22)];
        ring.extend((0..=10).map(|step| {
            let angle = PI * step as f32 / 10.0;
            vec3(x, 0.25 * angle.cos(), 0.98 + 0.25 * angle.sin())
        }));
        ring.push(vec3(x, -0.25, 0.22));
        ring
    };
    builder.loft(&[arc(-0.25), arc(0.25)], |_, _| None);
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.255, 0.0, 1.0], [0.02, 0.36, 0.05]);
    slab(builder, [0.252, 0.0, 0.62], [0.012, 0.14, 0.16]);
    builder.tinted(Material::Sign, WHITE);
    slab(builder, [0.252, 0.0, 0.80], [0.012, 0.26, 0.09]);
    builder.tinted(Material::Metal, DARK);
    legs(builder, 0.2, 0.2, 0.24, 0.03);
}

fn street_fountain(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREEN);
    builder.lathe(
        Vec3::ZERO,
        &[(0.18, 0.0), (0.17, 0.06), (0.11, 0.12), (0.10, 0.80), (0.14, 0.84), (0.14, 0.90)],
        8,
    );
    builder.lathe(Vec3::Z * 0.90, &[(0.15, 0.0), (0.10, 0.12), (0.04, 0.18), (0.0, 0.20)], 8);
    builder.tinted(Material::Metal, GREY);
    builder.pipe(&[vec3(0.10, 0.0, 0.70), vec3(0.20, 0.0, 0.72), vec3(0.21, 0.0, 0.66)], 0.016, 7);
    builder.rod(vec3(0.0, 0.12, 0.72), vec3(0.0, 0.18, 0.72), 0.03, 8);
    builder.tinted(Material::Concrete, STONE);
    builder.lathe(
        vec3(0.22, 0.0, 0.0),
        &[(0.15, 0.0), (0.18, 0.10), (0.19, 0.14), (0.15, 0.12)],
        12,
    );
    builder.material(Material::Water);
    builder.lathe(vec3(0.22, 0.0, 0.11), &[(0.155, 0.0), (0.155, 0.01)], 12);
}

fn vending_machine(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, RED);
    slab(builder, [0.0, 0.0, 0.95], [0.80, 1.0, 1.80]);
    builder.tinted(Material::Metal, BLACK);
    slab(builder, [0.0, 0.0, 0.03], [0.76, 0.96, 0.06]);
    builder.material(Material::Glass);
    slab(builder, [0.402, 0.12, 1.10], [0.02, 0.66, 1.20]);
    for shelf in 0..5 {
        for can in 0..6 {
            let hues = [RED, BLUE, GREEN, ORANGE, WHITE, YELLOW];
            builder.tinted(Material::Plastic, hues[(shelf + can) % 6]);
            slab(
                builder,
                [0.415, -0.13 + 0.1 * can as f32, 0.62 + 0.22 * shelf as f32],
                [0.01, 0.055, 0.12],
            );
        }
    }
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.41, 0.12, 0.26], [0.02, 0.60, 0.18]);
    slab(builder, [0.41, -0.36, 1.20], [0.02, 0.14, 0.40]);
    builder.material(Material::LampWhite);
    slab(builder, [0.41, 0.0, 1.78], [0.02, 0.90, 0.10]);
}

/// A chessboard on an easel.
fn calibrator(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREY);
    for (x, y) in [(0.18, -0.5), (0.18, 0.5), (-0.30, 0.0)] {
        builder.rod(vec3(x, y, 0.0), vec3(0.0, y * 0.5, 1.1), 0.02, 6);
    }
    builder.tinted(Material::Plastic, WHITE);
    slab(builder, [0.02, 0.0, 1.1], [0.02, 1.2, 1.0]);
    builder.tinted(Material::Plastic, BLACK);
    for row in 0..6 {
        for column in 0..8 {
            if (row + column) % 2 == 0 {
                let (y, z) = (-0.49 + 0.14 * column as f32, 0.75 + 0.14 * row as f32);
                slab(builder, [0.032, y, z], [0.004, 0.14, 0.14]);
            }
        }
    }
}

fn hydrant(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, RED);
    builder.lathe(
        Vec3::ZERO,
        &[
            (0.16, 0.0),
            (0.16, 0.04),
            (0.11, 0.06),
            (0.11, 0.52),
            (0.14, 0.54),
            (0.14, 0.58),
            (0.11, 0.60),
            (0.06, 0.70),
            (0.03, 0.74),
        ],
        10,
    );
    builder.tinted(Material::Metal, YELLOW);
    builder.rod(vec3(0.0, -0.20, 0.42), vec3(0.0, 0.20, 0.42), 0.055, 8);
    builder.rod(vec3(-0.19, 0.0, 0.38), vec3(0.19, 0.0, 0.38), 0.07, 8);
}
