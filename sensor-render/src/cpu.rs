//! CPU tracer: packets of rays, no driver required.

mod beam;
mod camera;
mod develop;
mod geometry;
mod grain;
mod lamplight;
mod lens;
mod lidar;
mod occlusion;
mod overlay_raster;
mod pattern;
mod rain;
mod ray_group;
mod ray_packet;
mod room;
mod shade;
mod shadow;
mod shortlist;
mod sky;
mod slabs;
mod surface_materials;
#[cfg(test)]
mod tests;
mod traversal;
mod wear;
mod wet;

use camera::CameraRows;
use develop::Film;
use lidar::LidarColumns;
use rayon::prelude::*;
use shade::Shade;

use crate::lamps::SceneLamps;
use crate::outputs::{Tile, Work, split, split_first};
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
        let Work { sensors, tiles } = split(scene, world, jobs)?;
        let (isa, sensors) = (self.isa, &sensors);
        let light = world.light();
        let lamps = self.lamps.grid(scene, world, &light);
        let mut films: Vec<Option<Film>> = sensors.iter().map(|_| None).collect();
        for tile in tiles.iter().filter(|tile| tile.first == 0 && !tile.slices.color.is_empty()) {
            if let Sensor::Camera(camera) = &sensors[tile.sensor] {
                films[tile.sensor] = Film::new(camera, world, &light);
            }
        }
        let (tiles, prints) = onto_films(tiles, &mut films);
        let trace = |mut tile: Tile| match &sensors[tile.sensor] {
            Sensor::Camera(camera) => {
                let shade = Shade { scene, world, light: &light, lamps: &lamps, camera };
                isa.run(CameraRows { shade, tile: &mut tile });
            }
            Sensor::Lidar(lidar) => isa.run(LidarColumns { scene, world, lidar, tile: &mut tile }),
        };
        self.for_each(tiles, trace);
        if !prints.is_empty() {
            self.for_each(films.iter_mut().flatten().collect(), Film::expose);
            self.for_each(prints, |print: Print| {
                if let (Sensor::Camera(camera), Some(film)) =
                    (&sensors[print.sensor], &films[print.sensor])
                {
                    film.print(world, camera, print.first, print.rows);
                }
            });
        }
        Ok(())
    }

    /// Does each piece of work in one of the threads.
    fn for_each<T: Send>(&self, pieces: Vec<T>, work: impl Fn(T) + Send + Sync) {
        match &self.workers {
            Some(workers) => workers.run(|| pieces.into_par_iter().with_max_len(1).for_each(work)),
            None => pieces.into_iter().for_each(work),
        }
    }
}

/// Rows of a colour image that a film is developed into.
struct Print<'a> {
    /// Index into [`Work::sensors`].
    sensor: usize,
    /// First row.
    first: u32,
    rows: &'a mut [[u8; 4]],
}

/// Gives the tiles of cameras with films the rows of their films in place of those of the colour images,
/// which are developed later.
fn onto_films<'a: 'b, 'b>(
    tiles: Vec<Tile<'a>>,
    films: &'b mut [Option<Film>],
) -> (Vec<Tile<'b>>, Vec<Print<'a>>) {
    let pixels = |film: &'b mut Option<Film>| match film {
        Some(film) => &mut film.pixels[..],
        None => &mut [],
    };
    let mut rest: Vec<&'b mut [[f32; 4]]> = films.iter_mut().map(pixels).collect();
    let mut prints = Vec::new();
    let filmed = |mut tile: Tile<'a>| -> Tile<'b> {
        let Tile { sensor, first, .. } = tile;
        if rest[sensor].is_empty() {
            return tile;
        }
        let rows = std::mem::take(&mut tile.slices.color);
        let mut tile: Tile<'b> = tile;
        tile.slices.film = split_first(&mut rest[sensor], rows.len());
        prints.push(Print { sensor, first, rows });
        tile
    };
    let tiles = tiles.into_iter().map(filmed).collect();
    (tiles, prints)
}
