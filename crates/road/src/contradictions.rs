//! Which junctions contradict themselves in height.

use std::sync::OnceLock;

/// For each junction whether its roads contradict each other in height. Found on first use, as it
/// takes long, and derived from the rest of the network: all values are equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contradictions(OnceLock<Vec<OnceLock<bool>>>);

impl PartialEq for Contradictions {
    fn eq(&self, _: &Contradictions) -> bool {
        true
    }
}

impl Contradictions {
    /// Returns whether the roads of `junction`, one of `count`, contradict each other; `find` says
    /// so the first time.
    pub(crate) fn get(&self, junction: u32, count: usize, find: impl FnOnce() -> bool) -> bool {
        let known = self.0.get_or_init(|| vec![OnceLock::new(); count]);
        *known[junction as usize].get_or_init(find)
    }
}
