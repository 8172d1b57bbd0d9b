//! The cost of a plan by the number of vehicles, which move as their controls mean, on generated
//! grids of the same density.
//!
//! ```text
//! cargo run --release -p omnibus-traffic --example planning -- 100 1000 10000
//! ```
//!
//! Prints for each number: the time of one vehicle and step, and a hash of all controls, which is
//! equal for equal decisions. `FRAMES` in the environment sets the number of frames of a round,
//! `WARM_UP` that of those before, and `THREADS` that of threads.

use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use mapgen::{Character, Plan};
use omnibus_traffic::{IntendedMotion, Planner};
use protocol::{ActorId, ActorState, Pose, flag, kind};
use road::Network;

const ROUNDS: usize = 3;
const DELTA_NANOS: u64 = 50_000_000;
const DELTA_S: f32 = 0.05;
/// Edge of the town for 10 000 vehicles, metres; that of others has the same density.
const LARGEST_M: f64 = 3000.0;
const LARGEST: usize = 10_000;

fn main() {
    let counts: Vec<usize> =
        std::env::args().skip(1).map(|count| count.parse().expect("numbers of vehicles")).collect();
    // At the beginning all vehicles stand apart; later there are queues.
    let warm_up = number("WARM_UP", 600);
    for &count in if counts.is_empty() { &[100, 1000, LARGEST][..] } else { &counts } {
        let mut world = World::new(count);
        let first = world.tick();
        for _ in 1..warm_up {
            world.tick();
        }
        let frames = number("FRAMES", (1_000_000 / count).clamp(20, 600));
        let mut rounds = [0.0; ROUNDS];
        let (mut all, mut computed) = (Vec::new(), Vec::new());
        for mean in &mut rounds {
            let nanos: Vec<[u64; 2]> = (0..frames).map(|_| world.tick()).collect();
            let sum = |of: usize| nanos.iter().map(|nanos| nanos[of]).sum::<u64>();
            let per_step = 1e-3 / (frames * count) as f64;
            *mean = sum(0) as f64 * per_step;
            computed.push(sum(1) as f64 * per_step);
            all.extend(nanos.iter().map(|nanos| nanos[0]));
        }
        rounds.sort_by(f64::total_cmp);
        computed.sort_by(f64::total_cmp);
        all.sort_unstable();
        let tenth = all[all.len() / 10] as f64 * 1e-3 / count as f64;
        println!(
            "{count} vehicles: {:.3} us per vehicle and step (median of {ROUNDS} rounds of \
             {frames} frames: {rounds:.3?}), {tenth:.3} in the fastest tenth of frames, {:.3} of \
             CPU time, first plan {:.1} ms, mean speed {:.2} m/s, hash {:016x}",
            rounds[ROUNDS / 2],
            computed[ROUNDS / 2],
            first[0] as f64 * 1e-6,
            world.mean_speed_mps(),
            world.hash
        );
    }
}

fn number(name: &str, default: usize) -> usize {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// Returns the nanoseconds that all threads of this process have computed.
fn computed_nanos() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Returns the edge of the town for a number of vehicles, metres.
fn edge_m(count: usize) -> f64 {
    LARGEST_M * (count as f64 / LARGEST as f64).sqrt()
}

/// A flat town and its vehicles, without physics.
struct World {
    planner: Planner,
    actors: Vec<ActorState>,
    /// Of all controls so far: equal decisions have equal hashes.
    hash: u64,
}

impl World {
    fn new(count: usize) -> World {
        let text = mapgen::generate(&Plan {
            name: "planning".to_owned(),
            seed: 1,
            size_m: edge_m(count),
            character: Character::Grid,
            relief_m: 0.0,
        });
        let network = Arc::new(Network::parse(&text).expect("generated towns parse"));
        let points = network.spawn_points();
        assert!(points.len() >= count, "{} places for {count} vehicles", points.len());
        let stride = points.len() as f64 / count as f64;
        let (blueprint, _) =
            town::blueprint("vehicle.tesla.model3").expect("a blueprint of the catalogue");
        let actors = (0..count).map(|k| {
            let at = network.place(points[(k as f64 * stride) as usize]);
            ActorState {
                actor_id: ActorId(k as u32 + 1),
                blueprint,
                kind: kind::VEHICLE,
                flags: flag::AUTOPILOT,
                pose: Pose::level(at.position.as_vec3(), at.heading_rad as f32),
                ..ActorState::default()
            }
        });
        let actors = actors.collect();
        let mut planner = Planner::new(network, 1);
        planner.set_threads(number("THREADS", 1));
        World { planner, actors, hash: 0 }
    }

    /// Plans a frame and moves the vehicles; returns the nanoseconds of the plan: those that passed, and
    /// those that all threads computed.
    fn tick(&mut self) -> [u64; 2] {
        let (begin, computed) = (bus::clock::now_nanos(), computed_nanos());
        self.planner.plan(DELTA_NANOS, &self.actors, &[]);
        let nanos = [bus::clock::now_nanos() - begin, computed_nanos() - computed];
        for (control, state) in self.planner.controls().iter().zip(&mut self.actors) {
            for value in [control.throttle, control.brake, control.steer] {
                self.hash = (self.hash ^ u64::from(value.to_bits()))
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    .rotate_left(29);
            }
            step(state, &self.planner.intended_motion(control, state));
        }
        nanos
    }

    fn mean_speed_mps(&self) -> f32 {
        let sum: f32 = self.actors.iter().map(|state| state.velocity().length()).sum();
        sum / self.actors.len() as f32
    }
}

/// Moves a vehicle for one frame on level ground: a bicycle without slip.
fn step(state: &mut ActorState, motion: &IntendedMotion) {
    let before = motion.direction * motion.speed_mps;
    let after = (before + motion.acceleration_mps2 * DELTA_S).max(before.min(0.0));
    let moved_m = motion.direction * 0.5 * (before + after).max(0.0) * DELTA_S;
    let forward = (state.pose.rotation() * Vec3::X).truncate().normalize_or(Vec2::X);
    let turn = moved_m * motion.wheel_steer_rad.tan() / motion.wheelbase_m;
    let position = state.pose.position();
    let rear = position.truncate() - forward * 0.5 * motion.wheelbase_m
        + Vec2::from_angle(0.5 * turn).rotate(forward) * moved_m;
    let forward_after = Vec2::from_angle(turn).rotate(forward);
    let place = rear + forward_after * 0.5 * motion.wheelbase_m;
    let speed = motion.direction * after.max(0.0);
    let acceleration = (after.max(0.0) - before) / DELTA_S * motion.direction;
    state.pose =
        Pose::new(place.extend(position.z), Quat::from_rotation_z(forward_after.to_angle()));
    state.velocity_mps = (forward_after * speed).extend(0.0).to_array();
    state.angular_velocity_radps = [0.0, 0.0, turn / DELTA_S];
    state.acceleration_mps2 = (forward_after * acceleration).extend(0.0).to_array();
}
