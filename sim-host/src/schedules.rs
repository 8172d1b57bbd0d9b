//! The host and its participants under a seeded scheduler that kills and stops them.
//!
//! A schedule runs the host, both stages and some clients as coroutines of one thread, over the
//! `simulated-bus` crate. The host, the barrier, the slots, the journal and its keyframes, and the
//! participants' side of each are the code that programs run; the work of the stages, the clients and
//! the watcher of processes are short models of it (`stages.rs`, `clients.rs`, `processes.rs`).
//!
//! The test prints the seed of a schedule that fails. `OMNIBUS_SCHEDULE=<seed>` runs that schedule
//! alone and prints every access to the control page and every message; `OMNIBUS_SOAK=1` runs a
//! million schedules.

use std::{
    cell::{Cell, RefCell},
    collections::BTreeMap,
    rc::Rc,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use bake::Cache;
use bus::{Instance, Role, SLOTS, SlotState, channel, scheduler};
use protocol::{Episode, PIPELINE_MAX};

use crate::{HostConfig, Maps, host::Host, supervisor::Processes, world::World};
use plan::Plan;
use processes::SimulatedProcesses;
use truth::Truth;

mod clients;
mod plan;
mod processes;
mod stages;
mod truth;

/// What the processes of a schedule share with the test, beside the bus.
struct Shared {
    plan: Plan,
    truth: RefCell<Truth>,
    /// Process ids of the stages, by slot.
    stages: RefCell<[u32; 2]>,
    /// Deaths that are still to be caused.
    kills_left: Cell<u64>,
    /// Clients that join and leave after each other.
    visitors_left: Cell<u64>,
    /// No more faults are caused, and clients are to leave.
    is_ending: Cell<bool>,
    /// Whether a process may have slept although there was something to do.
    may_idle: Cell<bool>,
    stop: Arc<AtomicBool>,
}

struct NoMaps;

impl Maps for NoMaps {
    fn find(&self, _name: &str) -> Result<(String, String), String> {
        Err("there is no other map".into())
    }

    fn names(&self) -> Vec<String> {
        Vec::new()
    }
}

thread_local! {
    static WORLD: World = plain();
}

/// A world of one floor without objects.
fn plain() -> World {
    let mut town = town::Town::default();
    let corner = |x: f32, y: f32| [x * 500.0, y * 500.0, 0.0];
    let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
    town.mesh
        .quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], face);
    World::new(&town, 1)
}

/// Runs one schedule.
fn run(seed: u64, is_traced: bool) -> Result<scheduler::Report, String> {
    let plan = Plan::new(seed);
    if is_traced {
        println!("{plan:#?}");
    }
    let shared = Rc::new(Shared {
        truth: RefCell::new(Truth::new(plan.settings)),
        stages: RefCell::default(),
        kills_left: Cell::new(plan.kills),
        visitors_left: Cell::new(0),
        is_ending: Cell::new(false),
        may_idle: Cell::new(plan.may_idle()),
        stop: Arc::new(AtomicBool::new(false)),
        plan,
    });
    scheduler::run(seed, is_traced, move || run_host(&shared))
}

fn run_host(shared: &Rc<Shared>) {
    let plan = &shared.plan;
    let config = HostConfig {
        name: None,
        episode: Episode { map: "plain".into(), open_drive: String::new(), seed: 1 },
        maps: Arc::new(NoMaps),
        settings: plan.settings,
        hidden_layers: 0,
        strategy: plan.strategy,
        deadline_nanos: plan.deadline_nanos,
        restart: true,
        on_stall: plan.on_stall,
        stages: vec![Role::Traffic, Role::Render],
        stop: Arc::clone(&shared.stop),
    };
    let owned_instance = Instance::create(None).unwrap();
    let node = owned_instance.node(false).unwrap();
    let processes = |reports| -> std::io::Result<Box<dyn Processes>> {
        Ok(Box::new(SimulatedProcesses::new(reports, Rc::clone(shared))))
    };
    let world = || {
        shared.truth.borrow_mut().observe();
        Ok(WORLD.with(World::at_start))
    };
    let cache = Cache::from_environment();
    let mut host = Host::create(config, owned_instance, node, &cache, processes, world).unwrap();
    clients::start(shared);
    host.serve().unwrap();
    check_end(&host, &mut shared.truth.borrow_mut(), plan.may_be_late());
}

/// What holds when no client is left and both stages have done the last frame.
fn check_end(host: &Host, truth: &mut Truth, may_be_late: bool) {
    truth.update();
    let shell = &host.shell;
    let frame = host.frame();
    assert_eq!(frame.0 + 1, truth.frames() as u64, "frames were published more than once");
    assert_eq!(shell.control.complete.get(), frame.0, "the last frame is not complete");
    assert!(shell.journal.is_sent(), "a stage was not sent the whole journal");
    assert_eq!(shell.barrier.slots().collect::<Vec<_>>(), [0, 1], "members of the barrier");
    assert_eq!(shell.control.alive(), 0b11, "slots that the barrier waits for");
    let recent = shell.keyframes.recent_len();
    let is_bounded = recent <= PIPELINE_MAX as usize + 1;
    assert!(is_bounded || may_be_late, "{recent} frames are kept for a keyframe");
    for slot in 0..SLOTS {
        let state = shell.control.slot(slot).state();
        let expected = if slot < 2 { SlotState::Live } else { SlotState::Free };
        assert_eq!(state, expected, "slot {slot}");
    }
    assert_eq!(shell.control.ticker(), None, "the tick was not released");
    truth.check_standing(host.sim.standing());
    for (name, writers, readers) in
        [("journal", 1, 2), ("snapshot", 1, 2), ("traffic", 1, 1), ("command", 0, 1)]
    {
        assert_eq!(bus::ends(name), (writers, readers), "ends of channel {}", channel(name).name);
    }
}

/// Failed schedules after which no more are run.
const FAILURES_MAX: usize = 20;

/// Runs the schedules of some seeds on as many threads as there are cores. Returns those that failed
/// and why, by seed.
fn run_all(seeds: std::ops::Range<u64>) -> BTreeMap<u64, String> {
    let next = AtomicU64::new(seeds.start);
    let failed = Mutex::new(BTreeMap::new());
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end || failed.lock().unwrap().len() >= FAILURES_MAX {
                return;
            }
            if let Err(why) = run(seed, false) {
                failed.lock().unwrap().insert(seed, why);
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            std::thread::Builder::new().name("schedules".into()).spawn_scoped(scope, work).unwrap();
        }
    });
    failed.into_inner().unwrap()
}

#[test]
fn no_schedule_loses_a_frame_or_a_journal_entry() {
    if let Ok(seed) = std::env::var("OMNIBUS_SCHEDULE") {
        let seed = seed.parse().expect("OMNIBUS_SCHEDULE is a number");
        println!("{:?}", run(seed, true).unwrap());
        return;
    }
    let is_soak = std::env::var_os("OMNIBUS_SOAK").is_some();
    let failed = run_all(0..if is_soak { 1_000_000 } else { 2_000 });
    let lines: Vec<_> =
        failed.iter().map(|(seed, why)| format!("schedule {seed}: {why}")).collect();
    assert!(
        failed.is_empty(),
        "OMNIBUS_SCHEDULE=<number> prints the steps of one of these:\n{}",
        lines.join("\n")
    );
}

#[test]
fn a_seed_gives_the_same_schedule() {
    for seed in 0..20 {
        assert_eq!(run(seed, false), run(seed, false), "{seed}");
    }
}
