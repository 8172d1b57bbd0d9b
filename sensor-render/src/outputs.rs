use protocol::{Plane, SensorSpec, element_bytes, output, sensor};

use crate::rays::{Sensor, first_azimuth_rad, rays};
use crate::{BundleJob, TraceError, World};

/// Rows of a camera image in one piece; packets are as high or a divisor of it.
pub(crate) const PIECE_ROWS: u32 = 8;

/// Rays of a lidar in one piece, about.
const PIECE_RAYS: u32 = 4096;

/// A run of whole rows (camera) or columns (lidar) of one sensor, with the bytes they fill.
///
/// Pieces are what threads share out. Their borders depend on nothing but the sensor.
#[derive(Debug)]
pub(crate) struct Piece<'a> {
    /// Index into [`Work::sensors`].
    pub(crate) sensor: usize,
    /// First row or column.
    pub(crate) first: u32,
    /// How many.
    pub(crate) count: u32,
    pub(crate) sheets: Sheets<'a>,
}

/// Each output's elements; empty where nobody wants them.
#[derive(Debug, Default)]
pub(crate) struct Sheets<'a> {
    pub(crate) color: &'a mut [[u8; 4]],
    pub(crate) depth: &'a mut [f32],
    pub(crate) tag: &'a mut [u8],
    pub(crate) instance: &'a mut [u32],
    pub(crate) normal: &'a mut [[f32; 3]],
    pub(crate) flow: &'a mut [[f32; 2]],
    pub(crate) points: &'a mut [[f32; 4]],
    pub(crate) labels: &'a mut [[u32; 2]],
}

/// All rays of a batch, and all bytes.
#[derive(Debug)]
pub(crate) struct Work<'a> {
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) pieces: Vec<Piece<'a>>,
}

/// Checks a batch, writes each bundle's table of planes, and cuts the rest into pieces.
pub(crate) fn split<'a>(world: &World, jobs: &'a mut [BundleJob]) -> Result<Work<'a>, TraceError> {
    let mut work = Work { sensors: Vec::new(), pieces: Vec::new() };
    for job in jobs {
        let planes = check(job)?;
        let (table, mut rest) = job.out.split_at_mut(size_of_val(planes));
        write_table(world, job.sensors, planes, table);
        let mut at = table.len();
        let mut sheets: Vec<Sheets> = job.sensors.iter().map(|_| Sheets::default()).collect();
        for plane in planes {
            let (_, from_here) = rest.split_at_mut(plane.offset as usize - at);
            let (bytes, behind) = from_here.split_at_mut(plane.byte_len as usize);
            (rest, at) = (behind, (plane.offset + plane.byte_len) as usize);
            sheets[plane.sensor as usize].put(plane.output, bytes);
        }
        for (index, (spec, sheets)) in job.sensors.iter().zip(sheets).enumerate() {
            let Some(plane) = planes.iter().find(|plane| plane.sensor as usize == index) else {
                continue;
            };
            let pose = &plane.world_from_sensor;
            let mut sensor = rays(spec, pose, world.stamp, world.delta_nanos)?;
            if let (Sensor::Camera(camera), Some(moved)) = (&mut sensor, world.motion(job.parent)) {
                camera.before = Some(camera.moved(moved));
            }
            work.sensors.push(sensor);
            sheets.cut(spec, work.sensors.len() - 1, &mut work.pieces);
        }
    }
    Ok(work)
}

/// Whether the shaders lack one of these outputs, so that the processor measures them all.
pub(crate) fn need_cpu(planes: &[Plane]) -> bool {
    planes.iter().any(|plane| plane.output & (output::NORMAL | output::FLOW) != 0)
}

/// Writes `planes` into the first bytes of a payload, with their lidars' first azimuths.
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

/// The planes of a job, if each fits its sensor, the one before it and the payload.
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
            return refuse(format!(
                "the bundle has {count} sensors, this is of number {}",
                plane.sensor
            ));
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
        let elements = u64::from(spec.width) * u64::from(spec.height);
        let needed = elements * element_bytes(plane.output) as u64;
        if plane.byte_len != needed {
            return refuse(format!("{} x {} elements take {needed}", spec.width, spec.height));
        }
        if plane.offset < end || !plane.offset.is_multiple_of(64) {
            return refuse(format!(
                "what is before it ends at {end}, and edges are at multiples of 64"
            ));
        }
        end = plane.offset + plane.byte_len;
        if end > job.out.len() as u64 {
            return refuse(format!("the payload holds {}", job.out.len()));
        }
    }
    if end > job.out.len() as u64 {
        let why = format!("the payload holds {}, less than the table", job.out.len());
        return Err(TraceError::Plane { plane: 0, offset: 0, byte_len: end, why });
    }
    Ok(job.planes)
}

impl<'a> Sheets<'a> {
    /// Offsets are multiples of 64 from an aligned start, so the casts hold.
    fn put(&mut self, output: u32, bytes: &'a mut [u8]) {
        match output {
            output::COLOR => self.color = bytemuck::cast_slice_mut(bytes),
            output::DEPTH => self.depth = bytemuck::cast_slice_mut(bytes),
            output::TAG => self.tag = bytes,
            output::INSTANCE => self.instance = bytemuck::cast_slice_mut(bytes),
            output::NORMAL => self.normal = bytemuck::cast_slice_mut(bytes),
            output::FLOW => self.flow = bytemuck::cast_slice_mut(bytes),
            output::POINTS => self.points = bytemuck::cast_slice_mut(bytes),
            _ => self.labels = bytemuck::cast_slice_mut(bytes),
        }
    }

    fn cut(mut self, spec: &SensorSpec, sensor: usize, pieces: &mut Vec<Piece<'a>>) {
        // A camera's rows lie one after the other in memory, a lidar's columns do.
        let (runs, run_len, step) = if spec.kind == sensor::CAMERA {
            (spec.height, spec.width, PIECE_ROWS)
        } else {
            (
                spec.width,
                spec.height,
                (PIECE_RAYS / spec.height.max(1)).next_multiple_of(16).max(16),
            )
        };
        if run_len == 0 {
            return;
        }
        for first in (0..runs).step_by(step as usize) {
            let count = step.min(runs - first);
            let sheets = self.take(count as usize * run_len as usize);
            pieces.push(Piece { sensor, first, count, sheets });
        }
    }

    fn take(&mut self, elements: usize) -> Sheets<'a> {
        Sheets {
            color: first(&mut self.color, elements),
            depth: first(&mut self.depth, elements),
            tag: first(&mut self.tag, elements),
            instance: first(&mut self.instance, elements),
            normal: first(&mut self.normal, elements),
            flow: first(&mut self.flow, elements),
            points: first(&mut self.points, elements),
            labels: first(&mut self.labels, elements),
        }
    }
}

/// Takes the first `count` elements off, or none of an empty slice.
fn first<'a, T>(slice: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (first, rest) = std::mem::take(slice).split_at_mut_checked(count).unwrap_or_default();
    *slice = rest;
    first
}
