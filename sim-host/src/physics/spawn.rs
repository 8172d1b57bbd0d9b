//! Spawning actors.

use std::sync::Arc;

use glam::{Mat3, Quat, Vec2, Vec3};
use protocol::{ActorId, Pose};
use rapier3d::prelude::{
    ColliderBuilder, MassProperties, PhysicsWorld, Pose as BodyPose, RigidBodyBuilder, SharedShape,
};

use super::{
    actor::{Actor, Kind, Teleport},
    collision_groups::{PASSABLE, SOLID},
    error::PhysicsError,
    limits::check_pose,
    model::VehicleModel,
    motion::{Twist, Wrench},
    prop::{Prop, PropModel},
    rigid_body::body_pose,
    vehicle::{Prepared, Vehicle},
    walker::Walker,
    walker_model::WalkerModel,
    world::Physics,
};

/// A vehicle spawned no higher above the road than this is placed on it.
const SNAP_M: f32 = 1.0;

impl Physics {
    /// Spawns a vehicle at rest and returns its pose. An upright vehicle at most 1 m above the road
    /// is placed on the road.
    ///
    /// # Errors
    ///
    /// The id is in use, the pose is not valid, or an obstacle overlaps the vehicle.
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

    /// Spawns a standing walker and returns its pose, whose origin is between the feet.
    ///
    /// # Errors
    ///
    /// The id is in use, the pose is not valid, or an obstacle overlaps the walker.
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

    /// Spawns a prop and returns its pose, whose origin is in the middle of the base. A prop may
    /// overlap obstacles: CARLA gives a prop its mesh after it has found a place for it.
    ///
    /// # Errors
    ///
    /// The id is in use, or the pose is not valid.
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

    fn check_new(&self, id: ActorId, pose: &Pose) -> Result<(), PhysicsError> {
        check_pose(id, pose)?;
        if self.find(id).is_ok() || id == ActorId::NONE {
            return Err(PhysicsError::Taken(id));
        }
        Ok(())
    }

    /// Returns the shared precomputed values of a model. Vehicles of one model share them, restored
    /// vehicles included.
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

    #[expect(clippy::too_many_arguments, reason = "one call site for each kind of actor")]
    pub(super) fn insert(
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
        let is_passable = kind.is_passable();
        if !matches!(kind, Kind::Prop(_))
            && let Some(obstacle) = self.obstacle(&(pose * local), &shape, None)
        {
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
            .collision_groups(if is_passable { PASSABLE } else { SOLID })
            .user_data(u128::from(id.0));
        let (body, collider) = self.world.insert(body, collider);
        // The centre of mass is valid from the first substep on.
        let PhysicsWorld { bodies, colliders, .. } = &mut self.world;
        bodies[body].recompute_mass_properties_from_colliders(colliders);
        let actor = Actor {
            id: id.0,
            body,
            collider,
            kinematic,
            kind,
            kinematic_velocity: Twist::ZERO,
            acceleration_mps2: Vec3::ZERO,
            gravity_disabled: false,
            collisions_disabled: false,
            external_force: Wrench::default(),
            teleport: Teleport::default(),
            far: None,
            solo: false,
            dormant: false,
            path: Vec::new(),
        };
        self.actors.insert(actor);
        Ok(())
    }

    /// Returns the pose with all wheels on the ground, if they are near it.
    fn snapped(&self, model: &VehicleModel, pose: &Pose) -> Pose {
        let (position, rotation) = (pose.position(), pose.rotation());
        if (rotation * Vec3::Z).z < 0.7 || model.wheels.is_empty() {
            return *pose;
        }
        let origin = self.ground.below(position.x, position.y, position.z + 0.5);
        if !origin.on_map || position.z - origin.height_m > SNAP_M {
            return *pose;
        }
        // The plane through the ground below the wheels: mean height, and slopes along both axes.
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
