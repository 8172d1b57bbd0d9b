//! The connections that tick the world.

use crate::rpc::Peer;

/// The connections that have ticked the world and are still open.
#[derive(Default)]
pub(crate) struct Tickers(Vec<Peer>);

impl Tickers {
    /// Adds a connection that ticks.
    ///
    /// As in CARLA, the ticks of two clients both advance the world; a warning names them.
    pub(crate) fn add(&mut self, peer: &Peer, frame: u64) {
        if self.0.contains(peer) {
            return;
        }
        if let Some(other) = self.0.last() {
            log::warn!(
                "{frame} clients {} and {} both tick; each tick advances the world",
                other.address,
                peer.address
            );
        }
        self.0.push(*peer);
    }

    /// Removes a closed connection and returns whether no ticking connection is left.
    pub(crate) fn remove(&mut self, peer: &Peer) -> bool {
        self.0.retain(|ticker| ticker != peer);
        self.0.is_empty()
    }
}
