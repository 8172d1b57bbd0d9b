//! Saved states: after loading one, the simulation continues as it did before.

use client_lib::{Client, Spawn, Weather};
use protocol::{Command, TrafficParam, param};

use crate::{
    kit::{Scratch, Sim, is_soak, resident_bytes},
    record::{Bustle, Seen, seen},
};

/// Ticks without any commands.
fn run(client: &mut Client, frames: usize) -> Vec<Seen> {
    (0..frames)
        .map(|_| {
            client.tick().unwrap();
            seen(client)
        })
        .collect()
}

fn check_same(a: &[Seen], b: &[Seen], what: &str) {
    let at = a.iter().zip(b).position(|(a, b)| a != b);
    let Some(at) = at else { return assert_eq!(a.len(), b.len(), "{what}") };
    let differing = a[at].actors.iter().zip(&b[at].actors).position(|(a, b)| a != b);
    panic!(
        "{what}: frame {at} differs, the {differing:?}th of {} and {} actors first",
        a[at].actors.len(),
        b[at].actors.len()
    );
}

/// Thirty cars in busy traffic, with their own weather and parameters.
fn lively(client: &mut Client) -> Bustle {
    let mut bustle = Bustle::new(client);
    client.set_weather(Weather { wetness: 40.0, ..Weather::default() }).unwrap();
    let slower =
        TrafficParam { param: param::SPEED_REDUCTION, value: -0.4, ..TrafficParam::default() };
    client.request("param", &[Command::TrafficParam(slower)]).unwrap();
    for _ in 0..60 {
        bustle.act(client);
        client.tick().unwrap();
    }
    bustle
}

#[test]
fn a_loaded_state_has_the_future_it_had_when_saved() {
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    lively(&mut client);
    // Commands that wait for the next frame are part of the state.
    let first = client.world().states().iter().find(|a| a.kind == 1).unwrap().actor_id;
    let mut other = sim.client("other");
    other.send(&[Command::Destroy(first)]).unwrap();
    let state = client.save_state().unwrap();
    let future = run(&mut client, 200);
    assert!(future[0].actors.iter().all(|a| a[0] != first.0), "the command was carried out");
    // The same from the present state, and after other commands.
    for detour in [0, 40] {
        client.load_state(&state).unwrap();
        run(&mut client, detour);
        let mut bustle = Bustle::new(&mut client);
        for _ in 0..detour {
            bustle.act(&mut client);
            client.tick().unwrap();
        }
        client.load_state(&state).unwrap();
        check_same(&run(&mut client, 200), &future, &format!("after {detour} frames elsewhere"));
    }
    drop((client, other));
    sim.end();
}

#[test]
fn saving_in_the_middle_changes_nothing() {
    let drive = |with_save: bool| {
        let sim = Sim::start(&["--seed", "3"]);
        let mut client = sim.ticker();
        let mut bustle = lively(&mut client);
        let mut seen_so_far = Vec::new();
        for frame in 0..150 {
            if with_save && frame % 30 == 7 {
                let state = client.save_state().unwrap();
                client.load_state(&state).unwrap();
            }
            bustle.act(&mut client);
            client.tick().unwrap();
            seen_so_far.push(seen(&client));
        }
        drop(client);
        sim.end();
        seen_so_far
    };
    check_same(&drive(true), &drive(false), "saved and loaded on the way");
}

#[test]
fn a_state_continues_in_another_process() {
    let scratch = Scratch::new();
    let path = scratch.path().join("state");
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    lively(&mut client);
    client.save_state_to(&path).unwrap();
    let future = run(&mut client, 100);
    drop(client);
    sim.end();
    let sim = Sim::start(&["--seed", "3", "--threads", "2"]);
    let mut client = sim.ticker();
    client.load_state_from(&path).unwrap();
    assert_eq!(client.wire_settings().delta_nanos, crate::kit::DELTA_NANOS);
    check_same(&run(&mut client, 100), &future, "in another process");
    drop(client);
    sim.end();
}

#[test]
fn many_branches_of_one_state_need_no_more_memory() {
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    lively(&mut client);
    let state = client.save_state().unwrap();
    let branches = if is_soak() { 1000 } else { 50 };
    let mut first = None;
    let mut early = (0, 0);
    for branch in 0..branches {
        client.load_state(&state).unwrap();
        // Each branch diverges after the first common frames.
        let common = run(&mut client, 3);
        check_same(first.get_or_insert_with(|| common.clone()), &common, "a branch");
        let place = client.spawn_points().unwrap()[branch % 20];
        let _ = client.spawn(Spawn::new("vehicle.audi.tt", place).autopilot());
        run(&mut client, 5);
        let shared: u64 = sim.shared_memory().iter().map(|(_, len)| len).sum();
        let now = (resident_bytes(sim.host_pid()), shared);
        if branch == branches / 5 {
            early = now;
        } else if branch + 1 == branches {
            println!("{branches} branches: {early:?} bytes resident and shared, then {now:?}");
            assert!(now.0 < early.0 + (24 << 20), "{early:?} then {now:?}");
            assert!(now.1 <= early.1 + (1 << 20), "{early:?} then {now:?}");
        }
    }
    drop(client);
    sim.end();
}

#[test]
fn an_invalid_state_is_refused_and_the_world_goes_on() {
    let scratch = Scratch::new();
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    lively(&mut client);
    let state = client.save_state().unwrap();
    let before = run(&mut client, 5);
    client.load_state(&state).unwrap();
    let mut flipped = state.clone();
    flipped[state.len() / 2] ^= 1;
    for (bytes, words) in [
        (&b""[..], "shorter"),
        (&state[..100], "not a saved state"),
        (&state[..state.len() - 1], "damaged"),
        (&flipped, "damaged"),
        (&[9; 4096], "bad magic"),
    ] {
        let said = client.load_state(bytes).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
    let missing = scratch.path().join("missing");
    assert!(client.load_state_from(&missing).unwrap_err().to_string().contains("missing"));
    check_same(&run(&mut client, 5), &before, "after refusals");
    drop(client);
    sim.end();
    let sim = Sim::start(&["--seed", "4"]);
    let mut client = sim.ticker();
    let said = client.load_state(&state).unwrap_err().to_string();
    assert!(said.contains("another map or seed"), "{said}");
    run(&mut client, 3);
    drop(client);
    sim.end();
}
