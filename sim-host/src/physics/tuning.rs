//! Vehicle parameters that clients can change: conversion to and from a model.

use bytemuck::{Pod, bytes_of};
use glam::Vec3;
use protocol::{
    Curve, Gear, VehicleBody, VehicleEngine, VehicleGearbox, VehiclePhysics, VehicleSteering,
    VehicleWheel,
};

use super::{
    classes::loads,
    model::{GearModel, VehicleModel},
};

/// Returns the parameters of an unchanged model.
pub(super) fn physics_of(model: &VehicleModel) -> VehiclePhysics {
    let engine = &model.engine;
    let gearbox = &model.gearbox;
    let gears: Vec<Gear> = gearbox
        .forward
        .iter()
        .map(|gear| Gear { ratio: gear.ratio, down: gear.down, up: gear.up })
        .collect();
    let curve = |pairs: &[[f32; 2]]| Curve::new(pairs).expect("a model's curves fit");
    let wheels = model.wheels.iter().zip(0..).map(|(wheel, index)| VehicleWheel {
        index,
        hub_m: wheel.hub_m.to_array(),
        grip: wheel.grip,
        damping_nmsprad: wheel.damping_nmsprad,
        steer_max_rad: if wheel.steered { model.steer_max_rad * wheel.steer_share } else { 0.0 },
        radius_m: wheel.radius_m,
        brake_torque_nm: wheel.brake_torque_nm,
        handbrake_torque_nm: wheel.handbrake_torque_nm,
        stiff_load: wheel.tyre.stiff_load,
        stiffness_y: wheel.tyre.stiffness_y,
        stiffness_x: wheel.tyre.stiffness_x,
        ..VehicleWheel::default()
    });
    VehiclePhysics {
        body: VehicleBody {
            wheels: model.wheels.len() as u32,
            mass_kg: model.mass_kg,
            drag_coefficient: model.drag_coefficient,
            abs: model.abs.into(),
            stability_control: model.stability_control.into(),
            ..VehicleBody::default()
        },
        engine: VehicleEngine {
            max_rpm: engine.max_rpm,
            inertia_kgm2: engine.inertia_kgm2,
            damping_full_nmsprad: engine.damping_full_nmsprad,
            damping_geared_nmsprad: engine.damping_geared_nmsprad,
            damping_neutral_nmsprad: engine.damping_neutral_nmsprad,
            torque: curve(&engine.torque_curve),
            ..VehicleEngine::default()
        },
        gearbox: VehicleGearbox {
            automatic: gearbox.automatic.into(),
            shift_s: gearbox.shift_s,
            clutch_nm: gearbox.clutch_nm,
            final_drive: gearbox.final_drive,
            ..VehicleGearbox::default()
        }
        .with_gears(&gears)
        .expect("a model's gears fit"),
        steering: VehicleSteering {
            share: curve(&model.steer_curve),
            ..VehicleSteering::default()
        },
        wheels: wheels.collect(),
    }
}

/// Returns the model that a blueprint's own model and a client's parameters give.
pub(super) fn tuned_model(own: &VehicleModel, by: &VehiclePhysics) -> VehicleModel {
    let mut model = own.clone();
    let heavier = by.body.mass_kg / own.mass_kg;
    model.mass_kg = by.body.mass_kg;
    model.inertia_kgm2 = own.inertia_kgm2 * heavier;
    model.com_m = own.com_m + Vec3::from_array(by.body.center_of_mass_m);
    model.drag_coefficient = by.body.drag_coefficient;
    model.abs = by.body.abs != 0;
    model.stability_control = by.body.stability_control != 0;

    model.engine.max_rpm = by.engine.max_rpm;
    model.engine.idle_rpm = own.engine.idle_rpm.min(0.5 * by.engine.max_rpm);
    model.engine.inertia_kgm2 = by.engine.inertia_kgm2;
    model.engine.damping_full_nmsprad = by.engine.damping_full_nmsprad;
    model.engine.damping_geared_nmsprad = by.engine.damping_geared_nmsprad;
    model.engine.damping_neutral_nmsprad = by.engine.damping_neutral_nmsprad;
    model.engine.torque_curve = by.engine.torque.pairs().to_vec();

    model.gearbox.automatic = by.gearbox.automatic != 0;
    model.gearbox.shift_s = by.gearbox.shift_s;
    model.gearbox.clutch_nm = by.gearbox.clutch_nm;
    model.gearbox.final_drive = by.gearbox.final_drive;
    let gear = |gear: &Gear| GearModel { ratio: gear.ratio, down: gear.down, up: gear.up };
    model.gearbox.forward = by.gearbox.gears().iter().map(gear).collect();

    model.steer_curve = by.steering.share.pairs().to_vec();
    let widest = by.wheels.iter().map(|wheel| wheel.steer_max_rad).fold(0.0, f32::max);
    model.steer_max_rad = widest;

    // Spring rates follow the static load, so that ride height and natural frequency stay the same.
    let hubs: Vec<Vec3> = own.wheels.iter().map(|wheel| wheel.hub_m).collect();
    let before = loads(&hubs, own.com_m, own.mass_kg, 0.0);
    let after = loads(&hubs, model.com_m, model.mass_kg, 0.0);
    for (index, (wheel, by)) in model.wheels.iter_mut().zip(&by.wheels).enumerate() {
        let more = after[index] / before[index];
        wheel.static_load_n *= more;
        wheel.spring_npm *= more;
        wheel.bump_damping_nspm *= more;
        wheel.rebound_damping_nspm *= more;
        wheel.anti_roll_npm *= more;
        wheel.inertia_kgm2 *= (by.radius_m / wheel.radius_m).powi(2);
        wheel.radius_m = by.radius_m;
        wheel.grip = by.grip;
        wheel.damping_nmsprad = by.damping_nmsprad;
        wheel.steered = by.steer_max_rad > 0.0;
        wheel.steer_share = if wheel.steered { by.steer_max_rad / widest } else { 1.0 };
        wheel.brake_torque_nm = by.brake_torque_nm;
        wheel.handbrake_torque_nm = by.handbrake_torque_nm;
        wheel.tyre.stiff_load = by.stiff_load;
        wheel.tyre.stiffness_y = by.stiffness_y;
        wheel.tyre.stiffness_x = by.stiffness_x;
    }
    model
}

/// Returns the bytes for a saved state.
pub(super) fn to_bytes(physics: &VehiclePhysics) -> Vec<u8> {
    let VehiclePhysics { body, engine, gearbox, steering, wheels } = physics;
    let wheels: &[u8] = bytemuck::cast_slice(wheels);
    [bytes_of(body), bytes_of(engine), bytes_of(gearbox), bytes_of(steering), wheels].concat()
}

/// Reads saved bytes; `None` if they are damaged.
pub(super) fn from_bytes(mut bytes: &[u8]) -> Option<VehiclePhysics> {
    let physics = VehiclePhysics {
        body: take(&mut bytes)?,
        engine: take(&mut bytes)?,
        gearbox: take(&mut bytes)?,
        steering: take(&mut bytes)?,
        wheels: bytes
            .chunks_exact(size_of::<VehicleWheel>())
            .map(bytemuck::pod_read_unaligned)
            .collect(),
    };
    physics.check().is_ok().then_some(physics)
}

fn take<T: Pod>(bytes: &mut &[u8]) -> Option<T> {
    let (front, rest) = bytes.split_at_checked(size_of::<T>())?;
    *bytes = rest;
    Some(bytemuck::pod_read_unaligned(front))
}
