//! Walkers and props that vehicles hit: obstacles of walkers, walkers that are pushed aside or stand
//! up after a fall, and props that are released.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Mat3, Quat, Vec3};
use protocol::{ActorId, LIE_NANOS};
use rapier3d::prelude::{MassProperties, Pose, SharedShape};

use super::{
    actor::{Actor, Kind},
    body_state::BodyState,
    collision::{Pair, Push, Touched},
    door_model::DoorModel,
    obstacles::{Obstacle, Obstacles},
    overlap::touch,
    walker::Walker,
    world::Physics,
};

/// Distance at which a prop is released, so that it is dynamic at the first contact.
const RELEASE_M: f32 = 0.03;

impl Physics {
    /// Returns the obstacles of walkers in a substep of `dt` seconds; none if no walker is active.
    pub(super) fn obstacles(&self, dt: f32) -> Obstacles {
        let walks = |actor: &Actor| matches!(&actor.kind, Kind::Walker(w) if !w.has_fallen());
        if !self.actors.awake().any(walks) {
            return Obstacles::default();
        }
        let mut obstacles = Vec::new();
        for actor in self.actors.iter().filter(|actor| !actor.collisions_disabled) {
            let BodyState { pose, velocity } = self.body_state(actor);
            let velocity_mps = if actor.kinematic {
                actor.kinematic_velocity.linear_mps
            } else {
                velocity.linear_mps
            };
            let mut add = |center_m: Vec3, half_m: Vec3, turn: Quat| {
                obstacles.push(Obstacle {
                    actor: actor.id,
                    center_m: pose * center_m,
                    axes: Mat3::from_quat(pose.rotation * turn),
                    half_m,
                    velocity_mps,
                });
            };
            match &actor.kind {
                Kind::Vehicle(v) => {
                    add(v.own.box_center_m, v.own.box_half_m, Quat::IDENTITY);
                    for DoorModel { middle_m, half_extents_m, turn, .. } in v.open_doors() {
                        add(*middle_m, *half_extents_m, *turn);
                    }
                }
                Kind::Prop(p) if p.model.is_passable => {}
                Kind::Prop(p) => {
                    let half_m = p.model.half_extents_m;
                    add(Vec3::Z * half_m.z, half_m, Quat::IDENTITY);
                }
                Kind::Walker(_) => {}
            }
        }
        Obstacles::new(obstacles, dt)
    }

    /// Applies the reaction of pushed walkers to the actors that push them.
    pub(super) fn push_back(&mut self) {
        for push in &self.pushes {
            let Some(index) = self.actors.index_of(push.by) else { continue };
            let body = &mut self.world.bodies[self.actors[index].body];
            // Kinematic bodies have infinite mass, and rapier ignores the impulse.
            body.apply_impulse(push.impulse_ns, true);
        }
    }

    /// Adds the impulses of one substep between walkers and the actors that push them.
    pub(super) fn collect_pushes(
        &self,
        impulses: &mut BTreeMap<Pair, Vec3>,
        touching: &mut BTreeSet<Pair>,
    ) {
        for &Push { walker, by, impulse_ns } in &self.pushes {
            let (pair, given_ns) = if walker < by {
                ((walker, Touched::Actor(by)), -impulse_ns)
            } else {
                ((by, Touched::Actor(walker)), impulse_ns)
            };
            *impulses.entry(pair).or_insert(Vec3::ZERO) += given_ns;
            touching.insert(pair);
        }
    }

    /// Makes the kinematic props dynamic that a moving actor touches within `dt` seconds, so that it
    /// meets their mass and not that of a kinematic body, which is infinite.
    pub(super) fn release_props(&mut self, dt: f32) {
        let is_held = |actor: &Actor| {
            let is_released_on_hit =
                matches!(&actor.kind, Kind::Prop(prop) if prop.model.is_released_on_hit);
            is_released_on_hit && actor.kinematic && !actor.collisions_disabled
        };
        let hit: Vec<ActorId> = self
            .actors
            .iter()
            .filter(|actor| is_held(actor) && self.is_hit(actor, dt))
            .map(|actor| ActorId(actor.id))
            .collect();
        for id in hit {
            // The actor was found above.
            let _ = self.set_kinematic(id, false);
        }
    }

    /// Whether a moving vehicle or prop touches a prop within `dt` seconds.
    fn is_hit(&self, prop: &Actor, dt: f32) -> bool {
        let Kind::Prop(held) = &prop.kind else { return false };
        let half_m = held.model.half_extents_m + RELEASE_M;
        let (shape, reach_m) = (SharedShape::cuboid(half_m.x, half_m.y, half_m.z), half_m.length());
        let pose = self.body(prop).position() * Pose::from_translation(Vec3::Z * half_m.z);
        let may_hit = |actor: &&Actor| {
            let is_solid = !actor.collisions_disabled && !actor.kind.is_passable();
            actor.id != prop.id && is_solid && !matches!(actor.kind, Kind::Walker(_))
        };
        self.actors.awake().filter(may_hit).any(|actor| {
            let body = self.body(actor);
            let velocity_mps =
                if actor.kinematic { actor.kinematic_velocity.linear_mps } else { body.linvel() };
            if velocity_mps == Vec3::ZERO {
                return false;
            }
            let ahead = Pose::from_translation(velocity_mps * dt) * *body.position();
            body.colliders().iter().any(|collider| {
                let collider = &self.world.colliders[*collider];
                let bounds = collider.shape().compute_local_bounding_sphere();
                let local = collider.position_wrt_parent().copied().unwrap_or(Pose::IDENTITY);
                let at = ahead * local;
                let near_m = bounds.radius + bounds.center.length() + reach_m;
                at.translation.distance_squared(pose.translation) < near_m * near_m
                    && touch(&at, collider.shape(), &pose, &*shape)
            })
        })
    }

    /// Lets the walkers stand up that have lain for their time, where there is room.
    pub(super) fn stand_walkers_up(&mut self) {
        let lies_long = |actor: &Actor| {
            matches!(&actor.kind, Kind::Walker(Walker { model, limbs: Some(limbs), .. })
                if model.gets_up_after_fall && limbs.fallen_nanos >= LIE_NANOS)
        };
        let ids: Vec<ActorId> =
            self.actors.iter().filter(|a| lies_long(a)).map(|a| ActorId(a.id)).collect();
        for id in ids {
            self.stand_up(id);
        }
    }

    /// Replaces the ragdoll of a walker by a standing body below its hips, if there is room.
    fn stand_up(&mut self, id: ActorId) {
        let Ok(index) = self.find(id) else { return };
        let actor = &self.actors[index];
        let Kind::Walker(Walker { model, limbs: Some(limbs), .. }) = actor.kind else { return };
        let body = self.body(actor);
        let hips_m = body.center_of_mass();
        let ground = self.ground.below(hips_m.x, hips_m.y, hips_m.z + 0.3);
        let ahead = *body.rotation() * Vec3::X;
        let feet_m = hips_m.with_z(ground.height_m);
        let walker = Walker::new(model, ahead.y.atan2(ahead.x));
        let pose = protocol::Pose::level(feet_m, walker.yaw_rad);
        let shape = SharedShape::capsule_z(model.half_segment_m(), model.radius_m);
        let middle_m = model.middle_m();
        let at = Pose::from_translation(feet_m + middle_m);
        if self.obstacle(&at, &shape, Some(id.0)).is_some() {
            return;
        }
        let mass = MassProperties::new(middle_m, model.mass_kg, model.inertia_kgm2());
        let lay = self.actors.remove(index);
        limbs.remove(&mut self.world);
        self.world.remove_body(lay.body);
        // The place was found free above.
        let kind = Kind::Walker(walker);
        if self.insert(id, kind, shape, middle_m, mass, &pose, lay.kinematic).is_ok()
            && let Ok(index) = self.find(id)
        {
            let actor = self.actors.wake(index);
            actor.teleport = lay.teleport;
            // Both are set as by commands, since the bodies differ.
            let _ = self.set_gravity(id, !lay.gravity_disabled);
            let _ = self.set_collisions(id, !lay.collisions_disabled);
        }
    }
}
