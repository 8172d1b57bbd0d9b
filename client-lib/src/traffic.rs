//! Traffic: how vehicles on autopilot drive, where they go, and what the traffic lights show.

use protocol::ActorId;

use crate::{Actor, ActorKind, Client, ClientError, Command, LightPhase, RouteStep, TrafficParam};

impl Client {
    /// Sets how a vehicle on autopilot drives or a walker walks, or with [`ActorId::NONE`] how all do that were told
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

    /// Gives a walker on autopilot places to walk to one after the other, or a vehicle a route: places that it passes over the shortest way, and turns
    /// that it takes at the junctions that come next. It changes lanes for them where that is safe.
    /// After the last step, and without steps, it chooses its own way.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it does not exist, is neither a vehicle nor a walker, or is a walker
    /// and a step is a turn.
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
