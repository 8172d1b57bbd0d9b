//! `omnibus inspect`: what a data set, a map or a running simulator is.

use std::path::{Path, PathBuf};

use bus::{Instance, SLOTS, SlotState};

use crate::{collect, launch::WorldArgs};

/// What `omnibus inspect` takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct InspectArgs {
    /// A data set's folder, an OpenDRIVE file, or a map's name; none: the simulators that run
    what: Option<PathBuf>,
}

/// Says what it is, and checks it.
pub(crate) fn inspect(args: &InspectArgs) -> anyhow::Result<()> {
    match &args.what {
        None => running(),
        Some(dir) if dir.is_dir() => {
            say!("{}", collect::inspect(dir)?);
            Ok(())
        }
        Some(map) => look_at_map(map),
    }
}

fn running() -> anyhow::Result<()> {
    let instances = Instance::running();
    if instances.is_empty() {
        say!("no simulator runs");
    }
    for instance in instances {
        let control = instance.control()?;
        let map = instance.episode()?.map;
        let mode = if control.is_synchronous() { "synchronous" } else { "asynchronous" };
        say!("{} on {map}, {mode}, at frame {}", instance.id(), control.complete.get());
        for index in 0..SLOTS {
            let slot = control.slot(index);
            if slot.state() != SlotState::Free {
                let role = slot.role().map_or("?", |role| role.name());
                let ticks = if control.ticker() == Some(index) { ", holds the tick" } else { "" };
                say!(
                    "  {role:<8} {:<24} process {:>7}, {:?}, frame {}{ticks}",
                    slot.name().as_str(),
                    slot.pid(),
                    slot.state(),
                    slot.ack().0,
                );
            }
        }
    }
    Ok(())
}

fn look_at_map(map: &Path) -> anyhow::Result<()> {
    let world = WorldArgs::of_map(&map.to_string_lossy());
    let episode = world.episode()?;
    let network = world.network()?;
    let town = town::furnish(&network, episode.seed);
    let (low, high) = network.bounds();
    let size = high - low;
    say!("{}: {:.0} m by {:.0} m", episode.map, size.x, size.y);
    say!(
        "{} roads, {} lanes, {} junctions, {} signals, {} spawn points",
        network.roads().len(),
        network.lanes().len(),
        network.junctions().len(),
        network.signals().len(),
        network.spawn_points().len(),
    );
    say!("furnished: {} triangles, {} objects", town.mesh.triangles.len(), town.objects.len());
    Ok(())
}
