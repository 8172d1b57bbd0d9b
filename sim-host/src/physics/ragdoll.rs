//! The ragdoll of a fallen walker: eleven bodies connected by joints with human limits.
//!
//! The space of every body is that of the standing walker, so that a limb without rotation lies
//! where the standing walker has it. The walker's own body is the hips. The ground is no collider
//! of the rigid-body world, and limbs that press on each other would sink into spring contacts: so
//! each limb has a floor of its own, a solid box below the surface that moves with it and supports
//! no other limb.

use glam::{Quat, Vec3};
use protocol::LIMBS;
use rapier3d::prelude::{
    ColliderBuilder, ColliderHandle, GenericJoint, Group, InteractionGroups, InteractionTestMode,
    JointAxis, MassProperties, PhysicsWorld, Pose, RevoluteJointBuilder, RigidBodyActivation,
    RigidBodyBuilder, RigidBodyHandle, RigidBodyType, SharedShape, SphericalJointBuilder,
};
use serde::{Deserialize, Serialize};

use super::{
    ground::{Ground, Hit},
    prop::PropModel,
    walker_model::WalkerModel,
};

/// Velocity damping of a joint, per second.
const JOINT_DAMPING_PER_S: f32 = 9.0;
/// Friction of a floor. With the 0.4 of a limb the mean is 0.6, clothes on asphalt.
const FLOOR_FRICTION: f32 = 0.8;
/// A body slower than this for half a second may sleep. Rapier evaluates the speed of the point of
/// the body's space that is farthest from it, some metres from the limb.
const REST_MPS: f32 = 0.5;
/// A ragdoll whose hips stay within this radius for this time may sleep, whatever its limbs do.
const REST_RADIUS_M: f32 = 0.2;
const SLEEP_AFTER_S: f32 = 1.5;
/// Smallest principal inertia of a limb, as a fraction of the largest.
const INERTIA_MIN_SHARE: f32 = 0.25;
/// Angular damping by air and clothes.
const SPIN_DAMPING_PER_S: f32 = 0.4;
/// Half the edges of a floor, and the distance a limb moves until its floor follows.
const FLOOR_HALF_M: Vec3 = Vec3::new(0.9, 0.9, 0.5);
const FLOOR_REACH_M: f32 = 0.4;

const FLOOR: Group = Group::GROUP_2;
/// Bit of the first part's group; those of the other parts follow.
const PART: u32 = 8;

fn group(part: usize) -> Group {
    Group::from_bits_retain(1 << (PART + part as u32))
}

/// Groups of a limb: it collides with everything except limbs and the floors of others.
fn limb_groups(part: usize, is_solid: bool) -> InteractionGroups {
    let others = if is_solid { Group::GROUP_1 } else { Group::NONE };
    InteractionGroups::new(group(part), others | FLOOR, InteractionTestMode::And)
}

fn floor_groups(part: usize) -> InteractionGroups {
    InteractionGroups::new(FLOOR, group(part), InteractionTestMode::And)
}

/// The bodies of a fallen walker except the hips.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Limbs {
    /// Bodies in the order of [`protocol::WalkerLimbs`].
    pub bodies: [RigidBodyHandle; LIMBS],
    /// Floors of the parts, the hips first.
    floors: [ColliderHandle; LIMBS + 1],
    /// Position at which the hips came to rest, and the time since.
    rest_position_m: Vec3,
    rest_time_s: f32,
    /// Simulated time since the fall, up to the end of the last frame.
    pub fallen_nanos: u64,
}

/// One part of the body. Lengths are fractions of the height, (forward, left, up) from between the
/// feet.
struct Part {
    /// Index of the part that carries this one.
    carrier: usize,
    /// Position of the joint.
    joint: [f32; 3],
    middle: [f32; 3],
    half: [f32; 3],
    /// Fraction of the whole mass.
    mass: f32,
    kind: JointKind,
}

/// How a part rotates relative to its carrier. Radians.
#[derive(Clone, Copy)]
enum JointKind {
    /// The first part has no carrier.
    Root,
    Ball(Ball),
    /// About y: lower and upper limit.
    Hinge([f32; 2]),
}

use JointKind::{Hinge, Root};

/// Angles are measured from the middle of the range, because those about three axes are not defined
/// near half a revolution.
#[derive(Clone, Copy)]
struct Ball {
    /// Middle of the range: about x, then about y.
    middle: [f32; 2],
    /// Limits to either side of the middle, about x, y and z.
    reach: [f32; 3],
}

const SPINE: JointKind = JointKind::Ball(Ball { middle: [0.0, 0.25], reach: [0.35, 0.55, 0.4] });
const NECK: JointKind = JointKind::Ball(Ball { middle: [0.0, 0.1], reach: [0.5, 0.6, 0.8] });
const ARM: Ball = Ball { middle: [0.75, -0.7], reach: [1.05, 1.3, 0.9] };
const THIGH: Ball = Ball { middle: [0.25, -0.7], reach: [0.5, 1.0, 0.5] };

/// Returns the left joint of a pair.
const fn left(ball: Ball) -> JointKind {
    JointKind::Ball(ball)
}

/// Returns the right joint of a pair.
const fn right(Ball { middle: [x, y], reach }: Ball) -> JointKind {
    JointKind::Ball(Ball { middle: [-x, y], reach })
}

/// Mass fractions after Winter, Biomechanics and Motor Control of Human Movement, 4th ed., table
/// 4.1; joints as in [`town::Skeleton`].
#[rustfmt::skip]
const PARTS: [Part; LIMBS + 1] = [
    Part { carrier: 0, joint: [0.0, 0.0, 0.530], middle: [0.0, 0.0, 0.535], half: [0.055, 0.085, 0.055], mass: 0.15, kind: Root },
    Part { carrier: 0, joint: [0.0, 0.0, 0.580], middle: [0.0, 0.0, 0.705], half: [0.058, 0.095, 0.125], mass: 0.32, kind: SPINE },
    Part { carrier: 1, joint: [0.0, 0.0, 0.840], middle: [0.01, 0.0, 0.925], half: [0.050, 0.042, 0.070], mass: 0.08, kind: NECK },
    Part { carrier: 1, joint: [0.0, 0.108, 0.808], middle: [-0.002, 0.118, 0.722], half: [0.026, 0.026, 0.100], mass: 0.028, kind: left(ARM) },
    Part { carrier: 3, joint: [-0.004, 0.128, 0.635], middle: [0.006, 0.135, 0.530], half: [0.020, 0.018, 0.115], mass: 0.022, kind: Hinge([-2.4, 0.0]) },
    Part { carrier: 1, joint: [0.0, -0.108, 0.808], middle: [-0.002, -0.118, 0.722], half: [0.026, 0.026, 0.100], mass: 0.028, kind: right(ARM) },
    Part { carrier: 5, joint: [-0.004, -0.128, 0.635], middle: [0.006, -0.135, 0.530], half: [0.020, 0.018, 0.115], mass: 0.022, kind: Hinge([-2.4, 0.0]) },
    Part { carrier: 0, joint: [0.0, 0.052, 0.510], middle: [0.003, 0.052, 0.400], half: [0.044, 0.042, 0.125], mass: 0.10, kind: left(THIGH) },
    Part { carrier: 7, joint: [0.006, 0.052, 0.285], middle: [0.010, 0.052, 0.145], half: [0.034, 0.030, 0.145], mass: 0.075, kind: Hinge([0.0, 2.3]) },
    Part { carrier: 0, joint: [0.0, -0.052, 0.510], middle: [0.003, -0.052, 0.400], half: [0.044, 0.042, 0.125], mass: 0.10, kind: right(THIGH) },
    Part { carrier: 9, joint: [0.006, -0.052, 0.285], middle: [0.010, -0.052, 0.145], half: [0.034, 0.030, 0.145], mass: 0.075, kind: Hinge([0.0, 2.3]) },
];

impl Part {
    fn model(&self, walker: &WalkerModel) -> PropModel {
        PropModel {
            half_extents_m: Vec3::from_array(self.half) * walker.height_m,
            mass_kg: self.mass * walker.mass_kg,
            is_passable: false,
            is_released_on_hit: false,
        }
    }

    fn middle_m(&self, walker: &WalkerModel) -> Vec3 {
        Vec3::from_array(self.middle) * walker.height_m
    }

    fn mass(&self, walker: &WalkerModel) -> MassProperties {
        let model = self.model(walker);
        let inertia = model.inertia_kgm2();
        // Thin limbs with a small inertia about their own axis would not come to rest.
        let inertia = inertia.max(Vec3::splat(INERTIA_MIN_SHARE * inertia.max_element()));
        MassProperties::new(self.middle_m(walker), model.mass_kg, inertia)
    }

    /// Returns the shape of a part. Long parts are capsules, the others boxes.
    fn shape(&self, walker: &WalkerModel) -> SharedShape {
        let half = self.model(walker).half_extents_m;
        let radius = 0.5 * (half.x + half.y);
        if half.z > 1.5 * half.y {
            SharedShape::capsule_z((half.z - radius).max(0.01), radius)
        } else {
            SharedShape::cuboid(half.x, half.y, half.z)
        }
    }

    fn joint(&self, walker: &WalkerModel) -> GenericJoint {
        let at_m = Vec3::from_array(self.joint) * walker.height_m;
        match self.kind {
            Hinge(limits) => RevoluteJointBuilder::new(Vec3::Y)
                .local_anchor1(at_m)
                .local_anchor2(at_m)
                .contacts_enabled(false)
                .limits(limits)
                .motor_velocity(0.0, JOINT_DAMPING_PER_S)
                .into(),
            JointKind::Ball(Ball { middle: [x, y], reach }) => {
                let middle = Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
                let mut joint = SphericalJointBuilder::new()
                    .local_frame1(Pose::from_parts(at_m, middle))
                    .local_anchor2(at_m)
                    .contacts_enabled(false);
                let axes = [JointAxis::AngX, JointAxis::AngY, JointAxis::AngZ];
                for (axis, reach) in axes.into_iter().zip(reach) {
                    joint = joint.limits(axis, [-reach, reach]);
                    joint = joint.motor_velocity(axis, 0.0, JOINT_DAMPING_PER_S);
                }
                joint.into()
            }
            Root => SphericalJointBuilder::new().into(),
        }
    }
}

/// The sleeping thresholds of limbs.
fn activation() -> RigidBodyActivation {
    let mut activation = RigidBodyActivation::active();
    activation.normalized_linear_threshold = REST_MPS;
    activation
}

/// Returns the pose of a floor below the ground that a query found.
fn floor_pose(x: f32, y: f32, hit: &Hit) -> Pose {
    let turn = Quat::from_rotation_arc(Vec3::Z, hit.normal);
    let top = Vec3::new(x, y, hit.height_m);
    Pose::from_parts(top - hit.normal * FLOOR_HALF_M.z, turn)
}

impl Limbs {
    /// Turns a walker's body into the hips and attaches the other parts to it. All of them continue
    /// with the walker's velocity.
    pub(super) fn create(
        world: &mut PhysicsWorld,
        (body, collider): (RigidBodyHandle, ColliderHandle),
        model: &WalkerModel,
        velocity_mps: Vec3,
    ) -> Limbs {
        let place = *world.bodies[body].position();
        let (user_data, is_solid) = {
            let collider = &mut world.colliders[collider];
            let is_solid = collider.is_enabled();
            collider.set_shape(PARTS[0].shape(model));
            collider.set_position_wrt_parent(Pose::from_translation(PARTS[0].middle_m(model)));
            collider.set_collision_groups(limb_groups(0, is_solid));
            collider.set_enabled(true);
            (collider.user_data, is_solid)
        };
        let hips = &mut world.bodies[body];
        let gravity_scale = hips.gravity_scale();
        hips.set_body_type(RigidBodyType::Dynamic, true);
        hips.set_additional_mass_properties(PARTS[0].mass(model), true);
        hips.set_angular_damping(SPIN_DAMPING_PER_S);
        hips.recompute_mass_properties_from_colliders(&world.colliders);
        hips.set_linvel(velocity_mps, true);
        hips.set_angvel(Vec3::ZERO, true);
        *hips.activation_mut() = activation();

        let mut bodies = [body; LIMBS + 1];
        for (index, part) in PARTS.iter().enumerate().skip(1) {
            let limb = RigidBodyBuilder::dynamic()
                .pose(place)
                .additional_mass_properties(part.mass(model))
                .angular_damping(SPIN_DAMPING_PER_S)
                .gravity_scale(gravity_scale)
                .linvel(velocity_mps);
            let collider = ColliderBuilder::new(part.shape(model))
                .position(Pose::from_translation(part.middle_m(model)))
                .density(0.0)
                .friction(0.4)
                .collision_groups(limb_groups(index, is_solid))
                .user_data(user_data);
            let (limb, _) = world.insert(limb, collider);
            let PhysicsWorld { bodies: all, colliders, .. } = world;
            all[limb].recompute_mass_properties_from_colliders(colliders);
            *all[limb].activation_mut() = activation();
            world.insert_impulse_joint(bodies[part.carrier], limb, part.joint(model));
            bodies[index] = limb;
        }
        let mut limbs = [body; LIMBS];
        limbs.copy_from_slice(&bodies[1..]);
        // Floors start far below; each moves up in the first substep.
        let floors = std::array::from_fn(|part| {
            let floor = SharedShape::cuboid(FLOOR_HALF_M.x, FLOOR_HALF_M.y, FLOOR_HALF_M.z);
            let collider = ColliderBuilder::new(floor)
                .position(Pose::from_translation(place.translation - Vec3::Z * 1e3))
                .friction(FLOOR_FRICTION)
                .collision_groups(floor_groups(part));
            world.insert_collider(collider, None)
        });
        Limbs {
            bodies: limbs,
            floors,
            rest_position_m: place.translation,
            rest_time_s: 0.0,
            fallen_nanos: 0,
        }
    }

    /// Moves floors below their limbs; called before a substep of `dt` seconds. The floors of
    /// sleeping limbs stay.
    pub(super) fn update_floors(
        &mut self,
        world: &mut PhysicsWorld,
        ground: &Ground,
        hips: RigidBodyHandle,
        dt: f32,
    ) {
        self.update_sleep(world, hips, dt);
        for (handle, floor) in std::iter::once(&hips).chain(&self.bodies).zip(self.floors) {
            let body = &world.bodies[*handle];
            if body.is_sleeping() {
                continue;
            }
            let at = body.center_of_mass();
            let hit = ground.below(at.x, at.y, at.z + 0.3);
            let now = *world.colliders[floor].position();
            let target = floor_pose(at.x, at.y, &hit);
            // Moving a floor wakes the limb on it.
            let tilt_or_height_changed = (now.rotation * Vec3::Z).distance(hit.normal) > 1e-3
                || (target.translation - now.translation).dot(hit.normal).abs() > 1e-3;
            let away = (target.translation - now.translation).truncate().length();
            if tilt_or_height_changed || away > FLOOR_REACH_M {
                world.colliders[floor].set_position(target);
            }
        }
    }

    /// Overlapping limbs may jitter for a long time: a ragdoll that has been at rest for a while
    /// may sleep nevertheless.
    fn update_sleep(&mut self, world: &mut PhysicsWorld, hips: RigidBodyHandle, dt: f32) {
        let body = &world.bodies[hips];
        if body.is_sleeping() {
            return;
        }
        let may_sleep = |limbs: &Limbs| limbs.rest_time_s > SLEEP_AFTER_S;
        let could_sleep = may_sleep(self);
        let at = body.center_of_mass();
        if at.distance(self.rest_position_m) < REST_RADIUS_M {
            self.rest_time_s += dt;
        } else {
            (self.rest_position_m, self.rest_time_s) = (at, 0.0);
        }
        if may_sleep(self) != could_sleep {
            let time_until_sleep_s =
                if may_sleep(self) { 0.0 } else { activation().time_until_sleep };
            for handle in std::iter::once(hips).chain(self.bodies) {
                world.bodies[handle].activation_mut().time_until_sleep = time_until_sleep_s;
            }
        }
    }

    /// Selects whether the limbs collide with other bodies.
    pub(super) fn set_collisions(&self, world: &mut PhysicsWorld, hips: RigidBodyHandle, on: bool) {
        for (part, handle) in std::iter::once(&hips).chain(&self.bodies).enumerate() {
            for collider in world.bodies[*handle].colliders().to_vec() {
                world.colliders[collider].set_collision_groups(limb_groups(part, on));
            }
        }
    }

    /// Returns the rotation of each limb relative to its carrier.
    pub(super) fn joint_rotations(
        &self,
        world: &PhysicsWorld,
        hips: RigidBodyHandle,
    ) -> [Quat; LIMBS] {
        let turn = |part: usize| {
            let handle = if part == 0 { hips } else { self.bodies[part - 1] };
            *world.bodies[handle].rotation()
        };
        std::array::from_fn(|limb| turn(PARTS[limb + 1].carrier).inverse() * turn(limb + 1))
    }

    /// Moves all limbs with the hips from one pose to another, at rest, with unchanged joint
    /// angles.
    pub(super) fn teleport(&self, world: &mut PhysicsWorld, from: &Pose, to: &Pose) {
        let moved = *to * from.inverse();
        for handle in self.bodies {
            let body = &mut world.bodies[handle];
            body.set_position(moved * *body.position(), true);
            body.set_linvel(Vec3::ZERO, true);
            body.set_angvel(Vec3::ZERO, true);
        }
    }

    /// Removes the limbs and floors from the world.
    pub(super) fn remove(&self, world: &mut PhysicsWorld) {
        for handle in self.bodies {
            world.remove_body(handle);
        }
        for floor in self.floors {
            world.remove_collider(floor);
        }
    }
}
