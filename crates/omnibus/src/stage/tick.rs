//! `omnibus stage tick`: a whole tick with a client and every stage, but without sensors.

use anyhow::ensure;
use bus::clock;
use protocol::{Command, Name, Settings, Spawn, flag};

use crate::{BackgroundHost, collect::places, launch::WorldArgs};

/// Returns the nanoseconds of each tick, from the call to its return, and the number of vehicles. The
/// world begins with `commands`.
pub(super) fn measure(
    world: &WorldArgs,
    settings: Settings,
    commands: &[Command],
    vehicles_max: usize,
    warmup: u64,
    frames: u64,
) -> anyhow::Result<(Vec<u64>, usize)> {
    let spawns: Vec<_> = if vehicles_max == 0 {
        Vec::new()
    } else {
        let places = places(&world.network()?, world.seed());
        let roles = std::iter::once("hero").chain(std::iter::repeat(""));
        places.into_iter().take(vehicles_max).zip(roles).map(vehicle).collect()
    };
    let settings = Settings { synchronous: 1, ..settings };
    let host = BackgroundHost::start(world, settings)?;
    let mut client = host.connect("stage")?;
    if !commands.is_empty() {
        client.try_wire_request("settings", commands)?;
    }
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

fn vehicle((pose, role): (protocol::Pose, &str)) -> Command {
    Command::Spawn(Spawn {
        blueprint: Name::new(crate::collect::EGO),
        flags: flag::AUTOPILOT,
        role: Name::new(role),
        pose,
        ..Spawn::default()
    })
}
