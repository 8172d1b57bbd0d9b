use glam::Affine3A;
use protocol::{ActorState, GivenPoses, STRIDE, WalkerLimbs, flag, kind};
use town::{GivenPose, Posture};

use crate::scene::Scene;

/// Calls `show` with the bottom-level hierarchy and `world_from_piece` of each piece of an actor
/// that has a surface.
pub(crate) fn pieces(
    scene: &Scene,
    actor: &ActorState,
    (poses, limbs): (&GivenPoses, Option<&WalkerLimbs>),
    is_parked: bool,
    mut show: impl FnMut(u32, &Affine3A),
) {
    let Some(geometry) = scene.geometries.get(actor.blueprint as usize) else { return };
    if !actor.pose.is_valid() {
        return;
    }
    let world_from_actor = actor.pose.affine();
    let mut show = |blas: u32, world_from_piece: &Affine3A| {
        if !scene.blases[blas as usize].is_empty() {
            show(blas, world_from_piece);
        }
    };
    let first = geometry.first_blas;
    match (&geometry.rig, geometry.whole.filter(|_| is_parked)) {
        (_, Some(whole)) => show(whole, &world_from_actor),
        (None, None) => show(first, &world_from_actor),
        (Some(rig), None) => {
            rig.place(&posture_of(actor, poses, limbs), |piece, actor_from_piece| {
                let blas = first + piece as u32;
                if actor_from_piece == Affine3A::IDENTITY {
                    show(blas, &world_from_actor);
                } else {
                    show(blas, &(world_from_actor * actor_from_piece));
                }
            })
        }
    }
}

/// Returns the joint angles of an actor.
fn posture_of<'a>(
    actor: &ActorState,
    poses: &'a GivenPoses,
    limbs: Option<&WalkerLimbs>,
) -> Posture<'a> {
    let is_walker = actor.kind == kind::WALKER;
    Posture {
        steer_rad: actor.wheel_steer_rad,
        spin_rad: actor.wheel_spin_rad,
        doors: actor.doors,
        stride: if is_walker { actor.phase as f32 / STRIDE as f32 } else { 0.0 },
        speed_mps: if is_walker { actor.velocity().truncate().length() } else { 0.0 },
        limbs: limbs.map(WalkerLimbs::rotations),
        given: if actor.has(flag::POSED) {
            poses.of(actor.actor_id).map(|to| GivenPose { weight: to.weight, bones: &to.bones })
        } else {
            None
        },
    }
}
