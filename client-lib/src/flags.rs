//! Enumerations and bit flags of the typed interface, over the numbers of the protocol.

use bitflags::bitflags;
use protocol::{flag, kind, lamp, layer, light, output};

/// The kind of an actor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ActorKind {
    /// A car, truck, bus, motorcycle or bicycle.
    Vehicle,
    /// A pedestrian.
    Walker,
    /// A lamp box of a traffic light of the map.
    TrafficLight,
    /// Anything else that can be spawned.
    Prop,
}

impl ActorKind {
    pub(crate) fn from_wire(code: u32) -> ActorKind {
        match code {
            kind::VEHICLE => ActorKind::Vehicle,
            kind::WALKER => ActorKind::Walker,
            kind::TRAFFIC_LIGHT => ActorKind::TrafficLight,
            _ => ActorKind::Prop,
        }
    }
}

/// What a traffic light shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum LightPhase {
    /// Stop.
    Red = light::RED,
    /// Stop if that is possible safely.
    Yellow = light::YELLOW,
    /// Go.
    Green = light::GREEN,
    /// Dark: the priority signs apply.
    Off = light::OFF,
}

impl LightPhase {
    pub(crate) fn from_wire(code: u32) -> LightPhase {
        match code {
            light::RED => LightPhase::Red,
            light::YELLOW => LightPhase::Yellow,
            light::GREEN => LightPhase::Green,
            _ => LightPhase::Off,
        }
    }
}

bitflags! {
    /// States of an actor.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct ActorFlags: u32 {
        /// Traffic drives it.
        const AUTOPILOT = flag::AUTOPILOT;
        /// Physics does not move it.
        const KINEMATIC = flag::KINEMATIC;
        /// It touched something during this frame.
        const COLLIDING = flag::COLLIDING;
        /// Its handbrake is on.
        const HANDBRAKE = flag::HANDBRAKE;
        /// Its reverse gear is engaged.
        const REVERSE = flag::REVERSE;
        /// A teleport set its pose in this frame.
        const TELEPORTED = flag::TELEPORTED;
        /// A traffic light that a client holds at a phase.
        const FROZEN = flag::FROZEN;
        /// A walker that falls when it is hit.
        const RAGDOLL_ON_HIT = flag::RAGDOLL_ON_HIT;
        /// A walker that shows some of a pose that a client set.
        const POSED = flag::POSED;
        /// A walker that is destroyed 10 s after it fell.
        const REMOVED_AFTER_FALL = flag::REMOVED_AFTER_FALL;
        /// A vehicle whose engine has stopped for good.
        const DEAD = flag::DEAD;
        /// A walker that stands up 5 s after it fell.
        const GETS_UP_AFTER_FALL = flag::GETS_UP_AFTER_FALL;
        /// A kinematic prop that a moving actor makes dynamic by touching it.
        const RELEASED_ON_HIT = flag::RELEASED_ON_HIT;
    }

    /// Lights of a vehicle that are switched on: CARLA's `VehicleLightState`.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct VehicleLights: u32 {
        /// Position lights.
        const POSITION = lamp::POSITION;
        /// Low beam.
        const LOW_BEAM = lamp::LOW_BEAM;
        /// High beam.
        const HIGH_BEAM = lamp::HIGH_BEAM;
        /// Brake lights, independent of the pedal.
        const BRAKE = lamp::BRAKE;
        /// Right indicators.
        const RIGHT_BLINKER = lamp::RIGHT_BLINKER;
        /// Left indicators.
        const LEFT_BLINKER = lamp::LEFT_BLINKER;
        /// Reversing lights, independent of the gear.
        const REVERSE = lamp::REVERSE;
        /// Fog lights.
        const FOG = lamp::FOG;
        /// Interior lights.
        const INTERIOR = lamp::INTERIOR;
        /// Beacons of emergency vehicles.
        const SPECIAL1 = lamp::SPECIAL1;
        /// Further beacons.
        const SPECIAL2 = lamp::SPECIAL2;
    }

    /// Doors of a vehicle that are open.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Doors: u32 {
        /// Front left.
        const FRONT_LEFT = 1 << 0;
        /// Front right.
        const FRONT_RIGHT = 1 << 1;
        /// Rear left.
        const REAR_LEFT = 1 << 2;
        /// Rear right.
        const REAR_RIGHT = 1 << 3;
    }

    /// Layers of the town that can be hidden.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Layers: u32 {
        /// Buildings.
        const BUILDINGS = layer::BUILDINGS;
        /// Trees, bushes and hedges.
        const FOLIAGE = layer::FOLIAGE;
        /// Parked vehicles, which never move.
        const PARKED_VEHICLES = layer::PARKED_VEHICLES;
        /// Benches, bins, signs and poles.
        const PROPS = layer::PROPS;
        /// Street lights.
        const STREET_LIGHTS = layer::STREET_LIGHTS;
        /// Walls and fences.
        const WALLS = layer::WALLS;
    }

    /// Images that a camera gives.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct CameraOutputs: u32 {
        /// Red, green, blue, 255; sRGB, 4 bytes a pixel.
        const COLOR = output::COLOR;
        /// Metres along the optical axis, f32.
        const DEPTH = output::DEPTH;
        /// CARLA's semantic tag, u8.
        const TAG = output::TAG;
        /// Actor id, or static object id with the top bit set, u32.
        const INSTANCE = output::INSTANCE;
        /// Unit normal of the surface in sensor space, 3 f32.
        const NORMAL = output::NORMAL;
        /// Motion in the image since the frame before, 2 f32, pixels to the right and down.
        const FLOW = output::FLOW;
    }

    /// What a lidar gives for each ray.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct LidarOutputs: u32 {
        /// x, y, z in sensor space in metres, and the
        /// [`PointAttribute`](crate::PointAttribute), 4 f32.
        const POINTS = output::POINTS;
        /// Instance and tag, 2 u32.
        const LABELS = output::LABELS;
        /// As [`LidarOutputs::POINTS`], of the last return of each ray, or of the second strongest if the
        /// last is the strongest.
        const LAST_POINTS = output::LAST_POINTS;
        /// Instance and tag of these.
        const LAST_LABELS = output::LAST_LABELS;
    }
}

impl From<CameraOutputs> for u32 {
    fn from(outputs: CameraOutputs) -> u32 {
        outputs.bits()
    }
}

impl From<LidarOutputs> for u32 {
    fn from(outputs: LidarOutputs) -> u32 {
        outputs.bits()
    }
}

impl From<Layers> for u32 {
    fn from(layers: Layers) -> u32 {
        layers.bits()
    }
}
