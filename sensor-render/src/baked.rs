//! A scene's place in the cache of baked things.

use town::cache::{Cache, Key, Parts};

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
pub(crate) fn cached_scene(
    cache: &Cache,
    open_drive: &str,
    seed: u64,
) -> Result<(Scene, bool), road::MapError> {
    let baked = cache.find(key(open_drive, seed));
    if let Some(scene) = baked.and_then(|mut parts| take(&mut parts)) {
        return Ok((scene, false));
    }
    Ok((Scene::of_town(&town_of(cache, open_drive, seed)?), true))
}

/// The town of a map, out of the cache where it is there.
pub(crate) fn town_of(
    cache: &Cache,
    open_drive: &str,
    seed: u64,
) -> Result<town::Town, road::MapError> {
    match cache.find_town(open_drive, seed) {
        Some(town) => Ok(town),
        None => Ok(town::furnish(&cache.network(open_drive)?, seed)),
    }
}

/// Keeps a scene for the next start.
pub(crate) fn keep_scene(cache: &Cache, open_drive: &str, seed: u64, scene: &Scene) {
    let levels: Vec<Level> = [&[scene.ground], &*scene.levels].concat();
    cache.keep(
        key(open_drive, seed),
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

fn key(open_drive: &str, seed: u64) -> Key {
    Key::new("scene", CODE, open_drive, seed, town::Detail::Standard)
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
