//! Rigs: which sensors are measured together, and the channels their bundles go through.

use std::collections::BTreeMap;

use bus::{
    ActorId, CreateRig, HostPorts, Name, RigId, SENSORS_MAX, SensorSpec, free_bytes, layout,
    output, sensor,
};

/// The most pixels or rays across or down.
const SIDE_MAX: u32 = 8192;

/// The rigs of the world.
#[derive(Default)]
pub(crate) struct Rigs {
    mounted: BTreeMap<RigId, Mounted>,
    last: u32,
}

/// Where a rig is, and whose.
struct Mounted {
    parent: ActorId,
    client: Name,
}

impl Rigs {
    /// Makes a rig and its channel, or says why not.
    pub(crate) fn create(
        &mut self,
        client: Name,
        wish: &CreateRig,
        sensors: &[SensorSpec],
        ports: &mut HostPorts,
    ) -> Result<RigId, String> {
        check_rig(wish, sensors)?;
        let (_, bytes) = layout(sensors);
        let held = wish.hold_max as usize;
        let needed = HostPorts::rig_bytes(bytes, held);
        let free = free_bytes().map_err(|e| format!("/dev/shm: {e}"))?;
        if needed > free {
            return Err(format!(
                "rig {:?}: {} MB a frame may need {} MB of /dev/shm, which has {} MB free; \
                 enlarge it, or hold fewer than {held} bundles",
                wish.name,
                bytes.div_ceil(1 << 20),
                needed.div_ceil(1 << 20),
                free >> 20,
            ));
        }
        let rig = RigId(self.last + 1);
        ports.found_rig(rig, held).map_err(|e| e.to_string())?;
        self.last += 1;
        self.mounted.insert(rig, Mounted { parent: wish.parent, client });
        Ok(rig)
    }

    /// Takes a rig away.
    pub(crate) fn destroy(&mut self, rig: RigId, ports: &mut HostPorts) -> Result<(), String> {
        self.mounted.remove(&rig).ok_or_else(|| format!("there is no rig {}", rig.0))?;
        ports.forget_rig(rig);
        Ok(())
    }

    /// Every rig.
    pub(crate) fn all(&self) -> Vec<RigId> {
        self.those(|_| true)
    }

    /// The rigs that `actor` carries.
    pub(crate) fn on(&self, actor: ActorId) -> Vec<RigId> {
        self.those(|rig| rig.parent == actor)
    }

    /// The rigs that `client` made: nobody else reads them.
    pub(crate) fn of(&self, client: Name) -> Vec<RigId> {
        self.those(|rig| rig.client == client)
    }

    /// The rigs on actors that are not there.
    pub(crate) fn orphans(&self, is_there: impl Fn(ActorId) -> bool) -> Vec<RigId> {
        self.those(|rig| rig.parent != ActorId::NONE && !is_there(rig.parent))
    }

    fn those(&self, are_meant: impl Fn(&Mounted) -> bool) -> Vec<RigId> {
        let meant = self.mounted.iter().filter(|(_, rig)| are_meant(rig));
        meant.map(|(id, _)| *id).collect()
    }
}

fn check_rig(wish: &CreateRig, sensors: &[SensorSpec]) -> Result<(), String> {
    let name = &wish.name;
    if sensors.is_empty() || sensors.len() > SENSORS_MAX {
        let count = sensors.len();
        return Err(format!("rig {name:?} has {count} sensors; 1 to {SENSORS_MAX} are possible"));
    }
    if sensors.len() != wish.sensor_count as usize {
        return Err(format!(
            "rig {name:?} announces {} sensors, but {} follow",
            wish.sensor_count,
            sensors.len()
        ));
    }
    if !(1..=8).contains(&wish.hold_max) {
        return Err(format!("rig {name:?}: hold_max is {}, not 1 to 8", wish.hold_max));
    }
    let born = sensors.iter().filter(|spec| sensor::is_born(spec.kind)).count();
    if born != 0 && born != sensors.len() {
        return Err(format!(
            "rig {name:?} has {born} sensors that physics measures and {} that rays do; make a rig \
             of each",
            sensors.len() - born
        ));
    }
    for (index, spec) in sensors.iter().enumerate() {
        check_sensor(spec)
            .map_err(|why| format!("sensor {:?} of rig {name:?}: {why}", spec.name))?;
        if sensors[..index].iter().any(|earlier| earlier.name == spec.name) {
            return Err(format!("rig {name:?} has two sensors named {:?}", spec.name));
        }
    }
    Ok(())
}

fn check_sensor(spec: &SensorSpec) -> Result<(), String> {
    let in_range = |what: &str, value: f32, low: f32, high: f32| {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(format!("{what} is {value}, not {low} to {high}"))
        }
    };
    if !spec.parent_from_sensor.is_valid() {
        return Err("its pose is not finite, or its rotation not of unit length".to_owned());
    }
    let away_m = spec.parent_from_sensor.position().abs().max_element();
    if away_m > 1e5 {
        return Err(format!("its pose lies {away_m} m out; 100000 m is the limit"));
    }
    if sensor::is_born(spec.kind) {
        return spec.check_born();
    }
    for (what, value) in [("width", spec.width), ("height", spec.height)] {
        if !(1..=SIDE_MAX).contains(&value) {
            return Err(format!("{what} is {value}, not 1 to {SIDE_MAX}"));
        }
    }
    let (name, possible) = match spec.kind {
        sensor::CAMERA => ("camera", output::OF_CAMERA),
        sensor::LIDAR => ("lidar", output::OF_LIDAR),
        other => {
            return Err(format!(
                "kind {other} is neither camera (1), lidar (2) nor one that physics measures (16 \
                 and up)"
            ));
        }
    };
    if spec.outputs == 0 || spec.outputs & !possible != 0 {
        return Err(format!(
            "outputs {:#x} are none or not possible for a {name}, which has {possible:#x}",
            spec.outputs
        ));
    }
    if spec.kind == sensor::CAMERA {
        return in_range("fov_rad", spec.fov_rad, 0.01, 3.1);
    }
    in_range("fov_rad", spec.fov_rad, 0.01, 6.283_186)?;
    in_range("upper_rad", spec.upper_rad, -1.6, 1.6)?;
    in_range("lower_rad", spec.lower_rad, -1.6, spec.upper_rad)?;
    in_range("range_m", spec.range_m, 0.1, 10_000.0)?;
    in_range("attenuation_per_m", spec.attenuation_per_m, 0.0, 10.0)?;
    in_range("noise_m", spec.noise_m, 0.0, 100.0)?;
    in_range("dropoff", spec.dropoff, 0.0, 1.0)?;
    in_range("rotation_rate_hz", spec.rotation_rate_hz, 0.0, 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::Pose;

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
        let wish = CreateRig {
            sensor_count: 1,
            hold_max: 2,
            name: Name::new("r"),
            ..CreateRig::default()
        };
        let said = check_rig(&wish, &[spec]).err().unwrap_or_default();
        assert_eq!(said, refusal);
    }

    #[test]
    fn a_refusal_names_the_sensor_and_the_attribute() {
        check(camera(), "");
        check(
            SensorSpec { width: 0, ..camera() },
            "sensor \"front\" of rig \"r\": width is 0, not 1 to 8192",
        );
        check(
            SensorSpec { fov_rad: f32::NAN, ..camera() },
            "sensor \"front\" of rig \"r\": fov_rad is NaN, not 0.01 to 3.1",
        );
        check(
            SensorSpec { outputs: output::POINTS, ..camera() },
            "sensor \"front\" of rig \"r\": outputs 0x10 are none or not possible for a camera, which has 0xcf",
        );
        let crooked = Pose { rotation: [0.0; 4], ..Pose::IDENTITY };
        check(
            SensorSpec { parent_from_sensor: crooked, ..camera() },
            "sensor \"front\" of rig \"r\": its pose is not finite, or its rotation not of unit length",
        );
    }
}
