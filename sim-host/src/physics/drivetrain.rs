//! The drivetrain: engine, clutch and gearbox.
//!
//! The clutch is either *locked*, and the engine's inertia rotates with the wheels, or it *slips*
//! and transmits limited torque; it locks when both sides have the same speed. An electric motor
//! has no clutch and is always locked.

use serde::{Deserialize, Serialize};

use super::model::{GearModel, VehicleModel};

const RPM_PER_RADPS: f32 = 60.0 / std::f32::consts::TAU;
/// The clutch may lock below this speed difference. Radians per second.
const LOCK_WITHIN_RADPS: f32 = 6.0;
/// Shortest time between two shifts.
const SHIFT_PAUSE_S: f32 = 0.6;
/// Above this speed the gearbox does not change between forward and reverse.
const REVERSE_BELOW_MPS: f32 = 1.5;

/// The driver's inputs to the drivetrain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    /// From 0 to 1.
    pub throttle: f32,
    pub reverse: bool,
    /// The gear selected by a manual shift; `None` for automatic.
    pub manual: Option<i32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Drivetrain {
    pub engine_radps: f32,
    /// −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// The gear that is engaged at the end of the shift in progress.
    pub next_gear: i32,
    shift_left_s: f32,
    since_shift_s: f32,
    locked: bool,
    throttle: f32,
}

/// The effect of the drivetrain on the driven wheels in one sub-iteration, before their shares: the
/// torque `torque_nm − damping_nmsprad * wheel speed`, and the inertia that rotates with them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drive {
    pub torque_nm: f32,
    pub damping_nmsprad: f32,
    pub inertia_kgm2: f32,
    /// By how much the engine turns faster than the wheels drive the gearbox; 0 while the clutch does not slip.
    pub slip_radps: f32,
}

impl Drivetrain {
    pub(super) fn new(model: &VehicleModel) -> Drivetrain {
        Drivetrain {
            engine_radps: model.engine.idle_rpm / RPM_PER_RADPS,
            gear: 1,
            next_gear: 1,
            shift_left_s: 0.0,
            since_shift_s: SHIFT_PAUSE_S,
            locked: model.engine.idle_rpm == 0.0,
            throttle: 0.0,
        }
    }

    /// Returns the gear that is engaged, or will be at the end of the shift in progress.
    pub(super) fn reported_gear(&self) -> i32 {
        self.next_gear
    }

    pub(super) fn rpm(&self) -> f32 {
        self.engine_radps.abs() * RPM_PER_RADPS
    }

    /// Returns engine revolutions per wheel revolution; negative in reverse, 0 in neutral.
    fn ratio(&self, model: &VehicleModel) -> f32 {
        let gearbox = &model.gearbox;
        let gear = match self.gear {
            0 => 0.0,
            -1 => -gearbox.reverse,
            n => gearbox.forward.get(n as usize - 1).map_or(0.0, |gear| gear.ratio),
        };
        gear * gearbox.final_drive
    }

    /// Selects the gear; called once per substep. `wheel_radps` is the mean speed of the driven
    /// wheels.
    pub(super) fn shift(
        &mut self,
        model: &VehicleModel,
        demand: Demand,
        wheel_radps: f32,
        speed_mps: f32,
        dt: f32,
    ) {
        let top = model.gearbox.forward.len() as i32;
        self.since_shift_s += dt;
        let target_gear = match demand.manual {
            Some(gear) => gear.clamp(-1, top),
            None => self.automatic(model, demand, wheel_radps, speed_mps, top),
        };
        if target_gear != self.next_gear {
            // A change from neutral, or between forward and reverse at standstill, takes no time.
            let immediate = self.next_gear * target_gear <= 0;
            self.next_gear = target_gear;
            self.shift_left_s = if immediate { 0.0 } else { model.gearbox.shift_s };
            self.since_shift_s = 0.0;
            if self.shift_left_s > 0.0 {
                self.gear = 0;
            }
        }
        if self.gear != self.next_gear {
            self.shift_left_s -= dt;
            if self.shift_left_s <= 0.0 {
                self.gear = self.next_gear;
                self.locked = model.engine.idle_rpm == 0.0;
            }
        }
        // With reverse requested while rolling forward, there is no torque until the vehicle stops.
        let reverses = demand.manual.is_none() && demand.reverse != (self.next_gear < 0);
        self.throttle = if reverses { 0.0 } else { demand.throttle };
    }

    fn automatic(
        &self,
        model: &VehicleModel,
        demand: Demand,
        wheel_radps: f32,
        speed_mps: f32,
        top: i32,
    ) -> i32 {
        let gear = self.next_gear.min(top);
        if demand.reverse {
            return if gear < 0 || speed_mps < REVERSE_BELOW_MPS { -1 } else { gear };
        }
        if gear < 1 {
            return if gear == 0 || speed_mps > -REVERSE_BELOW_MPS { 1 } else { gear };
        }
        if self.since_shift_s < SHIFT_PAUSE_S || !model.gearbox.automatic {
            return gear;
        }
        let (engine, gearbox) = (&model.engine, &model.gearbox);
        let rpm_in = |gear: i32| {
            wheel_radps.max(0.0)
                * gearbox.forward[gear as usize - 1].ratio
                * gearbox.final_drive
                * RPM_PER_RADPS
        };
        let GearModel { down, up, .. } = gearbox.forward[gear as usize - 1];
        let more = demand.throttle - 0.5;
        let up_rpm = engine.max_rpm * (up + 0.48 * more);
        let down_rpm = (engine.max_rpm * (down + 0.30 * more)).max(1.2 * engine.idle_rpm);
        if gear < top && rpm_in(gear) > up_rpm {
            gear + 1
        } else if gear > 1 && rpm_in(gear) < down_rpm {
            gear - 1
        } else {
            gear
        }
    }

    /// Returns the fraction of idle speed below which the clutch opens. Without throttle it opens at
    /// idle speed, before the idle governor would drive the wheels against the brake.
    fn release_share(&self) -> f32 {
        if self.throttle > 0.0 { 0.75 } else { 1.0 }
    }

    fn engine_nm(&self, model: &VehicleModel) -> f32 {
        let engine = &model.engine;
        let rpm = self.engine_radps * RPM_PER_RADPS;
        let mut throttle = self.throttle;
        if rpm > engine.max_rpm {
            throttle = 0.0;
        } else if engine.idle_rpm > 0.0 && rpm < engine.idle_rpm {
            // The idle governor opens the throttle. Motors and riders have none: they stand with the
            // wheels.
            throttle = throttle.max(((engine.idle_rpm - rpm) / engine.idle_rpm * 4.0).min(1.0));
        }
        let closed = 1.0 - throttle;
        let closed_damping = if self.gear == 0 {
            engine.damping_neutral_nmsprad
        } else {
            engine.damping_geared_nmsprad
        };
        let damping = throttle * engine.damping_full_nmsprad + closed * closed_damping;
        let drag = closed * engine.drag_nm * (self.engine_radps * 0.1).clamp(-1.0, 1.0)
            + damping * self.engine_radps;
        let torque = if throttle > 0.0 { throttle * engine.torque_nm(rpm.abs()) } else { 0.0 };
        torque - drag
    }

    /// Computes the effect on the wheels; called once per sub-iteration before the wheels move.
    pub(super) fn drive(&mut self, model: &VehicleModel, wheel_radps: f32, dt: f32) -> Drive {
        let ratio = self.ratio(model);
        let engine = &model.engine;
        let torque = self.engine_nm(model);
        if ratio == 0.0 {
            self.engine_radps += dt * torque / engine.inertia_kgm2;
            return Drive::default();
        }
        let input_radps = ratio * wheel_radps;
        let idle_radps = engine.idle_rpm / RPM_PER_RADPS;
        if self.locked && idle_radps > 0.0 && input_radps < self.release_share() * idle_radps {
            self.locked = false;
        }
        let efficiency = model.gearbox.efficiency;
        if self.locked {
            let lost = if torque > 0.0 { efficiency } else { 1.0 };
            return Drive {
                torque_nm: torque * ratio * lost,
                inertia_kgm2: engine.inertia_kgm2 * ratio * ratio,
                ..Drive::default()
            };
        }
        // The clutch engages as the engine speed rises above idle.
        let engagement =
            ((self.engine_radps - 1.05 * idle_radps) / (0.9 * idle_radps)).clamp(0.0, 1.0);
        let carried = model.gearbox.clutch_nm * engagement * engagement;
        let slip = self.engine_radps - input_radps;
        let lost = if slip > 0.0 { efficiency } else { 1.0 };
        let stiffness_nms = carried / slip.abs().max(LOCK_WITHIN_RADPS);
        let clutch = stiffness_nms * slip;
        // The clutch torque falls as the wheels approach engine speed; half of that reduction acts
        // within this step. Otherwise a strong clutch in a low gear would make the wheel speed
        // oscillate around its target.
        let gradient =
            if slip.abs() < LOCK_WITHIN_RADPS { stiffness_nms } else { 0.5 * stiffness_nms };
        let drive = Drive {
            torque_nm: (clutch + gradient * input_radps) * ratio * lost,
            damping_nmsprad: gradient * ratio * ratio * lost,
            inertia_kgm2: 0.0,
            slip_radps: slip,
        };
        // Implicit in engine speed, for the same reason.
        let stiffness = if slip.abs() < LOCK_WITHIN_RADPS { stiffness_nms } else { 0.0 };
        self.engine_radps += dt * (torque - clutch) / (engine.inertia_kgm2 + dt * stiffness);
        drive
    }

    /// Computes the effect on wheels that roll at `wheel_radps`, with the engine and the clutch in a
    /// steady state. The engine continues from it.
    pub(super) fn steady(&mut self, model: &VehicleModel, wheel_radps: f32) -> Drive {
        let ratio = self.ratio(model);
        let engine = &model.engine;
        let idle_radps = engine.idle_rpm / RPM_PER_RADPS;
        if ratio == 0.0 {
            self.engine_radps = self.engine_radps.max(idle_radps);
            return Drive::default();
        }
        let input_radps = ratio * wheel_radps;
        self.locked = idle_radps == 0.0 || input_radps >= self.release_share() * idle_radps;
        let efficiency = model.gearbox.efficiency;
        if self.locked {
            self.engine_radps = input_radps;
            let torque = self.engine_nm(model);
            let lost = if torque > 0.0 { efficiency } else { 1.0 };
            let inertia_kgm2 = engine.inertia_kgm2 * ratio * ratio;
            return Drive { torque_nm: torque * ratio * lost, inertia_kgm2, ..Drive::default() };
        }
        if self.throttle == 0.0 {
            self.engine_radps = idle_radps;
            return Drive::default();
        }
        // The engine rises to the speed at which the slipping clutch carries its torque.
        let clutch_nm = model.gearbox.clutch_nm.max(1.0);
        let full_nm = self.throttle * engine.torque_nm(1.5 * engine.idle_rpm);
        let engagement = (full_nm / clutch_nm).min(1.0).sqrt();
        self.engine_radps = idle_radps * (1.05 + 0.9 * engagement);
        let torque = self.engine_nm(model).clamp(0.0, clutch_nm);
        Drive { torque_nm: torque * ratio * efficiency, ..Drive::default() }
    }

    /// Locks the clutch or slips it; called once per sub-iteration after the wheels moved. `before` is the effect
    /// that they moved under.
    ///
    /// The clutch locks where its slip changes its sign too: a strong one in a low gear would else drive the
    /// wheels and hold them back in turns, and never lock.
    pub(super) fn update_clutch(&mut self, model: &VehicleModel, before: &Drive, wheel_radps: f32) {
        let ratio = self.ratio(model);
        if ratio == 0.0 {
            return;
        }
        let input_radps = ratio * wheel_radps;
        let idle_radps = model.engine.idle_rpm / RPM_PER_RADPS;
        let slip = self.engine_radps - input_radps;
        if !self.locked
            && (slip.abs() < LOCK_WITHIN_RADPS || slip * before.slip_radps < 0.0)
            && input_radps > (self.release_share() + 0.15) * idle_radps
        {
            self.locked = true;
        }
        if self.locked {
            self.engine_radps = input_radps;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two wheels of 1.5 kg m², which a tyre holds at 8 rad/s with 250 N m per rad/s.
    #[test]
    fn a_strong_clutch_locks_in_a_low_gear() {
        let blueprint = town::blueprint("vehicle.dodge.charger_police_2020").expect("a vehicle").1;
        let model = VehicleModel::of(blueprint);
        let (inertia_kgm2, tyre_nms, ground_radps, dt) = (3.0, 250.0, 8.0, 0.0025);
        for above_radps in [10.0, 20.0, 40.0, 80.0] {
            let mut drivetrain = Drivetrain::new(&model);
            let mut wheel_radps = ground_radps;
            drivetrain.engine_radps = drivetrain.ratio(&model) * wheel_radps + above_radps;
            let mut slips_s = 0.0;
            while !drivetrain.locked && slips_s < 1.0 {
                let drive = drivetrain.drive(&model, wheel_radps, dt);
                let pull_nm = drive.torque_nm + tyre_nms * ground_radps;
                let held_nms = drive.damping_nmsprad + tyre_nms;
                wheel_radps =
                    (inertia_kgm2 * wheel_radps + pull_nm * dt) / (inertia_kgm2 + held_nms * dt);
                drivetrain.update_clutch(&model, &drive, wheel_radps);
                slips_s += dt;
            }
            println!("{above_radps} rad/s: {slips_s} s");
            assert!(slips_s < 0.2, "it slips for {slips_s} s from {above_radps} rad/s on");
        }
    }
}
