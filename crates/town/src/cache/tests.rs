use std::fs;
use std::path::PathBuf;

use super::*;

/// A folder of one test's own, gone at its end.
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
fn what_was_kept_is_found_under_its_key_alone() {
    let folder = Folder::new("found");
    let cache = Cache::at(&folder.0);
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
fn no_flipped_bit_and_no_shortened_file_is_taken_for_what_was_kept() {
    let folder = Folder::new("damaged");
    let cache = Cache::at(&folder.0);
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
    assert!(find(&cache, key(1)).is_some(), "it is made anew");
    assert_eq!(folder.only_file(), file);
}

#[test]
fn a_network_is_found_as_it_was_read_and_never_a_damaged_one() {
    let folder = Folder::new("network");
    let cache = Cache::at(&folder.0);
    let (_, text) = crate::default_map();
    let network = road::Network::parse(&text).expect("a map");
    // Not by assert_eq: it would print whole maps.
    let check = |what: &str| {
        let found = cache.network(&text).expect("a map");
        assert!(found == network, "{what}");
    };
    check("read anew");
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
        assert!(is_kept(), "it is made anew after damage at {at}");
        fs::remove_file(&file).expect("remove");
        fs::write(&file, &whole[..at]).expect("write");
        check("shortened");
        assert!(is_kept(), "it is made anew after {at} bytes");
    }
    assert!(cache.network(&format!("{text}<!-- -->")).expect("a map") == network);
    assert_eq!(fs::read_dir(&folder.0).expect("the folder").count(), 2, "a key for each text");
    assert!(cache.network("<OpenDRIVE/>").is_err());
}

#[test]
fn a_cache_that_is_off_or_cannot_be_written_keeps_nothing() {
    let folder = Folder::new("off");
    let is_at = |set: &[(&str, &str)]| {
        folder_by(|name| set.iter().find(|(n, _)| *n == name).map(|(_, value)| value.into()))
    };
    assert_eq!(is_at(&[("OMNIBUS_CACHE", ""), ("HOME", "/h")]), None);
    assert_eq!(is_at(&[("OMNIBUS_CACHE", "/c"), ("HOME", "/h")]), Some("/c".into()));
    assert_eq!(is_at(&[("XDG_CACHE_HOME", "/x"), ("HOME", "/h")]), Some("/x/omnibus".into()));
    assert_eq!(is_at(&[("HOME", "/h")]), Some("/h/.cache/omnibus".into()));
    assert_eq!(is_at(&[]), None);
    keep(&Cache::off(), key(1));
    assert_eq!(find(&Cache::off(), key(1)), None);
    fs::write(&folder.0, "a file where the folder should be").expect("write");
    let cache = Cache::at(&folder.0);
    keep(&cache, key(1));
    assert_eq!(find(&cache, key(1)), None);
    fs::remove_file(&folder.0).expect("remove");
}

#[test]
fn only_the_newest_files_stay_and_foreign_ones_are_left_alone() {
    let folder = Folder::new("pruned");
    let cache = Cache::at(&folder.0);
    fs::create_dir_all(&folder.0).expect("folder");
    fs::write(folder.0.join("mine"), "x").expect("write");
    for seed in 0..FILES_MAX as u64 + 4 {
        keep(&cache, key(seed));
        let file = fs::File::open(folder.0.join(key(seed).file_name())).expect("file");
        let written = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1000 + seed);
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
fn a_town_comes_back_as_it_was_and_a_damaged_one_does_not() {
    let folder = Folder::new("town");
    let cache = Cache::at(&folder.0);
    let mut town = Town::default();
    town.objects.push(crate::Object {
        tag: mesh::Tag::Building,
        layer: crate::Layer::Buildings,
        center: glam::Vec3::X,
        half_extents_m: glam::Vec3::ONE,
        yaw_rad: 0.5,
        color: [1, 2, 3],
    });
    town.colliders.push(crate::Collider {
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
