//! Mesh list: glTF files that replace procedural meshes, in TOML, one line per blueprint.
//!
//! ```toml
//! vehicle.tesla.model3 = "model3.glb"
//! "static.prop.bike helmet" = "helmet.glb"
//! ```

use std::{
    io,
    path::{Path, PathBuf},
};

use mesh::Mesh;

use crate::scene::{Replaced, Scene, SceneError};

/// Most bytes of a mesh list.
const LIST_MAX: u64 = 1 << 24;
/// Most bytes of a glTF file.
const MESH_MAX: u64 = 1 << 32;

/// Files that replace the meshes of blueprints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshList {
    /// Index into the catalogue, and path of the file.
    entries: Vec<(u32, PathBuf)>,
}

/// Reason why a mesh list cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MeshListError {
    /// The file cannot be read.
    #[error("{0}: {1}")]
    Read(PathBuf, std::io::Error),
    /// The file is not valid TOML.
    #[error("{0}: {1}")]
    Syntax(PathBuf, toml::de::Error),
    /// A value is not a string.
    #[error("{0}: the value of {1} is {2}, expected a file name in quotes")]
    NoFile(PathBuf, String, String),
    /// A key is not the id of a blueprint.
    #[error("{0}: unknown blueprint {1:?}; `omnibus blueprints` lists all")]
    Unknown(PathBuf, String),
    /// The scene cannot be built with these meshes.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl MeshList {
    /// Reads a mesh list. File names are relative to its folder.
    ///
    /// # Errors
    /// [`MeshListError`] if the file cannot be read or a line is invalid.
    pub fn read(path: &Path) -> Result<MeshList, MeshListError> {
        let text = bus::read_regular(path, LIST_MAX)
            .and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other))
            .map_err(|e| MeshListError::Read(path.into(), e))?;
        let table: toml::Table = text.parse().map_err(|e| MeshListError::Syntax(path.into(), e))?;
        let mut entries = Vec::new();
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut left = vec![(String::new(), toml::Value::Table(table))];
        while let Some((id, value)) = left.pop() {
            match value {
                // Dots in a key without quotes make nested tables.
                toml::Value::Table(table) => left.extend(table.into_iter().map(|(key, value)| {
                    (if id.is_empty() { key } else { format!("{id}.{key}") }, value)
                })),
                toml::Value::String(file) => {
                    let Some((index, _)) = town::blueprint(&id) else {
                        return Err(MeshListError::Unknown(path.into(), id));
                    };
                    entries.push((index, folder.join(file)));
                }
                other => return Err(MeshListError::NoFile(path.into(), id, other.to_string())),
            }
        }
        entries.sort();
        Ok(MeshList { entries })
    }

    /// Loads the files. A file that cannot be used is reported on standard error, and its blueprint
    /// keeps its own mesh.
    pub(crate) fn load(&self) -> Vec<Replaced> {
        let mut found = Vec::new();
        for (index, file) in &self.entries {
            let blueprint = &town::catalogue()[*index as usize];
            let read = bus::read_regular(file, MESH_MAX).map_err(|e| e.to_string());
            let taken =
                read.and_then(|bytes| town::replaced(blueprint, &bytes).map_err(|e| e.to_string()));
            match taken {
                Ok((geometry, skeleton)) => found.push((*index, geometry, skeleton)),
                Err(why) => {
                    log::warn!("{}: {why}; {} keeps its own mesh", file.display(), blueprint.id)
                }
            }
        }
        found
    }
}

/// Builds a scene of a static mesh and the whole catalogue, with some blueprints from files.
///
/// # Errors
/// [`MeshListError`] if the list is invalid or the scene cannot be built.
pub fn scene_with(static_mesh: &Mesh, list: Option<&Path>) -> Result<Scene, MeshListError> {
    let replaced = list.map(MeshList::read).transpose()?.map_or(Vec::new(), |list| list.load());
    Ok(Scene::with_catalogue(static_mesh, &[], Vec::new(), &replaced)?)
}
