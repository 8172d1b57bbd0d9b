//! `static.trigger.friction`: boxes in which the tyres of vehicles have another friction.
//!
//! As in CARLA, a vehicle that enters a box gets the friction of the box on all wheels, and one that
//! leaves it gets back what it had. A vehicle is in a box when its middle or a corner of its bounds is.

use std::collections::BTreeMap;

use client_lib::{ActorId, BlueprintInfo, Pose, VehicleWheel, World, wire::kind};
use glam::Vec3;

use crate::{
    args::RpcError, blueprints::FRICTION_TRIGGER, physics_control::FRICTION, wire::Description,
};

const CM_PER_M: f32 = 100.0;

/// A box: `world_from_box`, half of its size in metres, and the friction in CARLA's unit.
pub(crate) struct Trigger {
    pose: Pose,
    half_m: Vec3,
    friction: f32,
}

impl Trigger {
    /// Reads the attributes of a box. Extents are in centimetres, as in CARLA.
    ///
    /// # Errors
    ///
    /// Returns an error if an attribute is no number, or friction is out of range.
    pub(crate) fn new(pose: Pose, description: &Description) -> Result<Trigger, RpcError> {
        let friction = description.number("friction", FRICTION)?;
        if !(0.0..=100.0).contains(&friction) {
            return Err(
                format!("{FRICTION_TRIGGER}: friction is {friction}, must be 0 to 100").into()
            );
        }
        let half = |name| description.number(name, 1.0).map(|cm| cm.abs() / CM_PER_M);
        let half_m = Vec3::new(half("extent_x")?, half("extent_y")?, half("extent_z")?);
        Ok(Trigger { pose, half_m, friction })
    }

    fn contains(&self, point: Vec3) -> bool {
        let inside = self.pose.rotation().inverse() * (point - self.pose.position());
        inside.abs().cmple(self.half_m).all()
    }
}

/// The boxes of an episode, and the vehicles in them.
#[derive(Default)]
pub(crate) struct FrictionTriggers {
    triggers: BTreeMap<u32, Trigger>,
    /// By vehicle: the box, and the factors on friction that its wheels had before.
    inside: BTreeMap<u32, (u32, Vec<f32>)>,
}

impl FrictionTriggers {
    /// Adds a box.
    pub(crate) fn add(&mut self, id: u32, trigger: Trigger) {
        self.triggers.insert(id, trigger);
    }

    /// Moves a box.
    pub(crate) fn place(&mut self, id: u32, pose: Pose) {
        if let Some(trigger) = self.triggers.get_mut(&id) {
            trigger.pose = pose;
        }
    }

    /// Removes a box.
    pub(crate) fn remove(&mut self, id: u32) {
        self.triggers.remove(&id);
    }

    /// Returns the vehicles that have entered or left a box: the vehicle, and the box that it is in.
    pub(crate) fn changes(
        &mut self,
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Vec<(u32, Option<u32>)> {
        let mut changes = Vec::new();
        if self.triggers.is_empty() && self.inside.is_empty() {
            return changes;
        }
        self.inside.retain(|id, _| world.state(ActorId(*id)).is_some());
        for vehicle in world.states().iter().filter(|state| state.kind == kind::VEHICLE) {
            let Some(info) = blueprints.get(vehicle.blueprint as usize) else { continue };
            let points = outline(&vehicle.pose, info);
            let is_in = |trigger: &Trigger| points.iter().any(|point| trigger.contains(*point));
            let id = vehicle.actor_id.0;
            let before = self.inside.get(&id).map(|(trigger, _)| *trigger);
            // The box that it is in already holds as long as it is in it.
            let stays = before.filter(|id| self.triggers.get(id).is_some_and(is_in));
            let now =
                stays.or_else(|| self.triggers.iter().find(|(_, t)| is_in(t)).map(|(id, _)| *id));
            if now != before {
                changes.push((id, now));
            }
        }
        changes
    }

    /// Gives a vehicle's wheels the friction of the box that it has entered, or its own again.
    pub(crate) fn apply(
        &mut self,
        vehicle: u32,
        trigger: Option<u32>,
        wheels: &mut [VehicleWheel],
    ) {
        let own = self.inside.remove(&vehicle).map(|(_, own)| own);
        let own = own.unwrap_or_else(|| wheels.iter().map(|wheel| wheel.grip).collect());
        let found = trigger.and_then(|id| self.triggers.get(&id).map(|t| (id, t.friction)));
        for (wheel, own) in wheels.iter_mut().zip(&own) {
            wheel.grip = found.map_or(*own, |(_, friction)| friction / FRICTION);
        }
        if let Some((id, _)) = found {
            self.inside.insert(vehicle, (id, own));
        }
    }
}

/// Returns the middle and the lower corners of a vehicle, in the world.
fn outline(pose: &Pose, info: &BlueprintInfo) -> [Vec3; 5] {
    let (center, half) = (Vec3::from(info.center_m), Vec3::from(info.half_extents_m));
    [
        Vec3::ZERO,
        Vec3::new(1.0, 1.0, -1.0),
        Vec3::new(1.0, -1.0, -1.0),
        Vec3::new(-1.0, 1.0, -1.0),
        Vec3::new(-1.0, -1.0, -1.0),
    ]
    .map(|side| pose.position() + pose.rotation() * (center + side * half))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_turned_and_measured_in_centimetres() {
        let attributes = [("friction", "0.5"), ("extent_x", "400.0"), ("extent_y", "100.0")];
        let mut description = crate::blueprints::definition(FRICTION_TRIGGER).unwrap().describe();
        for (id, value) in attributes {
            let found = description.attributes.iter_mut().find(|one| one.id == id).unwrap();
            value.clone_into(&mut found.value);
        }
        let quarter = std::f32::consts::FRAC_PI_2;
        let pose = Pose::level(Vec3::new(10.0, 20.0, 0.0), quarter);
        let trigger = Trigger::new(pose, &description).unwrap();
        assert_eq!(trigger.friction, 0.5);
        assert!(trigger.contains(Vec3::new(10.5, 23.5, 0.0)));
        assert!(!trigger.contains(Vec3::new(13.5, 20.5, 0.0)));
        assert!(!trigger.contains(Vec3::new(10.0, 20.0, 0.1)));
    }
}
