//! Objects and street lights of the town, and rays through it.

use glam::Vec3;

use crate::{Client, ClientError, MapObject, RayHit, StreetLight};

impl Client {
    /// Returns every static object of the town. The first call of a world reads the town from the
    /// cache of baked maps, or furnishes it, which takes seconds.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn map_objects(&self) -> Result<Vec<MapObject>, ClientError> {
        Ok(self.connection().static_world()?.map_objects())
    }

    /// Returns every street light of the town; see [`Client::map_objects`].
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn street_lights(&self) -> Result<Vec<StreetLight>, ClientError> {
        Ok(self.connection().static_world()?.street_lights())
    }

    /// Returns all hits of a ray from one place to another in world space (metres), the nearest
    /// first: surfaces of the static world, and bounding boxes of actors at the frame that was taken
    /// in last. Hidden objects are hit, too. See [`Client::map_objects`] for the first call.
    ///
    /// # Errors
    ///
    /// As for [`Client::map`].
    pub fn cast_ray(&self, from: Vec3, to: Vec3) -> Result<Vec<RayHit>, ClientError> {
        let static_world = self.connection().static_world()?;
        Ok(static_world.cast_ray([from, to], self.world(), self.blueprints()))
    }
}
