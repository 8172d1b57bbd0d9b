//! Street lamps.

use mesh::ObjectId;
use protocol::{Command, SetStreetLights, street_light};

use crate::{Client, ClientError};

/// How street lamps are to shine: see [`Client::switch_lamps`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreetLightCommand(SetStreetLights);

impl StreetLightCommand {
    fn of(mode: u32) -> StreetLightCommand {
        StreetLightCommand(SetStreetLights {
            block: 0,
            mode,
            color: 0,
            intensity: 1.0,
            bits: [0; 16],
        })
    }

    /// Dark.
    pub fn off() -> StreetLightCommand {
        StreetLightCommand::of(street_light::OFF)
    }

    /// Day and night.
    pub fn on() -> StreetLightCommand {
        StreetLightCommand::of(street_light::ON)
    }

    /// While it is dark: as all lamps do at first.
    pub fn at_night() -> StreetLightCommand {
        StreetLightCommand::of(street_light::AT_NIGHT)
    }

    /// In this colour: red, green, blue.
    pub fn color(mut self, [r, g, b]: [u8; 3]) -> StreetLightCommand {
        self.0.color = u32::from_le_bytes([r, g, b, 255]);
        self
    }

    /// So bright, as a share of a lamp's own brightness, up to 100.
    pub fn share(mut self, share: f32) -> StreetLightCommand {
        self.0.intensity = share;
        self
    }

    /// The commands that tell these lamps so.
    pub fn commands(&self, lamps: &[u32]) -> Vec<Command> {
        let blocks = ObjectId::blocks(lamps.iter().copied().map(ObjectId::new));
        let command =
            |(block, bits)| Command::SetStreetLights(SetStreetLights { block, bits, ..self.0 });
        blocks.into_iter().map(command).collect()
    }
}

impl Client {
    /// Lets street lamps shine so from the next frame on. A lamp is named by the number that
    /// instance images show of its pole, with or without its highest bit; what is no lamp is
    /// refused.
    pub fn switch_lamps(
        &mut self,
        lamps: &[u32],
        shining: StreetLightCommand,
    ) -> Result<(), ClientError> {
        let commands = shining.commands(lamps);
        if commands.is_empty() {
            return Ok(());
        }
        self.request("switch_lamps", &commands).map(drop)
    }
}
