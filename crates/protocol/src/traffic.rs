use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Block, Stamp, VehicleControl};

/// Header of the one message that traffic sends per frame: its decisions on `stamp.frame`, which act
/// in the next frame. The payload holds controls of vehicles, controls of walkers, traffic lights and
/// the planner's state, each aligned to 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TrafficHeader {
    /// The frame that the plan is based on.
    pub stamp: Stamp,
    /// Number of [`crate::VehicleControl`]s.
    pub control_count: u32,
    /// Number of [`LightState`]s.
    pub light_count: u32,
    /// Number of [`WalkerControl`]s.
    pub walker_count: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// Bytes of the planner's state: what a restarted planner needs beside the snapshot to continue
    /// identically. Opaque to other crates.
    pub planner_len: u64,
    /// Monotonic clock when planning began.
    pub begin_nanos: u64,
    /// Monotonic clock when planning ended.
    pub end_nanos: u64,
}

const _: () = assert!(size_of::<TrafficHeader>() == 64);

/// The phase of one traffic light from the next frame on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LightState {
    /// The traffic light.
    pub actor_id: ActorId,
    /// One of [`crate::light`].
    pub phase: u32,
}

/// How a walker walks from the next frame on; the latest control holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WalkerControl {
    /// The walker.
    pub actor_id: ActorId,
    /// Speed over ground, metres per second.
    pub speed_mps: f32,
    /// Direction in the ground plane of world space, a unit vector.
    pub direction: [f32; 2],
}

const _: () = assert!(size_of::<WalkerControl>() == 16);

/// The parts of a traffic message.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrafficParts<'a> {
    /// Controls of the vehicles that traffic drives.
    pub controls: &'a [VehicleControl],
    /// Controls of the walkers that traffic leads.
    pub walkers: &'a [WalkerControl],
    /// Phases of traffic lights.
    pub lights: &'a [LightState],
    /// The planner's state.
    pub planner: &'a [u8],
}

/// Offsets of the parts of a traffic message, in bytes from the start of its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrafficLayout {
    walkers_at: usize,
    lights_at: usize,
    planner_at: usize,
    /// Length of the payload in blocks.
    pub blocks: usize,
}

impl TrafficHeader {
    /// The offsets of the parts.
    pub fn layout(&self) -> TrafficLayout {
        let controls = self.control_count as usize * size_of::<VehicleControl>();
        let walkers = self.walker_count as usize * size_of::<WalkerControl>();
        let lights = self.light_count as usize * size_of::<LightState>();
        let walkers_at = controls.next_multiple_of(64);
        let lights_at = walkers_at + walkers.next_multiple_of(64);
        let planner_at = lights_at + lights.next_multiple_of(64);
        TrafficLayout {
            walkers_at,
            lights_at,
            planner_at,
            blocks: (planner_at + self.planner_len as usize).div_ceil(64),
        }
    }

    /// Sets the numbers of the parts.
    pub fn counting(self, parts: &TrafficParts<'_>) -> TrafficHeader {
        TrafficHeader {
            control_count: parts.controls.len() as u32,
            walker_count: parts.walkers.len() as u32,
            light_count: parts.lights.len() as u32,
            planner_len: parts.planner.len() as u64,
            ..self
        }
    }

    /// Writes the parts, whose numbers the header has, into a payload of `layout().blocks`.
    pub fn fill(&self, payload: &mut [Block], parts: &TrafficParts<'_>) {
        let layout = self.layout();
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(payload);
        bytes.fill(0);
        let mut put = |at: usize, part: &[u8]| bytes[at..][..part.len()].copy_from_slice(part);
        put(0, bytemuck::cast_slice(parts.controls));
        put(layout.walkers_at, bytemuck::cast_slice(parts.walkers));
        put(layout.lights_at, bytemuck::cast_slice(parts.lights));
        put(layout.planner_at, parts.planner);
    }

    /// The parts of a payload. `None` if the payload is shorter than the header states.
    pub fn parts<'a>(&self, payload: &'a [Block]) -> Option<TrafficParts<'a>> {
        let layout = self.layout();
        if payload.len() < layout.blocks {
            return None;
        }
        let bytes: &[u8] = bytemuck::cast_slice(payload);
        let part = |at: usize, count: u32, size: usize| &bytes[at..][..count as usize * size];
        Some(TrafficParts {
            controls: bytemuck::cast_slice(part(
                0,
                self.control_count,
                size_of::<VehicleControl>(),
            )),
            walkers: bytemuck::cast_slice(part(
                layout.walkers_at,
                self.walker_count,
                size_of::<WalkerControl>(),
            )),
            lights: bytemuck::cast_slice(part(
                layout.lights_at,
                self.light_count,
                size_of::<LightState>(),
            )),
            planner: &bytes[layout.planner_at..][..self.planner_len as usize],
        })
    }
}
