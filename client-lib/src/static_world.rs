//! The furnished town of one world, and its objects.

use std::sync::OnceLock;

use glam::{Quat, Vec3};
use mesh::{Mesh, ObjectId, Tag};
use protocol::{BlueprintInfo, Pose};
use town::Town;

use crate::{Layers, RayGrid, RayHit, World};

/// A static object of the town.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapObject {
    /// Its number: instance images show it with the highest bit set, and
    /// [`Client::hide_objects`](crate::Client::hide_objects) takes it.
    pub id: u32,
    /// Its semantic tag.
    pub tag: Tag,
    /// Its layer.
    pub layer: Layers,
    /// `world_from_box`: the middle and the turn of its bounding box.
    pub pose: Pose,
    /// Half the size of its bounding box, metres.
    pub half_extents_m: Vec3,
}

/// A street light of the town.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct StreetLight {
    /// The number of its pole, which [`Client::switch_street_lights`](crate::Client::switch_street_lights) takes.
    pub id: u32,
    /// Where the light comes from, in world space, metres.
    pub position: Vec3,
}

/// The town of one world as it was loaded, with the objects that were hidden since.
pub(crate) struct StaticWorld {
    town: Town,
    /// The mesh for rays, with coarse plants, and its grid.
    grid: OnceLock<(Mesh, RayGrid)>,
}

impl StaticWorld {
    pub(crate) fn new(town: Town) -> StaticWorld {
        StaticWorld { town, grid: OnceLock::new() }
    }

    pub(crate) fn map_objects(&self) -> Vec<MapObject> {
        let objects = self.town.objects.iter().zip(0..).map(|(object, index)| MapObject {
            id: number_of(index),
            tag: object.tag,
            layer: Layers::from_bits_retain(object.layer.bit()),
            pose: Pose::new(object.center, Quat::from_rotation_z(object.yaw_rad)),
            half_extents_m: object.half_extents_m,
        });
        objects.collect()
    }

    pub(crate) fn street_lights(&self) -> Vec<StreetLight> {
        let light =
            |lamp: &town::Lamp| StreetLight { id: number_of(lamp.object), position: lamp.position };
        self.town.lamps.iter().map(light).collect()
    }

    /// Returns the hits of a ray between two places in world space; see [`RayGrid::cast`].
    pub(crate) fn cast_ray(
        &self,
        ends: [Vec3; 2],
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Vec<RayHit> {
        let (mesh, grid) = self.grid.get_or_init(|| {
            let mesh = self.town.mesh_with_coarse_plants();
            let grid = RayGrid::new(&mesh);
            (mesh, grid)
        });
        grid.cast(mesh, ends, world, blueprints)
    }
}

/// Returns the number of an object by its index in the town's list.
fn number_of(index: u32) -> u32 {
    ObjectId::from_index(index).number()
}
