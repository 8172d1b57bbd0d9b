//! Checks and times the GPU tracer: `gpu_check [auto|gpu:N] [FRAMES]`.
//!
//! Compares it with the CPU tracer pixel by pixel, lets it write into shared memory that another
//! process reads, and times whole frames from the world to bytes in shared memory, by staging and
//! by import. Exits with 1 if the tracers or the bytes disagree. The scene is Town10HD if
//! OMNIBUS_MAPS names a folder that has it, else a generated town. With 0 frames nothing is timed.

#![expect(unsafe_code, reason = "maps shared memory and lends it to the device")]

mod sample;

use std::collections::BTreeMap;
use std::error::Error;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::{Quat, vec3};
use omnibus_sensor_render::{BundleJob, CpuTracer, Device, GpuTracer};
use omnibus_sensor_render::{Scene, Tracer, World, pose_planes};
use protocol::{Frame, Plane, Pose, SensorSpec, Stamp, Weather, layout, output, quality};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [verb, path, ranges @ ..] = arguments.as_slice()
        && verb == "read"
    {
        return read(path, ranges);
    }
    let device = arguments.first().map_or("auto", String::as_str).parse()?;
    let frames: usize = arguments.get(1).map_or(Ok(60), |count| count.parse())?;
    let number = match device {
        Device::Gpu(number) => Some(number),
        _ => None,
    };
    let begin = Instant::now();
    let gpu = GpuTracer::open(number, 0)?.ok_or("there is no GPU here; try gpu:0")?;
    let opened_ms = begin.elapsed().as_secs_f64() * 1e3;
    let imports = gpu.can_import();
    println!("device   {}, opened in {opened_ms:.0} ms", gpu.adapter());
    println!("import   of host memory {}", if imports { "offered" } else { "not offered" });

    let town = sample::Sample::heavy()?;
    let begin = Instant::now();
    let scene = Scene::of_town(&town.town)?;
    let built_ms = begin.elapsed().as_secs_f64() * 1e3;
    let actors = town.traffic(100, 3);
    let instanced: usize =
        actors.iter().map(|a| town::catalogue()[a.blueprint as usize].mesh().triangles.len()).sum();
    println!(
        "scene    {}: {} triangles, {instanced} in {} actors, built in {built_ms:.0} ms",
        town.name,
        town.town.mesh.triangles.len(),
        actors.len()
    );
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Default::default() };
    world.place(&scene, stamp, 50_000_000, &Weather::default(), &actors, sample::paint);

    let mut gpu = Tracer::Gpu(Box::new(gpu));
    let mut right = compare_all(&mut gpu)?;
    right &= hand_over(&town, &scene, &world, &mut gpu)?;
    let verdict = if right { Ok(()) } else { Err("the tracers or their bytes disagree".into()) };
    if frames == 0 {
        return verdict;
    }

    println!(
        "\n{:<30}{:>10}{:>10}{:>10}{:>10}{:>10}{:>12}",
        "whole frame, ms", "p50", "p90", "min", "traced", "copied", "per second"
    );
    for (name, sensor_sets) in workloads(&town) {
        time(&format!("{name} staged"), &sensor_sets, &scene, &world, &mut gpu, frames)?;
        if imports {
            let Tracer::Gpu(tracer) = &mut gpu else { unreachable!() };
            // SAFETY: `time` keeps its pages until the tracer has forgotten them.
            unsafe { tracer.import_payloads() };
            time(&format!("{name} imported"), &sensor_sets, &scene, &world, &mut gpu, frames)?;
        }
    }
    verdict
}

type PosedSensors = (Vec<SensorSpec>, Pose);

fn workloads(town: &sample::Sample) -> Vec<(&'static str, Vec<PosedSensors>)> {
    // 16 bundles of 64 cameras each, all at different poses.
    let agents = |turn: Quat| {
        let agent = |index: usize| {
            let pose = town.street_pose(index);
            SensorSpec {
                outputs: output::COLOR,
                parent_from_sensor: Pose::new(pose.position(), pose.rotation() * turn),
                ..sample::camera("agent", 84, 84)
            }
        };
        (0..16)
            .map(|bundle| {
                ((0..64).map(|camera| agent(bundle * 64 + camera)).collect(), Pose::IDENTITY)
            })
            .collect()
    };
    let up = Quat::from_rotation_y(-std::f32::consts::FRAC_PI_2);
    let color = |specs: Vec<SensorSpec>| -> Vec<SensorSpec> {
        specs.into_iter().map(|spec| SensorSpec { outputs: output::COLOR, ..spec }).collect()
    };
    let here = town.street_pose(0);
    let standard = |effects: &str, width: u32, height: u32| SensorSpec {
        outputs: output::COLOR,
        quality: quality::STANDARD,
        effects: sample::effects(effects),
        ..sample::camera("front", width, height)
    };
    let surfaces = SensorSpec {
        outputs: output::COLOR | output::NORMAL | output::FLOW,
        ..sample::camera("front", 800, 600)
    };
    vec![
        ("1024x84x84 colour", agents(Quat::IDENTITY)),
        // Almost no ray hits anything, so this measures everything but the hits.
        ("1024x84x84 of the sky", agents(up)),
        ("6x1600x900 colour", vec![(color(sample::ring(1600, 900)), here)]),
        ("6x1600x900 all", vec![(sample::ring(1600, 900), here)]),
        ("1x800x600 colour", vec![(color(vec![sample::camera("front", 800, 600)]), here)]),
        ("1x800x600 standard", vec![(vec![standard("none", 800, 600)], here)]),
        ("1x800x600 effects", vec![(vec![standard("camera", 800, 600)], here)]),
        ("1x800x600 focus", vec![(vec![standard("focus", 800, 600)], here)]),
        ("1x1920x1080 standard", vec![(vec![standard("none", 1920, 1080)], here)]),
        ("1x1920x1080 effects", vec![(vec![standard("camera", 1920, 1080)], here)]),
        ("1x800x600 surfaces", vec![(vec![surfaces], here)]),
        ("1x800x600 all", vec![(vec![sample::camera("front", 800, 600)], here)]),
        ("lidar 128x2048", vec![(vec![sample::lidar("roof", 2048, 128)], here)]),
    ]
}

/// Measures one bundle by staging, and once more into shared memory that another process then
/// reads. Returns whether that process read the same bytes.
fn hand_over(
    town: &sample::Sample,
    scene: &Scene,
    world: &World,
    tracer: &mut Tracer,
) -> Result<bool, Box<dyn Error>> {
    let Tracer::Gpu(gpu) = tracer else { unreachable!() };
    if !gpu.can_import() {
        println!("hand-over not tried: the driver imports no memory");
        return Ok(true);
    }
    // The first is written by the shaders, the second copied.
    let camera = || sample::camera("front", 640, 480);
    let mut right = true;
    for sensors in [vec![camera()], vec![camera(), sample::lidar("roof", 512, 32)]] {
        right &= hand_over_one(sensors, town, scene, world, tracer)?;
    }
    Ok(right)
}

fn hand_over_one(
    sensors: Vec<SensorSpec>,
    town: &sample::Sample,
    scene: &Scene,
    world: &World,
    tracer: &mut Tracer,
) -> Result<bool, Box<dyn Error>> {
    let sensor_sets = [(sensors, town.street_pose(1))];
    let (mut staged, mut shared) = (bundles(&sensor_sets)?, bundles(&sensor_sets)?);
    tracer.measure(scene, world, &mut jobs(&sensor_sets, &mut staged))?;
    let Tracer::Gpu(gpu) = tracer else { unreachable!() };
    // SAFETY: `shared` lives until the tracer has forgotten it.
    unsafe { gpu.import_payloads() };
    tracer.measure(scene, world, &mut jobs(&sensor_sets, &mut shared))?;
    let Tracer::Gpu(gpu) = tracer else { unreachable!() };
    let imported = gpu.imported_count();
    let planes = staged[0].planes.clone();
    let mut reader = std::process::Command::new(std::env::current_exe()?);
    reader.arg("read").arg(&shared[0].pages.path);
    let mut wanted = mesh::Fnv1a64::new();
    for plane in &planes {
        let (begin, end) = (plane.offset as usize, (plane.offset + plane.byte_len) as usize);
        reader.arg(format!("{begin}-{end}"));
        wanted.write(&staged[0].pages.bytes()[begin..end]);
    }
    let wanted = wanted.value();
    let answer = reader.output()?;
    gpu.forget_imports();
    let got = String::from_utf8_lossy(&answer.stdout).trim().to_string();
    let right = imported == 1 && got == format!("{wanted:016x}");
    println!(
        "hand-over {imported} payload imported, another process read {got}, staged {wanted:016x}: {}",
        if right { "ok" } else { "WRONG" }
    );
    Ok(right)
}

/// Body of the other process: prints the digest of these ranges of the file.
fn read(path: &str, ranges: &[String]) -> Result<(), Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let mut sum = mesh::Fnv1a64::new();
    for range in ranges {
        let (begin, end) = range.split_once('-').ok_or("a range is BEGIN-END")?;
        sum.write(&bytes[begin.parse()?..end.parse()?]);
    }
    println!("{:016x}", sum.value());
    Ok(())
}

/// Mapped file in /dev/shm, like the pool of a publisher.
struct Pages {
    path: String,
    address: *mut u8,
    len: usize,
}

impl Pages {
    fn new(len: usize) -> Result<Pages, Box<dyn Error>> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let len = len.next_multiple_of(4096);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = format!("/dev/shm/gpu_check-{}-{number}", std::process::id());
        let file = File::options().read(true).write(true).create_new(true).open(&path)?;
        file.set_len(len as u64)?;
        let access = libc::PROT_READ | libc::PROT_WRITE;
        // SAFETY: a fresh mapping of a fresh file that is `len` long; failure is checked.
        unsafe {
            let (shared, file) = (libc::MAP_SHARED, file.as_raw_fd());
            let address = libc::mmap(std::ptr::null_mut(), len, access, shared, file, 0);
            if address == libc::MAP_FAILED {
                return Err(std::io::Error::last_os_error().into());
            }
            std::ptr::write_bytes(address.cast::<u8>(), 0xa5, len);
            Ok(Pages { path, address: address.cast(), len })
        }
    }

    fn bytes(&mut self) -> &mut [u8] {
        // SAFETY: the mapping lives as long as `self`, and nothing else writes to it.
        unsafe { std::slice::from_raw_parts_mut(self.address, self.len) }
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        // SAFETY: mapped in `new`, unmapped once.
        unsafe { libc::munmap(self.address.cast(), self.len) };
        // An error means that the file does not exist any more.
        let _ = std::fs::remove_file(&self.path);
    }
}

struct Bundle {
    planes: Vec<Plane>,
    pages: Pages,
}

fn bundles(sensor_sets: &[PosedSensors]) -> Result<Vec<Bundle>, Box<dyn Error>> {
    sensor_sets
        .iter()
        .map(|(sensors, pose)| {
            let (mut planes, byte_len) = layout(sensors);
            pose_planes(&mut planes, sensors, pose);
            Ok(Bundle { planes, pages: Pages::new(byte_len as usize)? })
        })
        .collect()
}

fn jobs<'a>(sensor_sets: &'a [PosedSensors], bundles: &'a mut [Bundle]) -> Vec<BundleJob<'a>> {
    sensor_sets
        .iter()
        .zip(bundles)
        .map(|((sensors, _), bundle)| BundleJob {
            parent: protocol::ActorId::NONE,
            sensors,
            planes: &bundle.planes,
            out: bundle.pages.bytes(),
        })
        .collect()
}

fn time(
    name: &str,
    sensor_sets: &[PosedSensors],
    scene: &Scene,
    world: &World,
    tracer: &mut Tracer,
    frames: usize,
) -> Result<(), Box<dyn Error>> {
    let mut bundles = bundles(sensor_sets)?;
    let mut jobs = jobs(sensor_sets, &mut bundles);
    for _ in 0..5 {
        tracer.measure(scene, world, &mut jobs)?;
    }
    let mut millis = Vec::with_capacity(frames);
    let (mut traced, mut copied) = (Vec::new(), Vec::new());
    for _ in 0..frames {
        let begin = Instant::now();
        tracer.measure(scene, world, &mut jobs)?;
        millis.push(begin.elapsed().as_secs_f64() * 1e3);
        let Tracer::Gpu(gpu) = &*tracer else { unreachable!() };
        if let Some(times) = gpu.device_times() {
            traced.push((times.traced_nanos - times.begun_nanos) as f64 / 1e6);
            copied.push((times.copied_nanos - times.traced_nanos) as f64 / 1e6);
        }
    }
    let Tracer::Gpu(gpu) = tracer else { unreachable!() };
    let imported = gpu.imported_count();
    gpu.forget_imports();
    for numbers in [&mut millis, &mut traced, &mut copied] {
        numbers.sort_by(f64::total_cmp);
    }
    let at = |share: f64| millis[((millis.len() - 1) as f64 * share).round() as usize];
    // A device without timestamps has none of these.
    let median = |numbers: &[f64]| numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN);
    // Agents are counted per image, other bundles as a whole.
    let count = if sensor_sets.len() > 1 {
        sensor_sets.iter().map(|(sensors, _)| sensors.len()).sum()
    } else {
        1
    };
    println!(
        "{name:<30}{:>10.3}{:>10.3}{:>10.3}{:>10.3}{:>10.3}{:>12.0}  {imported} payloads imported",
        at(0.5),
        at(0.9),
        at(0.0),
        median(&traced),
        median(&copied),
        count as f64 / at(0.5) * 1e3
    );
    Ok(())
}

/// Measures 8 poses in each of several towns with both tracers, and prints how many elements
/// differ.
fn compare_all(gpu: &mut Tracer) -> Result<bool, Box<dyn Error>> {
    println!("\nCPU against GPU, 8 poses of 640x480 and of a lidar of 32x512: how many differ");
    print!("{:<12}", "");
    for (name, _) in OUTPUTS {
        print!("{name:>18}");
    }
    println!();
    let mut right = true;
    for name in sample::towns() {
        let town = sample::Sample::named(&name)?;
        let scene = Scene::of_town(&town.town)?;
        let mut world = World::new();
        let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Default::default() };
        let actors = town.traffic(100, 3);
        world.place(&scene, stamp, 50_000_000, &Weather::default(), &actors, sample::paint);
        right &= compare(&town, &scene, &world, gpu)?;
    }
    Ok(right)
}

/// Outputs in the order of their bits: what is compared, and the denominator of the allowed share.
const OUTPUTS: [(&str, u64); 6] = [
    ("colour (> 2/255)", 1000),
    ("depth (> 1e-4)", 10_000),
    ("tag", 10_000),
    ("instance", 10_000),
    ("points", 10_000),
    ("labels", 10_000),
];

fn compare(
    town: &sample::Sample,
    scene: &Scene,
    world: &World,
    gpu: &mut Tracer,
) -> Result<bool, Box<dyn Error>> {
    let mut cpu = Tracer::Cpu(CpuTracer::new(0)?);
    let mut differ = [0u64; 6];
    let mut pairs_of_ids: BTreeMap<[u32; 2], u64> = BTreeMap::new();
    let mut points = Vec::new();
    let mut of = [0u64; 6];
    for index in 0..8 {
        let sensors = vec![sample::camera("front", 640, 480), sample::lidar("roof", 512, 32)];
        let sensor_sets = [(sensors, town.street_pose(index))];
        let (mut by_cpu, mut by_gpu) = (bundles(&sensor_sets)?, bundles(&sensor_sets)?);
        cpu.measure(scene, world, &mut jobs(&sensor_sets, &mut by_cpu))?;
        gpu.measure(scene, world, &mut jobs(&sensor_sets, &mut by_gpu))?;
        for plane in by_cpu[0].planes.clone() {
            let range = plane.offset as usize..(plane.offset + plane.byte_len) as usize;
            let (a, b) = (&by_cpu[0].pages.bytes()[range.clone()], &by_gpu[0].pages.bytes()[range]);
            let at = plane.output.trailing_zeros() as usize;
            let size = protocol::element_bytes(plane.output);
            of[at] += (a.len() / size) as u64;
            let pairs = a.chunks_exact(size).zip(b.chunks_exact(size));
            let different = pairs.filter(|(a, b)| differs(plane.output, a, b));
            for (a, b) in different {
                differ[at] += 1;
                if plane.output == output::INSTANCE {
                    let ids = [a, b].map(|id| u32::from_le_bytes([id[0], id[1], id[2], id[3]]));
                    *pairs_of_ids.entry(ids).or_default() += 1;
                }
                if plane.output == output::POINTS {
                    let [a, b] = [a, b].map(bytemuck::pod_read_unaligned::<[f32; 4]>);
                    points.push(format!("pose {index}: {a:?} on the CPU, {b:?} on the GPU"));
                }
            }
        }
    }
    let mut right = true;
    print!("{:<12}", town.name);
    for (at, (_, one_in)) in OUTPUTS.into_iter().enumerate() {
        right &= differ[at] * one_in <= of[at];
        print!("{:>18}", format!("{} of {}", differ[at], of[at]));
    }
    println!("  {}", if right { "ok" } else { "TOO MANY" });
    if !right {
        let mut often: Vec<_> = pairs_of_ids.into_iter().collect();
        often.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        for ([by_cpu, by_gpu], count) in often.into_iter().take(12) {
            println!("    {count} x {by_cpu:#x} on the CPU, {by_gpu:#x} on the GPU");
        }
        points.iter().take(24).for_each(|point| println!("    {point}"));
    }
    Ok(right)
}

fn differs(which: u32, a: &[u8], b: &[u8]) -> bool {
    let float =
        |bytes: &[u8], at: usize| f32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[at * 4 + i]));
    match which {
        output::COLOR => a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2),
        output::DEPTH => (float(a, 0) - float(b, 0)).abs() > 1e-4 * float(a, 0),
        output::POINTS => {
            let [a_at, b_at] = [a, b].map(|p| vec3(float(p, 0), float(p, 1), float(p, 2)));
            a_at.distance(b_at) > 1e-4 * a_at.length() || (float(a, 3) - float(b, 3)).abs() > 1e-3
        }
        _ => a != b,
    }
}
