//! How street lamps shine.

use std::collections::BTreeMap;

use crate::{BLOCK_OBJECTS, Command, SetStreetLights};

/// The street lamps that do not shine in the default way. A lamp's number is the id of its pole in
/// instance images without the highest bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StreetLights {
    lamps: BTreeMap<u32, StreetLightState>,
}

/// How a street lamp shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreetLightState {
    /// One of [`crate::street_light`].
    pub mode: u32,
    /// Red, green, blue, 255 in sRGB; 0: the lamp's own colour.
    pub color: u32,
    /// Brightness as a intensity of the lamp's own.
    pub intensity: f32,
}

impl StreetLightState {
    /// The default: from dusk to dawn, in the lamp's own colour and brightness.
    pub const OWN: StreetLightState = StreetLightState { mode: 2, color: 0, intensity: 1.0 };
}

impl StreetLights {
    /// Sets the lamps of one block whose bits are set.
    pub fn set(&mut self, block: u32, bits: &[u64; 16], shine: StreetLightState) {
        for within in 0..BLOCK_OBJECTS {
            if bits[within as usize / 64] >> (within % 64) & 1 == 0 {
                continue;
            }
            let number = block.saturating_mul(BLOCK_OBJECTS).saturating_add(within);
            if shine == StreetLightState::OWN {
                self.lamps.remove(&number);
            } else {
                self.lamps.insert(number, shine);
            }
        }
    }

    /// Returns the lamps that do not shine in the default way, by rising number.
    pub fn lamps(&self) -> impl ExactSizeIterator<Item = (u32, &StreetLightState)> {
        self.lamps.iter().map(|(number, shine)| (*number, shine))
    }

    /// Returns the commands that set the same lamps where all lamps shine in the default way.
    pub fn commands(&self) -> impl Iterator<Item = Command> {
        self.blocks().into_iter().map(
            |(block, bits, StreetLightState { mode, color, intensity })| {
                Command::SetStreetLights(SetStreetLights { block, mode, color, intensity, bits })
            },
        )
    }

    fn blocks(&self) -> Vec<(u32, [u64; 16], StreetLightState)> {
        let mut told: Vec<(u32, [u64; 16], StreetLightState)> = Vec::new();
        for (number, shine) in &self.lamps {
            let (block, within) = (number / BLOCK_OBJECTS, number % BLOCK_OBJECTS);
            let same = told.iter().rposition(|(b, _, s)| *b == block && s == shine);
            let at = same.unwrap_or_else(|| {
                told.push((block, [0; 16], *shine));
                told.len() - 1
            });
            told[at].1[within as usize / 64] |= 1 << (within % 64);
        }
        told
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(of: &[u32]) -> [u64; 16] {
        let mut bits = [0; 16];
        of.iter().for_each(|at| bits[*at as usize / 64] |= 1 << (at % 64));
        bits
    }

    #[test]
    fn blocks_of_lights_set_the_same_lights_again() {
        let mut lights = StreetLights::default();
        let (red, off) = (
            StreetLightState { color: 0xff, ..StreetLightState::OWN },
            StreetLightState { mode: 0, ..StreetLightState::OWN },
        );
        lights.set(0, &bits(&[1, 2, 700]), off);
        lights.set(3, &bits(&[5]), red);
        lights.set(0, &bits(&[2]), red);
        lights.set(0, &bits(&[1]), StreetLightState::OWN);
        let numbers: Vec<_> = lights.lamps().map(|(number, shine)| (number, *shine)).collect();
        assert_eq!(numbers, [(2, red), (700, off), (3 * 1024 + 5, red)]);
        let mut again = StreetLights::default();
        let told = lights.blocks();
        told.iter().for_each(|(block, bits, shine)| again.set(*block, bits, *shine));
        assert_eq!(again, lights);
        assert_eq!(told.len(), 3);
    }
}
