//! Bodies of blueprints.

use std::{collections::BTreeMap, sync::Arc};

use glam::{Quat, Vec3};
use protocol::{ActorId, Pose, flag};
use town::{Blueprint, Kind, Motion};

use crate::physics::{DoorModel, Physics, PhysicsError, PropModel, VehicleModel, WalkerModel};

/// The vehicle models of the blueprints that were spawned so far.
#[derive(Default)]
pub(crate) struct Models {
    vehicles: BTreeMap<u32, Arc<VehicleModel>>,
}

impl Models {
    /// Spawns the body of a blueprint, with `flags` of the spawn command, and returns its pose.
    pub(crate) fn spawn(
        &mut self,
        physics: &mut Physics,
        id: ActorId,
        (index, blueprint): (u32, &Blueprint),
        pose: &Pose,
        flags: u32,
    ) -> Result<Pose, PhysicsError> {
        let half = blueprint.half_extents_m;
        let has = |bit: u32| flags & bit != 0;
        match blueprint.kind {
            Kind::Vehicle => {
                let model = self
                    .vehicles
                    .entry(index)
                    .or_insert_with(|| Arc::new(VehicleModel::of(blueprint)));
                physics.spawn_vehicle(id, model, pose, has(flag::KINEMATIC))
            }
            Kind::Walker => {
                let model = WalkerModel {
                    radius_m: half.y.min(0.4 * half.z),
                    height_m: 2.0 * half.z,
                    mass_kg: blueprint.mass_kg.max(1.0),
                    is_ragdoll_on_hit: has(flag::RAGDOLL_ON_HIT),
                    gets_up_after_fall: has(flag::GETS_UP_AFTER_FALL),
                };
                physics.spawn_walker(id, model, pose)
            }
            Kind::Prop | Kind::TrafficLight => {
                let mass_kg = blueprint.mass_kg.max(1.0);
                physics.spawn_prop(
                    id,
                    PropModel {
                        half_extents_m: half,
                        mass_kg,
                        is_passable: blueprint.is_passable(),
                        is_released_on_hit: has(flag::RELEASED_ON_HIT),
                    },
                    pose,
                    has(flag::KINEMATIC),
                )
            }
        }
    }
}

/// Returns the boxes of the doors of a vehicle that are in `open`.
pub(crate) fn doors_of(blueprint: &Blueprint, open: u32) -> Vec<DoorModel> {
    if open == 0 {
        return Vec::new();
    }
    let pieces = blueprint.rig().joints.iter().zip(&blueprint.geometry().pieces);
    let doors = pieces.filter_map(|(joint, mesh)| {
        let Motion::Door { number, hinge_m, axis, opens_rad } = joint.motion else { return None };
        let corners = || mesh.positions.iter().map(|p| Vec3::from_array(*p));
        let (low, high) = (corners().reduce(Vec3::min)?, corners().reduce(Vec3::max)?);
        let turn = Quat::from_axis_angle(axis, opens_rad);
        let middle_m = hinge_m + turn * (0.5 * (low + high) - hinge_m);
        let half_extents_m = (0.5 * (high - low)).max(Vec3::splat(0.02));
        (open >> number & 1 == 1).then_some(DoorModel { number, middle_m, half_extents_m, turn })
    });
    doors.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_doors_extend_beyond_their_vehicles() {
        let mut count = 0;
        for blueprint in town::catalogue().iter().filter(|b| b.rig().door_count() > 0) {
            let all = (1 << blueprint.rig().door_count()) - 1;
            let doors = doors_of(blueprint, all);
            assert_eq!(
                doors.iter().fold(0, |bits, d| bits | 1 << d.number),
                all,
                "{}",
                blueprint.id
            );
            for door in doors {
                let (middle, half) = (door.middle_m, door.half_extents_m);
                let name = format!("{} {door:?}", blueprint.id);
                assert!(half.x > 0.25 && half.x < 1.0 && half.z > 0.4 && half.z < 1.5, "{name}");
                assert!(half.y < 0.45, "{name}");
                // The end of the door away from its hinge lies well beside the body.
                let end = middle - door.turn * Vec3::X * half.x;
                assert!(end.y.abs() > blueprint.half_extents_m.y + 0.3, "{name}");
                assert_eq!(end.y > 0.0, door.number % 2 == 0, "{name}");
                count += 1;
            }
        }
        assert!(count > 40, "{count} doors");
    }
}
