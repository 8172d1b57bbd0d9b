//! Everything that is derived from the map before the first frame.

use std::sync::{Arc, OnceLock};

use bake::{Cache, Key, Parts};
use road::Network;
use town::Detail;
use walkable::Ground;

use crate::{
    approach::Approaches, beside::Beside, body::Bodies, conflict::Conflicts, grid::Grid,
    signals::SignalPlan, tracks::Tracks, walkers::WalkerGround,
};

/// Makes the walkable ground of a map.
pub(crate) type GroundSource = Box<dyn Fn() -> Ground + Send + Sync>;

/// The map as the planner reads it; constant during an episode.
pub(crate) struct Map {
    pub(crate) tracks: Tracks,
    pub(crate) beside: Beside,
    pub(crate) grid: Grid,
    pub(crate) conflicts: Conflicts,
    pub(crate) approaches: Approaches,
    pub(crate) signals: SignalPlan,
    pub(crate) bodies: Bodies,
    ground_source: GroundSource,
    walker_ground: OnceLock<WalkerGround>,
}

/// Source code that determines what is kept in the cache. It is part of the key, so that what other
/// code has derived is not used.
const CODE: &str = concat!(
    include_str!("body.rs"),
    include_str!("conflict.rs"),
    include_str!("grid.rs"),
    include_str!("map.rs"),
    include_str!("swept_path.rs"),
    include_str!("tracks.rs"),
    include_str!("tracks/lookup.rs"),
);

/// Returns what furnishes the town around a network for its walkable ground.
pub(crate) fn furnished_ground(network: &Arc<Network>, seed: u64) -> GroundSource {
    let network = Arc::clone(network);
    Box::new(move || Ground::new(&network, &town::furnish(&network, seed)))
}

/// Returns what makes the walkable ground of a town that lies in the cache.
pub(crate) fn cached_ground(
    cache: &Cache,
    network: &Arc<Network>,
    open_drive: &str,
    seed: u64,
) -> GroundSource {
    let (cache, network, open_drive) = (cache.clone(), Arc::clone(network), open_drive.to_owned());
    Box::new(move || Ground::new(&network, &cache.ground_around(&network, &open_drive, seed)))
}

/// What takes long to derive.
struct Lanes {
    tracks: Tracks,
    grid: Grid,
    conflicts: Conflicts,
}

impl Map {
    /// Derives everything from a network.
    pub(crate) fn new(network: &Network, ground_source: GroundSource) -> Map {
        Map::of(network, Lanes::new(network), ground_source)
    }

    /// As [`Map::new`], with what takes long from the cache if possible; otherwise it is kept.
    /// `open_drive` is the text of `network`.
    pub(crate) fn cached(
        cache: &Cache,
        network: &Network,
        open_drive: &str,
        ground_source: GroundSource,
    ) -> Map {
        let key = Key::new("lanes", CODE, open_drive, 0, Detail::Standard);
        let found = cache.find(key).and_then(|mut parts| Lanes::take(&mut parts));
        let lanes = found.unwrap_or_else(|| {
            let lanes = Lanes::new(network);
            let Lanes { tracks, grid, conflicts } = &lanes;
            let parts = [tracks.parts(), grid.parts(), conflicts.parts()].concat();
            cache.keep(key, &parts.iter().map(|part| &**part).collect::<Vec<_>>());
            lanes
        });
        Map::of(network, lanes, ground_source)
    }

    /// Returns the ground of walkers, which is made when the first one walks.
    pub(crate) fn walker_ground(&self) -> &WalkerGround {
        self.walker_ground.get_or_init(|| {
            let ground = (self.ground_source)();
            WalkerGround::new(&ground, &self.tracks, &self.grid, &self.approaches)
        })
    }

    fn of(
        network: &Network,
        Lanes { tracks, grid, conflicts }: Lanes,
        ground_source: GroundSource,
    ) -> Map {
        let beside = Beside::new(network, &tracks);
        let approaches = Approaches::new(network, &tracks, &conflicts);
        let signals = SignalPlan::new(network, &tracks, &conflicts, &approaches);
        Map {
            tracks,
            beside,
            grid,
            conflicts,
            approaches,
            signals,
            bodies: Bodies::from_catalogue(),
            ground_source,
            walker_ground: OnceLock::new(),
        }
    }
}

impl Lanes {
    fn new(network: &Network) -> Lanes {
        let tracks = Tracks::new(network);
        // Either takes about a third of a start.
        let (grid, conflicts) = std::thread::scope(|scope| {
            let grid = scope.spawn(|| Grid::new(&tracks));
            let conflicts = Conflicts::new(&tracks);
            (grid.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), conflicts)
        });
        Lanes { tracks, grid, conflicts }
    }

    fn take(parts: &mut Parts) -> Option<Lanes> {
        Some(Lanes {
            tracks: Tracks::take(parts)?,
            grid: Grid::take(parts)?,
            conflicts: Conflicts::take(parts)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::maps;

    #[test]
    fn lanes_from_the_cache_have_the_bits_of_those_from_the_network() {
        let network = maps::town();
        let folder = std::env::temp_dir().join(format!("omnibus-lanes-{}", std::process::id()));
        let cache = Cache::in_folder(&folder);
        let bytes = |map: &Map| {
            let Map { tracks, grid, conflicts, .. } = map;
            [tracks.parts(), grid.parts(), conflicts.parts()].concat().concat()
        };
        let built = Map::new(&network, Box::new(Ground::default));
        assert!(
            bytes(&Map::cached(&cache, &network, "a map", Box::new(Ground::default)))
                == bytes(&built)
        );
        let key = Key::new("lanes", CODE, "a map", 0, Detail::Standard);
        let lanes = cache.find(key).and_then(|mut parts| Lanes::take(&mut parts));
        let kept =
            Map::of(&network, lanes.expect("they are in the cache"), Box::new(Ground::default));
        assert!(bytes(&kept) == bytes(&built) && bytes(&built).len() > 100_000);
        std::fs::remove_dir_all(&folder).unwrap();
        for lane in 0..built.tracks.count() as u32 {
            assert_eq!(kept.conflicts.of(lane), built.conflicts.of(lane));
        }
    }
}
