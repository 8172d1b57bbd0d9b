use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use road::{LaneIndex, LanePoint, LaneType, LaneTypes, Network};

use crate::*;

/// Three sizes of each character, two seeds each, flat and hilly.
fn plans() -> impl Iterator<Item = Plan> {
    Character::ALL.into_iter().flat_map(|character| {
        (0..6).map(move |seed| {
            let (least, _) = character.size_range_m();
            let (usual, relief) = character.default_size_and_relief_m();
            let size_m = [least, usual, usual * 1.3][seed as usize % 3];
            let relief_m = if seed % 2 == 0 { relief * 2.0 } else { 0.0 };
            let name = format!("{}-{seed}", character.name());
            Plan { name, seed, size_m, character, relief_m }
        })
    })
}

/// The texts of all plans and of all named towns.
fn texts() -> impl Iterator<Item = (String, String)> {
    let named = names().chain(carla_names()).map(|name| (name.to_string(), named(name).unwrap()));
    plans().map(|plan| (plan.name.clone(), generate(&plan))).chain(named)
}

#[test]
fn the_same_plan_gives_the_same_text_and_another_seed_another() {
    for one in plans() {
        assert_eq!(generate(&one), generate(&one));
        assert_ne!(generate(&one), generate(&Plan { seed: one.seed + 6, ..one.clone() }));
    }
}

#[test]
fn named_towns_are_found_in_any_letter_case_and_unknown_names_are_not() {
    assert_eq!(named("TOWN04_Opt"), named("Town04"));
    assert_eq!(named("millbrook"), Some(default_map().1));
    for name in ["", "Town99", "Millbrook_Opt", "_Opt", "Tow\u{e9}_Opt"] {
        assert_eq!(named(name), None, "{name}");
    }
    assert!(names().chain(carla_names()).all(|name| description(name).is_some()));
}

#[test]
fn road_ids_of_the_largest_towns_are_unique() {
    for character in Character::ALL {
        let (_, size_m) = character.size_range_m();
        let name = character.name().to_string();
        let text = generate(&Plan { name, seed: 1, size_m, character, relief_m: 10.0 });
        let network = Network::parse(&text).unwrap();
        let mut numbers: Vec<&str> = network.roads().iter().map(|road| &*road.id).collect();
        let count = numbers.len();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), count, "{character:?}");
    }
}

#[test]
fn generated_towns_validate_without_findings() {
    for (name, text) in texts() {
        let network = Network::parse(&text).unwrap();
        assert_eq!(network.findings(), [], "{name}");
        for signal in network.signals() {
            assert!(!signal.lanes.is_empty(), "{name}: signal {} rules no lane", signal.id);
            let ruled = !signal.dynamic || signal.controller.is_some();
            assert!(ruled, "{name}: signal {} has no controller", signal.id);
        }
    }
}

/// The findings of `omnibus map validate`, for more seeds than in the other tests.
#[test]
fn towns_of_many_seeds_validate_without_findings() {
    let seeds = if std::env::var_os("OMNIBUS_SOAK").is_some() { 100 } else { 12 };
    for character in Character::ALL {
        let (size_m, relief_m) = character.default_size_and_relief_m();
        for seed in 0..seeds {
            let name = format!("{}-{seed}", character.name());
            let plan = Plan { name: name.clone(), seed, size_m, character, relief_m };
            let found = road::validate(&generate(&plan)).unwrap();
            assert!(found.is_empty(), "{name}: {:?}", found.first());
        }
    }
}

/// The lanes that can be reached from the first one, with lane changes where they are allowed.
fn reached(network: &Network, start: LaneIndex, back: bool) -> Vec<bool> {
    let mut seen = vec![false; network.lanes().len()];
    let mut open = vec![start];
    seen[start.0 as usize] = true;
    while let Some(index) = open.pop() {
        let lane = network.lane(index);
        let next = if back { &lane.predecessors } else { &lane.successors };
        let sides =
            [lane.left.filter(|_| lane.left_change), lane.right.filter(|_| lane.right_change)];
        for other in next.iter().copied().chain(sides.into_iter().flatten()) {
            if !std::mem::replace(&mut seen[other.0 as usize], true) {
                open.push(other);
            }
        }
    }
    seen
}

#[test]
fn every_driving_lane_reaches_every_other() {
    for (name, text) in texts() {
        let network = Network::parse(&text).unwrap();
        let driving: Vec<_> =
            network.lanes().iter().filter(|lane| LaneTypes::DRIVING.contains(lane.kind)).collect();
        let (ahead, back) =
            (reached(&network, driving[0].index, false), reached(&network, driving[0].index, true));
        for lane in driving {
            // An acceleration lane ends; its traffic changes to the left.
            let goes_on = !lane.successors.is_empty() || lane.left_change;
            // A deceleration lane begins; departing traffic changes into it.
            let comes = !lane.predecessors.is_empty() || lane.left_change;
            assert!(goes_on && comes, "{name}: {lane:?}");
            let index = lane.index.0 as usize;
            assert!(ahead[index] && back[index], "{name}: {lane:?}");
        }
    }
}

/// A lane starts where the lanes before it end: within one centimetre and half a degree.
#[test]
fn lanes_meet_without_a_step() {
    for (name, text) in texts() {
        let network = Network::parse(&text).unwrap();
        for lane in network.lanes() {
            let end = network.place_at(lane.index, lane.length_m, 0.0);
            for next in &lane.successors {
                let start = network.place_at(*next, 0.0, 0.0);
                let gap = end.position.distance(start.position);
                assert!(gap < 0.01, "{name}: {gap} m after {lane:?}");
                let turn = curve::wrapped(end.heading_rad - start.heading_rad).abs();
                assert!(turn < 0.01 || !LaneTypes::DRIVING.contains(lane.kind), "{turn} {lane:?}");
            }
        }
    }
}

/// The tightest curvature and the steepest slope that vehicles can drive.
#[test]
fn lanes_are_no_tighter_and_no_steeper_than_vehicles_can_drive() {
    for (name, text) in texts() {
        let network = Network::parse(&text).unwrap();
        for lane in network.lanes().iter().filter(|l| LaneTypes::DRIVING.contains(l.kind)) {
            let steps = (lane.length_m / 2.0).ceil() as usize;
            for step in 0..=steps {
                let along = lane.length_m * step as f64 / steps.max(1) as f64;
                let place = network.place_at(lane.index, along, 0.0);
                let road = &network.roads()[lane.road as usize].id;
                let (bend, slope) = (place.curvature_per_m.abs(), place.pitch_rad.tan().abs());
                assert!(bend < 1.0 / 5.5, "{name}: road {road} bends by {bend} per metre");
                assert!(slope < 0.11, "{name}: road {road} climbs by {slope}");
            }
        }
    }
}

/// A point in the middle of a lane, half the lane's width, its road and junction.
type Sample = (DVec3, f64, u32, Option<u32>);

/// Driving lanes lie beside or well above all others, except where roads meet.
#[test]
fn roads_keep_clear_of_each_other() {
    for (name, text) in texts() {
        let network = Network::parse(&text).unwrap();
        let mut squares: BTreeMap<(i32, i32), Vec<Sample>> = BTreeMap::new();
        // The roads that lead to each junction.
        let mut leads = BTreeSet::new();
        for lane in network.lanes().iter().filter(|l| LaneTypes::DRIVING.contains(l.kind)) {
            for next in lane.successors.iter().chain(&lane.predecessors) {
                leads.extend(network.lane(*next).junction.map(|junction| (lane.road, junction)));
            }
            let steps = (lane.length_m / 3.0).ceil() as usize;
            for step in 1..steps {
                let along_m = lane.length_m * step as f64 / steps as f64;
                let at = LanePoint { lane: lane.index, along_m };
                let (place, half) = (network.place(at).position, network.width(at) * 0.5);
                let square = ((place.x / 5.0).floor() as i32, (place.y / 5.0).floor() as i32);
                squares.entry(square).or_default().push((place, half, lane.road, lane.junction));
            }
        }
        for ((x, y), here) in &squares {
            let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (x + i, y + j)));
            for (place, half, road, junction) in here {
                let others = around.clone().filter_map(|square| squares.get(&square)).flatten();
                for (other, other_half, other_road, other_junction) in others {
                    let meet = road == other_road
                        || (junction.is_some() && junction == other_junction)
                        || junction.is_some_and(|j| leads.contains(&(*other_road, j)))
                        || other_junction.is_some_and(|j| leads.contains(&(*road, j)));
                    let gap = place.truncate().distance(other.truncate());
                    let touches = gap < half + other_half - 0.3;
                    let level = (place.z - other.z).abs() < 4.8;
                    let roads = [road, other_road].map(|r| &network.roads()[*r as usize].id);
                    assert!(meet || !touches || !level, "{name}: roads {roads:?} at {place}");
                }
            }
        }
    }
}

#[test]
fn motorways_have_acceleration_and_deceleration_lanes() {
    let size_m = Character::Highway.default_size_and_relief_m().0;
    for seed in [2, 3, 4] {
        let name = format!("highway {seed}");
        let plan = Plan { name, seed, size_m, character: Character::Highway, relief_m: 4.0 };
        let network = Network::parse(&generate(&plan)).expect("a generated town");
        let called = |index: LaneIndex, name: &str| {
            network.roads()[network.lane(index).road as usize].name.starts_with(name)
        };
        let width = |lane: LaneIndex, along_m: f64| network.width(LanePoint { lane, along_m });
        let ramps = |name: &'static str| {
            network
                .lanes()
                .iter()
                .filter(move |lane| lane.kind == LaneType::Driving && called(lane.index, name))
        };
        let mut seen = [0, 0];
        for ramp in ramps("Exit") {
            let [turn] = ramp.predecessors[..] else { panic!("one way to the exit") };
            let [lane] = network.lane(turn).predecessors[..] else { panic!("one lane") };
            let lane = network.lane(lane);
            assert!(called(lane.index, "Motorway"));
            // Through traffic does not use it; departing traffic enters it from the left.
            assert_eq!(lane.successors, [turn]);
            assert!(lane.predecessors.is_empty() && lane.length_m > 200.0, "{}", lane.length_m);
            assert!(width(lane.index, 0.0) < 0.1 && width(lane.index, 60.0) > 3.5);
            let left = network.lane(lane.left.expect("a lane beside it"));
            assert!(left.right_change && left.kind == LaneType::Driving);
            assert!(
                left.successors
                    .iter()
                    .all(|next| !called(network.lane(*next).successors[0], "Exit"))
            );
            seen[0] += 1;
        }
        for ramp in ramps("Entry") {
            let [turn] = ramp.successors[..] else { panic!("one way from the entry") };
            let [lane] = network.lane(turn).successors[..] else { panic!("one lane") };
            let lane = network.lane(lane);
            assert!(called(lane.index, "Motorway") && lane.left_change);
            assert_eq!(lane.predecessors, [turn]);
            assert!(lane.successors.is_empty() && lane.length_m > 200.0, "{}", lane.length_m);
            assert!(width(lane.index, 150.0) > 3.5);
            seen[1] += 1;
        }
        assert!(seen[0] >= 2 && seen[0] == seen[1], "{seen:?}");
    }
}
