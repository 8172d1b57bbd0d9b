//! Checks of commands about layers, objects and street lights; hidden objects in physics.

use protocol::{BLOCK_OBJECTS, HiddenObjects, HideLayers, HideObjects, Refusal, SetStreetLights};
use town::Layer;

use super::World;

impl World {
    /// Checks that layers exist.
    pub(crate) fn check_layers(to: &HideLayers) -> Result<(), Refusal> {
        let all = Layer::ALL.len() as u32;
        if to.layers >> all != 0 {
            return Err(Refusal::out_of_range(format!(
                "layers are {:#x}, but there are only {all} layers, one bit each",
                to.layers
            )));
        }
        Ok(())
    }

    /// Checks that objects exist and can be hidden.
    pub(crate) fn check_objects(&self, to: &HideObjects) -> Result<(), Refusal> {
        let last = to.bits.iter().rposition(|bits| *bits != 0).map(|word| {
            let bit = 63 - to.bits[word].leading_zeros();
            u64::from(to.block) * u64::from(BLOCK_OBJECTS) + word as u64 * 64 + u64::from(bit)
        });
        if to.block == 0 && to.bits[0] & 1 != 0 {
            return Err(Refusal::not_found("object 0 is the ground; it cannot be hidden"));
        }
        if last.is_some_and(|last| last > u64::from(self.map.objects)) {
            return Err(Refusal::not_found(format!(
                "object {} is not one of the {} objects of the town",
                last.unwrap_or_default(),
                self.map.objects
            )));
        }
        Ok(())
    }

    /// Checks that street lights exist.
    pub(crate) fn check_street_lights(&self, to: &SetStreetLights) -> Result<(), Refusal> {
        match to.numbers().find(|number| !self.map.lamps.contains(number)) {
            Some(other) => {
                let lamps = self.map.lamps.len();
                Err(Refusal::not_found(format!(
                    "object {other} is not one of the town's {lamps} street lights"
                )))
            }
            None => Ok(()),
        }
    }

    /// Disables the static boxes of hidden objects and enables the others.
    pub(crate) fn hide(&mut self, hidden: &HiddenObjects) {
        for (index, (object, layer)) in self.map.solids.iter().enumerate() {
            self.physics.set_static(index, !hidden.hides(object + 1, layer.bit()));
        }
    }
}
