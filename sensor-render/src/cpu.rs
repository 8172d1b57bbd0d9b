//! CPU tracer: packets of rays, no driver required.

mod beam;
mod camera;
mod geometry;
mod grain;
mod lamplight;
mod lens;
mod lidar;
mod occlusion;
mod overlay_raster;
mod pattern;
mod ray_packet;
mod shade;
mod shadow;
mod single_ray;
mod sky;
mod surface_materials;
#[cfg(test)]
mod tests;
mod traversal;
mod wear;

use camera::CameraRows;
use lidar::LidarColumns;
use rayon::prelude::*;
use shade::Shade;

use crate::lamps::SceneLamps;
use crate::outputs::{Tile, split};
use crate::rays::Sensor;
use crate::simd::Isa;
use crate::workers::Workers;
use crate::{error::TraceError, job::BundleJob, scene::Scene, world::World};

/// Tracer on the CPU, with its own threads or in the calling one.
#[derive(Debug)]
pub struct CpuTracer {
    /// `None`: the calling thread traces.
    workers: Option<Workers>,
    isa: Isa,
    lamps: SceneLamps,
}

impl CpuTracer {
    /// Returns a tracer with `threads` threads; 0 means one per core that this process may use.
    ///
    /// # Errors
    /// [`TraceError::Threads`] if the threads cannot be started.
    pub fn new(threads: usize) -> Result<CpuTracer, TraceError> {
        Ok(CpuTracer { workers: Some(Workers::new(threads)?), ..CpuTracer::in_calling_thread() })
    }

    /// Returns a tracer that works in the thread that calls it. A forked process can go on with it,
    /// unlike with one that has threads.
    pub fn in_calling_thread() -> CpuTracer {
        CpuTracer { workers: None, isa: Isa::detect(), lamps: SceneLamps::default() }
    }

    /// Returns a tracer that uses the given instruction set.
    #[cfg(test)]
    pub(crate) fn with_isa(threads: usize, isa: Isa) -> CpuTracer {
        CpuTracer { isa, ..CpuTracer::new(threads).unwrap() }
    }

    pub(crate) fn describe(&self) -> String {
        let threads = self.workers.as_ref().map_or(1, Workers::count);
        format!("{threads} threads, {}", self.isa.name())
    }

    /// Measures as [`crate::Tracer::measure`].
    ///
    /// # Errors
    /// [`TraceError`]; the payloads of `jobs` may then be partly written.
    pub fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        let work = split(world, jobs)?;
        let (isa, sensors) = (self.isa, &work.sensors);
        let light = world.light();
        let lamps = self.lamps.grid(scene, world, &light);
        let trace = |mut tile: Tile| match &sensors[tile.sensor] {
            Sensor::Camera(camera) => {
                let shade = Shade { scene, world, light: &light, lamps: &lamps, camera };
                isa.run(CameraRows { shade, tile: &mut tile });
            }
            Sensor::Lidar(lidar) => isa.run(LidarColumns { scene, world, lidar, tile: &mut tile }),
        };
        match &self.workers {
            Some(workers) => {
                workers.run(|| work.tiles.into_par_iter().with_max_len(1).for_each(trace))
            }
            None => work.tiles.into_iter().for_each(trace),
        }
        Ok(())
    }
}
