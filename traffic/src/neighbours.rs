//! Agents by place, so that the search for those around a point does not visit all.

use glam::Vec2;

/// Edge of a cell, metres.
const CELL_M: f32 = 32.0;
/// Least number of buckets, as a power of two.
const BUCKET_BITS_MIN: u32 = 4;

/// Indices of agents in a hash table of square cells.
#[derive(Default)]
pub(crate) struct Neighbours {
    /// Begin of each bucket in the list; one more entry than buckets.
    first: Vec<u32>,
    list: Vec<u32>,
    /// Of each agent that is listed, in the order of the agents.
    hashes: Vec<u32>,
    bits: u32,
}

impl Neighbours {
    /// Lists these agents: index and position, in ascending order of the index.
    pub(crate) fn rebuild(&mut self, agents: impl Iterator<Item = (u32, Vec2)> + Clone) {
        self.hashes.clear();
        self.hashes.extend(agents.clone().map(|(_, place)| hash(cell(place))));
        let count = self.hashes.len();
        self.bits = count.next_power_of_two().trailing_zeros().max(BUCKET_BITS_MIN);
        self.first.clear();
        self.first.resize((1 << self.bits) + 1, 0);
        for &hash in &self.hashes {
            self.first[bucket(hash, self.bits) + 1] += 1;
        }
        for index in 1..self.first.len() {
            self.first[index] += self.first[index - 1];
        }
        self.list.clear();
        self.list.resize(count, 0);
        // Afterwards each entry is the end of its bucket, which is where the next one begins.
        for ((agent, _), &hash) in agents.zip(&self.hashes) {
            let at = &mut self.first[bucket(hash, self.bits)];
            self.list[*at as usize] = agent;
            *at += 1;
        }
        self.first.rotate_right(1);
        self.first[0] = 0;
    }

    /// Returns all agents within `reach_m` of a place in the ground plane and some farther away,
    /// ascending.
    pub(crate) fn near(&self, place: Vec2, reach_m: f32) -> Vec<u32> {
        if self.list.is_empty() {
            return Vec::new();
        }
        let (low, high) = (cell(place - reach_m), cell(place + reach_m));
        let cells = [0, 1].map(|axis| i64::from(high[axis]) - i64::from(low[axis]) + 1);
        let mut found = if cells[0].saturating_mul(cells[1]) >= self.first.len() as i64 {
            self.list.clone()
        } else {
            let mut found = Vec::new();
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let bucket = bucket(hash([x, y]), self.bits);
                    let (begin, end) = (self.first[bucket], self.first[bucket + 1]);
                    found.extend_from_slice(&self.list[begin as usize..end as usize]);
                }
            }
            found
        };
        // Two cells may share a bucket.
        found.sort_unstable();
        found.dedup();
        found
    }
}

fn cell(place: Vec2) -> [i32; 2] {
    (place / CELL_M).floor().to_array().map(|value| value as i32)
}

fn hash([x, y]: [i32; 2]) -> u32 {
    let mixed = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77);
    mixed.wrapping_mul(0xc2b2_ae3d)
}

/// Returns the bucket of the cells with a hash.
fn bucket(hash: u32, bits: u32) -> usize {
    (hash >> (32 - bits)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::RandomStream;

    #[test]
    fn every_agent_within_reach_is_found_once_and_in_order() {
        for count in [0usize, 1, 7, 300] {
            let mut draws = RandomStream::from_state(count as u64);
            let mut place = || (Vec2::new(draws.unit(), draws.unit()) - 0.5) * 1500.0;
            let places: Vec<Vec2> = (0..count).map(|_| place()).collect();
            let mut neighbours = Neighbours::default();
            neighbours.rebuild((0..).zip(places.iter().copied()));
            let reaches = [1.0f32, 40.0, 90.0].repeat(40);
            for reach_m in reaches.into_iter().chain([1e9]) {
                let at = place();
                let found = neighbours.near(at, reach_m);
                assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
                let mut within = 0;
                for (agent, other) in places.iter().enumerate() {
                    if other.distance(at) < reach_m {
                        assert!(found.contains(&(agent as u32)), "{agent} at {reach_m} m");
                        within += 1;
                    }
                }
                assert!(reach_m > 100.0 || found.len() < 70 + 4 * within, "it visits few others");
            }
        }
    }

    #[test]
    fn a_table_without_agents_is_empty() {
        assert!(Neighbours::default().near(Vec2::ZERO, 10.0).is_empty());
        let mut neighbours = Neighbours::default();
        neighbours.rebuild([(3, Vec2::splat(f32::MAX))].into_iter());
        assert_eq!(neighbours.near(Vec2::splat(f32::MAX), 10.0), [3]);
    }
}
