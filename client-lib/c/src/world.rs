//! The world at one frame.
#![expect(unsafe_code, reason = "names of C functions")]

use std::mem::{MaybeUninit, offset_of};

use bytemuck::{AnyBitPattern, cast_slice};
use client_lib::{ActorId, ClientError, Pose, clock, wire::ActorState};

use crate::{
    argument::place,
    client::{OmnibusClient, enter},
    status::{Fault, OmnibusStatus, call},
};

/// A rigid transform outer_from_inner.
#[derive(Clone, Copy, Debug, Default, PartialEq, AnyBitPattern)]
#[repr(C)]
pub struct OmnibusPose {
    /// Origin of the inner space in the outer space, metres.
    pub position_m: [f32; 3],
    /// Rotation of the inner axes in the outer space: a unit quaternion x, y, z, w.
    pub rotation_xyzw: [f32; 4],
}

impl From<Pose> for OmnibusPose {
    fn from(pose: Pose) -> OmnibusPose {
        OmnibusPose { position_m: pose.position_m, rotation_xyzw: pose.rotation }
    }
}

impl OmnibusPose {
    /// The pose, checked.
    pub(crate) fn checked(&self, what: &str) -> Result<Pose, Fault> {
        let pose = Pose { position_m: self.position_m, rotation: self.rotation_xyzw };
        if pose.is_valid() {
            return Ok(pose);
        }
        Err(Fault::argument(format!(
            "{what} has position {:?} and rotation {:?}; finite numbers and a unit quaternion are \
             needed, 0 0 0 1 for none",
            self.position_m, self.rotation_xyzw
        )))
    }
}

/// A car, truck, bus, motorcycle or bicycle.
pub const OMNIBUS_KIND_VEHICLE: u32 = 1;
/// A pedestrian.
pub const OMNIBUS_KIND_WALKER: u32 = 2;
/// A traffic light of the map.
pub const OMNIBUS_KIND_TRAFFIC_LIGHT: u32 = 3;
/// Anything else that can be spawned.
pub const OMNIBUS_KIND_PROP: u32 = 4;

/// Traffic drives the actor.
pub const OMNIBUS_FLAG_AUTOPILOT: u32 = 1;
/// Teleports and set velocities alone move the actor.
pub const OMNIBUS_FLAG_KINEMATIC: u32 = 2;
/// The actor touched something during this frame.
pub const OMNIBUS_FLAG_COLLIDING: u32 = 4;
/// The handbrake is on.
pub const OMNIBUS_FLAG_HANDBRAKE: u32 = 8;
/// The control selects the reverse gear.
pub const OMNIBUS_FLAG_REVERSE: u32 = 16;

/// One actor at one frame, where the simulator wrote it. Vehicle space is x forward, y left, z up,
/// with its origin on the ground below the middle of the wheelbase.
#[derive(Clone, Copy, Debug, Default, PartialEq, AnyBitPattern)]
#[repr(C)]
pub struct OmnibusActor {
    /// The id, never reused within an episode.
    pub actor_id: u32,
    /// Index of the blueprint in the catalogue.
    pub blueprint: u32,
    /// One of OMNIBUS_KIND_….
    pub kind: u32,
    /// Bits OMNIBUS_FLAG_…; others may be set.
    pub flags: u32,
    /// world_from_actor.
    pub pose: OmnibusPose,
    /// Velocity of the origin in world space, m/s.
    pub velocity_mps: [f32; 3],
    /// Angular velocity in world space, rad/s.
    pub angular_velocity_radps: [f32; 3],
    /// Mean acceleration over the frame in world space, without gravity, m/s².
    pub acceleration_mps2: [f32; 3],
    /// Vehicles: accelerator pedal, 0 to 1.
    pub throttle: f32,
    /// Vehicles: brake pedal, 0 to 1.
    pub brake: f32,
    /// Vehicles: steering wheel, -1 (full right) to 1 (full left).
    pub steer: f32,
    /// Vehicles: -1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// Vehicles: engine speed, revolutions per minute.
    pub engine_rpm: f32,
    /// Vehicles: angle of the front wheels, positive to the left, rad.
    pub wheel_steer_rad: f32,
    /// Vehicles: rotation of the wheels modulo one turn, rad.
    pub wheel_spin_rad: f32,
    /// Traffic lights: 0 red, 1 yellow, 2 green, 3 off. Walkers: how much of a stride is done, of
    /// 65536.
    pub phase: u32,
    /// Traffic lights: index of the signal.
    pub signal: u32,
    /// Paint: red, green, blue, alpha; sRGB.
    pub color_rgba: [u8; 4],
    /// Vehicles: bits of the lights that are on.
    pub lights: u32,
    /// Vehicles: bits of the doors that are open: front left, front right, rear left, rear right.
    pub doors: u32,
}

/// The layout is that of the protocol.
const _: () = {
    assert!(size_of::<OmnibusActor>() == size_of::<ActorState>());
    assert!(align_of::<OmnibusActor>() == align_of::<ActorState>());
    assert!(offset_of!(OmnibusActor, flags) == offset_of!(ActorState, flags));
    assert!(offset_of!(OmnibusActor, pose) == offset_of!(ActorState, pose));
    assert!(offset_of!(OmnibusActor, velocity_mps) == offset_of!(ActorState, velocity_mps));
    assert!(offset_of!(OmnibusActor, throttle) == offset_of!(ActorState, throttle));
    assert!(offset_of!(OmnibusActor, gear) == offset_of!(ActorState, gear));
    assert!(offset_of!(OmnibusActor, engine_rpm) == offset_of!(ActorState, engine_rpm));
    assert!(offset_of!(OmnibusActor, phase) == offset_of!(ActorState, phase));
    assert!(offset_of!(OmnibusActor, signal) == offset_of!(ActorState, signal));
    assert!(offset_of!(OmnibusActor, color_rgba) == offset_of!(ActorState, color));
    assert!(offset_of!(OmnibusActor, lights) == offset_of!(ActorState, lamps));
    assert!(offset_of!(OmnibusActor, doors) == offset_of!(ActorState, doors));
};

/// The world at the frame that was taken in last.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct OmnibusWorld {
    /// The frame.
    pub frame: u64,
    /// Simulated time since the world was loaded.
    pub sim_time_nanos: u64,
    /// A hash of everything that decides the future.
    pub state_hash: u64,
    /// When the host sent the snapshot: nanoseconds of omnibus_clock_nanos().
    pub published_nanos: u64,
    /// Every actor, sorted by id, in shared memory. Read-only.
    pub actors: *const OmnibusActor,
    /// The number of actors.
    pub actor_count: usize,
    /// The number of the world, from 1: loading a world raises it.
    pub episode: u32,
}

/// Returns the world at the frame that was taken in last. Nothing is copied: `world->actors` is the
/// simulator's own memory. It is valid until the next omnibus_tick(), omnibus_await_frame(),
/// omnibus_refresh() or omnibus_close() of this client.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_world(
    client: Option<&OmnibusClient>,
    world: Option<&mut MaybeUninit<OmnibusWorld>>,
) -> OmnibusStatus {
    call("omnibus_world", || {
        let client = enter(client)?;
        let now = client.world();
        let header = now.header();
        let actors: &[OmnibusActor] = cast_slice(now.states());
        place(world, "world")?.write(OmnibusWorld {
            frame: header.stamp.frame.0,
            sim_time_nanos: header.stamp.sim_time_nanos,
            state_hash: header.state_hash,
            published_nanos: header.published_nanos,
            actors: actors.as_ptr(),
            actor_count: actors.len(),
            episode: header.stamp.episode,
        });
        Ok(())
    })
}

/// Finds one actor at the frame that was taken in last. `*actor` is valid as long as the actors of
/// omnibus_world().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_actor(
    client: Option<&OmnibusClient>,
    actor_id: u32,
    actor: Option<&mut MaybeUninit<*const OmnibusActor>>,
) -> OmnibusStatus {
    call("omnibus_actor", || {
        let client = enter(client)?;
        let actor_id = ActorId(actor_id);
        let state = client.world().state(actor_id);
        let state = state.ok_or(ClientError::NoSuchActor { actor_id })?;
        let actors: &[OmnibusActor] = cast_slice(std::slice::from_ref(state));
        place(actor, "actor")?.write(actors.as_ptr());
        Ok(())
    })
}

/// Returns the monotonic clock of the machine, nanoseconds: that of published_nanos.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_clock_nanos() -> u64 {
    clock::now_nanos()
}
