//! Synchronous, pipelined and asynchronous mode, agents in lockstep, and changes during a run.

use client_lib::{
    Client, Pose, Spawn,
    wire::{Settings, VehicleControl, camera},
};
use glam::{Quat, Vec3};
use protocol::{ActorId, output};

use crate::kit::{DELTA_NANOS, Sim, run_asynchronously};

fn lookout(client: &mut Client) -> client_lib::SensorBundle {
    let at = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", at, 64, 48, 1.5, output::DEPTH);
    client.create_bundle("lookout", ActorId::NONE, [spec], 4).unwrap()
}

#[test]
fn a_synchronous_tick_returns_with_every_measurement_and_simulated_time_adds_up() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bundle = lookout(&mut client);
    let begin = client.world().header().stamp;
    for count in 1..=100 {
        let (frame, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        assert_eq!(frame.0, begin.frame.0 + count);
        assert_eq!(measured[0].as_ref().map(|m| m.frame()), Some(frame));
        let stamp = client.world().header().stamp;
        assert_eq!(stamp.sim_time_nanos, begin.sim_time_nanos + count * DELTA_NANOS);
    }
    drop((client, bundle));
    sim.end();
}

#[test]
fn without_a_tick_a_synchronous_world_stands_still_and_an_asynchronous_one_runs() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let frame = client.tick().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    client.refresh().unwrap();
    assert_eq!(client.frame(), frame);
    let running = Settings { synchronous: 0, real_time_permille: 0, ..client.wire_settings() };
    client.apply_wire_settings(running).unwrap();
    let mut last = frame;
    for _ in 0..20 {
        let next = client.await_frame().unwrap();
        assert!(next > last);
        last = next;
    }
    let refused = client.tick().unwrap_err().to_string();
    assert!(refused.contains("own clock"), "{refused}");
    client.synchronise(std::time::Duration::from_nanos(DELTA_NANOS)).unwrap();
    client.refresh().unwrap();
    let still = client.frame();
    assert_eq!(client.tick().unwrap().0, still.0 + 1, "it waits for ticks again");
    drop(client);
    sim.end();
}

#[test]
fn a_slow_renderer_does_not_slow_an_asynchronous_world_and_shows_complete_frames() {
    let slow = [("OMNIBUS_DELAY", "sensor-render:60000")];
    let sim = Sim::start_with(&[], &slow);
    let mut client = sim.client("watcher");
    let mut bundle = lookout(&mut client);
    run_asynchronously(&mut client);
    let from = client.await_frame().unwrap();
    let mut frames = Vec::new();
    while frames.len() < 20 {
        frames.push(client.await_measurement(&mut bundle).unwrap().frame());
    }
    client.refresh().unwrap();
    let passed = client.frame().0 - from.0;
    assert!(passed > 30, "the world made {passed} frames while the renderer showed {frames:?}");
    assert!(frames.windows(2).all(|f| f[0] < f[1]), "{frames:?}");
    assert!(bundle.missed() > 0, "it shows the newest, not all");
    drop((client, bundle));
    sim.end();
}

#[test]
fn a_pipelined_renderer_lags_by_at_most_the_configured_frames() {
    let sim = Sim::start_with(&[], &[("OMNIBUS_DELAY", "sensor-render:8000")]);
    let mut client = sim.ticker();
    let mut bundle = lookout(&mut client);
    let mut trailed = false;
    let mut first = None;
    for depth in [2, 0, 3, 1] {
        client.apply_wire_settings(Settings { pipeline: depth, ..client.wire_settings() }).unwrap();
        for _ in 0..30 {
            let frame = client.tick().unwrap();
            while let Some(measured) = bundle.receive().unwrap() {
                first.get_or_insert(measured.frame());
                trailed |= measured.frame() < frame;
            }
            assert!(
                bundle.last().0 + u64::from(depth) >= frame.0,
                "depth {depth}: {} at {frame}",
                bundle.last()
            );
        }
    }
    assert!(trailed, "it never trailed: nothing was pipelined");
    while bundle.last() < client.frame() {
        client.await_measurement(&mut bundle).unwrap();
    }
    assert_eq!((first, bundle.missed()), (Some(client_lib::Frame(1)), 0));
    drop((client, bundle));
    sim.end();
}

#[test]
fn agents_that_take_part_are_waited_for_and_steer_every_frame() {
    const TICKS: u64 = 200;
    let sim = Sim::start(&[]);
    let mut ticker = sim.ticker();
    let places = ticker.spawn_points().unwrap();
    let car = ticker.spawn(Spawn::new("vehicle.tesla.model3", places[3])).unwrap();
    let mut agent = sim.client("agent");
    agent.join_barrier().unwrap();
    let at_work = crate::kit::thread(move || {
        let mut seen = Vec::new();
        for _ in 0..TICKS {
            let frame = agent.await_frame().unwrap();
            seen.push(frame);
            // It is delayed, and still no frame is skipped.
            std::thread::sleep(std::time::Duration::from_millis(frame.0 % 3));
            let throttle = (frame.0 % 10) as f32 * 0.1;
            let control = VehicleControl { actor_id: car, throttle, ..VehicleControl::default() };
            agent.control(&[control]).unwrap();
            agent.arrive();
        }
        agent.leave_barrier().unwrap();
        seen
    });
    let mut throttles = Vec::new();
    for _ in 0..TICKS {
        let frame = ticker.tick().unwrap();
        throttles.push((frame, ticker.world().state(car).unwrap().throttle));
    }
    let seen = at_work.join().unwrap();
    assert_eq!(seen, throttles.iter().map(|(frame, _)| *frame).collect::<Vec<_>>());
    for (frame, throttle) in &throttles[1..] {
        let due = ((frame.0 - 1) % 10) as f32 * 0.1;
        assert_eq!(*throttle, due, "{frame}: what the agent said on the frame before acts");
    }
    ticker.tick().unwrap();
    drop(ticker);
    sim.end();
}

#[test]
fn an_agent_that_dies_degrades_its_frame_and_no_other() {
    let sim = Sim::start(&[]);
    let mut ticker = sim.ticker();
    ticker.tick().unwrap();
    // A participant in this process that never arrives: the frame ends late and names it.
    let late = Sim::start(&["--deadline-secs", "0.3"]);
    let mut other = late.ticker();
    let mut idle = late.client("idle");
    idle.join_barrier().unwrap();
    let said = other.tick().unwrap_err().to_string();
    assert!(said.contains("late") && said.contains("idle"), "{said}");
    drop(idle);
    crate::kit::eventually("a tick without it", || other.tick().is_ok());
    drop(other);
    late.end();
    ticker.tick().unwrap();
    drop(ticker);
    sim.end();
}

#[test]
fn no_rendering_renders_nothing_and_can_be_switched() {
    let sim = Sim::start(&["--no-rendering"]);
    let mut client = sim.ticker();
    let mut bundle = lookout(&mut client);
    let off = Settings { no_rendering: 1, ..client.wire_settings() };
    client.apply_wire_settings(off).unwrap();
    for _ in 0..10 {
        assert!(client.tick_and_collect(&mut [&mut bundle]).unwrap().1[0].is_none());
    }
    client.apply_wire_settings(Settings { no_rendering: 0, ..off }).unwrap();
    assert!(client.tick_and_collect(&mut [&mut bundle]).unwrap().1[0].is_some());
    drop((client, bundle));
    sim.end();
}

#[test]
fn a_client_that_steers_for_long_can_still_send_commands() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    for _ in 0..200 {
        let control = VehicleControl { actor_id: car, throttle: 0.3, ..VehicleControl::default() };
        client.control(&[control]).unwrap();
        client.tick().unwrap();
    }
    client.destroy(car).unwrap();
    drop(client);
    sim.end();
}
