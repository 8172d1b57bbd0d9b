//! The bones of walkers and the moving parts of vehicles, as clients see them.

use client_lib::{
    ActorId, BoneTransform, animation_pose, bone, bone_commands, bone_transforms,
    wire::{ActorState, BlendPose, Command, flag, kind},
};
use town::{Blueprint, Kind};

use crate::{
    args::RpcError,
    calls::{actors::unknown, call::Call},
    wire::{transform, write_transform},
};

pub(super) fn names(call: &mut Call) -> Result<(), RpcError> {
    let bones = bones(call, "get_actor_bone_names")?;
    call.out.list(bones.len());
    for bone in &bones {
        call.out.text(&bone.name);
    }
    Ok(())
}

pub(super) fn in_world(call: &mut Call) -> Result<(), RpcError> {
    let bones = bones(call, "get_actor_bone_world_transforms")?;
    call.out.list(bones.len());
    for bone in &bones {
        write_transform(&bone.world_from_bone, call.out);
    }
    Ok(())
}

pub(super) fn relative(call: &mut Call) -> Result<(), RpcError> {
    let bones = bones(call, "get_actor_bone_relative_transforms")?;
    call.out.list(bones.len());
    for bone in &bones {
        write_transform(&bone.parent_from_bone, call.out);
    }
    Ok(())
}

/// Writes `WalkerBoneControlOut`: name, and transforms in the world, in the actor and in the
/// parent.
pub(super) fn all(call: &mut Call) -> Result<(), RpcError> {
    let bones = bones(call, "get_bones_transform")?;
    call.out.list(1).list(bones.len());
    for bone in &bones {
        call.out.list(4).text(&bone.name);
        write_transform(&bone.world_from_bone, call.out);
        write_transform(&bone.actor_from_bone, call.out);
        write_transform(&bone.parent_from_bone, call.out);
    }
    Ok(())
}

/// Reads `WalkerBoneControlIn`: names and transforms in the parent.
pub(super) fn set(call: &mut Call) -> Result<(), RpcError> {
    let id = walker(call, "set_bones_transform")?;
    let mut list = call.args.list()?.list()?;
    let mut bones = Vec::with_capacity(list.len());
    while list.len() > 0 {
        let mut one = list.list()?;
        let name = one.text()?;
        let number = bone(name).ok_or_else(|| format!("unknown bone {name:?} of a walker"))?;
        bones.push((number, transform(&mut one)?));
    }
    bone_commands(ActorId(id), &bones).into_iter().for_each(|command| call.bridge.command(command));
    Ok(())
}

/// Sets the weight of the pose that clients have set.
pub(super) fn blend(call: &mut Call) -> Result<(), RpcError> {
    let id = walker(call, "blend_pose")?;
    let weight = call.args.f32()?;
    if !(0.0..=1.0).contains(&weight) {
        return Err(format!("blend is {weight}, must be 0 to 1").into());
    }
    call.bridge.command(Command::BlendPose(BlendPose { actor_id: ActorId(id), weight }));
    Ok(())
}

/// Sets the present pose of the walking animation as the pose of the walker.
pub(super) fn set_from_animation(call: &mut Call) -> Result<(), RpcError> {
    let id = walker(call, "get_pose_from_animation")?;
    let (state, blueprint) = state_and_blueprint(call, "get_pose_from_animation", id)?;
    let bones = animation_pose(blueprint, &state, call.bridge.limbs(id).as_ref())
        .ok_or("the actor has no skeleton")?;
    bone_commands(ActorId(id), &bones).into_iter().for_each(|command| call.bridge.command(command));
    Ok(())
}

/// Returns the walker that a call concerns; before a snapshot shows it, its blueprint is known.
fn walker(call: &mut Call, function: &str) -> Result<u32, RpcError> {
    let id = call.args.u32()?;
    let (_, blueprint) = state_and_blueprint(call, function, id)?;
    if blueprint.kind != Kind::Walker {
        return Err(format!("{function}: actor {id} is not a walker").into());
    }
    Ok(id)
}

fn bones(call: &mut Call, function: &str) -> Result<Vec<BoneTransform>, RpcError> {
    let id = call.args.u32()?;
    let (state, blueprint) = state_and_blueprint(call, function, id)?;
    // The host stores the pose that clients have set.
    let is_posed = state.kind == kind::WALKER && state.has(flag::POSED);
    let given = if is_posed {
        Some(call.bridge.query(|queries| queries.given_pose(state.actor_id))?)
    } else {
        None
    };
    Ok(bone_transforms(blueprint, &state, call.bridge.limbs(id).as_ref(), given))
}

fn state_and_blueprint(
    call: &mut Call,
    function: &str,
    id: u32,
) -> Result<(ActorState, &'static Blueprint), RpcError> {
    let state = call.bridge.actor_state(id).ok_or_else(|| unknown(function, id))?;
    let blueprint = call
        .bridge
        .blueprint_id(id)
        .and_then(|name| town::blueprint(&name))
        .ok_or("the actor has no body and therefore no bones")?
        .1;
    Ok((state, blueprint))
}
