//! Queries of the rigid-body world for sensors. They change nothing.

use glam::Vec3;
use protocol::{ActorId, Pose as BusPose};
use rapier3d::{
    parry::{
        query::{Ray, ShapeCastOptions, cast_shapes},
        shape::{Ball, Shape},
    },
    prelude::{Collider, Pose},
};

use super::{
    actor::{Actor, Kind},
    body_state::BodyState,
    motion::Twist,
    world::Physics,
};

/// The motion of a body at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyMotion {
    /// `world_from_actor`.
    pub pose: BusPose,
    /// Velocity of the origin, in world space.
    pub velocity_mps: Vec3,
    /// Angular velocity, in world space.
    pub spin_radps: Vec3,
}

/// The object that a sphere cast hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CastHit {
    /// An actor.
    Actor(ActorId),
    /// A static box, by index.
    Static(u32),
    /// The ground.
    Ground,
}

impl Physics {
    /// Returns the motion of an actor's body, or `None` if the actor has none.
    pub fn motion(&self, id: ActorId) -> Option<BodyMotion> {
        let actor = &self.actors[self.find(id).ok()?];
        let BodyState { pose, velocity } = self.body_state(actor);
        let pose = BusPose::new(pose.translation, pose.rotation);
        let velocity = if actor.kinematic {
            actor.kinematic_velocity
        } else {
            Twist { linear_mps: self.origin_mps(actor), ..velocity }
        };
        Some(BodyMotion {
            pose,
            velocity_mps: velocity.linear_mps,
            spin_radps: velocity.angular_radps,
        })
    }

    /// Returns the mean circumferential speed of a vehicle's wheels, or `None` if it has no wheels.
    pub fn wheel_speed_mps(&self, id: ActorId) -> Option<f32> {
        let actor = &self.actors[self.find(id).ok()?];
        let Kind::Vehicle(vehicle) = &actor.kind else { return None };
        vehicle.wheel_speed_mps()
    }

    /// Returns the pose of a collider of an actor: the rigid-body world does not move those of
    /// disabled bodies.
    fn collider_pose(&self, actor: &Actor, collider: &Collider) -> Pose {
        if actor.far.is_none() && !actor.solo {
            return *collider.position();
        }
        let local = collider.position_wrt_parent().copied();
        let local = local.unwrap_or_else(|| actor.collider_in_body());
        self.body_state(actor).pose * local
    }

    /// Casts a sphere from `from` along the unit vector `ahead`, up to `reach_m`. Returns the
    /// distance and the first object that it hits. The actor `excluded` is ignored; with
    /// `only_actors`, so are static boxes and the ground.
    pub fn cast_sphere(
        &self,
        (from, ahead): (Vec3, Vec3),
        reach_m: f32,
        radius_m: f32,
        excluded: ActorId,
        only_actors: bool,
    ) -> Option<(f32, CastHit)> {
        let ball = Ball::new(radius_m);
        let start = Pose::from_translation(from);
        let middle = from + ahead * (0.5 * reach_m);
        let near_m = 0.5 * reach_m + radius_m;
        let cast = |reach_m: f32, pose: &Pose, shape: &dyn Shape| -> Option<f32> {
            let options = ShapeCastOptions::with_max_time_of_impact(reach_m);
            let hit = cast_shapes(&start, ahead, &ball, pose, Vec3::ZERO, shape, options);
            hit.ok().flatten().map(|hit| hit.time_of_impact)
        };
        let mut nearest: Option<(f32, CastHit)> = None;
        let mut take = |found: Option<f32>, met: CastHit| {
            let Some(distance) = found else { return };
            if nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, met));
            }
        };
        for actor in self.actors.iter().filter(|a| a.id != excluded.0 && !a.collisions_disabled) {
            for collider in self.colliders(actor) {
                let pose = self.collider_pose(actor, collider);
                let bounds = collider.shape().compute_bounding_sphere(&pose);
                if bounds.center.distance(middle) <= near_m + bounds.radius {
                    let found = cast(reach_m, &pose, collider.shape());
                    take(found, CastHit::Actor(ActorId(actor.id)));
                }
            }
        }
        if !only_actors {
            let end = Pose::from_translation(from + ahead * reach_m);
            for index in self.statics.near_sweep(&ball, &start, &end) {
                let (pose, shape) = self.statics.shape(index);
                take(cast(reach_m, pose, shape), CastHit::Static(index as u32));
            }
            take(self.sphere_on_ground((from, ahead), reach_m, radius_m), CastHit::Ground);
        }
        nearest
    }

    /// Tests the line between two points. Returns whether a static box or the ground blocks it, and
    /// the actors on it, by id. The actors in `excluded` are ignored.
    pub fn line_of_sight(
        &self,
        from: Vec3,
        to: Vec3,
        excluded: [ActorId; 2],
    ) -> (bool, Vec<ActorId>) {
        const STEP_M: f32 = 2.0;
        let along = to - from;
        let length = along.length();
        let Some(ahead) = along.try_normalize() else { return (false, Vec::new()) };
        let ray = Ray::new(from, ahead);
        let meets = |pose: &Pose, shape: &dyn Shape| shape.intersects_ray(pose, &ray, length);
        let dot = Ball::new(0.01);
        let (start, end) = (Pose::from_translation(from), Pose::from_translation(to));
        let hits_box = self.statics.near_sweep(&dot, &start, &end).into_iter().any(|index| {
            let (pose, shape) = self.statics.shape(index);
            meets(pose, shape)
        });
        let steps = (length / STEP_M).ceil().max(1.0) as u32;
        let is_below_ground = |step: u32| {
            let at = from.lerp(to, step as f32 / steps as f32);
            let ground = self.ground.below(at.x, at.y, at.z + 100.0);
            ground.on_map && ground.height_m > at.z
        };
        let hits_ground = !hits_box && (1..steps).any(is_below_ground);
        let mut actors = Vec::new();
        for actor in self.actors.iter().filter(|a| !excluded.contains(&ActorId(a.id))) {
            let Some(collider) = self.world.colliders.get(actor.collider) else { continue };
            if meets(&self.collider_pose(actor, collider), collider.shape()) {
                actors.push(ActorId(actor.id));
            }
        }
        (hits_box || hits_ground, actors)
    }

    /// Returns the distance that a sphere travels until it hits the ground. A sphere that starts in
    /// the ground does not hit it: some sensors are mounted low.
    fn sphere_on_ground(
        &self,
        (from, ahead): (Vec3, Vec3),
        reach_m: f32,
        radius_m: f32,
    ) -> Option<f32> {
        const STEP_M: f32 = 0.25;
        let clear_m = |along: f32| {
            let at = from + ahead * along;
            let under = self.ground.below(at.x, at.y, at.z + radius_m + 1.0);
            let above = (at.z - under.height_m) * under.normal.z - radius_m;
            if under.on_map { above } else { f32::INFINITY }
        };
        if clear_m(0.0) <= 0.0 {
            return None;
        }
        let steps = (reach_m / STEP_M).ceil().max(1.0) as u32;
        let along = |step: u32| reach_m * step as f32 / steps as f32;
        let first = (1..=steps).find(|step| clear_m(along(*step)) <= 0.0)?;
        let (mut clear, mut met) = (along(first - 1), along(first));
        for _ in 0..12 {
            let half = 0.5 * (clear + met);
            if clear_m(half) <= 0.0 { met = half } else { clear = half }
        }
        Some(met)
    }
}
