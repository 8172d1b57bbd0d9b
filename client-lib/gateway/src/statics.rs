//! The static world, furnished here as every stage does, when it is first asked after.

use std::sync::OnceLock;

use client_lib::Episode;
use town::{Town, cache::Cache};

use crate::{geo::GeoReference, rays::Grid};

/// A map and what stands round its roads.
pub(crate) struct Statics {
    pub(crate) episode: Episode,
    /// Where on earth it lies.
    pub(crate) geo: GeoReference,
    town: OnceLock<Town>,
    /// The town's triangles, sorted for rays.
    pub(crate) grid: OnceLock<Grid>,
}

impl Statics {
    pub(crate) fn new(episode: Episode) -> Statics {
        let geo = GeoReference::of(&episode.open_drive);
        Statics { episode, geo, town: OnceLock::new(), grid: OnceLock::new() }
    }

    /// The map's plain name: a file's without its folder and ending.
    pub(crate) fn map_name(&self) -> &str {
        let name = self.episode.map.rsplit('/').next().unwrap_or_default();
        name.strip_suffix(".xodr").unwrap_or(name)
    }

    /// The town.
    pub(crate) fn town(&self) -> &Town {
        self.town.get_or_init(|| {
            let Episode { open_drive, seed, .. } = &self.episode;
            let cache = Cache::of_environment();
            let baked = cache.find_town(open_drive, *seed);
            baked.unwrap_or_else(|| match cache.network(open_drive) {
                Ok(network) => town::furnish(&network, *seed),
                Err(_) => Town::default(),
            })
        })
    }
}
