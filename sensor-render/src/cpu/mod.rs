//! The tracer that needs no driver.

use bus::DEPTH_FAR_M;
use glam::Vec3;
use rayon::prelude::*;

use crate::echo::Echo;
use crate::hit::{Hit, NONE};
use crate::outputs::{Piece, split};
use crate::rays::{Camera, Lidar, Sensor};
use crate::reference::{Ray, closest};
use crate::workers::Workers;
use crate::{RigJob, Scene, TraceError, World};

/// Casts rays on the processor, on its own threads.
#[derive(Debug)]
pub struct CpuTracer {
    workers: Workers,
}

impl CpuTracer {
    /// A tracer with `threads` threads; 0: one for each core that this process may use.
    pub fn new(threads: usize) -> Result<CpuTracer, TraceError> {
        Ok(CpuTracer { workers: Workers::new(threads)? })
    }

    pub(crate) fn describe(&self) -> String {
        format!("{} threads", self.workers.count())
    }

    pub(crate) fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [RigJob],
    ) -> Result<(), TraceError> {
        let work = split(world, jobs)?;
        let sensors = &work.sensors;
        self.workers.run(|| {
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
                    (normal(scene, world, &hit).dot(Vec3::new(0.4, 0.3, 0.8)).abs() * 200.0) as u8
                        + 30
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
            let range_m =
                if (cos_azimuth, sin_azimuth) == (0.0, 0.0) { 0.0 } else { lidar.range_m };
            let hit = closest(scene, world, ray, range_m);
            let at = column as usize * lidar.elevations.len() + channel;
            let beam = piece.first * lidar.channels + at as u32;
            let echo = hit.is_some().then(|| {
                let triangle = &scene.triangles[hit.triangle as usize];
                let cosine = normal(scene, world, &hit).dot(ray.direction).abs();
                Echo::of(lidar, beam, hit.t, cosine, triangle.material())
            });
            let echo = echo.flatten();
            let (tag, instance) = labels(scene, world, &hit);
            if let Some(out) = sheets.points.get_mut(at) {
                *out = echo.map_or([0.0; 4], |echo| {
                    let [x, y, z] = (in_sensor * echo.distance_m).to_array();
                    [x, y, z, echo.intensity]
                });
            }
            if let Some(out) = sheets.labels.get_mut(at) {
                *out = if echo.is_some() { [instance, u32::from(tag)] } else { [0; 2] };
            }
        }
    }
}

/// In world space.
fn normal(scene: &Scene, world: &World, hit: &Hit) -> Vec3 {
    let triangle = &scene.triangles[hit.triangle as usize];
    let normal = Vec3::from(triangle.edge1).cross(Vec3::from(triangle.edge2));
    let normal = match hit.instance {
        NONE => normal,
        index => {
            let [x, y, z] = world.instances[index as usize].actor_from_world;
            let row = |row: [f32; 4]| Vec3::new(row[0], row[1], row[2]);
            row(x) * normal.x + row(y) * normal.y + row(z) * normal.z
        }
    };
    normal.normalize_or_zero()
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
