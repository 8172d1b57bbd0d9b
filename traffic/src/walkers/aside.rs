//! Room for vehicles that wait for walkers in their swept paths: on a sidewalk over which the overhang
//! sweeps, and on a crossing on which the vehicle stands.

use glam::Vec2;

use super::view::View;
use crate::obstacles::across;

/// Speed below which a vehicle waits. Metres per second.
const WAITING_MPS: f32 = 0.5;
/// Gap between a vehicle and a walker in front of it up to which it would not start.
const BEFORE_M: f32 = 2.0;
/// Speed with which a walker steps aside. Metres per second.
pub(super) const ASIDE_MPS: f32 = 0.7;
/// Distance between walkers within which one that stands hinders the other. Metres.
const SHOULDER_M: f32 = 1.0;

/// Walkers that vehicles wait for because they stand in swept paths.
#[derive(Default)]
pub(super) struct InSweptPaths {
    /// Agents, and the directions out of the paths, ascending by agent.
    found: Vec<(u32, Vec2)>,
    /// The vehicles that wait for them, ascending by agent.
    waiting: Vec<u32>,
}

impl InSweptPaths {
    pub(super) fn find(&mut self, view: &View<'_>) {
        let agents = view.agents;
        self.found.clear();
        self.waiting.clear();
        for obstacle in view.obstacles {
            let (walker, vehicle) = (obstacle.leader.agent, agents.driven[obstacle.row]);
            let waits = agents.speed(vehicle as usize).abs() < WAITING_MPS;
            if agents.walks[walker as usize] && waits {
                self.found.push((walker, obstacle.away));
                self.waiting.push(vehicle);
            }
        }
        self.push_neighbours(view);
        self.push_leaders(view);
        // Stable: of several vehicles the first counts.
        self.found.sort_by_key(|(walker, _)| *walker);
        self.waiting.sort_unstable();
        self.waiting.dedup();
    }

    /// Adds walkers that stand in the way of those that step aside: they step in the same direction.
    fn push_neighbours(&mut self, view: &View<'_>) {
        let agents = view.agents;
        let at = |walker: u32| agents.position[walker as usize].truncate();
        let mut next = 0;
        while let Some(&(walker, away)) = self.found.get(next) {
            next += 1;
            for &other in &agents.led {
                let offset = at(other) - at(walker);
                let is_in_way = offset.length_squared() < SHOULDER_M * SHOULDER_M
                    && offset.dot(away) > 0.3 * offset.length();
                let stands = agents.velocity[other as usize].length() < WAITING_MPS;
                if is_in_way && stands && self.found.iter().all(|(found, _)| *found != other) {
                    self.found.push((other, away));
                }
            }
        }
    }

    /// Adds walkers right before vehicles that wait for them: beside the swept path, a vehicle keeps its
    /// distance too.
    fn push_leaders(&mut self, view: &View<'_>) {
        let agents = view.agents;
        for (row, leader) in view.leaders.iter().enumerate() {
            let vehicle = agents.driven[row];
            if leader.gap_m < BEFORE_M
                && agents.walks[leader.agent as usize]
                && agents.speed(vehicle as usize).abs() < WAITING_MPS
            {
                let [at, walker_at] =
                    [vehicle, leader.agent].map(|agent| agents.position[agent as usize]);
                let to = (walker_at - at).truncate();
                self.found.push((leader.agent, across(agents.forward[vehicle as usize], to)));
                self.waiting.push(vehicle);
            }
        }
    }

    /// Returns whether no vehicle waits for a walker.
    pub(super) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Returns whether a vehicle waits for a walker in its swept path.
    pub(super) fn holds_up(&self, vehicle: u32) -> bool {
        self.waiting.binary_search(&vehicle).is_ok()
    }

    /// Returns whether a vehicle waits for a walker.
    pub(super) fn has(&self, walker: u32) -> bool {
        self.found.binary_search_by_key(&walker, |(found, _)| *found).is_ok()
    }

    /// Returns the velocity out of the path of a vehicle that waits for a walker.
    pub(super) fn aside(&self, walker: u32) -> Option<Vec2> {
        let at = self.found.partition_point(|found| found.0 < walker);
        let (_, away) = self.found.get(at).filter(|found| found.0 == walker)?;
        Some(*away * ASIDE_MPS)
    }
}
