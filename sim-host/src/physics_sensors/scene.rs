//! The scene that a physics sensor measures.

use protocol::{ActorId, SnapshotHeader};
use road::Network;

use crate::world::World;

/// The world and roads at the measured frame.
pub(super) struct Scene<'a> {
    pub(super) world: &'a World,
    pub(super) network: Option<&'a Network>,
    /// The actor that carries the sensor.
    pub(super) parent: ActorId,
    pub(super) header: &'a SnapshotHeader,
}
