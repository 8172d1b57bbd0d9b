//! The bones of walkers, under CARLA's names, and the walk.
//!
//! At rest a walker stands upright with hanging arms, and the axes of every bone are those of the
//! actor.

use std::f32::consts::TAU;

use glam::{Affine3A, Quat, Vec3, vec3};

use crate::catalogue::posture::{GivenPose, Posture};

/// A bone at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Bone {
    /// CARLA's name, such as `crl_foreArm__L`.
    pub name: String,
    /// The index of the parent, lower than its own; the root is its own parent.
    pub parent: usize,
    /// The origin of the bone, in actor space at rest.
    pub at_m: Vec3,
}

/// All bones of a walker.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// The bones, parents before children; the body's bones come first, then the fingers.
    pub bones: Vec<Bone>,
    height_m: f32,
}

/// The number of bones without fingers.
pub(crate) const BODY_BONES: usize = 26;

/// The number of limbs of a fallen walker that rotate.
const LIMBS: usize = 10;

/// The bones about which the limbs of a fallen walker rotate: chest, head, left upper arm and
/// forearm, the same on the right, left thigh and shin, the same on the right.
pub const LIMB_BONES: [usize; LIMBS] = [2, 12, 5, 6, 9, 10, 16, 17, 21, 22];

/// Names, parents, and (forward, left, up) as fractions of the height.
#[rustfmt::skip]
const BODY: [(&str, usize, [f32; 3]); BODY_BONES] = [
    ("crl_root", 0, [0.0, 0.0, 0.0]),
    ("crl_hips__C", 0, [0.0, 0.0, 0.530]),
    ("crl_spine__C", 1, [0.0, 0.0, 0.580]),
    ("crl_spine01__C", 2, [0.0, 0.0, 0.700]),
    ("crl_shoulder__L", 3, [0.0, 0.030, 0.815]),
    ("crl_arm__L", 4, [0.0, 0.108, 0.808]),
    ("crl_foreArm__L", 5, [-0.004, 0.128, 0.635]),
    ("crl_hand__L", 6, [0.014, 0.140, 0.487]),
    ("crl_shoulder__R", 3, [0.0, -0.030, 0.815]),
    ("crl_arm__R", 8, [0.0, -0.108, 0.808]),
    ("crl_foreArm__R", 9, [-0.004, -0.128, 0.635]),
    ("crl_hand__R", 10, [0.014, -0.140, 0.487]),
    ("crl_neck__C", 3, [0.0, 0.0, 0.840]),
    ("crl_Head__C", 12, [0.008, 0.0, 0.890]),
    ("crl_eye__L", 13, [0.050, 0.018, 0.935]),
    ("crl_eye__R", 13, [0.050, -0.018, 0.935]),
    ("crl_thigh__L", 1, [0.0, 0.052, 0.510]),
    ("crl_leg__L", 16, [0.006, 0.052, 0.285]),
    ("crl_foot__L", 17, [-0.008, 0.052, 0.045]),
    ("crl_toe__L", 18, [0.075, 0.056, 0.016]),
    ("crl_toeEnd__L", 19, [0.115, 0.056, 0.014]),
    ("crl_thigh__R", 1, [0.0, -0.052, 0.510]),
    ("crl_leg__R", 21, [0.006, -0.052, 0.285]),
    ("crl_foot__R", 22, [-0.008, -0.052, 0.045]),
    ("crl_toe__R", 23, [0.075, -0.056, 0.016]),
    ("crl_toeEnd__R", 24, [0.115, -0.056, 0.014]),
];

/// Indices into [`BODY`].
pub(crate) mod bone {
    pub(crate) const HIPS: usize = 1;
    pub(crate) const SPINE: usize = 2;
    pub(crate) const CHEST: usize = 3;
    pub(crate) const ARM: [usize; 2] = [5, 9];
    pub(crate) const FOREARM: [usize; 2] = [6, 10];
    pub(crate) const HAND: [usize; 2] = [7, 11];
    pub(crate) const HEAD: usize = 13;
    pub(crate) const THIGH: [usize; 2] = [16, 21];
    pub(crate) const LEG: [usize; 2] = [17, 22];
    pub(crate) const FOOT: [usize; 2] = [18, 23];
}

const FINGERS: [(&str, f32, f32); 5] = [
    ("Thumb", 0.020, 0.60),
    ("Index", 0.012, 1.0),
    ("Middle", 0.004, 1.05),
    ("Ring", -0.005, 1.0),
    ("Pinky", -0.013, 0.8),
];

/// The distance that two steps cover at a speed, for a walker of this height. Metres.
pub fn stride_m(height_m: f32, speed_mps: f32) -> f32 {
    height_m * (0.42 + 0.30 * speed_mps * (1.75 / height_m.max(0.5))).clamp(0.42, 2.0)
}

impl Skeleton {
    /// The skeleton of a walker of this height and of this relative breadth.
    pub(crate) fn new(height_m: f32, girth: f32) -> Skeleton {
        let at = |[x, y, z]: [f32; 3], wide: f32| vec3(x, y * wide, z) * height_m;
        let mut bones: Vec<Bone> = BODY
            .iter()
            .enumerate()
            .map(|(index, (name, parent, fraction))| {
                let wide = if (4..12).contains(&index) { 0.45 + 0.55 * girth } else { girth };
                Bone { name: (*name).to_owned(), parent: *parent, at_m: at(*fraction, wide) }
            })
            .collect();
        for (side, hand) in ["L", "R"].into_iter().zip(bone::HAND) {
            for (finger, ahead, long) in FINGERS {
                for (joint, suffix) in ["", "01", "02", "End"].into_iter().enumerate() {
                    let parent = if joint == 0 { hand } else { bones.len() - 1 };
                    let down = 0.030 + 0.014 * joint as f32;
                    bones.push(Bone {
                        name: format!("crl_hand{finger}{suffix}__{side}"),
                        parent,
                        at_m: bones[hand].at_m + vec3(ahead, 0.0, -down * long) * height_m,
                    });
                }
            }
        }
        Skeleton { bones, height_m }
    }

    /// Writes `actor_from_bone` of the bones that fit into the slice. The space of a bone is the
    /// actor's while the bone is at rest, so a mesh in actor space is fixed to its bone by this
    /// transform.
    pub fn pose(&self, posture: &Posture, actor_from_rest: &mut [Affine3A]) {
        let gait = match posture.limbs {
            Some(_) => Gait::none(),
            None => Gait::of(posture, self.height_m),
        };
        let lying = |index: usize| {
            let limb = LIMB_BONES.iter().position(|bone| *bone == index)?;
            posture.limbs.map(|turns| turns[limb])
        };
        let foot = |placed: &[Affine3A], side: usize| {
            let index = bone::FOOT[side];
            placed[index].transform_point3(self.bones[index].at_m).z - self.bones[index].at_m.z
        };
        let count = actor_from_rest.len().min(self.bones.len());
        for index in 0..count {
            let Bone { parent, at_m, .. } = self.bones[index];
            let turn = lying(index).unwrap_or_else(|| gait.turn(index));
            let own = Affine3A::from_rotation_translation(turn, at_m - turn * at_m);
            actor_from_rest[index] = if index == 0 { own } else { actor_from_rest[parent] * own };
        }
        // The lower foot stands on the ground.
        if gait.amount > 0.0 && count >= BODY_BONES {
            let lowest = foot(actor_from_rest, 0).min(foot(actor_from_rest, 1));
            for placed in actor_from_rest.iter_mut().skip(1) {
                placed.translation.z -= lowest;
            }
        }
        if let Some(given) = &posture.given {
            self.blend(given, &mut actor_from_rest[..count]);
        }
    }

    /// Rotates and shifts each bone relative to its parent towards the given pose.
    fn blend(&self, given: &GivenPose, actor_from_rest: &mut [Affine3A]) {
        let walk = actor_from_rest.to_vec();
        for index in 0..walk.len() {
            let Bone { parent, at_m, .. } = self.bones[index];
            let is_root = index == parent;
            let (begins, parent_from_actor) = if is_root {
                (Vec3::ZERO, Affine3A::IDENTITY)
            } else {
                (self.bones[parent].at_m, walk[parent].inverse())
            };
            // The origin and rotation relative to the parent.
            let own = parent_from_actor * walk[index];
            let turn = Quat::from_mat3a(&own.matrix3);
            let at = own.transform_point3(at_m) - begins;
            let set = given.bones.get(index).copied().flatten();
            let (to, to_turn) = set.unwrap_or((at_m - begins, Quat::IDENTITY));
            let turn = turn.slerp(to_turn.normalize(), given.weight).normalize();
            let at = at.lerp(to, given.weight) + begins;
            let own = Affine3A::from_rotation_translation(turn, at - turn * at_m);
            actor_from_rest[index] = if is_root { own } else { actor_from_rest[parent] * own };
        }
    }

    /// `parent_from_bone` of every bone in its current pose, as origin and rotation.
    pub fn parent_from_bones(&self, posture: &Posture) -> Vec<(Vec3, Quat)> {
        let placed = self.actor_from_bones(posture);
        let against = |(index, bone): (usize, &Bone)| {
            let own = if index == bone.parent {
                placed[index]
            } else {
                placed[bone.parent].inverse() * placed[index]
            };
            let (_, turn, at) = own.to_scale_rotation_translation();
            (at, turn.normalize())
        };
        self.bones.iter().enumerate().map(against).collect()
    }

    /// `actor_from_bone` of every bone, with its origin at the origin of the bone.
    pub fn actor_from_bones(&self, posture: &Posture) -> Vec<Affine3A> {
        let mut placed = vec![Affine3A::IDENTITY; self.bones.len()];
        self.pose(posture, &mut placed);
        let with =
            |(placed, bone): (Affine3A, &Bone)| placed * Affine3A::from_translation(bone.at_m);
        placed.into_iter().zip(&self.bones).map(with).collect()
    }
}

/// The state of the walk at one phase of a stride.
struct Gait {
    /// The amount of motion: 0 standing, 1 walking or running.
    amount: f32,
    /// The gait: 0 walking, 1 running.
    run: f32,
    /// The swing of the thighs, positive forwards.
    swing_rad: f32,
    phase_rad: f32,
}

impl Gait {
    /// The state of a standing walker.
    fn none() -> Gait {
        Gait { amount: 0.0, run: 0.0, swing_rad: 0.0, phase_rad: 0.0 }
    }

    fn of(posture: &Posture, height_m: f32) -> Gait {
        let speed = posture.speed_mps;
        let amount = ((speed - 0.05) / 0.5).clamp(0.0, 1.0);
        // Legs have half of the height; a stride is four times their reach.
        let reach = stride_m(height_m, speed) / (2.0 * height_m);
        Gait {
            amount,
            run: ((speed - 2.0) / 1.2).clamp(0.0, 1.0),
            swing_rad: reach.clamp(0.0, 0.68).asin() * amount,
            phase_rad: posture.stride * TAU,
        }
    }

    /// The rotation of a bone relative to its parent.
    fn turn(&self, index: usize) -> Quat {
        if self.amount == 0.0 {
            return Quat::IDENTITY;
        }
        let side_of = |pair: [usize; 2]| pair.iter().position(|bone| *bone == index);
        // The right leg lags by half a stride.
        let phase = |side: usize| self.phase_rad + side as f32 * TAU * 0.5;
        let forwards = |angle: f32| Quat::from_rotation_y(-angle);
        let knee = |side: usize| {
            let lift = (phase(side) + 0.35).cos().max(0.0);
            self.amount * (0.10 + (0.85 + 0.75 * self.run) * lift * lift)
        };
        if let Some(side) = side_of(bone::THIGH) {
            forwards(self.swing_rad * phase(side).sin() + 0.12 * self.run + 0.05 * self.amount)
        } else if let Some(side) = side_of(bone::LEG) {
            forwards(-knee(side))
        } else if let Some(side) = side_of(bone::FOOT) {
            let thigh = self.swing_rad * phase(side).sin();
            forwards((knee(side) - thigh) * 0.6)
        } else if let Some(side) = side_of(bone::ARM) {
            let out = if side == 0 { 1.0 } else { -1.0 } * 0.06 * self.amount;
            let swing = self.swing_rad * (0.75 + 0.25 * self.run);
            forwards(-swing * phase(side).sin()) * Quat::from_rotation_x(out)
        } else if let Some(side) = side_of(bone::FOREARM) {
            let bend = 0.25 + 0.12 * -phase(side).sin() + 1.15 * self.run;
            forwards(bend * self.amount)
        } else {
            match index {
                bone::HIPS => Quat::from_rotation_z(0.06 * self.amount * self.phase_rad.sin()),
                bone::SPINE => forwards(-0.02 * self.amount - 0.12 * self.run),
                bone::CHEST => Quat::from_rotation_z(-0.12 * self.amount * self.phase_rad.sin()),
                bone::HEAD => forwards(0.08 * self.run),
                _ => Quat::IDENTITY,
            }
        }
    }
}
