//! Traffic lights of the map.

use client_lib::ActorId;

use super::Call;
use crate::{args::Refusal, wire::Bounds};

/// Half the size of one lamp box. Metres.
const BOX_M: [f32; 3] = [0.2, 0.2, 0.5];

fn light(call: &mut Call, function: &str) -> Result<u32, Refusal> {
    let id = call.args.u32()?;
    if call.bridge.lights.contains(id) {
        return Ok(id);
    }
    Err(format!(
        "Responding error from function {function}: Actor is not a traffic light.  Actor Id: {id}"
    )
    .into())
}

pub(super) fn group(call: &mut Call) -> Result<(), Refusal> {
    let id = light(call, "get_group_traffic_lights")?;
    let group = call.bridge.lights.group(id);
    call.out.list(group.len());
    for id in group {
        call.out.uint(id.into());
    }
    Ok(())
}

pub(super) fn boxes(call: &mut Call) -> Result<(), Refusal> {
    let id = light(call, "get_light_boxes")?;
    let actor = call.bridge.client.world().actor(ActorId(id)).ok_or("it is not there")?;
    let position = actor.pose.position() + glam::Vec3::Z * BOX_M[2];
    let ahead = actor.pose.rotation() * glam::Vec3::X;
    let yaw_rad = ahead.y.atan2(ahead.x);
    let lamps = Bounds { center_m: position.to_array(), half_extents_m: BOX_M, yaw_rad, actor: id };
    call.out.list(1);
    lamps.write(call.out);
    Ok(())
}

pub(super) fn set_secs(call: &mut Call, colour: usize) -> Result<(), Refusal> {
    let id = light(call, "set_traffic_light_time")?;
    let secs = call.args.f32()?;
    call.bridge.lights.set_secs(id, colour, secs);
    Err("the plan of the lights is traffic's own; the time is only told back".into())
}

pub(super) fn set_state(call: &mut Call) -> Result<(), Refusal> {
    let id = light(call, "set_traffic_light_state")?;
    let state = call.args.u32()?;
    call.bridge.set_light(id, state)
}

impl crate::bridge::Bridge {
    /// Switches a light.
    pub(crate) fn set_light(&mut self, _id: u32, _state: u32) -> Result<(), Refusal> {
        super::refuse("lights that clients switch")
    }
}

pub(super) fn freeze_all(_: &mut Call) -> Result<(), Refusal> {
    super::refuse("lights that clients switch")
}

pub(super) fn freeze(_: &mut Call) -> Result<(), Refusal> {
    super::refuse("lights that clients switch")
}

pub(super) fn reset_all(_: &mut Call) -> Result<(), Refusal> {
    super::refuse("lights that clients switch")
}

pub(super) fn reset_group(_: &mut Call) -> Result<(), Refusal> {
    super::refuse("lights that clients switch")
}
