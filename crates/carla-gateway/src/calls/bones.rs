//! Bones of walkers, and the parts of vehicles that move, as clients see them.

use client_lib::{
    ActorId, ActorState, BlendPose, Command, Pose, WalkerLimbs, bone, bone_commands, flag, kind,
};
use glam::{Affine3A, Quat, Vec3};
use town::{Blueprint, GivenPose, Kind, Posture};

use super::{Call, actors::unknown};
use crate::{
    args::Refusal,
    wire::{transform, write_transform},
};

/// A given pose: how much of it shows, and `parent_from_bone` of each bone.
type Held = (f32, Vec<Option<(Vec3, Quat)>>);

/// A bone: its name, and its pose in the actor and against its parent.
struct Bone {
    name: String,
    actor_from_bone: Affine3A,
    parent_from_bone: Affine3A,
}

pub(super) fn names(call: &mut Call) -> Result<(), Refusal> {
    let (_, bones) = bones(call, "get_actor_bone_names")?;
    call.out.list(bones.len());
    for bone in &bones {
        call.out.text(&bone.name);
    }
    Ok(())
}

pub(super) fn in_world(call: &mut Call) -> Result<(), Refusal> {
    let (pose, bones) = bones(call, "get_actor_bone_world_transforms")?;
    call.out.list(bones.len());
    for bone in &bones {
        write_transform(&pose_of(&(pose.affine() * bone.actor_from_bone)), call.out);
    }
    Ok(())
}

pub(super) fn relative(call: &mut Call) -> Result<(), Refusal> {
    let (_, bones) = bones(call, "get_actor_bone_relative_transforms")?;
    call.out.list(bones.len());
    for bone in &bones {
        write_transform(&pose_of(&bone.parent_from_bone), call.out);
    }
    Ok(())
}

/// `WalkerBoneControlOut`: name, in the world, in the actor, against the parent.
pub(super) fn all(call: &mut Call) -> Result<(), Refusal> {
    let (pose, bones) = bones(call, "get_bones_transform")?;
    call.out.list(1).list(bones.len());
    for bone in &bones {
        call.out.list(4).text(&bone.name);
        write_transform(&pose_of(&(pose.affine() * bone.actor_from_bone)), call.out);
        write_transform(&pose_of(&bone.actor_from_bone), call.out);
        write_transform(&pose_of(&bone.parent_from_bone), call.out);
    }
    Ok(())
}

/// `WalkerBoneControlIn`: names, each with its transform against the parent.
pub(super) fn set(call: &mut Call) -> Result<(), Refusal> {
    let id = walker(call, "set_bones_transform")?;
    let mut list = call.args.list()?.list()?;
    let mut bones = Vec::with_capacity(list.len());
    while list.len() > 0 {
        let mut one = list.list()?;
        let name = one.text()?;
        let number = bone(name).ok_or_else(|| format!("walkers have no bone {name:?}"))?;
        bones.push((number, transform(&mut one)?));
    }
    bone_commands(ActorId(id), &bones).into_iter().for_each(|command| call.bridge.command(command));
    Ok(())
}

/// How much of the given pose shows.
pub(super) fn blend(call: &mut Call) -> Result<(), Refusal> {
    let id = walker(call, "blend_pose")?;
    let share = call.args.f32()?;
    if !(0.0..=1.0).contains(&share) {
        return Err(format!("blend is {share}, not 0 to 1").into());
    }
    call.bridge.command(Command::BlendPose(BlendPose { actor_id: ActorId(id), weight: share }));
    Ok(())
}

/// The pose that the walk has just now is the given one.
pub(super) fn keep(call: &mut Call) -> Result<(), Refusal> {
    let id = walker(call, "get_pose_from_animation")?;
    let (state, blueprint) = who(call, "get_pose_from_animation", id)?;
    let skeleton = blueprint.skeleton().ok_or("it has no bones")?;
    let held =
        skeleton.parent_from_bones(&posture_of(blueprint, &state, call.bridge.limbs(id), None));
    let bones: Vec<_> =
        held.iter().zip(0..).map(|((at, turn), bone)| (bone, Pose::new(*at, *turn))).collect();
    bone_commands(ActorId(id), &bones).into_iter().for_each(|command| call.bridge.command(command));
    Ok(())
}

/// The walker that a call is about; one that no snapshot shows yet is known by its blueprint.
fn walker(call: &mut Call, function: &str) -> Result<u32, Refusal> {
    let id = call.args.u32()?;
    let (_, blueprint) = who(call, function, id)?;
    if blueprint.kind != Kind::Walker {
        return Err(format!("{function}: {id} is no walker").into());
    }
    Ok(id)
}

fn bones(call: &mut Call, function: &str) -> Result<(Pose, Vec<Bone>), Refusal> {
    let id = call.args.u32()?;
    let (state, blueprint) = who(call, function, id)?;
    let given = given(call, &state)?;
    Ok((state.pose, bones_of(blueprint, &state, call.bridge.limbs(id), given.as_ref())))
}

/// The pose that clients gave a walker, if any of it shows: the host knows it.
fn given(call: &mut Call, state: &ActorState) -> Result<Option<Held>, Refusal> {
    if state.kind != kind::WALKER || !state.has(flag::POSED) {
        return Ok(None);
    }
    let (bones, share) = call.bridge.client.given_pose(state.actor_id)?;
    let bones = bones.iter().map(|pose| Some((pose.position(), pose.rotation()))).collect();
    Ok(Some((share, bones)))
}

fn who(
    call: &mut Call,
    function: &str,
    id: u32,
) -> Result<(ActorState, &'static Blueprint), Refusal> {
    let state = call.bridge.state(id).ok_or_else(|| unknown(function, id))?;
    let blueprint = call
        .bridge
        .known_id(id)
        .and_then(|name| town::blueprint(&name))
        .ok_or("it has no body, so it has no bones")?
        .1;
    Ok((state, blueprint))
}

fn bones_of(
    blueprint: &Blueprint,
    state: &ActorState,
    limbs: Option<WalkerLimbs>,
    given: Option<&Held>,
) -> Vec<Bone> {
    let posture = posture_of(blueprint, state, limbs, given);
    if let Some(skeleton) = blueprint.skeleton() {
        let placed = skeleton.actor_from_bones(&posture);
        let bone = |(index, bone): (usize, &town::Bone)| Bone {
            name: bone.name.clone(),
            actor_from_bone: placed[index],
            parent_from_bone: if index == bone.parent {
                placed[index]
            } else {
                placed[bone.parent].inverse() * placed[index]
            },
        };
        return skeleton.bones.iter().enumerate().map(bone).collect();
    }
    let mut all = Vec::new();
    let rig = blueprint.rig();
    rig.place(&posture, |piece, placed| {
        let joint = &rig.joints[piece];
        let actor_from_bone = placed * Affine3A::from_translation(joint.pivot_m());
        let name = joint.name.to_owned();
        all.push(Bone { name, actor_from_bone, parent_from_bone: actor_from_bone });
    });
    all
}

fn posture_of<'a>(
    blueprint: &Blueprint,
    state: &ActorState,
    limbs: Option<WalkerLimbs>,
    given: Option<&'a Held>,
) -> Posture<'a> {
    let is_walker = blueprint.kind == Kind::Walker;
    Posture {
        steer_rad: state.wheel_steer_rad,
        spin_rad: state.wheel_spin_rad,
        doors: state.doors,
        stride: if is_walker { state.phase as f32 / client_lib::STRIDE as f32 } else { 0.0 },
        speed_mps: state.velocity().truncate().length(),
        limbs: limbs.map(|limbs| limbs.rotations()),
        given: given.map(|(share, bones)| GivenPose { weight: *share, bones }),
    }
}

fn pose_of(affine: &Affine3A) -> Pose {
    let (_, rotation, position) = affine.to_scale_rotation_translation();
    Pose::new(position, rotation.normalize())
}
