//! What does not change within an episode: the map, its town, and data computed from both.

use std::sync::{Arc, OnceLock, PoisonError, RwLock};

use bake::Cache;
use client_lib::{BlueprintInfo, ClientError, Instance, RayGrid, RayHit, World, wire::Episode};
use glam::Vec3;
use road::Network;
use town::Town;

use crate::{
    cosmos::{self, Stroke},
    navigation,
};

/// The map and the town of an episode.
pub(crate) struct Statics {
    pub(crate) episode: Episode,
    network: Arc<Network>,
    /// The map's text as clients read it, if it differs from the episode's.
    repaired: OnceLock<Option<String>>,
    town: OnceLock<Town>,
    /// The triangles of the town, sorted for ray casts.
    grid: OnceLock<RayGrid>,
    navigation: OnceLock<Option<NavigationFile>>,
    /// The lines of the Cosmos visualization.
    strokes: OnceLock<Vec<Stroke>>,
}

/// The navigation mesh of pedestrians, as a file.
pub(crate) struct NavigationFile {
    /// The name under which clients store the file; it contains a checksum of the contents.
    pub(crate) name: String,
    pub(crate) file: Vec<u8>,
}

impl Statics {
    pub(crate) fn new(episode: Episode, network: Arc<Network>) -> Statics {
        Statics {
            episode,
            network,
            repaired: OnceLock::new(),
            town: OnceLock::new(),
            grid: OnceLock::new(),
            navigation: OnceLock::new(),
            strokes: OnceLock::new(),
        }
    }

    /// Reads the map of the episode that the host has begun, and returns the number of the episode.
    /// If it is the map of `before`, that is returned.
    ///
    /// # Errors
    ///
    /// Returns an error if the map cannot be read or parsed.
    pub(crate) fn load(
        instance: &Instance,
        before: &Arc<Statics>,
    ) -> Result<(u32, Arc<Statics>), ClientError> {
        let (number, episode) = instance.numbered_episode()?;
        if episode == before.episode {
            return Ok((number, Arc::clone(before)));
        }
        let network = Cache::from_environment().network(&episode.map, &episode.open_drive)?;
        Ok((number, Arc::new(Statics::new(episode, Arc::new(network)))))
    }

    /// Returns the road network.
    pub(crate) fn network(&self) -> &Arc<Network> {
        &self.network
    }

    /// Returns the name of the map: the file name without folder and extension.
    pub(crate) fn map_name(&self) -> &str {
        let name = self.episode.map.rsplit('/').next().unwrap_or_default();
        name.strip_suffix(".xodr").unwrap_or(name)
    }

    /// Returns the map's text as clients can read it. Their library computes in single precision, in
    /// which a lane section shorter than a millimetre has no length and no direction.
    pub(crate) fn readable_open_drive(&self) -> &str {
        let make = || {
            // The host has read the same text, so that an error is none of the map.
            let repair = road::repair(&self.episode.open_drive).ok().flatten()?;
            log::info!(
                "map {}: clients receive {} lane sections of less than 1 mm as 1 mm long, and {} \
                 driving lanes of less than 1 cm that lead nowhere without a type",
                self.map_name(),
                repair.sections,
                repair.lanes
            );
            Some(repair.text)
        };
        self.repaired.get_or_init(make).as_deref().unwrap_or(&self.episode.open_drive)
    }

    /// Returns the navigation mesh, or `None` on a map without sidewalks.
    pub(crate) fn navigation(&self) -> Option<&NavigationFile> {
        let make = || {
            let file = navigation::file(&self.network, self.town())?;
            let sum = mesh::fnv1a64(&file);
            let name = format!("Carla/Maps/Nav/{}-{sum:016x}.bin", self.map_name());
            Some(NavigationFile { name, file })
        };
        self.navigation.get_or_init(make).as_ref()
    }

    /// Returns the lines of the map that the Cosmos visualization shows.
    pub(crate) fn strokes(&self) -> &[Stroke] {
        self.strokes.get_or_init(|| cosmos::of_map(&self.network, self.town()))
    }

    /// Starts a thread that computes what clients ask for first.
    pub(crate) fn prepare(self: &Arc<Statics>) {
        let statics = Arc::clone(self);
        let work = move || {
            statics.readable_open_drive();
            statics.navigation();
        };
        // Without this thread, the first call computes it.
        let _ = std::thread::Builder::new().name("carla-navigation".into()).spawn(work);
    }

    /// Returns everything that a segment in world space hits, nearest first.
    pub(crate) fn cast_ray(
        &self,
        segment: [Vec3; 2],
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Vec<RayHit> {
        self.grid().cast(&self.town().mesh, segment, world, blueprints)
    }

    /// Returns the grid of the town's triangles. It is built at the first call.
    pub(crate) fn grid(&self) -> &RayGrid {
        let mesh = &self.town().mesh;
        self.grid.get_or_init(|| RayGrid::new(mesh))
    }

    /// Returns the town. It is loaded at the first call.
    pub(crate) fn town(&self) -> &Town {
        self.town.get_or_init(|| {
            let Episode { open_drive, seed, .. } = &self.episode;
            Cache::from_environment().town_around(&self.network, open_drive, *seed)
        })
    }
}

/// The statics of the current episode, readable without the lock of the bridge.
pub(crate) struct SharedStatics(RwLock<Arc<Statics>>);

impl SharedStatics {
    pub(crate) fn new(statics: Arc<Statics>) -> SharedStatics {
        SharedStatics(RwLock::new(statics))
    }

    /// Returns the statics of the current episode.
    pub(crate) fn get(&self) -> Arc<Statics> {
        Arc::clone(&self.0.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Replaces the statics when another episode begins.
    pub(crate) fn set(&self, statics: Arc<Statics>) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = statics;
    }
}
