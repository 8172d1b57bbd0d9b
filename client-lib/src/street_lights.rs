//! Street lights.

use mesh::ObjectId;
use protocol::{Command, SetStreetLights, street_light};

use crate::{Client, ClientError};

/// A state that street lights are set to by [`Client::switch_street_lights`].
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
    pub fn intensity(mut self, intensity: f32) -> StreetLightCommand {
        self.0.intensity = intensity;
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
    /// Switches street lights from the next frame on. A light is named by its number: see
    /// [`Client::street_lights`], and the numbers that instance images show of its pole, with or
    /// without the highest bit.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if a number is no street light's.
    pub fn switch_street_lights(
        &mut self,
        lights: &[u32],
        command: StreetLightCommand,
    ) -> Result<(), ClientError> {
        let commands = command.commands(lights);
        if commands.is_empty() {
            return Ok(());
        }
        self.request("switch_street_lights", &commands).map(drop)
    }
}
