//! People on foot: CARLA's 49 ids, adults and children of several builds.

use glam::{Quat, Vec3, vec3};
use road::{Material, Tag};

use super::{Blueprint, Kind};
use crate::clay::{self, Clay};
use crate::random::Random;

macro_rules! ids {
    ($($number:literal)*) => { [$(concat!("walker.pedestrian.", $number)),*] };
}

const IDS: [&str; 49] = ids!(
    "0001" "0002" "0003" "0004" "0005" "0006" "0007" "0008" "0009" "0010" "0011" "0012" "0013"
    "0014" "0015" "0016" "0017" "0018" "0019" "0020" "0021" "0022" "0023" "0024" "0025" "0026"
    "0027" "0028" "0029" "0030" "0031" "0032" "0033" "0034" "0035" "0036" "0037" "0038" "0039"
    "0040" "0041" "0042" "0043" "0044" "0045" "0046" "0047" "0048" "0049"
);

/// The numbers of CARLA's children.
const CHILDREN: [usize; 8] = [9, 10, 11, 12, 13, 14, 48, 49];

/// All walkers, by id.
pub(super) fn walkers() -> Vec<Blueprint> {
    IDS.iter().enumerate().map(|(index, id)| walker(id, index + 1)).collect()
}

fn walker(id: &'static str, number: usize) -> Blueprint {
    let mut random = Random::new(number as u64, 0x3a17);
    let child = CHILDREN.contains(&number);
    let height = if child { random.between(1.08, 1.42) } else { random.between(1.58, 1.92) };
    let girth = if child { random.between(0.9, 1.0) } else { random.between(0.88, 1.22) };
    let skirt = !child && number % 5 == 2;
    let color = [0; 3].map(|_: u8| (30.0 + 170.0 * random.unit()) as u8);

    let mut clay = Clay::new(Tag::Pedestrian, Material::Cloth, 0);
    figure(&mut clay, height, girth, skirt, number % 3);
    let (low, high) = clay::bounds(&clay.mesh);
    Blueprint {
        id,
        kind: Kind::Walker,
        tag: Tag::Pedestrian,
        base_type: "",
        special_type: "",
        half_extents_m: (high - low) * 0.5,
        center_m: (high + low) * 0.5,
        mesh: clay.mesh,
        wheels: Vec::new(),
        mass_kg: 22.0 * girth * girth * height * height,
        wheelbase_m: 0.0,
        default_color: color,
    }
}

/// Someone in mid-step, looking along x.
fn figure(clay: &mut Clay, height: f32, girth: f32, skirt: bool, hair: usize) {
    let head = (height * 0.072).max(0.105);
    let hip = height * 0.50;
    let shoulder = height - 2.0 * head - height * 0.045;
    let broad = height * 0.115 * girth;
    let stride = height * 0.13;
    // The upper garment takes the actor's own colour.
    clay.material(Material::CarPaint);
    torso(clay, Vec3::Z * (hip - 0.03), Vec3::Z * shoulder, broad * 0.80, broad);
    for side in [1.0f32, -1.0] {
        let y = side * broad * 0.52;
        let ankle = vec3(stride * side, y, 0.075);
        let knee = vec3(stride * side * 0.5 + 0.05, y, hip * 0.53);
        clay.material(if skirt { Material::Skin } else { Material::Cloth });
        limb(clay, &[vec3(0.0, y, hip), knee, ankle], &[0.085 * girth, 0.062 * girth, 0.045]);
        clay.material(Material::Rubber);
        let foot = vec3(ankle.x + 0.05, y, 0.045);
        clay.ball(foot, vec3(height * 0.078, 0.048, 0.045), 4, 8);

        let upper = vec3(0.0, side * (broad + 0.045), shoulder - 0.05);
        let elbow = upper + vec3(-stride * side * 0.45, side * 0.05, -height * 0.165);
        let hand = elbow + vec3(-stride * side * 0.4 + 0.09, 0.0, -height * 0.135);
        clay.material(Material::CarPaint);
        limb(clay, &[upper, elbow, hand], &[0.055 * girth, 0.045 * girth, 0.034]);
        clay.material(Material::Skin);
        clay.ball(hand - Vec3::Z * 0.04, vec3(0.035, 0.03, 0.06), 4, 6);
    }
    if skirt {
        clay.material(Material::Cloth);
        clay.cone(Vec3::Z * (hip * 0.52), Vec3::Z * (hip + 0.08), [broad * 1.25, broad * 0.75], 10);
    }
    let center = vec3(0.015, 0.0, height - head);
    clay.material(Material::Skin);
    clay.rod(Vec3::Z * (shoulder - 0.02), center, head * 0.48, 8);
    clay.ball(center, vec3(head * 0.88, head * 0.70, head * 0.985), 7, 10);
    clay.material(if hair == 0 { Material::Plastic } else { Material::Bark });
    let tail = if hair == 1 { 0.30 } else { 0.05 };
    clay.ball(
        center + vec3(-head * 0.16, 0.0, head * (0.22 - tail)),
        vec3(head * 0.84, head * 0.76, head * (0.78 + tail)),
        6,
        10,
    );
}

/// A trunk from hips to shoulders.
pub(super) fn torso(clay: &mut Clay, hip: Vec3, shoulder: Vec3, waist: f32, broad: f32) {
    let turn = Quat::from_rotation_arc(Vec3::Z, (shoulder - hip).normalize_or(Vec3::Z));
    let length = (shoulder - hip).length();
    let rings: Vec<Vec<Vec3>> =
        [(-0.10, 0.75), (0.0, 1.0), (0.35, 0.92), (0.75, 1.12), (0.95, 1.0), (1.06, 0.35)]
            .map(|(along, wide): (f32, f32)| {
                let half = wide * (waist + (broad - waist) * along.clamp(0.0, 1.0));
                (0..10)
                    .map(|side| {
                        let angle = std::f32::consts::TAU * side as f32 / 10.0;
                        let flat = vec3(angle.cos() * half * 0.66, angle.sin() * half, 0.0);
                        hip + turn * (flat + Vec3::Z * along * length)
                    })
                    .collect()
            })
            .into();
    clay.loft(&rings, |_, _| None);
}

/// An arm or a leg through three joints.
pub(super) fn limb(clay: &mut Clay, joints: &[Vec3; 3], radii: &[f32; 3]) {
    clay.cone(joints[0], joints[1], [radii[0], radii[1]], 7);
    clay.cone(joints[1], joints[2], [radii[1], radii[2]], 7);
    clay.ball(joints[1], Vec3::splat(radii[1]), 4, 7);
    clay.ball(joints[0], Vec3::splat(radii[0]), 4, 7);
}
