//! Connections of CARLA's protocol beside each other and beside native clients.

use std::sync::{Arc, Mutex};

use carla_gateway::msgpack::{Pack, Value};
use client_lib::{Client, Spawn, Weather};

use crate::{
    carla::with_carla_server,
    carla_wire::{Connection, Listener, value},
    kit::{Sim, eventually, thread},
};

/// A simulator whose synchronous world waits for `agent` at each frame, without a time limit: a
/// tick, or the load of a world, cannot end before this client arrives.
fn held_by_an_agent() -> (Sim, u16, Connection, Client) {
    let (sim, port) = with_carla_server(&["--deadline-secs", "0"]);
    let mut carla = Connection::open(port);
    carla.set_synchronous();
    let mut agent = sim.client("agent");
    agent.join_barrier().unwrap();
    (sim, port, carla, agent)
}

/// Makes a call of one connection wait for the agent, and calls of another one meanwhile.
fn check_order(method: &'static str, args: usize, write: fn(&mut Pack)) {
    let (sim, port, mut waiting, mut agent) = held_by_an_agent();
    let events = Arc::new(Mutex::new(Vec::new()));
    let ended = Arc::clone(&events);
    let begun = agent.frame();
    let waiting = thread(move || {
        waiting.call(method, args, write);
        ended.lock().unwrap().push(method);
        waiting
    });
    while agent.frame() == begun {
        agent.await_frame().unwrap();
    }
    // The frame is published, and complete only after the agent has arrived.
    let mut other = Connection::open(port);
    other.call_each_kind();
    other.call_traffic_manager();
    events.lock().unwrap().push("calls of another connection");
    agent.arrive();
    let waiting = waiting.join().unwrap();
    assert_eq!(*events.lock().unwrap(), ["calls of another connection", method]);
    drop((waiting, agent));
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
}

/// Without this, an agent in the barrier that reads the world through CARLA's protocol before it
/// arrives would block the tick for which it is awaited.
#[test]
fn calls_are_answered_while_another_carla_client_waits_for_its_tick() {
    check_order("tick_cue", 0, |_| {});
}

#[test]
fn calls_are_answered_while_another_carla_client_loads_a_world() {
    check_order("load_new_episode", 3, |args| {
        args.text("Millbrook").bool(false).uint(0xffff);
    });
}

/// A tick ends when all images of its frame are measured: whatever waits for a tick waits for the
/// images of another client.
#[test]
fn actors_and_sensors_are_spawned_while_another_carla_client_waits_for_its_tick() {
    let (sim, port, mut waiting, mut agent) = held_by_an_agent();
    let begun = agent.frame();
    let waiting = thread(move || {
        waiting.call("tick_cue", 0, |_| {});
        waiting
    });
    while agent.frame() == begun {
        agent.await_frame().unwrap();
    }
    let mut other = Connection::open(port);
    let car = other.spawn("vehicle.audi.tt", &[], [0.0, 0.0, 50.0]);
    let (camera, stream) = other.spawn_camera([32, 16]);
    let mut images = Listener::open(&mut other, stream);
    // The frame is open until the agent arrives.
    agent.arrive();
    let mut waiting = waiting.join().unwrap();
    agent.leave_barrier().unwrap();
    let frame = waiting.tick();
    assert_eq!(images.next().frame, frame);
    for actor in [car, camera] {
        other.call("destroy_actor", 1, |args| {
            args.uint(actor);
        });
    }
    drop((waiting, other, agent));
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
}

#[test]
fn ticks_of_two_carla_clients_each_advance_the_world() {
    const TICKS: u64 = 50;
    let (sim, port) = with_carla_server(&[]);
    let mut first = Connection::open(port);
    first.set_synchronous();
    let ticks = |mut connection: Connection| {
        thread(move || {
            let tick = |_| match connection.call("tick_cue", 0, |_| {}) {
                Value::List(parts) => format!("{parts:?}"),
                other => panic!("{other:?}"),
            };
            let frames: Vec<_> = (0..TICKS).map(tick).collect();
            (connection, frames)
        })
    };
    let (a, b) = (ticks(first), ticks(Connection::open(port)));
    let ((_a, mut frames), (_b, others)) = (a.join().unwrap(), b.join().unwrap());
    frames.extend(others);
    frames.sort();
    frames.dedup();
    assert_eq!(frames.len() as u64, 2 * TICKS, "each tick has a frame of its own");
    drop((_a, _b));
    sim.end();
}

#[test]
fn carla_s_clients_read_the_weather_that_a_native_client_has_set() {
    let (sim, port) = with_carla_server(&[]);
    let mut native = sim.ticker();
    let mut carla = Connection::open(port);
    let cloudiness =
        |carla: &mut Connection| match value(carla.call("get_weather_parameters", 0, |_| {})) {
            Value::List(weather) => weather[0].clone(),
            other => panic!("{other:?}"),
        };
    let before = cloudiness(&mut carla);
    native.set_weather(Weather { cloudiness: 77.0, ..Weather::default() }).unwrap();
    native.tick().unwrap();
    eventually("the weather is read", || cloudiness(&mut carla) != before);
    assert_eq!(cloudiness(&mut carla), Value::Float(77.0));
    drop((native, carla));
    sim.end();
}

/// A frame is published before it is measured: until the last participant has arrived, clients read
/// and change the world as between two frames.
#[test]
fn clients_query_spawn_and_destroy_while_another_one_waits_for_its_tick() {
    let (sim, _, mut waiting, mut agent) = held_by_an_agent();
    let mut other = sim.client("other");
    let pose = client_lib::spawn_poses(&other.map().unwrap())[0];
    let begun = agent.frame();
    let waiting = thread(move || {
        waiting.call("tick_cue", 0, |_| {});
        waiting
    });
    while agent.frame() == begun {
        agent.await_frame().unwrap();
    }
    let car = other.spawn(Spawn::new("vehicle.audi.tt", pose)).unwrap();
    assert_eq!(other.queries().vehicle_physics(car).unwrap().body.wheels, 4);
    other.destroy(car).unwrap();
    // The frame is open until the agent arrives.
    agent.arrive();
    drop((waiting.join().unwrap(), agent, other));
    let log = sim.end();
    assert!(!log.contains("panicked"), "{log}");
}

/// Returns the refusal in an answer: `[[0, [text]]]`, or `[[true, [text]]]` of a call without value.
fn refusal(answer: Value) -> String {
    let Value::List(wrapped) = &answer else { panic!("{answer:?}") };
    match wrapped.first() {
        Some(Value::List(parts))
            if matches!(parts.first(), Some(Value::Int(0) | Value::Bool(true))) =>
        {
            format!("{parts:?}")
        }
        _ => panic!("it was not refused: {answer:?}"),
    }
}

/// Writes the description of an actor without attributes and its transform.
fn described(args: &mut Pack, blueprint: &str, at_m: [f32; 3]) {
    args.list(3).uint(0).text(blueprint).list(0);
    args.list(2).vector(at_m).vector([0.0; 3]);
}

#[test]
fn sensors_and_triggers_are_not_placed_beyond_the_world() {
    let (sim, port) = with_carla_server(&[]);
    let mut carla = Connection::open(port);
    carla.set_synchronous();
    let car = carla.spawn("vehicle.tesla.model3", &[], [0.0, 0.0, 300.0]);
    let camera = carla.spawn("sensor.camera.rgb", &[], [0.0, 0.0, 30.0]);
    for (bad, word) in
        [(3e38, "100000"), (-3e38, "100000"), (f32::NAN, "NaN"), (f32::INFINITY, "inf")]
    {
        let place = [1.0, 2.0, bad];
        for blueprint in ["sensor.camera.rgb", "sensor.other.gnss", "static.trigger.friction"] {
            let why =
                refusal(carla.call("spawn_actor", 2, |args| described(args, blueprint, place)));
            assert!(why.contains(word), "{blueprint}: {why}");
            let why = refusal(carla.call("spawn_actor_with_parent", 5, |args| {
                described(args, blueprint, place);
                args.uint(car).uint(0).text("");
            }));
            assert!(why.contains(word), "{blueprint}: {why}");
        }
        for (method, args) in [("set_actor_location", 2), ("set_actor_transform", 2)] {
            let why = refusal(carla.call(method, args, |args| {
                args.uint(camera);
                if method == "set_actor_transform" {
                    args.list(2).vector(place).vector([0.0; 3]);
                } else {
                    args.vector(place);
                }
            }));
            assert!(why.contains(word), "{method}: {why}");
        }
    }
    let nan = refusal(carla.call("set_weather_parameters", 1, |args| {
        args.list(14);
        for value in [0.0; 13] {
            args.f32(value);
        }
        args.f32(f32::NAN);
    }));
    assert!(nan.contains("NaN"), "{nan}");
    carla.tick();
    drop(carla);
    sim.end();
}
