//! Processes of every kind are killed and stopped at random instants, all at once, over many
//! simulators: no frame is lost, every frame has the undisturbed run's bits, nothing hangs, and
//! nothing is left behind.

use std::{
    process::Child,
    sync::{Arc, Weak},
    time::{Duration, Instant},
};

use ::record::Recording;
use bus::Role;
use client_lib::{ClientError, Profile};
use mesh::RandomStream;
use rustix::process::Signal;

use crate::{
    crash::{Judge, Seen, flat, footprint, undisturbed},
    kit::{Scratch, Sim, eventually, is_soak, kill, lives, omnibus, open_files, thread},
};

/// Simulators in sequence, and the faults in each of them; about half are kills.
fn counts() -> (usize, usize) {
    if is_soak() { (100, 200) } else { (3, 16) }
}

/// Frames until the map is loaded again, and the run begins anew.
const PERIOD: usize = 150;

/// Kills of a stage in one frame: the host gives up after five, and ends the run.
const KILLS_MAX: usize = 4;

/// The longest stop of a process, and the longest time between two faults.
const STOP_MAX_MICROS: u64 = 40_000;
const PAUSE_MAX_MICROS: u64 = 30_000;

/// The process that a fault meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Victim {
    Traffic,
    Renderer,
    Gateway,
    Observer,
    Host,
}

const VICTIMS: [Victim; 5] =
    [Victim::Traffic, Victim::Renderer, Victim::Gateway, Victim::Observer, Victim::Host];

impl Victim {
    /// Returns its process, if it participates.
    fn pid(self, sim: &Sim, observer: u32) -> Option<u32> {
        match self {
            Victim::Traffic => sim.pid(Role::Traffic),
            Victim::Renderer => sim.pid(Role::Render),
            Victim::Gateway => sim.gateway_pid(),
            Victim::Observer => Some(observer).filter(|pid| sim.has_admitted(*pid)),
            Victim::Host => Some(sim.host_pid()),
        }
    }
}

/// Faults that have happened, by victim.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    kills: [usize; VICTIMS.len()],
    stops: [usize; VICTIMS.len()],
}

/// A client in a process of its own, which is started again after its death.
struct Observer(Child);

impl Observer {
    fn start(sim: &Sim) -> Observer {
        let mut command = omnibus();
        command.args(["observe", sim.instance().id()]);
        Observer(command.spawn().unwrap())
    }
}

impl Drop for Observer {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Ends the host when the thread of the faults or that of the test fails: the other one ends then,
/// and no simulator is left.
struct EndsHostOnPanic(Weak<Sim>);

impl Drop for EndsHostOnPanic {
    fn drop(&mut self) {
        let Some(sim) = self.0.upgrade().filter(|_| std::thread::panicking()) else { return };
        eprintln!("{}", sim.log());
        kill(sim.host_pid(), Signal::TERM);
        // It may be stopped.
        kill(sim.host_pid(), Signal::CONT);
    }
}

/// Lets faults happen to a simulator; the last one kills the host, if `ends_with_host`.
fn disturb(
    sim: &Sim,
    mut observer: Observer,
    faults: usize,
    seed: u64,
    ends_with_host: bool,
) -> Tally {
    let mut random = RandomStream::from_state(seed);
    let mut tally = Tally::default();
    let mut killed = [None; VICTIMS.len()];
    // The frame of the last kills, and how many there were in it.
    let mut recent = [(0, 0); VICTIMS.len()];
    for _ in 0..faults {
        std::thread::sleep(Duration::from_micros(random.bits() % PAUSE_MAX_MICROS));
        let index = *random.pick(&[0, 0, 0, 1, 1, 1, 2, 3, 3, 4]);
        let victim = VICTIMS[index];
        let mut pid = None;
        eventually(&format!("{victim:?} after its death"), || {
            pid = victim.pid(sim, observer.0.id()).filter(|pid| killed[index] != Some(*pid));
            pid.is_some()
        });
        let pid = pid.unwrap();
        let frame = sim.frame();
        if recent[index].0 != frame {
            recent[index] = (frame, 0);
        }
        if victim == Victim::Host || recent[index].1 == KILLS_MAX || random.chance(0.5) {
            kill(pid, Signal::STOP);
            std::thread::sleep(Duration::from_micros(random.bits() % STOP_MAX_MICROS));
            kill(pid, Signal::CONT);
            tally.stops[index] += 1;
        } else {
            kill(pid, Signal::KILL);
            tally.kills[index] += 1;
            recent[index].1 += 1;
            killed[index] = Some(pid);
            if victim == Victim::Observer {
                observer = Observer::start(sim);
            }
        }
    }
    if ends_with_host {
        kill(sim.host_pid(), Signal::KILL);
        tally.kills[VICTIMS.len() - 1] += 1;
    } else {
        for (index, victim) in VICTIMS.into_iter().enumerate() {
            eventually(&format!("{victim:?} at the end"), || {
                victim.pid(sim, observer.0.id()).is_some_and(|pid| killed[index] != Some(pid))
            });
        }
    }
    drop(observer);
    tally
}

/// Asserts that a recording holds the frames of `run` in their order. Frames that were simulated when
/// the host died may be missing, and one that no client has seen may be there.
fn check_recording(path: &std::path::Path, run: &[Seen]) -> usize {
    // Less than one segment: the file may have no summary yet.
    let Ok(mut recording) = Recording::open(path) else { return 0 };
    let mut count = 0;
    for segment in 0..recording.segments() {
        for frame in recording.recorded_frames(segment).unwrap() {
            assert_eq!(frame.state_hash, run[count].0, "frame {count} of the recording");
            count += 1;
        }
    }
    count
}

#[test]
fn processes_of_every_kind_may_be_killed_and_stopped_at_random_times() {
    let (sessions, faults) = counts();
    let scratch = Scratch::new();
    let name = format!("f{}", std::process::id() % 1_000_000);
    let reference = undisturbed(PERIOD);
    let (mut frames, mut recorded, mut total) = (0, 0, Tally::default());
    let own_files = open_files(std::process::id());
    let begun = Instant::now();
    for session in 0..sessions {
        // On a loaded machine, several successors in one frame take longer than the default deadline.
        let args = ["--carla-port", "0", "--deadline-secs", "120"];
        let sim = Arc::new(Sim::start_named(&name, &args, &[]));
        let _guard = EndsHostOnPanic(Arc::downgrade(&sim));
        let mut judge = Judge::new(&sim);
        let path = scratch.path().join("faults.mcap");
        judge.client.start_recorder(path.to_str().unwrap(), Profile::State).unwrap();
        let mut at = 0;
        while at < 10 {
            assert_eq!(judge.try_tick().unwrap(), reference[at]);
            at += 1;
        }
        let observer = Observer::start(&sim);
        eventually("the other clients", || {
            sim.gateway_pid().is_some() && sim.has_admitted(observer.0.id())
        });
        let before = (footprint(&sim), open_files(sim.host_pid()));
        // The last simulator ends as a user ends it.
        let ends_with_host = session + 1 < sessions;
        let faulty = {
            let sim = Arc::clone(&sim);
            thread(move || {
                let _guard = EndsHostOnPanic(Arc::downgrade(&sim));
                disturb(&sim, observer, faults, session as u64, ends_with_host)
            })
        };
        let members: Vec<u32> = loop {
            let members: Vec<_> = VICTIMS.iter().filter_map(|v| v.pid(&sim, 0)).collect();
            match judge.try_tick() {
                Ok(seen) => {
                    assert_eq!(seen, reference[at], "simulator {session}, frame {at} of its world");
                    (at, frames) = (at + 1, frames + 1);
                }
                Err(ClientError::HostEnded { .. }) if ends_with_host => break members,
                Err(e) => panic!("simulator {session}: {e}; {}", sim.log()),
            }
            if faulty.is_finished() && !ends_with_host {
                break members;
            }
            if at == PERIOD {
                // The recording ends with the world.
                match judge.reload() {
                    Ok(()) => at = 0,
                    Err(ClientError::HostEnded { .. }) if ends_with_host => break members,
                    Err(e) => panic!("simulator {session}: {e}; {}", sim.log()),
                }
            }
        };
        let tally = faulty.join().unwrap_or_else(|_| panic!("{}", sim.log()));
        for (sum, one) in total.kills.iter_mut().zip(tally.kills) {
            *sum += one;
        }
        for (sum, one) in total.stops.iter_mut().zip(tally.stops) {
            *sum += one;
        }
        if ends_with_host {
            drop(judge);
            eventually("the end of every process", || !members.iter().any(|pid| lives(*pid)));
        } else {
            // What a dead renderer left is removed with the next tick.
            judge.try_tick().unwrap();
            let after = (footprint(&sim), open_files(sim.host_pid()));
            flat("faults", before.0, after.0);
            assert!(after.1 <= before.1 + 4, "open files of the host: {before:?} -> {after:?}");
            drop(judge);
        }
        recorded += check_recording(&path, reference);
        let log = sim.log();
        assert!(!log.contains("panicked"), "{log}");
        if is_soak() {
            println!("simulator {session}: {frames} frames, {total:?}");
        }
        match Arc::into_inner(sim) {
            Some(sim) if !ends_with_host => drop(sim.end()),
            Some(mut sim) => drop(sim.wait()),
            None => unreachable!("the thread of the faults has ended"),
        }
    }
    println!(
        "{sessions} simulators in {:.0} s: {frames} frames, none lost, all with the undisturbed bits, \
         {recorded} of them recorded",
        begun.elapsed().as_secs_f64()
    );
    for (index, victim) in VICTIMS.into_iter().enumerate() {
        println!("{victim:?}: killed {}, stopped {}", total.kills[index], total.stops[index]);
    }
    assert_eq!(total.kills[4], sessions - 1);
    if is_soak() {
        // Other tests open files in this process, except in the soak.
        let files = open_files(std::process::id());
        assert!(files <= own_files + 2, "open files of the client: {own_files} -> {files}");
    }
}
