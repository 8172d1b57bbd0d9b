//! State of each walker on autopilot beyond the snapshot.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

use super::pace;

/// Time without progress after which a walker looks for another way. Seconds.
const STUCK_S: f32 = 10.0;
/// Time for which it looks for one that leads back. Seconds.
const BACK_S: f32 = 1.0;
/// Time that a walker has to come forward to make up for a second without progress. Seconds.
const MADE_UP_S: f32 = 0.5;
/// Most points of a way in a saved state.
const POINTS_MAX: u32 = 100_000;

/// One walker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Row {
    id: u32,
    /// Number of random draws so far.
    pub(super) draws: u32,
    /// One of [`goal`].
    pub(super) goal: u32,
    /// How long it has not come forward although it is allowed to.
    stuck_s: f32,
    /// For how long it still waits outside the swept path out of which it has stepped.
    pub(super) aside_s: f32,
    points: u32,
}

/// Values of [`Row::goal`].
pub(super) mod goal {
    /// None: it has to choose one.
    pub(crate) const NONE: u32 = 0;
    /// A place that it chose itself.
    pub(crate) const OWN: u32 = 1;
    /// The first place of its client's route.
    pub(crate) const CLIENT: u32 = 2;
    /// The walker with which it goes.
    pub(crate) const COMPANION: u32 = 3;
}

/// One row for each walker on autopilot, ascending by actor id.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct WalkerTable {
    rows: Vec<Row>,
    /// By row: the points where it turns on its way; the last is the destination.
    ways: Vec<Vec<Vec2>>,
}

impl WalkerTable {
    pub(crate) fn count(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn id(&self, row: usize) -> u32 {
        self.rows[row].id
    }

    pub(super) fn row_of(&self, id: u32) -> Option<usize> {
        self.rows.binary_search_by_key(&id, |row| row.id).ok()
    }

    pub(super) fn row(&mut self, row: usize) -> &mut Row {
        &mut self.rows[row]
    }

    /// Returns whether a walker leaves its way to a vehicle for now.
    pub(super) fn gives_way(&self, row: usize) -> bool {
        self.rows[row].aside_s > 0.0
    }

    pub(super) fn goal(&self, row: usize) -> u32 {
        self.rows[row].goal
    }

    pub(super) fn way(&self, row: usize) -> &[Vec2] {
        &self.ways[row]
    }

    /// Changes the rows to those of `ids` (ascending): keeps the state of walkers that stay.
    pub(crate) fn retain(&mut self, ids: impl Iterator<Item = u32> + Clone) {
        if self.rows.iter().map(|row| row.id).eq(ids.clone()) {
            return;
        }
        let mut old = std::mem::take(self);
        for id in ids {
            let (row, way) = match old.row_of(id) {
                Some(row) => (old.rows[row], std::mem::take(&mut old.ways[row])),
                None => (Row { id, ..Row::default() }, Vec::new()),
            };
            self.rows.push(row);
            self.ways.push(way);
        }
    }

    /// Gives a walker a way to a goal.
    pub(super) fn set_way(&mut self, row: usize, goal: u32, way: Vec<Vec2>) {
        self.rows[row].goal = goal;
        self.rows[row].stuck_s = 0.0;
        self.rows[row].points = way.len() as u32;
        self.ways[row] = way;
    }

    /// Gives a walker a way to a goal of its own.
    #[cfg(test)]
    pub(crate) fn set_own_way(&mut self, row: usize, way: Vec<Vec2>) {
        self.set_way(row, goal::OWN, way);
    }

    /// Drops the way of an actor, if it is a walker with a row.
    pub(crate) fn drop_way(&mut self, id: u32) {
        if let Some(row) = self.row_of(id) {
            self.set_way(row, goal::NONE, Vec::new());
        }
    }

    /// Removes the first point of a way.
    pub(super) fn pass_point(&mut self, row: usize) {
        self.ways[row].remove(0);
        self.rows[row].points = self.ways[row].len() as u32;
    }

    /// Whether a walker has not come forward for so long that it looks for another way.
    pub(super) fn is_stuck(&self, row: usize) -> bool {
        self.rows[row].stuck_s > STUCK_S
    }

    /// Whether that way has to lead back; if none is found soon, it need not.
    pub(super) fn turns_round(&self, row: usize) -> bool {
        self.is_stuck(row) && self.rows[row].stuck_s < STUCK_S + BACK_S
    }

    /// Measures how long a walker has not come forward.
    pub(super) fn watch(
        &mut self,
        row: usize,
        wanted: Vec2,
        chosen: Vec2,
        is_held: bool,
        delta_s: f32,
    ) {
        let state = &mut self.rows[row];
        if is_held || wanted == Vec2::ZERO {
            state.stuck_s = 0.0;
        } else if chosen.dot(wanted.normalize()) < pace::SLOW_MPS {
            state.stuck_s += delta_s;
        } else {
            state.stuck_s = (state.stuck_s - delta_s / MADE_UP_S).max(0.0);
        }
    }

    /// Appends the bytes of all rows.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(bytemuck::cast_slice(&self.rows));
        for way in &self.ways {
            bytes.extend_from_slice(bytemuck::cast_slice(way));
        }
    }

    /// Returns the number of bytes that [`WalkerTable::write`] writes.
    pub(crate) fn byte_count(&self) -> usize {
        let points: usize = self.ways.iter().map(Vec::len).sum();
        self.rows.len() * size_of::<Row>() + points * size_of::<Vec2>()
    }

    /// Reads `count` rows; `None` if the bytes are cut off, too long or out of order.
    pub(crate) fn read(count: usize, bytes: &[u8]) -> Option<WalkerTable> {
        let (rows, mut rest) = bytes.split_at_checked(count.checked_mul(size_of::<Row>())?)?;
        let rows: Vec<Row> =
            rows.chunks_exact(size_of::<Row>()).map(bytemuck::pod_read_unaligned).collect();
        let mut ways = Vec::new();
        for row in &rows {
            if row.points > POINTS_MAX || row.goal > goal::COMPANION {
                return None;
            }
            let (way, after) = rest.split_at_checked(row.points as usize * size_of::<Vec2>())?;
            rest = after;
            let way: Vec<Vec2> =
                way.chunks_exact(size_of::<Vec2>()).map(bytemuck::pod_read_unaligned).collect();
            if way.iter().any(|point| !point.is_finite()) {
                return None;
            }
            ways.push(way);
        }
        let ascends = rows.windows(2).all(|pair| pair[0].id < pair[1].id);
        (rest.is_empty() && ascends).then_some(WalkerTable { rows, ways })
    }
}
