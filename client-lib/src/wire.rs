//! The protocol's own layouts: for gateways to other protocols, tools for recordings, and benchmarks.
//!
//! Programs do not need this module. What it exports is plain integers and floats as they stand in
//! shared memory; fields are added with the protocol's version, without a period of deprecation.

pub use protocol::{
    ActorState, ApplyForce, Autopilot, BlendPose, BundleHeader, Command, Episode, EraseShapes,
    HideLayers, HideObjects, JournalEntry, LoadMap, Name, Outcome, Plane, RouteCommand, RouteStep,
    STRIDE, SensorSpec, SetBones, SetDoors, SetPhysics, SetStreetLights, SetTrafficLight,
    SetVehicleLights, SetVelocity, SetWeatherAffectsGrip, Settings, Shape, SnapshotHeader, Stamp,
    Switch, Teleport, TrafficParam, Transmit, VehicleControl, WalkerLimbs, flag, kind, lamp, layer,
    light, output, param, point_attribute, route_step, sensor, shape, status, street_light, tracer,
};

use crate::{Client, ClientError, Outcome as TypedOutcome};

impl Client {
    /// How time passes, in the protocol's layout.
    #[must_use]
    pub fn wire_settings(&self) -> Settings {
        self.connection().participant.control().settings()
    }

    /// Sets how time passes, in the protocol's layout.
    ///
    /// # Errors
    ///
    /// As for [`Client::apply_settings`].
    pub fn apply_wire_settings(&mut self, settings: Settings) -> Result<(), ClientError> {
        self.request_one("settings", Command::SetSettings(settings)).map(drop)
    }

    /// As [`Client::try_request`], with the entries of the journal.
    ///
    /// # Errors
    ///
    /// As for [`Client::try_request`].
    pub fn try_wire_request(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<JournalEntry>, ClientError> {
        let outcomes = self.try_request(what, commands)?;
        Ok(outcomes.into_iter().map(TypedOutcome::into_entry).collect())
    }
}
