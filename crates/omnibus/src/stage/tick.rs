//! `omnibus stage tick`: a whole tick with a client and every stage, but without sensors.

use anyhow::ensure;
use bus::clock;
use protocol::{Command, Name, Settings, Spawn, flag};

use crate::{BackgroundHost, collect::places, launch::WorldArgs};

/// Returns the nanoseconds of each tick, from the call to its return, and the number of vehicles.
pub(super) fn measure(
    world: &WorldArgs,
    vehicles_max: usize,
    warmup: u64,
    frames: u64,
) -> anyhow::Result<(Vec<u64>, usize)> {
    let spawns: Vec<_> = if vehicles_max == 0 {
        Vec::new()
    } else {
        let places = places(&world.network()?, world.seed());
        places.into_iter().take(vehicles_max).map(vehicle).collect()
    };
    let settings = Settings { synchronous: 1, ..Settings::default() };
    let host = BackgroundHost::start(world, settings)?;
    let mut client = host.connect("stage")?;
    let mut vehicles = 0;
    if !spawns.is_empty() {
        let outcomes = client.try_wire_request("spawn", &spawns)?;
        vehicles = outcomes.iter().filter(|entry| entry.outcome.result().is_ok()).count();
        ensure!(vehicles > 0, "no vehicle finds a place on this map");
    }
    for _ in 0..warmup {
        client.tick()?;
    }
    let mut nanos = Vec::with_capacity(frames as usize);
    for _ in 0..frames {
        let begin = clock::now_nanos();
        client.tick()?;
        nanos.push(clock::now_nanos() - begin);
    }
    drop(client);
    host.end()?;
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
