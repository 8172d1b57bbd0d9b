//! Walkers that go together: companions walk beside the one with which they go.

use glam::Vec2;

use super::{pace, table::WalkerTable, view::View};

/// Distance between neighbours in a group. Metres.
const ABREAST_M: f32 = 0.8;
/// A companion farther behind than this slows the group, and farther than that stops it. Metres.
const SLOWS_M: f32 = 1.8;
const STOPS_M: f32 = 3.5;
/// A companion this far away is not waited for. Metres.
const LEFT_M: f32 = 60.0;
/// A companion farther away than this searches for a way. Metres.
const LOST_M: f32 = 7.0;
/// Time in which a companion corrects its place in the group. Seconds.
const CORRECTION_S: f32 = 0.9;
/// How much faster than its own speed a companion walks to catch up.
const HURRY: f32 = 1.4;

/// Groups: which walkers go with which, in rows of the table.
#[derive(Default)]
pub(super) struct Groups {
    leader: Vec<Option<usize>>,
    /// By row: how many earlier companions its leader has.
    nth: Vec<usize>,
    /// By row: whether it is far from its leader, or something lies between them.
    lost: Vec<bool>,
    /// By row: what part of its speed a leader walks.
    share: Vec<f32>,
    /// By row of a leader: the speed of the slowest of its group.
    speed_mps: Vec<f32>,
}

impl Groups {
    /// Reads which walkers go with which.
    pub(super) fn find(
        &mut self,
        table: &WalkerTable,
        standing: &[Option<(u32, Vec2)>],
        view: &View<'_>,
    ) {
        let count = table.count();
        let named = |row: usize| {
            let leader = table.row_of(view.params.walks_with(table.id(row))?)?;
            (leader != row).then_some(leader)
        };
        self.leader.clear();
        // Only a walker that goes with no other leads.
        self.leader
            .extend((0..count).map(|row| named(row).filter(|leader| named(*leader).is_none())));
        self.nth.clear();
        self.nth.resize(count, 0);
        self.lost.clear();
        self.lost.resize(count, false);
        self.share.clear();
        self.share.resize(count, 1.0);
        self.speed_mps.clear();
        self.speed_mps.extend((0..count).map(|row| pace::speed(view, table.id(row))));
        let mut companions = vec![0; count];
        let agents = view.agents;
        let at = |row: usize| agents.position[agents.led[row] as usize].truncate();
        for (row, standing) in standing.iter().enumerate() {
            let Some(leader) = self.leader[row] else { continue };
            self.nth[row] = companions[leader];
            companions[leader] += 1;
            let apart_m = at(row).distance(at(leader));
            // The ground between both must be free, or they would wait for each other around a corner.
            let is_connected = |on: (u32, Vec2)| {
                let (_, there) = view.ground.surface.step(on.0, on.1, at(leader), |_| true);
                there.distance(at(leader)) < 0.5
            };
            self.lost[row] =
                apart_m > LOST_M || apart_m > SLOWS_M && !standing.is_some_and(is_connected);
            let share = match apart_m {
                m if m > LEFT_M => 1.0,
                m if m > STOPS_M => 0.0,
                m if m > SLOWS_M => 0.6,
                _ => 1.0,
            };
            self.share[leader] = self.share[leader].min(share);
            self.speed_mps[leader] = self.speed_mps[leader].min(self.speed_mps[row]);
        }
    }

    /// Returns the row of the walker with which this one goes.
    pub(super) fn leader(&self, row: usize) -> Option<usize> {
        self.leader[row]
    }

    /// Whether a walker has lost its leader and needs a way to it.
    pub(super) fn is_lost(&self, row: usize) -> bool {
        self.lost[row]
    }

    /// Returns the speed at which a walker walks if its companions need not catch up.
    pub(super) fn speed_mps(&self, row: usize) -> f32 {
        self.speed_mps[self.leader[row].unwrap_or(row)]
    }

    /// Returns the speed at which a walker walks so that its companions keep up.
    pub(super) fn patient_speed_mps(&self, row: usize) -> f32 {
        self.speed_mps[row] * self.share[row]
    }

    /// Whether two walkers belong to one group.
    pub(super) fn are_together(&self, a: usize, b: usize) -> bool {
        let head = |row: usize| self.leader[row].unwrap_or(row);
        head(a) == head(b)
    }

    /// Returns the velocity by which a companion keeps its place beside its leader.
    pub(super) fn beside(&self, row: usize, at: Vec2, view: &View<'_>) -> Vec2 {
        let Some(leader) = self.leader[row] else { return Vec2::ZERO };
        let agents = view.agents;
        let ahead = agents.led[leader] as usize;
        let (center, forward) = (agents.position[ahead].truncate(), agents.forward[ahead]);
        // Alternately to the right and to the left.
        let nth = self.nth[row];
        let side = if nth.is_multiple_of(2) { -1.0 } else { 1.0 };
        let aside_m = ABREAST_M * side * (nth / 2 + 1) as f32;
        let moves = agents.velocity[ahead];
        let wanted = center + forward.perp() * aside_m;
        let surface = &view.ground.surface;
        // Where the ground is too narrow, behind the leader.
        let place = match surface.nearest(center, 1.0) {
            Some((on, near)) => {
                let there = surface.step(on, near, wanted, |_| true).1;
                if there.distance(near) > 0.75 * aside_m.abs() {
                    there
                } else {
                    let behind = center - forward * (ABREAST_M * (nth + 1) as f32);
                    surface.step(on, near, behind, |_| true).1
                }
            }
            None => wanted,
        };
        let speed = self.speed_mps(row);
        let correction = (place - at) / CORRECTION_S;
        let is_there = moves.length() < 0.1 && place.distance(at) < 0.35;
        if is_there { Vec2::ZERO } else { (moves + correction).clamp_length(0.0, speed * HURRY) }
    }
}
