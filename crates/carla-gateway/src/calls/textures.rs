//! The streams of a camera's textures.

use crate::{
    args::RpcError,
    calls::{actors::unknown, call::Call},
    sensor::Sensor,
    sensor_kind::Kind,
    stream,
    textures::COUNT,
};

/// Returns a camera of color images: no other sensor has textures.
fn camera(call: &mut Call, function: &str) -> Result<u32, RpcError> {
    let id = call.args.u32()?;
    let proxy = call.bridge.episode.actors.proxies.get(&id).ok_or_else(|| unknown(function, id))?;
    if proxy.sensor.as_ref().is_some_and(|sensor| sensor.kind == Kind::Rgb) {
        return Ok(id);
    }
    let why = "Actor is not a sensor.camera.rgb, no other has textures. ";
    Err(format!("Responding error from function {function}: {why} Actor Id: {id}").into())
}

/// Returns the token of a texture's stream, which does not change. The client either connects to it
/// or not.
pub(super) fn token(call: &mut Call) -> Result<(), RpcError> {
    let id = camera(call, "get_gbuffer_token")?;
    let texture = call.args.u32()?;
    if texture >= COUNT {
        return Err(format!("unknown GBuffer texture {texture}, must be 0 to 12").into());
    }
    let existing = |sensor: &Sensor| sensor.textures.get(&texture).copied();
    let actors = &mut call.bridge.episode.actors;
    let stream = match actors.proxy_mut(id)?.sensor.as_deref().and_then(existing) {
        Some(stream) => stream,
        None => call.bridge.streams.next_number(),
    };
    let actors = &mut call.bridge.episode.actors;
    if let Some(sensor) = &mut actors.proxy_mut(id)?.sensor {
        sensor.textures.insert(texture, stream);
    }
    if !call.bridge.streams.is_wanted(stream) {
        call.bridge.streams.expect(stream);
    }
    call.out.bin(&stream::token(stream, call.ports.streams));
    Ok(())
}

/// Textures are measured whenever a client listens.
pub(super) fn enable(call: &mut Call) -> Result<(), RpcError> {
    camera(call, "enable_gbuffers").map(drop)
}

pub(super) fn are_enabled(call: &mut Call) -> Result<(), RpcError> {
    camera(call, "are_gbuffers_enabled")?;
    call.out.bool(true);
    Ok(())
}
