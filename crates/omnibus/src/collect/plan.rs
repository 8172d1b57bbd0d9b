//! A plan: the file that describes a collection, and the scene that each index of it means.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, anyhow, bail, ensure};
use protocol::{SensorSpec, output};
use road::Network;
use serde::{Deserialize, Serialize};

use crate::{
    collect::{
        actors::EGO,
        departures::Departures,
        events::{Crossing, Event},
        image_storage::ImageStorage,
        label_settings::LabelSettings,
        sensors::{CAMERA_OUTPUTS, PlannedSensor},
        sky::{self, WeatherEntry},
    },
    sensors_file::{self, SensorEntry},
};

/// A plan, as in its TOML file. Missing fields have the values of [`Plan::default`].
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Plan {
    /// The number of scenes.
    pub(crate) scenes: u64,
    /// Frames that are kept of each scene.
    pub(crate) frames: u64,
    /// Sensors without a rate of their own measure in one of this many frames. Frames in which a sensor
    /// measures are kept.
    pub(crate) every: u64,
    /// Frames that are simulated before the first that is kept.
    pub(crate) warmup: u64,
    /// Simulated time per frame.
    pub(crate) fixed_delta_secs: f64,
    /// Of the scenery, and with the scene's index of spawn points, kinds and paints.
    pub(crate) seed: u64,
    /// Names or files of maps, which scenes take in turn; empty: the default map.
    pub(crate) maps: Vec<String>,
    /// Hours of the day; each has a scene on every map under every weather.
    pub(crate) hours: Vec<f32>,
    /// Altitudes of the sun, each for an equal part of a scene's frames.
    pub(crate) sun_altitudes_deg: Vec<f32>,
    /// Weathers; each has a scene on every map.
    #[serde(rename = "weather")]
    pub(crate) weathers: Vec<WeatherEntry>,
    pub(crate) ego: EgoEntry,
    pub(crate) traffic: TrafficEntry,
    pub(crate) demand: DemandEntry,
    pub(crate) images: ImageStorage,
    /// Labels besides boxes.
    pub(crate) labels: LabelSettings,
    #[serde(rename = "event")]
    pub(crate) events: Vec<Event>,
    #[serde(rename = "sensor")]
    pub(crate) sensors: Vec<SensorEntry>,
}

/// The vehicle that carries the sensors.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct EgoEntry {
    pub(crate) blueprint: String,
    /// Places in world space, in metres, which scenes take in turn: the ego starts on the lane nearest to
    /// the first, and drives over the others. Empty: a spawn point by the seed, and turns at random.
    pub(crate) routes: Vec<Vec<[f32; 2]>>,
}

/// The other road users.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct TrafficEntry {
    /// Vehicles on the whole map.
    pub(crate) vehicles: u32,
    /// Of these, vehicles within `radius_m` of the ego. What falls behind is replaced ahead.
    pub(crate) vehicles_near: u32,
    /// Instead of `vehicles_near`: vehicles per kilometre of driving lane within `radius_m`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) vehicles_per_km: Option<f32>,
    /// Pedestrians on the sidewalks within half of `radius_m`, replaced likewise.
    pub(crate) walkers: u32,
    /// Instead of `walkers`: pedestrians per kilometre of sidewalk within half of `radius_m`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) walkers_per_km: Option<f32>,
    pub(crate) radius_m: f32,
    /// Road users of at least 25 pixels of height that the cameras have in view, on average; while there
    /// are fewer, more of the vehicles come near the ego. 0: any number.
    pub(crate) in_view: f32,
    /// By how much drivers differ: 0 not at all, 1 as in the field.
    pub(crate) driver_spread: f32,
    /// The radius of hybrid physics; absent: physics is full everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) hybrid_radius_m: Option<f32>,
}

/// Vehicles that depart at their times and take their routes.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct DemandEntry {
    /// A route file of SUMO for the only map of the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) routes: Option<PathBuf>,
    /// The time of the file at which a scene begins, warm-up included. Seconds.
    pub(crate) begin_secs: f64,
}

impl DemandEntry {
    /// Returns the vehicles of a scene.
    pub(crate) fn departures(
        &self,
        network: Network,
        seed: u64,
    ) -> anyhow::Result<Option<Departures>> {
        let Some(path) = &self.routes else { return Ok(None) };
        Departures::read(path, self.begin_secs, Arc::new(network), seed).map(Some)
    }
}

/// Checks the radius of hybrid physics; `what` names it.
pub(crate) fn check_hybrid_radius(what: &str, radius_m: Option<f32>) -> anyhow::Result<()> {
    let radius_m = radius_m.unwrap_or(0.0);
    ensure!((0.0..=100_000.0).contains(&radius_m), "{what} is {radius_m}; use 0 to 100000");
    Ok(())
}

impl Default for Plan {
    fn default() -> Plan {
        Plan {
            scenes: 1,
            frames: 300,
            every: 1,
            warmup: 40,
            fixed_delta_secs: 0.05,
            seed: 1,
            maps: Vec::new(),
            hours: Vec::new(),
            sun_altitudes_deg: Vec::new(),
            weathers: Vec::new(),
            ego: EgoEntry::default(),
            traffic: TrafficEntry::default(),
            demand: DemandEntry::default(),
            images: ImageStorage::default(),
            labels: LabelSettings::default(),
            events: Vec::new(),
            sensors: sensors_file::parse_entries(DEFAULT_SENSORS).expect("they are tested"),
        }
    }
}

impl Default for EgoEntry {
    fn default() -> EgoEntry {
        EgoEntry { blueprint: EGO.to_owned(), routes: Vec::new() }
    }
}

impl Default for TrafficEntry {
    fn default() -> TrafficEntry {
        TrafficEntry {
            vehicles: 50,
            vehicles_near: 25,
            vehicles_per_km: None,
            walkers: 30,
            walkers_per_km: None,
            radius_m: 120.0,
            in_view: 4.0,
            driver_spread: 1.0,
            hybrid_radius_m: None,
        }
    }
}

/// A camera with all outputs, and a lidar on the roof.
const DEFAULT_SENSORS: &str = include_str!("plans/default-sensors.toml");

/// Plans to start from.
const TEMPLATES: [(&str, &str); 4] = [
    ("carla-default", include_str!("plans/carla-default.toml")),
    ("nuscenes", include_str!("plans/nuscenes.toml")),
    ("kitti", include_str!("plans/kitti.toml")),
    ("waymo", include_str!("plans/waymo.toml")),
];

/// Returns the text of a plan to start from.
pub(crate) fn template(name: &str) -> anyhow::Result<&'static str> {
    let found = TEMPLATES.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text).ok_or_else(|| {
        anyhow!(
            "unknown plan --init {name:?}; use {}",
            TEMPLATES.map(|(known, _)| known).join(", ")
        )
    })
}

/// One scene of a plan: everything that decides what its frames show.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scene {
    pub(crate) index: u64,
    /// Of spawn points, kinds and paints.
    pub(crate) seed: u64,
    /// The default map if `None`.
    pub(crate) map: Option<String>,
    /// The default weather if `None`.
    pub(crate) weather: Option<protocol::Weather>,
    pub(crate) route: Vec<[f32; 2]>,
}

impl Plan {
    /// Reads a plan.
    pub(crate) fn read(path: &Path) -> anyhow::Result<Plan> {
        let text = std::fs::read_to_string(path).with_context(|| {
            format!("plan {}; omnibus collect --init carla-default prints one", path.display())
        })?;
        toml::from_str(&text).with_context(|| format!("plan {}", path.display()))
    }

    /// Returns the first fault of the values.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        let delta = self.fixed_delta_secs;
        for (what, number) in
            [("scenes", self.scenes), ("frames", self.frames), ("every", self.every)]
        {
            ensure!(number > 0, "{what} is 0; use at least 1");
        }
        ensure!((0.001..=1.0).contains(&delta), "the fixed delta is {delta} s; use 0.001 to 1");
        let wrong = self.sun_altitudes_deg.iter().find(|deg| !(-90.0..=90.0).contains(*deg));
        ensure!(wrong.is_none(), "a sun altitude is {}; use -90 to 90", wrong.unwrap_or(&0.0));
        let wrong = self.hours.iter().find(|hour| !(0.0..=24.0).contains(*hour));
        ensure!(wrong.is_none(), "an hour of the day is {}; use 0 to 24", wrong.unwrap_or(&0.0));
        ensure!(
            self.hours.is_empty() || self.sun_altitudes_deg.is_empty(),
            "hours and sun_altitudes_deg both move the sun; use one of them"
        );
        let TrafficEntry { radius_m, in_view, vehicles_per_km, walkers_per_km, .. } = self.traffic;
        for (what, density) in
            [("vehicles_per_km", vehicles_per_km), ("walkers_per_km", walkers_per_km)]
        {
            let density = density.unwrap_or(0.0);
            ensure!((0.0..=500.0).contains(&density), "traffic.{what} is {density}; use 0 to 500");
        }
        ensure!(
            (20.0..=1000.0).contains(&radius_m),
            "traffic.radius_m is {radius_m}; use 20 to 1000"
        );
        ensure!((0.0..=200.0).contains(&in_view), "traffic.in_view is {in_view}; use 0 to 200");
        let spread = self.traffic.driver_spread;
        ensure!((0.0..=3.0).contains(&spread), "traffic.driver_spread is {spread}; use 0 to 3");
        check_hybrid_radius("traffic.hybrid_radius_m", self.traffic.hybrid_radius_m)?;
        ensure!(
            town::blueprint(&self.ego.blueprint)
                .is_some_and(|_| self.ego.blueprint.starts_with("vehicle.")),
            "ego.blueprint is {:?}, which is no vehicle; omnibus blueprints lists them",
            self.ego.blueprint
        );
        if let (Some(path), true) = (&self.demand.routes, self.maps.len() > 1) {
            bail!(
                "the routes of {} are for one map, but the plan has {}; use a plan for each map",
                path.display(),
                self.maps.len()
            );
        }
        let quality = self.images.jpeg_quality;
        ensure!((1..=100).contains(&quality), "images.jpeg_quality is {quality}; use 1 to 100");
        for route in &self.ego.routes {
            ensure!(!route.is_empty(), "a route in ego.routes has no place");
            ensure!(
                route.as_flattened().iter().all(|v| v.is_finite()),
                "a route in ego.routes has a place that is not finite"
            );
        }
        for entry in &self.weathers {
            entry.weather()?;
        }
        for event in &self.events {
            let at = event.at_secs;
            ensure!((0.0..=1e6).contains(&at), "an event is at {at} s; use 0 to 1000000");
            ensure!(
                event.weather.is_some() || event.crossing.is_some(),
                "the event at {at} s has neither weather nor crossing"
            );
            if let Some(entry) = &event.weather {
                entry.weather()?;
            }
            if let Some(Crossing { ahead_m, speed_mps }) = event.crossing {
                ensure!(
                    (2.0..=200.0).contains(&ahead_m) && (0.1..=10.0).contains(&speed_mps),
                    "the crossing at {at} s is {ahead_m} m ahead at {speed_mps} m/s; use 2 to 200, 0.1 to 10"
                );
            }
        }
        self.planned_sensors().map(drop)
    }

    /// Returns the simulated time per frame.
    pub(crate) fn delta_nanos(&self) -> u64 {
        (self.fixed_delta_secs * 1e9).round() as u64
    }

    /// Returns the sun's altitude for a frame that is kept, by its ordinal among them; none where it stays.
    pub(crate) fn sun_altitude_rad(&self, kept: u64) -> Option<f32> {
        let parts = self.sun_altitudes_deg.len() as u64;
        let part = kept.min(self.frames - 1) * parts / self.frames;
        self.sun_altitudes_deg.get(part as usize).map(|deg| deg.to_radians())
    }

    /// Returns the sensors, each with its period.
    pub(crate) fn planned_sensors(&self) -> anyhow::Result<Vec<PlannedSensor>> {
        let mut specs = sensors_file::specs(&self.sensors)?;
        let delta_nanos = self.delta_nanos();
        for spec in &mut specs {
            if spec.period_nanos == 0 {
                spec.period_nanos = self.every * delta_nanos;
            }
            let [rate_hz, frames_hz] = [spec.period_nanos, delta_nanos].map(|n| 1e9 / n as f64);
            // A thousandth is the rounding of a time step such as 0.033 s.
            ensure!(
                rate_hz <= 1.001 * frames_hz,
                "sensor {:?}: rate_hz is {rate_hz:.3}, but {frames_hz:.3} frames are simulated per second; \
                 use a lower rate, or a smaller fixed_delta_secs",
                spec.name.as_str()
            );
            ensure!(
                spec.outputs & output::OF_CAMERA & !CAMERA_OUTPUTS == 0,
                "sensor {:?}: collect writes the outputs color, depth, tag and instance",
                spec.name.as_str()
            );
        }
        let of_entry = |(entry, spec): (&SensorEntry, SensorSpec)| PlannedSensor {
            spec,
            radar: entry.radar(spec.period_nanos),
            receiver: entry.receiver(),
        };
        Ok(self.sensors.iter().zip(specs).map(of_entry).collect())
    }

    /// Returns the scene of an index: maps change fastest, then weathers, then hours.
    pub(crate) fn scene(&self, index: u64) -> anyhow::Result<Scene> {
        let turn = |len: usize, over: usize| {
            let over = over.max(1) as u64;
            (len > 0).then(|| (index / over % len as u64) as usize)
        };
        let (maps, weathers) = (self.maps.len(), self.weathers.len());
        let map = turn(maps, 1).map(|at| self.maps[at].clone());
        let entry = turn(weathers, maps).map(|at| &self.weathers[at]);
        let hour = turn(self.hours.len(), maps.max(1) * weathers.max(1)).map(|at| self.hours[at]);
        let mut weather = entry.map(WeatherEntry::weather).transpose()?;
        if let Some(hour) = hour {
            let [altitude, azimuth] = sky::sun_rad(hour);
            let under = weather.get_or_insert_default();
            (under.sun_altitude_rad, under.sun_azimuth_rad) = (altitude, azimuth);
        }
        let route = turn(self.ego.routes.len(), 1).map(|at| self.ego.routes[at].clone());
        Ok(Scene {
            index,
            seed: self.seed.wrapping_add(index),
            map,
            weather,
            route: route.unwrap_or_default(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Plan {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn every_template_is_a_valid_plan_with_sensors_that_fit_their_names() {
        for (name, text) in TEMPLATES {
            let plan: Plan = toml::from_str(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            plan.check().unwrap_or_else(|e| panic!("{name}: {e}"));
            for index in 0..plan.scenes {
                plan.scene(index).unwrap();
            }
        }
        assert_eq!(parse(TEMPLATES[1].1).planned_sensors().unwrap().len(), 12, "nuScenes");
        assert_eq!(parse(TEMPLATES[2].1).planned_sensors().unwrap()[0].spec.width, 1242);
        assert_eq!(
            parse(TEMPLATES[3].1).planned_sensors().unwrap().len(),
            10,
            "five cameras, five lidars"
        );
        assert!(template("cityscapes").unwrap_err().to_string().contains("waymo"));
        assert_eq!(parse(TEMPLATES[0].1), Plan { scenes: 8, ..parse(TEMPLATES[0].1) });
    }

    #[test]
    fn scenes_go_through_maps_then_weathers_then_hours() {
        let plan = parse(
            "scenes = 9\nseed = 10\nmaps = [\"a\", \"b\"]\nhours = [6.5, 12.0]\n\
             [[weather]]\npreset = \"clear\"\n[[weather]]\npreset = \"rain\"\n",
        );
        let scenes: Vec<_> = (0..9).map(|index| plan.scene(index).unwrap()).collect();
        let maps: Vec<_> = scenes.iter().map(|s| s.map.as_deref().unwrap()).collect();
        assert_eq!(maps, ["a", "b", "a", "b", "a", "b", "a", "b", "a"]);
        let rains: Vec<_> = scenes.iter().map(|s| s.weather.unwrap().precipitation > 0.0).collect();
        assert_eq!(rains, [false, false, true, true, false, false, true, true, false]);
        let altitude = |at: usize| scenes[at].weather.unwrap().sun_altitude_rad;
        assert!(altitude(0) < 0.2 && altitude(3) < 0.2 && altitude(4) > 0.7 && altitude(8) < 0.2);
        assert_eq!(scenes[3].seed, 13);
    }

    #[test]
    fn a_plan_without_a_field_has_the_default_and_an_unknown_one_is_named() {
        assert_eq!(parse(""), Plan::default());
        assert_eq!(parse("frames = 7").traffic, TrafficEntry::default());
        Plan::default().check().unwrap();
        let error = toml::from_str::<Plan>("[traffic]\nvehicle = 3\n").unwrap_err().to_string();
        assert!(error.contains("vehicle") && error.contains("vehicles_near"), "{error}");
        for (text, said) in [
            ("frames = 0", "frames is 0"),
            ("fixed_delta_secs = 2.0", "fixed delta is 2"),
            ("hours = [25.0]", "25"),
            ("hours = [12.0]\nsun_altitudes_deg = [3.0]", "both move the sun"),
            ("[ego]\nblueprint = \"walker.pedestrian.0001\"", "no vehicle"),
            ("[[weather]]\npreset = \"hail\"", "hail"),
            ("[[weather]]\nfog_density = 101.0", "fog_density"),
            ("[[event]]\nat_secs = 1.0", "neither"),
            ("[traffic]\nradius_m = 1.0", "radius_m"),
            ("[traffic]\ndriver_spread = 3.5", "driver_spread is 3.5"),
            ("[traffic]\nhybrid_radius_m = -1.0", "hybrid_radius_m is -1"),
            ("[images]\njpeg_quality = 0", "jpeg_quality is 0"),
            ("sensor = []", "no [[sensor]]"),
            ("[[sensor]]\nname = \"a\"\nkind = \"camera\"\noutputs = [\"flow\"]", "color, depth"),
        ] {
            let error = format!("{:#}", parse(text).check().unwrap_err());
            assert!(error.contains(said), "{text}: {error}");
        }
    }
}
