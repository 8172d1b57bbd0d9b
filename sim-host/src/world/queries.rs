//! Queries about actors and the world. They change nothing.

use protocol::{
    ActorId, BONES_PER_COMMAND, BlendPose, GivenPoses, Pose, Query, QueryKind, Refusal, Response,
    SetBones, StandingState, VehiclePhysics,
};

use super::{World, vehicle_physics::no_wheel};

impl World {
    /// Returns the response to a query. `standing` is what persists beside actors.
    ///
    /// # Errors
    ///
    /// The cause of the refusal.
    pub(crate) fn answer(
        &self,
        standing: &StandingState,
        query: &Query,
    ) -> Result<Response, Refusal> {
        let Query { actor_id: id, index, .. } = *query;
        let kind = QueryKind::of(query.kind)
            .ok_or_else(|| Refusal::unsupported(format!("unknown query kind {}", query.kind)))?;
        Ok(match kind {
            QueryKind::VehicleBody => Response::new(&self.parameters(id)?.body),
            QueryKind::VehicleEngine => Response::new(&self.parameters(id)?.engine),
            QueryKind::VehicleGearbox => Response::new(&self.parameters(id)?.gearbox),
            QueryKind::VehicleSteering => Response::new(&self.parameters(id)?.steering),
            QueryKind::VehicleWheel => {
                let physics = self.parameters(id)?;
                let wheel = physics.wheels.get(index as usize);
                Response::new(wheel.ok_or_else(|| no_wheel(id, index, &physics))?)
            }
            QueryKind::VehicleTelemetry => {
                self.check_vehicle(id, "engine")?;
                Response::new(&self.physics.telemetry(id)?)
            }
            QueryKind::WheelTelemetry => {
                self.check_vehicle(id, "engine")?;
                Response::new(&self.physics.wheel_telemetry(id, index)?)
            }
            QueryKind::AckermannSettings => {
                self.check_vehicle(id, "engine")?;
                Response::new(&self.physics.ackermann_settings(id)?)
            }
            QueryKind::Bones => Response::new(&self.bones(&standing.poses, id, index)?),
            QueryKind::Blend => {
                self.walker(id)?;
                let share = standing.poses.of(id).map_or(0.0, |given| given.weight);
                Response::new(&BlendPose { actor_id: id, weight: share })
            }
            QueryKind::Weather => Response::new(&standing.weather),
        })
    }

    /// Returns the parameters of a vehicle.
    fn parameters(&self, id: ActorId) -> Result<VehiclePhysics, Refusal> {
        self.check_vehicle(id, "engine")?;
        Ok(self.physics.vehicle_physics(id)?)
    }

    /// Returns up to [`BONES_PER_COMMAND`] bones of a walker's set pose, from `first` on.
    fn bones(&self, poses: &GivenPoses, id: ActorId, first: u32) -> Result<SetBones, Refusal> {
        let skeleton = self.walker(id)?;
        let bones = skeleton.bones.iter().enumerate().skip(first as usize).take(BONES_PER_COMMAND);
        let given = poses.of(id);
        let mut set = SetBones { actor_id: id, first, ..SetBones::default() };
        for (room, (index, bone)) in set.parent_from_bones.iter_mut().zip(bones) {
            let begins = skeleton.bones[bone.parent].at_m;
            let at_m = if index == bone.parent { bone.at_m } else { bone.at_m - begins };
            let own = given.and_then(|given| given.bones.get(index).copied().flatten());
            let (at, turn) = own.unwrap_or((at_m, glam::Quat::IDENTITY));
            *room = Pose::new(at, turn);
            set.count += 1;
        }
        if set.count == 0 {
            return Err(Refusal::not_found(format!(
                "{id} has {} bones; there is no bone {first}",
                skeleton.bones.len()
            )));
        }
        Ok(set)
    }
}
