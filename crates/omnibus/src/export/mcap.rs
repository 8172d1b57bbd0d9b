//! MCAP with the schemas of Foxglove: a file for each scene.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    fs::{self, File},
    io::BufWriter,
    path::{Path, PathBuf},
};

use ::mcap::{Attachment, WriteOptions, Writer, records::MessageHeader};
use anyhow::Context;
use glam::{DAffine3, DVec3};
use mesh::Tag;

use crate::{
    collect::format::{ActorBox, Camera, Sensor},
    export::{
        foxglove::{self, Message, timestamp},
        geometry::{affine, affine_of_rows, intrinsics_of_centres, parts},
        images::Images,
        parallel::Threads,
        set::{Frame, Scene, Set},
    },
};

/// Spaces that every scene has.
const WORLD: &str = "world";
const EGO: &str = "ego";

/// A message of a frame.
struct Stamped {
    topic: Cow<'static, str>,
    schema: &'static str,
    time_nanos: u64,
    data: Vec<u8>,
}

/// A file that is written.
struct Open {
    scene: usize,
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    schemas: BTreeMap<&'static str, u16>,
    channels: BTreeMap<Cow<'static, str>, u16>,
    sequence: u32,
}

/// The schema of the ego's readings, which Foxglove has no schema for.
const READINGS: &str = "omnibus.EgoSensors";

/// Writes the files.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    threads: Threads,
) -> anyhow::Result<()> {
    let mut open: Option<Open> = None;
    let convert = |index: usize| Ok((set.place(index).0, messages(&set.frame(index)?, images)?));
    threads.in_order(set.frames(), convert, |_, (scene, messages)| {
        if open.as_ref().is_none_or(|open| open.scene != scene) {
            open.take().map_or(Ok(()), Open::finish)?;
            open = Some(Open::create(root, scene, &set.scenes()[scene])?);
        }
        let Some(open) = &mut open else { return Ok(()) };
        messages.iter().try_for_each(|message| open.put(message))
    })?;
    open.map_or(Ok(()), Open::finish)
}

impl Open {
    fn create(root: &Path, number: usize, scene: &Scene) -> anyhow::Result<Open> {
        let path = root.join(format!("{}.mcap", scene.name));
        let shown = || path.display().to_string();
        let file = File::create(&path).with_context(shown)?;
        // Images are compressed already; `mcap compress` makes the rest smaller.
        let options = WriteOptions::new()
            .profile("")
            .library(concat!("omnibus ", env!("CARGO_PKG_VERSION")))
            .compression(None);
        let mut writer =
            options.create(BufWriter::with_capacity(1 << 20, file)).with_context(shown)?;
        let metadata = serde_json::to_vec_pretty(&scene.metadata)?;
        let map = fs::read(scene.map()).with_context(|| scene.map().display().to_string())?;
        for (name, kind, data) in
            [("metadata.json", "application/json", metadata), ("map.xodr", "application/xml", map)]
        {
            let attachment = Attachment {
                log_time: 0,
                create_time: 0,
                name: name.to_owned(),
                media_type: kind.to_owned(),
                data: data.into(),
            };
            writer.attach(&attachment).with_context(shown)?;
        }
        let (schemas, channels) = (BTreeMap::new(), BTreeMap::new());
        Ok(Open { scene: number, path, writer, schemas, channels, sequence: 0 })
    }

    fn put(&mut self, message: &Stamped) -> anyhow::Result<()> {
        self.write(message).with_context(|| self.path.display().to_string())
    }

    fn write(&mut self, message: &Stamped) -> ::mcap::McapResult<()> {
        let channel_id = match self.channels.get(&message.topic) {
            Some(id) => *id,
            None => self.add_channel(message)?,
        };
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time: message.time_nanos,
            publish_time: message.time_nanos,
        };
        self.sequence += 1;
        self.writer.write_to_known_channel(&header, &message.data)
    }

    fn add_channel(&mut self, message: &Stamped) -> ::mcap::McapResult<u16> {
        let name = message.schema;
        let is_json = name == READINGS;
        let schema = match self.schemas.get(name) {
            Some(id) => *id,
            None if is_json => {
                self.writer.add_schema(name, "jsonschema", br#"{"type": "object"}"#)?
            }
            None => self.writer.add_schema(name, "protobuf", &foxglove::descriptor())?,
        };
        self.schemas.insert(name, schema);
        let encoding = if is_json { "json" } else { "protobuf" };
        let id = self.writer.add_channel(schema, &message.topic, encoding, &BTreeMap::new())?;
        self.channels.insert(message.topic.clone(), id);
        Ok(id)
    }

    fn finish(mut self) -> anyhow::Result<()> {
        self.writer.finish().with_context(|| self.path.display().to_string())?;
        Ok(())
    }
}

/// Returns the messages of a frame.
fn messages(frame: &Frame, images: &Images) -> anyhow::Result<Vec<Stamped>> {
    let now = frame.line.sim_time_nanos;
    let time = timestamp(now);
    let mut all = Vec::new();
    let mut put = |topic: Cow<'static, str>, schema, message: Message| {
        all.push(Stamped { topic, schema, time_nanos: now, data: message.0 });
    };
    let scene = frame.scene;
    let ego = affine(&frame.line.ego.world_from_vehicle);
    let mut transforms = Message::new().message(1, &transform(&time, [WORLD, EGO], &ego));
    for sensor in &scene.metadata.settings.sensors {
        let vehicle_from_sensor = affine_of_rows(&sensor.vehicle_from_sensor);
        let name = &sensor.name;
        transforms = transforms.message(1, &transform(&time, [EGO, name], &vehicle_from_sensor));
        if let Some(camera) = &sensor.camera {
            let optical = affine_of_rows(&camera.vehicle_from_optical);
            transforms =
                transforms.message(1, &transform(&time, [EGO, &optical_space(sensor)], &optical));
        }
    }
    put("/tf".into(), "foxglove.FrameTransforms", transforms);
    let pose = Message::new().message(1, &time).text(2, WORLD).message(3, &pose(&ego));
    put("/ego/pose".into(), "foxglove.PoseInFrame", pose);
    for (sensor, camera) in frame.cameras() {
        let space = optical_space(sensor);
        let file = images.file(frame, sensor, camera)?;
        let format = if images.extension() == "jpg" { "jpeg" } else { "png" };
        let image = Message::new().message(1, &time).text(4, &space);
        let image = image.bytes(2, &file).text(3, format);
        put(format!("/{}/image", sensor.name).into(), "foxglove.CompressedImage", image);
        let calibration = calibration(&time, &space, camera);
        let topic = format!("/{}/calibration", sensor.name);
        put(topic.into(), "foxglove.CameraCalibration", calibration);
    }
    for (sensor, _) in frame.lidars() {
        let (points, labels) = (frame.points(sensor)?, frame.labels(sensor)?);
        let cloud = point_cloud(&time, &sensor.name, &points, &labels);
        put(format!("/{}/points", sensor.name).into(), "foxglove.PointCloud", cloud);
    }
    // Objects that are seen no longer disappear.
    let deletion = Message::new().message(1, &time).integer(2, 1);
    let mut update = Message::new().message(1, &deletion);
    for actor in frame.boxes()? {
        update = update.message(2, &entity(&time, &actor));
    }
    put("/boxes".into(), "foxglove.SceneUpdate", update);
    for reading in &frame.line.ego_sensors {
        let time_nanos = reading.sim_time_nanos;
        let gnss = &reading.gnss;
        let fix = Message::new()
            .message(6, &timestamp(time_nanos))
            .text(7, "gnss")
            .double(1, gnss.latitude_deg)
            .double(2, gnss.longitude_deg)
            .double(3, gnss.altitude_m);
        let topic = Cow::Borrowed("/gnss");
        all.push(Stamped { topic, schema: "foxglove.LocationFix", time_nanos, data: fix.0 });
        let data = serde_json::to_vec(reading)?;
        let topic = Cow::Borrowed("/ego/sensors");
        all.push(Stamped { topic, schema: READINGS, time_nanos, data });
    }
    Ok(all)
}

fn optical_space(sensor: &Sensor) -> String {
    format!("{}_optical", sensor.name)
}

fn vector(vector: DVec3) -> Message {
    Message::new().double(1, vector.x).double(2, vector.y).double(3, vector.z)
}

/// Returns `foxglove.Quaternion` and the position of a transform.
fn rigid(transform: &DAffine3) -> (Message, Message) {
    let (position, q) = parts(transform);
    let rotation = Message::new().double(1, q.x).double(2, q.y).double(3, q.z).double(4, q.w);
    (vector(position), rotation)
}

fn pose(of: &DAffine3) -> Message {
    let (position, rotation) = rigid(of);
    Message::new().message(1, &position).message(2, &rotation)
}

/// Returns `foxglove.FrameTransform`: `parent_from_child`.
fn transform(time: &Message, [parent, child]: [&str; 2], of: &DAffine3) -> Message {
    let (position, rotation) = rigid(of);
    let message = Message::new().message(1, time).text(2, parent).text(3, child);
    message.message(4, &position).message(5, &rotation)
}

fn calibration(time: &Message, space: &str, camera: &Camera) -> Message {
    let [x, y, z] = intrinsics_of_centres(&camera.intrinsics_px);
    let projection = [x, y, z].map(|row| [row[0], row[1], row[2], 0.0]);
    Message::new()
        .message(1, time)
        .text(9, space)
        .fixed32(2, camera.width_px)
        .fixed32(3, camera.height_px)
        .text(4, "plumb_bob")
        .doubles(5, &[0.0; 5])
        .doubles(6, [x, y, z].as_flattened())
        .doubles(7, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
        .doubles(8, projection.as_flattened())
}

/// The fields of a point: name, offset, `PackedElementField.NumericType`.
const POINT: [(&str, u32, u64); 6] =
    [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("id", 16, 5), ("tag", 20, 5)];

fn point_cloud(time: &Message, space: &str, points: &[u8], labels: &[u8]) -> Message {
    let mut data = Vec::with_capacity(points.len() + labels.len());
    for (point, label) in points.chunks_exact(16).zip(labels.chunks_exact(8)) {
        data.extend_from_slice(point);
        data.extend_from_slice(label);
    }
    let (origin, rotation) = rigid(&DAffine3::IDENTITY);
    let pose = Message::new().message(1, &origin).message(2, &rotation);
    let mut cloud = Message::new().message(1, time).text(2, space).message(3, &pose);
    cloud = cloud.fixed32(4, 24);
    for (name, offset, kind) in POINT {
        let field = Message::new().text(1, name).fixed32(2, offset).integer(3, kind);
        cloud = cloud.message(5, &field);
    }
    cloud.bytes(6, &data)
}

/// Returns an actor as a coloured, transparent box with its name.
fn entity(time: &Message, actor: &ActorBox) -> Message {
    let [red, green, blue] = Tag::from_code(actor.tag).map_or([128; 3], Tag::color);
    let color = |alpha: f64| {
        let [r, g, b] = [red, green, blue].map(|value| f64::from(value) / 255.0);
        Message::new().double(1, r).double(2, g).double(3, b).double(4, alpha)
    };
    let world_from_box = affine(&actor.world_from_box);
    let size = actor.size_m.map(f64::from);
    let cube = Message::new()
        .message(1, &pose(&world_from_box))
        .message(2, &vector(DVec3::from_array(size)))
        .message(3, &color(0.5));
    let above = DAffine3::from_translation(DVec3::Z * (0.5 * size[2] + 0.4)) * world_from_box;
    let name = format!("{} {}", actor.tag_name, actor.actor_id);
    let text = Message::new()
        .message(1, &pose(&above))
        .integer(2, 1)
        .double(3, 0.4)
        .message(5, &color(1.0))
        .text(6, &name);
    let velocity = actor.velocity_mps.map(|value| value.to_string()).join(" ");
    let mut entity =
        Message::new().message(1, time).text(2, WORLD).text(3, &actor.actor_id.to_string());
    for (key, value) in [
        ("blueprint", actor.blueprint.as_str()),
        ("tag_name", &actor.tag_name),
        ("velocity_mps", &velocity),
    ] {
        entity = entity.message(6, &Message::new().text(1, key).text(2, value));
    }
    entity.message(8, &cube).message(13, &text)
}
