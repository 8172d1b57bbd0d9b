//! What a log contains: its header and its frames, in CARLA's units.

/// Stands for "no actor" where CARLA's log names one.
pub const NO_ACTOR: u32 = u32::MAX;

/// The header of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// The version of the format: 1.
    pub version: u16,
    /// The date of the recording. Seconds since 1970.
    pub date_secs: i64,
    /// The name of the map.
    pub map: String,
}

/// The event of an actor's spawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CreatedActor {
    /// The id of the actor.
    pub id: u32,
    /// 0 other, 1 vehicle, 2 walker, 3 traffic light.
    pub kind: u8,
    /// Position. Centimetres.
    pub location: [f32; 3],
    /// Roll, pitch, yaw. Degrees.
    pub rotation: [f32; 3],
    /// The number of the blueprint.
    pub uid: u32,
    /// The id of the blueprint.
    pub blueprint: String,
    /// Attributes: type, name, value.
    pub attributes: Vec<(u8, String, String)>,
}

impl CreatedActor {
    /// Returns the value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(_, of, _)| of == name).map(|(_, _, value)| value.as_str())
    }
}

/// A collision of two actors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Collision {
    /// The number of the collision in its frame.
    pub id: u32,
    /// The actors; the second may be none, `u32::MAX`.
    pub actors: [u32; 2],
    /// Which of the actors are heroes.
    pub heroes: [bool; 2],
}

/// The pose of an actor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position {
    /// The id of the actor.
    pub id: u32,
    /// Position. Centimetres.
    pub location: [f32; 3],
    /// Roll, pitch, yaw. Degrees.
    pub rotation: [f32; 3],
}

/// The state of a traffic light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrafficLight {
    /// The id of the actor.
    pub id: u32,
    /// The light keeps its phase.
    pub frozen: bool,
    /// How long the light has been in its phase. Seconds.
    pub elapsed_s: f32,
    /// 0 red, 1 yellow, 2 green, 3 off.
    pub state: u8,
}

/// The control of a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleAnimation {
    /// The id of the actor.
    pub id: u32,
    /// Steering, −1 to 1, positive to the right.
    pub steer: f32,
    /// Throttle, 0 to 1.
    pub throttle: f32,
    /// Brake, 0 to 1.
    pub brake: f32,
    /// The handbrake is on.
    pub handbrake: bool,
    /// The gear; −1 is reverse.
    pub gear: i32,
}

/// The velocities of an actor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kinematics {
    /// The id of the actor.
    pub id: u32,
    /// Linear velocity. Metres per second.
    pub velocity: [f32; 3],
    /// Angular velocity. Degrees per second.
    pub spin: [f32; 3],
}

/// What is read of a frame. Other packets of CARLA are skipped.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// The number of the frame, counted from 1.
    pub number: u64,
    /// The duration of the frame. Seconds.
    pub duration_s: f64,
    /// The time since the first frame. Seconds.
    pub elapsed_s: f64,
    /// Actors that were spawned.
    pub created: Vec<CreatedActor>,
    /// Actors that were destroyed.
    pub destroyed: Vec<u32>,
    /// Child and parent of attached actors.
    pub parents: Vec<[u32; 2]>,
    /// Collisions.
    pub collisions: Vec<Collision>,
    /// Poses of all actors.
    pub places: Vec<Position>,
    /// States of traffic lights.
    pub lights: Vec<TrafficLight>,
    /// Controls of vehicles.
    pub pedals: Vec<VehicleAnimation>,
    /// Walkers and their speeds. Centimetres per second.
    pub walkers: Vec<(u32, f32)>,
    /// Vehicles and their lights: bits of CARLA's `VehicleLightState`.
    pub lamps: Vec<(u32, u32)>,
    /// Vehicles, one of their doors, and whether it is open.
    pub doors: Vec<(u32, u8, bool)>,
    /// Velocities of all actors.
    pub motions: Vec<Kinematics>,
}
