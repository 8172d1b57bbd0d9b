//! Files in the place of procedural meshes: a list in TOML, one line for each blueprint.
//!
//! ```toml
//! vehicle.tesla.model3 = "model3.glb"
//! "static.prop.bike helmet" = "helmet.glb"
//! ```

use std::fs;
use std::path::{Path, PathBuf};

use mesh::Mesh;

use crate::Scene;
use crate::scene::Replaced;

/// Which files replace which blueprints' meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshList {
    /// Index into the catalogue, and the file.
    entries: Vec<(u32, PathBuf)>,
}

/// Why a list of meshes cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MeshListError {
    /// It cannot be read.
    #[error("{0}: {1}")]
    Read(PathBuf, std::io::Error),
    /// It is no list.
    #[error("{0}: {1}")]
    Syntax(PathBuf, toml::de::Error),
    /// It gives something else than a file.
    #[error("{0}: {1} is {2}, not the name of a file in quotes")]
    NoFile(PathBuf, String, String),
    /// It names what nobody can spawn.
    #[error("{0}: no blueprint is called {1:?} (omnibus blueprints)")]
    Unknown(PathBuf, String),
}

impl MeshList {
    /// Reads a list; files are sought from its folder on.
    pub fn read(path: &Path) -> Result<MeshList, MeshListError> {
        let text = fs::read_to_string(path).map_err(|e| MeshListError::Read(path.into(), e))?;
        let table: toml::Table = text.parse().map_err(|e| MeshListError::Syntax(path.into(), e))?;
        let mut entries = Vec::new();
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut left = vec![(String::new(), toml::Value::Table(table))];
        while let Some((id, value)) = left.pop() {
            match value {
                // Dots in a name without quotes make tables within tables.
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

    /// The looks that the files give. A file that gives none is named on standard error: its
    /// blueprint keeps its own.
    pub(crate) fn load(&self) -> Vec<Replaced> {
        let mut found = Vec::new();
        for (index, file) in &self.entries {
            let blueprint = &town::catalogue()[*index as usize];
            let read = fs::read(file).map_err(|e| e.to_string());
            let taken =
                read.and_then(|bytes| town::replaced(blueprint, &bytes).map_err(|e| e.to_string()));
            match taken {
                Ok((looks, bundle)) => found.push((*index, looks, bundle)),
                Err(why) => {
                    log::warn!("{}: {why}; {} keeps its own mesh", file.display(), blueprint.id)
                }
            }
        }
        found
    }
}

/// A scene around this mesh with the whole catalogue, some of it out of files.
pub fn scene_with(static_mesh: &Mesh, list: Option<&Path>) -> Result<Scene, MeshListError> {
    let replaced = list.map(MeshList::read).transpose()?.map_or(Vec::new(), |list| list.load());
    Ok(Scene::with_catalogue(static_mesh, Vec::new(), &replaced))
}
