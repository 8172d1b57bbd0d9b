//! Two simulators, two clients, two tickers.

use client_lib::Spawn;

use crate::kit::Sim;

#[test]
fn two_simulators_on_one_machine_are_isolated() {
    let (left, right) = (Sim::start(&["--seed", "1"]), Sim::start(&["--seed", "1"]));
    let (mut a, mut b) = (left.ticker(), right.ticker());
    let place = a.spawn_points().unwrap()[0];
    let empty = b.world().states().len();
    a.spawn(Spawn::new("vehicle.audi.tt", place)).unwrap();
    for _ in 0..50 {
        a.tick().unwrap();
    }
    assert_eq!(b.tick().unwrap().0, 1, "the other's ticks are its own");
    assert_eq!(b.world().states().len(), empty);
    assert_eq!(a.world().states().len(), empty + 1);
    let ambiguous = client_lib::Client::connect(None, "lost").err().map(|e| e.to_string());
    assert!(ambiguous.is_some_and(|e| e.contains("say which by name")));
    drop((a, b));
    left.end();
    right.end();
}

#[test]
fn a_second_ticking_client_is_refused_by_name_unless_the_first_hands_over() {
    let sim = Sim::start(&[]);
    let mut first = sim.client("first");
    first.synchronise(std::time::Duration::from_nanos(50_000_000)).unwrap();
    let mut second = sim.client("second");
    let refused = second.tick().unwrap_err().to_string();
    assert!(refused.contains("\"first\"") && refused.contains("hand"), "{refused}");
    let unknown = first.hand_tick_to("third").unwrap_err().to_string();
    assert!(unknown.contains("third"), "{unknown}");
    first.hand_tick_to("second").unwrap();
    assert_eq!(second.tick().unwrap().0, 1);
    let refused = first.tick().unwrap_err().to_string();
    assert!(refused.contains("\"second\""), "{refused}");
    drop(second);
    crate::kit::eventually("the tick comes back", || first.tick().is_ok());
    drop(first);
    sim.end();
}

#[test]
fn two_clients_with_one_name_get_their_own_responses() {
    let sim = Sim::start(&[]);
    let (a, b) = (sim.client("twin"), sim.client("twin"));
    let places = a.spawn_points().unwrap();
    let spawn_ten = |mut client: client_lib::Client, first: usize| {
        let places: Vec<_> = places.iter().skip(first).step_by(20).take(10).copied().collect();
        let spawn = move || {
            let mut ids = Vec::new();
            for place in places {
                ids.push(client.spawn(Spawn::new("vehicle.audi.tt", place)).unwrap().0);
            }
            ids
        };
        crate::kit::thread(spawn)
    };
    let (one, two) = (spawn_ten(a, 0), spawn_ten(b, 10));
    let spawns = [one.join().unwrap(), two.join().unwrap()].concat();
    let mut ids = spawns.clone();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 20, "{spawns:?}");
    sim.end();
}

#[test]
fn a_client_that_connects_leaves_the_settings_as_they_are() {
    let sim = Sim::start(&["--pipeline", "2", "--fixed-delta", "0.02", "--no-rendering"]);
    let mut client = sim.client("late");
    client
        .synchronise(std::time::Duration::from_nanos(client.wire_settings().delta_nanos))
        .unwrap();
    let settings = client.wire_settings();
    assert_eq!((settings.pipeline, settings.no_rendering), (2, 1));
    client.tick().unwrap();
    assert_eq!(client.world().header().delta_nanos, 20_000_000);
    drop(client);
    sim.end();
}

#[test]
fn every_blueprint_that_is_listed_can_be_spawned() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    for (index, blueprint) in town::catalogue().iter().enumerate() {
        if blueprint.kind == town::Kind::TrafficLight {
            continue;
        }
        let at = glam::Vec3::new((index % 16) as f32 * 20.0, (index / 16) as f32 * 20.0, 150.0);
        let pose = client_lib::Pose::new(at, glam::Quat::IDENTITY);
        let spawned = client.spawn(Spawn::new(blueprint.id, pose).kinematic());
        assert!(spawned.is_ok(), "{}: {:?}", blueprint.id, spawned.err());
    }
    client.tick().unwrap();
    drop(client);
    sim.end();
}
