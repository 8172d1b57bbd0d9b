//! Times the CPU tracer: `cpu_time [THREADS] [FRAMES] [FILTER] [QUALITY] [NIGHT]`.
//!
//! Prints wall time and CPU time for each workload on the largest town with 100 cars, at the same
//! 16 street poses; with EACH in the environment, those of each pose too, which `bench/embree_peer.py`
//! reads.

#![expect(unsafe_code, reason = "asks the kernel for processor time")]

mod sample;

use std::error::Error;
use std::f32::consts::FRAC_PI_2;
use std::time::Instant;

use omnibus_sensor_render::{BundleJob, CpuTracer, Quality, Scene, Tracer, World, pose_planes};
use protocol::{Frame, Pose, SensorSpec, Stamp, Weather, layout, output};

const POSES: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let threads = arguments.first().map_or(Ok(0), |text| text.parse())?;
    let frames: usize = arguments.get(1).map_or(Ok(4), |text| text.parse())?;
    let filter = arguments.get(2).map_or("", String::as_str);
    let quality = arguments.get(3).map_or(Ok(Quality::Low), |text| text.parse())?;
    let is_night = arguments.get(4).is_some();
    let town = sample::Sample::heavy()?;
    let begin = Instant::now();
    let scene = Scene::of_town(&town.town)?;
    let built_ms = begin.elapsed().as_secs_f64() * 1e3;
    let actors = town.traffic(100, 3);
    let instanced: usize =
        actors.iter().map(|a| town::catalogue()[a.blueprint as usize].mesh().triangles.len()).sum();
    println!(
        "{}: {} triangles in the town, {instanced} in {} actors; built in {built_ms:.0} ms",
        town.name,
        town.town.mesh.triangles.len(),
        actors.len()
    );
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Default::default() };
    world.set_quality(quality);
    let mut weather = Weather::default();
    if is_night {
        weather.sun_altitude_rad = -0.6;
    }
    world.place(&scene, stamp, 50_000_000, &weather, &actors, sample::paint);
    let mut tracer = Tracer::Cpu(CpuTracer::new(threads)?);
    println!("{}", tracer.describe());
    println!("{:<30}{:>12}{:>12}{:>12}", "", "wall ms", "cpu ms", "not sky");
    let with = |outputs: u32, width: u32, height: u32| SensorSpec {
        outputs,
        ..sample::camera("front", width, height)
    };
    let every = output::COLOR | output::DEPTH | output::TAG | output::INSTANCE;
    let through = |lens: &str, fov_rad: f32| SensorSpec {
        lens: sample::lens(lens),
        fov_rad,
        ..with(output::COLOR, 800, 600)
    };
    let effects =
        |name: &str| SensorSpec { effects: sample::effects(name), ..with(output::COLOR, 800, 600) };
    for (name, sensors, copies) in [
        ("800x600 colour", vec![with(output::COLOR, 800, 600)], 1),
        ("400x300 depth", vec![with(output::DEPTH, 400, 300)], 1),
        ("200x150 depth", vec![with(output::DEPTH, 200, 150)], 1),
        ("800x600 depth", vec![with(output::DEPTH, 800, 600)], 1),
        ("800x600 depth tag instance", vec![with(every & !output::COLOR, 800, 600)], 1),
        ("800x600 all", vec![with(every, 800, 600)], 1),
        ("800x600 colour Brown-Conrady", vec![through("brown-conrady", FRAC_PI_2)], 1),
        ("800x600 colour fisheye", vec![through("fisheye", 3.3)], 1),
        ("800x600 colour fisheye 90°", vec![through("fisheye", FRAC_PI_2)], 1),
        ("800x600 colour effects", vec![effects("camera")], 1),
        ("800x600 colour focus", vec![effects("focus")], 1),
        ("64x84x84 colour", vec![with(output::COLOR, 84, 84)], 64),
        ("64x84x84 all", vec![with(every, 84, 84)], 64),
        ("lidar 32x1800", vec![sample::lidar("roof", 1800, 32)], 1),
    ] {
        if name.contains(filter) {
            time(name, &sensors, copies, frames, &town, &scene, &world, &mut tracer)?;
        }
    }
    Ok(())
}

#[expect(clippy::too_many_arguments, reason = "called once")]
fn time(
    name: &str,
    sensors: &[SensorSpec],
    copies: usize,
    frames: usize,
    town: &sample::Sample,
    scene: &Scene,
    world: &World,
    tracer: &mut Tracer,
) -> Result<(), Box<dyn Error>> {
    let (mut wall, mut cpu, mut rounds) = (0.0, 0.0, 0);
    let (mut seen, mut pixels) = (0usize, 0usize);
    for pose in 0..POSES {
        let before = cpu;
        let poses: Vec<Pose> =
            (0..copies).map(|copy| town.street_pose(pose + copy * POSES)).collect();
        let (planes, byte_len) = layout(sensors);
        let mut all: Vec<_> = poses
            .iter()
            .map(|pose| {
                let mut planes = planes.clone();
                pose_planes(&mut planes, sensors, pose);
                (planes, vec![[0u64; 8]; byte_len as usize / 64])
            })
            .collect();
        let mut jobs: Vec<BundleJob> = all
            .iter_mut()
            .map(|(planes, words)| BundleJob {
                parent: protocol::ActorId::NONE,
                sensors,
                planes,
                out: bytemuck::cast_slice_mut(words),
            })
            .collect();
        for frame in 0..=frames {
            let (begin, begin_cpu) = (Instant::now(), cpu_seconds());
            tracer.measure(scene, world, &mut jobs)?;
            if frame > 0 {
                wall += begin.elapsed().as_secs_f64();
                cpu += cpu_seconds() - begin_cpu;
                rounds += 1;
            }
        }
        if std::env::var_os("EACH").is_some() {
            let (at, turn) = (poses[0].position(), poses[0].rotation());
            let millis = (cpu - before) * 1e3 / frames as f64;
            println!("  pose {pose}: {millis:.2} ms of CPU at {at}, {turn}");
        }
        for job in &jobs {
            if let Some(plane) = job.planes.iter().find(|plane| plane.output == output::DEPTH) {
                let bytes = &job.out[plane.offset as usize..][..plane.byte_len as usize];
                let depths: &[f32] = bytemuck::cast_slice(bytes);
                seen += depths.iter().filter(|depth| **depth < protocol::DEPTH_FAR_M).count();
                pixels += depths.len();
            }
        }
    }
    let mean = |seconds: f64| seconds * 1e3 / f64::from(rounds);
    let share = if pixels > 0 {
        format!("{:.0} %", 100.0 * seen as f64 / pixels as f64)
    } else {
        "".into()
    };
    println!("{name:<30}{:>12.2}{:>12.2}{share:>12}", mean(wall), mean(cpu));
    Ok(())
}

/// Returns the user CPU time of this process in seconds.
fn cpu_seconds() -> f64 {
    // SAFETY: the kernel fills the whole struct, which consists of numbers.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(libc::RUSAGE_SELF, &mut usage);
        usage
    };
    usage.ru_utime.tv_sec as f64 + usage.ru_utime.tv_usec as f64 * 1e-6
}
