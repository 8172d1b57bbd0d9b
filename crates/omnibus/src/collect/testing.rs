//! Fixtures of the tests of this module.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
};

use protocol::{ActorState, Pose};

use crate::collect::{
    ImageStorage,
    format::{DataSetSettings, Ego, FrameLine},
    label_settings::LabelSettings,
    sensors,
};

/// Returns a line of the frame list.
pub(crate) fn line(frame: u64) -> FrameLine {
    FrameLine {
        frame,
        sim_time_nanos: frame * 50_000_000,
        state_hash: "00".to_owned(),
        tracer: "cpu".to_owned(),
        ego: Ego::from(&ActorState { pose: Pose::IDENTITY, ..ActorState::default() }),
        sensors: Vec::new(),
        box_count: 0,
        point_counts: BTreeMap::new(),
        ego_sensors: Vec::new(),
        weather: protocol::Weather::default().into(),
        files_crc32: BTreeMap::new(),
    }
}

/// Returns the settings of a run.
pub(crate) fn settings() -> DataSetSettings {
    DataSetSettings {
        map: "Millbrook".to_owned(),
        map_fnv1a64: "00".to_owned(),
        seed: 7,
        fixed_delta_nanos: 50_000_000,
        warmup_frames: 40,
        every_frames: 1,
        scene: 0,
        scene_seed: 7,
        vehicles_requested: 50,
        vehicles_near: 25,
        driver_spread: None,
        hybrid_radius_m: None,
        routes_fnv1a64: None,
        routes_begin_secs: None,
        vehicles_per_km: None,
        walkers_per_km: None,
        walkers_requested: 30,
        traffic_radius_m: 120.0,
        in_view: 4.0,
        weather: None,
        sun_altitudes_deg: Vec::new(),
        events: Vec::new(),
        ego_blueprint: "vehicle.tesla.model3".to_owned(),
        ego_route: Vec::new(),
        images: ImageStorage::default(),
        labels: LabelSettings::default(),
        sensors: sensors::default_sensors(800, 600)
            .into_iter()
            .map(|spec| sensors::describe(&spec.into()))
            .collect(),
    }
}

/// A folder for one test, removed when it ends.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new(name: &str) -> Scratch {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("omnibus-collect-{}-{number}-{name}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).unwrap();
        Scratch(path)
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
