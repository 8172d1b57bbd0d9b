//! A town in one mesh, for programs without actors.

use glam::{Affine3A, Quat, Vec3};
use mesh::{Face, Mesh};

use crate::{
    catalogue::{blueprint, catalogue},
    plants::{coarse_mesh, plant_mesh},
    static_world::Town,
};

/// The blueprint whose actors stand at the heads of traffic lights.
const TRAFFIC_LIGHT: &str = "traffic.traffic_light";

impl Town {
    /// Everything that stands in the town without an actor being spawned: the static mesh, plants,
    /// parked cars, and the lamp boxes of traffic lights. World space.
    ///
    /// Faces of plants and of parked cars name their objects; those of lamp boxes name object 0.
    pub fn assembled_mesh(&self) -> Mesh {
        let mut whole = self.with_plants(plant_mesh);
        for parked in &self.parked {
            let rotation = Quat::from_array(parked.rotation);
            let world_from_actor = Affine3A::from_rotation_translation(rotation, parked.position);
            let vehicle = catalogue()[parked.blueprint as usize].mesh();
            append(&mut whole, vehicle, world_from_actor, parked.object + 1);
        }
        if let Some((_, light)) = blueprint(TRAFFIC_LIGHT) {
            for head in &self.heads {
                let rotation = Quat::from_axis_angle(Vec3::Z, head.yaw_rad);
                let world_from_actor = Affine3A::from_rotation_translation(rotation, head.position);
                append(&mut whole, light.mesh(), world_from_actor, 0);
            }
        }
        whole
    }

    /// The static mesh with a coarse mesh of each plant: a trunk and a closed crown. World space.
    pub fn mesh_with_coarse_plants(&self) -> Mesh {
        self.with_plants(coarse_mesh)
    }

    fn with_plants(&self, mesh: impl Fn(u32) -> Option<&'static Mesh>) -> Mesh {
        let mut whole = self.mesh.clone();
        for plant in &self.plants {
            if let Some(model) = mesh(plant.model) {
                append(&mut whole, model, plant.world_from_model(), plant.object + 1);
            }
        }
        whole
    }
}

fn append(whole: &mut Mesh, part: &Mesh, world_from_part: Affine3A, object: u32) {
    let first = whole.positions.len() as u32;
    let place = |position: &[f32; 3]| {
        world_from_part.transform_point3(Vec3::from_array(*position)).to_array()
    };
    whole.positions.extend(part.positions.iter().map(place));
    whole.triangles.extend(part.triangles.iter().map(|corners| corners.map(|at| at + first)));
    whole.faces.extend(part.faces.iter().map(|face| Face { object, ..*face }));
}

#[cfg(test)]
mod tests {
    use mesh::Tag;

    use crate::{Layer, blueprint, catalogue, furnish};

    #[test]
    fn an_assembled_town_holds_every_parked_car_and_every_traffic_light() {
        let text = mapgen::named("Flatford").expect("a named town");
        let town = furnish(&road::Network::parse(&text).expect("a map"), 1);
        assert!(!town.parked.is_empty() && !town.heads.is_empty());
        let whole = town.assembled_mesh();
        assert_eq!(whole.triangles.len(), whole.faces.len());
        assert!(whole.triangles.iter().flatten().all(|at| (*at as usize) < whole.positions.len()));
        let of = |object: u32| whole.faces.iter().filter(move |face| face.object == object);
        for parked in &town.parked {
            let vehicle = &catalogue()[parked.blueprint as usize];
            assert_eq!(of(parked.object + 1).count(), vehicle.mesh().triangles.len());
            assert_eq!(town.objects[parked.object as usize].layer, Layer::ParkedVehicles);
        }
        let tag = Tag::TrafficLight as u8;
        let lights = |faces: &[mesh::Face]| faces.iter().filter(|face| face.tag == tag).count();
        let (_, light) = blueprint(super::TRAFFIC_LIGHT).expect("a blueprint");
        let added = lights(&whole.faces) - lights(&town.mesh.faces);
        assert_eq!(added, town.heads.len() * lights(&light.mesh().faces));
        // A car stands where its object's box says.
        let parked = &town.parked[0];
        let object = &town.objects[parked.object as usize];
        let reach = object.half_extents_m.length() + 0.01;
        for (corners, _) in
            whole.triangles.iter().zip(&whole.faces).filter(|(_, f)| f.object == parked.object + 1)
        {
            for at in corners {
                let point = glam::Vec3::from_array(whole.positions[*at as usize]);
                assert!(point.distance(object.center) < reach, "{point} {}", object.center);
            }
        }
    }
}
