//! Drives a car along its lane: a driving stack in a hundred lines.
//!
//! ```text
//! omnibus run
//! cargo run --release -p omnibus-client-lib --example drive_ego      # in a second terminal
//! ```
//!
//! Each tick it reads where the car is, steers towards a point ahead on the lane (pure pursuit:
//! R. C. Coulter, CMU-RI-TR-92-01, 1992) and holds a speed that the bends allow. It looks neither
//! at lights nor at others.

use std::time::Duration;

use omnibus_client_lib::{
    Actor, Client, ClientError, Spawn, VehicleControl, clock,
    glam::{Vec3, Vec3Swizzles},
    road::{LanePoint, Network},
};

const DELTA: Duration = Duration::from_millis(50);
const TICKS: u64 = 600;
const SPACING_M: f64 = 1.0;
/// Axle to axle, of the car below.
const WHEELBASE_M: f32 = 2.875;
/// How far `steer` 1 turns the front wheels.
const STEER_MAX_RAD: f32 = 0.61;
const CRUISE_MPS: f32 = 12.0;
const LATERAL_MPS2: f32 = 2.0;
const BRAKING_MPS2: f32 = 2.0;

fn main() {
    if let Err(why) = run(None) {
        eprintln!("drive_ego: {why}");
        std::process::exit(1);
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<(), ClientError> {
    let mut client = Client::connect(instance, "drive_ego")?;
    let before = client.settings();
    client.synchronise(DELTA)?;
    let route = Route::from(&*client.map()?);
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;

    let mut at = 0;
    let mut latencies_nanos = Vec::new();
    for tick in 1..=TICKS {
        client.tick()?;
        let state = *client.world().actor(car).expect("it was spawned");
        at = route.nearest(at, &state);
        if at + 1 >= route.points.len() {
            println!("the lane ends here");
            break;
        }
        client.control(&[route.steer(at, &state)])?;
        latencies_nanos.push(clock::now_nanos() - client.world().published_nanos());
        if tick % 20 == 0 {
            println!(
                "{:5.1} s: {:5.2} m/s, the lane's centre {:5.2} m to the left; {:6.1} us from snapshot to control",
                client.world().sim_time().as_secs_f64(),
                state.speed_mps(),
                route.offset_m(at, &state),
                *latencies_nanos.last().unwrap_or(&0) as f64 * 1e-3,
            );
        }
    }
    latencies_nanos.sort_unstable();
    let share =
        |share: usize| latencies_nanos[(latencies_nanos.len() - 1) * share / 100] as f64 * 1e-3;
    println!("snapshot to control: p50 {:.1} us, p99 {:.1} us", share(50), share(99));
    client.destroy(car)?;
    client.apply_settings(before)
}

/// Where to drive: points on lane centres, a metre apart, in world space.
struct Route {
    points: Vec<Waypoint>,
}

struct Waypoint {
    position: Vec3,
    speed_max_mps: f32,
}

impl Route {
    /// From the first spawn point on; where lanes fork, now the first way, now the last.
    fn from(network: &Network) -> Route {
        let mut points = Vec::new();
        let mut at: Option<LanePoint> = network.spawn_points().first().copied();
        while let Some(here) = at
            && points.len() < 2000
        {
            let place = network.place(here);
            let bend = (LATERAL_MPS2 / place.curvature_per_m.abs().max(1e-6) as f32).sqrt();
            let limit = network.lane(here.lane).speed_limit_mps.unwrap_or(f64::MAX) as f32;
            let speed_max_mps = CRUISE_MPS.min(bend).min(limit);
            points.push(Waypoint { position: place.position.as_vec3(), speed_max_mps });
            let ways = network.advance(here, SPACING_M);
            at = if points.len() % 2 == 0 { ways.first() } else { ways.last() }.copied();
        }
        // Slow down in time: v² = u² + 2 a s, from the end backwards.
        let mut next_mps = 0.0f32;
        for point in points.iter_mut().rev() {
            let reachable = (next_mps * next_mps + 2.0 * BRAKING_MPS2 * SPACING_M as f32).sqrt();
            point.speed_max_mps = point.speed_max_mps.min(reachable);
            next_mps = point.speed_max_mps;
        }
        Route { points }
    }

    /// The point abeam of the car, at or after `from`.
    fn nearest(&self, from: usize, car: &Actor) -> usize {
        let distance = |i: usize| self.points[i].position.distance_squared(car.position());
        let ahead = from..(from + 20).min(self.points.len());
        ahead.min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(from)
    }

    /// How far the lane's centre lies to the left of the car.
    fn offset_m(&self, at: usize, car: &Actor) -> f32 {
        car.pose().affine().inverse().transform_point3(self.points[at].position).y
    }

    fn steer(&self, at: usize, car: &Actor) -> VehicleControl {
        let speed_mps = car.speed_mps();
        let ahead = at + (4.0 + 0.8 * speed_mps) as usize;
        let target = self.points[ahead.min(self.points.len() - 1)].position;
        // Seen from the rear axle, x forward and y left: the circle through both has this curvature.
        let vehicle_from_world = car.pose().affine().inverse();
        let goal = vehicle_from_world.transform_point3(target) + Vec3::X * (WHEELBASE_M / 2.0);
        let curvature_per_m = 2.0 * goal.y / goal.xy().length_squared().max(1.0);
        let wheel_rad = (WHEELBASE_M * curvature_per_m).atan();
        let missing_mps = self.points[at].speed_max_mps - speed_mps;
        VehicleControl {
            actor_id: car.id(),
            throttle: (0.2 + 0.3 * missing_mps).clamp(0.0, 0.8),
            brake: (-0.2 * missing_mps - 0.1).clamp(0.0, 1.0),
            steer: (wheel_rad / STEER_MAX_RAD).clamp(-1.0, 1.0),
            ..VehicleControl::default()
        }
    }
}
