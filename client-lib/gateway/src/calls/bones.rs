//! Bones of walkers, and the parts of vehicles that move, as clients see them.

use client_lib::{ActorState, Pose};
use glam::Affine3A;
use town::{Blueprint, Kind, Posture};

use super::{Call, actors::unknown};
use crate::{args::Refusal, wire::write_transform};

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

fn bones(call: &mut Call, function: &str) -> Result<(Pose, Vec<Bone>), Refusal> {
    let id = call.args.u32()?;
    let state = call.bridge.state(id).ok_or_else(|| unknown(function, id))?;
    let blueprint = call
        .bridge
        .known_id(id)
        .and_then(|name| town::blueprint(&name))
        .ok_or("it has no body, so it has no bones")?
        .1;
    Ok((state.pose, bones_of(blueprint, &state)))
}

fn bones_of(blueprint: &Blueprint, state: &ActorState) -> Vec<Bone> {
    let posture = posture_of(blueprint, state);
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

fn posture_of(blueprint: &Blueprint, state: &ActorState) -> Posture {
    let is_walker = blueprint.kind == Kind::Walker;
    Posture {
        steer_rad: state.wheel_steer_rad,
        spin_rad: state.wheel_spin_rad,
        doors: state.doors,
        stride: if is_walker { state.phase as f32 / client_lib::STRIDE as f32 } else { 0.0 },
        speed_mps: state.velocity().truncate().length(),
    }
}

fn pose_of(affine: &Affine3A) -> Pose {
    let (_, rotation, position) = affine.to_scale_rotation_translation();
    Pose::new(position, rotation.normalize())
}
