//! Vehicles that drive past the line of a traffic light that shows red, judged from where they are.

use std::collections::BTreeMap;

use protocol::{ActorId, ActorState, light};
use road::{LaneIndex, LanePoint, Network, Signal};
use traffic::VehiclePlan;

/// How far the front is beyond a line that has been passed: vehicles stop at lines, and their origin is not in their
/// middle. Metres.
const BEYOND_M: f32 = 1.0;
/// A light counts as red from this long on, because a decision acts a frame later. Seconds.
const RED_S: f32 = 0.2;

/// Resolution with which lanes are measured. Metres.
const STEP_M: f64 = 0.5;

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
                let line_m = arc_m(network, at) + BEYOND_M;
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

/// Returns the length of the centre of a lane up to a point, as plans measure it: the point counts along the
/// reference line of the road, which is longer or shorter in bends.
fn arc_m(network: &Network, to: LanePoint) -> f32 {
    let steps = (to.along_m / STEP_M).ceil().max(1.0);
    let place = |step: f64| {
        let along_m = to.along_m * step / steps;
        network.place(LanePoint { along_m, ..to }).position
    };
    let lengths =
        (0..steps as u32).map(f64::from).map(|step| place(step).distance(place(step + 1.0)));
    lengths.sum::<f64>() as f32
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

#[cfg(test)]
mod tests {
    use traffic::WaitReason;

    use super::*;

    fn plan(lane: LaneIndex, along_m: f32) -> VehiclePlan {
        VehiclePlan {
            actor_id: ActorId(1),
            lane,
            along_m,
            cross_track_error_m: 0.0,
            limit_mps: 10.0,
            desired_speed_mps: 10.0,
            leader: ActorId::NONE,
            leader_m: f32::INFINITY,
            stop_m: f32::INFINITY,
            merge_m: f32::INFINITY,
            reservation: 0,
            waited_s: 0.0,
            wait_reason: WaitReason::None,
            blocker: ActorId::NONE,
            reverses: false,
            is_turning_around: false,
        }
    }

    /// Returns whether a vehicle has passed red with its front half a metre before a line, half a metre
    /// farther than vehicles stop beyond it, and 5 m farther, while the light shows these states.
    fn passes_red(bends_m: f32, shown: [u32; 3]) -> bool {
        let network = Network::parse(&mapgen::named("Town02").unwrap()).unwrap();
        let centre_m = |to: LanePoint| {
            let place = |part: i32| {
                let along_m = to.along_m * f64::from(part) / 5000.0;
                network.place(LanePoint { along_m, ..to }).position
            };
            (0..5000).map(|part| place(part).distance(place(part + 1))).sum::<f64>() as f32
        };
        let signals = network.signals().iter().zip(0u32..);
        let lights = signals.filter(|(signal, _)| is_vehicle_light(signal));
        let mut ends = lights.flat_map(|(signal, number)| {
            network.approaches(signal).into_iter().map(move |at| (at, number))
        });
        let (at, signal) = ends
            .find(|(at, _)| at.along_m as f32 - centre_m(*at) > bends_m)
            .expect("a line after bends");
        let next = network.lane(at.lane).successors[0];
        let mut red_lights = RedLights::new(&network);
        let line_m = centre_m(at);
        let ways_m = [line_m - 0.5, line_m + BEYOND_M + 0.5, line_m + BEYOND_M + 5.0];
        for (front_m, phase) in ways_m.into_iter().zip(shown) {
            let light = ActorState { signal, phase, ..ActorState::default() };
            red_lights.advance(&[light], 1.0);
            assert_eq!(red_lights.follow(&plan(at.lane, front_m), 0.0), None);
        }
        red_lights.follow(&plan(next, 0.0), 0.0) == Some(signal)
    }

    #[test]
    fn a_line_after_bends_is_where_plans_measure_it() {
        let [green, red] = [light::GREEN, light::RED];
        assert!(!passes_red(2.0, [green, green, red]), "it passes the line at green");
        assert!(passes_red(2.0, [green, red, red]), "it passes the line at red");
    }
}
