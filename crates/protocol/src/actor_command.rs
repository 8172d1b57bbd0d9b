//! Parameters of the commands that create and change actors.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Name, Pose};

/// Parameters of [`crate::Command::Spawn`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Spawn {
    /// The blueprint's id, for example `vehicle.tesla.model3`.
    pub blueprint: Name,
    /// Bits of [`crate::flag`]: `AUTOPILOT`, `KINEMATIC`, `RAGDOLL_ON_HIT`, `REMOVED_AFTER_FALL`,
    /// `GETS_UP_AFTER_FALL`, `RELEASED_ON_HIT`.
    pub flags: u32,
    /// `world_from_actor`. A vehicle at most 1 m above the road is placed on the road.
    pub pose: Pose,
    /// Paint: red, green, blue, 255; 0: the blueprint's default.
    pub color: u32,
    /// The role name, for example `hero`.
    pub role: Name,
}

/// Parameters of [`crate::Command::Teleport`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Teleport {
    /// The actor.
    pub actor_id: ActorId,
    /// `world_from_actor`.
    pub pose: Pose,
}

/// Parameters of [`crate::Command::SetVelocity`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SetVelocity {
    /// The actor.
    pub actor_id: ActorId,
    /// Linear velocity in world space.
    pub velocity_mps: [f32; 3],
    /// Angular velocity in world space.
    pub angular_velocity_radps: [f32; 3],
}

/// Parameters of [`crate::Command::SetTrafficLight`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetTrafficLight {
    /// The traffic light.
    pub actor_id: ActorId,
    /// 1: the light is frozen in `phase`; 0: it follows the signal plan.
    pub hold: u32,
    /// One of [`crate::light`].
    pub phase: u32,
}

/// Simulated time for which a fallen walker with [`crate::flag::REMOVED_AFTER_FALL`] lies before the
/// host destroys it. CARLA removes the body of a dead walker after the same time.
pub const BODY_LIFE_NANOS: u64 = 10_000_000_000;

/// Simulated time for which a fallen walker with [`crate::flag::GETS_UP_AFTER_FALL`] lies before it
/// stands up; longer while there is no room for it to stand.
pub const LIE_NANOS: u64 = 5_000_000_000;

/// Parameters of [`crate::Command::SetDead`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetDead {
    /// The walker or vehicle.
    pub actor_id: ActorId,
    /// 1: a walker's body is removed [`BODY_LIFE_NANOS`] after the fall; 0: only if its flag
    /// `REMOVED_AFTER_FALL` is set.
    pub removes_body: u32,
}

/// Parameters of [`crate::Command::SetPhysics`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetPhysics {
    /// The actor.
    pub actor_id: ActorId,
    /// 1: dynamic: gravity, contacts and controls move it; 0: kinematic.
    pub on: u32,
}

/// Parameters of [`crate::Command::SetVehicleLights`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetVehicleLights {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Lights that are on: bits of [`crate::lamp`].
    pub lamps: u32,
}

/// Parameters of [`crate::Command::SetDoors`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetDoors {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Open doors, in the bits of [`crate::ActorState::doors`].
    pub open: u32,
}

/// Parameters of [`crate::Command::Autopilot`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Autopilot {
    /// The actor.
    pub actor_id: ActorId,
    /// 1: traffic drives it; 0: clients do.
    pub on: u32,
}
