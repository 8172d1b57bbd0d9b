use glam::Vec3;
use protocol::{ActorId, Plane, Pose, SensorSpec, element_bytes, output, sensor};

use crate::{
    error::TraceError,
    hit::NONE,
    job::BundleJob,
    lidar::{first_azimuth_rad, has_echoes, sweeps},
    lidar_echo::Echoes,
    rain::Rainfall,
    rays::{Camera, Sensor, rays},
    reference::{Ray, closest},
    scene::Scene,
    world::World,
};

/// Height above a camera up to which a roof keeps rain away. Metres.
const ROOF_FAR_M: f32 = 100.0;

/// Rows of a camera image in one tile; the height of a packet divides it.
pub(crate) const TILE_ROWS: u32 = 8;

/// Maximum width and height of a camera image, and maximum columns and channels of a lidar. Tracers
/// count the rays and words of a sensor in 32 bits.
const SIDE_MAX: u32 = 8192;

/// Approximate number of rays of a lidar in one tile.
const TILE_RAYS: u32 = 4096;

/// Run of whole rows (camera) or columns (lidar) of one sensor, with the memory that they fill.
///
/// Tiles are the work items of the threads. Their borders depend only on the sensor.
#[derive(Debug)]
pub(crate) struct Tile<'a> {
    /// Index into [`Work::sensors`].
    pub(crate) sensor: usize,
    /// First row or column.
    pub(crate) first: u32,
    /// Number of rows or columns.
    pub(crate) count: u32,
    pub(crate) slices: OutputSlices<'a>,
}

/// Elements of each output; empty if the sensor does not measure it.
#[derive(Debug, Default)]
pub(crate) struct OutputSlices<'a> {
    pub(crate) color: &'a mut [[u8; 4]],
    /// In place of the colour of a camera with effects: radiance, and depth of the nearest surface.
    pub(crate) film: &'a mut [[f32; 4]],
    pub(crate) depth: &'a mut [f32],
    pub(crate) tag: &'a mut [u8],
    pub(crate) instance: &'a mut [u32],
    pub(crate) normal: &'a mut [[f32; 3]],
    pub(crate) flow: &'a mut [[f32; 2]],
    pub(crate) points: &'a mut [[f32; 4]],
    pub(crate) labels: &'a mut [[u32; 2]],
    pub(crate) last_points: &'a mut [[f32; 4]],
    pub(crate) last_labels: &'a mut [[u32; 2]],
}

/// Ray generators of a batch, and the memory for their measurements.
#[derive(Debug)]
pub(crate) struct Work<'a> {
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) tiles: Vec<Tile<'a>>,
}

/// Checks a batch, writes each bundle's table of planes, and divides the measurements into tiles.
pub(crate) fn split<'a>(
    scene: &Scene,
    world: &World,
    jobs: &'a mut [BundleJob],
) -> Result<Work<'a>, TraceError> {
    let mut work = Work { sensors: Vec::new(), tiles: Vec::new() };
    for job in jobs {
        let planes = check(job)?;
        let (table, mut rest) = job.out.split_at_mut(size_of_val(planes));
        write_table(world, job.sensors, planes, table);
        let mut at = table.len();
        let mut slices: Vec<OutputSlices> =
            job.sensors.iter().map(|_| OutputSlices::default()).collect();
        for plane in planes {
            let (_, from_here) = rest.split_at_mut(plane.offset as usize - at);
            let (bytes, behind) = from_here.split_at_mut(plane.byte_len as usize);
            (rest, at) = (behind, (plane.offset + plane.byte_len) as usize);
            slices[plane.sensor as usize].put(plane.output, bytes);
        }
        for (index, (spec, slices)) in job.sensors.iter().zip(slices).enumerate() {
            let Some(plane) = planes.iter().find(|plane| plane.sensor as usize == index) else {
                continue;
            };
            let pose = &plane.world_from_sensor;
            work.sensors.push(ray_generator(scene, world, job.parent, spec, pose)?);
            slices.cut(spec, work.sensors.len() - 1, &mut work.tiles);
        }
    }
    Ok(work)
}

/// Returns the ray generator of one sensor of a bundle that `parent` carries.
///
/// # Errors
/// As [`rays`].
pub(crate) fn ray_generator(
    scene: &Scene,
    world: &World,
    parent: ActorId,
    spec: &SensorSpec,
    pose: &Pose,
) -> Result<Sensor, TraceError> {
    let mut sensor = rays(spec, pose, world.stamp, world.delta_nanos, world.quality)?;
    if let Sensor::Camera(camera) = &mut sensor {
        if let Some(moved) = world.motion_of(parent) {
            camera.before = Some(camera.moved(moved));
        }
        camera.rain = rainfall(scene, world, camera, parent);
    }
    if let Sensor::Lidar(lidar) = &mut sensor {
        if sweeps(spec)
            && let Some(moved) = world.motion_of(parent)
        {
            lidar.follow(spec, world.delta_nanos, moved);
        }
        if has_echoes(spec) {
            lidar.echoes = Some(Echoes::of(spec, &world.weather, &world.puffs, lidar.origin));
        }
    }
    Ok(sensor)
}

/// Returns the rain and the spray that a camera sees which `parent` carries, if there are any.
fn rainfall(
    scene: &Scene,
    world: &World,
    camera: &Camera,
    parent: ActorId,
) -> Option<Box<Rainfall>> {
    if world.puffs.is_empty() && world.weather.precipitation <= 0.0 {
        return None;
    }
    let carrier = world.velocities.binary_search_by_key(&parent, |(id, _)| *id);
    let velocity = carrier.map_or(Vec3::ZERO, |at| world.velocities[at].1);
    let has_roof = || {
        let ray = Ray { origin: camera.origin, direction: Vec3::Z };
        closest(scene, &World::new(), ray, ROOF_FAR_M).triangle != NONE
    };
    let Camera { effects, seed, origin, .. } = camera;
    let rainfall =
        Rainfall::new(&world.weather, effects, *seed, *origin, velocity, &world.puffs, has_roof);
    (!rainfall.is_none()).then(|| Box::new(rainfall))
}

/// Writes `planes` to the first bytes of a payload, with the first azimuths of lidars.
pub(crate) fn write_table(
    world: &World,
    sensors: &[SensorSpec],
    planes: &[Plane],
    table: &mut [u8],
) {
    for (plane, bytes) in planes.iter().zip(table.chunks_exact_mut(size_of::<Plane>())) {
        let spec = &sensors[plane.sensor as usize];
        let first_azimuth_rad = first_azimuth_rad(spec, world.stamp, world.delta_nanos);
        bytes.copy_from_slice(bytemuck::bytes_of(&Plane { first_azimuth_rad, ..*plane }));
    }
}

/// Returns the planes of a job after checking that each fits its sensor, the plane before it and
/// the payload.
pub(crate) fn check<'a>(job: &BundleJob<'a>) -> Result<&'a [Plane], TraceError> {
    if !job.out.as_ptr().addr().is_multiple_of(16) {
        return Err(TraceError::Unaligned);
    }
    let mut end = size_of_val(job.planes) as u64;
    for (index, plane) in job.planes.iter().enumerate() {
        let refuse = |why: String| {
            let (offset, byte_len) = (plane.offset, plane.byte_len);
            Err(TraceError::Plane { plane: index, offset, byte_len, why })
        };
        let Some(spec) = job.sensors.get(plane.sensor as usize) else {
            let count = job.sensors.len();
            return refuse(format!("it names sensor {} of {count}", plane.sensor));
        };
        let of_kind = match spec.kind {
            sensor::CAMERA => output::OF_CAMERA,
            sensor::LIDAR => output::OF_LIDAR,
            kind => return Err(TraceError::UnknownKind { sensor: spec.name, kind }),
        };
        if plane.output.count_ones() != 1 || plane.output & of_kind == 0 {
            let (sensor, kind) = (spec.name, spec.kind);
            return Err(TraceError::WrongOutput { sensor, kind, output: plane.output });
        }
        if spec.width > SIDE_MAX || spec.height > SIDE_MAX {
            let (sensor, width, height) = (spec.name, spec.width, spec.height);
            return Err(TraceError::SensorSize { sensor, width, height, max: SIDE_MAX });
        }
        let elements = u64::from(spec.width) * u64::from(spec.height);
        let needed = elements * element_bytes(plane.output) as u64;
        if plane.byte_len != needed {
            return refuse(format!(
                "{} x {} elements take {needed} bytes",
                spec.width, spec.height
            ));
        }
        if plane.offset < end || !plane.offset.is_multiple_of(64) {
            return refuse(format!("it must begin at a multiple of 64, not before {end}"));
        }
        end = plane.offset + plane.byte_len;
        if end > job.out.len() as u64 {
            return refuse(format!("the payload holds {} bytes", job.out.len()));
        }
    }
    if end > job.out.len() as u64 {
        let why = format!("the payload holds {} bytes, less than the table", job.out.len());
        return Err(TraceError::Plane { plane: 0, offset: 0, byte_len: end, why });
    }
    Ok(job.planes)
}

impl<'a> OutputSlices<'a> {
    /// Assigns the bytes of one output. Offsets are multiples of 64 from an aligned start, so the
    /// casts cannot fail.
    fn put(&mut self, output: u32, bytes: &'a mut [u8]) {
        match output {
            output::COLOR => self.color = bytemuck::cast_slice_mut(bytes),
            output::DEPTH => self.depth = bytemuck::cast_slice_mut(bytes),
            output::TAG => self.tag = bytes,
            output::INSTANCE => self.instance = bytemuck::cast_slice_mut(bytes),
            output::NORMAL => self.normal = bytemuck::cast_slice_mut(bytes),
            output::FLOW => self.flow = bytemuck::cast_slice_mut(bytes),
            output::POINTS => self.points = bytemuck::cast_slice_mut(bytes),
            output::LAST_POINTS => self.last_points = bytemuck::cast_slice_mut(bytes),
            output::LAST_LABELS => self.last_labels = bytemuck::cast_slice_mut(bytes),
            _ => self.labels = bytemuck::cast_slice_mut(bytes),
        }
    }

    fn cut(mut self, spec: &SensorSpec, sensor: usize, tiles: &mut Vec<Tile<'a>>) {
        // A camera's rows are contiguous in memory; a lidar's columns are.
        let (runs, run_len, step) = if spec.kind == sensor::CAMERA {
            (spec.height, spec.width, TILE_ROWS)
        } else {
            (spec.width, spec.height, (TILE_RAYS / spec.height.max(1)).next_multiple_of(16).max(16))
        };
        if run_len == 0 {
            return;
        }
        for first in (0..runs).step_by(step as usize) {
            let count = step.min(runs - first);
            let slices = self.take(count as usize * run_len as usize);
            tiles.push(Tile { sensor, first, count, slices });
        }
    }

    fn take(&mut self, elements: usize) -> OutputSlices<'a> {
        OutputSlices {
            color: split_first(&mut self.color, elements),
            film: split_first(&mut self.film, elements),
            depth: split_first(&mut self.depth, elements),
            tag: split_first(&mut self.tag, elements),
            instance: split_first(&mut self.instance, elements),
            normal: split_first(&mut self.normal, elements),
            flow: split_first(&mut self.flow, elements),
            points: split_first(&mut self.points, elements),
            labels: split_first(&mut self.labels, elements),
            last_points: split_first(&mut self.last_points, elements),
            last_labels: split_first(&mut self.last_labels, elements),
        }
    }
}

/// Splits off the first `count` elements, or none of an empty slice.
pub(crate) fn split_first<'a, T>(slice: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (first, rest) = std::mem::take(slice).split_at_mut_checked(count).unwrap_or_default();
    *slice = rest;
    first
}
