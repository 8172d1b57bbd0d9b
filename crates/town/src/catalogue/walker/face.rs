//! The faces of walkers: eyes, brows, ears, nose, mouth, and of some glasses.

use glam::{Quat, Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::{catalogue::cage::Surface, mesh_builder::MeshBuilder};

/// The head that a face belongs to. Metres.
pub(super) struct Face {
    /// The number of the walker, by which features vary.
    pub(super) number: usize,
    /// The middle of the head, and half its height.
    pub(super) center: Vec3,
    pub(super) half: f32,
    /// The skin of the head.
    pub(super) surface: Surface,
    /// The colours of skin and hair, sRGB.
    pub(super) skin: [u8; 3],
    pub(super) hair: [u8; 3],
}

/// The colours of irises, sRGB.
const IRISES: [[u8; 3]; 5] =
    [[62, 40, 24], [80, 52, 28], [70, 96, 120], [78, 92, 60], [40, 28, 20]];

/// The distance of an eye from the middle of the face, and its height, in half heads.
const ASIDE: f32 = 0.27;
const EYE: f32 = 0.03;

/// Adds the face, which looks along x.
pub(super) fn build(builder: &mut MeshBuilder, face: &Face) {
    let mut random = RandomStream::named(0xface, face.number as u64);
    let at = |x: f32, y: f32, z: f32| face.center + vec3(x, y, z) * face.half;
    let size = |x: f32, y: f32, z: f32| vec3(x, y, z) * face.half;
    // A point that many half heads ahead of the skin.
    let on = |ahead: f32, y: f32, z: f32| {
        let inside = at(0.0, y, z);
        let found = face.surface.cast(inside, Vec3::X);
        found.map_or(inside, |(point, _)| point) + Vec3::X * ahead * face.half
    };
    let skin = |part: [f32; 3]| {
        let mut color = face.skin.map(f32::from);
        color.iter_mut().zip(part).for_each(|(own, share)| *own *= share);
        color.map(|c| c as u8)
    };
    let iris = IRISES[random.below(IRISES.len())];
    let (wide, lift) = (random.between(0.92, 1.08), random.between(-0.02, 0.02));
    let brows = face.hair.map(|part| (f32::from(part) * 0.8) as u8);
    for side in [-1.0, 1.0] {
        let y = side * ASIDE * wide;
        // The socket, the white, the iris in front of it, the lid above, and the brow.
        builder.tinted(Material::Skin, skin([0.80, 0.74, 0.72]));
        builder.ball(on(-0.045, y, EYE + lift), size(0.06, 0.165, 0.10), 3, 6);
        builder.tinted(Material::Skin, [190, 186, 180]);
        builder.ball(on(-0.035, y, EYE + lift), size(0.06, 0.11, 0.046), 3, 6);
        builder.tinted(Material::Plastic, iris);
        builder.ball(on(0.008, y * 0.99, EYE + lift), size(0.025, 0.046, 0.046), 3, 6);
        builder.tinted(Material::Bark, brows);
        let tilt = Quat::from_rotation_x(side * random.between(-0.16, -0.04))
            * Quat::from_rotation_z(side * 0.35);
        builder.block_at(on(-0.005, y * 1.02, 0.185 + lift), size(0.025, 0.14, 0.024), tilt);
        builder.tinted(Material::Skin, skin([0.97, 0.90, 0.88]));
        let tilt = Quat::from_rotation_z(side * 0.4);
        ear(builder, at(-0.06, side * 0.70, -0.08), tilt, face.half);
    }
    nose(builder, &at, skin([0.98, 0.94, 0.93]), random.between(0.85, 1.15));
    // The lips with the line between them.
    let broad = random.between(0.19, 0.25);
    builder.tinted(Material::Skin, skin([0.86, 0.68, 0.66]));
    builder.ball(on(-0.025, 0.0, -0.475), size(0.05, broad, 0.032), 3, 6);
    builder.ball(on(-0.020, 0.0, -0.545), size(0.05, broad * 0.84, 0.040), 3, 6);
    builder.tinted(Material::Skin, skin([0.50, 0.36, 0.35]));
    builder.block_at(on(0.018, 0.0, -0.508), size(0.012, broad * 0.8, 0.009), Quat::IDENTITY);
    if face.number % 7 == 3 {
        glasses(builder, &at, face.half);
    }
}

/// Adds an ear: a flat ball whose upper half is the larger one.
fn ear(builder: &mut MeshBuilder, center: Vec3, turn: Quat, half: f32) {
    let ring = |z: f32, long: f32, thick: f32| -> Vec<Vec3> {
        (0..6)
            .map(|side| {
                let angle = std::f32::consts::TAU * side as f32 / 6.0;
                center + turn * vec3(angle.cos() * long, angle.sin() * thick, z) * half
            })
            .collect()
    };
    let rings = [
        ring(-0.19, 0.03, 0.03),
        ring(-0.12, 0.08, 0.05),
        ring(0.08, 0.12, 0.055),
        ring(0.18, 0.06, 0.03),
    ];
    builder.loft(&rings, |_, _| None);
}

/// Adds the nose: a ridge with a flat underside.
fn nose(builder: &mut MeshBuilder, at: &impl Fn(f32, f32, f32) -> Vec3, color: [u8; 3], big: f32) {
    builder.tinted(Material::Skin, color);
    let (tip, wing) = (0.70 + 0.25 * big, 0.125 * big);
    builder.solid(|builder| {
        let [bridge, left, right, tip_left, tip_right, below, inside] = [
            at(0.72, 0.0, 0.12),
            at(0.70, wing, -0.27),
            at(0.70, -wing, -0.27),
            at(tip, 0.05, -0.20),
            at(tip, -0.05, -0.20),
            at(0.74, 0.0, -0.33),
            at(0.55, 0.0, -0.12),
        ]
        .map(|point| builder.vertex(point));
        for corners in [
            [bridge, tip_left, left],
            [bridge, right, tip_right],
            [bridge, tip_right, tip_left],
            [left, tip_left, below],
            [tip_right, right, below],
            [tip_left, tip_right, below],
            [bridge, left, inside],
            [right, bridge, inside],
            [left, below, inside],
            [below, right, inside],
        ] {
            builder.triangle(corners);
        }
    });
}

/// Adds the frame of glasses.
fn glasses(builder: &mut MeshBuilder, at: &impl Fn(f32, f32, f32) -> Vec3, half: f32) {
    builder.tinted(Material::Plastic, [24, 24, 28]);
    let thin = 0.016 * half;
    for side in [-1.0, 1.0] {
        let corner = |y: f32, z: f32| at(0.80, side * y, EYE + z);
        let frame =
            [corner(0.09, 0.1), corner(0.45, 0.1), corner(0.43, -0.11), corner(0.12, -0.11)];
        for edge in 0..4 {
            builder.rod(frame[edge], frame[(edge + 1) % 4], thin, 4);
        }
        builder.rod(corner(0.45, 0.08), at(-0.05, side * 0.70, EYE + 0.08), thin, 4);
    }
    builder.rod(at(0.82, 0.09, EYE + 0.06), at(0.82, -0.09, EYE + 0.06), thin, 4);
}
