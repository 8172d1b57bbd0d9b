use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, BlendPose, BundleId, EraseShapes,
    FilePath, LoadMap, Name, Pose, SensorSpec, SetBones, SetStreetLights, SetWeatherAffectsGrip,
    Shape, ShapeReceipt, Stamp, StartRecorder, StartReplay, StopReplay, Switch, Transmit,
    VehicleBody, VehicleControl, VehicleEngine, VehicleGearbox, VehicleSteering, VehicleWheel,
};

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct RawCommand {
    /// The number of the command kind.
    kind: u32,
    /// Reserved; 0.
    reserved: u32,
    /// The command's own struct, padded with zeros.
    body: [u64; 25],
}

const _: () = assert!(size_of::<RawCommand>() == 208);

/// Values of [`Outcome::status`].
pub mod status {
    /// The command took effect.
    pub const DONE: u32 = 0;
    /// The command had no effect; [`super::Outcome::text`] holds the reason.
    pub const REFUSED: u32 = 1;
}

/// The result of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Outcome {
    /// One of [`status`].
    pub status: u32,
    /// The actor or bundle that the command created or changed.
    pub id: u32,
    /// The reason of a refusal as UTF-8, or a response; padded with zeros.
    pub text: [u8; 184],
}

const _: () = assert!(size_of::<Outcome>() == 192);

impl Outcome {
    /// The outcome of a command that took effect on, or created, `id`.
    pub fn done(id: u32) -> Outcome {
        Outcome { status: status::DONE, id, text: [0; 184] }
    }

    /// It took effect, and made `id` with this receipt.
    pub fn answer(id: u32, what: &impl Answer) -> Outcome {
        let mut text = [0; 184];
        let bytes = bytemuck::bytes_of(what);
        text[..bytes.len()].copy_from_slice(bytes);
        Outcome { status: status::DONE, id, text }
    }

    /// The receipt of a command that made something, or why there is none.
    pub fn answered<T: Answer>(&self) -> Result<T, &str> {
        self.result()?;
        Ok(bytemuck::pod_read_unaligned(&self.text[..size_of::<T>()]))
    }

    /// The outcome of a command that was refused. `why` is cut after 184 bytes.
    pub fn refused(why: &str) -> Outcome {
        let mut text = [0; 184];
        let mut end = why.len().min(184);
        while !why.is_char_boundary(end) {
            end -= 1;
        }
        text[..end].copy_from_slice(&why.as_bytes()[..end]);
        Outcome { status: status::REFUSED, id: 0, text }
    }

    /// Returns the id, or the reason of the refusal.
    pub fn result(&self) -> Result<u32, &str> {
        if self.status == status::DONE {
            return Ok(self.id);
        }
        let end = self.text.iter().position(|&b| b == 0).unwrap_or(184);
        Err(std::str::from_utf8(&self.text[..end]).unwrap_or("refused"))
    }
}

/// A struct that fits into an [`Outcome`].
pub trait Answer: Pod {}

macro_rules! answers {
    ($($body:ty),*) => {
        $(
            const _: () = assert!(size_of::<$body>() <= 184);
            impl Answer for $body {}
        )*
    };
}

answers! {
    ShapeReceipt
}

/// One entry of a frame's journal: a command and its outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalEntry {
    /// Name of the client that sent the command.
    pub client: Name,
    /// Sequence number among the client's commands.
    pub sequence: u64,
    /// The command.
    pub command: RawCommand,
    /// Its outcome.
    pub outcome: Outcome,
}

const _: () = assert!(size_of::<JournalEntry>() == 448);

/// Header of one part of a frame's journal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalHeader {
    /// The first frame whose snapshot shows the effect of these commands.
    pub stamp: Stamp,
    /// Counts the parts without gaps since the host started, so that a reader detects a lost part.
    pub serial: u64,
    /// Index of this part's first entry in the frame's journal.
    pub first: u32,
    /// 0: the commands of one frame. Otherwise a keyframe: the standing state from which a reader that
    /// joined late starts, and the number of parts that belong to it, this one and the past journals
    /// that follow it.
    pub keyframe: u32,
}

const _: () = assert!(size_of::<JournalHeader>() == 40);

macro_rules! commands {
    ($(
        $(#[$group_doc:meta])* $group:ident($enum:ident) {
            $($(#[$doc:meta])* $name:ident($body:ty) = $kind:literal,)*
        }
    )*) => {
        /// A command: what a client may change in the world or in its sensors.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Command { $($($(#[$doc])* $name($body),)*)* }

        /// A [`Command`] by the part of the host that carries it out. Each part matches its own
        /// group without a wildcard, so that a new command which is not handled does not compile.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum CommandGroup { $($(#[$group_doc])* $group($enum),)* }

        $(
            $(#[$group_doc])*
            #[derive(Clone, Copy, Debug, PartialEq)]
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
                        const { assert!(size_of::<$body>() <= 200) };
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
        /// Draws a debug shape into camera images. The outcome carries a [`ShapeReceipt`]; its id is
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

/// Parameters of [`Command::Spawn`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Spawn {
    /// The blueprint's id, for example `vehicle.tesla.model3`.
    pub blueprint: Name,
    /// Bits of [`crate::flag`]: `AUTOPILOT`, `KINEMATIC`, `RAGDOLL_ON_HIT`.
    pub flags: u32,
    /// `world_from_actor`. A vehicle at most 1 m above the road is placed on the road.
    pub pose: Pose,
    /// Paint: red, green, blue, 255; 0: the blueprint's default.
    pub color: u32,
    /// The role name, for example `hero`.
    pub role: Name,
}

/// Parameters of [`Command::Teleport`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Teleport {
    /// The actor.
    pub actor_id: ActorId,
    /// `world_from_actor`.
    pub pose: Pose,
}

/// Parameters of [`Command::SetVelocity`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SetVelocity {
    /// The actor.
    pub actor_id: ActorId,
    /// Linear velocity in world space.
    pub velocity_mps: [f32; 3],
    /// Angular velocity in world space.
    pub angular_velocity_radps: [f32; 3],
}

/// Parameters of [`Command::SetTrafficLight`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetTrafficLight {
    /// The traffic light.
    pub actor_id: ActorId,
    /// 1: the light is frozen in `phase`; 0: it follows the signal plan.
    pub hold: u32,
    /// One of [`crate::light`].
    pub phase: u32,
}

/// Parameters of [`Command::SetPhysics`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetPhysics {
    /// The actor.
    pub actor_id: ActorId,
    /// 1: dynamic: gravity, contacts and controls move it; 0: kinematic.
    pub on: u32,
}

/// Parameters of [`Command::HideLayers`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HideLayers {
    /// Bits of [`layer`].
    pub layers: u32,
    /// 1: invisible and without collisions; 0: restored.
    pub hidden: u32,
}

/// Bits of [`HideLayers::layers`].
pub mod layer {
    /// Buildings.
    pub const BUILDINGS: u32 = 1 << 0;
    /// Trees, bushes, hedges.
    pub const FOLIAGE: u32 = 1 << 1;
    /// Parked cars.
    pub const PARKED_VEHICLES: u32 = 1 << 2;
    /// Benches, bins, signs and poles.
    pub const PROPS: u32 = 1 << 3;
    /// Street lights.
    pub const STREET_LIGHTS: u32 = 1 << 4;
    /// Walls and fences.
    pub const WALLS: u32 = 1 << 5;
    /// Every layer.
    pub const ALL: u32 = (1 << 6) - 1;
}

/// Parameters of [`Command::HideObjects`]: up to 1024 static objects with consecutive numbers. An
/// object's number is its id in instance images without the highest bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HideObjects {
    /// Number of the object of bit 0, divided by 1024.
    pub block: u32,
    /// 1: invisible and without collisions; 0: restored, unless their layer is hidden.
    pub hidden: u32,
    /// A bit for each object of the block.
    pub bits: [u64; 16],
}

/// Parameters of [`Command::SetVehicleLights`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetVehicleLights {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Lights that are on: bits of [`crate::lamp`].
    pub lamps: u32,
}

/// Parameters of [`Command::SetDoors`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetDoors {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Open doors, in the bits of [`crate::ActorState::doors`].
    pub open: u32,
}

/// Parameters of [`Command::Autopilot`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Autopilot {
    /// The actor.
    pub actor_id: ActorId,
    /// 1: traffic drives it; 0: clients do.
    pub on: u32,
}

/// Parameters of [`Command::CreateBundle`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CreateBundle {
    /// The actor that the sensors are attached to; [`ActorId::NONE`]: they are fixed in the world.
    pub parent: ActorId,
    /// Number of sensors that follow.
    pub sensor_count: u32,
    /// Number of measurements that a reader may borrow at a time, 1 to 8.
    pub max_borrowed: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// The name given by the user.
    pub name: Name,
}

/// Parameters of [`Command::SetWeather`]. Percentages have the meaning that CARLA gives them.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Weather {
    /// 0 to 100.
    pub cloudiness: f32,
    /// 0 to 100.
    pub precipitation: f32,
    /// Puddles, 0 to 100.
    pub precipitation_deposits: f32,
    /// 0 to 100.
    pub wind_intensity: f32,
    /// Azimuth of the sun, counter-clockwise from x.
    pub sun_azimuth_rad: f32,
    /// Altitude of the sun above the horizon.
    pub sun_altitude_rad: f32,
    /// 0 to 100.
    pub fog_density: f32,
    /// Distance at which fog begins.
    pub fog_distance_m: f32,
    /// 0 to 100.
    pub wetness: f32,
}

impl Default for Weather {
    /// A clear afternoon.
    fn default() -> Self {
        Weather {
            cloudiness: 10.0,
            precipitation: 0.0,
            precipitation_deposits: 0.0,
            wind_intensity: 10.0,
            sun_azimuth_rad: 0.6,
            sun_altitude_rad: 0.85,
            fog_density: 2.0,
            fog_distance_m: 0.75,
            wetness: 0.0,
        }
    }
}

/// Parameters of [`Command::SetSettings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Settings {
    /// Simulated time of one tick, 0.1 ms to 10 s.
    pub delta_nanos: u64,
    /// Largest physics substep, 0.1 ms to 100 ms.
    pub substep_max_nanos: u64,
    /// 1: synchronous: the world advances when the ticking client requests it; 0: asynchronous: on its own clock.
    pub synchronous: u32,
    /// Frames by which rendering may trail the world: 0 is strict, at most [`crate::PIPELINE_MAX`].
    pub pipeline: u32,
    /// Asynchronous mode: simulated seconds per real second, in thousandths; 0: without pacing.
    pub real_time_permille: u32,
    /// 1: no sensor is rendered.
    pub no_rendering: u32,
}

impl Default for Settings {
    /// Asynchronous, 50 ms at real-time pace, substeps of 10 ms.
    fn default() -> Self {
        Settings {
            delta_nanos: 50_000_000,
            substep_max_nanos: 10_000_000,
            synchronous: 0,
            pipeline: 0,
            real_time_permille: 1000,
            no_rendering: 0,
        }
    }
}

/// Parameters of [`Command::TrafficParam`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TrafficParam {
    /// The vehicle; [`ActorId::NONE`]: every vehicle.
    pub actor_id: ActorId,
    /// One of [`param`].
    pub param: u32,
    /// The value, in the unit of the parameter.
    pub value: f32,
}

/// The most steps in one [`RouteCommand`]; a longer route takes several.
pub const ROUTE_STEPS: usize = 11;

/// Parameters of [`Command::RouteCommand`]. After the last step the vehicle chooses its turns at random
/// again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RouteCommand {
    /// The vehicle.
    pub actor_id: ActorId,
    /// 1: replaces the earlier route; 0: continues it.
    pub replace: u32,
    /// Number of valid `steps`; with `replace` and no step the route is removed.
    pub count: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// The steps, in order.
    pub steps: [RouteStep; ROUTE_STEPS],
}

/// One step of a route.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RouteStep {
    /// One of [`route_step`].
    pub kind: u32,
    /// For [`route_step::PLACE`]: the place in world space.
    pub position_m: [f32; 3],
}

impl RouteCommand {
    /// The commands that set a whole route; an empty route removes the earlier one.
    pub fn route(actor_id: ActorId, steps: &[RouteStep]) -> Vec<RouteCommand> {
        let part = |nth: usize, some: &[RouteStep]| {
            let replace = u32::from(nth == 0);
            let mut guide = RouteCommand {
                actor_id,
                replace,
                count: some.len() as u32,
                ..RouteCommand::default()
            };
            guide.steps[..some.len()].copy_from_slice(some);
            guide
        };
        if steps.is_empty() {
            return vec![part(0, &[])];
        }
        steps.chunks(ROUTE_STEPS).enumerate().map(|(nth, some)| part(nth, some)).collect()
    }
}

impl RouteStep {
    /// Drives by a place in world space, metres.
    pub fn place(position: Vec3) -> RouteStep {
        RouteStep { kind: route_step::PLACE, position_m: position.to_array() }
    }

    /// A turn or lane change: one of the other values of [`route_step`].
    pub fn turn(kind: u32) -> RouteStep {
        RouteStep { kind, ..RouteStep::default() }
    }
}

/// Values of [`RouteStep::kind`].
pub mod route_step {
    /// Drives by a place, on the nearest lane and the shortest way.
    pub const PLACE: u32 = 1;
    /// Turns left at the next junction, changing lanes for it where needed; takes the straightest
    /// connection where there is no turn to the left.
    pub const LEFT: u32 = 2;
    /// Turns right at the next junction, with the same rules.
    pub const RIGHT: u32 = 3;
    /// Goes straight on at the next junction.
    pub const STRAIGHT: u32 = 4;
    /// Changes to the lane on the left, if there is one.
    pub const LANE_LEFT: u32 = 5;
    /// Changes to the lane on the right, if there is one.
    pub const LANE_RIGHT: u32 = 6;
}

/// Values of [`TrafficParam::param`].
pub mod param {
    /// Reduction of the speed limit as a fraction: 0.3 is 30 % slower, −0.2 is 20 % faster.
    pub const SPEED_REDUCTION: u32 = 1;
    /// Gap to the leading vehicle at standstill, metres.
    pub const GAP_M: u32 = 2;
    /// Fraction of red lights that are ignored.
    pub const IGNORE_LIGHTS: u32 = 3;
    /// Desired speed in metres per second, independent of the limit but reduced in curves. The later
    /// of this and [`SPEED_REDUCTION`] holds.
    pub const SPEED_MPS: u32 = 4;
    /// Lateral offset from the centre of the lane, metres, positive to the left.
    pub const OFFSET_LEFT_M: u32 = 5;
    /// 1: changes lanes where that is an advantage (the default); 0: never does.
    pub const CHANGES_LANES: u32 = 6;
    /// Changes lanes once, as soon as there is a neighbouring lane, even if it is occupied: 1 to the
    /// left, −1 to the right.
    pub const CHANGE_NOW: u32 = 7;
    /// Probability of a change to the right, if that is safe, at each lane decision, about every
    /// 0.6 s.
    pub const KEEP_RIGHT: u32 = 8;
    /// Probability of a change to the left, with the same rule.
    pub const CHANGE_LEFT: u32 = 9;
    /// Probability of a change to the right, with the same rule; added to [`KEEP_RIGHT`].
    pub const CHANGE_RIGHT: u32 = 10;
    /// Fraction of stop and yield signs that are ignored.
    pub const IGNORE_SIGNS: u32 = 11;
    /// Fraction of other vehicles that are ignored, drawn once for each.
    pub const IGNORE_VEHICLES: u32 = 12;
    /// Fraction of walkers that are ignored, drawn once for each.
    pub const IGNORE_WALKERS: u32 = 13;
    /// For every vehicle: the random streams of traffic restart from this integer, 0 to 2^24, and the
    /// seed of the world.
    pub const SEED: u32 = 14;
    /// 1: traffic switches the vehicle lights: indicators, brake lights, and low beam, position and
    /// fog lights by the weather.
    pub const LAMPS: u32 = 15;
    /// Plus the id of an actor: 1 ignores that actor, 0 does not, whatever the fractions say.
    pub const IGNORE_ACTOR: u32 = 1 << 31;

    /// The parameter that this one replaces.
    pub const fn displaces(param: u32) -> Option<u32> {
        match param {
            SPEED_MPS => Some(SPEED_REDUCTION),
            SPEED_REDUCTION => Some(SPEED_MPS),
            _ => None,
        }
    }

    /// Whether the parameter is reset when its action is done.
    pub const fn is_once(param: u32) -> bool {
        param == CHANGE_NOW
    }

    /// Whether a parameter of `owner` ends when the actor `gone` is destroyed.
    pub fn ends_with(owner: super::ActorId, param: u32, gone: super::ActorId) -> bool {
        owner == gone || param == IGNORE_ACTOR.saturating_add(gone.0)
    }
}
