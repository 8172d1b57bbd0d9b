//! The faces of walkers: eyes, brows, nose, mouth, and of some a beard or glasses.

use glam::{Quat, Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

/// The head that a face belongs to. Metres.
pub(super) struct Face {
    /// The number of the walker, by which features vary.
    pub(super) number: usize,
    /// The middle of the head, and half its height.
    pub(super) center: Vec3,
    pub(super) half: f32,
    /// The colours of skin and hair, sRGB.
    pub(super) skin: [u8; 3],
    pub(super) hair: [u8; 3],
    pub(super) is_grown_man: bool,
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
    let skin = |part: [f32; 3]| {
        let mut color = face.skin.map(f32::from);
        color.iter_mut().zip(part).for_each(|(own, share)| *own *= share);
        color.map(|c| c as u8)
    };
    let iris = IRISES[random.below(IRISES.len())];
    let (wide, lift) = (random.between(0.9, 1.1), random.between(-0.02, 0.02));
    for side in [-1.0, 1.0] {
        let y = side * ASIDE * wide;
        // The white, the iris in front of it, the lid above, and the brow.
        builder.tinted(Material::Skin, [226, 222, 216]);
        builder.ball(at(0.655, y, EYE + lift), size(0.075, 0.125, 0.062), 4, 8);
        builder.tinted(Material::Plastic, iris);
        builder.ball(at(0.715, y * 0.99, EYE + lift), size(0.03, 0.052, 0.055), 4, 6);
        builder.tinted(Material::Skin, skin([0.86, 0.82, 0.80]));
        builder.ball(at(0.655, y, EYE + 0.055 + lift), size(0.09, 0.135, 0.032), 3, 8);
        builder.tinted(Material::Bark, face.hair.map(|c| (f32::from(c) * 0.8) as u8));
        let tilt = Quat::from_rotation_x(side * random.between(-0.16, -0.04));
        builder.block_at(at(0.735, y * 1.02, 0.205 + lift), size(0.05, 0.15, 0.026), tilt);
    }
    nose(builder, &at, skin([0.97, 0.93, 0.92]), random.between(0.85, 1.2));
    // The lips with the line between them.
    let broad = random.between(0.20, 0.27);
    builder.tinted(Material::Skin, skin([0.84, 0.62, 0.60]));
    builder.ball(at(0.690, 0.0, -0.475), size(0.06, broad, 0.034), 4, 8);
    builder.ball(at(0.690, 0.0, -0.545), size(0.055, broad * 0.86, 0.042), 4, 8);
    builder.tinted(Material::Skin, skin([0.45, 0.30, 0.30]));
    builder.ball(at(0.715, 0.0, -0.507), size(0.035, broad * 0.9, 0.010), 3, 8);
    if face.is_grown_man && face.number.is_multiple_of(4) {
        beard(builder, face);
    }
    if face.number % 7 == 3 {
        glasses(builder, &at, face.half);
    }
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

/// Adds a short beard over chin and jaw.
fn beard(builder: &mut MeshBuilder, face: &Face) {
    builder.tinted(Material::Bark, face.hair);
    let ring = |z: f32, x: f32, y: f32, ahead: f32| -> Vec<Vec3> {
        (0..12)
            .map(|side| {
                let angle = std::f32::consts::TAU * side as f32 / 12.0;
                let around = vec3(angle.cos() * x + ahead, angle.sin() * y, z);
                face.center + around * face.half
            })
            .collect()
    };
    builder.loft(
        &[
            ring(-1.03, 0.22, 0.22, 0.36),
            ring(-0.90, 0.46, 0.42, 0.26),
            ring(-0.62, 0.68, 0.60, 0.085),
        ],
        |_, _| None,
    );
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
