use super::places::Places;
use crate::network::Network;

/// A network under validation, with the positions of its parts in the text.
pub(super) struct Judged<'a> {
    pub(super) network: &'a Network,
    pub(super) places: &'a Places,
}
