//! What of the town is there.

use mesh::ObjectId;
use protocol::{Command, HideLayers, HideObjects};

use crate::{Client, ClientError, Layers};

impl Client {
    /// Switches layers of the town off, or on again: the named ones. What is off
    /// is neither seen nor run into, from the next frame on.
    pub fn hide_layers(&mut self, layers: Layers, hidden: bool) -> Result<(), ClientError> {
        let command = HideLayers { layers: layers.bits(), hidden: hidden.into() };
        self.request("hide_layers", &[Command::HideLayers(command)]).map(drop)
    }

    /// Switches things of the town off, or on again. A thing's number is the one that instance
    /// images show, with or without its highest bit; one that is not there is refused.
    pub fn hide_objects(&mut self, objects: &[u32], hidden: bool) -> Result<(), ClientError> {
        let commands = hide_objects(objects, hidden);
        if commands.is_empty() {
            return Ok(());
        }
        self.request("hide_objects", &commands).map(drop)
    }
}

/// The commands that switch things of the town off, or on again; see [`Client::hide_objects`].
pub fn hide_objects(objects: &[u32], hidden: bool) -> Vec<Command> {
    let blocks = ObjectId::blocks(objects.iter().copied().map(ObjectId::new));
    let command =
        |(block, bits)| Command::HideObjects(HideObjects { block, hidden: hidden.into(), bits });
    blocks.into_iter().map(command).collect()
}
