//! Presences by lane, and rows by the lane on which they leave a junction.

/// The presence of a vehicle on a lane of a junction, now or soon.
#[derive(Clone, Copy)]
pub(super) struct Presence {
    pub(super) lane: u32,
    /// Index into the agents.
    pub(super) agent: u32,
    /// Distance from its front bumper to the start of the lane.
    pub(super) start_m: f32,
    pub(super) rank: i32,
    /// Highest speed that the lanes on its way allow.
    pub(super) top_mps: f32,
}

/// Lists of entries, one for each lane.
pub(super) struct ByLane<T> {
    lists: Vec<Vec<T>>,
    /// Lanes whose lists may hold entries.
    used: Vec<u32>,
}

impl<T> Default for ByLane<T> {
    fn default() -> ByLane<T> {
        ByLane { lists: Vec::new(), used: Vec::new() }
    }
}

impl<T> ByLane<T> {
    /// Empties the lists of a map of `lanes` lanes, and keeps their allocations.
    pub(super) fn clear(&mut self, lanes: usize) {
        for lane in self.used.drain(..) {
            self.lists[lane as usize].clear();
        }
        self.lists.resize_with(lanes, Vec::new);
    }

    /// Returns the entries of a lane.
    pub(super) fn of(&self, lane: u32) -> &[T] {
        self.lists.get(lane as usize).map_or(&[], |list| list)
    }

    fn list(&mut self, lane: u32) -> &mut Vec<T> {
        let list = &mut self.lists[lane as usize];
        if list.is_empty() {
            self.used.push(lane);
        }
        list
    }
}

impl ByLane<Presence> {
    /// Adds a presence; those of a lane ascend by agent.
    pub(super) fn add(&mut self, presence: Presence) {
        let list = self.list(presence.lane);
        let at = list.partition_point(|p| p.agent < presence.agent);
        list.insert(at, presence);
    }
}

impl ByLane<u32> {
    /// Adds a row to a lane, once; those of a lane ascend.
    pub(super) fn add_row(&mut self, lane: u32, row: u32) {
        let list = self.list(lane);
        if let Err(at) = list.binary_search(&row) {
            list.insert(at, row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presences_ascend_by_agent_and_are_gone_after_the_frame() {
        let mut list = ByLane::<Presence>::default();
        for _ in 0..2 {
            list.clear(4);
            for (lane, agent) in [(2, 7), (2, 3), (1, 9), (2, 5)] {
                list.add(Presence { lane, agent, start_m: 0.0, rank: 0, top_mps: 0.0 });
            }
            let agents = |lane| list.of(lane).iter().map(|p| p.agent).collect::<Vec<_>>();
            assert_eq!((agents(2), agents(1), agents(0)), (vec![3, 5, 7], vec![9], vec![]));
        }
        assert!(list.of(99).is_empty(), "a lane beyond the map has none");
        let mut rows = ByLane::<u32>::default();
        rows.clear(2);
        for row in [4, 1, 4] {
            rows.add_row(1, row);
        }
        assert_eq!(rows.of(1), [1, 4]);
    }
}
