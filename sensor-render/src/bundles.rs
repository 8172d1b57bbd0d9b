//! Sensor bundles, as the journal describes them.

use std::collections::BTreeMap;

use bus::Writer;
use protocol::{
    ActorId, ActorState, BundleHeader, BundleId, BundleReceipt, CreateBundle, EffectsSpec, Page,
    Plane, Pose, SensorSpec, SnapshotHeader, output, sensor,
};

use crate::lidar::sweeps;

/// Writing end of the channel of one bundle.
pub(crate) type BundleWriter = Writer<BundleHeader, Page>;

#[derive(Default)]
pub(crate) struct Bundles {
    bundles: BTreeMap<BundleId, SensorBundle>,
    /// Writers of bundles that the next keyframe may name again.
    spare_writers: BTreeMap<BundleId, BundleWriter>,
}

struct SensorBundle {
    parent: ActorId,
    sensor_count: u32,
    receipt: BundleReceipt,
    sensors: Vec<SensorSpec>,
    /// Set once all sensors of the bundle are known.
    active: Option<ActiveBundle>,
}

struct ActiveBundle {
    planes: Vec<Plane>,
    byte_len: u64,
    writer: BundleWriter,
}

/// A bundle that measures at the current frame.
pub(crate) struct DueBundle {
    pub(crate) id: BundleId,
    pub(crate) parent: ActorId,
    pub(crate) world_from_parent: Pose,
    /// Planes of the sensors that are due.
    pub(crate) planes: Vec<Plane>,
    pub(crate) byte_len: u64,
}

impl Bundles {
    pub(crate) fn reset(&mut self) {
        for (id, bundle) in std::mem::take(&mut self.bundles) {
            if let Some(active) = bundle.active {
                self.spare_writers.insert(id, active.writer);
            }
        }
    }

    pub(crate) fn create(&mut self, id: BundleId, command: &CreateBundle, receipt: BundleReceipt) {
        let &CreateBundle { parent, sensor_count, .. } = command;
        let bundle =
            SensorBundle { parent, sensor_count, receipt, sensors: Vec::new(), active: None };
        self.bundles.insert(id, bundle);
    }

    /// Adds a sensor; returns all sensors of the bundle once they are complete.
    pub(crate) fn add(&mut self, id: BundleId, spec: SensorSpec) -> Option<&[SensorSpec]> {
        let bundle = self.bundles.get_mut(&id)?;
        bundle.sensors.push(spec);
        (bundle.sensors.len() == bundle.sensor_count as usize).then_some(&bundle.sensors[..])
    }

    pub(crate) fn take_writer(&mut self, id: BundleId) -> Option<BundleWriter> {
        self.spare_writers.remove(&id)
    }

    pub(crate) fn activate(
        &mut self,
        id: BundleId,
        planes: Vec<Plane>,
        byte_len: u64,
        writer: BundleWriter,
    ) {
        if let Some(bundle) = self.bundles.get_mut(&id) {
            bundle.active = Some(ActiveBundle { planes, byte_len, writer });
        }
    }

    pub(crate) fn remove(&mut self, id: BundleId) {
        self.bundles.remove(&id);
        self.spare_writers.remove(&id);
    }

    /// Returns whether any sensor depends on the motion since the previous frame: by optical flow, a rolling
    /// shutter or motion blur of a camera, or the sweep of a lidar.
    pub(crate) fn needs_motion(&self) -> bool {
        let needs = |spec: &SensorSpec| {
            let EffectsSpec { readout_secs, blur_secs, .. } = spec.effects;
            let has_flow = spec.kind == sensor::CAMERA && spec.outputs & output::FLOW != 0;
            has_flow || readout_secs > 0.0 || blur_secs > 0.0 || sweeps(spec)
        };
        self.bundles.values().any(|bundle| bundle.sensors.iter().any(needs))
    }

    pub(crate) fn sensors(&self, id: BundleId) -> &[SensorSpec] {
        &self.bundles[&id].sensors
    }

    pub(crate) fn writer(&self, id: BundleId) -> &BundleWriter {
        &self.bundles[&id].active.as_ref().expect("only a mounted bundle is due").writer
    }

    /// Returns the bundles that measure at this frame, by id. A bundle whose parent no longer
    /// exists does not measure.
    pub(crate) fn due(&self, header: &SnapshotHeader, actors: &[ActorState]) -> Vec<DueBundle> {
        let mut due = Vec::new();
        for (id, bundle) in &self.bundles {
            let Some(active) = &bundle.active else { continue };
            let world_from_parent = if bundle.parent == ActorId::NONE {
                Pose::IDENTITY
            } else {
                match actors.binary_search_by_key(&bundle.parent, |a| a.actor_id) {
                    Ok(index) => actors[index].pose,
                    Err(_) => continue,
                }
            };
            let plane_is_due = |plane: &Plane| {
                bundle.receipt.is_due(&bundle.sensors[plane.sensor as usize], header)
            };
            let planes: Vec<_> = active.planes.iter().copied().filter(plane_is_due).collect();
            if !planes.is_empty() {
                due.push(DueBundle {
                    id: *id,
                    parent: bundle.parent,
                    world_from_parent,
                    planes,
                    byte_len: active.byte_len,
                });
            }
        }
        due
    }
}
