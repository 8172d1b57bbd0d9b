//! Creates and destroys the sensor bundles that measure for CARLA's sensors.

use client_lib::{
    ActorId, BundleId, Client, SensorBundle, TEXT_BYTES, bundle_commands,
    wire::{Command, SensorSpec, Transmit},
};

use crate::{
    args::RpcError, bridge::episode_state::EpisodeState, proxy_actors::ProxyActors,
    sensor_kind::Kind, stream::Streams,
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

/// A bundle that is about to be created.
pub(crate) struct NewBundle {
    pub(crate) commands: Vec<Command>,
    spec: SensorSpec,
    delta_nanos: u64,
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

    /// Takes out the bundles of sensors without listeners and those that no longer fit, and returns
    /// them with the sensors that need a bundle.
    pub(crate) fn changes(
        &self,
        episode: &mut EpisodeState,
        streams: &Streams,
        delta_nanos: u64,
    ) -> (Vec<SensorBundle>, Vec<u32>) {
        let (mut obsolete, mut missing) = (Vec::new(), Vec::new());
        for (id, proxy) in &mut episode.actors.proxies {
            let Some(sensor) = &mut proxy.sensor else { continue };
            // Radios send whether or not a client listens.
            let is_wanted = sensor.is_wanted(streams) || sensor.kind.is_radio();
            let lacks = sensor.texture_outputs(streams) & !sensor.bundle_outputs;
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
        (obsolete, missing)
    }

    /// Returns what creates the bundle of a sensor, or `None` if it has one or needs none.
    ///
    /// # Errors
    ///
    /// Returns an error if an attribute of the sensor is invalid.
    pub(crate) fn new_bundle(
        &self,
        episode: &EpisodeState,
        client: &Client,
        streams: &Streams,
        id: u32,
    ) -> Result<Option<NewBundle>, RpcError> {
        let delta_nanos = client.wire_settings().delta_nanos;
        let actors = &episode.actors;
        let Some(proxy) = actors.proxies.get(&id) else { return Ok(None) };
        // The host does not know proxies: a sensor on one is fixed in the world.
        let (carrier, pose) = if proxy.parent == 0 || ProxyActors::is_proxy(proxy.parent) {
            (ActorId::NONE, actors.pose_and_velocity(proxy, client.world()).0)
        } else {
            (ActorId(proxy.parent), proxy.pose)
        };
        let Some(sensor) = proxy.sensor.as_ref().filter(|s| s.bundle.is_none()) else {
            return Ok(None);
        };
        let Some(mut spec) = sensor.spec(pose, delta_nanos, self.imu_gravity_mps2)? else {
            return Ok(None);
        };
        spec.outputs |= sensor.texture_outputs(streams);
        let commands = bundle_commands(&format!("carla-{id}"), carrier, [spec], 2);
        Ok(Some(NewBundle { commands, spec, delta_nanos }))
    }

    /// Gives a sensor the bundle that the host has created.
    ///
    /// # Errors
    ///
    /// Returns an error if the bundle has ended meanwhile.
    pub(crate) fn open(
        new: &NewBundle,
        bundle: BundleId,
        episode: &mut EpisodeState,
        client: &Client,
        id: u32,
    ) -> Result<(), RpcError> {
        let bundle = client.open_bundle(bundle, [new.spec])?;
        let proxy = episode.actors.proxies.get_mut(&id);
        // If the sensor was destroyed meanwhile, the bundle is destroyed here.
        if let Some(sensor) = proxy.and_then(|proxy| proxy.sensor.as_mut()) {
            sensor.bundle = Some(bundle);
            sensor.bundle_outputs = new.spec.outputs;
            sensor.bundle_delta_nanos = new.delta_nanos;
            sensor.idle_frames = 0;
        }
        Ok(())
    }

    /// Returns the command by which a radio sends a text with the next frame.
    ///
    /// # Errors
    ///
    /// Returns an error if the sensor is not a `sensor.other.v2x_custom` or the text is too long.
    pub(crate) fn transmission(
        episode: &mut EpisodeState,
        id: u32,
        text: &str,
    ) -> Result<Command, RpcError> {
        let sensor = episode.actors.proxy_mut(id)?.sensor.as_ref();
        let sensor = sensor.filter(|s| s.kind == Kind::V2xCustom);
        let bundle = sensor.and_then(|s| s.bundle.as_ref()).map(SensorBundle::id);
        let bundle = bundle.ok_or("only sensor.other.v2x_custom can send text")?;
        let mut bytes = [0; TEXT_BYTES];
        let room = bytes.get_mut(..text.len()).ok_or_else(|| {
            format!("text of {} bytes is too long; the limit is {TEXT_BYTES} bytes", text.len())
        })?;
        room.copy_from_slice(text.as_bytes());
        Ok(Command::Transmit(Transmit { bundle, sensor: 0, text: bytes }))
    }
}
