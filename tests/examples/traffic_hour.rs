//! Traffic in closed loop with physics, without processes: distances, speeds, jams and
//! collisions.
//!
//! ```text
//! cargo run --release -p omnibus-tests --example traffic_hour -- maps/Town04.xodr --vehicles 100
//! ```
//!
//! Without a map it drives on the default one. It ends with 1 if a goal is missed:
//!
//! - *Free*, vehicles drive at 60 % of the limit. A moment is free if no actor is within 60 m
//!   ahead, no stop line within 200 m applies, and the vehicle neither reverses nor turns
//!   round. Acceleration after a stop counts, and so do vehicles that cannot go faster: bicycles,
//!   buses. The figure is the mean, over all free moments of all vehicles, of speed by limit. The
//!   goal excludes moments in which a curve or a lower limit ahead requires less than 95 % of the
//!   limit; the figure with them is printed first.
//! - Each vehicle drives 5 km per hour, including all waiting.
//! - No vehicle stays within 5 m of a place for more than 120 s, for whatever reason: a red light
//!   counts too.
//! - No vehicle is removed, teleported or overturned, none touches another actor or an object, and none passes a
//!   light that has been red for 0.2 s.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;
use omnibus_tests::closed_loop::{Cast, WIDE_PERCENT, World};
use road::Network;

#[derive(Parser)]
struct Arguments {
    /// An OpenDRIVE file, or the name of a generated town; default: the default map.
    map: Option<String>,
    #[arg(long, default_value_t = 100)]
    vehicles: usize,
    /// Pedestrians on sidewalks.
    #[arg(long, default_value_t = 0)]
    walkers: usize,
    /// Simulated time at the end, in seconds.
    #[arg(long, default_value_t = 3600)]
    seconds: u32,
    /// Writes the state every 300 simulated seconds and at the end to this file, from which another run with the same
    /// map and cast goes on.
    #[arg(long)]
    save: Option<PathBuf>,
    /// Goes on from a state; what is reported happened since.
    #[arg(long)]
    resume: Option<PathBuf>,
    /// Ends after this time of the clock, in seconds, even if less has been simulated.
    #[arg(long, default_value_t = f64::INFINITY)]
    wall_seconds: f64,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads of physics and planner; the results do not depend on them.
    #[arg(long, default_value_t = 1, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    threads: usize,
    /// Sedans only, instead of a mixture of cars, vans, trucks, buses and two-wheelers.
    #[arg(long)]
    sedans: bool,
    /// Trucks and buses in the mixture, in percent.
    #[arg(long, default_value_t = WIDE_PERCENT)]
    wide_percent: usize,
    /// Prints the plans of these vehicles, twice a second.
    #[arg(long, value_delimiter = ',')]
    watch: Vec<u32>,
    /// From when on, in simulated seconds.
    #[arg(long, default_value_t = 0)]
    watch_from: u32,
    /// Writes positions and reasons for waiting to this file, as CSV, once a second.
    #[arg(long)]
    trace: Option<PathBuf>,
    /// Writes states from before contacts and from before stays of more than 240 s to this folder, to resume from.
    #[arg(long)]
    keep: Option<PathBuf>,
}

/// Frames between two states written with `--save`.
const SAVE_EVERY: u64 = 6000;
/// Simulated time between two states in memory, in seconds.
const KEEP_EVERY_S: u64 = 20;
/// A state from this long before a contact shows how it came about.
const BEFORE_CONTACT_S: f32 = 10.0;
const LONG_STAY_S: f32 = 240.0;
/// States from before a stay began.
const BEFORE_STAY_S: f32 = LONG_STAY_S + 60.0;
/// Files of each kind.
const KEPT_MAX: usize = 3;

/// The states of the last minutes, of which those before something went wrong are written.
struct Keeper {
    folder: PathBuf,
    states: VecDeque<(f32, Vec<u8>)>,
    contacts: usize,
    stays: usize,
}

impl Keeper {
    fn new(folder: &Path) -> Keeper {
        std::fs::create_dir_all(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        Keeper { folder: folder.to_owned(), states: VecDeque::new(), contacts: 0, stays: 0 }
    }

    /// To be called once a simulated second.
    fn advance(&mut self, world: &World, second: u64) {
        let time_s = world.time_s();
        if second.is_multiple_of(KEEP_EVERY_S) {
            self.states.push_back((time_s, world.save()));
            self.states.retain(|(at_s, _)| time_s - at_s < BEFORE_STAY_S);
        }
        let contacts = world.contacts();
        if contacts > self.contacts {
            let before = self.states.iter().rfind(|(at_s, _)| time_s - at_s > BEFORE_CONTACT_S);
            self.write("contact", self.contacts, before, time_s);
            self.contacts = contacts;
        }
        let stays = world.standstills(LONG_STAY_S).len();
        if stays > self.stays {
            self.write("stay", self.stays, self.states.front(), time_s);
            self.stays = stays;
        }
    }

    fn write(&self, what: &str, before: usize, state: Option<&(f32, Vec<u8>)>, time_s: f32) {
        let Some((at_s, bytes)) = state.filter(|_| before < KEPT_MAX) else { return };
        let path = self.folder.join(format!("{what}_{time_s:.0}_from_{at_s:.0}"));
        write(&path, bytes);
    }
}

/// A file is whole at any time: it is written beside the old one first.
fn write(path: &Path, bytes: &[u8]) {
    let beside = path.with_extension("part");
    std::fs::write(&beside, bytes)
        .and_then(|()| std::fs::rename(&beside, path))
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

fn main() {
    let arguments = Arguments::parse();
    let (name, network) = network(arguments.map.as_deref());
    let Arguments { vehicles, walkers, seed, sedans, wide_percent, .. } = arguments;
    let cast = Cast { vehicles, walkers, seed, sedans, wide_percent };
    let mut world = World::new(Arc::new(network), &cast);
    world.set_threads(arguments.threads);
    let mut trace = arguments.trace.as_deref().map(begin_trace);
    let mut keeper = arguments.keep.as_deref().map(Keeper::new);
    let begin_nanos = bus::clock::now_nanos();
    if let Some(path) = &arguments.resume {
        let state = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        world.resume(&state).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    let resumed_at = (world.time_s() * 20.0).round() as u64;
    for tick in resumed_at..u64::from(arguments.seconds) * 20 {
        world.tick();
        if tick % 10 == 0 && tick >= 20 * u64::from(arguments.watch_from) {
            world.print(&arguments.watch);
        }
        if let Some(trace) = trace.as_mut().filter(|_| tick % 20 == 0) {
            world.write(trace).expect("the trace can be written");
        }
        if let Some(keeper) = keeper.as_mut().filter(|_| tick % 20 == 0) {
            keeper.advance(&world, tick / 20);
        }
        if let Some(path) =
            arguments.save.as_deref().filter(|_| tick % SAVE_EVERY == SAVE_EVERY - 1)
        {
            write(path, &world.save());
        }
        if tick % 20 == 0 && wall_s(begin_nanos) > arguments.wall_seconds {
            break;
        }
    }
    drop(trace);
    if let Some(path) = &arguments.save {
        write(path, &world.save());
    }
    if !world.report(&name, wall_s(begin_nanos)) {
        std::process::exit(1);
    }
}

fn wall_s(begin_nanos: u64) -> f64 {
    (bus::clock::now_nanos() - begin_nanos) as f64 * 1e-9
}

fn begin_trace(path: &Path) -> BufWriter<File> {
    let mut trace = BufWriter::new(File::create(path).expect("the trace can be made"));
    let head = "time_s,actor,x_m,y_m,yaw_rad,speed_mps,limit_mps,desired_speed_mps,road,lane,leader,leader_m,stop_m,merge_m,\
                leave,waited_s,waits_for,waits_on,phase";
    writeln!(trace, "{head}").expect("the trace can be written");
    trace
}

fn network(map: Option<&str>) -> (String, Network) {
    let (name, text) = match map {
        None => {
            let (name, text) = mapgen::default_map();
            (name.to_owned(), text)
        }
        Some(given) => {
            let text = mapgen::named(given).unwrap_or_else(|| {
                std::fs::read_to_string(given).unwrap_or_else(|e| panic!("{given}: {e}"))
            });
            let name = std::path::Path::new(given).file_stem().unwrap_or_default();
            (name.to_string_lossy().into_owned(), text)
        }
    };
    let network = Network::parse(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
    (name, network)
}
