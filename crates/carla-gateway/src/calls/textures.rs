//! The way to a camera's textures.

use super::{Call, actors::unknown};
use crate::{
    args::Refusal,
    sensor::{Kind, Sensor},
    stream,
    textures::COUNT,
};

/// The id of a camera of images: no other sensor has textures.
fn camera(call: &mut Call, function: &str) -> Result<u32, Refusal> {
    let id = call.args.u32()?;
    let own = call.bridge.cast.own.get(&id).ok_or_else(|| unknown(function, id))?;
    if own.sensor.as_ref().is_some_and(|sensor| sensor.kind == Kind::Rgb) {
        return Ok(id);
    }
    let why = "Actor is not a sensor.camera.rgb, no other has textures. ";
    Err(format!("Responding error from function {function}: {why} Actor Id: {id}").into())
}

/// The way to a texture's stream, always the same. Who asks will come to it, or leaves it.
pub(super) fn token(call: &mut Call) -> Result<(), Refusal> {
    let id = camera(call, "get_gbuffer_token")?;
    let texture = call.args.u32()?;
    if texture >= COUNT {
        return Err(format!("there is no GBuffer texture {texture}; they are 0 to 12").into());
    }
    let known = |sensor: &Sensor| sensor.textures.get(&texture).copied();
    let cast = &mut call.bridge.cast;
    let stream = match cast.own_mut(id)?.sensor.as_deref().and_then(known) {
        Some(stream) => stream,
        None => cast.next_stream(),
    };
    if let Some(sensor) = &mut cast.own_mut(id)?.sensor {
        sensor.textures.insert(texture, stream);
    }
    if !call.bridge.streams.is_wanted(stream) {
        call.bridge.streams.expect(stream);
    }
    call.out.bin(&stream::token(stream, call.ports.streams));
    Ok(())
}

/// Textures are measured whenever somebody listens.
pub(super) fn enable(call: &mut Call) -> Result<(), Refusal> {
    camera(call, "enable_gbuffers").map(drop)
}

pub(super) fn are_enabled(call: &mut Call) -> Result<(), Refusal> {
    camera(call, "are_gbuffers_enabled")?;
    call.out.bool(true);
    Ok(())
}
