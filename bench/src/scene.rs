//! The scenes of the benchmarks: maps, cars, street poses.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use client_lib::{Client, ClientError, Pose, Spawn, wire::Settings};
use glam::Vec3;

/// Simulated time of a tick.
pub(crate) const DELTA_NANOS: u64 = 50_000_000;
/// Cars of the bench scene.
pub(crate) const CARS: usize = 100;
/// Camera poses of the bench scene.
pub(crate) const POSES: usize = 16;
/// The environment variable of the folder of maps that are not included.
const MAPS: &str = "OMNIBUS_MAPS";
const TOWN: &str = "carla2021-scenic__Town10HD.xodr";
/// A camera's height above the road, a little more than a car's. Metres.
const EYES_M: f32 = 2.0;
/// Height of [`Client::spawn_points`] above the road. Metres.
const SPAWN_HEIGHT_M: f32 = 0.5;

/// A folder that is removed when it is dropped.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> anyhow::Result<Scratch> {
        let path = std::env::temp_dir().join(crate::sim::unique_name());
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        Ok(Scratch(path))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A map: its `--map` argument, and its title.
pub(crate) struct Map {
    pub(crate) arg: String,
    pub(crate) title: String,
    _home: Option<Scratch>,
}

/// Returns one straight road of 200 m without actors, not even a traffic light.
pub(crate) fn one_road() -> anyhow::Result<Map> {
    let home = Scratch::new()?;
    let path = home.path().join("one-road.xodr");
    fs::write(&path, ONE_ROAD).with_context(|| path.display().to_string())?;
    let arg = path.to_str().context("the temporary folder's name is not UTF-8")?.to_owned();
    Ok(Map { arg, title: "one road".to_owned(), _home: Some(home) })
}

/// Returns Town10HD if OMNIBUS_MAPS has it, or the default map.
pub(crate) fn bench_map() -> anyhow::Result<Map> {
    let Some(folder) = std::env::var_os(MAPS) else {
        let (name, _) = mapgen::default_map();
        return Ok(Map { arg: name.to_owned(), title: name.to_owned(), _home: None });
    };
    let path = Path::new(&folder).join(TOWN);
    anyhow::ensure!(path.is_file(), "{MAPS} names a folder without {TOWN}; unset it for our town");
    let arg = path.to_str().context("OMNIBUS_MAPS is not UTF-8")?.to_owned();
    Ok(Map { arg, title: "Town10HD".to_owned(), _home: None })
}

/// Spawns cars into a world that the client ticks, and simulates some time without rendering.
pub(crate) fn populate(client: &mut Client, cars: usize, frames: usize) -> anyhow::Result<usize> {
    let points = client.spawn_points()?;
    let car = mesh::Tag::Car as u8;
    let low = |height_m: f32| height_m < EYES_M - 0.1;
    let blueprints: Vec<String> = client
        .blueprints()
        .iter()
        .filter(|b| b.tag == car && low(2.0 * b.half_extents_m[2]))
        .map(|b| b.id.clone())
        .collect();
    anyhow::ensure!(!blueprints.is_empty() && !points.is_empty(), "no car finds a place here");
    let stride = (points.len() / cars.max(1)).max(1);
    // Every stride-th spawn point, then the ones in between.
    let order = (0..stride).flat_map(|first| (first..points.len()).step_by(stride));
    let mut spawned = 0;
    // A vehicle that is refused everywhere must not keep the others away.
    for (index, blueprint) in order.zip(blueprints.iter().cycle()) {
        if spawned == cars {
            break;
        }
        match client.spawn(Spawn::new(blueprint, points[index]).autopilot()) {
            Ok(_) => spawned += 1,
            // The spawn point is occupied.
            Err(ClientError::Refused { .. }) => {}
            Err(e) => return Err(e.into()),
        }
    }
    let settings = client.wire_settings();
    client.apply_wire_settings(Settings { no_rendering: 1, ..settings })?;
    for _ in 0..frames {
        client.tick()?;
    }
    client.apply_wire_settings(Settings { no_rendering: 0, ..settings })?;
    Ok(spawned)
}

/// Returns camera poses above the lanes, across the map, looking along the lane.
pub(crate) fn street_poses(client: &mut Client) -> anyhow::Result<Vec<Pose>> {
    let points = client.spawn_points()?;
    anyhow::ensure!(!points.is_empty(), "this map has no lane to look from");
    let pose = |index: usize| {
        let at = points[index * points.len() / POSES];
        Pose { position_m: (at.position() + Vec3::Z * (EYES_M - SPAWN_HEIGHT_M)).to_array(), ..at }
    };
    Ok((0..POSES).map(pose).collect())
}

const ONE_ROAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="one road"/>
  <road name="" length="200" id="1" junction="-1">
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="200"><line/></geometry>
    </planView>
    <lanes>
      <laneSection s="0">
        <center><lane id="0" type="none" level="false"/></center>
        <right>
          <lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
        </right>
      </laneSection>
    </lanes>
  </road>
</OpenDRIVE>
"#;
