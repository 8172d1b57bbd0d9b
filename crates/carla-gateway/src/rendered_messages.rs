//! Measurements of cameras, lidars and radars as CARLA's messages: BGRA images, and points with y
//! to the right.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use client_lib::{ActorId, Client, EventCamera, Measurement, Radar};
use glam::Vec3;

use crate::{
    args::RpcError,
    cosmos::{self, Canvas, Stroke},
    pixels::{OPAQUE, bgra, pixels},
    sensor::Sensor,
    sensor_kind::Kind,
    statics::Statics,
    stream::{Message, Streams},
    textures,
    wire::{Bytes, Description, message},
};

/// The depth that the value 1.0 of a depth image stands for. Metres.
const DEPTH_FULL_M: f32 = 1000.0;

/// A measurement and what its messages need besides. It owns all of it, so that the messages are made
/// without the lock of the bridge.
pub(crate) struct Rendered {
    measured: Measurement,
    kind: Kind,
    stream: u32,
    description: Arc<Description>,
    /// The textures of a camera and their streams.
    textures: Vec<(u32, u32)>,
    events: Option<Arc<Mutex<EventCamera>>>,
    radar: Option<RadarScan>,
    lines: Option<Lines>,
}

/// The lines that a Cosmos visualization shows.
struct Lines {
    /// Those of the map.
    of: Arc<Statics>,
    boxes: Vec<Stroke>,
}

/// What the detections of a radar depend on besides the measurement.
struct RadarScan {
    radar: Radar,
    velocities: BTreeMap<ActorId, Vec3>,
}

impl Rendered {
    /// Adds to a measurement what its messages need besides.
    ///
    /// # Errors
    ///
    /// Returns an error if an attribute of a radar is invalid.
    pub(crate) fn new(
        sensor: &Sensor,
        measured: Measurement,
        client: &Client,
        statics: &Arc<Statics>,
    ) -> Result<Rendered, RpcError> {
        let radar = if sensor.kind == Kind::Radar {
            let states = client.world().states();
            let velocities = states.iter().map(|a| (a.actor_id, a.velocity())).collect();
            Some(RadarScan { radar: sensor.radar()?, velocities })
        } else {
            None
        };
        let lines = (sensor.kind == Kind::Cosmos).then(|| Lines {
            of: Arc::clone(statics),
            boxes: cosmos::of_actors(client.world(), client.blueprints()),
        });
        Ok(Rendered {
            measured,
            kind: sensor.kind,
            stream: sensor.stream,
            description: Arc::clone(&sensor.description),
            textures: sensor.textures.iter().map(|(texture, stream)| (*texture, *stream)).collect(),
            events: sensor.events.clone(),
            radar,
            lines,
        })
    }

    /// Makes the messages that a listener has room for, and sends them.
    pub(crate) fn send(&self, to: &Streams) {
        let plane = self.measured.planes().first();
        let bytes = plane.map_or(0, |p| 4 * p.width as usize * p.height as usize);
        // An event camera compares each image with the one before.
        if (self.kind == Kind::Events || to.has_room(self.stream, bytes))
            && let Some(message) = self.message()
        {
            to.publish(self.stream, message);
        }
        let fov_deg = self.description.number("fov", 90.0).unwrap_or(90.0);
        for (texture, stream) in &self.textures {
            if to.has_room(*stream, bytes)
                && let Some(message) = textures::message_of(*texture, &self.measured, fov_deg)
            {
                to.publish(*stream, message);
            }
        }
    }

    /// Returns the message, or `None` if the bundle lacks what the sensor outputs.
    fn message(&self) -> Option<Message> {
        let measured = &self.measured;
        let plane = measured.planes().first()?;
        let (width, height) = (plane.width as usize, plane.height as usize);
        let begin = |body: usize| {
            let stamp = measured.header().stamp;
            message(
                self.kind.type_id(),
                stamp.frame.0,
                stamp.sim_time_nanos,
                &plane.world_from_sensor,
                body,
            )
        };
        let image = || {
            let mut bytes = begin(12 + 4 * width * height);
            let fov = self.description.number("fov", 90.0).unwrap_or(90.0);
            bytes.u32(plane.width).u32(plane.height).f32(fov);
            bytes
        };
        let bytes = match self.kind {
            Kind::Rgb => pixels(image(), measured.color(0)?.iter(), |rgba| bgra(*rgba)),
            Kind::Depth => pixels(image(), measured.depth(0)?.iter(), |depth| depth_pixel(*depth)),
            Kind::Semantic => {
                pixels(image(), measured.tags(0)?.iter(), |tag| OPAQUE | u32::from(*tag) << 16)
            }
            Kind::Instance => {
                let both = measured.tags(0)?.iter().zip(measured.instances(0)?);
                pixels(image(), both, |(tag, id)| {
                    OPAQUE | u32::from(*tag) << 16 | (id & 0xff) << 8 | (id >> 8 & 0xff)
                })
            }
            Kind::Cosmos => {
                let lines = self.lines.as_ref()?;
                let fov_deg = self.description.number("fov", 90.0).unwrap_or(90.0);
                let mut canvas = Canvas::new([width, height], fov_deg, &plane.world_from_sensor);
                lines.of.strokes().iter().chain(&lines.boxes).for_each(|line| canvas.draw(line));
                pixels(image(), canvas.pixels.iter(), |word| *word)
            }
            Kind::Normals => {
                pixels(image(), measured.normals(0)?.iter(), |normal| normal_pixel(*normal))
            }
            Kind::Flow => {
                let mut bytes = image();
                let scale = [2.0 / width as f32, -2.0 / height as f32];
                for flow in measured.flow(0)? {
                    // Fractions of half the image, positive upwards, within CARLA's range.
                    let [x, y] = [0, 1].map(|axis| (flow[axis] * scale[axis]).clamp(-2.0, 2.0));
                    bytes.f32(x).f32(y);
                }
                bytes
            }
            Kind::Events => {
                let mut bytes = image();
                let now_nanos = measured.header().stamp.sim_time_nanos;
                let size = [plane.width, plane.height];
                let mut camera =
                    self.events.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner);
                let events = camera.update(size, measured.color(0)?, now_nanos);
                if events.is_empty() {
                    return None;
                }
                for event in events {
                    bytes.put(event.x.to_le_bytes()).put(event.y.to_le_bytes());
                    bytes
                        .put((event.time_nanos as i64).to_le_bytes())
                        .put([event.is_brighter.into()]);
                }
                bytes
            }
            Kind::Lidar | Kind::SemanticLidar => {
                let each = if self.kind == Kind::Lidar { 16 } else { 24 };
                let mut bytes = begin(8 + 4 * height + each * width * height);
                let azimuth = -plane.first_azimuth_rad;
                bytes.f32(azimuth.rem_euclid(std::f32::consts::TAU)).u32(plane.height);
                append_lidar(bytes, measured, [width, height], self.kind)?
            }
            Kind::Radar => {
                let scan = self.radar.as_ref()?;
                append_radar(begin(16 * scan.radar.points), scan, measured)?
            }
            _ => return None,
        };
        Some(bytes.into_message())
    }
}

/// Returns a depth pixel: metres as a fraction of 1000 m in 24 bits, the lowest in red, the highest
/// in blue.
fn depth_pixel(depth_m: f32) -> u32 {
    let fraction = f64::from(depth_m.clamp(0.0, DEPTH_FULL_M)) / f64::from(DEPTH_FULL_M);
    let code = (fraction * 16_777_215.0 + 0.5) as u32;
    OPAQUE | (code & 0xff) << 16 | code & 0xff00 | code >> 16 & 0xff
}

/// Returns a normal pixel: the axes of the camera, y to the right, as red, green and blue. −1 is 0,
/// 1 is 255.
fn normal_pixel([x, y, z]: [f32; 3]) -> u32 {
    let code = |fraction: f32| ((fraction * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0 + 0.5) as u32;
    OPAQUE | code(x) << 16 | code(-y) << 8 | code(z)
}

/// Appends the returns of a lidar, channel by channel, after the number of returns of each channel.
fn append_lidar(
    mut bytes: Bytes,
    measured: &Measurement,
    [columns, channels]: [usize; 2],
    kind: Kind,
) -> Option<Bytes> {
    let points = measured.points(0)?;
    let labels = measured.labels(0);
    let counts_at = bytes.0.len();
    bytes.0.resize(counts_at + 4 * channels, 0);
    for channel in 0..channels {
        let mut count = 0u32;
        for column in 0..columns {
            let ray = column * channels + channel;
            let [x, y, z, intensity] = *points.get(ray)?;
            if [x, y, z] == [0.0; 3] {
                continue;
            }
            count += 1;
            bytes.vector([x, -y, z]);
            if kind == Kind::Lidar {
                bytes.f32(intensity);
            } else {
                let [id, tag] = *labels?.get(ray)?;
                // The point attribute of a semantic lidar is the cosine of incidence.
                bytes.f32(intensity).u32(id).u32(tag);
            }
        }
        let at = counts_at + 4 * channel;
        bytes.0[at..at + 4].copy_from_slice(&count.to_le_bytes());
    }
    Some(bytes)
}

/// Appends the detections of a radar: radial velocity, azimuth to the right, altitude and depth.
fn append_radar(mut bytes: Bytes, scan: &RadarScan, measured: &Measurement) -> Option<Bytes> {
    let plane = measured.planes().first()?;
    let header = measured.header();
    let velocity_of = |id: ActorId| scan.velocities.get(&id).copied().unwrap_or(Vec3::ZERO);
    let detections = scan.radar.detections(
        header.stamp.sim_time_nanos,
        plane,
        measured.points(0)?,
        measured.labels(0)?,
        velocity_of,
        header.parent,
    );
    for (found, _) in detections {
        bytes.f32(found.velocity_mps).f32(-found.azimuth_rad);
        bytes.f32(found.altitude_rad).f32(found.depth_m);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn red_and_blue_are_swapped() {
        assert_eq!(bgra([1, 2, 3, 4]).to_le_bytes(), [3, 2, 1, 255]);
    }

    #[test]
    fn a_normal_to_the_right_is_green() {
        assert_eq!(normal_pixel([0.0, -1.0, 0.0]).to_le_bytes(), [128, 255, 128, 255]);
        assert_eq!(normal_pixel([-1.0, 0.0, 1.0]).to_le_bytes(), [255, 128, 0, 255]);
    }

    #[test]
    fn a_depth_pixel_decodes_to_its_metres() {
        for depth_m in [0.0, 0.5, 12.34, 999.0, 1000.0, 5000.0] {
            let [b, g, r, _] = depth_pixel(depth_m).to_le_bytes().map(f64::from);
            let decoded = (r + 256.0 * g + 65536.0 * b) / 16_777_215.0 * 1000.0;
            assert!((decoded - f64::from(depth_m.min(1000.0))).abs() < 1e-4, "{depth_m}");
        }
    }
}
