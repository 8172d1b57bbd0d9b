//! Walkers: upright capsules that move over the ground at a desired velocity and stop at obstacles.
//! A fast obstacle knocks down a walker, which becomes a ragdoll (`ragdoll.rs`) and may stand up
//! later; a slow one pushes it aside.

use glam::{Quat, Vec2, Vec3};
use rapier3d::prelude::{ColliderHandle, PhysicsWorld, RigidBodyHandle};
use serde::{Deserialize, Serialize};

use super::{
    ground::Ground,
    model::GRAVITY_MPS2,
    obstacles::{Obstacle, Obstacles},
    ragdoll::Limbs,
    walker_model::WalkerModel,
};

/// Highest step that a walker climbs, and deepest one that it descends without falling.
const STEP_M: f32 = 0.4;
/// Largest speed of a fall.
const FALL_MAX_MPS: f32 = 50.0;
/// Vertical speed at the start of a jump, about 0.9 m high as with CARLA's walkers.
const JUMP_MPS: f32 = 4.2;
/// Closing speed of an obstacle above which a walker is knocked down.
const KNOCK_DOWN_MPS: f32 = 2.0;
/// Closing speed of an obstacle above which it pushes a walker aside; a resting vehicle sways less.
const PUSH_MPS: f32 = 0.05;
/// Distance that is kept to an obstacle that pushes.
const PUSH_GAP_M: f32 = 0.02;
/// Friction of shoes on the ground: the force of a pushed walker on the obstacle, by its weight.
const PUSH_FRICTION: f32 = 0.5;
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Walker {
    pub model: WalkerModel,
    /// Desired velocity over ground, in world space.
    pub desired_speed_mps: Vec2,
    /// Vertical speed in the air; `None` on the ground.
    pub rise_mps: Option<f32>,
    pub yaw_rad: f32,
    /// The ragdoll of a fallen walker.
    pub limbs: Option<Limbs>,
}

impl Walker {
    pub(super) fn new(model: WalkerModel, yaw_rad: f32) -> Walker {
        Walker { model, desired_speed_mps: Vec2::ZERO, rise_mps: None, yaw_rad, limbs: None }
    }

    /// Starts a jump, if the walker stands on the ground.
    pub(super) fn jump(&mut self) {
        self.rise_mps = self.rise_mps.or(Some(JUMP_MPS));
    }

    /// Whether the walker has fallen and is a ragdoll.
    pub(super) fn has_fallen(&self) -> bool {
        self.limbs.is_some()
    }

    /// Turns the walker into a ragdoll that continues with its velocity.
    pub(super) fn fall(
        &mut self,
        world: &mut PhysicsWorld,
        own: (RigidBodyHandle, ColliderHandle),
    ) {
        let velocity_mps = self.desired_speed_mps.extend(self.rise_mps.unwrap_or(0.0));
        self.limbs = Some(Limbs::create(world, own, &self.model, velocity_mps));
    }

    /// Returns the obstacles that may meet the walker within `dt` seconds, and others near; besides its desired
    /// velocity it may move by `way_m`.
    pub(super) fn near<'a>(
        &self,
        obstacles: &'a Obstacles,
        feet_m: Vec3,
        way_m: f32,
        dt: f32,
    ) -> Vec<&'a Obstacle> {
        let reach_m = self.model.height_m + self.desired_speed_mps.length() * dt + way_m;
        obstacles.near(feet_m + self.model.middle_m(), reach_m)
    }

    /// Returns how far obstacles push the walker aside within `dt` seconds, and the impulse of the
    /// walker on each of them, by actor: that of a weight that slides over the ground.
    pub(super) fn pushed_aside(
        &self,
        feet_m: Vec3,
        obstacles: &[&Obstacle],
        dt: f32,
    ) -> (Vec3, Vec<(u32, Vec3)>) {
        let middle_m = feet_m + self.model.middle_m();
        let (mut moved_m, mut impulses) = (Vec3::ZERO, Vec::new());
        for obstacle in obstacles {
            if obstacle.is_far(middle_m, &self.model, obstacle.velocity_mps.length() * dt) {
                continue;
            }
            let (gap, direction) = obstacle.gap(middle_m, &self.model);
            let direction = direction.with_z(0.0).normalize_or_zero();
            let closing_mps = obstacle.velocity_mps.dot(direction);
            let pushed_m = closing_mps * dt + PUSH_GAP_M - gap;
            if closing_mps > PUSH_MPS && pushed_m > 0.0 {
                moved_m += direction * pushed_m.min(closing_mps * dt + PUSH_GAP_M);
                let weight_n = self.model.mass_kg * GRAVITY_MPS2;
                impulses.push((obstacle.actor, direction * (-PUSH_FRICTION * weight_n * dt)));
            }
        }
        (moved_m, impulses)
    }

    /// Whether an obstacle hits the walker within `dt` seconds fast enough to knock it down.
    pub(super) fn is_knocked_down(&self, feet_m: Vec3, obstacles: &[&Obstacle], dt: f32) -> bool {
        if !self.model.is_ragdoll_on_hit {
            return false;
        }
        let own_mps = self.desired_speed_mps.extend(0.0);
        let middle_m = feet_m + self.model.middle_m();
        obstacles.iter().any(|obstacle| {
            let coming_mps = obstacle.velocity_mps - own_mps;
            if obstacle.is_far(middle_m, &self.model, coming_mps.length() * dt) {
                return false;
            }
            let (gap, direction) = obstacle.gap(middle_m, &self.model);
            let closing_mps = coming_mps.dot(direction);
            closing_mps > KNOCK_DOWN_MPS && gap < closing_mps * dt + 0.08
        })
    }

    /// Returns the position of the feet after `dt` seconds, and the rotation of the body.
    /// `pushed_m` is how far obstacles push the walker ([`Walker::pushed_aside`]); `free` tests
    /// whether a walker may stand at a position.
    pub(super) fn substep(
        &mut self,
        ground: &Ground,
        obstacles: &[&Obstacle],
        (feet_m, pushed_m): (Vec3, Vec3),
        gravity_mps2: f32,
        dt: f32,
        free: impl Fn(Vec3) -> bool,
    ) -> (Vec3, Quat) {
        let mut next = feet_m;
        if pushed_m != Vec3::ZERO && free(feet_m + pushed_m) {
            next += pushed_m;
        }
        if self.desired_speed_mps != Vec2::ZERO {
            self.yaw_rad = self.desired_speed_mps.y.atan2(self.desired_speed_mps.x);
            let stepped = next + (self.desired_speed_mps * dt).extend(0.0);
            // A walker inside a box may leave it.
            let [here_m, there_m] = [next, stepped].map(|feet| feet + self.model.middle_m());
            let way_m = here_m.distance(there_m);
            let deeper = |obstacle: &&Obstacle| {
                if obstacle.is_far(here_m, &self.model, way_m) {
                    return false;
                }
                let [from, to] =
                    [here_m, there_m].map(|middle_m| obstacle.gap(middle_m, &self.model).0);
                to < 0.0 && to < from
            };
            if !obstacles.iter().any(deeper) && free(stepped) {
                next = stepped;
            }
        }
        let below_m = ground.below(next.x, next.y, next.z + STEP_M).height_m;
        if self.rise_mps.is_none() && next.z - below_m > STEP_M {
            self.rise_mps = Some(0.0);
        }
        match &mut self.rise_mps {
            Some(rise) => {
                *rise = (*rise - gravity_mps2 * dt).max(-FALL_MAX_MPS);
                next.z += *rise * dt;
                if next.z <= below_m {
                    next.z = below_m;
                    self.rise_mps = None;
                }
            }
            None => next.z = below_m,
        }
        (next, Quat::from_rotation_z(self.yaw_rad))
    }
}
