//! `latency`: from the publication of a snapshot until the agent's control takes effect, for agents in
//! Rust, C, Python and with the official `carla` package; then how long the last two take to read a
//! large image and a thousand poses.

use std::time::Duration;

use anyhow::{Context, ensure};
use client_lib::{ActorId, Client, Frame, Pose, Spawn};
use glam::Vec3;

use crate::{
    Effort,
    agent::{Agent, Language},
    carla::{free_port, take_tick},
    figure::{Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
    scene,
    sim::Sim,
};

const ROUNDS: usize = 9;
const TICKS: usize = 2_000;
/// Ticks in which much is read, which takes longer.
const LONG_TICKS: usize = 200;
/// Ticks in a row: the stage clock keeps 64 frames.
const BURST: usize = 60;
/// The first ticks of a burst do not count: the processes were asleep.
const WARM_UP: usize = 12;
const EGO: &str = "vehicle.tesla.model3";
const VEHICLES: usize = 1_000;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let (map, folder) = (scene::one_road()?, scene::Scratch::new()?);
    let mut programs = Vec::new();
    for language in Language::ALL {
        match language.program(folder.path())? {
            Ok(program) => programs.push((language, program)),
            Err(why) => sink.skip(names(language)[0], &why),
        }
    }
    let port = free_port()?.to_string();
    let args = ["--synchronous", "--map", &map.arg, "--device", "null", "--wait", "latency"];
    let sim = Sim::start(&[&args[..], &["--carla-port", &port]].concat())?;
    let mut client = sim.client()?;
    client.synchronise(Duration::from_nanos(scene::DELTA_NANOS))?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new(EGO, place))?;
    client.tick()?;
    let mut world = World { sim, client, port, car, effort };
    let mut put = |name, workload: String, spread: Spread, peer| {
        let (unit, value) = (Unit::Micros, spread.p50);
        sink.put(&Figure { name, workload, unit, value, spread, peer }, &machine)
    };

    let scene = format!(
        "the agent ticks; {} with one car, null tracer, strict, --wait latency, with a CARLA server; \
         the agents in turn",
        map.title
    );
    let measured = world.in_turn("loop", TICKS, &programs)?;
    let rust = measured[0].1.clone();
    for (language, rounds) in measured {
        let [applied, read] = names(language);
        let beside = |of: fn(&Turn) -> u64| {
            let value = spread(&rust, of).p50;
            (language != Language::Rust).then_some(Peer { name: "the agent in Rust", value })
        };
        let what = "from the publication of snapshot N until the agent has read it";
        put(read, format!("{what}; {scene}"), spread(&rounds, Turn::read), beside(Turn::read))?;
        let what = "from the publication of snapshot N until the host has applied the agent's \
                    control, which N+1 shows";
        let peer = beside(Turn::applied);
        put(applied, format!("{what}; {scene}"), spread(&rounds, Turn::applied), peer)?;
    }

    programs.retain(|(language, _)| matches!(language, Language::Python | Language::Carla));
    if programs.first().is_none_or(|(language, _)| *language != Language::Python) {
        return Ok(());
    }
    for (job, name, what, of) in [
        (
            "image",
            "latency.python_image",
            "from the publication of a snapshot until the ticking agent reads the first byte of its \
             1920x1080 image; one car; nothing is traced"
                .to_owned(),
            Turn::read as fn(&Turn) -> u64,
        ),
        (
            "poses",
            "latency.python_poses",
            format!("after a tick, the poses of {VEHICLES} vehicles: arrays; in carla a list"),
            |turn| turn.printed_nanos,
        ),
    ] {
        if job == "poses" {
            world.fill()?;
        }
        let measured = world.in_turn(job, LONG_TICKS, &programs)?;
        let of = |wanted| {
            let found = measured.iter().find(|(language, _)| *language == wanted);
            found.map(|(_, rounds)| spread(rounds, of))
        };
        let carla = of(Language::Carla).map(|carla| Peer { name: "carla", value: carla.p50 });
        if let Some(python) = of(Language::Python) {
            put(name, what, python, carla)?;
        }
    }
    Ok(())
}

/// The names of an agent's figures: until its control is applied, and until it has read.
fn names(language: Language) -> [&'static str; 2] {
    match language {
        Language::Rust => ["latency.rust_agent", "latency.rust_agent.read"],
        Language::C => ["latency.c_agent", "latency.c_agent.read"],
        Language::Python => ["latency.python_agent", "latency.python_agent.read"],
        Language::Carla => ["latency.carla_agent", "latency.carla_agent.read"],
    }
}

/// A tick of an agent, which answers frame N and gets frame N+1.
#[derive(Clone)]
struct Turn {
    /// When N was published.
    answered_nanos: u64,
    /// When the controls of N+1 were applied.
    applied_nanos: u64,
    /// When N+1 was published.
    published_nanos: u64,
    /// What the agent printed of N+1.
    printed_nanos: u64,
}

impl Turn {
    fn read(&self) -> u64 {
        self.printed_nanos.saturating_sub(self.published_nanos)
    }

    fn applied(&self) -> u64 {
        self.applied_nanos.saturating_sub(self.answered_nanos)
    }
}

/// The turns of an agent, by round.
type Rounds = Vec<Vec<Turn>>;

fn spread(rounds: &Rounds, of: fn(&Turn) -> u64) -> Spread {
    let rounds: Vec<Vec<u64>> = rounds.iter().map(|round| round.iter().map(of).collect()).collect();
    Spread::of_rounds(&rounds, 1e3)
}

/// The simulator in which agents take turns.
struct World {
    sim: Sim,
    client: Client,
    port: String,
    car: ActorId,
    effort: Effort,
}

impl World {
    /// Measures each agent in each round.
    fn in_turn(
        &mut self,
        job: &str,
        ticks: usize,
        programs: &[(Language, Vec<String>)],
    ) -> anyhow::Result<Vec<(Language, Rounds)>> {
        let mut all: Vec<_> = programs.iter().map(|(language, _)| (*language, vec![])).collect();
        for _ in 0..self.effort.rounds(ROUNDS) {
            for ((language, program), (_, rounds)) in programs.iter().zip(&mut all) {
                let round = self.round(job, self.effort.count(ticks), *language, program);
                rounds.push(round.with_context(|| format!("the agent {language:?}, {job}"))?);
            }
        }
        Ok(all)
    }

    fn round(
        &mut self,
        job: &str,
        ticks: usize,
        language: Language,
        program: &[String],
    ) -> anyhow::Result<Vec<Turn>> {
        // The one before has left it.
        take_tick(&mut self.client)?;
        self.client.leave_tick();
        let at = if language == Language::Carla { &self.port } else { self.sim.name() };
        let mut agent = Agent::start(program, at, self.car)?;
        agent.run(job, BURST)?;
        let mut turns = Vec::new();
        while turns.len() < ticks {
            let printed = agent.run(job, BURST)?;
            for pair in printed[WARM_UP - 1..].windows(2) {
                turns.push(self.turn(pair[0].0, pair[1])?);
            }
        }
        Ok(turns)
    }

    fn turn(&self, answered: Frame, (frame, printed_nanos): (Frame, u64)) -> anyhow::Result<Turn> {
        ensure!(frame.0 == answered.0 + 1, "frame {frame} came after frame {answered}");
        let (before, now) = (self.client.stage_clock(answered), self.client.stage_clock(frame));
        let missing = || format!("the stage clock does not have frames {answered} and {frame}");
        Ok(Turn {
            answered_nanos: before.published_nanos.with_context(missing)?,
            applied_nanos: now.physics_begun_nanos.with_context(missing)?,
            published_nanos: now.published_nanos.with_context(missing)?,
            printed_nanos,
        })
    }

    /// Adds vehicles, above each other, which do not move.
    fn fill(&mut self) -> anyhow::Result<()> {
        take_tick(&mut self.client)?;
        let places = self.client.spawn_points()?;
        for index in 1..VEHICLES {
            let (place, level) = (places[index % places.len()], 1 + index / places.len());
            let position_m = (place.position() + Vec3::Z * 5.0 * level as f32).to_array();
            self.client.spawn(Spawn::new(EGO, Pose { position_m, ..place }).kinematic())?;
        }
        self.client.tick()?;
        Ok(())
    }
}
