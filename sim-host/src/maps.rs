//! The source of maps and worlds.

use std::time::Duration;

use bake::{Cache, LoadedTown, MapError};
use crossbeam::channel::{Receiver, RecvTimeoutError, bounded};
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

/// A world that a thread builds from a map. The thread is left behind if the host stops meanwhile:
/// the map of a metropolis takes a minute.
pub(crate) struct MapThread {
    /// Whether the map is valid.
    parsed: Receiver<Result<(), MapError>>,
    built: Receiver<Result<BuiltWorld, MapError>>,
}

/// The world of frame 0, and its town if the town is new to the cache.
pub(crate) type BuiltWorld = (World, Option<Town>);

/// Why there is no world.
pub(crate) enum Unbuilt {
    /// The host stops.
    Stopped,
    /// The map is bad.
    Failed(String),
}

impl MapThread {
    /// Begins to build the world of an episode.
    pub(crate) fn start(cache: &Cache, episode: &Episode) -> Result<MapThread, Unbuilt> {
        let ((has_parsed, parsed), (has_built, built)) = (bounded(1), bounded(1));
        let (cache, episode) = (cache.clone(), episode.clone());
        // Nothing receives what is sent if the host has stopped.
        let build = move || {
            let Episode { map, open_drive, seed } = &episode;
            match cache.town_source(map, open_drive, *seed) {
                Err(why) => drop(has_parsed.send(Err(why))),
                Ok(source) => {
                    let _ = has_parsed.send(Ok(()));
                    let _ = has_built.send(source.load().map(|town| build_world(town, *seed)));
                }
            }
        };
        let spawned = std::thread::Builder::new().name("map".into()).spawn(build);
        spawned.map_err(|e| Unbuilt::Failed(format!("no thread for the map: {e}")))?;
        Ok(MapThread { parsed, built })
    }

    /// Waits until the map is known to be valid.
    pub(crate) fn await_valid(&self, is_stopped: impl Fn() -> bool) -> Result<(), Unbuilt> {
        receive(&self.parsed, is_stopped)
    }

    /// Waits for the world.
    pub(crate) fn finish(self, is_stopped: impl Fn() -> bool) -> Result<BuiltWorld, Unbuilt> {
        receive(&self.built, is_stopped)
    }
}

fn receive<T>(
    from: &Receiver<Result<T, MapError>>,
    is_stopped: impl Fn() -> bool,
) -> Result<T, Unbuilt> {
    loop {
        match from.recv_timeout(STOP_CHECK) {
            Ok(result) => return result.map_err(|e| Unbuilt::Failed(e.to_string())),
            Err(RecvTimeoutError::Timeout) if is_stopped() => return Err(Unbuilt::Stopped),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let why = "the map cannot be built; its thread panicked";
                return Err(Unbuilt::Failed(why.to_owned()));
            }
        }
    }
}

/// Builds the world of an episode.
pub(crate) fn load_world(
    cache: &Cache,
    episode: &Episode,
    is_stopped: impl Fn() -> bool,
) -> Result<BuiltWorld, Refusal> {
    let thread = MapThread::start(cache, episode);
    let built = thread.and_then(|thread| {
        thread.await_valid(&is_stopped)?;
        thread.finish(&is_stopped)
    });
    built.map_err(|unbuilt| match unbuilt {
        Unbuilt::Stopped => Refusal::other("the simulator ends"),
        Unbuilt::Failed(why) => Refusal::map(why),
    })
}

fn build_world(loaded: LoadedTown, seed: u64) -> BuiltWorld {
    let LoadedTown { town, is_new } = loaded;
    (World::new(&town, seed), is_new.then_some(town))
}
