//! Everything that is derived from the map before the first frame.

use road::Network;

use crate::{
    approach::Approaches, beside::Beside, body::Bodies, conflict::Conflicts, grid::Grid,
    signals::SignalPlan, tracks::Tracks,
};

/// The map as the planner reads it; constant during an episode.
pub(crate) struct Map {
    pub(crate) tracks: Tracks,
    pub(crate) beside: Beside,
    pub(crate) grid: Grid,
    pub(crate) conflicts: Conflicts,
    pub(crate) approaches: Approaches,
    pub(crate) signals: SignalPlan,
    pub(crate) bodies: Bodies,
}

impl Map {
    /// Derives everything from a network.
    pub(crate) fn new(network: &Network) -> Map {
        let tracks = Tracks::new(network);
        let beside = Beside::new(network, &tracks);
        // Either takes about a third of a start.
        let (grid, conflicts) = std::thread::scope(|scope| {
            let grid = scope.spawn(|| Grid::new(&tracks));
            let conflicts = Conflicts::new(&tracks);
            (grid.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), conflicts)
        });
        let approaches = Approaches::new(network, &tracks, &conflicts);
        let signals = SignalPlan::new(network, &tracks, &conflicts, &approaches);
        Map {
            tracks,
            beside,
            grid,
            conflicts,
            approaches,
            signals,
            bodies: Bodies::from_catalogue(),
        }
    }
}
