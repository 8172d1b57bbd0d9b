//! Landmarks: signals as approaching vehicles encounter them.

use crate::{
    lane::{Lane, LaneIndex, LanePoint},
    network::Network,
    signal::{Orientation, SignalUse},
};

/// A place where a signal applies: its own, or that of a reference to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmark<'a> {
    /// Index into [`Network::signals`].
    pub signal: u32,
    /// Where it applies, and to which lanes.
    pub rules: &'a SignalUse,
}

/// A landmark ahead of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkAhead<'a> {
    /// The landmark.
    pub landmark: Landmark<'a>,
    /// The point on the lane beside the landmark.
    pub at: LanePoint,
    /// Driving distance from the starting point, metres.
    pub distance_m: f64,
}

impl SignalUse {
    /// Returns whether it applies to no lane at all, which CARLA's towns write as "0 to 0".
    pub fn is_void(&self) -> bool {
        !self.validity.is_empty() && self.validity.iter().all(|range| *range == (0, 0))
    }

    /// Returns whether it applies to `lane` of its road: by the lanes that it names, or else by
    /// direction.
    pub fn rules_lane(&self, lane: &Lane) -> bool {
        if self.validity.is_empty() {
            return match self.orientation {
                Orientation::Forward => lane.forward,
                Orientation::Backward => !lane.forward,
                Orientation::Both => true,
            };
        }
        self.validity.iter().any(|(from, to)| (*from..=*to).contains(&lane.id))
    }
}

impl Network {
    /// Returns every place where a signal applies to a lane, ordered by signal: CARLA's
    /// `get_all_landmarks`.
    pub fn landmarks(&self) -> impl Iterator<Item = Landmark<'_>> {
        let with_index = self.signals().iter().zip(0u32..);
        with_index.flat_map(|(signal, index)| {
            let uses = signal.uses.iter().filter(|rules| !rules.is_void());
            uses.map(move |rules| Landmark { signal: index, rules })
        })
    }

    /// Returns the landmarks ahead of `at` on every branch, within `distance_m`, each once, nearest
    /// first. `stop_at_junction` leaves out roads of junctions, unless `at` lies on one.
    pub fn landmarks_ahead(
        &self,
        at: LanePoint,
        distance_m: f64,
        stop_at_junction: bool,
    ) -> Vec<LandmarkAhead<'_>> {
        let mut found: Vec<LandmarkAhead> = Vec::new();
        if !(distance_m.is_finite() && distance_m >= 0.0) {
            return found;
        }
        // Lanes with the distance driven before they begin; the first one begins behind `at`. Each
        // lane is visited once, on the shortest path to it.
        let along = at.along_m.clamp(0.0, self.lane(at.lane).length_m);
        let mut open: Vec<(LaneIndex, f64)> = vec![(at.lane, -along)];
        let mut seen = std::collections::BTreeMap::new();
        while let Some(next) = nearest(&mut open) {
            let (index, before) = next;
            if seen.insert(index, ()).is_some() {
                continue;
            }
            let lane = self.lane(index);
            for (landmark, along_m) in self.landmarks_on(lane) {
                let away = before + along_m;
                let is_new = found.iter().all(|other| other.landmark != landmark);
                if (0.0..=distance_m).contains(&away) && is_new {
                    let at = LanePoint { lane: index, along_m };
                    found.push(LandmarkAhead { landmark, at, distance_m: away });
                }
            }
            let after = before + lane.length_m;
            if after > distance_m {
                continue;
            }
            for next in &lane.successors {
                if !(stop_at_junction && self.lane(*next).junction.is_some()) {
                    open.push((*next, after));
                }
            }
        }
        found.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        found
    }

    /// Returns the landmarks beside one lane that apply to it, with metres along it.
    fn landmarks_on(&self, lane: &Lane) -> impl Iterator<Item = (Landmark<'_>, f64)> {
        let road = &self.roads()[lane.road as usize];
        self.uses_of_road(lane.road).filter_map(move |(signal, number)| {
            let rules = &self.signals()[signal as usize].uses[number as usize];
            let s = rules.s.clamp(0.0, road.length_m);
            let section = &road.sections[lane.section as usize];
            let is_here = (section.start_m..=section.start_m + section.length_m).contains(&s);
            let is_ruled = is_here && !rules.is_void() && rules.rules_lane(lane);
            is_ruled.then(|| (Landmark { signal, rules }, self.point_at_s(lane, s).along_m))
        })
    }

    /// Returns signal and use indices of the signals that apply on one road.
    fn uses_of_road(&self, road: u32) -> impl Iterator<Item = (u32, u32)> {
        let first = self.uses.partition_point(|entry| entry.0 < road);
        self.uses[first..].iter().take_while(move |e| e.0 == road).map(|e| (e.1, e.2))
    }

    /// Returns (road, signal, use) of every use of every signal, ordered by road.
    pub(crate) fn sorted_uses(&self) -> Vec<(u32, u32, u32)> {
        let mut uses = Vec::new();
        for (signal, index) in self.signals().iter().zip(0u32..) {
            uses.extend(signal.uses.iter().zip(0u32..).map(|(rules, n)| (rules.road, index, n)));
        }
        uses.sort_unstable();
        uses
    }
}

fn nearest(open: &mut Vec<(LaneIndex, f64)>) -> Option<(LaneIndex, f64)> {
    let best = open.iter().enumerate().min_by(|a, b| a.1.1.total_cmp(&b.1.1))?.0;
    Some(open.swap_remove(best))
}
