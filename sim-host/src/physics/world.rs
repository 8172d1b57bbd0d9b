//! The rigid-body world, and its step.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use glam::Vec3;
use protocol::ActorId;
use rapier3d::prelude::{
    Collider, ColliderBuilder, ColliderHandle, PhysicsWorld, Pose, RigidBody, SharedShape,
};

use super::{
    actor::{Actor, FarMotion, Kind, Teleport, digest_of, put_back},
    actor_list::ActorList,
    collision::{Collision, Pair, Push, Touched},
    error::PhysicsError,
    ground::Ground,
    mark,
    model::GRAVITY_MPS2,
    motion::{Twist, Wrench},
    overlap::{shrunk, touch},
    rigid_body::{apply, limit_speeds, motion_of, moved, published_velocity_mps, rounded_mps},
    statics::{StaticBox, StaticBoxes},
    walker::Walker,
    wheels::Surface,
};

/// The rigid-body world of one map.
pub struct Physics {
    pub(super) world: PhysicsWorld,
    pub(super) ground: Arc<Ground>,
    /// Factor on the friction of the dry ground under wheels.
    pub(super) grip: f32,
    pub(super) statics: StaticBoxes,
    /// Colliders of the static boxes, in their order.
    static_colliders: Vec<ColliderHandle>,
    pub(super) actors: ActorList,
    /// Ids of the actors that were awake in the last step; the states of the others did not change.
    pub(super) active: Vec<u32>,
    pub(super) collisions: Vec<Collision>,
    /// Ids of the actors in contact during the last frame, sorted.
    pub(super) colliding: Vec<u32>,
    /// Pairs in contact at the end of the last step.
    pub(super) touching: BTreeSet<Pair>,
    /// Walkers that were pushed aside in the last substep.
    pub(super) pushes: Vec<Push>,
    /// See [`Physics::set_far`].
    far_m: f32,
    /// See [`Physics::set_threads`].
    pub(super) threads: usize,
    /// Substeps of the current frame that are done; 0 between frames.
    pub(super) substeps_done: u64,
}

/// Marks the colliders of static boxes in `user_data`.
const STATIC: u128 = 1 << 64;

impl Physics {
    /// Creates a world without actors on a ground and among static boxes.
    pub fn new(ground: Arc<Ground>, boxes: &[StaticBox]) -> Physics {
        Physics::among(ground, StaticBoxes::new(boxes))
    }

    /// Creates a world without actors on a ground and among static boxes.
    pub fn among(ground: Arc<Ground>, statics: StaticBoxes) -> Physics {
        let mut world = PhysicsWorld::new();
        world.gravity = Vec3::Z * -GRAVITY_MPS2;
        // A larger margin: a moving car is searched in the tree of boxes every other substep.
        world.broad_phase.adaptive_change_detection_margin = true;
        let mut static_colliders = Vec::new();
        for (index, (pose, shape)) in statics.iter().enumerate() {
            let half = shape.half_extents.max(Vec3::splat(0.01));
            let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
                .position(*pose)
                .friction(0.5)
                .user_data(STATIC | index as u128);
            static_colliders.push(world.insert_collider(collider, None));
        }
        Physics {
            world,
            ground,
            grip: 1.0,
            statics,
            static_colliders,
            far_m: f32::INFINITY,
            threads: 1,
            substeps_done: 0,
            actors: ActorList::default(),
            active: Vec::new(),
            collisions: Vec::new(),
            colliding: Vec::new(),
            touching: BTreeSet::new(),
            pushes: Vec::new(),
        }
    }

    /// Returns the ground.
    pub fn ground(&self) -> &Arc<Ground> {
        &self.ground
    }

    /// Sets the factor on the friction of the dry ground under wheels, above 0 and up to 1.
    pub fn set_grip(&mut self, share: f32) {
        self.grip = share.clamp(0.01, 1.0);
    }

    /// Enables or disables a static box.
    pub fn set_static(&mut self, index: usize, enabled: bool) {
        // Changing a collider wakes the bodies near it.
        if !self.statics.set_enabled(index, enabled) {
            return;
        }
        self.world.colliders[self.static_colliders[index]].set_enabled(enabled);
    }

    /// Updates which static boxes are enabled, after the colliders were restored.
    pub(super) fn refresh_statics(&mut self) {
        for (index, handle) in self.static_colliders.iter().enumerate() {
            let enabled = self.world.colliders.get(*handle).is_some_and(|one| one.is_enabled());
            self.statics.set_enabled(index, enabled);
        }
    }

    /// Lets kinematic vehicles that are at least `far_m` metres from every other kind of body move
    /// once a frame, without contacts, instead of once a substep. It saves most of their time; poses
    /// differ by roundings. Infinity, the default, for none. A saved state does not have the motion
    /// of such vehicles.
    pub fn set_far(&mut self, far_m: f32) {
        self.far_m = far_m;
    }

    /// Sets the number of threads on which vehicles move, 1 by default. It changes no result.
    pub fn set_threads(&mut self, threads: usize) {
        self.threads = threads.max(1);
    }

    /// Returns the number of threads on which vehicles move.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Takes kinematic vehicles out of the rigid-body world while they are far from others, and moves
    /// them by one frame.
    fn move_far(&mut self, delta_s: f32) {
        let is_free = |actor: &Actor| actor.kinematic && matches!(actor.kind, Kind::Vehicle(_));
        let others: Vec<Vec3> = (self.actors.iter().filter(|actor| !is_free(actor)))
            .map(|actor| self.body(actor).translation())
            .collect();
        let Physics { world, actors, far_m, .. } = self;
        for actor in actors.awake_mut().filter(|actor| is_free(actor)) {
            let at = actor.far.map_or_else(|| *world.bodies[actor.body].position(), |far| far.pose);
            let is_far = others.iter().all(|other| other.distance(at.translation) >= *far_m);
            match (is_far, actor.far) {
                (true, None) => world.bodies[actor.body].set_enabled(false),
                (false, Some(_)) => bring_near(world, actor),
                _ => {}
            }
            if is_far {
                let velocity = actor.kinematic_velocity;
                actor.far = Some(FarMotion { pose: moved(&at, velocity, delta_s), velocity });
            }
        }
    }

    /// Returns the velocity of an actor's origin as snapshots hold it.
    fn velocity_mps(&self, actor: &Actor) -> Vec3 {
        match &actor.far {
            Some(far) => rounded_mps(far.velocity.linear_mps),
            None => published_velocity_mps(self.body(actor)),
        }
    }

    /// Returns the number of actors.
    pub fn len(&self) -> usize {
        self.actors.len()
    }

    /// Whether there are no actors.
    pub fn is_empty(&self) -> bool {
        self.actors.is_empty()
    }

    /// Returns the ids of all actors, rising.
    pub fn ids(&self) -> impl Iterator<Item = ActorId> + '_ {
        self.actors.iter().map(|a| ActorId(a.id))
    }

    /// Returns the ids of the actors whose state the last step may have changed, rising.
    pub fn active(&self) -> &[u32] {
        &self.active
    }

    /// Returns the collisions of the last frame, sorted by actor, then other, static boxes last.
    pub fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// Advances by one frame of `delta_nanos`, in the fewest equal substeps that are no longer than
    /// `substep_max_nanos`.
    pub fn step(&mut self, delta_nanos: u64, substep_max_nanos: u64) {
        self.step_observed(delta_nanos, substep_max_nanos, |_, _| {});
    }

    /// Advances like [`Physics::step`], and calls `observe` before the first substep with 0 and
    /// after each substep with its length in seconds.
    pub fn step_observed(
        &mut self,
        delta_nanos: u64,
        substep_max_nanos: u64,
        mut observe: impl FnMut(&Physics, f32),
    ) {
        if delta_nanos == 0 {
            return;
        }
        let count = delta_nanos.div_ceil(substep_max_nanos.max(1));
        let dt = (delta_nanos as f64 * 1e-9 / count as f64) as f32;
        self.world.integration_parameters.dt = dt;

        let before: Vec<Vec3> = self.actors.awake().map(|actor| self.velocity_mps(actor)).collect();
        let mut impulses = BTreeMap::new();
        let mut touching = BTreeSet::new();
        // A world without actors needs no substeps.
        let steps = if self.actors.is_empty() { 0 } else { count };
        observe(self, 0.0);
        if self.far_m.is_finite() {
            self.move_far((delta_nanos as f64 * 1e-9) as f32);
        }
        self.separate((delta_nanos as f64 * 1e-9) as f32);
        self.move_solo(dt, steps);
        for _ in 0..steps {
            self.apply_forces(dt);
            self.world.step();
            for actor in self.actors.awake().filter(|actor| !actor.kinematic && !actor.solo) {
                limit_speeds(&mut self.world.bodies[actor.body]);
            }
            self.collect_contacts(&mut impulses, &mut touching);
            self.collect_pushes(&mut impulses, &mut touching);
            self.substeps_done += 1;
            observe(self, dt);
        }
        self.end_solo();
        self.report_collisions(impulses, touching);

        let per_second = (1e9 / delta_nanos as f64) as f32;
        let after: Vec<Vec3> = self.actors.awake().map(|actor| self.velocity_mps(actor)).collect();
        for ((actor, before), after) in self.actors.awake_mut().zip(before).zip(after) {
            actor.acceleration_mps2 = (after - before) * per_second;
            actor.teleport.end_step();
            actor.external_force = Wrench::default();
            if let Kind::Walker(Walker { limbs: Some(limbs), .. }) = &mut actor.kind {
                limbs.fallen_nanos += delta_nanos;
            }
        }
        // An actor in a collision wakes up.
        for id in &self.colliding {
            if let Some(index) = self.actors.index_of(*id) {
                self.actors.wake(index);
            }
        }
        self.stand_walkers_up();
        self.active.clear();
        self.active.extend(self.actors.awake().map(|a| a.id));
        self.put_to_sleep();
    }

    /// Puts to sleep the actors at rest whose state the next step would not change.
    fn put_to_sleep(&mut self) {
        let Physics { world, actors, colliding, .. } = self;
        actors.sleep_where(|actor| {
            if !actor.kinematic {
                return None;
            }
            let body = &world.bodies[actor.body];
            let is_still = actor.far.is_none()
                && [
                    actor.kinematic_velocity.linear_mps,
                    actor.kinematic_velocity.angular_radps,
                    actor.acceleration_mps2,
                ] == [Vec3::ZERO; 3]
                && [body.linvel(), body.angvel()] == [Vec3::ZERO; 2]
                && actor.teleport == Teleport::default()
                && colliding.binary_search(&actor.id).is_err();
            is_still.then(|| digest_of(body, actor))
        });
    }

    pub(super) fn find(&self, id: ActorId) -> Result<usize, PhysicsError> {
        self.actors.index_of(id.0).ok_or(PhysicsError::Unknown(id))
    }

    pub(super) fn body(&self, actor: &Actor) -> &RigidBody {
        &self.world.bodies[actor.body]
    }

    /// Returns the colliders of an actor, whether or not it is in the rigid-body world.
    pub(super) fn colliders<'a>(&'a self, actor: &'a Actor) -> impl Iterator<Item = &'a Collider> {
        let of_body = self.body(actor).colliders();
        let own = if of_body.is_empty() { std::slice::from_ref(&actor.collider) } else { of_body };
        own.iter().filter_map(|handle| self.world.colliders.get(*handle))
    }

    /// Sets the force and torque of every body for one substep, or its next pose.
    fn apply_forces(&mut self, dt: f32) {
        self.release_props(dt);
        let obstacles = self.obstacles(dt);
        let Physics { world, ground, grip, statics, actors, pushes, .. } = self;
        pushes.clear();
        let surface = Surface { ground, grip: *grip };
        for actor in actors.awake_mut().filter(|actor| !actor.solo) {
            if actor.kinematic {
                let velocity = actor.kinematic_velocity;
                // A body at rest is not touched: rapier visits every body that was.
                if velocity != Twist::ZERO && actor.far.is_none() {
                    let body = &mut world.bodies[actor.body];
                    body.set_next_kinematic_position(moved(body.position(), velocity, dt));
                }
                continue;
            }
            let gravity = if actor.gravity_disabled { 0.0 } else { GRAVITY_MPS2 };
            let external = actor.external_force;
            let mut near = Vec::new();
            if let Kind::Walker(walker) = &mut actor.kind {
                let feet = world.bodies[actor.body].translation();
                if !walker.has_fallen() {
                    near = walker.near(&obstacles, feet, 0.0, dt);
                    if walker.is_knocked_down(feet, &near, dt) {
                        walker.fall(world, (actor.body, actor.collider));
                    }
                }
                if let Some(limbs) = &mut walker.limbs {
                    limbs.update_floors(world, ground, actor.body, dt);
                    continue;
                }
            }
            let body = &mut world.bodies[actor.body];
            match &mut actor.kind {
                Kind::Vehicle(vehicle) => {
                    let wrench =
                        vehicle.substep(&surface, &motion_of(body, gravity), &external, dt);
                    apply(body, &wrench);
                }
                Kind::Prop(prop) => {
                    let wrench = prop.substep(ground, &motion_of(body, gravity), &external, dt);
                    apply(body, &wrench);
                }
                Kind::Walker(walker) => {
                    let model = walker.model;
                    let shape = world.colliders[actor.collider].shape();
                    let lift = model.middle_m();
                    let free = |feet: Vec3| {
                        statics.touching(&Pose::from_translation(feet + lift), shape).is_none()
                    };
                    let feet = body.translation();
                    let (pushed_m, impulses) = walker.pushed_aside(feet, &near, dt);
                    pushes.extend(impulses.into_iter().map(|(by, impulse_ns)| Push {
                        walker: actor.id,
                        by,
                        impulse_ns,
                    }));
                    if pushed_m != Vec3::ZERO {
                        near = walker.near(&obstacles, feet, pushed_m.length(), dt);
                    }
                    let at = (feet, pushed_m);
                    let (feet, turn) = walker.substep(ground, &near, at, gravity, dt, free);
                    body.set_next_kinematic_position(Pose::from_parts(feet, turn));
                }
            }
        }
        self.push_back();
    }

    /// Returns the first object that a shape would touch: actors by id except `but`, then static
    /// boxes.
    pub(super) fn obstacle(
        &self,
        pose: &Pose,
        shape: &SharedShape,
        but: Option<u32>,
    ) -> Option<String> {
        let shape = shrunk(shape);
        let others = self.actors.iter().filter(|actor| {
            !actor.collisions_disabled && !actor.kind.is_passable() && Some(actor.id) != but
        });
        for actor in others {
            let body = self.body(actor);
            for collider in self.colliders(actor) {
                let local = collider.position_wrt_parent().copied();
                let local = local.unwrap_or_else(|| actor.collider_in_body());
                if touch(pose, &*shape, &(*body.position() * local), collider.shape()) {
                    return Some(ActorId(actor.id).to_string());
                }
            }
        }
        self.statics.touching(pose, &*shape).map(|index| self.statics.name(index).to_string())
    }

    /// Adds the contact impulses of one substep.
    fn collect_contacts(&self, impulses: &mut BTreeMap<Pair, Vec3>, touching: &mut BTreeSet<Pair>) {
        touching.clear();
        for pair in self.world.narrow_phase.contact_pairs() {
            if !pair.has_any_active_contact() {
                continue;
            }
            let impulse = pair.total_impulse();
            if impulse == Vec3::ZERO {
                continue;
            }
            let owner = |handle| self.world.colliders.get(handle).map(|c| c.user_data);
            let (Some(first), Some(second)) = (owner(pair.collider1), owner(pair.collider2)) else {
                continue;
            };
            // Floors of ragdolls belong to no actor.
            if first.min(second) == 0 {
                continue;
            }
            // The contact normal points from the first to the second.
            let (low, high, given) =
                if first < second { (first, second, -impulse) } else { (second, first, impulse) };
            let touched = if high & STATIC != 0 {
                Touched::Static(high as u32)
            } else {
                Touched::Actor(high as u32)
            };
            let pair = (low as u32, touched);
            *impulses.entry(pair).or_insert(Vec3::ZERO) += given;
            touching.insert(pair);
        }
    }

    fn report_collisions(&mut self, impulses: BTreeMap<Pair, Vec3>, touching: BTreeSet<Pair>) {
        let before = std::mem::replace(&mut self.touching, touching);
        self.collisions.clear();
        self.collisions.extend(impulses.into_iter().map(|(pair, impulse_ns)| {
            let (other, static_box) = match pair.1 {
                Touched::Actor(id) => (ActorId(id), None),
                Touched::Static(index) => (ActorId::NONE, Some(index)),
            };
            let began = !before.contains(&pair);
            Collision { actor: ActorId(pair.0), other, static_box, impulse_ns, began }
        }));
        self.colliding.clear();
        self.colliding.extend(self.collisions.iter().flat_map(|c| [c.actor.0, c.other.0]));
        self.colliding.sort_unstable();
        self.colliding.dedup();
    }
}

/// Puts the body of an actor that is far from others, or solo, back into the rigid-body world.
pub(super) fn bring_near(world: &mut PhysicsWorld, actor: &mut Actor) {
    if let Some(far) = actor.far.take() {
        let body = &mut world.bodies[actor.body];
        body.set_position(far.pose, true);
        body.set_enabled(true);
    } else if actor.solo {
        (actor.solo, actor.dormant) = (false, false);
        world.bodies[actor.body].user_data &= !mark::DORMANT;
        put_back(world, actor);
    }
}
