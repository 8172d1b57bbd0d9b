//! Processes are killed with SIGKILL at every fault point and at random; the run continues.

use std::sync::OnceLock;

use bus::Role;
use client_lib::{
    Client, ClientError, Command, Pose, SensorBundle, Spawn, TrafficParam, wire::camera,
};
use glam::{Quat, Vec3};
use mesh::WordHash;
use protocol::{ActorId, output};
use rustix::process::Signal;

use crate::kit::{
    Sim, eventually, is_soak, kill, lives, omnibus, resident_bytes, run_asynchronously,
};

/// Deaths at each point.
fn deaths_wanted() -> usize {
    if is_soak() { 60 } else { 20 }
}

/// A run whose every frame is compared.
pub(crate) struct Judge {
    pub(crate) client: Client,
    bundle: SensorBundle,
}

/// State hash and image digest of a frame.
pub(crate) type Seen = (u64, u64);

impl Judge {
    pub(crate) fn new(sim: &Sim) -> Judge {
        let mut client = sim.ticker();
        let bundle = furnish(&mut client).unwrap();
        Judge { client, bundle }
    }

    /// Loads the map again; the run begins anew.
    pub(crate) fn reload(&mut self) -> Result<(), ClientError> {
        self.client.reload_map()?;
        self.bundle = furnish(&mut self.client)?;
        Ok(())
    }

    /// Ticks; the frame's measurement must have arrived.
    fn tick(&mut self) -> Seen {
        self.try_tick().unwrap()
    }

    /// Ticks; the frame's measurement must have arrived, unless the tick fails.
    pub(crate) fn try_tick(&mut self) -> Result<Seen, ClientError> {
        let (frame, measured) = self.client.tick_and_collect(&mut [&mut self.bundle])?;
        let measured = measured[0].as_ref().unwrap_or_else(|| panic!("{frame} was not measured"));
        let header = self.client.world().header();
        assert_eq!(measured.header().state_hash, header.state_hash, "{frame}");
        let mut digest = WordHash::new();
        digest.bytes(measured.data(0, output::DEPTH).unwrap());
        digest.bytes(measured.data(0, output::INSTANCE).unwrap());
        Ok((header.state_hash, digest.value()))
    }
}

/// Spawns thirteen cars in traffic and ten walkers, two of them together; a camera is on the roof of a
/// car.
fn furnish(client: &mut Client) -> Result<SensorBundle, ClientError> {
    let places = client.spawn_points()?;
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", places[0]).autopilot())?;
    for place in places.iter().skip(5).step_by(9).take(12) {
        client.spawn(Spawn::new("vehicle.audi.tt", *place).autopilot())?;
    }
    client.set_traffic_param(ActorId::NONE, TrafficParam::CrossFactor(0.5))?;
    let walkers = spawn_walkers(client, 10)?;
    client.set_traffic_param(walkers[1], TrafficParam::WalksWith(walkers[0]))?;
    let roof = Pose::new(Vec3::Z * 2.5, Quat::IDENTITY);
    let outputs = output::DEPTH | output::INSTANCE;
    let eye = camera("c", roof, 64, 48, 1.5, outputs);
    client.create_bundle("judge", car, [eye], 2)
}

/// Spawns walkers on autopilot on the sidewalks.
pub(crate) fn spawn_walkers(
    client: &mut Client,
    count: usize,
) -> Result<Vec<ActorId>, ClientError> {
    let map = client.map()?;
    let places = map.waypoints(7.0, road::LaneTypes::only(road::LaneType::Sidewalk));
    let mut walkers = Vec::new();
    for at in places {
        if walkers.len() < count {
            let position = map.place(at).position.as_vec3() + Vec3::Z;
            let place = Pose::new(position, Quat::IDENTITY);
            let spawn = Spawn::new("walker.pedestrian.0001", place).autopilot();
            match client.spawn(spawn) {
                // Something stands there.
                Err(ClientError::Refused { .. }) => {}
                spawned => walkers.push(spawned?),
            }
        }
    }
    Ok(walkers)
}

/// The same run without deaths, made once and long enough for every test.
pub(crate) fn undisturbed(frames: usize) -> &'static [Seen] {
    static RUN: OnceLock<Vec<Seen>> = OnceLock::new();
    let seen = RUN.get_or_init(|| {
        let sim = Sim::start(&[]);
        let mut judge = Judge::new(&sim);
        let seen = (0..if is_soak() { 2600 } else { 300 }).map(|_| judge.tick()).collect();
        drop(judge);
        sim.end();
        seen
    });
    &seen[..frames]
}

#[test]
fn a_measurement_that_is_lost_with_the_host_is_an_error() {
    let mut sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bundle = furnish(&mut client).unwrap();
    // Not received yet: the writer of a new bundle is found when its first measurement is received.
    let frame = client.request_tick().unwrap().wait().unwrap();
    let renderer = sim.pid(Role::Render).unwrap();
    kill(sim.host_pid(), Signal::KILL);
    eventually("the end of the renderer", || !lives(renderer));
    let received = bundle.receive_at(frame).map(|measured| measured.is_some());
    assert!(matches!(received, Err(ClientError::HostEnded { .. })), "{received:?}");
    drop((client, bundle));
    drop(sim.wait());
}

fn deaths(log: &str) -> usize {
    log.lines().filter(|line| line.contains(" died and is ")).count()
}

/// Files and bytes in shared memory and the resident bytes of the host, while both stages live.
pub(crate) fn footprint(sim: &Sim) -> (usize, u64, u64) {
    // A death may not have been noticed yet, so two counts must agree.
    let count = || {
        let stages = [Role::Render, Role::Traffic].map(|role| sim.pid(role).filter(|p| lives(*p)));
        let files = sim.shared_memory();
        (stages, files.len(), files.iter().map(|(_, len)| len).sum())
    };
    let mut last = count();
    eventually("both stages, and a steady count", || {
        std::thread::sleep(std::time::Duration::from_millis(50));
        let before = std::mem::replace(&mut last, count());
        last == before && last.0.iter().all(Option::is_some)
    });
    (last.1, last.2, resident_bytes(sim.host_pid()))
}

pub(crate) fn flat(name: &str, early: (usize, u64, u64), late: (usize, u64, u64)) {
    println!("{name}: files, bytes in shared memory, host resident: {early:?} -> {late:?}");
    assert!(late.0 <= early.0 + 2, "{name}: files in shared memory grow: {early:?} -> {late:?}");
    assert!(late.1 <= early.1 + (1 << 20), "{name}: shared memory grows: {early:?} -> {late:?}");
    assert!(late.2 <= early.2 + (16 << 20), "{name}: the host grows: {early:?} -> {late:?}");
}

/// Runs with a fault plan until enough processes have died; every frame must equal the undisturbed
/// run's.
fn dies_at(role: Role, point: &str) {
    const EVERY: usize = 4;
    let wanted = deaths_wanted();
    let plan = format!("{}:{point}:{EVERY}", role.name());
    let sim = Sim::start_with(&[], &[("OMNIBUS_FAULT", plan.as_str())]);
    let mut judge = Judge::new(&sim);
    let mut seen = Vec::new();
    let mut early = None;
    while deaths(&sim.log()) < wanted {
        seen.push(judge.tick());
        if early.is_none() && deaths(&sim.log()) >= wanted / 4 {
            // What a dead renderer left is removed with the next tick.
            seen.push(judge.tick());
            early = Some(footprint(&sim));
        }
        assert!(
            seen.len() < wanted * EVERY * 3,
            "{plan}: {} deaths in {} frames",
            deaths(&sim.log()),
            seen.len()
        );
    }
    seen.push(judge.tick());
    let late = footprint(&sim);
    let count = deaths(&sim.log());
    drop(judge);
    sim.end();
    assert!(seen == *undisturbed(seen.len()), "{plan}: the run differs");
    println!("{plan}: {count} deaths in {} frames, none lost", seen.len());
    flat(&plan, early.unwrap(), late);
}

/// Kills the stage from outside; every second successor dies while it joins.
fn dies_joining(role: Role) {
    let wanted = deaths_wanted();
    let plan = format!("{}:joining:1", role.name());
    let sim = Sim::start_with(&[], &[("OMNIBUS_FAULT", plan.as_str())]);
    let mut judge = Judge::new(&sim);
    let mut seen = Vec::new();
    let mut early = None;
    while deaths(&sim.log()) < 2 * wanted {
        let pid = sim.pid(role).expect("it lives between ticks");
        kill(pid, Signal::KILL);
        seen.push(judge.tick());
        eventually("its successor", || sim.pid(role).is_some_and(|new| new != pid));
        if early.is_none() && deaths(&sim.log()) >= wanted / 2 {
            // What a dead renderer left is removed with the next tick.
            seen.push(judge.tick());
            early = Some(footprint(&sim));
        }
    }
    seen.push(judge.tick());
    let late = footprint(&sim);
    let count = deaths(&sim.log());
    drop(judge);
    sim.end();
    let other = undisturbed(seen.len()).iter().zip(&seen).position(|(a, b)| a != b);
    assert_eq!(other, None, "{plan}: the run differs from that frame on");
    println!("{plan}: {count} deaths, half of them while joining, in {} frames", seen.len());
    flat(&plan, early.unwrap(), late);
}

#[test]
fn the_renderer_may_die_at_every_fault_point() {
    for point in ["loan_held", "sent", "acked"] {
        dies_at(Role::Render, point);
    }
    dies_joining(Role::Render);
}

#[test]
fn frames_of_a_dead_pipelined_renderer_still_arrive() {
    let wanted = deaths_wanted();
    let sim = Sim::start_with(&[], &[("OMNIBUS_FAULT", "sensor-render:acked:7")]);
    let mut judge = Judge::new(&sim);
    let settings = client_lib::wire::Settings { pipeline: 3, ..judge.client.wire_settings() };
    judge.client.apply_wire_settings(settings).unwrap();
    let (mut ticks, mut measured) = (0, 0);
    while deaths(&sim.log()) < wanted {
        judge.client.tick().unwrap();
        ticks += 1;
        // It reads late because frames lag: a dead renderer has sent what is not yet read.
        std::thread::sleep(std::time::Duration::from_millis(ticks % 5));
        while judge.bundle.receive().unwrap().is_some() {
            measured += 1;
        }
    }
    while measured < ticks {
        judge.client.await_measurement(&mut judge.bundle).unwrap();
        measured += 1;
    }
    assert_eq!(judge.bundle.missed(), 0);
    println!("pipelined: {} deaths in {ticks} frames", deaths(&sim.log()));
    drop(judge);
    sim.end();
}

#[test]
fn a_measurement_outlives_the_renderer_that_sent_it() {
    let sim = Sim::start(&[]);
    let mut judge = Judge::new(&sim);
    judge.tick();
    let renderer = || sim.pid(Role::Render).expect("a renderer");
    let (mut last, mut measured) = (renderer(), 0);
    for _ in 0..10 {
        // The next renderer measures the frame and dies before the client looks for its bundle.
        kill(last, Signal::KILL);
        let frame = judge.client.tick().unwrap();
        last = renderer();
        kill(last, Signal::KILL);
        eventually("the renderer after it", || sim.pid(Role::Render).is_some_and(|p| p != last));
        last = renderer();
        measured += usize::from(judge.bundle.latest().unwrap().is_some_and(|m| m.frame() == frame));
    }
    assert_eq!(measured, 10, "of 10 frames; {}", sim.log());
    drop(judge);
    sim.end();
}

#[test]
fn traffic_may_die_at_every_fault_point_without_losing_state() {
    dies_joining(Role::Traffic);
    for point in ["loan_held", "sent", "acked"] {
        dies_at(Role::Traffic, point);
    }
}

#[test]
fn clients_may_die_at_every_fault_point_even_while_they_hold_the_tick() {
    let sim = Sim::start(&[]);
    let mut judge = Judge::new(&sim);
    judge.tick();
    let own: Vec<_> = judge.client.world().states().iter().map(|a| a.actor_id).collect();
    let mut early = None;
    let points = ["joining", "requesting", "requested", "loan_held", "leaving"];
    for (place, point) in points.into_iter().enumerate() {
        for round in 0..deaths_wanted() {
            // It takes the tick; a holder that died before must have released it.
            release(&mut judge, &sim);
            let every = if point == "leaving" { 1 } else { 3 };
            let fault = format!("client:{point}:{every}");
            let ticks = (round % 5 + 3).to_string();
            let ended = omnibus()
                .args(["client", sim.instance().id(), &ticks])
                .env("OMNIBUS_FAULT", &fault)
                .env("OMNIBUS_LIFE", "1")
                .output()
                .unwrap();
            let why = String::from_utf8_lossy(&ended.stderr);
            assert!(why.is_empty(), "{fault}: {why}");
            eventually("the tick comes back", || judge.client.take_tick().is_ok());
            judge.tick();
            // The cars of a dead client stay, as in CARLA; here they would make the messages
            // longer.
            let cars =
                judge.client.world().states().iter().filter(|a| a.kind == protocol::kind::VEHICLE);
            for car in cars.map(|a| a.actor_id).filter(|id| !own.contains(id)).collect::<Vec<_>>() {
                judge.client.destroy(car).unwrap();
            }
        }
        if early.is_none() {
            early = Some(footprint(&sim));
        }
        let dead = || {
            let log = sim.log();
            log.lines().filter(|l| l.contains("client \"mortal") && l.contains("died")).count()
        };
        // The host removes the last one when it next checks.
        eventually("every client is dead", || dead() >= deaths_wanted() * (place + 1));
        println!("client:{point}: {} deaths so far", dead());
        assert_eq!(dead(), deaths_wanted() * (place + 1), "{point}: too many died");
    }
    flat("clients", early.unwrap(), footprint(&sim));
    drop(judge);
    sim.end();
}

/// Releases the tick, so that the next client can take it.
fn release(judge: &mut Judge, sim: &Sim) {
    let control = sim.instance().control().unwrap();
    control.pass_tick(control.ticker(), None);
    let _ = judge;
}

#[test]
fn every_process_may_die_at_random_times() {
    let wanted = if is_soak() { 600 } else { 40 };
    let sim = Sim::start(&[]);
    let mut judge = Judge::new(&sim);
    let mut seen = Vec::new();
    let mut early = None;
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    for count in 0..wanted {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let role = if random & 1 == 0 { Role::Render } else { Role::Traffic };
        eventually("both stages", || {
            sim.pid(Role::Render).is_some() && sim.pid(Role::Traffic).is_some()
        });
        let pid = sim.pid(role).unwrap();
        let pause = std::time::Duration::from_micros(random >> 8 & 0x1fff);
        let killer = crate::kit::thread(move || {
            std::thread::sleep(pause);
            kill(pid, Signal::KILL);
        });
        for _ in 0..4 {
            seen.push(judge.tick());
        }
        killer.join().unwrap();
        eventually("its successor", || sim.pid(role).is_some_and(|new| new != pid));
        if count == wanted / 4 {
            // With a tick after the last death: its successor has created everything it needs.
            seen.push(judge.tick());
            early = Some(footprint(&sim));
        }
    }
    eventually("both stages", || {
        sim.pid(Role::Render).is_some() && sim.pid(Role::Traffic).is_some()
    });
    seen.push(judge.tick());
    let (late, count) = (footprint(&sim), deaths(&sim.log()));
    drop(judge);
    sim.end();
    assert_eq!(count, wanted, "too few died");
    assert!(seen == *undisturbed(seen.len()), "the run is another one");
    println!("at random: {count} deaths in {} frames, none lost", seen.len());
    flat("at random", early.unwrap(), late);
}

#[test]
fn a_command_between_two_frames_reaches_a_restarted_stage() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let at = Pose::new(Vec3::Z * 40.0, Quat::IDENTITY);
    let spec = camera("c", at, 64, 48, 1.5, output::DEPTH);
    let mut bundle = client.create_bundle("early", ActorId::NONE, [spec], 2).unwrap();
    let pid = sim.pid(Role::Render).unwrap();
    kill(pid, Signal::KILL);
    eventually("its successor", || sim.pid(Role::Render).is_some_and(|new| new != pid));
    for _ in 0..5 {
        assert!(client.tick_and_collect(&mut [&mut bundle]).unwrap().1[0].is_some());
    }
    drop((client, bundle));
    sim.end();
}

#[test]
fn without_restart_a_death_ends_the_run_with_its_reason() {
    let mut sim = Sim::start_with(&["--no-restart"], &[("OMNIBUS_FAULT", "traffic:sent:5")]);
    let mut judge = Judge::new(&sim);
    let ended = (0..20).find_map(|_| judge.client.tick().err()).expect("traffic dies at frame 5");
    assert!(ended.to_string().contains("host has ended"), "{ended}");
    let (status, log) = sim.wait();
    assert!(!status.success());
    println!("{log}");
    assert!(log.contains("traffic died in frame") && log.contains("signal: 9"), "{log}");
    assert_eq!(sim.shared_memory(), []);
}

#[test]
fn a_stage_that_keeps_dying_ends_the_run_with_its_last_error() {
    // A GPU that does not exist: the renderer ends as soon as it starts.
    let output = omnibus()
        .args(["run", "--device", "gpu:63", "--no-carla", "--map", crate::kit::small_map()])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(said.contains("sensor-render") && said.contains("gpu:63"), "{said}");
}

#[test]
fn a_stopped_stage_is_started_again_and_completes_its_frame() {
    let sim = Sim::start(&["--deadline-secs", "0.5", "--on-stall", "restart"]);
    let mut judge = Judge::new(&sim);
    let mut seen = Vec::new();
    for role in [Role::Traffic, Role::Render] {
        for _ in 0..5 {
            seen.push(judge.tick());
        }
        kill(sim.pid(role).unwrap(), Signal::STOP);
    }
    for _ in 0..20 {
        seen.push(judge.tick());
    }
    drop(judge);
    let log = sim.end();
    assert!(seen == *undisturbed(seen.len()), "the run differs: {log}");
    for role in [Role::Traffic, Role::Render] {
        let stalls = log.lines().filter(|line| {
            line.contains(role.name()) && line.contains("has made no progress for 0.5 s")
        });
        assert_eq!(stalls.count(), 1, "{log}");
    }
}

#[test]
fn a_stopped_stage_of_an_asynchronous_world_is_started_again() {
    let sim = Sim::start(&["--deadline-secs", "0.5"]);
    let mut client = sim.client("watcher");
    let place = client.spawn_points().unwrap()[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot()).unwrap();
    run_asynchronously(&mut client);
    for role in [Role::Traffic, Role::Render] {
        let stopped = sim.pid(role).unwrap();
        kill(stopped, Signal::STOP);
        // Only the planner learns this, from the journal after its last plan.
        let stop = TrafficParam::SpeedMps(0.0);
        client.request("stop", &[Command::set_traffic_param(car, stop)]).unwrap();
        eventually("another process in its place", || {
            sim.pid(role).is_some_and(|pid| pid != stopped)
        });
    }
    eventually("a standing car", || {
        client.await_frame().unwrap();
        let velocity = client.world().state(car).unwrap().velocity_mps;
        Vec3::from(velocity).length() < 0.1
    });
    drop(client);
    let log = sim.end();
    assert_eq!(log.matches("has made no progress for 0.5 s; it is killed").count(), 2, "{log}");
}
