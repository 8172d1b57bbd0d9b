//! Sensor bundles: checks, ids and channels.

use std::collections::BTreeMap;

use bus::{HostPorts, free_bytes};
use protocol::{
    ActorId, BundleId, CreateBundle, Name, Projection, Refusal, SENSORS_MAX, SensorSpec, layout,
    output, quality, sensor,
};

/// Largest width or height of an image, in pixels or rays.
const SIDE_MAX: u32 = 8192;

/// The bundles of the world.
#[derive(Default)]
pub(crate) struct Bundles {
    mounted: BTreeMap<BundleId, Mounted>,
    last: u32,
}

/// The carrier and owner of a bundle.
struct Mounted {
    parent: ActorId,
    client: Name,
}

impl Bundles {
    /// Creates a bundle and its channel.
    ///
    /// # Errors
    ///
    /// The cause as a text.
    pub(crate) fn create(
        &mut self,
        client: Name,
        command: &CreateBundle,
        sensors: &[SensorSpec],
        ports: &mut HostPorts,
    ) -> Result<BundleId, Refusal> {
        check_bundle(command, sensors)?;
        let (_, bytes) = layout(sensors);
        let held = command.max_borrowed as usize;
        let needed = HostPorts::bundle_channel_bytes(bytes, held);
        let free = free_bytes().map_err(|e| Refusal::other(format!("/dev/shm: {e}")))?;
        if needed > free {
            return Err(Refusal::full(format!(
                "bundle {:?}: {} MB per frame may need {} MB of /dev/shm, which has {} MB free; \
                 enlarge it, or hold fewer than {held} bundles",
                command.name,
                bytes.div_ceil(1 << 20),
                needed.div_ceil(1 << 20),
                free >> 20,
            )));
        }
        let bundle = BundleId(self.last + 1);
        ports.create_bundle(bundle, held).map_err(|e| Refusal::full(e.to_string()))?;
        self.last += 1;
        self.mounted.insert(bundle, Mounted { parent: command.parent, client });
        Ok(bundle)
    }

    /// Removes a bundle and its channel.
    pub(crate) fn destroy(
        &mut self,
        bundle: BundleId,
        ports: &mut HostPorts,
    ) -> Result<(), Refusal> {
        self.mounted
            .remove(&bundle)
            .ok_or_else(|| Refusal::not_found(format!("there is no bundle {}", bundle.0)))?;
        ports.remove_bundle(bundle);
        Ok(())
    }

    /// Returns whether there is no bundle.
    pub(crate) fn is_empty(&self) -> bool {
        self.mounted.is_empty()
    }

    /// Returns every bundle.
    pub(crate) fn all(&self) -> Vec<BundleId> {
        self.those(|_| true)
    }

    /// Returns the bundles that `actor` carries.
    pub(crate) fn on(&self, actor: ActorId) -> Vec<BundleId> {
        self.those(|bundle| bundle.parent == actor)
    }

    /// Returns the bundles that `client` created; no other client reads them.
    pub(crate) fn of(&self, client: Name) -> Vec<BundleId> {
        self.those(|bundle| bundle.client == client)
    }

    /// Returns the bundles on actors that do not exist.
    pub(crate) fn orphans(&self, is_there: impl Fn(ActorId) -> bool) -> Vec<BundleId> {
        self.those(|bundle| bundle.parent != ActorId::NONE && !is_there(bundle.parent))
    }

    fn those(&self, are_meant: impl Fn(&Mounted) -> bool) -> Vec<BundleId> {
        let meant = self.mounted.iter().filter(|(_, bundle)| are_meant(bundle));
        meant.map(|(id, _)| *id).collect()
    }
}

fn check_bundle(command: &CreateBundle, sensors: &[SensorSpec]) -> Result<(), Refusal> {
    let name = &command.name;
    if sensors.is_empty() || sensors.len() > SENSORS_MAX {
        let count = sensors.len();
        return Err(Refusal::out_of_range(format!(
            "bundle {name:?} has {count} sensors, not 1 to {SENSORS_MAX}"
        )));
    }
    if sensors.len() != command.sensor_count as usize {
        return Err(Refusal::out_of_range(format!(
            "bundle {name:?} announces {} sensors, but {} follow",
            command.sensor_count,
            sensors.len()
        )));
    }
    if !(1..=8).contains(&command.max_borrowed) {
        return Err(Refusal::out_of_range(format!(
            "bundle {name:?}: max_borrowed is {}, not 1 to 8",
            command.max_borrowed
        )));
    }
    let physics = sensors.iter().filter(|spec| sensor::is_physics_sensor(spec.kind)).count();
    if physics != 0 && physics != sensors.len() {
        return Err(Refusal::out_of_range(format!(
            "bundle {name:?} has {physics} physics sensors and {} sensors of rays; make a bundle \
             of each",
            sensors.len() - physics
        )));
    }
    for (index, spec) in sensors.iter().enumerate() {
        check_sensor(spec).map_err(|refusal| {
            refusal.about(format_args!("sensor {:?} of bundle {name:?}", spec.name))
        })?;
        if sensors[..index].iter().any(|earlier| earlier.name == spec.name) {
            return Err(Refusal::out_of_range(format!(
                "bundle {name:?} has two sensors named {:?}",
                spec.name
            )));
        }
    }
    Ok(())
}

fn check_sensor(spec: &SensorSpec) -> Result<(), Refusal> {
    let in_range = |what: &str, value: f32, low: f32, high: f32| {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(Refusal::out_of_range(format!("{what} is {value}, not {low} to {high}")))
        }
    };
    if !spec.parent_from_sensor.is_valid() {
        return Err(Refusal::out_of_range(
            "its pose is not finite, or its rotation not of unit length",
        ));
    }
    let away_m = spec.parent_from_sensor.position().abs().max_element();
    if away_m > 1e5 {
        return Err(Refusal::out_of_range(format!(
            "its pose lies {away_m} m from its parent; the limit is 100000 m"
        )));
    }
    if sensor::is_physics_sensor(spec.kind) {
        return spec.check_physics_sensor().map_err(Refusal::out_of_range);
    }
    for (what, value) in [("width", spec.width), ("height", spec.height)] {
        if !(1..=SIDE_MAX).contains(&value) {
            return Err(Refusal::out_of_range(format!("{what} is {value}, not 1 to {SIDE_MAX}")));
        }
    }
    let (name, possible) = match spec.kind {
        sensor::CAMERA => ("camera", output::OF_CAMERA),
        sensor::LIDAR => ("lidar", output::OF_LIDAR),
        other => {
            return Err(Refusal::unsupported(format!(
                "unsupported sensor kind {other}, not camera (1), lidar (2) or a physics sensor (16 \
                 and up)"
            )));
        }
    };
    if spec.outputs == 0 || spec.outputs & !possible != 0 {
        return Err(Refusal::out_of_range(format!(
            "outputs {:#x} are empty or unsupported; a {name} has {possible:#x}",
            spec.outputs
        )));
    }
    if spec.kind == sensor::CAMERA {
        if spec.quality > quality::EPIC {
            return Err(Refusal::out_of_range(format!(
                "quality is {}, not 0 (as the renderer), 1 (low), 2 (standard) or 3 (epic)",
                spec.quality
            )));
        }
        Projection::check(spec).map_err(Refusal::out_of_range)?;
        if spec.effects.readout_secs > 0.0 && spec.outputs & output::FLOW != 0 {
            return Err(Refusal::unsupported(
                "readout_secs is above 0, but optical flow of a rolling shutter is not supported; \
                 measure it with another camera",
            ));
        }
        return spec.effects.check().map_err(Refusal::out_of_range);
    }
    in_range("fov_rad", spec.fov_rad, 0.01, 6.283_186)?;
    in_range("upper_rad", spec.upper_rad, -1.6, 1.6)?;
    in_range("lower_rad", spec.lower_rad, -1.6, spec.upper_rad)?;
    in_range("range_m", spec.range_m, 0.1, 10_000.0)?;
    in_range("attenuation_per_m", spec.attenuation_per_m, 0.0, 10.0)?;
    in_range("noise_m", spec.noise_m, 0.0, 100.0)?;
    in_range("dropoff", spec.dropoff, 0.0, 1.0)?;
    in_range("rotation_rate_hz", spec.rotation_rate_hz, 0.0, 1000.0)?;
    spec.check_beams().map_err(Refusal::out_of_range)
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::Pose;

    fn camera() -> SensorSpec {
        SensorSpec {
            name: Name::new("front"),
            kind: sensor::CAMERA,
            outputs: output::COLOR,
            width: 800,
            height: 600,
            fov_rad: 1.5,
            ..SensorSpec::default()
        }
    }

    fn check(spec: SensorSpec, refusal: &str) {
        let command = CreateBundle {
            sensor_count: 1,
            max_borrowed: 2,
            name: Name::new("r"),
            ..CreateBundle::default()
        };
        let error = check_bundle(&command, &[spec]).err().map(|refusal| refusal.reason);
        assert_eq!(error.unwrap_or_default(), refusal);
    }

    #[test]
    fn a_refusal_names_the_sensor_and_the_attribute() {
        check(camera(), "");
        check(
            SensorSpec { width: 0, ..camera() },
            "sensor \"front\" of bundle \"r\": width is 0, not 1 to 8192",
        );
        check(
            SensorSpec { fov_rad: f32::NAN, ..camera() },
            "sensor \"front\" of bundle \"r\": fov_rad is NaN, not 0.01 to 3.1",
        );
        check(
            SensorSpec { outputs: output::POINTS, ..camera() },
            "sensor \"front\" of bundle \"r\": outputs 0x10 are empty or unsupported; a camera has 0xcf",
        );
        let crooked = Pose { rotation: [0.0; 4], ..Pose::IDENTITY };
        check(
            SensorSpec { parent_from_sensor: crooked, ..camera() },
            "sensor \"front\" of bundle \"r\": its pose is not finite, or its rotation not of unit length",
        );
    }

    #[test]
    fn every_number_of_a_sensor_is_refused_or_gives_a_finite_pose_and_a_bounded_bundle() {
        use protocol::{
            CamSpec, CollisionSpec, GnssSpec, ImuSpec, LaneInvasionSpec, MessageSpec, ObstacleSpec,
            OdometrySpec,
        };
        let lidar = SensorSpec {
            kind: sensor::LIDAR,
            outputs: output::POINTS,
            upper_rad: 0.2,
            lower_rad: -0.2,
            range_m: 50.0,
            ..camera()
        };
        let specs = [
            camera(),
            lidar,
            SensorSpec::physics("front", Pose::IDENTITY, &ImuSpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &GnssSpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &OdometrySpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &CollisionSpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &LaneInvasionSpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &ObstacleSpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &CamSpec::default()),
            SensorSpec::physics("front", Pose::IDENTITY, &MessageSpec::default()),
        ];
        let far = Pose::level(glam::Vec3::splat(protocol::PLACE_MAX_M), 0.3);
        let command = CreateBundle { sensor_count: 1, max_borrowed: 2, ..CreateBundle::default() };
        for spec in specs {
            let kind = spec.kind;
            check(spec, "");
            for word in 0..size_of::<SensorSpec>() / 4 {
                for value in [f32::NAN, f32::INFINITY, 3e38, -1e30, 1e-40, 9e4] {
                    let mut spec = spec;
                    bytemuck::bytes_of_mut(&mut spec)[word * 4..][..4]
                        .copy_from_slice(&value.to_ne_bytes());
                    if check_bundle(&command, &[spec]).is_err() {
                        continue;
                    }
                    let at = far.then(&spec.parent_from_sensor);
                    assert!(at.is_valid(), "kind {kind} word {word} {value}: {at:?}");
                    let bytes = layout(&[spec]).1;
                    assert!(bytes < 1 << 33, "kind {kind} word {word} {value}: {bytes} bytes");
                }
            }
        }
    }
}
