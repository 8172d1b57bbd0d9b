//! Bundles of a client: created, destroyed, and texts sent by their radios.

use std::sync::Arc;

use protocol::{
    ActorId, BundleId, Command, CreateBundle, Name, Refusal, SensorSpec, TEXT_BYTES, Transmit,
};

use crate::{Client, ClientError, SensorBundle};

impl Client {
    /// Mounts sensors on an actor, or in the world (`ActorId::NONE`), as one bundle: measured
    /// together, delivered together. Sensors are [`Sensor`](crate::Sensor)s, or records of
    /// [`wire`](crate::wire); measurements name them by their index. `max_borrowed` measurements may be held at a time, 1 to 8.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist, a sensor is not possible, shared memory
    /// has no room, or another client destroyed the actor or loaded a map meanwhile.
    pub fn create_bundle<S: Into<SensorSpec>>(
        &mut self,
        name: &str,
        parent: ActorId,
        sensors: impl IntoIterator<Item = S>,
        max_borrowed: u32,
    ) -> Result<SensorBundle, ClientError> {
        let sensors: Vec<SensorSpec> = sensors.into_iter().map(S::into).collect();
        let commands = bundle_commands(name, parent, &sensors, max_borrowed);
        let id = BundleId(self.request("bundle", &commands)?[0]);
        self.open_bundle(id, sensors)
    }

    /// Opens a bundle that the commands of [`bundle_commands`] have created; `id` is the outcome of
    /// the first of them.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the bundle does not exist.
    pub fn open_bundle<S: Into<SensorSpec>>(
        &self,
        id: BundleId,
        sensors: impl IntoIterator<Item = S>,
    ) -> Result<SensorBundle, ClientError> {
        let connection = self.connection();
        let reader = connection.bundles.open(id).map_err(|why| match why {
            why if why.is_missing_channel() => ClientError::refused(
                "bundle",
                Refusal::not_found(format!(
                    "there is no bundle {}; it may have been destroyed with its actor or its world",
                    id.0
                )),
            ),
            why => why.into(),
        })?;
        let owner = Arc::downgrade(connection);
        let sensors = sensors.into_iter().map(S::into).collect();
        Ok(SensorBundle::new(id, self.episode(), sensors, reader, owner))
    }

    /// Destroys a bundle and waits until that was carried out. Dropping it destroys it, too,
    /// without waiting.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if it was destroyed with its actor or world.
    pub fn destroy_bundle(&mut self, bundle: SensorBundle) -> Result<(), ClientError> {
        self.request_one("bundle", Command::DestroyBundle(bundle.release())).map(drop)
    }

    /// Sends a text by radio with the next frame, from a
    /// [`Sensor::v2x_messages`](crate::Sensor::v2x_messages) sensor of a bundle; at most
    /// [`TEXT_BYTES`] bytes.
    ///
    /// # Errors
    ///
    /// [`ClientError::BadArgument`] if the text is longer; [`ClientError::Refused`] if there is no
    /// such sensor.
    pub fn transmit(
        &mut self,
        bundle: &SensorBundle,
        sensor: usize,
        text: &str,
    ) -> Result<(), ClientError> {
        let mut bytes = [0; TEXT_BYTES];
        let room = bytes.get_mut(..text.len()).ok_or_else(|| {
            let len = text.len();
            let why = format!("the text has {len} bytes; {TEXT_BYTES} is the limit");
            ClientError::bad_argument("transmit", why)
        })?;
        room.copy_from_slice(text.as_bytes());
        let transmit = Transmit { bundle: bundle.id(), sensor: sensor as u32, text: bytes };
        self.request_one("transmit", Command::Transmit(transmit)).map(drop)
    }
}

/// Returns the commands that create a bundle, in the protocol's layout: see [`Client::create_bundle`].
#[must_use]
pub fn bundle_commands<S: Into<SensorSpec>>(
    name: &str,
    parent: ActorId,
    sensors: impl IntoIterator<Item = S>,
    max_borrowed: u32,
) -> Vec<Command> {
    let sensors: Vec<SensorSpec> = sensors.into_iter().map(S::into).collect();
    let bundle = CreateBundle {
        parent,
        sensor_count: sensors.len() as u32,
        max_borrowed,
        reserved: 0,
        name: Name::new(name),
    };
    let sensors = sensors.into_iter().map(Command::Sensor);
    std::iter::once(Command::CreateBundle(bundle)).chain(sensors).collect()
}
