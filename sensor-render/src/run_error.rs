use bake::MapError;

use crate::{error::TraceError, meshes::MeshListError, scene::SceneError};

/// Reason why the renderer ended before its host.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A port or the barrier failed.
    #[error(transparent)]
    Bus(#[from] bus::BusError),
    /// The tracer failed.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The mesh list cannot be used.
    #[error(transparent)]
    Meshes(#[from] MeshListError),
    /// The map cannot be read.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The scene of the map cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
}
