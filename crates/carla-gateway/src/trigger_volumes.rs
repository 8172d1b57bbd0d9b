//! The volumes before traffic lights and signs in which these apply to vehicles.
//!
//! CARLA puts one box on each approach lane, 3 m before the signal (`TrafficLightComponent.cpp`), and
//! gives clients one box around them in the space of the actor, whose x axis points across the road,
//! to the right of the approaching traffic.

use std::f32::consts::FRAC_PI_2;

use client_lib::Pose;
use glam::{Quat, Vec2, Vec3};
use road::{LaneType, Network, Signal};

use crate::wire::Bounds;

/// From the signal to the middle of the box. Metres.
const BEFORE_SIGNAL_M: f64 = 3.0;
/// Half the length of the box along the lane. Metres.
const HALF_LENGTH_M: f32 = 1.5;
/// Half the height of the box. Metres.
const HALF_HEIGHT_M: f32 = 1.0;
/// The cosine of the angle between approach lanes up to which one box encloses both.
const SAME_DIRECTION: f32 = 0.5;

/// The box of one signal on one approach lane. World space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LaneVolume {
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
pub(crate) fn lane_volumes(network: &Network, signal: &Signal) -> Vec<LaneVolume> {
    let approaches = network.approaches(signal).into_iter();
    let driven = approaches.filter(|at| network.lane(at.lane).kind == LaneType::Driving);
    driven
        .map(|at| {
            let along_m = (at.along_m - BEFORE_SIGNAL_M).max(0.0);
            let pose = network.place_at(at.lane, along_m, 0.0);
            let width_m = network.width(road::LanePoint { along_m, ..at });
            LaneVolume {
                center: pose.position.as_vec3(),
                along: Vec2::from_angle(pose.heading_rad as f32),
                half_width_m: (0.5 * width_m as f32).max(0.01),
            }
        })
        .collect()
}

/// Converts the pose of a light's or sign's face, whose x axis points to the approaching traffic, into
/// that of CARLA's actor: a rotation by 90 degrees about z.
pub(crate) fn carla_from_face(face: &Pose) -> Pose {
    face.then(&Pose::new(Vec3::ZERO, Quat::from_rotation_z(FRAC_PI_2)))
}

/// Returns the box around those of a signal that its face is turned to, in the space of CARLA's actor
/// at `pose`. `None` without an approach lane.
pub(crate) fn enclosing(volumes: &[LaneVolume], pose: &Pose, actor: u32) -> Option<Bounds> {
    let across = pose.rotation() * Vec3::X;
    let faced = across.truncate().perp().normalize_or(Vec2::Y);
    let turned_to = |way: Vec2| {
        let same = |volume: &&LaneVolume| volume.along.dot(way) > SAME_DIRECTION;
        volumes.iter().filter(same).collect::<Vec<_>>()
    };
    let mut chosen = turned_to(faced);
    if chosen.is_empty() {
        chosen = turned_to(volumes.first()?.along);
    }
    let actor_from_world = pose.rotation().inverse();
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for volume in chosen {
        let center = actor_from_world * (volume.center - pose.position());
        let half = Vec3::new(volume.half_width_m, HALF_LENGTH_M, HALF_HEIGHT_M);
        (low, high) = (low.min(center - half), high.max(center + half));
    }
    Some(Bounds {
        center_m: (0.5 * (low + high)).to_array(),
        half_extents_m: (0.5 * (high - low)).to_array(),
        yaw_rad: 0.0,
        actor,
    })
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, path::PathBuf};

    use road::LaneTypes;

    use super::*;

    /// Name and text of a town and, if `OMNIBUS_MAPS` names a folder with it, of CARLA's Town10HD.
    fn maps() -> Vec<(String, String)> {
        let mut maps = vec![("Town01".to_owned(), mapgen::named("Town01").unwrap())];
        if let Some(folder) = std::env::var_os("OMNIBUS_MAPS").map(PathBuf::from) {
            let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
            let named = |path: &PathBuf| path.to_string_lossy().ends_with("Town10HD.xodr");
            for path in paths.filter(named) {
                maps.push((path.display().to_string(), std::fs::read_to_string(path).unwrap()));
            }
        }
        maps
    }

    /// Samples the volume as CARLA's client does in `get_stop_waypoints`.
    #[test]
    fn stop_waypoints_are_one_on_each_approach_lane_outside_the_junction() {
        for (name, text) in maps() {
            let network = Network::parse(&text).unwrap();
            for signal in network.signals().iter().filter(|signal| signal.dynamic) {
                let face =
                    Pose::level(signal.pose.position.as_vec3(), signal.pose.heading_rad as f32);
                let pose = carla_from_face(&face);
                let volumes = lane_volumes(&network, signal);
                let Some(volume) = enclosing(&volumes, &pose, 1) else { continue };
                let half = volume.half_extents_m[0];
                let steps = (0u16..).map(|step| f32::from(step) - 0.9 * half);
                let lanes: BTreeSet<_> = steps
                    .take_while(|x| *x < 0.9 * half)
                    .map(|x| Vec3::from(volume.center_m) + Vec3::X * x)
                    .map(|at| (pose.position() + pose.rotation() * at).as_dvec3())
                    .map(|at| network.nearest(at, LaneTypes::DRIVING).unwrap().lane)
                    .collect();
                let what = format!("signal {} of {name}: {lanes:?}", signal.id);
                assert!(lanes.iter().all(|lane| network.lane(*lane).junction.is_none()), "{what}");
                let expected = network.approaches(signal).iter().map(|at| at.lane).collect();
                assert_eq!(lanes, expected, "{what}");
            }
        }
    }

    #[test]
    fn a_vehicle_touches_the_volume_of_its_own_lane_only() {
        let volume =
            LaneVolume { center: Vec3::new(50.0, 20.0, 1.0), along: Vec2::X, half_width_m: 1.75 };
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
