//! What stands round the roads, and what rays meet.

use std::sync::Arc;

use client_lib::{Command, HideLayers, hide_objects, layer};
use glam::Vec3;

use super::Call;
use crate::{
    args::Refusal,
    rays::Rays,
    wire::{Bounds, flip, location, write_transform},
};

/// CARLA's tag for everything.
const ANY: u32 = 255;

fn bounds(object: &town::Object) -> Bounds {
    Bounds {
        center_m: object.center.to_array(),
        half_extents_m: object.half_extents_m.to_array(),
        yaw_rad: object.yaw_rad,
        actor: 0,
    }
}

/// Boxes in world space of all that bears a tag.
pub(super) fn level_boxes(call: &mut Call) -> Result<(), Refusal> {
    let tag = call.args.u32()?;
    let objects = &call.bridge.statics.town().objects;
    let those: Vec<_> =
        objects.iter().filter(|o| tag == ANY || o.tag as u32 == tag).map(bounds).collect();
    call.out.list(those.len());
    those.iter().for_each(|b| b.write(call.out));
    Ok(())
}

pub(super) fn environment_objects(call: &mut Call) -> Result<(), Refusal> {
    let tag = call.args.u32()?;
    let objects = &call.bridge.statics.town().objects;
    let those = objects.iter().enumerate().filter(|(_, o)| tag == ANY || o.tag as u32 == tag);
    let those: Vec<_> = those.collect();
    call.out.list(those.len());
    for (index, object) in those {
        let pose = client_lib::Pose::level(object.center, object.yaw_rad);
        call.out.list(5);
        write_transform(&pose, call.out);
        bounds(object).write(call.out);
        call.out.uint(index as u64 + 1).text(&name(index, object)).uint(object.tag as u64);
    }
    Ok(())
}

/// Switches things off or on; unknown numbers are passed over, as CARLA does.
pub(super) fn enable(call: &mut Call) -> Result<(), Refusal> {
    let mut ids = call.args.list()?;
    let mut numbers = Vec::with_capacity(ids.len());
    while ids.len() > 0 {
        numbers.push(ids.int()?);
    }
    let is_there = call.args.bool()?;
    let count = call.bridge.statics.town().objects.len() as i64;
    let known = numbers.into_iter().filter(|number| (1..=count).contains(number));
    let known: Vec<u32> = known.map(|number| number as u32).collect();
    for command in hide_objects(&known, !is_there) {
        call.bridge.command(command);
    }
    Ok(())
}

pub(super) fn load_layer(call: &mut Call) -> Result<(), Refusal> {
    switch_layers(call, false)
}

pub(super) fn unload_layer(call: &mut Call) -> Result<(), Refusal> {
    switch_layers(call, true)
}

/// CARLA's layers that ours have; decals, ground and particles are none of ours.
pub(super) fn our_layers(asked: u32) -> u32 {
    const LAYERS: [(u32, u32); 6] = [
        (0x1, layer::BUILDINGS),
        (0x4, layer::FOLIAGE),
        (0x10, layer::PARKED_VEHICLES),
        (0x40, layer::PROPS),
        (0x80, layer::STREET_LIGHTS),
        (0x100, layer::WALLS),
    ];
    let ours = LAYERS.iter().filter(|(theirs, _)| asked & theirs != 0);
    ours.fold(0, |sum, (_, ours)| sum | ours)
}

fn switch_layers(call: &mut Call, hidden: bool) -> Result<(), Refusal> {
    let layers = our_layers(call.args.u32()?);
    call.bridge.command(Command::HideLayers(HideLayers { layers, hidden: hidden.into() }));
    Ok(())
}

pub(super) fn names(call: &mut Call) -> Result<(), Refusal> {
    let objects = &call.bridge.statics.town().objects;
    call.out.list(objects.len());
    for (index, object) in objects.iter().enumerate() {
        call.out.text(&name(index, object));
    }
    Ok(())
}

fn name(index: usize, object: &town::Object) -> String {
    format!("{:?}_{:?}_{index}", object.layer, object.tag)
}

/// Street lamps.
pub(super) fn lamps(call: &mut Call) -> Result<(), Refusal> {
    let lamps = &call.bridge.statics.town().lamps;
    call.bridge.street.write(lamps, call.out);
    Ok(())
}

/// Who calls, what lamps are to be like, and whether the caller wants to be told of it.
pub(super) fn switch_lamps(call: &mut Call) -> Result<(), Refusal> {
    call.args.text()?;
    let mut states = call.args.list()?;
    let statics = Arc::clone(&call.bridge.statics);
    let commands = call.bridge.street.take(&statics.town().lamps, &mut states)?;
    light_up(call, commands);
    Ok(())
}

pub(super) fn follow_day(call: &mut Call) -> Result<(), Refusal> {
    call.args.text()?;
    let on = call.args.bool()?;
    let statics = Arc::clone(&call.bridge.statics);
    let commands = call.bridge.street.follow_day(on, &statics.town().lamps);
    light_up(call, commands);
    Ok(())
}

/// Everybody asks again what lamps are like.
pub(super) fn light_up(call: &mut Call, commands: Vec<Command>) {
    commands.into_iter().for_each(|command| call.bridge.command(command));
    call.bridge.has_new_lights = true;
}

/// Everything between two places.
pub(super) fn cast_ray(call: &mut Call) -> Result<(), Refusal> {
    let (from, to) = (location(&mut call.args)?, location(&mut call.args)?);
    let rays = Rays::of(&call.bridge.statics);
    let hits = rays.all(from, to, call.bridge.client.world(), call.bridge.client.blueprints());
    call.out.list(hits.len());
    for (share, tag) in hits {
        point(call, from.lerp(to, share), tag);
    }
    Ok(())
}

/// The first thing on the way.
pub(super) fn project_point(call: &mut Call) -> Result<(), Refusal> {
    let (from, direction) = (location(&mut call.args)?, location(&mut call.args)?);
    let reach = call.args.f32()?;
    if !reach.is_finite() {
        return Err("the search distance is not finite".into());
    }
    let to = from + direction.normalize_or_zero() * reach;
    let rays = Rays::of(&call.bridge.statics);
    let hits = rays.all(from, to, call.bridge.client.world(), call.bridge.client.blueprints());
    call.out.list(2).bool(!hits.is_empty());
    let (share, tag) = hits.first().copied().unwrap_or((0.0, 0));
    point(call, from.lerp(to, share), tag);
    Ok(())
}

fn point(call: &mut Call, at: Vec3, tag: u8) {
    call.out.list(2).vector(flip(at.to_array())).uint(tag.into());
}
