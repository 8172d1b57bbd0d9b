//! The volumes before traffic lights and signs in which these apply to vehicles.
//!
//! CARLA puts one box on each approach lane, 3 m before the signal (`TrafficLightComponent.cpp`), and
//! gives clients one box around them in the space of the actor, whose x axis points across the road,
//! to the right of the approaching traffic.

use client_lib::Pose;
use glam::{DVec3, Vec2, Vec3};
use road::{LaneIndex, LaneType, Network, Signal};

use crate::wire::Bounds;

/// From the signal to the middle of the box. Metres.
const BEFORE_SIGNAL_M: f64 = 3.0;
/// Half the length of the box along the lane. Metres.
pub(crate) const HALF_LENGTH_M: f32 = 1.5;
/// From the edge of the box to that of the lane, so that no point of the box belongs to a lane beside
/// it. Metres.
const EDGE_M: f32 = 0.2;
/// Half the height of the box. Metres.
const HALF_HEIGHT_M: f32 = 1.0;
/// The cosine of the angle between approach lanes up to which they belong to one signal.
const SAME_DIRECTION: f32 = 0.5;

/// The box of one signal on one approach lane. World space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LaneVolume {
    pub(crate) lane: LaneIndex,
    pub(crate) center: Vec3,
    /// Unit vector in driving direction.
    pub(crate) along: Vec2,
    pub(crate) half_width_m: f32,
}

impl LaneVolume {
    /// Returns whether a vehicle's box touches the middle half of this volume, which is as wide as
    /// CARLA's, so that vehicles in other lanes do not touch it.
    pub(crate) fn touches(
        &self,
        pose: &Pose,
        center_m: [f32; 3],
        half_extents_m: [f32; 3],
    ) -> bool {
        let center = pose.position() + pose.rotation() * Vec3::from(center_m);
        let between = center - self.center;
        let forward = pose.rotation() * Vec3::X;
        let forward = forward.truncate().normalize_or(Vec2::X);
        let own = [(forward, half_extents_m[0]), (forward.perp(), half_extents_m[1])];
        let volume = [(self.along, HALF_LENGTH_M), (self.along.perp(), 0.5 * self.half_width_m)];
        let reach = |axis: Vec2| {
            let sides = own.iter().chain(&volume);
            sides.map(|(side, half)| side.dot(axis).abs() * half).sum::<f32>()
        };
        // Two rectangles overlap unless one of their four axes separates them.
        let overlaps =
            |(axis, _): &(Vec2, f32)| between.truncate().dot(*axis).abs() <= reach(*axis);
        between.z.abs() <= half_extents_m[2] + HALF_HEIGHT_M
            && own.iter().chain(&volume).all(overlaps)
    }
}

/// Returns the boxes of a signal.
fn lane_volumes(network: &Network, signal: &Signal) -> Vec<LaneVolume> {
    let approaches = network.approaches(signal).into_iter();
    let driven = approaches.filter(|at| network.lane(at.lane).kind == LaneType::Driving);
    driven
        .map(|at| {
            // On a short lane, halfway to its start, where other lanes begin as well.
            let along_m = (at.along_m - BEFORE_SIGNAL_M).max(0.5 * at.along_m);
            let pose = network.place_at(at.lane, along_m, 0.0);
            let width_m = network.width(road::LanePoint { along_m, ..at });
            LaneVolume {
                lane: at.lane,
                center: pose.position.as_vec3(),
                along: Vec2::from_angle(pose.heading_rad as f32),
                half_width_m: (0.5 * width_m as f32 - EDGE_M).max(0.01),
            }
        })
        .collect()
}

/// Where CARLA's clients see a traffic light or sign, and where it applies.
pub(crate) struct SignalPlace {
    /// The pose of the actor: at the foot of the signal, with the x axis across its approach lanes.
    ///
    /// Clients look for the lanes of a signal along this axis, so that it follows the lanes. The face
    /// of a signal may be turned by any angle against them.
    pub(crate) pose: Pose,
    /// On each approach lane.
    pub(crate) volumes: Vec<LaneVolume>,
    /// Those of one direction, which the face is turned to if there are several.
    faced: Vec<LaneVolume>,
}

impl SignalPlace {
    pub(crate) fn new(network: &Network, signal: &Signal) -> SignalPlace {
        let volumes = lane_volumes(network, signal);
        let face = Vec2::from_angle(signal.pose.heading_rad as f32);
        let turned_to = |way: Vec2| {
            let same = |volume: &LaneVolume| volume.along.dot(way) > SAME_DIRECTION;
            volumes.iter().copied().filter(same).collect::<Vec<_>>()
        };
        let mut faced = turned_to(-face);
        if let Some(first) = volumes.first().filter(|_| faced.is_empty()) {
            faced = turned_to(first.along);
        }
        let along = faced.iter().map(|volume| volume.along).sum::<Vec2>().normalize_or(-face);
        let across = -along.perp();
        let foot = signal.pose.position - DVec3::Z * signal.z_offset_m;
        SignalPlace { pose: Pose::level(foot.as_vec3(), across.to_angle()), volumes, faced }
    }

    /// Returns the box around the volumes, in the space of the actor. `None` without an approach lane.
    ///
    /// Its middle line crosses every approach lane before that lane ends, also where the lanes of one
    /// approach end one after another.
    pub(crate) fn bounds(&self, actor: u32) -> Option<Bounds> {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for volume in &self.faced {
            let center = self.pose.rotation().inverse() * (volume.center - self.pose.position());
            let half = Vec3::new(volume.half_width_m, HALF_LENGTH_M, HALF_HEIGHT_M);
            (low, high) = (low.min(center - half), high.max(center + half));
        }
        high.y = high.y.min(low.y + 2.0 * HALF_LENGTH_M);
        (!self.faced.is_empty()).then(|| Bounds {
            center_m: (0.5 * (low + high)).to_array(),
            half_extents_m: (0.5 * (high - low)).to_array(),
            yaw_rad: 0.0,
            actor,
        })
    }
}

/// Returns the limit that a speed sign shows, kilometres per hour; `None` for another signal.
///
/// The type is that of the German catalogue, which OpenDRIVE maps use.
pub(crate) fn speed_sign_kmh(signal: &Signal) -> Option<f32> {
    let named = || signal.subtype.parse().ok().filter(|v| *v > 0.0);
    (signal.kind == "274").then(|| signal.value.or_else(named).unwrap_or(30.0) as f32)
}

#[cfg(test)]
mod tests {
    use std::{
        collections::{BTreeMap, BTreeSet},
        path::PathBuf,
    };

    use road::{LanePoint, LaneTypes};

    use super::*;

    /// Name and text of a town, and of each map in the folder that `OMNIBUS_MAPS` names.
    fn maps() -> Vec<(String, String)> {
        let towns = ["Town01", "Town03", "Town05", "Town10HD", "Millbrook"];
        let named = |name: &str| (name.to_owned(), mapgen::named(name).unwrap());
        let mut maps: Vec<_> = towns.into_iter().map(named).collect();
        if let Some(folder) = std::env::var_os("OMNIBUS_MAPS").map(PathBuf::from) {
            let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
            for path in paths.filter(|path| path.extension().is_some_and(|e| e == "xodr")) {
                maps.push((path.display().to_string(), std::fs::read_to_string(path).unwrap()));
            }
        }
        maps
    }

    /// Returns the lanes that CARLA's client finds in `get_stop_waypoints`, with their points.
    fn stop_points(network: &Network, place: &SignalPlace, bounds: &Bounds) -> Vec<LanePoint> {
        let half = bounds.half_extents_m[0];
        let steps = (0u16..).map(|step| f32::from(step) - 0.9 * half);
        let mut found = BTreeMap::new();
        for x in steps.take_while(|x| *x < 0.9 * half) {
            let at = Vec3::from(bounds.center_m) + Vec3::X * x;
            let at = place.pose.position() + place.pose.rotation() * at;
            let point = network.nearest(at.as_dvec3(), LaneTypes::DRIVING).unwrap();
            found.entry(point.lane).or_insert(point.along_m);
        }
        found.into_iter().map(|(lane, along_m)| LanePoint { lane, along_m }).collect()
    }

    #[test]
    fn stop_waypoints_are_on_each_approach_lane_before_the_junction() {
        let mut wrong = Vec::new();
        for (name, text) in maps() {
            let network = Network::parse(&text).unwrap();
            for signal in network.signals().iter().filter(|signal| signal.dynamic) {
                let place = SignalPlace::new(&network, signal);
                let Some(bounds) = place.bounds(1) else { continue };
                let along = place.pose.rotation() * Vec3::Y;
                let points = stop_points(&network, &place, &bounds);
                let mut lanes: BTreeSet<_> = points.iter().map(|at| at.lane).collect();
                let what = format!("signal {} of {name}: {points:?}", signal.id);
                // The map of Acosta draws lanes of two directions over each other.
                let is_drawn_over = |at: &LanePoint| {
                    let center = network.place_at(at.lane, at.along_m, 0.0).position.as_vec3();
                    let across =
                        |v: &LaneVolume| (center - v.center).truncate().dot(v.along.perp());
                    place.faced.iter().any(|v| across(v).abs() < v.half_width_m)
                };
                for at in &points {
                    let lane = network.lane(at.lane);
                    let pose = network.place_at(at.lane, at.along_m, 0.0);
                    let way = Vec2::from_angle(pose.heading_rad as f32);
                    let is_opposed = way.dot(along.truncate()) < SAME_DIRECTION;
                    if lane.junction.is_some() || is_opposed && !is_drawn_over(at) {
                        wrong.push(format!("{at:?} of {what}"));
                    }
                    if is_opposed {
                        lanes.remove(&at.lane);
                    }
                }
                let expected: BTreeSet<_> = place.faced.iter().map(|v| v.lane).collect();
                if lanes != expected {
                    wrong.push(format!("lanes {expected:?} {what}"));
                }
            }
        }
        assert!(wrong.is_empty(), "{}: {}", wrong.len(), wrong.join("\n"));
    }

    #[test]
    fn a_vehicle_touches_the_volume_of_its_own_lane_only() {
        let volume = LaneVolume {
            lane: LaneIndex(0),
            center: Vec3::new(50.0, 20.0, 1.0),
            along: Vec2::X,
            half_width_m: 1.75,
        };
        let touches = |x: f32, y: f32, z: f32| {
            let pose = Pose::level(Vec3::new(x, y, z), 0.0);
            volume.touches(&pose, [0.0, 0.0, 0.75], [2.4, 1.0, 0.75])
        };
        assert!(touches(50.0, 20.0, 1.0));
        assert!(touches(47.0, 20.5, 1.0), "the front reaches into the volume");
        assert!(touches(53.0, 20.0, 1.0), "the rear has not left the volume");
        assert!(!touches(45.0, 20.0, 1.0), "before the volume");
        assert!(!touches(55.0, 20.0, 1.0), "behind the volume");
        assert!(!touches(50.0, 23.5, 1.0), "in the lane to the left");
        assert!(!touches(50.0, 20.0, 7.0), "on a bridge above");
    }
}
