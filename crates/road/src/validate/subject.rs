use super::places::Places;
use crate::network::Network;

/// A network and where its parts stand in the text.
pub(super) struct Judged<'a> {
    pub(super) network: &'a Network,
    pub(super) places: &'a Places,
}
