//! The static objects of the town that have boxes: everything with a class and an extent of its own.

use std::ops::Range;

use client_lib::Client;
use glam::{Affine3A, Quat};
use mesh::Tag;
use protocol::{Episode, Pose};
use town::{Layer, Town};

use crate::collect::{CollectError, silhouette::Part};

/// The town of a run.
pub(crate) struct StaticObjects {
    town: Town,
    /// By object.
    shapes: Vec<Shape>,
}

struct Shape {
    /// Its triangles in the town's mesh, where those of an object lie together.
    triangles: Range<usize>,
    /// The positions that they name.
    positions: Range<usize>,
    /// The index of the vehicle in the list of parked ones.
    parked: Option<usize>,
    /// The index of the plant in the list of plants.
    plant: Option<usize>,
}

/// What the box of an object says of it, in world space.
pub(crate) struct Described {
    pub(crate) tag: Tag,
    pub(crate) layer: Layer,
    /// Of a parked vehicle.
    pub(crate) blueprint: Option<&'static str>,
    pub(crate) size_m: [f32; 3],
    pub(crate) world_from_box: Pose,
}

impl StaticObjects {
    /// Reads the town of the client's world.
    pub(crate) fn load(client: &Client, episode: &Episode) -> Result<StaticObjects, CollectError> {
        let network = client.map()?;
        let cache = bake::Cache::from_environment();
        let town = cache.town_around(&network, &episode.open_drive, episode.seed);
        Ok(StaticObjects::new(town))
    }

    pub(crate) fn new(town: Town) -> StaticObjects {
        let shape = |_: &town::Object| Shape {
            triangles: 0..0,
            positions: 0..0,
            parked: None,
            plant: None,
        };
        let mut shapes: Vec<Shape> = town.objects.iter().map(shape).collect();
        let mut end = 0;
        for faces in town.mesh.faces.chunk_by(|a, b| a.object == b.object) {
            let triangles = end..end + faces.len();
            end = triangles.end;
            let Some(index) = faces[0].object.checked_sub(1) else { continue };
            let corners = || town.mesh.triangles[triangles.clone()].iter().flatten();
            let low = corners().min().map_or(0, |low| *low as usize);
            let high = corners().max().map_or(0, |high| *high as usize + 1);
            let positions = low..high;
            shapes[index as usize] = Shape { positions, triangles, parked: None, plant: None };
        }
        for (at, parked) in town.parked.iter().enumerate() {
            shapes[parked.object as usize].parked = Some(at);
        }
        for (at, plant) in town.plants.iter().enumerate() {
            shapes[plant.object as usize].plant = Some(at);
        }
        StaticObjects { town, shapes }
    }

    /// Returns the number of objects, with and without boxes.
    pub(crate) fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Returns the places of the boxes of traffic lights.
    pub(crate) fn traffic_light_heads(&self) -> &[town::Head] {
        &self.town.heads
    }

    /// Whether the object at an index has a box.
    pub(crate) fn has_box(&self, index: usize) -> bool {
        self.town.objects.get(index).is_some_and(|object| has_extent(object.tag))
    }

    /// Describes the object at an index.
    pub(crate) fn describe(&self, index: usize) -> Described {
        let object = &self.town.objects[index];
        let parked = self.shapes[index].parked.map(|at| &self.town.parked[at]);
        let rotation = match parked {
            // A parked vehicle leans as the ground below its wheels does.
            Some(parked) => Quat::from_array(parked.rotation),
            None => Quat::from_rotation_z(object.yaw_rad),
        };
        Described {
            tag: object.tag,
            layer: object.layer,
            blueprint: parked.map(|parked| town::catalogue()[parked.blueprint as usize].id),
            size_m: (object.half_extents_m * 2.0).to_array(),
            world_from_box: Pose::new(object.center, rotation),
        }
    }

    /// Returns the mesh of the object at an index, and the transform to world space.
    pub(crate) fn mesh(&self, index: usize) -> (Part<'_>, Affine3A) {
        let Shape { triangles, positions, parked, plant } = &self.shapes[index];
        let plant = plant.map(|at| &self.town.plants[at]);
        if let Some((plant, mesh)) = plant.and_then(|one| Some((one, town::plant_mesh(one.model)?)))
        {
            return (Part::whole(mesh), plant.world_from_model());
        }
        match parked.map(|at| &self.town.parked[at]) {
            Some(parked) => {
                let mesh = town::catalogue()[parked.blueprint as usize].mesh();
                let rotation = Quat::from_array(parked.rotation);
                let place = Affine3A::from_rotation_translation(rotation, parked.position);
                (Part::whole(mesh), place)
            }
            None => {
                let part = Part {
                    positions: &self.town.mesh.positions[positions.clone()],
                    triangles: &self.town.mesh.triangles[triangles.clone()],
                    first: positions.start as u32,
                };
                (part, Affine3A::IDENTITY)
            }
        }
    }
}

/// Whether things of this class stand apart from each other. Buildings, walls and the like adjoin
/// each other, and the ground has no extent.
fn has_extent(tag: Tag) -> bool {
    match tag {
        Tag::Pole
        | Tag::TrafficLight
        | Tag::TrafficSign
        | Tag::Vegetation
        | Tag::Pedestrian
        | Tag::Rider
        | Tag::Car
        | Tag::Truck
        | Tag::Bus
        | Tag::Train
        | Tag::Motorcycle
        | Tag::Bicycle
        | Tag::Static
        | Tag::Dynamic
        | Tag::Other => true,
        Tag::Unlabeled
        | Tag::Roads
        | Tag::SideWalks
        | Tag::Building
        | Tag::Wall
        | Tag::Fence
        | Tag::Terrain
        | Tag::Sky
        | Tag::Water
        | Tag::RoadLine
        | Tag::Ground
        | Tag::Bridge
        | Tag::RailTrack
        | Tag::GuardRail => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn every_object_lies_in_its_box_and_fills_it() {
        let text = mapgen::named("Millbrook").expect("a named town");
        let town = town::furnish(&road::Network::parse(&text).expect("a map"), 1);
        let objects = StaticObjects::new(town);
        let (mut parked, mut leaning) = (0, 0);
        for index in (0..objects.len()).filter(|index| objects.has_box(*index)) {
            let described = objects.describe(index);
            let (part, world_from_mesh) = objects.mesh(index);
            let box_from_mesh = described.world_from_box.affine().inverse() * world_from_mesh;
            let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
            for corner in part.triangles.iter().flatten() {
                let position = part.positions[(corner - part.first) as usize];
                let own = box_from_mesh.transform_point3(Vec3::from_array(position));
                (low, high) = (low.min(own), high.max(own));
            }
            let half = Vec3::from_array(described.size_m) * 0.5;
            // The boxes of vehicles are those of CARLA's blueprints.
            let close = if described.blueprint.is_some() { 0.1 } else { 0.01 };
            assert!(
                (low + half).abs().max_element() < close
                    && (high - half).abs().max_element() < close,
                "{index}, {:?}: {low} to {high}, half {half}",
                described.tag
            );
            parked += u32::from(described.blueprint.is_some());
            let up = described.world_from_box.rotation() * Vec3::Z;
            leaning += u32::from(up.z < 0.9999);
        }
        assert!(parked > 20 && leaning > 5, "{parked} parked, {leaning} lean");
    }
}
