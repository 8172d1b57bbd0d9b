//! Which layers and objects of the town are hidden.

use std::collections::BTreeMap;

use crate::{Command, HideLayers, HideObjects};

/// Objects that one block of bits covers; see [`HideObjects::block`].
pub const BLOCK_OBJECTS: u32 = 1024;

/// The layers and single objects of a town that are hidden: not rendered and not collided with.
///
/// An object's number is its id in instance images without the highest bit: one more than its
/// index in the town's list of objects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HiddenObjects {
    /// Bits of [`crate::layer`].
    layers: u32,
    /// A bit for each hidden object, by number / [`BLOCK_OBJECTS`].
    objects: BTreeMap<u32, [u64; 16]>,
}

impl HiddenObjects {
    /// Hides the layers of a mask or shows them; single objects stay as they are.
    pub fn set_layers(&mut self, mask: u32, hidden: bool) {
        self.layers = if hidden { self.layers | mask } else { self.layers & !mask };
    }

    /// Hides the objects of one block whose bits are set, or shows them.
    pub fn set_objects(&mut self, block: u32, bits: &[u64; 16], hidden: bool) {
        let own = self.objects.entry(block).or_default();
        for (own, bits) in own.iter_mut().zip(bits) {
            *own = if hidden { *own | bits } else { *own & !bits };
        }
        if *own == [0; 16] {
            self.objects.remove(&block);
        }
    }

    /// Returns the mask of hidden layers, bits of [`crate::layer`].
    pub fn hidden_layers(&self) -> u32 {
        self.layers
    }

    /// Returns the blocks that have hidden objects, by rising number.
    pub fn hidden_objects(&self) -> impl Iterator<Item = (u32, &[u64; 16])> {
        self.objects.iter().map(|(block, bits)| (*block, bits))
    }

    /// Whether the object of this number, in the layer of this bit, is hidden.
    pub fn hides(&self, number: u32, layer_bit: u32) -> bool {
        let within = number % BLOCK_OBJECTS;
        let bits = self.objects.get(&(number / BLOCK_OBJECTS));
        self.layers & layer_bit != 0
            || bits.is_some_and(|bits| bits[within as usize / 64] >> (within % 64) & 1 != 0)
    }

    /// Returns the commands that hide the same layers and objects in a town that hides none.
    pub fn commands(&self) -> impl Iterator<Item = Command> {
        let layers = (self.layers != 0).then_some(HideLayers { layers: self.layers, hidden: 1 });
        let objects = self.hidden_objects().map(|(block, bits)| HideObjects {
            block,
            hidden: 1,
            bits: *bits,
        });
        layers.into_iter().map(Command::HideLayers).chain(objects.map(Command::HideObjects))
    }
}
