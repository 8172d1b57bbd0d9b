//! The inside of a car: floor, dashboard, steering wheel, seats, lining, and its occupants.

use std::f32::consts::TAU;

use glam::{Quat, Vec3, vec3};
use mesh::{Face, Material};

use crate::{
    catalogue::{
        cage::{Part, Skin},
        profile::{Measure, SHELL, Silhouette},
        rig::OCCUPANTS,
    },
    mesh_builder::MeshBuilder,
    subdivision::Cage,
};

/// The distance from the outer skin to the lining. Metres.
const LINING_M: f32 = 0.035;
const TRIM: [u8; 3] = [44, 44, 47];
const HEADLINER: [u8; 3] = [150, 147, 142];
const SEAT: [u8; 3] = [66, 64, 62];

/// Where the occupants of a car sit, in actor space. Metres.
struct Cabin {
    half: f32,
    floor: f32,
    belt: f32,
    roof: f32,
    /// x of the lower end of the windscreen, and of the rear end of the cabin.
    dash: f32,
    /// x and height of the lower edge of the windscreen.
    cowl: [f32; 2],
    rear: f32,
    /// x of the hips in each row.
    rows: Vec<f32>,
}

impl Cabin {
    fn of(shape: &Silhouette, measure: &Measure) -> Cabin {
        let cuts = shape.door_cuts();
        let height = measure.size_m.z;
        let (front, back) = (cuts[0].0, cuts[cuts.len() - 1].1);
        let x = |fraction: f32| measure.at(fraction);
        let first = x(cuts[0].0 + (cuts[0].1 - cuts[0].0) * 0.66);
        let rear = x((back + 0.04).min(0.93));
        let mut rows = vec![first];
        let second = (first - 0.84).max(rear + 0.16);
        if cuts.len() > 1 || first - second > 0.7 {
            rows.push(second);
        }
        Cabin {
            half: measure.body_m * 0.5,
            floor: shape.clearance_m + 0.08,
            belt: shape.belt(front) * height,
            roof: shape.top((front + back) * 0.5) * height - 0.06,
            dash: x(front) + 0.02,
            cowl: shape.cowl().map_or([x(front); 2], |(at, z)| [x(at), z * height]),
            rear: if rows.len() > 1 { second - 0.38 } else { rear.min(first - 0.4) },
            rows,
        }
    }

    /// The height of the hips: the roof clears the heads.
    fn hip(&self) -> f32 {
        (self.roof - 0.86).min(self.floor + 0.42).max(self.floor + 0.16)
    }

    fn lateral(&self) -> f32 {
        self.half * 0.43
    }
}

/// Adds the lining of the coarse cage's roof and doors, seen through glass and open doors.
pub(super) fn lining(builder: &mut MeshBuilder, cage: &Cage<Skin>) {
    let mut normals = vec![Vec3::ZERO; cage.points.len()];
    let point = |index: u32| cage.points[index as usize];
    for (corners, _) in &cage.faces {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| point(corners[k % corners.len()]));
        let normal = (c - a).cross(d - b).normalize_or_zero();
        corners.iter().for_each(|corner| normals[*corner as usize] += normal);
    }
    let inner = cage.points.iter().zip(&normals);
    let points = inner.map(|(p, n)| *p - n.normalize_or_zero() * LINING_M).collect();
    let is_lined = |skin: &Skin| match skin.part {
        Part::Roof => skin.material == Material::CarPaint,
        Part::Door(_) => skin.material != Material::Glass,
        Part::Body => false,
    };
    let faces = cage.faces.iter().filter(|(_, skin)| is_lined(skin));
    let faces = faces.map(|(c, skin)| (c.iter().rev().copied().collect(), *skin)).collect();
    let lining = Cage { points, faces, creases: Default::default() };
    builder.material(Material::Cloth);
    builder.cage(&lining, |usual, skin: Skin| {
        let (object, rgb) = match skin.part {
            Part::Door(number) => (SHELL + 1 + number, TRIM),
            _ => (usual.object, HEADLINER),
        };
        Face { object, tint: Face::tint(rgb), ..usual }
    });
}

/// Adds floor, dashboard, steering wheel and seats as part of the current object, and the occupants
/// as [`OCCUPANTS`]. `number` varies them.
pub(super) fn furnish(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    number: usize,
) {
    let cabin = Cabin::of(shape, measure);
    let (half, hip) = (cabin.half, cabin.hip());
    builder.tinted(Material::Cloth, TRIM);
    builder.block(
        vec3(cabin.rear, -half * 0.88, cabin.floor - 0.03),
        vec3(cabin.dash, half * 0.88, cabin.floor),
    );
    // The shelf behind the last row, and the wall below it.
    builder.block(
        vec3(cabin.rear - 0.06, -half * 0.84, cabin.floor),
        vec3(cabin.rear - 0.02, half * 0.84, cabin.belt - 0.06),
    );
    builder.tinted(Material::Plastic, TRIM);
    let deep = cabin.dash - 0.34;
    let ring = |x: f32, low: f32, high: f32| {
        [(-1.0, low), (-1.0, high), (1.0, high), (1.0, low)]
            .map(|(side, z)| vec3(x, side * half * 0.84, z))
            .to_vec()
    };
    builder.solid(|builder| {
        builder.loft(
            &[
                ring(deep, cabin.belt - 0.24, cabin.belt - 0.10),
                ring(deep + 0.05, cabin.belt - 0.30, cabin.belt - 0.03),
                ring(cabin.dash + 0.05, cabin.belt - 0.32, cabin.belt - 0.02),
                ring(
                    cabin.cowl[0].max(cabin.dash + 0.06) - 0.04,
                    cabin.belt - 0.32,
                    (cabin.belt - 0.02).min(cabin.cowl[1] - 0.03),
                ),
            ],
            |_, _| None,
        );
    });
    builder
        .block(vec3(cabin.rows[0] - 0.1, -0.10, cabin.floor), vec3(deep + 0.1, 0.10, hip + 0.06));
    wheel(builder, steering(&cabin));
    for (row, x) in cabin.rows.iter().enumerate() {
        for side in [1.0, -1.0] {
            builder.tinted(Material::Cloth, SEAT);
            let (wide, height) = if row > 0 { (0.27, 0.60) } else { (0.25, 0.68) };
            seat(builder, vec3(*x, side * cabin.lateral(), hip), wide, height);
        }
    }
    builder.material(Material::LampInterior);
    let middle = (cabin.dash + cabin.rear) * 0.5;
    builder.block(
        vec3(middle - 0.06, -0.08, cabin.roof - 0.02),
        vec3(middle + 0.06, 0.08, cabin.roof),
    );
    builder.object(OCCUPANTS);
    person(builder, vec3(cabin.rows[0], cabin.lateral(), hip), number, Some(steering(&cabin)));
    if number % 3 == 1 {
        person(builder, vec3(cabin.rows[0], -cabin.lateral(), hip), number + 5, None);
    }
    if number % 5 == 3 && cabin.rows.len() > 1 && cabin.roof - hip > 0.84 {
        person(builder, vec3(cabin.rows[1], -cabin.lateral(), hip), number + 9, None);
    }
}

/// The middle of the steering wheel.
fn steering(cabin: &Cabin) -> Vec3 {
    vec3(cabin.rows[0] + 0.40, cabin.lateral(), cabin.hip() + 0.34)
}

/// The tilt of the steering wheel: its axis points at the driver and upwards.
fn tilt() -> Quat {
    Quat::from_rotation_y(-1.15)
}

/// Adds a steering wheel.
pub(super) fn wheel(builder: &mut MeshBuilder, middle: Vec3) {
    builder.tinted(Material::Plastic, [24, 24, 26]);
    let rim = |step: u32| {
        let angle = TAU * step as f32 / 12.0;
        middle + tilt() * vec3(angle.cos() * 0.18, angle.sin() * 0.18, 0.0)
    };
    for step in 0..12 {
        builder.rod(rim(step), rim(step + 1), 0.014, 5);
    }
    for step in [0, 3, 9] {
        builder.rod(middle, rim(step), 0.016, 4);
    }
    let axis = tilt() * Vec3::Z;
    builder.rod(middle - axis * 0.02, middle + axis * 0.03, 0.06, 8);
    builder.rod(middle, middle - axis * 0.3, 0.03, 6);
}

/// Adds a seat of half this width about a hip point, with cushions of rounded section and a head
/// restraint at this height.
pub(super) fn seat(builder: &mut MeshBuilder, hip: Vec3, wide: f32, height: f32) {
    // Rings across the cushion, from its front edge up to the top of the back.
    let ring = |center: Vec3, lean: f32, thick: f32, wide: f32| -> Vec<Vec3> {
        let out = Quat::from_rotation_y(lean);
        [
            (-1.0, -0.6),
            (-0.8, -1.0),
            (0.8, -1.0),
            (1.0, -0.6),
            (1.0, 0.6),
            (0.85, 1.0),
            (-0.85, 1.0),
            (-1.0, 0.6),
        ]
        .map(|(y, z): (f32, f32)| hip + center + out * vec3(0.0, y * wide, z * thick))
        .to_vec()
    };
    builder.solid(|builder| {
        let rings = [
            ring(vec3(0.44, 0.0, -0.13), 0.3, 0.05, wide * 0.9),
            ring(vec3(0.38, 0.0, -0.12), 0.1, 0.08, wide),
            ring(vec3(-0.02, 0.0, -0.15), -0.2, 0.09, wide),
            ring(vec3(-0.14, 0.0, -0.08), -0.8, 0.09, wide),
            ring(vec3(-0.22, 0.0, 0.12), -1.3, 0.08, wide),
            ring(vec3(-0.31, 0.0, 0.44), -1.3, 0.07, wide * 0.95),
            ring(vec3(-0.345, 0.0, 0.56), -1.3, 0.05, wide * 0.75),
        ];
        builder.loft(&rings, |_, _| None);
    });
    builder.ball(hip + vec3(-0.355, 0.0, height), vec3(0.05, wide * 0.5, 0.09), 5, 8);
}

/// Adds a person that sits at a hip point, with the hands on the steering wheel or on the thighs.
pub(super) fn person(builder: &mut MeshBuilder, hip: Vec3, number: usize, wheel: Option<Vec3>) {
    const SHIRTS: [[u8; 3]; 7] = [
        [52, 74, 110],
        [150, 148, 140],
        [92, 34, 36],
        [40, 44, 48],
        [62, 92, 70],
        [176, 150, 106],
        [110, 120, 134],
    ];
    const SKINS: [[u8; 3]; 4] = [[214, 168, 138], [184, 134, 102], [128, 88, 64], [226, 184, 156]];
    const HAIRS: [[u8; 3]; 4] = [[46, 34, 26], [90, 62, 38], [24, 22, 22], [140, 134, 128]];
    let (skin, hair) = (SKINS[number % 4], HAIRS[(number / 2) % 4]);
    let shirt = SHIRTS[number % 7];
    let at = |x: f32, y: f32, z: f32| hip + vec3(x, y, z);
    builder.tinted(Material::Cloth, shirt);
    let ring = |x: f32, z: f32, deep: f32, wide: f32| -> Vec<Vec3> {
        (0..10)
            .map(|side| {
                let angle = TAU * side as f32 / 10.0;
                at(x + angle.cos() * deep, angle.sin() * wide, z)
            })
            .collect()
    };
    builder.solid(|builder| {
        builder.loft(
            &[
                ring(0.0, -0.06, 0.11, 0.17),
                ring(-0.02, 0.06, 0.12, 0.165),
                ring(-0.07, 0.22, 0.115, 0.165),
                ring(-0.12, 0.38, 0.115, 0.19),
                ring(-0.145, 0.47, 0.09, 0.17),
                ring(-0.155, 0.52, 0.055, 0.07),
            ],
            |_, _| None,
        );
    });
    for side in [1.0, -1.0] {
        let shoulder = at(-0.135, side * 0.195, 0.43);
        let hand = match wheel {
            Some(middle) => middle + tilt() * vec3(-0.06, side * 0.17, 0.01),
            None => at(0.30, side * 0.12, 0.10),
        };
        let elbow = shoulder.lerp(hand, 0.48) + vec3(-0.06, side * 0.05, -0.10);
        builder.tinted(Material::Cloth, shirt);
        builder.ball(shoulder, Vec3::splat(0.065), 5, 8);
        builder.cone(shoulder, elbow, [0.055, 0.046], 7);
        builder.ball(elbow, Vec3::splat(0.046), 4, 7);
        builder.cone(elbow, hand.lerp(elbow, 0.15), [0.044, 0.034], 7);
        builder.tinted(Material::Skin, skin);
        builder.ball(hand, vec3(0.045, 0.04, 0.045), 4, 7);
        builder.tinted(Material::Cloth, [44, 48, 62]);
        let knee = at(0.42, side * 0.13, 0.06);
        builder.cone(at(0.0, side * 0.09, -0.01), knee, [0.09, 0.06], 8);
        builder.ball(knee, Vec3::splat(0.062), 4, 8);
        builder.cone(knee, at(0.60, side * 0.12, -0.26), [0.058, 0.042], 7);
    }
    builder.tinted(Material::Skin, skin);
    builder.rod(at(-0.155, 0.0, 0.50), at(-0.14, 0.0, 0.62), 0.052, 8);
    builder.ball(at(-0.115, 0.0, 0.69), vec3(0.098, 0.076, 0.118), 8, 12);
    builder.ball(at(-0.022, 0.0, 0.675), vec3(0.02, 0.014, 0.022), 4, 6);
    builder.tinted(Material::Bark, hair);
    builder.ball(at(-0.130, 0.0, 0.722), vec3(0.102, 0.083, 0.100), 6, 12);
}
