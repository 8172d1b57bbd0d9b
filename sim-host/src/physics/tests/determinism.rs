//! The determinism contract: equal calls give equal bits, and a restored state continues exactly.
//! The tests compare the hash of every frame, and at the end the whole saved state, which contains
//! rapier's own data.
//!
//! The scene is chaotic on purpose: cars crash into each other and into buildings, are destroyed
//! and spawned, crates fall, walkers are hit.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use protocol::{ActorId, Pose, VehicleControl};

use super::{FRAME_NANOS, Ground, SUBSTEP_NANOS};
use crate::physics::{Physics, PropModel, StaticBox, VehicleModel, WalkerModel};

/// A small repeatable random stream.
struct Stream(u64);

impl Stream {
    fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }
}

fn arena() -> Physics {
    let houses: Vec<StaticBox> = (0..12)
        .map(|i| {
            let angle = i as f32 * std::f32::consts::TAU / 12.0;
            StaticBox {
                center: Vec3::new(angle.cos() * 55.0, angle.sin() * 55.0, 3.0),
                half_extents_m: Vec3::new(4.0, 9.0, 3.0),
                yaw_rad: angle,
            }
        })
        .collect();
    Physics::new(Arc::new(Ground::flat(0.0)), &houses)
}

/// Applies the commands before frame `frame`; depends only on its arguments.
fn act(physics: &mut Physics, models: &[Arc<VehicleModel>; 2], frame: u64, seed: u64) {
    let mut stream = Stream(seed ^ frame.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    stream.next();
    if frame < 300 && frame.is_multiple_of(4) {
        let id = ActorId(frame as u32 + 1);
        let place = Vec3::new(stream.between(-40.0, 40.0), stream.between(-40.0, 40.0), 0.0);
        let pose = Pose::level(place, stream.between(-3.0, 3.0));
        let spawned = match frame % 20 {
            4 => physics.spawn_prop(
                id,
                PropModel {
                    half_extents_m: Vec3::splat(0.5),
                    mass_kg: 60.0,
                    is_passable: false,
                    is_released_on_hit: false,
                },
                &pose,
                false,
            ),
            8 => physics.spawn_walker(
                id,
                WalkerModel {
                    radius_m: 0.3,
                    height_m: 1.8,
                    mass_kg: 70.0,
                    is_ragdoll_on_hit: true,
                    gets_up_after_fall: false,
                },
                &pose,
            ),
            n => physics.spawn_vehicle(id, &models[(n % 8 / 4) as usize], &pose, false),
        };
        drop(spawned); // Refused if there is an obstacle, equally in each run.
    }
    if frame % 16 == 9 {
        let ids: Vec<ActorId> = physics.ids().collect();
        if ids.len() > 20 {
            physics.destroy(ids[(stream.next() * ids.len() as f32) as usize]).unwrap();
        }
    }
    let ids: Vec<ActorId> = physics.ids().collect();
    for id in ids {
        let control = VehicleControl {
            actor_id: id,
            throttle: stream.between(0.2, 1.0),
            brake: if stream.next() < 0.1 { 0.5 } else { 0.0 },
            steer: stream.between(-0.6, 0.8),
            ..VehicleControl::default()
        };
        let walk = Vec2::new(stream.between(-2.0, 2.0), stream.between(-2.0, 2.0));
        if physics.control(&control).is_err() {
            drop(physics.walk(id, walk)); // Crates do neither.
        }
    }
}

/// The hash of each frame, the number of collisions that began, and the final state.
struct Run {
    hashes: Vec<u64>,
    begun: usize,
    end: Vec<u8>,
}

/// Runs `frames` frames. At frame `save_at` the state is saved and restored into another world.
fn run(frames: u64, seed: u64, save_at: Option<u64>) -> Run {
    let truck = |half: Vec3| {
        let mut model = VehicleModel::sedan();
        model.mass_kg = 2500.0;
        model.box_half_m = half;
        Arc::new(model)
    };
    let models = [Arc::new(VehicleModel::sedan()), truck(Vec3::new(2.6, 1.0, 0.8))];
    let mut physics = arena();
    let mut run = Run { hashes: Vec::new(), begun: 0, end: Vec::new() };
    for frame in 0..frames {
        if save_at == Some(frame) {
            let bytes = physics.save();
            physics = arena();
            // The other world has a history of its own, of which nothing may remain.
            for frame in 0..20 {
                act(&mut physics, &models, frame, 99);
                physics.step(FRAME_NANOS, SUBSTEP_NANOS);
            }
            physics.restore(&bytes).unwrap();
            assert_eq!(physics.save(), bytes, "the restored state differs from the saved one");
        }
        act(&mut physics, &models, frame, seed);
        physics.step(FRAME_NANOS, SUBSTEP_NANOS);
        run.begun += physics.collisions().iter().filter(|c| c.began).count();
        run.hashes.push(physics.hash());
    }
    run.end = physics.save();
    run
}

fn assert_same(a: &Run, b: &Run, what: &str) {
    let first = a.hashes.iter().zip(&b.hashes).position(|(a, b)| a != b);
    assert_eq!(first, None, "{what}: differs from this frame on");
    assert_eq!(a.end.len(), b.end.len(), "{what}: the saved states' sizes differ");
    assert!(a.end == b.end, "{what}: equal hashes, but the saved states differ");
}

#[test]
fn two_runs_give_equal_bits() {
    let (a, b) = (run(600, 7, None), run(600, 7, None));
    println!("{} collisions, {} bytes", a.begun, a.end.len());
    assert!(a.begun >= 100, "only {} collisions: the scene has too few collisions", a.begun);
    assert_same(&a, &b, "run = run");
    assert_ne!(a.hashes, run(600, 8, None).hashes, "another seed must differ");
}

#[test]
fn a_run_through_a_saved_state_gives_equal_bits() {
    let whole = run(400, 11, None);
    for save_at in [1, 60, 233] {
        let cut = run(400, 11, Some(save_at));
        assert_same(&whole, &cut, &format!("saved before frame {save_at}"));
    }
}

#[test]
fn damaged_bytes_are_refused_and_the_world_continues() {
    let models = [Arc::new(VehicleModel::sedan()), Arc::new(VehicleModel::sedan())];
    let mut physics = arena();
    act(&mut physics, &models, 0, 3);
    physics.step(FRAME_NANOS, SUBSTEP_NANOS);
    let (bytes, hash) = (physics.save(), physics.hash());
    for cut in [0, 3, 4, 100, bytes.len() / 2, bytes.len() - 1] {
        physics.restore(&bytes[..cut]).unwrap_err();
    }
    for at in (0..bytes.len()).step_by(bytes.len() / 50) {
        let mut flipped = bytes.clone();
        flipped[at] ^= 0x10;
        physics.restore(&flipped).unwrap_err();
    }
    assert_eq!(physics.hash(), hash);
}
