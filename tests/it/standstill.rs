//! CARLA's towns: no vehicle stands in one place for more than two minutes.
//!
//! Each map of `OMNIBUS_MAPS` whose name contains "Town", with a hundred vehicles for ten simulated
//! minutes, in closed loop with physics; `OMNIBUS_SOAK=1` simulates an hour.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use omnibus_tests::closed_loop::{Cast, WIDE_PERCENT, World};

use crate::kit::{is_soak, note_skipped, thread};

const VEHICLES: usize = 100;
/// Longest stay in one place, red lights included.
const STAND_MAX_S: f32 = 120.0;

/// Simulates a town, prints a summary and returns the standstills.
fn drive(map: &PathBuf, seconds: u64) -> Vec<String> {
    let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let network = Arc::new(road::Network::parse(&std::fs::read_to_string(map).unwrap()).unwrap());
    let mut world = World::new(
        network,
        &Cast {
            vehicles: VEHICLES,
            walkers: 0,
            seed: 1,
            sedans: false,
            wide_percent: WIDE_PERCENT,
        },
    );
    (0..seconds * 20).for_each(|_| world.tick());
    let (vehicles, driven_m, longest_s) = world.figures();
    let stands = world.standstills(STAND_MAX_S);
    println!(
        "{name}: {vehicles} vehicles drove {:.1} km in {seconds} s, longest in one place \
         {longest_s:.0} s, {} standstills",
        driven_m / 1000.0,
        stands.len()
    );
    assert_eq!(vehicles, VEHICLES, "{name} has no room for them");
    stands.into_iter().map(|stand| format!("{name}: {stand}")).collect()
}

#[test]
fn no_vehicle_stands_for_more_than_two_minutes_on_a_town_of_carla() {
    let Some(folder) = std::env::var_os("OMNIBUS_MAPS") else {
        note_skipped(
            "no_vehicle_stands_for_more_than_two_minutes_on_a_town_of_carla",
            "OMNIBUS_MAPS names no folder",
        );
        return;
    };
    let is_town = |path: &PathBuf| {
        path.extension().is_some_and(|e| e == "xodr") && path.to_string_lossy().contains("Town")
    };
    let mut maps: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .flatten()
        .map(|entry| entry.path())
        .filter(is_town)
        .collect();
    maps.sort();
    let seconds = if is_soak() { 3600 } else { 600 };
    let (maps, next) = (Arc::new(maps), Arc::new(AtomicUsize::new(0)));
    let found = Arc::new(Mutex::new(Vec::new()));
    let cores = std::thread::available_parallelism().map_or(2, |cores| cores.get());
    let drivers: Vec<_> = (0..cores.clamp(1, 16))
        .map(|_| {
            let (maps, next, found) = (maps.clone(), next.clone(), found.clone());
            thread(move || {
                while let Some(map) = maps.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let stands = drive(map, seconds);
                    found.lock().unwrap().extend(stands);
                }
            })
        })
        .collect();
    drivers.into_iter().for_each(|driver| driver.join().unwrap());
    let found = found.lock().unwrap();
    assert!(found.is_empty(), "{found:#?}");
}
