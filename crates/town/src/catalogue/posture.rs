//! The inputs that decide where the pieces of an actor are.

use glam::{Quat, Vec3};

/// The posture of an actor: everything that moves its pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Posture<'a> {
    /// The angle of the steered wheels, positive to the left.
    pub steer_rad: f32,
    /// The rotation of the wheels, modulo one turn.
    pub spin_rad: f32,
    /// Open doors, one bit each.
    pub doors: u32,
    /// The phase of the current stride (two steps), 0 to 1.
    pub stride: f32,
    /// The speed over ground. Metres per second.
    pub speed_mps: f32,
    /// For a fallen walker: the rotation of each limb relative to its parent, in the order of
    /// [`LIMB_BONES`](crate::LIMB_BONES).
    pub limbs: Option<[Quat; 10]>,
    /// A pose set by a client, blended with the walk.
    pub given: Option<GivenPose<'a>>,
}

/// A pose that a client set for a walker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPose<'a> {
    /// The weight of the pose: 0 shows only the walk, 1 only the pose.
    pub weight: f32,
    /// By bone, `parent_from_bone` as origin and rotation for the bones that were set. The others
    /// are at rest.
    pub bones: &'a [Option<(Vec3, Quat)>],
}
