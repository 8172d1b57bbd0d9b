//! Every vehicle of the catalogue against published figures of the real vehicle.
//!
//! The test writes `docs/vehicle-figures.md` with `UPDATE_DOCS=1`.

use std::{fmt::Write, sync::Arc};

use glam::Vec3;
use protocol::ActorId;

use super::{Ground, Lone};
use crate::physics::VehicleModel;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/vehicle-figures.md");
const HEAD: &str = include_str!("figures-head.md");
/// Mass of the rider of a two-wheeler.
const RIDER_KG: f32 = 80.0;

/// Published figures; 0: none published.
struct Published {
    id: &'static str,
    /// The real vehicle.
    real: &'static str,
    /// Kerb mass, with the rider of a two-wheeler.
    mass_kg: f32,
    /// 0 to 100 km/h.
    sprint_s: f32,
    top_kmh: f32,
    /// 100 to 0 km/h.
    stop_m: f32,
    source: &'static str,
}

const fn row(
    id: &'static str,
    real: &'static str,
    [mass_kg, sprint_s, top_kmh, stop_m]: [f32; 4],
    source: &'static str,
) -> Published {
    Published { id, real, mass_kg, sprint_s, top_kmh, stop_m, source }
}

const fn two_wheeler(
    id: &'static str,
    real: &'static str,
    [kerb_kg, sprint_s, top_kmh, stop_m]: [f32; 4],
    source: &'static str,
) -> Published {
    row(id, real, [kerb_kg + RIDER_KG, sprint_s, top_kmh, stop_m], source)
}

#[rustfmt::skip]
const PUBLISHED: [Published; 41] = [
    row("vehicle.audi.a2", "Audi A2 1.4 (2000)", [970.0, 12.3, 173.0, 39.0], "Audi data sheet; stop: auto motor und sport"),
    row("vehicle.audi.etron", "Audi e-tron 55 quattro (2019)", [2490.0, 5.7, 200.0, 36.9], "Audi data sheet; stop: auto motor und sport"),
    row("vehicle.audi.tt", "Audi TT 2.0 TFSI (8S, 2014)", [1305.0, 6.0, 250.0, 34.6], "Audi data sheet; stop: auto motor und sport"),
    two_wheeler("vehicle.bh.crossbike", "BH cross bicycle", [14.0, 0.0, 0.0, 0.0], "BH Bikes"),
    row("vehicle.bmw.grandtourer", "BMW 220d Gran Tourer (F46, 2015)", [1615.0, 7.9, 223.0, 36.5], "BMW data sheet; stop: auto motor und sport"),
    row("vehicle.carlamotors.carlacola", "fictitious; Mitsubishi Fuso Canter 7C15 with box", [5200.0, 0.0, 90.0, 0.0], "speed limiter of Directive 92/6/EEC"),
    row("vehicle.carlamotors.european_hgv", "fictitious; two-axle lorry of 18 t, unladen", [11000.0, 0.0, 90.0, 0.0], "speed limiter of Directive 92/6/EEC"),
    row("vehicle.carlamotors.firetruck", "fictitious; pumper", [14500.0, 0.0, 109.0, 0.0], "NFPA 1901: at most 68 mph"),
    row("vehicle.chevrolet.impala", "Chevrolet Impala 5.4 V8 Powerglide (1965)", [1750.0, 10.5, 181.0, 0.0], "automobile-catalog.com"),
    row("vehicle.citroen.c3", "Citroën C3 PureTech 110 (2017)", [1090.0, 9.3, 188.0, 37.0], "Citroën data sheet; stop: ADAC"),
    two_wheeler("vehicle.diamondback.century", "Diamondback Century", [9.0, 0.0, 0.0, 0.0], "Diamondback"),
    row("vehicle.dodge.charger_2020", "Dodge Charger R/T 5.7 (2020)", [1935.0, 5.5, 233.0, 38.9], "Dodge; sprint and stop: Car and Driver, from 0-60 and 70-0 mph"),
    row("vehicle.dodge.charger_police", "Dodge Charger Pursuit 5.7 (2013)", [1950.0, 6.3, 235.0, 44.0], "Michigan State Police vehicle evaluation, from mph; verified: top speed, of the car of 2010 (policemag.com)"),
    row("vehicle.dodge.charger_police_2020", "Dodge Charger Pursuit 5.7 (2020)", [1980.0, 6.3, 225.0, 42.4], "Michigan State Police vehicle evaluation, from mph"),
    row("vehicle.ford.ambulance", "Ford E-450 with ambulance body", [4500.0, 0.0, 121.0, 0.0], "Ford: limited to 75 mph"),
    row("vehicle.ford.crown", "Ford Crown Victoria Police Interceptor (2008)", [1870.0, 9.1, 208.0, 46.5], "Michigan State Police vehicle evaluation, from mph"),
    row("vehicle.ford.mustang", "Ford Mustang 289 fastback (1966)", [1400.0, 8.8, 187.0, 0.0], "automobile-catalog.com"),
    two_wheeler("vehicle.gazelle.omafiets", "Gazelle Omafiets", [20.0, 0.0, 0.0, 0.0], "Gazelle"),
    two_wheeler("vehicle.harley-davidson.low_rider", "Harley-Davidson Low Rider FXDL (2014)", [302.0, 5.5, 175.0, 44.0], "Harley-Davidson; sprint, top speed and stop: magazine tests"),
    row("vehicle.jeep.wrangler_rubicon", "Jeep Wrangler Rubicon 3.6 (JK, 2012)", [1880.0, 8.1, 180.0, 43.5], "Jeep data sheet; stop: auto motor und sport"),
    two_wheeler("vehicle.kawasaki.ninja", "Kawasaki Ninja 400 (2018)", [168.0, 4.9, 188.0, 42.4], "Kawasaki; others: Cycle World, from mph; verified: mass (speedweek.com)"),
    row("vehicle.lincoln.mkz_2017", "Lincoln MKZ 2.0T (2017)", [1710.0, 7.5, 209.0, 42.8], "Lincoln; sprint and stop: Car and Driver, from 0-60 and 70-0 mph"),
    row("vehicle.lincoln.mkz_2020", "Lincoln MKZ 2.0T (2020)", [1710.0, 7.5, 209.0, 42.8], "Lincoln; sprint and stop: Car and Driver, from 0-60 and 70-0 mph"),
    row("vehicle.mercedes.coupe", "Mercedes-Benz S 400 4MATIC Coupé (C217, 2016)", [2070.0, 5.6, 250.0, 35.8], "Mercedes-Benz data sheet; stop: auto motor und sport"),
    row("vehicle.mercedes.coupe_2020", "Mercedes-Benz C 300 Coupé (C205, 2019)", [1640.0, 6.0, 250.0, 35.5], "Mercedes-Benz data sheet; stop: auto motor und sport"),
    row("vehicle.mercedes.sprinter", "Mercedes-Benz Sprinter 316 CDI (2019)", [2230.0, 14.5, 161.0, 47.6], "Mercedes-Benz; sprint: promobil; stop: Car and Driver, from 70-0 mph"),
    row("vehicle.micro.microlino", "Microlino 2.0 (2022)", [513.0, 0.0, 90.0, 0.0], "Micro Mobility data sheet; verified: mass and top speed (notibras.com)"),
    row("vehicle.mini.cooper_s", "Mini Cooper S (R56, 2006)", [1205.0, 7.1, 225.0, 37.0], "BMW data sheet; stop: auto motor und sport"),
    row("vehicle.mini.cooper_s_2021", "Mini Cooper S (F56, 2021)", [1330.0, 6.8, 235.0, 36.0], "BMW data sheet; stop: auto motor und sport; verified: sprint and top speed (motorline.cc, 2014)"),
    row("vehicle.mitsubishi.fusorosa", "stretched; Mitsubishi Fuso Aero Star of 10.4 m", [10000.0, 0.0, 100.0, 0.0], "speed limiter of Directive 92/6/EEC"),
    row("vehicle.nissan.micra", "Nissan Micra 1.2 (K12, 2003)", [1015.0, 13.9, 167.0, 41.0], "Nissan data sheet; stop: ADAC"),
    row("vehicle.nissan.patrol", "Nissan Patrol 3.0 Di (Y61, 2000)", [2200.0, 14.6, 160.0, 47.0], "Nissan data sheet; stop: auto motor und sport"),
    row("vehicle.nissan.patrol_2021", "Nissan Patrol 5.6 (Y62, 2021)", [2720.0, 6.6, 210.0, 43.5], "Nissan data sheet; stop: Car and Driver, Armada, from 70-0 mph"),
    row("vehicle.seat.leon", "Seat León 1.8 20VT (1M, 2001)", [1322.0, 7.7, 229.0, 38.5], "Seat data sheet; stop: auto motor und sport"),
    row("vehicle.tesla.cybertruck", "Tesla Cybertruck AWD (2024)", [2995.0, 4.3, 180.0, 39.2], "Tesla, sprint from 0-60 mph; stop: Car and Driver, from 70-0 mph"),
    row("vehicle.tesla.model3", "Tesla Model 3 RWD (2021)", [1825.0, 5.8, 225.0, 37.0], "Tesla data sheet (5.6 to 6.1 s); stop: ADAC"),
    row("vehicle.toyota.prius", "Toyota Prius (XW50, 2016)", [1450.0, 10.6, 180.0, 38.5], "Toyota data sheet; stop: ADAC; verified: sprint (vroom.be)"),
    two_wheeler("vehicle.vespa.zx125", "Vespa ZX 125", [104.0, 0.0, 90.0, 0.0], "Vespa"),
    row("vehicle.volkswagen.t2", "Volkswagen T2b 2.0 (1976)", [1280.0, 22.0, 127.0, 0.0], "Volkswagen; sprint: auto motor und sport"),
    row("vehicle.volkswagen.t2_2021", "Volkswagen T2b 2.0 (1976), restored", [1300.0, 22.0, 127.0, 0.0], "Volkswagen; sprint: auto motor und sport"),
    two_wheeler("vehicle.yamaha.yzf", "Yamaha YZF-R3 (2019)", [169.0, 5.3, 188.0, 42.4], "Yamaha; others: Cycle World, from mph; verified: mass (acidmoto.ch)"),
];

fn lone(model: VehicleModel) -> Lone {
    let mut lone = Lone::new(Arc::new(Ground::flat(0.0)), model);
    lone.run(1.0);
    lone
}

/// Returns the seconds from rest to 100 km/h with full throttle; infinity if it takes two minutes.
fn sprint_s(model: VehicleModel) -> f32 {
    let mut lone = lone(model);
    lone.control.throttle = 1.0;
    let (from, mut before) = (lone.seconds, 0.0);
    while lone.seconds - from < 120.0 {
        lone.frame();
        let (now, wanted) = (lone.speed(), 100.0 / 3.6);
        if now >= wanted {
            return lone.seconds - from - 0.05 * (now - wanted) / (now - before);
        }
        before = now;
    }
    f32::INFINITY
}

/// Returns the mean speed of the last two of 100 s with full throttle. Kilometres per hour.
fn top_kmh(model: VehicleModel, start_mps: f32) -> f32 {
    let mut lone = lone(model);
    lone.physics.set_velocity(ActorId(1), Vec3::X * start_mps, Vec3::ZERO).unwrap();
    lone.control.throttle = 1.0;
    lone.run(98.0);
    let from = lone.position();
    lone.run(2.0);
    (lone.position() - from).length() / 2.0 * 3.6
}

/// Returns the metres from 100 km/h to standstill with a full brake.
fn stop_m(model: VehicleModel) -> f32 {
    let mut lone = lone(model);
    lone.physics.set_velocity(ActorId(1), Vec3::X * 100.0 / 3.6, Vec3::ZERO).unwrap();
    lone.control.brake = 1.0;
    let from = lone.position();
    while lone.speed() > 0.05 {
        lone.frame();
        assert!(lone.seconds < 30.0);
    }
    (lone.position() - from).length()
}

fn model_of(id: &str) -> VehicleModel {
    let (_, blueprint) = town::blueprint(id).unwrap_or_else(|| panic!("no {id}"));
    VehicleModel::of(blueprint)
}

/// Writes a cell with a published and a measured figure; returns whether it is within 10 %.
fn cell(line: &mut String, published: f32, measured: impl FnOnce() -> f32, digits: usize) -> bool {
    if published == 0.0 {
        line.push_str("| none published | – ");
        return true;
    }
    let measured = measured();
    let off = measured / published - 1.0;
    let _ = write!(line, "| {published:.digits$} | {measured:.digits$} ({:+.0} %) ", 100.0 * off);
    off.abs() <= 0.1
}

#[test]
fn every_vehicle_agrees_with_published_figures_within_10_percent() {
    let ids = town::catalogue().iter().filter(|one| one.kind == town::Kind::Vehicle);
    let ids: Vec<_> = ids.map(|one| one.id).collect();
    assert_eq!(ids, PUBLISHED.each_ref().map(|row| row.id), "the table lists the catalogue");
    let lines = std::thread::scope(|scope| {
        let work = PUBLISHED
            .chunks(11)
            .map(|rows| scope.spawn(move || rows.iter().map(measure).collect::<Vec<_>>()));
        let work: Vec<_> = work.collect();
        work.into_iter().flat_map(|one| one.join().unwrap()).collect::<Vec<_>>()
    });
    let mut page = HEAD.to_owned();
    let mut wrong = Vec::new();
    for (line, is_good) in lines {
        if !is_good {
            wrong.push(line.clone());
        }
        page.push_str(&line);
    }
    assert!(wrong.is_empty(), "more than 10 % off:\n{}", wrong.concat());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(PAGE, &page).unwrap();
    }
    let found = std::fs::read_to_string(PAGE).unwrap_or_default();
    assert!(found == page, "docs/vehicle-figures.md is out of date, UPDATE_DOCS=1 updates it");
}

fn measure(row: &Published) -> (String, bool) {
    let model = || model_of(row.id);
    let mut line = format!("| `{}` | {} ", row.id, row.real);
    let good = [
        cell(&mut line, row.mass_kg, || model().mass_kg, 0),
        cell(&mut line, row.sprint_s, || sprint_s(model()), 1),
        cell(&mut line, row.top_kmh, || top_kmh(model(), 0.9 * row.top_kmh / 3.6), 0),
        cell(&mut line, row.stop_m, || stop_m(model()), 1),
    ];
    let _ = writeln!(line, "| {} |", row.source);
    (line, good.iter().all(|good| *good))
}
