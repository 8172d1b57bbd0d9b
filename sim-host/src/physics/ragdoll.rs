//! One who fell: eleven bodies that hang together by joints, each with the limits of a human's.
//!
//! Every body's space is the actor's as it stood, so that a limb that has not turned lies where the
//! standing one has it. The walker's own body is the hips. The ground is no collider of the world
//! of bodies, and limbs that press on each other would sink into springs: so each has a floor of
//! its own, a solid box that goes with it below the surface and carries nobody else.

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

/// How fast a joint that is left alone stops turning, per second: flesh is no bearing.
const JOINT_DAMPING_PER_S: f32 = 9.0;
/// Clothes on asphalt, with a limb's own 0.4: a mean of 0.6.
const FLOOR_FRICTION: f32 = 0.8;
/// Who moves no faster than this for half a second has come to rest: by the point of each limb's
/// space that is farthest off, some metres from the limb.
const REST_MPS: f32 = 0.5;
/// Whose hips have stayed so near for so long lies, however limbs twitch.
const REST_RADIUS_M: f32 = 0.2;
const SLEEP_AFTER_S: f32 = 1.5;
/// The least of a limb's inertias, as a share of the largest.
const INERTIA_MIN_SHARE: f32 = 0.25;
/// What air and clothes take.
const SPIN_DAMPING_PER_S: f32 = 0.4;
/// Half the edges of a floor, and how far a limb goes until its floor follows.
const FLOOR_HALF_M: Vec3 = Vec3::new(0.9, 0.9, 0.5);
const FLOOR_REACH_M: f32 = 0.4;

const FLOOR: Group = Group::GROUP_2;
/// The first part's; the others' follow.
const PART: u32 = 8;

fn group(part: usize) -> Group {
    Group::from_bits_retain(1 << (PART + part as u32))
}

/// A limb runs into everything but limbs and the floors of others.
fn limb_groups(part: usize, is_solid: bool) -> InteractionGroups {
    let others = if is_solid { Group::GROUP_1 } else { Group::NONE };
    InteractionGroups::new(group(part), others | FLOOR, InteractionTestMode::And)
}

fn floor_groups(part: usize) -> InteractionGroups {
    InteractionGroups::new(FLOOR, group(part), InteractionTestMode::And)
}

/// The bodies of one who fell, but for the hips.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Limbs {
    /// In the order of [`protocol::ActorState::limbs`].
    pub bodies: [RigidBodyHandle; LIMBS],
    /// What each of them stands on, the hips first.
    floors: [ColliderHandle; LIMBS + 1],
    /// Where the hips have been for a while, and for how long.
    rest_position_m: Vec3,
    rest_time_s: f32,
}

/// One body: lengths in shares of the height, (forward, left, up) from between the feet.
struct Part {
    /// Which of the parts carries it.
    carrier: usize,
    /// What it turns about.
    joint: [f32; 3],
    middle: [f32; 3],
    half: [f32; 3],
    /// Of the whole mass.
    mass: f32,
    kind: JointKind,
}

/// How far a part turns against its carrier. Radians.
#[derive(Clone, Copy)]
enum JointKind {
    /// The first of all is carried by nobody.
    Root,
    Ball(Ball),
    /// About y: least and most.
    Hinge([f32; 2]),
}

use JointKind::{Hinge, Root};

/// Measured from the middle of its range, for the angles about three axes are none where they come
/// near to half a turn.
#[derive(Clone, Copy)]
struct Ball {
    /// The middle: about x, then about y.
    middle: [f32; 2],
    /// From there, either way, about x, y and z.
    reach: [f32; 3],
}

const SPINE: JointKind = JointKind::Ball(Ball { middle: [0.0, 0.25], reach: [0.35, 0.55, 0.4] });
const NECK: JointKind = JointKind::Ball(Ball { middle: [0.0, 0.1], reach: [0.5, 0.6, 0.8] });
const ARM: Ball = Ball { middle: [0.75, -0.7], reach: [1.05, 1.3, 0.9] };
const THIGH: Ball = Ball { middle: [0.25, -0.7], reach: [0.5, 1.0, 0.5] };

/// The left one of a pair.
const fn left(ball: Ball) -> JointKind {
    JointKind::Ball(ball)
}

/// The right one.
const fn right(Ball { middle: [x, y], reach }: Ball) -> JointKind {
    JointKind::Ball(Ball { middle: [-x, y], reach })
}

/// Masses after Winter, Biomechanics and Motor Control of Human Movement, 4th ed., table 4.1;
/// joints as [`town::Skeleton`] has them.
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
        }
    }

    fn middle_m(&self, walker: &WalkerModel) -> Vec3 {
        Vec3::from_array(self.middle) * walker.height_m
    }

    fn mass(&self, walker: &WalkerModel) -> MassProperties {
        let model = self.model(walker);
        let inertia = model.inertia_kgm2();
        // Thin limbs that may spin about themselves never come to rest.
        let inertia = inertia.max(Vec3::splat(INERTIA_MIN_SHARE * inertia.max_element()));
        MassProperties::new(self.middle_m(walker), model.mass_kg, inertia)
    }

    /// Long parts are round at their ends.
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

/// They sleep when nothing of them has moved for a while.
fn activation() -> RigidBodyActivation {
    let mut activation = RigidBodyActivation::active();
    activation.normalized_linear_threshold = REST_MPS;
    activation
}

/// Where a floor's box lies below the ground that was found.
fn floor_pose(x: f32, y: f32, hit: &Hit) -> Pose {
    let turn = Quat::from_rotation_arc(Vec3::Z, hit.normal);
    let top = Vec3::new(x, y, hit.height_m);
    Pose::from_parts(top - hit.normal * FLOOR_HALF_M.z, turn)
}

impl Limbs {
    /// A walker's own body becomes its hips, and the other parts come to hang on them. They move on
    /// as it did.
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
        // Deep below: each comes up with the first substep.
        let floors = std::array::from_fn(|part| {
            let floor = SharedShape::cuboid(FLOOR_HALF_M.x, FLOOR_HALF_M.y, FLOOR_HALF_M.z);
            let collider = ColliderBuilder::new(floor)
                .position(Pose::from_translation(place.translation - Vec3::Z * 1e3))
                .friction(FLOOR_FRICTION)
                .collision_groups(floor_groups(part));
            world.insert_collider(collider, None)
        });
        Limbs { bodies: limbs, floors, rest_position_m: place.translation, rest_time_s: 0.0 }
    }

    /// Before a substep of `dt` seconds: floors follow their limbs. Who sleeps is not touched.
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
            // To move a floor is to wake who lies on it.
            let tilt_or_height_changed = (now.rotation * Vec3::Z).distance(hit.normal) > 1e-3
                || (target.translation - now.translation).dot(hit.normal).abs() > 1e-3;
            let away = (target.translation - now.translation).truncate().length();
            if tilt_or_height_changed || away > FLOOR_REACH_M {
                world.colliders[floor].set_position(target);
            }
        }
    }

    /// Limbs that lie in each other's way may twitch for long: who has lain for a while may sleep
    /// in spite of it.
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

    /// Whether they run into others.
    pub(super) fn set_collisions(&self, world: &mut PhysicsWorld, hips: RigidBodyHandle, on: bool) {
        for (part, handle) in std::iter::once(&hips).chain(&self.bodies).enumerate() {
            for collider in world.bodies[*handle].colliders().to_vec() {
                world.colliders[collider].set_collision_groups(limb_groups(part, on));
            }
        }
    }

    /// How each is turned against what carries it.
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

    /// Puts all of them where the hips are put, held as they are, at rest.
    pub(super) fn teleport(&self, world: &mut PhysicsWorld, from: &Pose, to: &Pose) {
        let moved = *to * from.inverse();
        for handle in self.bodies {
            let body = &mut world.bodies[handle];
            body.set_position(moved * *body.position(), true);
            body.set_linvel(Vec3::ZERO, true);
            body.set_angvel(Vec3::ZERO, true);
        }
    }

    /// Takes them out of the world.
    pub(super) fn remove(&self, world: &mut PhysicsWorld) {
        for handle in self.bodies {
            world.remove_body(handle);
        }
        for floor in self.floors {
            world.remove_collider(floor);
        }
    }
}
