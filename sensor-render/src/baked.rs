//! Scenes in the cache of baked data.

use bake::{Cache, Key, Parts};
use protocol::Episode;

use crate::{
    run_error::RenderError,
    scene::{Blas, BlueprintGeometry, Scene, SceneError, new_serial},
};

/// Source code that determines the contents of a scene. It is part of the cache key, so that a
/// scene built by other code is not used.
const CODE: &str = concat!(
    include_str!("baked.rs"),
    include_str!("bvh.rs"),
    include_str!("parallel_build.rs"),
    include_str!("scene.rs"),
    include_str!("smooth.rs"),
    include_str!("triangle.rs"),
    include_str!("wall.rs"),
    include_str!("wide.rs"),
);

/// Builds the scene of a map: its town, and the geometry of every blueprint.
///
/// # Errors
/// As [`Scene::new`].
pub fn scene_of(network: &road::Network, seed: u64) -> Result<Scene, SceneError> {
    Scene::of_town(&town::furnish(network, seed))
}

/// Returns the scene of an episode: from the cache if possible, else it is built and kept.
///
/// # Errors
/// [`RenderError::Map`] and [`RenderError::Scene`].
pub fn scene_from(cache: &Cache, episode: &Episode) -> Result<Scene, RenderError> {
    let (scene, is_new) = cached_scene(cache, episode)?;
    if is_new {
        // Stored at once, so that the work is kept even if this process is stopped soon after.
        store_scene(cache, episode, &scene);
    }
    Ok(scene)
}

/// As [`scene_of`], from the cache if possible. Also returns whether the scene had to be built.
pub(crate) fn cached_scene(cache: &Cache, episode: &Episode) -> Result<(Scene, bool), RenderError> {
    let baked = cache.find(key(episode));
    if let Some(scene) = baked.and_then(|mut parts| load_scene(&mut parts)) {
        return Ok((scene, false));
    }
    let Episode { map, open_drive, seed } = episode;
    Ok((Scene::of_town(&cache.town(map, open_drive, *seed)?)?, true))
}

/// Stores a scene in the cache.
pub(crate) fn store_scene(cache: &Cache, episode: &Episode, scene: &Scene) {
    let blases: Vec<Blas> = [&[scene.town_blas], &*scene.blases].concat();
    cache.keep(
        key(episode),
        &[
            bytemuck::cast_slice(&blases),
            bytemuck::cast_slice(&[scene.reach]),
            bytemuck::cast_slice(&scene.town_ends),
            bytemuck::cast_slice(&[scene.smooth_from]),
            bytemuck::cast_slice(&scene.parked),
            bytemuck::cast_slice(&scene.plant_models),
            bytemuck::cast_slice(&scene.plants),
            bytemuck::cast_slice(&scene.walls),
            bytemuck::cast_slice(&scene.triangles),
            bytemuck::cast_slice(&scene.nodes),
            bytemuck::cast_slice(&scene.wide),
            bytemuck::cast_slice(&scene.smooth),
        ],
    );
}

fn key(episode: &Episode) -> Key {
    Key::new("scene", CODE, &episode.open_drive, episode.seed, town::Detail::Standard)
}

fn load_scene(parts: &mut Parts) -> Option<Scene> {
    let mut blases = parts.take::<Blas>()?.into_iter();
    let (town_blas, blases) = (blases.next()?, blases.collect());
    let reach = *parts.take::<f32>()?.first()?;
    let town_ends = *parts.take::<[u32; 3]>()?.first()?;
    let smooth_from = *parts.take::<u32>()?.first()?;
    let parked = parts.take()?;
    Some(Scene {
        serial: new_serial(),
        town_blas,
        town_ends,
        blases,
        geometries: BlueprintGeometry::all(&parked).0,
        reach,
        parked,
        smooth_from,
        plant_models: parts.take()?,
        plants: parts.take()?,
        walls: parts.take()?,
        triangles: parts.take()?,
        nodes: parts.take()?,
        wide: parts.take()?,
        smooth: parts.take()?,
    })
}
