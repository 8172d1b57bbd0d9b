use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{ActorId, Stamp};

/// Header of traffic's one sample per frame: what it decided on `stamp.frame`, which acts in the
/// next one. The payload holds controls, then lights, then the mind, each at a 64-byte edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[type_name("TrafficHeader")]
#[repr(C)]
pub struct TrafficHeader {
    /// The frame that was planned on.
    pub stamp: Stamp,
    /// How many [`crate::VehicleControl`]s.
    pub control_count: u32,
    /// How many [`LightState`]s.
    pub light_count: u32,
    /// Bytes of the mind: all that traffic must know beyond the snapshot to go on as if nothing
    /// had happened. Opaque to everybody else.
    pub mind_len: u64,
    /// Monotonic clock when planning began.
    pub begin_nanos: u64,
    /// Monotonic clock when planning ended.
    pub end_nanos: u64,
}

const _: () = assert!(size_of::<TrafficHeader>() == 56);

/// The colour that one traffic light shows from the next frame on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[type_name("LightState")]
#[repr(C)]
pub struct LightState {
    /// The light, an actor of the world.
    pub actor_id: ActorId,
    /// One of [`crate::light`].
    pub phase: u32,
}
