//! However a simulator ends, nothing is left behind.

use std::{fs, io::Read, os::unix::fs::PermissionsExt, path::PathBuf, process::Stdio};

use bus::Role;
use rustix::process::Signal;

use crate::kit::{Scratch, Sim, eventually, kill, lives, omnibus};

fn stages(sim: &Sim) -> Vec<u32> {
    [Role::Traffic, Role::Render].iter().filter_map(|role| sim.pid(*role)).collect()
}

#[test]
fn ctrl_c_and_sigterm_leave_no_process_and_no_file() {
    for signal in [Signal::INT, Signal::TERM] {
        let sim = Sim::start(&[]);
        let mut client = sim.ticker();
        for _ in 0..20 {
            client.tick().unwrap();
        }
        let (stages, instance) = (stages(&sim), sim.instance().clone());
        assert_eq!(stages.len(), 2);
        let (status, log) = sim.signal(signal);
        assert!(status.success(), "{log}");
        assert!(!stages.iter().any(|pid| lives(*pid)));
        assert!(!instance.root().exists());
        assert_eq!(instance.segments(), Vec::<std::path::PathBuf>::new());
        let told = client.tick().unwrap_err().to_string();
        assert!(told.contains("host has ended"), "{told}");
    }
}

#[test]
fn a_killed_host_ends_the_others_at_once_and_the_next_start_removes_what_it_left() {
    let mut sim = Sim::start(&[]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let stages = stages(&sim);
    kill(sim.host_pid(), Signal::KILL);
    let _ = sim.wait();
    let told = client.tick().unwrap_err().to_string();
    assert!(told.contains("host has ended"), "{told}");
    eventually("the stages' end", || !stages.iter().any(|pid| lives(*pid)));
    assert!(sim.instance().root().exists(), "a killed host cannot tidy up");
    drop(client);
    let next = Sim::start(&[]);
    assert!(!sim.instance().root().exists());
    assert_eq!(sim.shared_memory(), []);
    next.end();
}

#[test]
fn a_client_that_leaves_frees_its_slot() {
    let sim = Sim::start(&[]);
    let mut ticker = sim.ticker();
    let mut files = Vec::new();
    for round in 0..60 {
        // More clients than slots, so none may be lost.
        drop(sim.client("visitor"));
        ticker.tick().unwrap();
        if round % 20 == 19 {
            files.push(sim.shared_memory().len());
        }
    }
    assert!(files.windows(2).all(|n| n[1] <= n[0]), "files in shared memory grow: {files:?}");
    drop(ticker);
    sim.end();
}

/// Ten roads of 100 km, whose towns take far longer to build than a process to start.
fn long_roads() -> String {
    let lane = |id: i32| {
        format!(
            r#"<lane id="{id}" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>"#
        )
    };
    let road = |id: usize| {
        let y = id * 500;
        format!(
            r#"<road length="100000" id="{id}" junction="-1"><planView><geometry s="0" x="0" y="{y}" hdg="0" length="100000"><arc curvature="0.00001"/></geometry></planView><lanes><laneSection s="0"><left>{}</left><center><lane id="0" type="none"/></center><right>{}</right></laneSection></lanes></road>"#,
            lane(1),
            lane(-1)
        )
    };
    let roads: String = (1..=10).map(road).collect();
    format!(r#"<OpenDRIVE><header revMajor="1" revMinor="6"/>{roads}</OpenDRIVE>"#)
}

#[test]
fn a_simulator_that_loads_a_map_ends_at_a_signal() {
    let scratch = Scratch::new();
    let map = scratch.path().join("long.xodr");
    fs::write(&map, long_roads()).unwrap();
    for extra in [&[][..], &["--single-process"]] {
        let name = format!("load{}-{}", std::process::id() % 100_000, extra.len());
        let mut started = omnibus();
        started.env("OMNIBUS_CACHE", scratch.path());
        started.args(["run", "--no-carla", "--device", "null", "--name", &name, "--map"]);
        started.arg(&map).args(extra);
        let mut simulator = started.stdout(Stdio::piped()).spawn().unwrap();
        let folder = PathBuf::from(format!("/dev/shm/omnibus-{name}"));
        eventually("an instance", || folder.exists());
        kill(simulator.id(), Signal::TERM);
        let mut said = String::new();
        simulator.stdout.take().unwrap().read_to_string(&mut said).unwrap();
        assert!(simulator.wait().unwrap().success());
        assert_eq!(said, "stopped while the map was loaded\n");
        eventually("no instance", || !folder.exists());
    }
}

#[test]
fn other_users_can_open_nothing_of_a_simulator() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let instance = sim.instance();
    for path in instance.segments().into_iter().chain([instance.root()]) {
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{}: {mode:o}", path.display());
    }
    drop(client);
    sim.end();
}
