//! What moves and stops the vehicles of the catalogue: engine, gears, aerodynamics, brakes.
//!
//! Powers are fitted: with them the model reaches 100 km/h in the published time. They differ from
//! rated powers because every engine of the model has the same torque curve, reaches its power at
//! its highest speed, and shifts alike. `docs/vehicle-figures.md` compares the result with published
//! figures.

/// How a vehicle is driven.
#[derive(Clone, Copy, Debug)]
pub(super) enum Power {
    /// A combustion engine with its forward gears. Its torque curve has the power at the highest
    /// speed of the engine.
    Combustion { power_kw: f32, max_rpm: f32, gears: &'static [f32] },
    /// An electric motor with one gear: constant torque up to `base_mps`, then constant power. A
    /// power-split hybrid drives in the same way.
    Electric { power_kw: f32, base_mps: f32 },
    /// The rider of a bicycle.
    Rider,
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fittings {
    pub id: &'static str,
    pub power: Power,
    /// Speed at which engine or motor reach their highest speed in the last gear, or that of the
    /// limiter. Kilometres per hour.
    pub top_kmh: f32,
    pub drag_coefficient: f32,
    pub frontal_m2: f32,
    /// Mean deceleration of a full stop, in multiples of gravity.
    pub braking_g: f32,
    pub aids: Aids,
}

/// The driver aids that the real vehicle has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aids {
    None,
    Abs,
    /// Anti-lock brakes and electronic stability control.
    Esc,
}

use Aids::{Abs, Esc, None};
use Power::{Combustion, Electric, Rider};

/// Three-speed automatic gearbox.
const THREE: &[f32] = &[2.48, 1.48, 1.0];
/// Four-speed gearbox.
const FOUR: &[f32] = &[3.2, 1.75, 1.2, 0.85];
const FIVE: &[f32] = &[3.4, 1.95, 1.3, 0.98, 0.76];
const SIX: &[f32] = &[3.6, 2.1, 1.45, 1.1, 0.88, 0.72];
const EIGHT: &[f32] = &[4.7, 3.1, 2.1, 1.67, 1.29, 1.0, 0.84, 0.67];
const HEAVY: &[f32] = &[6.7, 3.9, 2.4, 1.6, 1.2, 1.0];
const MOTORCYCLE: &[f32] = &[2.6, 1.9, 1.5, 1.25, 1.1, 1.0];
/// A scooter's variator holds the engine near its best speed.
const VARIATOR: &[f32] = &[2.6, 1.9, 1.4, 1.0];

const fn petrol(power_kw: f32, gears: &'static [f32]) -> Power {
    Combustion { power_kw, max_rpm: 6200.0, gears }
}

const fn diesel(power_kw: f32, gears: &'static [f32]) -> Power {
    Combustion { power_kw, max_rpm: 4600.0, gears }
}

const fn heavy(power_kw: f32) -> Power {
    Combustion { power_kw, max_rpm: 2500.0, gears: HEAVY }
}

const fn motorcycle(power_kw: f32, max_rpm: f32) -> Power {
    Combustion { power_kw, max_rpm, gears: MOTORCYCLE }
}

const fn row(
    id: &'static str,
    power: Power,
    top_kmh: f32,
    drag: (f32, f32),
    braking_g: f32,
    aids: Aids,
) -> Fittings {
    let (drag_coefficient, frontal_m2) = drag;
    Fittings { id, power, top_kmh, drag_coefficient, frontal_m2, braking_g, aids }
}

/// The table, sorted by id.
#[rustfmt::skip]
pub(super) static FLEET: [Fittings; 41] = [
    row("vehicle.audi.a2", petrol(57.5, FIVE), 173.0, (0.29, 2.20), 1.01, Esc),
    row("vehicle.audi.etron", Electric { power_kw: 292.0, base_mps: 19.0 }, 200.0, (0.28, 2.65), 1.07, Esc),
    row("vehicle.audi.tt", petrol(208.0, SIX), 250.0, (0.29, 2.09), 1.14, Esc),
    row("vehicle.bh.crossbike", Rider, 40.0, (0.9, 0.55), 0.5, None),
    row("vehicle.bmw.grandtourer", diesel(137.0, EIGHT), 223.0, (0.29, 2.42), 1.08, Esc),
    row("vehicle.carlamotors.carlacola", heavy(110.0), 90.0, (0.6, 5.0), 0.65, Abs),
    row("vehicle.carlamotors.european_hgv", heavy(240.0), 90.0, (0.6, 8.0), 0.65, Esc),
    row("vehicle.carlamotors.firetruck", heavy(300.0), 109.0, (0.7, 8.5), 0.65, Esc),
    row("vehicle.chevrolet.impala", Combustion { power_kw: 129.0, max_rpm: 4800.0, gears: THREE }, 180.0, (0.45, 2.35), 0.72, None),
    row("vehicle.citroen.c3", petrol(84.0, FIVE), 188.0, (0.31, 2.20), 1.04, Esc),
    row("vehicle.diamondback.century", Rider, 45.0, (0.9, 0.45), 0.5, None),
    row("vehicle.dodge.charger_2020", petrol(319.0, EIGHT), 233.0, (0.335, 2.40), 1.01, Esc),
    row("vehicle.dodge.charger_police", petrol(331.0, FIVE), 235.0, (0.34, 2.45), 0.89, Esc),
    row("vehicle.dodge.charger_police_2020", petrol(254.0, EIGHT), 225.0, (0.35, 2.50), 0.93, Esc),
    row("vehicle.ford.ambulance", diesel(224.0, SIX), 121.0, (0.6, 5.0), 0.75, Abs),
    row("vehicle.ford.crown", petrol(151.0, FOUR), 208.0, (0.37, 2.40), 0.85, Abs),
    row("vehicle.ford.mustang", Combustion { power_kw: 128.0, max_rpm: 5400.0, gears: THREE }, 187.0, (0.46, 2.00), 0.75, None),
    row("vehicle.gazelle.omafiets", Rider, 32.0, (1.0, 0.6), 0.45, None),
    row("vehicle.harley-davidson.low_rider", motorcycle(58.0, 5500.0), 175.0, (0.72, 0.75), 0.88, Abs),
    row("vehicle.jeep.wrangler_rubicon", petrol(163.0, FIVE), 180.0, (0.45, 2.75), 0.90, Esc),
    row("vehicle.kawasaki.ninja", motorcycle(52.0, 12000.0), 188.0, (0.6, 0.65), 0.93, Abs),
    row("vehicle.lincoln.mkz_2017", petrol(195.0, SIX), 209.0, (0.28, 2.30), 0.92, Esc),
    row("vehicle.lincoln.mkz_2020", petrol(197.0, SIX), 209.0, (0.28, 2.30), 0.92, Esc),
    row("vehicle.mercedes.coupe", petrol(228.0, EIGHT), 250.0, (0.28, 2.40), 1.10, Esc),
    row("vehicle.mercedes.coupe_2020", petrol(194.0, EIGHT), 250.0, (0.26, 2.20), 1.11, Esc),
    row("vehicle.mercedes.sprinter", diesel(103.0, SIX), 161.0, (0.34, 4.40), 0.83, Esc),
    row("vehicle.micro.microlino", Electric { power_kw: 12.5, base_mps: 6.0 }, 90.0, (0.35, 1.70), 0.75, None),
    row("vehicle.mini.cooper_s", petrol(136.0, SIX), 225.0, (0.36, 2.01), 1.06, Esc),
    row("vehicle.mini.cooper_s_2021", petrol(158.0, SIX), 235.0, (0.31, 2.10), 1.09, Esc),
    row("vehicle.mitsubishi.fusorosa", heavy(170.0), 100.0, (0.6, 6.8), 0.65, Esc),
    row("vehicle.nissan.micra", petrol(50.0, FIVE), 167.0, (0.32, 2.10), 0.96, Abs),
    row("vehicle.nissan.patrol", diesel(99.0, FIVE), 160.0, (0.44, 2.80), 0.84, Abs),
    row("vehicle.nissan.patrol_2021", petrol(257.0, EIGHT), 210.0, (0.37, 3.25), 0.90, Esc),
    row("vehicle.seat.leon", petrol(128.0, SIX), 229.0, (0.32, 2.10), 1.02, Esc),
    row("vehicle.tesla.cybertruck", Electric { power_kw: 489.0, base_mps: 19.0 }, 180.0, (0.34, 3.40), 1.00, Esc),
    row("vehicle.tesla.model3", Electric { power_kw: 222.0, base_mps: 20.0 }, 225.0, (0.23, 2.22), 1.06, Esc),
    row("vehicle.toyota.prius", Electric { power_kw: 77.0, base_mps: 13.0 }, 180.0, (0.24, 2.20), 1.02, Esc),
    row("vehicle.vespa.zx125", Combustion { power_kw: 6.0, max_rpm: 8000.0, gears: VARIATOR }, 90.0, (0.8, 0.65), 0.6, None),
    row("vehicle.volkswagen.t2", Combustion { power_kw: 46.5, max_rpm: 4800.0, gears: FOUR }, 127.0, (0.44, 3.00), 0.70, None),
    row("vehicle.volkswagen.t2_2021", Combustion { power_kw: 47.0, max_rpm: 4800.0, gears: FOUR }, 127.0, (0.44, 3.00), 0.70, None),
    row("vehicle.yamaha.yzf", motorcycle(46.0, 12000.0), 188.0, (0.6, 0.65), 0.93, Abs),
];

/// Returns the row of a blueprint.
pub(super) fn of(id: &str) -> Option<&'static Fittings> {
    FLEET.iter().find(|row| row.id == id)
}
