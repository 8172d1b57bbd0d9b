use std::collections::BTreeMap;

use mesh::{ObjectBits, ObjectId};

/// The states of street lights that clients have set. A light is named by the number of its object,
/// as in [`mesh::ObjectId`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    lamps: BTreeMap<u32, StreetLightState>,
}

/// The state of a street light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreetLightState {
    /// The mode. 0: off; 1: on; 2: on while it is dark.
    pub mode: u32,
    /// The colour: red, green, blue, 255, sRGB; 0 for the light's own colour.
    pub color: u32,
    /// The intensity, as a fraction of the light's own intensity.
    pub intensity: f32,
}

impl StreetLightState {
    /// The state of a street light that no client has set.
    pub const OWN: StreetLightState = StreetLightState { mode: 2, color: 0, intensity: 1.0 };
}

impl Lighting {
    /// Sets the lights of one block whose bits are set.
    pub fn set(&mut self, block: u32, bits: &ObjectBits, state: StreetLightState) {
        for number in ObjectId::in_block(block, bits).map(ObjectId::number) {
            if state == StreetLightState::OWN {
                self.lamps.remove(&number);
            } else {
                self.lamps.insert(number, state);
            }
        }
    }

    /// The lights whose state differs from [`StreetLightState::OWN`], in rising order.
    pub fn lamps(&self) -> impl ExactSizeIterator<Item = (u32, &StreetLightState)> {
        self.lamps.iter().map(|(number, state)| (*number, state))
    }

    /// The settings (block, bits, state) that produce this state from an empty one.
    pub fn settings(&self) -> Vec<(u32, ObjectBits, StreetLightState)> {
        let mut settings: Vec<(u32, ObjectBits, StreetLightState)> = Vec::new();
        for (number, state) in &self.lamps {
            let object = ObjectId::new(*number);
            let block = object.block();
            let same = settings.iter().rposition(|(b, _, s)| *b == block && s == state);
            let at = same.unwrap_or_else(|| {
                settings.push((block, ObjectBits::default(), *state));
                settings.len() - 1
            });
            object.set_in(&mut settings[at].1);
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(of: &[u32]) -> ObjectBits {
        let mut bits = [0; 16];
        of.iter().for_each(|at| bits[*at as usize / 64] |= 1 << (at % 64));
        bits
    }

    #[test]
    fn what_is_told_again_makes_the_same() {
        let mut lighting = Lighting::default();
        let (red, off) = (
            StreetLightState { color: 0xff, ..StreetLightState::OWN },
            StreetLightState { mode: 0, ..StreetLightState::OWN },
        );
        lighting.set(0, &bits(&[1, 2, 700]), off);
        lighting.set(3, &bits(&[5]), red);
        lighting.set(0, &bits(&[2]), red);
        lighting.set(0, &bits(&[1]), StreetLightState::OWN);
        let numbers: Vec<_> = lighting.lamps().map(|(number, state)| (number, *state)).collect();
        assert_eq!(numbers, [(2, red), (700, off), (3 * 1024 + 5, red)]);
        let mut again = Lighting::default();
        let settings = lighting.settings();
        settings.iter().for_each(|(block, bits, state)| again.set(*block, bits, *state));
        assert_eq!(again, lighting);
        assert_eq!(settings.len(), 3);
    }
}
