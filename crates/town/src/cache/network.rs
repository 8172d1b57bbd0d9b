//! Road networks, which are used where they lie in the cache.

use std::sync::Arc;
use std::thread;

use road::{MapError, Network};

use super::file::Parts;
use super::{Cache, Key};
use crate::Detail;

impl Cache {
    /// The network of a map's text: kept, or read anew and then kept.
    pub fn network(&self, open_drive: &str) -> Result<Network, MapError> {
        if self.folder.is_none() {
            return Network::parse(open_drive);
        }
        let key = Key::new("network", "", open_drive, 0, Detail::Standard);
        if let Some(network) = self.find(key).and_then(|mut parts| take(&mut parts)) {
            return Ok(network);
        }
        let network = Network::parse(open_drive)?;
        self.keep(key, &[&network.to_bytes()]);
        Ok(network)
    }
}

fn take(parts: &mut Parts) -> Option<Network> {
    let (mapped, check) = parts.map()?;
    let bytes = Arc::new(mapped);
    // Whatever the bytes are, reading them breaks nothing; what they add up to decides.
    thread::scope(|scope| {
        let holds = || check.holds((*bytes).as_ref());
        let helper = thread::Builder::new().name("cache-check".to_owned());
        let checked = helper.spawn_scoped(scope, holds);
        let network = Network::from_bytes(bytes.clone());
        let holds = checked.ok().and_then(|helper| helper.join().ok()).unwrap_or_else(holds);
        network.filter(|_| holds)
    })
}
