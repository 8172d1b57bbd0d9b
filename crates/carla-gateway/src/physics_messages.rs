//! Measurements of physics sensors as CARLA's messages.

use client_lib::{
    BlueprintInfo, Measurement, World,
    wire::{CollisionReading, GnssReading, ImuReading, ObstacleReading},
};

use crate::{
    msgpack::Pack,
    proxy_actors::ProxyActors,
    radio,
    sensor::Sensor,
    sensor_kind::Kind,
    stream::Message,
    wire::{Actor, flip, flip_turn, message},
};

/// Returns the messages of one measurement, one for each event.
pub(crate) fn messages_of(
    sensor: &Sensor,
    carrier: u32,
    measured: &Measurement,
    actors: &mut ProxyActors,
    world: &World,
    blueprints: &[BlueprintInfo],
) -> Vec<Message> {
    let Some(plane) = measured.planes().first() else { return Vec::new() };
    let begin = |len: usize| {
        let stamp = measured.header().stamp;
        let (frame, nanos) = (stamp.frame.0, stamp.sim_time_nanos);
        message(sensor.kind.type_id(), frame, nanos, &plane.world_from_sensor, len)
    };
    let wrap = |body: &Pack| {
        let mut bytes = begin(body.bytes().len());
        bytes.0.extend_from_slice(body.bytes());
        bytes.into_message()
    };
    let mut body = Pack::new();
    match sensor.kind {
        Kind::Imu => {
            let Some(imu) = measured.readings::<ImuReading>(0).first() else { return Vec::new() };
            body.list(3)
                .vector(flip(imu.accelerometer_mps2))
                .vector(flip_turn(imu.gyroscope_radps))
                .f32(imu.compass_rad);
            vec![wrap(&body)]
        }
        Kind::Gnss => {
            let Some(fix) = measured.readings::<GnssReading>(0).first() else { return Vec::new() };
            body.list(3).f64(fix.latitude_deg).f64(fix.longitude_deg).f64(fix.altitude_m);
            vec![wrap(&body)]
        }
        Kind::Collision => {
            let mut messages = Vec::new();
            let own = actors.actor(carrier, world, blueprints).cloned();
            for hit in measured.readings::<CollisionReading>(0) {
                let Some(own) = &own else { break };
                let other = other(hit.other.0, hit.tag, actors, world, blueprints);
                let mut body = Pack::new();
                body.list(3);
                own.write(&mut body);
                other.write(&mut body);
                body.vector(flip(hit.impulse_ns));
                messages.push(wrap(&body));
            }
            messages
        }
        Kind::Obstacle => {
            let Some(seen) = measured.readings::<ObstacleReading>(0).first() else {
                return Vec::new();
            };
            let Some(own) = actors.actor(carrier, world, blueprints).cloned() else {
                return Vec::new();
            };
            let other = other(seen.other.0, seen.tag, actors, world, blueprints);
            body.list(3);
            own.write(&mut body);
            other.write(&mut body);
            body.f32(seen.distance_m);
            vec![wrap(&body)]
        }
        Kind::V2x => {
            let received = measured.readings(0);
            vec![radio::cams(begin(radio::CAM_BYTES * received.len()), received).into_message()]
        }
        Kind::V2xCustom => {
            let received = measured.readings(0);
            vec![radio::texts(begin(radio::TEXT_BYTES * received.len()), received).into_message()]
        }
        _ => Vec::new(),
    }
}

/// Returns the other actor of an event. A static object of the town is no actor; it is named by its
/// tag, as in CARLA.
fn other(
    id: u32,
    tag: u32,
    actors: &mut ProxyActors,
    world: &World,
    blueprints: &[BlueprintInfo],
) -> Actor {
    let known = (id != 0).then(|| actors.actor(id, world, blueprints).cloned()).flatten();
    known.unwrap_or_else(|| {
        let label = LABELS.get(tag as usize).unwrap_or(&"other");
        let mut actor = Actor::default();
        actor.description.id = format!("static.{label}");
        actor.tag = tag as u8;
        actor
    })
}

/// CARLA's names of its tags.
const LABELS: [&str; 29] = [
    "none",
    "roads",
    "sidewalks",
    "buildings",
    "walls",
    "fences",
    "poles",
    "trafficlight",
    "trafficsigns",
    "vegetation",
    "terrain",
    "sky",
    "pedestrians",
    "rider",
    "car",
    "truck",
    "bus",
    "train",
    "motorcycle",
    "bicycle",
    "static",
    "dynamic",
    "other",
    "water",
    "roadlines",
    "ground",
    "bridge",
    "railtrack",
    "guardrail",
];
