//! The table of commands.

use bytemuck::{Pod, Zeroable};

use crate::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Autopilot, BlendPose, BundleId,
    CreateBundle, EraseShapes, FilePath, HideLayers, HideObjects, LoadMap, Name, RouteCommand,
    SensorSpec, SetBones, SetDead, SetDoors, SetPhysics, SetStreetLights, SetTrafficLight,
    SetVehicleLights, SetVelocity, SetWeatherAffectsGrip, Settings, Shape, Spawn, Stamp,
    StartRecorder, StartReplay, StopReplay, Switch, Teleport, TrafficParam, Transmit, VehicleBody,
    VehicleControl, VehicleEngine, VehicleGearbox, VehicleSteering, VehicleWheel, Weather,
};

/// The most commands in one batch: longer lists travel as several batches.
pub const BATCH_MAX: usize = 128;

/// Header of a batch of [`RawCommand`]s or [`VehicleControl`]s from one client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BatchHeader {
    /// The newest frame that the client had received.
    pub stamp: Stamp,
    /// The client's declared name; the commands of one frame apply in the order of names.
    pub client: Name,
    /// Sequence number of the first command of the batch; a client's numbers have no gaps.
    pub sequence: u64,
    /// 1: apply at once, between two frames, if the world waits for a tick. 0: with the next tick.
    pub now: u32,
    /// The participant slot of the client.
    pub slot: u32,
}

const _: () = assert!(size_of::<BatchHeader>() == 80);

/// A one-time request that changes the world, as it travels. [`Command`] is its typed form.
/// Commands are never lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct RawCommand {
    /// The number of the command kind.
    kind: u32,
    /// Reserved; 0.
    reserved: u32,
    /// The command's own struct, padded with zeros.
    body: [u64; BODY_WORDS],
}

/// Words of the largest command, [`Command::Sensor`].
const BODY_WORDS: usize = 73;

const _: () = assert!(size_of::<RawCommand>() == 592);

impl Default for RawCommand {
    fn default() -> RawCommand {
        RawCommand::zeroed()
    }
}

macro_rules! commands {
    ($(
        $(#[$group_doc:meta])* $group:ident($enum:ident) {
            $($(#[$doc:meta])* $name:ident($body:ty) = $kind:literal,)*
        }
    )*) => {
        /// A command: what a client may change in the world or in its sensors.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant, reason = "records without pointers; a sensor has a table")]
        pub enum Command { $($($(#[$doc])* $name($body),)*)* }

        /// A [`Command`] by the part of the host that carries it out. Each part matches its own
        /// group without a wildcard, so that a new command which is not handled does not compile.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant, reason = "records without pointers; a sensor has a table")]
        pub enum CommandGroup { $($(#[$group_doc])* $group($enum),)* }

        $(
            $(#[$group_doc])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            #[allow(clippy::large_enum_variant, reason = "records without pointers; a sensor has a table")]
            pub enum $enum { $($(#[$doc])* $name($body),)* }

            impl From<$enum> for Command {
                fn from(command: $enum) -> Command {
                    match command { $($enum::$name(body) => Command::$name(body),)* }
                }
            }
        )*

        impl Command {
            /// Returns the command as a member of its group.
            pub fn group(self) -> CommandGroup {
                match self {
                    $($(Command::$name(body) => CommandGroup::$group($enum::$name(body)),)*)*
                }
            }
        }

        impl From<Command> for RawCommand {
            fn from(command: Command) -> RawCommand {
                let mut raw = RawCommand::default();
                match command {
                    $($(Command::$name(body) => {
                        const { assert!(size_of::<$body>() <= 8 * BODY_WORDS) };
                        raw.kind = $kind;
                        bytemuck::bytes_of_mut(&mut raw.body)[..size_of::<$body>()]
                            .copy_from_slice(bytemuck::bytes_of(&body));
                    })*)*
                }
                raw
            }
        }

        impl RawCommand {
            /// Returns the command, or `None` if its kind is unknown.
            pub fn decode(&self) -> Option<Command> {
                let bytes = bytemuck::bytes_of(&self.body);
                match self.kind {
                    $($($kind => Some(Command::$name(
                        bytemuck::pod_read_unaligned(&bytes[..size_of::<$body>()]),
                    )),)*)*
                    _ => None,
                }
            }
        }
    };
}

commands! {
    /// Commands that change actors. Their effect is part of the state hash.
    World(WorldCommand) {
        /// Spawns an actor; the outcome holds its id.
        Spawn(Spawn) = 1,
        /// Destroys an actor and every sensor bundle attached to it.
        Destroy(ActorId) = 2,
        /// Moves an actor to a pose, at rest.
        Teleport(Teleport) = 3,
        /// Sets pedals and steering wheel; the latest control holds.
        Control(VehicleControl) = 4,
        /// Lets traffic drive an actor, or gives it back to clients.
        Autopilot(Autopilot) = 5,
        /// Sets the velocity of an actor.
        SetVelocity(SetVelocity) = 12,
        /// Freezes a traffic light in one phase, or returns it to the signal plan.
        SetTrafficLight(SetTrafficLight) = 13,
        /// Switches between dynamic and kinematic motion of an actor.
        SetPhysics(SetPhysics) = 14,
        /// Switches the lights of a vehicle.
        SetVehicleLights(SetVehicleLights) = 17,
        /// Opens and closes the doors of a vehicle.
        SetDoors(SetDoors) = 18,
        /// Sets mass, drag and centre of mass of a vehicle.
        SetBody(VehicleBody) = 31,
        /// Sets the engine of a vehicle.
        SetEngine(VehicleEngine) = 32,
        /// Sets the gearbox of a vehicle.
        SetGearbox(VehicleGearbox) = 33,
        /// Sets the steering curve of a vehicle over speed.
        SetSteering(VehicleSteering) = 34,
        /// Sets one wheel of a vehicle.
        SetWheel(VehicleWheel) = 35,
        /// Applies an impulse to an actor, or a force for one frame.
        ApplyForce(ApplyForce) = 36,
        /// Switches gravity of an actor on or off.
        SetGravity(Switch) = 37,
        /// Switches collisions of an actor on or off.
        SetCollisions(Switch) = 38,
        /// Drives a vehicle to a speed and a steering angle; the later of this and [`Command::Control`] holds.
        Ackermann(AckermannControl) = 39,
        /// Sets the gains of a vehicle's Ackermann controller.
        SetAckermann(AckermannSettings) = 40,
        /// Makes a walker jump.
        Jump(ActorId) = 41,
        /// Sets or extends the route of a vehicle that traffic drives.
        RouteCommand(RouteCommand) = 50,
        /// Lets a walker fall, or stops the engine of a vehicle for good.
        SetDead(SetDead) = 51,
    }
    /// Commands whose effect holds until another command changes it; [`crate::StandingState`] is
    /// the sum of them.
    Standing(StandingCommand) {
        /// Sets the weather.
        SetWeather(Weather) = 6,
        /// Changes time step, mode and pipelining.
        SetSettings(Settings) = 10,
        /// Sets one parameter of traffic.
        TrafficParam(TrafficParam) = 11,
        /// Hides or shows layers of the map.
        HideLayers(HideLayers) = 15,
        /// Hides or shows static objects of the map.
        HideObjects(HideObjects) = 16,
        /// Couples tyre grip to the weather, or decouples it.
        SetWeatherAffectsGrip(SetWeatherAffectsGrip) = 42,
        /// Draws a debug shape into camera images. The outcome carries a [`crate::ShapeReceipt`]; its id is
        /// larger than those of all earlier shapes.
        Draw(Shape) = 44,
        /// Removes debug shapes.
        EraseShapes(EraseShapes) = 45,
        /// Sets bones of a walker's client pose.
        SetBones(SetBones) = 46,
        /// Sets the weight of a walker's client pose.
        BlendPose(BlendPose) = 47,
        /// Sets the state of street lights.
        SetStreetLights(SetStreetLights) = 48,
    }
    /// Commands about sensor bundles and the messages that their sensors send.
    Sensor(SensorCommand) {
        /// Creates a sensor bundle. Its `sensor_count` [`Command::Sensor`]s follow directly in the same batch.
        /// The outcomes carry a [`crate::BundleReceipt`].
        CreateBundle(CreateBundle) = 7,
        /// Adds one sensor to the bundle before it.
        Sensor(SensorSpec) = 8,
        /// Destroys a sensor bundle.
        DestroyBundle(BundleId) = 9,
        /// Transmits a text by radio with the next frame.
        Transmit(Transmit) = 43,
    }
    /// Commands that the host process executes outside the simulation: recordings, saved states,
    /// replays, maps.
    Service(ServiceCommand) {
        /// Starts a recording with the next frame.
        StartRecorder(StartRecorder) = 100,
        /// Ends the recording.
        StopRecorder(Nothing) = 101,
        /// Saves the complete simulation state to a file, between two frames.
        SaveState(FilePath) = 102,
        /// Restores a saved simulation state.
        LoadState(FilePath) = 103,
        /// Replays a recording beside the actors of the world.
        StartReplay(StartReplay) = 104,
        /// Ends the replay.
        StopReplay(StopReplay) = 105,
        /// Destroys the world and loads a map in its place, between two frames. The outcome's id is the
        /// number of the new episode.
        LoadMap(LoadMap) = 106,
    }
}

/// The body of a command without parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Nothing {
    /// Reserved; 0.
    pub reserved: u64,
}
