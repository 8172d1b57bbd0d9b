//! Which standing vehicle waits for which others.

use std::collections::BTreeSet;

use super::state::{Junctions, View};
use crate::{
    constraint::WaitReason, leader, obstacles, spread::Spread, tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Gap within which a vehicle waits for its leader, on its own lane or on another one of a merge.
pub(super) const BEHIND_M: f32 = 5.0;
/// Length of the longest cycle that is searched.
const CYCLE_LEN_MAX: usize = 16;
/// Square of the speed below which a vehicle stands, (m/s)².
const STANDING: f32 = 0.25;

/// Which rows each row waits for; a vehicle that moves waits for none. A row is examined when it is
/// first visited, because cycles are short and most vehicles are in none.
pub(super) struct WaitGraph {
    waits_for: Vec<Option<[u32; 3]>>,
    /// All waits, once they are needed: the row that is waited for, and the one that waits. Sorted.
    reversed: Option<Vec<(u32, u32)>>,
}

impl WaitGraph {
    /// Creates the graph of `count` rows, of which none is examined yet.
    pub(super) fn new(count: usize) -> WaitGraph {
        WaitGraph { waits_for: vec![None; count], reversed: None }
    }

    fn after(&mut self, row: usize, examine: &impl Fn(usize) -> [u32; 3]) -> Vec<usize> {
        let waits = self.waits_for[row].get_or_insert_with(|| examine(row));
        waits.iter().filter(|&&row| row != NONE).map(|&row| row as usize).collect()
    }

    /// Returns a cycle of vehicles that wait for each other, beginning with `row`. `examine` returns
    /// the rows that a row waits for; it gives the same for as long as the graph is used.
    pub(super) fn cycle(
        &mut self,
        row: usize,
        examine: &impl Fn(usize) -> [u32; 3],
    ) -> Option<Vec<usize>> {
        let mut path = vec![row];
        let mut open: Vec<Vec<usize>> = vec![self.after(row, examine)];
        let mut seen = BTreeSet::new();
        while let Some(next) = open.last_mut() {
            let Some(at) = (!next.is_empty()).then(|| next.remove(0)) else {
                open.pop();
                path.pop();
                continue;
            };
            if at == row {
                return Some(path);
            }
            if path.len() < CYCLE_LEN_MAX && seen.insert(at) {
                path.push(at);
                open.push(self.after(at, examine));
            }
        }
        None
    }

    /// Returns the rows of a cycle and all rows that wait for one of them, ascending.
    pub(super) fn blocked_by(
        &mut self,
        cycle: &[usize],
        examine: &(impl Fn(usize) -> [u32; 3] + Sync),
        spread: Spread,
    ) -> Vec<usize> {
        let reversed = self.reversed.take().unwrap_or_else(|| {
            let mut waits = Vec::new();
            spread.list(self.waits_for.len(), &mut waits, |row, waits| {
                let of_row = self.waits_for[row].unwrap_or_else(|| examine(row));
                let others = of_row.into_iter().filter(|&to| to != NONE);
                waits.extend(others.map(|to| (to, row as u32)));
            });
            waits.sort_unstable();
            waits
        });
        let mut blocked: BTreeSet<usize> = cycle.iter().copied().collect();
        let mut open = cycle.to_vec();
        while let Some(row) = open.pop() {
            let begin = reversed.partition_point(|&(to, _)| (to as usize) < row);
            let waiting = reversed[begin..].iter().take_while(|&&(to, _)| to as usize == row);
            for &(_, waits) in waiting {
                if blocked.insert(waits as usize) {
                    open.push(waits as usize);
                }
            }
        }
        self.reversed = Some(reversed);
        blocked.into_iter().collect()
    }
}

impl Junctions {
    /// Returns the rows that a row waits for, or [`NONE`].
    pub(super) fn waits_of(&self, vehicles: &VehicleTable, row: usize, view: &View) -> [u32; 3] {
        let agents = view.agents;
        let velocity = agents.velocity[agents.driven[row] as usize];
        if vehicles[row].located == 0 || velocity.length_squared() > STANDING {
            return [NONE; 3];
        }
        self.blockers_of(vehicles, row, view).map(|agent| {
            let other = agents.row.get(agent as usize).copied().unwrap_or(NONE);
            let is_planned = other != NONE && vehicles[other as usize].located == 1;
            if is_planned && other as usize != row { other } else { NONE }
        })
    }

    /// Returns the agents that a standing row waits for: by the rules of a junction, as the leader
    /// on its lane, and as the leader on another lane of a merge; [`NONE`] where there is none.
    fn blockers_of(&self, vehicles: &VehicleTable, row: usize, view: &View) -> [u32; 3] {
        let required = match self.waits[row] {
            WaitReason::Signal => self.blocker_beyond(vehicles, row, view),
            _ => self.blocker(row),
        };
        let (tracks, agents) = (&view.map.tracks, view.agents);
        let mut leader =
            leader::leader(&vehicles[row], row, tracks, agents, view.occupancy, BEHIND_M);
        for obstacle in obstacles::of_row(view.obstacles, row) {
            leader = leader.nearer(obstacle.leader);
        }
        let constraint = &self.constraints[row];
        let follows =
            leader.gap_m < BEHIND_M && (required == NONE || leader.gap_m < constraint.stop_m);
        let merges = constraint.merge_leader_m < BEHIND_M;
        [
            if follows { NONE } else { required },
            if follows { leader.agent } else { NONE },
            if merges { self.merges_behind[row] } else { NONE },
        ]
    }

    /// Returns the agent for which a row at a red light would wait if the light were green. Lights that
    /// are never green together would otherwise hide a cycle: one of its rows always waits for a light.
    fn blocker_beyond(&self, vehicles: &VehicleTable, row: usize, view: &View) -> u32 {
        let request = self.request(&vehicles[row], row, view);
        request.map_or(NONE, |request| self.way_free(vehicles, &request, view).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_found_by_any_of_the_waits_of_its_members() {
        let waits_for = [
            [4, NONE, 1], // 0 waits for 4, which waits for none, and for 1.
            [2, NONE, NONE],
            [NONE, 0, NONE],
            [NONE, 1, NONE],
            [NONE; 3],
        ];
        let examine = |row: usize| waits_for[row];
        let mut graph = WaitGraph::new(waits_for.len());
        assert_eq!(graph.cycle(0, &examine), Some(vec![0, 1, 2]));
        assert_eq!(graph.cycle(2, &examine), Some(vec![2, 0, 1]));
        let none = (graph.cycle(3, &examine), graph.cycle(4, &examine));
        assert_eq!(none, (None, None), "they are in no cycle");
        assert_eq!(graph.blocked_by(&[0, 1, 2], &examine, Spread::Alone), [0, 1, 2, 3]);
        assert_eq!(
            graph.blocked_by(&[2, 0, 1], &examine, Spread::Alone),
            [0, 1, 2, 3],
            "and again"
        );
    }
}
