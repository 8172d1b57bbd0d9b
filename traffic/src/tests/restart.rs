//! The planner is a pure function of its inputs, across restarts.

use protocol::ActorId;

use super::course::{Course, DELTA_NANOS};
use super::maps;
use crate::{Planner, RestoreError};

/// Returns all decisions and the state of a planner.
fn bytes(planner: &Planner) -> Vec<u8> {
    let mut bytes = bytemuck::cast_slice(planner.controls()).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(planner.lights()));
    bytes.extend(planner.save());
    bytes
}

/// Returns the controls of a run of 20 vehicles, frame by frame.
fn run(seed: u64, ticks: usize) -> Vec<Vec<u8>> {
    let mut course = Course::new(maps::town(), seed, 20);
    (0..ticks)
        .map(|_| {
            course.tick();
            bytemuck::cast_slice(course.planner.controls()).to_vec()
        })
        .collect()
}

#[test]
fn a_seed_decides_every_bit() {
    let once = run(7, 600);
    assert!(once == run(7, 600), "the same seed");
    assert!(once != run(8, 600), "another seed");
}

/// Returns all decisions and states of a run of many vehicles in this number of threads: by frame,
/// and with vehicles that leave and others that come.
fn run_in(threads: usize, ticks: usize) -> Vec<Vec<u8>> {
    let mut course = Course::new(maps::town(), 3, 240);
    course.planner.set_threads(threads);
    let run = (0..ticks).map(|tick| {
        let gone = ActorId(1 + (tick as u32 / 40 * 7) % 240);
        let there: Vec<_> =
            course.actors.iter().filter(|actor| actor.actor_id != gone).copied().collect();
        course.planner.plan(DELTA_NANOS, &there, &[]);
        let decided = bytes(&course.planner);
        course.advance();
        decided
    });
    run.collect()
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let alone = run_in(1, 400);
    assert!(alone[0].len() > 200 * 256, "enough vehicles for several threads");
    for threads in [2, 5] {
        let spread = run_in(threads, 400);
        let differs = alone.iter().zip(&spread).position(|(one, other)| one != other);
        assert_eq!(differs, None, "the first frame in which {threads} threads decide otherwise");
    }
}

#[test]
fn a_restored_planner_continues_with_the_same_bits() {
    // While some wait, some turn and some change lanes.
    for restart_at in [1, 37, 400, 1203] {
        let mut course = Course::new(maps::town(), 4, 30);
        for _ in 0..restart_at {
            course.tick();
        }
        let mut second = Planner::new(course.network.clone(), 999);
        second.restore(&course.planner.save()).unwrap();
        for tick in 0..400 {
            course.planner.plan(DELTA_NANOS, &course.actors, &[]);
            second.plan(DELTA_NANOS, &course.actors, &[]);
            assert!(
                bytes(&course.planner) == bytes(&second),
                "{tick} ticks after a restart at {restart_at}"
            );
            course.advance();
        }
    }
}

#[test]
fn the_order_of_actors_does_not_matter() {
    let mut course = Course::new(maps::town(), 4, 30);
    let mut second = Planner::new(course.network.clone(), 4);
    for tick in 0..400 {
        let mut shuffled = course.actors.clone();
        shuffled.reverse();
        let middle = tick % shuffled.len();
        shuffled.rotate_left(middle);
        course.planner.plan(DELTA_NANOS, &course.actors, &[]);
        second.plan(DELTA_NANOS, &shuffled, &[]);
        assert!(bytes(&course.planner) == bytes(&second), "tick {tick}");
        course.advance();
    }
}

#[test]
fn a_state_that_does_not_fit_is_refused_and_changes_nothing() {
    let mut course = Course::new(maps::town(), 4, 5);
    for _ in 0..50 {
        course.tick();
    }
    let saved = course.planner.save();
    let mut other = Planner::new(maps::straight(500.0), 1);
    assert!(matches!(other.restore(&saved), Err(RestoreError::OtherMap { what: "lanes", .. })));
    let cut = &saved[..saved.len() - 1];
    assert!(matches!(course.planner.restore(cut), Err(RestoreError::Shape { .. })));
    assert!(matches!(course.planner.restore(&[]), Err(RestoreError::Shape { found: 0, .. })));
    let mut bent = saved.clone();
    bent[0] ^= 1;
    assert!(matches!(course.planner.restore(&bent), Err(RestoreError::Shape { .. })));
    assert_eq!(course.planner.save(), saved);
}
