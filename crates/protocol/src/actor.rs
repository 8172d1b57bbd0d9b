use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Quat, Vec3};

/// The most actors in one snapshot.
pub const ACTORS_MAX: usize = 16_384;

/// The id of an actor. Ids are never reused within an episode; 0 is [`ActorId::NONE`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct ActorId(pub u32);

impl ActorId {
    /// No actor.
    pub const NONE: ActorId = ActorId(0);
}

impl std::fmt::Display for ActorId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "actor {}", self.0)
    }
}

/// A rigid transform `outer_from_inner`: metres, and a unit quaternion as x, y, z, w.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pose {
    /// Origin of the inner space in the outer space, metres.
    pub position_m: [f32; 3],
    /// Rotation of the inner axes in the outer space as a unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
}

const _: () = assert!(size_of::<Pose>() == 28);

impl Default for Pose {
    fn default() -> Self {
        Pose::IDENTITY
    }
}

impl Pose {
    /// The identity: inner and outer space coincide.
    pub const IDENTITY: Pose = Pose { position_m: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// A pose of glam's types; `rotation` must have unit length.
    pub fn new(position: Vec3, rotation: Quat) -> Pose {
        Pose { position_m: position.to_array(), rotation: rotation.to_array() }
    }

    /// A pose without pitch and roll. `yaw_rad` rotates x towards y, about z.
    pub fn level(position: Vec3, yaw_rad: f32) -> Pose {
        Pose::new(position, Quat::from_rotation_z(yaw_rad))
    }

    /// The origin of the inner space in the outer space, metres.
    pub fn position(&self) -> Vec3 {
        Vec3::from_array(self.position_m)
    }

    /// The rotation of the inner axes in the outer space.
    pub fn rotation(&self) -> Quat {
        Quat::from_array(self.rotation)
    }

    /// The affine transform: `point_in_outer = affine * point_in_inner`.
    pub fn affine(&self) -> Affine3A {
        Affine3A::from_rotation_translation(self.rotation(), self.position())
    }

    /// The product `outer_from_inner * inner_from_deeper`.
    pub fn then(&self, deeper: &Pose) -> Pose {
        Pose::new(
            self.position() + self.rotation() * deeper.position(),
            (self.rotation() * deeper.rotation()).normalize(),
        )
    }

    /// Whether every number is finite and the quaternion has unit length within 1e-3.
    pub fn is_valid(&self) -> bool {
        self.position().is_finite()
            && self.rotation().is_finite()
            && (self.rotation().length_squared() - 1.0).abs() < 2e-3
    }
}

/// Values of [`ActorState::kind`].
pub mod kind {
    /// A car, truck, bus, motorcycle or bicycle.
    pub const VEHICLE: u32 = 1;
    /// A pedestrian.
    pub const WALKER: u32 = 2;
    /// A traffic light of the map.
    pub const TRAFFIC_LIGHT: u32 = 3;
    /// Any other actor: furniture, barriers, litter.
    pub const PROP: u32 = 4;
}

/// Bits of [`ActorState::flags`].
pub mod flag {
    /// Traffic drives a vehicle, or leads a walker.
    pub const AUTOPILOT: u32 = 1 << 0;
    /// Commands alone move it; physics does not.
    pub const KINEMATIC: u32 = 1 << 1;
    /// It touched another actor or a static object during this frame.
    pub const COLLIDING: u32 = 1 << 2;
    /// The handbrake is on.
    pub const HANDBRAKE: u32 = 1 << 3;
    /// The control asks for reverse gear.
    pub const REVERSE: u32 = 1 << 4;
    /// A teleport placed it in this frame.
    pub const TELEPORTED: u32 = 1 << 5;
    /// Traffic lights: the phase stays, whatever the signal plan says.
    pub const FROZEN: u32 = 1 << 6;
    /// Walkers: a collision makes it fall. Set when it is spawned.
    pub const RAGDOLL_ON_HIT: u32 = 1 << 7;
    /// Walkers: it has fallen; the snapshot holds its limbs ([`crate::WalkerLimbs`]).
    pub const FALLEN: u32 = 1 << 8;
    /// Walkers: a pose set by a client is shown, at least in part.
    pub const POSED: u32 = 1 << 9;
    /// Walkers: the host destroys it [`crate::BODY_LIFE_NANOS`] after it fell. Set when it is
    /// spawned, or by [`crate::Command::SetDead`].
    pub const REMOVED_AFTER_FALL: u32 = 1 << 10;
    /// Vehicles: the engine has stopped for good ([`crate::Command::SetDead`]).
    pub const DEAD: u32 = 1 << 11;
    /// Vehicles: the control selects the gear ([`super::VehicleControl::manual_gear`]).
    pub const MANUAL_GEAR: u32 = 1 << 12;
    /// Walkers: it stands up [`crate::LIE_NANOS`] after it fell. Set when it is spawned, cleared by
    /// [`crate::Command::SetDead`].
    pub const GETS_UP_AFTER_FALL: u32 = 1 << 13;
    /// Kinematic props: a moving actor that touches it makes it dynamic. Set when it is spawned.
    pub const RELEASED_ON_HIT: u32 = 1 << 14;
}

/// Units of [`ActorState::phase`] in one stride of a walker.
pub const STRIDE: u32 = 1 << 16;

/// Resolution of published motion, in steps per unit. It is far finer than a sensor measures, and
/// halves the size of a recording of exact states.
pub mod parts {
    /// Steps per metre per second and per radian per second.
    pub const MOTION: u32 = 16_384;
    /// Steps per revolution per minute.
    pub const ENGINE: u32 = 4;
    /// Steps per radian, for wheels.
    pub const WHEEL: u32 = 8_192;
}

/// Bits of [`ActorState::lamps`], the same as CARLA's `VehicleLightState`.
pub mod lamp {
    /// Position lights.
    pub const POSITION: u32 = 1 << 0;
    /// Low beam.
    pub const LOW_BEAM: u32 = 1 << 1;
    /// High beam.
    pub const HIGH_BEAM: u32 = 1 << 2;
    /// Brake lights, independent of the pedal.
    pub const BRAKE: u32 = 1 << 3;
    /// Right indicators.
    pub const RIGHT_BLINKER: u32 = 1 << 4;
    /// Left indicators.
    pub const LEFT_BLINKER: u32 = 1 << 5;
    /// Reversing lights, independent of the gear.
    pub const REVERSE: u32 = 1 << 6;
    /// Fog lights.
    pub const FOG: u32 = 1 << 7;
    /// Interior light.
    pub const INTERIOR: u32 = 1 << 8;
    /// First special light: beacons of emergency vehicles.
    pub const SPECIAL1: u32 = 1 << 9;
    /// Second special light.
    pub const SPECIAL2: u32 = 1 << 10;
    /// In a [`super::VehicleControl`] of traffic: its `lamps` field is valid.
    pub const SWITCHED: u32 = 1 << 31;
    /// Every light.
    pub const ALL: u32 = (1 << 11) - 1;
}

/// Values of [`ActorState::phase`] for traffic lights.
pub mod light {
    /// Red.
    pub const RED: u32 = 0;
    /// Yellow.
    pub const YELLOW: u32 = 1;
    /// Green.
    pub const GREEN: u32 = 2;
    /// Off: priority signs apply.
    pub const OFF: u32 = 3;
}

/// The state of one actor at one frame.
///
/// World space is right-handed: x east, y north, z up. Vehicle space is x forward, y left, z up,
/// with its origin on the ground below the middle of the wheelbase.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ActorState {
    /// The actor.
    pub actor_id: ActorId,
    /// Index into the blueprint catalogue (`town::catalogue`).
    pub blueprint: u32,
    /// One of [`kind`].
    pub kind: u32,
    /// Bits of [`flag`].
    pub flags: u32,
    /// `world_from_actor`. For a fallen walker, the pose of its hips.
    pub pose: Pose,
    /// Velocity of the origin in world space, in steps of 1/[`parts::MOTION`].
    pub velocity_mps: [f32; 3],
    /// Angular velocity in world space, in steps of 1/[`parts::MOTION`].
    pub angular_velocity_radps: [f32; 3],
    /// Mean coordinate acceleration over the frame in world space: the change of the published
    /// velocity.
    pub acceleration_mps2: [f32; 3],
    /// Vehicles: throttle pedal, 0 to 1. Other kinds: 0, here and in every field of vehicles.
    pub throttle: f32,
    /// Vehicles: brake pedal, 0 to 1.
    pub brake: f32,
    /// Vehicles: steering wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// Vehicles: −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// Vehicles: engine speed, revolutions per minute, in steps of 1/[`parts::ENGINE`].
    pub engine_rpm: f32,
    /// Vehicles: steering angle of the front wheels, positive to the left, in steps of
    /// 1/[`parts::WHEEL`].
    pub wheel_steer_rad: f32,
    /// Vehicles: rotation of the wheels modulo one turn, in steps of 1/[`parts::WHEEL`].
    pub wheel_spin_rad: f32,
    /// Traffic lights: one of [`light`]. Walkers: progress through the stride, 0 to [`STRIDE`].
    /// Other kinds: 0.
    pub phase: u32,
    /// Traffic lights: index into `road::Network::signals`. Other kinds: 0.
    pub signal: u32,
    /// Paint: red, green, blue, 255, from the lowest byte.
    pub color: u32,
    /// Vehicles: lights that a client or traffic has switched on, bits of [`lamp`].
    pub lamps: u32,
    /// Vehicles: open doors, one bit each: front left, front right, rear left, rear right.
    pub doors: u32,
}

const _: () = assert!(size_of::<ActorState>() == 128);

impl ActorState {
    /// Velocity of the origin in world space, metres per second.
    pub fn velocity(&self) -> Vec3 {
        Vec3::from_array(self.velocity_mps)
    }

    /// Whether all bits of `mask` are set.
    pub fn has(&self, mask: u32) -> bool {
        self.flags & mask == mask
    }
}

/// Pedals and steering wheel of one vehicle; the latest control holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleControl {
    /// The vehicle.
    pub actor_id: ActorId,
    /// [`flag::HANDBRAKE`] and [`flag::REVERSE`].
    pub flags: u32,
    /// Throttle pedal, 0 to 1.
    pub throttle: f32,
    /// Brake pedal, 0 to 1.
    pub brake: f32,
    /// Steering wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// With `manual_gear`: −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// 1: `gear` holds; 0: the gearbox shifts automatically.
    pub manual_gear: u32,
    /// From traffic only: with [`lamp::SWITCHED`], the lights that are on; all others are off.
    pub lamps: u32,
}

const _: () = assert!(size_of::<VehicleControl>() == 32);
