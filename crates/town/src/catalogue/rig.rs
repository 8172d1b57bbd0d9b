//! How the pieces of a blueprint move: a pure function of what an actor's state says.

use glam::{Affine3A, Quat, Vec2, Vec3, vec2, vec3};

use super::{
    posture::Posture,
    skeleton::{BODY_BONES, Skeleton},
};

/// The object of faces that are seen only while a door is open.
pub(crate) const INTERIOR: u32 = 1000;

/// The pieces that a blueprint is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// One for each piece.
    pub joints: Vec<Joint>,
    /// Of a walker.
    pub(crate) skeleton: Option<Skeleton>,
}

/// One piece and how it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// As `wheel_fl`, `door_rr`, `crl_thigh__L`.
    pub name: &'static str,
    /// How.
    pub motion: Motion,
}

/// How a piece moves. Points and axes are in actor space at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Not at all.
    Still,
    /// Not at all; seen while every door is shut. It holds the doors.
    Shut,
    /// Not at all; seen while a door is open.
    Ajar,
    /// About its hinge; seen while any door is open.
    Door {
        /// Bit of [`Posture::doors`]: CARLA's order, front left, front right, rear left, rear right.
        number: u32,
        /// A point of the hinge's axis.
        hinge_m: Vec3,
        /// Of unit length.
        axis: Vec3,
        /// How far it opens.
        opens_rad: f32,
    },
    /// Rolls about its hub, after the steering turned it.
    Wheel {
        /// Its middle.
        hub_m: Vec3,
        /// What steering turns it about; zero: it is not steered.
        steers_about: Vec3,
    },
    /// Turns with the steering: handlebar and fork.
    Steer {
        /// A point of the axis.
        pivot_m: Vec3,
        /// Of unit length.
        axis: Vec3,
    },
    /// Pedals go round with the wheels.
    Crank {
        /// Their axle.
        axle_m: Vec3,
    },
    /// A cyclist's thigh or shin, whose foot stays on its pedal.
    Leg {
        /// The leg at rest.
        leg: PedalLeg,
        /// Below the knee.
        is_shin: bool,
    },
    /// Follows a walker's bone of this number.
    Bone(usize),
}

/// A leg that pedals, seen from the side: (x, z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PedalLeg {
    /// The hip.
    pub hip_m: Vec2,
    /// The crank's axle.
    pub axle_m: Vec2,
    /// From the axle to the pedal, at rest.
    pub arm_m: Vec2,
    /// From the pedal to the ankle.
    pub ankle_m: Vec2,
    /// Of thigh and shin.
    pub lengths_m: Vec2,
}

impl Joint {
    /// What it turns about, in actor space at rest; the origin if it does not turn.
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
    /// One piece that does not move.
    pub(crate) fn still() -> Rig {
        Rig { joints: vec![Joint { name: "body", motion: Motion::Still }], skeleton: None }
    }

    /// Whether it is one piece that does not move.
    pub fn is_still(&self) -> bool {
        matches!(self.joints[..], [Joint { motion: Motion::Still, .. }])
    }

    /// How many doors open.
    pub fn door_count(&self) -> usize {
        self.joints.iter().filter(|joint| matches!(joint.motion, Motion::Door { .. })).count()
    }

    /// Says of each piece that is seen where it is: `show(piece, actor_from_piece)`.
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

/// A turn about an axis through a point.
fn turned(point: Vec3, axis: Vec3, angle_rad: f32) -> Affine3A {
    about(point, Quat::from_axis_angle(axis, angle_rad))
}

fn about(point: Vec3, turn: Quat) -> Affine3A {
    Affine3A::from_rotation_translation(turn, point - turn * point)
}

impl PedalLeg {
    /// Where the knee is when the crank has turned so far.
    pub(crate) fn knee(&self, turn_rad: f32) -> (Vec2, Vec2) {
        let (sin, cos) = turn_rad.sin_cos();
        // About y, x goes down and z forward.
        let arm =
            vec2(self.arm_m.x * cos + self.arm_m.y * sin, self.arm_m.y * cos - self.arm_m.x * sin);
        let ankle = self.axle_m + arm + self.ankle_m;
        let [thigh, shin] = self.lengths_m.to_array();
        let reach = ankle - self.hip_m;
        let far = reach.length().clamp((thigh - shin).abs() + 0.01, thigh + shin - 0.001);
        let along = (thigh * thigh - shin * shin + far * far) / (2.0 * far);
        let aside = (thigh * thigh - along * along).max(0.0).sqrt();
        let ahead = reach / reach.length().max(1e-6);
        // The knee is on the side of the front.
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
        // From x towards z is a negative turn about y.
        let turn = Quat::from_rotation_y(-(a.perp_dot(b)).atan2(a.dot(b)));
        let pivot = vec3(from0.x, 0.0, from0.y);
        let shift = vec3(from.x - from0.x, 0.0, from.y - from0.y);
        Affine3A::from_rotation_translation(turn, pivot + shift - turn * pivot)
    }
}
