//! The source of maps and worlds.

use std::time::Duration;

use bake::{Cache, LoadedTown, TownSource};
use crossbeam::channel::{RecvTimeoutError, bounded};
use protocol::{Episode, Refusal};
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

/// Time after which a host that loads a map checks whether it is to stop.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// Builds the world of an episode on a thread of its own, which is left behind if the host stops
/// meanwhile: the map of a metropolis takes a minute.
pub(crate) fn load_world(
    cache: &Cache,
    episode: &Episode,
    is_stopped: impl Fn() -> bool,
) -> Result<(World, Option<Town>), Refusal> {
    let (sender, built) = bounded(1);
    let (cache, episode) = (cache.clone(), episode.clone());
    let build = move || {
        let Episode { map, open_drive, seed } = &episode;
        let loaded = cache.town_source(map, open_drive, *seed).and_then(TownSource::load);
        // Nothing receives it if the host has stopped.
        let _ = sender.send(loaded.map(|loaded| build_world(loaded, *seed)));
    };
    let spawned = std::thread::Builder::new().name("map".into()).spawn(build);
    spawned.map_err(|e| Refusal::other(format!("no thread for the map: {e}")))?;
    loop {
        match built.recv_timeout(STOP_CHECK) {
            Ok(world) => return world.map_err(|e| Refusal::map(e.to_string())),
            Err(RecvTimeoutError::Timeout) if is_stopped() => {
                return Err(Refusal::other("the simulator ends"));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Refusal::map("the map cannot be built; its thread panicked"));
            }
        }
    }
}

/// Returns the world of frame 0, and its town if the town is new to the cache.
pub(crate) fn build_world(loaded: LoadedTown, seed: u64) -> (World, Option<Town>) {
    let LoadedTown { town, is_new } = loaded;
    (World::new(&town, seed), is_new.then_some(town))
}
