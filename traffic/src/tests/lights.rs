//! Green is actuated by demand.

use protocol::light;

use super::maps;
use crate::{demand::Demand, map::Map, signals::SignalPlan};

const TICK_NANOS: u64 = 50_000_000;

/// Returns the states of three lights, one in each phase, second by second.
fn shown(seconds: usize, demand: impl Fn(f32) -> Demand) -> Vec<[u32; 3]> {
    let plan = SignalPlan::of_phases(3);
    let mut clocks = vec![0];
    let ticks = 0..seconds * 20;
    ticks
        .map(|tick| {
            plan.advance(&mut clocks, &demand(tick as f32 / 20.0), TICK_NANOS);
            [0, 1, 2].map(|signal| plan.shows(signal, &clocks))
        })
        .step_by(20)
        .collect()
}

/// Returns for how many of the seconds a light is green.
fn green_s(shown: &[[u32; 3]], signal: usize) -> usize {
    shown.iter().filter(|lights| lights[signal] == light::GREEN).count()
}

#[test]
fn phases_alternate_without_demand() {
    let shown = shown(90, |_| Demand::of(&[], &[]));
    for signal in 0..3 {
        assert!((18..=30).contains(&green_s(&shown, signal)), "{}", green_s(&shown, signal));
    }
}

#[test]
fn a_phase_without_demand_is_skipped() {
    let shown = shown(120, |_| Demand::of(&[0, 2], &[0, 2]));
    assert_eq!(green_s(&shown, 1), 0);
    assert!(green_s(&shown, 0) > 35 && green_s(&shown, 2) > 35);
}

#[test]
fn green_ends_when_its_demand_ends_and_others_wait() {
    let shown = shown(30, |now_s| Demand::of(&[1], if now_s < 9.0 { &[0] } else { &[] }));
    assert!((8..=10).contains(&green_s(&shown, 0)), "{}", green_s(&shown, 0));
    assert!(green_s(&shown, 1) >= 10);
}

#[test]
fn every_phase_gets_green_under_continuous_demand() {
    let shown = shown(100, |_| Demand::of(&[0, 1, 2], &[0, 1, 2]));
    for signal in 0..3 {
        assert!(green_s(&shown, signal) > 15, "{}", green_s(&shown, signal));
    }
}

#[test]
fn a_phase_with_priority_comes_next_and_stays_longer() {
    let begin_and_length_s = |prefers: bool| {
        let shown = shown(100, |_| {
            let mut demand = Demand::of(&[0, 1, 2], &[0, 1, 2]);
            if prefers {
                demand.prefer(0, 2);
            }
            demand
        });
        let begin_s = shown.iter().take_while(|lights| lights[2] != light::GREEN).count();
        let green = shown[begin_s..].iter().take_while(|lights| lights[2] == light::GREEN);
        (begin_s, green.count())
    };
    let [first, later] = [true, false].map(begin_and_length_s);
    assert!((10..=13).contains(&first.0) && (39..=41).contains(&first.1), "{first:?}");
    assert!(later.0 > 30 && later.1 < 20, "{later:?}");
}

#[test]
fn yellow_lasts_for_as_long_as_the_speed_limit_requires() {
    // The first yellow of a light.
    let yellow_s = |plan: &SignalPlan| {
        let mut clocks = vec![0; plan.cycles()];
        let shown = (0..20 * 30).map(|_| {
            plan.advance(&mut clocks, &Demand::default(), TICK_NANOS);
            plan.shows(0, &clocks)
        });
        let yellow = shown.skip_while(|&phase| phase != light::YELLOW);
        0.05 * yellow.take_while(|&phase| phase == light::YELLOW).count() as f32
    };
    let at_50_kmh = Map::new(&maps::two_crossings(26.0), Box::new(Default::default)).signals;
    let at_50_kmh = yellow_s(&at_50_kmh);
    assert!((3.4..3.6).contains(&at_50_kmh), "{at_50_kmh}");
    let least = yellow_s(&SignalPlan::of_phases(2));
    assert!((2.9..3.1).contains(&least), "{least}");
}

#[test]
fn green_rests_on_the_only_phase_with_demand() {
    let shown = shown(120, |_| Demand::of(&[0], &[0]));
    assert_eq!(green_s(&shown, 0), 120);
}
