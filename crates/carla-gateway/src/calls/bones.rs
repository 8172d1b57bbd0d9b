//! The bones of walkers and the moving parts of vehicles, as clients see them.

use client_lib::{
    ActorId, Pose, bone, bone_commands,
    wire::{ActorState, BlendPose, Command, WalkerLimbs, flag, kind},
};
use glam::{Affine3A, Quat, Vec3};
use town::{Blueprint, GivenPose, Kind, Posture};

use crate::{
    args::RpcError,
    calls::{actors::unknown, call::Call},
    wire::{transform, write_transform},
};

/// A pose that clients have set: its weight, and `parent_from_bone` of each bone.
type SetPose = (f32, Vec<Option<(Vec3, Quat)>>);

/// A bone: its name, and its pose in the actor and in its parent.
struct Bone {
    name: String,
    actor_from_bone: Affine3A,
    parent_from_bone: Affine3A,
}

pub(super) fn names(call: &mut Call) -> Result<(), RpcError> {
    let (_, bones) = bones(call, "get_actor_bone_names")?;
    call.out.list(bones.len());
    for bone in &bones {
        call.out.text(&bone.name);
    }
    Ok(())
}

pub(super) fn in_world(call: &mut Call) -> Result<(), RpcError> {
    let (pose, bones) = bones(call, "get_actor_bone_world_transforms")?;
    call.out.list(bones.len());
    for bone in &bones {
        write_transform(&pose_of(&(pose.affine() * bone.actor_from_bone)), call.out);
    }
    Ok(())
}

pub(super) fn relative(call: &mut Call) -> Result<(), RpcError> {
    let (_, bones) = bones(call, "get_actor_bone_relative_transforms")?;
    call.out.list(bones.len());
    for bone in &bones {
        write_transform(&pose_of(&bone.parent_from_bone), call.out);
    }
    Ok(())
}

/// Writes `WalkerBoneControlOut`: name, and transforms in the world, in the actor and in the
/// parent.
pub(super) fn all(call: &mut Call) -> Result<(), RpcError> {
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
    let skeleton = blueprint.skeleton().ok_or("the actor has no skeleton")?;
    let bones =
        skeleton.parent_from_bones(&posture_of(blueprint, &state, call.bridge.limbs(id), None));
    let bones: Vec<_> =
        bones.iter().zip(0..).map(|((at, turn), bone)| (bone, Pose::new(*at, *turn))).collect();
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

fn bones(call: &mut Call, function: &str) -> Result<(Pose, Vec<Bone>), RpcError> {
    let id = call.args.u32()?;
    let (state, blueprint) = state_and_blueprint(call, function, id)?;
    let given = set_pose(call, &state)?;
    Ok((state.pose, bones_of(blueprint, &state, call.bridge.limbs(id), given.as_ref())))
}

/// Returns the pose that clients have set, which the host stores, if its weight is not 0.
fn set_pose(call: &mut Call, state: &ActorState) -> Result<Option<SetPose>, RpcError> {
    if state.kind != kind::WALKER || !state.has(flag::POSED) {
        return Ok(None);
    }
    let (bones, share) = call.bridge.client.given_pose(state.actor_id)?;
    let bones = bones.iter().map(|pose| Some((pose.position(), pose.rotation()))).collect();
    Ok(Some((share, bones)))
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

fn bones_of(
    blueprint: &Blueprint,
    state: &ActorState,
    limbs: Option<WalkerLimbs>,
    given: Option<&SetPose>,
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
    given: Option<&'a SetPose>,
) -> Posture<'a> {
    let is_walker = blueprint.kind == Kind::Walker;
    Posture {
        steer_rad: state.wheel_steer_rad,
        spin_rad: state.wheel_spin_rad,
        doors: state.doors,
        stride: if is_walker { state.phase as f32 / client_lib::wire::STRIDE as f32 } else { 0.0 },
        speed_mps: state.velocity().truncate().length(),
        limbs: limbs.map(|limbs| limbs.rotations()),
        given: given.map(|(share, bones)| GivenPose { weight: *share, bones }),
    }
}

fn pose_of(affine: &Affine3A) -> Pose {
    let (_, rotation, position) = affine.to_scale_rotation_translation();
    Pose::new(position, rotation.normalize())
}
