//! Who is in the world, as CARLA's clients know it: the bus's actors, and those that live here
//! alone: the spectator, sensors, signs, controllers.

use std::collections::{BTreeMap, btree_map::Entry};

use client_lib::{ActorId, BlueprintInfo, Pose, World, wire::ActorState};
use road::Network;

use crate::{
    args::Refusal,
    blueprints,
    sensor::Sensor,
    stream,
    wire::{Actor, Attribute, Bounds, Description},
};

/// Where the ids of actors begin that are not on the bus.
const OWN: u32 = 1 << 24;
/// The free camera that every episode has.
pub(crate) const SPECTATOR: u32 = OWN;
/// CARLA's tag of what is none of the others.
const OTHER: u8 = 22;
const TRAFFIC_SIGN: u8 = 8;

/// An actor that is not on the bus.
pub(crate) struct Own {
    /// 0: nobody.
    pub(crate) parent: u32,
    /// In the parent's space, or in the world's.
    pub(crate) pose: Pose,
    /// OpenDRIVE's id of a sign.
    pub(crate) sign: String,
    pub(crate) sensor: Option<Box<Sensor>>,
}

/// Everybody.
pub(crate) struct Cast {
    known: BTreeMap<u32, Actor>,
    pub(crate) own: BTreeMap<u32, Own>,
    last_own: u32,
    last_stream: u32,
    stream_port: u16,
}

impl Cast {
    /// The spectator and the map's signs.
    pub(crate) fn new(network: &Network, stream_port: u16) -> Cast {
        Cast::after(stream::WORLD, network, stream_port)
    }

    /// The same for another map. Streams count on: who still listens to an old one hears nothing.
    pub(crate) fn in_world_of(&self, network: &Network) -> Cast {
        Cast::after(self.last_stream, network, self.stream_port)
    }

    fn after(last_stream: u32, network: &Network, stream_port: u16) -> Cast {
        let mut cast = Cast {
            known: BTreeMap::new(),
            own: BTreeMap::new(),
            last_own: OWN - 1,
            last_stream,
            stream_port,
        };
        let description =
            Description { uid: 0, id: "spectator".to_owned(), attributes: Vec::new() };
        cast.add_own(description, 0, Pose::IDENTITY, None);
        for signal in network.signals().iter().filter(|s| !s.dynamic) {
            let Some(id) = sign_type(signal) else { continue };
            let description = Description { uid: 0, id, attributes: Vec::new() };
            let turn = signal.pose.rotation().as_quat();
            let pose = Pose::new(signal.pose.position.as_vec3(), turn);
            let id = cast.add_own(description, 0, pose, None);
            if let Some(own) = cast.own.get_mut(&id) {
                own.sign.clone_from(&signal.id);
            }
            if let Some(actor) = cast.known.get_mut(&id) {
                actor.tag = TRAFFIC_SIGN;
            }
        }
        cast
    }

    /// An actor that is not on the bus.
    pub(crate) fn add_own(
        &mut self,
        description: Description,
        parent: u32,
        pose: Pose,
        sensor: Option<Box<Sensor>>,
    ) -> u32 {
        self.last_own += 1;
        let id = self.last_own;
        let token = sensor.as_ref().and_then(|s| s.is_streamed().then_some(s.stream));
        let token = token.map(|stream| stream::token(stream, self.stream_port));
        let bounds = Bounds { actor: id, ..Bounds::default() };
        self.known.insert(id, Actor { id, parent, description, bounds, tag: OTHER, token });
        self.own.insert(id, Own { parent, pose, sign: String::new(), sensor });
        id
    }

    /// A number for a stream.
    pub(crate) fn next_stream(&mut self) -> u32 {
        self.last_stream += 1;
        self.last_stream
    }

    /// An actor of the bus that one of CARLA's clients spawned.
    pub(crate) fn add(&mut self, id: u32, description: Description, info: &BlueprintInfo) {
        self.known.insert(id, on_bus(id, description, info));
    }

    /// An actor as clients hold it.
    pub(crate) fn actor(
        &mut self,
        id: u32,
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Option<&Actor> {
        if let Entry::Vacant(room) = self.known.entry(id) {
            let state = world.state(ActorId(id))?;
            let info = blueprints.get(state.blueprint as usize)?;
            room.insert(on_bus(id, describe(state, info), info));
        }
        self.known.get(&id)
    }

    /// An actor that was asked for before, or lives here.
    pub(crate) fn known(&self, id: u32) -> Option<&Actor> {
        self.known.get(&id)
    }

    /// Forgets an actor; says which of our own went with it.
    pub(crate) fn remove(&mut self, id: u32) -> Vec<Own> {
        self.known.remove(&id);
        let mut gone: Vec<Own> = self.own.remove(&id).into_iter().collect();
        let children: Vec<u32> =
            self.own.iter().filter(|(_, own)| own.parent == id).map(|(id, _)| *id).collect();
        for child in children {
            gone.extend(self.remove(child));
        }
        gone
    }

    /// Forgets the bus's actors that are in the world no more; says which of our own went along.
    pub(crate) fn forget_gone(
        &mut self,
        world: &World,
        spawned: &BTreeMap<u32, (u64, Pose)>,
    ) -> Vec<Own> {
        let is_gone =
            |id: u32| id < OWN && world.state(ActorId(id)).is_none() && !spawned.contains_key(&id);
        let gone: Vec<u32> = self.known.keys().copied().filter(|id| is_gone(*id)).collect();
        let parents = self.own.values().map(|own| own.parent);
        let orphaned: Vec<u32> = parents.filter(|id| *id != 0 && is_gone(*id)).collect();
        gone.into_iter().chain(orphaned).flat_map(|id| self.remove(id)).collect()
    }

    /// Where one of our own is, in the world, and how fast its carrier moves.
    pub(crate) fn place(&self, own: &Own, world: &World) -> (Pose, [f32; 3]) {
        if let Some(carrier) = self.own.get(&own.parent) {
            return (carrier.pose.then(&own.pose), [0.0; 3]);
        }
        match world.state(ActorId(own.parent)) {
            Some(carrier) => (carrier.pose.then(&own.pose), carrier.velocity_mps),
            None => (own.pose, [0.0; 3]),
        }
    }

    /// The sensor whose measurements go into this stream.
    pub(crate) fn sensor_of(&self, stream: u32) -> Option<u32> {
        let of = |own: &Own| own.sensor.as_ref().is_some_and(|s| s.stream == stream);
        self.own.iter().find(|(_, own)| of(own)).map(|(id, _)| *id)
    }

    /// Whether this actor, if it is there at all, is not on the bus.
    pub(crate) fn is_own(id: u32) -> bool {
        id >= OWN
    }

    /// One of our own, by id.
    pub(crate) fn own_mut(&mut self, id: u32) -> Result<&mut Own, Refusal> {
        self.own.get_mut(&id).ok_or_else(|| "Actor could not be found in the registry".into())
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

/// What a stranger's actor was made from, as far as a snapshot tells.
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

/// CARLA's name of a sign, by the German catalogue that OpenDRIVE's maps use.
fn sign_type(signal: &road::Signal) -> Option<String> {
    match signal.kind.as_str() {
        "206" => Some("traffic.stop".to_owned()),
        "205" => Some("traffic.yield".to_owned()),
        "274" => {
            let named = signal.subtype.parse().ok().filter(|v| *v > 0.0);
            let limit = signal.value.or(named).unwrap_or(30.0);
            Some(format!("traffic.speed_limit.{}", limit.round()))
        }
        _ => None,
    }
}
