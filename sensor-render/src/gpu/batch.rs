use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use protocol::output;

use crate::rays::{Camera, Lidar, Sensor, rays};
use crate::{BundleJob, TraceError, World, outputs};

/// No such plane.
const NONE: u32 = u32::MAX;

/// The twin of `Camera` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GpuCamera {
    origin: [f32; 4],
    forward: [f32; 4],
    right: [f32; 4],
    down: [f32; 4],
    center: [f32; 2],
    width: u32,
    height: u32,
    first_group: u32,
    groups_across: u32,
    color: u32,
    depth: u32,
    instance: u32,
    tag: u32,
    first_tag: u32,
    first_packing_group: u32,
}

const _: () = assert!(size_of::<GpuCamera>() == 112);

/// The twin of `Lidar` in scene.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct GpuLidar {
    origin: [f32; 4],
    x_axis: [f32; 4],
    y_axis: [f32; 4],
    z_axis: [f32; 4],
    columns: u32,
    channels: u32,
    azimuths: u32,
    elevations: u32,
    first_group: u32,
    points: u32,
    labels: u32,
    seed: u32,
}

const _: () = assert!(size_of::<GpuLidar>() == 96);

/// A run of whole sensors of one bundle, as bytes of its payload and of the device's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    /// Index of the job.
    pub(crate) job: usize,
    /// First byte in the payload; a multiple of 64.
    pub(crate) begin: u64,
    /// Behind the last byte in the payload.
    pub(crate) end: u64,
    /// First byte in the device's output; a multiple of 64.
    pub(crate) base: u64,
}

/// What one submission measures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batch {
    pub(crate) cameras: Vec<GpuCamera>,
    pub(crate) lidars: Vec<GpuLidar>,
    /// Cosines and sines of all lidars.
    pub(crate) circles: Vec<[f32; 2]>,
    pub(crate) windows: Vec<Window>,
    /// Bytes of output.
    pub(crate) byte_len: u64,
    /// Words of unpacked tags.
    pub(crate) tag_len: u32,
    /// Workgroups of the camera, lidar and packing passes.
    pub(crate) groups: [u32; 3],
}

/// Checks the jobs, writes their tables of planes, and deals their sensors out to batches whose
/// output is at most `bytes_max` long.
pub(crate) fn batches(
    world: &World,
    jobs: &mut [BundleJob],
    bytes_max: u64,
) -> Result<Vec<Batch>, TraceError> {
    let mut batches = vec![Batch::default()];
    for (job_index, job) in jobs.iter_mut().enumerate() {
        let planes = outputs::check(job)?;
        outputs::write_table(world, job.sensors, planes, job.out);
        for of_sensor in planes.chunk_by(|a, b| a.sensor == b.sensor) {
            let (first, last) = (&of_sensor[0], &of_sensor[of_sensor.len() - 1]);
            let (begin, end) = (first.offset, last.offset + last.byte_len);
            let byte_len = (end - begin).next_multiple_of(64);
            let spec = &job.sensors[first.sensor as usize];
            let unpacked = match of_sensor.iter().find(|plane| plane.output == output::TAG) {
                Some(plane) => plane.byte_len * 4,
                None => 0,
            };
            let longest = byte_len.max(unpacked);
            if longest > bytes_max {
                let sensor = spec.name;
                return Err(TraceError::TooLarge { sensor, byte_len: longest, bytes_max });
            }
            let sensor = rays(spec, &first.world_from_sensor, world.stamp, world.delta_nanos)?;
            let mut batch = batches.last_mut().unwrap_or_else(|| unreachable!("never empty"));
            if batch.byte_len + byte_len > bytes_max
                || u64::from(batch.tag_len) * 4 + unpacked > bytes_max
            {
                batches.push(Batch::default());
                batch = batches.last_mut().unwrap_or_else(|| unreachable!("just pushed"));
            }
            let base = batch.byte_len;
            let plane = |output: u32| {
                let plane = of_sensor.iter().find(|plane| plane.output == output);
                plane.map_or(NONE, |plane| ((base + plane.offset - begin) / 4) as u32)
            };
            match sensor {
                Sensor::Camera(camera) => batch.see(&camera, plane),
                Sensor::Lidar(lidar) => batch.sweep(&lidar, plane),
            }
            batch.extend(Window { job: job_index, begin, end, base });
            batch.byte_len = base + byte_len;
        }
    }
    batches.retain(|batch| batch.byte_len > 0);
    Ok(batches)
}

impl Batch {
    fn see(&mut self, camera: &Camera, plane: impl Fn(u32) -> u32) {
        let pixels = camera.width * camera.height;
        let across = camera.width.div_ceil(8);
        let tag = plane(output::TAG);
        self.cameras.push(GpuCamera {
            origin: with(camera.origin, camera.pixel),
            forward: with(camera.forward, 0.0),
            right: with(camera.right, 0.0),
            down: with(camera.down, 0.0),
            center: camera.center,
            width: camera.width,
            height: camera.height,
            first_group: self.groups[0],
            groups_across: across,
            color: plane(output::COLOR),
            depth: plane(output::DEPTH),
            instance: plane(output::INSTANCE),
            tag,
            first_tag: self.tag_len,
            first_packing_group: self.groups[2],
        });
        self.groups[0] += across * camera.height.div_ceil(8);
        if tag != NONE {
            self.tag_len += pixels;
            self.groups[2] += (pixels.div_ceil(64) * 16).div_ceil(64);
        }
    }

    fn sweep(&mut self, lidar: &Lidar, plane: impl Fn(u32) -> u32) {
        let azimuths = self.circles.len() as u32;
        self.circles.extend_from_slice(&lidar.azimuths);
        let elevations = self.circles.len() as u32;
        self.circles.extend_from_slice(&lidar.elevations);
        self.lidars.push(GpuLidar {
            origin: with(lidar.origin, lidar.range_m),
            x_axis: with(lidar.axes.x_axis, lidar.attenuation_per_m),
            y_axis: with(lidar.axes.y_axis, lidar.noise_m),
            z_axis: with(lidar.axes.z_axis, lidar.dropoff),
            columns: lidar.columns,
            channels: lidar.channels,
            azimuths,
            elevations,
            first_group: self.groups[1],
            points: plane(output::POINTS),
            labels: plane(output::LABELS),
            seed: lidar.seed,
        });
        self.groups[1] += (lidar.columns * lidar.channels).div_ceil(64);
    }

    /// A number that changes with the layout of the output.
    pub(crate) fn plan(&self) -> u64 {
        let mut plan = self.byte_len | 1 << 63;
        let mut mix =
            |word: u64| plan = (plan ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1 << 63;
        for camera in &self.cameras {
            let GpuCamera { color, depth, instance, tag, width, height, .. } = *camera;
            for word in [color, depth, instance, tag, width, height] {
                mix(word.into());
            }
        }
        for lidar in &self.lidars {
            for word in [lidar.points, lidar.labels, lidar.columns, lidar.channels] {
                mix(word.into());
            }
        }
        plan
    }

    /// Adds a window, or lengthens the one before if it goes on there.
    fn extend(&mut self, window: Window) {
        if let Some(last) = self.windows.last_mut() {
            let gap = last.end.next_multiple_of(64);
            if last.job == window.job
                && gap == window.begin
                && last.base + (gap - last.begin) == window.base
            {
                last.end = window.end;
                return;
            }
        }
        self.windows.push(window);
    }
}

fn with(v: Vec3, w: f32) -> [f32; 4] {
    [v.x, v.y, v.z, w]
}
