//! The options of `omnibus collect`: a plan, what replaces its values, and where to write.

use std::{num::NonZeroU64, path::PathBuf, str::FromStr};

use anyhow::{anyhow, ensure};
use protocol::PIPELINE_MAX;

use crate::{
    collect::{image_storage::ImageFormat, plan::Plan, sky::WeatherEntry},
    launch::WorldArgs,
    sensors_file,
};

/// What to collect, and where to write it.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Options {
    /// The plan of the collection, a TOML file; each scene becomes a data set in a folder of its own
    #[arg(value_name = "PLAN")]
    pub(crate) plan: Option<PathBuf>,
    /// Print a plan to start from, and end: carla-default, nuscenes, kitti or waymo
    #[arg(long, value_name = "NAME")]
    pub(crate) init: Option<String>,
    /// The folder of the data set; created if missing
    #[arg(long, value_name = "DIR", required_unless_present = "init")]
    pub(crate) out: Option<PathBuf>,
    /// The number of scenes, each in a folder of its own
    #[arg(long, value_name = "N")]
    pub(crate) scenes: Option<NonZeroU64>,
    /// Collect only this scene of the plan, counted from 0, into --out itself
    #[arg(long, value_name = "INDEX", conflicts_with_all = ["scenes", "shard"])]
    pub(crate) scene: Option<u64>,
    /// Collect only every n-th scene, beginning with the i-th, counted from 0
    #[arg(long, value_name = "I/N")]
    pub(crate) shard: Option<Shard>,
    /// Write the plan with the values of the options into --out, print it as a line of JSON, and end
    #[arg(long, conflicts_with_all = ["scene", "shard"])]
    pub(crate) prepare: bool,
    /// Frames to keep of each scene (300 without a plan)
    #[arg(long)]
    frames: Option<u64>,
    /// Vehicles in traffic, in addition to the ego (50 without a plan)
    #[arg(long)]
    vehicles: Option<u32>,
    /// Of these, vehicles near the ego (25 without a plan)
    #[arg(long)]
    vehicles_near: Option<u32>,
    /// By how much drivers differ: 0 not at all, 1 as in the field (1 without a plan)
    #[arg(long, value_name = "SPREAD")]
    driver_spread: Option<f32>,
    /// Switches hybrid physics on: vehicles farther than this from the ego move by a kinematic model
    #[arg(long, value_name = "METRES")]
    hybrid_radius: Option<f32>,
    /// Vehicles that depart at their times, take their routes and are removed where they arrive: a route
    /// file of SUMO, on a net that netconvert made from this map's OpenDRIVE file
    #[arg(long, value_name = "FILE.rou.xml")]
    routes: Option<PathBuf>,
    /// The time of --routes at which a scene begins, warm-up included, in seconds; vehicles that depart
    /// earlier are left out (0 without a plan)
    #[arg(long, value_name = "SECONDS")]
    routes_begin: Option<f64>,
    /// Pedestrians on the sidewalks around the ego (30 without a plan)
    #[arg(long)]
    walkers: Option<u32>,
    /// The weather: clear, cloudy, overcast, wet, drizzle, rain, storm or fog
    #[arg(long, value_name = "NAME")]
    weather: Option<String>,
    /// The hour of the day, 0 to 24
    #[arg(long, value_name = "HOUR", conflicts_with = "sun_altitudes_deg")]
    time: Option<f32>,
    /// Altitudes of the sun above the horizon, each for an equal part of the frames
    #[arg(long, value_name = "DEGREES,…", value_delimiter = ',', allow_hyphen_values = true)]
    sun_altitudes_deg: Vec<f32>,
    /// The sensors, as `omnibus profile --sensors` takes them
    #[arg(long, value_name = "FILE")]
    sensors: Option<PathBuf>,
    /// Simulated seconds per frame (0.05 without a plan)
    #[arg(long, value_name = "SECONDS")]
    fixed_delta: Option<f64>,
    /// Keep one in this many frames (1 without a plan); sensors with a rate_hz have their own
    #[arg(long, value_name = "FRAMES")]
    every: Option<u64>,
    /// Frames to simulate before the first that is kept (40 without a plan)
    #[arg(long, value_name = "FRAMES")]
    warmup: Option<u64>,
    /// Width of every camera's images (800 without a plan)
    #[arg(long, value_name = "PIXELS")]
    width: Option<u32>,
    /// Height of every camera's images (600 without a plan)
    #[arg(long, value_name = "PIXELS")]
    height: Option<u32>,
    /// How images are stored
    #[arg(long, value_name = "FORMAT")]
    image_format: Option<ImageFormat>,
    /// The quality of JPEG, 1 to 100 (95 without a plan)
    #[arg(long, value_name = "QUALITY")]
    jpeg_quality: Option<u8>,
    /// Whether the keypoints of pedestrians are written (they are without a plan)
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    keypoints: Option<bool>,
    /// Whether the masks are written that objects would have if nothing occluded them
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    amodal_masks: Option<bool>,
    /// How many frames rendering may lag behind the simulation, 0 to 3; the data are the same
    #[arg(long, value_name = "FRAMES", default_value_t = 1)]
    pub(crate) pipeline: u32,
    /// Threads that encode and write; 0: one per core
    #[arg(long, value_name = "THREADS", default_value_t = 0)]
    pub(crate) writers: usize,
    /// Continue a data set that was interrupted; all other settings must be the same
    #[arg(long)]
    pub(crate) resume: bool,
    /// Print progress and result as lines of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// End, as with SIGTERM, when this process ends: the one that started this one
    #[arg(long, value_name = "PID", hide = true)]
    pub(crate) parent: Option<i32>,
}

/// Every `count`-th scene, beginning with `index`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) index: u64,
    pub(crate) count: u64,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if index < count => Ok(Shard { index, count }),
            _ => Err(format!("{text:?} is no shard; use I/N with I from 0 to N - 1, such as 0/4")),
        }
    }
}

impl Options {
    /// Returns the plan with the values of the options, checked. Map, seed and quality of `world` replace
    /// those of the plan.
    pub(crate) fn resolve(&self, world: &WorldArgs) -> anyhow::Result<Plan> {
        let mut plan = match &self.plan {
            Some(path) => Plan::read(path)?,
            None => Plan::default(),
        };
        macro_rules! replace {
            ($($option:ident => $($field:ident).+),* $(,)?) => {
                $(if let Some(value) = self.$option { plan.$($field).+ = value; })*
            };
        }
        replace! {
            frames => frames,
            every => every,
            warmup => warmup,
            fixed_delta => fixed_delta_secs,
            vehicles => traffic.vehicles,
            vehicles_near => traffic.vehicles_near,
            driver_spread => traffic.driver_spread,
            routes_begin => demand.begin_secs,
            walkers => traffic.walkers,
            image_format => images.format,
            jpeg_quality => images.jpeg_quality,
            keypoints => labels.keypoints,
            amodal_masks => labels.amodal_masks,
        }
        plan.traffic.hybrid_radius_m = self.hybrid_radius.or(plan.traffic.hybrid_radius_m);
        if let Some(path) = &self.routes {
            plan.demand.routes = Some(path.clone());
        }
        ensure!(
            self.routes_begin.is_none() || plan.demand.routes.is_some(),
            "--routes-begin has no effect without --routes"
        );
        if let Some(scenes) = self.scenes {
            plan.scenes = scenes.get();
        }
        if let Some(map) = &world.map {
            plan.maps = vec![map.clone()];
        }
        if let Some(seed) = world.seed {
            plan.seed = seed;
        }
        if let Some(name) = &self.weather {
            plan.weathers = vec![WeatherEntry::preset(name)];
        }
        if let Some(hour) = self.time {
            (plan.hours, plan.sun_altitudes_deg) = (vec![hour], Vec::new());
        }
        if !self.sun_altitudes_deg.is_empty() {
            (plan.hours, plan.sun_altitudes_deg) = (Vec::new(), self.sun_altitudes_deg.clone());
        }
        if let Some(path) = &self.sensors {
            plan.sensors = sensors_file::entries_of(path)?;
        }
        for sensor in &mut plan.sensors {
            sensor.resize(self.width, self.height);
            sensor.set_quality(world.quality);
        }
        plan.check().map_err(|why| match &self.plan {
            Some(path) => why.context(format!("plan {}", path.display())),
            None => why,
        })?;
        ensure!(
            self.pipeline <= PIPELINE_MAX,
            "--pipeline is {}; use 0 to {PIPELINE_MAX}",
            self.pipeline
        );
        if let Some(scene) = self.scene {
            ensure!(
                scene < plan.scenes,
                "--scene is {scene}, but the plan has {} scenes, counted from 0",
                plan.scenes
            );
        }
        Ok(plan)
    }

    /// Whether each scene has a folder of its own below `--out`.
    pub(crate) fn has_scene_folders(&self) -> bool {
        self.scene.is_none()
            && (self.plan.is_some() || self.scenes.is_some() || self.shard.is_some())
    }

    /// Returns the folder of the data set.
    pub(crate) fn out(&self) -> anyhow::Result<&PathBuf> {
        self.out.as_ref().ok_or_else(|| anyhow!("no folder to write to; name it by --out DIR"))
    }

    /// Returns the number of encoder threads.
    pub(crate) fn threads(&self) -> usize {
        match self.writers {
            0 => std::thread::available_parallelism().map_or(2, usize::from).min(16),
            some => some.min(64),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        options: Options,
    }

    fn plan_of(args: &[&str]) -> anyhow::Result<Plan> {
        let line = Line::try_parse_from([&["collect", "--out", "set"], args].concat())?;
        line.options.resolve(&WorldArgs::default())
    }

    #[test]
    fn options_replace_the_values_of_the_plan() {
        let plan =
            plan_of(&["--frames", "7", "--vehicles", "3", "--weather", "rain", "--width", "64"]);
        let plan = plan.unwrap();
        assert_eq!((plan.frames, plan.traffic.vehicles), (7, 3));
        assert_eq!(plan.scene(0).unwrap().weather.unwrap().precipitation, 60.0);
        let sensors: Vec<_> =
            plan.planned_sensors().unwrap().into_iter().map(|sensor| sensor.spec).collect();
        assert_eq!((sensors[0].width, sensors[0].height, sensors[1].width), (64, 600, 1800));
    }

    #[test]
    fn labels_are_asked_for_by_options_without_a_value() {
        let labels = |args: &[&str]| plan_of(args).unwrap().labels;
        assert_eq!((labels(&[]).keypoints, labels(&[]).amodal_masks), (true, false));
        let asked = labels(&["--amodal-masks", "--keypoints=false"]);
        assert_eq!((asked.keypoints, asked.amodal_masks), (false, true));
    }

    #[test]
    fn a_shard_is_two_numbers_of_which_the_first_is_smaller() {
        assert_eq!("1/4".parse(), Ok(Shard { index: 1, count: 4 }));
        for wrong in ["4/4", "1", "a/b", "1/0", "-1/4", ""] {
            let error = wrong.parse::<Shard>().unwrap_err();
            assert!(error.contains("use I/N"), "{error}");
        }
    }

    #[test]
    fn values_out_of_range_are_named() {
        for (args, said) in [
            (&["--frames", "0"][..], "frames is 0"),
            (&["--every", "0"], "every is 0"),
            (&["--fixed-delta", "2"], "fixed delta is 2"),
            (&["--pipeline", "4"], "--pipeline is 4"),
            (&["--weather", "hail"], "hail"),
            (&["--time", "25"], "25"),
            (&["--width", "0"], "width_px is 0"),
            (&["--jpeg-quality", "101"], "jpeg_quality is 101"),
            (&["--scene", "1"], "--scene is 1, but the plan has 1 scenes"),
        ] {
            let error = format!("{:#}", plan_of(args).unwrap_err());
            assert!(error.contains(said), "{error}");
        }
    }
}
