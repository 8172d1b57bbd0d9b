//! From a map's text to its road network or its town, out of the cache where possible.

use std::{sync::Arc, thread};

use mesh::Mesh;
use road::Network;
use town::{Detail, Town};

use crate::{
    cache::{Cache, Key},
    file::Parts,
    town_bytes::{town_from_bytes, town_to_bytes},
};

/// Why a map cannot be used, with the map's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapError {
    /// The map's name or path.
    pub map: String,
    /// The line and the reason.
    pub cause: road::MapError,
}

// By hand: the message holds the cause, so the cause must not be reported as `source()` again.
impl std::error::Error for MapError {}

impl std::fmt::Display for MapError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.map, self.cause)
    }
}

/// A town that can be loaded without a further error: its baked bytes are in the cache, or its map
/// has been parsed.
#[derive(Debug)]
pub struct TownSource<'a> {
    cache: &'a Cache,
    map: &'a str,
    open_drive: &'a str,
    seed: u64,
    /// None where the cache has a file of the town.
    network: Option<Network>,
}

/// A town, and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedTown {
    /// The town.
    pub town: Town,
    /// Whether it had to be furnished: [`Cache::keep_town`] saves the next start that work.
    pub is_new: bool,
}

impl Cache {
    /// The road network of the map that is called `map`. A network that was parsed is kept.
    ///
    /// # Errors
    ///
    /// The map's text is not OpenDRIVE that can be driven on.
    pub fn network(&self, map: &str, open_drive: &str) -> Result<Network, MapError> {
        let parse = || {
            let named = |cause| MapError { map: map.to_owned(), cause };
            Network::parse(open_drive).map_err(named)
        };
        if !self.is_enabled() {
            return parse();
        }
        let key = Key::new("network", "", open_drive, 0, Detail::Standard);
        if let Some(network) = self.find(key).and_then(|mut parts| take_network(&mut parts)) {
            return Ok(network);
        }
        let network = parse()?;
        self.keep(key, &[&network.to_bytes()]);
        Ok(network)
    }

    /// The town of the map that is called `map`. A town that was furnished is not kept.
    ///
    /// # Errors
    ///
    /// The map's text is not OpenDRIVE that can be driven on.
    pub fn town(&self, map: &str, open_drive: &str, seed: u64) -> Result<Town, MapError> {
        match self.find_town(open_drive, seed) {
            Some(town) => Ok(town),
            None => Ok(town::furnish(&self.network(map, open_drive)?, seed)),
        }
    }

    /// The town round `network`, which was read from `open_drive`.
    pub fn town_around(&self, network: &Network, open_drive: &str, seed: u64) -> Town {
        self.find_town(open_drive, seed).unwrap_or_else(|| town::furnish(network, seed))
    }

    /// The part of the town round `network` that decides physics: [`Town::without_scenery`]. It is
    /// kept.
    pub fn ground_around(&self, network: &Network, open_drive: &str, seed: u64) -> Town {
        let key = Key::new("ground", "", open_drive, seed, Detail::Standard);
        let kept = self.find(key).and_then(|mut parts| parts.take::<u8>());
        if let Some(town) = kept.and_then(|bytes| town_from_bytes(&bytes).ok()) {
            return town;
        }
        let town = self.town_around(network, open_drive, seed).without_scenery();
        if self.is_enabled() {
            self.keep(key, &[&town_to_bytes(&town)]);
        }
        town
    }

    /// The part of the town round `network` that decides physics beside the ground: the result of
    /// [`Cache::ground_around`] without its mesh. It is kept.
    pub fn solids_around(&self, network: &Network, open_drive: &str, seed: u64) -> Town {
        let key = Key::new("solids", "", open_drive, seed, Detail::Standard);
        let kept = self.find(key).and_then(|mut parts| parts.take::<u8>());
        if let Some(town) = kept.and_then(|bytes| town_from_bytes(&bytes).ok()) {
            return town;
        }
        let mut town = self.ground_around(network, open_drive, seed);
        town.mesh = Mesh::default();
        if self.is_enabled() {
            self.keep(key, &[&town_to_bytes(&town)]);
        }
        town
    }

    /// The first half of [`Cache::town`]: finds everything that can be wrong with the map.
    ///
    /// # Errors
    ///
    /// The map's text is not OpenDRIVE that can be driven on.
    pub fn town_source<'a>(
        &'a self,
        map: &'a str,
        open_drive: &'a str,
        seed: u64,
    ) -> Result<TownSource<'a>, MapError> {
        let is_baked = self.find(town_key(open_drive, seed)).is_some();
        let network = if is_baked { None } else { Some(self.network(map, open_drive)?) };
        Ok(TownSource { cache: self, map, open_drive, seed, network })
    }

    /// The town that was kept for this map and seed.
    pub fn find_town(&self, open_drive: &str, seed: u64) -> Option<Town> {
        let bytes: Vec<u8> = self.find(town_key(open_drive, seed))?.take()?;
        town_from_bytes(&bytes).ok()
    }

    /// Keeps the town of this map and seed.
    pub fn keep_town(&self, open_drive: &str, seed: u64, town: &Town) {
        if self.is_enabled() {
            self.keep(town_key(open_drive, seed), &[&town_to_bytes(town)]);
        }
    }
}

impl TownSource<'_> {
    /// Loads or furnishes the town.
    ///
    /// # Errors
    ///
    /// The baked town is damaged, and the map's text is not OpenDRIVE that can be driven on.
    pub fn load(self) -> Result<LoadedTown, MapError> {
        let TownSource { cache, map, open_drive, seed, network } = self;
        let network = match network {
            Some(network) => network,
            None => match cache.find_town(open_drive, seed) {
                Some(town) => return Ok(LoadedTown { town, is_new: false }),
                // The baked town is damaged.
                None => cache.network(map, open_drive)?,
            },
        };
        Ok(LoadedTown { town: town::furnish(&network, seed), is_new: true })
    }
}

fn town_key(open_drive: &str, seed: u64) -> Key {
    Key::new("town", "", open_drive, seed, Detail::Standard)
}

fn take_network(parts: &mut Parts) -> Option<Network> {
    let (mapped, expected) = parts.map()?;
    let bytes = Arc::new(mapped);
    // The checksum is computed beside the reading: damaged bytes cannot break the reader, and a
    // network whose bytes do not match is dropped.
    thread::scope(|scope| {
        let matches = || expected.matches((*bytes).as_ref());
        let helper = thread::Builder::new().name("cache-check".to_owned());
        let checked = helper.spawn_scoped(scope, matches);
        let network = Network::from_bytes(bytes.clone());
        let matches = checked.ok().and_then(|helper| helper.join().ok()).unwrap_or_else(matches);
        network.filter(|_| matches)
    })
}
