//! Which standing vehicle waits for which others.

use super::state::{Junctions, View};
use crate::{leader, tracks::NONE, vehicle_table::VehicleTable};

/// Gap within which a vehicle waits for its leader, on its own lane or on another one of a merge.
pub(super) const BEHIND_M: f32 = 5.0;
/// Length of the longest cycle that is searched.
const CYCLE_LEN_MAX: usize = 16;
/// Square of the speed below which a vehicle stands, (m/s)².
const STANDING: f32 = 0.25;

/// For each row: the rows that it waits for. A vehicle that moves waits for none.
pub(super) struct WaitGraph {
    waits_for: Vec<[u32; 3]>,
}

impl WaitGraph {
    /// Lists what the vehicles of this frame wait for.
    pub(super) fn new(junctions: &Junctions, vehicles: &VehicleTable, view: &View) -> WaitGraph {
        let agents = view.agents;
        let of = |row: usize| {
            let velocity = agents.velocity[agents.driven[row] as usize];
            if vehicles.located[row] == 0 || velocity.length_squared() > STANDING {
                return [NONE; 3];
            }
            junctions.blockers_of(vehicles, row, view).map(|agent| {
                let other = agents.row.get(agent as usize).copied().unwrap_or(NONE);
                let is_planned = other != NONE && vehicles.located[other as usize] == 1;
                if is_planned && other as usize != row { other } else { NONE }
            })
        };
        WaitGraph { waits_for: (0..vehicles.id.len()).map(of).collect() }
    }

    fn after(&self, row: usize) -> impl Iterator<Item = usize> {
        self.waits_for[row].into_iter().filter(|&row| row != NONE).map(|row| row as usize)
    }

    /// Returns a cycle of vehicles that wait for each other, beginning with `row`.
    pub(super) fn cycle(&self, row: usize) -> Option<Vec<usize>> {
        let mut path = vec![row];
        let mut open: Vec<Vec<usize>> = vec![self.after(row).collect()];
        let mut seen = vec![false; self.waits_for.len()];
        while let Some(next) = open.last_mut() {
            let Some(at) = (!next.is_empty()).then(|| next.remove(0)) else {
                open.pop();
                path.pop();
                continue;
            };
            if at == row {
                return Some(path);
            }
            if !seen[at] && path.len() < CYCLE_LEN_MAX {
                seen[at] = true;
                path.push(at);
                open.push(self.after(at).collect());
            }
        }
        None
    }

    /// Returns the rows of a cycle and all rows that wait for one of them.
    pub(super) fn blocked_by(&self, cycle: &[usize]) -> Vec<usize> {
        let mut blocked = cycle.to_vec();
        loop {
            let before = blocked.len();
            for row in 0..self.waits_for.len() {
                if !blocked.contains(&row) && self.after(row).any(|other| blocked.contains(&other))
                {
                    blocked.push(row);
                }
            }
            if blocked.len() == before {
                return blocked;
            }
        }
    }
}

impl Junctions {
    /// Returns the agents that a standing row waits for: by the rules of a junction, as the leader
    /// on its lane, and as the leader on another lane of a merge; [`NONE`] where there is none.
    fn blockers_of(&self, vehicles: &VehicleTable, row: usize, view: &View) -> [u32; 3] {
        let required = self.blocker(row);
        let (tracks, agents) = (&view.map.tracks, view.agents);
        let mut leader = leader::leader(vehicles, row, tracks, agents, view.occupancy, BEHIND_M);
        for obstacle in view.obstacles.iter().filter(|obstacle| obstacle.row == row) {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_found_by_any_of_the_waits_of_its_members() {
        let waits_for = vec![
            [4, NONE, 1], // 0 waits for 4, which waits for none, and for 1.
            [2, NONE, NONE],
            [NONE, 0, NONE],
            [NONE, 1, NONE],
            [NONE; 3],
        ];
        let graph = WaitGraph { waits_for };
        assert_eq!(graph.cycle(0), Some(vec![0, 1, 2]));
        assert_eq!(graph.cycle(2), Some(vec![2, 0, 1]));
        assert_eq!((graph.cycle(3), graph.cycle(4)), (None, None), "they are in no cycle");
        assert_eq!(graph.blocked_by(&[0, 1, 2]), [0, 1, 2, 3]);
    }
}
