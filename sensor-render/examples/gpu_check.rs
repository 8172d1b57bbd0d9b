//! Is the GPU right, and how fast is it? `gpu_check [auto|gpu:N] [FRAMES]`.
//!
//! First compares it with the CPU tracer pixel by pixel, then times whole frames from the world to
//! bytes in shared memory, by staging and by import. Exits with 1 if the comparison fails.

#![expect(unsafe_code, reason = "maps shared memory and lends it to the device")]

mod sample;

use std::error::Error;
use std::time::Instant;

use bus::{Frame, Plane, Pose, SensorSpec, Stamp, Weather, layout, output};
use glam::vec3;
use sensor_render::{BlueprintMesh, CpuTracer, Device, GpuTracer, RigJob};
use sensor_render::{Scene, Tracer, World, pose_planes};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let device = arguments.first().map_or("auto", String::as_str).parse()?;
    let frames: usize = arguments.get(1).map_or(Ok(60), |count| count.parse())?;
    let number = match device {
        Device::Gpu(number) => Some(number),
        _ => None,
    };
    let begin = Instant::now();
    let mut gpu = GpuTracer::open(number, 0)?.ok_or("there is no GPU here; try gpu:0")?;
    let opened_ms = begin.elapsed().as_secs_f64() * 1e3;
    println!("adapter  {}", gpu.adapter());
    println!("import   {}", if gpu.can_import() { "offered" } else { "not offered" });
    let imports = gpu.can_import();

    let begin = Instant::now();
    let town = sample::Sample::new(6, 1);
    let meshes: Vec<BlueprintMesh> = town.cars.iter().map(|mesh| BlueprintMesh { mesh }).collect();
    let made_ms = begin.elapsed().as_secs_f64() * 1e3;
    let begin = Instant::now();
    let scene = Scene::new(&town.mesh, &meshes);
    let built_ms = begin.elapsed().as_secs_f64() * 1e3;
    let actors = town.traffic(100, 3);
    let instanced: usize =
        actors.iter().map(|car| town.cars[car.blueprint as usize].triangles.len()).sum();
    println!(
        "scene    {} triangles in the town, {instanced} in {} cars; made in {made_ms:.0} ms, built in {built_ms:.0} ms; device opened in {opened_ms:.0} ms",
        town.mesh.triangles.len(),
        actors.len()
    );
    let mut world = World::new();
    let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Default::default() };
    world.place(&scene, stamp, 50_000_000, &Weather::default(), &actors, sample::paint);

    gpu.forget_imports();
    let mut gpu = Tracer::Gpu(Box::new(gpu));
    let right = compare(&town, &scene, &world, &mut gpu)?;

    println!("\n{:<26}{:>10}{:>10}{:>10}{:>12}", "whole frame, ms", "p50", "p90", "min", "rays/s");
    for (name, rigs) in workloads(&town) {
        time(&format!("{name} staged"), &rigs, &scene, &world, &mut gpu, frames)?;
        if imports {
            let Tracer::Gpu(tracer) = &mut gpu else { unreachable!() };
            // SAFETY: `time` keeps its pages until it has made the tracer forget them.
            unsafe { tracer.import_payloads() };
            time(&format!("{name} imported"), &rigs, &scene, &world, &mut gpu, frames)?;
        }
    }
    if right { Ok(()) } else { Err("the tracers disagree".into()) }
}

type Rig = (Vec<SensorSpec>, Pose);

fn workloads(town: &sample::Sample) -> Vec<(&'static str, Vec<Rig>)> {
    let ring: Vec<SensorSpec> = (0..6)
        .map(|side| SensorSpec {
            fov_rad: 1.22,
            parent_from_sensor: Pose::level(vec3(0., 0., 0.), side as f32 * 1.047),
            ..sample::camera(&format!("ring{side}"), 1600, 900)
        })
        .collect();
    let agents =
        (0..1024).map(|i| (vec![sample::camera("agent", 84, 84)], town.street_pose(i))).collect();
    vec![
        ("1x800x600", vec![(vec![sample::camera("front", 800, 600)], town.street_pose(0))]),
        ("6x1600x900", vec![(ring, town.street_pose(0))]),
        ("1024x84x84", agents),
        ("lidar 128x2048", vec![(vec![sample::lidar("roof", 2048, 128)], town.street_pose(0))]),
    ]
}

/// Shared memory as a publisher's pool would give it.
struct Pages {
    address: *mut u8,
    len: usize,
}

impl Pages {
    fn new(len: usize) -> Result<Pages, Box<dyn Error>> {
        let len = len.next_multiple_of(4096);
        // SAFETY: a fresh file and a fresh mapping; failures are checked.
        unsafe {
            let file = libc::memfd_create(c"payload".as_ptr(), 0);
            if file < 0 || libc::ftruncate(file, len as libc::off_t) != 0 {
                return Err(std::io::Error::last_os_error().into());
            }
            let access = libc::PROT_READ | libc::PROT_WRITE;
            let address = libc::mmap(std::ptr::null_mut(), len, access, libc::MAP_SHARED, file, 0);
            libc::close(file);
            if address == libc::MAP_FAILED {
                return Err(std::io::Error::last_os_error().into());
            }
            std::ptr::write_bytes(address.cast::<u8>(), 0xa5, len);
            Ok(Pages { address: address.cast(), len })
        }
    }

    fn bytes(&mut self) -> &mut [u8] {
        // SAFETY: the mapping lives as long as `self`, and nobody else has its address.
        unsafe { std::slice::from_raw_parts_mut(self.address, self.len) }
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        // SAFETY: mapped in `new`, unmapped once.
        unsafe { libc::munmap(self.address.cast(), self.len) };
    }
}

struct Bundle {
    planes: Vec<Plane>,
    pages: Pages,
}

fn bundles(rigs: &[Rig]) -> Result<Vec<Bundle>, Box<dyn Error>> {
    rigs.iter()
        .map(|(sensors, pose)| {
            let (mut planes, byte_len) = layout(sensors);
            pose_planes(&mut planes, sensors, pose);
            Ok(Bundle { planes, pages: Pages::new(byte_len as usize)? })
        })
        .collect()
}

fn jobs<'a>(rigs: &'a [Rig], bundles: &'a mut [Bundle]) -> Vec<RigJob<'a>> {
    rigs.iter()
        .zip(bundles)
        .map(|((sensors, _), bundle)| RigJob {
            sensors,
            planes: &bundle.planes,
            out: bundle.pages.bytes(),
        })
        .collect()
}

fn time(
    name: &str,
    rigs: &[Rig],
    scene: &Scene,
    world: &World,
    tracer: &mut Tracer,
    frames: usize,
) -> Result<(), Box<dyn Error>> {
    let mut bundles = bundles(rigs)?;
    let mut jobs = jobs(rigs, &mut bundles);
    for _ in 0..5 {
        tracer.measure(scene, world, &mut jobs)?;
    }
    let mut millis = Vec::with_capacity(frames);
    for _ in 0..frames {
        let begin = Instant::now();
        tracer.measure(scene, world, &mut jobs)?;
        millis.push(begin.elapsed().as_secs_f64() * 1e3);
    }
    let Tracer::Gpu(gpu) = tracer else { unreachable!() };
    let imported = gpu.imported_count();
    gpu.forget_imports();
    millis.sort_by(f64::total_cmp);
    let at = |share: f64| millis[((millis.len() - 1) as f64 * share).round() as usize];
    let rays: u64 = rigs
        .iter()
        .flat_map(|(sensors, _)| sensors)
        .map(|spec| u64::from(spec.width) * u64::from(spec.height))
        .sum();
    println!(
        "{name:<26}{:>10.3}{:>10.3}{:>10.3}{:>12.3e}  {imported} payloads imported",
        at(0.5),
        at(0.9),
        at(0.0),
        rays as f64 / at(0.5) * 1e3
    );
    Ok(())
}

/// Measures 8 poses by both tracers and prints how many elements differ.
fn compare(
    town: &sample::Sample,
    scene: &Scene,
    world: &World,
    gpu: &mut Tracer,
) -> Result<bool, Box<dyn Error>> {
    let mut cpu = Tracer::Cpu(CpuTracer::new(0)?);
    let mut differ = [0u64; 6];
    let mut of = [0u64; 6];
    for index in 0..8 {
        let sensors = vec![sample::camera("front", 640, 480), sample::lidar("roof", 512, 32)];
        let rigs = [(sensors, town.street_pose(index))];
        let (mut by_cpu, mut by_gpu) = (bundles(&rigs)?, bundles(&rigs)?);
        cpu.measure(scene, world, &mut jobs(&rigs, &mut by_cpu))?;
        gpu.measure(scene, world, &mut jobs(&rigs, &mut by_gpu))?;
        for plane in by_cpu[0].planes.clone() {
            let range = plane.offset as usize..(plane.offset + plane.byte_len) as usize;
            let (a, b) = (&by_cpu[0].pages.bytes()[range.clone()], &by_gpu[0].pages.bytes()[range]);
            let at = plane.output.trailing_zeros() as usize;
            let size = bus::element_bytes(plane.output);
            of[at] += (a.len() / size) as u64;
            let pairs = a.chunks_exact(size).zip(b.chunks_exact(size));
            differ[at] += pairs.filter(|(a, b)| differs(plane.output, a, b)).count() as u64;
        }
    }
    println!("\n8 poses of 640x480 and a lidar of 32x512, CPU against GPU");
    let mut right = true;
    for (at, name) in ["colour (> 4/255)", "depth (> 1e-4)", "tag", "instance", "points", "labels"]
        .into_iter()
        .enumerate()
    {
        let fine = differ[at] * 10_000 <= of[at];
        right &= fine || at == 0;
        let verdict = if fine { "ok" } else { "TOO MANY" };
        println!("{name:<20}{:>8} of {:>9} differ  {verdict}", differ[at], of[at]);
    }
    Ok(right)
}

fn differs(which: u32, a: &[u8], b: &[u8]) -> bool {
    let float =
        |bytes: &[u8], at: usize| f32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[at * 4 + i]));
    match which {
        output::COLOR => a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 4),
        output::DEPTH => (float(a, 0) - float(b, 0)).abs() > 1e-4 * float(a, 0),
        output::POINTS => {
            let [a_at, b_at] = [a, b].map(|p| vec3(float(p, 0), float(p, 1), float(p, 2)));
            a_at.distance(b_at) > 1e-4 * a_at.length() || (float(a, 3) - float(b, 3)).abs() > 1e-3
        }
        _ => a != b,
    }
}
