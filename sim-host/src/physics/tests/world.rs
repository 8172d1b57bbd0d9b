use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use protocol::{ActorId, ActorState, Pose, VehicleControl, flag, parts};

use super::{FRAME_NANOS, Ground, Lone, SUBSTEP_NANOS, incline};
use crate::physics::{Physics, PhysicsError, PropModel, StaticBox, VehicleModel, WalkerModel};

fn state(physics: &Physics, id: u32) -> ActorState {
    let mut state = ActorState { actor_id: ActorId(id), ..ActorState::default() };
    assert!(physics.write_state(&mut state));
    state
}

fn town() -> Physics {
    let house = StaticBox {
        center: Vec3::new(30.0, 0.0, 5.0),
        half_extents_m: Vec3::new(5.0, 8.0, 5.0),
        yaw_rad: 0.3,
    };
    Physics::new(Arc::new(Ground::flat(0.0)), &[house])
}

#[test]
fn a_blocked_spawn_names_the_obstacle() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    let at = |x: f32| Pose::level(Vec3::new(x, 0.0, 0.0), 0.0);
    physics.spawn_vehicle(ActorId(12), &model, &at(0.0), false).unwrap();
    let refused = |physics: &mut Physics, x: f32| {
        physics.spawn_vehicle(ActorId(13), &model, &at(x), false).unwrap_err().to_string()
    };
    assert_eq!(
        refused(&mut physics, 3.0),
        "actor 13 would stand in actor 12; choose another position"
    );
    assert_eq!(
        refused(&mut physics, 28.0),
        "actor 13 would stand in a building; choose another position"
    );
    physics.spawn_vehicle(ActorId(13), &model, &at(6.0), false).unwrap();
    assert_eq!(
        physics.spawn_vehicle(ActorId(13), &model, &at(-20.0), false),
        Err(PhysicsError::Taken(ActorId(13)))
    );
    physics.destroy(ActorId(12)).unwrap();
    physics.spawn_vehicle(ActorId(14), &model, &at(0.0), false).unwrap();
    assert_eq!(physics.destroy(ActorId(12)), Err(PhysicsError::Unknown(ActorId(12))));
}

#[test]
fn a_vehicle_spawned_just_above_a_slope_is_placed_on_it() {
    let mut physics = Physics::new(incline(0.1), &[]);
    let model = Arc::new(VehicleModel::sedan());
    let above = Pose::level(Vec3::new(50.0, 0.0, 5.8), 0.0);
    let set = physics.spawn_vehicle(ActorId(1), &model, &above, false).unwrap();
    assert!((set.position().z - 5.0).abs() < 0.01, "{set:?}");
    let up = set.rotation() * Vec3::Z;
    assert!((up - Vec3::new(-0.1, 0.0, 1.0).normalize_or_zero()).length() < 0.01, "{up}");
    physics
        .control(&VehicleControl { actor_id: ActorId(1), brake: 1.0, ..VehicleControl::default() })
        .unwrap();
    for _ in 0..40 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    assert!((state(&physics, 1).pose.position() - set.position()).length() < 0.05);

    let high = Pose::level(Vec3::new(150.0, 0.0, 20.0), 0.0);
    let left = physics.spawn_vehicle(ActorId(2), &model, &high, false).unwrap();
    assert_eq!(left, high);
}

#[test]
fn a_collision_begins_once_and_has_its_impulse() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    for (id, x, yaw) in [(1, 0.0, 0.0), (2, 12.0, std::f32::consts::PI)] {
        physics
            .spawn_vehicle(ActorId(id), &model, &Pose::level(Vec3::new(x, 0.0, 0.0), yaw), false)
            .unwrap();
        physics.set_velocity(ActorId(id), Vec3::X * 10.0 * yaw.cos(), Vec3::ZERO).unwrap();
    }
    let mut begun = 0;
    let mut impulse = Vec3::ZERO;
    for _ in 0..20 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        for collision in physics.collisions() {
            assert_eq!((collision.actor, collision.other), (ActorId(1), ActorId(2)));
            begun += u32::from(collision.began);
            impulse += collision.impulse_ns;
            assert!(state(&physics, 1).has(flag::COLLIDING));
        }
    }
    println!("impulse {impulse}");
    assert!(begun >= 1);
    // Each loses about 1700 kg * 10 m/s, and more by the rebound.
    assert!(impulse.x < -14_000.0 && impulse.x > -25_000.0, "{impulse}");
    assert!(state(&physics, 1).velocity().x < 1.0);
}

#[test]
fn a_collision_with_a_building_names_the_static_box() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(ActorId(1), &model, &Pose::IDENTITY, false).unwrap();
    physics.set_velocity(ActorId(1), Vec3::X * 30.0, Vec3::ZERO).unwrap();
    let mut named = false;
    for _ in 0..60 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        named |= physics
            .collisions()
            .iter()
            .any(|c| c.static_box == Some(0) && c.other == ActorId::NONE);
        assert!(state(&physics, 1).pose.position().x < 26.0, "the walker is inside the building");
    }
    assert!(named);
}

#[test]
fn a_car_at_50_mps_does_not_fall_through_small_triangles() {
    let mut mesh = mesh::Mesh::default();
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    let (columns, rows, edge) = (2400u32, 30u32, 0.25f32);
    for row in 0..=rows {
        for column in 0..=columns {
            let (x, y) = (column as f32 * edge - 20.0, (row as f32 - 15.0) * edge);
            mesh.vertex([x, y, 0.4 * (x * 0.05).sin() + 0.004 * (x * 7.0 + y * 5.0).sin()]);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            mesh.triangle([a, a + 1, a + columns + 2], face);
            mesh.triangle([a, a + columns + 2, a + columns + 1], face);
        }
    }
    let mut lone = Lone::new(Arc::new(Ground::new(&mesh)), VehicleModel::sedan());
    lone.physics.set_velocity(ActorId(1), Vec3::X * 50.0, Vec3::ZERO).unwrap();
    lone.control.throttle = 1.0;
    for _ in 0..200 {
        lone.frame();
        let place = lone.position();
        let ground = lone.physics.ground().below(place.x, place.y, place.z + 3.0);
        if !ground.on_map {
            break;
        }
        assert!(place.z - ground.height_m > -0.2, "{} below {}", place, ground.height_m);
        assert!(place.z - ground.height_m < 1.5, "{} flies above {}", place, ground.height_m);
    }
    assert!(lone.position().x > 400.0, "{}", lone.position());
}

#[test]
fn an_overturned_car_lies_on_its_roof() {
    let mut physics = Physics::new(Arc::new(Ground::flat(0.0)), &[]);
    let model = Arc::new(VehicleModel::sedan());
    let roll = |angle: f32| Quat::from_rotation_x(angle);
    for (id, angle) in [(1, 3.0), (2, 1.4), (3, 2.2)] {
        let pose = Pose::new(Vec3::new(id as f32 * 10.0, 0.0, 4.0), roll(angle));
        physics.spawn_vehicle(ActorId(id), &model, &pose, false).unwrap();
        physics.set_velocity(ActorId(id), Vec3::new(8.0, 3.0, 0.0), Vec3::ZERO).unwrap();
        let control = VehicleControl {
            actor_id: ActorId(id),
            flags: flag::HANDBRAKE,
            ..VehicleControl::default()
        };
        physics.control(&control).unwrap();
    }
    for _ in 0..200 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    for id in 1..=3 {
        let state = state(&physics, id);
        let rotation = state.pose.rotation();
        let middle = state.pose.position() + rotation * model.box_center_m;
        let half = model.box_half_m;
        let reach = (rotation * Vec3::X).z.abs() * half.x
            + (rotation * Vec3::Y).z.abs() * half.y
            + (rotation * Vec3::Z).z.abs() * half.z;
        println!("{id}: lowest {}, speed {}", middle.z - reach, state.velocity().length());
        assert!(middle.z - reach > -0.05, "car {id} sinks to {}", middle.z - reach);
        assert!(middle.z < 2.0, "car {id} flies");
        assert!(state.velocity().length() < 0.02, "car {id} moves at {}", state.velocity());
    }
}

#[test]
fn invalid_values_are_refused_and_change_nothing() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(ActorId(1), &model, &Pose::IDENTITY, false).unwrap();
    let hash = physics.hash();
    let nan = Pose::level(Vec3::new(f32::NAN, 0.0, 0.0), 0.0);
    let far = Pose::level(Vec3::new(1e9, 0.0, 0.0), 0.0);
    let crooked = Pose { rotation: [0.0; 4], ..Pose::IDENTITY };
    for pose in [nan, far, crooked] {
        physics.teleport(ActorId(1), &pose).unwrap_err();
        physics.spawn_vehicle(ActorId(2), &model, &pose, false).unwrap_err();
    }
    for velocity in [Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e6)] {
        physics.set_velocity(ActorId(1), velocity, Vec3::ZERO).unwrap_err();
        physics.set_velocity(ActorId(1), Vec3::ZERO, velocity).unwrap_err();
    }
    physics.walk(ActorId(1), Vec2::X).unwrap_err();
    assert_eq!(physics.hash(), hash);
    let control = VehicleControl {
        actor_id: ActorId(1),
        throttle: f32::NAN,
        brake: f32::INFINITY,
        steer: -1e9,
        manual_gear: 1,
        gear: i32::MIN,
        ..VehicleControl::default()
    };
    physics.control(&control).unwrap();
    physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    assert!(state(&physics, 1).pose.is_valid());
    assert_eq!(
        physics.teleport(ActorId(9), &Pose::IDENTITY).unwrap_err().to_string(),
        "actor 9 does not exist"
    );
}

#[test]
fn a_teleport_causes_no_velocity_and_no_acceleration() {
    let mut lone = Lone::sedan();
    lone.physics.set_velocity(ActorId(1), Vec3::X * 20.0, Vec3::ZERO).unwrap();
    lone.run(1.0);
    let there = Pose::level(Vec3::new(100.0, 50.0, 0.0), 1.0);
    lone.physics.teleport(ActorId(1), &there).unwrap();
    lone.frame();
    let state = lone.state();
    assert!(state.has(flag::TELEPORTED));
    assert!((state.pose.position() - there.position()).length() < 0.02, "{:?}", state.pose);
    assert!(state.velocity().length() < 0.1);
    assert!(Vec3::from_array(state.acceleration_mps2).length() < 2.0);
    lone.frame();
    assert!(!lone.state().has(flag::TELEPORTED));
}

#[test]
fn walkers_stay_on_the_ground_and_stop_at_buildings() {
    let mut physics = town();
    let model = WalkerModel {
        radius_m: 0.25,
        height_m: 1.8,
        mass_kg: 75.0,
        is_ragdoll_on_hit: false,
        gets_up_after_fall: false,
    };
    physics.spawn_walker(ActorId(5), model, &Pose::IDENTITY).unwrap();
    physics.walk(ActorId(5), Vec2::new(1.5, 0.0)).unwrap();
    for _ in 0..100 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let after = state(&physics, 5);
    assert!((after.pose.position() - Vec3::X * 7.5).length() < 0.02, "{:?}", after.pose);
    assert!((after.velocity() - Vec3::X * 1.5).length() < 1e-3, "{}", after.velocity());
    for _ in 0..500 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let blocked = state(&physics, 5).pose.position();
    assert!(blocked.x > 20.0 && blocked.x < 27.5, "{blocked}");
}

#[test]
fn a_crate_falls_comes_to_rest_and_is_moved_by_a_car() {
    let mut physics = town();
    let crate_model = PropModel {
        half_extents_m: Vec3::splat(0.4),
        mass_kg: 40.0,
        is_passable: false,
        is_released_on_hit: false,
    };
    let above = Pose::level(Vec3::new(8.0, 0.0, 2.0), 0.4);
    physics.spawn_prop(ActorId(7), crate_model, &above, false).unwrap();
    for _ in 0..60 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let rest = state(&physics, 7);
    assert!(rest.pose.position().z.abs() < 0.05, "{:?}", rest.pose);
    assert!(rest.velocity().length() < 0.01, "{}", rest.velocity());
    let model = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(ActorId(1), &model, &Pose::IDENTITY, false).unwrap();
    physics.set_velocity(ActorId(1), Vec3::X * 10.0, Vec3::ZERO).unwrap();
    for _ in 0..40 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    assert!(state(&physics, 7).pose.position().x > 10.0);
    assert!(state(&physics, 7).pose.position().z > -0.3);
}

#[test]
fn a_kinematic_vehicle_floats_and_falls_when_it_is_dynamic() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    let pose = Pose::level(Vec3::new(0.0, 0.0, 6.0), 0.0);
    physics.spawn_vehicle(ActorId(1), &model, &pose, false).unwrap();
    physics.set_kinematic(ActorId(1), true).unwrap();
    for _ in 0..20 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    assert_eq!(state(&physics, 1).pose, pose);
    physics.set_kinematic(ActorId(1), false).unwrap();
    for _ in 0..20 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    assert!(state(&physics, 1).pose.position().z < 5.0);
}

#[test]
fn a_vehicle_spawned_far_below_the_map_falls_until_it_is_teleported_to_the_road() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    let deep = Pose::level(Vec3::Z * -500.0, 0.0);
    physics.spawn_vehicle(ActorId(1), &model, &deep, false).unwrap();
    for _ in 0..2 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let fallen = state(&physics, 1);
    let fall = fallen.velocity_mps[2];
    assert!((-1.1..-0.8).contains(&fall), "after 0.1 s: {fall} m/s at {:?}", fallen.pose);
    physics.set_kinematic(ActorId(1), true).unwrap();
    physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    physics.teleport(ActorId(1), &Pose::level(Vec3::Z, 0.0)).unwrap();
    physics.set_kinematic(ActorId(1), false).unwrap();
    for _ in 0..40 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let place = state(&physics, 1).pose.position();
    assert!(place.length() < 0.1, "it does not stand on the road: {place}");
}

#[test]
fn a_kinematic_vehicle_moves_only_by_its_set_velocity() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    let pose = Pose::level(Vec3::new(0.0, 0.0, 3.0), 0.0);
    physics.spawn_vehicle(ActorId(1), &model, &pose, true).unwrap();
    physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    assert_eq!(state(&physics, 1).pose, pose);
    physics.set_velocity(ActorId(1), Vec3::X * 2.0, Vec3::ZERO).unwrap();
    for _ in 0..20 {
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    }
    let moved = state(&physics, 1);
    assert!((moved.pose.position() - Vec3::new(2.0, 0.0, 3.0)).length() < 1e-3);
    assert!((moved.velocity().x - 2.0).abs() < 1e-3);
}

#[test]
fn published_velocities_are_multiples_of_their_resolution() {
    let mut physics = town();
    let model = Arc::new(VehicleModel::sedan());
    let pose = Pose::level(Vec3::new(0.0, 0.0, 0.5), 0.3);
    physics.spawn_vehicle(ActorId(1), &model, &pose, false).unwrap();
    let control = VehicleControl {
        actor_id: ActorId(1),
        throttle: 0.7,
        steer: 0.2,
        ..VehicleControl::default()
    };
    physics.control(&control).unwrap();
    let lies = |value: f32, of: u32| (value * of as f32).fract() == 0.0;
    for _ in 0..60 {
        let before = state(&physics, 1).velocity();
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        let state = state(&physics, 1);
        let motion = state.velocity_mps.iter().chain(&state.angular_velocity_radps);
        assert!(motion.into_iter().all(|value| lies(*value, parts::MOTION)), "{state:?}");
        assert!(lies(state.engine_rpm, parts::ENGINE), "{state:?}");
        assert!(lies(state.wheel_steer_rad, parts::WHEEL), "{state:?}");
        assert!(lies(state.wheel_spin_rad, parts::WHEEL), "{state:?}");
        let gained = (state.velocity() - before) * (1e9 / FRAME_NANOS as f64) as f32;
        assert_eq!(state.acceleration_mps2, gained.to_array());
    }
    assert!(state(&physics, 1).velocity().length() > 3.0);
}
