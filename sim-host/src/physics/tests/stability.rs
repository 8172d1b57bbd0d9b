//! Steady-state circles, anti-lock brakes, stability control, and the lean of two-wheelers.

use std::sync::Arc;

use glam::{Quat, Vec3};
use protocol::ActorId;

use super::{Ground, Lone};
use crate::physics::{Class, VehicleModel};

fn on_flat(model: VehicleModel, mps: f32) -> Lone {
    let mut lone = Lone::new(Arc::new(Ground::flat(0.0)), model);
    lone.run(1.0);
    lone.physics.set_velocity(ActorId(1), Vec3::X * mps, Vec3::ZERO).unwrap();
    lone
}

fn model_of(id: &str) -> VehicleModel {
    VehicleModel::of(town::blueprint(id).unwrap().1)
}

fn vehicles() -> impl Iterator<Item = (&'static str, VehicleModel)> {
    let all = town::catalogue().iter().filter(|one| one.kind == town::Kind::Vehicle);
    all.map(|one| (one.id, VehicleModel::of(one)))
}

/// Returns the slip angle of a vehicle at its origin.
fn slip_rad(lone: &Lone) -> f32 {
    let velocity = lone.rotation().inverse() * lone.state().velocity();
    velocity.y.atan2(velocity.x.abs().max(0.5))
}

/// Returns the steering angle and the lateral acceleration at which a vehicle follows a circle of
/// 60 m at a steady speed.
fn circle(model: &VehicleModel, mps: f32) -> (f32, f32) {
    const RADIUS_M: f32 = 60.0;
    let mut lone = on_flat(model.clone(), mps);
    let (mut sums, mut push) = ([0.0; 2], 0.0);
    lone.control.steer = 0.1;
    for frame in 0..600 {
        let state = lone.state();
        let speed = lone.speed();
        let curvature = state.angular_velocity_radps[2] / speed.max(1.0);
        lone.control.steer += (1.0 / RADIUS_M - curvature) * 0.8;
        push = f32::clamp(push + 0.01 * (mps - speed), 0.0, 1.0);
        lone.control.throttle = (push + 0.2 * (mps - speed)).clamp(0.0, 1.0);
        lone.frame();
        if frame >= 400 {
            sums[0] += lone.state().wheel_steer_rad / 200.0;
            sums[1] += lone.speed() * lone.state().angular_velocity_radps[2] / 200.0;
        }
    }
    (sums[0], sums[1])
}

/// Returns the understeer gradient between 1 and 4 m/s² (ISO 4138, constant radius). Degrees per g.
fn understeer(model: VehicleModel) -> f32 {
    let ((slow, low), (fast, high)) = (circle(&model, 7.75), circle(&model, 15.5));
    ((fast - slow) / (high - low) * 9.81).to_degrees()
}

#[test]
fn every_car_understeers_by_1_to_3_degrees_per_g() {
    for one in town::catalogue().iter().filter(|one| one.kind == town::Kind::Vehicle) {
        if !matches!(one.base_type, "car" | "van") {
            continue;
        }
        let gradient = understeer(VehicleModel::of(one));
        println!("{}: {gradient:.2} degrees per g", one.id);
        assert!((1.0..=3.0).contains(&gradient), "{}: {gradient} degrees per g", one.id);
    }
}

/// Returns the largest slip angle in four seconds of constant steering from 80 km/h.
fn worst_slip_deg(model: VehicleModel, steer: f32) -> f32 {
    let mut lone = on_flat(model, 80.0 / 3.6);
    // The gearbox shifts up.
    lone.control.throttle = 0.3;
    lone.run(4.0);
    let ahead = lone.rotation() * Vec3::X;
    lone.physics.set_velocity(ActorId(1), ahead * 80.0 / 3.6, Vec3::ZERO).unwrap();
    lone.control.steer = steer;
    let mut most = 0.0f32;
    for _ in 0..80 {
        lone.frame();
        if lone.speed() > 5.0 {
            most = most.max(slip_rad(&lone).abs().to_degrees());
        }
    }
    most
}

#[test]
fn stability_control_prevents_a_spin() {
    let mut bad = Vec::new();
    for (id, model) in vehicles().filter(|(_, model)| model.stability_control) {
        for steer in [0.25, -0.25, 0.5] {
            let without = VehicleModel { stability_control: false, ..model.clone() };
            let without = worst_slip_deg(without, steer);
            let with = worst_slip_deg(model.clone(), steer);
            println!("{id}, steer {steer}: slip {with:.1} degrees, without {without:.1}");
            if with >= 12.0 {
                bad.push(format!("{id}, steer {steer}: slip {with} degrees"));
            }
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}

/// Swerves at 100 km/h, to one side and back, with the throttle closed, on rear tyres that are worn.
fn worst_swerve_deg(stability_control: bool) -> f32 {
    let mut model = VehicleModel { stability_control, ..model_of("vehicle.tesla.model3") };
    for wheel in model.wheels.iter_mut().filter(|wheel| !wheel.steered) {
        wheel.grip = 0.8;
    }
    let mut lone = on_flat(model, 100.0 / 3.6);
    let mut most = 0.0f32;
    for frame in 0..100 {
        lone.control.steer = [0.4, -0.4, 0.0, 0.0, 0.0][(frame / 16).min(4)];
        lone.frame();
        if lone.speed() > 5.0 {
            most = most.max(slip_rad(&lone).abs().to_degrees());
        }
    }
    most
}

#[test]
fn a_car_with_worn_rear_tyres_spins_without_stability_control_only() {
    let (with, without) = (worst_swerve_deg(true), worst_swerve_deg(false));
    println!("swerve: slip {with:.1} degrees, without control {without:.1}");
    assert!(with < 15.0, "{with} degrees with stability control");
    assert!(without > 45.0, "{without} degrees without");
}

/// Brakes fully from 100 km/h while steering; returns metres driven, metres to the left, and
/// whether a wheel locked above 3 m/s.
fn full_stop(model: VehicleModel, steer: f32) -> (f32, f32, bool) {
    let wheels = model.wheels.len();
    let mut lone = on_flat(model, 100.0 / 3.6);
    (lone.control.brake, lone.control.steer) = (1.0, steer);
    let mut locked = false;
    while lone.speed() > 0.05 {
        lone.frame();
        if lone.speed() > 3.0 {
            locked |= (0..wheels as u32).any(|wheel| {
                let wheel = lone.physics.wheel_telemetry(ActorId(1), wheel).unwrap();
                wheel.spin_radps.abs() < 0.1 && wheel.load_n > 50.0
            });
        }
        assert!(lone.seconds < 40.0);
    }
    (lone.position().length(), lone.position().y, locked)
}

#[test]
fn anti_lock_brakes_keep_wheels_turning_and_the_car_steerable() {
    // Brakes with which a driver locks the wheels.
    let strong = |abs: bool| {
        let mut model = model_of("vehicle.tesla.model3");
        model.wheels.iter_mut().for_each(|wheel| wheel.brake_torque_nm *= 1.6);
        VehicleModel { abs, stability_control: false, ..model }
    };
    let (with, _, turning) = full_stop(strong(true), 0.0);
    let (without, _, locked) = full_stop(strong(false), 0.0);
    println!("stop with anti-lock brakes {with:.1} m, without {without:.1} m");
    assert!(!turning, "a wheel locked with anti-lock brakes");
    assert!(locked, "no wheel locked without anti-lock brakes");
    assert!(with <= without, "{with} m with anti-lock brakes, {without} m without");
    let (_, aside, _) = full_stop(strong(true), 0.2);
    let (_, straight, _) = full_stop(strong(false), 0.2);
    println!("aside with anti-lock brakes {aside:.1} m, without {straight:.1} m");
    assert!(aside > 5.0 && aside > 3.0 * straight.abs(), "{aside} m, {straight} m");
}

#[test]
fn every_vehicle_with_anti_lock_brakes_stops_without_locking() {
    for (id, model) in vehicles().filter(|(_, model)| model.abs) {
        let (_, _, locked) = full_stop(model, 0.0);
        assert!(!locked, "{id} locks a wheel");
    }
}

/// Brakes as hard as traffic does in a swerve to one side and back. Returns the largest slip angle, and the deviation
/// of the final heading from the first, in degrees.
fn braked_swerve_deg(model: VehicleModel) -> (f32, f32) {
    let mut lone = on_flat(model, 20.0);
    lone.control.brake = 0.8;
    let mut most = 0.0f32;
    for frame in 0..60 {
        lone.control.steer = [0.012, -0.012, 0.0][(frame / 8).min(2)];
        lone.frame();
        if lone.speed() > 3.0 {
            most = most.max(slip_rad(&lone).abs().to_degrees());
        }
    }
    let ahead = lone.rotation() * Vec3::X;
    (most, ahead.y.atan2(ahead.x).abs().to_degrees())
}

#[test]
fn a_motorcycle_that_brakes_hard_does_not_slide() {
    let mut bad = Vec::new();
    for (id, model) in vehicles().filter(|(_, model)| model.class == Class::Motorcycle) {
        let (slip, turned) = braked_swerve_deg(model);
        println!("{id}: slip {slip:.1} degrees, turned by {turned:.1}");
        if slip > 5.0 || turned > 10.0 {
            bad.push(format!("{id}: slip {slip} degrees, turned by {turned}"));
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}

#[test]
fn a_two_wheeler_leans_no_further_than_its_tyres_hold() {
    for (id, model) in vehicles().filter(|(_, model)| model.lean.is_some()) {
        let grip = model.wheels.iter().map(|w| w.tyre.grip_y).fold(9.0, f32::min);
        for factor in [1.0, 0.5, 0.2] {
            for steer in [1.0, -0.4] {
                let mut lone = Lone::new(Arc::new(Ground::flat(0.0)), model.clone());
                lone.physics.set_grip(factor);
                lone.run(1.0);
                let pace = if model.class == Class::Bicycle { 7.0 } else { 18.0 };
                lone.physics.set_velocity(ActorId(1), Vec3::X * pace, Vec3::ZERO).unwrap();
                lone.control.steer = steer;
                let mut most = 0.0f32;
                for _ in 0..80 {
                    lone.frame();
                    most = most.max(roll_rad(lone.rotation()).abs());
                }
                let limit = (grip * factor).atan();
                let (most, limit) = (most.to_degrees(), limit.to_degrees());
                println!("{id}, friction {factor}: leans {most:.1} of {limit:.1} degrees");
                assert!(most <= limit, "{id}, friction {factor}: {most} degrees, not {limit}");
                assert!(factor < 1.0 || most > 0.3 * limit, "{id} hardly leans: {most} degrees");
            }
        }
    }
}

fn roll_rad(rotation: Quat) -> f32 {
    (rotation * Vec3::Y).z.asin()
}
