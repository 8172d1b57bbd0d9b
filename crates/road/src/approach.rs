//! Approaches of signals: where traffic waits for them.

use std::collections::BTreeMap;

use crate::{
    lane::{LaneIndex, LanePoint},
    network::Network,
    signal::Signal,
};

/// The most lanes inside a junction between a signal and the lane that leads into the junction.
const INSIDE_MAX: usize = 8;

impl Network {
    /// Returns where traffic waits for a signal: on each approach lane, the last point before the
    /// signal, or the end of the lane if the signal applies to a lane inside the junction behind it.
    ///
    /// CARLA moves a signal's trigger box in the same way (`TrafficLightComponent.cpp`), but over one
    /// lane at most. Lanes inside a junction that no lane outside it leads to have no approach.
    pub fn approaches(&self, signal: &Signal) -> Vec<LanePoint> {
        let mut found: BTreeMap<LaneIndex, f64> = BTreeMap::new();
        for (lane, along_m) in &signal.lanes {
            for point in self.before_junction(LanePoint { lane: *lane, along_m: *along_m }) {
                let nearest = found.entry(point.lane).or_insert(point.along_m);
                *nearest = nearest.min(point.along_m);
            }
        }
        found.into_iter().map(|(lane, along_m)| LanePoint { lane, along_m }).collect()
    }

    /// Returns the ends of the lanes through which traffic reaches a point inside a junction, or the
    /// point itself outside junctions.
    fn before_junction(&self, at: LanePoint) -> Vec<LanePoint> {
        let is_outside = |lane: LaneIndex| self.lane(lane).junction.is_none();
        if is_outside(at.lane) {
            return vec![at];
        }
        let (mut open, mut ends) = (vec![at.lane], Vec::new());
        for _ in 0..INSIDE_MAX {
            let before: Vec<LaneIndex> = open
                .iter()
                .flat_map(|lane| self.lane(*lane).predecessors.iter().copied())
                .collect();
            let (outside, inside): (Vec<_>, Vec<_>) =
                before.into_iter().partition(|lane| is_outside(*lane));
            ends.extend(outside);
            open = inside;
        }
        let end = |lane: LaneIndex| LanePoint { lane, along_m: self.lane(lane).length_m };
        ends.into_iter().map(end).collect()
    }

    /// Returns the junction whose traffic a signal controls: that of its controller, or else the one
    /// that its lanes belong to or lead into.
    pub fn junction_of(&self, signal: &Signal) -> Option<u32> {
        let by_controller = signal.controller.and_then(|controller| {
            let junctions = self.junctions().iter();
            junctions.zip(0u32..).find(|(junction, _)| junction.controllers.contains(&controller))
        });
        let by_lane = || {
            let lanes = signal.lanes.iter().map(|(lane, _)| self.lane(*lane));
            lanes.flat_map(|lane| {
                let next = lane.successors.iter().map(|next| self.lane(*next).junction);
                std::iter::once(lane.junction).chain(next)
            })
        };
        by_controller.map(|(_, index)| index).or_else(|| by_lane().flatten().next())
    }
}
