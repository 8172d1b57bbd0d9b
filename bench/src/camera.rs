//! `camera` and `lidar`: the throughput of the renderer, at fixed poses in a street with traffic.

use std::f32::consts::{FRAC_PI_2, TAU};

use client_lib::{
    ActorId, Client, Pose, clock,
    wire::{EffectsSpec, SensorSpec, camera, exposure, lidar, output, quality, tracer},
};
use glam::{Quat, Vec3};

use crate::{
    Effort, cores,
    figure::{Figure, Sink, Spread, Unit, brief, median},
    machine::Machine,
    scene,
    sim::{Sim, pid_of},
};

const ROUNDS: usize = 3;
/// Measurements of a new bundle that are discarded because they touch its memory first.
const WARM_UP: usize = 4;
const DRIVEN_FRAMES: usize = 100;
const GPU_NAMES: [&str; 6] = [
    "camera.gpu.800x600",
    "camera.gpu.800x600.standard",
    "camera.gpu.800x600.epic",
    "camera.gpu.800x600.standard.effects",
    "camera.gpu.84x84x1024",
    "camera.gpu.1600x900x6",
];

/// What is measured together, and how it is counted.
struct Job {
    name: &'static str,
    /// The bundles, measured in sequence for equal times.
    bundles: Vec<Vec<SensorSpec>>,
    what: &'static str,
    /// What one measurement counts as, in the figure's unit.
    count: f64,
    text: String,
}

/// Measures the camera figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let mut street = Street::start(effort, "cpu")?;
    let poses = street.poses.clone();
    street.take(effort, sink, &single("camera.cpu.800x600", quality::LOW, &poses))?;
    street.take(effort, sink, &single("camera.cpu.800x600.standard", quality::STANDARD, &poses))?;
    street.take(effort, sink, &single("camera.cpu.800x600.epic", quality::EPIC, &poses))?;
    let name = "camera.cpu.800x600.standard.effects";
    street.take(effort, sink, &with_effects(name, &poses))?;
    street.take(effort, sink, &small("camera.cpu.84x84x64", &poses, 4))?;
    drop(street);
    let mut street = Street::start(effort, "auto")?;
    if street.tracer()? != tracer::GPU {
        GPU_NAMES.iter().for_each(|name| sink.skip(name, "no GPU here"));
        return Ok(());
    }
    street.take(effort, sink, &single(GPU_NAMES[0], quality::LOW, &poses))?;
    street.take(effort, sink, &single(GPU_NAMES[1], quality::STANDARD, &poses))?;
    street.take(effort, sink, &single(GPU_NAMES[2], quality::EPIC, &poses))?;
    street.take(effort, sink, &with_effects(GPU_NAMES[3], &poses))?;
    street.take(effort, sink, &small(GPU_NAMES[4], &poses, 64))?;
    street.take(effort, sink, &ring(GPU_NAMES[5], &poses))
}

/// Measures the lidar figures.
pub(crate) fn measure_lidar(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let mut street = Street::start(effort, "cpu")?;
    let (channels, columns) = (32, 1800);
    let spread = [-30f32, 10.0].map(f32::to_radians);
    let bundles = street.poses.iter();
    let bundles = bundles.map(|at| vec![lidar("lidar", *at, channels, columns, spread, 100.0)]);
    let job = Job {
        name: "lidar.cpu.32x1800",
        bundles: bundles.collect(),
        what: "million rays",
        count: f64::from(channels * columns) * 1e-6,
        text: "32 channels x 1800 columns, points and labels".to_owned(),
    };
    street.take(effort, sink, &job)
}

/// Returns the job of one camera at a time, of one of [`quality`].
fn single(name: &'static str, quality: u32, poses: &[Pose]) -> Job {
    let bundle = |at: &Pose| {
        let spec = camera("front", *at, 800, 600, FRAC_PI_2, output::COLOR);
        vec![SensorSpec { quality, ..spec }]
    };
    Job {
        name,
        bundles: poses.iter().map(bundle).collect(),
        what: "images",
        count: 1.0,
        text: "800x600 colour, one camera".to_owned(),
    }
}

/// Returns the job of one camera at a time with exposure by the image, bloom, vignetting and noise.
fn with_effects(name: &'static str, poses: &[Pose]) -> Job {
    let effects = EffectsSpec {
        exposure: exposure::AUTOMATIC,
        bloom: 0.06,
        vignette: 0.6,
        white_electrons: 8000.0,
        read_electrons: 6.0,
        ..EffectsSpec::default()
    };
    let mut job = single(name, quality::STANDARD, poses);
    job.bundles.iter_mut().flatten().for_each(|spec| spec.effects = effects);
    job.text = "800x600 colour with effects, one camera".to_owned();
    job
}

/// Returns the job of many small cameras in one bundle: from every pose into `turns` directions.
fn small(name: &'static str, poses: &[Pose], turns: usize) -> Job {
    let eyes: Vec<SensorSpec> = poses
        .iter()
        .flat_map(|at| (0..turns).map(|turn| turned(at, turn as f32 * TAU / turns as f32)))
        .enumerate()
        .map(|(index, at)| camera(&index.to_string(), at, 84, 84, FRAC_PI_2, output::COLOR))
        .collect();
    let count = eyes.len();
    Job {
        name,
        bundles: vec![eyes],
        what: "images",
        count: count as f64,
        text: format!("84x84 colour, {count} cameras in one bundle"),
    }
}

/// Returns the job of six cameras around a car, as one bundle.
fn ring(name: &'static str, poses: &[Pose]) -> Job {
    let bundle = |at: &Pose| {
        let eye = |turn: usize| {
            let at = turned(at, turn as f32 * TAU / 6.0);
            camera(&turn.to_string(), at, 1600, 900, 70f32.to_radians(), output::COLOR)
        };
        (0..6).map(eye).collect()
    };
    Job {
        name,
        bundles: poses.iter().map(bundle).collect(),
        what: "bundles",
        count: 1.0,
        text: "6 x 1600x900 colour, one bundle".to_owned(),
    }
}

fn turned(pose: &Pose, yaw_rad: f32) -> Pose {
    pose.then(&Pose::new(Vec3::ZERO, Quat::from_rotation_z(yaw_rad)))
}

/// A town with traffic, and a client that ticks it.
struct Street {
    client: Client,
    poses: Vec<Pose>,
    title: String,
    machine: Machine,
    // The last field: the simulator ends after its client has left.
    _sim: Sim,
}

/// The rounds of one job.
#[derive(Default)]
struct Taken {
    /// Each measurement, by the renderer's clock.
    nanos: Vec<Vec<u64>>,
    by_renderer: Vec<f64>,
    by_wall: Vec<f64>,
    cpu_nanos: u64,
    measurements: u64,
}

impl Street {
    fn start(effort: Effort, device: &str) -> anyhow::Result<Street> {
        let machine = Machine::look();
        let map = scene::bench_map()?;
        let sim = Sim::start(&["--synchronous", "--map", &map.arg, "--device", device])?;
        let mut client = sim.client()?;
        client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
        let cars = scene::populate(&mut client, scene::CARS, effort.count(DRIVEN_FRAMES))?;
        let poses = scene::street_poses(&mut client)?;
        let title = format!("{}, {cars} cars, {} street poses", map.title, poses.len());
        Ok(Street { client, poses, title, machine, _sim: sim })
    }

    /// Measures a job and reports the figure.
    fn take(&mut self, effort: Effort, sink: &mut Sink, job: &Job) -> anyhow::Result<()> {
        let not_sky = self.share_not_sky(job)?;
        let render = pid_of(&self.client, "sensor-render")?;
        let rounds = effort.rounds(ROUNDS);
        let nanos_each = effort.seconds() * 1e9 / (rounds * job.bundles.len()) as f64;
        let mut taken = Taken::default();
        for _ in 0..rounds {
            let (mut nanos, mut wall) = (Vec::new(), 0);
            for sensors in &job.bundles {
                let mut bundle = self.client.create_bundle(job.name, ActorId::NONE, sensors, 2)?;
                for _ in 0..WARM_UP {
                    self.client.tick_and_collect(&mut [&mut bundle])?;
                }
                let (begin, cpu) = (clock::now_nanos(), cores::cpu_nanos(render));
                let mut spent = 0;
                while spent == 0 || (spent as f64) < nanos_each {
                    let (frame, measured) = self.client.tick_and_collect(&mut [&mut bundle])?;
                    let Some(measured) = measured.into_iter().flatten().next() else {
                        anyhow::bail!("{frame} has no measurement of {}", job.name);
                    };
                    nanos.push(measured.header().end_nanos - measured.header().begin_nanos);
                    spent = clock::now_nanos() - begin;
                }
                taken.cpu_nanos += cores::cpu_nanos(render) - cpu;
                wall += spent;
                self.client.destroy_bundle(bundle)?;
            }
            let per_sec = |spent: u64| nanos.len() as f64 * job.count * 1e9 / spent.max(1) as f64;
            taken.by_renderer.push(per_sec(nanos.iter().sum()));
            taken.by_wall.push(per_sec(wall));
            taken.measurements += nanos.len() as u64;
            taken.nanos.push(nanos);
        }
        let unit = Unit::PerSecond(job.what);
        let cpu_millis = taken.cpu_nanos as f64 / 1e6 / taken.measurements as f64;
        let looks = not_sky.map_or(String::new(), |s| format!(", {:.0} % not sky", s * 100.0));
        let workload = format!(
            "{}; {}{looks}; by the renderer's clock; with the whole tick {} {unit}; {} ms of CPU \
             time a measurement",
            job.text,
            self.title,
            brief(median(&taken.by_wall)),
            brief(cpu_millis),
        );
        let spread = Spread::of_rounds(&taken.nanos, 1e9).as_rates(job.count);
        let value = median(&taken.by_renderer);
        let figure = Figure { name: job.name, workload, unit, value, spread, peer: None };
        sink.put(&figure, &self.machine)
    }

    /// Returns the fraction of a job's pixels that show something; `None` for a lidar.
    fn share_not_sky(&mut self, job: &Job) -> anyhow::Result<Option<f64>> {
        let (mut sky, mut all) = (0, 0);
        for sensors in &job.bundles {
            let mut sensors = sensors.clone();
            if sensors.iter().any(|s| s.outputs & output::COLOR == 0) {
                return Ok(None);
            }
            sensors.iter_mut().for_each(|s| s.outputs = output::TAG);
            let mut bundle = self.client.create_bundle("tags", ActorId::NONE, &sensors, 2)?;
            let (frame, measured) = self.client.tick_and_collect(&mut [&mut bundle])?;
            let Some(measured) = measured.into_iter().flatten().next() else {
                anyhow::bail!("{frame} has no tags");
            };
            for tags in (0..sensors.len()).filter_map(|sensor| measured.tags(sensor)) {
                sky += tags.iter().filter(|tag| **tag == mesh::Tag::Sky as u8).count();
                all += tags.len();
            }
            drop(measured);
            self.client.destroy_bundle(bundle)?;
        }
        Ok(Some(1.0 - sky as f64 / all.max(1) as f64))
    }

    /// Returns the tracer of the renderer.
    fn tracer(&mut self) -> anyhow::Result<u32> {
        let sensors = [camera("look", self.poses[0], 16, 16, FRAC_PI_2, output::TAG)];
        let mut bundle = self.client.create_bundle("look", ActorId::NONE, sensors, 2)?;
        let (frame, measured) = self.client.tick_and_collect(&mut [&mut bundle])?;
        let Some(measured) = measured.into_iter().flatten().next() else {
            anyhow::bail!("{frame} has no image");
        };
        let code = measured.header().tracer;
        drop(measured);
        self.client.destroy_bundle(bundle)?;
        Ok(code)
    }
}
