//! Generated towns: traffic stays on their roads and does not jam.
//!
//! A town of each character except the grid, which other tests use, with a hundred vehicles for five
//! simulated minutes, in closed loop with physics. `OMNIBUS_SOAK=1` uses a hundred towns for ten minutes
//! each, where rare contacts are allowed.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicUsize, Ordering},
};

use mapgen::{Character, Plan};
use omnibus_tests::closed_loop::{Cast, WIDE_PERCENT, World};

use crate::kit::{is_soak, thread};

const VEHICLES: usize = 100;
/// One contact is allowed per this many towns.
const TOWNS_PER_TOUCH: usize = 25;

/// Returns the plan of a seed: characters in turn, sizes from the usual one to one and a half times
/// that.
fn plan(seed: u64) -> Plan {
    let character = Character::ALL[(seed % 6) as usize];
    let (size_m, relief_m) = character.default_size_and_relief_m();
    Plan {
        name: format!("{}-{seed}", character.name()),
        seed,
        size_m: size_m * (1.0 + 0.1 * (seed / 6 % 6) as f64),
        character,
        relief_m,
    }
}

/// Simulates a town, prints a summary and returns the faults.
fn drive(plan: &Plan) -> Vec<String> {
    let network = Arc::new(road::Network::parse(&mapgen::generate(plan)).unwrap());
    let places = network.spawn_points().len();
    let cast = Cast {
        vehicles: VEHICLES,
        walkers: 0,
        seed: plan.seed,
        sedans: false,
        wide_percent: WIDE_PERCENT,
    };
    let mut world = World::new(network, &cast);
    let seconds = if is_soak() { 600 } else { 300 };
    (0..seconds * 20).for_each(|_| world.tick());
    let (vehicles, driven_m, longest_s) = world.figures();
    println!(
        "{}: {vehicles} vehicles drove {:.1} km, longest in one place {longest_s:.0} s, {} touches \
         of fixed things",
        plan.name,
        driven_m / 1000.0,
        world.brushes()
    );
    let mut faults = world.faults();
    if vehicles < VEHICLES.min(places) {
        faults.push(format!("only {vehicles} vehicles found room in {places} places"));
    }
    // Less than 6 km/h.
    if driven_m < vehicles as f32 * seconds as f32 / 0.6 {
        faults.push(format!("{vehicles} vehicles drove {driven_m:.0} m together"));
    }
    let faults = faults.into_iter().map(|fault| format!("{}: {fault}", plan.name));
    // A soak takes long, so each result is printed at once.
    faults.inspect(|fault| println!("{fault}")).collect()
}

#[test]
fn traffic_stays_on_the_roads_of_generated_towns_and_never_jams() {
    // Old town, suburb, highway, roundabouts, countryside; the soak includes grids.
    let seeds: std::ops::Range<usize> = if is_soak() { 0..100 } else { 1..6 };
    let next = Arc::new(AtomicUsize::new(seeds.start));
    let faults = Arc::new(Mutex::new(Vec::new()));
    let end = seeds.end;
    let cores = std::thread::available_parallelism().map_or(2, |cores| cores.get());
    let drivers: Vec<_> = (0..cores.clamp(2, 16))
        .map(|_| {
            let (next, faults) = (next.clone(), faults.clone());
            thread(move || {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= end {
                        break;
                    }
                    let found = drive(&plan(seed as u64));
                    faults.lock().unwrap().extend(found);
                }
            })
        })
        .collect();
    drivers.into_iter().for_each(|driver| driver.join().unwrap());
    let faults = faults.lock().unwrap();
    let (touches, others): (Vec<&String>, Vec<&String>) =
        faults.iter().partition(|fault| fault.contains(" touched at "));
    assert!(others.is_empty(), "{others:#?}");
    assert!(touches.len() <= seeds.len() / TOWNS_PER_TOUCH, "{touches:#?}");
}
