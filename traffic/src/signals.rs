//! The signal plan of traffic lights.
//!
//! Each junction with lights has a cycle of *phases*; in each phase some signal groups are green
//! together. The lights of a controller form a group; so do lights without a controller on the same
//! approach. Opposite approaches whose only conflict is that of left turns with oncoming traffic
//! share a phase.
//!
//! Green is actuated by demand: a phase is extended while vehicles arrive, up to a maximum while
//! others wait, and a phase without demand is skipped while another has demand. Without any demand
//! the phases follow each other at a fixed rate. A phase with priority comes next and stays longer.

use glam::Vec2;
use protocol::light;
use road::Network;

use crate::{
    approach::{Approaches, is_vehicle_light},
    conflict::Conflicts,
    demand::Demand,
    tracks::{NONE, Tracks},
};

/// Green part of a phase's clock. Green that ends early skips to its end.
const GREEN_NANOS: u64 = 40_000_000_000;
/// Yellow part of a phase's clock. Where yellow is shorter, it begins later.
const YELLOW_NANOS: u64 = 6_000_000_000;
/// Shortest yellow.
const YELLOW_MIN_NANOS: u64 = 3_000_000_000;
/// All-red part of a phase's clock.
const RED_NANOS: u64 = 2_000_000_000;
/// Length of a phase's clock.
pub(crate) const PHASE_NANOS: u64 = GREEN_NANOS + YELLOW_NANOS + RED_NANOS;
/// Minimum green of a phase.
const GREEN_MIN_NANOS: u64 = 6_000_000_000;
/// Green without demand.
const GREEN_DEFAULT_NANOS: u64 = 10_000_000_000;
/// Longest cycle while vehicles wait, unless there are very many phases.
const CYCLE_MAX_NANOS: u64 = 70_000_000_000;

/// The phases of all signals.
pub(crate) struct SignalPlan {
    /// By signal: its cycle and its phase there, or [`NONE`] if its state is constant.
    slot: Vec<(u32, u32)>,
    /// By signal: its state if it has no cycle.
    idle: Vec<u32>,
    /// By cycle and phase: how long yellow is shown.
    yellow_nanos: Vec<Vec<u64>>,
}

/// Lights that always show the same state.
struct SignalGroup {
    signals: Vec<u32>,
    /// Lanes inside the junction that they govern.
    lanes: Vec<u32>,
    /// Mean driving direction at the entry, unit length or zero.
    direction: Vec2,
}

impl SignalPlan {
    /// Plans all lights of `network`.
    pub(crate) fn new(
        network: &Network,
        tracks: &Tracks,
        conflicts: &Conflicts,
        approaches: &Approaches,
    ) -> SignalPlan {
        let signals = network.signals();
        let mut plan = SignalPlan {
            slot: vec![(NONE, NONE); signals.len()],
            idle: signals
                .iter()
                .map(|s| if is_vehicle_light(s) { light::OFF } else { light::RED })
                .collect(),
            yellow_nanos: Vec::new(),
        };
        for groups in junction_groups(network, tracks, approaches) {
            let cycle = plan.yellow_nanos.len() as u32;
            let mut phases: Vec<Vec<&SignalGroup>> = Vec::new();
            for group in &groups {
                let fits = |phase: &Vec<&SignalGroup>| {
                    phase.iter().all(|other| are_compatible(tracks, conflicts, group, other))
                };
                match phases.iter_mut().find(|phase| fits(phase)) {
                    Some(phase) => phase.push(group),
                    None => phases.push(vec![group]),
                }
            }
            for (phase, groups) in phases.iter().enumerate() {
                for &signal in groups.iter().flat_map(|group| &group.signals) {
                    plan.slot[signal as usize] = (cycle, phase as u32);
                }
            }
            let lanes = |phase: &Vec<&SignalGroup>| {
                phase.iter().flat_map(|group| group.lanes.clone()).collect::<Vec<_>>()
            };
            let yellow = |phase: &Vec<&SignalGroup>| yellow_nanos(tracks, &lanes(phase));
            plan.yellow_nanos.push(phases.iter().map(yellow).collect());
        }
        for &(lane, _, signal) in &approaches.midblock {
            if plan.slot[signal as usize].0 == NONE {
                plan.slot[signal as usize] = (plan.yellow_nanos.len() as u32, 0);
                plan.yellow_nanos.push(vec![yellow_at(tracks.limit_mps[lane as usize])]);
            }
        }
        plan
    }

    /// Creates one cycle of `count` phases, with a signal in each.
    #[cfg(test)]
    pub(crate) fn of_phases(count: u32) -> SignalPlan {
        SignalPlan {
            slot: (0..count).map(|phase| (0, phase)).collect(),
            idle: vec![light::OFF; count as usize],
            yellow_nanos: vec![vec![yellow_at(0.0); count as usize]],
        }
    }

    /// Returns the number of signals, with or without a cycle.
    pub(crate) fn count(&self) -> usize {
        self.slot.len()
    }

    /// Returns the number of cycles.
    pub(crate) fn cycles(&self) -> usize {
        self.yellow_nanos.len()
    }

    /// Returns the cycle and the phase of `signal`, if it has one.
    pub(crate) fn slot(&self, signal: u32) -> Option<(u32, u32)> {
        self.slot.get(signal as usize).copied().filter(|slot| slot.0 != NONE)
    }

    /// Returns the number of phases of a cycle.
    pub(crate) fn phases(&self, cycle: u32) -> u32 {
        self.yellow_nanos[cycle as usize].len() as u32
    }

    /// Returns for how long a signal that shows red stays red at least, in seconds: without limit if
    /// it has no cycle.
    pub(crate) fn red_left_s(&self, signal: u32, clocks: &[u64]) -> f32 {
        let Some((cycle, phase)) = self.slot(signal) else { return f32::INFINITY };
        let clock = clocks[cycle as usize];
        let (now, into) = (clock / PHASE_NANOS, clock % PHASE_NANOS);
        let nanos = if now == u64::from(phase) {
            // Its own phase ends, and may be the next one again.
            PHASE_NANOS - into
        } else if into < GREEN_NANOS {
            let yellow_nanos = self.yellow_nanos[cycle as usize][now as usize];
            GREEN_MIN_NANOS.saturating_sub(into) + yellow_nanos + RED_NANOS
        } else {
            PHASE_NANOS - into
        };
        (nanos as f64 * 1e-9) as f32
    }

    /// Returns for how long the present phase of a signal's cycle has been green, in seconds, if it is; 0
    /// if it has no cycle.
    pub(crate) fn phase_age_s(&self, signal: u32, clocks: &[u64]) -> f32 {
        let clock = self.slot(signal).map_or(0, |(cycle, _)| clocks[cycle as usize]);
        ((clock % PHASE_NANOS) as f64 * 1e-9) as f32
    }

    /// Advances the clocks of all cycles.
    pub(crate) fn advance(&self, clocks: &mut [u64], demand: &Demand, delta_nanos: u64) {
        for (cycle, clock) in clocks.iter_mut().enumerate() {
            let phases = (self.yellow_nanos[cycle].len() as u64).max(1);
            let (phase, before) = (*clock / PHASE_NANOS, *clock % PHASE_NANOS);
            let others_wait = (0..phases).any(|p| p != phase && demand.waits(cycle, p));
            let extends = demand.comes(cycle, phase);
            let preferred = (0..phases).find(|&p| demand.has_priority(cycle, p));
            let mut now = before + delta_nanos;
            if before < GREEN_NANOS {
                let yellow_nanos = self.yellow_nanos[cycle][phase as usize];
                let most = (CYCLE_MAX_NANOS / phases)
                    .saturating_sub(yellow_nanos + RED_NANOS)
                    .clamp(GREEN_MIN_NANOS + 2_000_000_000, GREEN_NANOS);
                let until = match (others_wait, extends) {
                    (true, _) if demand.has_priority(cycle, phase) => GREEN_NANOS,
                    (true, _) if preferred.is_some() => GREEN_MIN_NANOS,
                    (true, true) => most,
                    (true, false) => GREEN_MIN_NANOS,
                    // With demand on this phase alone, green rests just before its end.
                    (false, true) if phases > 1 => {
                        now = now.min(GREEN_MIN_NANOS);
                        GREEN_NANOS
                    }
                    (false, _) => GREEN_DEFAULT_NANOS,
                };
                if now >= until {
                    let skipped = YELLOW_NANOS - yellow_nanos;
                    now = skipped + GREEN_NANOS.max(now.min(GREEN_NANOS + delta_nanos));
                }
            }
            let next = (1..=phases).map(|step| (phase + step) % phases);
            *clock = if now < PHASE_NANOS {
                phase * PHASE_NANOS + now
            } else {
                let next_demanded = next.clone().find(|&p| demand.waits(cycle, p));
                preferred.or(next_demanded).or(next.clone().next()).unwrap_or(0) * PHASE_NANOS
            };
        }
    }

    /// Returns the state of `signal` at these clocks of the cycles; one of [`protocol::light`].
    pub(crate) fn shows(&self, signal: u32, clocks: &[u64]) -> u32 {
        let Some(&(cycle, phase)) = self.slot.get(signal as usize) else { return light::OFF };
        if cycle == NONE {
            return self.idle[signal as usize];
        }
        let clock = clocks[cycle as usize];
        if clock / PHASE_NANOS != u64::from(phase) {
            return light::RED;
        }
        match clock % PHASE_NANOS {
            t if t < GREEN_NANOS => light::GREEN,
            t if t < GREEN_NANOS + YELLOW_NANOS => light::YELLOW,
            _ => light::RED,
        }
    }
}

/// Returns for how long yellow is shown to vehicles that enter a junction on these lanes.
fn yellow_nanos(tracks: &Tracks, lanes: &[u32]) -> u64 {
    let before = lanes.iter().flat_map(|&lane| tracks.previous(lane));
    let limits_mps = before.map(|&lane| tracks.limit_mps[lane as usize]);
    yellow_at(limits_mps.fold(0.0, f32::max))
}

/// Returns for how long yellow is shown at a speed limit: 1 s and the time in which a vehicle passes its
/// stopping distance at 7 % above the limit, with 3 m/s² (Institute of Transportation Engineers,
/// *Guidelines for Determining Traffic Signal Change and Clearance Intervals*, 2020).
fn yellow_at(limit_mps: f32) -> u64 {
    let seconds = 1.0 + 1.07 * f64::from(limit_mps) / (2.0 * 3.0);
    ((seconds * 1e9) as u64).clamp(YELLOW_MIN_NANOS, YELLOW_NANOS)
}

/// Identity of a signal group: 0 and the controller, or 1 and the road of its approach.
type Key = (u32, u32);

/// Returns the signal groups of each junction that has lights, in the order of the junctions.
fn junction_groups(
    network: &Network,
    tracks: &Tracks,
    approaches: &Approaches,
) -> Vec<Vec<SignalGroup>> {
    // (junction, key of the group, signal, lane).
    let mut rows: Vec<(u32, Key, u32, u32)> = Vec::new();
    for lane in 0..tracks.count() as u32 {
        let signal = approaches.signal[lane as usize];
        if signal == NONE {
            continue;
        }
        let junction = tracks.junction[lane as usize];
        let controller = network.signals()[signal as usize].controller;
        let key = match controller {
            Some(controller) => (0, controller),
            None => (1, approach_road(network, tracks, lane)),
        };
        rows.push((junction, key, signal, lane));
    }
    // Lights of a controller that govern no lane, or the same lane as another, join its group; so
    // do those at the end of the same road.
    for (index, signal) in network.signals().iter().enumerate() {
        let index = index as u32;
        if !is_vehicle_light(signal) || rows.iter().any(|row| row.2 == index) {
            continue;
        }
        let lanes: Vec<u32> = signal.lanes.iter().map(|(lane, _)| lane.0).collect();
        let partner = rows.iter().find(|row| {
            let same_controller =
                signal.controller.is_some_and(|controller| row.1 == (0, controller));
            let same_place = network.signals()[row.2 as usize]
                .lanes
                .iter()
                .any(|(lane, _)| lanes.contains(&lane.0));
            same_controller || same_place
        });
        if let Some(&(junction, key, ..)) = partner {
            rows.push((junction, key, index, NONE));
        }
    }
    rows.sort_unstable();
    let mut junctions: Vec<(u32, Vec<(Key, SignalGroup)>)> = Vec::new();
    for (junction, key, signal, lane) in rows {
        if junctions.last().is_none_or(|last| last.0 != junction) {
            junctions.push((junction, Vec::new()));
        }
        let groups = &mut junctions.last_mut().expect("just pushed").1;
        if groups.last().is_none_or(|last| last.0 != key) {
            let group =
                SignalGroup { signals: Vec::new(), lanes: Vec::new(), direction: Vec2::ZERO };
            groups.push((key, group));
        }
        let group = &mut groups.last_mut().expect("just pushed").1;
        group.signals.push(signal);
        if lane != NONE {
            group.lanes.push(lane);
            group.direction += tracks.at(lane, 0.0).1;
        }
    }
    let finish = |mut group: SignalGroup| {
        group.signals.dedup();
        group.direction = group.direction.normalize_or_zero();
        group
    };
    junctions
        .into_iter()
        .map(|(_, groups)| groups.into_iter().map(|(_, group)| finish(group)).collect())
        .collect()
}

/// Returns the road from which a lane of a junction is reached, or its own without a predecessor.
fn approach_road(network: &Network, tracks: &Tracks, lane: u32) -> u32 {
    let from = tracks.previous(lane).first().copied().unwrap_or(lane);
    network.lane(road::LaneIndex(from)).road
}

/// Returns whether two groups may be green together.
fn are_compatible(
    tracks: &Tracks,
    conflicts: &Conflicts,
    a: &SignalGroup,
    b: &SignalGroup,
) -> bool {
    let facing = a.direction.dot(b.direction);
    if facing.abs() < 0.85 {
        return false;
    }
    a.lanes.iter().all(|&lane| {
        let turn_draws = turn_rad(tracks, lane) > LEFT_TURN_RAD;
        conflicts.of(lane).iter().all(|conflict| {
            let permitted =
                facing < 0.0 && (turn_draws || turn_rad(tracks, conflict.other) > LEFT_TURN_RAD);
            permitted
                || conflict.between((false, false)).is_none()
                || !b.lanes.contains(&conflict.other)
        })
    })
}

/// A turn to the left by more than this crosses oncoming traffic.
pub(crate) const LEFT_TURN_RAD: f32 = 0.6;

/// Returns the turn to the left of the path through the junction that begins with `lane`, radians.
fn turn_rad(tracks: &Tracks, lane: u32) -> f32 {
    let from = tracks.at(lane, 0.0).1;
    let mut last = lane;
    for _ in 0..16 {
        match tracks.next(last) {
            [next] if tracks.in_junction(*next) => last = *next,
            _ => break,
        }
    }
    from.angle_to(tracks.at(last, tracks.length(last)).1)
}
