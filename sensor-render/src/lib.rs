//! The sensors: snapshots in, measurements out.
//!
//! Every sensor is a ray generator. A [`Scene`] holds what stands still and what blueprints look
//! like, a [`World`] holds one frame's actors and weather, and a [`Tracer`] casts the rays of all
//! sensors of all bundles and writes what they see straight into the caller's bytes.
//!
//! World space is right-handed, z up, metres; sensor space is x forward, y left, z up. Angles are
//! radians, positive to the left. The same scene and world give the same bytes, whatever the
//! number of threads.

mod baked;
mod bundles;
mod bvh;
mod coat;
mod cpu;
mod device;
mod divide;
mod echo;
mod gallery;
mod glyphs;
mod gpu;
mod heuristic;
mod hit;
mod simd;
mod light;
mod meshes;
mod motion;
mod outputs;
mod overlay;
mod rays;
#[cfg(test)]
mod reference;
mod run;
mod scene;
mod surface;
mod tracer;
mod wall;
mod wide;
mod workers;
mod world;

#[cfg(test)]
#[path = "../examples/sample/mod.rs"]
mod sample;
#[cfg(test)]
mod tests;

pub use baked::scene_of;
pub use cpu::CpuTracer;
pub use device::Device;
pub use gpu::GpuTracer;
pub use meshes::{MeshList, MeshListError, scene_with};
pub use overlay::Overlay;
pub use rays::pose_planes;
pub use run::{RenderConfig, RenderError, run};
pub use scene::{BlueprintMesh, Scene};
pub use tracer::{BundleJob, TraceError, Tracer};
pub use world::World;
