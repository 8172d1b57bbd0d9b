//! The speed limit and the traffic light that apply to a vehicle.

use std::{collections::BTreeMap, sync::Arc};

use client_lib::{
    BlueprintInfo, World,
    wire::{ActorState, kind, light},
};
use glam::Vec3;
use road::{LaneTypes, Network};

use crate::{
    state::RoadContext,
    trigger_volumes::{LaneVolume, SignalPlace},
};

/// The speed limit of a vehicle is looked up every this many frames.
const FRAMES_BETWEEN: u64 = 4;
/// The limit of roads that define none. Kilometres per hour.
const LIMIT_KMH: f32 = 30.0;
/// The edge length of a cell of the grid of trigger volumes. It exceeds half a vehicle and half a
/// volume together. Metres.
const CELL_M: f32 = 16.0;

/// The limits and trigger volumes of a map, and the last limit of each vehicle.
pub(crate) struct RoadContexts {
    network: Arc<Network>,
    /// By cell: the signals whose volumes a vehicle with its centre there may touch.
    volumes: BTreeMap<[i32; 2], Vec<(u32, LaneVolume)>>,
    limits_kmh: BTreeMap<u32, f32>,
    /// By signal: its actor, and the phase that it shows in this frame.
    lights: BTreeMap<u32, (u32, u32)>,
}

impl RoadContexts {
    pub(crate) fn new(network: &Arc<Network>) -> RoadContexts {
        let mut volumes: BTreeMap<[i32; 2], Vec<(u32, LaneVolume)>> = BTreeMap::new();
        for (signal, index) in network.signals().iter().zip(0u32..).filter(|(s, _)| s.dynamic) {
            for volume in SignalPlace::new(network, signal).volumes {
                let [x, y] = cell(volume.center);
                let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
                around.for_each(|at| volumes.entry(at).or_default().push((index, volume)));
            }
        }
        RoadContexts {
            network: Arc::clone(network),
            volumes,
            limits_kmh: BTreeMap::new(),
            lights: BTreeMap::new(),
        }
    }

    /// Takes over the phases of a frame.
    pub(crate) fn follow(&mut self, world: &World) {
        let lights = world.states().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT);
        self.lights = lights.map(|a| (a.signal, (a.actor_id.0, a.phase))).collect();
    }

    /// Returns the context of a vehicle at this frame.
    pub(crate) fn of(
        &mut self,
        actor: &ActorState,
        blueprints: &[BlueprintInfo],
        frame: u64,
    ) -> RoadContext {
        let id = actor.actor_id.0;
        let is_due = (frame + u64::from(id)).is_multiple_of(FRAMES_BETWEEN);
        let speed_limit_kmh = match self.limits_kmh.get(&id) {
            Some(limit) if !is_due => *limit,
            _ => {
                let limit = self.limit_kmh(actor);
                self.limits_kmh.insert(id, limit);
                limit
            }
        };
        let light = blueprints.get(actor.blueprint as usize).and_then(|b| self.light(actor, b));
        RoadContext { speed_limit_kmh, light }
    }

    fn limit_kmh(&self, actor: &ActorState) -> f32 {
        let at = actor.pose.position().as_dvec3();
        let point = self.network.nearest(at, LaneTypes::DRIVING);
        let limit = point.and_then(|point| self.network.lane(point.lane).speed_limit_mps);
        limit.map_or(LIMIT_KMH, |mps| mps as f32 * 3.6)
    }

    /// Returns the light whose volume a vehicle touches, and its phase, unless it is green.
    fn light(&self, actor: &ActorState, blueprint: &BlueprintInfo) -> Option<(u32, u32)> {
        let BlueprintInfo { center_m, half_extents_m, .. } = blueprint;
        let near = self.volumes.get(&cell(actor.pose.position()))?;
        let shown = near.iter().filter_map(|(signal, volume)| {
            let light = *self.lights.get(signal)?;
            (light.1 != light::GREEN).then_some((light, volume))
        });
        let mut touched =
            shown.filter(|(_, volume)| volume.touches(&actor.pose, *center_m, *half_extents_m));
        touched.next().map(|(light, _)| light)
    }
}

fn cell(at: Vec3) -> [i32; 2] {
    [(at.x / CELL_M).floor() as i32, (at.y / CELL_M).floor() as i32]
}
