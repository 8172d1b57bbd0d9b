//! Containers, rubbish, and portable items.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Quat, Vec3, vec3};
use mesh::{Material, Tag};

use crate::{
    catalogue::prop::parts::{Row, heap, hue::*, legs, slab},
    mesh_builder::MeshBuilder,
};

const D: Tag = Tag::Dynamic;
const S: Tag = Tag::Static;

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    ("static.prop.barrel", D, [0.60, 0.60, 0.90], 18.0, barrel),
    ("static.prop.bin", S, [0.50, 0.50, 0.95], 15.0, bin),
    ("static.prop.clothcontainer", S, [1.15, 1.15, 2.15], 180.0, cloth_container),
    ("static.prop.container", S, [1.90, 1.06, 1.40], 130.0, wheeled_container),
    ("static.prop.glasscontainer", S, [1.50, 1.50, 1.75], 120.0, glass_container),
    ("static.prop.box01", D, [0.60, 0.50, 0.45], 4.0, |c| carton(c, 1.0, 0.0)),
    ("static.prop.box02", D, [0.40, 0.30, 0.30], 2.0, |c| carton(c, 0.8, 0.0)),
    ("static.prop.box03", D, [0.80, 0.45, 0.60], 6.0, |c| carton(c, 1.4, 1.1)),
    ("static.prop.creasedbox01", D, [0.60, 0.50, 0.32], 4.0, |c| creased(c, 1)),
    ("static.prop.creasedbox02", D, [0.45, 0.40, 0.22], 2.0, |c| creased(c, 2)),
    ("static.prop.creasedbox03", D, [0.75, 0.50, 0.14], 3.0, |c| creased(c, 3)),
    ("static.prop.trashbag", D, [0.58, 0.56, 0.62], 8.0, trash_bag),
    ("static.prop.colacan", D, [0.066, 0.066, 0.115], 0.4, cola_can),
    ("static.prop.garbage01", D, [0.90, 0.70, 0.30], 6.0, |c| garbage(c, 1)),
    ("static.prop.garbage02", D, [0.60, 0.60, 0.16], 3.0, |c| garbage(c, 2)),
    ("static.prop.garbage03", D, [1.10, 0.60, 0.24], 5.0, |c| garbage(c, 3)),
    ("static.prop.garbage04", D, [0.70, 0.90, 0.20], 4.0, |c| garbage(c, 4)),
    ("static.prop.garbage05", D, [0.50, 0.40, 0.12], 2.0, |c| garbage(c, 5)),
    ("static.prop.garbage06", D, [1.20, 1.00, 0.40], 9.0, |c| garbage(c, 6)),
    ("static.prop.platformgarbage01", D, [1.20, 1.00, 0.60], 35.0, platform),
    ("static.prop.trashcan01", S, [0.58, 0.74, 1.07], 14.0, |c| wheelie_bin(c, GREEN)),
    ("static.prop.trashcan02", S, [0.45, 0.45, 0.70], 4.0, round_can),
    ("static.prop.trashcan03", S, [0.42, 0.42, 1.00], 30.0, slatted_can),
    ("static.prop.trashcan04", S, [0.40, 0.32, 1.10], 12.0, post_can),
    ("static.prop.trashcan05", S, [0.90, 0.55, 1.20], 55.0, twin_can),
    ("static.prop.plasticbag", D, [0.34, 0.22, 0.42], 1.0, plastic_bag),
    ("static.prop.shoppingbag", D, [0.32, 0.14, 0.42], 1.5, shopping_bag),
    ("static.prop.shoppingcart", D, [0.96, 0.58, 1.02], 22.0, shopping_cart),
    ("static.prop.shoppingtrolley", D, [0.36, 0.34, 0.98], 3.0, shopping_trolley),
    ("static.prop.briefcase", D, [0.44, 0.13, 0.36], 3.0, briefcase),
    ("static.prop.guitarcase", D, [1.08, 0.40, 0.14], 4.0, guitar_case),
    ("static.prop.travelcase", D, [0.48, 0.28, 0.76], 9.0, travel_case),
    ("static.prop.bike helmet", D, [0.29, 0.21, 0.17], 0.3, bike_helmet),
    ("static.prop.motorhelmet", D, [0.34, 0.25, 0.26], 1.4, motor_helmet),
    ("static.prop.mobile", D, [0.15, 0.075, 0.010], 0.2, mobile),
    ("static.prop.purse", D, [0.28, 0.11, 0.30], 0.8, purse),
];

fn barrel(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, BLUE);
    builder.lathe(
        Vec3::ZERO,
        &[
            (0.28, 0.0),
            (0.30, 0.02),
            (0.29, 0.05),
            (0.29, 0.28),
            (0.305, 0.30),
            (0.29, 0.32),
            (0.29, 0.58),
            (0.305, 0.60),
            (0.29, 0.62),
            (0.29, 0.86),
            (0.30, 0.88),
            (0.28, 0.90),
            (0.27, 0.87),
        ],
        20,
    );
    builder.material(Material::Metal);
    builder.rod(vec3(0.14, 0.0, 0.87), vec3(0.14, 0.0, 0.895), 0.04, 8);
}

fn bin(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, DARK);
    builder.lathe(Vec3::ZERO, &[(0.20, 0.0), (0.24, 0.04), (0.25, 0.70), (0.26, 0.74)], 12);
    for y in [-0.24, 0.24] {
        slab(builder, [0.0, y, 0.80], [0.03, 0.02, 0.16]);
    }
    builder.tinted(Material::Metal, BLACK);
    builder.lathe(Vec3::Z * 0.84, &[(0.25, 0.0), (0.24, 0.05), (0.10, 0.11)], 12);
}

fn cloth_container(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, WHITE);
    slab(builder, [0.0, 0.0, 1.02], [1.15, 1.15, 1.90]);
    builder.tinted(Material::Metal, GREEN);
    slab(builder, [0.0, 0.0, 2.06], [1.05, 1.05, 0.18]);
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.56, 0.0, 1.62], [0.06, 0.80, 0.34]);
    builder.tinted(Material::Metal, GREY);
    slab(builder, [0.60, 0.0, 1.46], [0.14, 0.80, 0.04]);
    builder.tinted(Material::Sign, GREEN);
    slab(builder, [0.575, 0.0, 0.85], [0.01, 0.7, 0.5]);
    builder.tinted(Material::Plastic, BLACK);
    legs(builder, 0.5, 0.5, 0.1, 0.05);
}

fn wheeled_container(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, GREEN);
    let ring = |z: f32, x: f32, y: f32| {
        vec![vec3(x, -y, z), vec3(x, y, z), vec3(-x, y, z), vec3(-x, -y, z)]
    };
    builder.loft(
        &[
            ring(0.16, 0.70, 0.36),
            ring(0.24, 0.78, 0.42),
            ring(1.10, 0.92, 0.52),
            ring(1.14, 0.95, 0.53),
        ],
        |_, _| None,
    );
    for x in [-0.6, -0.3, 0.0, 0.3, 0.6f32] {
        for y in [-0.49, 0.49] {
            slab(builder, [x, y, 0.70], [0.06, 0.06, 0.78]);
        }
    }
    builder.tinted(Material::Plastic, DARK);
    // A lid with a rounded rear edge.
    let arc = |x: f32| -> Vec<Vec3> {
        (0..=10)
            .map(|step| {
                let angle = std::f32::consts::PI * step as f32 / 10.0;
                vec3(x, 0.53 * angle.cos(), 1.14 + 0.26 * angle.sin())
            })
            .collect()
    };
    builder.loft(&[arc(-0.95), arc(0.95)], |_, _| None);
    builder.material(Material::Rubber);
    for (x, y) in [(-0.6, -0.3), (-0.6, 0.3), (0.6, -0.3), (0.6, 0.3)] {
        builder.rod(vec3(x, y - 0.03, 0.1), vec3(x, y + 0.03, 0.1), 0.1, 12);
    }
}

fn glass_container(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, GREEN);
    builder.lathe(
        Vec3::ZERO,
        &[
            (0.66, 0.0),
            (0.72, 0.06),
            (0.75, 0.5),
            (0.72, 1.0),
            (0.60, 1.38),
            (0.36, 1.62),
            (0.10, 1.70),
        ],
        20,
    );
    builder.material(Material::Metal);
    builder.rod(Vec3::Z * 1.68, Vec3::Z * 1.75, 0.06, 8);
    for angle in [0.0, FRAC_PI_2, 2.0 * FRAC_PI_2, 3.0 * FRAC_PI_2] {
        let out = vec3(angle.cos(), angle.sin(), 0.0);
        builder.tinted(Material::Rubber, BLACK);
        builder.rod(out * 0.60 + Vec3::Z * 1.18, out * 0.74 + Vec3::Z * 1.22, 0.13, 12);
    }
    builder.tinted(Material::Sign, WHITE);
    slab(builder, [0.74, 0.0, 0.62], [0.02, 0.4, 0.3]);
}

fn carton(builder: &mut MeshBuilder, height: f32, flaps: f32) {
    builder.tinted(Material::Wood, CARTON);
    slab(builder, [0.0, 0.0, height * 0.5], [1.2, 1.0, height]);
    builder.tinted(Material::Plastic, TAN);
    slab(builder, [0.0, 0.0, height * 0.5], [1.205, 0.14, height + 0.005]);
    if flaps > 0.0 {
        builder.tinted(Material::Wood, CARTON);
        for side in [1.0f32, -1.0] {
            let turn = Quat::from_rotation_x(-side * flaps);
            let hinge = vec3(0.0, side * 0.5, height);
            builder.block_at(hinge + turn * vec3(0.0, side * 0.2, 0.0), vec3(0.6, 0.2, 0.01), turn);
        }
    }
}

/// A crushed box.
fn creased(builder: &mut MeshBuilder, number: u32) {
    builder.tinted(Material::Wood, CARTON);
    let sag = [0.0, 0.12, 0.22, 0.34][number as usize];
    let ring = |x: f32, z: f32, lean: f32| {
        vec![
            vec3(x + lean, -0.5, 0.0),
            vec3(x + lean, 0.52, 0.0),
            vec3(x - lean, 0.46 + sag, z * 0.9),
            vec3(x, 0.05, z * (1.0 - sag)),
            vec3(x + lean, -0.44 - sag * 0.5, z),
        ]
    };
    let (a, b) = (ring(-0.62, 0.8, -0.03), ring(-0.2, 0.8 - sag, 0.04));
    let (c, d) = (ring(0.18, 0.62 - sag, -0.05), ring(0.6, 0.84 - sag * 0.5, 0.03));
    builder.loft(&[a, b, c, d], |_, _| None);
    builder.tinted(Material::Plastic, TAN);
    slab(builder, [0.1, -0.2, 0.02], [1.25, 0.1, 0.02]);
    builder.tinted(Material::Wood, CARTON);
    let turn = Quat::from_rotation_y(0.5) * Quat::from_rotation_x(0.2);
    builder.block_at(vec3(0.66, 0.1, 0.3), vec3(0.16, 0.4, 0.01), turn);
}

fn trash_bag(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, BLACK);
    heap(builder, [0.0, 0.0], [0.30, 0.28, 0.48], 5);
    builder.lathe(Vec3::Z * 0.44, &[(0.10, 0.0), (0.035, 0.05), (0.09, 0.16), (0.05, 0.18)], 9);
    builder.tinted(Material::Plastic, RED);
    builder.rod(Vec3::Z * 0.475, Vec3::Z * 0.50, 0.045, 8);
}

fn cola_can(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREY);
    builder.lathe(Vec3::ZERO, &[(0.024, 0.0), (0.026, 0.004), (0.033, 0.012)], 14);
    builder.tinted(Material::Metal, RED);
    builder.lathe(Vec3::Z * 0.012, &[(0.033, 0.0), (0.033, 0.045)], 14);
    builder.tinted(Material::Metal, WHITE);
    builder.lathe(Vec3::Z * 0.057, &[(0.0331, 0.0), (0.0331, 0.012)], 14);
    builder.tinted(Material::Metal, RED);
    builder.lathe(Vec3::Z * 0.069, &[(0.033, 0.0), (0.033, 0.033)], 14);
    builder.tinted(Material::Metal, GREY);
    builder.lathe(Vec3::Z * 0.102, &[(0.033, 0.0), (0.027, 0.010), (0.027, 0.013)], 14);
}

fn garbage(builder: &mut MeshBuilder, number: u32) {
    let hues = [BROWN, DARK, WHITE, CARTON, SKY, TAN, BLACK];
    builder.tinted(Material::Cloth, hues[number as usize % 3]);
    heap(builder, [0.0, 0.0], [0.42, 0.36, 0.20], number);
    for piece in 0..number + 4 {
        let angle = piece as f32 * 2.399;
        let reach = 0.16 + 0.06 * (piece % 5) as f32;
        let at = vec3(angle.cos() * reach, angle.sin() * reach, 0.12 - 0.18 * (reach - 0.16));
        let turn =
            Quat::from_rotation_z(angle) * Quat::from_rotation_x(0.4 + 0.3 * (piece % 3) as f32);
        builder.tinted(Material::Plastic, hues[(piece + number) as usize % 7]);
        match (piece + number) % 3 {
            0 => builder.block_at(at, vec3(0.10, 0.06, 0.03), turn),
            1 => builder.rod(at - turn * Vec3::X * 0.09, at + turn * Vec3::X * 0.09, 0.032, 8),
            _ => builder.ball(at, vec3(0.09, 0.07, 0.05), 3, 6),
        }
    }
    slab(builder, [0.0, 0.0, 0.01], [0.3, 0.3, 0.02]);
}

/// A pallet with bags.
fn platform(builder: &mut MeshBuilder) {
    builder.material(Material::Wood);
    for y in [-0.42, -0.21, 0.0, 0.21, 0.42] {
        slab(builder, [0.0, y, 0.135], [1.2, 0.12, 0.022]);
    }
    for x in [-0.54, 0.0, 0.54] {
        slab(builder, [x, 0.0, 0.07], [0.12, 1.0, 0.10]);
        slab(builder, [x, 0.0, 0.011], [0.12, 1.0, 0.022]);
    }
    for (x, y, seed) in [(-0.28, -0.2, 3), (0.26, -0.18, 8), (0.0, 0.24, 4)] {
        builder.tinted(Material::Plastic, if seed == 8 { DARK } else { BLACK });
        heap(builder, [x, y], [0.28, 0.25, 0.56], seed);
    }
}

fn wheelie_bin(builder: &mut MeshBuilder, hue: [u8; 3]) {
    builder.tinted(Material::Plastic, hue);
    let ring = |z: f32, x: f32, y: f32, back: f32| {
        vec![vec3(x, -y, z), vec3(x, y, z), vec3(back, y, z), vec3(back, -y, z)]
    };
    builder.loft(
        &[
            ring(0.06, 0.22, 0.20, -0.22),
            ring(0.94, 0.30, 0.28, -0.30),
            ring(0.98, 0.32, 0.29, -0.34),
        ],
        |_, _| None,
    );
    builder.tinted(Material::Plastic, DARK);
    builder.loft(&[ring(0.99, 0.33, 0.29, -0.32), ring(1.05, 0.24, 0.26, -0.30)], |_, _| None);
    builder.rod(vec3(-0.36, -0.24, 0.96), vec3(-0.36, 0.24, 0.96), 0.02, 7);
    builder.material(Material::Rubber);
    for y in [-0.24, 0.24] {
        builder.rod(vec3(-0.24, y - 0.03, 0.1), vec3(-0.24, y + 0.03, 0.1), 0.1, 12);
    }
}

fn round_can(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREY);
    builder.lathe(Vec3::ZERO, &[(0.18, 0.0), (0.22, 0.60), (0.225, 0.62)], 16);
    for rib in 0..8 {
        let angle = TAU * rib as f32 / 8.0;
        let out = vec3(angle.cos(), angle.sin(), 0.0);
        builder.rod(out * 0.185 + Vec3::Z * 0.03, out * 0.222 + Vec3::Z * 0.58, 0.012, 4);
    }
    builder.tinted(Material::Metal, DARK);
    builder.lathe(Vec3::Z * 0.62, &[(0.23, 0.0), (0.18, 0.05), (0.04, 0.07)], 16);
    builder.rod(vec3(-0.05, 0.0, 0.705), vec3(0.05, 0.0, 0.705), 0.012, 6);
}

fn slatted_can(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, BLACK);
    builder.lathe(Vec3::ZERO, &[(0.17, 0.0), (0.17, 0.90)], 16);
    builder.material(Material::Wood);
    for slat in 0..14 {
        let angle = TAU * slat as f32 / 14.0;
        let turn = Quat::from_rotation_z(angle);
        builder.block_at(turn * Vec3::X * 0.195 + Vec3::Z * 0.46, vec3(0.015, 0.032, 0.40), turn);
    }
    builder.tinted(Material::Metal, BLACK);
    builder.lathe(Vec3::Z * 0.88, &[(0.215, 0.0), (0.215, 0.03)], 16);
    builder.lathe(Vec3::Z * 0.94, &[(0.21, 0.0), (0.18, 0.05), (0.05, 0.06)], 16);
}

fn post_can(builder: &mut MeshBuilder) {
    builder.material(Material::Metal);
    builder.rod(vec3(-0.17, 0.0, 0.0), vec3(-0.17, 0.0, 1.1), 0.03, 8);
    builder.tinted(Material::Plastic, ORANGE);
    builder.lathe(
        vec3(0.03, 0.0, 0.45),
        &[(0.12, 0.0), (0.155, 0.04), (0.16, 0.46), (0.15, 0.50)],
        14,
    );
    builder.tinted(Material::Plastic, BLACK);
    builder.lathe(vec3(0.03, 0.0, 0.98), &[(0.16, 0.0), (0.12, 0.06), (0.03, 0.08)], 14);
    slab(builder, [0.17, 0.0, 0.86], [0.03, 0.16, 0.06]);
}

fn twin_can(builder: &mut MeshBuilder) {
    for (y, hue) in [(-0.22, BLUE), (0.22, YELLOW)] {
        builder.tinted(Material::Metal, GREY);
        slab(builder, [0.0, y, 0.52], [0.50, 0.42, 0.92]);
        builder.tinted(Material::Metal, hue);
        slab(builder, [0.255, y, 0.46], [0.012, 0.34, 0.70]);
        builder.tinted(Material::Plastic, BLACK);
        slab(builder, [0.255, y, 0.90], [0.014, 0.24, 0.10]);
    }
    builder.tinted(Material::Metal, DARK);
    slab(builder, [0.0, 0.0, 0.03], [0.46, 0.84, 0.06]);
    slab(builder, [0.0, 0.0, 1.05], [0.55, 0.90, 0.04]);
    builder.lathe(Vec3::Z * 1.07, &[(0.26, 0.0), (0.2, 0.1), (0.03, 0.13)], 4);
}

fn plastic_bag(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, WHITE);
    heap(builder, [0.0, 0.0], [0.17, 0.11, 0.30], 11);
    for side in [1.0f32, -1.0] {
        let points = [
            vec3(side * 0.10, 0.0, 0.20),
            vec3(side * 0.08, 0.02, 0.40),
            vec3(side * 0.03, 0.02, 0.42),
            vec3(side * 0.02, 0.0, 0.28),
        ];
        builder.pipe(&points, 0.010, 5);
    }
}

fn shopping_bag(builder: &mut MeshBuilder) {
    builder.tinted(Material::Wood, TAN);
    let ring = |z: f32, x: f32, y: f32| {
        vec![vec3(x, -y, z), vec3(x, y, z), vec3(-x, y, z), vec3(-x, -y, z)]
    };
    builder
        .loft(&[ring(0.0, 0.15, 0.065), ring(0.28, 0.16, 0.07), ring(0.34, 0.16, 0.05)], |_, _| {
            None
        });
    builder.tinted(Material::Wood, RED);
    slab(builder, [0.0, 0.068, 0.17], [0.14, 0.01, 0.14]);
    builder.tinted(Material::Cloth, BROWN);
    for y in [-0.04, 0.04] {
        let points =
            [vec3(-0.06, y, 0.33), vec3(-0.05, y, 0.41), vec3(0.05, y, 0.41), vec3(0.06, y, 0.33)];
        builder.pipe(&points, 0.006, 5);
    }
}

fn shopping_cart(builder: &mut MeshBuilder) {
    builder.material(Material::Metal);
    let corners = |z: f32, front: f32, back: f32, half: f32| {
        [vec3(front, -half, z), vec3(front, half, z), vec3(back, half, z), vec3(back, -half, z)]
    };
    let (low, high) = (corners(0.48, 0.36, -0.30, 0.17), corners(0.92, 0.48, -0.40, 0.27));
    for side in 0..4 {
        let next = (side + 1) % 4;
        for bar in 0..5 {
            let fraction = bar as f32 / 4.0;
            let (a, b) =
                (low[side].lerp(high[side], fraction), low[next].lerp(high[next], fraction));
            builder.rod(a, b, if bar == 4 { 0.013 } else { 0.007 }, 5);
        }
        for bar in 0..7 {
            let fraction = bar as f32 / 7.0;
            let (a, b) =
                (low[side].lerp(low[next], fraction), high[side].lerp(high[next], fraction));
            builder.rod(a, b, 0.005, 4);
        }
    }
    for bar in 0..6 {
        let fraction = bar as f32 / 5.0;
        builder.rod(low[0].lerp(low[3], fraction), low[1].lerp(low[2], fraction), 0.006, 4);
    }
    for y in [-0.22, 0.22f32] {
        builder.pipe(
            &[vec3(-0.40, y, 0.90), vec3(-0.26, y, 0.20), vec3(0.40, y * 0.7, 0.16)],
            0.014,
            6,
        );
        builder.rod(vec3(-0.40, y, 0.90), vec3(-0.47, y, 1.0), 0.014, 6);
    }
    builder.tinted(Material::Plastic, RED);
    builder.rod(vec3(-0.47, -0.26, 1.0), vec3(-0.47, 0.26, 1.0), 0.022, 8);
    builder.material(Material::Rubber);
    for (x, y) in [(-0.24, -0.22), (-0.24, 0.22), (0.38, -0.15), (0.38, 0.15)] {
        builder.rod(vec3(x, y - 0.015, 0.065), vec3(x, y + 0.015, 0.065), 0.065, 12);
        builder.rod(vec3(x, y, 0.06), vec3(x, y, 0.20), 0.012, 5);
    }
}

fn shopping_trolley(builder: &mut MeshBuilder) {
    builder.tinted(Material::Cloth, RED);
    let ring = |z: f32, x: f32, y: f32| {
        vec![
            vec3(x, -y, z),
            vec3(x, y, z),
            vec3(x - 0.06, y + 0.02, z),
            vec3(-x, y, z),
            vec3(-x, -y, z),
            vec3(x - 0.06, -y - 0.02, z),
        ]
    };
    builder.loft(
        &[
            ring(0.10, 0.11, 0.13),
            ring(0.20, 0.14, 0.15),
            ring(0.58, 0.15, 0.16),
            ring(0.66, 0.12, 0.13),
        ],
        |_, _| None,
    );
    builder.tinted(Material::Cloth, DARK);
    slab(builder, [0.155, 0.0, 0.30], [0.03, 0.22, 0.22]);
    builder.material(Material::Metal);
    for y in [-0.11, 0.11] {
        builder.pipe(&[vec3(-0.10, y, 0.06), vec3(-0.16, y, 0.60), vec3(-0.17, y, 0.97)], 0.010, 6);
    }
    builder.tinted(Material::Rubber, BLACK);
    builder.rod(vec3(-0.17, -0.12, 0.97), vec3(-0.17, 0.12, 0.97), 0.014, 7);
    for y in [-0.15, 0.15] {
        builder.rod(vec3(-0.10, y - 0.015, 0.08), vec3(-0.10, y + 0.015, 0.08), 0.08, 14);
    }
}

fn briefcase(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, BROWN);
    slab(builder, [0.0, 0.0, 0.15], [0.44, 0.12, 0.30]);
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.0, 0.0, 0.15], [0.445, 0.012, 0.305]);
    builder.pipe(
        &[
            vec3(-0.07, 0.0, 0.30),
            vec3(-0.06, 0.0, 0.355),
            vec3(0.06, 0.0, 0.355),
            vec3(0.07, 0.0, 0.30),
        ],
        0.011,
        6,
    );
    builder.tinted(Material::Metal, YELLOW);
    for x in [-0.13, 0.13] {
        slab(builder, [x, 0.0, 0.295], [0.04, 0.13, 0.02]);
    }
}

fn guitar_case(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, BLACK);
    let outline: [(f32, f32); 9] = [
        (-0.52, 0.06),
        (-0.48, 0.16),
        (-0.36, 0.20),
        (-0.22, 0.15),
        (-0.14, 0.145),
        (-0.02, 0.17),
        (0.06, 0.09),
        (0.40, 0.055),
        (0.54, 0.075),
    ];
    let rings: Vec<Vec<Vec3>> = outline
        .iter()
        .map(|(x, half)| {
            let thick = if *x < 0.08 { 0.14 } else { 0.10 };
            [
                (0.9, 0.0),
                (1.0, 0.03),
                (1.0, thick - 0.03),
                (0.9, thick),
                (-0.9, thick),
                (-1.0, thick - 0.03),
                (-1.0, 0.03),
                (-0.9, 0.0),
            ]
            .map(|(y, z): (f32, f32)| vec3(*x, y * half, z))
            .to_vec()
        })
        .collect();
    builder.loft(&rings, |_, _| None);
    builder.material(Material::Metal);
    for x in [-0.40, -0.10, 0.30] {
        slab(builder, [x, 0.14 - 0.05 * f32::from(u8::from(x > 0.2)), 0.07], [0.04, 0.10, 0.04]);
    }
    builder.tinted(Material::Plastic, DARK);
    builder.pipe(
        &[
            vec3(-0.22, -0.13, 0.07),
            vec3(-0.20, -0.20, 0.07),
            vec3(-0.08, -0.20, 0.07),
            vec3(-0.06, -0.14, 0.07),
        ],
        0.012,
        6,
    );
}

fn travel_case(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, BLUE);
    let ring = |z: f32, x: f32, y: f32| {
        let c = 0.04;
        vec![
            vec3(x, -y + c, z),
            vec3(x, y - c, z),
            vec3(x - c, y, z),
            vec3(-x + c, y, z),
            vec3(-x, y - c, z),
            vec3(-x, -y + c, z),
            vec3(-x + c, -y, z),
            vec3(x - c, -y, z),
        ]
    };
    builder.loft(
        &[
            ring(0.05, 0.20, 0.11),
            ring(0.08, 0.23, 0.13),
            ring(0.56, 0.23, 0.13),
            ring(0.60, 0.20, 0.11),
        ],
        |_, _| None,
    );
    for x in [-0.15, -0.05, 0.05, 0.15] {
        slab(builder, [x, 0.0, 0.32], [0.025, 0.272, 0.42]);
    }
    builder.material(Material::Metal);
    for x in [-0.09, 0.09] {
        builder.rod(vec3(x, -0.09, 0.58), vec3(x, -0.09, 0.75), 0.009, 6);
    }
    builder.tinted(Material::Plastic, BLACK);
    builder.rod(vec3(-0.11, -0.09, 0.75), vec3(0.11, -0.09, 0.75), 0.014, 7);
    for (x, y) in [(-0.18, -0.09), (-0.18, 0.09), (0.18, -0.09), (0.18, 0.09)] {
        builder.rod(vec3(x - 0.012, y, 0.025), vec3(x + 0.012, y, 0.025), 0.025, 8);
    }
}

fn bike_helmet(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, RED);
    shell(builder, vec3(0.145, 0.105, 0.16), 0.0);
    builder.tinted(Material::Plastic, BLACK);
    for y in [-0.06, 0.0, 0.06] {
        let points: Vec<Vec3> = (0..7)
            .map(|step| {
                let angle = 0.5 + 2.2 * step as f32 / 6.0;
                vec3(angle.cos() * 0.148, y, angle.sin() * 0.164 * (1.0 - 4.0 * y * y * 6.0))
            })
            .collect();
        builder.pipe(&points, 0.012, 5);
    }
    slab(builder, [0.155, 0.0, 0.035], [0.05, 0.14, 0.012]);
}

/// The upper half of an ellipsoid; its flat side is open.
fn shell(builder: &mut MeshBuilder, radii: Vec3, lift: f32) {
    let stack: Vec<Vec<Vec3>> = (0..=7)
        .map(|ring| {
            let polar = FRAC_PI_2 * ring as f32 / 7.0;
            let cos = if ring == 7 { 0.0 } else { polar.cos() };
            (0..16)
                .map(|side| {
                    let angle = TAU * side as f32 / 16.0;
                    radii * vec3(angle.cos() * cos, angle.sin() * cos, polar.sin()) + Vec3::Z * lift
                })
                .collect()
        })
        .collect();
    builder.loft(&stack, |_, _| None);
}

fn motor_helmet(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, WHITE);
    builder.ball(Vec3::Z * 0.14, vec3(0.15, 0.125, 0.13), 9, 16);
    slab(builder, [0.10, 0.0, 0.05], [0.14, 0.13, 0.09]);
    builder.material(Material::Glass);
    builder.ball(vec3(0.03, 0.0, 0.15), vec3(0.135, 0.118, 0.055), 6, 16);
    builder.tinted(Material::Plastic, BLACK);
    builder.rod(vec3(0.0, -0.128, 0.14), vec3(0.0, 0.128, 0.14), 0.022, 10);
    builder.tinted(Material::Plastic, RED);
    slab(builder, [-0.02, 0.0, 0.258], [0.20, 0.04, 0.024]);
}

fn mobile(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.0, 0.0, 0.0045], [0.15, 0.075, 0.009]);
    builder.tinted(Material::Glass, DARK);
    slab(builder, [0.0, 0.0, 0.0095], [0.138, 0.068, 0.001]);
}

fn purse(builder: &mut MeshBuilder) {
    builder.tinted(Material::Cloth, PINK);
    let ring = |z: f32, x: f32, y: f32| {
        vec![vec3(x, -y, z), vec3(x, y, z), vec3(-x, y, z), vec3(-x, -y, z)]
    };
    builder.loft(
        &[
            ring(0.0, 0.12, 0.045),
            ring(0.03, 0.14, 0.055),
            ring(0.12, 0.14, 0.05),
            ring(0.17, 0.12, 0.03),
        ],
        |_, _| None,
    );
    slab(builder, [0.0, 0.05, 0.12], [0.24, 0.012, 0.10]);
    builder.tinted(Material::Metal, YELLOW);
    slab(builder, [0.0, 0.058, 0.09], [0.04, 0.01, 0.03]);
    builder.tinted(Material::Cloth, BROWN);
    builder.pipe(
        &[
            vec3(-0.11, 0.0, 0.16),
            vec3(-0.08, 0.0, 0.26),
            vec3(0.0, 0.0, 0.295),
            vec3(0.08, 0.0, 0.26),
            vec3(0.11, 0.0, 0.16),
        ],
        0.007,
        6,
    );
}
