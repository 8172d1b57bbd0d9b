//! Sensors that the host measures in the midst of physics: what it is told in CARLA's words, and
//! what it says as CARLA's messages.

use client_lib::{
    BlueprintInfo, GnssSpec, ImuSpec, Measurement, ObstacleSpec, Pose, SensorSpec, World, cam,
    collision, geodesy, gnss, imu, obstacle,
};

use crate::{
    args::Refusal,
    cast::Cast,
    msgpack::Pack,
    radio,
    sensor::{Kind, Sensor},
    stream::Message,
    wire::{Actor, Description, flip, flip_turn, message},
};

/// What an accelerometer of CARLA's shows at most.
const ACCELERATION_MAX_MPS2: f32 = 99.9;

/// What the host is to measure; nothing if it is another's work.
pub(crate) fn spec(
    kind: Kind,
    d: &Description,
    pose: Pose,
    gravity_mps2: f32,
) -> Result<Option<SensorSpec>, Refusal> {
    let number = |id: &str, otherwise: f32| d.number(id, otherwise);
    let axes = |what: &str| -> Result<[f32; 3], Refusal> {
        Ok([
            number(&format!("{what}_x"), 0.0)?,
            number(&format!("{what}_y"), 0.0)?,
            number(&format!("{what}_z"), 0.0)?,
        ])
    };
    let spec = match kind {
        Kind::Imu => {
            let errors = ImuSpec {
                accelerometer_stddev_mps2: axes("noise_accel_stddev")?.map(f32::abs),
                gyroscope_stddev_radps: axes("noise_gyro_stddev")?.map(f32::abs),
                // The same turn the other way round is the same in both hands.
                gyroscope_bias_radps: flip_turn(axes("noise_gyro_bias")?),
                gravity_mps2,
                accelerometer_max_mps2: ACCELERATION_MAX_MPS2,
                ..ImuSpec::default()
            };
            imu("imu", pose, errors)
        }
        Kind::Gnss => {
            let errors = GnssSpec {
                latitude_stddev_deg: number("noise_lat_stddev", 0.0)?.abs(),
                latitude_bias_deg: number("noise_lat_bias", 0.0)?,
                longitude_stddev_deg: number("noise_lon_stddev", 0.0)?.abs(),
                longitude_bias_deg: number("noise_lon_bias", 0.0)?,
                altitude_stddev_m: number("noise_alt_stddev", 0.0)?.abs(),
                altitude_bias_m: number("noise_alt_bias", 0.0)?,
                geodesy: geodesy::CARLA,
                ..GnssSpec::default()
            };
            gnss("gnss", pose, errors)
        }
        Kind::Collision => collision("collision"),
        Kind::Obstacle => {
            let look = ObstacleSpec {
                distance_m: number("distance", 5.0)?.max(0.01),
                hit_radius_m: number("hit_radius", 0.5)?.max(0.001),
                only_dynamics: d.flag("only_dynamics").into(),
            };
            obstacle("obstacle", pose, look)
        }
        Kind::V2x => cam("v2x", pose, radio::cam_spec(d)?),
        Kind::V2xCustom => client_lib::message("v2x_custom", pose, radio::text_spec(d)?),
        _ => return Ok(None),
    };
    let seed = number("noise_seed", 0.0)? as u64;
    let spec = SensorSpec { seed, ..spec };
    spec.check_physics_sensor().map_err(Refusal::from)?;
    Ok(Some(spec))
}

/// The messages of one measurement: one for each event.
pub(crate) fn messages_of(
    sensor: &Sensor,
    carrier: u32,
    measured: &Measurement,
    cast: &mut Cast,
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
            let Some(felt) = measured.imu(0) else { return Vec::new() };
            body.list(3)
                .vector(flip(felt.accelerometer_mps2))
                .vector(flip_turn(felt.gyroscope_radps))
                .f32(felt.compass_rad);
            vec![wrap(&body)]
        }
        Kind::Gnss => {
            let Some(fix) = measured.gnss(0) else { return Vec::new() };
            body.list(3).f64(fix.latitude_deg).f64(fix.longitude_deg).f64(fix.altitude_m);
            vec![wrap(&body)]
        }
        Kind::Collision => {
            let mut messages = Vec::new();
            let own = cast.actor(carrier, world, blueprints).cloned();
            for hit in measured.collisions(0) {
                let Some(own) = &own else { break };
                let other = other(hit.other.0, hit.tag, cast, world, blueprints);
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
            let Some(seen) = measured.obstacle(0) else { return Vec::new() };
            let Some(own) = cast.actor(carrier, world, blueprints).cloned() else {
                return Vec::new();
            };
            let other = other(seen.other.0, seen.tag, cast, world, blueprints);
            body.list(3);
            own.write(&mut body);
            other.write(&mut body);
            body.f32(seen.distance_m);
            vec![wrap(&body)]
        }
        Kind::V2x => {
            let heard = measured.cams(0);
            vec![radio::cams(begin(radio::CAM_BYTES * heard.len()), heard).into_message()]
        }
        Kind::V2xCustom => {
            let heard = measured.messages(0);
            vec![radio::texts(begin(radio::TEXT_BYTES * heard.len()), heard).into_message()]
        }
        _ => Vec::new(),
    }
}

/// Who it was; a thing of the town is no actor, and is called by its tag, as CARLA does.
fn other(id: u32, tag: u32, cast: &mut Cast, world: &World, blueprints: &[BlueprintInfo]) -> Actor {
    let known = (id != 0).then(|| cast.actor(id, world, blueprints).cloned()).flatten();
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
