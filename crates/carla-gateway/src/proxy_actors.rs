//! The actors that CARLA's clients know: those of the bus, and proxies, which exist only in the
//! gateway: the spectator, sensors, traffic signs and controllers.

use std::collections::{BTreeMap, btree_map::Entry};

use client_lib::{
    ActorId, BlueprintInfo, Pose, World,
    wire::{ActorState, kind},
};
use road::Network;

use crate::{
    args::RpcError,
    blueprints,
    sensor::Sensor,
    stream,
    trigger_volumes::{self, SignalPlace},
    wire::{Actor, Attribute, Bounds, Description},
};

/// The first id of proxies. Actors of the bus have smaller ones.
const FIRST_PROXY: u32 = 1 << 24;
/// Most proxies, traffic signs included.
pub(crate) const PROXIES_MAX: usize = 1 << 14;
/// Largest coordinate of the pose of a proxy, in the world or on its parent. Metres.
pub(crate) const PROXY_MAX_M: f32 = 1e5;
/// The id of the spectator, the free camera that every episode has.
pub(crate) const SPECTATOR: u32 = FIRST_PROXY;
/// CARLA's tag "other".
const OTHER: u8 = 22;
const TRAFFIC_SIGN: u8 = 8;

/// An actor that exists only in the gateway.
pub(crate) struct Proxy {
    /// The id of the parent; 0: none.
    pub(crate) parent: u32,
    /// `parent_from_actor`, or `world_from_actor` without a parent.
    pub(crate) pose: Pose,
    /// The OpenDRIVE id of a traffic sign; empty for other proxies.
    pub(crate) sign: String,
    pub(crate) sensor: Option<Box<Sensor>>,
}

/// All actors as clients know them.
pub(crate) struct ProxyActors {
    known: BTreeMap<u32, Actor>,
    pub(crate) proxies: BTreeMap<u32, Proxy>,
    /// By signal: where it is and where it applies to vehicles.
    signals: Vec<SignalPlace>,
    last_proxy: u32,
    stream_port: u16,
}

impl ProxyActors {
    /// Creates those of another map.
    pub(crate) fn for_map(&self, network: &Network) -> ProxyActors {
        ProxyActors::new(network, self.stream_port)
    }

    /// Creates the spectator and the traffic signs of a map.
    pub(crate) fn new(network: &Network, stream_port: u16) -> ProxyActors {
        let mut actors = ProxyActors {
            known: BTreeMap::new(),
            proxies: BTreeMap::new(),
            signals: network.signals().iter().map(|s| SignalPlace::new(network, s)).collect(),
            last_proxy: FIRST_PROXY - 1,
            stream_port,
        };
        let description =
            Description { uid: 0, id: "spectator".to_owned(), attributes: Vec::new() };
        actors.add_proxy(description, 0, Pose::IDENTITY, None);
        for (index, signal) in network.signals().iter().enumerate().filter(|(_, s)| !s.dynamic) {
            let Some(id) = sign_type(signal) else { continue };
            let description = Description { uid: 0, id, attributes: Vec::new() };
            let id = actors.add_proxy(description, 0, actors.signals[index].pose, None);
            if let Some(proxy) = actors.proxies.get_mut(&id) {
                proxy.sign.clone_from(&signal.id);
            }
            if let Some(actor) = actors.known.get_mut(&id) {
                actor.tag = TRAFFIC_SIGN;
                actor.bounds = actors.signals[index].bounds(id).unwrap_or(actor.bounds);
            }
        }
        actors
    }

    /// Adds a proxy and returns its id.
    pub(crate) fn add_proxy(
        &mut self,
        description: Description,
        parent: u32,
        pose: Pose,
        sensor: Option<Box<Sensor>>,
    ) -> u32 {
        self.last_proxy += 1;
        let id = self.last_proxy;
        let token = sensor.as_ref().and_then(|s| s.is_streamed().then_some(s.stream));
        let token = token.map(|stream| stream::token(stream, self.stream_port));
        let bounds = Bounds { actor: id, ..Bounds::default() };
        self.known.insert(id, Actor { id, parent, description, bounds, tag: OTHER, token });
        self.proxies.insert(id, Proxy { parent, pose, sign: String::new(), sensor });
        id
    }

    /// Adds an actor of the bus that a client of this server has spawned.
    pub(crate) fn add(&mut self, id: u32, description: Description, info: &BlueprintInfo) {
        self.known.insert(id, on_bus(id, description, info));
    }

    /// Returns an actor as clients know it; describes it first if that has not been done yet.
    pub(crate) fn actor(
        &mut self,
        id: u32,
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Option<&Actor> {
        if let Entry::Vacant(room) = self.known.entry(id) {
            let state = world.state(ActorId(id))?;
            let info = blueprints.get(state.blueprint as usize)?;
            let mut actor = on_bus(id, describe(state, info), info);
            if state.kind == kind::TRAFFIC_LIGHT {
                let place = self.signals.get(state.signal as usize);
                actor.bounds = place.and_then(|place| place.bounds(id)).unwrap_or(actor.bounds);
            }
            room.insert(actor);
        }
        self.known.get(&id)
    }

    /// Returns a proxy, or an actor of the bus that was described before.
    pub(crate) fn known(&self, id: u32) -> Option<&Actor> {
        self.known.get(&id)
    }

    /// Removes an actor, and returns the proxies that are removed with it.
    pub(crate) fn remove(&mut self, id: u32) -> Vec<Proxy> {
        self.known.remove(&id);
        let mut gone: Vec<Proxy> = self.proxies.remove(&id).into_iter().collect();
        let children: Vec<u32> = self
            .proxies
            .iter()
            .filter(|(_, proxy)| proxy.parent == id)
            .map(|(id, _)| *id)
            .collect();
        for child in children {
            gone.extend(self.remove(child));
        }
        gone
    }

    /// Removes the actors of the bus that a snapshot does not contain and that are not expected to
    /// be missing, and returns the proxies that are removed with them.
    pub(crate) fn remove_absent(
        &mut self,
        world: &World,
        is_expected: impl Fn(u32) -> bool,
    ) -> Vec<Proxy> {
        let is_gone =
            |id: u32| id < FIRST_PROXY && world.state(ActorId(id)).is_none() && !is_expected(id);
        let gone: Vec<u32> = self.known.keys().copied().filter(|id| is_gone(*id)).collect();
        let parents = self.proxies.values().map(|proxy| proxy.parent);
        let orphaned: Vec<u32> = parents.filter(|id| *id != 0 && is_gone(*id)).collect();
        gone.into_iter().chain(orphaned).flat_map(|id| self.remove(id)).collect()
    }

    /// Returns the pose of a proxy in the world and the velocity of its parent.
    pub(crate) fn pose_and_velocity(&self, proxy: &Proxy, world: &World) -> (Pose, [f32; 3]) {
        if let Some(carrier) = self.proxies.get(&proxy.parent) {
            return (carrier.pose.then(&proxy.pose), [0.0; 3]);
        }
        match world.state(ActorId(proxy.parent)) {
            Some(carrier) => (carrier.pose.then(&proxy.pose), carrier.velocity_mps),
            None => (proxy.pose, [0.0; 3]),
        }
    }

    /// Returns the pose of a traffic light as clients see it.
    pub(crate) fn light_pose(&self, light: &ActorState) -> Pose {
        self.signals.get(light.signal as usize).map_or(light.pose, |place| place.pose)
    }

    /// Returns the sensor whose measurements a stream contains.
    pub(crate) fn sensor_of(&self, stream: u32) -> Option<u32> {
        let of = |proxy: &Proxy| proxy.sensor.as_ref().is_some_and(|s| s.stream == stream);
        self.proxies.iter().find(|(_, proxy)| of(proxy)).map(|(id, _)| *id)
    }

    /// Returns whether an id is one of a proxy.
    pub(crate) fn is_proxy(id: u32) -> bool {
        id >= FIRST_PROXY
    }

    /// Returns a proxy by id.
    ///
    /// # Errors
    ///
    /// Returns CARLA's error for an unknown id.
    pub(crate) fn proxy_mut(&mut self, id: u32) -> Result<&mut Proxy, RpcError> {
        self.proxies.get_mut(&id).ok_or_else(|| "Actor could not be found in the registry".into())
    }
}

fn on_bus(id: u32, description: Description, info: &BlueprintInfo) -> Actor {
    let bounds = Bounds {
        center_m: info.center_m,
        half_extents_m: info.half_extents_m,
        yaw_rad: 0.0,
        actor: id,
    };
    Actor { id, parent: 0, description, bounds, tag: info.tag, token: None }
}

/// Returns the description of an actor that another client of the bus has spawned, as far as a
/// snapshot contains it.
fn describe(state: &ActorState, info: &BlueprintInfo) -> Description {
    let plain = || Description { uid: 0, id: info.id.clone(), attributes: Vec::new() };
    let mut description =
        blueprints::definition(&info.id).map_or_else(plain, |found| found.describe());
    let [r, g, b, _] = state.color.to_le_bytes();
    for Attribute { id, value, .. } in &mut description.attributes {
        if id == "color" {
            *value = format!("{r},{g},{b}");
        }
    }
    description
}

/// Returns CARLA's blueprint of a traffic sign, by the German catalogue that OpenDRIVE maps use.
fn sign_type(signal: &road::Signal) -> Option<String> {
    match signal.kind.as_str() {
        "206" => Some("traffic.stop".to_owned()),
        "205" => Some("traffic.yield".to_owned()),
        _ => {
            let limit = trigger_volumes::speed_sign_kmh(signal)?;
            Some(format!("traffic.speed_limit.{}", limit.round()))
        }
    }
}
