//! Coming, going, and what can be asked of an actor in between.

use std::sync::Arc;

use glam::{Mat3, Quat, Vec2, Vec3};
use protocol::{ActorId, Pose, VehicleControl};
use rapier3d::prelude::{
    ColliderBuilder, MassProperties, PhysicsWorld, Pose as BodyPose, RigidBodyBuilder,
    RigidBodyType, SharedShape,
};
use serde::{Deserialize, Serialize};

use super::error::PhysicsError;
use super::model::VehicleModel;
use super::overlap::{shrunk, touch};
use super::ragdoll::SOLID;
use super::vehicle::{Pedals, Prepared, Vehicle};
use super::walker::{Walker, WalkerModel};
use super::world::{Actor, Kind, Physics};

/// A vehicle that is spawned no higher above the road than this is set onto it.
const SNAP_M: f32 = 1.0;
/// f32 keeps half a centimetre out to here.
const WORLD_MAX_M: f32 = 50_000.0;
/// Rapier's own limit.
const SPEED_MAX_MPS: f32 = 400.0;
const SPIN_MAX_RADPS: f32 = 100.0;

/// A thing that stands about: a box, its origin in the middle of its base.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PropModel {
    /// Half the edges.
    pub half_extents_m: Vec3,
    /// Evenly spread.
    pub mass_kg: f32,
}

impl PropModel {
    pub(super) fn inertia_kgm2(&self) -> Vec3 {
        let square = self.half_extents_m * self.half_extents_m;
        Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y)
            * (self.mass_kg / 3.0)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Prop {
    pub model: PropModel,
}

impl Physics {
    /// Puts a vehicle into the world, at rest. If it is upright and at most 1 m above the road, it
    /// is set onto it. Returns where it stands now.
    pub fn spawn_vehicle(
        &mut self,
        id: ActorId,
        model: &Arc<VehicleModel>,
        pose: &Pose,
        kinematic: bool,
    ) -> Result<Pose, PhysicsError> {
        self.check_new(id, pose)?;
        let half = model.box_half_m;
        let pose = self.snapped(model, pose);
        let mass = MassProperties::new(model.com_m, model.mass_kg, model.inertia_kgm2);
        let prepared = self.prepared(model);
        let kind = Kind::Vehicle(Vehicle::new(prepared));
        let shape = SharedShape::cuboid(half.x, half.y, half.z);
        self.insert(id, kind, shape, model.box_center_m, mass, &pose, kinematic)?;
        Ok(pose)
    }

    /// Puts a walker into the world, standing. The pose's origin is between its feet.
    pub fn spawn_walker(
        &mut self,
        id: ActorId,
        model: WalkerModel,
        pose: &Pose,
    ) -> Result<Pose, PhysicsError> {
        self.check_new(id, pose)?;
        let mut feet = pose.position();
        let hit = self.ground.below(feet.x, feet.y, feet.z + 0.5);
        if feet.z - hit.height_m <= SNAP_M {
            feet.z = hit.height_m;
        }
        let ahead = pose.rotation() * Vec3::X;
        let yaw_rad = ahead.y.atan2(ahead.x);
        let pose = Pose::level(feet, yaw_rad);
        let walker = Walker::new(model, yaw_rad);
        let shape = SharedShape::capsule_z(model.half_segment_m(), model.radius_m);
        let middle = model.middle_m();
        let mass = MassProperties::new(middle, model.mass_kg, model.inertia_kgm2());
        self.insert(id, Kind::Walker(walker), shape, middle, mass, &pose, false)?;
        Ok(pose)
    }

    /// Puts a box into the world. The pose's origin is in the middle of its base.
    pub fn spawn_prop(
        &mut self,
        id: ActorId,
        model: PropModel,
        pose: &Pose,
        kinematic: bool,
    ) -> Result<Pose, PhysicsError> {
        self.check_new(id, pose)?;
        let half = model.half_extents_m;
        let middle = Vec3::Z * half.z;
        let mass = MassProperties::new(middle, model.mass_kg, model.inertia_kgm2());
        let shape = SharedShape::cuboid(half.x, half.y, half.z);
        self.insert(id, Kind::Prop(Prop { model }), shape, middle, mass, pose, kinematic)?;
        Ok(*pose)
    }

    /// Takes an actor out of the world.
    pub fn destroy(&mut self, id: ActorId) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.remove(index);
        if let Kind::Walker(Walker { limbs: Some(limbs), .. }) = &actor.kind {
            limbs.remove(&mut self.world);
        }
        self.world.remove_body(actor.body);
        self.touching.retain(|pair| pair.0 != id.0 && pair.1 != super::world::Touched::Actor(id.0));
        self.collisions.retain(|c| c.actor != id && c.other != id);
        self.colliding.retain(|other| *other != id.0);
        Ok(())
    }

    /// Puts an actor elsewhere, at rest. Whoever stands there is pushed away.
    pub fn teleport(&mut self, id: ActorId, pose: &Pose) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        check_pose(id, pose)?;
        let actor = self.actors.wake(index);
        actor.teleported.0 = true;
        actor.glide = (Vec3::ZERO, Vec3::ZERO);
        match &mut actor.kind {
            Kind::Vehicle(vehicle) => vehicle.rest(),
            Kind::Walker(walker) => {
                let ahead = pose.rotation() * Vec3::X;
                walker.yaw_rad = ahead.y.atan2(ahead.x);
                walker.rise_mps = None;
                if let Some(limbs) = &walker.limbs {
                    let from = *self.world.bodies[actor.body].position();
                    limbs.follow(&mut self.world, &from, &body_pose(pose));
                }
            }
            Kind::Prop(_) => {}
        }
        let body = &mut self.world.bodies[actor.body];
        body.set_position(body_pose(pose), true);
        body.set_linvel(Vec3::ZERO, true);
        body.set_angvel(Vec3::ZERO, true);
        Ok(())
    }

    /// Changes an actor's velocity, of its origin, and its spin; both in world space.
    pub fn set_velocity(
        &mut self,
        id: ActorId,
        velocity_mps: Vec3,
        spin_radps: Vec3,
    ) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        check_length(id, "velocity", velocity_mps, SPEED_MAX_MPS, "not finite, or above 400 m/s")?;
        check_length(
            id,
            "angular velocity",
            spin_radps,
            SPIN_MAX_RADPS,
            "not finite, or above 100 rad/s",
        )?;
        let actor = self.actors.wake(index);
        if matches!(&actor.kind, Kind::Walker(walker) if walker.is_down()) {
            return Err(PhysicsError::Refused(id, "it lies on the ground".to_owned()));
        }
        let body = &mut self.world.bodies[actor.body];
        if actor.kinematic {
            actor.glide = (velocity_mps, spin_radps);
            return Ok(());
        }
        if let Kind::Walker(walker) = &mut actor.kind {
            walker.desired_speed_mps = velocity_mps.truncate();
            return Ok(());
        }
        let arm = body.center_of_mass() - body.translation();
        body.set_linvel(velocity_mps + spin_radps.cross(arm), true);
        body.set_angvel(spin_radps, true);
        if let Kind::Vehicle(vehicle) = &mut actor.kind {
            vehicle.roll_at(velocity_mps.dot(*body.rotation() * Vec3::X));
        }
        Ok(())
    }

    /// Whether physics moves an actor, or teleports and set velocities alone. It comes to rest.
    pub fn set_kinematic(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
        if actor.kinematic == on {
            return Ok(());
        }
        actor.kinematic = on;
        actor.glide = (Vec3::ZERO, Vec3::ZERO);
        match &mut actor.kind {
            // A walker's body goes where its feet go, either way.
            Kind::Walker(walker) if !walker.is_down() => {
                walker.desired_speed_mps = Vec2::ZERO;
                return Ok(());
            }
            Kind::Vehicle(vehicle) => vehicle.rest(),
            Kind::Walker(_) | Kind::Prop(_) => {}
        }
        let body_type =
            if on { RigidBodyType::KinematicPositionBased } else { RigidBodyType::Dynamic };
        for body in actor.bodies() {
            let body = &mut self.world.bodies[body];
            body.set_body_type(body_type, true);
            body.set_linvel(Vec3::ZERO, true);
            body.set_angvel(Vec3::ZERO, true);
        }
        Ok(())
    }

    /// Sets a vehicle's pedals and wheel; the latest holds. Values are cut to their ranges.
    pub fn control(&mut self, control: &VehicleControl) -> Result<(), PhysicsError> {
        let vehicle = self.vehicle_mut(control.actor_id)?;
        vehicle.state.control = Pedals::new(control);
        if let Some(controller) = &mut vehicle.state.ackermann {
            controller.let_go();
        }
        Ok(())
    }

    /// Tells a walker where to go: metres per second over ground, in world space.
    pub fn walk(&mut self, id: ActorId, velocity_mps: Vec2) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        check_length(
            id,
            "velocity",
            velocity_mps.extend(0.0),
            20.0,
            "not finite, or above 20 m/s",
        )?;
        let Kind::Walker(walker) = &mut self.actors.wake(index).kind else {
            return Err(PhysicsError::WrongKind(id, "walker"));
        };
        if walker.is_down() {
            return Err(PhysicsError::Refused(id, "it lies on the ground".to_owned()));
        }
        walker.desired_speed_mps = velocity_mps;
        Ok(())
    }

    /// Lets a walker jump, if it stands on the ground.
    pub fn jump(&mut self, id: ActorId) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let Kind::Walker(walker) = &mut self.actors.wake(index).kind else {
            return Err(PhysicsError::WrongKind(id, "walker"));
        };
        if walker.is_down() {
            return Err(PhysicsError::Refused(id, "it lies on the ground".to_owned()));
        }
        walker.jump();
        Ok(())
    }

    pub(super) fn find(&self, id: ActorId) -> Result<usize, PhysicsError> {
        self.actors.binary_search_by_key(&id.0, |a| a.id).map_err(|_| PhysicsError::Unknown(id))
    }

    fn check_new(&self, id: ActorId, pose: &Pose) -> Result<(), PhysicsError> {
        check_pose(id, pose)?;
        if self.find(id).is_ok() || id == ActorId::NONE {
            return Err(PhysicsError::Taken(id));
        }
        Ok(())
    }

    /// Vehicles of one model share what is computed from it, also with those that were restored.
    fn prepared(&self, model: &Arc<VehicleModel>) -> Arc<Prepared> {
        let known = self.actors.iter().find_map(|actor| match &actor.kind {
            Kind::Vehicle(v)
                if Arc::ptr_eq(&v.prepared.model, model) || v.prepared.model == *model =>
            {
                Some(&v.prepared)
            }
            _ => None,
        });
        known.map_or_else(|| Arc::new(Prepared::new(Arc::clone(model))), Arc::clone)
    }

    /// The first that a shape would touch, actors by id but for one, then static boxes.
    pub(super) fn obstacle(
        &self,
        pose: &BodyPose,
        shape: &SharedShape,
        but: Option<u32>,
    ) -> Option<String> {
        let shape = shrunk(shape);
        let others = self.actors.iter().filter(|actor| !actor.is_ghost && Some(actor.id) != but);
        for actor in others {
            let body = self.body(actor);
            for collider in body.colliders() {
                let collider = &self.world.colliders[*collider];
                let local = collider.position_wrt_parent().copied().unwrap_or(BodyPose::IDENTITY);
                if touch(pose, &*shape, &(*body.position() * local), collider.shape()) {
                    return Some(ActorId(actor.id).to_string());
                }
            }
        }
        self.statics.touching(pose, &*shape).map(|index| self.statics.name(index).to_string())
    }

    #[expect(clippy::too_many_arguments, reason = "one call site for each kind of actor")]
    fn insert(
        &mut self,
        id: ActorId,
        kind: Kind,
        shape: SharedShape,
        middle_m: Vec3,
        mass: MassProperties,
        pose: &Pose,
        kinematic: bool,
    ) -> Result<(), PhysicsError> {
        let pose = body_pose(pose);
        let local = BodyPose::from_translation(middle_m);
        if let Some(obstacle) = self.obstacle(&(pose * local), &shape, None) {
            return Err(PhysicsError::Blocked { actor: id, obstacle });
        }
        let still = kinematic || matches!(kind, Kind::Walker(_));
        let body = if still {
            RigidBodyBuilder::kinematic_position_based()
        } else {
            RigidBodyBuilder::dynamic()
        };
        let body = body.pose(pose).additional_mass_properties(mass).can_sleep(false);
        let collider = ColliderBuilder::new(shape)
            .position(local)
            .density(0.0)
            .friction(0.4)
            .collision_groups(SOLID)
            .user_data(u128::from(id.0));
        let (body, collider) = self.world.insert(body, collider);
        // Its centre of mass counts from the first substep on.
        let PhysicsWorld { bodies, colliders, .. } = &mut self.world;
        bodies[body].recompute_mass_properties_from_colliders(colliders);
        let actor = Actor {
            id: id.0,
            body,
            collider,
            kinematic,
            kind,
            glide: (Vec3::ZERO, Vec3::ZERO),
            acceleration_mps2: Vec3::ZERO,
            is_weightless: false,
            is_ghost: false,
            pushed: (Vec3::ZERO, Vec3::ZERO),
            teleported: (false, false),
        };
        self.actors.insert(actor);
        Ok(())
    }

    /// The pose with all wheels on the ground, if they are near it.
    fn snapped(&self, model: &VehicleModel, pose: &Pose) -> Pose {
        let (position, rotation) = (pose.position(), pose.rotation());
        if (rotation * Vec3::Z).z < 0.7 || model.wheels.is_empty() {
            return *pose;
        }
        let origin = self.ground.below(position.x, position.y, position.z + 0.5);
        if !origin.on_map || position.z - origin.height_m > SNAP_M {
            return *pose;
        }
        // A plane through the ground below the wheels: their mean height and slopes along both axes.
        let ahead = (rotation * Vec3::X).with_z(0.0).normalize_or(Vec3::X);
        let left = Vec3::Z.cross(ahead);
        let feet: Vec<(Vec2, f32)> = model
            .wheels
            .iter()
            .map(|wheel| {
                let at = Vec2::new(wheel.hub_m.x, wheel.hub_m.y);
                let foot = position + ahead * at.x + left * at.y;
                (at, self.ground.below(foot.x, foot.y, position.z + 0.5).height_m)
            })
            .collect();
        let count = feet.len() as f32;
        let middle = feet.iter().map(|f| f.0).sum::<Vec2>() / count;
        let height = feet.iter().map(|f| f.1).sum::<f32>() / count;
        let (mut rise, mut spread) = (Vec2::ZERO, Vec2::splat(1e-6));
        for (at, z) in &feet {
            rise += (*at - middle) * (z - height);
            spread += (*at - middle) * (*at - middle);
        }
        let slope = rise / spread;
        let x = (ahead + Vec3::Z * slope.x).normalize_or(ahead);
        let z = x.cross(left + Vec3::Z * slope.y).normalize_or(Vec3::Z);
        let turn = Quat::from_mat3(&Mat3::from_cols(x, z.cross(x), z));
        let z = height - slope.dot(middle);
        Pose::new(position.with_z(z), turn.normalize())
    }
}

fn body_pose(pose: &Pose) -> BodyPose {
    BodyPose::from_parts(pose.position(), pose.rotation().normalize())
}

fn check_pose(id: ActorId, pose: &Pose) -> Result<(), PhysicsError> {
    let bad =
        |why| Err(PhysicsError::Bad { actor: id, what: "pose", value: format!("{pose:?}"), why });
    if !pose.is_valid() {
        return bad("not finite, or its quaternion is not of unit length");
    }
    if pose.position().abs().max_element() > WORLD_MAX_M {
        return bad("more than 50 km from the map's origin");
    }
    Ok(())
}

pub(super) fn check_length(
    id: ActorId,
    what: &'static str,
    v: Vec3,
    most: f32,
    why: &'static str,
) -> Result<(), PhysicsError> {
    // Not finite lengths fail this comparison as well.
    if v.length() <= most {
        return Ok(());
    }
    Err(PhysicsError::Bad { actor: id, what, value: v.to_string(), why })
}
