//! The cost of a plan by the number of walkers, which move as their controls mean, on a generated
//! town.
//!
//! ```text
//! cargo run --release -p omnibus-traffic --example walking -- 100 1000
//! ```
//!
//! Prints for each number: the time of one walker and step, that of the longest step, and a hash of
//! all controls, which is equal for equal decisions.
//! `FRAMES` in the environment sets the number of frames of a round.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use omnibus_traffic::Planner;
use protocol::{ActorId, ActorState, Pose, flag, kind};
use road::{LaneType, LaneTypes, Network};

const ROUNDS: usize = 3;
const WARM_UP: usize = 600;
const DELTA_NANOS: u64 = 50_000_000;
const DELTA_S: f32 = 0.05;

fn main() {
    let counts: Vec<usize> =
        std::env::args().skip(1).map(|count| count.parse().expect("numbers of walkers")).collect();
    let frames = std::env::var("FRAMES")
        .map_or(400, |text| text.parse().expect("FRAMES is a number of frames"));
    for &count in if counts.is_empty() { &[100, 1000][..] } else { &counts } {
        let mut world = World::new(count);
        let first = world.tick();
        let warm_up: Vec<u64> = (1..WARM_UP).map(|_| world.tick()).collect();
        let mut longest = warm_up.iter().copied().max().unwrap_or(0);
        let mut rounds = [0.0; ROUNDS];
        for mean in &mut rounds {
            let nanos: Vec<u64> = (0..frames).map(|_| world.tick()).collect();
            longest = nanos.iter().copied().max().unwrap_or(0).max(longest);
            *mean = nanos.iter().sum::<u64>() as f64 * 1e-3 / (frames * count) as f64;
        }
        rounds.sort_by(f64::total_cmp);
        println!(
            "{count} walkers: {:.3} us per walker and step (median of {ROUNDS} rounds of {frames} \
             frames: {rounds:.3?}), first plan with the ground {:.1} ms, longest other plan {:.2} ms, \
             mean speed {:.2} m/s, hash {:016x}",
            rounds[ROUNDS / 2],
            first as f64 * 1e-6,
            longest as f64 * 1e-6,
            world.mean_speed_mps(),
            world.hash
        );
    }
}

/// A town and its walkers, without physics.
struct World {
    planner: Planner,
    actors: Vec<ActorState>,
    /// Of all controls so far.
    hash: u64,
}

impl World {
    fn new(count: usize) -> World {
        let text = mapgen::named("Flatford").expect("a map of the generator");
        let network = Arc::new(Network::parse(&text).expect("generated towns parse"));
        let places = network.waypoints(1.5, LaneTypes::only(LaneType::Sidewalk));
        assert!(places.len() >= count, "{} places for {count} walkers", places.len());
        let stride = places.len() as f64 / count as f64;
        let (blueprint, _) =
            town::blueprint("walker.pedestrian.0001").expect("a blueprint of the catalogue");
        let actors = (0..count).map(|k| {
            let at = network.place(places[(k as f64 * stride) as usize]);
            ActorState {
                actor_id: ActorId(k as u32 + 1),
                blueprint,
                kind: kind::WALKER,
                flags: flag::AUTOPILOT,
                pose: Pose::level(at.position.as_vec3(), at.heading_rad as f32),
                ..ActorState::default()
            }
        });
        let actors = actors.collect();
        World { planner: Planner::new(network, 1), actors, hash: 0 }
    }

    /// Plans a frame and moves the walkers; returns the nanoseconds of the plan.
    fn tick(&mut self) -> u64 {
        let begin = bus::clock::now_nanos();
        self.planner.plan(DELTA_NANOS, &self.actors, &[]);
        let nanos = bus::clock::now_nanos() - begin;
        for (control, state) in self.planner.walker_controls().iter().zip(&mut self.actors) {
            let velocity: Vec2 = Vec2::from(control.direction) * control.speed_mps;
            for value in velocity.to_array() {
                self.hash = (self.hash ^ u64::from(value.to_bits()))
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    .rotate_left(29);
            }
            let position: Vec3 = state.pose.position() + velocity.extend(0.0) * DELTA_S;
            state.velocity_mps = velocity.extend(0.0).to_array();
            state.pose.position_m = position.to_array();
            if velocity != Vec2::ZERO {
                state.pose = Pose::level(position, velocity.to_angle());
            }
        }
        nanos
    }

    fn mean_speed_mps(&self) -> f32 {
        let sum: f32 = self.actors.iter().map(|state| state.velocity().length()).sum();
        sum / self.actors.len() as f32
    }
}
