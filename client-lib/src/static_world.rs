//! The furnished town: its objects, its street lights, and rays through it.

use std::sync::OnceLock;

use glam::{Quat, Vec3};
use mesh::{ObjectId, Tag};
use protocol::Pose;
use town::Town;

use crate::{Client, ClientError, Layers, RayGrid, RayHit};

/// A static object of the town.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MapObject {
    /// Its number: instance images show it with the highest bit set, and
    /// [`Client::hide_objects`] takes it.
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
    /// The number of its pole, which [`Client::switch_street_lights`] takes.
    pub id: u32,
    /// Where the light comes from, in world space, metres.
    pub position: Vec3,
}

/// The town of one world as it was loaded: what was hidden since is part of it.
pub(crate) struct StaticWorld {
    town: Town,
    grid: OnceLock<RayGrid>,
}

impl StaticWorld {
    pub(crate) fn new(town: Town) -> StaticWorld {
        StaticWorld { town, grid: OnceLock::new() }
    }
}

/// The number of an object by its place in the town's list.
fn number_of(index: u32) -> u32 {
    ObjectId::from_index(index).number()
}

impl Client {
    /// Returns every static object of the town. The first call of a world reads the town from the
    /// cache of baked maps, or furnishes it, which takes seconds.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn map_objects(&self) -> Result<Vec<MapObject>, ClientError> {
        let world = self.connection().static_world()?;
        let objects = world.town.objects.iter().zip(0..).map(|(object, index)| MapObject {
            id: number_of(index),
            tag: object.tag,
            layer: Layers::from_bits_retain(object.layer.bit()),
            pose: Pose::new(object.center, Quat::from_rotation_z(object.yaw_rad)),
            half_extents_m: object.half_extents_m,
        });
        Ok(objects.collect())
    }

    /// Returns every street light of the town; see [`Client::map_objects`].
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn street_lights(&self) -> Result<Vec<StreetLight>, ClientError> {
        let world = self.connection().static_world()?;
        let light =
            |lamp: &town::Lamp| StreetLight { id: number_of(lamp.object), position: lamp.position };
        Ok(world.town.lamps.iter().map(light).collect())
    }

    /// Returns all hits of a ray from one place to another in world space (metres), the nearest
    /// first: surfaces of the static world, and bounding boxes of actors at the frame that was taken
    /// in last. Hidden objects are hit, too. See [`Client::map_objects`] for the first call.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn cast_ray(&self, from: Vec3, to: Vec3) -> Result<Vec<RayHit>, ClientError> {
        let world = self.connection().static_world()?;
        let grid = world.grid.get_or_init(|| RayGrid::new(&world.town.mesh));
        Ok(grid.cast(&world.town.mesh, [from, to], self.world(), self.blueprints()))
    }
}
