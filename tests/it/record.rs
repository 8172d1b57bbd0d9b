//! Recordings: read, simulated again, cut off, refused.

use std::{
    fs,
    path::{Path, PathBuf},
};

use ::record::Recording;
use client_lib::{Client, Profile, Replay, Spawn, TrafficParam, wire::camera};
use glam::{Quat, Vec3};
use omnibus::resimulate;
use protocol::{ActorId, ActorState, Command, Pose, SetVelocity, output};
use rustix::process::Signal;

use crate::kit::{Scratch, Sim, eventually, is_soak, omnibus, small_map};

const FRAMES: u64 = 300;

/// State hash and actors of a frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Seen {
    pub(crate) hash: u64,
    pub(crate) actors: Vec<[u32; 32]>,
}

pub(crate) fn seen(client: &Client) -> Seen {
    let bits = |state: &ActorState| -> [u32; 32] { bytemuck::cast(*state) };
    let world = client.world();
    Seen { hash: world.header().state_hash, actors: world.states().iter().map(bits).collect() }
}

/// Thirty cars in traffic, and ten new ones in every frame.
pub(crate) struct Bustle {
    places: Vec<client_lib::Pose>,
    next: usize,
    pub(crate) brief: Vec<ActorId>,
}

impl Bustle {
    pub(crate) fn new(client: &mut Client) -> Bustle {
        let places = client.spawn_points().unwrap();
        for place in places.iter().step_by(3).take(30) {
            let _ = client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot());
        }
        Bustle { places, next: 0, brief: Vec::new() }
    }

    /// The client's commands before the next tick.
    pub(crate) fn act(&mut self, client: &mut Client) {
        let mut commands: Vec<_> = self.brief.drain(..).map(Command::Destroy).collect();
        let cars: Vec<_> = client.world().states().iter().filter(|a| a.kind == 1).collect();
        if let Some(car) = cars.get(self.next % cars.len().max(1)) {
            commands.push(Command::SetVelocity(SetVelocity {
                actor_id: car.actor_id,
                velocity_mps: [7.0, -3.0, 1.0],
                angular_velocity_radps: [0.0, 0.3, 1.0],
            }));
        }
        client.send(&commands).unwrap();
        let spawns: Vec<_> = (0..10)
            .map(|n| {
                self.next += 1;
                let place = self.places[(self.next * 7 + n) % self.places.len()];
                let blueprint = ["vehicle.audi.tt", "vehicle.tesla.model3"][n % 2];
                Spawn::new(blueprint, place).autopilot().wire()
            })
            .collect();
        let outcomes = client.try_wire_request("spawn", &spawns).unwrap();
        let ids = outcomes.iter().filter_map(|entry| entry.outcome.result().ok());
        self.brief = ids.map(ActorId).collect();
    }
}

/// Records a busy run and returns every recorded frame.
fn record(sim: &Sim, profile: Profile, path: &Path, frames: u64) -> Vec<Seen> {
    let mut client = sim.ticker();
    let mut bustle = Bustle::new(&mut client);
    for _ in 0..20 {
        bustle.act(&mut client);
        client.tick().unwrap();
    }
    client.start_recorder(path.to_str().unwrap(), profile).unwrap();
    let mut run = Vec::new();
    for _ in 0..frames {
        bustle.act(&mut client);
        client.tick().unwrap();
        run.push(seen(&client));
    }
    assert_eq!(client.stop_recorder().unwrap(), frames);
    run
}

fn check_same(recording: &mut Recording, run: &[Seen], with_actors: bool) -> usize {
    let mut at = 0;
    for segment in 0..recording.segments() {
        for moment in recording.recorded_frames(segment).unwrap() {
            assert_eq!(moment.state_hash, run[at].hash, "{}", moment.stamp.frame);
            if with_actors {
                assert!(moment.is_as_shown());
                let bits: Vec<[u32; 32]> =
                    moment.actors.iter().map(|state| bytemuck::cast(*state)).collect();
                assert_eq!(bits, run[at].actors, "{}", moment.stamp.frame);
            }
            at += 1;
        }
    }
    at
}

#[test]
fn a_recording_equals_the_shown_states_and_can_be_simulated_again() {
    let scratch = Scratch::new();
    for (profile, threads) in [(Profile::State, "1"), (Profile::Inputs, "2")] {
        let sim = Sim::start(&["--seed", "3", "--threads", threads]);
        let path = scratch.path().join(format!("{profile:?}.mcap"));
        let run = record(&sim, profile, &path, FRAMES);
        sim.end();
        let mut recording = Recording::open(&path).unwrap();
        assert!(recording.info().is_complete);
        let frames = check_same(&mut recording, &run, profile == Profile::State);
        assert_eq!(frames, run.len());
        let told = resimulate(&mut recording, 0, u64::MAX).unwrap();
        assert_eq!((told.frames, told.difference), (FRAMES, None), "{profile:?}");
        let output = omnibus().arg("replay").arg(&path).args(["--resimulate", "--verify"]).output();
        let output = output.unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        if profile == Profile::State {
            let mut command = omnibus();
            command.arg("replay").arg(&path).args(["--verify", "--device", "cpu"]);
            let output = command.output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{said}");
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(said.contains("300 frames shown as recorded, to the bit"), "{said}");
        }
    }
}

/// Vehicles near the car on which sensors are mounted during the recording have full physics.
#[test]
fn hybrid_physics_is_simulated_again() {
    let scratch = Scratch::new();
    let run = |is_hybrid: bool| {
        let sim = Sim::start(&["--seed", "3"]);
        let mut client = sim.ticker();
        let places = client.spawn_points().unwrap();
        let cars: Vec<ActorId> = places
            .iter()
            .step_by(3)
            .filter_map(|place| {
                client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot()).ok()
            })
            .take(30)
            .collect();
        if is_hybrid {
            let every = ActorId::NONE;
            client.set_traffic_param(every, TrafficParam::HybridRadiusM(60.0)).unwrap();
            client.set_traffic_param(every, TrafficParam::HybridPhysics(true)).unwrap();
        }
        let path = scratch.path().join(format!("{is_hybrid}.mcap"));
        client.start_recorder(path.to_str().unwrap(), Profile::Inputs).unwrap();
        let mut bundle = None;
        for frame in 0..120 {
            if frame == 60 {
                let at = Pose::new(Vec3::Z * 2.0, Quat::IDENTITY);
                let eye = camera("eye", at, 32, 24, 1.5, output::DEPTH);
                bundle = Some(client.create_bundle("eye", cars[0], [eye], 2).unwrap());
            }
            client.tick().unwrap();
        }
        drop(bundle);
        client.stop_recorder().unwrap();
        let last = seen(&client);
        sim.end();
        let mut recording = Recording::open(&path).unwrap();
        let told = resimulate(&mut recording, 0, u64::MAX).unwrap();
        assert_eq!((told.frames, told.difference), (120, None), "hybrid: {is_hybrid}");
        last
    };
    assert_ne!(run(true).actors, run(false).actors);
}

#[test]
fn a_replay_shows_recorded_actors_beside_existing_ones() {
    let scratch = Scratch::new();
    let path = scratch.path().join("shown.mcap");
    let name = path.to_str().unwrap();
    let sim = Sim::start(&["--seed", "3"]);
    let run = record(&sim, Profile::State, &path, 60);
    sim.end();
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    let place = *client.spawn_points().unwrap().last().unwrap();
    let above = client_lib::Pose::new(place.position() + glam::Vec3::Z * 300.0, place.rotation());
    let own = client.spawn(Spawn::new("vehicle.audi.tt", above)).unwrap();
    client.tick().unwrap();
    client.start_replay(name, Replay::default()).unwrap();
    for recorded in &run {
        client.tick().unwrap();
        // Ids in use are not reassigned; all others are as recorded.
        let shown = seen(&client).actors;
        let missing = recorded.actors.iter().filter(|a| !shown.contains(a)).count();
        let has_own = recorded.actors.iter().any(|a| a[0] == own.0);
        assert_eq!(missing, usize::from(has_own));
    }
    assert!(client.world().state(own).unwrap().pose.position().z < 299.0, "it went on");
    // At the end of the replay the vehicles drive on.
    let last = run.last().unwrap().actors.len();
    for _ in 0..40 {
        client.tick().unwrap();
    }
    let driven = client.world().states().iter().filter(|a| a.kind == 1 && a.has(1) && !a.has(2));
    assert!(driven.count() > 20 && client.world().states().len() >= last);
    // Again from the middle, twice as fast, and stopped.
    let replay = Replay { from_s: -1.5, time_factor: 2.0, ..Replay::default() };
    client.start_replay(name, replay).unwrap();
    let before = client.world().states().len();
    client.tick().unwrap();
    assert!(client.world().states().len() > before);
    client.stop_replay(false).unwrap();
    client.tick().unwrap();
    assert_eq!(client.world().states().len(), before);
    for (replay, word) in [
        (Replay { from_s: 99.0, ..Replay::default() }, "3.00 s"),
        (Replay { time_factor: f32::NAN, ..Replay::default() }, "time_factor"),
    ] {
        let said = client.start_replay(name, replay).unwrap_err().to_string();
        assert!(said.contains(word), "{said}");
    }
    drop(client);
    sim.end();
}

#[test]
fn a_replay_of_another_world_loads_it_first() {
    let scratch = Scratch::new();
    let path = scratch.path().join("elsewhere.mcap");
    let sim = Sim::start(&["--seed", "3"]);
    let run = record(&sim, Profile::State, &path, 30);
    sim.end();
    let sim = Sim::start(&["--seed", "4", "--map", "Millbrook"]);
    let mut client = sim.ticker();
    let place = client.spawn_points().unwrap()[0];
    client.spawn(Spawn::new("vehicle.audi.tt", place)).unwrap();
    client.tick().unwrap();
    let replay = |from_s| Replay { from_s, ..Replay::default() };
    // A refused replay destroys nothing.
    let first = client.episode();
    let said = client.start_replay(path.to_str().unwrap(), replay(99.0)).unwrap_err().to_string();
    assert!(said.contains("1.50 s") && client.episode() == first, "{said}");
    client.start_replay(path.to_str().unwrap(), replay(0.0)).unwrap();
    assert_eq!(client.world().header().stamp.episode, first + 1);
    let episode = client.instance().episode().unwrap();
    assert_eq!(episode, Recording::open(&path).unwrap().info().episode);
    for recorded in &run {
        client.tick().unwrap();
        assert_eq!(seen(&client).actors, recorded.actors);
    }
    drop(client);
    sim.end();
}

/// CARLA's log has centimetres and degrees.
#[test]
fn a_carla_log_equals_the_recording_and_can_be_replayed() {
    let scratch = Scratch::new();
    let [log, path, again] = ["run.log", "run.mcap", "again.mcap"].map(|f| scratch.path().join(f));
    let told = |args: &[&str]| {
        let output = omnibus().args(args).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
        String::from_utf8(output.stdout).unwrap()
    };
    let [log_name, path_name] = [&log, &path].map(|path| path.to_str().unwrap());
    let small = ["--vehicles", "8", "--frames", "60", "--device", "null", "--map", small_map()];
    let mut args = vec!["record", "--carla-log", log_name, "--out", path_name];
    args.extend(small);
    told(&args);
    for table in
        [&["--info", "--all"][..], &["--info"], &["--collisions", "a,a"], &["--blocked", "1,50"]]
    {
        let [ours, carlas] = [path_name, log_name].map(|name| {
            let mut args = vec!["inspect", name];
            args.extend(table);
            told(&args)
        });
        assert_eq!(ours, carlas, "{table:?}");
        assert!(ours.contains("Frames: 60"), "{ours}");
    }
    assert!(told(&["inspect", log_name]).contains("60 frames of"));
    let json: serde_json::Value =
        serde_json::from_str(&told(&["inspect", log_name, "--json"])).unwrap();
    assert_eq!((&json["frames"], &json["carla_log"]), (&60.into(), &1.into()));
    told(&["replay", log_name, "--map", small_map(), "--time-factor", "4", "--device", "null"]);

    let mut recording = Recording::open(&path).unwrap();
    carla_gateway::carla_log::import(&log, &again, recording.info().episode.clone()).unwrap();
    let mut imported = Recording::open(&again).unwrap();
    assert_eq!(imported.segments(), recording.segments());
    let mut seen = 0;
    for segment in 0..recording.segments() {
        let moments = recording.recorded_frames(segment).unwrap();
        for (moment, shown) in moments.iter().zip(imported.recorded_frames(segment).unwrap()) {
            assert_eq!(moment.actors.len(), shown.actors.len());
            for (was, is) in moment.actors.iter().zip(&shown.actors) {
                assert_eq!(
                    (was.actor_id, was.blueprint, was.kind),
                    (is.actor_id, is.blueprint, is.kind)
                );
                assert_eq!((was.phase, was.gear, was.color), (is.phase, is.gear, is.color));
                assert!(was.pose.position().distance(is.pose.position()) < 1e-3);
                assert!(was.pose.rotation().angle_between(is.pose.rotation()) < 2e-3);
                assert!(was.velocity().distance(is.velocity()) < 1e-4);
                seen += 1;
            }
        }
    }
    assert!(seen > 60 * 8, "{seen}");

    // With the log alone, the recording is removed.
    let alone = scratch.path().join("alone.log");
    let mut args = vec!["record", "--carla-log", alone.to_str().unwrap()];
    args.extend(small);
    told(&args);
    assert!(alone.exists() && !alone.with_added_extension("mcap").exists());
}

#[test]
fn a_killed_simulator_leaves_a_recording_up_to_its_last_second() {
    let scratch = Scratch::new();
    let path = scratch.path().join("killed.mcap");
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    let mut bustle = Bustle::new(&mut client);
    client.start_recorder(path.to_str().unwrap(), Profile::State).unwrap();
    let mut run = Vec::new();
    for _ in 0..if is_soak() { 2000 } else { 130 } {
        bustle.act(&mut client);
        client.tick().unwrap();
        run.push(seen(&client));
    }
    // Frames of an incomplete segment are written after at most a second of real time.
    let whole = run.len() as u64 / 20 * 20;
    eventually("the last full second", || {
        Recording::open(&path).is_ok_and(|mut r| frames(&mut r) >= whole)
    });
    drop(client);
    sim.signal(Signal::KILL);
    let mut recording = Recording::open(&path).unwrap();
    assert!(!recording.info().is_complete);
    let count = check_same(&mut recording, &run, true);
    assert!(count as u64 >= whole, "{count} of {} frames", run.len());
}

fn frames(recording: &mut Recording) -> u64 {
    (0..recording.segments()).map(|s| recording.frames(s).map_or(0, |f| f.len() as u64)).sum()
}

#[test]
fn the_first_difference_of_a_changed_run_is_named_by_frame_and_actor() {
    let scratch = Scratch::new();
    let path = scratch.path().join("run.mcap");
    let sim = Sim::start(&["--seed", "3"]);
    record(&sim, Profile::State, &path, 60);
    sim.end();
    let mut recording = Recording::open(&path).unwrap();
    let plan = ::record::RecordingConfig {
        path: scratch.path().join("changed.mcap"),
        profile: ::record::Profile::State,
        episode: recording.info().episode.clone(),
        blueprints: vec![],
        roles: vec![],
    };
    let mut writer = ::record::Writer::create(&plan).unwrap();
    let mut changed = None;
    for segment in 0..recording.segments() {
        for moment in recording.recorded_frames(segment).unwrap() {
            let mut moment = moment.clone();
            // One of the first thirty cars; the others exist for one frame only.
            if changed.is_none()
                && moment.stamp.frame.0 > 50
                && let Some(car) = moment.actors.iter_mut().find(|a| a.kind == 1)
            {
                car.pose.position_m[0] += 0.001;
                changed = Some((moment.stamp.frame, car.actor_id));
            }
            writer.put(moment).unwrap();
        }
    }
    writer.finish().unwrap();
    let output = omnibus()
        .arg("replay")
        .arg(&plan.path)
        .args(["--resimulate", "--verify"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    let (frame, actor) = changed.unwrap();
    assert!(!output.status.success());
    assert!(said.contains(&frame.to_string()) && said.contains(&actor.to_string()), "{said}");
}

#[test]
fn a_file_that_is_not_a_recording_is_refused_in_one_line() {
    let scratch = Scratch::new();
    let good = scratch.path().join("good.mcap");
    let sim = Sim::start(&["--seed", "3"]);
    record(&sim, Profile::State, &good, 45);
    sim.end();
    let bytes = fs::read(&good).unwrap();
    let refused = |name: &str, content: &[u8], words: &[&str]| {
        let path: PathBuf = scratch.path().join(name);
        fs::write(&path, content).unwrap();
        let output = omnibus().arg("replay").arg(&path).arg("--verify").output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success(), "{name}");
        assert_eq!(said.lines().count(), 1, "{said}");
        for word in words.iter().chain([&name]) {
            assert!(said.contains(word), "{said:?} does not say {word:?}");
        }
    };
    refused("empty", b"", &["not a recording"]);
    refused("text", b"hello, world: this is text", &["not a recording"]);
    refused("magic", &bytes[..8], &["not a recording"]);
    refused("head", &bytes[..600], &[]);
    let noise: Vec<u8> = (0..50_000u64).map(|n| (n.wrapping_mul(n) >> 7) as u8).collect();
    refused("noise", &noise, &["not a recording"]);
    let mut torn = bytes.clone();
    let middle = torn.len() / 2;
    torn[middle..middle + 40].fill(0xa5);
    refused("torn", &torn, &["damaged"]);
    let form = find(&bytes, b"format_version\x01\x00\x00\x006").unwrap();
    let mut other = bytes.clone();
    other[form + 18] = b'9';
    refused("other", &other, &["format version 9", "format version 6"]);
    let output = omnibus().args(["replay", "/no/such/file.mcap"]).output().unwrap();
    assert!(String::from_utf8_lossy(&output.stderr).contains("No such file"));
}

fn find(bytes: &[u8], part: &[u8]) -> Option<usize> {
    bytes.windows(part.len()).position(|window| window == part)
}

#[test]
fn a_recorder_that_cannot_write_reports_it_and_the_world_goes_on() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    for bad in ["/proc/no/such", "/dev/null/x"] {
        let said = client.start_recorder(bad, Profile::State).unwrap_err().to_string();
        assert!(said.contains(bad), "{said}");
    }
    let long = format!("/tmp/{}", "x".repeat(200));
    assert!(client.start_recorder(&long, Profile::State).unwrap_err().to_string().contains("160"));
    assert_eq!(client.stop_recorder().unwrap(), 0);
    client.tick().unwrap();
    drop(client);
    sim.end();
}

#[test]
fn the_tables_have_carlas_layout() {
    let scratch = Scratch::new();
    let path = scratch.path().join("tables.mcap");
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    let places = client.spawn_points().unwrap();
    let hero = Spawn::new("vehicle.tesla.model3", places[0]).role("hero").color([1, 2, 3]);
    let hero = client.spawn(hero).unwrap();
    let parked = Spawn::new("vehicle.audi.tt", *places.last().unwrap()).kinematic();
    client.spawn(parked).unwrap();
    client.start_recorder(path.to_str().unwrap(), Profile::State).unwrap();
    client.tick().unwrap();
    let other = client.spawn(Spawn::new("vehicle.audi.tt", places[1])).unwrap();
    client.tick().unwrap();
    // A head-on collision.
    let ahead = places[0].rotation() * glam::Vec3::X;
    let facing = places[0].rotation() * glam::Quat::from_rotation_z(std::f32::consts::PI);
    let at = places[0].position() + ahead * 6.0;
    client.teleport(other, client_lib::Pose::new(at, facing)).unwrap();
    let push = SetVelocity {
        actor_id: other,
        velocity_mps: (ahead * -12.0).to_array(),
        ..SetVelocity::default()
    };
    client.request("push", &[Command::SetVelocity(push)]).unwrap();
    for _ in 0..60 {
        client.tick().unwrap();
    }
    client.destroy(other).unwrap();
    client.tick().unwrap();
    client.stop_recorder().unwrap();
    drop(client);
    sim.end();
    let ask = |args: &[&str]| {
        let output = omnibus().arg("inspect").arg(&path).args(args).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let info = ask(&["--info"]);
    let lines: Vec<_> = info.lines().collect();
    assert_eq!(lines[0], "Version: 1");
    assert!(lines[1].starts_with("Map: ") && lines[2].starts_with("Date: "), "{info}");
    assert_eq!(lines[3..5], ["", "Frame 1 at 0 seconds"]);
    let hero_line = format!(" Create {}: vehicle.tesla.model3 (1) at (", hero.0);
    let at = lines.iter().position(|l| l.starts_with(&hero_line)).unwrap();
    assert_eq!(lines[at + 1..at + 3], ["  color = 1,2,3", "  role_name = hero"]);
    assert!(info.contains(" Create 1: traffic.traffic_light (3) at ("), "{info}");
    assert!(lines.contains(&"Frame 2 at 0.05 seconds"), "{info}");
    assert!(lines.contains(&format!(" Destroy {}", other.0).as_str()), "{info}");
    let hit = format!("between {} (hero)  with {}", hero.0, other.0);
    assert!(info.contains(&hit), "{info}");
    assert!(info.ends_with("\nFrames: 63\nDuration: 3.1 seconds\n"), "{info}");
    let all = ask(&["--info", "--all"]);
    assert!(all.contains(" Positions: 3\n  Id: ") && all.contains(" elapsedTime: "), "{all}");
    let table = ask(&["--collisions", "h,v"]);
    let head = "    Time  Types     Id Actor 1                                 Id Actor 2";
    let lines: Vec<_> = table.lines().collect();
    assert_eq!(lines[4].trim_end(), head);
    // One row for each second in which they touch.
    let rows = &lines[5..lines.len() - 3];
    assert!((1..=3).contains(&rows.len()), "{table}");
    for (second, row) in rows.iter().enumerate() {
        let start =
            format!("       {second}   v v  {:>6} vehicle.tesla.model3                ", hero.0);
        assert!(row.starts_with(&start), "{table}");
    }
    assert_eq!(lines[lines.len() - 3..], ["", "Frames: 63", "Duration: 3 seconds"]);
    assert!(!ask(&["--collisions", "w,a"]).contains("tesla"));
    let table = ask(&["--blocked", "1.5,50"]);
    assert!(table.contains("    Time     Id Actor                                 Duration"));
    assert!(table.contains("vehicle.audi.tt"), "{table}");
    let json: serde_json::Value =
        serde_json::from_str(&ask(&["--collisions", "h,v", "--json"])).unwrap();
    assert_eq!(json["collisions"][0]["actor_ids"], serde_json::json!([hero.0, other.0]));
    assert!(ask(&[]).contains("profile state"), "{}", ask(&[]));
}

#[test]
fn a_recording_that_cannot_grow_is_reported_and_keeps_what_was_written() {
    let scratch = Scratch::new();
    let path = scratch.path().join("cut.mcap");
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bustle = Bustle::new(&mut client);
    client.start_recorder(path.to_str().unwrap(), Profile::State).unwrap();
    for _ in 0..100 {
        bustle.act(&mut client);
        client.tick().unwrap();
    }
    // The file may not become longer than it is, as on a full disk.
    eventually("some frames on the disk", || path.metadata().unwrap().len() > 100_000);
    let host = rustix::process::Pid::from_raw(sim.host_pid() as i32);
    let limit = Some(path.metadata().unwrap().len() + 10_000);
    let limit = rustix::process::Rlimit { current: limit, maximum: limit };
    rustix::process::prlimit(host, rustix::process::Resource::Fsize, limit).unwrap();
    for _ in 0..200 {
        client.tick().unwrap();
    }
    let error = client.stop_recorder().unwrap_err().to_string();
    assert!(error.contains("cut.mcap") && error.contains("too large"), "{error}");
    assert_eq!(client.stop_recorder().unwrap(), 0, "it is told once");
    drop(client);
    let log = sim.end();
    assert!(log.contains("the recording ends: "), "{log}");
    let mut kept = Recording::open(&path).unwrap();
    let frames: usize = (0..kept.segments()).map(|s| kept.recorded_frames(s).unwrap().len()).sum();
    assert!(frames >= 20, "{frames} frames are left");
}
