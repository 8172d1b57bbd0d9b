//! Green is actuated by demand.

use protocol::light;

use crate::{demand::Demand, signals::SignalPlan};

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
fn green_rests_on_the_only_phase_with_demand() {
    let shown = shown(120, |_| Demand::of(&[0], &[0]));
    assert_eq!(green_s(&shown, 0), 120);
}
