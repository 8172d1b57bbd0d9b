//! Ragdolls: they stay connected, come to rest, and are deterministic.

use std::sync::Arc;

use glam::{Quat, Vec3};
use protocol::{ActorId, ActorState, Pose, VehicleControl, flag};
use rapier3d::prelude::{RigidBody, RigidBodyHandle};

use super::{FRAME_NANOS, Ground, SUBSTEP_NANOS, incline};
use crate::physics::{GRAVITY_MPS2, Physics, StaticBox, VehicleModel, WalkerModel, actor::Kind};

const WALKER: ActorId = ActorId(1);
const CAR: ActorId = ActorId(2);

fn person() -> WalkerModel {
    WalkerModel {
        radius_m: 0.3,
        height_m: 1.8,
        mass_kg: 75.0,
        is_ragdoll_on_hit: true,
        gets_up_after_fall: false,
    }
}

/// A car that hits a walker, turned by `yaw_rad`, and brakes from the impact on.
fn hit(ground: Arc<Ground>, boxes: &[StaticBox], mps: f32, yaw_rad: f32) -> Physics {
    let mut physics = Physics::new(ground, boxes);
    physics.spawn_walker(WALKER, person(), &Pose::level(Vec3::ZERO, yaw_rad)).unwrap();
    let model = Arc::new(VehicleModel::sedan());
    physics.spawn_vehicle(CAR, &model, &Pose::level(Vec3::X * -9.0, 0.0), false).unwrap();
    run(&mut physics, 0.5);
    physics.set_velocity(CAR, Vec3::X * mps, Vec3::ZERO).unwrap();
    while !state(&physics, WALKER).has(flag::FALLEN) {
        frame(&mut physics);
    }
    let brake = VehicleControl { actor_id: CAR, brake: 1.0, ..VehicleControl::default() };
    physics.control(&brake).unwrap();
    physics
}

fn frame(physics: &mut Physics) {
    physics.step(FRAME_NANOS, SUBSTEP_NANOS);
}

fn run(physics: &mut Physics, seconds: f32) {
    (0..(seconds / 0.05).round() as usize).for_each(|_| frame(physics));
}

fn state(physics: &Physics, actor_id: ActorId) -> ActorState {
    let mut state = ActorState { actor_id, ..ActorState::default() };
    assert!(physics.write_state(&mut state));
    state
}

/// Returns the largest distance between the anchors of a joint.
fn apart_m(physics: &Physics) -> f32 {
    let joints = physics.world.impulse_joints().map(|(_, joint)| {
        let at =
            |body: RigidBodyHandle, anchor: Vec3| *physics.world.bodies[body].position() * anchor;
        let [one, other] =
            [joint.data.local_frame1.translation, joint.data.local_frame2.translation];
        at(joint.body1(), one).distance(at(joint.body2(), other))
    });
    joints.fold(0.0, f32::max)
}

/// Returns by how much elbows and knees exceed their limits.
fn overbent_rad(physics: &Physics) -> f32 {
    let turns = physics.limbs(WALKER).expect("it fell").rotations();
    let angle = |limb: usize| 2.0 * turns[limb].y.atan2(turns[limb].w);
    let elbows = [3, 5].map(|limb| angle(limb).max(-2.4 - angle(limb)));
    let knees = [7, 9].map(|limb| (-angle(limb)).max(angle(limb) - 2.3));
    elbows.into_iter().chain(knees).fold(0.0, f32::max)
}

fn limbs(physics: &Physics) -> impl Iterator<Item = &RigidBody> {
    let actor = &physics.actors[0];
    assert!(matches!(&actor.kind, Kind::Walker(walker) if walker.has_fallen()));
    actor.bodies().map(|body| &physics.world.bodies[body])
}

/// Returns the kinetic and potential energy. Joules.
fn energy_j(physics: &Physics) -> f32 {
    let of = |body: &RigidBody| {
        let high = body.center_of_mass().z;
        body.kinetic_energy() + body.mass() * GRAVITY_MPS2 * high
    };
    limbs(physics).map(of).sum()
}

/// Returns the speed of the fastest body.
fn fastest_mps(physics: &Physics) -> f32 {
    limbs(physics)
        .map(|body| body.linvel().length() + 0.2 * body.angvel().length())
        .fold(0.0, f32::max)
}

/// Speeds of impact and orientations of the walker: from behind, the side, the front and at an
/// angle.
const HITS: [(f32, f32); 8] = [
    (8.3, 0.0),
    (8.3, 1.57),
    (8.3, 3.1),
    (16.7, 0.0),
    (16.7, -1.57),
    (16.7, 2.5),
    (3.0, 3.1),
    (30.0, 0.8),
];

fn is_asleep(physics: &Physics) -> bool {
    limbs(physics).all(|body| body.is_sleeping())
}

#[test]
fn a_hit_walker_comes_to_rest_on_the_ground_in_one_piece() {
    for (mps, yaw_rad) in HITS {
        let mut physics = hit(Arc::new(Ground::flat(0.0)), &[], mps, yaw_rad);
        let (mut apart, mut overbent) = (0.0f32, 0.0f32);
        let (mut seconds, mut fastest) = (0.0, 0.0f32);
        while !is_asleep(&physics) {
            frame(&mut physics);
            seconds += 0.05;
            assert!(seconds < 12.0, "{mps} m/s, {yaw_rad}: {} m/s yet", fastest_mps(&physics));
            apart = apart.max(apart_m(&physics));
            overbent = overbent.max(overbent_rad(&physics));
            fastest = fastest.max(fastest_mps(&physics));
        }
        let lies = state(&physics, WALKER);
        let highest = limbs(&physics).map(|b| b.center_of_mass().z).fold(0.0, f32::max);
        let lowest = limbs(&physics).map(|b| b.center_of_mass().z).fold(9.0, f32::min);
        let middle = limbs(&physics).map(|b| b.center_of_mass() * b.mass()).sum::<Vec3>() / 75.0;
        println!(
            "{mps} m/s, {yaw_rad}: rests after {seconds:.1} s at {middle:.2}, limbs {lowest:.2} to \
             {highest:.2} high, {apart:.3} m apart at most, {fastest:.0} m/s the fastest"
        );
        assert!(overbent < 0.5, "{overbent} rad");
        // An arm between a fast car and the chest gives way for one frame.
        assert!(apart < 0.05 + 0.006 * mps, "{mps} m/s, {yaw_rad}: {apart} m");
        assert!(highest < 0.6 && middle.z < 0.3 && lowest > 0.0, "{lowest} to {highest}");
        assert!(middle.x > 0.3 && middle.x < 0.16 * mps * mps + 2.0, "{middle}");
        assert!(fastest < 2.5 * mps + 6.0, "{fastest} m/s");
        let turns = physics.limbs(WALKER).expect("it lies").rotations();
        assert!(turns.iter().any(|turn| turn.angle_between(Quat::IDENTITY) > 0.2), "{turns:?}");
        run(&mut physics, 2.0);
        assert_eq!(state(&physics, WALKER).pose, lies.pose, "it stays");
    }
}

#[test]
fn energy_does_not_grow_after_the_contact() {
    for (mps, yaw_rad) in HITS {
        let mut physics = hit(Arc::new(Ground::flat(0.0)), &[], mps, yaw_rad);
        frame(&mut physics);
        while !physics.collisions().is_empty() {
            frame(&mut physics);
        }
        let (first, mut least) = (energy_j(&physics), energy_j(&physics));
        for step in 0..160 {
            frame(&mut physics);
            if !physics.collisions().is_empty() {
                // The lost energy is that of the car, or of the ground below the impact.
                least = energy_j(&physics);
                continue;
            }
            let now = energy_j(&physics);
            assert!(
                now < least + 0.03 * first + 15.0,
                "{mps} m/s, {yaw_rad}, frame {step}: {now} J after {least} J, {first} J at first"
            );
            least = least.min(now);
        }
    }
}

#[test]
fn the_car_loses_momentum_in_the_impact() {
    for mps in [8.3, 16.7] {
        let mut physics = hit(Arc::new(Ground::flat(0.0)), &[], mps, 0.0);
        let before = state(&physics, CAR).velocity_mps[0];
        let coast = VehicleControl { actor_id: CAR, manual_gear: 1, ..VehicleControl::default() };
        physics.control(&coast).unwrap();
        let mut given = Vec3::ZERO;
        for _ in 0..4 {
            frame(&mut physics);
            let hits = physics.collisions().iter();
            given += hits.map(|c| c.impulse_ns).sum::<Vec3>();
        }
        let lost = before - state(&physics, CAR).velocity_mps[0];
        let expected = 75.0 * mps / (VehicleModel::sedan().mass_kg + 75.0);
        println!("{mps} m/s: {lost} lost, {expected} expected, {given} Ns");
        assert!((0.7..1.6).contains(&(lost / expected)), "{lost} m/s lost, {expected} expected");
        assert!((0.7..1.6).contains(&(given.x / (75.0 * mps))), "{given}");
    }
}

#[test]
fn walls_kerbs_and_slopes_support_ragdolls() {
    let wall = StaticBox {
        center: Vec3::new(4.0, 0.0, 1.5),
        half_extents_m: Vec3::new(0.3, 8.0, 1.5),
        yaw_rad: 0.0,
    };
    let mut physics = hit(Arc::new(Ground::flat(0.0)), &[wall], 8.3, 0.4);
    run(&mut physics, 8.0);
    for body in limbs(&physics) {
        let at = body.center_of_mass();
        assert!(at.x < 3.75 && at.z > 0.0, "a limb is in the wall: {at}");
    }
    let mut mesh = mesh::Mesh::default();
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    for (from, to, z) in [(-50.0f32, 3.0f32, 0.0f32), (3.0, 50.0, 0.15)] {
        mesh.quad([[from, -9.0, z], [to, -9.0, z], [to, 9.0, z], [from, 9.0, z]], face);
    }
    for ground in [incline(0.12), incline(-0.12), Arc::new(Ground::new(&mesh))] {
        let mut physics = hit(Arc::clone(&ground), &[], 8.3, 0.4);
        run(&mut physics, 9.0);
        assert!(is_asleep(&physics), "{} m/s", fastest_mps(&physics));
        for body in limbs(&physics) {
            let at = body.center_of_mass();
            let over = at.z - ground.below(at.x, at.y, at.z + 0.5).height_m;
            assert!((0.0..0.6).contains(&over), "a limb is {over} m over the ground");
        }
    }
}

#[test]
fn a_teleport_moves_the_whole_ragdoll_and_a_destroy_removes_it() {
    let mut physics = hit(Arc::new(Ground::flat(0.0)), &[], 8.3, 0.0);
    run(&mut physics, 8.0);
    let held = state(&physics, WALKER);
    let there = Pose::new(held.pose.position() + Vec3::new(0.0, 20.0, 0.0), held.pose.rotation());
    physics.teleport(WALKER, &there).unwrap();
    frame(&mut physics);
    run(&mut physics, 2.0);
    let moved = state(&physics, WALKER);
    assert!((moved.pose.position() - there.position()).length() < 0.05, "{:?}", moved.pose);
    assert!(is_asleep(&physics) && apart_m(&physics) < 0.01);
    physics.set_kinematic(WALKER, true).unwrap();
    run(&mut physics, 0.5);
    physics.set_kinematic(WALKER, false).unwrap();
    physics.set_collisions(WALKER, false).unwrap();
    physics.set_gravity(WALKER, false).unwrap();
    physics.set_gravity(WALKER, true).unwrap();
    run(&mut physics, 1.0);
    assert!(state(&physics, WALKER).pose.position().z > -0.5, "the ground carries it");
    physics.destroy(WALKER).unwrap();
    let left = (physics.world.bodies.len(), physics.world.colliders.len());
    assert_eq!((left, physics.world.impulse_joints().count()), ((1, 1), 0));
    frame(&mut physics);
}

#[test]
fn a_restored_ragdoll_continues_bit_for_bit() {
    let flat = || Arc::new(Ground::flat(0.0));
    for (mps, frames) in [(8.3, 3), (16.7, 14), (8.3, 90)] {
        let mut whole = hit(flat(), &[], mps, 0.7);
        (0..frames).for_each(|_| frame(&mut whole));
        let bytes = whole.save();
        // The other world has a history of its own.
        let mut other = hit(flat(), &[], 5.0, 2.0);
        run(&mut other, 1.0);
        other.restore(&bytes).unwrap();
        assert_eq!(other.save(), bytes);
        for step in 0..120 {
            frame(&mut whole);
            frame(&mut other);
            assert_eq!(whole.hash(), other.hash(), "{mps} m/s, {step} frames later");
            assert_eq!(state(&whole, WALKER), state(&other, WALKER));
        }
    }
}
#[test]
fn ragdolls_of_random_impacts_come_to_rest() {
    let mut seed = 1u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u64 << 24) as f32
    };
    for _ in 0..24 {
        let (mps, yaw_rad) = (2.5 + 25.0 * next(), 6.3 * next());
        let mut physics = hit(Arc::new(Ground::flat(0.0)), &[], mps, yaw_rad);
        let mut seconds = 0.0;
        while !is_asleep(&physics) {
            frame(&mut physics);
            seconds += 0.05;
            assert!(seconds < 12.0, "{mps} m/s, {yaw_rad}: {} m/s yet", fastest_mps(&physics));
            assert!(apart_m(&physics) < 0.25 && fastest_mps(&physics) < 2.5 * mps + 8.0);
        }
    }
}
