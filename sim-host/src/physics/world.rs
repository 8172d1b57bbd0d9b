//! The world of bodies, and its step.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use glam::{Mat3, Quat, Vec3};
use protocol::ActorId;
use rapier3d::prelude::{
    ColliderBuilder, ColliderHandle, PhysicsWorld, Pose, RigidBody, SharedShape,
};

use super::{
    actor::{Actor, Kind, Teleport, digest_of},
    actor_list::ActorList,
    collision::{Collision, Pair, Touched},
    door_model::DoorModel,
    error::PhysicsError,
    ground::Ground,
    model::GRAVITY_MPS2,
    motion::{Twist, Wrench},
    overlap::{shrunk, touch},
    ragdoll::Limbs,
    rigid_body::{apply, integrate_kinematic, motion_of, published_velocity_mps},
    statics::{StaticBox, StaticBoxes},
    walker::Obstacle,
    wheels::Surface,
};

/// The world of bodies.
pub struct Physics {
    pub(super) world: PhysicsWorld,
    pub(super) ground: Arc<Ground>,
    /// Share of the dry ground's friction that wheels find.
    pub(super) grip: f32,
    pub(super) statics: StaticBoxes,
    /// Of the static boxes, in their order.
    static_colliders: Vec<ColliderHandle>,
    pub(super) actors: ActorList,
    /// Who was awake in the last step, by id: of the others nothing new is to be told.
    pub(super) active: Vec<u32>,
    pub(super) collisions: Vec<Collision>,
    /// Who is part of one, by id.
    pub(super) colliding: Vec<u32>,
    /// Pairs that touched at the end of the last step.
    pub(super) touching: BTreeSet<Pair>,
}

/// Marks the colliders of static boxes in `user_data`.
const STATIC: u128 = 1 << 64;

impl Physics {
    /// An empty world on that ground, among those boxes.
    pub fn new(ground: Arc<Ground>, boxes: &[StaticBox]) -> Physics {
        let mut world = PhysicsWorld::new();
        world.gravity = Vec3::Z * -GRAVITY_MPS2;
        // A car that drives is sought anew in the tree of all boxes every other substep, not in each.
        world.broad_phase.adaptive_change_detection_margin = true;
        let mut static_colliders = Vec::with_capacity(boxes.len());
        for (index, b) in boxes.iter().enumerate() {
            let half = b.half_extents_m.max(Vec3::splat(0.01));
            let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
                .position(b.pose())
                .friction(0.5)
                .user_data(STATIC | index as u128);
            static_colliders.push(world.insert_collider(collider, None));
        }
        Physics {
            world,
            ground,
            grip: 1.0,
            statics: StaticBoxes::new(boxes),
            static_colliders,
            actors: ActorList::default(),
            active: Vec::new(),
            collisions: Vec::new(),
            colliding: Vec::new(),
            touching: BTreeSet::new(),
        }
    }

    /// The ground that everything stands on.
    pub fn ground(&self) -> &Arc<Ground> {
        &self.ground
    }

    /// How much of the dry ground's friction wheels find, above 0 and up to 1.
    pub fn set_grip(&mut self, share: f32) {
        self.grip = share.clamp(0.01, 1.0);
    }

    /// Takes a static box out of the world, or puts it back.
    pub fn set_static(&mut self, index: usize, enabled: bool) {
        // To touch a collider is to wake those round it.
        if !self.statics.set_enabled(index, enabled) {
            return;
        }
        self.world.colliders[self.static_colliders[index]].set_enabled(enabled);
    }

    /// After the colliders came from elsewhere: who is there.
    pub(super) fn refresh_statics(&mut self) {
        for (index, handle) in self.static_colliders.iter().enumerate() {
            let enabled = self.world.colliders.get(*handle).is_some_and(|one| one.is_enabled());
            self.statics.set_enabled(index, enabled);
        }
    }

    /// How many actors there are.
    pub fn len(&self) -> usize {
        self.actors.len()
    }

    /// Whether there is nobody.
    pub fn is_empty(&self) -> bool {
        self.actors.is_empty()
    }

    /// Everybody's id, rising.
    pub fn ids(&self) -> impl Iterator<Item = ActorId> + '_ {
        self.actors.iter().map(|a| ActorId(a.id))
    }

    /// Whose state the last step may have changed, by id.
    pub fn active(&self) -> &[u32] {
        &self.active
    }

    /// Who touched whom during the last frame, sorted by actor, then other, static boxes last.
    pub fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    /// Advances by one frame of `delta_nanos`, in the fewest equal substeps that are no longer than
    /// `substep_max_nanos`.
    pub fn step(&mut self, delta_nanos: u64, substep_max_nanos: u64) {
        self.step_observed(delta_nanos, substep_max_nanos, |_, _| {});
    }

    /// The same for one who looks: before the first substep with 0, and after each with its
    /// length in seconds.
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

        let before: Vec<Vec3> =
            self.actors.awake().map(|a| published_velocity_mps(self.body(a))).collect();
        let mut impulses = BTreeMap::new();
        let mut touching = BTreeSet::new();
        // Where nobody is, nothing moves.
        let steps = if self.actors.is_empty() { 0 } else { count };
        observe(self, 0.0);
        for _ in 0..steps {
            self.apply_forces(dt);
            self.world.step();
            self.collect_contacts(&mut impulses, &mut touching);
            observe(self, dt);
        }
        self.report_collisions(impulses, touching);

        let per_second = (1e9 / delta_nanos as f64) as f32;
        let Physics { world, actors, .. } = self;
        for (actor, before) in actors.awake_mut().zip(before) {
            let after = published_velocity_mps(&world.bodies[actor.body]);
            actor.acceleration_mps2 = (after - before) * per_second;
            actor.teleport.end_step();
            actor.external_force = Wrench::default();
        }
        // Who was run into stirs.
        for id in &self.colliding {
            if let Ok(index) = self.actors.binary_search_by_key(id, |a| a.id) {
                self.actors.wake(index);
            }
        }
        self.active.clear();
        self.active.extend(self.actors.awake().map(|a| a.id));
        self.put_to_sleep();
    }

    /// Lets those rest whom nothing moves and of whom the next step would tell the same.
    fn put_to_sleep(&mut self) {
        let Physics { world, actors, colliding, .. } = self;
        actors.sleep_where(|actor| {
            let body = &world.bodies[actor.body];
            let is_still = actor.kinematic
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
        self.actors.binary_search_by_key(&id.0, |a| a.id).map_err(|_| PhysicsError::Unknown(id))
    }

    pub(super) fn body(&self, actor: &Actor) -> &RigidBody {
        &self.world.bodies[actor.body]
    }

    /// Gives every body its force and torque for one substep, or its next place.
    fn apply_forces(&mut self, dt: f32) {
        let obstacles = self.obstacles();
        let Physics { world, ground, grip, statics, actors, .. } = self;
        let surface = Surface { ground, grip: *grip };
        for actor in actors.awake_mut() {
            if actor.kinematic {
                // Who rests is not touched: rapier goes through all that were.
                if actor.kinematic_velocity != Twist::ZERO {
                    integrate_kinematic(
                        &mut world.bodies[actor.body],
                        actor.kinematic_velocity,
                        dt,
                    );
                }
                continue;
            }
            let gravity = if actor.gravity_disabled { 0.0 } else { GRAVITY_MPS2 };
            let external = actor.external_force;
            if let Kind::Walker(walker) = &mut actor.kind {
                let model = walker.model;
                let feet = world.bodies[actor.body].translation();
                if !walker.has_fallen() && walker.is_knocked_down(feet, &obstacles, dt) {
                    let velocity = walker.desired_speed_mps.extend(walker.rise_mps.unwrap_or(0.0));
                    let own = (actor.body, actor.collider);
                    walker.limbs = Some(Limbs::create(world, own, &model, velocity));
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
                    let (feet, turn) = walker.substep(ground, &obstacles, feet, gravity, dt, free);
                    body.set_next_kinematic_position(Pose::from_parts(feet, turn));
                }
            }
        }
    }

    /// What walkers go round. Nothing where nobody walks.
    fn obstacles(&self) -> Vec<Obstacle> {
        let walks = |actor: &Actor| matches!(&actor.kind, Kind::Walker(w) if !w.has_fallen());
        if !self.actors.awake().any(walks) {
            return Vec::new();
        }
        let mut obstacles = Vec::new();
        for actor in self.actors.iter().filter(|actor| !actor.collisions_disabled) {
            let body = self.body(actor);
            let velocity_mps =
                if actor.kinematic { actor.kinematic_velocity.linear_mps } else { body.linvel() };
            let mut add = |center_m: Vec3, half_m: Vec3, turn: Quat| {
                obstacles.push(Obstacle {
                    center_m: body.position() * center_m,
                    axes: Mat3::from_quat(*body.rotation() * turn),
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
                Kind::Prop(p) => {
                    let half_m = p.model.half_extents_m;
                    add(Vec3::Z * half_m.z, half_m, Quat::IDENTITY);
                }
                Kind::Walker(_) => {}
            }
        }
        obstacles
    }

    /// The first that a shape would touch, actors by id but for one, then static boxes.
    pub(super) fn obstacle(
        &self,
        pose: &Pose,
        shape: &SharedShape,
        but: Option<u32>,
    ) -> Option<String> {
        let shape = shrunk(shape);
        let others =
            self.actors.iter().filter(|actor| !actor.collisions_disabled && Some(actor.id) != but);
        for actor in others {
            let body = self.body(actor);
            for collider in body.colliders() {
                let collider = &self.world.colliders[*collider];
                let local = collider.position_wrt_parent().copied().unwrap_or(Pose::IDENTITY);
                if touch(pose, &*shape, &(*body.position() * local), collider.shape()) {
                    return Some(ActorId(actor.id).to_string());
                }
            }
        }
        self.statics.touching(pose, &*shape).map(|index| self.statics.name(index).to_string())
    }

    /// Adds one substep's contact impulses.
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
            let who = |handle| self.world.colliders.get(handle).map(|c| c.user_data);
            let (Some(first), Some(second)) = (who(pair.collider1), who(pair.collider2)) else {
                continue;
            };
            // Floors of those who lie are nobody's.
            if first.min(second) == 0 {
                continue;
            }
            // The contact's normal points from the first to the second.
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
