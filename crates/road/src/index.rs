//! The spatial index: lane centres as short segments in a grid, refined on the exact curve where
//! they bend.

mod nearest;
mod pieces;

use crate::{grid::LaneIndexGrid, network::Network, road::Road};

/// Fewest lanes for each thread.
const LANES_MIN: usize = 500;

/// Builds the index on up to `threads` threads; the result does not depend on their number.
pub(crate) fn lane_grid(network: &Network, threads: usize) -> LaneIndexGrid {
    let total_m: f64 = network.lanes().iter().map(|lane| lane.length_m).sum();
    let roads = network.roads();
    let parts = threads.min(network.lanes().len() / LANES_MIN).max(1);
    let of = |roads: &[Road]| pieces::of_roads(network, roads, total_m);
    let mut parts = network.road_ranges(parts).into_iter().map(|part| &roads[part]);
    let Some(first) = parts.next() else { return LaneIndexGrid::default() };
    let segments = std::thread::scope(|scope| {
        let helpers: Vec<_> = parts
            .map(|part| {
                let helper = std::thread::Builder::new()
                    .name("road-index".to_string())
                    .spawn_scoped(scope, move || of(part));
                (part, helper)
            })
            .collect();
        let mut segments = of(first);
        for (part, helper) in helpers {
            let found = helper.ok().and_then(|helper| helper.join().ok());
            segments.append(&mut found.unwrap_or_else(|| of(part)));
        }
        segments
    });
    LaneIndexGrid::filled(segments)
}
