use std::{
    env, fs,
    path::{Path, PathBuf},
    process,
    time::{Duration, SystemTime},
};

use road::Network;
use town::{Detail, Town, furnish};

use crate::{
    cache::{FILES_MAX, folder_from},
    *,
};

/// A folder for one test, removed when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = env::temp_dir().join(format!("omnibus-cache-{name}-{}", process::id()));
        let _ = fs::remove_dir_all(&folder);
        Folder(folder)
    }

    fn only_file(&self) -> PathBuf {
        let mut files =
            fs::read_dir(&self.0).expect("the folder").map(|e| e.expect("entry").path());
        let file = files.next().expect("a file");
        assert!(files.next().is_none(), "one file");
        file
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn key(seed: u64) -> Key {
    Key::new("test", "", "<OpenDRIVE/>", seed, Detail::Standard)
}

const WORDS: [u64; 5] = [1, 2, 3, 0, 5];

fn keep(cache: &Cache, key: Key) {
    cache.keep(key, &[bytemuck::cast_slice(&WORDS), b"tail"]);
}

fn find(cache: &Cache, key: Key) -> Option<(Vec<u64>, Vec<u8>)> {
    let mut parts = cache.find(key)?;
    Some((parts.take()?, parts.take()?))
}

#[test]
fn a_kept_thing_is_found_under_its_own_key_only() {
    let folder = Folder::new("found");
    let cache = Cache::in_folder(&folder.0);
    assert_eq!(find(&cache, key(1)), None);
    keep(&cache, key(1));
    assert_eq!(find(&cache, key(1)), Some((WORDS.to_vec(), b"tail".to_vec())));
    for other in [
        key(2),
        Key::new("test", "1", "<OpenDRIVE/>", 1, Detail::Standard),
        Key::new("other", "", "<OpenDRIVE/>", 1, Detail::Standard),
        Key::new("test", "", "<OpenDRIVE/> ", 1, Detail::Standard),
        Key::new("test", "", "<OpenDRIVE/>", 1, Detail::High),
    ] {
        assert_ne!(key(1), other);
        assert_eq!(find(&cache, other), None);
    }
}

#[test]
fn every_block_of_a_long_part_is_read_and_checked() {
    let folder = Folder::new("blocks");
    let cache = Cache::in_folder(&folder.0);
    // Two and a half blocks, and a value that no large page ends with.
    let words: Vec<u64> = (0..(10 << 20) / 8 + 3).collect();
    cache.keep(key(1), &[b"head", bytemuck::cast_slice(&words), b"tail"]);
    let read = || -> Option<(Vec<u8>, Vec<u64>, Vec<u8>)> {
        let mut parts = cache.find(key(1))?;
        Some((parts.take()?, parts.take()?, parts.take()?))
    };
    assert!(read() == Some((b"head".to_vec(), words.clone(), b"tail".to_vec())));
    let file = folder.only_file();
    let bytes = fs::read(&file).expect("the file");
    for at in [bytes.len() - 5, bytes.len() - (2 << 20), bytes.len() / 2, bytes.len() / 10] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 4;
        fs::write(&file, damaged).expect("write");
        assert!(read().is_none(), "byte {at}");
    }
    fs::write(&file, &bytes).expect("write");
    assert!(read().is_some());
}

#[test]
fn shared_values_are_those_that_were_kept_and_damaged_ones_are_a_miss() {
    let folder = Folder::new("shared");
    let cache = Cache::in_folder(&folder.0);
    // Alignment of a cache line after a part of odd length; more than a block.
    #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
    #[repr(C, align(64))]
    struct Line([u64; 8]);
    let lines: Vec<Line> = (0..70_000).map(|number| Line([number; 8])).collect();
    cache.keep(key(1), &[b"odd", bytemuck::cast_slice(&lines), b"", b"tail"]);
    let read = || {
        let mut parts = cache.find(key(1))?;
        let head = parts.share::<u8>()?;
        let (lines, none) = (parts.share::<Line>()?, parts.share::<u32>()?);
        assert!(none.is_empty());
        // An own part between shared ones.
        Some((head.to_vec(), lines, parts.take::<u8>()?))
    };
    let (head, shared, tail) = read().expect("intact");
    assert_eq!((&*head, &*tail), (&b"odd"[..], &b"tail"[..]));
    assert!(*shared == *lines);
    let mut parts = cache.find(key(1)).expect("intact");
    assert!(parts.share::<u64>().is_none(), "three bytes are no u64");
    let file = folder.only_file();
    let bytes = fs::read(&file).expect("the file");
    for at in [200, bytes.len() / 2, bytes.len() - 5] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 4;
        // Another file: the values above stay as they are.
        fs::remove_file(&file).expect("remove");
        fs::write(&file, damaged).expect("write");
        assert!(read().is_none(), "byte {at}");
    }
    assert!(*shared == *lines);
}

#[test]
fn the_key_covers_the_sources_of_every_crate_that_decides_the_bytes() {
    let crates: Vec<&str> = env!("OMNIBUS_SOURCE_CRATES").split(' ').collect();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for name in ["bake", "mesh", "road", "town"].into_iter().filter(|n| folder.join(n).exists()) {
        assert!(crates.contains(&name), "{name} is not in {crates:?}");
    }
    assert!(!crates.contains(&"mapgen"), "the map's text is in the key itself");
}

#[test]
fn a_file_with_a_flipped_bit_or_cut_short_is_a_miss() {
    let folder = Folder::new("damaged");
    let cache = Cache::in_folder(&folder.0);
    keep(&cache, key(1));
    let file = folder.only_file();
    let whole = fs::read(&file).expect("the file");
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&file, &bytes).expect("write");
        assert_eq!(find(&cache, key(1)), None, "byte {at}");
        fs::write(&file, &whole[..at]).expect("write");
        assert_eq!(find(&cache, key(1)), None, "{at} bytes of {}", whole.len());
    }
    fs::write(&file, [&whole[..], b"more"].concat()).expect("write");
    assert_eq!(find(&cache, key(1)), None);
    keep(&cache, key(1));
    assert!(find(&cache, key(1)).is_some(), "the damaged file is replaced");
    assert_eq!(folder.only_file(), file);
}

#[test]
fn a_network_is_found_as_it_was_parsed_and_a_damaged_one_is_parsed_again() {
    let folder = Folder::new("network");
    let cache = Cache::in_folder(&folder.0);
    let (name, text) = mapgen::default_map();
    let network = Network::parse(&text).expect("a map");
    // Not by assert_eq, which would print whole maps.
    let check = |what: &str| {
        let found = cache.network(name, &text).expect("a map");
        assert!(found == network, "{what}");
    };
    check("parsed");
    let file = folder.only_file();
    let whole = fs::read(&file).expect("the file");
    check("found");
    let is_kept = || fs::read(folder.only_file()).expect("the file") == whole;
    assert!(is_kept());
    for at in (0..whole.len()).step_by(whole.len() / 30 + 1) {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::remove_file(&file).expect("remove");
        fs::write(&file, &bytes).expect("write");
        check("damaged");
        assert!(is_kept(), "the file is replaced after damage at {at}");
        fs::remove_file(&file).expect("remove");
        fs::write(&file, &whole[..at]).expect("write");
        check("shortened");
        assert!(is_kept(), "the file is replaced after a cut to {at} bytes");
    }
    assert!(cache.network(name, &format!("{text}<!-- -->")).expect("a map") == network);
    assert_eq!(fs::read_dir(&folder.0).expect("the folder").count(), 2, "one file for each text");
    let error = cache.network("Nowhere", "<OpenDRIVE/>").expect_err("no roads");
    assert!(error.to_string().starts_with("Nowhere: line "), "{error}");
}

#[test]
fn a_disabled_cache_and_an_unwritable_folder_keep_nothing() {
    let folder = Folder::new("off");
    let folder_of = |set: &[(&str, &str)]| {
        folder_from(|name| set.iter().find(|(n, _)| *n == name).map(|(_, value)| value.into()))
    };
    assert_eq!(folder_of(&[("OMNIBUS_CACHE", ""), ("HOME", "/h")]), None);
    assert_eq!(folder_of(&[("OMNIBUS_CACHE", "/c"), ("HOME", "/h")]), Some("/c".into()));
    assert_eq!(folder_of(&[("XDG_CACHE_HOME", "/x"), ("HOME", "/h")]), Some("/x/omnibus".into()));
    assert_eq!(folder_of(&[("HOME", "/h")]), Some("/h/.cache/omnibus".into()));
    assert_eq!(folder_of(&[]), None);
    keep(&Cache::disabled(), key(1));
    assert_eq!(find(&Cache::disabled(), key(1)), None);
    fs::write(&folder.0, "a file where the folder should be").expect("write");
    let cache = Cache::in_folder(&folder.0);
    keep(&cache, key(1));
    assert_eq!(find(&cache, key(1)), None);
    fs::remove_file(&folder.0).expect("remove");
}

#[test]
fn pruning_keeps_the_newest_files_and_every_foreign_file() {
    let folder = Folder::new("pruned");
    let cache = Cache::in_folder(&folder.0);
    fs::create_dir_all(&folder.0).expect("folder");
    fs::write(folder.0.join("mine"), "x").expect("write");
    for seed in 0..FILES_MAX as u64 + 4 {
        keep(&cache, key(seed));
        let file = fs::File::open(folder.0.join(key(seed).file_name())).expect("file");
        let written = SystemTime::UNIX_EPOCH + Duration::from_secs(1000 + seed);
        file.set_modified(written).expect("time");
    }
    // No process has this number.
    let left = folder.0.join(format!("{}.4294967295.0", key(98).file_name()));
    fs::write(&left, "begun").expect("write");
    keep(&cache, key(99));
    assert!(!left.exists());
    assert_eq!(fs::read_dir(&folder.0).expect("folder").count(), FILES_MAX + 1);
    assert!(folder.0.join("mine").exists());
    assert!(find(&cache, key(99)).is_some());
    assert!(find(&cache, key(0)).is_none());
}

#[test]
fn a_kept_town_is_found_unchanged_and_a_damaged_one_is_a_miss() {
    let folder = Folder::new("town");
    let cache = Cache::in_folder(&folder.0);
    let mut town = Town::default();
    town.objects.push(town::Object {
        tag: mesh::Tag::Building,
        layer: town::Layer::Buildings,
        center: glam::Vec3::X,
        half_extents_m: glam::Vec3::ONE,
        yaw_rad: 0.5,
        color: [1, 2, 3],
    });
    town.colliders.push(town::Collider {
        object: 0,
        center: glam::Vec3::X,
        half_extents_m: glam::Vec3::ONE,
        yaw_rad: 0.5,
    });
    cache.keep_town("map", 3, &town);
    assert_eq!(cache.find_town("map", 3), Some(town));
    assert_eq!(cache.find_town("map", 4), None);
    let file = folder.only_file();
    let mut bytes = fs::read(&file).expect("the file");
    *bytes.last_mut().expect("a byte") ^= 1;
    fs::write(&file, bytes).expect("write");
    assert_eq!(cache.find_town("map", 3), None);
}

#[test]
fn a_town_source_reports_bad_maps_first_and_recovers_from_a_damaged_town() {
    let folder = Folder::new("source");
    let cache = Cache::in_folder(&folder.0);
    let error = cache.town_source("Nowhere", "<OpenDRIVE/>", 1).expect_err("no roads");
    assert!(error.to_string().starts_with("Nowhere: line "), "{error}");
    let text = mapgen::named("Flatford").expect("a named town");
    let load = || cache.town_source("Flatford", &text, 1).expect("a map").load().expect("a town");
    let first = load();
    assert!(first.is_new);
    cache.keep_town(&text, 1, &first.town);
    let second = load();
    assert!(!second.is_new && second.town == first.town);
    let mut files = fs::read_dir(&folder.0).expect("folder").map(|e| e.expect("entry").path());
    let file = files.find(|f| f.to_string_lossy().contains("baked-town")).expect("the town");
    let mut bytes = fs::read(&file).expect("the file");
    *bytes.last_mut().expect("a byte") ^= 1;
    fs::write(&file, bytes).expect("write");
    let third = load();
    assert!(third.is_new && third.town == first.town);
}

/// Name and text of every map in the folder that `OMNIBUS_MAPS` names, by name; none without it.
fn shared_maps() -> Vec<(String, String)> {
    let Some(folder) = env::var_os("OMNIBUS_MAPS").map(PathBuf::from) else {
        return Vec::new();
    };
    let entries = fs::read_dir(folder).expect("OMNIBUS_MAPS names a folder");
    let paths = entries.map(|entry| entry.expect("a readable folder").path());
    let mut maps: Vec<(String, String)> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "xodr"))
        .map(|path| {
            let name = path.file_stem().expect("a name").to_string_lossy().to_string();
            (name, fs::read_to_string(&path).expect("a readable map"))
        })
        .collect();
    maps.sort();
    maps
}

fn flatford() -> Network {
    Network::parse(&mapgen::named("Flatford").expect("a named town")).expect("a map")
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_other_bytes() {
    let network = flatford();
    let first = town_to_bytes(&furnish(&network, 1));
    assert!(first == town_to_bytes(&furnish(&network, 1)));
    assert!(first != town_to_bytes(&furnish(&network, 2)));
}

#[test]
fn the_number_of_threads_does_not_change_a_town() {
    let by = |network: &Network, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        town_to_bytes(&pool.install(|| furnish(network, 1)))
    };
    let mut maps = shared_maps();
    maps.retain(|(name, _)| name.contains("Town02") || name.contains("Town04"));
    maps.push(("Flatford".to_owned(), mapgen::named("Flatford").expect("a named town")));
    for (name, text) in maps {
        let network = Network::parse(&text).expect("a map that loads");
        let alone = by(&network, 1);
        for threads in [2, 5] {
            assert!(by(&network, threads) == alone, "{name} on {threads} threads");
        }
    }
}

#[test]
fn a_baked_town_reads_back_unchanged() {
    let network = flatford();
    let town = furnish(&network, 3);
    let bytes = town_to_bytes(&town);
    assert!(town_from_bytes(&bytes).as_ref() == Ok(&town));
    assert_eq!(town_from_bytes(b"something else").err(), Some(TownError::Foreign));
    let short = &bytes[..bytes.len() - 1];
    assert_eq!(town_from_bytes(short).err(), Some(TownError::Damaged { part: "heads" }));
    let mut other = bytes.clone();
    other[8] += 1;
    assert!(matches!(town_from_bytes(&other), Err(TownError::Version { .. })));
    let mut unknown = town.clone();
    unknown.plants[0].model = town::plant_count();
    let damaged = town_from_bytes(&town_to_bytes(&unknown)).err();
    assert_eq!(damaged, Some(TownError::Damaged { part: "plants" }));
}

#[test]
fn the_ground_of_a_town_is_kept_without_its_scenery() {
    let folder = Folder::new("ground");
    let cache = Cache::in_folder(&folder.0);
    let text = mapgen::default_map().1;
    let network = Network::parse(&text).expect("a map");
    let first = cache.ground_around(&network, &text, 4);
    let town = furnish(&network, 4);
    assert!(first == town.without_scenery(), "another town");
    assert_eq!((&first.colliders, &first.heads), (&town.colliders, &town.heads));
    let ground = town.mesh.faces.iter().filter(|face| face.object == 0).count();
    assert_eq!(first.mesh.faces.len(), ground);
    assert!(first.mesh.positions.len() < town.mesh.positions.len() && first.parked.is_empty());
    // From the only file of the cache.
    folder.only_file();
    assert!(cache.ground_around(&network, &text, 4) == first, "another town is kept");
    let solids = Town { mesh: mesh::Mesh::default(), ..first };
    assert!(cache.solids_around(&network, &text, 4) == solids, "another town");
    assert!(cache.solids_around(&network, &text, 4) == solids, "another town is kept");
}
