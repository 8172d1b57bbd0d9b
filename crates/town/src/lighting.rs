use std::collections::BTreeMap;

use mesh::{ObjectBits, ObjectId};

/// What street lamps were told. Lamps are named by their numbers, as things are in instance
/// images: one more than their places in [`crate::Town::objects`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    lamps: BTreeMap<u32, StreetLightState>,
}

/// How a lamp shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreetLightState {
    /// 0: not at all; 1: always; 2: while it is dark.
    pub mode: u32,
    /// Red, green, blue, 255, sRGB; 0: its own.
    pub color: u32,
    /// Of its own brightness.
    pub share: f32,
}

impl StreetLightState {
    /// As every lamp does that was told nothing.
    pub const OWN: StreetLightState = StreetLightState { mode: 2, color: 0, share: 1.0 };
}

impl Lighting {
    /// Tells the lamps of one block whose bits are set.
    pub fn set(&mut self, block: u32, bits: &ObjectBits, shine: StreetLightState) {
        for number in ObjectId::in_block(block, bits).map(ObjectId::number) {
            if shine == StreetLightState::OWN {
                self.lamps.remove(&number);
            } else {
                self.lamps.insert(number, shine);
            }
        }
    }

    /// Those that do not shine as their own, rising.
    pub fn lamps(&self) -> impl ExactSizeIterator<Item = (u32, &StreetLightState)> {
        self.lamps.iter().map(|(number, shine)| (*number, shine))
    }

    /// What, told one after the other to lamps of their own, makes them as these are.
    pub fn told(&self) -> Vec<(u32, ObjectBits, StreetLightState)> {
        let mut told: Vec<(u32, ObjectBits, StreetLightState)> = Vec::new();
        for (number, shine) in &self.lamps {
            let object = ObjectId::new(*number);
            let block = object.block();
            let same = told.iter().rposition(|(b, _, s)| *b == block && s == shine);
            let at = same.unwrap_or_else(|| {
                told.push((block, ObjectBits::default(), *shine));
                told.len() - 1
            });
            object.set_in(&mut told[at].1);
        }
        told
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
        let numbers: Vec<_> = lighting.lamps().map(|(number, shine)| (number, *shine)).collect();
        assert_eq!(numbers, [(2, red), (700, off), (3 * 1024 + 5, red)]);
        let mut again = Lighting::default();
        let told = lighting.told();
        told.iter().for_each(|(block, bits, shine)| again.set(*block, bits, *shine));
        assert_eq!(again, lighting);
        assert_eq!(told.len(), 3);
    }
}
