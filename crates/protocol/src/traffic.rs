use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Block, Stamp, VehicleControl};

/// Header of traffic's one sample per frame: what it decided on `stamp.frame`, which acts in the
/// next one. The payload holds controls, then lights, then the planner, each at a 64-byte edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TrafficHeader {
    /// The frame that was planned on.
    pub stamp: Stamp,
    /// How many [`crate::VehicleControl`]s.
    pub control_count: u32,
    /// How many [`LightState`]s.
    pub light_count: u32,
    /// Bytes of the planner: all that traffic must know beyond the snapshot to go on as if nothing
    /// had happened. Opaque to everybody else.
    pub mind_len: u64,
    /// Monotonic clock when planning began.
    pub begin_nanos: u64,
    /// Monotonic clock when planning ended.
    pub end_nanos: u64,
}

const _: () = assert!(size_of::<TrafficHeader>() == 56);

/// The colour that one traffic light shows from the next frame on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LightState {
    /// The light, an actor of the world.
    pub actor_id: ActorId,
    /// One of [`crate::light`].
    pub phase: u32,
}

/// Where the three parts of a traffic sample lie, in bytes from the start of its payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrafficLayout {
    lights_at: usize,
    mind_at: usize,
    /// Blocks in all.
    pub blocks: usize,
}

impl TrafficHeader {
    /// Where the parts lie.
    pub fn layout(&self) -> TrafficLayout {
        let controls = self.control_count as usize * size_of::<VehicleControl>();
        let lights = self.light_count as usize * size_of::<LightState>();
        let lights_at = controls.next_multiple_of(64);
        let mind_at = lights_at + lights.next_multiple_of(64);
        TrafficLayout {
            lights_at,
            mind_at,
            blocks: (mind_at + self.mind_len as usize).div_ceil(64),
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
        bytes[layout.mind_at..][..planner.len()].copy_from_slice(planner);
    }

    /// What a payload holds: controls, lights, planner. `None` if it is shorter than the header says.
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
            &bytes[layout.mind_at..][..self.mind_len as usize],
        ))
    }
}
