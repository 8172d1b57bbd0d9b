//! Junctions whose roads contradict each other in height.

use std::sync::OnceLock;

/// For each junction whether its roads contradict each other in height. Determined on first use,
/// because it takes long. It follows from the rest of the network, so all values compare equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contradictions(OnceLock<Vec<OnceLock<bool>>>);

impl PartialEq for Contradictions {
    fn eq(&self, _: &Contradictions) -> bool {
        true
    }
}

impl Contradictions {
    /// Returns whether the roads of `junction`, one of `count` junctions, contradict each other.
    /// Calls `find` the first time.
    pub(crate) fn get(&self, junction: u32, count: usize, find: impl FnOnce() -> bool) -> bool {
        let known = self.0.get_or_init(|| vec![OnceLock::new(); count]);
        *known[junction as usize].get_or_init(find)
    }
}
