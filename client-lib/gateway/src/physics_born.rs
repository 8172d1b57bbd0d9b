//! Sensors that need no rays: what they say follows from the snapshot.

use client_lib::{ActorId, ActorState, Client, Pose, World, flag};
use glam::{DVec3, Vec3};

use crate::{
    cast::Cast,
    msgpack::Pack,
    rays,
    sensor::{Kind, Sensor},
    statics::Statics,
    stream::Message,
    wire::{Actor, flip, flip_turn, message},
};

/// Downwards.
const GRAVITY_MPS2: f32 = 9.81;
/// What an accelerometer shows at most.
const ACCELERATION_MAX: f32 = 99.9;

/// The messages of one sensor at the newest frame.
pub(crate) fn measure(
    cast: &mut Cast,
    id: u32,
    pose: &Pose,
    world: &World,
    client: &Client,
    statics: &Statics,
) -> Vec<Message> {
    let stamp = world.header().stamp;
    let Some(own) = cast.own.get_mut(&id) else { return Vec::new() };
    let carrier_id = own.parent;
    let Some(sensor) = &mut own.sensor else { return Vec::new() };
    let kind = sensor.kind;
    let is_due = match kind {
        Kind::Imu | Kind::Gnss | Kind::Obstacle => sensor.is_due(stamp.sim_time_nanos),
        Kind::Collision => true,
        _ => false,
    };
    if !is_due {
        return Vec::new();
    }
    let carrier = world.actor(ActorId(carrier_id));
    let mut body = Pack::new();
    match kind {
        Kind::Imu => imu(sensor, pose, carrier, &mut body),
        Kind::Gnss => gnss(sensor, pose, statics, &mut body),
        Kind::Collision => {
            let Some(carrier) = carrier.filter(|a| a.has(flag::COLLIDING)) else {
                return Vec::new();
            };
            let blueprints = client.blueprints();
            let extents = |actor: &ActorState| {
                blueprints
                    .get(actor.blueprint as usize)
                    .map_or(1.0, |b| Vec3::from_array(b.half_extents_m).length())
            };
            let other = touched(carrier, world, extents);
            let Some(hero) = cast.actor(carrier_id, world, blueprints).cloned() else {
                return Vec::new();
            };
            let found = other.and_then(|other| cast.actor(other.actor_id.0, world, blueprints));
            let other = found.cloned().unwrap_or_else(ground);
            let delta_secs = world.header().delta_nanos as f32 * 1e-9;
            let mass = town::blueprint(&hero.description.id).map_or(0.0, |(_, b)| b.mass_kg);
            let impulse = carrier.acceleration_mps2.map(|a| a * mass * delta_secs);
            body.list(3);
            hero.write(&mut body);
            other.write(&mut body);
            body.vector(flip(impulse));
        }
        Kind::Obstacle => {
            let number = |id: &str, otherwise: f32| {
                sensor.description.number(id, otherwise).unwrap_or(otherwise)
            };
            let (reach, radius) = (number("distance", 5.0), number("hit_radius", 0.5));
            let blueprints = client.blueprints();
            let ahead = world.actors().iter().filter(|a| a.actor_id.0 != carrier_id);
            let distances = ahead.filter_map(|actor| {
                let info = blueprints.get(actor.blueprint as usize)?;
                let half = Vec3::from_array(info.half_extents_m) + radius;
                let center = actor.pose.affine().transform_point3(Vec3::from_array(info.center_m));
                let turn = actor.pose.rotation();
                let ahead = pose.rotation() * Vec3::X;
                let distance = rays::enter(pose.position(), ahead, reach, center, turn, half)?;
                Some((distance, actor.actor_id.0))
            });
            let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((distance, other)) = nearest else { return Vec::new() };
            let hero = cast.actor(carrier_id, world, blueprints).cloned();
            let other = cast.actor(other, world, blueprints).cloned();
            let (Some(hero), Some(other)) = (hero, other) else { return Vec::new() };
            body.list(3);
            hero.write(&mut body);
            other.write(&mut body);
            body.f32(distance);
        }
        _ => return Vec::new(),
    }
    let mut bytes =
        message(kind.type_id(), stamp.frame.0, stamp.sim_time_nanos, pose, body.bytes().len());
    bytes.0.extend_from_slice(body.bytes());
    vec![bytes.into_message()]
}

/// The nearest other actor that touches something at this frame, if it is near enough.
fn touched<'a>(
    carrier: &ActorState,
    world: &'a World,
    extents: impl Fn(&ActorState) -> f32,
) -> Option<&'a ActorState> {
    let distance = |a: &ActorState| (a.pose.position() - carrier.pose.position()).length();
    let others = world.actors().iter().filter(|a| {
        a.actor_id != carrier.actor_id
            && a.has(flag::COLLIDING)
            && distance(a) < extents(a) + extents(carrier) + 0.5
    });
    others.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// What is touched that is no actor.
fn ground() -> Actor {
    let mut actor = Actor::default();
    actor.description.id = "static.unknown".to_owned();
    actor.tag = 20;
    actor
}

fn imu(sensor: &mut Sensor, pose: &Pose, carrier: Option<&ActorState>, body: &mut Pack) {
    let back = pose.rotation().inverse();
    let felt = carrier.map_or(Vec3::ZERO, |a| Vec3::from_array(a.acceleration_mps2))
        + Vec3::Z * GRAVITY_MPS2;
    let turn = carrier.map_or(Vec3::ZERO, |a| Vec3::from_array(a.angular_velocity_radps));
    let mut accelerometer = flip((back * felt).to_array());
    let mut gyroscope = flip_turn((back * turn).to_array());
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let noise = |what: &str| {
            let deviation = sensor.description.number(&format!("{what}_{name}"), 0.0);
            deviation.unwrap_or(0.0)
        };
        let (accel, gyro) = (noise("noise_accel_stddev"), noise("noise_gyro_stddev"));
        let bias = noise("noise_gyro_bias");
        if accel != 0.0 {
            accelerometer[axis] += accel * sensor.normal();
        }
        if gyro != 0.0 {
            gyroscope[axis] += gyro * sensor.normal();
        }
        gyroscope[axis] += bias;
    }
    let accelerometer = accelerometer.map(|a| a.clamp(-ACCELERATION_MAX, ACCELERATION_MAX));
    // Clockwise from north, which is our y.
    let ahead = pose.rotation() * Vec3::X;
    let compass = ahead.x.atan2(ahead.y).rem_euclid(std::f32::consts::TAU);
    body.list(3).vector(accelerometer).vector(gyroscope).f32(compass);
}

fn gnss(sensor: &mut Sensor, pose: &Pose, statics: &Statics, body: &mut Pack) {
    let place: DVec3 = pose.position().as_dvec3();
    let mut fix = statics.geo.locate(place);
    for (value, name) in fix.iter_mut().zip(["lat", "lon", "alt"]) {
        let number = |what: &str| {
            f64::from(
                sensor.description.number(&format!("noise_{name}_{what}"), 0.0).unwrap_or(0.0),
            )
        };
        let (deviation, bias) = (number("stddev"), number("bias"));
        if deviation != 0.0 {
            *value += deviation * f64::from(sensor.normal());
        }
        *value += bias;
    }
    body.list(3).f64(fix[0]).f64(fix[1]).f64(fix[2]);
}
