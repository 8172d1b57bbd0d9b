use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Ask, BlendPose, BundleId,
    EraseShapes, FilePath, LoadMap, Name, Pose, SensorSpec, SetBones, SetStreetLights,
    SetWeatherAffectsGrip, Shape, ShapeReceipt, Stamp, StartRecorder, StartReplay, StopReplay,
    Switch, Transmit, VehicleBody, VehicleControl, VehicleEngine, VehicleGearbox, VehicleSteering,
    VehicleTelemetry, VehicleWheel, WheelTelemetry,
};

/// Header of a batch of [`RawCommand`]s or [`VehicleControl`]s from one client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BatchHeader {
    /// The newest frame that the client had seen.
    pub stamp: Stamp,
    /// The client's declared name; commands of one frame apply in the order of names.
    pub client: Name,
    /// Number of the first command; they count up within one client, without gaps.
    pub sequence: u64,
    /// 1: carry out now, between two frames, if the world stands still. 0: with the next tick.
    pub now: u32,
    /// The participant slot that the client holds.
    pub slot: u32,
}

const _: () = assert!(size_of::<BatchHeader>() == 80);

/// A one-time command, never lost. [`Command`] is its readable form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct RawCommand {
    /// Which command.
    kind: u32,
    /// Zero.
    reserved: u32,
    /// The command's own struct, padded with zeros.
    body: [u64; 25],
}

const _: () = assert!(size_of::<RawCommand>() == 208);

/// How a command ended.
pub mod status {
    /// It took effect.
    pub const DONE: u32 = 0;
    /// It did not; [`super::Outcome::text`] says why.
    pub const REFUSED: u32 = 1;
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Outcome {
    /// One of [`status`].
    pub status: u32,
    /// The actor or bundle that it made or changed.
    pub id: u32,
    /// Why it was refused, as UTF-8, or what was asked for; padded with zeros.
    pub text: [u8; 184],
}

const _: () = assert!(size_of::<Outcome>() == 192);

impl Outcome {
    /// It took effect on, or made, `id`.
    pub fn done(id: u32) -> Outcome {
        Outcome { status: status::DONE, id, text: [0; 184] }
    }

    /// What was asked for about `id`.
    pub fn answer(id: u32, what: &impl Answer) -> Outcome {
        let mut text = [0; 184];
        let bytes = bytemuck::bytes_of(what);
        text[..bytes.len()].copy_from_slice(bytes);
        Outcome { status: status::DONE, id, text }
    }

    /// The answer to an [`Ask`] for a `T`, or why there is none.
    pub fn answered<T: Answer>(&self) -> Result<T, &str> {
        self.result()?;
        Ok(bytemuck::pod_read_unaligned(&self.text[..size_of::<T>()]))
    }

    /// It did not take effect. `why` is cut after 184 bytes.
    pub fn refused(why: &str) -> Outcome {
        let mut text = [0; 184];
        let mut end = why.len().min(184);
        while !why.is_char_boundary(end) {
            end -= 1;
        }
        text[..end].copy_from_slice(&why.as_bytes()[..end]);
        Outcome { status: status::REFUSED, id: 0, text }
    }

    /// The id, or why there is none.
    pub fn result(&self) -> Result<u32, &str> {
        if self.status == status::DONE {
            return Ok(self.id);
        }
        let end = self.text.iter().position(|&b| b == 0).unwrap_or(184);
        Err(std::str::from_utf8(&self.text[..end]).unwrap_or("refused"))
    }
}

/// What an [`Outcome`] has room for.
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
    VehicleBody, VehicleEngine, VehicleGearbox, VehicleSteering, VehicleWheel, VehicleTelemetry,
    AckermannSettings, BlendPose, ShapeReceipt, SetBones, WheelTelemetry
}

/// One line of a frame's journal: who requested what, and what became of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalEntry {
    /// Who.
    pub client: Name,
    /// Which of the client's commands.
    pub sequence: u64,
    /// What.
    pub command: RawCommand,
    /// What became of it.
    pub outcome: Outcome,
}

const _: () = assert!(size_of::<JournalEntry>() == 448);

/// Header of one part of a frame's journal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalHeader {
    /// The frame whose snapshot is the first to show these commands' effect.
    pub stamp: Stamp,
    /// Counts the parts of this host's life without gaps, so that a reader sees what it missed.
    pub serial: u64,
    /// Index of this part's first entry in the frame's journal.
    pub first: u32,
    /// Not 0: not news but the standing state, for who joins; begin anew from it. How many parts
    /// it takes, this one and the past journals that follow it.
    pub keyframe: u32,
}

const _: () = assert!(size_of::<JournalHeader>() == 40);

macro_rules! commands {
    ($($(#[$doc:meta])* $name:ident($body:ty) = $kind:literal,)*) => {
        /// What a client may command of the world.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Command { $($(#[$doc])* $name($body),)* }

        impl From<Command> for RawCommand {
            fn from(command: Command) -> RawCommand {
                let mut raw = RawCommand::default();
                match command {
                    $(Command::$name(body) => {
                        const { assert!(size_of::<$body>() <= 200) };
                        raw.kind = $kind;
                        bytemuck::bytes_of_mut(&mut raw.body)[..size_of::<$body>()]
                            .copy_from_slice(bytemuck::bytes_of(&body));
                    })*
                }
                raw
            }
        }

        impl RawCommand {
            /// The command, or `None` if this is of no kind we know.
            pub fn decode(&self) -> Option<Command> {
                let bytes = bytemuck::bytes_of(&self.body);
                match self.kind {
                    $($kind => Some(Command::$name(
                        bytemuck::pod_read_unaligned(&bytes[..size_of::<$body>()]),
                    )),)*
                    _ => None,
                }
            }
        }
    };
}

commands! {
    /// Put an actor into the world; the outcome names it.
    Spawn(Spawn) = 1,
    /// Take an actor out of the world, and every bundle on it.
    Destroy(ActorId) = 2,
    /// Put an actor elsewhere, at rest.
    Teleport(Teleport) = 3,
    /// Pedals and wheel; the latest holds.
    Control(VehicleControl) = 4,
    /// Hand an actor to the traffic room, or take it back.
    Autopilot(Autopilot) = 5,
    /// Sun, clouds, rain, fog.
    SetWeather(Weather) = 6,
    /// A new bundle; its `sensor_count` [`Command::Sensor`]s follow at once in the same batch.
    CreateBundle(CreateBundle) = 7,
    /// One sensor of the bundle before it.
    Sensor(SensorSpec) = 8,
    /// Take a bundle away.
    DestroyBundle(BundleId) = 9,
    /// How time passes.
    SetSettings(Settings) = 10,
    /// How traffic drives.
    TrafficParam(TrafficParam) = 11,
    /// Change a vehicle's velocity.
    SetVelocity(SetVelocity) = 12,
    /// Keep a traffic light at one colour, or give it back to traffic's plan.
    SetTrafficLight(SetTrafficLight) = 13,
    /// Let physics move an actor, or teleports and set velocities alone.
    SetPhysics(SetPhysics) = 14,
    /// Switch layers of the town off or on.
    HideLayers(HideLayers) = 15,
    /// Switch things of the town off or on.
    HideObjects(HideObjects) = 16,
    /// Switch a vehicle's lamps.
    SetVehicleLights(SetVehicleLights) = 17,
    /// Open and shut a vehicle's doors.
    SetDoors(SetDoors) = 18,
    /// Tell something of an actor that snapshots do not; the outcome does.
    Ask(Ask) = 30,
    /// Change a vehicle's mass, air and centre of mass.
    SetBody(VehicleBody) = 31,
    /// Change a vehicle's engine.
    SetEngine(VehicleEngine) = 32,
    /// Change a vehicle's gearbox.
    SetGearbox(VehicleGearbox) = 33,
    /// Change how far a vehicle's steering goes at speed.
    SetSteering(VehicleSteering) = 34,
    /// Change one of a vehicle's wheels.
    SetWheel(VehicleWheel) = 35,
    /// ApplyForce or twist an actor, for a moment or a frame.
    ApplyForce(ApplyForce) = 36,
    /// Let an actor fall, or not.
    SetGravity(Switch) = 37,
    /// Let an actor run into others, or not.
    SetCollisions(Switch) = 38,
    /// Drive a vehicle to a speed and a steering angle; the latest of this and pedals holds.
    Ackermann(AckermannControl) = 39,
    /// How a vehicle's controller does that.
    SetAckermann(AckermannSettings) = 40,
    /// Let a walker jump.
    Jump(ActorId) = 41,
    /// Let the sky decide how much wheels grip, or not.
    SetWeatherAffectsGrip(SetWeatherAffectsGrip) = 42,
    /// Send a text by radio, with the next frame.
    Transmit(Transmit) = 43,
    /// Tell a vehicle on autopilot where to go.
    RouteCommand(RouteCommand) = 50,
    /// Draw a shape into the images of cameras; the outcome is a [`ShapeReceipt`], its id a number above
    /// those of all shapes before.
    Draw(Shape) = 44,
    /// Forget what was drawn.
    EraseShapes(EraseShapes) = 45,
    /// Set bones of the pose that a client gives a walker.
    SetBones(SetBones) = 46,
    /// How much of a given pose shows.
    BlendPose(BlendPose) = 47,
    /// Let street lamps shine, or not.
    SetStreetLights(SetStreetLights) = 48,
    /// Write down what happens from the next frame on.
    StartRecorder(StartRecorder) = 100,
    /// Close the recording.
    StopRecorder(Nothing) = 101,
    /// Write everything that decides the future into a file, between two frames.
    SaveState(FilePath) = 102,
    /// Go on from such a file; what happened since is forgotten.
    LoadState(FilePath) = 103,
    /// Show what was recorded, beside those who are there.
    StartReplay(StartReplay) = 104,
    /// End the replay.
    StopReplay(StopReplay) = 105,
    /// Destroy the world and load a map in its place, between two frames. The outcome's id is the
    /// number of the new episode.
    LoadMap(LoadMap) = 106,
}

/// A command that needs no more words.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Nothing {
    /// Zero.
    pub reserved: u64,
}

/// See [`Command::Spawn`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Spawn {
    /// The blueprint's id, as `vehicle.tesla.model3`.
    pub blueprint: Name,
    /// Bits of [`crate::flag`]: `AUTOPILOT`, `KINEMATIC`, `RAGDOLL_ON_HIT`.
    pub flags: u32,
    /// `world_from_actor`. A vehicle is set onto the road below if it is at most 1 m above it.
    pub pose: Pose,
    /// Red, green, blue, 255; 0: the blueprint's own.
    pub color: u32,
    /// What the user calls it: `hero`, `autopilot`.
    pub role: Name,
}

/// See [`Command::Teleport`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Teleport {
    /// Who.
    pub actor_id: ActorId,
    /// `world_from_actor`.
    pub pose: Pose,
}

/// See [`Command::SetVelocity`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SetVelocity {
    /// Who.
    pub actor_id: ActorId,
    /// In world space.
    pub velocity_mps: [f32; 3],
    /// In world space.
    pub angular_velocity_radps: [f32; 3],
}

/// See [`Command::SetTrafficLight`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetTrafficLight {
    /// Which light.
    pub actor_id: ActorId,
    /// 1: it keeps `phase`; 0: it shows what traffic plans.
    pub hold: u32,
    /// One of [`crate::light`].
    pub phase: u32,
}

/// See [`Command::SetPhysics`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetPhysics {
    /// Who.
    pub actor_id: ActorId,
    /// 1: it falls, rolls and is pushed; 0: it is kinematic.
    pub on: u32,
}

/// See [`Command::HideLayers`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HideLayers {
    /// Which: bits of [`layer`].
    pub layers: u32,
    /// 1: nobody sees them or runs into them; 0: they are there again.
    pub hidden: u32,
}

/// Bits of [`HideLayers::layers`].
pub mod layer {
    /// Houses.
    pub const BUILDINGS: u32 = 1 << 0;
    /// Trees, bushes, hedges.
    pub const FOLIAGE: u32 = 1 << 1;
    /// Cars that never move.
    pub const PARKED_VEHICLES: u32 = 1 << 2;
    /// Benches, bins, signs and poles.
    pub const PROPS: u32 = 1 << 3;
    /// Street lamps.
    pub const STREET_LIGHTS: u32 = 1 << 4;
    /// Walls and fences.
    pub const WALLS: u32 = 1 << 5;
    /// All of them.
    pub const ALL: u32 = (1 << 6) - 1;
}

/// See [`Command::HideObjects`]. A thing's number is that of instance images without the highest bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct HideObjects {
    /// The number of the first bit's thing, over 1024.
    pub block: u32,
    /// 1: nobody sees them or runs into them; 0: they are there again, where their layer is.
    pub hidden: u32,
    /// Which of the block's 1024.
    pub bits: [u64; 16],
}

/// See [`Command::SetVehicleLights`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetVehicleLights {
    /// Whose.
    pub actor_id: ActorId,
    /// Bits of [`crate::lamp`]: those that are on.
    pub lamps: u32,
}

/// See [`Command::SetDoors`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetDoors {
    /// Whose.
    pub actor_id: ActorId,
    /// Those that stand open, as [`crate::ActorState::doors`] has them.
    pub open: u32,
}

/// See [`Command::Autopilot`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Autopilot {
    /// Who.
    pub actor_id: ActorId,
    /// 1: traffic drives; 0: the client does.
    pub on: u32,
}

/// See [`Command::CreateBundle`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CreateBundle {
    /// The actor that carries it; nobody: it stands in the world.
    pub parent: ActorId,
    /// How many sensors follow.
    pub sensor_count: u32,
    /// How many bundles a reader may hold at a time, 1 to 8.
    pub max_borrowed: u32,
    /// Zero.
    pub reserved: u32,
    /// What the user calls it.
    pub name: Name,
}

/// See [`Command::SetWeather`]. Percentages as in CARLA.
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
    /// Counter-clockwise from x.
    pub sun_azimuth_rad: f32,
    /// Above the horizon.
    pub sun_altitude_rad: f32,
    /// 0 to 100.
    pub fog_density: f32,
    /// Where the fog begins.
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

/// See [`Command::SetSettings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Settings {
    /// Simulated time of one tick.
    pub delta_nanos: u64,
    /// The longest physics substep.
    pub substep_max_nanos: u64,
    /// 1: the world advances when the ticking client asks; 0: on its own clock.
    pub synchronous: u32,
    /// How many frames rendering may trail: 0 strict, up to [`crate::PIPELINE_MAX`].
    pub pipeline: u32,
    /// Asynchronous: simulated seconds per real second, in thousandths; 0: as fast as it can.
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

/// See [`Command::TrafficParam`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TrafficParam {
    /// Whom it concerns; nobody: everybody.
    pub actor_id: ActorId,
    /// One of [`param`].
    pub param: u32,
    /// In the param's own unit.
    pub value: f32,
}

/// The most steps that one [`RouteCommand`] tells; a longer way takes several.
pub const ROUTE_STEPS: usize = 11;

/// See [`Command::RouteCommand`]. When the last step is done, it goes where it likes again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RouteCommand {
    /// Whom.
    pub actor_id: ActorId,
    /// 1: what it was told before is void; 0: this comes after it.
    pub anew: u32,
    /// How many of `steps` count; with `anew` and no step it goes where it likes.
    pub count: u32,
    /// Zero.
    pub reserved: u32,
    /// One after the other.
    pub steps: [RouteStep; ROUTE_STEPS],
}

/// One thing that a guided vehicle does next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RouteStep {
    /// One of [`guide`].
    pub kind: u32,
    /// Of [`guide::PLACE`]: where, in the world, metres.
    pub position_m: [f32; 3],
}

impl RouteCommand {
    /// A whole way, in as many parts as it takes; none of it: it goes where it likes.
    pub fn way(actor_id: ActorId, steps: &[RouteStep]) -> Vec<RouteCommand> {
        let part = |nth: usize, some: &[RouteStep]| {
            let anew = u32::from(nth == 0);
            let mut guide = RouteCommand {
                actor_id,
                anew,
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
    /// Comes by a place in the world, metres.
    pub fn place(position: Vec3) -> RouteStep {
        RouteStep { kind: guide::PLACE, position_m: position.to_array() }
    }

    /// Does one of the other things of [`guide`].
    pub fn turn(kind: u32) -> RouteStep {
        RouteStep { kind, ..RouteStep::default() }
    }
}

/// Values of [`RouteStep::kind`].
pub mod guide {
    /// Comes by a place: by the nearest lane, over the shortest way.
    pub const PLACE: u32 = 1;
    /// Turns left at the next junction, from whatever lane that is done; if it offers none, takes
    /// its straightest way.
    pub const LEFT: u32 = 2;
    /// Turns right, likewise.
    pub const RIGHT: u32 = 3;
    /// Goes straight on at the next junction.
    pub const STRAIGHT: u32 = 4;
    /// Goes over to the lane on the left, if there is one.
    pub const LANE_LEFT: u32 = 5;
    /// Goes over to the lane on the right, if there is one.
    pub const LANE_RIGHT: u32 = 6;
}

/// Values of [`TrafficParam::param`].
pub mod param {
    /// How much slower than the limit to drive, as a share: 0.3 is 30 % slower, −0.2 faster.
    pub const SPEED_REDUCTION: u32 = 1;
    /// Metres to keep to the one in front, standing.
    pub const GAP_M: u32 = 2;
    /// Share of red lights to ignore.
    pub const IGNORE_LIGHTS: u32 = 3;
    /// Metres per second to drive at whatever the limit is, curves allowing; takes the place of
    /// [`SPEED_REDUCTION`], as that takes its place.
    pub const SPEED_MPS: u32 = 4;
    /// Metres left of the middle of the lane; negative: right of it.
    pub const OFFSET_LEFT_M: u32 = 5;
    /// 1: changes lanes for its own ends, as everybody does; 0: does not.
    pub const CHANGES_LANES: u32 = 6;
    /// To change lanes once, as soon as there is a lane beside, whoever is on it: 1 to the left,
    /// -1 to the right.
    pub const CHANGE_NOW: u32 = 7;
    /// With what probability it changes to the right if that is safe, each time that it thinks of
    /// lanes, which is about every 0.6 s.
    pub const KEEP_RIGHT: u32 = 8;
    /// With what probability it changes to the left, likewise.
    pub const CHANGE_LEFT: u32 = 9;
    /// With what probability it changes to the right, likewise; it adds to [`KEEP_RIGHT`].
    pub const CHANGE_RIGHT: u32 = 10;
    /// Share of stop and yield signs to ignore.
    pub const IGNORE_SIGNS: u32 = 11;
    /// Share of other vehicles to ignore, drawn once for each.
    pub const IGNORE_VEHICLES: u32 = 12;
    /// Share of walkers to ignore, drawn once for each.
    pub const IGNORE_WALKERS: u32 = 13;
    /// Everybody's: random turns and whims are drawn anew from this whole number, 0 to 2^24, and
    /// the seed of the world.
    pub const SEED: u32 = 14;
    /// 1: switches its lamps by itself: indicators, brake lights, and low beam, position and fog
    /// lights as the weather asks.
    pub const LAMPS: u32 = 15;
    /// This and the number of an actor: 1 ignores that one, 0 does not, whatever the shares say.
    pub const IGNORE_ACTOR: u32 = 1 << 31;

    /// The param whose place this one takes.
    pub const fn displaces(param: u32) -> Option<u32> {
        match param {
            SPEED_MPS => Some(SPEED_REDUCTION),
            SPEED_REDUCTION => Some(SPEED_MPS),
            _ => None,
        }
    }

    /// Whether it is turned back by what it does.
    pub const fn is_once(param: u32) -> bool {
        param == CHANGE_NOW
    }

    /// Whether a param of `owner` is void once `gone` is no more.
    pub fn ends_with(owner: super::ActorId, param: u32, gone: super::ActorId) -> bool {
        owner == gone || param == IGNORE_ACTOR.saturating_add(gone.0)
    }
}
