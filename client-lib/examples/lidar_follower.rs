//! A lidar-based agent: follows the vehicle ahead, at a distance, from point clouds alone.
//!
//! ```text
//! omnibus run --map client-lib/examples/oval.xodr
//! cargo run --release -p omnibus-client-lib --example lidar_follower # in a second terminal
//! ```
//!
//! Of each cloud the agent keeps the points above the road that are near to where it saw the vehicle
//! last; the nearest of them are the vehicle's rear. It steers to their middle (pure pursuit: R. C.
//! Coulter, CMU-RI-TR-92-01, 1992) and holds a gap that grows with its own speed. Map and poses are
//! read for the report only.

use std::time::Duration;

use omnibus_client_lib::{
    Actor, ActorFlags, ActorId, Client, ClientError, LidarOptions, LidarOutputs, PointCloud, Pose,
    Sensor, Spawn, TrafficParam, VehicleControl,
    glam::{Quat, Vec2, Vec3, Vec3Swizzles},
    road::{LaneTypes, Network},
};

const DELTA: Duration = Duration::from_millis(50);
const TICKS: u32 = 800;
/// Axle to axle, of the car below.
const WHEELBASE_M: f32 = 2.875;
/// From the middle of the wheelbase to the front bumper.
const BUMPER_M: f32 = 2.4;
/// How far `steer` 1 turns the front wheels.
const STEER_MAX_RAD: f32 = 0.61;
/// The gap at rest, and what is added for each metre per second.
const GAP_M: f32 = 4.0;
const GAP_SECS: f32 = 0.8;
/// Height above the road of the points that count.
const LOW_M: f32 = 0.4;
const HIGH_M: f32 = 1.8;
/// The vehicle moves less than this between two clouds.
const NEAR_M: f32 = 1.6;

/// What the agent did at one frame, by the simulator's own account.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Simulated time, seconds.
    pub(crate) time_s: f64,
    /// How far the car is to the left of the lane's centre, metres.
    pub(crate) deviation_m: f32,
    /// From bumper to bumper, metres.
    pub(crate) gap_m: f32,
    /// The same as the agent measured it.
    pub(crate) measured_m: f32,
    /// Speed, m/s.
    pub(crate) speed_mps: f32,
    /// Whether the car touches something.
    pub(crate) collides: bool,
}

fn main() {
    match run(None) {
        Ok(samples) => {
            println!("time_s,deviation_m,gap_m,measured_m,speed_mps,collides");
            for Sample { time_s, deviation_m, gap_m, measured_m, speed_mps, collides } in samples {
                let collides = u8::from(collides);
                println!(
                    "{time_s:.2},{deviation_m:.3},{gap_m:.2},{measured_m:.2},{speed_mps:.2},{collides}"
                );
            }
        }
        Err(why) => {
            eprintln!("lidar_follower: {why}");
            std::process::exit(1);
        }
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<Vec<Sample>, ClientError> {
    let mut client = Client::connect(instance, "lidar_follower")?;
    let before = client.settings();
    client.synchronise(DELTA)?;
    let map = client.map()?;
    let place = client.spawn_points()?[0];
    let ahead = place.affine().transform_point3(Vec3::X * 14.0);
    // The vehicle ahead drives at the limit and not faster.
    client.set_traffic_param(ActorId::NONE, TrafficParam::DriverSpread(0.0))?;
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    let ahead = Spawn::new("vehicle.audi.a2", Pose::new(ahead, place.rotation())).autopilot();
    let leader = client.spawn(ahead)?;
    let vehicle_from_roof = Pose::new(Vec3::new(0.0, 0.0, 1.9), Quat::IDENTITY);
    let options =
        LidarOptions::new(24, 240, [-0.25, 0.02], 60.0).fov_rad(2.4).outputs(LidarOutputs::POINTS);
    let roof = Sensor::lidar("roof", vehicle_from_roof, options);
    client.tick()?;
    let blueprint = client.world().actor(leader).expect("it was spawned").blueprint();
    let leader_half_m = client.blueprints()[blueprint].half_extents_m[0];
    let mut bundle = client.create_bundle("roof", car, [roof], 1)?;

    let mut view = View { rear: Vec2::new(14.0 - 2.0, 0.0), closing_mps: 0.0 };
    let mut samples = Vec::new();
    for _ in 0..TICKS {
        let (_, mut measured) = client.tick_and_collect(&mut [&mut bundle])?;
        let state = *client.world().actor(car).expect("it was spawned");
        let other = *client.world().actor(leader).expect("it was spawned");
        if let Some(cloud) = measured.pop().flatten().as_ref().and_then(|m| m.point_cloud(0)) {
            view.look(&cloud, &vehicle_from_roof);
        }
        client.control(&[view.drive(&state)])?;
        let between = state.position().distance(other.position());
        samples.push(Sample {
            time_s: client.world().sim_time().as_secs_f64(),
            deviation_m: deviation_m(&map, &state),
            gap_m: between - BUMPER_M - leader_half_m,
            measured_m: view.gap_m(),
            speed_mps: state.speed_mps(),
            collides: state.flags().contains(ActorFlags::COLLIDING),
        });
    }
    client.destroy_bundle(bundle)?;
    client.destroy(leader)?;
    client.destroy(car)?;
    client.apply_settings(before)?;
    Ok(samples)
}

/// What the agent believes of the vehicle ahead, in vehicle space.
struct View {
    /// The middle of its rear.
    rear: Vec2,
    /// How fast the gap shrinks.
    closing_mps: f32,
}

impl View {
    /// Finds the vehicle where it was seen last. If nothing is there, the last belief holds.
    fn look(&mut self, cloud: &PointCloud<'_>, vehicle_from_roof: &Pose) {
        let vehicle_from_roof = vehicle_from_roof.affine();
        let points = cloud.hits().map(|(point, _)| vehicle_from_roof.transform_point3(point));
        let near: Vec<Vec2> = points
            .filter(|point| (LOW_M..HIGH_M).contains(&point.z))
            .map(|point| point.xy())
            .filter(|point| point.distance(self.rear) < NEAR_M)
            .collect();
        let nearest_m = near.iter().map(|point| point.length()).fold(f32::INFINITY, f32::min);
        let rear = near.iter().filter(|point| point.length() < nearest_m + 0.4);
        let (count, sum) = rear.fold((0.0, Vec2::ZERO), |(n, sum), p| (n + 1.0, sum + *p));
        if count < 3.0 {
            return;
        }
        let rear = sum / count;
        let closing_mps = (self.rear.length() - rear.length()) / DELTA.as_secs_f32();
        // Single clouds resolve a few centimetres, so that their difference is smoothed.
        self.closing_mps += 0.2 * (closing_mps - self.closing_mps);
        self.rear = rear;
    }

    fn gap_m(&self) -> f32 {
        self.rear.length() - BUMPER_M
    }

    fn drive(&self, car: &Actor) -> VehicleControl {
        // Seen from the rear axle, x forward and y left: the circle through both has this curvature.
        let goal = self.rear + Vec2::X * (WHEELBASE_M / 2.0);
        let curvature_per_m = 2.0 * goal.y / goal.length_squared();
        let missing_m = self.gap_m() - GAP_M - GAP_SECS * car.speed_mps();
        let wanted_mps2 = 0.35 * missing_m - 0.9 * self.closing_mps;
        VehicleControl {
            actor_id: car.id(),
            throttle: (0.1 + 0.2 * wanted_mps2).clamp(0.0, 0.8),
            brake: (-0.15 * wanted_mps2 - 0.05).clamp(0.0, 1.0),
            steer: ((WHEELBASE_M * curvature_per_m).atan() / STEER_MAX_RAD).clamp(-1.0, 1.0),
            ..VehicleControl::default()
        }
    }
}

/// How far the car is to the left of the nearest lane's centre.
fn deviation_m(map: &Network, car: &Actor) -> f32 {
    let Some(at) = map.nearest(car.position().as_dvec3(), LaneTypes::DRIVABLE) else {
        return f32::INFINITY;
    };
    let place = map.place(at);
    let offset = car.position().as_dvec3() - place.position;
    (place.rotation().inverse() * offset).y as f32
}
