//! Which vehicles have rolled over, and since when.

use std::collections::BTreeMap;

use client_lib::{ActorId, World, wire::ActorState};
use glam::Vec3;

/// A vehicle has rolled over beyond this roll, to either side. Radians.
///
/// Limits and delay are those of CARLA's `ACarlaWheeledVehicle::ApplyRolloverBehavior`.
const OVER_RAD: f32 = 160.0_f32.to_radians();
/// A vehicle has recovered below this roll. Radians.
const RECOVERED_RAD: f32 = 30.0_f32.to_radians();
/// Simulated time after which a vehicle that has rolled over reports it.
const DELAY_NANOS: u64 = 5_000_000_000;
/// CARLA's numbers of `VehicleFailureState`.
const NONE: u8 = 0;
const ROLLOVER: u8 = 1;

/// When each vehicle that has not recovered rolled over.
#[derive(Default)]
pub(crate) struct Rollovers {
    since_nanos: BTreeMap<u32, u64>,
}

impl Rollovers {
    /// Forgets vehicles that are no longer in the world.
    pub(crate) fn follow(&mut self, world: &World) {
        self.since_nanos.retain(|id, _| world.state(ActorId(*id)).is_some());
    }

    /// Returns CARLA's failure state of a vehicle at this simulated time.
    pub(crate) fn failure_of(&mut self, vehicle: &ActorState, now_nanos: u64) -> u8 {
        let rotation = vehicle.pose.rotation();
        let (left, up) = (rotation * Vec3::Y, rotation * Vec3::Z);
        let roll_rad = left.z.abs().atan2(up.z);
        let id = vehicle.actor_id.0;
        if roll_rad < RECOVERED_RAD {
            self.since_nanos.remove(&id);
        } else if roll_rad > OVER_RAD {
            self.since_nanos.entry(id).or_insert(now_nanos);
        }
        let since = self.since_nanos.get(&id);
        let is_over = since.is_some_and(|since| now_nanos.saturating_sub(*since) >= DELAY_NANOS);
        if is_over { ROLLOVER } else { NONE }
    }
}

#[cfg(test)]
mod tests {
    use client_lib::Pose;
    use glam::Quat;

    use super::*;

    #[test]
    fn a_vehicle_on_its_roof_reports_it_after_five_seconds_until_it_stands_again() {
        let mut rollovers = Rollovers::default();
        let mut at = |roll_deg: f32, secs: u64| {
            let turn = Quat::from_rotation_z(0.7) * Quat::from_rotation_x(roll_deg.to_radians());
            let pose = Pose::new(Vec3::ZERO, turn);
            let vehicle = ActorState { pose, ..ActorState::default() };
            rollovers.failure_of(&vehicle, secs * 1_000_000_000)
        };
        let steps = [
            (0.0, 0),
            (150.0, 10),
            (175.0, 20),
            (180.0, 24),
            (180.0, 25),
            (-60.0, 26),
            (-10.0, 27),
        ];
        let failures: Vec<u8> = steps.iter().map(|(roll, secs)| at(*roll, *secs)).collect();
        assert_eq!(failures, [0, 0, 0, 0, 1, 1, 0]);
        assert_eq!(at(-170.0, 40), NONE);
        assert_eq!(at(-170.0, 45), ROLLOVER);
    }
}
