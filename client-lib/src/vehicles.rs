//! What moves an actor besides its pedals, and a vehicle's lights and doors.

use glam::Vec3;
use protocol::ActorId;

use crate::{Client, ClientError, Command, Doors, VehicleLights};

impl Client {
    /// Sets an actor's velocity (m/s) and angular velocity (rad/s), both in world space. A kinematic
    /// actor keeps them.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist, is a traffic light, or a number is not finite.
    pub fn set_velocity(
        &mut self,
        actor_id: ActorId,
        velocity: Vec3,
        angular_velocity: Vec3,
    ) -> Result<(), ClientError> {
        let command = Command::set_velocity(actor_id, velocity, angular_velocity);
        self.request_one("set_velocity", command.0).map(drop)
    }

    /// Lets teleports and set velocities alone move an actor, or physics again.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist or is a traffic light.
    pub fn set_kinematic(
        &mut self,
        actor_id: ActorId,
        is_kinematic: bool,
    ) -> Result<(), ClientError> {
        let command = Command::set_kinematic(actor_id, is_kinematic);
        self.request_one("set_kinematic", command.0).map(drop)
    }

    /// Switches a vehicle's lights: those that are named on, all others off.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it is no vehicle.
    pub fn set_vehicle_lights(
        &mut self,
        actor_id: ActorId,
        lights: VehicleLights,
    ) -> Result<(), ClientError> {
        let command = Command::set_vehicle_lights(actor_id, lights);
        self.request_one("set_vehicle_lights", command.0).map(drop)
    }

    /// Opens a vehicle's doors that are named and closes all others.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it is no vehicle or has no such door.
    pub fn set_doors(&mut self, actor_id: ActorId, open: Doors) -> Result<(), ClientError> {
        self.request_one("set_doors", Command::set_doors(actor_id, open).0).map(drop)
    }
}
