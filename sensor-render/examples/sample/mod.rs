//! A made-up town for tests and measurements: blocks of houses along a grid of streets, trees,
//! and cars, about as heavy as a whole real one.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "a part of several programs, each of which needs other parts of it"
)]

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use bus::{ActorId, ActorState, Name, Pose, SensorSpec, kind, output, sensor};
use glam::{Quat, Vec3, vec3};
use road::{Face, Material, Mesh, Tag};

/// Side of a block with its street.
const BLOCK_M: f32 = 100.0;
const ROAD_HALF_M: f32 = 7.0;
const WALK_M: f32 = 4.0;

/// A made-up town of `blocks` × `blocks` blocks about the origin.
pub struct Sample {
    pub mesh: Mesh,
    pub cars: Vec<Mesh>,
    blocks: i32,
}

/// A small generator of numbers (splitmix64).
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Dice {
        Dice(seed)
    }

    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.word() >> 40) as f32 / 16_777_216.0
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.word() % from.len() as u64) as usize]
    }
}

impl Sample {
    pub fn new(blocks: i32, seed: u64) -> Sample {
        let mut dice = Dice::new(seed);
        let mut mesh = Mesh::default();
        let mut object = 0;
        let half = blocks as f32 * BLOCK_M / 2.0;
        for i in 0..=blocks {
            for j in 0..=blocks {
                let at = vec3(i as f32, j as f32, 0.0) * BLOCK_M - vec3(half, half, 0.0);
                crossing(&mut mesh, at);
                if i < blocks {
                    street(&mut mesh, at, false);
                }
                if j < blocks {
                    street(&mut mesh, at, true);
                }
                if i < blocks && j < blocks {
                    block(&mut mesh, &mut dice, &mut object, at);
                }
            }
        }
        let far = half + 600.0;
        let grass = Face::new(Tag::Terrain, Material::Grass, 0);
        let edge = half + ROAD_HALF_M;
        for quarter in 0..4 {
            let turn = Quat::from_rotation_z(quarter as f32 * FRAC_PI_2);
            let corner = |x: f32, y: f32| (turn * vec3(x, y, -0.02)).to_array();
            mesh.quad(
                [corner(edge, -edge), corner(far, -far), corner(far, far), corner(edge, edge)],
                grass,
            );
        }
        Sample { mesh, cars: (0..4).map(car).collect(), blocks }
    }

    /// `count` cars along the streets.
    pub fn traffic(&self, count: u32, seed: u64) -> Vec<ActorState> {
        let mut dice = Dice::new(seed);
        let half = self.blocks as f32 * BLOCK_M / 2.0;
        (1..=count)
            .map(|id| {
                let lane = dice.pick(&[-5.2f32, -1.75, 1.75, 5.2]);
                let line = (dice.word() % (self.blocks as u64 + 1)) as f32 * BLOCK_M - half;
                let along = dice.between(-half, half);
                let turned = dice.word().is_multiple_of(2);
                let heading = if lane < 0.0 { 0.0 } else { PI };
                let (at, yaw) = if turned {
                    (vec3(line - lane, along, 0.0), heading + FRAC_PI_2)
                } else {
                    (vec3(along, line + lane, 0.0), heading)
                };
                ActorState {
                    actor_id: ActorId(id),
                    blueprint: id % self.cars.len() as u32,
                    kind: kind::VEHICLE,
                    pose: Pose::level(at, yaw),
                    brake: if id % 3 == 0 { 0.5 } else { 0.0 },
                    ..Default::default()
                }
            })
            .collect()
    }

    /// Where a camera on a car in the middle lane sees the town: street pose `index`.
    pub fn street_pose(&self, index: u32) -> Pose {
        let mut dice = Dice::new(1000 + u64::from(index));
        let half = self.blocks as f32 * BLOCK_M / 2.0;
        let line = (1 + dice.word() % (self.blocks as u64 - 1).max(1)) as f32 * BLOCK_M - half;
        let along = dice.between(-half * 0.8, half * 0.8);
        let (at, yaw) = if index.is_multiple_of(2) {
            (vec3(along, line - 1.75, 1.6), if along < 0.0 { 0.0 } else { PI })
        } else {
            (vec3(line + 1.75, along, 1.6), if along < 0.0 { FRAC_PI_2 } else { -FRAC_PI_2 })
        };
        let wobble = Quat::from_rotation_z(dice.between(-0.3, 0.3));
        let pitch = Quat::from_rotation_y(dice.between(0.0, 0.06));
        Pose::new(at, Quat::from_rotation_z(yaw) * wobble * pitch)
    }
}

/// A colour of cars.
pub fn paint(actor: &ActorState) -> [u8; 3] {
    const PAINTS: [[u8; 3]; 8] = [
        [176, 22, 24],
        [230, 230, 228],
        [22, 24, 28],
        [120, 124, 130],
        [24, 60, 130],
        [196, 160, 40],
        [60, 90, 70],
        [150, 40, 20],
    ];
    PAINTS[actor.actor_id.0 as usize % PAINTS.len()]
}

/// A pinhole with every output.
pub fn camera(name: &str, width: u32, height: u32) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::CAMERA,
        outputs: output::COLOR | output::DEPTH | output::TAG | output::INSTANCE,
        width,
        height,
        fov_rad: FRAC_PI_2,
        ..Default::default()
    }
}

/// A full turn at one instant.
pub fn lidar(name: &str, columns: u32, channels: u32) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::LIDAR,
        outputs: output::POINTS | output::LABELS,
        width: columns,
        height: channels,
        fov_rad: TAU,
        upper_rad: 10f32.to_radians(),
        lower_rad: (-30f32).to_radians(),
        range_m: 100.0,
        attenuation_per_m: 0.004,
        ..Default::default()
    }
}

fn rectangle(mesh: &mut Mesh, low: Vec3, high: Vec3, face: Face) {
    let p = |x: f32, y: f32| [x, y, low.z];
    mesh.quad([p(low.x, low.y), p(high.x, low.y), p(high.x, high.y), p(low.x, high.y)], face);
}

pub fn solid(mesh: &mut Mesh, low: Vec3, high: Vec3, turn: Quat, pivot: Vec3, faces: [Face; 3]) {
    let [side, top, bottom] = faces;
    let p = |x: bool, y: bool, z: bool| {
        let corner = vec3(
            if x { high.x } else { low.x },
            if y { high.y } else { low.y },
            if z { high.z } else { low.z },
        );
        (pivot + turn * corner).to_array()
    };
    let (o, i) = (false, true);
    mesh.quad([p(o, o, o), p(o, i, o), p(i, i, o), p(i, o, o)], bottom);
    mesh.quad([p(o, o, i), p(i, o, i), p(i, i, i), p(o, i, i)], top);
    mesh.quad([p(o, o, o), p(i, o, o), p(i, o, i), p(o, o, i)], side);
    mesh.quad([p(o, i, o), p(o, i, i), p(i, i, i), p(i, i, o)], side);
    mesh.quad([p(o, o, o), p(o, o, i), p(o, i, i), p(o, i, o)], side);
    mesh.quad([p(i, o, o), p(i, i, o), p(i, i, i), p(i, o, i)], side);
}

fn plain(mesh: &mut Mesh, low: Vec3, high: Vec3, face: Face) {
    solid(mesh, low, high, Quat::IDENTITY, Vec3::ZERO, [face; 3]);
}

fn crossing(mesh: &mut Mesh, at: Vec3) {
    let half = vec3(ROAD_HALF_M, ROAD_HALF_M, 0.0);
    rectangle(mesh, at - half, at + half, Face::new(Tag::Roads, Material::Asphalt, 0));
}

fn street(mesh: &mut Mesh, at: Vec3, turned: bool) {
    let turn = Quat::from_rotation_z(if turned { FRAC_PI_2 } else { 0.0 });
    let asphalt = Face::new(Tag::Roads, Material::Asphalt, 0);
    let white = Face::new(Tag::RoadLine, Material::PaintWhite, 0);
    let yellow = Face::new(Tag::RoadLine, Material::PaintYellow, 0);
    let mut strip = |x0: f32, x1: f32, y0: f32, y1: f32, face: Face| {
        let p = |x: f32, y: f32| (at + turn * vec3(x, y, 0.0)).to_array();
        mesh.quad([p(x0, y0), p(x1, y0), p(x1, y1), p(x0, y1)], face);
    };
    let (begin, end) = (ROAD_HALF_M, BLOCK_M - ROAD_HALF_M);
    // Lanes and lines side by side, so that no two faces share a plane.
    let bands: [(f32, f32, u8); 9] = [
        (-7.0, -3.56, 0),
        (-3.56, -3.44, 2),
        (-3.44, -0.14, 0),
        (-0.14, -0.04, 3),
        (-0.04, 0.04, 0),
        (0.04, 0.14, 3),
        (0.14, 3.44, 0),
        (3.44, 3.56, 2),
        (3.56, 7.0, 0),
    ];
    let mut x = begin;
    let mut step = 0;
    while x < end {
        let next = (x + 2.15).min(end);
        for (y0, y1, what) in bands {
            let face = match what {
                3 => yellow,
                2 if step % 4 < 2 => white,
                _ => asphalt,
            };
            strip(x, next, y0, y1, face);
        }
        x = next;
        step += 1;
    }
}

fn block(mesh: &mut Mesh, dice: &mut Dice, object: &mut u32, at: Vec3) {
    let low = at + vec3(ROAD_HALF_M, ROAD_HALF_M, 0.0);
    let high = at + vec3(BLOCK_M - ROAD_HALF_M, BLOCK_M - ROAD_HALF_M, 0.15);
    let paving = Face::new(Tag::SideWalks, Material::Paving, 0);
    let kerb = Face::new(Tag::SideWalks, Material::Kerb, 0);
    solid(mesh, low, high, Quat::IDENTITY, Vec3::ZERO, [kerb, paving, kerb]);
    let (inner_low, inner_high) = (low + WALK_M, high - vec3(WALK_M, WALK_M, 0.0));
    let grass = Face::new(Tag::Terrain, Material::Grass, 0);
    let lawn = vec3(inner_low.x + 14.0, inner_low.y + 14.0, 0.16);
    rectangle(mesh, lawn, vec3(inner_high.x - 14.0, inner_high.y - 14.0, 0.16), grass);
    for side in 0..4 {
        let turn = Quat::from_rotation_z(side as f32 * FRAC_PI_2);
        let center = (inner_low + inner_high).with_z(0.0) / 2.0;
        let reach = (inner_high.x - inner_low.x) / 2.0;
        let mut x = -reach;
        while x < reach - 16.0 {
            let width = dice.between(12.0, 22.0).min(reach - 13.0 - x);
            if width < 8.0 {
                break;
            }
            *object += 1;
            let height = 3.1 * dice.between(3.0, 9.0).floor() + 1.0;
            let pivot = center + turn * vec3(x, -reach, 0.15);
            house(mesh, dice, *object, pivot, turn, vec3(width, 12.0, height));
            x += width + if dice.word().is_multiple_of(4) { 3.0 } else { 0.0 };
        }
        for tree_number in 0..5 {
            let along = -reach + 8.0 + tree_number as f32 * 17.0 + dice.between(-2.0, 2.0);
            let foot = center + turn * vec3(along, -reach - 2.6, 0.15);
            *object += 1;
            tree(mesh, dice, *object, foot);
            if tree_number % 2 == 0 {
                *object += 1;
                lamp(mesh, *object, center + turn * vec3(along + 6.0, -reach - 3.4, 0.15), turn);
            }
        }
    }
}

fn house(mesh: &mut Mesh, dice: &mut Dice, object: u32, pivot: Vec3, turn: Quat, size: Vec3) {
    let material = dice.pick(&[
        Material::FacadeBrick,
        Material::FacadePlaster,
        Material::FacadePlaster,
        Material::FacadeGlass,
        Material::FacadeConcrete,
    ]);
    let wall = Face::new(Tag::Building, material, object);
    let roof = Face::new(Tag::Building, Material::RoofFlat, object);
    let trim = Face::new(Tag::Building, Material::Concrete, object);
    solid(mesh, Vec3::ZERO, size, turn, pivot, [wall, roof, wall]);
    if size.z < 14.0 && material != Material::FacadeGlass {
        let tiles = Face::new(Tag::Building, Material::RoofTiles, object);
        let p = |x: f32, y: f32, z: f32| (pivot + turn * vec3(x, y, z)).to_array();
        let (w, d, h) = (size.x, size.y, size.z);
        mesh.quad(
            [
                p(-0.4, -0.4, h - 0.2),
                p(w + 0.4, -0.4, h - 0.2),
                p(w + 0.4, d / 2.0, h + 4.0),
                p(-0.4, d / 2.0, h + 4.0),
            ],
            tiles,
        );
        mesh.quad(
            [
                p(w + 0.4, d + 0.4, h - 0.2),
                p(-0.4, d + 0.4, h - 0.2),
                p(-0.4, d / 2.0, h + 4.0),
                p(w + 0.4, d / 2.0, h + 4.0),
            ],
            tiles,
        );
        for x in [0.0, w] {
            let [a, b, c] =
                [p(x, 0.0, h), p(x, d, h), p(x, d / 2.0, h + 3.9)].map(|c| mesh.vertex(c));
            mesh.triangle(if x == 0.0 { [b, a, c] } else { [a, b, c] }, wall);
        }
    } else {
        for (low, high) in [
            (vec3(-0.2, -0.2, size.z), vec3(size.x + 0.2, 0.3, size.z + 0.8)),
            (vec3(-0.2, size.y - 0.3, size.z), vec3(size.x + 0.2, size.y + 0.2, size.z + 0.8)),
        ] {
            solid(mesh, low, high, turn, pivot, [trim; 3]);
        }
        for _ in 0..3 {
            let at = vec3(dice.between(2.0, size.x - 4.0), dice.between(2.0, 8.0), size.z);
            solid(mesh, at, at + vec3(2.0, 2.0, 1.4), turn, pivot, [trim; 3]);
        }
    }
    if material != Material::FacadeGlass {
        // Balconies with railings of thin bars, which make the town as heavy as real ones are.
        let floors = ((size.z - 1.0) / 3.1) as u32;
        let metal = Face::new(Tag::Building, Material::Metal, object);
        for floor in 1..floors {
            let mut x = 2.0;
            while x < size.x - 3.0 {
                let low = vec3(x, -1.2, floor as f32 * 3.1 - 0.15);
                solid(mesh, low, low + vec3(2.4, 1.2, 0.15), turn, pivot, [trim; 3]);
                for bar in 0..7 {
                    let at = low + vec3(0.02 + bar as f32 * 0.39, 0.02, 0.15);
                    solid(mesh, at, at + vec3(0.03, 0.03, 0.95), turn, pivot, [metal; 3]);
                }
                let rail = low + vec3(0.0, 0.0, 1.08);
                solid(mesh, rail, rail + vec3(2.4, 0.06, 0.05), turn, pivot, [metal; 3]);
                x += 5.6;
            }
        }
    }
}

fn tree(mesh: &mut Mesh, dice: &mut Dice, object: u32, foot: Vec3) {
    let bark = Face::new(Tag::Vegetation, Material::Bark, object);
    let height = dice.between(2.2, 3.0);
    plain(mesh, foot + vec3(-0.15, -0.15, 0.0), foot + vec3(0.15, 0.15, height), bark);
    let needles = dice.word().is_multiple_of(4);
    let leaves = Face::new(
        Tag::Vegetation,
        if needles { Material::Needles } else { Material::Leaves },
        object,
    );
    let size = dice.between(1.6, 2.4);
    for _ in 0..900 {
        // A leaf cluster: a small slanted triangle somewhere in the crown's shell.
        let z = dice.between(-1.0, 1.0);
        let angle = dice.between(0.0, TAU);
        let ring = (1.0 - z * z).sqrt();
        let radius = size * dice.between(0.55, 1.0).sqrt();
        let at = foot
            + vec3(0.0, 0.0, height + size * 0.9)
            + vec3(ring * angle.cos(), ring * angle.sin(), z * 1.15) * radius;
        let mut jitter =
            || vec3(dice.between(-0.3, 0.3), dice.between(-0.3, 0.3), dice.between(-0.3, 0.3));
        let corners =
            [at + jitter(), at + jitter(), at + jitter()].map(|c| mesh.vertex(c.to_array()));
        mesh.triangle(corners, leaves);
    }
}

fn lamp(mesh: &mut Mesh, object: u32, foot: Vec3, turn: Quat) {
    let metal = Face::new(Tag::Pole, Material::Metal, object);
    let light = Face::new(Tag::Pole, Material::LampWhite, object);
    solid(mesh, vec3(-0.07, -0.07, 0.0), vec3(0.07, 0.07, 7.0), turn, foot, [metal; 3]);
    solid(mesh, vec3(-0.05, -1.8, 6.9), vec3(0.05, 0.0, 7.0), turn, foot, [metal; 3]);
    solid(mesh, vec3(-0.15, -2.2, 6.85), vec3(0.15, -1.5, 7.0), turn, foot, [metal, metal, light]);
}

/// A car of about 1800 triangles: body and cabin as skins over rings of points, wheels, lamps.
fn car(variant: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let body = Face::new(Tag::Car, Material::CarPaint, 0);
    let glass = Face::new(Tag::Car, Material::Glass, 0);
    let tall = [0.0, 0.25, 0.1, 0.4][variant];
    let length = [2.25, 2.35, 2.0, 2.5][variant];
    let sides = 24;
    // Stations along x: half width, bottom, top, and whether the band behind is glass.
    let profile: [(f32, f32, f32, f32); 12] = [
        (-1.0, 0.55, 0.45, 0.75),
        (-0.97, 0.82, 0.32, 0.92),
        (-0.85, 0.9, 0.28, 0.98),
        (-0.6, 0.92, 0.25, 1.0),
        (-0.35, 0.92, 0.24, 1.0),
        (-0.1, 0.92, 0.24, 0.99),
        (0.15, 0.92, 0.24, 0.97),
        (0.4, 0.92, 0.24, 0.93),
        (0.65, 0.91, 0.25, 0.86),
        (0.85, 0.88, 0.27, 0.78),
        (0.96, 0.78, 0.3, 0.66),
        (1.0, 0.5, 0.4, 0.55),
    ];
    let ring = |x: f32, half: f32, low: f32, high: f32, power: f32| -> Vec<Vec3> {
        (0..sides)
            .map(|side| {
                let angle = TAU * side as f32 / sides as f32;
                let squash = |v: f32| v.signum() * v.abs().powf(power);
                let middle = (low + high) / 2.0;
                vec3(
                    x,
                    half * squash(angle.cos()),
                    middle + (high - low) / 2.0 * squash(angle.sin()),
                )
            })
            .collect()
    };
    let skin = |mesh: &mut Mesh, rings: &[Vec<Vec3>], face: &dyn Fn(usize, usize) -> Face| {
        for (band, pair) in rings.windows(2).enumerate() {
            for side in 0..sides {
                let next = (side + 1) % sides;
                let corners = [pair[0][side], pair[1][side], pair[1][next], pair[0][next]];
                mesh.quad(corners.map(|c| c.to_array()), face(band, side));
            }
        }
        for (ring, flip) in [(&rings[0], false), (&rings[rings.len() - 1], true)] {
            for side in 1..sides - 1 {
                let (a, b) = if flip { (side + 1, side) } else { (side, side + 1) };
                let corners = [ring[0], ring[a], ring[b]].map(|c| mesh.vertex(c.to_array()));
                mesh.triangle(corners, body);
            }
        }
    };
    let rings: Vec<Vec<Vec3>> = profile
        .iter()
        .map(|(x, half, low, high)| ring(x * length, *half, *low, *high, 0.5))
        .collect();
    let lamps = Face::new(Tag::Car, Material::LampWhite, 0);
    let tail = Face::new(Tag::Car, Material::LampRed, 0);
    let trim = Face::new(Tag::Car, Material::Plastic, 0);
    skin(&mut mesh, &rings, &|band, side| {
        let outer = matches!(side, 1..=3 | 8..=10);
        match band {
            9 | 10 if outer => lamps,
            0 if outer => tail,
            _ if (14..=21).contains(&side) => trim,
            _ => body,
        }
    });
    let cabin: [(f32, f32, f32); 7] = [
        (-0.85, 0.75, 0.98),
        (-0.62, 0.74, 1.36),
        (-0.45, 0.72, 1.44),
        (-0.2, 0.71, 1.47),
        (0.05, 0.71, 1.44),
        (0.2, 0.73, 1.33),
        (0.5, 0.78, 0.95),
    ];
    let rings: Vec<Vec<Vec3>> = cabin
        .iter()
        .map(|(x, half, high)| {
            ring(x * length, *half, 0.85, high + if *high > 1.0 { tall } else { 0.0 }, 0.45)
        })
        .collect();
    skin(&mut mesh, &rings, &|band, side| match (band, side) {
        (0 | 5, 2..=9) => glass,
        (1..=4, 0..=2 | 9..=11) => glass,
        _ => body,
    });
    let rubber = Face::new(Tag::Car, Material::Rubber, 0);
    let rim = Face::new(Tag::Car, Material::Metal, 0);
    for (x, y) in [(0.62, 1.0), (0.62, -1.0), (-0.6, 1.0), (-0.6, -1.0f32)] {
        let hub = vec3(x * length, y * 0.82, 0.33);
        for step in 0..20 {
            let [a, b] = [step, step + 1].map(|s| TAU * s as f32 / 20.0);
            let p = |angle: f32, radius: f32, out: f32| {
                (hub + vec3(radius * angle.cos(), y * out, radius * angle.sin())).to_array()
            };
            mesh.quad(
                [p(a, 0.33, 0.12), p(b, 0.33, 0.12), p(b, 0.33, -0.12), p(a, 0.33, -0.12)],
                rubber,
            );
            mesh.quad(
                [p(a, 0.33, 0.12), p(b, 0.33, 0.12), p(b, 0.22, 0.13), p(a, 0.22, 0.13)],
                rubber,
            );
            let spoke = if step % 4 < 2 { rim } else { rubber };
            mesh.quad(
                [p(a, 0.22, 0.11), p(b, 0.22, 0.11), p(b, 0.0, 0.12), p(a, 0.0, 0.12)],
                spoke,
            );
        }
    }
    mesh
}
