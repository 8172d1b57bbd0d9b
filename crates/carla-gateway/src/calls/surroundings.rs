//! The surroundings of the roads: objects, layers, street lights, ray casts.

use client_lib::{
    RayHit, hide_objects,
    wire::{Command, HideLayers, layer},
};
use glam::Vec3;

use crate::{
    args::RpcError,
    calls::call::Call,
    wire::{flip, location},
};

/// Shows or hides objects. Unknown ids are ignored, as in CARLA.
pub(super) fn enable(call: &mut Call) -> Result<(), RpcError> {
    let mut ids = call.args.list()?;
    let mut numbers = Vec::with_capacity(ids.len());
    while ids.len() > 0 {
        numbers.push(ids.int()?);
    }
    let exists = call.args.bool()?;
    let count = call.bridge.statics_with_town().town().objects.len() as i64;
    let known = numbers.into_iter().filter(|number| (1..=count).contains(number));
    let known: Vec<u32> = known.map(|number| number as u32).collect();
    for command in hide_objects(&known, !exists) {
        call.bridge.command(command);
    }
    Ok(())
}

pub(super) fn load_layer(call: &mut Call) -> Result<(), RpcError> {
    switch_layers(call, false)
}

pub(super) fn unload_layer(call: &mut Call) -> Result<(), RpcError> {
    switch_layers(call, true)
}

/// Returns the layers of this simulator that CARLA's layers select. Decals, ground and particles
/// have no counterpart.
pub(super) fn layers_from_carla(requested: u32) -> u32 {
    const LAYERS: [(u32, u32); 6] = [
        (0x1, layer::BUILDINGS),
        (0x4, layer::FOLIAGE),
        (0x10, layer::PARKED_VEHICLES),
        (0x40, layer::PROPS),
        (0x80, layer::STREET_LIGHTS),
        (0x100, layer::WALLS),
    ];
    let ours = LAYERS.iter().filter(|(theirs, _)| requested & theirs != 0);
    ours.fold(0, |sum, (_, ours)| sum | ours)
}

fn switch_layers(call: &mut Call, hidden: bool) -> Result<(), RpcError> {
    let layers = layers_from_carla(call.args.u32()?);
    call.bridge.command(Command::HideLayers(HideLayers { layers, hidden: hidden.into() }));
    Ok(())
}

/// Returns the states of all street lights.
pub(super) fn street_lights(call: &mut Call) -> Result<(), RpcError> {
    let statics = call.bridge.statics_with_town();
    let lamps = &statics.town().lamps;
    let episode = &call.bridge.episode;
    episode.street_lights.write(lamps, &episode.standing, call.out);
    Ok(())
}

/// Sets the states of street lights: the client, the states, and whether to discard the client's
/// own.
pub(super) fn set_street_lights(call: &mut Call) -> Result<(), RpcError> {
    call.args.text()?;
    let mut states = call.args.list()?;
    let statics = call.bridge.statics_with_town();
    let commands = call.bridge.episode.street_lights.update(&statics.town().lamps, &mut states)?;
    queue_light_commands(call, commands);
    Ok(())
}

pub(super) fn follow_sun(call: &mut Call) -> Result<(), RpcError> {
    call.args.text()?;
    let on = call.args.bool()?;
    let statics = call.bridge.statics_with_town();
    let episode = &mut call.bridge.episode;
    let lamps = &statics.town().lamps;
    let commands = episode.street_lights.follow_sun(on, lamps, &episode.standing);
    queue_light_commands(call, commands);
    Ok(())
}

/// Queues commands, and lets all clients read the states again.
pub(super) fn queue_light_commands(call: &mut Call, commands: Vec<Command>) {
    commands.into_iter().for_each(|command| call.bridge.command(command));
    call.bridge.episode.has_new_lights = true;
}

/// Returns everything that a segment hits.
pub(super) fn cast_ray(call: &mut Call) -> Result<(), RpcError> {
    let (from, to) = (location(&mut call.args)?, location(&mut call.args)?);
    let hits = hits(call, [from, to]);
    call.out.list(hits.len());
    for hit in hits {
        write_point(call, hit.position, hit.tag);
    }
    Ok(())
}

/// Returns the first hit in a direction.
pub(super) fn project_point(call: &mut Call) -> Result<(), RpcError> {
    let (from, direction) = (location(&mut call.args)?, location(&mut call.args)?);
    let reach = call.args.f32()?;
    let hits = hits(call, [from, from + direction.normalize_or_zero() * reach]);
    call.out.list(2).bool(!hits.is_empty());
    let (position, tag) = hits.first().map_or((from, 0), |hit| (hit.position, hit.tag));
    write_point(call, position, tag);
    Ok(())
}

fn hits(call: &mut Call, segment: [Vec3; 2]) -> Vec<RayHit> {
    let statics = call.bridge.statics_with_town();
    call.bridge.unlocked(|| {
        statics.grid();
    });
    let client = &call.bridge.client;
    statics.cast_ray(segment, client.world(), client.blueprints())
}

fn write_point(call: &mut Call, position: Vec3, tag: u8) {
    call.out.list(2).vector(flip(position.to_array())).uint(tag.into());
}
