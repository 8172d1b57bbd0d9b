//! However a simulator ends, nothing is left behind.

use bus::Role;
use rustix::process::Signal;

use crate::kit::{Sim, eventually, kill, lives};

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
