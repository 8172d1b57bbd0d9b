//! Creates and destroys the sensor bundles that measure for CARLA's sensors.

use client_lib::{
    ActorId, Client, SensorBundle, TEXT_BYTES,
    wire::{Command, Transmit},
};

use crate::{
    args::RpcError,
    bridge::{episode_state::EpisodeState, outbox::Outbox},
    proxy_actors::ProxyActors,
    sensor_kind::Kind,
    stream::Streams,
};

/// Frames after which the bundle of a sensor without listeners is destroyed.
const IDLE_FRAMES: u32 = 20;

/// Acceleration that inertial sensors at rest measure by default. Metres per second squared.
const IMU_GRAVITY_MPS2: f32 = 9.81;

/// What the sensors of all clients have in common.
pub(crate) struct Bundles {
    /// Acceleration that inertial sensors at rest measure. Metres per second squared.
    pub(crate) imu_gravity_mps2: f32,
}

/// What a bundle is created with.
pub(crate) struct BundleContext<'a> {
    pub(crate) client: &'a mut Client,
    pub(crate) episode: &'a mut EpisodeState,
    pub(crate) outbox: &'a mut Outbox,
    pub(crate) streams: &'a Streams,
}

impl Bundles {
    /// Creates the settings that a server starts with.
    pub(crate) fn new() -> Bundles {
        Bundles { imu_gravity_mps2: IMU_GRAVITY_MPS2 }
    }

    /// Sets what inertial sensors at rest measure. Their bundles are created again.
    pub(crate) fn set_imu_gravity(&mut self, mps2: f32, episode: &mut EpisodeState) {
        self.imu_gravity_mps2 = mps2;
        for proxy in episode.actors.proxies.values_mut() {
            if let Some(sensor) = proxy.sensor.as_mut().filter(|s| s.kind == Kind::Imu) {
                // A delta that differs from the world's marks the bundle as obsolete.
                sensor.bundle_delta_nanos = 0;
            }
        }
    }

    /// Creates bundles for sensors that have listeners, and destroys those without.
    pub(crate) fn update(&self, with: &mut BundleContext, frame: u64) {
        let mut missing = Vec::new();
        let mut obsolete = Vec::new();
        let delta_nanos = with.client.wire_settings().delta_nanos;
        for (id, proxy) in &mut with.episode.actors.proxies {
            let Some(sensor) = &mut proxy.sensor else { continue };
            // Radios send whether or not a client listens.
            let is_wanted = sensor.is_wanted(with.streams) || sensor.kind.is_radio();
            let lacks = sensor.texture_outputs(with.streams) & !sensor.bundle_outputs;
            sensor.idle_frames = if is_wanted { 0 } else { sensor.idle_frames + 1 };
            // The columns of a lidar depend on the length of a tick.
            let is_obsolete = sensor.bundle_delta_nanos != delta_nanos || lacks != 0;
            if (sensor.idle_frames > IDLE_FRAMES || is_obsolete)
                && let Some(bundle) = sensor.bundle.take()
            {
                obsolete.push(bundle);
            }
            if is_wanted && sensor.bundle.is_none() {
                missing.push(*id);
            }
        }
        for bundle in obsolete {
            destroy(with.client, bundle);
        }
        for id in missing {
            if let Err(RpcError(why)) = self.create(with, id) {
                log::warn!("{frame} sensor {id}: {why}");
            }
        }
    }

    /// Creates the bundle of a sensor, unless it has one or needs none.
    ///
    /// # Errors
    ///
    /// Returns an error if an attribute of the sensor is invalid or the host refuses the bundle.
    pub(crate) fn create(&self, with: &mut BundleContext, id: u32) -> Result<(), RpcError> {
        let delta_nanos = with.client.wire_settings().delta_nanos;
        let actors = &with.episode.actors;
        let Some(proxy) = actors.proxies.get(&id) else { return Ok(()) };
        // The host does not know proxies: a sensor on one is fixed in the world.
        let (carrier, pose) = if proxy.parent == 0 || ProxyActors::is_proxy(proxy.parent) {
            (ActorId::NONE, actors.pose_and_velocity(proxy, with.client.world()).0)
        } else {
            (ActorId(proxy.parent), proxy.pose)
        };
        let Some(sensor) = proxy.sensor.as_ref().filter(|s| s.bundle.is_none()) else {
            return Ok(());
        };
        let Some(mut spec) = sensor.spec(pose, delta_nanos, self.imu_gravity_mps2)? else {
            return Ok(());
        };
        spec.outputs |= sensor.texture_outputs(with.streams);
        let commands = with.outbox.take_commands();
        if !commands.is_empty() {
            with.client.try_wire_request("commands", &commands)?;
        }
        let bundle = with.client.create_bundle(&format!("carla-{id}"), carrier, &[spec], 2)?;
        let proxy = with.episode.actors.proxies.get_mut(&id);
        if let Some(sensor) = proxy.and_then(|proxy| proxy.sensor.as_mut()) {
            sensor.bundle = Some(bundle);
            sensor.bundle_outputs = spec.outputs;
            sensor.bundle_delta_nanos = delta_nanos;
            sensor.idle_frames = 0;
        }
        Ok(())
    }

    /// Queues a text that a radio sends with the next frame.
    ///
    /// # Errors
    ///
    /// Returns an error if the sensor is not a `sensor.other.v2x_custom` or the text is too long.
    pub(crate) fn transmit(
        &self,
        with: &mut BundleContext,
        id: u32,
        text: &str,
    ) -> Result<(), RpcError> {
        self.create(with, id)?;
        let sensor = with.episode.actors.proxy_mut(id)?.sensor.as_ref();
        let sensor = sensor.filter(|s| s.kind == Kind::V2xCustom);
        let bundle = sensor.and_then(|s| s.bundle.as_ref()).map(SensorBundle::id);
        let bundle = bundle.ok_or("only sensor.other.v2x_custom can send text")?;
        let mut bytes = [0; TEXT_BYTES];
        let room = bytes.get_mut(..text.len()).ok_or_else(|| {
            format!("text of {} bytes is too long; the limit is {TEXT_BYTES} bytes", text.len())
        })?;
        room.copy_from_slice(text.as_bytes());
        with.outbox.command(Command::Transmit(Transmit { bundle, sensor: 0, text: bytes }));
        Ok(())
    }
}

/// Destroys a bundle. One that was destroyed with its carrier is no error.
pub(crate) fn destroy(client: &mut Client, bundle: SensorBundle) {
    let _ = client.destroy_bundle(bundle);
}
