//! Traffic: how vehicles on autopilot drive, where they go, and what the traffic lights show.

use glam::Vec3;
use protocol::{ActorId, param, route_step};

use crate::{Actor, ActorKind, Client, ClientError, Command, LightPhase};

/// How a vehicle on autopilot drives: see [`Client::set_traffic_param`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TrafficParam {
    /// How much slower than the speed limit it drives, as a share: 0.3 is 30 % slower, −0.2 is 20 %
    /// faster. Replaces [`TrafficParam::SpeedMps`].
    SpeedReduction(f32),
    /// The speed that it drives at whatever the limit is, curves allowing, m/s. Replaces
    /// [`TrafficParam::SpeedReduction`].
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
    /// The seed of all random decisions, 0 to 2^24; with [`ActorId::NONE`] only.
    Seed(u32),
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
            TrafficParam::Seed(seed) => (param::SEED, seed as f32),
        };
        protocol::TrafficParam { actor_id, param, value }
    }
}

/// One step of a route: see [`Client::set_route`].
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

impl Client {
    /// Sets how a vehicle on autopilot drives, or with [`ActorId::NONE`] how all do that were told
    /// nothing themselves.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the value is not finite.
    pub fn set_traffic_param(
        &mut self,
        actor_id: ActorId,
        param: TrafficParam,
    ) -> Result<(), ClientError> {
        self.request_one("traffic_param", Command::set_traffic_param(actor_id, param).0).map(drop)
    }

    /// Gives a vehicle on autopilot a route: places that it passes over the shortest way, and turns
    /// that it takes at the junctions that come next. It changes lanes for them where that is safe.
    /// After the last step, and without steps, it chooses its own way.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist, is no vehicle, or a place is not on the map.
    pub fn set_route(&mut self, actor_id: ActorId, steps: &[RouteStep]) -> Result<(), ClientError> {
        let steps: Vec<protocol::RouteStep> = steps.iter().map(|step| (*step).into()).collect();
        let parts = protocol::RouteCommand::route(actor_id, &steps).into_iter();
        let commands: Vec<_> = parts.map(protocol::Command::RouteCommand).collect();
        self.request("route", &commands).map(drop)
    }

    /// Holds a traffic light at a phase until [`Client::release_light`]: one lamp box. All boxes of
    /// a signal, and all signals that switch together, are in its [`Client::light_group`].
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it is no traffic light.
    pub fn hold_light(&mut self, actor_id: ActorId, phase: LightPhase) -> Result<(), ClientError> {
        self.request_one("hold_light", Command::hold_light(actor_id, phase).0).map(drop)
    }

    /// Lets a traffic light show what traffic plans.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it is no traffic light.
    pub fn release_light(&mut self, actor_id: ActorId) -> Result<(), ClientError> {
        self.request_one("release_light", Command::release_light(actor_id).0).map(drop)
    }

    /// The traffic lights of the world: one actor for each lamp box, sorted by id.
    pub fn traffic_lights(&self) -> impl Iterator<Item = &Actor> {
        self.world().actors().iter().filter(|actor| actor.kind() == ActorKind::TrafficLight)
    }

    /// The traffic lights that are switched together with one, itself among them: those whose
    /// signals have the same controller in the map. Empty if `actor_id` is no traffic light.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn light_group(&self, actor_id: ActorId) -> Result<Vec<ActorId>, ClientError> {
        let map = self.map()?;
        let signal = |actor: &Actor| actor.traffic_light().map(|light| light.signal);
        let controller =
            |signal: usize| map.signals().get(signal).and_then(|signal| signal.controller);
        let Some(own) = self.world().actor(actor_id).and_then(signal) else {
            return Ok(Vec::new());
        };
        let is_with = |other: &Actor| {
            signal(other).is_some_and(|other| {
                other == own || (controller(own).is_some() && controller(other) == controller(own))
            })
        };
        Ok(self.traffic_lights().filter(|light| is_with(light)).map(Actor::id).collect())
    }
}
