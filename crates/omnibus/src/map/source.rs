//! Which map a subcommand of `omnibus map` works on.

use std::path::PathBuf;

use anyhow::anyhow;
use road::Network;

use crate::launch::WorldArgs;

/// The map that a subcommand works on.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Source {
    /// An OpenDRIVE file, or the name of a map (see `omnibus maps`)
    pub(crate) map: String,
    /// A folder of OpenDRIVE files that maps are found in by name; default: OMNIBUS_MAPS
    #[arg(long, value_name = "DIR")]
    pub(crate) maps: Option<PathBuf>,
}

/// A parsed map.
pub(crate) struct Loaded {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) network: Network,
}

impl Source {
    /// Reads and parses the map.
    pub(crate) fn load(&self) -> anyhow::Result<Loaded> {
        let world = WorldArgs { maps: self.maps.clone(), ..WorldArgs::of_map(&self.map) };
        let episode = world.episode()?;
        let network = Network::parse(&episode.open_drive)
            .map_err(|e| anyhow!("{}:{}: {}", episode.map, e.line, e.reason))?;
        Ok(Loaded { name: episode.map, text: episode.open_drive, network })
    }
}
