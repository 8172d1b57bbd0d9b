//! Room for vehicles whose overhang sweeps over a sidewalk.

use glam::Vec2;

use super::view::View;

/// Speed below which a vehicle waits. Metres per second.
const WAITING_MPS: f32 = 0.5;
/// Speed with which a walker steps aside. Metres per second.
const ASIDE_MPS: f32 = 0.7;

/// Walkers that vehicles wait for because they stand in swept paths.
#[derive(Default)]
pub(super) struct InSweptPaths {
    /// Agents, and the directions out of the paths, ascending by agent.
    found: Vec<(u32, Vec2)>,
}

impl InSweptPaths {
    pub(super) fn find(&mut self, view: &View<'_>) {
        let agents = view.agents;
        self.found.clear();
        self.found.extend(view.obstacles.iter().filter_map(|obstacle| {
            let (walker, vehicle) = (obstacle.leader.agent, agents.driven[obstacle.row]);
            let waits = agents.speed(vehicle as usize).abs() < WAITING_MPS;
            (agents.walks[walker as usize] && waits).then_some((walker, obstacle.away))
        }));
        // Stable: of several vehicles the first counts.
        self.found.sort_by_key(|(walker, _)| *walker);
    }

    /// Returns the velocity out of the path of a vehicle that waits for a walker.
    pub(super) fn aside(&self, walker: u32) -> Option<Vec2> {
        let at = self.found.partition_point(|found| found.0 < walker);
        let (_, away) = self.found.get(at).filter(|found| found.0 == walker)?;
        Some(*away * ASIDE_MPS)
    }
}
