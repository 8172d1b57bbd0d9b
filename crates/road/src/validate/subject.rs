use super::positions::Positions;
use crate::network::Network;

/// A network under validation, with the positions of its parts in the text.
pub(super) struct Subject<'a> {
    pub(super) network: &'a Network,
    pub(super) positions: &'a Positions,
}
