//! How the pieces of a blueprint move: a pure function of an actor's posture.

use glam::{Affine3A, Quat, Vec2, Vec3, vec2, vec3};

use super::{
    posture::Posture,
    skeleton::{BODY_BONES, Skeleton},
};

/// The object of driver and passengers; a parked vehicle has none.
pub(crate) const OCCUPANTS: u32 = 1000;

/// The joints of a blueprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// One joint for each piece.
    pub joints: Vec<Joint>,
    /// The skeleton of a walker.
    pub(crate) skeleton: Option<Skeleton>,
}

/// One piece and its motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The name, such as `wheel_fl`, `door_rr`, `crl_thigh__L`.
    pub name: &'static str,
    /// The motion of the piece.
    pub motion: Motion,
}

/// The motion of a piece. Points and axes are in actor space at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Does not move.
    Still,
    /// Does not move; visible while all doors are closed. It includes the doors.
    Shut,
    /// Does not move; visible while a door is open.
    Ajar,
    /// Turns about a hinge; visible while any door is open.
    Door {
        /// The bit in [`Posture::doors`], in CARLA's order: front left, front right, rear left,
        /// rear right.
        number: u32,
        /// A point on the axis of the hinge.
        hinge_m: Vec3,
        /// The axis, of unit length.
        axis: Vec3,
        /// The angle of the open door.
        opens_rad: f32,
    },
    /// Rolls about its hub, after the steering has turned it.
    Wheel {
        /// The middle of the hub.
        hub_m: Vec3,
        /// The steering axis; zero for a wheel that is not steered.
        steers_about: Vec3,
    },
    /// Turns with the steering: handlebar and fork.
    Steer {
        /// A point on the axis.
        pivot_m: Vec3,
        /// The axis, of unit length.
        axis: Vec3,
    },
    /// Turns with the wheels: pedals.
    Crank {
        /// The axle of the crank.
        axle_m: Vec3,
    },
    /// Moves as a cyclist's thigh or shin; the foot stays on its pedal.
    Leg {
        /// The leg at rest.
        leg: PedalLeg,
        /// Whether the piece is the shin.
        is_shin: bool,
    },
    /// Follows the walker's bone of this index.
    Bone(usize),
}

/// A pedalling leg in side view: (x, z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PedalLeg {
    /// The hip joint.
    pub hip_m: Vec2,
    /// The axle of the crank.
    pub axle_m: Vec2,
    /// From the axle to the pedal, at rest.
    pub arm_m: Vec2,
    /// From the pedal to the ankle.
    pub ankle_m: Vec2,
    /// The lengths of thigh and shin.
    pub lengths_m: Vec2,
}

impl Joint {
    /// The point about which the piece turns, in actor space at rest; the origin if it does not
    /// turn.
    pub fn pivot_m(&self) -> Vec3 {
        match self.motion {
            Motion::Door { hinge_m, .. } => hinge_m,
            Motion::Wheel { hub_m, .. } => hub_m,
            Motion::Steer { pivot_m, .. } => pivot_m,
            Motion::Crank { axle_m } => axle_m,
            Motion::Leg { leg, is_shin } => {
                let at = if is_shin { leg.knee(0.0).0 } else { leg.hip_m };
                vec3(at.x, 0.0, at.y)
            }
            Motion::Still | Motion::Shut | Motion::Ajar | Motion::Bone(_) => Vec3::ZERO,
        }
    }
}

impl Rig {
    /// A rig of one piece that does not move.
    pub(crate) fn still() -> Rig {
        Rig { joints: vec![Joint { name: "body", motion: Motion::Still }], skeleton: None }
    }

    /// Whether the rig is one piece that does not move.
    pub fn is_still(&self) -> bool {
        matches!(self.joints[..], [Joint { motion: Motion::Still, .. }])
    }

    /// Whether a piece is the body, with its doors shut or ajar; occupants are shown with it.
    pub fn is_body(&self, piece: usize) -> bool {
        match self.joints[piece].motion {
            Motion::Shut | Motion::Ajar => true,
            Motion::Still => piece == 0,
            _ => false,
        }
    }

    /// The number of doors that open.
    pub fn door_count(&self) -> usize {
        self.joints.iter().filter(|joint| matches!(joint.motion, Motion::Door { .. })).count()
    }

    /// Calls `show(piece, actor_from_piece)` for each piece that is visible in this posture.
    pub fn place(&self, posture: &Posture, mut show: impl FnMut(usize, Affine3A)) {
        let is_ajar = posture.doors != 0;
        let mut bones = [Affine3A::IDENTITY; BODY_BONES];
        if let Some(skeleton) = &self.skeleton {
            skeleton.pose(posture, &mut bones);
        }
        for (piece, joint) in self.joints.iter().enumerate() {
            let placed = match joint.motion {
                Motion::Still => Affine3A::IDENTITY,
                Motion::Shut if !is_ajar => Affine3A::IDENTITY,
                Motion::Ajar if is_ajar => Affine3A::IDENTITY,
                Motion::Shut | Motion::Ajar => continue,
                Motion::Door { number, hinge_m, axis, opens_rad } => {
                    if !is_ajar {
                        continue;
                    }
                    let is_open = posture.doors >> number & 1 == 1;
                    turned(hinge_m, axis, if is_open { opens_rad } else { 0.0 })
                }
                Motion::Wheel { hub_m, steers_about } => {
                    let steer = if steers_about == Vec3::ZERO {
                        Quat::IDENTITY
                    } else {
                        Quat::from_axis_angle(steers_about, posture.steer_rad)
                    };
                    about(hub_m, steer * Quat::from_rotation_y(posture.spin_rad))
                }
                Motion::Steer { pivot_m, axis } => turned(pivot_m, axis, posture.steer_rad),
                Motion::Crank { axle_m } => turned(axle_m, Vec3::Y, posture.spin_rad),
                Motion::Leg { leg, is_shin } => leg.place(posture.spin_rad, is_shin),
                Motion::Bone(bone) => bones[bone],
            };
            show(piece, placed);
        }
    }
}

/// A rotation about an axis through a point.
fn turned(point: Vec3, axis: Vec3, angle_rad: f32) -> Affine3A {
    about(point, Quat::from_axis_angle(axis, angle_rad))
}

fn about(point: Vec3, turn: Quat) -> Affine3A {
    Affine3A::from_rotation_translation(turn, point - turn * point)
}

impl PedalLeg {
    /// The positions of knee and ankle when the crank has turned by this angle.
    pub(crate) fn knee(&self, turn_rad: f32) -> (Vec2, Vec2) {
        let (sin, cos) = turn_rad.sin_cos();
        // A positive rotation about y turns z towards x.
        let arm =
            vec2(self.arm_m.x * cos + self.arm_m.y * sin, self.arm_m.y * cos - self.arm_m.x * sin);
        let ankle = self.axle_m + arm + self.ankle_m;
        let [thigh, shin] = self.lengths_m.to_array();
        let reach = ankle - self.hip_m;
        let far = reach.length().clamp((thigh - shin).abs() + 0.01, thigh + shin - 0.001);
        let along = (thigh * thigh - shin * shin + far * far) / (2.0 * far);
        let aside = (thigh * thigh - along * along).max(0.0).sqrt();
        let ahead = reach / reach.length().max(1e-6);
        // The knee bends to the front.
        let knee = self.hip_m + ahead * along + vec2(-ahead.y, ahead.x) * aside;
        (knee, self.hip_m + ahead * far)
    }

    fn place(&self, turn_rad: f32, is_shin: bool) -> Affine3A {
        let ((knee0, ankle0), (knee, ankle)) = (self.knee(0.0), self.knee(turn_rad));
        let (from0, to0, from, to) = if is_shin {
            (knee0, ankle0, knee, ankle)
        } else {
            (self.hip_m, knee0, self.hip_m, knee)
        };
        let (a, b) = (to0 - from0, to - from);
        // A rotation from x towards z is negative about y.
        let turn = Quat::from_rotation_y(-(a.perp_dot(b)).atan2(a.dot(b)));
        let pivot = vec3(from0.x, 0.0, from0.y);
        let shift = vec3(from.x - from0.x, 0.0, from.y - from0.y);
        Affine3A::from_rotation_translation(turn, pivot + shift - turn * pivot)
    }
}
