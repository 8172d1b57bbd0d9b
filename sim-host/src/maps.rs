//! The source of maps and worlds.

use std::{fmt::Display, sync::Arc, time::Duration};

use bake::{Cache, LoadedTown, MapError};
use crossbeam::channel::{Receiver, RecvTimeoutError, bounded};
use protocol::{Episode, Refusal};
use town::Town;

use crate::world::World;

/// The source of maps. Only the composition root knows files and names.
pub trait Maps: Send + Sync {
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

impl From<Unbuilt> for Refusal {
    fn from(unbuilt: Unbuilt) -> Refusal {
        match unbuilt {
            Unbuilt::Stopped => Refusal::other("the simulator ends"),
            Unbuilt::Failed(why) => Refusal::map(why),
        }
    }
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
        spawn(build)?;
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

/// Runs what may take long beside the host.
fn spawn(work: impl FnOnce() + Send + 'static) -> Result<(), Unbuilt> {
    let spawned = std::thread::Builder::new().name("map".into()).spawn(work);
    spawned.map(drop).map_err(|e| Unbuilt::Failed(format!("no thread for the map: {e}")))
}

fn receive<T>(
    from: &Receiver<Result<T, impl Display>>,
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

/// Returns the name of a map and its text. A thread reads it, which is left behind if the host stops
/// meanwhile: its file may lie on a disk that does not answer.
pub(crate) fn find_map(
    maps: &Arc<dyn Maps>,
    name: &str,
    is_stopped: impl Fn() -> bool,
) -> Result<(String, String), Refusal> {
    let (has_found, found) = bounded(1);
    let (maps, name) = (Arc::clone(maps), name.to_owned());
    let spawned = spawn(move || drop(has_found.send(maps.find(&name))));
    Ok(spawned.and_then(|()| receive(&found, is_stopped))?)
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
    Ok(built?)
}

fn build_world(loaded: LoadedTown, seed: u64) -> BuiltWorld {
    let LoadedTown { town, is_new } = loaded;
    (World::new(&town, seed), is_new.then_some(town))
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    /// Its files lie on a disk that does not answer before the test has ended.
    struct Stuck(Arc<Barrier>);

    impl Maps for Stuck {
        fn find(&self, name: &str) -> Result<(String, String), String> {
            self.0.wait();
            Err(format!("{name} was read"))
        }

        fn names(&self) -> Vec<String> {
            Vec::new()
        }
    }

    #[test]
    fn a_host_that_stops_does_not_wait_for_a_map_file() {
        let barrier = Arc::new(Barrier::new(2));
        let maps: Arc<dyn Maps> = Arc::new(Stuck(Arc::clone(&barrier)));
        let refusal = find_map(&maps, "far", || true).unwrap_err();
        assert!(refusal.reason.contains("the simulator ends"), "{refusal:?}");
        barrier.wait();
    }
}
