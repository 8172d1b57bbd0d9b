//! The CPU and the GPU tracer agree. Depths agree within a relative 1e-4, tags and ids in all but 1
//! of 10 000 pixels, colours within 2 of 255 in all but 1 of 1000 pixels. The rest are rays that
//! graze an edge, where the tracers round differently. Without a Vulkan adapter these tests are
//! skipped with a note.

use glam::{Vec3, vec3};
use protocol::{Frame, Plane, Pose, SensorSpec, Stamp, Weather, layout, output, quality};

use super::GpuTracer;
use crate::{BundleJob, CpuTracer, Scene, TraceError, Tracer, World, pose_planes, sample};

/// Returns the tracer on the first adapter, hardware or software.
pub(crate) fn gpu() -> Option<Tracer> {
    match GpuTracer::open(Some(0), 0) {
        Ok(Some(tracer)) => Some(Tracer::Gpu(Box::new(tracer))),
        Ok(None) => None,
        Err(why @ TraceError::NoAdapter { .. }) => {
            note_skipped(&why.to_string());
            None
        }
        Err(why) => panic!("{why}"),
    }
}

/// Records that the running test is skipped; `./run test` counts and lists these notes.
fn note_skipped(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or_default().rsplit("::").next().unwrap_or_default().to_owned();
    eprintln!("skipped {test}: {why}");
    if let Some(path) = std::env::var_os("OMNIBUS_TEST_NOTES") {
        use std::io::Write as _;
        let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
        let line = format!("skipped {test}: {why}\n");
        file.and_then(|mut file| file.write_all(line.as_bytes())).expect("the notes are writable");
    }
}

fn town() -> (sample::Sample, Scene) {
    let town = sample::Sample::named("Flatford").unwrap();
    let scene = Scene::of_town(&town.town).unwrap();
    (town, scene)
}

fn world(town: &sample::Sample, scene: &Scene, frame: u64) -> World {
    world_in(town, scene, frame, &Weather::default())
}

fn world_in(town: &sample::Sample, scene: &Scene, frame: u64, weather: &Weather) -> World {
    let mut world = World::new();
    let stamp =
        Stamp { frame: Frame(frame), sim_time_nanos: frame * 50_000_000, ..Default::default() };
    let actors = town.traffic(40, frame);
    world.place(scene, stamp, 50_000_000, weather, &actors, sample::paint);
    world
}

/// Returns clear weather by day, clear weather at night, and rain.
fn weathers() -> [Weather; 3] {
    let clear = Weather::default();
    let night = Weather { sun_altitude_rad: -0.4, ..clear };
    let rain = Weather {
        cloudiness: 70.0,
        precipitation: 40.0,
        precipitation_deposits: 60.0,
        wetness: 80.0,
        fog_density: 10.0,
        ..clear
    };
    [clear, night, rain]
}

struct MeasuredBundle {
    planes: Vec<Plane>,
    words: Vec<[u64; 8]>,
}

impl MeasuredBundle {
    fn new(sensors: &[SensorSpec], world_from_parent: Pose) -> MeasuredBundle {
        let (mut planes, byte_len) = layout(sensors);
        pose_planes(&mut planes, sensors, &world_from_parent);
        MeasuredBundle { planes, words: vec![[0; 8]; byte_len as usize / 64] }
    }

    fn plane<T: bytemuck::Pod>(&self, index: usize) -> &[T] {
        let (plane, bytes) = (&self.planes[index], bytemuck::cast_slice::<_, u8>(&self.words));
        bytemuck::cast_slice(&bytes[plane.offset as usize..][..plane.byte_len as usize])
    }
}

fn measure(
    tracer: &mut Tracer,
    scene: &Scene,
    world: &World,
    sensors: &[(&[SensorSpec], Pose)],
) -> Vec<MeasuredBundle> {
    let mut bundles: Vec<MeasuredBundle> =
        sensors.iter().map(|(sensors, pose)| MeasuredBundle::new(sensors, *pose)).collect();
    let mut jobs: Vec<BundleJob> = bundles
        .iter_mut()
        .zip(sensors)
        .map(|(bundle, (sensors, _))| BundleJob {
            parent: protocol::ActorId::NONE,
            sensors,
            planes: &bundle.planes,
            out: bytemuck::cast_slice_mut(&mut bundle.words),
        })
        .collect();
    tracer.measure(scene, world, &mut jobs).unwrap();
    bundles
}

/// Returns how many elements of two planes differ beyond rounding, and how many there are.
fn disagreements(
    output: u32,
    a: &MeasuredBundle,
    b: &MeasuredBundle,
    index: usize,
) -> (usize, usize) {
    fn count<T: bytemuck::Pod>(
        a: &MeasuredBundle,
        b: &MeasuredBundle,
        index: usize,
        differ: impl Fn(&T, &T) -> bool,
    ) -> (usize, usize) {
        let (a, b) = (a.plane::<T>(index), b.plane::<T>(index));
        (a.iter().zip(b).filter(|(a, b)| differ(a, b)).count(), a.len())
    }
    match output {
        output::DEPTH => count(a, b, index, |a: &f32, b: &f32| (a - b).abs() > 1e-4 * a),
        output::TAG => count(a, b, index, |a: &u8, b: &u8| a != b),
        output::INSTANCE => count(a, b, index, |a: &u32, b: &u32| a != b),
        output::LABELS => count(a, b, index, |a: &[u32; 2], b: &[u32; 2]| a != b),
        output::POINTS => count(a, b, index, |a: &[f32; 4], b: &[f32; 4]| {
            let [a_at, b_at] = [a, b].map(|p| Vec3::from_slice(p));
            a_at.distance(b_at) > 1e-4 * a_at.length() || (a[3] - b[3]).abs() > 1e-3
        }),
        _ => count(a, b, index, |a: &[u8; 4], b: &[u8; 4]| {
            a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2)
        }),
    }
}

#[test]
fn both_tracers_measure_the_same() {
    let Some(mut gpu) = gpu() else { return };
    let mut cpu = Tracer::Cpu(CpuTracer::new(0).unwrap());
    let (town, scene) = town();
    for index in 0..6 {
        // Every weather at two levels of quality, every level in two weathers.
        let weather = weathers()[index % 3];
        let quality = [quality::LOW, quality::STANDARD, quality::EPIC][(index + index / 3) % 3];
        let world = world_in(&town, &scene, index as u64 + 1, &weather);
        let noisy =
            SensorSpec { noise_m: 0.03, dropoff: 0.2, seed: 5, ..sample::lidar("b", 200, 24) };
        let front = SensorSpec { quality, ..sample::camera("front", 321, 243) };
        let front = [front, sample::lidar("a", 512, 32)];
        let roof = [noisy, sample::camera("low", 84, 84)];
        let pose = town.street_pose(index);
        let above = pose.then(&Pose::level(vec3(-2.0, 1.0, 1.3), 2.4));
        let bundles: [(&[SensorSpec], Pose); 2] = [(&front, pose), (&roof, above)];
        let by_cpu = measure(&mut cpu, &scene, &world, &bundles);
        let by_gpu = measure(&mut gpu, &scene, &world, &bundles);
        for (a, b) in by_cpu.iter().zip(&by_gpu) {
            for (at, plane) in a.planes.iter().enumerate() {
                let (differ, of) = disagreements(plane.output, a, b, at);
                let one_in = if plane.output == output::COLOR { 1000 } else { 10_000 };
                let allowed = of.div_ceil(one_in).max(1);
                assert!(
                    differ <= allowed,
                    "pose {index}, quality {quality}, sensor {}, output {:#x}: {differ} of {of} differ",
                    plane.sensor,
                    plane.output
                );
            }
        }
    }
}

#[test]
fn every_pixel_of_an_image_of_any_size_is_traced() {
    let Some(mut gpu) = gpu() else { return };
    let mut cpu = Tracer::Cpu(CpuTracer::new(0).unwrap());
    let (town, scene) = town();
    let world = world(&town, &scene, 1);
    let sizes = [1, 2, 4, 5, 7, 8, 9, 12, 13, 16, 17, 20, 21, 24, 27];
    let camera = |width, height| SensorSpec {
        outputs: output::COLOR | output::DEPTH,
        ..sample::camera("small", width, height)
    };
    let sensors: Vec<SensorSpec> =
        sizes.iter().flat_map(|width| sizes.map(|height| camera(*width, height))).collect();
    let bundles: [(&[SensorSpec], Pose); 1] = [(&sensors, town.street_pose(2))];
    let by_cpu = &measure(&mut cpu, &scene, &world, &bundles)[0];
    let by_gpu = &measure(&mut gpu, &scene, &world, &bundles)[0];
    let mut differing = 0;
    for (at, plane) in by_cpu.planes.iter().enumerate() {
        let (differ, of) = disagreements(plane.output, by_cpu, by_gpu, at);
        let SensorSpec { width, height, .. } = sensors[plane.sensor as usize];
        // A strip that is left out has as many pixels as the shorter side.
        assert!(
            differ < (width.min(height) as usize).min(3),
            "{differ} of {width} x {height} differ"
        );
        assert_eq!(of, width as usize * height as usize);
        differing += differ;
    }
    assert!(differing < 10, "{differing} pixels differ");
}

#[test]
fn the_gpu_gives_the_same_bytes_again() {
    let Some(mut gpu) = gpu() else { return };
    let (town, scene) = town();
    let sensors = [sample::camera("odd", 123, 77), sample::lidar("top", 300, 16)];
    let bundles: [(&[SensorSpec], Pose); 1] = [(&sensors, town.street_pose(3))];
    let world_9 = world(&town, &scene, 9);
    let first = measure(&mut gpu, &scene, &world_9, &bundles);
    let other_sensors = [sample::camera("other", 301, 55)];
    let other: [(&[SensorSpec], Pose); 1] = [(&other_sensors, town.street_pose(2))];
    measure(&mut gpu, &scene, &world(&town, &scene, 10), &other);
    let again = measure(&mut gpu, &scene, &world_9, &bundles);
    assert!(first[0].words == again[0].words);
}

#[test]
fn imported_pages_have_the_same_bytes_as_staged_ones() {
    let Some(mut gpu) = gpu() else { return };
    let (town, scene) = town();
    let world = world(&town, &scene, 2);
    // Copied, and written by the shaders, in the same memory.
    let mixed = [sample::camera("front", 200, 150), sample::lidar("top", 100, 16)];
    let surfaces = SensorSpec {
        outputs: output::COLOR | output::TAG | output::NORMAL | output::FLOW,
        quality: quality::STANDARD,
        ..sample::camera("left", 123, 45)
    };
    let cameras = [sample::camera("front", 200, 149), surfaces];
    let pose = town.street_pose(0);
    let sets: [&[SensorSpec]; 2] = [&mixed, &cameras];
    let staged =
        sets.map(|sensors| measure(&mut gpu, &scene, &world, &[(sensors, pose)]).remove(0));
    let Tracer::Gpu(tracer) = &mut gpu else { unreachable!() };
    if !tracer.can_import() {
        note_skipped(&format!("{} imports no memory", tracer.adapter()));
        return;
    }
    #[expect(unsafe_code, reason = "the pages below live until the tracer has forgotten them")]
    // SAFETY: `pages` is dropped after `forget_imports`.
    unsafe {
        tracer.import_payloads();
    }
    let longest = staged.iter().map(|staged| staged.words.len()).max().unwrap();
    let mut pages = [0, 1].map(|_| vec![Page([0; 4096]); longest / 64 + 1]);
    // Two payloads a frame.
    for measured in [[0, 1], [0, 1], [1, 0], [1, 1], [0, 0]] {
        pages.iter_mut().for_each(|pages| pages.fill(Page([0; 4096])));
        let mut jobs: Vec<BundleJob> = measured
            .iter()
            .zip(&mut pages)
            .map(|(&set, pages)| BundleJob {
                parent: protocol::ActorId::NONE,
                sensors: sets[set],
                planes: &staged[set].planes,
                out: bytemuck::cast_slice_mut(pages),
            })
            .collect();
        gpu.measure(&scene, &world, &mut jobs).unwrap();
        // With what lies between the planes.
        for (set, pages) in measured.into_iter().zip(&pages) {
            let MeasuredBundle { planes, words, .. } = &staged[set];
            let last = &planes[planes.len() - 1];
            let range = planes[0].offset as usize..(last.offset + last.byte_len) as usize;
            let bytes: &[u8] = bytemuck::cast_slice(pages);
            let staged: &[u8] = bytemuck::cast_slice(words);
            assert!(bytes[range.clone()] == staged[range], "{set} of {measured:?}");
        }
    }
    let Tracer::Gpu(tracer) = &mut gpu else { unreachable!() };
    assert_eq!(tracer.imported_count(), 2);
    tracer.forget_imports();
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(4096))]
struct Page([u8; 4096]);

#[test]
fn a_missing_adapter_is_rejected_with_a_list_of_the_available_ones() {
    let refusal = GpuTracer::open(Some(97), 0).unwrap_err().to_string();
    assert!(refusal.starts_with("--device gpu:97: there "), "{refusal}");
}
