use std::fs;
use std::path::PathBuf;

use bake::Cache;
use mapgen::{Character, Plan, generate};
use protocol::Episode;
use town::Layer;

use super::*;
use crate::baked::{cached_scene, store_scene};
use crate::scene_of;

fn map() -> String {
    generate(&Plan {
        name: "Small".into(),
        seed: 5,
        size_m: 250.0,
        character: Character::Grid,
        relief_m: 3.0,
    })
}

fn episode(open_drive: &str, seed: u64) -> Episode {
    Episode { map: "Small".into(), open_drive: open_drive.into(), seed }
}

/// Returns the image of a camera above the centre of the town, with a car in front of it.
fn picture(scene: &Scene) -> MeasuredBundle {
    let car = Pose::level(Vec3::new(12., 2., 15.), 1.);
    let world = world_with(scene, &[actor(3, car)]);
    let sensor = SensorSpec {
        parent_from_sensor: Pose::level(Vec3::new(0., 0., 16.), 0.4),
        ..camera(320, 240)
    };
    MeasuredBundle::measure(&mut cpu(2), scene, &world, &[sensor])
}

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_cached_scene_gives_the_same_bytes_and_a_damaged_one_is_rebuilt() {
    let folder = Folder(std::env::temp_dir().join(format!("omnibus-scene-{}", std::process::id())));
    let (map, cache) = (map(), Cache::in_folder(&folder.0));
    let built = scene_of(&road::Network::parse(&map).unwrap(), 1).unwrap();
    let right = picture(&built);
    let tags = right.plane::<u8>(0, output::TAG);
    assert!(tags.contains(&(Tag::Building as u8)) && tags.contains(&(Tag::Car as u8)));
    assert!(cached_scene(&cache, &episode(&map, 1)).unwrap().1, "nothing is kept yet");
    store_scene(&cache, &episode(&map, 1), &built);
    assert!(!cached_scene(&Cache::in_folder(&folder.0), &episode(&map, 1)).unwrap().1);
    assert!(cached_scene(&cache, &episode(&map, 2)).unwrap().1, "another seed is another scene");
    assert!(cached_scene(&Cache::disabled(), &episode(&map, 1)).unwrap().1);

    let (found, is_new) = cached_scene(&cache, &episode(&map, 1)).unwrap();
    assert!(!is_new && picture(&found).bytes() == right.bytes());

    let mut files = fs::read_dir(&folder.0).unwrap().map(|file| file.unwrap().path());
    let is_scene = |file: &PathBuf| file.to_string_lossy().contains("baked-scene");
    let file = files.find(is_scene).unwrap();
    let whole = fs::read(&file).unwrap();
    for at in (0..whole.len()).step_by(whole.len() / 7).chain([whole.len() - 1]) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        fs::write(&file, &bytes).unwrap();
        let (scene, is_new) = cached_scene(&cache, &episode(&map, 1)).unwrap();
        assert!(is_new, "byte {at} of {}", whole.len());
        if at == 0 {
            assert!(picture(&scene).bytes() == right.bytes());
        }
    }
    fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let (scene, is_new) = cached_scene(&cache, &episode(&map, 1)).unwrap();
    assert!(is_new && picture(&scene).bytes() == right.bytes());
    store_scene(&cache, &episode(&map, 1), &scene);
    assert!(fs::read(&file).unwrap() == whole);
}

#[test]
fn a_scene_without_a_layer_is_the_same_with_reused_blueprints() {
    let map = map();
    let town = town::furnish(&road::Network::parse(&map).unwrap(), 1);
    let whole = Scene::of_town(&town).unwrap();
    let hidden = [Layer::Buildings, Layer::ParkedVehicles];
    let without = town.visible(|_, layer| hidden.contains(&layer));
    let [new, kept] =
        [Scene::of_town(&without).unwrap(), whole.with_town(&without).unwrap().unwrap()];
    assert!(kept.triangle_count() < whole.triangle_count());
    assert!(picture(&kept).bytes() == picture(&new).bytes());
    assert!(picture(&kept).bytes() != picture(&whole).bytes());
    let again = kept.with_town(&town).unwrap().unwrap();
    assert!(picture(&again).bytes() == picture(&whole).bytes());
    let bytes = |scene: &Scene| {
        [bytemuck::cast_slice::<_, u8>(&scene.nodes), bytemuck::cast_slice(&scene.wide)].concat()
    };
    assert!(bytes(&again) == bytes(&whole));
    assert!(again.reach == whole.reach && again.town_ends == whole.town_ends);
    assert!(new.with_town(&town).unwrap().is_none(), "it holds no parked car in one piece");
}
