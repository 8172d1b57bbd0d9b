//! Scripts of events, and the expected verdicts.
//!
//! `traffic joins` (slot 0), `render joins [lag n]` (slot 1), `agent joins` (slot 2, dropped when
//! it dies), `tick`, `x arrives n`, `x dies`, `x leaves`, `late`.

use super::*;

fn slot(name: &str) -> usize {
    match name {
        "traffic" => 0,
        "render" => 1,
        "agent" => 2,
        other => panic!("unknown participant {other}"),
    }
}

fn check(script: &str, outcome: &str) {
    let mut barrier = Barrier::default();
    let mut is_late = false;
    for line in script.split(';').map(str::trim) {
        let words: Vec<_> = line.split_whitespace().collect();
        match words[..] {
            ["tick"] => {
                barrier.advance();
                is_late = false;
            }
            ["late"] => is_late = true,
            [name, "joins"] => join(&mut barrier, name, 0),
            [name, "joins", "lag", lag] => join(&mut barrier, name, lag.parse().unwrap()),
            [name, "arrives", frame] => {
                barrier.arrive(slot(name), Frame(frame.parse().unwrap()));
            }
            [name, "dies"] => barrier.dies(slot(name)),
            [name, "leaves"] => barrier.leave(slot(name)),
            _ => panic!("unknown script line: {line}"),
        }
    }
    let verdict = match barrier.verdict(is_late) {
        Verdict::Open => format!("waits for {}", barrier.names(barrier.missing())),
        Verdict::Complete => "complete".to_owned(),
        Verdict::Late(mask) => format!("late: {}", barrier.names(mask)),
        Verdict::Degraded(mask) => format!("degraded: {mask:#b}"),
    };
    assert_eq!(verdict, outcome, "{script}");
}

fn join(barrier: &mut Barrier, name: &str, lag: u64) {
    let on_death = if name == "agent" { OnDeath::Drop } else { OnDeath::Respawn };
    let done = barrier.frame();
    barrier.join(slot(name), name, on_death, lag, done);
}

#[test]
fn a_frame_is_complete_when_all_participants_have_arrived() {
    check("tick", "complete");
    check("traffic joins; tick", "waits for traffic (last arrival: frame 0)");
    check("traffic joins; tick; traffic arrives 1", "complete");
    check(
        "traffic joins; render joins; tick; traffic arrives 1",
        "waits for render (last arrival: frame 0)",
    );
}

#[test]
fn early_and_repeated_arrivals_are_accepted() {
    check(
        "traffic joins; traffic arrives 0; tick; traffic arrives 1; traffic arrives 1",
        "complete",
    );
    check(
        "traffic joins; tick; traffic arrives 1; tick; traffic arrives 1",
        "waits for traffic (last arrival: frame 1)",
    );
}

#[test]
fn an_arrival_of_a_slot_that_did_not_join_is_ignored() {
    check("traffic joins; tick; agent arrives 1", "waits for traffic (last arrival: frame 0)");
}

#[test]
fn a_participant_that_joins_in_mid_run_owes_only_later_frames() {
    check("tick; tick; render joins", "complete");
    check("tick; tick; render joins; tick", "waits for render (last arrival: frame 2)");
}

#[test]
fn a_trailing_participant_is_waited_for_only_beyond_its_lag() {
    check("render joins lag 2; tick; tick", "complete");
    check("render joins lag 2; tick; tick; tick", "waits for render (last arrival: frame 0)");
    check("render joins lag 2; tick; tick; tick; render arrives 1", "complete");
}

#[test]
fn a_participant_that_restarts_is_waited_for() {
    check("render joins; tick; render dies", "waits for render (last arrival: frame 0)");
    check("render joins; tick; render dies; render arrives 1", "complete");
    check("render joins; tick; render arrives 1; render dies", "complete");
}

#[test]
fn a_dropped_participant_is_not_waited_for_but_its_frame_is_degraded() {
    check("agent joins; tick; agent dies", "degraded: 0b100");
    check("agent joins; tick; agent dies; tick", "complete");
    check("agent joins; tick; agent arrives 1; agent dies", "complete");
}

#[test]
fn a_participant_that_left_is_not_waited_for() {
    check("agent joins; tick; agent leaves", "complete");
}

#[test]
fn a_late_frame_names_the_missing_participants() {
    check(
        "traffic joins; render joins; tick; traffic arrives 1; late",
        "late: render (last arrival: frame 0)",
    );
    check("traffic joins; tick; late; traffic arrives 1", "complete");
}
