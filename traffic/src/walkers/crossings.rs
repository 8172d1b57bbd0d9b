//! Whether a walker may begin to cross: lights, vehicles that approach, vehicles that stand there.

use glam::Vec2;
use protocol::light;
use walkable::Area;

use super::{
    approaching::{Approach, Approaching},
    view::View,
};

/// Time for which lights have to stay red when a walker begins. Seconds.
const CLEARANCE_S: f32 = 5.0;
/// Time from the begin of a phase in which walkers begin to cross; then turning vehicles find the crossing
/// free. The shortest walk interval of the Manual on Uniform Traffic Control Devices (2009), 4E.06. Seconds.
pub(crate) const WALK_S: f32 = 7.0;
/// Deceleration and reaction time that a walker expects of a vehicle that is to wait for it.
const BRAKE_MPS2: f32 = 1.8;
const REACTION_S: f32 = 1.0;
/// Distance before the middle of a crossing at which vehicles stop beyond half its width. Metres.
const STOP_M: f32 = 1.5;
/// Time between a walker and a vehicle that does not wait. Seconds.
const MARGIN_S: f32 = 2.0;
/// Speed below which a vehicle stands. Metres per second.
const STANDING_MPS: f32 = 0.3;
/// Distance along a crossing within which a walker looks at bodies in its way. Metres.
const BLOCKED_M: f32 = 1.2;

/// Whether a walker may begin to cross.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leave {
    Go,
    Wait,
}

/// What decides about crossings in a frame.
pub(super) struct Crossings<'a> {
    pub(super) view: &'a View<'a>,
    pub(super) approaching: &'a Approaching,
}

impl Crossings<'_> {
    /// Returns whether a walker that stands before a crossing may begin to cross.
    pub(super) fn leave(&self, crossing: u32, at: Vec2, wanted: Vec2) -> Leave {
        let on = &self.view.ground.crossings[crossing as usize];
        if !on.signals.iter().all(|signal| self.is_red(*signal)) {
            return Leave::Wait;
        }
        let speed = wanted.length().max(0.5);
        // From the walker to the kerb on the other side.
        let ahead = wanted.dot(on.axis).signum();
        let far_m = on.half_length_m - (at - on.center).dot(on.axis) * ahead;
        let takes_s = far_m.clamp(2.0, 60.0) / speed;
        let is_clear = |approach: &Approach| {
            let to_m = approach.ahead_m - on.half_width_m - STOP_M;
            if approach.ahead_m < 0.0 {
                // Its front is beyond the middle: it leaves, or stands on the crossing.
                return approach.ahead_m + approach.length_m + on.half_width_m < 0.5;
            }
            if !approach.is_planned || on.area == Area::Road {
                let passes = approach.speed_mps > STANDING_MPS;
                let arrives_s = to_m / approach.speed_mps.max(3.0);
                return if passes { arrives_s > takes_s + MARGIN_S } else { to_m > 0.0 };
            }
            let brakes_m = approach.speed_mps * REACTION_S
                + approach.speed_mps * approach.speed_mps / (2.0 * BRAKE_MPS2);
            brakes_m < to_m
        };
        let is_free = self.approaching.of(crossing).iter().all(is_clear);
        let is_blocked = self.is_blocked(crossing, at, wanted, |_| true);
        if is_free && !is_blocked { Leave::Go } else { Leave::Wait }
    }

    /// Whether a light stops the vehicles, has not for longer than walkers may begin, and will for long
    /// enough. Lights that a client holds red stay red.
    fn is_red(&self, signal: u32) -> bool {
        let shown = self.view.light_states.get(signal as usize).copied().unwrap_or(light::OFF);
        let signals = &self.view.map.signals;
        if shown == light::OFF {
            return true;
        }
        // A light without other phases is never red for long: vehicles wait for those that began.
        let is_short = signals.slot(signal).is_some_and(|(cycle, _)| signals.phases(cycle) == 1);
        shown == light::RED
            && (is_short
                || signals.shows(signal, self.view.clocks) != light::RED
                || signals.red_left_s(signal, self.view.clocks) >= CLEARANCE_S
                    && signals.phase_age_s(signal, self.view.clocks) <= WALK_S)
    }

    /// Whether a body of an agent that `counts` stands in the way of a walker on a crossing.
    pub(super) fn is_blocked(
        &self,
        crossing: u32,
        at: Vec2,
        wanted: Vec2,
        counts: impl Fn(u32) -> bool,
    ) -> bool {
        let on = &self.view.ground.crossings[crossing as usize];
        let agents = self.view.agents;
        let ahead = wanted.normalize_or_zero();
        on.lanes.iter().any(|crossed| {
            self.view.occupancy.on(crossed.lane).iter().any(|occupant| {
                let agent = occupant.agent as usize;
                if agents.walks[agent] || !counts(occupant.agent) {
                    return false;
                }
                let reach_m = on.half_width_m + 0.5;
                let covers = occupant.rear_m < crossed.arc_m + reach_m
                    && occupant.front_m > crossed.arc_m - reach_m;
                let way = agents.position[agent].truncate() - at;
                let body = agents.body[agent];
                let beside_m = ahead.perp_dot(way).abs();
                covers && way.dot(ahead) > 0.0 && beside_m < body.front_m + BLOCKED_M
            })
        })
    }
}
