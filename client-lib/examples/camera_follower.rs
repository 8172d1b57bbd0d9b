//! A camera-based agent: keeps its lane from images of semantic tags alone.
//!
//! ```text
//! omnibus run --map client-lib/examples/oval.xodr
//! cargo run --release -p omnibus-client-lib --example camera_follower # in a second terminal
//! ```
//!
//! The agent sees which pixels are road markings (a camera's tag output, which a real car gets from
//! a trained network) and its own speed. Each marking is projected onto a flat road; between the
//! nearest ones to the left and right lies the lane. It steers to the lane's centre some metres
//! ahead (pure pursuit: R. C. Coulter, CMU-RI-TR-92-01, 1992). Map and poses are read for the
//! report only.

use std::{f32::consts::FRAC_PI_2, time::Duration};

use omnibus_client_lib::{
    Actor, ActorFlags, CameraOutputs, Client, ClientError, Image, Pose, Sensor, Spawn, Tag,
    VehicleControl,
    glam::{Quat, Vec2, Vec3},
    road::{LaneTypes, Network},
};

const DELTA: Duration = Duration::from_millis(50);
const TICKS: u32 = 800;
const CRUISE_MPS: f32 = 8.0;
/// Axle to axle, of the car below.
const WHEELBASE_M: f32 = 2.875;
/// How far `steer` 1 turns the front wheels.
const STEER_MAX_RAD: f32 = 0.61;
/// Where markings are looked for, ahead of the middle of the wheelbase.
const NEAR_M: f32 = 5.0;
const FAR_M: f32 = 11.0;
/// The camera's pitch, downwards.
const PITCH_RAD: f32 = 0.2;
/// The width of a lane, until both its markings were seen.
const LANE_M: f32 = 3.5;

/// What the agent did at one frame, by the simulator's own account.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Simulated time, seconds.
    pub(crate) time_s: f64,
    /// How far the car is to the left of the lane's centre, metres.
    pub(crate) deviation_m: f32,
    /// Speed, m/s.
    pub(crate) speed_mps: f32,
    /// Whether the car touches something.
    pub(crate) collides: bool,
}

fn main() {
    match run(None) {
        Ok(samples) => {
            println!("time_s,deviation_m,speed_mps,collides");
            for Sample { time_s, deviation_m, speed_mps, collides } in samples {
                println!("{time_s:.2},{deviation_m:.3},{speed_mps:.2},{}", u8::from(collides));
            }
        }
        Err(why) => {
            eprintln!("camera_follower: {why}");
            std::process::exit(1);
        }
    }
}

pub(crate) fn run(instance: Option<&str>) -> Result<Vec<Sample>, ClientError> {
    let mut client = Client::connect(instance, "camera_follower")?;
    let before = client.settings();
    client.synchronise(DELTA)?;
    let map = client.map()?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    let vehicle_from_eye = Pose::new(Vec3::new(0.6, 0.0, 1.6), Quat::from_rotation_y(PITCH_RAD));
    let eye =
        Sensor::camera("eye", vehicle_from_eye, 320, 160, FRAC_PI_2).outputs(CameraOutputs::TAG);
    let mut bundle = client.create_bundle("eye", car, [eye], 1)?;

    let mut lane = Lane { width_m: LANE_M, goal: Vec2::new(FAR_M, 0.0) };
    let mut samples = Vec::new();
    for _ in 0..TICKS {
        let (_, mut measured) = client.tick_and_collect(&mut [&mut bundle])?;
        let state = *client.world().actor(car).expect("it was spawned");
        if let Some(image) = measured.pop().flatten().as_ref().and_then(|m| m.tag_image(0)) {
            lane.look(&image, &vehicle_from_eye);
        }
        client.control(&[lane.steer(&state)])?;
        samples.push(Sample {
            time_s: client.world().sim_time().as_secs_f64(),
            deviation_m: deviation_m(&map, &state),
            speed_mps: state.speed_mps(),
            collides: state.flags().contains(ActorFlags::COLLIDING),
        });
    }
    client.destroy_bundle(bundle)?;
    client.destroy(car)?;
    client.apply_settings(before)?;
    Ok(samples)
}

/// What the agent believes of its lane, in vehicle space.
struct Lane {
    width_m: f32,
    /// A point of the centre ahead.
    goal: Vec2,
}

impl Lane {
    /// Follows the lane from the near rows of the image to the far ones. Where no marking is seen,
    /// the last belief holds.
    fn look(&mut self, image: &Image<'_, u8>, vehicle_from_eye: &Pose) {
        let mut centre_m = 0.0;
        let rows: Vec<&[u8]> = image.rows().collect();
        for (row, tags) in rows.into_iter().enumerate().rev() {
            let on_road = |column: usize| {
                let pixel = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
                let ray = vehicle_from_eye.rotation() * image.intrinsics.unproject(pixel, 1.0);
                let eye = vehicle_from_eye.position();
                (ray.z < 0.0).then(|| (eye - ray * (eye.z / ray.z)).truncate())
            };
            let Some(middle) = on_road(image.width as usize / 2) else { break };
            if middle.x > FAR_M {
                break;
            }
            if middle.x < NEAR_M {
                continue;
            }
            let (mut left_m, mut right_m) = (None, None);
            // From the left to the right.
            for (column, tag) in tags.iter().enumerate() {
                if *tag != Tag::RoadLine as u8 {
                    continue;
                }
                let Some(y_m) = on_road(column).map(|point| point.y) else { continue };
                if (0.5..self.width_m).contains(&(y_m - centre_m)) {
                    left_m = Some(y_m);
                } else if (0.5..self.width_m).contains(&(centre_m - y_m)) && right_m.is_none() {
                    right_m = Some(y_m);
                }
            }
            match (left_m, right_m) {
                (Some(left), Some(right)) => {
                    self.width_m += 0.02 * ((left - right).clamp(2.5, 4.5) - self.width_m);
                    centre_m = (left + right) * 0.5;
                }
                (Some(left), None) => centre_m = left - self.width_m * 0.5,
                (None, Some(right)) => centre_m = right + self.width_m * 0.5,
                (None, None) => continue,
            }
            self.goal = Vec2::new(middle.x, centre_m);
        }
    }

    fn steer(&self, car: &Actor) -> VehicleControl {
        // Seen from the rear axle, x forward and y left: the circle through both has this curvature.
        let goal = self.goal + Vec2::X * (WHEELBASE_M / 2.0);
        let curvature_per_m = 2.0 * goal.y / goal.length_squared();
        let missing_mps = CRUISE_MPS - car.speed_mps();
        VehicleControl {
            actor_id: car.id(),
            throttle: (0.15 + 0.2 * missing_mps).clamp(0.0, 0.8),
            brake: (-0.2 * missing_mps - 0.1).clamp(0.0, 1.0),
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
