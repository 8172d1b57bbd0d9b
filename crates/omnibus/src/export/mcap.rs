//! MCAP with the schemas of Foxglove: a file for each scene.

use std::{borrow::Cow, fs, path::Path};

use anyhow::Context;
use foxglove::{
    Calibration, Distortion, Entity, Message, WORLD, compressed_image, point_cloud, pose_in_frame,
    scene, timestamp, transform,
};
use mesh::Tag;

use crate::{
    collect::format::{ActorBox, Camera, LensName, Sensor},
    export::{
        geometry::{affine, affine_of_rows, intrinsics_of_centres},
        images::Images,
        mcap_file::{McapFile, Stamped},
        parallel::Threads,
        set::{Frame, Scene, Set},
    },
};

/// The space of the ego.
const EGO: &str = "ego";

/// The schemas of the ego's readings and the weather, which Foxglove has no schemas for.
const READINGS: &str = "omnibus.EgoSensors";
const WEATHER: &str = "omnibus.Weather";

/// Writes the files.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    threads: Threads,
) -> anyhow::Result<()> {
    let mut open: Option<(usize, McapFile)> = None;
    let convert = |index: usize| Ok((set.place(index), messages(&set.frame(index)?, images)?));
    threads.in_order(set.frames(), convert, |_, ((scene, _), messages)| {
        if open.as_ref().is_none_or(|(open, _)| *open != scene) {
            open.take().map_or(Ok(()), |(_, file)| file.finish())?;
            open = Some((scene, create(root, &set.scenes()[scene])?));
        }
        let Some((_, file)) = &mut open else { return Ok(()) };
        messages.iter().try_for_each(|message| file.put(message))
    })?;
    open.map_or(Ok(()), |(_, file)| file.finish())
}

/// Creates the file of a scene, with its attachments and its map.
fn create(root: &Path, scene: &Scene) -> anyhow::Result<McapFile> {
    // Images are compressed already; `mcap compress` makes the rest smaller.
    let mut file = McapFile::create(&root.join(format!("{}.mcap", scene.name)), None)?;
    let metadata = serde_json::to_vec_pretty(&scene.metadata)?;
    let map = fs::read(scene.map()).with_context(|| scene.map().display().to_string())?;
    file.attach("metadata.json", "application/json", metadata)?;
    file.attach("map.xodr", "application/xml", map)?;
    let time_nanos = scene.frame(0)?.line.sim_time_nanos;
    file.put(&Stamped::map(&scene.lane_map()?, time_nanos))?;
    Ok(file)
}

/// Returns the messages of a frame.
fn messages(frame: &Frame, images: &Images) -> anyhow::Result<Vec<Stamped>> {
    let now = frame.line.sim_time_nanos;
    let time = timestamp(now);
    let mut all = Vec::new();
    let mut put = |topic: Cow<'static, str>, schema, message: Message| {
        all.push(Stamped { topic, schema, time_nanos: now, data: message.0 });
    };
    let metadata = &frame.scene.metadata;
    let ego = affine(&frame.line.ego.world_from_vehicle);
    let mut transforms = Message::new().message(1, &transform(&time, [WORLD, EGO], &ego));
    for sensor in &metadata.settings.sensors {
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
    put("/ego/pose".into(), "foxglove.PoseInFrame", pose_in_frame(&time, &ego));
    for (sensor, camera) in frame.cameras() {
        let space = optical_space(sensor);
        let format = if images.extension() == "jpg" { "jpeg" } else { "png" };
        let mut image = compressed_image(&time, &space, format);
        images.append(frame, sensor, camera, &mut image, 2)?;
        put(format!("/{}/image", sensor.name).into(), "foxglove.CompressedImage", image);
        let calibration = calibration(camera).message(&time, &space);
        let topic = format!("/{}/calibration", sensor.name);
        put(topic.into(), "foxglove.CameraCalibration", calibration);
    }
    for (sensor, _) in frame.lidars() {
        let (points, labels) = (frame.points(sensor)?, frame.labels(sensor)?);
        let cloud = point_cloud(&time, &sensor.name, &points, &labels);
        put(format!("/{}/points", sensor.name).into(), "foxglove.PointCloud", cloud);
    }
    let boxes = frame.boxes()?;
    let update = scene(&time, boxes.iter().map(|actor| entity(&time, actor)));
    put("/boxes".into(), "foxglove.SceneUpdate", update);
    let data = serde_json::to_vec(&frame.line.weather)?;
    all.push(Stamped { topic: "/weather".into(), schema: WEATHER, time_nanos: now, data });
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

fn calibration(camera: &Camera) -> Calibration {
    let distortion = camera.lens.as_ref().map(|lens| match lens.model {
        LensName::BrownConrady => Distortion::PlumbBob(lens.coefficients.clone()),
        LensName::Fisheye => Distortion::KannalaBrandt(lens.coefficients.clone()),
    });
    Calibration {
        size: [camera.width_px, camera.height_px],
        intrinsics_px: intrinsics_of_centres(&camera.intrinsics_px),
        distortion,
    }
}

/// Returns an actor as a box in the colour of its tag.
fn entity(time: &Message, actor: &ActorBox) -> Message {
    let velocity = actor.velocity_mps.map(|value| value.to_string()).join(" ");
    Entity {
        id: &actor.actor_id.to_string(),
        name: &format!("{} {}", actor.tag_name, actor.actor_id),
        world_from_box: affine(&actor.world_from_box),
        size_m: actor.size_m,
        color: Tag::from_code(actor.tag).map_or([128; 3], Tag::color),
        has_heading: false,
        metadata: &[
            ("blueprint", &actor.blueprint),
            ("tag_name", &actor.tag_name),
            ("velocity_mps", &velocity),
        ],
    }
    .message(time)
}
