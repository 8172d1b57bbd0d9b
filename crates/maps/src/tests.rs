use std::{fs, path::PathBuf};

use crate::text;

fn folder(name: &str, files: &[&str]) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("omnibus-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    files.iter().for_each(|file| fs::write(folder.join(file), *file).unwrap());
    folder
}

#[test]
fn a_file_of_the_user_replaces_a_town_in_place_of_carla_s_but_not_a_generated_town() {
    let folder = folder("maps", &["carla__Town04.xodr", "Town03.xodr", "Millbrook.xodr", "b.txt"]);
    let text = |name: &str| crate::text(name, Some(&folder)).unwrap();
    assert_eq!(text("Town04"), "carla__Town04.xodr");
    assert_eq!(text("town04_opt"), "carla__Town04.xodr");
    assert_eq!(text("Town04_Opt"), "carla__Town04.xodr");
    assert_eq!(text("carla__Town04"), "carla__Town04.xodr");
    assert_eq!(text("Town03"), "Town03.xodr");
    assert_eq!(text("Town05"), mapgen::named("Town05").unwrap());
    assert_eq!(text("Millbrook"), mapgen::named("Millbrook").unwrap());
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_folder_of_carla_s_maps_is_ignored_in_a_name() {
    let folder = folder("prefix", &[]);
    for spelling in ["Carla/Maps/Town02", "/Game/Carla/Maps/Town02", "Town02_Opt"] {
        assert_eq!(text(spelling, Some(&folder)).unwrap(), mapgen::named("Town02").unwrap());
    }
    assert!(text("Town10HD_Opt", Some(&folder)).is_ok());
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_name_with_and_without_its_extension_is_the_same_map() {
    let folder = folder("extension", &["Town04.xodr"]);
    let text = |name: &str| crate::text(name, Some(&folder)).unwrap();
    for name in ["Town10HD", "Town04", "Millbrook"] {
        assert_eq!(text(&format!("{name}.xodr")), text(name));
    }
    assert_eq!(text("town04.XODR"), "Town04.xodr");
    let error = crate::text("Town99.xodr", Some(&folder)).unwrap_err().to_string();
    assert!(error.contains("no map is named \"Town99\""), "{error}");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_missing_map_file_or_folder_is_named() {
    let folder = folder("none", &[]);
    let error_of = |name: &str| text(name, Some(&folder)).unwrap_err().to_string();
    assert!(error_of("Town99").contains("no map is named \"Town99\""), "{}", error_of("Town99"));
    assert!(error_of("a/b.xodr").starts_with("map a/b.xodr"), "{}", error_of("a/b.xodr"));
    fs::remove_dir_all(&folder).unwrap();
    assert!(error_of("Town04").contains("folder of maps"), "{}", error_of("Town04"));
}

#[test]
fn a_character_and_a_seed_are_the_name_of_a_town() {
    let folder = folder("seeded", &["suburb-3.xodr"]);
    let text = |name: &str| crate::text(name, Some(&folder));
    let town = text("old-town-7").unwrap();
    assert!(town.contains("old-town-7") && town != text("old-town-8").unwrap());
    assert_eq!(text("suburb-3").unwrap(), "suburb-3.xodr", "a file of the user comes first");
    for wrong in ["old-town-07", "old-town--7", "old-town-", "hamlet-7"] {
        let error = text(wrong).unwrap_err().to_string();
        assert!(error.contains("such as old-town-7"), "{error}");
    }
    fs::remove_dir_all(&folder).unwrap();
}
