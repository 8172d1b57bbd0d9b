//! The source of maps and worlds.

use bake::LoadedTown;
use town::Town;

use crate::world::World;

/// The source of maps. Only the composition root knows files and names.
pub trait Maps: Send {
    /// Returns the name of a map and its OpenDRIVE text.
    ///
    /// # Errors
    ///
    /// The cause as a text.
    fn find(&self, name: &str) -> Result<(String, String), String>;

    /// Returns the names of all maps.
    fn names(&self) -> Vec<String>;
}

/// Returns the world of frame 0, and its town if the town is new to the cache.
pub(crate) fn build_world(loaded: LoadedTown, seed: u64) -> (World, Option<Town>) {
    let LoadedTown { town, is_new } = loaded;
    (World::new(&town, seed), is_new.then_some(town))
}
