//! `rest`: the cost of an idle actor per tick.

use anyhow::Context;
use client_lib::{ActorId, Client, ClientError, Pose, Spawn};
use glam::Vec3;

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, brief, median},
    machine::Machine,
    scene,
    sim::Sim,
    tick,
};

const PROPS: usize = 500;
const ROUNDS: usize = 7;
const TICKS: usize = 4_000;
/// Ticks after a change of the world, before the first that counts.
const SETTLE: usize = 200;
/// Names of [`tick::Parts`].
const PARTS: [&str; 5] = ["request", "commands", "physics", "snapshot", "arrivals and return"];

/// Measures the figure.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim =
        Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null", "--wait", "latency"])?;
    let mut client = sim.client()?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let (mut empty, mut full) = (Times::default(), Times::default());
    for _ in 0..effort.rounds(ROUNDS) {
        empty.round(&mut client, effort.count(TICKS))?;
        let props = beside_the_road(&mut client)?;
        full.round(&mut client, effort.count(TICKS))?;
        for prop in props {
            client.destroy(prop)?;
        }
    }
    let (without, with) = (empty.spread(), full.spread());
    let spread = Spread {
        p50: with.p50 - without.p50,
        p90: with.p90 - without.p90,
        p99: with.p99 - without.p99,
        n: with.n,
    };
    let of_part = |part: usize| full.part(part) - empty.part(part);
    let parts: Vec<_> =
        PARTS.iter().enumerate().map(|(k, name)| format!("{name} {}", brief(of_part(k)))).collect();
    let workload = format!(
        "what {PROPS} static props beside the road add to a tick, {}, no sensor, 4 processes; {} \
         us with them, {} without, in turns; more of each stage: {} us",
        map.title,
        brief(with.p50),
        brief(without.p50),
        parts.join(", ")
    );
    let name = "tick.props_500";
    sink.put(
        &Figure { name, workload, unit: Unit::Micros, value: spread.p50, spread, peer: None },
        &machine,
    )
}

/// Nanoseconds of ticks by round, and of their parts.
#[derive(Default)]
struct Times {
    ticks: Vec<Vec<u64>>,
    parts: tick::Parts,
}

impl Times {
    fn round(&mut self, client: &mut Client, count: usize) -> anyhow::Result<()> {
        for _ in 0..SETTLE {
            client.tick()?;
        }
        let mut ticks = Vec::with_capacity(count);
        for _ in 0..count {
            ticks.push(tick::timed(client, &mut self.parts)?);
        }
        self.ticks.push(ticks);
        Ok(())
    }

    fn spread(&self) -> Spread {
        Spread::of_rounds(&self.ticks, 1e3)
    }

    /// Converts to microseconds.
    fn part(&self, part: usize) -> f64 {
        median(&self.parts[part].iter().map(|nanos| *nanos as f64 / 1e3).collect::<Vec<_>>())
    }
}

/// Spawns props in rows, where there is room.
fn beside_the_road(client: &mut Client) -> anyhow::Result<Vec<ActorId>> {
    let cone = client.blueprints().iter().find(|b| b.id == "static.prop.constructioncone");
    let cone = cone.context("there is no cone")?.id.clone();
    let mut props = Vec::with_capacity(PROPS);
    let places = (0..).map(|k| Vec3::new((k % 95) as f32 * 2.0, 0.5 + (k / 95) as f32, 0.0));
    for at in places.take(4 * PROPS) {
        match client.spawn(Spawn::new(&cone, Pose::level(at, 0.0)).kinematic()) {
            Ok(id) => props.push(id),
            // A house or a tree is in the way.
            Err(ClientError::Refused { .. }) => {}
            Err(e) => return Err(e.into()),
        }
        if props.len() == PROPS {
            return Ok(props);
        }
    }
    anyhow::bail!("{} of {PROPS} props find room beside the road", props.len())
}
