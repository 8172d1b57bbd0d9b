//! Data sets of `omnibus collect` for `omnibus view`.

use std::{collections::BTreeMap, fs, path::Path, time::Duration};

use anyhow::{Context, anyhow};
use client_lib::{ActorKind, DEPTH_FAR_M, LightPhase};
use protocol::{Pose, Weather};
use view::{DataSet, Measured, ReadError, StoredActor, StoredBox, StoredFrame, StoredScene};

use crate::{
    collect::{
        Encoder, decode,
        format::{ActorBox, Sensor, Transform, WeatherSettings},
    },
    export::{
        is_static,
        set::{Frame, Scene, Set},
    },
};

/// A depth image of a data set is in centimetres; this value is the sky, and everything farther.
const DEPTH_SKY: u16 = u16::MAX;

/// What a page names, and the folder of the images of a camera.
const OUTPUTS: [(&str, &str); 4] =
    [("color", "color"), ("depth", "depth"), ("tags", "tag"), ("instances", "instance")];

/// Data sets that are shown.
pub(crate) struct StoredSet(Set);

impl StoredSet {
    /// Opens a data set, or those in the `scene-*` of a folder.
    pub(crate) fn open(dir: &Path) -> anyhow::Result<StoredSet> {
        Ok(StoredSet(Set::open(&[dir.to_owned()])?))
    }

    fn read(&self, index: usize, sensor: &str, output: &str) -> anyhow::Result<Measured> {
        let frame = self.0.frame(index)?;
        let sensors = &frame.scene.metadata.settings.sensors;
        let sensor = sensors.iter().find(|own| own.name == sensor).with_context(|| {
            let names: Vec<&str> = sensors.iter().map(|own| own.name.as_str()).collect();
            format!("no sensor {sensor:?}; this scene has {}", names.join(", "))
        })?;
        if output == "lidar" && sensor.lidar.is_some() {
            return points(&frame, sensor);
        }
        let folder = OUTPUTS.iter().find(|(name, _)| *name == output).map(|(_, folder)| *folder);
        let found = folder.filter(|folder| frame.scene.has(sensor, folder));
        let (Some(folder), Some(camera)) = (found, &sensor.camera) else {
            return Err(anyhow!("sensor {:?} has no output {output:?}", sensor.name));
        };
        let size = [camera.width_px, camera.height_px];
        if output == "color" {
            let folder = format!("{}/color", sensor.name);
            let extension = frame.scene.metadata.extension(&folder);
            if ["png", "jpg"].contains(&extension) {
                return Ok(Measured::Color(frame.bytes(&folder, extension)?));
            }
            // A browser shows no arrays.
            let mut encoder = Encoder::default();
            encoder.picture(size, &frame.image(sensor, camera, output)?.bytes)?;
            return Ok(Measured::Color(encoder.file));
        }
        let image = frame.image(sensor, camera, folder)?;
        Ok(match output {
            "depth" => Measured::Depth {
                size,
                depths_m: image.sixteen().into_iter().map(depth_m).collect(),
            },
            "tags" => Measured::Tags { size, codes: image.bytes },
            _ => Measured::Instances { size, ids: image.ids() },
        })
    }
}

impl DataSet for StoredSet {
    fn frames(&self) -> usize {
        self.0.frames()
    }

    fn scene_of(&self, index: usize) -> usize {
        self.0.place(index).0
    }

    fn scene(&self, scene: usize) -> Result<StoredScene, ReadError> {
        let scene = &self.0.scenes()[scene];
        let map = scene.map();
        let open_drive = fs::read_to_string(&map).with_context(|| map.display().to_string())?;
        let place = |index| {
            let [x, y, _] = scene.frame(index)?.line.ego.world_from_vehicle.position_m;
            Ok([x, y])
        };
        let path_m: anyhow::Result<Vec<[f32; 2]>> = (0..scene.frames()).map(place).collect();
        Ok(StoredScene {
            name: scene.name.clone(),
            map: scene.metadata.settings.map.clone(),
            open_drive,
            sensors: sensors(scene),
            path_m: path_m?,
        })
    }

    fn frame(&self, index: usize) -> Result<StoredFrame, ReadError> {
        let frame = self.0.frame(index)?;
        let seen = frame.boxes()?;
        let line = &frame.line;
        let ego = &frame.scene.metadata.settings.ego_blueprint;
        let half_extents_m = town::blueprint(ego).map_or([2.0, 1.0], |(_, made)| {
            let [length, width, _] = made.half_extents_m.to_array();
            [length, width]
        });
        let mut actors = vec![StoredActor {
            id: line.ego.actor_id,
            kind: ActorKind::Vehicle,
            blueprint: ego.clone(),
            pose: pose(&line.ego.world_from_vehicle),
            half_extents_m,
            velocity_mps: line.ego.velocity_mps,
            phase: None,
        }];
        // What grows or stands at the roadside is no actor; parked vehicles are of interest.
        actors.extend(
            seen.iter().filter(|seen| !is_static(seen) || !seen.blueprint.is_empty()).map(actor),
        );
        let mut boxes: BTreeMap<String, Vec<StoredBox>> = BTreeMap::new();
        for seen in &seen {
            for (camera, view) in &seen.cameras {
                boxes.entry(camera.clone()).or_default().push(StoredBox {
                    id: seen.actor_id,
                    tag: seen.tag,
                    name: seen.tag_name.clone(),
                    visible_px: view.visible_box_px,
                });
            }
        }
        Ok(StoredFrame {
            frame: line.frame,
            sim_time: Duration::from_nanos(line.sim_time_nanos),
            weather: weather(&line.weather),
            ego: line.ego.actor_id,
            actors,
            boxes,
        })
    }

    fn measured(&self, index: usize, sensor: &str, output: &str) -> Result<Measured, ReadError> {
        Ok(self.read(index, sensor, output)?)
    }
}

/// Returns the sensors that have images or points, with their outputs.
fn sensors(scene: &Scene) -> Vec<(String, Vec<&'static str>)> {
    let outputs = |sensor: &Sensor| -> Vec<&'static str> {
        if sensor.lidar.is_some() {
            return vec!["lidar"];
        }
        let has = |(_, folder): &&(&'static str, &'static str)| scene.has(sensor, folder);
        OUTPUTS.iter().filter(has).map(|(name, _)| *name).collect()
    };
    let all = scene.metadata.settings.sensors.iter();
    all.map(|sensor| (sensor.name.clone(), outputs(sensor)))
        .filter(|(_, outputs)| !outputs.is_empty())
        .collect()
}

fn points(frame: &Frame<'_>, sensor: &Sensor) -> anyhow::Result<Measured> {
    let numbers = decode::floats(&frame.points(sensor)?);
    let labels = decode::words(&frame.labels(sensor)?);
    let point = |p: &[f32]| [p[0], p[1], p[2], p[3]];
    Ok(Measured::Points {
        points: numbers.chunks_exact(4).map(point).collect(),
        labels: labels.chunks_exact(2).map(|label| [label[0], label[1]]).collect(),
    })
}

fn depth_m(centimetres: u16) -> f32 {
    if centimetres == DEPTH_SKY { DEPTH_FAR_M } else { f32::from(centimetres) / 100.0 }
}

fn pose(transform: &Transform) -> Pose {
    Pose { position_m: transform.position_m, rotation: transform.rotation_xyzw }
}

fn actor(seen: &ActorBox) -> StoredActor {
    let [length, width, _] = seen.size_m;
    StoredActor {
        id: seen.actor_id,
        kind: kind(seen),
        blueprint: seen.blueprint.clone(),
        pose: pose(&seen.world_from_box),
        half_extents_m: [length / 2.0, width / 2.0],
        velocity_mps: seen.velocity_mps,
        phase: seen.traffic_light_state.as_deref().map(|state| match state {
            "red" => LightPhase::Red,
            "yellow" => LightPhase::Yellow,
            "green" => LightPhase::Green,
            _ => LightPhase::Off,
        }),
    }
}

/// Returns the kind of an actor; parked vehicles are props, because nothing drives them.
fn kind(seen: &ActorBox) -> ActorKind {
    if seen.traffic_light_state.is_some() {
        return ActorKind::TrafficLight;
    }
    match seen.blueprint.split('.').next() {
        Some("vehicle") if !is_static(seen) => ActorKind::Vehicle,
        Some("walker") => ActorKind::Walker,
        _ => ActorKind::Prop,
    }
}

fn weather(weather: &WeatherSettings) -> Weather {
    Weather {
        cloudiness: weather.cloudiness,
        precipitation: weather.precipitation,
        precipitation_deposits: weather.precipitation_deposits,
        wind_intensity: weather.wind_intensity,
        sun_azimuth_rad: weather.sun_azimuth_rad,
        sun_altitude_rad: weather.sun_altitude_rad,
        fog_density: weather.fog_density,
        fog_distance_m: weather.fog_distance_m,
        wetness: weather.wetness,
    }
}
