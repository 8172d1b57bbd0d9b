//! Props of parks and gardens.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Quat, Vec3, vec3};
use mesh::{Material, Tag};

use crate::{
    catalogue::prop::parts::{Row, hue::*, slab},
    mesh_builder::MeshBuilder,
};

const D: Tag = Tag::Dynamic;
const S: Tag = Tag::Static;

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    ("static.prop.bench03", S, [0.62, 1.80, 0.84], 45.0, |c| bench(c, 3)),
    ("static.prop.gardenlamp", S, [0.24, 0.24, 0.86], 5.0, garden_lamp),
    ("static.prop.pergola", S, [3.20, 3.20, 2.60], 320.0, pergola),
    ("static.prop.plasticchair", D, [0.56, 0.56, 0.86], 2.6, plastic_chair),
    ("static.prop.plastictable", D, [0.90, 0.90, 0.72], 7.0, plastic_table),
    ("static.prop.slide", S, [2.60, 0.70, 1.85], 60.0, slide),
    ("static.prop.swing", S, [1.90, 2.60, 2.20], 80.0, swing),
    ("static.prop.swingcouch", S, [1.20, 1.90, 1.75], 45.0, swing_couch),
    ("static.prop.table", D, [1.60, 1.50, 0.75], 40.0, picnic_table),
    ("static.prop.trampoline", S, [3.05, 3.05, 2.35], 65.0, trampoline),
    ("static.prop.barbeque", D, [0.60, 1.10, 1.05], 28.0, barbeque),
    ("static.prop.clothesline", S, [0.60, 2.30, 1.40], 5.0, clothesline),
    ("static.prop.doghouse", S, [0.95, 0.80, 0.90], 25.0, doghouse),
    ("static.prop.gnome", D, [0.16, 0.18, 0.46], 3.0, gnome),
    ("static.prop.wateringcan", D, [0.50, 0.19, 0.34], 1.0, watering_can),
    ("static.prop.haybale", D, [1.30, 1.25, 1.25], 240.0, round_bale),
    ("static.prop.haybalelb", D, [1.00, 0.50, 0.40], 20.0, square_bale),
    ("static.prop.plantpot01", S, [0.50, 0.50, 0.90], 25.0, |c| pot(c, 1)),
    ("static.prop.plantpot02", S, [0.60, 0.60, 1.60], 40.0, |c| pot(c, 2)),
    ("static.prop.plantpot03", S, [1.20, 0.50, 0.75], 80.0, |c| pot(c, 3)),
    ("static.prop.plantpot04", S, [0.40, 0.40, 0.42], 9.0, |c| pot(c, 4)),
    ("static.prop.plantpot05", S, [0.90, 0.90, 0.85], 150.0, |c| pot(c, 5)),
    ("static.prop.plantpot06", S, [0.45, 0.45, 1.20], 30.0, |c| pot(c, 6)),
    ("static.prop.plantpot07", S, [1.60, 1.60, 0.95], 400.0, |c| pot(c, 7)),
    ("static.prop.plantpot08", S, [0.70, 0.70, 2.10], 70.0, |c| pot(c, 8)),
];

/// Three kinds of benches, one of them for streets.
pub(super) fn bench(builder: &mut MeshBuilder, make: u32) {
    if make == 2 {
        // A bench without a back, on stone blocks.
        builder.tinted(Material::Concrete, STONE);
        for y in [-0.6, 0.6] {
            slab(builder, [0.0, y, 0.20], [0.42, 0.20, 0.40]);
        }
        builder.material(Material::Wood);
        for slat in 0..5 {
            slab(builder, [-0.18 + 0.09 * slat as f32, 0.0, 0.425], [0.075, 1.8, 0.05]);
        }
        return;
    }
    let (slats, back) = if make == 1 { (4, 3) } else { (6, 5) };
    builder.material(Material::Wood);
    let step = 0.46 / slats as f32;
    for slat in 0..slats {
        slab(builder, [-0.20 + step * slat as f32, 0.0, 0.43], [step * 0.8, 1.7, 0.03]);
    }
    let step = 0.42 / back as f32;
    for slat in 0..back {
        let z = 0.52 + step * slat as f32;
        slab(builder, [-0.26 - 0.18 * (z - 0.5), 0.0, z], [0.025, 1.7, step * 0.75]);
    }
    if make == 1 {
        builder.tinted(Material::Metal, BLACK);
    }
    for y in [-0.72, 0.72] {
        slab(builder, [-0.20, y, 0.21], [0.05, 0.06, 0.42]);
        slab(builder, [0.20, y, 0.21], [0.05, 0.06, 0.42]);
        slab(builder, [0.0, y, 0.40], [0.46, 0.06, 0.04]);
        builder.rod(vec3(-0.24, y, 0.40), vec3(-0.34, y, 0.92), 0.025, 6);
        slab(builder, [0.0, y, 0.64], [0.52, 0.06, 0.035]);
        builder.rod(vec3(0.22, y, 0.42), vec3(0.22, y, 0.64), 0.022, 6);
    }
}

fn garden_lamp(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, BLACK);
    builder.lathe(
        Vec3::ZERO,
        &[(0.10, 0.0), (0.08, 0.03), (0.025, 0.06), (0.022, 0.58), (0.07, 0.60)],
        10,
    );
    builder.material(Material::LampWhite);
    builder.lathe(Vec3::Z * 0.60, &[(0.07, 0.0), (0.09, 0.14)], 8);
    builder.tinted(Material::Metal, BLACK);
    builder.lathe(Vec3::Z * 0.74, &[(0.12, 0.0), (0.05, 0.08), (0.015, 0.12)], 8);
}

fn pergola(builder: &mut MeshBuilder) {
    builder.material(Material::Wood);
    for (x, y) in [(1.35, 1.35), (1.35, -1.35), (-1.35, 1.35), (-1.35, -1.35)] {
        slab(builder, [x, y, 1.12], [0.14, 0.14, 2.24]);
        for (dx, dy) in [(0.3, 0.0), (0.0, 0.3)] {
            let inward = vec3(-dx * f32::signum(x), -dy * f32::signum(y), 0.0);
            builder.rod(vec3(x, y, 1.9), vec3(x, y, 2.22) + inward, 0.04, 4);
        }
    }
    for y in [-1.35, 1.35] {
        slab(builder, [0.0, y, 2.32], [3.2, 0.10, 0.18]);
    }
    for beam in 0..9 {
        slab(builder, [-1.4 + 0.35 * beam as f32, 0.0, 2.48], [0.07, 3.2, 0.16]);
    }
    for lath in 0..6 {
        slab(builder, [0.0, -1.25 + 0.5 * lath as f32, 2.58], [3.2, 0.04, 0.04]);
    }
}

fn plastic_chair(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, WHITE);
    slab(builder, [0.02, 0.0, 0.43], [0.46, 0.46, 0.03]);
    for (x, y) in [(0.22, 0.22), (0.22, -0.22), (-0.24, 0.22), (-0.24, -0.22)] {
        builder.cone(vec3(x * 1.1, y * 1.15, 0.0), vec3(x * 0.95, y, 0.44), [0.022, 0.03], 6);
    }
    for slat in 0..5 {
        let y = -0.18 + 0.09 * slat as f32;
        builder.rod(vec3(-0.20, y, 0.44), vec3(-0.30, y * 0.9, 0.84), 0.020, 5);
    }
    let top: Vec<Vec3> = (0..=6)
        .map(|step| {
            vec3(-0.30, -0.21 + 0.07 * step as f32, 0.80 + 0.05 * (PI * step as f32 / 6.0).sin())
        })
        .collect();
    builder.pipe(&top, 0.024, 6);
    for y in [-0.25, 0.25] {
        builder.pipe(&[vec3(0.22, y, 0.43), vec3(0.22, y, 0.64), vec3(-0.26, y, 0.66)], 0.022, 6);
    }
}

fn plastic_table(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, WHITE);
    builder.lathe(Vec3::Z * 0.68, &[(0.43, 0.0), (0.45, 0.01), (0.45, 0.035), (0.44, 0.04)], 24);
    for leg in 0..4 {
        let angle = FRAC_PI_2 * (leg as f32 + 0.5);
        let out = vec3(angle.cos(), angle.sin(), 0.0);
        builder.cone(out * 0.36, out * 0.26 + Vec3::Z * 0.69, [0.022, 0.035], 7);
    }
}

fn slide(builder: &mut MeshBuilder) {
    let chute = [
        vec3(-0.55, 0.0, 1.25),
        vec3(-0.30, 0.0, 1.20),
        vec3(0.55, 0.0, 0.50),
        vec3(0.95, 0.0, 0.28),
        vec3(1.30, 0.0, 0.26),
    ];
    for pair in chute.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        builder.tinted(Material::Plastic, YELLOW);
        for (y, lift) in [(0.0, 0.0), (0.24, 0.08), (-0.24, 0.08)] {
            let half = if y == 0.0 { vec3(0.0, 0.23, 0.0) } else { vec3(0.0, 0.015, 0.0) };
            let (from, to) = (a + Vec3::Y * y, b + Vec3::Y * y);
            let up = Vec3::Z * (lift + 0.02);
            builder.quad([from - half + up, to - half + up, to + half + up, from + half + up]);
            builder.quad([from + half, to + half, to - half, from - half]);
            builder.quad([from + half, from + half + up, to + half + up, to + half]);
            builder.quad([to - half, to - half + up, from - half + up, from - half]);
        }
    }
    builder.tinted(Material::Metal, RED);
    for y in [-0.26, 0.26] {
        builder.rod(vec3(-1.25, y, 0.0), vec3(-0.58, y, 1.30), 0.03, 7);
        builder.pipe(
            &[
                vec3(-0.58, y, 1.28),
                vec3(-0.66, y, 1.85),
                vec3(-0.28, y, 1.70),
                vec3(-0.25, y, 1.20),
            ],
            0.025,
            7,
        );
        builder.rod(vec3(-0.25, y, 1.2), vec3(-0.10, y, 0.0), 0.025, 7);
        builder.rod(vec3(0.95, y, 0.26), vec3(0.95, y, 0.0), 0.02, 6);
    }
    builder.tinted(Material::Metal, BLUE);
    for rung in 0..5 {
        let fraction = 0.14 + 0.19 * rung as f32;
        let at = vec3(-1.25, 0.0, 0.0).lerp(vec3(-0.58, 0.0, 1.30), fraction);
        builder.rod(at - Vec3::Y * 0.26, at + Vec3::Y * 0.26, 0.022, 6);
    }
}

fn swing(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, RED);
    for y in [-1.25, 1.25] {
        for x in [-0.92, 0.92] {
            builder.rod(vec3(x, y * 1.02, 0.0), vec3(0.0, y, 2.16), 0.035, 8);
        }
        builder.rod(vec3(-0.4, y, 1.2), vec3(0.4, y, 1.2), 0.025, 6);
    }
    builder.tinted(Material::Metal, BLUE);
    builder.rod(vec3(0.0, -1.3, 2.16), vec3(0.0, 1.3, 2.16), 0.04, 8);
    for y in [-0.55, 0.55] {
        builder.tinted(Material::Metal, GREY);
        for side in [-0.2, 0.2] {
            builder.rod(vec3(0.0, y + side, 2.14), vec3(0.0, y + side, 0.48), 0.008, 4);
        }
        builder.tinted(Material::Plastic, BLACK);
        slab(builder, [0.0, y, 0.46], [0.18, 0.46, 0.04]);
    }
}

fn swing_couch(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, DARK);
    for y in [-0.9, 0.9] {
        builder.rod(vec3(-0.58, y, 0.02), vec3(0.58, y, 0.02), 0.022, 6);
        builder.rod(vec3(-0.50, y, 0.02), vec3(0.0, y, 1.55), 0.025, 6);
        builder.rod(vec3(0.50, y, 0.02), vec3(0.0, y, 1.55), 0.025, 6);
        builder.rod(vec3(0.18, y * 0.86, 0.45), vec3(0.0, y * 0.9, 1.55), 0.01, 4);
    }
    builder.rod(vec3(0.0, -0.9, 1.55), vec3(0.0, 0.9, 1.55), 0.025, 6);
    builder.tinted(Material::Cloth, GREEN);
    slab(builder, [0.05, 0.0, 0.44], [0.55, 1.5, 0.12]);
    let lean = Quat::from_rotation_y(-0.25);
    builder.block_at(vec3(-0.28, 0.0, 0.74), vec3(0.06, 0.75, 0.30), lean);
    builder.tinted(Material::Cloth, WHITE);
    for y in [-0.5, 0.0, 0.5] {
        slab(builder, [0.05, y, 0.505], [0.50, 0.10, 0.02]);
    }
    builder.tinted(Material::Cloth, GREEN);
    for side in [1.0f32, -1.0] {
        let turn = Quat::from_rotation_y(side * 0.28);
        builder.block_at(vec3(side * 0.30, 0.0, 1.66), vec3(0.31, 0.94, 0.015), turn);
    }
    for scallop in 0..8 {
        for x in [-0.6, 0.6] {
            builder.ball(
                vec3(x, -0.82 + 0.235 * scallop as f32, 1.57),
                vec3(0.012, 0.11, 0.07),
                3,
                6,
            );
        }
    }
}

fn picnic_table(builder: &mut MeshBuilder) {
    builder.material(Material::Wood);
    for plank in 0..5 {
        slab(builder, [0.0, -0.30 + 0.15 * plank as f32, 0.73], [1.6, 0.135, 0.04]);
    }
    for side in [1.0f32, -1.0] {
        for plank in 0..2 {
            slab(builder, [0.0, side * (0.60 + 0.14 * plank as f32), 0.44], [1.6, 0.125, 0.04]);
        }
        let x = side * 0.58;
        slab(builder, [x, 0.0, 0.40], [0.05, 1.36, 0.09]);
        slab(builder, [x, 0.0, 0.68], [0.05, 0.70, 0.08]);
        for leg in [1.0f32, -1.0] {
            builder.rod(vec3(x, leg * 0.62, 0.0), vec3(x, leg * 0.24, 0.70), 0.05, 4);
        }
    }
}

fn trampoline(builder: &mut MeshBuilder) {
    builder.tinted(Material::Cloth, BLACK);
    builder.lathe(Vec3::Z * 0.72, &[(1.20, 0.0), (1.20, 0.02)], 28);
    builder.tinted(Material::Plastic, BLUE);
    builder.lathe(Vec3::Z * 0.71, &[(1.50, 0.0), (1.52, 0.04), (1.20, 0.05), (1.18, 0.01)], 28);
    for post in 0..8 {
        let angle = TAU * post as f32 / 8.0;
        let out = vec3(angle.cos(), angle.sin(), 0.0) * 1.5;
        builder.tinted(Material::Metal, GREY);
        if post % 2 == 0 {
            builder.rod(out * 0.92, out * 0.95 + Vec3::Z * 0.72, 0.025, 6);
        }
        builder.tinted(Material::Plastic, DARK);
        builder.rod(out + Vec3::Z * 0.5, out + Vec3::Z * 2.3, 0.03, 6);
        let next = TAU * (post + 1) as f32 / 8.0;
        let there = vec3(next.cos(), next.sin(), 0.0) * 1.5;
        for wire in 0..6 {
            let z = Vec3::Z * (0.95 + 0.26 * wire as f32);
            builder.rod(out + z, there + z, 0.006, 3);
        }
    }
}

fn barbeque(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, BLACK);
    let arc = |y: f32, up: f32| -> Vec<Vec3> {
        (0..=8)
            .map(|step| {
                let angle = PI * step as f32 / 8.0;
                vec3(0.28 * angle.cos(), y, 0.72 + up * 0.26 * angle.sin())
            })
            .collect()
    };
    builder.loft(&[arc(0.32, 1.0), arc(-0.32, 1.0)], |_, _| None);
    builder.loft(&[arc(-0.32, -1.0), arc(0.32, -1.0)], |_, _| None);
    builder.material(Material::Metal);
    builder.rod(vec3(0.30, -0.2, 0.84), vec3(0.30, 0.2, 0.84), 0.014, 6);
    for y in [-0.26, 0.26] {
        builder.rod(vec3(-0.24, y, 0.0), vec3(-0.18, y, 0.6), 0.018, 6);
        builder.rod(vec3(0.24, y, 0.08), vec3(0.18, y, 0.6), 0.018, 6);
        builder.material(Material::Rubber);
        builder.rod(vec3(0.24, y - 0.02, 0.08), vec3(0.24, y + 0.02, 0.08), 0.08, 10);
        builder.material(Material::Metal);
    }
    builder.material(Material::Wood);
    for y in [-0.45, 0.45] {
        slab(builder, [0.0, y, 0.72], [0.46, 0.20, 0.03]);
    }
    builder.tinted(Material::Metal, BLACK);
    builder.rod(vec3(-0.1, 0.2, 0.95), vec3(-0.1, 0.2, 1.05), 0.03, 8);
}

fn clothesline(builder: &mut MeshBuilder) {
    builder.material(Material::Metal);
    for y in [-0.7, 0.7] {
        builder.rod(vec3(-0.28, y, 0.0), vec3(0.10, y, 1.0), 0.014, 6);
        builder.rod(vec3(0.28, y, 0.0), vec3(-0.10, y, 1.0), 0.014, 6);
    }
    for x in [-0.10, 0.10] {
        builder.rod(vec3(x, -1.1, 1.0), vec3(x, 1.1, 1.0), 0.014, 6);
    }
    for y in [-0.7, 0.7] {
        builder.rod(vec3(0.0, y, 1.0), vec3(0.0, y * 1.6, 1.38), 0.012, 6);
    }
    for wire in 0..4 {
        let x = -0.09 + 0.06 * wire as f32;
        builder.rod(vec3(x, -1.1, 1.37), vec3(x, 1.1, 1.37), 0.005, 4);
    }
    for (y, hue, drop) in
        [(-0.75, WHITE, 0.7), (-0.2, SKY, 0.5), (0.25, RED, 0.55), (0.75, YELLOW, 0.8)]
    {
        builder.tinted(Material::Cloth, hue);
        slab(builder, [0.09, y, 1.36 - drop * 0.5], [0.012, 0.42, drop]);
        slab(builder, [0.03, y, 1.36 - drop * 0.35], [0.012, 0.42, drop * 0.7]);
    }
}

fn doghouse(builder: &mut MeshBuilder) {
    builder.tinted(Material::Wood, RED);
    slab(builder, [0.0, 0.0, 0.30], [0.84, 0.64, 0.56]);
    let gable = |x: f32| vec![vec3(x, 0.32, 0.58), vec3(x, 0.0, 0.86), vec3(x, -0.32, 0.58)];
    builder.loft(&[gable(-0.42), gable(0.42)], |_, _| None);
    builder.tinted(Material::Plastic, BLACK);
    slab(builder, [0.42, 0.0, 0.24], [0.01, 0.28, 0.36]);
    builder.rod(vec3(0.415, 0.0, 0.42), vec3(0.426, 0.0, 0.42), 0.14, 14);
    builder.tinted(Material::Wood, BROWN);
    for side in [1.0f32, -1.0] {
        let turn = Quat::from_rotation_x(-side * 0.72);
        builder.block_at(vec3(0.02, side * 0.19, 0.74), vec3(0.47, 0.26, 0.018), turn);
    }
    slab(builder, [0.0, 0.0, 0.01], [0.88, 0.70, 0.03]);
}

fn gnome(builder: &mut MeshBuilder) {
    builder.tinted(Material::Plastic, BROWN);
    for y in [-0.04, 0.04] {
        builder.ball(vec3(0.02, y, 0.02), vec3(0.055, 0.03, 0.025), 4, 8);
    }
    builder.tinted(Material::Cloth, BLUE);
    builder.lathe(Vec3::Z * 0.02, &[(0.06, 0.0), (0.075, 0.06), (0.07, 0.14), (0.04, 0.20)], 12);
    for side in [1.0f32, -1.0] {
        builder.cone(
            vec3(0.0, side * 0.05, 0.19),
            vec3(0.045, side * 0.085, 0.11),
            [0.022, 0.018],
            6,
        );
    }
    builder.tinted(Material::Plastic, BLACK);
    builder.rod(Vec3::Z * 0.09, Vec3::Z * 0.105, 0.077, 12);
    builder.material(Material::Skin);
    builder.ball(Vec3::Z * 0.25, Vec3::splat(0.052), 6, 10);
    builder.ball(vec3(0.055, 0.0, 0.245), Vec3::splat(0.014), 4, 6);
    builder.tinted(Material::Cloth, WHITE);
    builder.ball(vec3(0.035, 0.0, 0.20), vec3(0.034, 0.045, 0.055), 5, 8);
    builder.tinted(Material::Cloth, RED);
    builder.lathe(Vec3::Z * 0.275, &[(0.06, 0.0), (0.05, 0.03), (0.02, 0.12), (0.0, 0.185)], 12);
}

fn watering_can(builder: &mut MeshBuilder) {
    builder.tinted(Material::Metal, GREEN);
    builder.lathe(Vec3::ZERO, &[(0.09, 0.0), (0.095, 0.01), (0.085, 0.22), (0.07, 0.24)], 14);
    builder.cone(vec3(0.06, 0.0, 0.06), vec3(0.30, 0.0, 0.27), [0.026, 0.014], 8);
    builder.cone(vec3(0.29, 0.0, 0.26), vec3(0.335, 0.0, 0.30), [0.015, 0.045], 10);
    let handle: Vec<Vec3> = (0..=6)
        .map(|step| {
            let angle = 0.4 + 2.6 * step as f32 / 6.0;
            vec3(angle.cos() * 0.13 - 0.03, 0.0, 0.17 + angle.sin() * 0.16)
        })
        .collect();
    builder.pipe(&handle, 0.011, 6);
}

fn round_bale(builder: &mut MeshBuilder) {
    builder.tinted(Material::Grass, STRAW);
    builder.rod(vec3(0.0, -0.60, 0.62), vec3(0.0, 0.60, 0.62), 0.62, 22);
    for ring in 0..4 {
        builder.tinted(Material::Grass, if ring % 2 == 0 { TAN } else { STRAW });
        let radius = 0.56 - 0.14 * ring as f32;
        let reach = 0.605 + 0.006 * ring as f32;
        builder.rod(vec3(0.0, -reach, 0.62), vec3(0.0, reach, 0.62), radius, 18);
    }
    builder.tinted(Material::Cloth, WHITE);
    for y in [-0.35, 0.0, 0.35] {
        builder.rod(vec3(0.0, y - 0.012, 0.62), vec3(0.0, y + 0.012, 0.62), 0.625, 22);
    }
}

fn square_bale(builder: &mut MeshBuilder) {
    builder.tinted(Material::Grass, STRAW);
    slab(builder, [0.0, 0.0, 0.20], [0.98, 0.48, 0.38]);
    for tuft in 0..24 {
        let angle = tuft as f32 * 2.399;
        let at = vec3(angle.cos() * 0.49, angle.sin() * 0.24, 0.05 + 0.013 * tuft as f32);
        builder.rod(at, at + vec3(angle.cos() * 0.02, angle.sin() * 0.02, 0.05), 0.012, 3);
    }
    builder.tinted(Material::Cloth, ORANGE);
    for x in [-0.25, 0.25] {
        slab(builder, [x, 0.0, 0.20], [0.015, 0.49, 0.39]);
    }
}

fn pot(builder: &mut MeshBuilder, number: u32) {
    let foliage = |builder: &mut MeshBuilder, at: Vec3, radii: Vec3, seed: u32| {
        builder.material(Material::Leaves);
        for leaf in 0..5u32 {
            let angle = (leaf + seed) as f32 * 2.399;
            let out = vec3(angle.cos(), angle.sin(), 0.2 * (leaf % 3) as f32 - 0.2);
            builder.ball(at + out * radii * 0.5, radii * 0.66, 3, 6);
        }
        builder.ball(at, radii * 0.9, 4, 7);
    };
    let flowers = |builder: &mut MeshBuilder, at: Vec3, reach: f32, hue: [u8; 3]| {
        builder.tinted(Material::Cloth, hue);
        for flower in 0..9 {
            let angle = flower as f32 * 2.399;
            let out = reach * (0.3 + 0.7 * (flower as f32 / 9.0));
            builder.ball(
                at + vec3(angle.cos() * out, angle.sin() * out, 0.0),
                Vec3::splat(0.045),
                3,
                6,
            );
        }
    };
    match number {
        1 => {
            builder.tinted(Material::Concrete, TERRACOTTA);
            builder.lathe(
                Vec3::ZERO,
                &[(0.15, 0.0), (0.22, 0.36), (0.25, 0.37), (0.25, 0.44), (0.22, 0.43)],
                16,
            );
            foliage(builder, Vec3::Z * 0.66, vec3(0.24, 0.24, 0.24), 1);
        }
        2 => {
            builder.tinted(Material::Concrete, DARK);
            builder.lathe(Vec3::ZERO, &[(0.20, 0.0), (0.26, 0.50), (0.28, 0.52)], 4);
            builder.material(Material::Bark);
            builder.rod(Vec3::Z * 0.5, Vec3::Z * 1.1, 0.03, 6);
            foliage(builder, Vec3::Z * 1.3, Vec3::splat(0.28), 2);
        }
        3 => {
            builder.material(Material::Wood);
            slab(builder, [0.0, 0.0, 0.22], [1.2, 0.5, 0.40]);
            builder.tinted(Material::Wood, BROWN);
            for x in [-0.57, 0.57] {
                slab(builder, [x, 0.0, 0.22], [0.07, 0.52, 0.44]);
            }
            for bush in 0..4 {
                foliage(
                    builder,
                    vec3(-0.42 + 0.28 * bush as f32, 0.0, 0.54),
                    vec3(0.17, 0.19, 0.18),
                    bush,
                );
            }
            flowers(builder, Vec3::Z * 0.71, 0.4, PINK);
        }
        4 => {
            builder.tinted(Material::Concrete, TERRACOTTA);
            builder.lathe(Vec3::ZERO, &[(0.10, 0.0), (0.15, 0.16), (0.17, 0.17), (0.17, 0.21)], 14);
            builder.material(Material::Leaves);
            for blade in 0..14 {
                let angle = blade as f32 * 2.399;
                let out = vec3(angle.cos(), angle.sin(), 0.0);
                builder.cone(
                    out * 0.05 + Vec3::Z * 0.18,
                    out * 0.19 + Vec3::Z * 0.40,
                    [0.022, 0.0],
                    4,
                );
            }
        }
        5 => {
            builder.tinted(Material::Concrete, STONE);
            builder.lathe(
                Vec3::ZERO,
                &[
                    (0.30, 0.0),
                    (0.28, 0.06),
                    (0.20, 0.12),
                    (0.42, 0.40),
                    (0.45, 0.48),
                    (0.40, 0.46),
                ],
                20,
            );
            foliage(builder, Vec3::Z * 0.60, vec3(0.34, 0.34, 0.16), 4);
            flowers(builder, Vec3::Z * 0.78, 0.28, RED);
        }
        6 => {
            builder.tinted(Material::Plastic, WHITE);
            builder.lathe(Vec3::ZERO, &[(0.13, 0.0), (0.20, 0.55), (0.21, 0.56)], 16);
            builder.material(Material::Needles);
            builder.lathe(
                Vec3::Z * 0.55,
                &[(0.06, 0.0), (0.22, 0.08), (0.16, 0.30), (0.08, 0.52), (0.0, 0.66)],
                10,
            );
        }
        7 => {
            builder.tinted(Material::Concrete, STONE);
            builder.lathe(
                Vec3::ZERO,
                &[(0.76, 0.0), (0.80, 0.04), (0.80, 0.44), (0.76, 0.48), (0.68, 0.46)],
                8,
            );
            for bush in 0..5 {
                let angle = TAU * bush as f32 / 5.0;
                foliage(
                    builder,
                    vec3(angle.cos() * 0.4, angle.sin() * 0.4, 0.62),
                    Vec3::splat(0.26),
                    bush,
                );
            }
            flowers(builder, Vec3::Z * 0.86, 0.5, YELLOW);
        }
        _ => {
            builder.tinted(Material::Concrete, DARK);
            builder.lathe(Vec3::ZERO, &[(0.26, 0.0), (0.30, 0.44), (0.31, 0.46)], 16);
            builder.material(Material::Bark);
            builder.pipe(&[Vec3::Z * 0.4, vec3(0.03, 0.02, 0.9), vec3(-0.02, 0.0, 1.4)], 0.05, 7);
            builder.material(Material::Leaves);
            for frond in 0..10 {
                let angle = frond as f32 * TAU / 10.0;
                let out = vec3(angle.cos(), angle.sin(), 0.0);
                let top = vec3(-0.02, 0.0, 1.4);
                let rise = 0.5 + 0.18 * (frond % 2) as f32;
                builder.cone(top, top + out * 0.22 + Vec3::Z * rise * 0.9, [0.03, 0.05], 4);
                builder.cone(
                    top + out * 0.22 + Vec3::Z * rise * 0.9,
                    top + out * 0.36 + Vec3::Z * rise * 0.6,
                    [0.05, 0.0],
                    4,
                );
            }
        }
    }
}
