//! `omnibus ros2`: a node of ROS 2 beside a running simulator.

use std::path::PathBuf;

use anyhow::Context;
use client_lib::Client;
use protocol::{ActorId, output};
use ros2::{Node, NodeOptions, Vehicle};

use crate::{collect::default_sensors, run::stop_on_signals, sensors_file::sensors_of};

/// Arguments of `omnibus ros2`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Ros2Args {
    /// The name of the simulator; default: the only one that runs
    #[arg(long)]
    name: Option<String>,
    /// The role name of the vehicle: its topics are /carla/ROLE/...
    #[arg(long, value_name = "ROLE", default_value = "ego_vehicle")]
    ego: String,
    /// Serve the vehicle with this id, which exists, instead of spawning one
    #[arg(long, value_name = "ID", conflicts_with_all = ["vehicle", "spawn_point", "autopilot"])]
    actor: Option<u32>,
    /// The blueprint of the vehicle that is spawned, and destroyed at the end
    #[arg(long, value_name = "BLUEPRINT", default_value = "vehicle.tesla.model3")]
    vehicle: String,
    /// The number of its spawn point, from 0; default: the first that is free
    #[arg(long, value_name = "NUMBER")]
    spawn_point: Option<usize>,
    /// Let traffic drive it
    #[arg(long)]
    autopilot: bool,
    /// A TOML file of cameras and lidars (docs/profiling.md); default: a camera of 800 by 600
    /// pixels and a lidar of 32 channels
    #[arg(long, value_name = "FILE")]
    sensors: Option<PathBuf>,
    /// The domain of DDS, 0 to 232; default: $ROS_DOMAIN_ID, else 0
    #[arg(long, value_name = "NUMBER")]
    domain: Option<u16>,
    /// Serve other machines too; DDS has no authentication: whoever reaches the ports drives the
    /// vehicle
    #[arg(long)]
    network: bool,
    /// Let every frame wait until it is published, so that none is missed
    #[arg(long)]
    barrier: bool,
}

/// Publishes until Ctrl-C, SIGTERM, or the end of the simulator.
pub(crate) fn ros2(args: &Ros2Args) -> anyhow::Result<()> {
    let sensors = match &args.sensors {
        Some(file) => sensors_of(file)?,
        None => {
            let mut sensors = default_sensors(800, 600);
            sensors[0].outputs = output::COLOR;
            sensors
        }
    };
    let vehicle = match args.actor {
        Some(id) => Vehicle::Existing(ActorId(id)),
        None => Vehicle::Spawned {
            blueprint: args.vehicle.clone(),
            spawn_point: args.spawn_point,
            is_on_autopilot: args.autopilot,
        },
    };
    let domain = args.domain.map_or_else(domain_of_environment, Ok)?;
    let options = NodeOptions {
        role: args.ego.clone(),
        vehicle,
        sensors,
        domain,
        is_network: args.network,
        is_in_barrier: args.barrier,
    };
    let stop = stop_on_signals()?;
    let client = Client::connect(args.name.as_deref(), "ros2")?;
    let node = Node::start(client, &options)?;
    print_line!("{} publishes in domain {domain}:", node.vehicle());
    for (topic, message) in node.topics() {
        print_line!("  {topic} [{message}]");
    }
    let published = node.run(&stop).context("the node ended")?;
    print_line!(
        "published {} frames, and of cameras and lidars {}; {} between them were not measured, or \
         passed over",
        published.frames,
        published.measurements,
        published.missed
    );
    Ok(())
}

/// Returns the domain that the tools of ROS use in this environment.
fn domain_of_environment() -> anyhow::Result<u16> {
    match std::env::var("ROS_DOMAIN_ID") {
        Err(_) => Ok(0),
        Ok(text) if text.is_empty() => Ok(0),
        Ok(text) => text.parse().with_context(|| format!("ROS_DOMAIN_ID is {text:?}, no domain")),
    }
}
