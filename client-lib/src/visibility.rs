//! Visibility of the town: layers and single objects, hidden or shown.

use mesh::ObjectId;
use protocol::{Command, HideLayers, HideObjects};

use crate::{Client, ClientError, Layers};

impl Client {
    /// Hides the named layers of the town, or shows them again, from the next frame on. No sensor
    /// measures a hidden object and no actor collides with it.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if a layer is unknown.
    pub fn hide_layers(&mut self, layers: Layers, hidden: bool) -> Result<(), ClientError> {
        let command = HideLayers { layers: layers.bits(), hidden: hidden.into() };
        self.request("hide_layers", &[Command::HideLayers(command)]).map(drop)
    }

    /// Hides objects of the town, or shows them again, from the next frame on. The number of an
    /// object is that of [`Client::map_objects`] and of instance images, with or without the highest
    /// bit.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] with [`RefusalCode::NotFound`](crate::RefusalCode::NotFound) if the
    /// town has no such object, or it is the ground.
    pub fn hide_objects(&mut self, objects: &[u32], hidden: bool) -> Result<(), ClientError> {
        let commands = hide_objects(objects, hidden);
        if commands.is_empty() {
            return Ok(());
        }
        self.request("hide_objects", &commands).map(drop)
    }
}

/// Returns the commands that hide objects of the town or show them again: see
/// [`Client::hide_objects`].
#[must_use]
pub fn hide_objects(objects: &[u32], hidden: bool) -> Vec<Command> {
    let blocks = ObjectId::blocks(objects.iter().copied().map(ObjectId::new));
    let command =
        |(block, bits)| Command::HideObjects(HideObjects { block, hidden: hidden.into(), bits });
    blocks.into_iter().map(command).collect()
}
