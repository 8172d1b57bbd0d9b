use protocol::{AckermannControl, AckermannSettings, ActorId};

use super::Lone;

const ID: ActorId = ActorId(1);

fn aim(lone: &mut Lone, speed_mps: f32, steer_rad: f32) {
    let control =
        AckermannControl { actor_id: ID, speed_mps, steer_rad, ..AckermannControl::default() };
    lone.physics.ackermann(&control).unwrap();
}

fn run(lone: &mut Lone, seconds: f32) {
    for _ in 0..(seconds / 0.05) as usize {
        lone.physics.step(super::FRAME_NANOS, super::SUBSTEP_NANOS);
    }
}

#[test]
fn the_controller_reaches_and_keeps_a_speed_in_both_directions() {
    let mut lone = Lone::sedan();
    for target in [10.0, 4.0, 20.0, -3.0] {
        aim(&mut lone, target, 0.0);
        run(&mut lone, 20.0);
        for _ in 0..100 {
            run(&mut lone, 0.05);
            let speed = lone.state().velocity().x;
            assert!((speed - target).abs() < 0.6, "{speed} m/s, target {target}");
        }
        println!("target {target}: {}", lone.state().velocity().x);
    }
    aim(&mut lone, 0.0, 0.0);
    run(&mut lone, 10.0);
    assert!(lone.speed() < 0.01, "{}", lone.speed());
    assert!(lone.state().brake > 0.9);
}

#[test]
fn the_steering_angle_changes_at_the_requested_rate() {
    let mut lone = Lone::sedan();
    lone.run(0.5);
    let control = AckermannControl {
        actor_id: ID,
        steer_rad: 0.3,
        steer_radps: 0.1,
        ..AckermannControl::default()
    };
    lone.physics.ackermann(&control).unwrap();
    run(&mut lone, 1.0);
    let half_way = lone.state().wheel_steer_rad;
    run(&mut lone, 4.0);
    let there = lone.state().wheel_steer_rad;
    assert!((half_way - 0.1).abs() < 0.02, "{half_way}");
    assert!((there - 0.3).abs() < 1e-3, "{there}");
}

#[test]
fn acceleration_stays_below_the_requested_limit() {
    let mut most = [0.0f32; 2];
    for (most, acceleration_mps2) in most.iter_mut().zip([1.0, 0.0]) {
        let mut lone = Lone::sedan();
        lone.run(0.5);
        let control = AckermannControl {
            actor_id: ID,
            speed_mps: 15.0,
            acceleration_mps2,
            ..AckermannControl::default()
        };
        lone.physics.ackermann(&control).unwrap();
        run(&mut lone, 4.0);
        *most = lone.speed();
    }
    println!("after 4 s: {most:?}");
    assert!(most[0] < 5.0 && most[1] > most[0] + 0.5, "{most:?}");
}

#[test]
fn a_control_deactivates_the_controller_and_gains_are_kept() {
    let mut lone = Lone::sedan();
    let settings = AckermannSettings {
        actor_id: ID,
        speed: [0.3, 0.01, 0.2],
        acceleration: [0.02, 0.0, 0.01],
    };
    lone.physics.set_ackermann(&settings).unwrap();
    assert_eq!(lone.physics.ackermann_settings(ID).unwrap(), settings);
    aim(&mut lone, 8.0, 0.0);
    run(&mut lone, 10.0);
    lone.control.brake = 1.0;
    lone.run(5.0);
    assert!(lone.speed() < 0.01, "{}", lone.speed());
    assert_eq!(lone.physics.ackermann_settings(ID).unwrap(), settings);
    for gain in [f32::NAN, f32::INFINITY, -1.0] {
        let bad = AckermannSettings { speed: [gain, 0.0, 0.0], ..settings };
        assert!(lone.physics.set_ackermann(&bad).is_err(), "{gain}");
        let bad = AckermannControl { actor_id: ID, speed_mps: gain * 1e9, ..Default::default() };
        assert!(lone.physics.ackermann(&bad).is_err(), "{gain}");
    }
}

#[test]
fn a_restored_controller_continues_bit_for_bit() {
    let mut lone = Lone::sedan();
    aim(&mut lone, 12.0, 0.1);
    run(&mut lone, 2.0);
    let bytes = lone.physics.save();
    run(&mut lone, 3.0);
    let (hash, state) = (lone.physics.hash(), lone.state());
    lone.physics.restore(&bytes).unwrap();
    run(&mut lone, 3.0);
    assert_eq!((lone.physics.hash(), lone.state()), (hash, state));
}
