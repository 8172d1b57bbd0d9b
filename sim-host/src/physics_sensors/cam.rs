//! Generation and content of cooperative awareness messages: ETSI EN 302 637-2, section 6.1.3.

use glam::Vec3;
use mesh::Tag;
use protocol::{ActorState, CamReading, CamSpec, Pose, geodesy, radio};
use road::Network;

use super::{gnss::locate, imu::compass, noise::Noise};

/// Station types of ETSI.
mod station {
    pub(super) const UNKNOWN: u32 = 0;
    pub(super) const PEDESTRIAN: u32 = 1;
    pub(super) const CYCLIST: u32 = 2;
    pub(super) const MOTORCYCLE: u32 = 4;
    pub(super) const PASSENGER_CAR: u32 = 5;
    pub(super) const BUS: u32 = 6;
    pub(super) const LIGHT_TRUCK: u32 = 7;
    pub(super) const SPECIAL: u32 = 10;
    pub(super) const TRAM: u32 = 11;
    pub(super) const ROADSIDE_UNIT: u32 = 15;
}

const HEADING_CHANGE_RAD: f32 = 4.0 * std::f32::consts::PI / 180.0;
const PLACE_CHANGE_M: f32 = 4.0;
const SPEED_CHANGE_MPS: f32 = 0.5;
/// Shortest interval of the low-frequency container (role and lights).
const LOW_FREQUENCY_SECS: f64 = 0.5;
/// Interval of a roadside unit.
const ROADSIDE_SECS: f64 = 0.5;
/// After this many messages without a change of state, the interval is the longest again.
const UNCHANGED_MAX: u32 = 3;

/// The sending side of a station.
pub(super) struct Cam {
    pub(super) spec: CamSpec,
    /// Time, position, direction and speed of the last message.
    last: Option<(f64, Vec3, Vec3, f32)>,
    last_low_secs: Option<f64>,
    interval_secs: f64,
    unchanged: u32,
}

impl Cam {
    pub(super) fn new(spec: CamSpec) -> Cam {
        let interval_secs = f64::from(spec.interval_max_secs);
        Cam { spec, last: None, last_low_secs: None, interval_secs, unchanged: 0 }
    }

    /// Returns the message of this frame, if one is due.
    pub(super) fn generate(
        &mut self,
        carrier: Option<&ActorState>,
        world_from_sensor: &Pose,
        now_secs: f64,
        network: &Network,
        noise: &mut Noise,
    ) -> Option<CamReading> {
        let (place, ahead) = match carrier {
            Some(state) => (state.pose.position(), state.pose.rotation() * Vec3::X),
            None => (world_from_sensor.position(), world_from_sensor.rotation() * Vec3::X),
        };
        let speed = carrier.map_or(0.0, |state| state.velocity().dot(ahead));
        let is_vehicle = carrier.is_some();
        if !self.is_due(is_vehicle, now_secs, (place, ahead, speed)) {
            return None;
        }
        self.last = Some((now_secs, place, ahead, speed));
        let is_low =
            self.last_low_secs.is_none_or(|last| now_secs - last >= LOW_FREQUENCY_SECS - 1e-6);
        if is_vehicle && is_low {
            self.last_low_secs = Some(now_secs);
        }
        Some(self.message(carrier, world_from_sensor, now_secs, network, is_low, noise))
    }

    /// The generation rules. Simulated time may have been set back by a loaded state.
    fn is_due(&mut self, is_vehicle: bool, now_secs: f64, now: (Vec3, Vec3, f32)) -> bool {
        let Some((last_secs, place, ahead, speed)) = self.last else { return true };
        let past = now_secs - last_secs + 1e-6;
        if past < 0.0 {
            return true;
        }
        if !is_vehicle {
            return past >= ROADSIDE_SECS;
        }
        let spec = &self.spec;
        if past < f64::from(spec.interval_min_secs) {
            return false;
        }
        if spec.radio.flags & radio::FIXED_RATE != 0 {
            return true;
        }
        let has_changed = now.1.angle_between(ahead) > HEADING_CHANGE_RAD
            || now.0.distance(place) > PLACE_CHANGE_M
            || (now.2 - speed).abs() > SPEED_CHANGE_MPS;
        if has_changed {
            self.interval_secs = past.min(f64::from(spec.interval_max_secs));
            self.unchanged = 0;
            return true;
        }
        if past < self.interval_secs {
            return false;
        }
        self.unchanged += 1;
        if self.unchanged >= UNCHANGED_MAX {
            self.interval_secs = f64::from(spec.interval_max_secs);
        }
        true
    }

    fn message(
        &self,
        carrier: Option<&ActorState>,
        world_from_sensor: &Pose,
        now_secs: f64,
        network: &Network,
        is_low: bool,
        noise: &mut Noise,
    ) -> CamReading {
        let spec = &self.spec;
        let pose = carrier.map_or(*world_from_sensor, |state| state.pose);
        let geodesy =
            if spec.radio.flags & radio::AS_CARLA != 0 { geodesy::CARLA } else { geodesy::MAP };
        let point = locate(pose.position().as_dvec3(), network, geodesy);
        let mut error = |deviation: f32, bias: f32| noise.normal(deviation) + f64::from(bias);
        let mut message = CamReading {
            station_type: station::ROADSIDE_UNIT,
            generation_delta_ms: ((now_secs * 1000.0).round() as u64 % 65_536) as u32,
            latitude_deg: point.latitude_deg
                + error(spec.latitude_stddev_deg, spec.latitude_bias_deg),
            longitude_deg: point.longitude_deg
                + error(spec.longitude_stddev_deg, spec.longitude_bias_deg),
            altitude_m: point.altitude_m + error(spec.altitude_stddev_m, spec.altitude_bias_m),
            ..CamReading::default()
        };
        let Some(state) = carrier else { return message };
        let blueprint = &town::catalogue()[state.blueprint as usize];
        let back = pose.rotation().inverse();
        let speed = (back * state.velocity()).x;
        let turn = back * Vec3::from_array(state.angular_velocity_radps);
        let acceleration = back * Vec3::from_array(state.acceleration_mps2);
        let heading = compass(&pose) + error(spec.heading_stddev_rad, spec.heading_bias_rad) as f32;
        message.station_id = state.actor_id.0;
        message.station_type = station_of(blueprint.tag, blueprint.id);
        message.heading_rad = heading.rem_euclid(std::f32::consts::TAU);
        message.speed_mps = (speed + error(spec.speed_stddev_mps, 0.0) as f32).max(0.0);
        // The speed of a standing vehicle jitters slightly.
        message.drive_direction = (speed < -0.01).into();
        message.length_m = 2.0 * blueprint.half_extents_m.x;
        message.width_m = 2.0 * blueprint.half_extents_m.y;
        message.acceleration_mps2 = std::array::from_fn(|axis| {
            acceleration[axis] + error(spec.acceleration_stddev_mps2[axis], 0.0) as f32
        });
        message.yaw_rate_radps =
            turn.z + error(spec.yaw_rate_stddev_radps, spec.yaw_rate_bias_radps) as f32;
        message.has_low_frequency = is_low.into();
        if is_low {
            message.lamps = state.lamps;
            message.role = match message.station_type {
                station::BUS | station::TRAM => 1,
                station::SPECIAL => 6,
                _ => 0,
            };
        }
        message
    }
}

fn station_of(tag: Tag, id: &str) -> u32 {
    if ["ambulance", "firetruck", "charger_police", "police"].iter().any(|word| id.contains(word)) {
        return station::SPECIAL;
    }
    match tag {
        Tag::Pedestrian => station::PEDESTRIAN,
        Tag::Bicycle => station::CYCLIST,
        Tag::Motorcycle => station::MOTORCYCLE,
        Tag::Car => station::PASSENGER_CAR,
        Tag::Bus => station::BUS,
        Tag::Truck => station::LIGHT_TRUCK,
        Tag::Train => station::TRAM,
        Tag::TrafficLight | Tag::TrafficSign | Tag::Pole => station::ROADSIDE_UNIT,
        _ => station::UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the times of messages within `secs` of a vehicle with `speed` m/s, which from second
    /// 2 on accelerates with 1 m/s² if `gains`.
    fn times(spec: CamSpec, speed: f32, gains: bool, secs: f64) -> Vec<f64> {
        let mut cam = Cam::new(spec);
        let mut message = Vec::new();
        let (mut x, mut v) = (0.0, speed);
        for frame in 1..=(secs / 0.05) as u32 {
            let now = f64::from(frame) * 0.05;
            if gains && now > 2.0 {
                v += 0.05;
            }
            x += v * 0.05;
            if cam.is_due(true, now, (Vec3::X * x, Vec3::X, v)) {
                cam.last = Some((now, Vec3::X * x, Vec3::X, v));
                message.push(now);
            }
        }
        message
    }

    fn gaps(times: &[f64]) -> Vec<i64> {
        times.windows(2).map(|pair| ((pair[1] - pair[0]) * 1000.0).round() as i64).collect()
    }

    #[test]
    fn messages_follow_the_generation_rules() {
        let spec = CamSpec::default();
        // A standing vehicle sends once per second.
        assert!(gaps(&times(spec, 0.0, false, 5.0)).iter().all(|gap| *gap == 1000));
        // At 20 m/s, 4 m take less than 0.25 s.
        let fast = gaps(&times(spec, 20.0, false, 5.0));
        assert!(fast.iter().all(|gap| *gap == 250 || *gap == 200), "{fast:?}");
        // At 1 m/s², a change of 0.5 m/s takes half a second.
        let gaining = gaps(&times(spec, 1.0, true, 6.0));
        assert!(gaining.iter().rev().take(4).all(|gap| (500..=600).contains(gap)), "{gaining:?}");
        let fixed = CamSpec {
            radio: protocol::RadioSpec { flags: radio::FIXED_RATE, ..spec.radio },
            ..spec
        };
        assert!(gaps(&times(fixed, 0.0, false, 2.0)).iter().all(|gap| *gap == 100));
        // The shortest interval holds at any speed.
        assert!(gaps(&times(spec, 200.0, false, 2.0)).iter().all(|gap| *gap == 100));
    }
}
