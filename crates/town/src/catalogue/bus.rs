//! What only a bus has: seats, grab poles, passenger doors, a destination sign.

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{cabin, end::End, profile::Measure, rig::OCCUPANTS},
    mesh_builder::MeshBuilder,
};

/// The height of the floor. Metres.
const FLOOR_M: f32 = 1.05;
/// The distance between two rows of seats. Metres.
const PITCH_M: f32 = 0.86;
const SEAT: [u8; 3] = [40, 62, 112];
const POLE: [u8; 3] = [222, 186, 40];
const PANEL: [u8; 3] = [186, 186, 182];
/// The height of the unpainted lower part of the front bumper. Metres.
const BUMPER_M: f32 = 0.13;
/// The x of the passenger doors on the right, as fractions of the length, and half their width in
/// metres.
const DOORS: [f32; 2] = [0.100, 0.475];
const DOOR_HALF_M: f32 = 0.40;

/// The destination in seven segments, "25 SCHULE": from bit 0 the upper one, those on the right, the lower one, those on
/// the left, and the middle one.
const SIGN: [u8; 9] = [0x5b, 0x6d, 0, 0x6d, 0x39, 0x76, 0x3e, 0x38, 0x79];
/// The width of a segment. Metres.
const STROKE_M: f32 = 0.016;

/// Adds doors, sign, roof box, inside and occupants. `number` varies the occupants.
pub(super) fn fit(builder: &mut MeshBuilder, front: &End, number: usize) {
    outside(builder, front.measure);
    destination(builder, front);
    mask(builder, front);
    inside(builder, front.measure, number);
}

/// The destination, on a dark field above the windscreen.
fn destination(builder: &mut MeshBuilder, front: &End) {
    let (half, height) = (front.measure.body_m * 0.5, front.measure.size_m.z);
    builder.tinted(Material::Plastic, [18, 18, 20]);
    front.plate(builder, half * 0.62, [height * 0.855, height * 0.935], 0.004);
    builder.tinted(Material::LampAmber, [250, 180, 60]);
    let (wide, tall) = (half * 0.085, height * 0.042);
    let stroke = |builder: &mut MeshBuilder, [a, b]: [[f32; 2]; 2]| {
        let wider = STROKE_M * 0.5;
        let (low, high) = ([a[0].min(b[0]), a[1].min(b[1])], [a[0].max(b[0]), a[1].max(b[1])]);
        let corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])];
        let aside = [(-wider, -wider), (wider, -wider), (wider, wider), (-wider, wider)];
        let at = |corner: usize| {
            let ((y, z), (dy, dz)) = (corners[corner], aside[corner]);
            front.ahead(y + dy, z + dz).map(|(at, normal)| at + normal * 0.008)
        };
        if let (Some(a), Some(b), Some(c), Some(d)) = (at(0), at(1), at(2), at(3)) {
            builder.quad([a, b, c, d]);
        }
    };
    for (place, segments) in SIGN.iter().enumerate() {
        let (y, z) = (half * (-0.53 + 0.118 * place as f32), height * 0.874);
        let (left, right) = (y, y + wide);
        let (middle, top) = (z + tall * 0.5, z + tall);
        for (segment, ends) in [
            [[left, top], [right, top]],
            [[right, middle], [right, top]],
            [[right, z], [right, middle]],
            [[left, z], [right, z]],
            [[left, z], [left, middle]],
            [[left, middle], [left, top]],
            [[left, middle], [right, middle]],
        ]
        .into_iter()
        .enumerate()
        {
            if segments >> segment & 1 != 0 {
                stroke(builder, ends);
            }
        }
    }
}

/// A dark band below the windscreen, and a bumper of dark plastic.
fn mask(builder: &mut MeshBuilder, front: &End) {
    let (half, low) = (front.measure.body_m * 0.5, front.low());
    let cowl = front.shape.cowl().map_or(low, |(_, z)| z * front.measure.size_m.z);
    builder.tinted(Material::Plastic, [18, 18, 20]);
    front.plate(builder, half * 0.74, [cowl - 0.09, cowl - 0.005], 0.003);
    front.plate(builder, half * 0.86, [low, low + BUMPER_M], 0.006);
}

fn outside(builder: &mut MeshBuilder, measure: &Measure) {
    let (half, height) = (measure.body_m * 0.5, measure.size_m.z);
    for fraction in DOORS {
        let x = measure.at(fraction);
        let (low, high) = (0.40, height * 0.77);
        builder.tinted(Material::Plastic, [22, 23, 25]);
        builder.block(
            vec3(x - DOOR_HALF_M, -half - 0.006, low),
            vec3(x + DOOR_HALF_M, -half * 0.95, high),
        );
        for leaf in [-1.0f32, 1.0] {
            let (a, b) = (leaf * 0.03, leaf * (DOOR_HALF_M - 0.04));
            builder.material(Material::Glass);
            builder.block(
                vec3(x + a.min(b), -half - 0.012, low + 0.12),
                vec3(x + a.max(b), -half + 0.02, high - 0.08),
            );
            builder.tinted(Material::Plastic, POLE);
            let at = |z: f32| vec3(x + leaf * 0.07, -half - 0.03, z);
            builder.rod(at(1.1), at(1.7), 0.014, 6);
        }
    }
    // The air conditioner.
    builder.tinted(Material::Plastic, [200, 202, 204]);
    let ring = |fraction: f32, grow: f32| -> Vec<Vec3> {
        let (x, y) = (measure.at(fraction), half * 0.58 * grow);
        let (low, high) = (height - 0.16, height - 0.09 + 0.09 * grow);
        [
            (y, low),
            (y, high - 0.05),
            (y - 0.08, high),
            (-y + 0.08, high),
            (-y, high - 0.05),
            (-y, low),
        ]
        .map(|(y, z)| vec3(x, y, z))
        .to_vec()
    };
    let rings = [ring(0.70, 0.9), ring(0.68, 1.0), ring(0.47, 1.0), ring(0.44, 0.8)];
    builder.solid(|builder| builder.loft(&rings, |_, _| None));
    // Flaps of the luggage space, and a rubber strip along the body.
    builder.tinted(Material::Plastic, [36, 37, 40]);
    for side in [1.0f32, -1.0] {
        let (a, b) = (side * (half - 0.02), side * (half + 0.002));
        for edge in [0.31, 0.41, 0.52, 0.62] {
            let x = measure.at(edge);
            builder.block(vec3(x - 0.006, a.min(b), 0.42), vec3(x + 0.006, a.max(b), 1.15));
        }
    }
}

fn inside(builder: &mut MeshBuilder, measure: &Measure, number: usize) {
    let half = measure.body_m * 0.5;
    let roof = measure.size_m.z - 0.12;
    let (front, rear) = (measure.nose_m - 0.35, measure.nose_m - measure.size_m.x + 0.30);
    let belt = measure.size_m.z * 0.42;
    builder.tinted(Material::Plastic, [88, 90, 94]);
    builder
        .block(vec3(rear, -half * 0.95, FLOOR_M - 0.04), vec3(front - 0.2, half * 0.95, FLOOR_M));
    builder.tinted(Material::Plastic, PANEL);
    for side in [1.0f32, -1.0] {
        let (a, b) = (side * half * 0.93, side * half * 0.95);
        builder.block(vec3(rear, a.min(b), FLOOR_M), vec3(front - 0.3, a.max(b), belt - 0.02));
        // The luggage rack.
        let (a, b) = (side * half * 0.62, side * half * 0.92);
        builder.block(
            vec3(rear + 0.2, a.min(b), roof - 0.36),
            vec3(front - 1.6, a.max(b), roof - 0.33),
        );
    }
    builder.block(vec3(rear, -half * 0.93, FLOOR_M), vec3(rear + 0.04, half * 0.93, belt + 0.1));
    // The dashboard, the driver's place and the screen behind it.
    builder.tinted(Material::Plastic, [44, 44, 47]);
    let ring = |x: f32, low: f32, high: f32| {
        [(-1.0, low), (-1.0, high), (1.0, high), (1.0, low)]
            .map(|(side, z)| vec3(x, side * half * 0.86, z))
            .to_vec()
    };
    builder.solid(|builder| {
        let rings = [
            ring(front - 0.50, FLOOR_M, belt + 0.02),
            ring(front - 0.42, FLOOR_M - 0.1, belt + 0.10),
            ring(front + 0.16, FLOOR_M - 0.2, belt - 0.03),
        ];
        builder.loft(&rings, |_, _| None);
    });
    let hip = FLOOR_M + 0.44;
    let driver = vec3(measure.nose_m - 1.62, half * 0.55, hip);
    let steering = driver + vec3(0.40, 0.0, 0.32);
    cabin::wheel(builder, steering);
    builder.tinted(Material::Cloth, [52, 54, 58]);
    cabin::seat(builder, driver, 0.26, 0.70);
    builder.tinted(Material::Plastic, PANEL);
    let screen = driver.x - 0.55;
    builder.block(
        vec3(screen - 0.02, half * 0.2, FLOOR_M),
        vec3(screen + 0.02, half * 0.92, FLOOR_M + 1.0),
    );
    let rows = ((screen - 0.7 - (rear + 0.55)) / PITCH_M) as usize;
    let row_x = |row: usize| screen - 0.75 - PITCH_M * row as f32;
    let bench_y = half * 0.66;
    for row in 0..=rows {
        let x = row_x(row);
        for side in [1.0f32, -1.0] {
            let is_door = side < 0.0
                && DOORS.iter().any(|door| {
                    let off = measure.at(*door) - x;
                    off > -DOOR_HALF_M - 0.35 && off < DOOR_HALF_M + 0.75
                });
            if !is_door {
                builder.tinted(Material::Cloth, SEAT);
                cabin::seat(builder, vec3(x, side * bench_y, hip), half * 0.30, 0.66);
            }
            if row % 2 == 0 {
                builder.tinted(Material::Metal, POLE);
                let at = |z: f32| vec3(x - 0.30, side * half * 0.32, z);
                builder.rod(at(FLOOR_M), at(roof - 0.02), 0.017, 8);
            }
        }
    }
    builder.tinted(Material::Metal, POLE);
    for side in [1.0f32, -1.0] {
        let at = |x: f32| vec3(x, side * half * 0.32, roof - 0.30);
        builder.rod(at(row_x(rows) - 0.3), at(row_x(0) + 0.2), 0.017, 8);
    }
    builder.material(Material::LampInterior);
    for part in 0..4 {
        let x = rear + (front - rear) * (0.15 + 0.2 * part as f32);
        builder.block(vec3(x, -0.06, roof - 0.03), vec3(x + 1.0, 0.06, roof - 0.01));
    }
    builder.object(OCCUPANTS);
    cabin::person(builder, driver, number, Some(steering));
    for (row, side) in [(1, 1.0), (3, -1.0), (4, 1.0), (6, 1.0)] {
        if row <= rows {
            let at = vec3(row_x(row), side * (bench_y + 0.12), hip);
            cabin::person(builder, at, number + row * 3, None);
        }
    }
    builder.object(0);
}
