//! A scene's place in the cache of baked things.

use bake::{Cache, Key, MapError, Parts};
use protocol::Episode;

use crate::Scene;
use crate::scene::{Figure, Level, new_serial};

/// What decides how a scene is built: one by other code is not ours.
const CODE: &str = concat!(
    include_str!("baked.rs"),
    include_str!("bvh.rs"),
    include_str!("divide.rs"),
    include_str!("scene.rs"),
    include_str!("wall.rs"),
    include_str!("wide.rs"),
);

/// The scene of a map: its town, and every blueprint's looks.
pub fn scene_of(network: &road::Network, seed: u64) -> Scene {
    Scene::of_town(&town::furnish(network, seed))
}

/// As [`scene_of`], out of the cache where it is there; and whether it had to be built.
pub(crate) fn cached_scene(cache: &Cache, episode: &Episode) -> Result<(Scene, bool), MapError> {
    let baked = cache.find(key(episode));
    if let Some(scene) = baked.and_then(|mut parts| take(&mut parts)) {
        return Ok((scene, false));
    }
    let Episode { map, open_drive, seed } = episode;
    Ok((Scene::of_town(&cache.town(map, open_drive, *seed)?), true))
}

/// Keeps a scene for the next start.
pub(crate) fn keep_scene(cache: &Cache, episode: &Episode, scene: &Scene) {
    let levels: Vec<Level> = [&[scene.ground], &*scene.levels].concat();
    cache.keep(
        key(episode),
        &[
            bytemuck::cast_slice(&levels),
            bytemuck::cast_slice(&[scene.reach]),
            bytemuck::cast_slice(&scene.town_ends),
            bytemuck::cast_slice(&scene.parked),
            bytemuck::cast_slice(&scene.walls),
            bytemuck::cast_slice(&scene.triangles),
            bytemuck::cast_slice(&scene.nodes),
            bytemuck::cast_slice(&scene.wide),
        ],
    );
}

fn key(episode: &Episode) -> Key {
    Key::new("scene", CODE, &episode.open_drive, episode.seed, town::Detail::Standard)
}

fn take(parts: &mut Parts) -> Option<Scene> {
    let mut levels = parts.take::<Level>()?.into_iter();
    let (ground, levels) = (levels.next()?, levels.collect());
    let reach = *parts.take::<f32>()?.first()?;
    let town_ends = *parts.take::<[u32; 3]>()?.first()?;
    let parked = parts.take()?;
    Some(Scene {
        serial: new_serial(),
        ground,
        town_ends,
        levels,
        figures: Figure::all(&parked).0,
        reach,
        parked,
        walls: parts.take()?,
        triangles: parts.take()?,
        nodes: parts.take()?,
        wide: parts.take()?,
    })
}
