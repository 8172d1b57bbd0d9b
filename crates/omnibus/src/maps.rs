//! The list of maps, and maps by name for a running simulator.

use std::path::{Path, PathBuf};

use maps::{display_name, file_of, files, find, without_carla_folder};

/// Arguments of `omnibus maps`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct MapsArgs {
    /// A folder of OpenDRIVE files; default: OMNIBUS_MAPS
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
}

/// Prints every name that `--map` takes, with the source of the map.
pub(crate) fn list(args: &MapsArgs) -> anyhow::Result<()> {
    let files = files(args.maps.as_deref())?;
    let mut lines: Vec<(String, String)> = Vec::new();
    for name in mapgen::names() {
        let about = mapgen::description(name).unwrap_or_default();
        lines.push((name.to_owned(), format!("generated: {about}")));
    }
    for name in mapgen::carla_names() {
        if file_of(&files, name).is_none() {
            let about = mapgen::description(name).unwrap_or_default();
            lines.push((name.to_owned(), format!("generated, in place of CARLA's: {about}")));
        }
    }
    for file in &files {
        lines.push((display_name(file).to_owned(), file.display().to_string()));
    }
    for (name, origin) in lines {
        print_line!("{name:<20}  {origin}");
    }
    Ok(())
}

/// Finds the maps that a running simulator loads by name.
pub(crate) struct MapLibrary {
    /// The folder of `--maps`.
    pub(crate) folder: Option<PathBuf>,
}

impl sim_host::Maps for MapLibrary {
    fn find(&self, name: &str) -> Result<(String, String), String> {
        // A relative path would be one in the host's folder, of which a client does not know.
        let is_path = Path::new(name).is_absolute();
        let text = find(name, self.folder.as_deref(), is_path).map_err(|e| e.to_string())?;
        Ok((without_carla_folder(name).to_owned(), text))
    }

    fn names(&self) -> Vec<String> {
        let files = files(self.folder.as_deref()).unwrap_or_default();
        let named = mapgen::names().chain(mapgen::carla_names()).map(str::to_owned);
        let mut names: Vec<String> =
            named.chain(files.iter().map(|file| display_name(file).to_owned())).collect();
        names.sort();
        names.dedup();
        names
    }
}
