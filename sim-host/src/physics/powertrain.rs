//! Engines, motors and gearboxes from a few numbers.

use super::model::{Class, EngineModel, GearModel, GearboxModel};

pub(super) const RPM_PER_RADPS: f32 = 60.0 / std::f32::consts::TAU;

/// Torque of a combustion engine as a fraction of its largest one, over its speed as a fraction of
/// the highest one.
const SHAPE: [(f32, f32); 6] =
    [(0.0, 0.5), (0.17, 0.7), (0.35, 0.95), (0.55, 1.0), (0.8, 0.95), (1.0, 0.8)];

/// Shift points of an automatic gearbox at half throttle.
const MIDDLE: GearModel = GearModel { ratio: 1.0, down: 0.33, up: 0.66 };

/// Returns a combustion engine with this largest torque.
fn combustion(peak_nm: f32, max_rpm: f32, idle_rpm: f32) -> EngineModel {
    let damping_nmsprad = 0.1 * peak_nm / (max_rpm * 0.105);
    EngineModel {
        torque_curve: SHAPE.map(|(rpm, torque)| [rpm * max_rpm, torque * peak_nm]).to_vec(),
        max_rpm,
        idle_rpm,
        inertia_kgm2: 0.0006 * peak_nm,
        drag_nm: 0.06 * peak_nm,
        damping_full_nmsprad: 0.0,
        damping_geared_nmsprad: damping_nmsprad,
        damping_neutral_nmsprad: damping_nmsprad,
    }
}

/// Returns a combustion engine with this power at its highest speed.
pub(super) fn combustion_of_power(power_w: f32, max_rpm: f32, idle_rpm: f32) -> EngineModel {
    let (_, last) = SHAPE[SHAPE.len() - 1];
    combustion(power_w * RPM_PER_RADPS / max_rpm / last, max_rpm, idle_rpm)
}

/// Returns an electric motor: constant torque up to `base_rpm`, then constant power.
pub(super) fn electric(power_w: f32, base_rpm: f32, max_rpm: f32) -> EngineModel {
    const POINTS: i32 = 12;
    let peak_nm = power_w * RPM_PER_RADPS / base_rpm;
    let step = (max_rpm / base_rpm).powf(1.0 / POINTS as f32);
    let point = |i: i32| [base_rpm * step.powi(i), peak_nm * step.powi(-i)];
    let damping_nmsprad = 0.02 * peak_nm / (max_rpm * 0.105);
    EngineModel {
        torque_curve: std::iter::once([0.0, peak_nm]).chain((0..=POINTS).map(point)).collect(),
        max_rpm,
        idle_rpm: 0.0,
        inertia_kgm2: 1e-4 * peak_nm,
        drag_nm: 0.02 * peak_nm,
        damping_full_nmsprad: 0.0,
        damping_geared_nmsprad: damping_nmsprad,
        damping_neutral_nmsprad: damping_nmsprad,
    }
}

/// Returns an automatic gearbox.
pub(super) fn gearbox(
    forward: &[f32],
    reverse: f32,
    final_drive: f32,
    shift_s: f32,
    peak_nm: f32,
) -> GearboxModel {
    GearboxModel {
        automatic: true,
        forward: forward.iter().map(|ratio| GearModel { ratio: *ratio, ..MIDDLE }).collect(),
        reverse,
        final_drive,
        shift_s,
        clutch_nm: 1.8 * peak_nm,
        efficiency: 0.92,
    }
}

/// Returns the typical powertrain of a class.
pub(super) fn typical(class: Class, mass_kg: f32, radius_m: f32) -> (EngineModel, GearboxModel) {
    match class {
        Class::Car => {
            let peak = 0.175 * mass_kg;
            let forward = [3.2, 1.95, 1.35, 1.0, 0.8, 0.66];
            let gears = gearbox(&forward, 3.2, 11.2 * radius_m, 0.25, peak);
            (combustion(peak, 6200.0, 800.0), gears)
        }
        Class::Van => {
            let peak = 0.14 * mass_kg;
            let forward = [3.8, 2.1, 1.35, 1.0, 0.78, 0.65];
            let gears = gearbox(&forward, 3.8, 11.2 * radius_m, 0.3, peak);
            (combustion(peak, 4600.0, 800.0), gears)
        }
        Class::Truck | Class::Bus => {
            let peak = 0.11 * mass_kg;
            let forward = [6.7, 3.9, 2.4, 1.6, 1.2, 1.0];
            let gears = gearbox(&forward, 6.7, 9.0 * radius_m, 0.4, peak);
            (combustion(peak, 2500.0, 600.0), gears)
        }
        Class::Motorcycle => {
            // More torque would lift the front wheel at full throttle.
            let peak = 0.13 * mass_kg;
            let forward = [2.6, 1.9, 1.5, 1.25, 1.1, 1.0];
            let gears = gearbox(&forward, 2.6, 18.0 * radius_m, 0.15, peak);
            (combustion(peak, 9500.0, 1200.0), gears)
        }
        Class::Bicycle => {
            // A rider with low gears climbs a slope of 40 % at walking speed; at high speed the
            // power is about 350 W.
            let top_rpm = 12.0 / radius_m * 9.55;
            let pedals = |share: f32| {
                let torque = (350.0 / (12.0 * share)).min(470.0) * radius_m;
                [share * top_rpm, torque]
            };
            let engine = EngineModel {
                torque_curve: [0.05, 0.2, 0.35, 0.5, 0.75, 1.0].map(pedals).to_vec(),
                max_rpm: top_rpm,
                idle_rpm: 0.0,
                inertia_kgm2: 0.01,
                drag_nm: 0.0,
                damping_full_nmsprad: 0.0,
                damping_geared_nmsprad: 0.0,
                damping_neutral_nmsprad: 0.0,
            };
            (engine, gearbox(&[1.0], 1.0, 1.0, 0.0, 1000.0))
        }
    }
}
