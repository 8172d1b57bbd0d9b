//! The protocol's own layouts: for gateways to other protocols, tools for recordings, and benchmarks.
//!
//! Programs do not need this module. What it exports is plain integers and floats as they stand in
//! shared memory; fields are added with the protocol's version, without a period of deprecation.

pub use protocol::{
    ActorState, ApplyForce, Autopilot, BlendPose, BundleHeader, Command, Episode, EraseShapes,
    HideLayers, HideObjects, JournalEntry, LoadMap, Name, Outcome, Plane, RouteCommand, RouteStep,
    STRIDE, SensorSpec, SetBones, SetDead, SetDoors, SetPhysics, SetStreetLights, SetTrafficLight,
    SetVehicleLights, SetVelocity, SetWeatherAffectsGrip, Settings, Shape, SnapshotHeader, Stamp,
    StandingState, StreetLightState, Switch, Teleport, TrafficParam, Transmit, VehicleControl,
    WalkerLimbs, flag, kind, lamp, layer, light, output, param, point_attribute, route_step,
    sensor, shape, status, street_light, tracer,
};
