//! Telemetry of a vehicle: values that snapshots do not hold.

use glam::Vec3;
use protocol::{VehicleTelemetry, WheelTelemetry};

use super::{
    aerodynamics::add_aerodynamic_forces,
    motion::{Motion, Wrench},
    vehicle::Vehicle,
};

/// Below this speed, slip is computed as at this speed.
const SLIP_BELOW_MPS: f32 = 0.5;

impl Vehicle {
    pub(super) fn telemetry(&self, motion: &Motion) -> VehicleTelemetry {
        let mut wrench = Wrench::default();
        add_aerodynamic_forces(&self.prepared.model, motion, &mut wrench);
        let pedals = self.state.control;
        let speed = motion.velocity_mps.length().max(1e-6);
        VehicleTelemetry {
            wheels: self.own.wheels.len() as u32,
            gear: self.state.drivetrain.reported_gear(),
            speed_mps: motion.velocity_mps.dot(motion.axes.x_axis),
            steer: pedals.steer,
            throttle: pedals.throttle,
            brake: pedals.brake,
            engine_rpm: self.state.drivetrain.rpm(),
            drag_n: -wrench.force_n.dot(motion.velocity_mps / speed),
        }
    }

    /// Returns the mean circumferential speed of all wheels, forwards.
    pub(super) fn wheel_speed_mps(&self) -> Option<f32> {
        let wheels = &self.prepared.model.wheels;
        let rims = self.prepared.order.iter().enumerate().map(|(place, index)| {
            let bank = self.state.banks.get(place / 4);
            let spin = bank.map_or(0.0, |bank| bank.spin_radps.to_array()[place % 4]);
            spin * wheels.get(*index).map_or(0.0, |wheel| wheel.radius_m)
        });
        (!wheels.is_empty()).then(|| rims.sum::<f32>() / wheels.len() as f32)
    }

    pub(super) fn wheel_telemetry(&self, index: usize, motion: &Motion) -> Option<WheelTelemetry> {
        let wheel = self.prepared.model.wheels.get(index)?;
        let place = self.prepared.order.iter().position(|i| *i == index)?;
        let (state, lane) = (self.state.banks.get(place / 4)?, place % 4);
        let of = |lanes: wide::f32x4| lanes.to_array()[lane];
        let heading = self.prepared.heading(wheel, self.state.wheel_steer_rad());
        let arm = motion.axes * (wheel.hub_m - self.prepared.model.com_m);
        let velocity = motion.axes.transpose() * motion.velocity_at(arm);
        let along_mps = velocity.dot(heading);
        let across_mps = velocity.dot(Vec3::Z.cross(heading));
        let spin_radps = of(state.spin_radps);
        let ground_mps = along_mps.abs().max(SLIP_BELOW_MPS);
        let is_loaded = of(state.load_n) > 0.0;
        let loaded = |value: f32| if is_loaded { value } else { 0.0 };
        Some(WheelTelemetry {
            grip: wheel.grip,
            slip_y_rad: loaded(across_mps.atan2(ground_mps)),
            slip_x: loaded((spin_radps * wheel.radius_m - along_mps) / ground_mps),
            spin_radps,
            load_n: of(state.load_n),
            rest_load_n: wheel.static_load_n,
            torque_nm: of(state.torque_nm),
            along_n: loaded(of(state.along_n)),
            across_n: loaded(of(state.across_n)),
            steer_rad: heading.y.atan2(heading.x),
        })
    }
}
