//! A town without its hidden objects.

use mesh::Mesh;

use crate::static_world::{Layer, Town};

impl Town {
    /// Returns the town without the objects for which `hides` is true, given an object's number
    /// (one more than its index in [`Town::objects`]) and its layer. Objects keep their numbers.
    pub fn visible(&self, hides: impl Fn(u32, Layer) -> bool) -> Town {
        let numbered = (1..).zip(&self.objects);
        let off: Vec<bool> = numbered.map(|(number, one)| hides(number, one.layer)).collect();
        let is_on = |index: u32| !off[index as usize];
        let mut town = Town {
            mesh: Mesh { positions: self.mesh.positions.clone(), ..Mesh::default() },
            objects: self.objects.clone(),
            colliders: self.colliders.clone(),
            lamps: self.lamps.clone(),
            parked: self.parked.clone(),
            plants: self.plants.clone(),
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
        town.plants.retain(|one| is_on(one.object));
        town
    }
}
