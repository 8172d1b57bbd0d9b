//! The speed limit and the traffic light that apply to a vehicle.

use std::{collections::BTreeMap, sync::Arc};

use client_lib::{
    BlueprintInfo, World,
    wire::{ActorState, kind, light},
};
use glam::Vec3;
use road::Network;

use crate::{
    state::RoadContext,
    trigger_volumes::{self, LaneVolume, SignalPlace},
};

/// The limit of a vehicle that has touched the volume of no speed sign yet, as in CARLA
/// (`WheeledVehicleAIController.h`). Kilometres per hour.
const FIRST_LIMIT_KMH: f32 = 30.0;
/// The edge length of a cell of the grid of trigger volumes. It exceeds half a vehicle and half a
/// volume together. Metres.
const CELL_M: f32 = 16.0;

/// What a volume on a lane belongs to.
#[derive(Clone, Copy)]
enum Source {
    /// The index of a traffic light among the signals of the map.
    Light(u32),
    /// The limit of a speed sign, kilometres per hour.
    SpeedSign(f32),
}

/// The trigger volumes of a map, and the last limit of each vehicle.
pub(crate) struct RoadContexts {
    /// By cell: what a vehicle with its centre there may touch.
    volumes: BTreeMap<[i32; 2], Vec<(Source, LaneVolume)>>,
    /// By vehicle: the limit of the last speed sign whose volume it has touched.
    limits_kmh: BTreeMap<u32, f32>,
    /// By signal: its actor, and the phase that it shows in this frame.
    lights: BTreeMap<u32, (u32, u32)>,
}

impl RoadContexts {
    pub(crate) fn new(network: &Arc<Network>) -> RoadContexts {
        let mut volumes: BTreeMap<[i32; 2], Vec<(Source, LaneVolume)>> = BTreeMap::new();
        for (signal, index) in network.signals().iter().zip(0u32..) {
            let source = match trigger_volumes::speed_sign_kmh(signal) {
                _ if signal.dynamic => Source::Light(index),
                Some(limit) => Source::SpeedSign(limit),
                None => continue,
            };
            for volume in SignalPlace::new(network, signal).volumes {
                let [x, y] = cell(volume.center);
                let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
                around.for_each(|at| volumes.entry(at).or_default().push((source, volume)));
            }
        }
        RoadContexts { volumes, limits_kmh: BTreeMap::new(), lights: BTreeMap::new() }
    }

    /// Takes over the phases of a frame.
    pub(crate) fn follow(&mut self, world: &World) {
        let lights = world.states().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT);
        self.lights = lights.map(|a| (a.signal, (a.actor_id.0, a.phase))).collect();
    }

    /// Returns the context of a vehicle at this frame.
    pub(crate) fn of(&mut self, actor: &ActorState, blueprints: &[BlueprintInfo]) -> RoadContext {
        let id = actor.actor_id.0;
        let mut speed_limit_kmh = self.limits_kmh.get(&id).copied().unwrap_or(FIRST_LIMIT_KMH);
        let mut light = None;
        let near = self.volumes.get(&cell(actor.pose.position()));
        if let (Some(near), Some(blueprint)) = (near, blueprints.get(actor.blueprint as usize)) {
            let BlueprintInfo { center_m, half_extents_m, .. } = *blueprint;
            let touched =
                near.iter().filter(|(_, v)| v.touches(&actor.pose, center_m, half_extents_m));
            for (source, _) in touched {
                match source {
                    Source::SpeedSign(limit) => speed_limit_kmh = *limit,
                    Source::Light(signal) => {
                        let shown = self.lights.get(signal).filter(|(_, p)| *p != light::GREEN);
                        light = light.or(shown.copied());
                    }
                }
            }
            self.limits_kmh.insert(id, speed_limit_kmh);
        }
        RoadContext { speed_limit_kmh, light }
    }
}

fn cell(at: Vec3) -> [i32; 2] {
    [(at.x / CELL_M).floor() as i32, (at.y / CELL_M).floor() as i32]
}

#[cfg(test)]
mod tests {
    use client_lib::{ActorId, Pose};

    use super::*;

    /// Returns the limits of a vehicle that drives 10 m towards a volume, and 10 m beyond.
    fn limits(contexts: &mut RoadContexts, volume: &LaneVolume) -> Vec<f32> {
        let car = BlueprintInfo {
            id: "vehicle.tesla.model3".to_owned(),
            tag: 14,
            half_extents_m: [2.4, 1.0, 0.75],
            center_m: [0.0, 0.0, 0.75],
        };
        let mut limit_at = |step: u8| {
            let along = (f32::from(step) - 10.0) * volume.along;
            let pose = Pose::level(volume.center + along.extend(0.0), volume.along.to_angle());
            let actor = ActorState { actor_id: ActorId(7), pose, ..ActorState::default() };
            contexts.of(&actor, std::slice::from_ref(&car)).speed_limit_kmh
        };
        (0..=20).map(&mut limit_at).collect()
    }

    #[test]
    fn a_speed_limit_is_30_until_a_sign_is_passed_and_then_that_of_the_sign() {
        let network = Network::parse(&mapgen::named("Town05").unwrap()).unwrap();
        let network = Arc::new(network);
        let mut signs = network.signals().iter().filter_map(|signal| {
            let limit = trigger_volumes::speed_sign_kmh(signal).filter(|limit| *limit != 30.0)?;
            let volumes = SignalPlace::new(&network, signal).volumes;
            Some((limit, *volumes.first()?))
        });
        let (limit, volume) = signs.next().expect("a sign with another limit than 30 km/h");
        let mut contexts = RoadContexts::new(&network);
        let seen = limits(&mut contexts, &volume);
        assert_eq!(seen[0], 30.0, "10 m before the sign: {seen:?}");
        assert_eq!(seen[10..], [limit; 11], "from the sign on: {seen:?}");
        let (_, other) = signs.find(|(other, _)| *other != limit).unwrap_or((limit, volume));
        assert_eq!(limits(&mut contexts, &other)[0], limit, "until the next sign");
    }

    #[test]
    fn a_speed_limit_stays_30_where_a_map_has_no_speed_sign() {
        let text = mapgen::named("Town05").unwrap().replace("type=\"274\"", "type=\"101\"");
        let network = Arc::new(Network::parse(&text).unwrap());
        assert!(network.lanes().iter().any(|lane| lane.speed_limit_mps.is_some()));
        let signals = network.signals().iter().filter(|s| s.kind == "101");
        let places = signals.map(|signal| SignalPlace::new(&network, signal));
        let volume = places.flat_map(|place| place.volumes).next().unwrap();
        assert!(limits(&mut RoadContexts::new(&network), &volume).iter().all(|l| *l == 30.0));
    }
}
