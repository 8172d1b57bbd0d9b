use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Block, Stamp, VehicleControl};

/// Header of the one message that traffic sends per frame: its decisions on `stamp.frame`, which act
/// in the next frame. The payload holds controls, traffic lights and the planner's state, each
/// aligned to 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TrafficHeader {
    /// The frame that the plan is based on.
    pub stamp: Stamp,
    /// Number of [`crate::VehicleControl`]s.
    pub control_count: u32,
    /// Number of [`LightState`]s.
    pub light_count: u32,
    /// Bytes of the planner's state: what a restarted planner needs beside the snapshot to continue
    /// identically. Opaque to other crates.
    pub planner_len: u64,
    /// Monotonic clock when planning began.
    pub begin_nanos: u64,
    /// Monotonic clock when planning ended.
    pub end_nanos: u64,
}

const _: () = assert!(size_of::<TrafficHeader>() == 56);

/// The phase of one traffic light from the next frame on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LightState {
    /// The traffic light.
    pub actor_id: ActorId,
    /// One of [`crate::light`].
    pub phase: u32,
}

/// Offsets of the three parts of a traffic message, in bytes from the start of its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrafficLayout {
    lights_at: usize,
    planner_at: usize,
    /// Length of the payload in blocks.
    pub blocks: usize,
}

impl TrafficHeader {
    /// The offsets of the parts.
    pub fn layout(&self) -> TrafficLayout {
        let controls = self.control_count as usize * size_of::<VehicleControl>();
        let lights = self.light_count as usize * size_of::<LightState>();
        let lights_at = controls.next_multiple_of(64);
        let planner_at = lights_at + lights.next_multiple_of(64);
        TrafficLayout {
            lights_at,
            planner_at,
            blocks: (planner_at + self.planner_len as usize).div_ceil(64),
        }
    }

    /// Writes the three parts into a payload of `layout().blocks`.
    pub fn fill(
        &self,
        payload: &mut [Block],
        controls: &[VehicleControl],
        lights: &[LightState],
        planner: &[u8],
    ) {
        let layout = self.layout();
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(payload);
        bytes.fill(0);
        let controls: &[u8] = bytemuck::cast_slice(controls);
        let lights: &[u8] = bytemuck::cast_slice(lights);
        bytes[..controls.len()].copy_from_slice(controls);
        bytes[layout.lights_at..][..lights.len()].copy_from_slice(lights);
        bytes[layout.planner_at..][..planner.len()].copy_from_slice(planner);
    }

    /// The parts of a payload: controls, traffic lights, planner state. `None` if the payload is shorter
    /// than the header states.
    pub fn parts<'a>(
        &self,
        payload: &'a [Block],
    ) -> Option<(&'a [VehicleControl], &'a [LightState], &'a [u8])> {
        let layout = self.layout();
        if payload.len() < layout.blocks {
            return None;
        }
        let bytes: &[u8] = bytemuck::cast_slice(payload);
        let controls = self.control_count as usize * size_of::<VehicleControl>();
        let lights = self.light_count as usize * size_of::<LightState>();
        Some((
            bytemuck::cast_slice(&bytes[..controls]),
            bytemuck::cast_slice(&bytes[layout.lights_at..][..lights]),
            &bytes[layout.planner_at..][..self.planner_len as usize],
        ))
    }
}
