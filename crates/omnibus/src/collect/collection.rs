//! The scenes of a plan, as their folders lie below that of the collection.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use crate::collect::{CollectError, folder::Folder, plan::Plan};

/// The plan of a collection of scenes, with the values of the options.
pub(crate) const PLAN: &str = "plan.toml";

/// Returns the name of the folder of a scene.
pub(crate) fn scene_name(scene: u64) -> String {
    format!("scene-{scene:04}")
}

/// A folder of data sets, one for each scene.
pub(crate) struct Collection {
    pub(crate) dir: PathBuf,
    /// The scenes that have begun, by name.
    pub(crate) names: BTreeSet<String>,
    /// `None`: the scenes were put together by hand.
    pub(crate) plan: Option<Plan>,
}

impl Collection {
    /// Reads which scenes a folder holds; `None` if it is a data set itself.
    ///
    /// # Errors
    ///
    /// The folder holds neither a data set nor scenes, or its plan cannot be read.
    pub(crate) fn open(dir: &Path) -> Result<Option<Collection>, CollectError> {
        if Folder::new(dir).metadata().exists() {
            return Ok(None);
        }
        let entries = fs::read_dir(dir).map_err(|e| CollectError::io(dir, e))?;
        let has_begun = |name: &String| {
            name.starts_with("scene-") && Folder::new(&dir.join(name)).metadata().exists()
        };
        let names: BTreeSet<_> = entries
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(has_begun)
            .collect();
        let path = dir.join(PLAN);
        let plan = match path.exists() {
            true => Some(
                Plan::read(&path).map_err(|why| CollectError::damaged(&path, why.root_cause()))?,
            ),
            false => None,
        };
        if names.is_empty() && plan.is_none() {
            return Err(CollectError::NoDataSet { dir: dir.to_owned() });
        }
        Ok(Some(Collection { dir: dir.to_owned(), names, plan }))
    }

    /// Returns the names of all scenes, begun or in the plan.
    pub(crate) fn all_names(&self) -> BTreeSet<String> {
        let planned = self.plan.as_ref().map_or(0, |plan| plan.scenes);
        self.names.iter().cloned().chain((0..planned).map(scene_name)).collect()
    }

    /// Returns the folders of the scenes that have begun.
    pub(crate) fn folders(&self) -> impl Iterator<Item = PathBuf> {
        self.names.iter().map(|name| self.dir.join(name))
    }

    /// Returns the command that collects what is missing.
    pub(crate) fn continuation(&self) -> String {
        let dir = self.dir.display();
        format!("omnibus collect {dir}/{PLAN} --out {dir} --resume")
    }

    /// Returns how a scene disagrees with the plan; `None` if it does not.
    ///
    /// # Errors
    ///
    /// The scene's `metadata.json` cannot be read.
    pub(crate) fn disagreement(&self, name: &str) -> Result<Option<String>, CollectError> {
        let Some(plan) = &self.plan else { return Ok(None) };
        let Some(index) = (0..plan.scenes).find(|index| scene_name(*index) == name) else {
            let count = plan.scenes;
            return Ok(Some(format!("not of this collection: {PLAN} has {count} scenes")));
        };
        let retry = self.continuation();
        let Some(metadata) = Folder::new(&self.dir.join(name)).read_metadata()? else {
            let count = plan.scenes;
            return Ok(Some(format!("missing: {PLAN} has {count} scenes; {retry} collects it")));
        };
        let (scene, frames) = (metadata.settings.scene, metadata.frames_requested);
        if (scene, frames) != (index, plan.frames) {
            let wanted = plan.frames;
            return Ok(Some(format!(
                "of another collection: metadata.json has scene {scene} of {frames} frames, {PLAN} has \
                 scene {index} of {wanted} frames; remove the folder, then {retry}"
            )));
        }
        if !metadata.complete {
            return Ok(Some(format!("unfinished; {retry} continues it")));
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::collect::{
        format::SpawnedActors,
        metadata,
        testing::{Scratch, settings},
    };

    #[test]
    fn scenes_that_are_missing_unfinished_foreign_or_not_planned_disagree_with_the_plan() {
        let scratch = Scratch::new("collection");
        let dir = scratch.path();
        assert!(matches!(Collection::open(dir), Err(CollectError::NoDataSet { .. })));
        fs::write(dir.join(PLAN), "scenes = 4\nframes = 5\n").unwrap();
        let put = |name: &str, scene: u64, frames: u64, complete: bool| {
            let mut metadata = metadata::of(settings(), SpawnedActors::default(), &[], frames);
            (metadata.settings.scene, metadata.complete) = (scene, complete);
            fs::create_dir(dir.join(name)).unwrap();
            Folder::new(&dir.join(name)).write_metadata(&metadata).unwrap();
        };
        put("scene-0000", 0, 5, true);
        put("scene-0001", 1, 5, false);
        put("scene-0002", 0, 5, true);
        put("scene-0007", 7, 5, true);
        fs::create_dir(dir.join("scene-0003")).unwrap();
        let collection = Collection::open(dir).unwrap().unwrap();
        let told: BTreeMap<_, _> = (collection.all_names().into_iter())
            .filter_map(|name| {
                let said = collection.disagreement(&name).unwrap()?;
                Some((name, said))
            })
            .collect();
        let expected = [
            ("scene-0001", "unfinished"),
            ("scene-0002", "scene 0 of 5 frames, plan.toml has scene 2"),
            ("scene-0003", "missing: plan.toml has 4 scenes"),
            ("scene-0007", "plan.toml has 4 scenes"),
        ];
        assert_eq!(told.len(), expected.len(), "{told:?}");
        for (name, said) in expected {
            assert!(told[name].contains(said), "{told:?}");
        }
        assert!(told["scene-0003"].contains("--resume"), "{told:?}");
        // A scene itself is no collection.
        assert!(Collection::open(&dir.join("scene-0000")).unwrap().is_none());
    }
}
