//! Right of way at the entries of junctions: traffic lights, signs, and priority by speed limit.

use road::{LaneIndex, Network, Signal};

use crate::{
    conflict::{Conflict, Conflicts},
    roundabout,
    tracks::{NONE, Tracks},
};

/// Farthest distance from a signal to the junction that it governs.
const SIGNAL_REACH_M: f32 = 60.0;
/// Distance from a junction within which a line counts.
const LINE_REACH_M: f32 = 12.0;

/// What a sign requires of a vehicle that enters a junction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    /// No sign.
    None,
    /// Yield to vehicles with right of way.
    Yield,
    /// Stop completely, then yield.
    Stop,
}

/// Rules at the entries of junctions, by lane; lanes outside junctions have no signal and no sign.
pub(crate) struct Approaches {
    /// The traffic light that governs the lane, or [`NONE`].
    pub(crate) signal: Vec<u32>,
    /// The sign that governs the lane.
    pub(crate) sign: Vec<Sign>,
    /// Distance from the stop line to the start of the lane.
    pub(crate) line_m: Vec<f32>,
    /// Distance from the line of its traffic light, the last of several, to the start of the lane. It is
    /// less than `line_m` where vehicles wait farther back, clear of the paths of others.
    pub(crate) light_line_m: Vec<f32>,
    /// Arc length at which the last conflict area of the lane ends for a vehicle that is not wide, and
    /// for a wide one; 0 without conflicts.
    pub(crate) contested_m: Vec<[f32; 2]>,
    /// Whether a road with a higher speed limit crosses or joins here, to which this lane yields.
    pub(crate) minor: Vec<bool>,
    /// Whether another entry of the same junction has a traffic light.
    pub(crate) beside_signals: Vec<bool>,
    /// Mid-block traffic lights: lane, arc length of the stop line, signal. Ascending.
    pub(crate) midblock: Vec<(u32, f32, u32)>,
}

impl Approaches {
    /// Reads the signals, signs and speed limits of `network`.
    pub(crate) fn new(network: &Network, tracks: &Tracks, conflicts: &Conflicts) -> Approaches {
        let count = tracks.count();
        let mut approaches = Approaches {
            signal: vec![NONE; count],
            sign: vec![Sign::None; count],
            line_m: conflicts.setback_m.clone(),
            light_line_m: vec![0.0; count],
            contested_m: (0..count as u32).map(|lane| contested_m(conflicts, lane)).collect(),
            minor: vec![false; count],
            beside_signals: vec![false; count],
            midblock: Vec::new(),
        };
        for (index, signal) in network.signals().iter().enumerate() {
            for &(lane, stop_m) in &signal.lanes {
                approaches.add_signal(network, tracks, index as u32, signal, lane, stop_m);
            }
        }
        approaches
            .midblock
            .sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        approaches.compare_approaches(tracks);
        approaches.yield_to_roundabouts(tracks, conflicts);
        approaches
    }

    /// Makes vehicles that enter a roundabout yield to vehicles in it.
    fn yield_to_roundabouts(&mut self, tracks: &Tracks, conflicts: &Conflicts) {
        let circles = roundabout::circles(tracks);
        for lane in (0..tracks.count() as u32).filter(|&lane| tracks.in_junction(lane)) {
            let entry = lane as usize;
            let enters = tracks.previous(lane).iter().any(|&from| !circles[from as usize]);
            let crosses = conflicts.of(lane).iter().any(|c| circles[c.other as usize]);
            let has_no_rule = self.signal[entry] == NONE && self.sign[entry] == Sign::None;
            if enters && crosses && has_no_rule && !circles[entry] {
                self.sign[entry] = Sign::Yield;
            }
        }
    }

    /// Assigns a light or a sign to the lanes of the junction that it governs.
    fn add_signal(
        &mut self,
        network: &Network,
        tracks: &Tracks,
        index: u32,
        signal: &Signal,
        lane: LaneIndex,
        stop_m: f64,
    ) {
        let sign = sign(signal);
        let light = is_vehicle_light(signal);
        if !tracks.has(lane.0) || (sign == Sign::None && !light) {
            return;
        }
        let fraction = stop_m / network.lane(lane).length_m.max(1e-6);
        let stop_m = fraction.clamp(0.0, 1.0) as f32 * tracks.length(lane.0);
        let entries = junction_ahead(tracks, lane.0, stop_m);
        if entries.is_empty() && light {
            self.midblock.push((lane.0, stop_m, index));
        }
        for (entry, before_m) in entries {
            let entry = entry as usize;
            // A stop line farther from the junction would leave the other approaches too little
            // room.
            let counts = before_m < LINE_REACH_M;
            if light {
                let line_m = if counts { before_m } else { 0.0 };
                let last_m = &mut self.light_line_m[entry];
                *last_m = if self.signal[entry] == NONE { line_m } else { last_m.min(line_m) };
            }
            if light && self.signal[entry] == NONE {
                self.signal[entry] = index;
            } else if !light && self.sign[entry] != Sign::Stop {
                self.sign[entry] = sign;
            }
            if counts {
                self.line_m[entry] = self.line_m[entry].max(before_m);
            }
        }
    }

    /// Compares the entries of each junction with each other.
    fn compare_approaches(&mut self, tracks: &Tracks) {
        let junctions = tracks.junction.iter().filter(|&&j| j != NONE).max().map_or(0, |&j| j + 1);
        let mut fastest = vec![0.0f32; junctions as usize];
        let mut lit = vec![false; junctions as usize];
        let entries: Vec<u32> = (0..tracks.count() as u32)
            .filter(|&lane| tracks.has(lane) && tracks.in_junction(lane))
            .collect();
        for &lane in &entries {
            let junction = tracks.junction[lane as usize] as usize;
            fastest[junction] = fastest[junction].max(tracks.limit_mps[lane as usize]);
            lit[junction] |= self.signal[lane as usize] != NONE;
        }
        for &lane in &entries {
            let junction = tracks.junction[lane as usize] as usize;
            self.minor[lane as usize] = tracks.limit_mps[lane as usize] < fastest[junction] - 1.0;
            self.beside_signals[lane as usize] = lit[junction];
        }
    }
}

/// Returns where the last conflict area of a lane ends: see [`Approaches::contested_m`].
fn contested_m(conflicts: &Conflicts, lane: u32) -> [f32; 2] {
    let end_m = |conflict: &Conflict, wide: bool| {
        let areas = [false, true].map(|other| conflict.between((wide, other)));
        areas.into_iter().flatten().map(|area| area.own.1).fold(0.0, f32::max)
    };
    let of = |wide: bool| {
        conflicts.of(lane).iter().map(|conflict| end_m(conflict, wide)).fold(0.0, f32::max)
    };
    [of(false), of(true)]
}

/// Returns the lanes of the next junction that are reached from a stop line, and the distance from
/// the line to each. A line inside a junction counts as at the junction's entry, where no path has
/// been crossed yet.
fn junction_ahead(tracks: &Tracks, lane: u32, stop_m: f32) -> Vec<(u32, f32)> {
    if tracks.in_junction(lane) {
        return vec![(first_of_junction(tracks, lane), 0.0)];
    }
    let mut found = Vec::new();
    let mut open = vec![(lane, tracks.length(lane) - stop_m)];
    while let Some((at, before_m)) = open.pop() {
        if before_m > SIGNAL_REACH_M {
            continue;
        }
        for &to in tracks.next(at) {
            if tracks.in_junction(to) {
                found.push((to, before_m));
            } else {
                open.push((to, before_m + tracks.length(to)));
            }
        }
    }
    found
}

/// Returns the lane by which the junction is entered, as far as predecessors are unique.
fn first_of_junction(tracks: &Tracks, lane: u32) -> u32 {
    let mut at = lane;
    for _ in 0..16 {
        match tracks.previous(at) {
            [before] if tracks.in_junction(*before) => at = *before,
            _ => break,
        }
    }
    at
}

/// Returns whether the light governs vehicles. Types are those of ASAM OpenDRIVE's catalogue
/// without a country.
pub(crate) fn is_vehicle_light(signal: &Signal) -> bool {
    signal.dynamic && !matches!(signal.kind.as_str(), "1000002" | "1000003" | "1000007" | "1000013")
}

fn sign(signal: &Signal) -> Sign {
    match (signal.dynamic, signal.kind.as_str()) {
        (false, "206") => Sign::Stop,
        (false, "205") => Sign::Yield,
        _ => Sign::None,
    }
}
