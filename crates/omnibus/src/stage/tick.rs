//! `omnibus stage tick`: the exchange itself, with a client and every stage, and no sensor.

use anyhow::ensure;
use bus::clock;
use protocol::{Command, Name, Settings, Spawn, flag};

use super::StageArgs;
use crate::{BackgroundHost, collect::places};

/// How long each tick took, from the call to its return, and with how many vehicles.
pub(super) fn measure(args: &StageArgs) -> anyhow::Result<(Vec<u64>, usize)> {
    let spawns: Vec<_> = if args.vehicles == 0 {
        Vec::new()
    } else {
        let places = places(&args.world.network()?, args.world.seed);
        places.into_iter().take(args.vehicles).map(vehicle).collect()
    };
    let settings = Settings { synchronous: 1, ..Settings::default() };
    let beside = BackgroundHost::start(&args.world, settings)?;
    let mut client = beside.connect("stage")?;
    let mut vehicles = 0;
    if !spawns.is_empty() {
        let outcomes = client.try_wire_request("spawn", &spawns)?;
        vehicles = outcomes.iter().filter(|entry| entry.outcome.result().is_ok()).count();
        ensure!(vehicles > 0, "no vehicle finds a place on this map");
    }
    for _ in 0..args.warmup {
        client.tick()?;
    }
    let mut nanos = Vec::with_capacity(args.frames() as usize);
    for _ in 0..args.frames() {
        let begin = clock::now_nanos();
        client.tick()?;
        nanos.push(clock::now_nanos() - begin);
    }
    drop(client);
    beside.end()?;
    Ok((nanos, vehicles))
}

fn vehicle(pose: protocol::Pose) -> Command {
    Command::Spawn(Spawn {
        blueprint: Name::new(crate::collect::EGO),
        flags: flag::AUTOPILOT,
        pose,
        ..Spawn::default()
    })
}
