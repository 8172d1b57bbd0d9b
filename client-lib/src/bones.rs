//! Poses of walkers that clients set, and the transforms of bones.

use glam::Affine3A;
use protocol::{
    ActorId, ActorState, BONES, BlendPose, Command, Pose, STRIDE, SetBones, WalkerLimbs, flag, kind,
};
use town::{Blueprint, GivenPose, Posture};

use crate::{Client, ClientError};

/// Returns the number of a walker's bone by CARLA's name, as `crl_arm__L`; `None` if it is unknown.
#[must_use]
pub fn bone(name: &str) -> Option<u32> {
    BONES.iter().position(|one| *one == name).map(|index| index as u32)
}

impl Client {
    /// Sets bones of a walker's given pose: each by its number (see [`bone`]) and its
    /// `parent_from_bone`, metres. Other bones keep their rest pose, in which the axes of a bone are
    /// the actor's. [`Client::blend_pose`] sets how much of the pose is shown.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist, is not a walker or has fallen, if it has
    /// no such bone, or a pose is out of range.
    pub fn set_bones(
        &mut self,
        actor_id: ActorId,
        bones: &[(u32, Pose)],
    ) -> Result<(), ClientError> {
        let commands = bone_commands(actor_id, bones);
        if commands.is_empty() {
            return Ok(());
        }
        self.request("set_bones", &commands).map(drop)
    }

    /// Sets the weight of a walker's given pose: 0 shows its walk alone, 1 the pose alone.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist, is not a walker or has fallen, or the
    /// weight is not 0 to 1.
    pub fn blend_pose(&mut self, actor_id: ActorId, weight: f32) -> Result<(), ClientError> {
        let command = Command::BlendPose(BlendPose { actor_id, weight });
        self.request("blend_pose", &[command]).map(drop)
    }

    /// Returns a walker's given pose: `parent_from_bone` of every bone, and the weight of the pose.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist or is not a walker.
    pub fn given_pose(&mut self, actor_id: ActorId) -> Result<(Vec<Pose>, f32), ClientError> {
        self.queries().given_pose(actor_id)
    }
}

/// The pose of a walker's bone, or of a moving part of a vehicle.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BoneTransform {
    /// Name; a walker's bones have CARLA's names.
    pub name: String,
    /// Pose in world space.
    pub world_from_bone: Pose,
    /// Pose in the actor's space.
    pub actor_from_bone: Pose,
    /// Pose in the space of the parent bone; in the actor's space for a bone without a parent and
    /// for a part of a vehicle.
    pub parent_from_bone: Pose,
}

impl Client {
    /// Returns the bones of a walker, or the moving parts of a vehicle, at the frame that was taken
    /// in last.
    ///
    /// # Errors
    ///
    /// [`ClientError::NoSuchActor`] if no actor with a body has this id at that frame; as for
    /// [`Client::given_pose`], which is called if a client has set a pose.
    pub fn bone_transforms(
        &mut self,
        actor_id: ActorId,
    ) -> Result<Vec<BoneTransform>, ClientError> {
        let missing = ClientError::NoSuchActor { actor_id };
        let Some(state) = self.world().state(actor_id).copied() else { return Err(missing) };
        let limbs = WalkerLimbs::find(self.world().limbs(), actor_id).copied();
        let Some(blueprint) = town::catalogue().get(state.blueprint as usize) else {
            return Err(missing);
        };
        let is_posed = state.kind == kind::WALKER && state.has(flag::POSED);
        let given = if is_posed { Some(self.given_pose(actor_id)?) } else { None };
        Ok(bone_transforms(blueprint, &state, limbs.as_ref(), given))
    }
}

/// Returns the bones of an actor with this blueprint and state, as [`Client::bone_transforms`] does.
///
/// `limbs` are those of a fallen walker. `given` is the pose that clients have set, with its weight,
/// as returned by [`Client::given_pose`].
#[must_use]
pub fn bone_transforms(
    blueprint: &Blueprint,
    state: &ActorState,
    limbs: Option<&WalkerLimbs>,
    given: Option<(Vec<Pose>, f32)>,
) -> Vec<BoneTransform> {
    let given = given.map(|(bones, weight)| {
        let bones = bones.iter().map(|pose| Some((pose.position(), pose.rotation())));
        (bones.collect::<Vec<_>>(), weight)
    });
    let given = given.as_ref().map(|(bones, weight)| GivenPose { weight: *weight, bones });
    let posture = Posture { given, ..posture_of(state, limbs) };
    let world_from_actor = state.pose.affine();
    let transform =
        |name: &str, actor_from_bone: Affine3A, parent_from_bone: Affine3A| BoneTransform {
            name: name.to_owned(),
            world_from_bone: pose_of(&(world_from_actor * actor_from_bone)),
            actor_from_bone: pose_of(&actor_from_bone),
            parent_from_bone: pose_of(&parent_from_bone),
        };
    let mut all = Vec::new();
    if let Some(skeleton) = blueprint.skeleton() {
        let placed = skeleton.actor_from_bones(&posture);
        for (index, bone) in skeleton.bones.iter().enumerate() {
            let parent = if index == bone.parent {
                placed[index]
            } else {
                placed[bone.parent].inverse() * placed[index]
            };
            all.push(transform(&bone.name, placed[index], parent));
        }
        return all;
    }
    let rig = blueprint.rig();
    rig.place(&posture, |piece, placed| {
        let joint = &rig.joints[piece];
        let actor_from_bone = placed * Affine3A::from_translation(joint.pivot_m());
        all.push(transform(joint.name, actor_from_bone, actor_from_bone));
    });
    all
}

/// Returns the bones of a walker in its walking animation, without a pose that clients have set:
/// the number of each bone and `parent_from_bone`, as [`Client::set_bones`] takes them. `None` for
/// an actor without a skeleton.
#[must_use]
pub fn animation_pose(
    blueprint: &Blueprint,
    state: &ActorState,
    limbs: Option<&WalkerLimbs>,
) -> Option<Vec<(u32, Pose)>> {
    let bones = blueprint.skeleton()?.parent_from_bones(&posture_of(state, limbs));
    Some((0..).zip(bones).map(|(bone, (at, turn))| (bone, Pose::new(at, turn))).collect())
}

/// Returns what moves the pieces of an actor, as the renderer shows them, without a pose that clients
/// have set. `limbs` are those of a fallen walker.
#[must_use]
pub fn posture_of(state: &ActorState, limbs: Option<&WalkerLimbs>) -> Posture<'static> {
    let is_walker = state.kind == kind::WALKER;
    Posture {
        steer_rad: state.wheel_steer_rad,
        spin_rad: state.wheel_spin_rad,
        doors: state.doors,
        stride: if is_walker { state.phase as f32 / STRIDE as f32 } else { 0.0 },
        speed_mps: state.velocity().truncate().length(),
        limbs: limbs.map(WalkerLimbs::rotations),
        given: None,
    }
}

fn pose_of(affine: &Affine3A) -> Pose {
    let (_, rotation, position) = affine.to_scale_rotation_translation();
    Pose::new(position, rotation.normalize())
}

/// Returns the commands that set bones: see [`Client::set_bones`].
#[must_use]
pub fn bone_commands(actor_id: ActorId, bones: &[(u32, Pose)]) -> Vec<Command> {
    let mut bones = bones.to_vec();
    // If a bone is named twice, its last pose holds.
    bones.reverse();
    bones.sort_by_key(|(bone, _)| *bone);
    bones.dedup_by_key(|(bone, _)| *bone);
    SetBones::of(actor_id, &bones).into_iter().map(Command::SetBones).collect()
}
