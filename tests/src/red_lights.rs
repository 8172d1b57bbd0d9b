//! Vehicles that drive past the line of a traffic light that shows red, judged from where they are.

use std::collections::BTreeMap;

use protocol::{ActorId, ActorState, light};
use road::{LaneIndex, Network, Signal};
use traffic::VehiclePlan;

/// How far the front is beyond a line that has been passed: vehicles stop at lines, and their origin is not in their
/// middle. Metres.
const BEYOND_M: f32 = 1.0;
/// A light counts as red from this long on, because a decision acts a frame later. Seconds.
const RED_S: f32 = 0.2;

/// Lights by what they govern, and the vehicles that have passed their lines.
pub(crate) struct RedLights {
    /// Lines by lane outside of junctions: distance along it, and the signals there.
    lines: BTreeMap<LaneIndex, Vec<(f32, u32)>>,
    /// Signals of one way into a junction alone: the lane before, and the first lane inside.
    turns: BTreeMap<u32, Vec<(LaneIndex, LaneIndex)>>,
    /// How long each signal has been red. Seconds.
    red_s: BTreeMap<u32, f32>,
    vehicles: BTreeMap<ActorId, Passage>,
}

/// A vehicle before or within a junction.
#[derive(Default)]
struct Passage {
    lane: Option<LaneIndex>,
    front_m: f32,
    /// Signals that were red when it passed their lines on the lane.
    passed: Vec<u32>,
}

impl RedLights {
    pub(crate) fn new(network: &Network) -> RedLights {
        let (mut lines, mut turns) = (BTreeMap::<_, Vec<_>>::new(), BTreeMap::<_, Vec<_>>::new());
        for (signal, number) in network.signals().iter().zip(0u32..) {
            if !is_vehicle_light(signal) {
                continue;
            }
            for at in network.approaches(signal) {
                let line_m = at.along_m as f32 + BEYOND_M;
                lines.entry(at.lane).or_default().push((line_m, number));
            }
            let inside = signal.lanes.iter().filter(|(lane, _)| is_inside(network, *lane));
            for (lane, _) in inside {
                turns.entry(number).or_default().extend(entries(network, *lane));
            }
        }
        RedLights { lines, turns, red_s: BTreeMap::new(), vehicles: BTreeMap::new() }
    }

    /// Advances the time for which lights have been red.
    pub(crate) fn advance(&mut self, lights: &[ActorState], delta_s: f32) {
        for actor in lights {
            let red_s = self.red_s.entry(actor.signal).or_default();
            *red_s = if actor.phase == light::RED { *red_s + delta_s } else { 0.0 };
        }
    }

    /// Follows a vehicle with its front `ahead_m` ahead of its origin. Returns the signal that it has not obeyed, when
    /// it drives into the junction.
    pub(crate) fn follow(&mut self, plan: &VehiclePlan, ahead_m: f32) -> Option<u32> {
        let passage = self.vehicles.entry(plan.actor_id).or_default();
        let front_m = plan.along_m + ahead_m;
        let mut disobeyed = None;
        if let Some(before) = passage.lane.filter(|before| *before != plan.lane) {
            // Some signals stand before the line at which vehicles wait for green, and some ways have several.
            let governs = |signal: u32| {
                let turns = self.turns.get(&signal);
                turns.is_none_or(|turns| turns.contains(&(before, plan.lane)))
            };
            let is_red = |signal: u32| self.red_s.get(&signal).is_some_and(|red_s| *red_s > RED_S);
            let lines = self.lines.get(&before).into_iter().flatten();
            let are_red = lines.map(|line| line.1).filter(|signal| governs(*signal)).all(is_red);
            disobeyed = passage.passed.iter().copied().find(|signal| are_red && governs(*signal));
            passage.passed.clear();
        } else if passage.lane.is_some()
            && let Some(lines) = self.lines.get(&plan.lane)
        {
            for (line_m, signal) in lines {
                let is_red = self.red_s.get(signal).is_some_and(|red_s| *red_s > RED_S);
                if is_red && passage.front_m < *line_m && front_m >= *line_m {
                    passage.passed.push(*signal);
                }
            }
        }
        (passage.lane, passage.front_m) = (Some(plan.lane), front_m);
        disobeyed
    }
}

/// Types are those of ASAM OpenDRIVE's catalogue without a country: the others are for pedestrians, cyclists and
/// trams.
fn is_vehicle_light(signal: &Signal) -> bool {
    let others = ["1000002", "1000003", "1000007", "1000013"];
    signal.dynamic && !others.contains(&signal.kind.as_str())
}

fn is_inside(network: &Network, lane: LaneIndex) -> bool {
    network.lane(lane).junction.is_some()
}

/// Returns the ways into a junction that lead to a lane inside of it: the lane before, and the first inside.
fn entries(network: &Network, lane: LaneIndex) -> Vec<(LaneIndex, LaneIndex)> {
    let (mut open, mut found) = (vec![lane], Vec::new());
    for _ in 0..8 {
        for inside in std::mem::take(&mut open) {
            for before in &network.lane(inside).predecessors {
                if is_inside(network, *before) {
                    open.push(*before);
                } else {
                    found.push((*before, inside));
                }
            }
        }
    }
    found
}
