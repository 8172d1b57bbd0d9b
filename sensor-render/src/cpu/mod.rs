//! The tracer that needs no driver.

use bus::DEPTH_FAR_M;
use glam::Vec3;
use rayon::prelude::*;

use crate::hit::{Hit, NONE};
use crate::outputs::{Piece, split};
use crate::rays::{Camera, Lidar, Sensor};
use crate::reference::{Ray, closest};
use crate::{RigJob, Scene, TraceError, World};

/// Casts rays on the processor, on its own threads.
#[derive(Debug)]
pub struct CpuTracer {
    pool: rayon::ThreadPool,
}

impl CpuTracer {
    /// A tracer with `threads` threads; 0: one for each core that this process may use.
    pub fn new(threads: usize) -> Result<CpuTracer, TraceError> {
        let available = || std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let threads = if threads == 0 { available() } else { threads };
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|index| format!("render-{index}"))
            .build()
            .map(|pool| CpuTracer { pool })
            .map_err(|why| TraceError::Threads { threads, why: why.to_string() })
    }

    pub(crate) fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [RigJob],
    ) -> Result<(), TraceError> {
        let work = split(world, jobs)?;
        let sensors = &work.sensors;
        self.pool.install(|| {
            work.pieces.into_par_iter().with_max_len(1).for_each(|piece| {
                match &sensors[piece.sensor] {
                    Sensor::Camera(camera) => image(scene, world, camera, piece),
                    Sensor::Lidar(lidar) => points(scene, world, lidar, piece),
                }
            });
        });
        Ok(())
    }
}

fn image(scene: &Scene, world: &World, camera: &Camera, piece: Piece) {
    let sheets = piece.sheets;
    for row in 0..piece.count {
        for x in 0..camera.width {
            let direction = camera.direction(x, piece.first + row);
            let hit =
                closest(scene, world, Ray { origin: camera.origin, direction }, f32::INFINITY);
            let at = (row * camera.width + x) as usize;
            let (tag, instance) = labels(scene, world, &hit);
            if let Some(depth) = sheets.depth.get_mut(at) {
                *depth = hit.t.min(DEPTH_FAR_M);
            }
            if let Some(out) = sheets.tag.get_mut(at) {
                *out = tag;
            }
            if let Some(out) = sheets.instance.get_mut(at) {
                *out = instance;
            }
            if let Some(out) = sheets.color.get_mut(at) {
                let grey = if hit.is_some() {
                    let triangle = &scene.triangles[hit.triangle as usize];
                    let normal = Vec3::from(triangle.edge1)
                        .cross(Vec3::from(triangle.edge2))
                        .normalize_or_zero();
                    (normal.dot(Vec3::new(0.4, 0.3, 0.8)).abs() * 200.0) as u8 + 30
                } else {
                    220
                };
                *out = [grey, grey, grey, 255];
            }
        }
    }
}

fn points(scene: &Scene, world: &World, lidar: &Lidar, piece: Piece) {
    let sheets = piece.sheets;
    for column in 0..piece.count {
        let [cos_azimuth, sin_azimuth] = lidar.azimuths[(piece.first + column) as usize];
        for (channel, [cos, sin]) in lidar.elevations.iter().enumerate() {
            let in_sensor = Vec3::new(cos * cos_azimuth, cos * sin_azimuth, *sin);
            let ray = Ray { origin: lidar.origin, direction: lidar.axes * in_sensor };
            let hit = closest(scene, world, ray, lidar.range_m);
            let at = column as usize * lidar.elevations.len() + channel;
            let (tag, instance) = labels(scene, world, &hit);
            if let Some(out) = sheets.points.get_mut(at) {
                let [x, y, z] = (in_sensor * hit.t).to_array();
                let intensity = (-lidar.attenuation_per_m * hit.t).exp();
                *out = if hit.is_some() { [x, y, z, intensity] } else { [0.0; 4] };
            }
            if let Some(out) = sheets.labels.get_mut(at) {
                *out = if hit.is_some() { [instance, u32::from(tag)] } else { [0; 2] };
            }
        }
    }
}

/// The tag and the instance id of what was hit; the sky's where nothing was.
fn labels(scene: &Scene, world: &World, hit: &Hit) -> (u8, u32) {
    if !hit.is_some() {
        return (road::Tag::Sky as u8, 0);
    }
    let triangle = &scene.triangles[hit.triangle as usize];
    let instance = match hit.instance {
        NONE => 0x8000_0000 | triangle.object,
        index => world.instances[index as usize].id,
    };
    (triangle.tag(), instance)
}
