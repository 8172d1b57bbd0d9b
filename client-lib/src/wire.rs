//! The protocol's own layouts: for gateways to other protocols, tools for recordings, and benchmarks.
//!
//! Programs do not need this module. What it exports is plain integers and floats as they stand in
//! shared memory; fields are added with the protocol's version, without a period of deprecation.

mod sensors;

pub use protocol::{
    ActorState, ApplyForce, Autopilot, BlendPose, BundleHeader, CamReading, CamSpec,
    CollisionReading, CollisionSpec, Command, ELEVATIONS_MAX, EffectsSpec, Episode, EraseShapes,
    GnssReading, GnssSpec, HideLayers, HideObjects, ImuReading, ImuSpec, JournalEntry,
    LaneInvasionReading, LaneInvasionSpec, LensSpec, LidarSpec, LoadMap, MessageReading,
    MessageSpec, Name, ObstacleReading, ObstacleSpec, OdometryReading, OdometrySpec, Outcome,
    PhysicsSensorSpec, Plane, RadioSpec, Reading, RouteCommand, RouteStep, STRIDE, SensorSpec,
    SetBones, SetDead, SetDoors, SetPhysics, SetStreetLights, SetTrafficLight, SetVehicleLights,
    SetVelocity, SetWeatherAffectsGrip, Settings, Shape, SnapshotHeader, Stamp, StandingState,
    StreetLightState, Switch, Teleport, TrafficParam, Transmit, VehicleControl, WalkerLimbs,
    exposure, flag, geodesy, kind, lamp, layer, lens_model, lidar_flag, light, output, param,
    point_attribute, quality, radio, route_step, sensor, shape, status, street_light, tracer,
};
pub use sensors::{
    cam, camera, collision, gnss, imu, lane_invasion, lidar, message, obstacle, odometry,
};
