//! The traffic lights of the map.

use client_lib::ActorId;

use crate::{
    args::RpcError, bridge::Bridge, calls::call::Call, shared_bridge::LockedBridge,
    traffic_lights::UNKNOWN, wire::Bounds,
};

/// Half the size of a light box. Metres.
const BOX_M: [f32; 3] = [0.2, 0.2, 0.5];

fn light(call: &mut Call, function: &str) -> Result<u32, RpcError> {
    let id = call.args.u32()?;
    if call.bridge.episode.traffic_lights.contains(id) {
        return Ok(id);
    }
    Err(format!(
        "Responding error from function {function}: Actor is not a traffic light.  Actor Id: {id}"
    )
    .into())
}

pub(super) fn group(call: &mut Call) -> Result<(), RpcError> {
    let id = light(call, "get_group_traffic_lights")?;
    let group = call.bridge.episode.traffic_lights.group(id);
    call.out.list(group.len());
    for id in group {
        call.out.uint(id.into());
    }
    Ok(())
}

pub(super) fn boxes(call: &mut Call) -> Result<(), RpcError> {
    let id = light(call, "get_light_boxes")?;
    let actor = call
        .bridge
        .client
        .world()
        .state(ActorId(id))
        .ok_or("the traffic light is not in the snapshot")?;
    let position = actor.pose.position() + glam::Vec3::Z * BOX_M[2];
    let ahead = actor.pose.rotation() * glam::Vec3::X;
    let yaw_rad = ahead.y.atan2(ahead.x);
    let lamps = Bounds { center_m: position.to_array(), half_extents_m: BOX_M, yaw_rad, actor: id };
    call.out.list(1);
    lamps.write(call.out);
    Ok(())
}

/// Sets how long a phase is shown after a client has switched to it.
pub(super) fn set_secs(call: &mut Call, colour: usize) -> Result<(), RpcError> {
    let id = light(call, "set_traffic_light_time")?;
    let secs = call.args.f32()?;
    call.bridge.episode.traffic_lights.set_secs(id, colour, secs);
    Ok(())
}

pub(super) fn set_state(call: &mut Call) -> Result<(), RpcError> {
    let id = light(call, "set_traffic_light_state")?;
    let state = call.args.u32()?;
    call.bridge.set_traffic_light(id, state)
}

pub(super) fn freeze_all(call: &mut Call) -> Result<(), RpcError> {
    let on = call.args.bool()?;
    let commands = call.bridge.episode.traffic_lights.freeze(on);
    commands.into_iter().for_each(|command| call.bridge.command(command));
    Ok(())
}

/// CARLA's client does not send this call: freezing one light freezes all.
pub(super) fn freeze(call: &mut Call) -> Result<(), RpcError> {
    light(call, "freeze_traffic_light")?;
    freeze_all(call)
}

pub(super) fn reset_all(call: &mut Call) -> Result<(), RpcError> {
    let ids = call.bridge.episode.traffic_lights.ids();
    reset(call, &ids);
    Ok(())
}

pub(super) fn reset_group(call: &mut Call) -> Result<(), RpcError> {
    let id = light(call, "reset_traffic_light_group")?;
    let ids = call.bridge.episode.traffic_lights.group(id);
    reset(call, &ids);
    Ok(())
}

fn reset(call: &mut Call, ids: &[u32]) {
    let commands = call.bridge.episode.traffic_lights.reset(ids);
    commands.into_iter().for_each(|command| call.bridge.command(command));
}

impl LockedBridge<'_> {
    /// Switches a light: 0 red, 1 yellow, 2 green, 3 off, 4 unknown.
    pub(crate) fn set_traffic_light(&mut self, id: u32, state: u32) -> Result<(), RpcError> {
        if state > UNKNOWN {
            return Err(format!("unknown traffic light state {state}").into());
        }
        let Bridge { episode, client, .. } = &mut **self;
        let commands = episode.traffic_lights.switch(id, state, client.world());
        if commands.is_empty() {
            return Err("Actor is not a traffic light".into());
        }
        commands.into_iter().for_each(|command| self.command(command));
        Ok(())
    }
}
