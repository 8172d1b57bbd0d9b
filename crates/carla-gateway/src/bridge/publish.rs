//! Sends snapshots and measurements to the listeners of streams.

use std::{sync::Arc, time::Instant};

use client_lib::{
    ActorId, Client, Measurement,
    wire::{ActorState, kind},
};

use crate::{
    args::RpcError,
    bridge::episode_state::EpisodeState,
    physics_messages,
    proxy_actors::SPECTATOR,
    rendered_messages::Rendered,
    state::{Moment, StateMessage},
    statics::Statics,
    stream::{Streams, WORLD},
};

/// The state of publication: the last published frame, and the start of the platform clock.
pub(crate) struct Publisher {
    frame: u64,
    started: Instant,
}

impl Publisher {
    /// Creates a publisher whose platform clock starts now.
    pub(crate) fn new() -> Publisher {
        Publisher { frame: 0, started: Instant::now() }
    }

    /// Returns the last frame that was published.
    pub(crate) fn frame(&self) -> u64 {
        self.frame
    }

    /// Sends the newest snapshot to the listeners of the world's stream.
    pub(crate) fn state(&mut self, client: &Client, episode: &mut EpisodeState, to: &Streams) {
        let world = client.world();
        let header = world.header();
        self.frame = header.stamp.frame.0;
        episode.spawned.expire(self.frame);
        let spawned = &episode.spawned;
        drop(episode.actors.remove_absent(world, |id| spawned.contains(id)));
        let exists = |id| world.state(ActorId(id)).is_some() || spawned.contains(id);
        episode.motions.keep_walkers(exists);
        episode.traffic_lights.follow(world);
        episode.road_contexts.follow(world);
        episode.rollovers.follow(world);
        let moment = Moment {
            frame: self.frame,
            sim_time_nanos: header.stamp.sim_time_nanos,
            delta_nanos: header.delta_nanos.max(1),
            episode: episode.number,
            platform_secs: self.started.elapsed().as_secs_f64(),
            is_new_map: std::mem::take(&mut episode.is_new_map),
            has_new_lights: std::mem::take(&mut episode.has_new_lights),
        };
        let proxies = &mut episode.actors.proxies;
        if let Some(pose) = episode.replayer.spectator(world)
            && let Some(spectator) = proxies.get_mut(&SPECTATOR)
        {
            spectator.pose = pose;
        }
        let spectator = proxies.get(&SPECTATOR).map_or_else(Default::default, |s| s.pose);
        let count = world.states().len() + proxies.len();
        let mut state = StateMessage::new(&moment, &spectator, count);
        for actor in world.states() {
            match actor.kind {
                kind::TRAFFIC_LIGHT => {
                    let (sign, pole, timing) = episode.traffic_lights.of(actor, &moment);
                    let pose = episode.actors.light_pose(actor);
                    let phase = episode.traffic_lights.phase(actor);
                    state.light(&ActorState { pose, phase, ..*actor }, sign, pole, &timing);
                }
                kind::VEHICLE => {
                    let context = episode.road_contexts.of(actor, client.blueprints());
                    let failure = episode.rollovers.failure_of(actor, moment.sim_time_nanos);
                    state.vehicle(actor, context, failure);
                }
                kind::WALKER => {
                    state.walker(actor, episode.motions.walker(actor.actor_id.0));
                }
                _ => state.actor(actor),
            }
        }
        for (id, proxy) in &episode.actors.proxies {
            let (pose, velocity) = episode.actors.pose_and_velocity(proxy, world);
            state.fixture(*id, &pose, velocity, &proxy.sign);
        }
        to.publish(WORLD, state.into_message());
    }

    /// Takes one measurement from each sensor bundle that has one. Sends those of the host, and
    /// returns those of the renderer, whose messages are made without the lock of the bridge.
    pub(crate) fn measurements(
        &self,
        client: &Client,
        episode: &mut EpisodeState,
        statics: &Arc<Statics>,
        to: &Streams,
    ) -> Measured {
        let (mut rendered, mut of_physics) = (Vec::new(), Vec::new());
        for (id, proxy) in &mut episode.actors.proxies {
            let Some(sensor) = &mut proxy.sensor else { continue };
            let Some(bundle) = &mut sensor.bundle else { continue };
            let measured = match bundle.receive() {
                Ok(Some(measured)) => measured,
                Ok(None) => continue,
                Err(e) => {
                    log::warn!("{} {}: {e}", self.frame, sensor.description.id);
                    continue;
                }
            };
            if !sensor.is_rendered() {
                of_physics.push((*id, measured));
                continue;
            }
            match Rendered::new(sensor, measured, client, statics) {
                Ok(one) => rendered.push(one),
                Err(RpcError(why)) => log::warn!("{} {}: {why}", self.frame, sensor.description.id),
            }
        }
        let is_any = !(rendered.is_empty() && of_physics.is_empty());
        for (id, measured) in of_physics {
            publish_physics_measurement(id, &measured, client, episode, to);
        }
        Measured { rendered, is_any }
    }
}

/// What sensor bundles have measured: at most one measurement of each.
pub(crate) struct Measured {
    /// Those of the renderer, which are not sent yet.
    pub(crate) rendered: Vec<Rendered>,
    /// Whether there was any; if not, all bundles are empty.
    pub(crate) is_any: bool,
}

/// Sends what the host has measured for one sensor.
fn publish_physics_measurement(
    id: u32,
    measured: &Measurement,
    client: &Client,
    episode: &mut EpisodeState,
    to: &Streams,
) {
    let actors = &mut episode.actors;
    let Some(proxy) = actors.proxies.get_mut(&id) else { return };
    let carrier = proxy.parent;
    // Messages describe other actors of the same table, so the sensor is taken out meanwhile.
    let Some(sensor) = proxy.sensor.take() else { return };
    let (world, blueprints) = (client.world(), client.blueprints());
    let messages =
        physics_messages::messages_of(&sensor, carrier, measured, actors, world, blueprints);
    for message in messages {
        to.publish(sensor.stream, message);
    }
    if let Some(proxy) = actors.proxies.get_mut(&id) {
        proxy.sensor = Some(sensor);
    }
}
