//! The static world, furnished here as every stage does, when it is first asked after.

use std::sync::{Arc, OnceLock};

use bake::Cache;
use client_lib::Episode;
use road::Network;
use town::Town;

use crate::{navigation, rays::Grid};

/// A map and what stands round its roads.
pub(crate) struct Statics {
    pub(crate) episode: Episode,
    network: Arc<Network>,
    town: OnceLock<Town>,
    /// The town's triangles, sorted for rays.
    pub(crate) grid: OnceLock<Grid>,
    walks: OnceLock<Option<Walks>>,
}

/// Where people walk.
pub(crate) struct Walks {
    /// Under this name clients keep it: another content, another name.
    pub(crate) name: String,
    pub(crate) file: Vec<u8>,
}

impl Statics {
    pub(crate) fn new(episode: Episode, network: Arc<Network>) -> Statics {
        let (town, grid, walks) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Statics { episode, network, town, grid, walks }
    }

    /// The map's plain name: a file's without its folder and ending.
    pub(crate) fn map_name(&self) -> &str {
        let name = self.episode.map.rsplit('/').next().unwrap_or_default();
        name.strip_suffix(".xodr").unwrap_or(name)
    }

    /// Where people walk; nothing on a map without sidewalks.
    pub(crate) fn walks(&self) -> Option<&Walks> {
        let make = || {
            let file = navigation::file(&self.network, self.town())?;
            let sum = file.iter().fold(0xcbf2_9ce4_8422_2325, |sum: u64, byte| {
                (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
            });
            let name = format!("Carla/Maps/Nav/{}-{sum:016x}.bin", self.map_name());
            Some(Walks { name, file })
        };
        self.walks.get_or_init(make).as_ref()
    }

    /// Makes what clients ask for first, before they do.
    pub(crate) fn prepare(self: &Arc<Statics>) {
        let statics = Arc::clone(self);
        let work = move || {
            statics.walks();
        };
        // Without a thread it is made when it is asked for.
        let _ = std::thread::Builder::new().name("carla-walks".into()).spawn(work);
    }

    /// The town.
    pub(crate) fn town(&self) -> &Town {
        self.town.get_or_init(|| {
            let Episode { open_drive, seed, .. } = &self.episode;
            Cache::from_environment().town_around(&self.network, open_drive, *seed)
        })
    }
}
