use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Quat, Vec3};

/// The most actors that one snapshot holds.
pub const ACTORS_MAX: usize = 16_384;

/// Names an actor. Never reused within an episode; 0 names nobody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct ActorId(pub u32);

impl ActorId {
    /// Nobody.
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
    /// Where the inner space's origin lies in the outer space.
    pub position_m: [f32; 3],
    /// How the inner axes are turned in the outer space, as x, y, z, w. Unit length.
    pub rotation: [f32; 4],
}

const _: () = assert!(size_of::<Pose>() == 28);

impl Default for Pose {
    fn default() -> Self {
        Pose::IDENTITY
    }
}

impl Pose {
    /// Inner and outer space are the same.
    pub const IDENTITY: Pose = Pose { position_m: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// From glam's types; `rotation` must be of unit length.
    pub fn new(position: Vec3, rotation: Quat) -> Pose {
        Pose { position_m: position.to_array(), rotation: rotation.to_array() }
    }

    /// A level pose: `yaw_rad` turns x towards y, about z.
    pub fn level(position: Vec3, yaw_rad: f32) -> Pose {
        Pose::new(position, Quat::from_rotation_z(yaw_rad))
    }

    /// The origin.
    pub fn position(&self) -> Vec3 {
        Vec3::from_array(self.position_m)
    }

    /// The turn.
    pub fn rotation(&self) -> Quat {
        Quat::from_array(self.rotation)
    }

    /// Ready for arithmetic: `point_in_outer = affine * point_in_inner`.
    pub fn affine(&self) -> Affine3A {
        Affine3A::from_rotation_translation(self.rotation(), self.position())
    }

    /// `outer_from_inner * inner_from_deeper`.
    pub fn then(&self, deeper: &Pose) -> Pose {
        Pose::new(
            self.position() + self.rotation() * deeper.position(),
            (self.rotation() * deeper.rotation()).normalize(),
        )
    }

    /// Every number is finite and the quaternion is of unit length within 1e-3.
    pub fn is_valid(&self) -> bool {
        self.position().is_finite()
            && self.rotation().is_finite()
            && (self.rotation().length_squared() - 1.0).abs() < 2e-3
    }
}

/// What kind of thing an actor is.
pub mod kind {
    /// A car, truck, bus, motorcycle or bicycle.
    pub const VEHICLE: u32 = 1;
    /// A pedestrian.
    pub const WALKER: u32 = 2;
    /// A traffic light of the map.
    pub const TRAFFIC_LIGHT: u32 = 3;
    /// Anything else that can stand in the world.
    pub const PROP: u32 = 4;
}

/// Bits of [`ActorState::flags`].
pub mod flag {
    /// The traffic room drives it.
    pub const AUTOPILOT: u32 = 1 << 0;
    /// Physics does not move it.
    pub const KINEMATIC: u32 = 1 << 1;
    /// It touched something during this frame.
    pub const COLLIDING: u32 = 1 << 2;
    /// The handbrake is on.
    pub const HANDBRAKE: u32 = 1 << 3;
    /// The driver asks for reverse gear.
    pub const REVERSE: u32 = 1 << 4;
    /// It was put where it is by a teleport in this frame.
    pub const TELEPORTED: u32 = 1 << 5;
    /// A traffic light: it keeps its colour, whatever traffic plans.
    pub const FROZEN: u32 = 1 << 6;
    /// A walker: it falls when it is hit. Said when it is spawned.
    pub const RAGDOLL_ON_HIT: u32 = 1 << 7;
    /// A walker: it fell, and lies.
    pub const FALLEN: u32 = 1 << 8;
    /// A walker: some of a pose that clients gave it shows.
    pub const POSED: u32 = 1 << 9;
}

/// Of a walker, [`ActorState::phase`] counts so many to a stride.
pub const STRIDE: u32 = 1 << 16;

/// What physics publishes of motion is rounded to whole parts of a unit, far finer than a sensor
/// measures: a recording of exact states is half as large.
pub mod parts {
    /// Of a metre per second and of a radian per second.
    pub const MOTION: u32 = 16_384;
    /// Of a revolution per minute.
    pub const ENGINE: u32 = 4;
    /// Of a radian, for wheels.
    pub const WHEEL: u32 = 8_192;
}

/// Bits of [`ActorState::lamps`]: CARLA's `VehicleLightState`.
pub mod lamp {
    /// Position lamps.
    pub const POSITION: u32 = 1 << 0;
    /// Head lamps.
    pub const LOW_BEAM: u32 = 1 << 1;
    /// The other head lamps.
    pub const HIGH_BEAM: u32 = 1 << 2;
    /// Brake lamps, whatever the pedal says.
    pub const BRAKE: u32 = 1 << 3;
    /// Indicators on the right.
    pub const RIGHT_BLINKER: u32 = 1 << 4;
    /// Indicators on the left.
    pub const LEFT_BLINKER: u32 = 1 << 5;
    /// Reversing lamps, whatever the gear is.
    pub const REVERSE: u32 = 1 << 6;
    /// Fog lamps.
    pub const FOG: u32 = 1 << 7;
    /// Inside.
    pub const INTERIOR: u32 = 1 << 8;
    /// Beacons.
    pub const SPECIAL1: u32 = 1 << 9;
    /// The other beacons.
    pub const SPECIAL2: u32 = 1 << 10;
    /// Of a control of traffic's: it says which lamps are on.
    pub const SWITCHED: u32 = 1 << 31;
    /// Every lamp there is.
    pub const ALL: u32 = (1 << 11) - 1;
}

/// Values of [`ActorState::phase`] of a traffic light.
pub mod light {
    /// Stop.
    pub const RED: u32 = 0;
    /// Stop if you can.
    pub const YELLOW: u32 = 1;
    /// Go.
    pub const GREEN: u32 = 2;
    /// Dark: the priority signs rule.
    pub const OFF: u32 = 3;
}

/// Where one actor is and how it moves, at one frame.
///
/// World space is right-handed: x east, y north, z up. Vehicle space is x forward, y left, z up,
/// with its origin on the ground below the middle of the wheelbase.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ActorState {
    /// Whose state this is.
    pub actor_id: ActorId,
    /// Index into the blueprint catalogue (`town::catalogue`).
    pub blueprint: u32,
    /// One of [`kind`].
    pub kind: u32,
    /// Bits of [`flag`].
    pub flags: u32,
    /// `world_from_actor`.
    pub pose: Pose,
    /// Of the origin, in world space; in [`parts::MOTION`].
    pub velocity_mps: [f32; 3],
    /// In world space; in [`parts::MOTION`].
    pub angular_velocity_radps: [f32; 3],
    /// Mean over the frame, in world space, gravity not felt: what the published velocity gained.
    pub acceleration_mps2: [f32; 3],
    /// Pedal, 0 to 1. This and the other fields of vehicles are 0 for other kinds of actors.
    pub throttle: f32,
    /// Pedal, 0 to 1.
    pub brake: f32,
    /// Wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// Engine speed, revolutions per minute; in [`parts::ENGINE`].
    pub engine_rpm: f32,
    /// How far the front wheels are turned, positive to the left; in [`parts::WHEEL`].
    pub wheel_steer_rad: f32,
    /// How far the wheels have rolled, modulo one turn; in [`parts::WHEEL`].
    pub wheel_spin_rad: f32,
    /// A traffic light's colour (see [`light`]); how much of a walker's stride is done, in
    /// [`STRIDE`]ths.
    pub phase: u32,
    /// A traffic light's signal: index into `road::Network::signals`. Else 0.
    pub signal: u32,
    /// Red, green, blue, 255, from the lowest byte: the paint.
    pub color: u32,
    /// Lamps that a client switched on, or traffic for it: bits of [`lamp`].
    pub lamps: u32,
    /// Doors that stand open, one bit each: front left, front right, rear left, rear right.
    pub doors: u32,
}

const _: () = assert!(size_of::<ActorState>() == 128);

impl ActorState {
    /// Metres per second over ground, in world space.
    pub fn velocity(&self) -> Vec3 {
        Vec3::from_array(self.velocity_mps)
    }

    /// Whether all bits of `mask` are set.
    pub fn has(&self, mask: u32) -> bool {
        self.flags & mask == mask
    }
}

/// Pedals and wheel of one vehicle; the latest holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleControl {
    /// Whose pedals.
    pub actor_id: ActorId,
    /// [`flag::HANDBRAKE`] and [`flag::REVERSE`].
    pub flags: u32,
    /// 0 to 1.
    pub throttle: f32,
    /// 0 to 1.
    pub brake: f32,
    /// −1 (full right) to 1 (full left).
    pub steer: f32,
    /// With `manual_gear`: −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// 1: `gear` holds; 0: the gearbox shifts by itself.
    pub manual_gear: u32,
    /// Traffic's alone: with [`lamp::SWITCHED`], which lamps it switches on, and all others off.
    pub lamps: u32,
}

const _: () = assert!(size_of::<VehicleControl>() == 32);
