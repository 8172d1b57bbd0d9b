//! Parameters and routes of vehicles and walkers on autopilot.

use glam::Vec3;
use protocol::{ActorId, param, route_step};

/// How a vehicle on autopilot drives, or a walker walks: see [`Client::set_traffic_param`](crate::Client::set_traffic_param).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TrafficParam {
    /// How much slower than the speed limit it drives, as a share: 0.3 is 30 % slower, −0.2 is 20 %
    /// faster. Replaces [`TrafficParam::SpeedMps`].
    SpeedReduction(f32),
    /// The speed that it drives at whatever the limit is, curves allowing, m/s. Replaces
    /// [`TrafficParam::SpeedReduction`]. Of a walker: the speed at which it walks.
    SpeedMps(f32),
    /// The distance to the standing vehicle in front, m.
    GapM(f32),
    /// The offset from the middle of the lane, positive to the left, m.
    OffsetLeftM(f32),
    /// Whether it changes lanes by itself.
    ChangesLanes(bool),
    /// Changes to the lane on the left once, as soon as there is one.
    ChangeLeftNow,
    /// Changes to the lane on the right once, as soon as there is one.
    ChangeRightNow,
    /// The probability of a change to the right where that is safe, about every 0.6 s.
    KeepRight(f32),
    /// The probability of a change to the left, about every 0.6 s.
    ChangeLeft(f32),
    /// The probability of a change to the right, about every 0.6 s; adds to
    /// [`TrafficParam::KeepRight`].
    ChangeRight(f32),
    /// The share of red lights that it ignores.
    IgnoreLights(f32),
    /// The share of stop and yield signs that it ignores.
    IgnoreSigns(f32),
    /// The share of other vehicles that it ignores, drawn once for each.
    IgnoreVehicles(f32),
    /// The share of walkers that it ignores, drawn once for each.
    IgnoreWalkers(f32),
    /// Ignores one actor, or no longer, whatever the shares say.
    IgnoreActor(ActorId, bool),
    /// Whether it switches its lights by itself.
    AutomaticLights(bool),
    /// By how much drivers differ: 0 not at all, 1 as in the field (the default), up to 3; with
    /// [`ActorId::NONE`] only.
    DriverSpread(f32),
    /// The seed of all random decisions of vehicles, 0 to 2^24; with [`ActorId::NONE`] only.
    Seed(u32),
    /// The share of walkers that cross quiet streets away from crosswalks, 0 by default; with
    /// [`ActorId::NONE`] only.
    CrossFactor(f32),
    /// The seed of all random decisions of walkers, 0 to 2^24; with [`ActorId::NONE`] only.
    WalkerSeed(u32),
    /// Whether vehicles on autopilot that are far from every hero, every actor with sensors and every
    /// vehicle that a client drives are moved by a kinematic model; with [`ActorId::NONE`] only.
    HybridPhysics(bool),
    /// The distance from which on they are, 50 m by default; with [`ActorId::NONE`] only.
    HybridRadiusM(f32),
    /// The walker with which a walker goes, side by side; [`ActorId::NONE`] ends it.
    WalksWith(ActorId),
}

impl TrafficParam {
    pub(crate) fn to_wire(self, actor_id: ActorId) -> protocol::TrafficParam {
        let share = |is_set: bool| f32::from(u8::from(is_set));
        let (param, value) = match self {
            TrafficParam::SpeedReduction(value) => (param::SPEED_REDUCTION, value),
            TrafficParam::SpeedMps(value) => (param::SPEED_MPS, value),
            TrafficParam::GapM(value) => (param::GAP_M, value),
            TrafficParam::OffsetLeftM(value) => (param::OFFSET_LEFT_M, value),
            TrafficParam::ChangesLanes(on) => (param::CHANGES_LANES, share(on)),
            TrafficParam::ChangeLeftNow => (param::CHANGE_NOW, 1.0),
            TrafficParam::ChangeRightNow => (param::CHANGE_NOW, -1.0),
            TrafficParam::KeepRight(value) => (param::KEEP_RIGHT, value),
            TrafficParam::ChangeLeft(value) => (param::CHANGE_LEFT, value),
            TrafficParam::ChangeRight(value) => (param::CHANGE_RIGHT, value),
            TrafficParam::IgnoreLights(value) => (param::IGNORE_LIGHTS, value),
            TrafficParam::IgnoreSigns(value) => (param::IGNORE_SIGNS, value),
            TrafficParam::IgnoreVehicles(value) => (param::IGNORE_VEHICLES, value),
            TrafficParam::IgnoreWalkers(value) => (param::IGNORE_WALKERS, value),
            TrafficParam::IgnoreActor(other, on) => (param::IGNORE_ACTOR + other.0, share(on)),
            TrafficParam::AutomaticLights(on) => (param::LAMPS, share(on)),
            TrafficParam::DriverSpread(value) => (param::DRIVER_SPREAD, value),
            TrafficParam::Seed(seed) => (param::SEED, seed as f32),
            TrafficParam::CrossFactor(value) => (param::CROSS_FACTOR, value),
            TrafficParam::WalkerSeed(seed) => (param::WALKER_SEED, seed as f32),
            TrafficParam::HybridPhysics(on) => (param::HYBRID_PHYSICS, share(on)),
            TrafficParam::HybridRadiusM(value) => (param::HYBRID_RADIUS_M, value),
            TrafficParam::WalksWith(other) => (param::WALKS_WITH, other.0 as f32),
        };
        protocol::TrafficParam { actor_id, param, value }
    }
}

/// One step of a route: see [`Client::set_route`](crate::Client::set_route).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RouteStep {
    /// Passes a place in world space (metres) on the nearest lane, over the shortest way.
    Place(Vec3),
    /// Turns left at the next junction; where that is not possible, takes the straightest way.
    Left,
    /// Turns right at the next junction; where that is not possible, takes the straightest way.
    Right,
    /// Goes straight on at the next junction.
    Straight,
    /// Changes to the lane on the left, if there is one.
    LaneLeft,
    /// Changes to the lane on the right, if there is one.
    LaneRight,
}

impl From<RouteStep> for protocol::RouteStep {
    fn from(step: RouteStep) -> protocol::RouteStep {
        match step {
            RouteStep::Place(position) => protocol::RouteStep::place(position),
            RouteStep::Left => protocol::RouteStep::turn(route_step::LEFT),
            RouteStep::Right => protocol::RouteStep::turn(route_step::RIGHT),
            RouteStep::Straight => protocol::RouteStep::turn(route_step::STRAIGHT),
            RouteStep::LaneLeft => protocol::RouteStep::turn(route_step::LANE_LEFT),
            RouteStep::LaneRight => protocol::RouteStep::turn(route_step::LANE_RIGHT),
        }
    }
}
