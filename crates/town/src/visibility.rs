//! Which objects of a town are visible.

use std::collections::BTreeMap;

use mesh::{Mesh, ObjectBits, ObjectId};

use crate::static_world::{Layer, Object, Town};

/// Layers and single objects that are hidden: they are neither rendered nor collide.
///
/// Objects are named by [`ObjectId`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Visibility {
    /// Bit n: the n-th of [`Layer::ALL`] is hidden.
    layers: u32,
    /// A bit for each hidden object, by [`ObjectId::block`].
    objects: BTreeMap<u32, ObjectBits>,
}

impl Visibility {
    /// Hides or shows the layers of a mask; single objects keep their state.
    pub fn set_layers(&mut self, mask: u32, hidden: bool) {
        self.layers = if hidden { self.layers | mask } else { self.layers & !mask };
    }

    /// Hides or shows the objects of one block whose bits are set.
    pub fn set_objects(&mut self, block: u32, bits: &ObjectBits, hidden: bool) {
        let own = self.objects.entry(block).or_default();
        for (own, bits) in own.iter_mut().zip(bits) {
            *own = if hidden { *own | bits } else { *own & !bits };
        }
        if *own == ObjectBits::default() {
            self.objects.remove(&block);
        }
    }

    /// The mask of hidden layers.
    pub fn hidden_layers(&self) -> u32 {
        self.layers
    }

    /// The blocks with hidden objects, in rising order.
    pub fn hidden_objects(&self) -> impl Iterator<Item = (u32, &ObjectBits)> {
        self.objects.iter().map(|(block, bits)| (*block, bits))
    }

    /// Whether the object at this index of [`Town::objects`] is hidden.
    pub fn hides(&self, index: u32, layer: Layer) -> bool {
        let object = ObjectId::from_index(index);
        self.layers >> layer as u32 & 1 != 0
            || self.objects.get(&object.block()).is_some_and(|bits| object.is_in(bits))
    }
}

impl Town {
    /// The town without its hidden objects. Objects keep their indices.
    pub fn visible(&self, visibility: &Visibility) -> Town {
        let hides = |index: usize, object: &Object| visibility.hides(index as u32, object.layer);
        let off: Vec<bool> =
            self.objects.iter().enumerate().map(|(index, object)| hides(index, object)).collect();
        let is_on = |index: u32| !off[index as usize];
        let mut town = Town {
            mesh: Mesh { positions: self.mesh.positions.clone(), ..Mesh::default() },
            objects: self.objects.clone(),
            colliders: self.colliders.clone(),
            lamps: self.lamps.clone(),
            parked: self.parked.clone(),
            heads: self.heads.clone(),
        };
        for (triangle, face) in self.mesh.triangles.iter().zip(&self.mesh.faces) {
            if face.object == 0 || is_on(face.object - 1) {
                town.mesh.triangle(*triangle, *face);
            }
        }
        town.colliders.retain(|one| is_on(one.object));
        town.lamps.retain(|one| is_on(one.object));
        town.parked.retain(|one| is_on(one.object));
        town
    }
}
