//! The bundles of the world as the renderer knows them from the journal.

use std::collections::BTreeMap;

use protocol::{ActorId, ActorState, BundleId, Plane, Pose, SensorSpec, SnapshotHeader, output};

use crate::run::RigWriter;

#[derive(Default)]
pub(crate) struct Bundles {
    bundles: BTreeMap<BundleId, SensorBundle>,
    /// Writers of bundles that a keyframe may bring back.
    spare: BTreeMap<BundleId, RigWriter>,
}

struct SensorBundle {
    parent: ActorId,
    sensor_count: u32,
    sensors: Vec<SensorSpec>,
    /// There once all sensors are.
    mounted: Option<Mounted>,
}

struct Mounted {
    planes: Vec<Plane>,
    byte_len: u64,
    writer: RigWriter,
}

/// A bundle that measures in this frame.
pub(crate) struct Due {
    pub(crate) id: BundleId,
    pub(crate) parent: ActorId,
    pub(crate) world_from_parent: Pose,
    /// Those of the sensors whose turn it is.
    pub(crate) planes: Vec<Plane>,
    pub(crate) byte_len: u64,
}

impl Bundles {
    pub(crate) fn begin_anew(&mut self) {
        for (id, bundle) in std::mem::take(&mut self.bundles) {
            if let Some(mounted) = bundle.mounted {
                self.spare.insert(id, mounted.writer);
            }
        }
    }

    pub(crate) fn announce(&mut self, id: BundleId, parent: ActorId, sensor_count: u32) {
        self.bundles
            .insert(id, SensorBundle { parent, sensor_count, sensors: Vec::new(), mounted: None });
    }

    /// Adds a sensor; says all of them once they are complete.
    pub(crate) fn add(&mut self, id: BundleId, spec: SensorSpec) -> Option<&[SensorSpec]> {
        let bundle = self.bundles.get_mut(&id)?;
        bundle.sensors.push(spec);
        (bundle.sensors.len() == bundle.sensor_count as usize).then_some(&bundle.sensors[..])
    }

    pub(crate) fn take_writer(&mut self, id: BundleId) -> Option<RigWriter> {
        self.spare.remove(&id)
    }

    pub(crate) fn mount(
        &mut self,
        id: BundleId,
        planes: Vec<Plane>,
        byte_len: u64,
        writer: RigWriter,
    ) {
        if let Some(bundle) = self.bundles.get_mut(&id) {
            bundle.mounted = Some(Mounted { planes, byte_len, writer });
        }
    }

    pub(crate) fn remove(&mut self, id: BundleId) {
        self.bundles.remove(&id);
        self.spare.remove(&id);
    }

    /// Whether any sensor shows how things move.
    pub(crate) fn ask_for_flow(&self) -> bool {
        let flows = |spec: &SensorSpec| spec.outputs & output::FLOW != 0;
        self.bundles.values().any(|bundle| bundle.sensors.iter().any(flows))
    }

    pub(crate) fn sensors(&self, id: BundleId) -> &[SensorSpec] {
        &self.bundles[&id].sensors
    }

    pub(crate) fn writer(&self, id: BundleId) -> &RigWriter {
        &self.bundles[&id].mounted.as_ref().expect("only a mounted bundle is due").writer
    }

    /// The bundles that measure in this frame, by id. One whose carrier is gone does not.
    pub(crate) fn due(&self, header: &SnapshotHeader, actors: &[ActorState]) -> Vec<Due> {
        let mut due = Vec::new();
        for (id, bundle) in &self.bundles {
            let Some(mounted) = &bundle.mounted else { continue };
            let world_from_parent = if bundle.parent == ActorId::NONE {
                Pose::IDENTITY
            } else {
                match actors.binary_search_by_key(&bundle.parent, |a| a.actor_id) {
                    Ok(index) => actors[index].pose,
                    Err(_) => continue,
                }
            };
            let is_due = |plane: &Plane| measures(&bundle.sensors[plane.sensor as usize], header);
            let planes: Vec<_> = mounted.planes.iter().copied().filter(is_due).collect();
            if !planes.is_empty() {
                due.push(Due {
                    id: *id,
                    parent: bundle.parent,
                    world_from_parent,
                    planes,
                    byte_len: mounted.byte_len,
                });
            }
        }
        due
    }
}

/// Whether a sensor's turn has come: simulated time has passed a multiple of its period within
/// this frame. No drift, whatever the delta.
fn measures(spec: &SensorSpec, header: &SnapshotHeader) -> bool {
    if spec.period_nanos == 0 {
        return true;
    }
    let now = header.stamp.sim_time_nanos;
    let before = now.saturating_sub(header.delta_nanos);
    now / spec.period_nanos != before / spec.period_nanos
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::Stamp;

    #[test]
    fn a_period_that_is_no_multiple_of_the_delta_does_not_drift() {
        let spec = SensorSpec { period_nanos: 70_000_000, ..SensorSpec::default() };
        let times: Vec<_> = (1..=28)
            .filter(|frame| {
                let stamp = Stamp { sim_time_nanos: frame * 50_000_000, ..Stamp::default() };
                measures(
                    &spec,
                    &SnapshotHeader { stamp, delta_nanos: 50_000_000, ..Default::default() },
                )
            })
            .collect();
        assert_eq!(times.len(), 20);
        assert_eq!(times[..5], [2, 3, 5, 6, 7]);
    }
}
