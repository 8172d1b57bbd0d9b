//! The tracer that needs no driver: packets of rays that travel as one beam.

mod beam;
mod camera;
mod coats;
mod draw;
mod geometry;
mod grain;
mod lidar;
mod pattern;
mod pencil;
mod shade;
mod shadow;
mod sky;
mod solo;
#[cfg(test)]
mod tests;
mod walk;

use camera::CameraRows;
use lidar::LidarColumns;
use rayon::prelude::*;

use crate::simd::Isa;
use crate::light::Light;
use crate::outputs::split;
use crate::rays::Sensor;
use crate::workers::Workers;
use crate::{BundleJob, Scene, TraceError, World};

/// Casts rays on the processor, on its own threads.
#[derive(Debug)]
pub struct CpuTracer {
    workers: Workers,
    isa: Isa,
}

impl CpuTracer {
    /// A tracer with `threads` threads; 0: one for each core that this process may use.
    pub fn new(threads: usize) -> Result<CpuTracer, TraceError> {
        Ok(CpuTracer { workers: Workers::new(threads)?, isa: Isa::detect() })
    }

    /// The same with another instruction set.
    #[cfg(test)]
    pub(crate) fn with_isa(threads: usize, isa: Isa) -> CpuTracer {
        CpuTracer { isa, ..CpuTracer::new(threads).unwrap() }
    }

    pub(crate) fn describe(&self) -> String {
        format!("{} threads, {}", self.workers.count(), self.isa.name())
    }

    pub(crate) fn measure(
        &mut self,
        scene: &Scene,
        world: &World,
        jobs: &mut [BundleJob],
    ) -> Result<(), TraceError> {
        let work = split(world, jobs)?;
        let (isa, sensors) = (self.isa, &work.sensors);
        let light = Light::new(&world.weather, world.stamp.sim_time_nanos);
        self.workers.run(|| {
            work.pieces.into_par_iter().with_max_len(1).for_each(|mut piece| {
                match &sensors[piece.sensor] {
                    Sensor::Camera(camera) => {
                        let (light, piece) = (&light, &mut piece);
                        isa.run(CameraRows { scene, world, light, camera, piece });
                    }
                    Sensor::Lidar(lidar) => {
                        isa.run(LidarColumns { scene, world, lidar, piece: &mut piece });
                    }
                }
            });
        });
        Ok(())
    }
}
