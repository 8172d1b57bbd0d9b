//! Sensor renderer: snapshots in, measurements out.
//!
//! Every sensor is a ray generator. A [`Scene`] holds the town and the geometry of every blueprint,
//! which stay the same for an episode. A [`World`] holds the actors and the weather of one frame. A
//! [`Tracer`] casts the rays of all sensors of all bundles and writes the measurements into the
//! memory of the caller.
//!
//! World space is right-handed, z up, in metres. Sensor space is x forward, y left, z up. Angles
//! are radians, positive to the left. On one machine, the same scene and world give the same bytes
//! with any number of threads.

mod baked;
mod bundles;
mod bvh;
mod cpu;
mod device;
mod error;
mod film;
mod glyphs;
mod gpu;
mod hit;
mod instance;
mod job;
mod lamps;
mod lens;
mod lidar;
mod lidar_air;
mod lidar_echo;
mod lidar_return;
mod lidar_spray;
mod light;
mod meshes;
mod motion;
mod outputs;
mod overlay;
mod parallel_build;
mod parked;
mod pieces;
mod plate;
mod quality;
mod rain;
mod rays;
mod reference;
mod run;
mod run_error;
mod sah_build;
mod scene;
mod simd;
mod smooth;
mod smooth_triangle;
mod surface_material;
mod surface_sample;
mod time_slices;
mod tone_curve;
mod tracer;
mod triangle;
mod wall;
mod white_balance;
mod wide;
mod workers;
mod world;

#[cfg(test)]
#[path = "../examples/sample/mod.rs"]
mod sample;
#[cfg(test)]
mod tests;

pub use baked::{scene_from, scene_of};
pub use cpu::CpuTracer;
pub use device::Device;
pub use error::TraceError;
pub use gpu::{DeviceTimes, GpuTracer};
pub use job::BundleJob;
pub use meshes::{MeshList, MeshListError, scene_with};
pub use overlay::Overlay;
pub use quality::{Quality, UnknownQuality};
pub use rays::pose_planes;
pub use run::{RenderConfig, run};
pub use run_error::RenderError;
pub use scene::{BlueprintMesh, Scene, SceneError};
pub use tracer::Tracer;
pub use world::World;
