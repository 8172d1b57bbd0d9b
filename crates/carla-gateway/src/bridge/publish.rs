//! Sends snapshots and measurements to the listeners of streams.

use std::time::Instant;

use client_lib::{
    Client, Measurement,
    wire::{ActorState, kind},
};

use crate::{
    bridge::episode_state::EpisodeState,
    physics_messages,
    proxy_actors::SPECTATOR,
    rendered_messages,
    state::{Moment, StateMessage},
    stream::{Streams, WORLD},
    textures,
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
                    state.light(&ActorState { pose, ..*actor }, sign, pole, &timing);
                }
                kind::VEHICLE => {
                    let context = episode.road_contexts.of(actor, client.blueprints(), self.frame);
                    let failure = episode.rollovers.failure_of(actor, moment.sim_time_nanos);
                    state.vehicle(actor, context, failure);
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

    /// Sends what sensor bundles have measured.
    pub(crate) fn measurements(&self, client: &Client, episode: &mut EpisodeState, to: &Streams) {
        let world = client.world();
        let mut of_physics = Vec::new();
        for (id, proxy) in &mut episode.actors.proxies {
            let Some(sensor) = &mut proxy.sensor else { continue };
            while let Some(bundle) = &mut sensor.bundle {
                match bundle.receive() {
                    Ok(Some(measured)) if !sensor.is_rendered() => of_physics.push((*id, measured)),
                    Ok(Some(measured)) => {
                        if let Some(message) =
                            rendered_messages::message_of(sensor, &measured, world)
                        {
                            to.publish(sensor.stream, message);
                        }
                        let size = measured.planes().first();
                        let bytes = size.map_or(0, |p| 4 * p.width as usize * p.height as usize);
                        let fov_deg = sensor.description.number("fov", 90.0).unwrap_or(90.0);
                        for (texture, stream) in &sensor.textures {
                            if to.has_room(*stream, bytes)
                                && let Some(message) =
                                    textures::message_of(*texture, &measured, fov_deg)
                            {
                                to.publish(*stream, message);
                            }
                        }
                    }
                    Ok(None) => break,
                    Err(e) => {
                        log::warn!("{} {}: {e}", self.frame, sensor.description.id);
                        break;
                    }
                }
            }
        }
        for (id, measured) in of_physics {
            publish_physics_measurement(id, &measured, client, episode, to);
        }
    }
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
