//! Walkers: upright capsules that move over the ground at a desired velocity and stop at obstacles.
//! A fast obstacle knocks down a walker, which becomes a ragdoll (`ragdoll.rs`) and may stand up
//! later; a slow one pushes it aside.

use glam::{Mat3, Quat, Vec2, Vec3};
use rapier3d::prelude::{ColliderHandle, PhysicsWorld, RigidBodyHandle};
use serde::{Deserialize, Serialize};

use super::{ground::Ground, model::GRAVITY_MPS2, ragdoll::Limbs, walker_model::WalkerModel};

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

/// A box that blocks walkers and may knock them down.
pub(super) struct Obstacle {
    /// The id of the actor.
    pub actor: u32,
    pub center_m: Vec3,
    /// `world_from_box`, rotation only.
    pub axes: Mat3,
    pub half_m: Vec3,
    pub velocity_mps: Vec3,
}

impl Obstacle {
    /// Whether the box cannot touch a walker after `way_m` of relative motion: a cheap test.
    fn is_far(&self, middle_m: Vec3, model: &WalkerModel, way_m: f32) -> bool {
        let near_m = self.half_m.length() + model.height_m + way_m;
        (middle_m - self.center_m).length_squared() > near_m * near_m
    }

    /// Returns the distance from the box to the side of a walker, negative inside, and the
    /// direction from the box to the walker in world space.
    fn gap(&self, middle_m: Vec3, model: &WalkerModel) -> (f32, Vec3) {
        let local = self.axes.transpose() * (middle_m - self.center_m);
        if local.z.abs() > self.half_m.z + model.height_m / 2.0 {
            return (f32::MAX, Vec3::ZERO);
        }
        let beyond = Vec2::new(local.x.abs(), local.y.abs()) - self.half_m.truncate();
        let outside = beyond.max(Vec2::ZERO);
        let gap = outside.length() + beyond.max_element().min(0.0) - model.radius_m;
        let sign = Vec2::new(local.x.signum(), local.y.signum());
        let direction = if outside == Vec2::ZERO {
            if beyond.x > beyond.y { Vec2::X } else { Vec2::Y }
        } else {
            outside.normalize_or_zero()
        };
        (gap, self.axes * (direction * sign).extend(0.0))
    }
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

    /// Returns how far obstacles push the walker aside within `dt` seconds, and the impulse of the
    /// walker on each of them, by actor: that of a weight that slides over the ground.
    pub(super) fn pushed_aside(
        &self,
        feet_m: Vec3,
        obstacles: &[Obstacle],
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
    pub(super) fn is_knocked_down(&self, feet_m: Vec3, obstacles: &[Obstacle], dt: f32) -> bool {
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
        obstacles: &[Obstacle],
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
            let deeper = |obstacle: &Obstacle| {
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
