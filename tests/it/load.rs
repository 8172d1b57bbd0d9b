//! A simulator on a machine that is busy with other work: slower, but the same.

use std::process::{Child, Command, Stdio};

use bus::Role;
use rustix::process::Signal;

use crate::{
    crash::{Judge, undisturbed},
    kit::{Sim, eventually, is_soak, kill},
};

/// Processes that compute.
struct Busy(Vec<Child>);

impl Busy {
    fn start(count: usize) -> Busy {
        let spawn = |_| {
            let mut shell = Command::new("sh");
            shell.args(["-c", "while :; do :; done"]).stdin(Stdio::null());
            shell.spawn().unwrap()
        };
        Busy((0..count).map(spawn).collect())
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[test]
fn a_start_and_a_run_beside_many_busy_processes_are_the_same() {
    let cores = std::thread::available_parallelism().unwrap().get();
    let (busy, rounds, frames) = if is_soak() { (8 * cores, 40, 60) } else { (2 * cores, 1, 30) };
    let reference = undisturbed(frames);
    let _busy = Busy::start(busy);
    for round in 0..rounds {
        let sim = Sim::start(&["--deadline-secs", "0"]);
        let mut judge = Judge::new(&sim);
        for (frame, wanted) in reference.iter().enumerate() {
            if frame % 20 == 10 {
                let role = [Role::Traffic, Role::Render][round % 2];
                eventually("the stage", || sim.pid(role).is_some());
                kill(sim.pid(role).unwrap(), Signal::KILL);
            }
            assert_eq!(judge.try_tick().unwrap(), *wanted, "round {round}, frame {frame}");
        }
        drop(judge);
        sim.end();
    }
    println!("{rounds} starts and {} frames beside {busy} busy processes", rounds * frames);
}
