//! Conservation laws and plausibility of motion.

use std::sync::Arc;

use glam::Vec3;
use protocol::{ActorId, ActorState, Pose, VehicleControl, flag};

use super::{FRAME_NANOS, Ground, Lone, SUBSTEP_NANOS};
use crate::physics::{GRAVITY_MPS2, Physics, SyntheticLoad, VehicleModel};

fn state(physics: &Physics, id: u32) -> ActorState {
    let mut state = ActorState { actor_id: ActorId(id), ..ActorState::default() };
    assert!(physics.write_state(&mut state));
    state
}

#[test]
fn a_coasting_car_slows_by_rolling_resistance_and_drag() {
    let mut lone = Lone::sedan();
    lone.physics.set_velocity(ActorId(1), Vec3::X * 20.0, Vec3::ZERO).unwrap();
    lone.run(5.0);
    let (early, mut last) = (lone.speed(), lone.speed());
    // Rolling resistance alone would take 0.6 m/s; engine drag and air take a little more.
    assert!((10.0..19.4).contains(&early), "{early} m/s after 5 s");
    for _ in 0..800 {
        lone.frame();
        assert!(lone.speed() <= last + 0.02, "{} after {last} m/s", lone.speed());
        last = lone.speed();
    }
    assert!((8.0..15.0).contains(&lone.speed()), "{} m/s", lone.speed());
    lone.control.brake = 0.5;
    lone.run(8.0);
    assert!(lone.speed() < 0.01, "{} m/s", lone.speed());
}

#[test]
fn a_car_at_rest_gains_no_energy_in_a_minute() {
    let mut lone = Lone::sedan();
    lone.control.brake = 1.0;
    lone.run(3.0);
    let (place, height) = (lone.position(), lone.position().z);
    for _ in 0..1200 {
        lone.frame();
        assert!(lone.speed() < 2e-3, "{} m/s", lone.speed());
        assert!((lone.position().z - height).abs() < 1e-3);
    }
    assert!(lone.position().distance(place) < 0.01, "{} to {}", place, lone.position());
}

#[test]
fn in_the_air_a_car_falls_freely_and_lands_on_its_wheels() {
    let mut lone = Lone::sedan();
    lone.run(1.0);
    lone.physics.teleport(ActorId(1), &Pose::level(Vec3::new(0.0, 0.0, 3.0), 0.0)).unwrap();
    lone.physics.set_velocity(ActorId(1), Vec3::X * 15.0, Vec3::ZERO).unwrap();
    lone.run(0.5);
    let fallen = 3.0 - lone.position().z;
    let free = 0.5 * GRAVITY_MPS2 * 0.25;
    assert!((fallen - free).abs() < 0.1, "fell {fallen} m, not {free}");
    let mut highest = 0.0f32;
    for frame in 0..100 {
        lone.frame();
        if frame > 20 {
            highest = highest.max(lone.position().z);
        }
    }
    assert!(highest < 0.6, "it bounced to {highest} m");
    assert!(lone.position().z.abs() < 0.1, "{}", lone.position());
    assert!((lone.rotation() * Vec3::Z).z > 0.99);
    assert!(lone.speed() > 8.0, "it rolls on");
}

#[test]
fn driven_wheels_spin_up_while_the_handbrake_holds_the_others() {
    let mut lone = Lone::sedan();
    let before = lone.state().wheel_spin_rad;
    lone.run(0.5);
    assert_eq!(lone.state().wheel_spin_rad, before, "nothing turns at rest");
    lone.control.throttle = 1.0;
    lone.run(3.0);
    let rolled = lone.position().x;
    assert!(rolled > 5.0, "{rolled} m");
    assert!(lone.state().wheel_spin_rad != before);
    assert!(lone.state().engine_rpm > 1500.0, "{}", lone.state().engine_rpm);
    lone.control.throttle = 0.0;
    lone.control.flags = flag::HANDBRAKE;
    lone.run(6.0);
    assert!(lone.speed() < 0.05, "the handbrake holds: {} m/s", lone.speed());
}

#[test]
fn a_crash_conserves_momentum() {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    let model = Arc::new(VehicleModel::sedan());
    for (id, x, yaw) in [(1, -10.0, 0.0), (2, 10.0, std::f32::consts::PI)] {
        let pose = Pose::level(Vec3::new(x, 0.0, 0.0), yaw);
        physics.spawn_vehicle(ActorId(id), &model, &pose, false).unwrap();
    }
    for _ in 0..10 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    physics.set_velocity(ActorId(1), Vec3::X * 12.0, Vec3::ZERO).unwrap();
    physics.set_velocity(ActorId(2), Vec3::X * -4.0, Vec3::ZERO).unwrap();
    let sum = |physics: &Physics| {
        model.mass_kg * (state(physics, 1).velocity() + state(physics, 2).velocity()).x
    };
    let (mut before, mut change) = (sum(&physics), Vec3::ZERO);
    let mut begun = 0;
    for _ in 0..30 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        for collision in physics.collisions() {
            assert_eq!((collision.actor, collision.other), (ActorId(1), ActorId(2)));
            begun += usize::from(collision.began);
            change += collision.impulse_ns;
        }
        if begun == 0 {
            before = sum(&physics);
        }
        if begun > 0 && physics.collisions().is_empty() {
            break;
        }
    }
    assert_eq!(begun, 1);
    // The momentum that one car lost the other gained, except what the tyres gave to the road.
    let after = sum(&physics);
    assert!((after - before).abs() < 0.1 * before, "{before} Ns before, {after} after");
    assert!(change.x < -0.5 * model.mass_kg * 12.0, "{change} Ns on the car that was hit head-on");
}

#[test]
fn a_frame_has_the_fewest_substeps_within_the_limit() {
    let run = |frame_nanos: u64, substep_nanos: u64, frames: usize| {
        let mut stage = SyntheticLoad::new(3);
        for _ in 0..frames {
            stage.frame(frame_nanos, substep_nanos);
        }
        stage.physics().hash()
    };
    // 50 ms in steps of at most 10 ms are 5 substeps, and so they are with at most 12 ms.
    assert_eq!(run(50_000_000, 10_000_000, 40), run(50_000_000, 12_000_000, 40));
    assert_ne!(run(50_000_000, 10_000_000, 40), run(50_000_000, 25_000_000, 40));
    assert_ne!(run(50_000_000, 10_000_000, 40), run(50_000_000, 9_999_999, 40));
}

#[test]
fn a_thousand_vehicles_stay_on_the_ground() {
    let mut stage = SyntheticLoad::new(1000);
    for _ in 0..200 {
        stage.frame(FRAME_NANOS, SUBSTEP_NANOS);
    }
    assert_eq!(stage.physics().len(), 1000);
    let mut upright = 0;
    for state in stage.physics().states() {
        let (place, speed) = (state.pose.position(), state.velocity().length());
        assert!(place.is_finite() && speed.is_finite());
        assert!(speed < 40.0 && place.z.abs() < 6.0, "{place} at {speed} m/s");
        upright += usize::from((state.pose.rotation() * Vec3::Z).z > 0.7);
    }
    assert!(upright > 990, "{upright} of 1000 stand upright");
}

/// A vehicle of the catalogue on a plain.
fn of(id: &str) -> Lone {
    let (_, blueprint) = town::blueprint(id).expect("it is in the catalogue");
    Lone::new(Arc::new(Ground::flat(0.0)), VehicleModel::of(blueprint))
}

#[test]
fn every_vehicle_of_the_catalogue_starts_and_stops_upright() {
    for blueprint in town::catalogue().iter().filter(|b| b.kind == town::Kind::Vehicle) {
        let mut lone = of(blueprint.id);
        let half = |lone: &Lone| (lone.rotation() * Vec3::X).z.abs();
        lone.control.throttle = 1.0;
        for _ in 0..100 {
            lone.frame();
            assert!(half(&lone) < 0.2, "{} rears up by {}", blueprint.id, half(&lone));
        }
        assert!(lone.speed() > 4.0, "{} reaches {} m/s", blueprint.id, lone.speed());
        lone.control = VehicleControl { brake: 1.0, throttle: 0.0, ..lone.control };
        lone.run(8.0);
        assert!(lone.speed() < 0.05, "{} still does {} m/s", blueprint.id, lone.speed());
        assert!((lone.rotation() * Vec3::Z).z > 0.98, "{} fell over", blueprint.id);
    }
}

#[test]
fn a_bus_accelerates_again_after_slowing_down() {
    for slow_mps in [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0] {
        let mut lone = of("vehicle.mitsubishi.fusorosa");
        lone.control.throttle = 1.0;
        lone.run(8.0);
        lone.control = VehicleControl { brake: 0.3, throttle: 0.0, ..lone.control };
        while lone.speed() > slow_mps {
            lone.frame();
        }
        lone.control = VehicleControl { brake: 0.0, throttle: 1.0, ..lone.control };
        lone.run(6.0);
        assert!(lone.speed() > 8.0, "from {slow_mps} m/s it comes to {} m/s", lone.speed());
    }
}

#[test]
fn a_fallen_two_wheeler_rights_itself() {
    for id in ["vehicle.vespa.zx125", "vehicle.gazelle.omafiets"] {
        let mut lone = of(id);
        let lying = glam::Quat::from_rotation_x(1.5);
        lone.physics.teleport(ActorId(1), &Pose::new(Vec3::new(0.0, 0.0, 0.6), lying)).unwrap();
        lone.run(6.0);
        assert!((lone.rotation() * Vec3::Z).z > 0.95, "{id}: {}", lone.rotation() * Vec3::Z);
        lone.control.throttle = 0.5;
        lone.run(4.0);
        assert!(lone.speed() > 1.5, "{id} rides on");
    }
}

#[test]
fn a_bicycle_climbs_forty_percent() {
    let (_, blueprint) = town::blueprint("vehicle.gazelle.omafiets").unwrap();
    let mut lone = Lone::new(super::incline(0.41), VehicleModel::of(blueprint));
    lone.control.throttle = 1.0;
    lone.run(20.0);
    assert!(lone.position().z > 2.0, "at {}", lone.position());
}
