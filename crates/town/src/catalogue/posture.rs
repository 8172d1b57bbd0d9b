//! What decides where the pieces of an actor are.

use glam::{Quat, Vec3};

/// What decides how an actor holds itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Posture<'a> {
    /// How far steered wheels are turned, positive to the left.
    pub steer_rad: f32,
    /// How far wheels have rolled, modulo one turn.
    pub spin_rad: f32,
    /// Open doors, one bit each.
    pub doors: u32,
    /// How much of the present stride (two steps) is done, 0 to 1.
    pub stride: f32,
    /// Over ground. Metres per second.
    pub speed_mps: f32,
    /// Of a walker who fell: how each limb is turned against the one that carries it, in the order
    /// of [`LIMB_BONES`](crate::LIMB_BONES).
    pub limbs: Option<[Quat; 10]>,
    /// What a walker was told to hold beside its walk.
    pub given: Option<Given<'a>>,
}

/// A pose that a walker was given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Given<'a> {
    /// How much of it shows: 0 the walk alone, 1 it alone.
    pub share: f32,
    /// By bone, `parent_from_bone` of those that were set: where it begins, and how it is turned.
    /// The others are as at rest.
    pub bones: &'a [Option<(Vec3, Quat)>],
}
